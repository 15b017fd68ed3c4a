//! Parts whose walls are straight at their flat faces: boxes, cylinders, prisms, rectangles, extrusions.

use super::room::Part;
use super::section::{Section, outline};
use super::{Cut, FRACTIONS, Lengthening, SAME, Step, scale};
use crate::scene::{ShapeId, ShapeKind};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::row::Flat;
use sdfc_vm::table::Op;

impl Lengthening<'_> {
    /// Moves flat faces of a shape outwards where that is possible.
    pub(super) fn longer(&mut self, id: ShapeId, path: &[Step], cut: &Cut) -> ShapeId {
        match self.kind(id) {
            ShapeKind::Primitive { op, .. } | ShapeKind::Distance { op, .. } => {
                self.longer_along(id, op.row().meta.flats, path, cut)
            }
            _ => id,
        }
    }

    /// The same along some axes, one after the other: what grew along one is wider for the next. Recursion over axes.
    fn longer_along(&mut self, id: ShapeId, flats: &[Flat], path: &[Step], cut: &Cut) -> ShapeId {
        let Some((flat, others)) = flats.split_first() else {
            return id;
        };
        let mut kind = self.kind(id).clone();
        let (ShapeKind::Primitive { parameters, .. } | ShapeKind::Distance { parameters, .. }) =
            &mut kind
        else {
            return id;
        };
        let plane = self.scene.shapes[id.0 as usize].plane;
        let before = self.bounds(id);
        let out = cut.size / scale(path);
        let is_constant = self
            .scene
            .expressions
            .as_constant(parameters[flat.half])
            .is_some();
        let mut sides = (0..3).filter(|&axis| !(plane && axis == 2));
        let is_finite =
            sides.all(|axis| before.min[axis] < before.max[axis] && before.min[axis].is_finite());
        if !out.is_finite() || !is_finite {
            return id;
        }
        let mut own = before;
        for upper in [true, false].into_iter().filter(|_| is_constant) {
            let by = self.room(id, &own, (flat.axis, upper), out, path, cut);
            let side = match upper {
                true => &mut own.max[flat.axis],
                false => &mut own.min[flat.axis],
            };
            *side += if upper { by } else { -by };
        }
        if own == before {
            return self.longer_along(id, others, path, cut);
        }
        let (low, high) = (own.min[flat.axis], own.max[flat.axis]);
        parameters[flat.half] = self.scene.expressions.constant((high - low) / 2.0);
        let mut centre = [0.0; 3];
        centre[flat.axis] = (low + high) / 2.0;
        let child = self.scene.derived(id, kind);
        let mut outwards = SAME;
        for (row, shift) in outwards.iter_mut().zip(centre) {
            row[3] = shift;
        }
        let path = [path, &[Step::Map(outwards)]].concat();
        let child = self.longer_along(child, others, &path, cut);
        self.moved(id, child, centre)
    }

    /// A shape moved, with the name and the text of another one.
    pub(super) fn moved(&mut self, like: ShapeId, child: ShapeId, by: [f64; 3]) -> ShapeId {
        let mut number = |value: f64| self.scene.expressions.constant(value);
        let matrix = std::array::from_fn(|at| match (at / 4, at % 4) {
            (row, 3) => number(-by[row]),
            (row, column) => number(f64::from(u8::from(row == column))),
        });
        let scale = number(1.0);
        let kind = ShapeKind::Frame {
            child,
            matrix,
            scale,
        };
        self.scene.derived(like, kind)
    }

    /// The length by which a face of a box can be moved out, at most `out`; zero where it stands out as much.
    fn room(
        &mut self,
        id: ShapeId,
        own: &Bounds,
        (axis, upper): (usize, bool),
        out: f64,
        path: &[Step],
        cut: &Cut,
    ) -> f64 {
        let at = if upper { own.max[axis] } else { own.min[axis] };
        // What is as near to a cutter as it is blended must be free, too.
        let reach = cut.reach / scale(path);
        let between = |a: f64, b: f64| {
            let mut added = own.grown(reach);
            if a == at || b == at {
                let far = if a == at { b } else { a };
                let far = far + if far > at { reach } else { -reach };
                (added.min[axis], added.max[axis]) = (at.min(far), at.max(far));
            }
            added
        };
        let way = if upper { out } else { -out };
        let is_long = own.max[axis] - own.min[axis] > out;
        let part = Part {
            id,
            is_straight: true,
            reach,
            axis,
            frame: SAME,
            sections: Some(self.straight_sections(id, own, (axis, at, at + way))),
        };
        if is_long && self.is_free(&part, &between(at - way, at), path, cut) {
            return 0.0;
        }
        let fraction = self.fraction(|this, fraction| {
            this.is_free(&part, &between(at, at + way * fraction), path, cut)
        });
        fraction.map_or(0.0, |fraction| out * fraction)
    }

    /// The largest fraction that is possible. The smallest one is tried first: no other is possible without it.
    pub(super) fn fraction(
        &mut self,
        mut is_possible: impl FnMut(&mut Self, f64) -> bool,
    ) -> Option<f64> {
        let (&smallest, larger) = FRACTIONS.split_last()?;
        if !is_possible(self, smallest) {
            return None;
        }
        let found = larger.iter().find(|&&fraction| is_possible(self, fraction));
        Some(*found.unwrap_or(&smallest))
    }

    /// Cross sections of a part at two places along an axis, or more than these.
    fn straight_sections(
        &self,
        id: ShapeId,
        own: &Bounds,
        (axis, near, far): (usize, f64, f64),
    ) -> [Section; 2] {
        let is_plane = self.scene.shapes[id.0 as usize].plane;
        let at = |end: f64, points: Vec<[f64; 3]>, is_round: bool| {
            let put = |mut point: [f64; 3]| {
                point[axis] = end;
                point
            };
            Section {
                points: points.into_iter().map(put).collect(),
                is_round,
                is_plane,
            }
        };
        let (points, is_round) = match self.kind(id) {
            ShapeKind::Primitive {
                op: Op::Cylinder, ..
            } => (vec![[own.max[0], 0.0, 0.0]], true),
            ShapeKind::Distance {
                op: Op::Extrude,
                child,
                ..
            } => match outline(self.scene, *child) {
                Some(points) => (points, false),
                None => (own.corners().to_vec(), false),
            },
            _ => (own.corners().to_vec(), false),
        };
        let flat = |point: &[f64; 3]| match is_plane {
            true => [point[0], point[1], 0.0],
            false => *point,
        };
        let points: Vec<[f64; 3]> = points.iter().map(flat).collect();
        [
            at(near, points.clone(), is_round),
            at(far, points, is_round),
        ]
    }
}
