//! Opens the window on the file that is named, or on a ball.

use sdfc_playground::build::Source;
use sdfc_playground::files::Disk;
use sdfc_playground::painter::Opener;
use sdfc_playground::session::{Devices, Session};
use sdfc_playground::window::{Example, Tools, open};
use sdfc_runtime::engine;
use std::process::ExitCode;
use std::sync::Arc;

fn main() -> ExitCode {
    let source = match std::env::args_os().nth(1) {
        Some(path) => Source::File(path.into()),
        None => Source::Text {
            name: "ball.sdf".to_owned(),
            text: "sphere(1)".to_owned(),
        },
    };
    let tools = Tools {
        files: Arc::new(Disk),
        opener: Box::new(|| -> Opener { Box::new(engine::open) }),
        examples: vec![Example {
            name: "hello",
            text: include_str!("../../examples/hello.sdf"),
        }],
    };
    match open(Session::new(source, Devices::default()), tools) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
