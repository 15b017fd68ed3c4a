//! Level of detail: pictures keep visible features, values stay within their bounds, and distant parts
//! take fewer instructions.

use crate::corpus::{name, on_large_stack, scene, scenes};
use glam::DVec3;
use sdfc_compiler::compile::{self, Compiled, compile};
use sdfc_compiler::elaborate::{self, elaborate};
use sdfc_compiler::passes::lod::{LodReport, LodTarget, PixelSize};
use sdfc_compiler::scene::Scene;
use sdfc_lang::Sources;
use sdfc_runtime::engine::{EngineKind, SceneInput, open};
use sdfc_runtime::render::{Image, RenderSettings, ResolvedLens};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use sdfc_trials::random::Random;
use sdfc_vm::evaluate::evaluate;
use sdfc_vm::program::Program;
use sdfc_vm::vector::V3;

const SIZE: [u32; 2] = [96, 72];
/// Hit threshold of a march and allowance for rounding, relative to the distance from the camera.
const HIT_TOLERANCE: f64 = 1e-4;

/// Four hundred distant spheres behind a near one. At 60 units a pixel covers half a unit, a sphere a
/// fifth of it.
const CLUSTERS: &str = "camera { from: [0, 3, 10], look: [0, 0, 0], fov: 40deg }\n\
    let far = for i in 0..400 { sphere(0.05).translate(fract(i * 0.618) * 4 - 2, \
    fract(i * 0.377), -60 - floor(i / 20) * 0.1) };\n\
    union(far) | sphere(1) | union(box(1).translate(3, 0, 0), \
    sphere(0.7).translate(3.4, 0.5, 0), smooth: 0.002)\n";

/// A readable scene: a blend, an offset and a pile too small for their pixels, and one of each that is
/// large enough.
const SMALL: &str = "let pile = sphere(0.01) | box(0.02).translate(0.02, 0, 0).rotate(10deg, Y);\n\
    union(box(1), sphere(0.6).translate(0, 0.5, 0), smooth: 0.001).offset(0.0002)\n\
    | pile.translate(0, 2, 0) | union(sphere(0.3), sphere(0.3).translate(0.3, 0, 0), smooth: 0.1)\
    .translate(2, 0, 0)\n";

fn scene_from_text(text: &str) -> Scene {
    let mut sources = Sources::new();
    let file = sources.add("text", text.to_owned());
    let (scene, surface_points) = elaborate(&mut sources, file, &elaborate::Options::default());
    scene.unwrap_or_else(|| panic!("{surface_points:?}"))
}

fn compiled(scene: Scene, sight: Option<LodTarget>) -> Compiled {
    let options = compile::Options {
        lod_target: sight,
        ..compile::Options::default()
    };
    let (compiled, surface_points) = compile(scene, &options);
    compiled.unwrap_or_else(|| panic!("{surface_points:?}"))
}

fn settings(compiled: &mut Compiled) -> (Vec<f64>, RenderSettings) {
    let uniform_values = compiled.module.update(0.0);
    let overrides = Overrides {
        size: Some(SIZE),
        aa: Some(1),
        ..Overrides::default()
    };
    let settings = resolve(&compiled.module, &uniform_values, &overrides).expect("it has settings");
    (uniform_values, settings)
}

/// The full scene and the scene simplified for its camera.
struct Pair {
    full: Compiled,
    simple: Compiled,
    settings: RenderSettings,
    sight: LodTarget,
    loss: LodReport,
}

fn pair(make: impl Fn() -> Scene, tolerance: f64) -> Pair {
    let mut full = compiled(make(), None);
    let (_, settings) = settings(&mut full);
    let pixel = match settings.view.lens {
        ResolvedLens::Perspective(angle) => PixelSize::from_perspective(angle, SIZE),
        ResolvedLens::Orthographic(pixel_color) => PixelSize::from_parallel(pixel_color, SIZE),
    };
    let camera = settings.view.from;
    let sight = LodTarget {
        camera_position: camera,
        pixel,
        tolerance,
    };
    let mut simple = compiled(make(), Some(sight));
    simple.module.update(0.0);
    let loss = simple.passes.iter().find_map(|pass| pass.loss);
    Pair {
        full,
        simple,
        settings,
        sight,
        loss: loss.expect("the pass ran"),
    }
}

/// Returns surface points: the ends of rays from the camera through the scene's bounding box.
fn surface(program: &Program, pair: &Pair, rays: u32) -> Vec<([f64; 3], f64)> {
    let view = &pair.settings.view;
    let from = DVec3::from(view.from);
    let middle = DVec3::from(view.look) - from;
    let length = middle.length();
    let mut random = Random::for_case("directions");
    let mut random = || 2.0 * random.unit() - 1.0;
    let mut surface_points = Vec::new();
    for _ in 0..rays {
        let to = middle / length + 0.3 * DVec3::new(random(), random(), random());
        let direction = to / to.length();
        let (mut distance, mut steps) = (0.0, 0);
        while distance < 4.0 * length.max(40.0) && steps < 200 {
            let p = (from + direction * distance).to_array();
            let value = value_at(program, p);
            if value < HIT_TOLERANCE * distance {
                surface_points.push((p, distance));
                break;
            }
            distance += value;
            steps += 1;
        }
    }
    surface_points
}

fn value_at(program: &Program, [x, y, z]: [f64; 3]) -> f64 {
    f64::from(evaluate::<f32>(
        program,
        V3::new(x as f32, y as f32, z as f32),
    ))
}

/// On the surface of one program, the value of the other one is within the error. Both directions are
/// checked, except inside the solid.
fn compare_surfaces(what: &str, pair: &Pair) {
    let (full, simple) = (&pair.full.module.distance, &pair.simple.module.distance);
    for (program, other, is_simple) in [(simple, full, true), (full, simple, false)] {
        for (p, distance) in surface(program, pair, 400) {
            let value = value_at(other, p);
            let allowed = pair.loss.max_error_pixels * pair.sight.pixel_size(distance)
                + 4.0 * HIT_TOLERANCE * distance;
            assert!(
                value <= allowed && (!is_simple || value >= -allowed),
                "{what}: {value} at {p:?}, {allowed} is allowed for {:?}",
                pair.loss
            );
        }
    }
}

#[test]
fn surfaces_are_where_they_were_but_for_the_error() {
    let mut replaced = Vec::new();
    for path in scenes("tests/scenes").iter().chain(&scenes("examples")) {
        on_large_stack(|| {
            for tolerance in [1.0, 8.0] {
                let pair = pair(|| scene(path), tolerance);
                assert!(pair.loss.max_error_pixels <= tolerance, "{:?}", pair.loss);
                if pair.loss.replaced > 0 {
                    compare_surfaces(&name(path), &pair);
                }
            }
        });
        let loss = on_large_stack(|| pair(|| scene(path), 8.0).loss);
        if loss.replaced > 0 {
            replaced.push(name(path));
        }
    }
    assert!(replaced.len() >= 3, "{replaced:?}");
    let clusters = pair(|| scene_from_text(CLUSTERS), 1.0);
    compare_surfaces("clusters", &clusters);
}

#[test]
fn far_clusters_take_fewer_instructions() {
    let pair = pair(|| scene_from_text(CLUSTERS), 1.0);
    let length = |compiled: &Compiled| compiled.module.distance.code.len();
    let (full, simple) = (length(&pair.full), length(&pair.simple));
    assert!(3 * simple <= full, "{full} and {simple} instructions");
    assert!(pair.loss.replaced >= 200, "{:?}", pair.loss);
    assert!(
        (0.5..=1.0).contains(&pair.loss.max_error_pixels),
        "{:?}",
        pair.loss
    );
}

fn draw(compiled: &mut Compiled) -> Image {
    let (uniform_values, settings) = settings(compiled);
    let mut engine = open(EngineKind::Cpu).expect("every machine has a processor");
    let loaded = SceneInput {
        module: &compiled.module,
        uniform_values: &uniform_values,
        generated: SceneSource::default(),
    };
    engine.load(&loaded).expect("the scene loads");
    engine.render(&settings, &|_| {}).expect("it is drawn")
}

/// A pixel that differs by more than 3 % of the screen range lies within two pixels of one that the other
/// picture contains. Edges and shading move by at most one pixel.
#[test]
fn pictures_differ_at_edges_only() {
    let mut pair = pair(|| scene_from_text(CLUSTERS), 1.0);
    let [a, b] = [&mut pair.full, &mut pair.simple].map(|compiled| draw(compiled).rgba8());
    let [width, height] = SIZE.map(|side| side as i64);
    let pixel = |of: &[u8], x: i64, y: i64| -> [u8; 3] {
        let from = ((y * width + x) * 4) as usize;
        [of[from], of[from + 1], of[from + 2]]
    };
    let alike = |a: [u8; 3], b: [u8; 3]| (0..3).all(|i| a[i].abs_diff(b[i]) <= 8);
    let mut differing = 0;
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let pixel_color = pixel(&b, x, y);
        if alike(pixel_color, pixel(&a, x, y)) {
            continue;
        }
        differing += 1;
        let neighbours = (-2..=2).flat_map(|dy| (-2..=2).map(move |dx| (x + dx, y + dy)));
        let mut neighbours =
            neighbours.filter(|(x, y)| (0..width).contains(x) && (0..height).contains(y));
        let edge = neighbours
            .clone()
            .any(|(nx, ny)| !alike(pixel(&a, nx, ny), pixel(&a, x, y)));
        let is_nearby = neighbours.any(|(nx, ny)| alike(pixel(&a, nx, ny), pixel_color));
        assert!(edge || is_nearby, "{x}, {y} shows {pixel_color:?}");
    }
    assert!(differing < SIZE[0] * SIZE[1] / 20, "{differing} pixels");
}

#[test]
fn the_dump_shows_omitted_detail() {
    let pair = pair(|| scene_from_text(SMALL), 1.0);
    let notes = pair.simple.passes.iter().find(|pass| pass.name == "lod");
    let text = format!(
        "{SMALL}\n--- before\n{}\n--- after: {}\n{}",
        pair.full.optimized.dump(),
        notes.expect("the pass is known").notes.join("; "),
        pair.simple.optimized.dump()
    );
    insta::with_settings!({ prepend_module_to_snapshot => false, omit_expression => true }, {
        insta::assert_snapshot!("pass__lod", text);
    });
}
