//! The files that a scene imports.

use crate::failure;
use crate::input;
use sdfc_compiler::elaborate::Loader;
use std::path::{Path, PathBuf};

/// The folder of a scene; nothing outside of it is read.
pub(super) struct Folder(PathBuf);

impl Folder {
    /// The folder that a scene's file lies in.
    pub(super) fn of(scene: &Path) -> Self {
        match scene.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => Self(folder.to_owned()),
            _ => Self(PathBuf::from(".")),
        }
    }
}

impl Loader for Folder {
    fn load(&self, path: &str) -> Result<String, String> {
        let reason = |error: std::io::Error| failure::reason(&error);
        let folder = self.0.canonicalize().map_err(reason)?;
        // Links are followed before it is looked where they lead.
        let file = folder.join(path).canonicalize().map_err(reason)?;
        if !file.starts_with(&folder) {
            return Err("it lies outside the folder of the scene".to_owned());
        }
        input::text(&file).map_err(|failure| failure.to_string())
    }
}
