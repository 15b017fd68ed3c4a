//! The subcommands, one file each: this list is what the parser, the help and the dispatch are made
//! of. A subcommand is its arguments and a function from them to its work.

mod bench;
mod check;
mod compile;
mod devices;
mod explain;
mod fmt;
mod generate;
mod info;
mod ops;
#[cfg(feature = "window")]
mod play;
mod query;
mod render;
mod verify;
mod watch;

use crate::failure::Failure;
use crate::terminal::Terminal;
use clap::Subcommand;

/// What can be done.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Render(render::Arguments),
    #[cfg(feature = "window")]
    Play(play::Arguments),
    Watch(watch::Arguments),
    Check(check::Arguments),
    Compile(compile::Arguments),
    Verify(verify::Arguments),
    Bench(bench::Arguments),
    Query(query::Arguments),
    Info(info::Arguments),
    Fmt(fmt::Arguments),
    Gen(generate::Arguments),
    Ops(ops::Arguments),
    Devices(devices::Arguments),
    Explain(explain::Arguments),
}

impl Command {
    /// Whether it has to run where the program begins: desktops open windows only there.
    pub(crate) fn wants_first_thread(&self) -> bool {
        #[cfg(feature = "window")]
        if matches!(self, Self::Play(_)) {
            return true;
        }
        false
    }

    /// Does it.
    pub(crate) fn run(self, terminal: &Terminal) -> Result<(), Failure> {
        match self {
            Self::Render(arguments) => render::run(&arguments, terminal),
            #[cfg(feature = "window")]
            Self::Play(arguments) => play::run(&arguments, terminal),
            Self::Watch(arguments) => watch::run(&arguments, terminal),
            Self::Check(arguments) => check::run(&arguments, terminal),
            Self::Compile(arguments) => compile::run(&arguments, terminal),
            Self::Verify(arguments) => verify::run(&arguments, terminal),
            Self::Bench(arguments) => bench::run(&arguments, terminal),
            Self::Query(arguments) => query::run(&arguments, terminal),
            Self::Info(arguments) => info::run(&arguments, terminal),
            Self::Fmt(arguments) => fmt::run(&arguments, terminal),
            Self::Gen(arguments) => generate::run(&arguments),
            Self::Ops(arguments) => ops::run(&arguments),
            Self::Devices(arguments) => devices::run(&arguments),
            Self::Explain(arguments) => explain::run(&arguments),
        }
    }
}
