//! Why a subcommand did not do its work, and the exit code that says so: 1 for everything that is
//! wrong with the input, 3 for the machine around it. (2, a wrong command line, is clap's.)

use crate::terminal::Terminal;
use sdfc_playground::files::disk::reason;
use std::fmt;
use std::io;
use std::path::Path;
use std::process::ExitCode;

/// The exit code of wrong input.
pub(crate) const INPUT: u8 = 1;
/// The exit code of files that cannot be read or written, and of devices that are not there.
pub(crate) const ENVIRONMENT: u8 = 3;

/// Why a subcommand ends early.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Failure {
    /// Something is wrong with the input.
    Input(String),
    /// A file cannot be read or written, or there is no device.
    Environment(String),
    /// The same as one of these, and the user has been told already.
    Told(u8),
    /// Whoever read the output has gone: nothing to complain about.
    Closed,
}

impl Failure {
    /// The exit code.
    pub(crate) fn code(&self) -> u8 {
        match self {
            Self::Input(_) => INPUT,
            Self::Environment(_) => ENVIRONMENT,
            Self::Told(code) => *code,
            Self::Closed => 0,
        }
    }

    /// Tells the user.
    pub(crate) fn report(&self, terminal: &Terminal) -> ExitCode {
        match self {
            Self::Input(message) | Self::Environment(message) => terminal.error(message),
            Self::Told(_) | Self::Closed => {}
        }
        ExitCode::from(self.code())
    }

    /// A file could not be read, or is larger than any that is.
    pub(crate) fn unreadable(path: &Path, error: &io::Error) -> Self {
        let problem = format!("{} cannot be read: {}", path.display(), reason(error));
        match error.kind() {
            io::ErrorKind::FileTooLarge => Self::Input(problem),
            _ => Self::Environment(problem),
        }
    }

    /// A file could not be written.
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
            Self::Told(_) | Self::Closed => Ok(()),
        }
    }
}

/// Runs something on each of several files: all of them are tried, failures are told as they come,
/// and the gravest decides the exit code.
pub(crate) fn on_each<T>(
    items: &[T],
    terminal: &Terminal,
    mut work: impl FnMut(&T) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let mut gravest = 0;
    for item in items {
        match work(item) {
            Ok(()) => {}
            Err(Failure::Closed) => return Err(Failure::Closed),
            Err(failure) => {
                failure.report(terminal);
                gravest = gravest.max(failure.code());
            }
        }
    }
    if gravest == 0 {
        Ok(())
    } else {
        Err(Failure::Told(gravest))
    }
}
