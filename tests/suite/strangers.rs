//! Scenes of strangers, against an oracle that shares no definition of a hit with the engines: all on the CPU,
//! every sixteenth on all engines, and with `SDFC_LONG=1` all on all.
//!
//! A pixel is wrong if nothing within two pixels of it looks like what an engine drew there: neither silhouettes
//! nor edges excuse more. Scenes are in `tests/strangers`; the first line of each says its class. A line
//! `// excused: 12 pixels, since …` says how many pixels may be wrong, and why that is right; one that begins
//! with `// fault:` says what is to be mended.

use crate::corpus::{compiled_scene, name, scene, scenes};
use sdfc_compiler::scene::Scene;
use sdfc_runtime::engine::{Engine, EngineKind, Loaded, open};
use sdfc_runtime::frame::{CellUse, Frame, RenderSettings, Status};
use sdfc_runtime::reference::{Camera, Ray};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use sdfc_trials::oracle::{Oracle, Trace};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// The size of the pictures.
const SIZE: [u32; 2] = [96, 72];
/// The largest distance of a pixel from what it shows, in pixels.
const AROUND: isize = 2;
/// Of how many scenes one is drawn by all engines.
const EVERY: usize = 16;
/// The length of rays, in distances of the camera from what it looks at.
const SEEN: f64 = 40.0;
/// The most steps of formulas that the oracle runs for a picture, and how many times as many in the long form.
const EFFORT: u64 = 20_000_000;
const LONG_EFFORT: u64 = 20;
/// The largest depth of a sliver, in halves of a pixel, and the number of points of it that are looked at.
const SLIVER: f64 = 0.5;
const SLICES: usize = 64;
/// The largest error of a depth, as a share of it and of the largest coordinate.
const DEPTH: f64 = 2e-5;
/// The most wrong pixels that are told one by one.
const SHOWN: usize = 8;
/// The largest error of a normal, in degrees.
const NORMAL: f64 = 3.0;

/// The folders of `tests/strangers`.
pub(crate) fn folders() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/strangers");
    let entries = std::fs::read_dir(root).expect("the folder can be read");
    let mut folders: Vec<PathBuf> = entries
        .map(|entry| entry.expect("its entries too").path())
        .filter(|path| path.is_dir())
        .collect();
    folders.sort();
    folders
}

/// All scenes that are compared: those of strangers, and the project's own.
fn cases() -> Vec<PathBuf> {
    let ours = ["examples", "tests/scenes", "tests/hard"].map(PathBuf::from);
    let all = folders().into_iter().chain(ours);
    all.flat_map(|folder| scenes(&folder.to_string_lossy()))
        .collect()
}

/// The truth of rays through pixels, found when it is asked for.
struct Truth {
    oracle: Oracle,
    camera: Camera,
    size: [u32; 2],
    /// The length of rays.
    far: f64,
    met: Vec<Option<Trace>>,
}

impl Truth {
    fn new(scene: &Scene, settings: &RenderSettings) -> Self {
        let root = scene.root.expect("it has a shape");
        let view = &settings.view;
        let way = (0..3).map(|i| (view.look[i] - view.from[i]).powi(2));
        let far = SEEN * way.sum::<f64>().sqrt();
        Self {
            oracle: Oracle::new(scene, root, 0.0),
            camera: Camera::of(settings),
            size: settings.size,
            far: settings.far.min(far),
            met: vec![None; (settings.size[0] * settings.size[1]) as usize],
        }
    }

    fn ray(&self, at: usize) -> Ray {
        let width = self.size[0] as usize;
        self.camera
            .ray([at % width, at / width].map(|v| v as f64), [0.0; 2])
    }

    /// Traces the ray through the centre of a pixel.
    fn at(&mut self, at: usize) -> Trace {
        if let Some(known) = self.met[at] {
            return known;
        }
        let ray = self.ray(at);
        let found = self
            .oracle
            .trace(ray.origin, ray.direction, [0.0, self.far]);
        self.met[at] = Some(found);
        found
    }

    /// Traces rays through the pixels around one, and between them.
    fn around(&mut self, at: usize) -> Vec<Trace> {
        let [width, height] = self.size.map(|side| side as isize);
        let (x, y) = (at as isize % width, at as isize / width);
        let mut found = Vec::new();
        for dy in -2 * AROUND..=2 * AROUND {
            for dx in -2 * AROUND..=2 * AROUND {
                let (nx, ny) = (x + dx / 2, y + dy / 2);
                let is_within = (0..width).contains(&nx) && (0..height).contains(&ny);
                if is_within && dx % 2 == 0 && dy % 2 == 0 {
                    found.push(self.at((ny * width + nx) as usize));
                } else {
                    let offset = [dx, dy].map(|v| v as f64 / 2.0);
                    let ray = self.camera.ray([x as f64, y as f64], offset);
                    found.push(
                        self.oracle
                            .trace(ray.origin, ray.direction, [0.0, self.far]),
                    );
                }
            }
        }
        found
    }
}

impl Truth {
    /// The direction out of the solid just before a place on a ray.
    fn outward(&self, at: usize, t: f64) -> [f64; 3] {
        let before = t - 1e-2 * self.camera.half_pixel(t);
        let gradient = self.oracle.gradient(self.ray(at).at(before));
        let length = gradient.iter().map(|v| v * v).sum::<f64>().sqrt();
        gradient.map(|v| v / length)
    }

    /// Tells if a ray that went on from a surface at `from` to `to` met no more of the solid than a sliver: less
    /// than a fraction of a pixel, as along a silhouette.
    fn is_sliver(&self, at: usize, from: f64, to: f64) -> bool {
        let ray = self.ray(at);
        let most = SLIVER * self.camera.half_pixel(from);
        let step = (to.min(self.far) - from) / SLICES as f64;
        let side = if self.oracle.value(ray.origin) < 0.0 {
            -1.0
        } else {
            1.0
        };
        (1..SLICES).all(|slice| {
            let p = ray.at(from + slice as f64 * step);
            let value = side * self.oracle.value(p);
            let slope = self
                .oracle
                .gradient(p)
                .iter()
                .map(|v| v * v)
                .sum::<f64>()
                .sqrt();
            value > -most * slope.max(1e-3)
        })
    }
}

/// The wrong pixels of a picture.
#[derive(Default)]
struct Wrong {
    hits: Vec<usize>,
    depths: Vec<usize>,
    normals: Vec<usize>,
}

impl Wrong {
    fn count(&self) -> usize {
        self.hits.len() + self.depths.len() + self.normals.len()
    }
}

/// The pixels in an order that soon has some of everywhere.
fn spread(count: usize) -> impl Iterator<Item = usize> {
    // Of two numbers without a common divisor, the multiples of one meet all remainders of the other.
    let step = (count * 5 / 8..)
        .find(|&step| (2..=step).all(|d| !count.is_multiple_of(d) || !step.is_multiple_of(d)));
    let step = step.expect("there is a prime");
    (0..count).map(move |i| i * step % count)
}

/// Looks at the pixels of a picture, as many as so much effort of the oracle is enough for.
fn compare(truth: &mut Truth, frame: &Frame, effort: u64) -> (Wrong, usize) {
    let mut wrong = Wrong::default();
    let before = Oracle::effort();
    let mut looked = 0;
    for at in spread(truth.met.len()) {
        if Oracle::effort() - before > effort {
            break;
        }
        looked += 1;
        if frame.status[at] == Status::StepCap {
            wrong.hits.push(at);
            continue;
        }
        let met = truth.at(at);
        let is_hit = matches!(frame.status[at], Status::Hit | Status::Inside)
            && f64::from(frame.depth[at]) < truth.far;
        let same = |trace: &Trace| match trace {
            Trace::Hit { .. } => is_hit,
            Trace::Miss => !is_hit,
            Trace::Undecided { .. } => true,
        };
        let drawn = if is_hit {
            f64::from(frame.depth[at])
        } else {
            f64::INFINITY
        };
        let is_passed = |truth: &Truth, t: f64| drawn > t && truth.is_sliver(at, t, drawn);
        if !same(&met) && !truth.around(at).iter().any(same) {
            match met {
                Trace::Hit { t, .. } if is_passed(truth, t) => {}
                _ => wrong.hits.push(at),
            }
            continue;
        }
        let Trace::Hit { t, normal, .. } = met else {
            continue;
        };
        if !is_hit {
            continue;
        }
        let origin = truth.ray(at).origin;
        let largest = origin.iter().fold(t, |most, v| most.max(v.abs()));
        let slack = DEPTH * largest + 0.1 * truth.camera.half_pixel(t);
        if (drawn - t).abs() > slack {
            let places = truth
                .around(at)
                .into_iter()
                .filter_map(|trace| match trace {
                    Trace::Hit { t, .. } => Some(t),
                    _ => None,
                });
            let (low, high) = places.fold((t, t), |(low, high), t| (low.min(t), high.max(t)));
            if !(low - slack..=high + slack).contains(&drawn) && !is_passed(truth, t) {
                wrong.depths.push(at);
            }
            continue;
        }
        let side = if frame.status[at] == Status::Inside {
            -1.0
        } else {
            1.0
        };
        let drawn = frame.normal[at].map(|v| side * f64::from(v));
        let Some(normal) = normal else { continue };
        if angle(normal, drawn) > NORMAL {
            let normals: Vec<[f64; 3]> = truth
                .around(at)
                .into_iter()
                .filter_map(|trace| match trace {
                    Trace::Hit { normal, .. } => normal,
                    _ => None,
                })
                .collect();
            let spread = normals
                .iter()
                .fold(0.0, |most: f64, n| most.max(angle(normal, *n)));
            let own = truth.outward(at, f64::from(frame.depth[at]));
            let fits = |n: [f64; 3]| angle(n, drawn) < NORMAL.max(spread);
            if !fits(own) && !normals.into_iter().any(fits) {
                wrong.normals.push(at);
            }
        }
    }
    (wrong, looked)
}

fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let dot: f64 = (0..3).map(|i| a[i] * b[i]).sum();
    dot.clamp(-1.0, 1.0).acos().to_degrees()
}

/// The number of pixels that a scene's head excuses.
fn excused(path: &Path) -> usize {
    let text = std::fs::read_to_string(path).expect("the scene can be read");
    let heads = text.lines().take_while(|line| line.starts_with("//"));
    let words = ["// excused: ", "// fault: "];
    let said = |line| words.iter().find_map(|word| str::strip_prefix(line, word));
    let mut excuses = heads.filter_map(said);
    excuses.next().map_or(0, |excuse| {
        let count = excuse
            .split_whitespace()
            .next()
            .and_then(|count| count.parse().ok());
        count.unwrap_or_else(|| panic!("{}: `// excused: 12 pixels, since …`", path.display()))
    })
}

/// Tells what is wrong with a scene on these engines, line by line.
fn examine(path: &Path, engines: &mut [Box<dyn Engine>], effort: u64) -> String {
    let mut report = String::new();
    let scene = scene(path);
    if scene.root.is_none() {
        return report;
    }
    let mut compiled = compiled_scene(scene.clone());
    let outputs = compiled.module.update(0.0);
    let source = compiled.generated();
    let overrides = Overrides {
        size: Some(SIZE),
        aa: Some(1),
        ..Overrides::default()
    };
    let settings = resolve(&compiled.module, &outputs, &overrides);
    let settings = settings.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    if settings.plane {
        return report;
    }
    let mut truth = Truth::new(&scene, &settings);
    let loaded = Loaded {
        module: &compiled.module,
        outputs: &outputs,
        generated: SceneSource {
            text: &source.text,
            calls: &source.calls,
        },
    };
    let excused = excused(path);
    for engine in engines {
        engine.load(&loaded).expect("it loads");
        for cells in [CellUse::Never, CellUse::Always] {
            let settings = RenderSettings {
                cells,
                ..settings.clone()
            };
            let frame = engine.render(&settings, &|_| {}).expect("it draws");
            let (wrong, looked) = compare(&mut truth, &frame, effort);
            let Frame { stats, .. } = &frame;
            if wrong.count() > excused || stats.step_caps > 0 {
                let (hits, depths, normals) =
                    (wrong.hits.len(), wrong.depths.len(), wrong.normals.len());
                let all = [&wrong.hits, &wrong.depths, &wrong.normals];
                let some = all.into_iter().flatten().take(SHOWN);
                let some: String = some
                    .map(|&at| {
                        let place = [at % frame.width, at / frame.width];
                        let drawn = (frame.depth[at], frame.normal[at]);
                        format!("\n  {place:?}: {:?}, drawn {drawn:?}", truth.met[at])
                    })
                    .collect();
                _ = writeln!(
                    report,
                    "{}: {} cells {cells:?}: {hits} hits, {depths} depths, {normals} normals, of {looked}, {} out of steps, {} NaN{some}",
                    name(path),
                    engine.kind(),
                    stats.step_caps,
                    stats.nans,
                );
            }
        }
    }
    report
}

#[test]
fn strangers_see_what_is_there() {
    let mut cases = cases();
    if let Ok(wanted) = std::env::var("SDFC_ONLY") {
        cases.retain(|path| path.to_string_lossy().contains(&wanted));
    }
    let is_long = std::env::var_os("SDFC_LONG").is_some();
    let effort = EFFORT * if is_long { LONG_EFFORT } else { 1 };
    let has_gpu = std::env::var_os("SDFC_SKIP_GPU").is_none();
    if !has_gpu {
        eprintln!("skipped: strangers on devices, as SDFC_SKIP_GPU asks");
    }
    let next = AtomicUsize::new(0);
    let reports: Vec<String> = std::thread::scope(|threads| {
        let work = || {
            let mut engines = vec![open(EngineKind::Cpu).expect("there is always a CPU")];
            let mut report = String::new();
            loop {
                let at = next.fetch_add(1, Relaxed);
                let Some(path) = cases.get(at) else {
                    return report;
                };
                let on_all = has_gpu && (is_long || at.is_multiple_of(EVERY));
                if on_all && engines.len() == 1 {
                    let others = EngineKind::FAST.into_iter().skip(1);
                    engines.extend(others.map(|kind| open(kind).expect("there is an adapter")));
                }
                let count = if on_all { engines.len() } else { 1 };
                report += &examine(path, &mut engines[..count], effort);
            }
        };
        let start = |_| {
            let thread = std::thread::Builder::new().stack_size(64 << 20);
            thread
                .spawn_scoped(threads, work)
                .expect("a thread can be started")
        };
        let handles: Vec<_> = (0..2).map(start).collect();
        handles
            .into_iter()
            .map(|handle| handle.join().expect("it reports"))
            .collect()
    });
    let report: String = reports.concat();
    assert!(report.is_empty(), "\n{report}");
}
