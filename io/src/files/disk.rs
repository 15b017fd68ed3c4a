//! The file system. Files are read and written atomically as a whole.

use super::Files;
use std::fs::{self, File, Permissions};
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

/// Maximum size in bytes of a file that is read. The compiler enforces the smaller limit of scene texts.
const MAX_FILE_BYTES: usize = sdfc_vm::file::MAX_BYTES;

/// The file system.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disk;

impl Files for Disk {
    fn read(&self, path: &Path) -> Result<Vec<u8>, String> {
        read(path).map_err(|error| reason(&error))
    }

    fn replace(&self, path: &Path, before: &str, text: &str) -> Result<(), String> {
        if self.read(path)? != before.as_bytes() {
            return Err("it has changed meanwhile, and was left as it is".to_owned());
        }
        self.write(path, text.as_bytes())
    }

    fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), String> {
        write(path, bytes).map_err(|error| reason(&error))
    }
}

/// Formats a system error in the style of our messages: lower case, without its number.
pub fn reason(error: &io::Error) -> String {
    let text = error.to_string();
    let text = text.split(" (os error").next().unwrap_or(&text);
    let mut chars = text.chars();
    match chars.next() {
        Some(first) => first.to_lowercase().chain(chars).collect(),
        None => "for an unknown reason".to_owned(),
    }
}

/// Reads a regular file. Pipes and devices could block or never end.
///
/// # Errors
///
/// Errors of the system; [`ErrorKind::FileTooLarge`] as in [`read_all`].
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    // Opening a pipe without a writer would block.
    let kind = fs::metadata(path)?.file_type();
    if kind.is_dir() {
        return Err(is_folder_error());
    }
    if !kind.is_file() {
        return Err(io::Error::other(
            "it is a pipe or a device, and only regular files are read (`-` is standard input)",
        ));
    }
    read_all(File::open(path)?)
}

/// Reads a stream to its end; endless streams are rejected.
///
/// # Errors
///
/// Errors of the system; [`ErrorKind::FileTooLarge`] for streams longer than `MAX_FILE_BYTES`.
pub fn read_all(from: impl Read) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    from.take(MAX_FILE_BYTES as u64 + 1)
        .read_to_end(&mut bytes)?;
    if bytes.len() > MAX_FILE_BYTES {
        let problem = format!("it is larger than the {MAX_FILE_BYTES} bytes that are read");
        return Err(io::Error::new(ErrorKind::FileTooLarge, problem));
    }
    Ok(bytes)
}

/// Target of a write.
enum WriteTarget {
    /// An existing pipe or device, which is written to directly.
    Device,
    /// A regular file with this path and folder.
    File { target: PathBuf, folder: PathBuf },
}

fn write_target(path: &Path) -> io::Result<WriteTarget> {
    let target = match fs::metadata(path) {
        Ok(metadata) if metadata.is_dir() => return Err(is_folder_error()),
        Ok(metadata) if !metadata.is_file() => return Ok(WriteTarget::Device),
        // A link is kept; its target is replaced.
        Ok(_) => path.canonicalize()?,
        Err(_) => path.to_owned(),
    };
    let folder = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    };
    if !folder.is_dir() {
        let problem = format!("there is no folder {}", folder.display());
        return Err(io::Error::other(problem));
    }
    Ok(WriteTarget::File { target, folder })
}

fn is_folder_error() -> io::Error {
    io::Error::other("it is a folder")
}

/// Checks whether a file can be written, as far as that is known in advance. Long computations call it
/// before they start.
///
/// # Errors
///
/// The errors that [`write()`] would return.
pub fn check(path: &Path) -> io::Result<()> {
    write_target(path).map(|_| ())
}

/// Writes a temporary file in the same folder and moves it into place, so that no partial file is ever
/// visible. The permissions of a replaced file are kept. A new file gets the default permissions.
///
/// # Errors
///
/// Errors of the system.
pub fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let WriteTarget::File { target, folder } = write_target(path)? else {
        return File::options().write(true).open(path)?.write_all(bytes);
    };
    let mut temporary = new_file(&target).tempfile_in(&folder)?;
    temporary.write_all(bytes)?;
    temporary.persist(&target).map_err(|failed| failed.error)?;
    Ok(())
}

fn new_file(target: &Path) -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".sdfc-");
    let metadata = fs::metadata(target)
        .ok()
        .map(|metadata| metadata.permissions());
    if let Some(permissions) = metadata.or_else(default_permissions) {
        builder.permissions(permissions);
    }
    builder
}

#[cfg(unix)]
fn default_permissions() -> Option<Permissions> {
    use std::os::unix::fs::PermissionsExt;
    // The umask removes bits from it.
    Some(Permissions::from_mode(0o666))
}

#[cfg(not(unix))]
fn default_permissions() -> Option<Permissions> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_changed_meanwhile_is_left_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.sdf");
        Disk.write(&path, b"one").unwrap();
        Disk.replace(&path, "one", "two").unwrap();
        assert_eq!(Disk.read(&path).unwrap(), b"two");
        let refused = Disk.replace(&path, "one", "three").unwrap_err();
        assert!(refused.contains("changed meanwhile"), "{refused}");
        assert_eq!(Disk.read(&path).unwrap(), b"two");
        let files = fs::read_dir(folder.path()).unwrap().count();
        assert_eq!(files, 1, "nothing is left behind");
    }

    #[test]
    fn unreadable_files_are_reported_with_the_reason() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(Disk.read(folder.path()).unwrap_err(), "it is a folder");
        let missing = Disk.read(&folder.path().join("none")).unwrap_err();
        assert_eq!(missing, "no such file or directory");
        let endless = read_all(io::repeat(0)).unwrap_err();
        assert_eq!(endless.kind(), ErrorKind::FileTooLarge);
    }

    #[cfg(unix)]
    #[test]
    fn a_file_has_the_permissions_that_any_other_would_have() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let [ours, plain] = ["ours", "plain"].map(|name| folder.path().join(name));
        write(&ours, b"").unwrap();
        fs::write(&plain, b"").unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
        fs::set_permissions(&ours, Permissions::from_mode(0o640)).unwrap();
        write(&ours, b"more").unwrap();
        assert_eq!(mode(&ours) & 0o777, 0o640, "those of before");
    }
}
