//! The command line, run as a person runs it: the built program, in a folder of its own.
//!
//! To add a case: write the scene into a [`Sandbox`](sandbox::Sandbox), run the command, and hold
//! what it says with a snapshot, [`Run::transcript`](sandbox::Run::transcript). Paths in it are
//! relative to the sandbox, so nothing depends on the machine; see `tests/README.md` for how
//! snapshots are blessed.

mod bench;
mod bytecode;
mod commands;
mod files;
mod generate;
mod mistakes;
mod params;
mod pictures;
mod reference;
mod sandbox;
mod unseen;
mod watch;
