//! Bounding boxes contain their shapes, for blends, offsets and folds of shapes whose values underestimate
//! the distance.

use crate::scene;
use sdfc_compiler::compile::{Options, compile};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::evaluate_f64;

/// Scenes whose blends, offsets and displacements extend far beyond their operands.
const SCENES: &[&str] = &[
    // A needle: its distance changes by one unit over four units of its length.
    "let a = sphere(0.5).scale([1, 4, 1]);\na |[0.1] a",
    "sphere(0.5).scale([1, 4, 1]).offset(0.1)",
    "sphere(0.5).scale([1, 4, 1]).shell(0.2)",
    "sphere(0.5).scale([1, 4, 1]).displace(fn(p) => 0.1 + 0.02 * sin(20 * p.x))",
    "let a = sphere(0.3).shear(1.5, 0, 0).rotate(30deg, Z);\na |[chamfer, 0.3] a",
    // Beyond the corners of the intersection of slabs.
    "let a = (slab(X, 1) & slab(Y, 1) & slab(Z, 1)).rotate(45deg, Z);\na |[0.1] a",
    "let a = box(2).subtract(sphere(1.2)).rotate([45deg, 30deg, 20deg]);\na |[fillet, 0.3] a",
    "let a = ellipsoid([1, 0.1, 0.1]).rotate(45deg, Z);\na |[0.2] a",
    "let a = tetrahedron(0.8);\na |[0.2] a.rotate(45deg, X)",
    // Displacement and twist reduce the slope, so the shape extends farther where its value is small.
    "let a = sphere(0.5).displace(fn(p) => 0.05 * sin(30 * p.x));\na |[0.1] a",
    "let a = sphere(0.5).warp(fn(p) => p + [0, 0.2 * sin(9 * p.x), 0]);\na |[0.1] a",
    "let a = box(0.4, 2, 0.4).twist(90deg);\na |[0.1] a",
    // A warp that contracts space: the values behind it are smaller than the distance.
    "box(0.8).warp(fn(p) => [p.x * exp(0.4 * p.y), p.y, p.z]).shell(0.3)",
    "let a = sphere(0.5).warp(fn(p) => [p.x * 0.4, p.y, p.z + 0.3 * p.x]);\na |[0.3] a",
    "box(0.7).translate(0.5, 0, 0).warp(fn(p) => p * dot(p, p)).offset(0.1)",
    // Rotations by angles that vary with the point keep lengths.
    "box(0.5, 1.6, 0.5).warp(fn(p) => [p.x * cos(p.y) - p.z * sin(p.y), p.y, p.x * sin(p.y) + p.z * cos(p.y)])",
    "field(fn(p) => { let a = 3 * length(p.xz); let x = p.x * cos(a) + p.z * sin(a); let z = p.z * cos(a) - p.x * sin(a); max(max(abs(x) - 0.5, abs(z) - 1), abs(p.y) - 0.1) })",
    "field(fn(p) => min(length(p) - 1, max(abs(p.x * cos(p.y) - p.z * sin(p.y)), max(abs(p.x * sin(p.y) + p.z * cos(p.y)), abs(p.y) / 5)) - 0.4))",
    // Disjoint shapes, then intersecting ones.
    "(sphere(0.5).translate(-0.55, 0, 0) & sphere(0.5).translate(0.55, 0, 0)).offset(0.2)",
    "let a = sphere(0.5).translate(-0.6, 0, 0).mirror(X);\n(a & a).offset(0.3) |[0.1] a.offset(0.3)",
    "sphere(1).translate(0, 0, 1.1).section(Z).offset(0.3)",
    "circle(0.4).translate(-0.5, 0).revolve().offset(0.3)",
    "sphere(0.5).offset(-0.1).offset(0.1) |[0.2] sphere(0.3).offset(-0.4)",
    // Elongation at a plane without material.
    "torus(1, 0.2).elongate(2, 2, 2)",
    "sphere(0.1).translate(1.5, 0, 0).elongate([4, 4, 4]) & sphere(1.2)",
    // Chains.
    "let a = sphere(0.5);\nunion([a, a, a, a, a, a, a, a], smooth: 0.1)",
    "let a = sphere(0.5);\nunion([a, a, a, a, a, a, a, a], smooth: 0.1, kernel: exponential)",
    "let a = sphere(0.5).scale([1, 2, 1]);\nunion([a, a, a, a, a, a], smooth: 0.1, kernel: circular)",
    "sphere(0.3).repeat([1, 0, 1], count: [2, 1, 2]) |[0.2] box(3, 0.1, 3)",
    "box(0.2, 1, 0.2).translate(0.8, 0, 0).polar(5) |[0.2] sphere(0.4)",
];

/// Reproducible random points.
struct Points(u64);

impl Points {
    fn next(&mut self, half_size: f64) -> [f64; 3] {
        std::array::from_fn(|_| {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            half_size * ((self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0)
        })
    }
}

fn check(name: &str, text: &str) -> Bounds {
    let (compiled, diagnostics) = compile(scene(text), &Options::default());
    let module = compiled
        .unwrap_or_else(|| panic!("{name}: {diagnostics:?}"))
        .module;
    let Bounds { min, max } = module.settings.bounds;
    let mut points = Points(0x5df_c0de);
    for index in 0..20_000 {
        let mut p = points.next([1.5, 3.0, 6.0][index % 3]);
        if module.settings.is_2d {
            p[2] = 0.0;
        }
        let d = evaluate_f64(&module.distance, p);
        let is_inside = (0..3).all(|i| min[i] - 1e-5 <= p[i] && p[i] <= max[i] + 1e-5);
        assert!(
            d >= -1e-6 || is_inside,
            "{name}: {d} at {p:?}, outside {:?}",
            module.settings.bounds
        );
    }
    module.settings.bounds
}

#[test]
fn nothing_lies_outside_its_box() {
    for text in SCENES {
        let bounds = check(text, text);
        let reach = (0..2).map(|i| bounds.max[i] - bounds.min[i]);
        assert!(reach.fold(0.0, f64::max) < 10.0, "{text}: {bounds:?}");
    }
}

#[test]
fn the_complement_of_a_half_space_is_a_half_space() {
    for text in [
        "!plane([0, -1, 0], at: 1)",
        "!plane([0, -1, 0]).translate(0, -1, 0)",
        "box(1).translate(0, -3, 0) | !plane([0, -1, 0], at: 1)",
    ] {
        let bounds = check(text, text);
        assert!((bounds.max[1] + 1.0).abs() < 1e-6, "{text}: {bounds:?}");
        assert!(bounds.min[1].is_infinite(), "{text}: {bounds:?}");
    }
}

/// Boxes of shapes that are turned by angles that vary with the point, by functions that the scene writes.
#[test]
fn boxes_of_turned_fields_are_those_of_their_corners() {
    let turned = "let x = p.x * cos(a) - p.z * sin(a); let z = p.x * sin(a) + p.z * cos(a);";
    let by_height = format!("let a = p.y * 60deg; {turned}");
    let half = 0.5_f64.hypot(0.5) / 2.0;
    let square = "max(max(abs(x), abs(z)) - 0.25, abs(p.y) - 0.8)";
    let cases = [
        (
            format!("box(0.5, 1.6, 0.5).warp(fn(p) => {{ {by_height} [x, p.y, z] }})"),
            [half, 0.8, half],
        ),
        (
            format!("field(fn(p) => {{ {by_height} {square} }})"),
            [half, 0.8, half],
        ),
        (
            format!("field(fn(p) => {{ {by_height} min(3 * {square}, length(p) - 0.6) }})"),
            [0.6, 0.8, 0.6],
        ),
        (
            format!(
                "field(fn(p) => {{ {by_height} max(min({square}, 5 * (length([x - 0.2, z]) - 0.1)), abs(p.y) - 0.8) }})"
            ),
            [half, 0.8, half],
        ),
        (
            "box(0.5, 1.6, 0.5).warp(fn(p) => { let c = cos(-1.3 * p.y); let s = -sin(p.y * 1.3); \
             [c * p.x - s * p.z, p.y, s * p.x + c * p.z] })"
                .to_owned(),
            [half, 0.8, half],
        ),
        (
            format!("field(fn(p) => {{ let a = 2 * length(p); {turned} 1.5 * {square} }})"),
            [half, 0.8, half],
        ),
    ];
    for (text, expected) in cases {
        let bounds = check(&text, &text);
        for (axis, expected) in expected.into_iter().enumerate() {
            let sides = [-bounds.min[axis], bounds.max[axis]];
            let is_close = |side: f64| side > expected - 1e-3 && side < expected * 1.1;
            assert!(sides.into_iter().all(is_close), "{text}: {bounds:?}");
        }
    }
}

/// Interval arithmetic alone yields −9 for x · x in [−3, 3], and e⁵⁴⁰ for its exponential.
#[test]
fn the_box_of_a_terrain_is_about_as_high_as_its_hills() {
    let hills = [
        ("0.7 * exp(-60 * p.x * p.x)", 0.7),
        ("exp(-60 * (p.x - 1) * (p.x - 1) - 5 * p.y * p.y)", 1.0),
        ("0.1 * (p.x * p.x - p.x) * p.y", 3.6),
        ("0.3 * sin(p.x) * cos(p.y)", 0.3),
    ];
    for (height, highest) in hills {
        let text = format!("heightfield(fn(p) => {height}, over: [6, 6])");
        let bounds = check(&text, &text);
        let (low, high) = (bounds.min[1], bounds.max[1]);
        assert!(high <= 3.0 * highest, "{height}: up to {high}");
        assert!(low >= -3.0 * highest, "{height}: down to {low}");
    }
}

#[test]
fn nothing_of_a_test_scene_lies_outside_its_box() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/scenes");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).expect("the scenes are there") {
        let path = entry.expect("they can be listed").path();
        let text = std::fs::read_to_string(&path).expect("they can be read");
        if !text.contains("import") {
            check(&path.display().to_string(), &text);
            count += 1;
        }
    }
    assert!(count > 15, "{count} scenes");
}

#[test]
fn a_shape_that_is_empty_in_its_middle_is_pulled_apart_to_nothing_there() {
    let (compiled, diagnostics) = compile(
        scene("sphere(0.1).translate(2, 0, 0).elongate(6, 6, 6)"),
        &Options::default(),
    );
    let module = compiled.unwrap_or_else(|| panic!("{diagnostics:?}")).module;
    let at = |p| evaluate_f64(&module.distance, p);
    assert!((at([0.0; 3]) - 1.9).abs() < 1e-6, "{}", at([0.0; 3]));
    assert!((at([5.0, 3.0, 3.0]) + 0.1).abs() < 1e-6);
}

/// A repetition of a live shape is the union of its copies.
#[test]
fn copies_of_what_moves_are_where_they_would_be_one_by_one() {
    let cases = [
        (
            "sphere(r).translate(0.1, 0, 0).repeat([1, 0, 0.8], count: [3, 1, 2])",
            "union(for i in 0..3 { for k in 0..2 { sphere(r).translate(i - 0.9, 0, 0.8 * k - 0.4) } })",
        ),
        (
            "box(r, 0.2, 0.3).translate(0.7, 0, 2 * r).repeat(1.2, count: 3)",
            "union(for i in 0..3 { for j in 0..3 { for k in 0..3 {
                box(r, 0.2, 0.3).translate(1.2 * i - 0.5, 1.2 * j - 1.2, 1.2 * k - 1.2 + 2 * r) } } })",
        ),
        // Not mirror symmetric: the nearest copy may belong to the neighbouring cell.
        (
            "cone(r, 0, 0.8).repeat([0, 1, 0], count: [1, 3, 1])",
            "union(for j in 0..3 { cone(r, 0, 0.8).translate(0, j - 1, 0) })",
        ),
        // Within three units of the origin, five copies are equivalent to all copies.
        (
            "sphere(r).repeat([1.5, 0, 0])",
            "union(for i in 0..9 { sphere(r).translate(1.5 * (i - 4), 0, 0) })",
        ),
        (
            "circle(r).translate(0.5, 0.2).repeat(1, count: [2, 3]).extrude(1)",
            "union(for i in 0..2 { for j in 0..3 { circle(r).translate(i, j - 0.8) } }).extrude(1)",
        ),
    ];
    for (repeated, listed) in cases {
        for r in ["0.1", "0.25", "0.4"] {
            let [a, b] = [repeated, listed].map(|text| {
                let text = format!("param r = 0.2 in 0.1..=0.4;\n{text}");
                let scene = crate::scene_with(&text, &[("r", r)]);
                let (compiled, diagnostics) = compile(scene, &Options::default());
                compiled
                    .unwrap_or_else(|| panic!("{text}: {diagnostics:?}"))
                    .module
            });
            let mut points = Points(7);
            for _ in 0..2_000 {
                let p = points.next(3.0);
                let [d, expected] = [&a, &b].map(|module| evaluate_f64(&module.distance, p));
                assert!(
                    (d - expected).abs() < 1e-5,
                    "{repeated} at {p:?}: {d}, not {expected}"
                );
            }
        }
    }
}

/// A shape that depends on a parameter or the time has a box for each of their values, but none for all.
#[test]
fn a_box_is_computed_at_the_current_values() {
    let text = "param r = 0.3 in 0.1..=0.5;\nsphere(r).translate(sin(time * 1rad / 1s), 0, 0)";
    let at = |r: &str, time| {
        let scene = crate::scene_with(text, &[("r", r)]);
        let options = Options {
            time,
            ..Options::default()
        };
        let (compiled, diagnostics) = compile(scene, &options);
        let mut compiled = compiled.unwrap_or_else(|| panic!("{diagnostics:?}"));
        compiled.update(time);
        compiled
    };
    let mut compiled = at("0.4", 1.0);
    let mut module = compiled.module.clone();
    let box_of = |module: &sdfc_vm::program::Module| *module.settings.clip_bounds();
    let space = box_of(&module);
    assert!(
        (space.max[0] - (1.0_f64.sin() + 0.4)).abs() < 1e-6,
        "{space:?}"
    );
    assert!((space.max[1] - 0.4).abs() < 1e-6, "{space:?}");
    // Without the scene, the box for other values is unknown.
    module.update(0.5);
    assert!(!box_of(&module).is_finite());
    module.update(1.0);
    assert!(box_of(&module).is_finite());
    module.settings.params[0].value = vec![0.2];
    module.update(1.0);
    assert!(!box_of(&module).is_finite());
    // With the scene, the box is computed again.
    compiled.module.settings.params[0].value = vec![0.2];
    compiled.update(0.5);
    let space = box_of(&compiled.module);
    assert!(
        (space.max[0] - (0.5_f64.sin() + 0.2)).abs() < 1e-6,
        "{space:?}"
    );
}

/// Bounds follow groups that are moved, rotated or scaled, where only a search finds their size.
#[test]
fn boxes_of_blends_follow_moved_groups() {
    let polygon = "polygon([[-0.4, -0.3], [0.4, -0.3], [0.1, 0], [0.3, 0.4]]).extrude(0.3)";
    let field = "field(fn(p) => p.x * p.x + 2 * p.y * p.y + p.z * p.z * p.z * p.z - 0.2)";
    let displaced = "sphere(0.4).displace(fn(p) => 0.05 * sin(9 * p.x))";
    let mut failures = Vec::new();
    for group in [
        format!("({polygon} | {field})"),
        format!("union([{polygon}, {field}, {displaced}])"),
        format!("({field} & {polygon})"),
        format!("({field} - {polygon})"),
        format!("({polygon} |[0.1] {field})"),
    ] {
        for (map, scale, shift) in [
            (".translate(3, 0, 0)", 1.0, 3.0),
            (".rotate(90deg, X).rotate(270deg, X)", 1.0, 0.0),
            (".scale(0.5).translate(3, 0, 0)", 0.5, 3.0),
        ] {
            let other = "|[circular, 0.2] sphere(0.2)";
            let bounds = |text: &str| {
                let scene = crate::scene_with(text, &[]);
                let (compiled, diagnostics) = compile(scene, &Options::default());
                let compiled = compiled.unwrap_or_else(|| panic!("{text}: {diagnostics:?}"));
                compiled.module.settings.bounds
            };
            let plain = bounds(&group);
            let moved = bounds(&format!("{group}{map} {other}"));
            // The other operand is smaller and grows the box by less than half of its width.
            for axis in 0..3 {
                let shift = if axis == 0 { shift } else { 0.0 };
                let low = (plain.min[axis] * scale + shift).min(-0.2) - 0.3;
                let high = (plain.max[axis] * scale + shift).max(0.2) + 0.3;
                if !(moved.min[axis] >= low && moved.max[axis] <= high) {
                    failures.push(format!("{group}{map} {other}: {moved:?}, alone {plain:?}"));
                }
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// The box for all values of live parameters contains that for each value, and is finite where transforms and widths of
/// blends are live.
#[test]
fn boxes_for_all_params_contain_those_for_each_value() {
    let field = "field(fn(p) => p.x * p.x + 2 * p.y * p.y + p.z * p.z - 0.4)";
    for (range, shape) in [
        ("0.5..=2", format!("{field}.scale(v)")),
        (
            "0.5..=2",
            format!("({field} | box(0.5, 2, 1)).scale([1, v, 2])"),
        ),
        ("-1..=3", format!("{field}.translate(v, 1, -v)")),
        (
            "-1..=3",
            "box(1).rotate(30deg, Y).translate(v, v, 0).rotate(40deg, X)".to_owned(),
        ),
        (
            "0..=0.5",
            format!("{field} |[v] sphere(0.3).translate(1, 0, 0)"),
        ),
        ("0..=0.5", format!("box(1, 2, 1) |[fillet, v] {field}")),
        (
            "0..=0.5",
            format!("(box(1, 2, 1) -[v] {field}).translate(v, 0, 0)"),
        ),
    ] {
        let bounds = |head: &str| {
            let text = format!("{head};\n{shape}\n");
            let (compiled, diagnostics) =
                compile(crate::scene_with(&text, &[]), &Options::default());
            let compiled = compiled.unwrap_or_else(|| panic!("{text}: {diagnostics:?}"));
            compiled.module.settings
        };
        let (low, high) = range.split_once("..=").expect("a range");
        let [low, high]: [f64; 2] = [low, high].map(|end| end.parse().expect("a number"));
        let all = bounds(&format!("param v = {low} in {range}")).bounds_for_all_params;
        assert!(all.is_finite(), "{shape}: {all:?}");
        for fraction in [0.0, 0.3, 0.5, 0.8, 1.0] {
            let value = low + (high - low) * fraction;
            let one = bounds(&format!("let v = {value}")).bounds;
            let contains = (0..3).all(|axis| {
                all.min[axis] <= one.min[axis] + 1e-9 && one.max[axis] <= all.max[axis] + 1e-9
            });
            assert!(contains, "{shape} at {value}: {one:?} is not in {all:?}");
        }
    }
}

#[test]
fn nested_transforms_have_the_box_of_their_product() {
    let solid = "(box(40, 4, 10).translate(0, 0, 5) | box(40, 30, 2).translate(0, 0, 1))";
    let plain = check("plain", solid);
    for transforms in [
        ".rotate(37deg, Z).rotate(-37deg, Z)",
        ".rotate(37deg, Z).scale(2).rotate(-37deg, Z).scale(0.5)",
        ".translate(1, 2, 3).rotate(20deg, X).rotate(-20deg, X).translate(-1, -2, -3)",
    ] {
        let bounds = check(transforms, &format!("{solid}{transforms}"));
        for (a, b) in [(plain.min, bounds.min), (plain.max, bounds.max)] {
            for axis in 0..3 {
                let difference = (a[axis] - b[axis]).abs();
                assert!(difference < 1e-4, "{transforms}: {plain:?} {bounds:?}");
            }
        }
    }
}

/// The search ends by its number of operations, of which a factor is one.
#[test]
fn a_factor_changes_no_box() {
    let folded = |field: &str| {
        let text = format!(
            "fn f(p: vec3) -> float {{ let q = fold(0..6, p, fn(q, i) => {{\
             let a = if q.x + q.y < 0 {{ [-q.y, -q.x, q.z] }} else {{ q }};\
             let b = if a.x + a.z < 0 {{ [-a.z, a.y, -a.x] }} else {{ a }};\
             let c = if b.y + b.z < 0 {{ [b.x, -b.z, -b.y] }} else {{ b }}; 2 * c - 1 }});\
             length(q) * pow(2, -6) - 0.03 }}\n{field}"
        );
        check(field, &text)
    };
    let bounds = folded("field(fn(p) => f(p))");
    for factor in ["3", "0.01", "7 * 2", "1 / 3"] {
        let field = format!("field(fn(p) => {factor} * f(p))");
        assert_eq!(bounds, folded(&field), "{factor}");
    }
    assert_eq!(bounds, folded("field(fn(p) => f(p) / 5)"));
}

/// A live factor changes no sign, and no box.
#[test]
fn fields_with_live_factors_have_the_boxes_of_those_without() {
    for (field, high) in [
        ("k * (length(p) - 1)", 1.0),
        ("max(length(p) - 1, k * (p.x - 0.25))", 0.25),
    ] {
        let text = format!("param k = 3 in 0.5..4;\nfield(fn(p) => {field})");
        let bounds = check(field, &text);
        assert!((bounds.max[0] - high).abs() < 0.02, "{field}: {bounds:?}");
        assert!((bounds.min[0] + 1.0).abs() < 0.02, "{field}: {bounds:?}");
    }
}
