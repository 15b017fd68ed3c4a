//! What is read from files.

use crate::failure::Failure;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// The most bytes that are read of any file. What a scene's text may have is less; the compiler
/// says so.
const LARGEST: usize = sdfc_vm::file::MAX_BYTES;

/// The bytes of a file.
pub(crate) fn bytes(path: &Path) -> Result<Vec<u8>, Failure> {
    let failed = |error: io::Error| Failure::unreadable(path, &error);
    let file = File::open(path).map_err(failed)?;
    if file.metadata().map_err(failed)?.is_dir() {
        return Err(failed(io::Error::other("it is a folder")));
    }
    whole(path, file)
}

/// All of what can be read; an endless file is noticed too.
fn whole(path: &Path, from: impl Read) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    let read = from.take(LARGEST as u64 + 1).read_to_end(&mut bytes);
    read.map_err(|error| Failure::unreadable(path, &error))?;
    if bytes.len() > LARGEST {
        let problem = format!(
            "{} is larger than the {LARGEST} bytes that are read",
            path.display()
        );
        return Err(Failure::Input(problem));
    }
    Ok(bytes)
}

/// The text of standard input.
pub(crate) fn standard() -> Result<String, Failure> {
    let name = Path::new("standard input");
    decoded(name, whole(name, io::stdin().lock())?)
}

/// The text of a file.
pub(crate) fn text(path: &Path) -> Result<String, Failure> {
    decoded(path, bytes(path)?)
}

/// Bytes as text.
pub(crate) fn decoded(path: &Path, bytes: Vec<u8>) -> Result<String, Failure> {
    sdfc_compiler::open::decoded(path, bytes).map_err(Failure::Input)
}
