//! Input from files and from standard input, whose name is `-`.

use crate::failure::Failure;
use sdfc_io::files::disk;
use std::io;
use std::path::Path;
use std::sync::OnceLock;

/// Name of standard input as a file.
const STANDARD_INPUT: &str = "-";

/// Reports whether a path stands for standard input.
pub(crate) fn is_standard(path: &Path) -> bool {
    path.as_os_str() == STANDARD_INPUT
}

/// Returns the bytes of a file, or of standard input.
pub(crate) fn bytes(path: &Path) -> Result<Vec<u8>, Failure> {
    match is_standard(path) {
        true => standard_bytes(),
        false => disk::read(path).map_err(|error| Failure::unreadable(path, &error)),
    }
}

/// Returns the bytes of standard input. They are read once, so that each reader gets all of them.
fn standard_bytes() -> Result<Vec<u8>, Failure> {
    static BYTES: OnceLock<Result<Vec<u8>, Failure>> = OnceLock::new();
    let read = || {
        let bytes = disk::read_all(io::stdin().lock());
        bytes.map_err(|error| Failure::unreadable(Path::new("standard input"), &error))
    };
    BYTES.get_or_init(read).clone()
}

/// Returns the text of standard input.
pub(crate) fn standard() -> Result<String, Failure> {
    decoded(Path::new("standard input"), standard_bytes()?)
}

/// Returns the text of a file, or of standard input.
pub(crate) fn text(path: &Path) -> Result<String, Failure> {
    decoded(path, bytes(path)?)
}

/// Decodes bytes as text.
pub(crate) fn decoded(path: &Path, bytes: Vec<u8>) -> Result<String, Failure> {
    sdfc_compiler::open::decode_text(path, bytes).map_err(Failure::Input)
}
