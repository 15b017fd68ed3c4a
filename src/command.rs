//! The subcommands, one file each: this list is what the parser, the help and the dispatch are made
//! of. A subcommand is its arguments and a function from them to its work.

mod devices;
mod explain;
mod fmt;
mod ops;

use crate::failure::Failure;
use crate::terminal::Terminal;
use clap::Subcommand;

/// What can be done.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Fmt(fmt::Arguments),
    Ops(ops::Arguments),
    Devices(devices::Arguments),
    Explain(explain::Arguments),
}

impl Command {
    /// Does it.
    pub(crate) fn run(self, terminal: &Terminal) -> Result<(), Failure> {
        match self {
            Self::Fmt(arguments) => fmt::run(&arguments, terminal),
            Self::Ops(arguments) => ops::run(&arguments),
            Self::Devices(arguments) => devices::run(&arguments),
            Self::Explain(arguments) => explain::run(&arguments),
        }
    }
}
