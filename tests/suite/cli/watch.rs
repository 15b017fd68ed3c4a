//! `sdfc watch`: pictures that follow their files.

use super::sandbox::Sandbox;
use std::io::{BufRead, BufReader};
use std::process::Child;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// Longer than any machine takes for a small picture.
const LONG: Duration = Duration::from_secs(60);

/// The program, watching; it ends with the test.
struct Watch {
    child: Child,
    said: Receiver<String>,
}

impl Watch {
    fn new(sandbox: &Sandbox) -> Self {
        let arguments = "watch scene.sdf -o out.png --size 24x16 --aa 1 --engine cpu";
        let mut child = sandbox.command(arguments).spawn().expect("it starts");
        let stderr = BufReader::new(child.stderr.take().expect("standard error"));
        let (to, said) = channel();
        std::thread::spawn(move || {
            for line in stderr.lines().map_while(Result::ok) {
                if to.send(line).is_err() {
                    return;
                }
            }
        });
        Self { child, said }
    }

    /// Waits for a line with this in it.
    fn says(&self, part: &str) {
        loop {
            match self.said.recv_timeout(LONG) {
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
    // What changed just before it began is drawn twice.
    let drawn = || watch.says("out.png: 24x16");
    let mut cube = ball.clone();
    while cube == ball {
        drawn();
        cube = sandbox.read("out.png");
    }
    // What is broken is told and leaves the picture.
    sandbox.write("knob.sdf", "fn knob(r) = box(r;\n");
    watch.says("error");
    assert_eq!(sandbox.read("out.png"), cube);
    std::fs::remove_file(sandbox.path("knob.sdf")).expect("it is there");
    watch.says("cannot be read");
    // Saved as editors do, by a new file in the place of the old one.
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
