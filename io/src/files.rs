//! Access to files: scenes and their imports are read through [`Files`] and written through it.

pub mod disk;

pub use disk::Disk;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// File storage. Tests use one in memory; a browser would need its own.
pub trait Files: Send + Sync {
    /// Reads a file. The error is a short reason.
    fn read(&self, path: &Path) -> Result<Vec<u8>, String>;

    /// Replaces the text of a file that still contains `before`.
    fn replace(&self, path: &Path, before: &str, text: &str) -> Result<(), String>;

    /// Writes a file, replacing an existing one.
    fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), String>;
}

/// The folder of a scene, which its imports may not leave. It records all requested files so that they
/// can be watched.
pub struct Folder<'f> {
    files: &'f dyn Files,
    folder: PathBuf,
    requested: Mutex<BTreeSet<PathBuf>>,
}

impl<'f> Folder<'f> {
    /// Creates the loader for the folder of a scene file.
    pub fn new(files: &'f dyn Files, scene: &Path) -> Self {
        Self {
            files,
            folder: scene.parent().unwrap_or(Path::new("")).to_owned(),
            requested: Mutex::default(),
        }
    }

    /// Returns the requested files, including missing ones.
    pub fn requested_files(self) -> BTreeSet<PathBuf> {
        self.requested
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

impl sdfc_compiler::elaborate::Loader for Folder<'_> {
    fn load(&self, path: &str) -> Result<String, String> {
        let file = self.folder.join(path);
        let mut requested = self
            .requested
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        requested.insert(file.clone());
        drop(requested);
        // Links are resolved before the location is checked.
        let is_current_folder = self.folder.as_os_str().is_empty();
        let folder = if is_current_folder {
            Path::new(".")
        } else {
            &self.folder
        };
        if let (Ok(folder), Ok(real)) = (folder.canonicalize(), file.canonicalize())
            && !real.starts_with(&folder)
        {
            return Err("it lies outside the folder of the scene".to_owned());
        }
        String::from_utf8(self.files.read(&file)?).map_err(|_| "it is not UTF-8 text".to_owned())
    }
}
