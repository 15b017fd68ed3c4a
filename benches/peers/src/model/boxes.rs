//! A smooth union of rounded, rotated boxes in a sphere, in two forms: in sdfc's language, and as
//! arithmetic for Fidget.
//!
//! Fidget has no such operations. The arithmetic follows the same formulas: I. Quilez's distance of a box
//! and the quadratic polynomial minimum.

use fidget::context::Tree;
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use std::fmt::Write;

/// The boxes, in the order of their union.
pub(crate) struct BoxUnion {
    list: Vec<RoundedBox>,
    /// Largest amount that the union adds, where two distances are equal.
    thickness: f64,
}

/// A box. All numbers are rounded to the digits that are written.
struct RoundedBox {
    center: Vector3<f64>,
    sides: Vector3<f64>,
    round: f64,
    /// Angle in integer degrees.
    turn: f64,
    axis: Vector3<f64>,
}

/// Radius of the sphere that they fill.
const SPHERE_RADIUS: f64 = 0.8;

impl BoxUnion {
    /// Creates `count` boxes, whose size decreases with their number.
    pub(crate) fn new(count: u32) -> Self {
        let spacing = SPHERE_RADIUS * (4.19 / f64::from(count)).cbrt();
        let mut random = Lcg(1);
        let list = (0..count).map(|index| {
            let unit_point = low_discrepancy_point(index);
            let (height, turn) = (2.0 * unit_point[0] - 1.0, std::f64::consts::TAU * unit_point[1]);
            let ring_radius = (1.0 - height * height).sqrt();
            let direction = Vector3::new(ring_radius * turn.cos(), height, ring_radius * turn.sin());
            let sides = Vector3::from_fn(|_, _| spacing * random.between(0.5, 1.1));
            RoundedBox {
                center: round_decimals(direction * (SPHERE_RADIUS * unit_point[2].cbrt())),
                sides: round_decimals(sides),
                round: round_decimals(Vector3::repeat(0.2 * sides.min())).x,
                turn: random.between(0.0, 360.0).floor(),
                axis: round_decimals(Vector3::from_fn(|i, _| match i {
                    1 => random.between(0.2, 1.0),
                    _ => random.between(-1.0, 1.0),
                })),
            }
        });
        Self {
            list: list.collect(),
            thickness: round_decimals(Vector3::repeat(0.05 * spacing)).x,
        }
    }

    /// Returns the number of boxes.
    pub(crate) fn len(&self) -> usize {
        self.list.len()
    }

    /// Moves a box slightly, as an edit of the scene does.
    pub(crate) fn nudge(&mut self, index: usize) {
        if let Some(nudged) = self.list.get_mut(index) {
            nudged.center = round_decimals(nudged.center + Vector3::new(0.01, 0.0, 0.0));
        }
    }

    /// Returns the union in sdfc's language.
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
                list(&b.center)
            );
        }
        let _ = writeln!(text, "    ],\n    smooth: {},\n)", self.thickness);
        text
    }

    /// Returns the union as arithmetic.
    pub(crate) fn tree(&self) -> Tree {
        let (x, y, z) = Tree::axes();
        // Difference of the distances from which on nothing is added.
        let width = (4.0 * self.thickness) as f32;
        let mut union: Option<Tree> = None;
        for b in &self.list {
            let box_distance = b.tree([&x, &y, &z]);
            union = Some(match union {
                None => box_distance,
                Some(union) => {
                    let difference = (union.clone() - box_distance.clone()).abs();
                    let overlap = (Tree::constant(width) - difference).max(0.0);
                    union.min(box_distance) - overlap.square() * (1.0 / (4.0 * width))
                }
            });
        }
        union.unwrap_or_else(|| Tree::constant(1.0))
    }
}

impl RoundedBox {
    fn tree(&self, point: [&Tree; 3]) -> Tree {
        let axis = Unit::new_normalize(self.axis);
        let turn = Rotation3::from_axis_angle(&axis, self.turn.to_radians());
        let back: Matrix3<f64> = turn.inverse().into_inner();
        let offset: Vec<Tree> = (0..3)
            .map(|i| point[i].clone() - self.center[i] as f32)
            .collect();
        let q: Vec<Tree> = (0..3)
            .map(|row| {
                let along = (0..3).map(|i| offset[i].clone() * back[(row, i)] as f32);
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

/// Rounds numbers to the digits that are written.
fn round_decimals(v: Vector3<f64>) -> Vector3<f64> {
    v.map(|n| (n * 1e5).round() / 1e5)
}

/// Returns a point of a sequence that fills the unit cube evenly (M. Roberts' recurrence).
fn low_discrepancy_point(index: u32) -> [f64; 3] {
    const PHI_3: f64 = 1.220_744_084_605_759_5;
    std::array::from_fn(|axis| (0.5 + f64::from(index + 1) * PHI_3.powi(-1 - axis as i32)).fract())
}

/// Linear congruential generator.
struct Lcg(u32);

impl Lcg {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        low + (high - low) * f64::from(self.0 >> 8) / f64::from(1_u32 << 24)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contestant::sdfc::EngineScene;
    use fidget::context::Context;
    use sdfc_compiler::passes::PassOptions;
    use sdfc_runtime::engine::{EngineKind, open};

    /// Both forms are the same field.
    #[test]
    fn both_sides_mean_the_same() {
        let boxes = BoxUnion::new(30);
        let compiled =
            EngineScene::from_text(&boxes.text(), &PassOptions::default(), EngineKind::Cpu).unwrap();
        let mut engine = open(EngineKind::Cpu).unwrap();
        engine.load(&compiled.scene_input()).unwrap();
        let mut context = Context::new();
        let node = context.import(&boxes.tree());
        let mut random = Lcg(3);
        let points: Vec<[f32; 3]> = (0..200)
            .map(|_| [0; 3].map(|_| random.between(-1.0, 1.0) as f32))
            .collect();
        for (point, sample) in points.iter().zip(engine.query(&points).unwrap()) {
            let [x, y, z] = *point;
            let fidget_value = context.eval_xyz(node, x, y, z).unwrap();
            assert!((sample.distance - fidget_value).abs() < 1e-5, "{point:?}");
        }
    }
}
