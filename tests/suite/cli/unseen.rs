//! Messages about pictures that show nothing, or not the whole scene.

use super::sandbox::Sandbox;
use crate::metamorphic::draw::{DrawOptions, image};
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{EngineKind, open};
use sdfc_runtime::render::CellMode;

/// Scenes, and a part of the message when they are drawn; an empty string means no message.
const SCENES: &[(&str, &str, &str)] = &[
    ("a scene that is seen", "sphere(1) | plane(Y, at: -1)", ""),
    (
        "a floor seen from the front, half of it from inside",
        "camera { from: [0, 0, 20], look: [0, 0, 0], height: 4 }\nplane(Y) | sphere(1)",
        "% of the rays begin inside of a solid and never leave it",
    ),
    (
        "a slab seen from the front",
        "camera { from: [0, 0, 20], look: [0, 0, 0], height: 4 }\nbox([3, 0.2, 3]) | sphere(1)",
        "",
    ),
    (
        "a union of nothing",
        "union([])",
        "nothing is seen: the scene has no solid",
    ),
    (
        "all cut away",
        "box(1) - box(2)",
        "Perhaps all of it is cut away",
    ),
    (
        "a Mandelbulb that goes on with what has left it",
        "field(fn(p) => {\n\
             let step = fn(s, i) => {\n\
                 let r = length(s.xyz);\n\
                 let th = 8 * acos(s.z / r);\n\
                 let ph = 8 * atan2(s.y, s.x);\n\
                 let z = pow(r, 8) * vec3(sin(th) * cos(ph), sin(th) * sin(ph), cos(th)) + p;\n\
                 vec4(z, 8 * pow(r, 7) * s.w + 1)\n\
             };\n\
             let s = fold(0..4, vec4(p, 1), step);\n\
             let r = length(s.xyz);\n\
             0.5 * ln(r) * r / s.w\n\
         })",
        "(100.00 %) met a distance that is not a number",
    ),
    (
        "a Julia set without a bailout in a box",
        "camera { from: [3.2, 1.6, 2.6], look: [0, 0, 0], fov: 40deg }\n\
         fn q2(a: vec4, c: vec4) -> vec4 =\n\
             [a.x*a.x - a.y*a.y - a.z*a.z - a.w*a.w, 2*a.x*a.y, 2*a.x*a.z, 2*a.x*a.w] + c;\n\
         fn it(a: vec4, c: vec4, n) -> vec4 = if n == 0 { a } else { it(q2(a, c), c, n - 1) };\n\
         field(fn(p) => length(it([p.x, p.y, p.z, 0], [-0.2, 0.6, 0.2, 0.2], 9)) - 2, within: 4)",
        "",
    ),
    (
        "a ball whose size is a power that overflows",
        "field(fn(p) => length(p) - 1 - 0.5 * saturate(pow(p.x * 20, 60) - pow(p.y * 20, 60)), within: 3)",
        "the field overflows f32",
    ),
    (
        "a ball that is no number on one side, and a floor",
        "camera { from: [3.2, 1.6, 2.6], look: [0, 0, 0], fov: 40deg }\n\
         field(fn(p) => length(p) - 1 + exp(900 * p.x) - exp(900 * p.x)) | plane(Y, at: -1)",
        "pixels are black, since their color is not a number",
    ),
    (
        "a field without a sign",
        "field(fn(p) => abs(length(p) - 1), within: 3)",
        "nothing is seen: the scene has no solid, its field is nowhere below zero",
    ),
    (
        "a 2-D shape without an edge",
        "field(fn(p: vec2) => -1 - p.x * p.x)",
        "all of the picture is inside of the shape",
    ),
    (
        "a line thinner than a pixel",
        "camera { from: [0, 0, 5], look: [0, 0, 0], height: 0.1 }\nrect(0.00003, 3)",
        "",
    ),
    (
        "an endless plot whose edges are far",
        "field(fn(p: vec2) => p.x * p.y - 1e8)",
        "",
    ),
    (
        "an endless plot whose edges are near",
        "field(fn(p: vec2) => p.y - 1e10 * p.x * p.x - 1e-10)",
        "",
    ),
    (
        "a lamp above a floor in millimetres",
        "scene { units: mm, up: z }\n\
         camera { from: [3000, -4000, 2000], look: [0, 0, 0], fov: 40deg }\n\
         light lamp { at: [0, 0, 2000], intensity: 4 }\n\
         box(4000, 4000, 20)",
        "is too faint to be visible: it falls off with the square of the distance",
    ),
    (
        "a sun whose direction leads to the ground",
        "camera { from: [3, 3, 5], look: [0, 0, 0], fov: 40deg }\n\
         light sun { dir: [0.2, -1, 0] }\n\
         sphere(1) | plane(Y, at: -1)",
        "perhaps `dir: [-0.196, 0.981, 0]` was meant",
    ),
    (
        "the default light behind a wall",
        "camera { from: [3, 3, 5], look: [0, 0, 0], fov: 40deg }\n\
         sphere(0.5) | plane(X, at: -1.2) | plane(Y, at: -0.5)",
        "perhaps `dir: [0.444, 0.726, 0.525]` was meant",
    ),
    (
        "a field that is the difference of equal numbers, on a floor",
        "camera { from: [3, 3, 5], look: [0, 0, 0], fov: 40deg }\n\
         field(fn(p) => length(p) - length(p)) | sphere(1) | plane(Y, at: -1)",
        "this field is below zero nowhere",
    ),
    (
        "a glow from below without shadows",
        "camera { from: [3, 3, 5], look: [0, 0, 0], fov: 40deg }\n\
         light glow { dir: [0.2, -1, 0], shadow: none }\n\
         sphere(1) | plane(Y, at: -1)",
        "",
    ),
    (
        "a floor that the camera looks away from",
        "camera { from: [0, 2, 0], look: [0, 5, 1] }\nplane(Y)",
        "meets a surface, and the field is below zero near",
    ),
    (
        "a sheet far from the origin",
        "scene { units: mm, up: z }\n\
         camera { from: [1001500, -3500, 1700], look: [1000000, 0, 850], fov: 35deg }\n\
         box(800, 0.5, 1800).translate(1000000, 0, 900)",
        "coordinates as large as these are rounded by more",
    ),
    (
        "a sheet far from the origin, on a floor",
        "camera { from: [1003, 2.5, 4], look: [1000, 0, 0], fov: 40deg }\n\
         box(1.5, 0.0005, 1.5).translate(1000, 0, 0) | plane(Y, at: -1)",
        "a part near [1000, 0, 0] is 0.0005 thin",
    ),
    (
        "a sheet through a telescope, on a floor",
        "camera { from: [300, 250, 400], look: [0, 0, 0], fov: 0.4deg }\n\
         box(1.5, 0.001, 1.5) | plane(Y, at: -1)",
        "",
    ),
    (
        "a field that only touches zero",
        "field(fn(p) => dot(p, p) - 2 * length(p) + 1, within: 3)",
        "such as `.offset(0.01)`",
    ),
    (
        "balls between all samples",
        "sphere(0.001) | sphere(0.001).translate(300, 200, 100)",
        "Its thickest part is about",
    ),
    (
        "a sheet without an inside on a floor",
        "field(fn(p) => abs(length(p) - 0.7)) | plane(Y, at: -1)",
        "warning[W0402]: this field is below zero nowhere",
    ),
    (
        "a square on a floor",
        "field(fn(p) => (length(p) - 0.7) * (length(p) - 0.7)) | plane(Y, at: -1)",
        "warning[W0402]: this field is below zero nowhere",
    ),
    (
        "a ball with a pole in its middle, which moves nothing that is seen",
        "field(fn(p) => 1 / 0.7 - 1 / length(p)) | plane(Y, at: -1)",
        "",
    ),
    (
        "a ball with a steeper pole",
        "field(fn(p) => 1 / 0.49 - 1 / dot(p, p)) | plane(Y, at: -1)",
        "",
    ),
    (
        "a camera that looks away",
        "camera { from: [0, 0, 5], look: [0, 0, 9] }\nsphere(1)",
        "nothing is seen: the camera at [0, 0, 5] looks away, towards [0, 0, 9]",
    ),
    (
        "a camera that looks past",
        "camera { from: [0, 0, 9], look: [9, 0, 0] }\nsphere(1)",
        "looks past it, towards [9, 0, 0], and the scene lies between [-1, -1, -1] and [1, 1, 1]: `look: [0, 0, 0]` shows it",
    ),
    (
        "a rod thinner than a pixel",
        "camera { from: [8.8, 8, 11.7], look: [0, 0, 0], fov: 40deg }\ncylinder(r: 0.001, h: 10)",
        "no ray meets the scene, which is in view",
    ),
    (
        "a scene too far away",
        "camera { from: [0, 0, 9000], look: [0, 0, 0] }\nsphere(1)",
        "pixels high from [0, 0, 9000]",
    ),
    (
        "rays that end before",
        "camera { from: [0, 0, 9], look: [0, 0, 0] }\nrender { far: 5 }\nsphere(1)",
        "rays go no farther than 5 (`far`)",
    ),
    (
        "a camera within a solid",
        "camera { from: [0, 0, 0.5], look: [0, 0, 0] }\nsphere(1)",
        "the camera is inside a solid: at [0, 0, 0.5] the field is -0.5",
    ),
    (
        "everything but a ball",
        "!sphere(1)",
        "the camera is inside a solid",
    ),
    (
        "a field with its sign reversed",
        "camera { from: [0, 0, 5], look: [0, 0, 0] }\nfield(fn(p) => 1 - length(p))",
        "negate a field that is positive inside",
    ),
    (
        "everything inside",
        "field(fn(p) => -1 - dot(p, p))",
        "all of space is inside",
    ),
    (
        "a field that is defined nowhere",
        "field(fn(p) => sqrt(-1 - dot(p, p)))",
        "the field is not defined at any of",
    ),
    (
        "a field with its highest points at zero",
        "field(fn(p) => p.y + 1 - sin(p.x) * sin(p.z))",
        "",
    ),
    (
        "balls below a plane through the origin",
        "field(fn(p) => max(p.y, length((p % 2) - [1, 1, 1]) - 0.5))",
        "",
    ),
    (
        "a light within a solid",
        "light { at: [0, 0.2, 0] }\nsphere(1)",
        "the light at [0, 0.2, 0] is inside a solid",
    ),
    (
        "a light within a solid that casts no shadow",
        "light { at: [0, 0.2, 0], shadow: none }\nsphere(1)",
        "",
    ),
    (
        "a ball in thick fog",
        "sky { fog: 5 }\nsphere(1)",
        "the fog hides all surfaces: the nearest is",
    ),
    ("a ball in thin fog", "sky { fog: 0.2 }\nsphere(1)", ""),
    (
        "a light without intensity",
        "light { dir: [1, 1, 1], intensity: 0 }\nsky { ambient: 0 }\nplane(Y)",
        "all of the picture is black: the brightest of 1 lights has 0 as color times `intensity`, and `ambient` is 0",
    ),
    (
        "a ball without light before a sky",
        "light { dir: [1, 1, 1], intensity: 0 }\nsky { ambient: 0 }\nsphere(1)",
        "all surfaces are black: the brightest of 1 lights has 0 as color times `intensity`, and `ambient` is 0",
    ),
    (
        "a glowing ball without light",
        "material glow { color: #ffffff, emission: #ffffff }\nlight { dir: [1, 1, 1], intensity: 0 }\nsky { ambient: 0 }\n\
         sphere(1).material(glow)",
        "",
    ),
    (
        "a picture without exposure",
        "render { exposure: 0 }\nsphere(1) | plane(Y, at: -1)",
        "all of the picture is black: its `exposure` is 0",
    ),
    (
        "a camera below a shadow",
        "camera { from: [0, 4, 0.1], look: [0, 0, 0] }\nsky { ambient: 0 }\n\
         light { dir: [0, 1, 0] }\nplane(Y) | plane(-Y, at: -9)",
        "none of 1 lights reaches what is in view",
    ),
    (
        "a face that fills the picture",
        "plane(Y)",
        "all of the picture has one color: a flat face fills it",
    ),
    (
        "a part below a floor",
        "sphere(4).translate(0, -20, 0) | plane(Y)",
        "all parts but floors and walls without an end lie between [-4, -24, -4] and [4, -16, 4]",
    ),
    (
        "a part flush with a floor",
        "box(10).translate(0, -5, 0) | plane(Y)",
        "inside of one of these, which hides them",
    ),
    (
        "a part sunk into a floor",
        "box(10).translate(0, -4, 0) | plane(Y)",
        "",
    ),
    (
        "a figure that is nowhere",
        "circle(1) - circle(2)",
        "Perhaps all of it is cut away",
    ),
];

#[test]
fn invisible_scenes_are_reported_with_the_reason() {
    for (title, scene, message) in SCENES {
        let sandbox = Sandbox::with_scene(scene);
        let run = sandbox.run("render scene.sdf -o out.png --size 48x36 --aa 1");
        let run = run.ok();
        let is_said = match message.is_empty() {
            // Messages about unbounded slopes are always allowed.
            true => run.stderr.lines().all(|line| !line.starts_with("warning:")),
            false => run
                .stderr
                .lines()
                .any(|line| line.starts_with("warning") && line.contains(message)),
        };
        assert!(is_said, "{title}: {}", run.stderr);
    }
}

/// A sphere whose field exceeds the range of `f32` within a fifth of its radius.
const STEEP: &str =
    "fn pw(x) = x*x*x*x*x*x*x*x;\nfield(fn(p) => pw(pw(pw(length(p)))) - 1, within: 4)";

#[test]
fn fields_too_steep_to_march_are_drawn_and_reported() {
    let sandbox = Sandbox::with_scene(STEEP);
    let run = sandbox.run("check scene.sdf");
    let message = run.ok().stderr;
    assert!(message.contains("so rays step over it"), "{message}");
    assert!(
        message.contains("write the same surface with a smaller slope"),
        "{message}"
    );

    let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
    let options = DrawOptions {
        size: [96, 72],
        passes: PassOptions::default(),
        cells: CellMode::Auto,
        scale: 1.0,
    };
    let image = image(&mut *engine, STEEP, &options).expect("it compiles");
    // The sphere fills 60 to 90 % of the height.
    assert!(image.stats.hits > 1000, "{:?}", image.stats);
}
