//! Random shapes as texts: every primitive, combination and transform of the language.
//!
//! Lengths are multiples of 1/64, which `f32` represents exactly, and about as large as a unit. Some are
//! degenerate on purpose: zero where that is allowed, the largest that fits, or equal to each other.

mod numbers;
mod rows;

use crate::random::Random;
pub use numbers::length;
use numbers::{LENGTH_STEPS_PER_UNIT, degrees, direction, length_or_zero, rounding, vector};
use rows::{ShapeClass, call};
use sdfc_vm::table::Row;

/// Returns a shape of a row of this class.
fn shape_of_class(r: &mut Random, class: ShapeClass) -> String {
    let row = r.pick(&rows::rows(class));
    call(r, row)
}

/// Returns a finite solid made of a shape of a row. Infinite solids are cut by a sphere, 2-D shapes are
/// extruded.
pub fn finite_solid(r: &mut Random, row: &Row) -> String {
    let shape = call(r, row);
    match ShapeClass::from_row(row) {
        Some(ShapeClass::ExactShape2d) => format!("{shape}.extrude(0.5)"),
        Some(ShapeClass::UnboundedSolid | ShapeClass::BoundSolid { is_finite: false }) => {
            format!("({shape} & sphere(1))")
        }
        Some(ShapeClass::ExactSolid | ShapeClass::BoundSolid { is_finite: true }) => shape,
        None => panic!("`{}` is no shape of a class", row.name),
    }
}

/// Returns a solid with exact distances everywhere by its row, centred near the origin.
pub fn exact_solid(r: &mut Random) -> String {
    shape_of_class(r, ShapeClass::ExactSolid)
}

/// Returns a 2-D shape with exact distances everywhere by its row.
pub fn exact_shape_2d(r: &mut Random) -> String {
    if r.chance(14) {
        let count = 3 + r.below(4);
        let corner = |index: usize| {
            let (sine, cosine) = (std::f64::consts::TAU * index as f64 / count as f64).sin_cos();
            let distance = length(r, 0.25, 0.75);
            [cosine * distance, sine * distance]
        };
        return polygon((0..count).map(corner).collect());
    }
    shape_of_class(r, ShapeClass::ExactShape2d)
}

/// Returns a polygon whose sides may cross each other.
pub fn crossing_polygon(r: &mut Random) -> String {
    let count = 3 + r.below(4);
    let corners = (0..count).map(|_| [length(r, -0.75, 0.75), length(r, -0.75, 0.75)]);
    polygon(corners.collect())
}

/// Returns the polygon of these corners, rounded to multiples of 1/64.
fn polygon(corners: Vec<[f64; 2]>) -> String {
    let rounded = |v: f64| (v * LENGTH_STEPS_PER_UNIT).round() / LENGTH_STEPS_PER_UNIT;
    let corners: Vec<_> = corners
        .into_iter()
        .map(|corner| corner.map(rounded))
        .collect();
    format!("polygon({corners:?})")
}

/// Returns a solid whose row promises a bound, or exact distances outside only.
fn bound_solid(r: &mut Random) -> String {
    let [a, b, c] = [0; 3].map(|_| length(r, 0.25, 0.875));
    match r.below(8) {
        0 | 1 => shape_of_class(r, ShapeClass::BoundSolid { is_finite: true }),
        2..=4 => {
            let solid = shape_of_class(r, ShapeClass::BoundSolid { is_finite: false });
            let limit = match r.below(3) {
                0 => format!("box({b})"),
                1 => format!("sphere({b})"),
                _ => format!("box({b}, {c}, 1)"),
            };
            format!("({solid} & {limit})")
        }
        5 => format!("torus(r1: {}, r2: {})", a.min(b) / 2.0, a.max(b)),
        _ => format!(
            "{}.extrude({a}, round: {})",
            exact_shape_2d(r),
            rounding(r, a / 2.0)
        ),
    }
}

/// Returns an unbounded solid, half of the time cut by a sphere.
fn unbounded_solid(r: &mut Random) -> String {
    let solid = shape_of_class(r, ShapeClass::UnboundedSolid);
    match r.chance(50) {
        true => format!("({solid} & sphere({}))", length(r, 0.5, 1.0)),
        false => solid,
    }
}

/// Returns a user-defined field without a stated slope bound.
fn field(r: &mut Random) -> String {
    let (a, b) = (length(r, 0.25, 1.0), length(r, 0.25, 2.0));
    let w = length(r, 1.0, 9.0);
    let formula = match r.below(14) {
        0 => format!("length(p) - {a}"),
        1 => format!("dot(p, p) - {a}"),
        2 => format!("{b} * (length(p.xz) - {a}) + 0.25 * sin({w} * p.y)"),
        3 => format!("p.y - {a} * sin({b} * p.x) * cos({b} * p.z)"),
        4 => format!("p.y - {b} * fbm(p * 0.5, octaves: 3)"),
        5 => format!("p.x * p.x * p.x + p.y * p.y + p.z * p.z * {b} - {a}"),
        6 => format!("{a} - 1 / (1 + {b} * dot(p, p))"),
        7 => format!("max(abs(p.x), max(abs(p.y), abs(p.z))) - {a}"),
        8 => format!("0.5 - exp(-{b} * dot(p, p)) - exp(-dot(p - [1, 0, 0], p - [1, 0, 0]))"),
        9 => format!("sqrt(p.x * p.x + {b} * p.z * p.z + 0.125) - {a}"),
        10 => format!("length(p) - {a} + 0.125 * noise({w} * p)"),
        11 => format!("sin({w} * p.x) * cos({w} * p.y) + sin({w} * p.y) * cos({w} * p.z) - {a}"),
        12 => format!("tanh({b} * (p.y + {a})) + 0.25 * atan2(p.x, 2 + p.z * p.z) / 1rad"),
        _ => format!(
            "if p.y > 0 {{ length(p) - {a} }} else {{ max(length(p.xz) - {a}, -p.y - {b}) }}"
        ),
    };
    let arguments = match r.below(4) {
        0 => "",
        1 => ", within: 2.5",
        _ => ", within: 4",
    };
    format!("field(fn(p) => {formula}{arguments})")
}

/// Returns an inward offset of a shape with a field that is steeper than a distance.
pub fn steep_inset(r: &mut Random) -> String {
    let (factor, a) = (length(r, 1.5, 9.0), length(r, 0.5, 1.0));
    let field = match r.below(5) {
        0 => format!("field(fn(p) => {factor} * (length(p) - {a}))"),
        1 => format!("field(fn(p) => {factor} * (dot(p, p) - {a}))"),
        2 => format!("field(fn(p) => {factor} * (max(abs(p.x), abs(p.y), abs(p.z)) - {a}))"),
        3 => format!("field(fn(p: vec2) => {factor} * (length(p) - {a})).extrude({a})"),
        _ => format!("{}.warp(fn(p) => p * {factor})", exact_solid(r)),
    };
    let shape = match r.below(6) {
        0 | 1 => field,
        2 => format!("({field} | {})", exact_solid(r)),
        3 => format!("({field} & {})", exact_solid(r)),
        4 => format!("{field}.rotate({}deg, [1, 2, 3])", r.below(360)),
        _ => format!("{field}.offset({})", length(r, -0.125, 0.25)),
    };
    format!("{shape}.offset(-{})", length(r, 0.0625, 1.0))
}

/// Returns a field with products of factors that are zero somewhere, over a live number or near a pole.
pub fn product_field(r: &mut Random) -> String {
    let factor = |r: &mut Random| {
        let a = length(r, 0.25, 1.5);
        let centre: [f64; 3] = std::array::from_fn(|_| length(r, -1.0, 1.0));
        match r.below(6) {
            0 => format!("(p.{})", r.pick(&["x", "y", "z"])),
            1 => format!("(length(p - {centre:?}) - {a})"),
            2 => format!("max({a} - abs(p.y - length(p - {centre:?})), 0)"),
            3 => format!("max(p.x - {a}, 0)"),
            4 => format!("sin({a} * p.z)"),
            _ => format!("abs(p.y - {a})"),
        }
    };
    let first = factor(r);
    let mut product = format!("{first} * {first}");
    for _ in 0..r.below(3) {
        product = match r.chance(30) {
            true => format!("({product}) * ({product})"),
            false => format!("{product} * {}", factor(r)),
        };
    }
    let divisor = match r.below(5) {
        0 | 1 => "k".to_owned(),
        2 => "(p.x * p.x + p.z * p.z)".to_owned(),
        3 => format!("sqrt({} + p.z * p.z)", first),
        _ => factor(r),
    };
    let function = r.pick(&["", "", "abs", "ln"]);
    let (a, scale) = (length(r, -1.0, 1.0), length(r, 0.125, 8.0));
    format!(
        "param k = {} in 0..=1;\nfield(fn(p) => {scale} * (p.y - {a} - {function}({product} / {divisor})))",
        length(r, 0.0625, 1.0)
    )
}

/// Returns a random shape, nested at most `depth` deep.
pub fn solid(r: &mut Random, depth: usize) -> String {
    if depth == 0 || r.chance(15) {
        let shape = match r.below(10) {
            0..=5 => exact_solid(r),
            6 | 7 => bound_solid(r),
            8 => field(r),
            _ => unbounded_solid(r),
        };
        return match r.chance(50) {
            true => format!("{shape}.translate({})", format_arguments(vector(r, 0.75))),
            false => shape,
        };
    }
    if r.chance(35) {
        let (a, b) = (solid(r, depth - 1), solid(r, depth - 1));
        let operator = operator(r);
        return match r.below(12) {
            0 => format!("xor({a}, {b})"),
            1 => format!("{a}.morph({b}, {})", length_or_zero(r, 1.0)),
            2 => format!("union([{a}, {b}, {}])", exact_solid(r)),
            _ => format!("({a} {operator} {b})"),
        };
    }
    let child = match r.below(12) {
        0 => return solid_from_shape_2d(r),
        _ => solid(r, depth - 1),
    };
    format!("{child}.{}", transform(r))
}

/// Returns an operator between two shapes.
fn operator(r: &mut Random) -> String {
    let k = length_or_zero(r, 0.4);
    let set = r.pick(&["|", "&", "-"]);
    match r.below(10) {
        0..=2 => set.to_owned(),
        3 => format!("{set}[{k}]"),
        4 => format!("{set}[cubic, {k}]"),
        5 => format!("{set}[circular, {k}]"),
        6 => format!("{set}[exponential, {k}]"),
        7 => format!("{set}[chamfer, {k}]"),
        8 => format!("{set}[fillet, {k}]"),
        _ if set == "|" && r.chance(50) => format!("|[distance, {k}]"),
        _ => format!("{set}[stairs, {k}, n: {}]", 1 + r.below(4)),
    }
}

/// Returns a solid made from a 2-D shape.
fn solid_from_shape_2d(r: &mut Random) -> String {
    let mut shape_2d = exact_shape_2d(r);
    if r.chance(40) {
        let other = exact_shape_2d(r);
        shape_2d = format!(
            "({shape_2d} {} {other})",
            r.pick(&["|", "&", "-", "|[0.125]"])
        );
    }
    let a = length(r, 0.125, 1.0);
    match r.below(5) {
        0 | 1 => format!("{shape_2d}.extrude({a})"),
        2 => format!("{shape_2d}.extrude({a}, round: {})", rounding(r, a / 2.0)),
        3 => format!("{shape_2d}.revolve(offset: {})", length(r, 0.0, 1.0)),
        _ => format!(
            "{shape_2d}.revolve(offset: {a}, angle: {}deg)",
            degrees(r, 1, 360)
        ),
    }
}

/// Returns a method that transforms a shape.
fn transform(r: &mut Random) -> String {
    let (a, b) = (length(r, 0.0625, 1.0), length(r, 0.5, 2.0));
    let axes = r.pick(&["[1, 0, 0]", "[0, 1, 0]", "[1, 0, 1]", "[1, 1, 1]"]);
    match r.below(27) {
        0 | 1 => format!("translate({})", format_arguments(vector(r, 1.0))),
        2 | 3 => format!("rotate({}deg, {:?})", degrees(r, 0, 360), direction(r)),
        4 => format!("scale({b})"),
        5 => format!(
            "scale([{b}, {}, {}])",
            length(r, 0.5, 2.0),
            length(r, 0.5, 2.0)
        ),
        6 => format!(
            "shear(xy: {}, yz: {})",
            length(r, -0.5, 0.5),
            length(r, -0.5, 0.5)
        ),
        7 => format!("reflect({:?}, at: {a})", direction(r)),
        8 => format!("mirror({axes})"),
        9 => format!("mirror({:?}, at: {})", direction(r), length(r, -0.5, 0.5)),
        10 => format!(
            "repeat([{}, 0, {}])",
            length(r, 0.5, 3.0),
            length(r, 0.5, 3.0)
        ),
        11 => {
            let spacing = [0; 3].map(|_| length(r, 0.5, 3.0));
            let counts = [0; 3].map(|_| 1 + r.below(3));
            format!("repeat({spacing:?}, count: {counts:?})")
        }
        12 => format!("polar({})", 1 + r.below(9)),
        13 => format!("translate({b}, 0, {a}).polar({})", 1 + r.below(9)),
        14 => format!(
            "elongate([{}, {}, {}])",
            length_or_zero(r, 1.0),
            a,
            length_or_zero(r, 0.5)
        ),
        15 => format!("twist({}deg)", degrees(r, 0, 120)),
        16 => format!("bend({}deg)", degrees(r, 0, 90)),
        17 => format!("offset({})", length(r, -0.25, 0.25)),
        18 => format!("shell({})", a / 4.0),
        19 => format!(
            "displace(fn(p) => {} * sin({} * p.x) * sin(5 * p.y))",
            a / 8.0,
            length(r, 1.0, 9.0)
        ),
        20 => format!(
            "displace(fn(p) => {} * noise({} * p))",
            a / 4.0,
            length(r, 1.0, 6.0)
        ),
        21 => format!("displace(fn(p) => {} * p.y * p.y)", a / 4.0),
        22 | 23 => format!("warp(fn(p) => {})", warp(r)),
        24 => format!("slice({:?}, at: {})", direction(r), length(r, -0.25, 0.25)),
        25 => format!(
            "section({:?}, at: {}).extrude({a})",
            direction(r),
            length(r, -0.25, 0.25)
        ),
        _ => format!("complement() & box({b})"),
    }
}

/// Returns a warp of space.
fn warp(r: &mut Random) -> String {
    let (a, b, w) = (
        length(r, 0.0625, 0.5),
        length(r, 0.5, 2.0),
        length(r, 1.0, 6.0),
    );
    match r.below(12) {
        0 => format!(
            "p + {} * [sin({w} * p.y), sin({w} * p.z), sin({w} * p.x)]",
            a / 2.0
        ),
        1 => format!("p * dot(p, p) * {b}"),
        2 => format!("[p.x, p.y + {a} * p.x * p.x, p.z]"),
        3 => format!("p / ({a} + length(p))"),
        4 => format!(
            "[p.x * cos({a} * p.z * 1rad) - p.y * sin({a} * p.z * 1rad), \
             p.x * sin({a} * p.z * 1rad) + p.y * cos({a} * p.z * 1rad), p.z]"
        ),
        5 => format!("[abs(p.x) - {a}, p.y, abs(p.z) - {a}]"),
        6 => format!("p * {b} + [{a}, 0, 0]"),
        7 => format!("[p.x * (1 + {a} * p.y), p.y, p.z * (1 + {a} * p.y)]"),
        8 => format!(
            "p + {} * [noise({w} * p), 0, noise({w} * p + [9, 0, 0])]",
            a / 2.0
        ),
        9 => format!("[p.x, p.y, p.z + {a} * sqrt(0.25 + p.x * p.x)]"),
        10 => "[p.z, p.x, p.y]".to_owned(),
        _ => format!("[p.x * exp({a} * p.y), p.y, p.z]"),
    }
}

/// Formats numbers as arguments of a call.
fn format_arguments(v: [f64; 3]) -> String {
    format!("{}, {}, {}", v[0], v[1], v[2])
}
