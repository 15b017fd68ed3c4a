//! Tests of the command line: the built program runs in its own folder, as for a user.
//!
//! To add a case, write the scene into a [`Sandbox`](sandbox::Sandbox), run the command, and compare the
//! output with a snapshot of [`Run::transcript`](sandbox::Run::transcript). Paths in it are relative to
//! the sandbox, so the output does not depend on the machine. See `tests/README.md` for blessing
//! snapshots.

mod bench;
mod bytecode;
mod cameras;
mod commands;
mod files;
mod generate;
mod input;
mod mistakes;
mod params;
mod pictures;
mod reference;
mod sandbox;
mod unseen;
mod watch;
