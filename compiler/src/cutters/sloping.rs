//! Solids whose walls slope at a flat face: cones and pyramids, and cylinders along any axis.
//!
//! A face moves along the axis while the walls are prolonged, so the face becomes larger or smaller. Walls that
//! narrow end in a tip.

use super::room::Part;
use super::section::{Section, moved};
use super::{Cut, Lengthening, Rows, SAME, Step, scale};
use crate::scene::{ShapeId, ShapeKind};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::table::{Op, prepare};

/// A solid with flat faces across its axis, the y axis of its own frame.
#[derive(Clone)]
struct Spindle {
    op: Op,
    /// Radii of the lower and the upper face; half sides of a pyramid's.
    ends: [f64; 2],
    /// Heights of both faces.
    heights: [f64; 2],
    /// The map from its own frame to that of the part.
    frame: Rows,
}

impl Spindle {
    /// The solid of a row with these numbers, if its faces can be moved.
    fn new(op: Op, numbers: &[f64]) -> Option<Self> {
        let (ends, half, frame) = match (op, numbers) {
            (Op::Cone, &[bottom, top, half, ..]) => ([bottom, top], half, SAME),
            (Op::Pyramid, &[base, half, ..]) => ([base, 0.0], half, SAME),
            (Op::CylinderBetween, &[x, y, z, r, along_x, along_y, along_z, half]) => {
                let frame = across([along_x, along_y, along_z], [x, y, z]);
                ([r, r], half, frame)
            }
            _ => return None,
        };
        let is_one = ends.iter().all(|end| end.is_finite()) && half > 0.0 && half.is_finite();
        is_one.then_some(Self {
            op,
            ends,
            heights: [-half, half],
            frame,
        })
    }

    /// The solid with a face farther out by a length, or by what its walls allow.
    fn grown(&self, upper: usize, by: f64) -> Self {
        let (face, other) = (self.ends[upper], self.ends[1 - upper]);
        let rate = (face - other) / (self.heights[1] - self.heights[0]);
        let mut new = self.clone();
        let tip = face / -rate;
        let (by, end) = match rate < 0.0 && by >= tip {
            true => (tip, 0.0),
            false => (by, face + rate * by),
        };
        new.ends[upper] = end;
        new.heights[upper] += if upper == 1 { by } else { -by };
        new
    }

    /// The box, in its own frame, between heights.
    fn between(&self, a: f64, b: f64) -> Bounds {
        let r = self.ends[0].max(self.ends[1]);
        Bounds {
            min: [-r, a.min(b), -r],
            max: [r, a.max(b), r],
        }
    }

    /// A face, in the frame of the part.
    fn section(&self, upper: usize) -> Section {
        let (r, y) = (self.ends[upper], self.heights[upper]);
        let is_round = self.op != Op::Pyramid;
        let points = match is_round {
            true => vec![[r, y, 0.0]],
            false => vec![[r, y, r], [r, y, -r], [-r, y, r], [-r, y, -r]],
        };
        Section {
            points: points.into_iter().map(|p| moved(&self.frame, p)).collect(),
            is_round,
            is_plane: false,
        }
    }
}

impl Lengthening<'_> {
    /// Moves faces of a cone, a pyramid or a cylinder between points outwards where that is possible.
    pub(super) fn farther(&mut self, id: ShapeId, path: &[Step], cut: &Cut) -> ShapeId {
        let ShapeKind::Primitive { op, parameters } = self.kind(id) else {
            return id;
        };
        let op = *op;
        let spindle = self
            .constants(parameters)
            .and_then(|numbers| Spindle::new(op, &numbers));
        let out = cut.size / scale(path);
        let Some(mut spindle) = spindle.filter(|_| out.is_finite() && out > 0.0) else {
            return id;
        };
        let mut current = id;
        for upper in [1, 0] {
            // A tip is no face.
            if spindle.ends[upper] == 0.0
                || self.stands_out(current, &spindle, upper, out, (path, cut))
            {
                continue;
            }
            let mut found = None;
            self.fraction(|this, fraction| {
                let new = spindle.grown(upper, out * fraction);
                let shapes = this.scene.shapes.len();
                let candidate = this.spindle(id, &new);
                let part = Part {
                    id: candidate,
                    is_straight: false,
                    reach: 0.0,
                    axis: 1,
                    frame: new.frame,
                    sections: Some([spindle.section(upper), new.section(upper)]),
                };
                let added = new.between(spindle.heights[upper], new.heights[upper]);
                let is_free = this.is_free(&part, &added, path, cut);
                match is_free {
                    true => found = Some((new, candidate)),
                    false => this.scene.shapes.truncate(shapes),
                }
                is_free
            });
            if let Some((new, candidate)) = found {
                (spindle, current) = (new, candidate);
            }
        }
        current
    }

    /// Reports whether a face stands out as far as it would be moved.
    fn stands_out(
        &mut self,
        id: ShapeId,
        spindle: &Spindle,
        upper: usize,
        out: f64,
        (path, cut): (&[Step], &Cut),
    ) -> bool {
        let [low, high] = spindle.heights;
        if high - low <= out {
            return false;
        }
        let face = spindle.heights[upper];
        let inner = if upper == 1 { face - out } else { face + out };
        let part = Part {
            id,
            is_straight: false,
            reach: 0.0,
            axis: 1,
            frame: spindle.frame,
            sections: None,
        };
        self.is_free(&part, &spindle.between(inner, face), path, cut)
    }

    /// The shape of a solid, with the name and the text of another one.
    fn spindle(&mut self, like: ShapeId, spindle: &Spindle) -> ShapeId {
        let [bottom, top] = spindle.ends;
        let [low, high] = spindle.heights;
        let place = |y: f64| moved(&spindle.frame, [0.0, y, 0.0]);
        let numbers = match spindle.op {
            Op::Cone => prepare(Op::Cone, &[bottom, top, high - low]),
            Op::Pyramid => prepare(Op::Pyramid, &[2.0 * bottom, high - low]),
            _ => {
                let ends = [place(low), place(high)].concat();
                prepare(Op::CylinderBetween, &[ends, vec![bottom]].concat())
            }
        };
        let expressions = &mut self.scene.expressions;
        let parameters = numbers
            .into_iter()
            .map(|v| expressions.constant(v))
            .collect();
        let op = spindle.op;
        let child = self
            .scene
            .derived(like, ShapeKind::Primitive { op, parameters });
        match op {
            Op::CylinderBetween => child,
            _ => self.moved(like, child, [0.0, (low + high) / 2.0, 0.0]),
        }
    }
}

/// The frame with its origin at a point and the y axis along a direction.
fn across(axis: [f64; 3], at: [f64; 3]) -> Rows {
    let cross = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            a[j] * b[k] - a[k] * b[j]
        })
    };
    let least = if axis[0].abs() < 0.5 {
        [1.0, 0.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    let side = cross(axis, least);
    let length = side.iter().map(|v| v * v).sum::<f64>().sqrt();
    let side = side.map(|v| v / length);
    let other = cross(side, axis);
    std::array::from_fn(|i| [side[i], axis[i], other[i], at[i]])
}
