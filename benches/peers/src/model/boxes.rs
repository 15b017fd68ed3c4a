//! A smooth union of rounded, rotated boxes in a ball, written for both sides: in sdfc's language,
//! and as arithmetic for Fidget.
//!
//! Fidget has no such operations; the arithmetic is that of the same formulas: I. Quilez's distance
//! of a box and the quadratic polynomial minimum.

use fidget::context::Tree;
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use std::fmt::Write;

/// The boxes, in the order in which they are united.
pub(crate) struct Boxes {
    list: Vec<RoundedBox>,
    /// The most that the union adds, where two distances are equal.
    thickness: f64,
}

/// A box; all numbers are those that are written.
struct RoundedBox {
    centre: Vector3<f64>,
    sides: Vector3<f64>,
    round: f64,
    /// In whole degrees.
    turn: f64,
    axis: Vector3<f64>,
}

/// The radius of the ball that they fill.
const RADIUS: f64 = 0.8;

impl Boxes {
    /// So many boxes; the more there are, the smaller they are.
    pub(crate) fn new(count: u32) -> Self {
        let spacing = RADIUS * (4.19 / f64::from(count)).cbrt();
        let mut random = Random(1);
        let list = (0..count).map(|index| {
            let at = even(index);
            let (height, turn) = (2.0 * at[0] - 1.0, std::f64::consts::TAU * at[1]);
            let across = (1.0 - height * height).sqrt();
            let direction = Vector3::new(across * turn.cos(), height, across * turn.sin());
            let sides = Vector3::from_fn(|_, _| spacing * random.between(0.5, 1.1));
            RoundedBox {
                centre: rounded(direction * (RADIUS * at[2].cbrt())),
                sides: rounded(sides),
                round: rounded(Vector3::repeat(0.2 * sides.min())).x,
                turn: random.between(0.0, 360.0).floor(),
                axis: rounded(Vector3::from_fn(|i, _| match i {
                    1 => random.between(0.2, 1.0),
                    _ => random.between(-1.0, 1.0),
                })),
            }
        });
        Self {
            list: list.collect(),
            thickness: rounded(Vector3::repeat(0.05 * spacing)).x,
        }
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.list.len()
    }

    /// Moves a box a little, as somebody does who edits the scene.
    pub(crate) fn nudge(&mut self, index: usize) {
        if let Some(nudged) = self.list.get_mut(index) {
            nudged.centre = rounded(nudged.centre + Vector3::new(0.01, 0.0, 0.0));
        }
    }

    /// The union in sdfc's language.
    pub(crate) fn text(&self) -> String {
        let mut text = String::from("union(\n    [\n");
        for b in &self.list {
            let list = |v: &Vector3<f64>| format!("{}, {}, {}", v.x, v.y, v.z);
            let _ = writeln!(
                text,
                "        box([{}], round: {}).rotate({}deg, [{}]).translate({}),",
                list(&b.sides),
                b.round,
                b.turn,
                list(&b.axis),
                list(&b.centre)
            );
        }
        let _ = writeln!(text, "    ],\n    smooth: {},\n)", self.thickness);
        text
    }

    /// The union as arithmetic.
    pub(crate) fn tree(&self) -> Tree {
        let (x, y, z) = Tree::axes();
        // The difference of the distances from which on nothing is added.
        let width = (4.0 * self.thickness) as f32;
        let mut all: Option<Tree> = None;
        for b in &self.list {
            let next = b.tree([&x, &y, &z]);
            all = Some(match all {
                None => next,
                Some(all) => {
                    let apart = (all.clone() - next.clone()).abs();
                    let near = (Tree::constant(width) - apart).max(0.0);
                    all.min(next) - near.square() * (1.0 / (4.0 * width))
                }
            });
        }
        all.unwrap_or_else(|| Tree::constant(1.0))
    }
}

impl RoundedBox {
    fn tree(&self, point: [&Tree; 3]) -> Tree {
        let axis = Unit::new_normalize(self.axis);
        let turn = Rotation3::from_axis_angle(&axis, self.turn.to_radians());
        let back: Matrix3<f64> = turn.inverse().into_inner();
        let away: Vec<Tree> = (0..3)
            .map(|i| point[i].clone() - self.centre[i] as f32)
            .collect();
        let q: Vec<Tree> = (0..3)
            .map(|row| {
                let along = (0..3).map(|i| away[i].clone() * back[(row, i)] as f32);
                let along = along.reduce(|a, b| a + b).unwrap_or_else(|| 0.0.into());
                along.abs() - (self.sides[row] / 2.0 - self.round) as f32
            })
            .collect();
        let outside = q.iter().map(|q| q.max(0.0).square());
        let outside = outside.reduce(|a, b| a + b).unwrap_or_else(|| 0.0.into());
        let inside = q[0].max(q[1].clone()).max(q[2].clone()).min(0.0);
        outside.sqrt() + inside - self.round as f32
    }
}

/// What is left of numbers once they are written.
fn rounded(v: Vector3<f64>) -> Vector3<f64> {
    v.map(|n| (n * 1e5).round() / 1e5)
}

/// Points that fill the unit cube evenly (M. Roberts' recurrence).
fn even(index: u32) -> [f64; 3] {
    const ROOT: f64 = 1.220_744_084_605_759_5;
    std::array::from_fn(|axis| (0.5 + f64::from(index + 1) * ROOT.powi(-1 - axis as i32)).fract())
}

/// A linear congruential generator.
struct Random(u32);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        low + (high - low) * f64::from(self.0 >> 8) / f64::from(1_u32 << 24)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contestant::ours::Compiled;
    use fidget::context::Context;
    use sdfc_compiler::passes::PassOptions;
    use sdfc_runtime::engine::{EngineKind, open};

    /// The two ways of writing are one field.
    #[test]
    fn both_sides_mean_the_same() {
        let boxes = Boxes::new(30);
        let compiled =
            Compiled::scene(&boxes.text(), &PassOptions::default(), EngineKind::Cpu).unwrap();
        let mut engine = open(EngineKind::Cpu).unwrap();
        engine.load(&compiled.loaded()).unwrap();
        let mut context = Context::new();
        let node = context.import(&boxes.tree());
        let mut random = Random(3);
        let points: Vec<[f32; 3]> = (0..200)
            .map(|_| [0; 3].map(|_| random.between(-1.0, 1.0) as f32))
            .collect();
        for (point, sample) in points.iter().zip(engine.query(&points).unwrap()) {
            let [x, y, z] = *point;
            let theirs = context.eval_xyz(node, x, y, z).unwrap();
            assert!((sample.distance - theirs).abs() < 1e-5, "{point:?}");
        }
    }
}
