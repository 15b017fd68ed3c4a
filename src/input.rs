//! What is read from files.

use crate::failure::Failure;
use sdfc_lang::MAX_SOURCE_BYTES;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// The bytes of a file, at most `limit` and one more, so that a larger one is noticed.
fn bytes(path: &Path, limit: usize) -> Result<Vec<u8>, Failure> {
    let failed = |error: io::Error| Failure::unreadable(path, &error);
    let file = File::open(path).map_err(failed)?;
    if file.metadata().map_err(failed)?.is_dir() {
        return Err(failed(io::Error::other("it is a folder")));
    }
    let mut bytes = Vec::new();
    file.take(limit as u64 + 1)
        .read_to_end(&mut bytes)
        .map_err(failed)?;
    Ok(bytes)
}

/// The text of a scene.
pub(crate) fn text(path: &Path) -> Result<String, Failure> {
    decoded(path, bytes(path, MAX_SOURCE_BYTES)?)
}

/// Bytes as text.
fn decoded(path: &Path, bytes: Vec<u8>) -> Result<String, Failure> {
    if bytes.len() > MAX_SOURCE_BYTES {
        return Err(Failure::Input(format!(
            "{} is too large: a scene may have {MAX_SOURCE_BYTES} bytes",
            path.display()
        )));
    }
    String::from_utf8(bytes).map_err(|error| {
        let good = error.utf8_error().valid_up_to();
        let bytes = error.as_bytes();
        let line = 1 + bytes[..good].iter().filter(|byte| **byte == b'\n').count();
        Failure::Input(format!(
            "{} is not UTF-8 text: there is the byte 0x{:02x} in line {line}",
            path.display(),
            bytes[good],
        ))
    })
}
