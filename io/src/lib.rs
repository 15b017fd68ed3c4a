//! Input and output: files of scenes and their imports, encoding of PNG files, and a watcher of files.

pub mod files;
pub mod png_encoding;
pub mod watcher;
