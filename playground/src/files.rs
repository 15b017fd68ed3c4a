//! Where scenes and what they import are read from, and how they are written.

pub mod disk;

pub use disk::Disk;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Where files are. Tests have one in memory, a browser would have one of its own.
pub trait Files: Send + Sync {
    /// The bytes of a file, or why there are none, in a few words.
    fn read(&self, path: &Path) -> Result<Vec<u8>, String>;

    /// Puts `text` in the place of a file that still holds `before`.
    fn replace(&self, path: &Path, before: &str, text: &str) -> Result<(), String>;

    /// Writes a file, new or not.
    fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), String>;
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
