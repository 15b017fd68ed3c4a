//! Meanings of texts: snapshots of whole scenes.

use crate::{build, rendered};
use sdfc_compiler::dump::dump;
use std::path::Path;

fn listing(text: &str) -> String {
    let (scene, diagnostics, sources) = build(text, &[], &[]);
    let messages = rendered(diagnostics, &sources);
    match scene {
        Some(scene) => format!("{messages}{}", dump(&scene)),
        None => messages,
    }
}

/// A scene of the language description, from the test data of the parser.
fn described(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../lang/tests/scenes");
    let text = std::fs::read_to_string(folder.join(name)).expect("the scene is there");
    // Scattering is not in the vocabulary yet.
    let lines = text.lines().filter(|line| !line.contains(".scatter("));
    lines
        .collect::<Vec<_>>()
        .join("\n")
        .replace("ground | forest", "ground | tree()")
}

#[test]
fn the_scenes_of_the_description() {
    for name in [
        "one_expression",
        "metaballs",
        "bracket",
        "landscape",
        "gyroid",
        "cog",
    ] {
        insta::assert_snapshot!(name, listing(&described(&format!("{name}.sdf"))));
    }
}

/// Small scenes, each under its title.
pub(crate) const SMALL_SCENES: &[(&str, &str)] = &[
    ("operators gather", "let a = sphere(1); let b = box(1); (a | b | a - b - a) & !b"),
    ("lists are unions", "let row = for i in 0..3 { sphere(0.4).translate(i, 0, 0) };\nbox(4) - row"),
    ("blends of all kinds", "let a = sphere(1); let b = box(1);
(a |[0.1] b) | (a &[cubic, 0.1] b) | (a -[circular, 0.1] b) | (a |[exponential, 0.1] b)
    | (a -[chamfer, 0.1] b) | (a |[fillet, 0.1] b) | (a |[stairs, 0.3, n: 3] b) | (a |[distance, 0.1] b)"),
    ("the scope of a blend", "blend(0.2) { sphere(1) | (box(1) -[0.1] sphere(0.5)) & box(3) } | sphere(0.1)"),
    ("nothing drops out", "let n = nothing();\n(sphere(1) | n) - n | (n & box(1)) | (n - box(2))"),
    ("functions, lambdas, lists", "fn at_angle(shape, a: angle, r = 2) = shape.translate(r, 0, 0).rotate(a);
let radii = map(0..4, fn(i) => 0.1 + i / 10);
let total = fold(radii, 0, fn(sum, r) => sum + r);
assert(len(radii) == 4);
print(\"total\", total, radii);
for i in 0..len(radii) { sphere(at(radii, i)).at_angle(i * 0.25turn) }"),
    ("vectors and swizzles", "let v = [1, 2, 3]; let w = v.zyx + 1 - [0.5, 0, 0] * 2;\nbox(abs(w)).translate(cross(X, Y) * length(v.xy))"),
    ("an if in a field is a choice", "field(fn(p) => if p.x > 0 && p.y < 1 { length(p) - 1 } else { max(abs(p.x), abs(p.y), abs(p.z)) - 1 })"),
    ("a live condition chooses between numbers", "param big = false;\nsphere(if big { 2 } else { 1 }).translate([0, if big { 1 } else { 0 }, 0])"),
    ("lights, cameras, materials", "material glow { color: #000, emission: #ff8800 * 3, roughness: fn(p) => 0.5 + 0.5 * noise(p), bump: fn(p) => 0.01 * sin(40 * p.x) }
camera top { from: [0, 5, 0], look: [0, 0, 0], height: 4 }
camera { fov: 50deg }
light { at: [1, 2, 3], shadow: none }
light rim { dir: X, color: [1, 0.5, 0.2], intensity: 2, shadow: sized(0.1) }
render { size: [320, 200], aa: 1, occlusion: 16, normals: tetrahedron, tonemap: none }
sphere(1).material(glow)"),
    ("terrain", "heightfield(fn(p) => 0.3 * sin(p.x) * cos(p.y), over: 8, base: -1)"),
    ("looking closer", "(box(2) - sphere(1.2).ghost() - cylinder(r: 0.1, h: 3).hide()) | sphere(5).only()"),
    ("copies", "sphere(0.2).translate(1, 0, 0).polar(5) | box(0.5).translate(0, 3, 0).repeat([2, 0, 2]) | sphere(0.3).translate(2, 0, 1).mirror([1, 0, 1])"),
    ("figures", "polygon([[0, 0], [2, 0], [1, 1.5]]).offset(0.1) - circle(0.3).translate(1, 0.5) | star(5, 1, 0.4).rotate(10deg)"),
];

#[test]
fn small_scenes() {
    let mut text = String::new();
    for (title, scene) in SMALL_SCENES {
        let lines = listing(scene);
        // Parts common to all scenes are in the other snapshots.
        let specific_lines = lines.lines().filter(|line| {
            let is_given = |word: &str| scene.contains(&format!("{word} "));
            !(line.starts_with("sky ")
                || line.starts_with("m0 ")
                || line.starts_with("render ") && !is_given("render")
                || line.starts_with("light ") && !is_given("light")
                || line.starts_with("camera ") && !is_given("camera"))
        });
        text += &format!(
            "──── {title}\n{}\n\n",
            specific_lines.collect::<Vec<_>>().join("\n")
        );
    }
    insta::assert_snapshot!(text);
}
