//! The subcommands, one file each: this list defines the parser, the help and the dispatch. A subcommand is
//! its arguments and a function that runs it.

mod bench;
mod camera;
mod check;
mod compile;
mod devices;
mod explain;
mod fmt;
mod generate;
mod info;
mod named_values;
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

/// The subcommands.
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
    /// Reports whether it must run on the main thread: desktops open windows only there.
    pub(crate) fn needs_main_thread(&self) -> bool {
        #[cfg(feature = "window")]
        if matches!(self, Self::Play(_)) {
            return true;
        }
        false
    }

    /// Runs the subcommand.
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
