//! `sdfc watch`: a scene's picture, drawn again whenever the scene changes.

use super::render::{self, destination, draw};
use crate::engine;
use crate::failure::Failure;
use crate::terminal::Terminal;
use sdfc_playground::watcher::{SETTLING, Watcher, changed_since};
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
    let to = destination(arguments)?;
    let mut engine = engine::chosen(arguments.engine, arguments.tier)?;
    let (sender, changes) = channel();
    let watcher = Watcher::new(move || {
        // Nobody listens any more only where the program ends.
        let _ = sender.send(());
    });
    let mut watcher = watcher.map_err(Failure::Environment)?;
    loop {
        // Before the files are read: what changes meanwhile is noticed.
        let mut files = vec![arguments.scene.clone()];
        files.extend(std::mem::take(&mut *arguments.build.imported()));
        watcher.watch(&files).map_err(Failure::Environment)?;
        let started = SystemTime::now();
        if let Err(failure) = draw(arguments, &to, &mut *engine, terminal) {
            // The picture of before stays until the scene is whole again.
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
            // Nobody watched what is imported for the first time.
            if changed_since(&files[1..], started) {
                continue;
            }
        }
        if !changed(&changes) {
            return Ok(());
        }
    }
}

/// Waits until files have changed, and then been quiet for a while; nobody will tell, if not so.
fn changed(changes: &Receiver<()>) -> bool {
    let changed = changes.recv().is_ok();
    while changes.recv_timeout(SETTLING).is_ok() {}
    changed
}
