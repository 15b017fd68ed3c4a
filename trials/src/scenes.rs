//! Scenes in several ways of saying the same: the operands of hard unions in another order, and
//! transforms in between that change nothing.

use crate::random::Random;
use std::fmt::Write;

/// A shape of a random scene.
#[derive(Clone, Debug)]
enum Shape {
    /// A primitive as it is written.
    Plain(String),
    /// A hard union.
    Union(Vec<Shape>),
    /// Two shapes and the operator between them.
    Pair(Box<[Shape; 2]>, String),
    /// A shape and a method that is called on it.
    Changed(Box<Shape>, String),
}

/// A random scene.
#[derive(Clone, Debug)]
pub struct Scene {
    shape: Shape,
    seed: u64,
}

/// How a scene is written.
#[derive(Clone, Copy, Debug, Default)]
pub struct Style {
    /// Hard unions are in another order than they were made.
    pub shuffled: bool,
    /// There are transforms that change nothing.
    pub padded: bool,
}

/// The scene of a seed: 3 to some 40 primitives.
pub fn scene(seed: u64) -> Scene {
    let mut r = Random::new(seed);
    let mut left = 3 + r.below(30);
    let mut parts = Vec::new();
    while left > 0 {
        parts.push(shape(&mut r, 0, &mut left));
    }
    Scene {
        shape: Shape::Union(parts),
        seed,
    }
}

/// A length from 0.1 to `most`.
fn length(r: &mut Random, most: f64) -> f64 {
    0.1 + (most - 0.1) * r.below(1000) as f64 / 1000.0
}

fn shape(r: &mut Random, depth: usize, left: &mut usize) -> Shape {
    *left = left.saturating_sub(1);
    let kind = if depth > 4 || *left == 0 {
        0
    } else {
        r.below(10)
    };
    match kind {
        0..=3 => {
            let place = [0; 3].map(|_| r.number());
            Shape::Changed(
                Box::new(Shape::Plain(primitive(r))),
                format!("translate({}, {}, {})", place[0], place[1], place[2]),
            )
        }
        4 | 5 => {
            let count = 2 + r.below(4);
            Shape::Union((0..count).map(|_| shape(r, depth + 1, left)).collect())
        }
        6 | 7 => {
            let pair = [0; 2].map(|_| shape(r, depth + 1, left));
            let k = length(r, 0.4);
            let operator = match r.below(8) {
                0 => "&".to_owned(),
                1 => "-".to_owned(),
                2 => format!("|[{k}]"),
                3 => format!("-[{k}]"),
                4 => format!("|[cubic, {k}]"),
                5 => format!("|[circular, {k}]"),
                6 => format!("|[exponential, {k}]"),
                _ => format!("|[chamfer, {k}]"),
            };
            Shape::Pair(Box::new(pair), operator)
        }
        _ => {
            let child = shape(r, depth + 1, left);
            let v = r.number();
            let method = match r.below(9) {
                0 => format!("translate({v}, {}, 0)", r.number()),
                1 => format!("rotate({}deg, [1, {v}, 2])", r.below(360)),
                2 => format!("scale({})", length(r, 2.0)),
                3 => "mirror(X)".to_owned(),
                4 => format!("offset({})", v / 20.0),
                5 => format!("shell({})", length(r, 0.2)),
                6 => format!("twist({}deg)", r.below(60)),
                7 => "displace(fn(p) => 0.03 * sin(7 * p.x) * sin(6 * p.y))".to_owned(),
                _ => format!("elongate([{}, 0, 0.1])", length(r, 0.5)),
            };
            Shape::Changed(Box::new(child), method)
        }
    }
}

fn primitive(r: &mut Random) -> String {
    let [a, b, c] = [0; 3].map(|_| length(r, 0.9));
    match r.below(10) {
        0 => format!("sphere({a})"),
        1 => format!("box({a}, {b}, {c})"),
        2 => format!("box({a}, round: {})", a / 4.0),
        3 => format!("cylinder(r: {a}, h: {b})"),
        4 => format!("capsule(h: {a}, r: {})", b / 2.0),
        5 => format!("torus(r1: {}, r2: {})", a + 0.2, b / 5.0),
        6 => format!("ellipsoid([{a}, {b}, {c}])"),
        7 => format!("cone(r1: {a}, r2: {}, h: {c})", a / 3.0),
        8 => format!("octahedron({a})"),
        _ => format!("prism(6, {a}, {b})"),
    }
}

impl Scene {
    /// The scene as text. Styles mean the same.
    pub fn text(&self, style: Style) -> String {
        let mut text = String::new();
        let mut r = Random::new(self.seed ^ 0x5eed);
        self.shape.write(&mut text, style, &mut r);
        text.push('\n');
        text
    }
}

impl Shape {
    fn write(&self, to: &mut String, style: Style, r: &mut Random) {
        match self {
            Shape::Plain(text) => to.push_str(text),
            Shape::Union(parts) => {
                let mut order: Vec<&Shape> = parts.iter().collect();
                if style.shuffled {
                    for at in (1..order.len()).rev() {
                        order.swap(at, r.below(at + 1));
                    }
                }
                to.push_str("union([");
                for (at, part) in order.into_iter().enumerate() {
                    to.push_str(if at > 0 { ", " } else { "" });
                    part.write(to, style, r);
                }
                to.push_str("])");
            }
            Shape::Pair(pair, operator) => {
                to.push('(');
                pair[0].write(to, style, r);
                let _ = write!(to, " {operator} ");
                pair[1].write(to, style, r);
                to.push(')');
            }
            Shape::Changed(child, method) => {
                child.write(to, style, r);
                let _ = write!(to, ".{method}");
            }
        }
        if style.padded && r.chance(40) {
            const NOTHING: &[&str] = &[
                ".translate(0, 0, 0)",
                ".rotate(0deg, Y)",
                ".scale(1)",
                ".offset(0)",
            ];
            to.push_str(r.pick(NOTHING));
        }
    }
}
