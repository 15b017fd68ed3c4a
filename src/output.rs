//! Where results go: standard output, or a file that is there as a whole or not at all.

use crate::failure::Failure;
use std::fs::{File, Permissions};
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::path::{Path, PathBuf};

/// Writes to standard output. A reader that has gone away is [`Failure::Closed`].
pub(crate) fn print(bytes: impl AsRef<[u8]>) -> Result<(), Failure> {
    let mut stdout = io::stdout().lock();
    let written = stdout
        .write_all(bytes.as_ref())
        .and_then(|()| stdout.flush());
    written.map_err(|error| match error.kind() {
        ErrorKind::BrokenPipe => Failure::Closed,
        _ => Failure::unwritable(Path::new("standard output"), &error),
    })
}

/// Prints data as JSON, for scripts.
pub(crate) fn print_json(value: &impl serde::Serialize) -> Result<(), Failure> {
    let mut text = serde_json::to_string_pretty(value)
        .map_err(|error| Failure::Input(format!("the result is no JSON: {error}")))?;
    text.push('\n');
    print(text)
}

/// Writes to a file, or to standard output if there is none (or it is `-`). Bytes that are not text
/// are not written to a terminal.
pub(crate) fn deliver(to: Option<&Path>, bytes: &[u8], is_text: bool) -> Result<(), Failure> {
    match to {
        Some(path) if path != Path::new("-") => write(path, bytes),
        _ if !is_text && io::stdout().is_terminal() => Err(Failure::Input(
            "this is not text: give a file with `-o FILE`, or send it into a pipe".to_owned(),
        )),
        _ => print(bytes),
    }
}

/// Where a file would be written.
enum Place {
    /// It is there and no plain file, a pipe or a device: it is written to as it is.
    Device,
    /// A file of this path in this folder.
    File { target: PathBuf, folder: PathBuf },
}

/// Whether a file could be written, as far as that can be known before it is; for work that takes
/// long and should not be for nothing.
pub(crate) fn check(path: &Path) -> Result<(), Failure> {
    if path != Path::new("-") {
        place(path)?;
    }
    Ok(())
}

fn place(path: &Path) -> Result<Place, Failure> {
    let failed = |error: io::Error| Failure::unwritable(path, &error);
    let target = match std::fs::metadata(path) {
        Ok(there) if there.is_dir() => {
            return Err(failed(io::Error::other("it is a folder")));
        }
        Ok(there) if !there.is_file() => return Ok(Place::Device),
        // A link stays a link: what it points to is replaced.
        Ok(_) => path.canonicalize().map_err(failed)?,
        Err(_) => path.to_owned(),
    };
    let folder = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    };
    if !folder.is_dir() {
        let problem = format!("there is no folder {}", folder.display());
        return Err(failed(io::Error::other(problem)));
    }
    Ok(Place::File { target, folder })
}

/// Writes a file under a temporary name in its folder and moves it into place, so that nobody sees
/// half of it.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let failed = |error: io::Error| Failure::unwritable(path, &error);
    let Place::File { target, folder } = place(path)? else {
        let mut device = File::options().write(true).open(path).map_err(failed)?;
        return device.write_all(bytes).map_err(failed);
    };
    let mut temporary = new_file(&target).tempfile_in(&folder).map_err(failed)?;
    temporary.write_all(bytes).map_err(failed)?;
    temporary
        .persist(&target)
        .map_err(|error| failed(error.error))?;
    Ok(())
}

/// A temporary file that will have the permissions of the file that it replaces, or those of any
/// new file.
fn new_file(target: &Path) -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".sdfc-");
    let there = std::fs::metadata(target)
        .ok()
        .map(|there| there.permissions());
    if let Some(permissions) = there.or_else(any_new_file) {
        builder.permissions(permissions);
    }
    builder
}

#[cfg(unix)]
fn any_new_file() -> Option<Permissions> {
    use std::os::unix::fs::PermissionsExt;
    // What the system's mask leaves of it.
    Some(Permissions::from_mode(0o666))
}

#[cfg(not(unix))]
fn any_new_file() -> Option<Permissions> {
    None
}
