//! Tests of `sdfc watch`, which redraws changed files.

use super::sandbox::Sandbox;
use std::io::{BufRead, BufReader};
use std::process::Child;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// Timeout; longer than any machine needs for a small picture.
const TIMEOUT: Duration = Duration::from_secs(60);

/// A running `sdfc watch`, which ends with the test.
struct Watch {
    child: Child,
    lines: Receiver<String>,
}

impl Watch {
    fn new(sandbox: &Sandbox) -> Self {
        let arguments = "watch scene.sdf -o out.png --size 24x16 --aa 1 --engine cpu";
        let mut child = sandbox.command(arguments).spawn().expect("it starts");
        let stderr = BufReader::new(child.stderr.take().expect("standard error"));
        let (to, lines) = channel();
        std::thread::spawn(move || {
            for line in stderr.lines().map_while(Result::ok) {
                if to.send(line).is_err() {
                    return;
                }
            }
        });
        Self { child, lines }
    }

    /// Waits for a line that contains this text.
    fn says(&self, part: &str) {
        loop {
            match self.lines.recv_timeout(TIMEOUT) {
                Ok(line) if line.contains(part) => return,
                Ok(_) => {}
                Err(_) => panic!("it never said `{part}`"),
            }
        }
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn the_picture_follows_the_scene_and_what_it_imports() {
    let sandbox = Sandbox::with_scene("import \"knob.sdf\" as knob;\nknob::knob(1)\n");
    sandbox.write("knob.sdf", "fn knob(r) = sphere(r);\n");
    let watch = Watch::new(&sandbox);
    watch.says("out.png: 24x16");
    let ball = sandbox.read("out.png");
    sandbox.write("knob.sdf", "fn knob(r) = box(r);\n");
    // A change just before the start is drawn twice.
    let drawn = || watch.says("out.png: 24x16");
    let mut cube = ball.clone();
    while cube == ball {
        drawn();
        cube = sandbox.read("out.png");
    }
    // A broken scene is reported, and the picture stays.
    sandbox.write("knob.sdf", "fn knob(r) = box(r;\n");
    watch.says("error");
    assert_eq!(sandbox.read("out.png"), cube);
    std::fs::remove_file(sandbox.path("knob.sdf")).expect("it is there");
    watch.says("cannot be read");
    // Saved like an editor: a new file replaces the old one.
    sandbox.write("knob.sdf.new", "fn knob(r) = sphere(r);\n");
    std::fs::rename(sandbox.path("knob.sdf.new"), sandbox.path("knob.sdf")).expect("a new name");
    drawn();
    assert_eq!(sandbox.read("out.png"), ball);
}

#[test]
fn a_scene_that_is_not_there_yet_is_waited_for() {
    let sandbox = Sandbox::new();
    let watch = Watch::new(&sandbox);
    watch.says("scene.sdf cannot be read");
    sandbox.write("scene.sdf", "sphere(1)");
    watch.says("out.png: 24x16");
    assert!(!sandbox.read("out.png").is_empty());
}
