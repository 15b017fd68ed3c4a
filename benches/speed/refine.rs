//! Pictures of the playground at 640×360 on the CPU, for each example.
//!
//! `move` is one picture while the camera turns, as coarse as the session requires to keep up. `refine`
//! lasts from a moved camera to the picture with all samples.
//!
//! Only the drawing is measured: the coarse picture, the full one and its refinement. The session's clock
//! stands still during that time. It skips the delay after which the session considers a camera at rest.

use crate::scenes;
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion};
use sdfc_io::files::Disk;
use sdfc_playground::build::{SceneOrigin, build};
use sdfc_playground::renderer::Renderer;
use sdfc_playground::session::{
    CameraEvent, Devices, Event, RefinementStage, Session, Task, TaskResult,
};
use sdfc_runtime::engine;
use std::path::Path;
use std::time::Duration;

pub(crate) fn bench(criterion: &mut Criterion) {
    let second = Duration::from_secs(1);
    let mut group = criterion.benchmark_group("move");
    group.sample_size(30).measurement_time(second);
    each_example(&mut group, |session| {
        assert!(session.draw(), "a turned camera asks for a picture");
    });
    group.finish();
    let mut group = criterion.benchmark_group("refine");
    group.sample_size(10).measurement_time(second);
    each_example(&mut group, BenchSession::refine);
}

/// Measures the work after a camera rotation, for each example.
fn each_example(group: &mut BenchmarkGroup<'_, WallTime>, act: fn(&mut BenchSession)) {
    group.warm_up_time(Duration::from_millis(100));
    for path in scenes::examples() {
        let mut session = None;
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        group.bench_function(name, |bencher| {
            let session = session.get_or_insert_with(|| BenchSession::at_rest(&path));
            bencher.iter(|| {
                session.turn();
                act(session);
            });
        });
    }
}

/// A session whose tasks run at once.
struct BenchSession {
    session: Session,
    painter: Renderer,
    now: Duration,
}

impl BenchSession {
    /// Creates a session that has all samples of this scene's picture.
    fn at_rest(path: &Path) -> Self {
        let mut session = Session::new(SceneOrigin::File(path.to_owned()), Devices::default());
        session.handle(Event::Resized([640, 360]), Duration::ZERO);
        let mut driver = Self {
            session,
            painter: Renderer::new(Box::new(engine::open)),
            now: Duration::ZERO,
        };
        driver.refine();
        driver
    }

    /// Rotates the camera slightly.
    fn turn(&mut self) {
        let turn = Event::Camera(CameraEvent::Orbit([0.002, 0.0]));
        self.session.handle(turn, self.now);
    }

    /// Runs the pending tasks, which are builds and a picture. Returns whether there were any.
    fn draw(&mut self) -> bool {
        let tasks = self.session.tasks(self.now);
        let has_tasks = !tasks.is_empty();
        for task in tasks {
            let result = match task {
                Task::Build(task) => TaskResult::Built(build(&task, &Disk)),
                Task::Draw(task) => TaskResult::Drawn(self.painter.draw(&task)),
                _ => continue,
            };
            self.session.finish_task(result, self.now);
        }
        has_tasks
    }

    /// Runs all tasks until the session is at rest.
    fn refine(&mut self) {
        loop {
            let is_done = !self.draw();
            match self.session.next_wakeup(self.now) {
                Some(position) => self.now = self.now.max(position),
                None if is_done => break,
                None => {}
            }
        }
        let stage = self.session.facts().map(|facts| facts.stage);
        assert!(
            matches!(stage, Some(RefinementStage::Full | RefinementStage::Fine)),
            "{stage:?}"
        );
    }
}
