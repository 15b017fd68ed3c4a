//! Where scenes and what they import are read from, and how they are written.

use std::collections::BTreeSet;
use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// The most bytes that are read of a file.
const LARGEST: usize = sdfc_vm::file::MAX_BYTES;

/// Where files are. Tests have one in memory, a browser would have one of its own.
pub trait Files: Send + Sync {
    /// The bytes of a file, or why there are none, in a few words.
    fn read(&self, path: &Path) -> Result<Vec<u8>, String>;

    /// Puts `text` in the place of a file that still holds `before`.
    fn replace(&self, path: &Path, before: &str, text: &str) -> Result<(), String>;

    /// Writes a file, new or not.
    fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), String>;
}

/// The file system.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disk;

impl Files for Disk {
    fn read(&self, path: &Path) -> Result<Vec<u8>, String> {
        let file = fs::File::open(path).map_err(reason)?;
        if file.metadata().map_err(reason)?.is_dir() {
            return Err("it is a folder".to_owned());
        }
        let mut bytes = Vec::new();
        file.take(LARGEST as u64 + 1)
            .read_to_end(&mut bytes)
            .map_err(reason)?;
        if bytes.len() > LARGEST {
            return Err(format!(
                "it is larger than the {LARGEST} bytes that are read"
            ));
        }
        Ok(bytes)
    }

    fn replace(&self, path: &Path, before: &str, text: &str) -> Result<(), String> {
        if self.read(path)? != before.as_bytes() {
            return Err("it has changed meanwhile, and was left as it is".to_owned());
        }
        self.write(path, text.as_bytes())
    }

    fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), String> {
        // A link stays one: what it leads to is replaced.
        let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        // All of it or nothing: whoever reads meanwhile sees the old file.
        let mut new = tempfile::NamedTempFile::new_in(folder).map_err(reason)?;
        new.write_all(bytes).map_err(reason)?;
        let permissions = match fs::metadata(&path) {
            Ok(old) => old.permissions(),
            Err(_) => shared(new.as_file()).map_err(reason)?,
        };
        new.as_file().set_permissions(permissions).map_err(reason)?;
        new.persist(&path).map_err(|failed| reason(failed.error))?;
        Ok(())
    }
}

/// The permissions of a new file that others may read, as far as this user's files may.
#[cfg(unix)]
fn shared(file: &fs::File) -> io::Result<fs::Permissions> {
    use std::os::unix::fs::PermissionsExt;
    file.metadata()?;
    Ok(fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn shared(file: &fs::File) -> io::Result<fs::Permissions> {
    Ok(file.metadata()?.permissions())
}

/// Why something failed, without the number of the error.
fn reason(error: io::Error) -> String {
    let text = error.to_string();
    match text.split_once(" (os error") {
        Some((text, _)) => text.to_lowercase(),
        None => text,
    }
}

/// The folder of a scene, which its imports may not leave; it notes all that is asked for, so that it
/// can be watched.
pub struct Folder<'f> {
    files: &'f dyn Files,
    folder: PathBuf,
    asked: Mutex<BTreeSet<PathBuf>>,
}

impl<'f> Folder<'f> {
    /// The folder that a scene's file lies in.
    pub fn of(files: &'f dyn Files, scene: &Path) -> Self {
        Self {
            files,
            folder: scene.parent().unwrap_or(Path::new("")).to_owned(),
            asked: Mutex::default(),
        }
    }

    /// The files that were asked for, whether there were any or not.
    pub fn asked(self) -> BTreeSet<PathBuf> {
        self.asked
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

impl sdfc_compiler::elaborate::Loader for Folder<'_> {
    fn load(&self, path: &str) -> Result<String, String> {
        let file = self.folder.join(path);
        let mut asked = self.asked.lock().unwrap_or_else(PoisonError::into_inner);
        asked.insert(file.clone());
        drop(asked);
        // Links are followed before it is looked where they lead.
        let here = self.folder.as_os_str().is_empty();
        let folder = if here { Path::new(".") } else { &self.folder };
        if let (Ok(folder), Ok(real)) = (folder.canonicalize(), file.canonicalize())
            && !real.starts_with(&folder)
        {
            return Err("it lies outside the folder of the scene".to_owned());
        }
        String::from_utf8(self.files.read(&file)?).map_err(|_| "it is not UTF-8 text".to_owned())
    }
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
    }
}
