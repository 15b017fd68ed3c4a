//! `sdfc`, the command line: it parses the arguments, runs the subcommand, and converts its result to
//! messages and an exit code. Everything about scenes is in the other crates.

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
use sdfc_io::files::disk::reason;
use std::process::ExitCode;
use std::sync::{Arc, Mutex};
use terminal::{ColorChoice, Terminal};

/// SDF scenes compiled to bytecode and WGSL, rendered on CPU and GPU.
#[derive(Debug, Parser)]
#[command(
    name = "sdfc",
    version,
    arg_required_else_help = true,
    args_override_self = true
)]
struct Cli {
    /// Use of color in messages.
    #[arg(long, global = true, value_enum, value_name = "WHEN", default_value_t)]
    color: ColorChoice,
    #[command(subcommand)]
    command: Command,
}

/// Stack size of the worker thread: trees of syntax and of expressions are walked by recursion, to a depth
/// that the compiler bounds.
const STACK_BYTES: usize = 256 << 20;

/// Exit code of a panic, the same as Rust's own.
const PANIC_EXIT_CODE: u8 = 101;

fn main() -> ExitCode {
    silence_driver_messages();
    let cli = Cli::parse();
    let terminal = Arc::new(Terminal::new(cli.color));
    record_panics();
    let on_main_thread = cli.command.needs_main_thread();
    let work = {
        let terminal = Arc::clone(&terminal);
        move || match cli.command.run(&terminal) {
            Ok(()) => ExitCode::SUCCESS,
            Err(failure) => failure.report(&terminal),
        }
    };
    if on_main_thread {
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
        terminal.error(&bug_message());
        ExitCode::from(PANIC_EXIT_CODE)
    })
}

/// Switches off Mesa's device selection, which complains on stderr without a desktop.
fn silence_driver_messages() {
    if std::env::var_os("NODEVICE_SELECT").is_none() {
        // SAFETY: no other thread exists yet, so nothing reads the environment meanwhile.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}

/// Message and location of the last panic.
static LAST_PANIC: Mutex<Option<String>> = Mutex::new(None);

/// Records the message of a panic until it is known whether someone catches it, as the layer above the GPU
/// drivers does.
fn record_panics() {
    std::panic::set_hook(Box::new(|panic| {
        let message = panic.payload_as_str().unwrap_or("no message");
        let location = panic
            .location()
            .map(|location| format!(" at {location}"))
            .unwrap_or_default();
        if let Ok(mut last) = LAST_PANIC.lock() {
            *last = Some(format!("{message}{location}"));
        }
    }));
}

fn bug_message() -> String {
    let last = LAST_PANIC
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
