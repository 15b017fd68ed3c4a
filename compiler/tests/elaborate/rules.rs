//! Rules for all scenes: structural parameters, units, the up axis, and limits with messages.

use crate::{build, rendered, scene, scene_with};
use sdfc_compiler::analysis::bounds::shape_bounds;
use sdfc_compiler::dump::dump;
use sdfc_compiler::scene::{Scene, ShapeKind};
use sdfc_vm::bounds::Bounds;

/// Names of the structural parameters.
fn structural(scene: &Scene) -> Vec<&str> {
    scene
        .params
        .iter()
        .filter(|p| p.structural)
        .map(|p| p.name.as_str())
        .collect()
}

/// Bounding box of the root.
fn bounds(text: &str) -> Bounds {
    let scene = scene(text);
    let root = scene.root.expect("something is drawn");
    shape_bounds(&scene)[root.0 as usize]
}

fn assert_box(text: &str, min: [f64; 3], max: [f64; 3]) {
    let b = bounds(text);
    for i in 0..3 {
        let is_near = |a: f64, b: f64| a == b || (a - b).abs() < 1e-6;
        assert!(
            is_near(b.min[i], min[i]) && is_near(b.max[i], max[i]),
            "{text}: {b:?}"
        );
    }
}

#[test]
fn a_param_is_structural_if_its_value_is_demanded() {
    let s = scene(
        "param loop_count = 3 in 1..9; param corners = 5 in 3..9; param octaves = 4 in 1..8;
param which = true; param pick = 1 in 0..=2; param depth = 2 in 0..5; param r = 0.5 in 0.1..2; param t = 0.5 in 0..1;
fn tower(n) = if n <= 0 { box(r) } else { box(r) | tower(n - 1).translate(0, r, 0) };
let a = for i in 0..loop_count { sphere(r).translate(i, 0, 0) };
let b = ngon(corners, r: r).extrude(t);
let c = sphere(1).displace(fn(p) => 0.1 * fbm(p, octaves: octaves));
let d = if which { sphere(r) } else { box(r) };
let e = at([sphere(1), box(1), torus(1, 0.2)], pick);
let f = sphere(if t > 0.5 { r } else { 2 * r });
a | b | c | d | e | f | tower(depth)",
    );
    assert_eq!(
        structural(&s),
        ["loop_count", "corners", "octaves", "which", "pick", "depth"]
    );
}

#[test]
fn a_structural_param_takes_the_value_from_outside() {
    let text = "param n = 2 in 1..=8;\nfor i in 0..n { sphere(0.1).translate(i, 0, 0) }";
    let count = |s: &Scene| {
        s.shapes
            .iter()
            .filter(|s| matches!(s.kind, ShapeKind::Primitive { .. }))
            .count()
    };
    assert_eq!(count(&scene(text)), 2);
    assert_eq!(count(&scene_with(text, &[("n", "5")])), 5);
}

#[test]
fn a_live_param_leaves_the_scene_as_it_is() {
    let text = "param r = 1 in 0.1..3;\nparam w: length = 10mm;\nsphere(r) |[0.1] box(w)";
    let (a, b) = (scene(text), scene_with(text, &[("r", "2"), ("w", "0.5m")]));
    let shapes = |s: &Scene| {
        let text = dump(s);
        text.lines()
            .filter(|l| !l.starts_with("param"))
            .collect::<Vec<_>>()
            .join("\n")
    };
    assert_eq!(shapes(&a), shapes(&b));
    assert_eq!(b.params[0].value, [2.0]);
    assert_eq!(b.params[1].value, [0.5]);
    assert_eq!(b.params[1].default, [0.01]);
}

#[test]
fn lengths_are_in_the_units_of_the_scene() {
    for (units, one_inch) in [("mm", 25.4), ("cm", 2.54), ("m", 0.0254), ("inch", 1.0)] {
        let text = format!("scene {{ units: {units} }}\nbox(1in)");
        assert_box(&text, [-one_inch / 2.0; 3], [one_inch / 2.0; 3]);
    }
    // Without a unit, the scene unit is a metre, and plain numbers are in scene units.
    assert_box("box(2000mm) | box(2)", [-1.0; 3], [1.0; 3]);
}

#[test]
fn the_library_follows_the_units_of_the_scene() {
    let text = "scene { units: cm, up: z }\nimport \"std/fasteners\" as fast;\ncylinder(d: fast::M4.clearance, h: 1)";
    assert_box(text, [-0.225, -0.225, -0.5], [0.225, 0.225, 0.5]);
}

#[test]
fn solids_stand_along_the_axis_that_points_up() {
    assert_box("cylinder(r: 1, h: 4)", [-1.0, -2.0, -1.0], [1.0, 2.0, 1.0]);
    assert_box(
        "scene { up: z }\ncylinder(r: 1, h: 4)",
        [-1.0, -1.0, -2.0],
        [1.0, 1.0, 2.0],
    );
    // Sizes are along the axes as written.
    assert_box(
        "scene { up: z }\nbox(1, 2, 3)",
        [-0.5, -1.0, -1.5],
        [0.5, 1.0, 1.5],
    );
    assert_box(
        "scene { up: z }\ntorus(2, 0.5)",
        [-2.5, -2.5, -0.5],
        [2.5, 2.5, 0.5],
    );
    // A 2-D shape is extruded along z, and revolved about the up axis.
    assert_box("rect(1, 2).extrude(4)", [-0.5, -1.0, -2.0], [0.5, 1.0, 2.0]);
    assert_box(
        "scene { up: z }\nrect(1, 2).extrude(4)",
        [-0.5, -1.0, -2.0],
        [0.5, 1.0, 2.0],
    );
    assert_box("rect(2, 6).revolve()", [-1.0, -3.0, -1.0], [1.0, 3.0, 1.0]);
    assert_box(
        "scene { up: z }\nrect(2, 6).revolve()",
        [-1.0, -1.0, -3.0],
        [1.0, 1.0, 3.0],
    );
}

#[test]
fn transforms_move_points_by_their_arguments() {
    assert_box(
        "box(2).translate(1, 2, 3)",
        [0.0, 1.0, 2.0],
        [2.0, 3.0, 4.0],
    );
    assert_box(
        "box(2, 4, 6).rotate(90deg, X)",
        [-1.0, -3.0, -2.0],
        [1.0, 3.0, 2.0],
    );
    assert_box(
        "box(2).translate(3, 0, 0).rotate(90deg, Y)",
        [-1.0, -1.0, -4.0],
        [1.0, 1.0, -2.0],
    );
    assert_box(
        "box(2).translate(3, 0, 0).rotate(90deg, Z)",
        [-1.0, 2.0, -1.0],
        [1.0, 4.0, 1.0],
    );
    assert_box(
        "box(2).translate(3, 0, 0).rotate([0deg, 0deg, 90deg])",
        [-1.0, 2.0, -1.0],
        [1.0, 4.0, 1.0],
    );
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let turned = format!("box(2).translate(3, 0, 0).rotate_quaternion([0, 0, {half}, {half}])");
    assert_box(&turned, [-1.0, 2.0, -1.0], [1.0, 4.0, 1.0]);
    assert_box("box(2).scale(3)", [-3.0; 3], [3.0; 3]);
    assert_box(
        "box(2).scale([1, 2, 3])",
        [-1.0, -2.0, -3.0],
        [1.0, 2.0, 3.0],
    );
    assert_box(
        "box(2).translate(3, 0, 0).reflect(X)",
        [-4.0, -1.0, -1.0],
        [-2.0, 1.0, 1.0],
    );
    assert_box(
        "box(2).translate(3, 0, 0).mirror(X)",
        [-4.0, -1.0, -1.0],
        [4.0, 1.0, 1.0],
    );
    assert_box(
        "box(2).translate(3, 0, 0).mirror(X, at: 1)",
        [-2.0, -1.0, -1.0],
        [4.0, 1.0, 1.0],
    );
    assert_box(
        "box(1).repeat(2, count: [3, 1, 2])",
        [-2.5, -0.5, -1.5],
        [2.5, 0.5, 1.5],
    );
    assert_box(
        "box(1).translate(0.9, 0, 0).repeat([2, 0, 0], count: [3, 1, 1])",
        [-1.6, -0.5, -0.5],
        [3.4, 0.5, 0.5],
    );
    assert_box(
        "box(2).elongate(4, 0, 0)",
        [-3.0, -1.0, -1.0],
        [3.0, 1.0, 1.0],
    );
    assert_box("sphere(1).offset(0.5)", [-1.5; 3], [1.5; 3]);
    assert_box("sphere(1).shell(0.5)", [-1.25; 3], [1.25; 3]);
    assert_box(
        "sphere(2).warp(fn(p) => p + [1, 0, 0.5 * sin(p.x)])",
        [-3.0, -2.0, -2.5],
        [1.0, 2.0, 2.5],
    );
}

#[test]
fn copies_may_overlap_and_share_their_middle() {
    for text in [
        "sphere(0.5).translate(1, 0, 0).polar(12)",
        "(cylinder(r: 0.3, h: 1) | box(0.1).translate(1, 0, 0)).polar(5)",
        "box(4, 1, 1).polar(2)",
        "cylinder(r: 0.1, h: 0.5).rotate(60deg, X).translate(0, 0, 0.25).polar(7)",
        "rect(4, 7).translate(0, 21).polar(16)",
        "box(2).mirror(X) | box(1).translate(0.4, 0, 0).mirror(X + Y)",
        "param r = 0.3 in 0.1..=0.5;\nsphere(r).repeat(1)",
        "sphere(0.2).translate(0.3 * sin(time), 0, 0).repeat(1)",
        "param at = 3 in 3..=3.2;\nsphere(0.2).translate(at, 0, 0).repeat(1)",
    ] {
        let (elaborated, diagnostics, sources) = build(text, &[], &[]);
        assert!(
            elaborated.is_some() && diagnostics.is_empty(),
            "{text}: {}",
            rendered(diagnostics, &sources)
        );
    }
}

#[test]
fn limits_are_messages() {
    let mut deep = "sphere(1)".to_owned();
    for _ in 0..600 {
        deep = format!("{deep}.offset(0.1)");
    }
    let many = "for i in 0..500 { for j in 0..500 { sphere(0.1).translate(i, j, 0) } }";
    let texts = [
        (deep.as_str(), "nested more than 500 deep"),
        (many, "more than 400000 shapes"),
        (
            "fn f(n) = f(n + 1) + 1;\nsphere(f(0))",
            "more than 256 levels deep",
        ),
        (
            "fn f(n) = if n > 0 { f(n - 1) + f(n - 1) } else { 1 };\nsphere(f(60))",
            "steps to build",
        ),
        ("for i in 0..1e18 { sphere(1) }", "rounds"),
        ("for i in 0..exp(88) * 1e9 { sphere(1) }", "rounds"),
    ];
    for (text, expected) in texts {
        let (elaborated, diagnostics, sources) = build(text, &[], &[]);
        let text = rendered(diagnostics, &sources);
        assert!(
            elaborated.is_none() && text.contains(expected),
            "{expected}: {text}"
        );
    }
}

#[test]
fn the_same_text_gives_the_same_scene() {
    let text = "param n = 4 in 1..9;\nimport \"std/colors\" as c;
let all = for i in 0..n { sphere(0.2 + 0.1 * random(i)).translate(i, 0, 0).material(c::gold) };
union(all, smooth: 0.1) | box(1).color(#f00)";
    assert_eq!(dump(&scene(text)), dump(&scene(text)));
}

#[test]
fn every_operand_stands_before_what_uses_it() {
    let s = scene(
        "let a = sphere(1); let _b = box(1); (a - box(0.5)).ghost() | a.shell(0.1).repeat(4) |[0.2] !a",
    );
    for (at, shape) in s.shapes.iter().enumerate() {
        if let ShapeKind::Combine { children, .. } = &shape.kind {
            assert!(children.iter().all(|c| (c.0 as usize) < at));
        }
    }
    assert!(!dump(&s).contains("_b"), "what nothing uses is left out");
}

/// A small generator of reproducible random numbers (xorshift). The one of `sdfc-trials` is not used here, because
/// that crate depends on this one.
struct Random(u64);

impl Random {
    fn below(&mut self, sides: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % sides as u64) as usize
    }
}

/// Tokens of a text: words, numbers, and single characters.
fn tokens(text: &str) -> Vec<String> {
    let mut tokens: Vec<String> = Vec::new();
    let mut joins = false;
    for letter in text.chars() {
        let is_word = letter.is_alphanumeric() || letter == '_';
        match tokens.last_mut() {
            Some(last) if joins && is_word => last.push(letter),
            _ => tokens.push(letter.to_string()),
        }
        joins = is_word;
    }
    tokens
}

#[test]
fn no_text_makes_it_panic() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../lang/tests/scenes");
    let names = [
        "one_expression",
        "metaballs",
        "bracket",
        "landscape",
        "gyroid",
        "cog",
    ];
    let mut scenes: Vec<String> = names
        .iter()
        .map(|name| {
            std::fs::read_to_string(folder.join(format!("{name}.sdf"))).expect("it is there")
        })
        .collect();
    scenes.extend(
        crate::meaning::SMALL_SCENES
            .iter()
            .map(|(_, scene)| (*scene).to_owned()),
    );
    let functions = sdfc_compiler::elaborate::function_docs();
    let odd = [
        "0",
        "-1",
        "1e18",
        "1e-18",
        "time",
        "p",
        "X",
        "[1, 2]",
        "[]",
        "90deg",
        "3mm",
        "#f00",
        "true",
        "\"text\"",
        "nothing()",
        "fn(p) => p",
        "0..3",
        "circle(1)",
        "sphere(1)",
        "(1, 2)",
    ];
    let mut dice = Random(0x5df_c0de);
    for _ in 0..3_000 {
        let mut tokens = tokens(&scenes[dice.below(scenes.len())]);
        for _ in 0..=dice.below(3) {
            // Mostly words and numbers, so that most texts still parse.
            let words: Vec<usize> = (0..tokens.len())
                .filter(|&index| {
                    dice.below(20) == 0 || tokens[index].chars().all(char::is_alphanumeric)
                })
                .filter(|&index| !tokens[index].is_empty())
                .collect();
            let (index, from) = (
                words[dice.below(words.len())],
                words[dice.below(words.len())],
            );
            match dice.below(4) {
                0 => tokens[index] = tokens[from].clone(),
                1 => tokens.swap(index, from),
                2 => tokens[index] = odd[dice.below(odd.len())].to_owned(),
                _ => tokens[index] = functions[dice.below(functions.len())].name.to_owned(),
            }
        }
        let text = tokens.concat();
        let (elaborated, diagnostics, sources) = build(&text, &[], &[]);
        assert_eq!(
            elaborated.is_none(),
            diagnostics.iter().any(|d| d.is_error()),
            "{text}"
        );
        // Rendering, listing and bounds must not panic either.
        let _ = rendered(diagnostics, &sources);
        if let Some(scene) = elaborated {
            let _ = (dump(&scene), shape_bounds(&scene));
        }
    }
}
