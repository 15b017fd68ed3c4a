//! Pictures of the playground at 640×360 on the CPU, for each example: `move` is one picture while the
//! camera turns, as coarse as the session makes it to keep up, and `refine` from a moved camera to the
//! picture with all samples.
//!
//! What is measured of refinement is drawing: the coarse picture, the full one, and what makes it fine. The
//! clock that the session goes by stands still meanwhile, and jumps over the moment that it waits before it
//! takes a camera to be at rest.

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion};
use sdfc_playground::build::{Source, build};
use sdfc_playground::files::Disk;
use sdfc_playground::painter::Painter;
use sdfc_playground::session::{CameraEvent, Devices, Done, Event, Session, Stage, Task};
use sdfc_runtime::engine;
use std::path::{Path, PathBuf};
use std::time::Duration;

pub(crate) fn bench(criterion: &mut Criterion) {
    let second = Duration::from_secs(1);
    let mut group = criterion.benchmark_group("move");
    group.sample_size(30).measurement_time(second);
    each_example(&mut group, |desk| {
        assert!(desk.draw(), "a turned camera asks for a picture");
    });
    group.finish();
    let mut group = criterion.benchmark_group("refine");
    group.sample_size(10).measurement_time(second);
    each_example(&mut group, Desk::refine);
}

/// Measures what is done after the camera of each example was turned.
fn each_example(group: &mut BenchmarkGroup<'_, WallTime>, act: fn(&mut Desk)) {
    group.warm_up_time(Duration::from_millis(100));
    for path in examples() {
        let mut desk = None;
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        group.bench_function(name, |bencher| {
            let desk = desk.get_or_insert_with(|| Desk::at_rest(&path));
            bencher.iter(|| {
                desk.turn();
                act(desk);
            });
        });
    }
}

/// The examples, in order of their names.
fn examples() -> Vec<PathBuf> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/examples");
    let files = std::fs::read_dir(folder).expect("there are examples");
    let paths = files.map(|entry| entry.expect("a file").path());
    let mut scenes: Vec<_> = paths
        .filter(|path| path.extension().is_some_and(|found| found == "sdf"))
        .collect();
    scenes.sort();
    scenes
}

/// A session whose tasks are done at once.
struct Desk {
    session: Session,
    painter: Painter,
    now: Duration,
}

impl Desk {
    /// One with all samples of this scene's picture.
    fn at_rest(path: &Path) -> Self {
        let mut session = Session::new(Source::File(path.to_owned()), Devices::default());
        session.handle(Event::Resized([640, 360]), Duration::ZERO);
        let mut desk = Self {
            session,
            painter: Painter::new(Box::new(engine::open)),
            now: Duration::ZERO,
        };
        desk.refine();
        desk
    }

    /// Turns the camera a little.
    fn turn(&mut self) {
        let turn = Event::Camera(CameraEvent::Orbit([0.002, 0.0]));
        self.session.handle(turn, self.now);
    }

    /// Does what is to be done at once: builds, and a picture; says whether there was anything.
    fn draw(&mut self) -> bool {
        let tasks = self.session.tasks(self.now);
        let is_anything = !tasks.is_empty();
        for task in tasks {
            let done = match task {
                Task::Build(task) => Done::Built(build(&task, &Disk)),
                Task::Draw(task) => Done::Drawn(self.painter.draw(&task)),
                _ => continue,
            };
            self.session.done(done, self.now);
        }
        is_anything
    }

    /// Does all there is to do until the session is at rest.
    fn refine(&mut self) {
        loop {
            let is_done = !self.draw();
            match self.session.wakes(self.now) {
                Some(at) => self.now = self.now.max(at),
                None if is_done => break,
                None => {}
            }
        }
        let stage = self.session.facts().map(|facts| facts.stage);
        assert!(
            matches!(stage, Some(Stage::Full | Stage::Fine)),
            "{stage:?}"
        );
    }
}
