//! `sdfc watch`: the picture of a scene, drawn again whenever the scene changes.

use super::render::{self, destination, draw};
use crate::engine;
use crate::failure::Failure;
use crate::input;
use crate::terminal::Terminal;
use sdfc_io::watcher::{SETTLE_DELAY, Watcher, changed_since};
use std::sync::mpsc::{Receiver, channel};
use std::time::SystemTime;

/// Draw a scene again whenever it changes, until interrupted.
#[derive(Debug, clap::Args)]
#[group(skip)]
pub(crate) struct Arguments {
    #[command(flatten)]
    render: render::Arguments,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<(), Failure> {
    let arguments = &arguments.render;
    if input::is_standard(&arguments.scene) {
        return Err(Failure::Input(
            "standard input does not change: give the scene as a file".to_owned(),
        ));
    }
    let to = destination(arguments)?;
    let mut engine = engine::open_choice(arguments.engine, arguments.arithmetic)?;
    let (sender, changes) = channel();
    let watcher = Watcher::new(move || {
        // There is no receiver only while the program ends.
        let _ = sender.send(());
    });
    let mut watcher = watcher.map_err(Failure::Environment)?;
    loop {
        // Watched before the files are read, so that changes meanwhile are noticed.
        let mut files = vec![arguments.scene.clone()];
        files.extend(std::mem::take(&mut *arguments.build.imported()));
        watcher.watch(&files).map_err(Failure::Environment)?;
        let started = SystemTime::now();
        if let Err(failure) = draw(arguments, &to, &mut *engine, terminal) {
            // The old picture stays until the scene is valid again.
            failure.report(terminal);
        }
        let new = arguments
            .build
            .imported()
            .iter()
            .cloned()
            .collect::<Vec<_>>();
        if new != files[1..] {
            files.truncate(1);
            files.extend(new);
            watcher.watch(&files).map_err(Failure::Environment)?;
            // Files that are imported for the first time were not watched.
            if changed_since(&files[1..], started) {
                continue;
            }
        }
        if !changed(&changes) {
            return Ok(());
        }
    }
}

/// Waits until files have changed and then been quiet for a while; returns false where no watcher is left.
fn changed(changes: &Receiver<()>) -> bool {
    let changed = changes.recv().is_ok();
    while changes.recv_timeout(SETTLE_DELAY).is_ok() {}
    changed
}
