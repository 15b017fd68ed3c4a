//! Random scenes in several equivalent texts: operands of hard unions in another order, and identity
//! transforms in between.

use crate::random::Random;
use std::fmt::Write;

/// A shape of a random scene.
#[derive(Clone, Debug)]
enum RandomShape {
    /// Primitive, as text.
    Primitive(String),
    /// Hard union.
    Union(Vec<RandomShape>),
    /// Two shapes and the operator between them.
    Pair(Box<[RandomShape; 2]>, String),
    /// A shape and a method call on it.
    Transformed(Box<RandomShape>, String),
}

/// A random scene.
#[derive(Clone, Debug)]
pub struct RandomScene {
    shape: RandomShape,
    seed: u64,
}

/// Variation of a scene's text.
#[derive(Clone, Copy, Debug, Default)]
pub struct SceneStyle {
    /// Shuffles the operands of hard unions.
    pub shuffled: bool,
    /// Inserts identity transforms.
    pub padded: bool,
}

/// Generates the scene of a seed, with about 3 to 40 primitives.
pub fn scene(seed: u64) -> RandomScene {
    let mut r = Random::new(seed);
    let mut remaining = 3 + r.below(30);
    let mut operands = Vec::new();
    while remaining > 0 {
        operands.push(shape(&mut r, 0, &mut remaining));
    }
    RandomScene {
        shape: RandomShape::Union(operands),
        seed,
    }
}

/// Returns a length from 0.1 to `max`.
fn length(r: &mut Random, max: f64) -> f64 {
    0.1 + (max - 0.1) * r.below(1000) as f64 / 1000.0
}

fn shape(r: &mut Random, depth: usize, remaining: &mut usize) -> RandomShape {
    *remaining = remaining.saturating_sub(1);
    let kind = if depth > 4 || *remaining == 0 {
        0
    } else {
        r.below(10)
    };
    match kind {
        0..=3 => {
            let position = [0; 3].map(|_| r.number());
            RandomShape::Transformed(
                Box::new(RandomShape::Primitive(primitive(r))),
                format!(
                    "translate({}, {}, {})",
                    position[0], position[1], position[2]
                ),
            )
        }
        4 | 5 => {
            let count = 2 + r.below(4);
            RandomShape::Union((0..count).map(|_| shape(r, depth + 1, remaining)).collect())
        }
        6 | 7 => {
            let pair = [0; 2].map(|_| shape(r, depth + 1, remaining));
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
            RandomShape::Pair(Box::new(pair), operator)
        }
        _ => {
            let child = shape(r, depth + 1, remaining);
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
            RandomShape::Transformed(Box::new(child), method)
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

impl RandomScene {
    /// Returns the scene as text. All styles mean the same.
    pub fn text(&self, style: SceneStyle) -> String {
        let mut text = String::new();
        let mut r = Random::new(self.seed ^ 0x5eed);
        self.shape.write(&mut text, style, &mut r);
        text.push('\n');
        text
    }
}

impl RandomShape {
    fn write(&self, output: &mut String, style: SceneStyle, r: &mut Random) {
        match self {
            RandomShape::Primitive(text) => output.push_str(text),
            RandomShape::Union(operands) => {
                let mut order: Vec<&RandomShape> = operands.iter().collect();
                if style.shuffled {
                    for index in (1..order.len()).rev() {
                        order.swap(index, r.below(index + 1));
                    }
                }
                output.push_str("union([");
                for (index, operand) in order.into_iter().enumerate() {
                    output.push_str(if index > 0 { ", " } else { "" });
                    operand.write(output, style, r);
                }
                output.push_str("])");
            }
            RandomShape::Pair(pair, operator) => {
                output.push('(');
                pair[0].write(output, style, r);
                let _ = write!(output, " {operator} ");
                pair[1].write(output, style, r);
                output.push(')');
            }
            RandomShape::Transformed(child, method) => {
                child.write(output, style, r);
                let _ = write!(output, ".{method}");
            }
        }
        if style.padded && r.chance(40) {
            const IDENTITY_TRANSFORMS: &[&str] = &[
                ".translate(0, 0, 0)",
                ".rotate(0deg, Y)",
                ".scale(1)",
                ".offset(0)",
            ];
            output.push_str(r.pick(IDENTITY_TRANSFORMS));
        }
    }
}
