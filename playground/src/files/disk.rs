//! The file system: files that are read as a whole, and that are there as a whole or not at all.

use super::Files;
use std::fs::{self, File, Permissions};
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

/// The most bytes that are read of any file. What a scene's text may have is less; the compiler
/// says so.
const LARGEST: usize = sdfc_vm::file::MAX_BYTES;

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

/// The system's reason in the style of our messages: lower case, without its number.
pub fn reason(error: &io::Error) -> String {
    let text = error.to_string();
    let text = text.split(" (os error").next().unwrap_or(&text);
    let mut chars = text.chars();
    match chars.next() {
        Some(first) => first.to_lowercase().chain(chars).collect(),
        None => "for an unknown reason".to_owned(),
    }
}

/// The bytes of a file.
///
/// # Errors
///
/// Those of the system; [`ErrorKind::FileTooLarge`] as [`whole`].
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    if file.metadata()?.is_dir() {
        return Err(a_folder());
    }
    whole(file)
}

/// All of what can be read; an endless file is noticed too.
///
/// # Errors
///
/// Those of the system; [`ErrorKind::FileTooLarge`] where there is more than any scene needs.
pub fn whole(from: impl Read) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    from.take(LARGEST as u64 + 1).read_to_end(&mut bytes)?;
    if bytes.len() > LARGEST {
        let problem = format!("it is larger than the {LARGEST} bytes that are read");
        return Err(io::Error::new(ErrorKind::FileTooLarge, problem));
    }
    Ok(bytes)
}

/// Where a file would be written.
enum Place {
    /// It is there and no plain file, a pipe or a device: it is written to as it is.
    Device,
    /// A file of this path in this folder.
    File { target: PathBuf, folder: PathBuf },
}

fn place(path: &Path) -> io::Result<Place> {
    let target = match fs::metadata(path) {
        Ok(there) if there.is_dir() => return Err(a_folder()),
        Ok(there) if !there.is_file() => return Ok(Place::Device),
        // A link stays a link: what it points to is replaced.
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
    Ok(Place::File { target, folder })
}

fn a_folder() -> io::Error {
    io::Error::other("it is a folder")
}

/// Whether a file could be written, as far as that can be known before it is; for work that takes
/// long and should not be for nothing.
///
/// # Errors
///
/// Those that [`write()`] would have.
pub fn check(path: &Path) -> io::Result<()> {
    place(path).map(|_| ())
}

/// Writes a file under a temporary name in its folder and moves it into place, so that nobody sees
/// half of it. It keeps the permissions of the file that it replaces; a new one has those of any new
/// file.
///
/// # Errors
///
/// Those of the system.
pub fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let Place::File { target, folder } = place(path)? else {
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
    let there = fs::metadata(target).ok().map(|there| there.permissions());
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
    fn what_cannot_be_read_says_why() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(Disk.read(folder.path()).unwrap_err(), "it is a folder");
        let missing = Disk.read(&folder.path().join("none")).unwrap_err();
        assert_eq!(missing, "no such file or directory");
        let endless = whole(io::repeat(0)).unwrap_err();
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
