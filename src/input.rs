//! Input from files.

use crate::failure::Failure;
use sdfc_io::files::disk;
use std::io;
use std::path::Path;

/// Returns the bytes of a file.
pub(crate) fn bytes(path: &Path) -> Result<Vec<u8>, Failure> {
    disk::read(path).map_err(|error| Failure::unreadable(path, &error))
}

/// Returns the text of standard input.
pub(crate) fn standard() -> Result<String, Failure> {
    let name = Path::new("standard input");
    let bytes = disk::read_all(io::stdin().lock());
    decoded(
        name,
        bytes.map_err(|error| Failure::unreadable(name, &error))?,
    )
}

/// Returns the text of a file.
pub(crate) fn text(path: &Path) -> Result<String, Failure> {
    decoded(path, bytes(path)?)
}

/// Decodes bytes as text.
pub(crate) fn decoded(path: &Path, bytes: Vec<u8>) -> Result<String, Failure> {
    sdfc_compiler::open::decode_text(path, bytes).map_err(Failure::Input)
}
