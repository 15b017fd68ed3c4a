//! Output of results: standard output, or a file that is written completely or not at all.

use crate::failure::Failure;
use sdfc_io::files::disk;
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::path::Path;

/// Writes to standard output. A reader that has closed it is [`Failure::Closed`].
pub(crate) fn print(bytes: impl AsRef<[u8]>) -> Result<(), Failure> {
    let mut stdout = io::stdout().lock();
    let result = stdout
        .write_all(bytes.as_ref())
        .and_then(|()| stdout.flush());
    result.map_err(|error| match error.kind() {
        ErrorKind::BrokenPipe => Failure::Closed,
        _ => Failure::unwritable(Path::new("standard output"), &error),
    })
}

/// Prints data as JSON, for scripts.
pub(crate) fn print_json(value: &impl serde::Serialize) -> Result<(), Failure> {
    let mut text = serde_json::to_string_pretty(value)
        .map_err(|error| Failure::Input(format!("the result is not JSON: {error}")))?;
    text.push('\n');
    print(text)
}

/// Writes to a file, or to standard output without one (or with `-`). Binary data is not written to a
/// terminal.
pub(crate) fn deliver(path: Option<&Path>, bytes: &[u8], is_text: bool) -> Result<(), Failure> {
    match path {
        Some(path) if path != Path::new("-") => write(path, bytes),
        _ if !is_text && io::stdout().is_terminal() => Err(Failure::Input(
            "this is not text: give a file with `-o FILE`, or send it into a pipe".to_owned(),
        )),
        _ => print(bytes),
    }
}

/// Checks that a file can be written, as far as possible in advance; for long work that must not be in vain.
pub(crate) fn check(path: &Path) -> Result<(), Failure> {
    if path == Path::new("-") {
        return Ok(());
    }
    disk::check(path).map_err(|error| Failure::unwritable(path, &error))
}

/// Checks that an output replaces none of these files.
pub(crate) fn check_differs<'p>(
    path: &Path,
    inputs: impl IntoIterator<Item = &'p Path>,
) -> Result<(), Failure> {
    let Ok(target) = path.canonicalize() else {
        return Ok(());
    };
    let mut inputs = inputs
        .into_iter()
        .filter_map(|input| input.canonicalize().ok());
    if target.is_file() && inputs.any(|input| input == target) {
        let path = path.display();
        return Err(Failure::Input(format!(
            "{path} is read here, and would be replaced by the result: give another file"
        )));
    }
    Ok(())
}

/// Writes a file, completely or not at all.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    disk::write(path, bytes).map_err(|error| Failure::unwritable(path, &error))
}
