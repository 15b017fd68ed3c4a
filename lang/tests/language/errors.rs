//! Messages about texts with mistakes.
//!
//! Each snapshot is a group of texts with all their messages. A new mistake is a new line in a group.

use super::parse_and_render;

fn render_messages(texts: &[&str]) -> String {
    let messages = texts.iter().map(|text| {
        let (tree, messages) = parse_and_render(text);
        let verdict = match tree {
            Some(_) => "accepted",
            None => "refused",
        };
        format!("{text}\n~~~ {verdict}\n{messages}")
    });
    messages.collect::<Vec<_>>().join("\n==========\n")
}

#[test]
fn words() {
    insta::assert_snapshot!(render_messages(&[
        "box(1).rotate(90degrees, X)",
        "sphere(3furlongs) | box(2furlong)",
        "sphere(1).color(#12345) | box(1).color(#12345g)",
        "print(\"half);\nsphere(1)",
        "print(\"50\\% of \\x\");",
        "sphere(1) /* the rest",
        "print('single');",
        "let n = 99999999999999999999;\nlet m = 1e400;",
        "let a = 2 × 3;\nlet b = 4 − 1;",
        "let größe = 2;\nlet a = 1;",
        "let a = 1 @ 2;",
        "let name = “text”;",
        "sphere(1.0f) | box(1f)",
        "#define N 3 // rounds\nsphere(N)",
        "#define sq(x) (x * x)\nsphere(sq(2))",
        "#define N 3;\nsphere(N)",
        "#define N 3 + \\\n    4\nsphere(N)",
        "#define part 3\nsphere(1)",
        "#ifdef FAST\nsphere(1)",
        "sphere(1, $fn = 100)",
        "sphere(1.)",
        "box(1., 2., 3.).translate(-1.*2, 0, 4. / 2)",
        "param a = 1. in 0. .. 2.;\nsphere(a)",
        "sphere(1. - .5)",
    ]));
}

#[test]
fn separators() {
    insta::assert_snapshot!(render_messages(&[
        "let r = 2\nsphere(r)",
        "let a = 1 let b = 2;\nparam c = 3",
        "fn f(x) {\n    let y = x\n    y\n}",
        "sphere(1)\nbox(2)",
        "sphere(1)\ncamera { from: [0, 1, 5] }",
        "box(1 2, 3)",
        "[[1, 2] [3, 4]]",
        "camera { from: [0, 1, 5] look: [0, 0, 0] }",
        "camera { from: [0, 1, 5]; fov: 35deg }\nsphere(1)",
        "camera { from [0, 1, 5], fov: 3 }\nsphere(1)",
        "sky { fog: 0.1 };\nfn f(x) { x };\nsphere(1)",
        "sphere(1);",
        "fn ball(r) { let s = r; sphere(s); }",
        "fn ball(r) { }",
        "sphere(1);\nbox(1)",
    ]));
}

#[test]
fn brackets() {
    insta::assert_snapshot!(render_messages(&[
        "let a = sphere(1;\nlet b = 2;",
        "let a = union([sphere(1), box(2);\nlet b = = 2;",
        "let a = sphere(1\nlet b = 2;",
        "let v = [1, 2, 3);",
        "let v = f(g(1, 2];",
        "sphere(1))",
        "fn f(x) {\n    x * 2\n\nparam y = 2;\nsphere(y)",
        "fn f(x) {\n    let y = (x * 2);\n    y",
        "camera {\n    from: [0, 1, 5],\n\nlet a = 1;",
        "let f = for i in 0..3 {\n    i\n\nparam a = 1;",
    ]));
}

#[test]
fn names() {
    insta::assert_snapshot!(render_messages(&[
        "let = sphere(1);\nlet 2 = 3;",
        "let part = sphere(1);\npart",
        "fn f(in: float) = 1;\nfn for(x) = 1;",
        "cylinder(by: 2)",
        "for 0..3 { 1 }",
        "x = 3;\nsphere(x)",
        "const x = 3;\nvar y: float = 2;\nsphere(x)",
        "function f(x) { x }\nfn g(x) { return x; }",
        "fn f(x) {\n    param y = 2;\n    fn g(z) = z;\n    x\n}",
        "let f = fn g(x) => x;",
        "import \"std/fasteners\";\nsphere(1)",
        "import fasteners as f;",
        "while (x < 3) { x }",
        "let a = if b { 1 } elif c { 2 } else { 3 };",
        "sphere(1).",
        "let mut d = 1;\nsphere(d)",
        "for (i = [0:5]) translate([i, 0, 0]) box(1);",
    ]));
}

#[test]
fn operators() {
    insta::assert_snapshot!(render_messages(&[
        "let a = r ^ 2 + s ** 3;",
        "let a = big ? 2 : 1;\nlet b = ;",
        "let a = b and not c or d;",
        "let a = b === c || d !== e || f <> g;",
        "cylinder(r = 1, h=2)",
        "camera { fov = 35deg }\nsphere(1)",
        "assert(n = 3, \"three\");",
        "let a = if b = 1 { c } else { d };",
        "let a == 1;\nlet b := 2;\nfn f(x) => x;",
        "a += 1;\nb.x = 2;",
        "field(p => length(p) - 1)",
        "field((p, n) => length(p) - 1)",
        "let h = p[1];",
        "let a = sphere(1).translate((1, 2, 3));",
        "let a = box(1,, 2);",
        "let a = box(, 2);",
        "let h = 2x + 1;",
        "let a = +1;\nlet b = a++;",
        "let a = ;\nlet b = a + ;\nlet c = a * * b;",
        "(a | ) - b",
        "if 0 < x < 1 { a } else { b }",
        "let n = if big { 2 };",
        "a |[] b",
        "cylinder(r: 1, 2)",
        "param n = 3 in 6;\nparam m = 3 in [1, 2] by 1;",
        "sphere 1",
        "a | b - c",
        "a - b |[0.1] c & d - e",
        "cylinder(h=3, r1=2, r2=1)",
        "cylinder(h=[1, f(a, b = 2)], d1 = 2).translate(by = 1)",
    ]));
}

#[test]
fn lambdas() {
    insta::assert_snapshot!(render_messages(&[
        "field(fn(p) { let q = p; length(q) - 1 })",
        "let f = fn(d, s) { d + s };\nsphere(f(1, 2))",
        "fn(d, s) { d + s }",
        "field(fn(p) -> float { length(p) - 1 })",
        "field(fn(p): float => length(p) - 1)",
        "let f = fn(p) -> length(p) - 1;\nlet g = fn(p) = p.x;\nlet h = fn(p): p.x;\nlet i = fn(p) -p.x;",
        "field((a, b) -> a);\nlet g = p -> p.x;",
        "let f = |p| length(p) - 1;\nfield(|p: vec3| p.x)",
        "let f = lambda a, b: a + b;\nfield(f)",
        "fn bumps(r) = field(fn(p) { length(p) - r });",
        "field(function(p) => length(p) - 1)",
        "let s =\n    | a\n    | b;",
        "let s = | a | b;",
        "a(x) -> 2",
        "a(x, y)(z) => 2",
    ]));
}

#[test]
fn shading_languages() {
    insta::assert_snapshot!(render_messages(&[
        "float sdBox(vec3 p, vec3 b) { return length(p) - b.x; }\nsphere(1)",
        "vec2 f(in vec2 p, const float r) { vec2 q = p; return q * r; }\nsphere(1)",
        "void mainImage(out vec4 color, in vec2 at) { color = vec4(1.); }\nsphere(1)",
        "float f(vec3 p[2]) { p[0].x }\nsphere(1)",
        "float f(void) { return 1; }\nsphere(1)",
    ]));
}

#[test]
fn transforms_before_their_shapes() {
    insta::assert_snapshot!(render_messages(&[
        "translate(x, y, z) box(1)",
        "translate([1, 2, 3]) box(1);",
        "translate([1, 2, 3])\n    rotate([0, -90, 45.5])\n    box(1).scale(2);",
        "rotate(90) parts::bolt(2) | sphere(1)",
        "let a = mirror([1, 0, 0]) rotate(30deg) box(1);",
        "linear_extrude(5) circle(1);",
        "color(#f00) {\n    box(1);\n    sphere(2);\n}",
        "difference() { box(2); sphere(1.2); translate([1, 0, 0]) box(1); }",
        "translate([0, 0, 1]) union() { box(2); sphere(1.2); }",
        "union() { let a = 1; box(a); }",
        "translate(base, 1, 2, 3)\nbox(1)",
        "union(a, b) sphere(1)",
        "difference() { union() { box(1); box(2); } sphere(1); }",
        "difference() { sphere(1); for i in 0..3 { box(i); } }",
        "rotate(90, [0, 0, 1]) box(1);",
        "linear_extrude(5mm, circle(3mm)) circle(1);",
        "linear_extrude(height = 5) circle(1);",
        "difference() {}",
        "hull() { sphere(1); translate([2, 0, 0]) sphere(1); }",
        "sphere(1) | smooth(0.2) { box(1); }",
    ]));
}

#[test]
fn several_are_found_in_one_run() {
    insta::assert_snapshot!(render_messages(&["\
param goo = 0.35 in 0.0..1.0
param tint: color = #3aa6f;
camera { from = [0, 1.4, 5], fov: 35degs }
let base = sphere(r = 1) |[0.2 box(1);
fn f(x) {
    let y = x ^ 2
    let z = y + ;
    z;
}
let = 3;
let good = 4;
base.rotate(90deg X)
"]));
}

#[test]
fn no_more_than_twenty_are_shown() {
    let text = "let = 1;\n".repeat(30);
    let (_, messages) = parse_and_render(&text);
    assert_eq!(messages.matches("error[E0115]").count(), 20);
    assert!(messages.ends_with("… and 10 more\n"), "{messages}");
}

#[test]
fn coloured_text_is_the_plain_text_with_colours() {
    use sdfc_lang::{Sources, Style, parse};
    let mut sources = Sources::new();
    let file = sources.add("scene.sdf", "cylinder(r = 1)");
    let (_, diagnostics) = parse(&sources, file);
    let coloured = diagnostics[0].render(&sources, Style::Coloured);
    assert!(coloured.contains("\u{1b}["));
    let mut plain = String::new();
    let mut remaining = coloured.as_str();
    while let Some((before, after)) = remaining.split_once('\u{1b}') {
        plain.push_str(before);
        remaining = after.split_once('m').map_or("", |(_, remaining)| remaining);
    }
    plain.push_str(remaining);
    assert_eq!(plain, diagnostics[0].render(&sources, Style::Plain));
}

#[test]
fn json_has_places_and_fixes() {
    use sdfc_lang::{Diagnostics, Sources, parse};
    let mut sources = Sources::new();
    let file = sources.add("scene.sdf", "let ä = 1;\ncylinder(r = 1)");
    let (_, diagnostics) = parse(&sources, file);
    let diagnostics: Diagnostics = diagnostics.into_iter().collect();
    insta::assert_snapshot!(serde_json::to_string_pretty(&diagnostics.to_json(&sources)).unwrap());
}
