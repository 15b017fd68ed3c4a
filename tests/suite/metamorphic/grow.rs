//! Random realistic scenes: solids, 2-D shapes, fields, booleans, blends, copies, warps, floors,
//! materials, lights and skies.

use super::scene::{Body, Head, SceneLight, Shape};
use sdfc_trials::random::Random;

/// Maximum nesting depth of shapes.
const MAX_DEPTH: usize = 2;

/// Returns the scene of a seed.
pub(super) fn grow(seed: u64) -> (Head, Body) {
    let mut r = Random::new(seed ^ 0x6d65_7461);
    let head = head(&mut r);
    let mut parts = Vec::new();
    for _ in 0..2 + r.below(4) {
        let [x, y, z] = [1.5, 0.9, 1.5].map(|reach| between(&mut r, -reach, reach));
        let part = shape(&mut r, 0).then(format!("translate({x}, {y}, {z})"));
        parts.push(painted(&mut r, part));
    }
    match r.below(6) {
        0 | 1 => parts.push(floor(&mut r, "plane(Y, at: -1.35)")),
        2 => parts.push(floor(&mut r, "plane([0.1, 1, 0.05], at: -1.2)")),
        3 => parts.push(floor(
            &mut r,
            "heightfield(fn(p) => 0.15 * sin(2 * p.x) * sin(3 * p.y), over: [5, 5]).translate(0, -1.4, 0)",
        )),
        _ => {}
    }
    (head, Body { parts, seed })
}

fn floor(r: &mut Random, text: &str) -> Shape {
    painted(r, Shape::Solid(text.to_owned()))
}

/// Returns a random number with three decimals.
fn between(r: &mut Random, low: f64, high: f64) -> f64 {
    let number = low + (high - low) * r.below(1001) as f64 / 1000.0;
    (number * 1000.0).round() / 1000.0
}

fn hue(r: &mut Random) -> String {
    format!("#{:06x}", 0x20_2020 + (r.below(0xe0_0000) & 0xdf_dfdf))
}

fn painted(r: &mut Random, shape: Shape) -> Shape {
    let (a, b) = (hue(r), hue(r));
    match r.below(8) {
        0 => shape,
        1 => shape.then(format!(
            "color(fn(p) => mix({a}, {b}, 0.5 + 0.5 * noise(p * 3)))"
        )),
        2 => shape.then(format!("color(fn(p, n) => mix({a}, {b}, saturate(n.y)))")),
        3 => shape.then("material(metal)".to_owned()),
        _ => shape.then(format!("color({a})")),
    }
}

fn head(r: &mut Random) -> Head {
    let from = [
        between(r, -4.0, 4.0),
        between(r, 0.5, 3.5),
        between(r, 4.0, 6.0),
    ];
    let lights = (0..r.below(3))
        .map(|_| {
            let position = [
                between(r, -3.0, 3.0),
                between(r, 1.5, 4.0),
                between(r, -1.0, 4.0),
            ];
            let is_point = r.chance(30);
            SceneLight {
                position,
                is_point,
                color: hue(r),
                intensity: between(r, 0.8, 3.0) * if is_point { 8.0 } else { 1.0 },
                shadow: r.pick(&[
                    "hard",
                    "hard",
                    "soft",
                    "soft(0.1)",
                    "plain(0.08)",
                    "sized(0.1)",
                    "none",
                ]),
            }
        })
        .collect();
    Head {
        from,
        look: [0.0, -0.2, 0.0],
        fov: between(r, 35.0, 50.0),
        lights,
        fog: r.chance(20).then_some(0.03),
        ambient: between(r, 0.3, 1.2),
        occlusion: r.pick(&["five_tap", "five_tap", "off", "6"]),
        tonemap: r.pick(&["aces", "reinhard", "none"]),
        reach: between(r, 0.2, 0.8),
    }
}

fn shape(r: &mut Random, depth: usize) -> Shape {
    if depth >= MAX_DEPTH {
        return leaf(r);
    }
    match r.below(20) {
        0..=4 => leaf(r),
        5 | 6 => Shape::Union(
            (0..2 + r.below(3))
                .map(|_| shape(r, depth + 1).then(moved(r)))
                .collect(),
        ),
        7..=9 => {
            let operator = r.pick(&["|", "&", "-", "-"]).to_owned();
            let pair = [shape(r, depth + 1), shape(r, depth + 1).then(moved(r))];
            Shape::pair(pair, operator)
        }
        10..=12 => {
            let k = between(r, 0.05, 0.3);
            let kernel = r.pick(&[
                "",
                "",
                "cubic, ",
                "circular, ",
                "exponential, ",
                "chamfer, ",
                "fillet, ",
            ]);
            let operator = r.pick(&["|", "|", "&", "-"]);
            let pair = [shape(r, depth + 1), shape(r, depth + 1).then(moved(r))];
            Shape::blend(pair, format!("{operator}[{kernel}{k}]"))
        }
        13 => {
            let by = between(r, -0.05, 0.15);
            shape(r, depth + 1).valued(format!("offset({by})"))
        }
        14 => {
            let thickness = between(r, 0.05, 0.15);
            let shell = shape(r, depth + 1).valued(format!("shell({thickness})"));
            if r.chance(50) {
                return shell.then(format!("slice({})", r.pick(&["X", "Z", "[1, 1, 0]"])));
            }
            shell
        }
        15 => displaced(r, depth),
        16 => {
            let child = shape(r, depth + 1);
            match r.below(4) {
                0 => child.then(format!("twist({}deg)", r.below(60))),
                1 => child.then(format!("bend({}deg)", r.below(50))),
                2 => child.then(format!(
                    "warp(fn(p) => p + {} * [sin(4 * p.y), sin(4 * p.z), sin(4 * p.x)])",
                    between(r, 0.02, 0.1)
                )),
                _ => child.valued(format!("elongate([{}, 0, 0.1])", between(r, 0.05, 0.4))),
            }
        }
        17 => copies(r),
        _ => {
            let turn = rigid(r);
            shape(r, depth + 1).then(turn)
        }
    }
}

fn displaced(r: &mut Random, depth: usize) -> Shape {
    let height = between(r, 0.01, 0.06);
    let pitch = between(r, 4.0, 10.0);
    let amount = match r.below(3) {
        0 => format!("{height} * sin({pitch} * p.x) * sin({pitch} * p.y) * sin({pitch} * p.z)"),
        1 => format!("{height} * noise(p * {pitch})"),
        _ => format!("{height} * sin({pitch} * p.y)"),
    };
    shape(r, depth + 1).valued(format!("displace(fn(p) => {amount})"))
}

fn moved(r: &mut Random) -> String {
    let [x, y, z] = [0; 3].map(|_| between(r, -0.6, 0.6));
    format!("translate({x}, {y}, {z})")
}

fn rigid(r: &mut Random) -> String {
    let v = between(r, -0.5, 0.5);
    match r.below(7) {
        0 => format!("rotate({}deg, [1, {v}, 2])", r.below(360)),
        1 => format!("rotate([{}deg, {}deg, 20deg])", r.below(90), r.below(90)),
        2 => format!("scale({})", between(r, 0.5, 1.4)),
        3 => format!("scale([1.3, {}, 1])", between(r, 0.6, 1.2)),
        4 => format!("reflect([1, {v}, 0.5], at: 0.1)"),
        5 => format!("shear(xy: {v})"),
        _ => format!("rotate({}deg, Y)", r.below(360)),
    }
}

/// Returns copies of a small shape: rows, grids, rings and mirror images.
fn copies(r: &mut Random) -> Shape {
    // Raw fields may be unbounded, so only solids are copied.
    let small = Shape::Solid(solid(r)).then(format!("scale({})", between(r, 0.25, 0.4)));
    match r.below(4) {
        0 => {
            let step = between(r, 0.3, 0.6);
            small.then(format!("repeat([{step}, 0, {step}], [3, 1, 2])"))
        }
        1 => {
            let step = between(r, 0.3, 0.5);
            small.then(format!("repeat([0, {step}, 0], [1, 3, 1])"))
        }
        2 => small
            .then(format!("translate({}, 0, 0)", between(r, 0.5, 0.8)))
            .then(format!("polar({})", 3 + r.below(6))),
        _ => small
            .then(format!("translate({}, 0.1, 0.2)", between(r, 0.3, 0.6)))
            .then(format!(
                "mirror({})",
                r.pick(&["X", "[1, 0, 1]", "[1, 1, 0]"])
            )),
    }
}

fn leaf(r: &mut Random) -> Shape {
    match r.below(10) {
        0..=5 => Shape::Solid(solid(r)),
        6 | 7 => field(r),
        _ => Shape::Solid(from_shape_2d(r)),
    }
}

fn solid(r: &mut Random) -> String {
    let [a, b, c] = [0; 3].map(|_| between(r, 0.25, 0.8));
    let n = 3 + r.below(6);
    match r.below(18) {
        0 => format!("sphere({a})"),
        1 => format!("box({a}, {b}, {c})"),
        2 => format!("box([{a}, {b}, {c}], round: 0.1)"),
        3 => format!("box_frame([{a}, {b}, {c}], 0.1)"),
        4 => format!("cylinder(r: {a}, h: {b})"),
        5 => format!("cylinder(r: {a}, h: {b}, round: 0.08)"),
        6 => format!("capsule(from: [-{a}, 0, 0.1], to: [{b}, {c}, 0], r: 0.2)"),
        7 => format!("torus(r1: {a}, r2: 0.15)"),
        8 => format!("torus(r1: {a}, r2: 0.15, angle: 220deg)"),
        9 => format!("ellipsoid([{a}, {b}, {c}])"),
        10 => format!("cone(r1: {a}, r2: 0.1, h: {b})"),
        11 => format!("cone(r1: {a}, r2: 0.15, h: {b}, round: 0.05)"),
        12 => format!("round_cone(r1: {a}, r2: 0.15, h: {b})"),
        13 => format!("octahedron({a})"),
        14 => format!("prism({n}, {a}, {b})"),
        15 => format!("pyramid({a}, {b})"),
        16 => format!("tetrahedron({a})"),
        _ => format!("(gyroid({a}, 0.08) & sphere({b}))"),
    }
}

fn from_shape_2d(r: &mut Random) -> String {
    let [a, b] = [0; 2].map(|_| between(r, 0.25, 0.7));
    let figure = match r.below(6) {
        0 => format!("circle({a})"),
        1 => format!("rect({a}, {b})"),
        2 => format!("rect([{a}, {b}], round: 0.1)"),
        3 => format!("ngon({}, {a})", 3 + r.below(5)),
        4 => format!("star(5, {a}, {})", a / 2.0),
        _ => "polygon([[-0.4, -0.3], [0.4, -0.3], [0.1, 0], [0.3, 0.4], [-0.3, 0.3]])".to_owned(),
    };
    match r.below(4) {
        0 => format!("{figure}.extrude({b})"),
        1 => format!("{figure}.extrude({b}, round: 0.05)"),
        2 => format!("{figure}.revolve(offset: {})", between(r, 0.0, 0.5)),
        _ => format!(
            "{figure}.translate(0.4, 0).revolve(angle: {}deg)",
            60 + r.below(280)
        ),
    }
}

/// Returns a raw field, with a global slope bound if it has one.
fn field(r: &mut Random) -> Shape {
    let a = between(r, 0.3, 0.8);
    let b = between(r, 0.02, 0.08);
    let k = between(r, 3.0, 8.0);
    let (value, slope) = match r.below(9) {
        0 => (format!("length(p) - {a}"), Some(1.0)),
        1 => (
            format!("length(p) - {a} + {b} * sin({k} * p.x) * sin({k} * p.y)"),
            Some(1.0 + b * k),
        ),
        2 => (
            format!("max(max(abs(p.x), abs(p.y)), abs(p.z)) - {a}"),
            Some(1.0),
        ),
        3 => (format!("dot(p, p) - {}", a * a), None),
        4 => (format!("length(p * [1, 2, 1.5]) - {a}"), Some(2.0)),
        5 => (
            format!("length(vec2(length(p.xz) - {a}, p.y)) - 0.15"),
            Some(1.0),
        ),
        6 => (format!("length(p) - {a} + {b} * noise(p * {k})"), None),
        7 => (
            format!(
                "max(length(p) - {a}, abs(sin({k} * p.x) + sin({k} * p.y) + sin({k} * p.z)) / {k} - 0.1)"
            ),
            Some(1.8),
        ),
        _ => (
            format!(
                "p.x * p.x + 2 * p.y * p.y + p.z * p.z * p.z * p.z - {}",
                a * a
            ),
            None,
        ),
    };
    Shape::Field {
        value,
        slope,
        is_stated: r.chance(30),
    }
}
