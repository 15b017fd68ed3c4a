//! Default cameras: bounded scenes fill most of the picture and are not cut off.

use crate::corpus::{compiled, compiled_text, name, on_large_stack, scenes};
use crate::strangers::folders;
use glam::DVec3;
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{EngineKind, SceneInput, open};
use sdfc_runtime::render::{Image, Mode, Status};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use std::ops::RangeInclusive;
use std::path::PathBuf;

const SIZE: [u32; 2] = [96, 72];
/// Fraction of the picture's width or height, whichever is larger, that a scene fills.
const FILLED_FRACTION: RangeInclusive<f64> = 0.6..=0.9;

/// Scenes that fill less, with their minimum fraction. The outline of a field is as loose as its interval
/// bounds, and ends thinner than a pixel are invisible.
const LOOSELY_BOUNDED: [(&str, f64); 4] = [
    ("kaleido_snowflake", 0.55),
    ("torus_quartic", 0.45),
    ("normalized_quartic", 0.55),
    ("shelf_rail_two_metres", 0.4),
];

/// Returns the scenes without a camera position.
fn open_scenes() -> Vec<PathBuf> {
    let ours = ["examples", "tests/scenes"].map(PathBuf::from);
    let folders = folders().into_iter().chain(ours);
    let paths = folders.flat_map(|folder| scenes(&folder.to_string_lossy()));
    let is_open = |path: &PathBuf| {
        let text = std::fs::read_to_string(path).expect("the scene can be read");
        !text.contains("from:")
    };
    paths.filter(is_open).collect()
}

/// Returns the fraction of the picture's sides spanned by the hits, and whether they touch its edges.
fn spanned_fraction(image: &Image) -> Option<(f64, bool)> {
    let (mut low, mut high) = ([u32::MAX; 2], [0; 2]);
    for (index, status) in image.status.iter().enumerate() {
        if *status == Status::Hit {
            let index = index as u32;
            let pixel = [index % SIZE[0], index / SIZE[0]];
            for axis in 0..2 {
                low[axis] = low[axis].min(pixel[axis]);
                high[axis] = high[axis].max(pixel[axis]);
            }
        }
    }
    let is_cut = (0..2).any(|axis| low[axis] == 0 || high[axis] == SIZE[axis] - 1);
    let fraction = |axis: usize| f64::from(high[axis] + 1 - low[axis]) / f64::from(SIZE[axis]);
    (low[0] <= high[0]).then(|| (fraction(0).max(fraction(1)), is_cut))
}

#[test]
fn open_cameras_frame_what_has_an_end() {
    let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
    let (mut count, mut failures) = (0, Vec::new());
    for path in open_scenes() {
        let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        let uniform_values = compiled.module.update(0.0);
        let module = &compiled.module;
        // Floors and unbounded fields may fill the picture.
        if module.settings.is_2d || !module.settings.bounds.is_finite() {
            continue;
        }
        let overrides = Overrides {
            size: Some(SIZE),
            aa: Some(1),
            mode: Mode::Depth,
            ..Overrides::default()
        };
        let settings = resolve(module, &uniform_values, &overrides).expect("it has settings");
        let scene = SceneInput {
            module,
            uniform_values: &uniform_values,
            generated: SceneSource::default(),
        };
        engine.load(&scene).expect("it loads");
        let image = engine.render(&settings, &|_| {}).expect("it is drawn");
        let Some((fraction, is_cut)) = spanned_fraction(&image) else {
            continue;
        };
        count += 1;
        let exception = LOOSELY_BOUNDED
            .iter()
            .find(|(scene, _)| *scene == name(&path));
        let min_fraction =
            exception.map_or(*FILLED_FRACTION.start(), |&(_, min_fraction)| min_fraction);
        if is_cut || !(min_fraction..=*FILLED_FRACTION.end()).contains(&fraction) {
            failures.push(format!(
                "{}: {fraction:.2} filled, cut: {is_cut}",
                name(&path)
            ));
        }
    }
    assert!(count >= 40, "{count}");
    assert!(failures.is_empty(), "of {count}:\n{}", failures.join("\n"));
}

/// Default cameras of unbounded scenes show the bounded parts, whichever way a wall faces.
#[test]
fn open_cameras_look_past_walls() {
    let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
    for (axis, sign) in [
        ("X", 1),
        ("X", -1),
        ("Y", 1),
        ("Y", -1),
        ("Z", 1),
        ("Z", -1),
    ] {
        let wall_position = ["X", "Y", "Z"].map(|other| if other == axis { sign } else { 0 });
        let [x, y, z] = wall_position;
        let text = format!("sphere(0.5) | slab({axis}, 0.2).translate({x}, {y}, {z})\n");
        let mut compiled = compiled_text(&text, PassOptions::default());
        let uniform_values = compiled.module.update(0.0);
        let module = &compiled.module;
        let overrides = Overrides {
            size: Some([33, 33]),
            aa: Some(1),
            ..Overrides::default()
        };
        let settings = resolve(module, &uniform_values, &overrides).expect("it has settings");
        let scene = SceneInput {
            module,
            uniform_values: &uniform_values,
            generated: SceneSource::default(),
        };
        engine.load(&scene).expect("it loads");
        let image = engine.render(&settings, &|_| {}).expect("it is drawn");
        let view = settings.view;
        let from = DVec3::from(view.from);
        let view_direction = DVec3::from(view.look) - from;
        let depth = f64::from(image.depth[16 * 33 + 16]);
        let seen = from + view_direction / view_direction.length() * depth;
        assert!(
            (seen.length() - 0.5).abs() < 0.01,
            "{text}{view:?} sees {seen:?}"
        );
    }
}

/// Draws `part`, the bounded part of a text, with the default camera of the text, and returns its spanned
/// fraction.
fn spanned_fraction_of(text: &str, part: &str) -> Option<(f64, bool)> {
    let camera = |text: &str, view| {
        let mut compiled = compiled_text(text, PassOptions::default());
        let uniform_values = compiled.module.update(0.0);
        let overrides = Overrides {
            size: Some(SIZE),
            aa: Some(1),
            view,
            ..Overrides::default()
        };
        let settings = resolve(&compiled.module, &uniform_values, &overrides);
        (compiled, uniform_values, settings.expect("it has settings"))
    };
    let view = camera(text, None).2.view;
    let (compiled, uniform_values, settings) = camera(part, Some(view));
    let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
    let scene = SceneInput {
        module: &compiled.module,
        uniform_values: &uniform_values,
        generated: SceneSource::default(),
    };
    engine.load(&scene).expect("it loads");
    let image = engine.render(&settings, &|_| {}).expect("it is drawn");
    spanned_fraction(&image)
}

/// Returns the pairs of a text and its bounded part that are framed wrongly.
fn framed_wrongly(pairs: impl IntoIterator<Item = (String, String)>) -> Vec<String> {
    let mut failures = Vec::new();
    for (text, part) in pairs {
        match spanned_fraction_of(&text, &part) {
            Some((fraction, false)) if FILLED_FRACTION.contains(&fraction) => {}
            found => failures.push(format!("{text}: {found:?}")),
        }
    }
    failures
}

/// Transforms of a whole scene keep the floor in the background and small parts in the picture.
#[test]
fn open_cameras_frame_transformed_scenes_with_floors() {
    let parts =
        "box(1, 1, 1).translate(0, 0.5, 0) | sphere(0.08).translate(0, 2.5, 0).color(#ff0000)";
    let changes = [
        "",
        ".translate(0, 0.1, 0)",
        ".translate(0.3, 0, 0.2)",
        ".rotate(20deg, X)",
        ".scale(3)",
        ".scale(0.013)",
        ".scale([1, 2, 0.5])",
        ".mirror(X)",
        ".elongate([0.5, 0, 0])",
        ".twist(10deg)",
        ".bend(10deg)",
        ".offset(0.02)",
        ".color(#808080)",
        ".translate(0, 0.1, 0).rotate(10deg, Z).scale(7)",
        ".warp(fn(p) => p + [0, 0.1 * sin(p.x), 0])",
        ".displace(fn(p) => 0.01 * sin(p.x * 9))",
    ];
    let floors = [
        "plane(Y).color(#b8c890)",
        "slab(Y, 1).translate(0, -0.5, 0)",
    ];
    let pair = |floor: &str, change: &str| {
        let text = format!("({parts} | {floor}){change}\n");
        (text, format!("({parts}){change}\n"))
    };
    let pairs = changes.iter().map(|change| pair(floors[0], change));
    let others = changes
        .iter()
        .step_by(4)
        .map(|change| pair(floors[1], change));
    let mut pairs: Vec<_> = pairs.chain(others).collect();
    let house = "sphere(0.03).translate(0, 1, 0) | cylinder(r: 0.33, h: 0.1)";
    for scale in [0.01, 0.3, 7.0, 23.5, 100.0, 314.0, 1777.0] {
        let text = format!("({house} | plane(Y, at: -0.5)).scale({scale})\n");
        pairs.push((text, format!("({house}).scale({scale})\n")));
    }
    // Equivalent notations.
    for (text, part) in [
        (
            "!(!(box(1) | sphere(0.1).translate(0, 2, 0)) & !plane(Y))",
            "box(1, 0.5, 1).translate(0, 0.25, 0) | sphere(0.1).translate(0, 2, 0)",
        ),
        // Parts hidden by a floor are not framed.
        (
            "(cylinder(r: 0.3, h: 8).translate(0, -3, 0) | box(2, 0.2, 2).translate(0, 1, 0)).color(#c05050) | plane(Y)",
            "cylinder(r: 0.3, h: 1).translate(0, 0.5, 0) | box(2, 0.2, 2).translate(0, 1, 0)",
        ),
        (
            "box(1).translate(0, 0.5, 0) | sphere(3).translate(5, -4, 0) | plane(Y)",
            "box(1).translate(0, 0.5, 0)",
        ),
        (
            "(box(1) | plane(Y, at: -0.5)) & !sphere(0.6)",
            "box(1) - sphere(0.6)",
        ),
        (
            "(box(1) | plane(Y, at: -0.5)).rotate(10deg, X) - sphere(0.6)",
            "box(1).rotate(10deg, X) - sphere(0.6)",
        ),
    ] {
        pairs.push((format!("{text}\n"), format!("{part}\n")));
    }
    let failures = framed_wrongly(pairs);
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// For a field written as a minimum, the bounded operands are framed.
#[test]
fn open_cameras_frame_finite_parts_of_fields() {
    let cuboid = "max(max(abs(p.x) - 1, abs(p.y) - 0.5), abs(p.z) - 0.7)";
    let ball = "length(p - [0, 1.5, 0]) - 0.1";
    let floor = "p.y + 0.5";
    let fold = "{ let a = atan2(p.z, p.x) * 12 / tau; let b = (a - round(a)) * tau / 12; let r = length(p.xz);";
    let balls = "length([r * cos(b) - 1, p.y, r * sin(b)]) - 0.2";
    let field = |body: &str| format!("field(fn(p) => {body})\n");
    let combined = format!("min({cuboid}, {ball})");
    let pairs = [
        (format!("min({cuboid}, {floor})"), cuboid.to_owned()),
        (format!("min({floor}, {cuboid})"), cuboid.to_owned()),
        (
            format!("min(min({cuboid}, {ball}), {floor})"),
            combined.clone(),
        ),
        (
            format!("min({cuboid}, min({floor}, {ball}))"),
            combined.clone(),
        ),
        (
            format!("{{ let d = {cuboid}; let e = min(d, {floor}); min(e, {ball}) }}"),
            combined.clone(),
        ),
        (format!("0.1 * min({cuboid}, {floor})"), cuboid.to_owned()),
        (format!("-max(-({cuboid}), -({floor}))"), cuboid.to_owned()),
        (
            format!("min({cuboid}, {floor}) - 0.1"),
            format!("{cuboid} - 0.1"),
        ),
        (
            format!("max(min({cuboid}, {floor}), -({ball}))"),
            cuboid.to_owned(),
        ),
        (format!("{fold} {balls} }}"), format!("{fold} {balls} }}")),
        (
            format!("{fold} min({balls}, p.y + 0.2) }}"),
            format!("{fold} {balls} }}"),
        ),
    ];
    let pairs = pairs.map(|(text, part)| (field(&text), field(&part)));
    let failures = framed_wrongly(pairs);
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Solids with loose bounding boxes fill the picture too.
#[test]
fn open_cameras_frame_turned_and_twisted_solids() {
    let gear = "(cylinder(r: 20, h: 8) | box(48, 8, 6) | box(6, 8, 48))";
    let arc = "circle(3).translate(20, 0).revolve(angle: 120deg)";
    let tooth = "polygon([[20, -2.5], [24, -1], [24, 1], [20, 2.5]])";
    let texts = [
        format!("(circle(20.3) | {tooth}.polar(16)).extrude(20).twist(4deg)"),
        format!("(circle(20.3) | {tooth}.polar(16)).extrude(20).rotate(90deg, X).twist(4deg)"),
        "rect(6, 10).translate(38, 0).revolve(angle: 120deg).rotate(37deg, Y)".to_owned(),
        format!("{gear}.twist(3deg)"),
        format!("{gear}.twist(3deg).rotate(30deg, Z)"),
        format!("{arc}.rotate(40deg, Y)"),
        format!("{arc}.rotate(90deg, X)"),
        format!("{arc}.rotate(40deg, Y).rotate(30deg, X)"),
        "capsule(r: 0.1, h: 3).rotate(45deg, Z).rotate(45deg, Z)".to_owned(),
        "torus(r1: 2, r2: 0.1).rotate(45deg, X).rotate(35deg, Z)".to_owned(),
    ];
    let pairs = texts.map(|text| (format!("{text}\n"), format!("{text}\n")));
    let failures = framed_wrongly(pairs);
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// The default radius of occlusion scales with the unit.
#[test]
fn default_lengths_follow_the_unit() {
    let superellipsoid =
        "pow(pow(abs(p.x / 1.2), 5) + pow(abs(p.y / 0.7), 5) + pow(abs(p.z), 5), 0.2) - 1";
    for field in [
        format!("min({superellipsoid}, p.y + 0.9)"),
        superellipsoid.to_owned(),
        "p.y - 0.3 * sin(3 * p.x) * sin(3 * p.z)".to_owned(),
    ] {
        let relative_reach = |unit: f64| {
            let text = format!(
                "camera {{ from: [{}, {}, {}], look: [0, 0, 0], fov: 40deg }}\nfield(fn(q) => {{ let p = q / {unit}; {unit} * ({field}) }})\n",
                3.0 * unit,
                2.0 * unit,
                4.0 * unit
            );
            let mut compiled = compiled_text(&text, PassOptions::default());
            let uniform_values = compiled.module.update(0.0);
            let settings = resolve(&compiled.module, &uniform_values, &Overrides::default());
            settings.expect("it has settings").occlusion_reach / unit
        };
        let unit_reach = relative_reach(1.0);
        for unit in [0.001, 0.1, 20.0, 1000.0] {
            let ratio = relative_reach(unit) / unit_reach;
            // Bounds found by bisection are some hundredths too large.
            assert!((0.95..=1.05).contains(&ratio), "{field} in {unit}: {ratio}");
        }
    }
}

/// The default camera's distance from an object on unbounded ground equals that without the ground.
#[test]
fn open_cameras_frame_what_stands_on_endless_grounds() {
    let distance = |text: &str| {
        let mut compiled = compiled_text(text, PassOptions::default());
        let uniform_values = compiled.module.update(0.0);
        let settings = resolve(&compiled.module, &uniform_values, &Overrides::default());
        let view = settings.expect("it has settings").view;
        view.target_distance()
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

/// Solids that extend downwards without bound are framed by their part above a floor.
#[test]
fn open_cameras_frame_what_rises_from_floors() {
    let waves = "field(fn(p) => max(p.y - 0.5 * sin(2 * p.x) * sin(2 * p.z), max(abs(p.xz)) - 4))";
    let steps = "field(fn(p) => max(p.y - ((floor(p.x) * 13 + floor(p.z) * 29) % 17) / 17, max(abs(p.xz)) - 4))";
    let pillar = "(slab(X, 0.6) & slab(Z, 0.8) & plane(Y, at: 2))";
    let cases = [(waves, -0.2), (steps, 0.3), (pillar, 0.0), (pillar, -1.0)];
    let pairs = cases.map(|(solid, floor)| {
        let above = format!(
            "({solid}) & box(40, 40, 40).translate(0, {}, 0)",
            20.0 + floor
        );
        (format!("{solid} | plane(Y, at: {floor})"), above)
    });
    let failures = framed_wrongly(pairs);
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
