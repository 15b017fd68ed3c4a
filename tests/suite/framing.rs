//! Cameras that scenes leave open: what has an end fills most of the picture, and nothing of it is cut off.

use crate::corpus::{compiled, compiled_text, name, on_large_stack, scenes};
use crate::strangers::folders;
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{EngineKind, Loaded, open};
use sdfc_runtime::frame::{Frame, Status};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use std::ops::RangeInclusive;
use std::path::PathBuf;

const SIZE: [u32; 2] = [96, 72];
/// The share of the picture's width or height, whichever is larger, that a scene fills.
const FILLED: RangeInclusive<f64> = 0.6..=0.9;

/// Scenes that fill less, by what: the outline of a field is as loose as its intervals are, and ends that are
/// thinner than a pixel are not seen.
const LOOSE: [(&str, f64); 4] = [
    ("kaleido_snowflake", 0.55),
    ("torus_quartic", 0.45),
    ("normalized_quartic", 0.55),
    ("shelf_rail_two_metres", 0.4),
];

/// The scenes without a place for their camera.
fn left_open() -> Vec<PathBuf> {
    let ours = ["examples", "tests/scenes"].map(PathBuf::from);
    let folders = folders().into_iter().chain(ours);
    let paths = folders.flat_map(|folder| scenes(&folder.to_string_lossy()));
    let is_open = |path: &PathBuf| {
        let text = std::fs::read_to_string(path).expect("the scene can be read");
        !text.contains("from:")
    };
    paths.filter(is_open).collect()
}

/// The share of the picture's sides that the hits span, and if they touch its edges.
fn spanned(frame: &Frame) -> Option<(f64, bool)> {
    let (mut low, mut high) = ([u32::MAX; 2], [0; 2]);
    for (at, status) in frame.status.iter().enumerate() {
        if *status == Status::Hit {
            let at = at as u32;
            let place = [at % SIZE[0], at / SIZE[0]];
            for axis in 0..2 {
                low[axis] = low[axis].min(place[axis]);
                high[axis] = high[axis].max(place[axis]);
            }
        }
    }
    let is_cut = (0..2).any(|axis| low[axis] == 0 || high[axis] == SIZE[axis] - 1);
    let share = |axis: usize| f64::from(high[axis] + 1 - low[axis]) / f64::from(SIZE[axis]);
    (low[0] <= high[0]).then(|| (share(0).max(share(1)), is_cut))
}

#[test]
fn open_cameras_frame_what_has_an_end() {
    let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
    let (mut tried, mut wrong) = (0, Vec::new());
    for path in left_open() {
        let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        let outputs = compiled.module.update(0.0);
        let module = &compiled.module;
        // Of floors and endless fields the picture may be full.
        if module.settings.plane || !module.settings.bounds.is_finite() {
            continue;
        }
        let overrides = Overrides {
            size: Some(SIZE),
            aa: Some(1),
            ..Overrides::default()
        };
        let settings = resolve(module, &outputs, &overrides).expect("it has settings");
        let scene = Loaded {
            module,
            outputs: &outputs,
            generated: SceneSource::default(),
        };
        engine.load(&scene).expect("it loads");
        let frame = engine.render(&settings, &|_| {}).expect("it is drawn");
        let Some((share, is_cut)) = spanned(&frame) else {
            continue;
        };
        tried += 1;
        let loose = LOOSE.iter().find(|(scene, _)| *scene == name(&path));
        let least = loose.map_or(*FILLED.start(), |&(_, least)| least);
        if is_cut || !(least..=*FILLED.end()).contains(&share) {
            wrong.push(format!("{}: {share:.2} filled, cut: {is_cut}", name(&path)));
        }
    }
    assert!(tried >= 40, "{tried}");
    assert!(wrong.is_empty(), "of {tried}:\n{}", wrong.join("\n"));
}

/// Open cameras of endless scenes see what has an end, whichever way a wall stands.
#[test]
fn open_cameras_look_past_walls() {
    let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
    for (axis, way) in [
        ("X", 1),
        ("X", -1),
        ("Y", 1),
        ("Y", -1),
        ("Z", 1),
        ("Z", -1),
    ] {
        let place = ["X", "Y", "Z"].map(|other| if other == axis { way } else { 0 });
        let [x, y, z] = place;
        let text = format!("sphere(0.5) | slab({axis}, 0.2).translate({x}, {y}, {z})\n");
        let mut compiled = compiled_text(&text, PassOptions::default());
        let outputs = compiled.module.update(0.0);
        let module = &compiled.module;
        let overrides = Overrides {
            size: Some([33, 33]),
            aa: Some(1),
            ..Overrides::default()
        };
        let settings = resolve(module, &outputs, &overrides).expect("it has settings");
        let scene = Loaded {
            module,
            outputs: &outputs,
            generated: SceneSource::default(),
        };
        engine.load(&scene).expect("it loads");
        let frame = engine.render(&settings, &|_| {}).expect("it is drawn");
        let view = settings.view;
        let way: [f64; 3] = std::array::from_fn(|axis| view.look[axis] - view.from[axis]);
        let length = way.iter().map(|v| v * v).sum::<f64>().sqrt();
        let depth = f64::from(frame.depth[16 * 33 + 16]);
        let seen: [f64; 3] = std::array::from_fn(|i| view.from[i] + way[i] / length * depth);
        let radius = seen.iter().map(|v| v * v).sum::<f64>().sqrt();
        assert!((radius - 0.5).abs() < 0.01, "{text}{view:?} sees {seen:?}");
    }
}

/// Open cameras stand as far away from what stands on a ground without an end as if there were none.
#[test]
fn open_cameras_frame_what_stands_on_endless_grounds() {
    let distance = |text: &str| {
        let mut compiled = compiled_text(text, PassOptions::default());
        let outputs = compiled.module.update(0.0);
        let settings = resolve(&compiled.module, &outputs, &Overrides::default());
        let view = settings.expect("it has settings").view;
        let squares = (0..3).map(|axis| (view.look[axis] - view.from[axis]).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let alone = distance("cylinder(r: 1, h: 4)");
    for ground in [
        "plane(Y, at: -2)",
        "slab(Y, 1).translate(0, -2.5, 0)",
        "field(fn(p) => p.y + 2 + 0.02 * dot(p.xz, p.xz))",
        "field(fn(p) => p.y + 2 + 0.02 * dot(p.xz, p.xz) + 0.1 * noise(p))",
        "field(fn(p) => p.y + 2.5 - 0.5 * sin(p.x) * sin(p.z))",
        "field(fn(p) => p.y + 3 - fbm(p.xz))",
        "field(fn(p) => p.y + 2 + sqrt(1 + dot(p.xz, p.xz)) - 1)",
        "field(fn(p) => p.y + 2 + pow(p.x, 4) * 0.001)",
    ] {
        let found = distance(&format!("cylinder(r: 1, h: 4) | {ground}"));
        let ratio = found / alone;
        assert!(
            (0.8..=1.25).contains(&ratio),
            "{ground}: {found} for {alone}"
        );
    }
}
