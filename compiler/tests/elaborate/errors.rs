//! Diagnostics of mistakes: one snapshot of all messages, as the terminal shows them.

use crate::{build, rendered};

/// Texts with a mistake, each under its title.
const MISTAKES: &[(&str, &str)] = &[
    ("unknown name", "let base = box(1);\nbse | sphere(1)"),
    ("unknown function", "spehre(1)"),
    ("unknown method", "sphere(1).tranlsate(1, 2, 3)"),
    (
        "unknown name in a function that nobody calls",
        "fn f(r) = sphere(q);\nbox(1)",
    ),
    (
        "names of other dialects",
        "cube(1) | ball(2).move(1, 0, 0) | linear_extrude(circle(1), 2)",
    ),
    (
        "a hint instead of a name",
        "smin(sphere(1), box(1), 0.2) | sphere(1).rotateX(90)",
    ),
    (
        "a formula that is no function",
        "field(dot(p, p) - 1) | sphere(1).displace(0.1 * sin(9 * p.x))",
    ),
    (
        "a field of coordinates",
        "field(fn(x, y, z) => x * x + y * y + z * z - 1) | sphere(1).warp(fn(u, v) => [u, v, 0])",
    ),
    (
        "fields of other dialects",
        "camera { position: [0, 0, 5], target: [0, 0, 0], fovy: 30deg }\nlight { pos: [1, 2, 3], energy: 2 }\nsphere(1)",
    ),
    (
        "a camera without its point",
        "camera { eye: [0, 0, 5], direction: [0, 0, -1], zoom: 2 }\nsphere(1).paint(gold) | line([0, 0, 0], [1, 1, 1], 0.1)",
    ),
    (
        "heights of nothing",
        "camera { from: [0, 0, 5], height: -2 }\ncamera b { from: [0, 0, 5], height: 0 }\nsphere(1)",
    ),
    ("unknown argument", "cylinder(radius: 1, h: 2)"),
    ("near argument", "sphere(1) | box(1, rond: 0.1)"),
    ("missing argument", "cylinder(r: 1)"),
    ("missing object", "translate(1, 2, 3)"),
    ("too many arguments", "sphere(1, 2)"),
    ("argument given twice", "sphere(1, r: 2)"),
    ("radius and diameter", "sphere(r: 1, d: 2)"),
    ("part of a vector", "box(2, 1)"),
    ("an axis before its angle", "box(1).rotate(X, 35deg)"),
    ("a shape at a place", "box(1).at([0, 2, 0])"),
    (
        "other words for a slope and a region",
        "field(fn(p) => length(p) - 1, slope: 2) | field(fn(p) => p.y, bounds: 3)",
    ),
    ("vector too short", "sphere(1).translate([1, 2])"),
    ("text for a number", "sphere(\"1\")"),
    ("a shape for a number", "sphere(sphere(1))"),
    ("a number for a shape", "translate(1, [0, 0, 1])"),
    (
        "angle without a unit",
        "let base = box(1);\nbase.rotate(90, X).translate(0, 20mm, 0)",
    ),
    (
        "angle without a unit, computed",
        "let n = 3;\nbox(1).rotate(n * 30, X)",
    ),
    (
        "copies that come to be many times as long as their cells",
        "param r = 0.3 in 0.1..=8;\nsphere(r).repeat([1, 0, 0])",
    ),
    (
        "cells that come to be far smaller than their copies",
        "param gap = 2 in 0.1..=3;\nbox(1).repeat([gap, 0, 0], count: [4, 1, 1])",
    ),
    ("copies that overlap along three axes", "box(7).repeat(1)"),
    (
        "copies without end",
        "gyroid(cell: 1, thickness: 0.1).repeat(4)",
    ),
    (
        "copies that leave their cells",
        "animate { duration: 4s }\nsphere(0.2).translate(9 * sin(time), 0, 0).repeat(1, count: 3)",
    ),
    (
        "behind a mirror",
        "sphere(1).translate(-3, 0, 0).mirror(X) | sphere(1).translate(0, -0.5, 0).mirror(Y) | sphere(1).mirror([0, 1, 1], at: 0.8)",
    ),
    (
        "factors of very different sizes",
        "torus(1, 0.3).scale([1, 1e-5, 1]) | box(1).scale([1, 1e-5, 1]) | torus(1, 0.3).scale(1e-5)",
    ),
    (
        "one number for all sides, and another",
        "box_frame(0.8, 0.1)",
    ),
    (
        "one number for all axes, and a count",
        "sphere(0.3).repeat(0.8, 3)",
    ),
    ("end of a range", "param a = 1 in 0..1;\nsphere(a + 1)"),
    (
        "material that hides a function",
        "material floor { color: #f00 }\nsphere(floor(2.5)).material(floor)",
    ),
    (
        "import of the scene itself, in the end",
        "import \"back.sdf\" as back;\nback::a()",
    ),
    ("length for an angle", "box(1).rotate(2mm, Y)"),
    ("angle for a radius", "sphere(90deg)"),
    (
        "area for a length",
        "scene { units: mm }\nlet a = 2mm;\nsphere(a * a)",
    ),
    ("units in a sum", "let a = 10mm + 30deg;\nsphere(a)"),
    ("sum of shapes", "sphere(1) + box(1)"),
    ("product of shapes", "sphere(1) * 2"),
    ("negative shape", "sphere(1) & -box(1)"),
    ("set operation on numbers", "sphere(1) | 2"),
    (
        "condition with one bar",
        "let a = true | false;\nif a { sphere(1) } else { box(1) }",
    ),
    ("2D and 3D", "circle(1) | sphere(1)"),
    ("2D only", "sphere(1).extrude(2)"),
    ("3D only", "circle(1).twist(9deg)"),
    ("calling a number", "let r = 2;\nsphere(r(3))"),
    ("bad swizzle", "let p = [1, 2, 3];\nsphere(p.xq)"),
    ("function as a field", "let s = sphere(1);\ns.nothing"),
    ("radius zero", "sphere(0)"),
    ("negative size", "let w = -2;\nbox(1, w, 1)"),
    (
        "degenerate capsule",
        "cylinder(from: [1, 2, 3], to: [1, 2, 3], r: 0.1)",
    ),
    ("no direction", "plane([0, 0, 0])"),
    ("scale by zero", "sphere(1).scale(0)"),
    ("division by zero", "let n = 3;\nsphere(1 / (n - 3))"),
    ("infinite", "let a = exp(1000);\nsphere(a)"),
    ("too large", "sphere(1e30)"),
    ("square root of a negative number", "sphere(sqrt(-1))"),
    ("loop over time", "for i in 0..time { sphere(i + 1) }"),
    (
        "point as a radius",
        "field(fn(p) => length(p) - 1) | sphere(1).displace(fn(p) => len(for i in 0..p.x { 1 }))",
    ),
    ("shape in a field", "field(fn(p) => sphere(p.x))"),
    ("field gives a vector", "field(fn(p) => p)"),
    ("field that forgot its function", "field(1)"),
    (
        "a loop of a billion",
        "for i in 0..1000000000 { sphere(1) }",
    ),
    (
        "recursion without end",
        "fn f(n) = sphere(1) | f(n + 1);\nf(0)",
    ),
    (
        "too much work",
        "let a = for i in 0..5000 { sum(for j in 0..5000 { i * j }) };\nsphere(sum(a))",
    ),
    (
        "failed assertion",
        "let n = 3;\nassert(n > 4, \"at least five, not \" + n);\nsphere(1)",
    ),
    (
        "used before it is defined",
        "let a = b + 1;\nlet b = 2;\nsphere(a)",
    ),
    (
        "unknown block",
        "lamp key { dir: [1, 1, 1] }\nligth sun { dir: [0, 1, 0] }\nsphere(1)",
    ),
    (
        "unknown field",
        "camera { form: [0, 1, 5], position: 1 }\nsphere(1)",
    ),
    (
        "field of the wrong type",
        "camera { from: 3, fov: 40 }\nlight { dir: [0, 0, 0] }\nrender { aa: 99, tonemap: acse }\nsphere(1)",
    ),
    ("light from nowhere", "light { color: #fff }\nsphere(1)"),
    (
        "unknown unit of the scene",
        "scene { units: km, up: x }\nsphere(1)",
    ),
    (
        "unknown type",
        "fn f(r: double) -> solid = sphere(r);\nf(1)",
    ),
    (
        "annotation that does not hold",
        "fn f(a: angle) = box(1).rotate(a, X);\nf(30)",
    ),
    (
        "result that is not what is written",
        "fn f(r) -> shape2 = sphere(r);\nf(1)",
    ),
    (
        "two params of a name",
        "param a = 1;\nparam a = 2;\nsphere(a)",
    ),
    (
        "param far outside its range, which a loop counts to",
        "param n = 999999999 in 1..=5;\nunion(for i in 0..n { sphere(i + q) })",
    ),
    ("param outside its range", "param a = 3 in 0..1;\nsphere(a)"),
    ("param of nothing", "param a = sphere(1);\na"),
    ("unknown blend", "sphere(1) |[chamfre, 0.2] box(1)"),
    (
        "unknown kernel",
        "union(sphere(1), box(1), smooth: 0.2, kernel: qubic)",
    ),
    ("blend of an angle", "sphere(1) |[30deg] box(1)"),
    ("polygon of two", "polygon([[0, 0], [1, 0]]).extrude(1)"),
    ("list too short", "sphere(at([1, 2, 3], 3))"),
    (
        "private name",
        "import \"parts.sdf\" as parts;\nparts::_secret()",
    ),
    (
        "dot after an import",
        "import \"parts.sdf\" as parts;\nparts.bolt(1)",
    ),
    (
        "unknown name of an import",
        "import \"parts.sdf\" as parts;\nparts::blot(1) | prats::bolt(1)",
    ),
    ("missing file", "import \"bolt\" as bolt;\nbolt::head()"),
    (
        "unknown library",
        "import \"std/fastener\" as fast;\nsphere(fast::M4.clearance)",
    ),
    (
        "absolute path",
        "import \"/etc/passwd\" as a;\nimport \"../x.sdf\" as b;\nsphere(1)",
    ),
    (
        "a circle of imports",
        "import \"one.sdf\" as one;\none::a()",
    ),
    (
        "mistake in an imported function",
        "import \"parts.sdf\" as parts;\nbox(1) | parts::bolt(-1)",
    ),
    (
        "mistake in a function of the scene",
        "fn ball(r) = sphere(r);\nbox(1) | ball(0)",
    ),
    (
        "many mistakes at once",
        "sphere(0) | box(sphere) | cylinder(1) | torus(1, 0.1, 30)",
    ),
    (
        "a function that was not called",
        "let f = fn(r) => sphere(r);\nf | nothing",
    ),
    (
        "remainder as a function",
        "field(fn(p) => length(vec3(mod(p.x + 1, 2.0), p.yz)) - fmod(3, 2))",
    ),
    (
        "matrices",
        "field(fn(p) => length(mat3(1, 0, 0, 0, 1, 0, 0, 0, 1) * p) - 1) | sphere(mat2(1))",
    ),
    ("casts", "sphere(float(1) + int(2.5))"),
    ("numbers of other languages", "sphere(1.f) | box(1.e3)"),
    ("fillet as a method", "box(1).fillet(0.2)"),
    ("round as a method", "box(1).round(0.2)"),
    (
        "chamfer as a method",
        "box(1).chamfer(0.2) | box(1).bevel(0.1)",
    ),
    (
        "cylinder with two diameters",
        "cylinder(h: 3, d1: 2, d2: 1)",
    ),
    (
        "cylinder with one of two radii",
        "cylinder(r1: 3, h: 2) | cylinder(r1: 3, d2: 2, h: 1)",
    ),
    (
        "centred shapes",
        "box([1, 2, 3], center: true) | box(center: true, size: 2) | circle(1).extrude(h: 3, center: false)",
    ),
    (
        "synonyms of arguments",
        "cylinder(radius: 1, height: 2) | sphere(diameter: 3)",
    ),
    (
        "angle as a field",
        "field(fn(p) => length(p) - 1 - atan2(p.z, p.x) / tau)",
    ),
    (
        "angle in degrees as a field",
        "field(fn(p) => { let a = atan2(p.z, p.x); length(p) - a * 180 / pi })",
    ),
    (
        "angle beside a number whose name is that of an angle within a loop",
        "field(fn(p) => { let a = 2; let b = sum(for i in 0..2 { let a = atan2(p.z, i); a / 1rad }); length(p) - a / pi - b - atan2(p.x, 1) })",
    ),
    (
        "angle alone as a field",
        "field(fn(p) => atan2(p.z, p.x) - 1)",
    ),
    (
        "angle over 6.28 as a radius",
        "sphere(atan2(1, 2) / 6.28) | sphere(atan2(1, 2))",
    ),
    (
        "angle as an annotated number",
        "fn f(a: float) -> float = atan2(a, 1) / (2 * pi);\nsphere(f(1))",
    ),
    ("atan of two numbers", "box(1).rotate(atan(1, 2), X)"),
    (
        "number as a vector",
        "field(fn(p) => dot(cross(p, 1), p + 1) + distance(p, 2) + dot(1, p.xy) - length(3))",
    ),
    (
        "extent of the plane for a field of space",
        "field(fn(p) => length(p) - 1, within: [40, 40])",
    ),
    (
        "extent of four numbers",
        "field(fn(p: vec2) => length(p) - 1, within: [1, 2, 3, 4])",
    ),
    ("size of two numbers", "box([1, 2])"),
    ("blend larger than a shape", "sphere(0.1) |[5] box(0.1)"),
    (
        "shapes that do not touch",
        "let hole = sphere(0.2).translate(5, 0, 0);\n(box(1) - hole) | (box(1) & hole)",
    ),
    (
        "unused names",
        "import \"parts.sdf\" as parts;\nparam p = 1;\nlet a = 2;\nfn f(x, y) { let z = x; x }\nfn g() = 3;\nsphere(f(1, 2))",
    ),
];

const FILES: &[(&str, &str)] = &[
    (
        "parts.sdf",
        "fn _secret() = sphere(1);\nfn bolt(r) {\n    let head = cylinder(r: 2 * r, h: 1);\n    head | cylinder(r: r, h: 4)\n}\n",
    ),
    (
        "one.sdf",
        "import \"two.sdf\" as two;\nfn a() = two::b();\n",
    ),
    ("back.sdf", "import \"on.sdf\" as on;\nfn a() = on::b();\n"),
    (
        "on.sdf",
        "import \"scene.sdf\" as scene;\nfn b() = sphere(1);\n",
    ),
    (
        "two.sdf",
        "import \"one.sdf\" as one;\nfn b() = sphere(1);\n",
    ),
];

#[test]
fn mistakes_are_explained() {
    let mut text = String::new();
    for (title, scene) in MISTAKES {
        let (elaborated, diagnostics, sources) = build(scene, FILES, &[]);
        let fails = diagnostics.iter().any(|d| d.is_error());
        assert_eq!(elaborated.is_none(), fails, "{title}");
        assert!(
            !diagnostics.is_empty(),
            "{title}: nothing is said about\n{scene}"
        );
        text += &format!("──── {title}\n{}\n", rendered(diagnostics, &sources));
    }
    insta::assert_snapshot!(text);
}

/// Texts of other languages that the corrections of the messages turn into scenes.
const CORRECTABLE: &[&str] = &[
    "field(fn(p) => length(vec3(mod(p.x + 1., 2.0), p.yz)) - 1.)",
    "#define R 2\nfloat ball(vec3 p, float r) { return length(p) - r; }\nfield(fn(p) { ball(p, R) })",
    "field(fn(p) -> float { let q = p * 1.0f; length(q) - 1.e0 })",
    "field(lambda p: length(p) - 1.)",
    "fn(d, s) { d + s }\nsphere(name(1, 2))",
    "field(fn(p) => length(p) - 1 - 0.1 * floor(atan2(p.z, p.x) / tau))",
    "field(fn(p) => length(p) - 0.01 * atan2(p.z, p.x) * 180 / pi)",
    "sphere(1 + atan2(1, 2) / 6.28)",
    "sphere(1).rotate(atan(1, 2), X)",
    "translate([1, 2, 3]) rotate([0, 0, 90]) box(1);",
    "difference() {\n    box(2);\n    translate([1, 0, 0]) rotate(45) sphere(1.3);\n}",
    "color(#f00) translate([0, 0, 1]) { box(1, center = true); cylinder(h=3, r1=2, r2=1, center=true); }",
    "cylinder(h: 3, d1: 2, d2: 1)",
    "linear_extrude(5) circle(1);",
    "mirror([1, 0, 0]) cube(2);",
    "field(fn(p) => length(cross(p, 1)) - 1)",
];

#[test]
fn corrections_of_other_languages_compile() {
    for scene in CORRECTABLE {
        let mut text = (*scene).to_owned();
        for _ in 0..12 {
            let (_, diagnostics, _) = build(&text, FILES, &[]);
            let errors: Vec<_> = diagnostics.iter().filter(|d| d.is_error()).collect();
            if errors.is_empty() {
                break;
            }
            let fix = errors.iter().find_map(|error| error.fixes.first());
            let Some(fix) = fix else { break };
            let mut edits: Vec<_> = fix.edits.iter().collect();
            edits.sort_by_key(|edit| std::cmp::Reverse(edit.span.start));
            for edit in edits {
                let range = edit.span.start as usize..edit.span.end as usize;
                text.replace_range(range, &edit.replacement);
            }
        }
        let (elaborated, diagnostics, sources) = build(&text, FILES, &[]);
        let messages = rendered(diagnostics, &sources);
        assert!(elaborated.is_some(), "{scene}\nbecame\n{text}\n{messages}");
    }
}

#[test]
fn values_from_outside_are_checked() {
    let scene = "param goo = 0.3 in 0..1;\nparam n = 3 in 1..=5;\nparam count: int = 3;\nparam turn = 30deg;\nparam tint = #ff8800;\nparam on = true;
sphere(goo + n + count).rotate(turn, X).color(if on { tint } else { #fff })";
    let mut text = String::new();
    for override_ in [
        ("gooo", "0.5"),
        ("goo", "1.5"),
        ("goo", "nan"),
        ("goo", "inf"),
        ("goo", "1e999"),
        ("goo", ""),
        ("goo", "30deg"),
        ("goo", "0.1 + 0.1"),
        ("n", "2.5"),
        ("n", "6"),
        ("count", "4.3"),
        ("turn", "30"),
        ("tint", "red"),
        ("on", "1"),
    ] {
        let (elaborated, diagnostics, sources) = build(scene, &[], &[override_]);
        assert!(elaborated.is_none(), "{override_:?}");
        text += &format!(
            "──── {}={}\n{}\n",
            override_.0,
            override_.1,
            rendered(diagnostics, &sources)
        );
    }
    insta::assert_snapshot!(text);
}
