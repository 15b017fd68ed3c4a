//! Materials that surfaces show.

use super::{
    Point, compile_scene, norm, oracle, point_along, random_point, read_scene, scene, scene_files,
};
use sdfc_compiler::scene::Scene;
use sdfc_trials::oracle::{Oracle, TraceOutcome};
use sdfc_trials::random::Random;
use sdfc_vm::dual::Dual;
use sdfc_vm::lanes::{Points, with_identity_jacobian};
use sdfc_vm::surface::{ID_INDEX, SurfaceHook};
use sdfc_vm::tape::Tape;
use sdfc_vm::tape::evaluator::TapeEvaluator;

/// Scenes with materials that meet in blends, in which engines mix them.
const BLENDED_SCENES: &[&str] = &["blends"];
/// Rays per scene.
const RAYS_PER_SCENE: usize = 400;

/// Returns the name of the material at a point, or an empty string.
fn material_name(scene: &Scene, p: Point) -> String {
    let material = oracle(scene).material(p);
    material.map_or(String::new(), |id| {
        scene.materials[id.0 as usize].name.clone()
    })
}

fn assert_materials(text: &str, expected: &[(Point, &str)]) {
    let materials = "material red { color: #ff0000 }\nmaterial blue { color: #0000ff }\n";
    let scene = scene(&format!("{materials}{text}"));
    for &(p, material) in expected {
        assert_eq!(material_name(&scene, p), material, "{text} at {p:?}");
    }
}

#[test]
fn the_nearer_operand_of_a_union_is_visible_and_the_first_of_equal_ones() {
    let right_point = [1.5, 0.0, 0.0];
    let left_point = [-1.5, 0.0, 0.0];
    assert_materials(
        "sphere(1).translate(0.5, 0, 0).material(red) | sphere(1).translate(-0.5, 0, 0).material(blue)",
        &[
            (right_point, "red"),
            (left_point, "blue"),
            ([0.0, 0.5_f64.sqrt(), 0.5], "red"),
        ],
    );
    assert_materials(
        "box(3).material(red) | box(3).material(blue)",
        &[(right_point, "red")],
    );
    assert_materials("box(3) | box(3).material(blue)", &[(right_point, "")]);
    assert_materials("box(3).material(blue) | box(3)", &[(right_point, "blue")]);
}

#[test]
fn the_outermost_of_nested_paints_is_visible() {
    let top = [0.0, 0.5, 0.0];
    assert_materials(
        "box(1).material(red).translate(0, 0, 0).material(blue)",
        &[(top, "blue")],
    );
    assert_materials(
        "(box(1).material(red) | sphere(0.4)).material(blue)",
        &[(top, "blue")],
    );
}

#[test]
fn unpainted_cutters_only_cut() {
    let (face, wall) = ([1.0, 0.9, 0.0], [0.5, 0.0, 0.0]);
    let hole = "cylinder(r: 0.5, h: 4)";
    assert_materials(
        &format!("box(2).material(red) - {hole}"),
        &[(face, "red"), (wall, "red")],
    );
    assert_materials(
        &format!("box(2).material(red) - {hole}.material(blue)"),
        &[(face, "red"), (wall, "blue")],
    );
    assert_materials(
        &format!("box(2) - {hole}.material(blue)"),
        &[(face, ""), (wall, "blue")],
    );
    assert_materials(
        "box(2).material(red) & sphere(1.2).material(blue)",
        &[
            ([1.0, 0.3, 0.2], "red"),
            ([0.0, 0.9, 0.63_f64.sqrt()], "blue"),
        ],
    );
    // Parts of a cutter without a material show that of the cut body, and other parts their own.
    let pocket = "box(0.2, 3, 0.2).translate(0.9, 0, 0.9)";
    let corner = [0.8, 0.1, 0.9];
    for cutter in [
        format!("({hole} | {pocket}.material(blue))"),
        format!("({pocket}.material(blue) | {hole})"),
        format!("({hole} | {pocket}.material(blue)).mirror(X)"),
        format!("({hole} | {pocket}.material(blue) | sphere(0.1))"),
        format!("(({hole} | {pocket}.material(blue)) - sphere(0.1))"),
        format!("(({hole} | {pocket}.material(blue)) & box(5))"),
        format!("({hole} | ({pocket} & box(5).material(blue)))"),
        format!("({hole} | ({pocket}.material(blue) - sphere(0.1)))"),
        format!("{hole} - {pocket}.material(blue)"),
        format!("{pocket}.material(blue) - {hole}"),
    ] {
        assert_materials(
            &format!("box(2).material(red) - {cutter}"),
            &[(face, "red"), (wall, "red"), (corner, "blue")],
        );
    }
    let body = "(box(2).material(red) | sphere(0.2).translate(0, 2, 0))";
    assert_materials(
        &format!("{body} - ({hole} | {pocket}.material(blue))"),
        &[([0.0, 2.2, 0.0], ""), (wall, "red"), (corner, "blue")],
    );
    assert_materials(
        "box(2).material(red) & (sphere(1.2) | box(0.2, 3, 3).material(blue))",
        &[
            ([1.0, 0.3, 0.2], "red"),
            ([0.3, 0.9, 0.54_f64.sqrt()], "red"),
            ([0.1, 0.95, 0.95], "blue"),
        ],
    );
    // On coincident surfaces, the first operand shows.
    assert_materials(
        "box(2).material(red) & box(2).material(blue)",
        &[(face, "red")],
    );
}

#[test]
fn copies_and_frames_show_the_paint_of_their_own_points() {
    assert_materials(
        "(sphere(0.2).material(red) | sphere(0.2).translate(0.4, 0, 0).material(blue)).repeat([2, 0, 0])",
        &[
            ([4.0, 0.2, 0.0], "red"),
            ([4.4, 0.2, 0.0], "blue"),
            ([-1.6, 0.2, 0.0], "blue"),
        ],
    );
    assert_materials(
        "(box(1).material(red) | box(1).translate(1, 0, 0).material(blue)).scale(0.1).rotate(90deg, Z)",
        &[([0.05, 0.0, 0.0], "red"), ([0.05, 0.1, 0.0], "blue")],
    );
}

/// Evaluator of the materials that engines show, by their ids.
struct EngineMaterials<'m> {
    program: &'m sdfc_vm::program::Program,
    tape: Tape,
    machine: TapeEvaluator<Dual<f32>, SurfaceHook>,
}

impl<'m> EngineMaterials<'m> {
    fn new(program: &'m sdfc_vm::program::Program) -> Self {
        let tape = Tape::new(program);
        let machine = TapeEvaluator::new(tape.values, tape.points);
        Self {
            program,
            tape,
            machine,
        }
    }

    fn material(&mut self, p: Point) -> u32 {
        let mut points = Points::default();
        for axis in 0..3 {
            points[axis].0.fill(p[axis] as f32);
        }
        *self.machine.inputs_mut() = with_identity_jacobian(&points);
        self.machine.hook().set_points(&points, &Points::default());
        self.machine.run(self.program, &self.tape.clauses, 1);
        self.machine.hook().surface()[ID_INDEX].0[0] as u32
    }
}

/// Reports whether a surface point is away from borders between materials.
fn is_unambiguous(oracle: &Oracle, p: Point) -> bool {
    let material = oracle.material(p);
    let mut r = Random::new(8);
    (0..12).all(|_| {
        let offset = random_point(&mut r, 1e-3);
        oracle.material([0, 1, 2].map(|i| p[i] + offset[i])) == material
    })
}

/// Returns a description of the points at which an engine and the oracle show different materials.
fn find_differences(scene: Scene) -> Option<String> {
    let oracle = oracle(&scene);
    let materials = scene.materials.clone();
    let is_2d = scene.is_2d;
    let compiled = compile_scene(scene);
    let program = compiled.module.surface.as_ref().filter(|_| !is_2d)?;
    let mut engine = EngineMaterials::new(program);
    let mut r = Random::new(9);
    let (mut count, mut first_difference) = (0, None);
    for _ in 0..RAYS_PER_SCENE {
        let (origin, target) = (random_point(&mut r, 6.0), random_point(&mut r, 2.0));
        let delta = [0, 1, 2].map(|i| target[i] - origin[i]);
        let length = norm(delta);
        let direction = delta.map(|v| v / length);
        let TraceOutcome::Hit { t, .. } = oracle.trace(origin, direction, [0.0, 20.0]) else {
            continue;
        };
        let p = point_along(origin, direction, t);
        if !is_unambiguous(&oracle, p) {
            continue;
        }
        let (truth, shown) = (oracle.material(p).map_or(0, |id| id.0), engine.material(p));
        if truth != shown {
            count += 1;
            first_difference.get_or_insert((p, truth, shown));
        }
    }
    let (p, truth, shown) = first_difference?;
    let [truth, shown] = [truth, shown].map(|id| &materials[id as usize].name);
    Some(format!(
        "{count} points, as {p:?}: `{shown}` and not `{truth}`"
    ))
}

/// Cutters with a material on some parts, in various nestings.
#[test]
fn engines_show_the_paints_of_cutters_painted_in_part() {
    let materials = "material red { color: #ff0000 }\nmaterial blue { color: #0000ff }\n";
    let red = "box(2).material(red)";
    let (hole, blue) = ("cylinder(r: 0.5, h: 4)", "box(0.4, 3, 0.7).material(blue)");
    let blue = &format!("{blue}.translate(0.8, 0.2, 0.1)");
    let mut failures = Vec::new();
    for text in [
        format!("{red} - ({hole} | {blue})"),
        format!("{red} - ({blue} | {hole})"),
        format!("{red} - {blue} - {hole}"),
        format!("{red} - {hole} - {blue}"),
        format!("{red} - ({hole} | {blue}).rotate(20deg, Y)"),
        format!("{red} - ({hole} | {blue}).mirror(X)"),
        format!("{red} - ({hole} | {blue}).scale(0.8)"),
        format!("{red} - ({hole} | {blue}).offset(0.05)"),
        format!("{red} - ({hole} | {blue}).twist(20deg)"),
        format!("({red} - ({hole} | {blue})).rotate(30deg, X).scale(1.3)"),
        format!("{red} - (({hole} | {blue}) - sphere(0.7).translate(1, 0, 0))"),
        format!("{red} - (({hole} | {blue}) & sphere(1.1).material(blue))"),
        format!("{red} - (({hole} | {blue}) & sphere(1.1))"),
        format!("{red} - ({hole} | (box(1) - {blue}).translate(0.6, 0.6, 0))"),
        format!("{red} - ({hole} | ({blue} - box(0.3).translate(1, 0, 0)))"),
        format!("({red} | sphere(1.3)) - ({hole} | {blue})"),
        format!("(sphere(1.3) | {red}) - {hole} - {blue}"),
        format!("({red} | sphere(1.3).material(blue)) - ({hole} | {blue})"),
        format!("{red} & (sphere(1.2) | {blue})"),
        format!("({hole} | {blue}) & {red}"),
        format!("({hole} | {blue}) & ({red} | sphere(1.2))"),
        format!("box(2) - ({hole} | {blue})"),
        format!("({red} - ({hole} | {blue})) | sphere(0.3)"),
        format!("{red} - ({hole} | {blue}).polar(3)"),
        format!("({red} - {blue}) - {hole}"),
        format!("({red} - {blue}).rotate(20deg, Y) - {hole}"),
        format!("({red} - {blue}) & sphere(1.2)"),
        format!("(({red} - {blue}) | sphere(0.2).translate(0, 1.1, 0)) - {hole}"),
        format!("box(2) - {blue} - {hole}"),
        format!("(box(2) - {blue}) - {hole}"),
    ] {
        let scene = scene(&format!("{materials}{text}"));
        failures.extend(find_differences(scene).map(|message| format!("{text}: {message}")));
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn engines_show_the_paints_of_all_scenes() {
    let mut failures = Vec::new();
    for path in scene_files() {
        let (scene, name) = read_scene(&path);
        if BLENDED_SCENES.contains(&name.as_str()) {
            continue;
        }
        failures.extend(find_differences(scene).map(|message| format!("{name}: {message}")));
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Materials in combinations of two and three, and under transforms. An operand without a material cuts at
/// most one material here.
const SCENES: &[&str] = &[
    "RED - CUT",
    "RED - CUT - BLUE.translate(0, 1, 0)",
    "RED - (CUT | BLUE.translate(0, 1, 0))",
    "CUT - RED",
    "RED & BLUE.translate(0.5, 0, 0)",
    "RED | CUT",
    "CUT | RED",
    "xor(RED, BLUE.translate(0.5, 0, 0))",
    "RED - CUT.translate(0.2, 0, 0).scale(1.2)",
    "(RED - CUT) | BLUE.translate(1.5, 0, 0)",
    "(RED | BLUE.translate(1, 0, 0)).offset(0.1)",
    "(RED | BLUE.translate(1, 0, 0)).twist(30deg)",
    "(RED | BLUE.translate(1, 0, 0)).mirror(X)",
    "(RED | BLUE.translate(1, 0, 0)).translate(2, 0, 0).polar(3)",
    "(RED | BLUE.translate(1, 0, 0)).repeat([3, 3, 3])",
    "(RED | BLUE.translate(1, 0, 0)).displace(fn(p) => 0.02 * sin(9 * p.y))",
    "(CUT | BLUE.translate(1, 0, 0)).material(red)",
    "((RED - CUT) & sphere(0.8)) - BLUE.translate(0, 0.4, 0)",
    "RED - (sphere(0.7) - BLUE.translate(0, 0.6, 0))",
    "field(fn(p) => length(p) - 1, within: 3).material(red) - CUT",
    "complement(BLUE) & RED.scale(1.3)",
    // A hole through several materials shows those of the cut parts.
    "(RED | BLUE.translate(0.7, 0, 0)) - CUT.rotate(90deg, Z)",
    "(RED | BLUE.translate(0.7, 0, 0)) & sphere(0.8)",
    "sphere(0.8) & (RED | BLUE.translate(0.7, 0, 0))",
    "(RED | BLUE.translate(0.7, 0, 0)) -[0.1] CUT.rotate(90deg, Z)",
    "(RED | BLUE.translate(0.7, 0, 0)) - CUT - sphere(0.6)",
    // Of coincident faces, the first in the text shows, whatever the brackets.
    "RED | BLUE.scale(10 / 9)",
    "RED | (BLUE.scale(10 / 9) | sphere(0.2).translate(0, 2, 0) | sphere(0.1).translate(0, 3, 0))",
    "BLUE.translate(0, 0.05, 0).translate(3, 3, 3).translate(-3, -3, -3) | RED",
    "RED.translate(0, 0.5, 0).rotate(30deg, Y) | BLUE.translate(0, 0.45, 0).rotate(30deg, Y).scale(10 / 9)",
];

#[test]
fn engines_show_the_paints_of_combinations() {
    let materials = "material red { color: #ff0000 }\nmaterial blue { color: #0000ff }\n";
    let mut failures = Vec::new();
    for text in SCENES {
        let text = text.replace("RED", "box(1).material(red)");
        let text = text.replace("BLUE", "box(0.9).material(blue)");
        let text = text.replace("CUT", "cylinder(r: 0.4, h: 3)");
        let message = find_differences(scene(&format!("{materials}{text}")));
        failures.extend(message.map(|message| format!("{text}: {message}")));
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
