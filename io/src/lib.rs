//! Input and output: files of scenes and their imports, PNG files, and a watcher of files.

pub mod files;
pub mod png_file;
pub mod watcher;
