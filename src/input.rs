//! What is read from files.

use crate::failure::Failure;
use sdfc_playground::files::disk;
use std::io;
use std::path::Path;

/// The bytes of a file.
pub(crate) fn bytes(path: &Path) -> Result<Vec<u8>, Failure> {
    disk::read(path).map_err(|error| Failure::unreadable(path, &error))
}

/// The text of standard input.
pub(crate) fn standard() -> Result<String, Failure> {
    let name = Path::new("standard input");
    let bytes = disk::whole(io::stdin().lock());
    decoded(
        name,
        bytes.map_err(|error| Failure::unreadable(name, &error))?,
    )
}

/// The text of a file.
pub(crate) fn text(path: &Path) -> Result<String, Failure> {
    decoded(path, bytes(path)?)
}

/// Bytes as text.
pub(crate) fn decoded(path: &Path, bytes: Vec<u8>) -> Result<String, Failure> {
    sdfc_compiler::open::decoded(path, bytes).map_err(Failure::Input)
}
