//! `sdfc`, the command line: it reads the arguments, hands them to the subcommand, and turns what
//! comes back into messages and an exit code. All that it knows of scenes it asks of the crates.

mod bench;
mod command;
mod engine;
mod failure;
mod generate;
mod input;
mod output;
mod progress;
mod rounding;
mod scene;
mod terminal;

use clap::Parser;
use command::Command;
use sdfc_playground::files::disk::reason;
use std::process::ExitCode;
use std::sync::{Arc, Mutex};
use terminal::{Colour, Terminal};

/// SDF scenes compiled to bytecode and WGSL, rendered on CPU and GPU.
#[derive(Debug, Parser)]
#[command(
    name = "sdfc",
    version,
    arg_required_else_help = true,
    args_override_self = true
)]
struct Cli {
    /// When messages are coloured.
    #[arg(long, global = true, value_enum, value_name = "WHEN", default_value_t)]
    color: Colour,
    #[command(subcommand)]
    command: Command,
}

/// The stack of the thread that works: trees of syntax and of expressions are walked by recursion,
/// to a depth that the compiler bounds.
const STACK_BYTES: usize = 256 << 20;

/// The exit code of a panic, as Rust's own.
const BUG: u8 = 101;

fn main() -> ExitCode {
    quieten_drivers();
    let cli = Cli::parse();
    let terminal = Arc::new(Terminal::new(cli.color));
    keep_panics();
    let first_thread = cli.command.wants_first_thread();
    let work = {
        let terminal = Arc::clone(&terminal);
        move || match cli.command.run(&terminal) {
            Ok(()) => ExitCode::SUCCESS,
            Err(failure) => failure.report(&terminal),
        }
    };
    if first_thread {
        return work();
    }
    let worker = match std::thread::Builder::new()
        .stack_size(STACK_BYTES)
        .spawn(work)
    {
        Ok(worker) => worker,
        Err(error) => {
            terminal.error(&format!("no thread could be started: {}", reason(&error)));
            return ExitCode::from(failure::ENVIRONMENT);
        }
    };
    worker.join().unwrap_or_else(|_| {
        terminal.error(&bug());
        ExitCode::from(BUG)
    })
}

/// Mesa's device selection complains on stderr where it finds no desktop; this switches it off.
fn quieten_drivers() {
    if std::env::var_os("NODEVICE_SELECT").is_none() {
        // SAFETY: no other thread exists yet, so nothing reads the environment meanwhile.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}

/// The last panic's message and place.
static PANIC: Mutex<Option<String>> = Mutex::new(None);

/// Keeps what a panic says until it is known whether someone catches it, as the layer above the
/// GPU drivers does.
fn keep_panics() {
    std::panic::set_hook(Box::new(|panic| {
        let said = panic.payload_as_str().unwrap_or("no message");
        let place = panic
            .location()
            .map(|place| format!(" at {place}"))
            .unwrap_or_default();
        if let Ok(mut last) = PANIC.lock() {
            *last = Some(format!("{said}{place}"));
        }
    }));
}

fn bug() -> String {
    let last = PANIC
        .lock()
        .ok()
        .and_then(|mut last| last.take())
        .unwrap_or_default();
    format!(
        "this is a bug in sdfc {}: {last}\nplease report it, with the command and the scene, at {}/issues",
        env!("CARGO_PKG_VERSION"),
        env!("CARGO_PKG_REPOSITORY"),
    )
}
