//! Scenes of strangers, compared with an oracle that shares no hit definition with the engines. All
//! scenes run on the CPU, every sixteenth on all engines, and with `SDFC_LONG=1` all scenes on all
//! engines.
//!
//! A pixel is wrong if nothing within two pixels of it matches the engine's result there; silhouettes and
//! edges excuse nothing more. Scenes are in `tests/strangers`; the first line of each states its class. A
//! line `// excused: 12 pixels, since …` states how many pixels may differ and why that is correct; `//
//! fault:` states what must be fixed. A line `// engines: cpu, since …` leaves a scene to the CPU.

use crate::corpus::{compiled_scene, name, scene, scene_input, scenes};
use glam::{DVec3, Vec3};
use sdfc_compiler::scene::Scene;
use sdfc_runtime::engine::{Engine, EngineKind, open};
use sdfc_runtime::reference::{ReferenceCamera, ReferenceRay};
use sdfc_runtime::render::{CellMode, Image, RenderSettings, Status};
use sdfc_runtime::settings::{CameraChanges, Overrides, resolve};
use sdfc_trials::oracle::{Oracle, TraceOutcome};
use sdfc_trials::skip::is_gpu_skipped;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Size of the pictures.
const SIZE: [u32; 2] = [96, 72];
/// Maximum distance in pixels between a pixel and matching content.
const MAX_NEIGHBOUR_DISTANCE: isize = 2;
/// One in this number of scenes is drawn by all engines.
const ALL_ENGINES_STRIDE: usize = 16;
/// Length of rays, in units of the camera's distance to the look-at point.
const RAY_LENGTH_FACTOR: f64 = 40.0;
/// Maximum number of formula steps of the oracle per picture, and the factor of the long form.
const MAX_ORACLE_STEPS: u64 = 20_000_000;
const LONG_FACTOR: u64 = 20;
/// Maximum depth of a sliver in half pixels, and the number of its samples.
const MAX_SLIVER_DEPTH: f64 = 0.5;
const SLIVER_SAMPLES: usize = 64;
/// Scenes with materials that meet in blends, in which engines mix them.
const BLENDED_SCENES: [&str; 2] = ["blends", "slime_on_floor"];
/// Depth below the surface at which the oracle reads materials, in half pixels.
const MATERIAL_DEPTH: f64 = 0.01;
/// Maximum error of a depth, relative to the depth and to the largest coordinate.
const MAX_DEPTH_ERROR: f64 = 2e-5;
/// Maximum number of wrong pixels that are listed.
const MAX_LISTED_PIXELS: usize = 8;
/// Maximum error of a normal in degrees.
const MAX_NORMAL_ERROR_DEGREES: f64 = 3.0;

/// Returns the folders of `tests/strangers`.
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

/// Returns all compared scenes: those of strangers and those of the repository.
pub(crate) fn cases() -> Vec<PathBuf> {
    let ours = ["examples", "tests/scenes", "tests/hard"].map(PathBuf::from);
    let all = folders().into_iter().chain(ours);
    all.flat_map(|folder| scenes(&folder.to_string_lossy()))
        .collect()
}

/// Scene and the camera through which it is compared.
#[derive(Clone)]
pub(crate) struct Case {
    pub(crate) path: PathBuf,
    pub(crate) camera: CameraChanges,
}

/// Ground truth of rays through pixels, computed on demand.
struct RayTruth {
    oracle: Oracle,
    camera: ReferenceCamera,
    size: [u32; 2],
    /// Length of rays.
    far: f64,
    outcomes: Vec<Option<TraceOutcome>>,
    /// Set if every surface has one material.
    has_materials: bool,
}

impl RayTruth {
    fn new(scene: &Scene, settings: &RenderSettings, has_materials: bool) -> Self {
        let root = scene.root.expect("it has a shape");
        let far = RAY_LENGTH_FACTOR * settings.view.target_distance();
        Self {
            oracle: Oracle::new(scene, root, 0.0),
            camera: ReferenceCamera::new(settings),
            size: settings.size,
            far: settings.far.min(far),
            outcomes: vec![None; (settings.size[0] * settings.size[1]) as usize],
            has_materials,
        }
    }

    fn ray(&self, pixel: usize) -> ReferenceRay {
        let width = self.size[0] as usize;
        self.camera
            .ray([pixel % width, pixel / width].map(|v| v as f64), [0.0; 2])
    }

    /// Traces the ray of a pixel with a single sample.
    fn outcome(&mut self, pixel: usize) -> TraceOutcome {
        if let Some(cached) = self.outcomes[pixel] {
            return cached;
        }
        let ray = self.ray(pixel);
        let outcome = self
            .oracle
            .trace(ray.origin, ray.direction, [0.0, self.far]);
        self.outcomes[pixel] = Some(outcome);
        outcome
    }

    /// Returns the number of the material just below the surface that a pixel shows at `t`. Sheets, which coincide
    /// with the surface and enclose nothing, are not there.
    fn material(&self, ray: &ReferenceRay, t: f64) -> u32 {
        let below = ray.at(t + MATERIAL_DEPTH * self.camera.half_pixel(t));
        self.oracle.material(below).map_or(0, |id| id.0)
    }

    /// Reports whether a material is seen around a pixel.
    fn has_material_around(&self, pixel: usize, material: u32) -> bool {
        let width = self.size[0] as usize;
        let centre = [pixel % width, pixel / width].map(|v| v as f64);
        let steps = 2 * MAX_NEIGHBOUR_DISTANCE;
        (-steps..=steps).any(|dy| {
            (-steps..=steps).any(|dx| {
                let ray = self.camera.ray(centre, [dx, dy].map(|v| v as f64 / 2.0));
                match self
                    .oracle
                    .trace(ray.origin, ray.direction, [0.0, self.far])
                {
                    TraceOutcome::Hit { t, .. } => self.material(&ray, t) == material,
                    _ => false,
                }
            })
        })
    }

    /// Traces rays through the pixels around one, and between them.
    fn outcomes_around(&mut self, pixel: usize) -> Vec<TraceOutcome> {
        let [width, height] = self.size.map(|side| side as isize);
        let (x, y) = (pixel as isize % width, pixel as isize / width);
        let mut outcomes = Vec::new();
        for dy in -2 * MAX_NEIGHBOUR_DISTANCE..=2 * MAX_NEIGHBOUR_DISTANCE {
            for dx in -2 * MAX_NEIGHBOUR_DISTANCE..=2 * MAX_NEIGHBOUR_DISTANCE {
                let (nx, ny) = (x + dx / 2, y + dy / 2);
                let is_within = (0..width).contains(&nx) && (0..height).contains(&ny);
                if is_within && dx % 2 == 0 && dy % 2 == 0 {
                    outcomes.push(self.outcome((ny * width + nx) as usize));
                } else {
                    let offset = [dx, dy].map(|v| v as f64 / 2.0);
                    let ray = self.camera.ray([x as f64, y as f64], offset);
                    outcomes.push(
                        self.oracle
                            .trace(ray.origin, ray.direction, [0.0, self.far]),
                    );
                }
            }
        }
        outcomes
    }
}

impl RayTruth {
    /// Returns the outward direction just before a point of a ray.
    fn outward(&self, pixel: usize, t: f64) -> DVec3 {
        let t_before = t - 1e-2 * self.camera.half_pixel(t);
        let gradient = DVec3::from(self.oracle.gradient(self.ray(pixel).at(t_before)));
        gradient / gradient.length()
    }

    /// Reports whether a ray that continued from a surface at `from` to `to` crossed only a sliver of the
    /// solid. It is less than a fraction of a pixel deep, as along a silhouette.
    fn is_sliver(&self, pixel: usize, from: f64, to: f64) -> bool {
        let ray = self.ray(pixel);
        let max_depth = MAX_SLIVER_DEPTH * self.camera.half_pixel(from);
        let step = (to.min(self.far) - from) / SLIVER_SAMPLES as f64;
        let side = if self.oracle.value(ray.origin) < 0.0 {
            -1.0
        } else {
            1.0
        };
        (1..SLIVER_SAMPLES).all(|slice| {
            let p = ray.at(from + slice as f64 * step);
            let value = side * self.oracle.value(p);
            let slope = DVec3::from(self.oracle.gradient(p)).length();
            value > -max_depth * slope.max(1e-3)
        })
    }
}

/// Wrong pixels of a picture.
#[derive(Default)]
struct WrongPixels {
    hits: Vec<usize>,
    depths: Vec<usize>,
    normals: Vec<usize>,
    materials: Vec<usize>,
}

impl WrongPixels {
    fn count(&self) -> usize {
        self.groups().map(|(_, pixels)| pixels.len()).iter().sum()
    }

    /// Returns the wrong pixels of each kind, with its name.
    fn groups(&self) -> [(&'static str, &[usize]); 4] {
        [
            ("hits", &self.hits),
            ("depths", &self.depths),
            ("normals", &self.normals),
            ("materials", &self.materials),
        ]
    }
}

/// Returns the pixel indices in an order that covers the picture early.
fn scattered_indices(count: usize) -> impl Iterator<Item = usize> {
    // Multiples of a number coprime to the count visit every remainder.
    let step = (count * 5 / 8..)
        .find(|&step| (2..=step).all(|d| !count.is_multiple_of(d) || !step.is_multiple_of(d)));
    let step = step.expect("there is a prime");
    (0..count).map(move |i| i * step % count)
}

/// Compares the pixels of a picture until the oracle has run `max_steps` steps. Returns the wrong pixels
/// and the number of compared ones.
fn compare(truth: &mut RayTruth, image: &Image, max_steps: u64) -> (WrongPixels, usize) {
    let mut wrong = WrongPixels::default();
    let steps_before = Oracle::steps_run();
    let mut compared = 0;
    for pixel in scattered_indices(truth.outcomes.len()) {
        if Oracle::steps_run() - steps_before > max_steps {
            break;
        }
        compared += 1;
        if image.status[pixel] == Status::StepCap {
            wrong.hits.push(pixel);
            continue;
        }
        let outcome = truth.outcome(pixel);
        let is_hit = matches!(image.status[pixel], Status::Hit | Status::Inside)
            && f64::from(image.depth[pixel]) < truth.far;
        let same = |trace: &TraceOutcome| match trace {
            TraceOutcome::Hit { .. } => is_hit,
            TraceOutcome::Miss => !is_hit,
            TraceOutcome::Undecided { .. } => true,
        };
        let drawn = if is_hit {
            f64::from(image.depth[pixel])
        } else {
            f64::INFINITY
        };
        let is_passed = |truth: &RayTruth, t: f64| drawn > t && truth.is_sliver(pixel, t, drawn);
        if !same(&outcome) && !truth.outcomes_around(pixel).iter().any(same) {
            match outcome {
                TraceOutcome::Hit { t, .. } if is_passed(truth, t) => {}
                _ => wrong.hits.push(pixel),
            }
            continue;
        }
        let TraceOutcome::Hit { t, normal, .. } = outcome else {
            continue;
        };
        if !is_hit {
            continue;
        }
        let origin = truth.ray(pixel).origin;
        let largest = origin.iter().fold(t, |most, v| most.max(v.abs()));
        let slack = MAX_DEPTH_ERROR * largest + 0.1 * truth.camera.half_pixel(t);
        if (drawn - t).abs() > slack {
            let places = truth
                .outcomes_around(pixel)
                .into_iter()
                .filter_map(|trace| match trace {
                    TraceOutcome::Hit { t, .. } => Some(t),
                    _ => None,
                });
            let (low, high) = places.fold((t, t), |(low, high), t| (low.min(t), high.max(t)));
            if !(low - slack..=high + slack).contains(&drawn) && !is_passed(truth, t) {
                wrong.depths.push(pixel);
            }
            continue;
        }
        let is_inside = image.status[pixel] == Status::Inside;
        let id = image.id[pixel];
        if truth.has_materials
            && !is_inside
            && truth.material(&truth.ray(pixel), t) != id
            && !truth.has_material_around(pixel, id)
        {
            wrong.materials.push(pixel);
        }
        let side = if is_inside { -1.0 } else { 1.0 };
        let drawn = side * Vec3::from(image.normal[pixel]).as_dvec3();
        let Some(normal) = normal else { continue };
        if angle(normal.into(), drawn) > MAX_NORMAL_ERROR_DEGREES {
            let normals: Vec<DVec3> = truth
                .outcomes_around(pixel)
                .into_iter()
                .filter_map(|trace| match trace {
                    TraceOutcome::Hit { normal, .. } => normal.map(DVec3::from),
                    _ => None,
                })
                .collect();
            let max_angle = normals
                .iter()
                .fold(0.0, |most: f64, n| most.max(angle(normal.into(), *n)));
            let outward_normal = truth.outward(pixel, f64::from(image.depth[pixel]));
            let fits = |n: DVec3| angle(n, drawn) < MAX_NORMAL_ERROR_DEGREES.max(max_angle);
            if !fits(outward_normal) && !normals.into_iter().any(fits) {
                wrong.normals.push(pixel);
            }
        }
    }
    (wrong, compared)
}

fn angle(a: DVec3, b: DVec3) -> f64 {
    a.dot(b).clamp(-1.0, 1.0).acos().to_degrees()
}

/// Returns the number of pixels that the scene's head excuses.
fn excused(path: &Path) -> usize {
    let text = std::fs::read_to_string(path).expect("the scene can be read");
    let heads = text.lines().take_while(|line| line.starts_with("//"));
    let words = ["// excused: ", "// fault: "];
    let excuse_text = |line| words.iter().find_map(|word| str::strip_prefix(line, word));
    let mut excuses = heads.filter_map(excuse_text);
    excuses.next().map_or(0, |excuse| {
        let count = excuse
            .split_whitespace()
            .next()
            .and_then(|count| count.parse().ok());
        count.unwrap_or_else(|| panic!("{}: `// excused: 12 pixels, since …`", path.display()))
    })
}

/// Reports whether only the CPU can prove that rays step over nothing in a scene.
fn needs_proof(path: &Path) -> bool {
    let text = std::fs::read_to_string(path).expect("the scene can be read");
    text.lines().any(|line| line.starts_with("// engines: cpu"))
}

/// Reports the errors of a scene on these engines, one per line.
fn examine(case: &Case, engines: &mut [Box<dyn Engine>], max_steps: u64) -> String {
    let path = &case.path;
    let mut report = String::new();
    let scene = scene(path);
    if scene.root.is_none() {
        return report;
    }
    let mut compiled = compiled_scene(scene.clone());
    let uniform_values = compiled.module.update(0.0);
    let source = compiled.generated();
    let overrides = Overrides {
        size: Some(SIZE),
        aa: Some(1),
        camera_changes: case.camera.clone(),
        ..Overrides::default()
    };
    let settings = resolve(&compiled.module, &uniform_values, &overrides);
    let settings = settings.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    if settings.is_2d {
        return report;
    }
    let mut truth = RayTruth::new(&scene, &settings, !BLENDED_SCENES.contains(&&*name(path)));
    let loaded = scene_input(&compiled, &uniform_values, &source);
    let excused = excused(path);
    let count = if needs_proof(path) { 1 } else { engines.len() };
    for engine in &mut engines[..count] {
        engine.load(&loaded).expect("it loads");
        for cells in [CellMode::Never, CellMode::Always] {
            let settings = RenderSettings {
                cells,
                ..settings.clone()
            };
            let image = engine.render(&settings, &|_| {}).expect("it draws");
            let (wrong, compared) = compare(&mut truth, &image, max_steps);
            let Image { stats, .. } = &image;
            if wrong.count() > excused || stats.step_caps > 0 {
                let groups = wrong.groups();
                let counts = groups.map(|(kind, pixels)| format!("{} {kind}, ", pixels.len()));
                let listed = groups.into_iter().flat_map(|(_, pixels)| pixels);
                let listed = listed.take(MAX_LISTED_PIXELS);
                let listed: String = listed
                    .map(|&pixel| {
                        let coordinates = [pixel % image.width, pixel / image.width];
                        let drawn = (image.depth[pixel], image.normal[pixel]);
                        format!(
                            "\n  {coordinates:?}: {:?}, drawn {drawn:?}",
                            truth.outcomes[pixel]
                        )
                    })
                    .collect();
                _ = writeln!(
                    report,
                    "{}{}: {} cells {cells:?}: {}of {compared}, {} out of steps, {} NaN{listed}",
                    name(path),
                    case.camera
                        .from
                        .map_or_else(String::new, |from| format!(" from {from:?}")),
                    engine.kind(),
                    counts.concat(),
                    stats.step_caps,
                    stats.nans,
                );
            }
        }
    }
    report
}

#[test]
fn stranger_scenes_show_the_hits_of_the_oracle() {
    let mut cases = cases();
    if let Ok(wanted) = std::env::var("SDFC_ONLY") {
        cases.retain(|path| path.to_string_lossy().contains(&wanted));
    }
    let camera = CameraChanges::default;
    let cases: Vec<Case> = cases
        .into_iter()
        .map(|path| Case {
            path,
            camera: camera(),
        })
        .collect();
    let report = errors_of(&cases);
    assert!(report.is_empty(), "\n{report}");
}

/// Returns the errors of all cases, one per line. In the short form, every sixteenth case is drawn by all engines.
pub(crate) fn errors_of(cases: &[Case]) -> String {
    let is_long = std::env::var_os("SDFC_LONG").is_some();
    let max_steps = MAX_ORACLE_STEPS * if is_long { LONG_FACTOR } else { 1 };
    let has_gpu = !is_gpu_skipped();
    let next = AtomicUsize::new(0);
    let reports: Vec<String> = std::thread::scope(|threads| {
        let work = || {
            let mut engines = vec![open(EngineKind::Cpu).expect("there is always a CPU")];
            let mut report = String::new();
            loop {
                let index = next.fetch_add(1, Relaxed);
                let Some(case) = cases.get(index) else {
                    return report;
                };
                let on_all = has_gpu && (is_long || index.is_multiple_of(ALL_ENGINES_STRIDE));
                if on_all && engines.len() == 1 {
                    let others = EngineKind::FAST.into_iter().skip(1);
                    engines.extend(others.map(|kind| open(kind).expect("there is an adapter")));
                }
                let count = if on_all { engines.len() } else { 1 };
                report += &examine(case, &mut engines[..count], max_steps);
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
    reports.concat()
}
