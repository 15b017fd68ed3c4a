//! Failures of a subcommand, and their exit codes: 1 for everything that is wrong with the input, 3 for the
//! machine around it. (2, a wrong command line, is from clap.)

use crate::terminal::Terminal;
use sdfc_io::files::disk::reason;
use std::fmt;
use std::io;
use std::path::Path;
use std::process::ExitCode;

/// Exit code of wrong input.
pub(crate) const INPUT: u8 = 1;
/// Exit code of files that cannot be read or written, and of missing devices.
pub(crate) const ENVIRONMENT: u8 = 3;

/// Reason of the early end of a subcommand.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Failure {
    /// Something is wrong with the input.
    Input(String),
    /// A file cannot be read or written, or there is no device.
    Environment(String),
    /// One of these, already reported, with its exit code.
    AlreadyReported(u8),
    /// The reader of the output has closed it: no complaint.
    Closed,
}

impl Failure {
    /// Returns the exit code.
    pub(crate) fn code(&self) -> u8 {
        match self {
            Self::Input(_) => INPUT,
            Self::Environment(_) => ENVIRONMENT,
            Self::AlreadyReported(code) => *code,
            Self::Closed => 0,
        }
    }

    /// Reports the failure to the user.
    pub(crate) fn report(&self, terminal: &Terminal) -> ExitCode {
        match self {
            Self::Input(message) | Self::Environment(message) => terminal.error(message),
            Self::AlreadyReported(_) | Self::Closed => {}
        }
        ExitCode::from(self.code())
    }

    /// Returns the failure to read a file, which may exceed the maximum size.
    pub(crate) fn unreadable(path: &Path, error: &io::Error) -> Self {
        let problem = format!("{} cannot be read: {}", path.display(), reason(error));
        match error.kind() {
            io::ErrorKind::FileTooLarge => Self::Input(problem),
            _ => Self::Environment(problem),
        }
    }

    /// Returns the failure to write a file.
    pub(crate) fn unwritable(path: &Path, error: &io::Error) -> Self {
        Self::Environment(format!(
            "{} cannot be written: {}",
            path.display(),
            reason(error)
        ))
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(message) | Self::Environment(message) => f.write_str(message),
            Self::AlreadyReported(_) | Self::Closed => Ok(()),
        }
    }
}

/// Runs `work` on each item and reports failures at once. All items are tried, and the gravest failure
/// decides the exit code.
pub(crate) fn on_each<T>(
    items: &[T],
    terminal: &Terminal,
    mut work: impl FnMut(&T) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let mut worst_code = 0;
    for item in items {
        match work(item) {
            Ok(()) => {}
            Err(Failure::Closed) => return Err(Failure::Closed),
            Err(failure) => {
                failure.report(terminal);
                worst_code = worst_code.max(failure.code());
            }
        }
    }
    if worst_code == 0 {
        Ok(())
    } else {
        Err(Failure::AlreadyReported(worst_code))
    }
}
