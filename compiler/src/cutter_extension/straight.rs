//! Parts with straight walls at their flat faces: boxes, cylinders, prisms, rectangles, extrusions.

use super::covered_sides::rows_to_part;
use super::free_space::GrowingPart;
use super::section::{Section, outline};
use super::{
    CutContext, CutterExtension, EXTENSION_FRACTIONS, IDENTITY, OtherCutter, PathStep, scale,
};
use crate::scene::{ShapeId, ShapeKind};
use glam::DVec3;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::row::Flat;
use sdfc_vm::table::Op;

/// Number of bisections of the largest extension into other cutters, between two of the tried fractions.
const BISECTIONS: usize = 5;

impl CutterExtension<'_> {
    /// Moves flat faces of a shape outwards where possible.
    pub(super) fn extend_flat_faces(
        &mut self,
        id: ShapeId,
        path: &[PathStep],
        cut: &CutContext,
    ) -> ShapeId {
        match self.kind(id) {
            ShapeKind::Primitive { op, .. } | ShapeKind::Distance { op, .. } => {
                self.extend_faces_along(id, op.row().facts.flats, path, cut)
            }
            _ => id,
        }
    }

    /// Extends a shape along several axes in turn: an extension along one axis enlarges the faces of the
    /// next. Recursion over axes.
    pub(super) fn extend_faces_along(
        &mut self,
        id: ShapeId,
        flats: &[Flat],
        path: &[PathStep],
        cut: &CutContext,
    ) -> ShapeId {
        let Some((flat, remaining)) = flats.split_first() else {
            return id;
        };
        let mut kind = self.kind(id).clone();
        let (ShapeKind::Primitive { parameters, .. } | ShapeKind::Distance { parameters, .. }) =
            &mut kind
        else {
            return id;
        };
        let is_2d = self.scene.shapes[id.0 as usize].is_2d;
        let original = self.bounds_beside_body(id, flat.axis, path, cut);
        let max_step = cut.size / scale(path);
        let is_constant = self
            .scene
            .expressions
            .as_constant(parameters[flat.half])
            .is_some();
        let mut sides = (0..3).filter(|&axis| !(is_2d && axis == 2));
        let is_finite = sides
            .all(|axis| original.min[axis] < original.max[axis] && original.min[axis].is_finite());
        if !max_step.is_finite() || !is_finite {
            return id;
        }
        let mut extended = original;
        for upper in [true, false].into_iter().filter(|_| is_constant) {
            let extension =
                self.max_extension(id, &extended, (flat.axis, upper), max_step, path, cut);
            let side = match upper {
                true => &mut extended.max[flat.axis],
                false => &mut extended.min[flat.axis],
            };
            *side += if upper { extension } else { -extension };
        }
        if extended == original {
            return self.extend_faces_along(id, remaining, path, cut);
        }
        let (low, high) = (extended.min[flat.axis], extended.max[flat.axis]);
        parameters[flat.half] = self.scene.expressions.constant((high - low) / 2.0);
        let mut centre = [0.0; 3];
        centre[flat.axis] = (low + high) / 2.0;
        let child = self.scene.derived(id, kind);
        let mut outwards = IDENTITY;
        for (row, shift) in outwards.iter_mut().zip(centre) {
            row[3] = shift;
        }
        let path = [path, &[PathStep::Map(outwards)]].concat();
        let child = self.extend_faces_along(child, remaining, &path, cut);
        self.translated(id, child, centre)
    }

    /// Returns the bounds of a part. Sides without an end, other than along `axis`, end where the body does.
    fn bounds_beside_body(
        &mut self,
        id: ShapeId,
        axis: usize,
        path: &[PathStep],
        cut: &CutContext,
    ) -> Bounds {
        let mut bounds = self.bounds(id);
        let is_2d = self.scene.shapes[id.0 as usize].is_2d;
        if bounds.is_finite() || is_2d {
            return bounds;
        }
        let (Some(to_part), Some(body)) = (rows_to_part(path), cut.body) else {
            return bounds;
        };
        let body = self.bounds(body).mapped(&to_part);
        for other in (0..3).filter(|&other| other != axis) {
            if bounds.min[other].is_infinite() {
                bounds.min[other] = body.min[other];
            }
            if bounds.max[other].is_infinite() {
                bounds.max[other] = body.max[other];
            }
        }
        bounds
    }

    /// Translates a shape, with the name and the span of another one.
    pub(super) fn translated(&mut self, like: ShapeId, child: ShapeId, shift: [f64; 3]) -> ShapeId {
        let mut number = |value: f64| self.scene.expressions.constant(value);
        let matrix = std::array::from_fn(|index| match (index / 4, index % 4) {
            (row, 3) => number(-shift[row]),
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

    /// Returns the distance by which a face can be moved outwards, at most `max_step`; 0 if it already protrudes
    /// that far.
    fn max_extension(
        &mut self,
        id: ShapeId,
        bounds: &Bounds,
        (axis, upper): (usize, bool),
        max_step: f64,
        path: &[PathStep],
        cut: &CutContext,
    ) -> f64 {
        let face = if upper {
            bounds.max[axis]
        } else {
            bounds.min[axis]
        };
        // The blend zone of a cutter must be free, too.
        let blend_radius = cut.blend_radius / scale(path);
        let between = |a: f64, b: f64| {
            let mut added = bounds.grown(blend_radius);
            if a == face || b == face {
                let end = if a == face { b } else { a };
                let end = end
                    + if end > face {
                        blend_radius
                    } else {
                        -blend_radius
                    };
                (added.min[axis], added.max[axis]) = (face.min(end), face.max(end));
            }
            added
        };
        let step = if upper { max_step } else { -max_step };
        let is_thick = bounds.max[axis] - bounds.min[axis] > max_step;
        let part = GrowingPart {
            id,
            is_straight: true,
            blend_radius,
            axis,
            placement: IDENTITY,
            sections: Some(self.straight_sections(id, bounds, (axis, face, face + step))),
        };
        // The blend zone of a face that was extended before touches the body.
        let protruding = step - blend_radius.copysign(step);
        if is_thick && self.is_free(&part, &between(face - protruding, face), path, cut) {
            return 0.0;
        }
        let fraction = self.largest_fraction(cut, |this, fraction| {
            this.is_free(&part, &between(face, face + step * fraction), path, cut)
        });
        fraction.map_or(0.0, |fraction| max_step * fraction)
    }

    /// Returns the largest possible fraction. The smallest is tried first: larger ones require it. `None` if it is
    /// impossible.
    pub(super) fn largest_fraction(
        &mut self,
        cut: &CutContext,
        mut is_possible: impl FnMut(&mut Self, f64) -> bool,
    ) -> Option<f64> {
        let (&smallest, larger) = EXTENSION_FRACTIONS.split_last()?;
        if !is_possible(self, smallest) {
            return None;
        }
        let larger_index = (0..larger.len()).find(|&index| is_possible(self, larger[index]));
        let (mut possible, next) = match larger_index {
            Some(0) => return Some(larger[0]),
            Some(index) => (larger[index], larger[index - 1]),
            None => (smallest, larger[larger.len() - 1]),
        };
        // The face ends near that of the cutter which contains it. In between, its value would hide nearer walls.
        let is_contained = |other: &OtherCutter| !other.is_extended && cut.blend_radius == 0.0;
        let rounds = match cut.other_cutters.iter().any(is_contained) {
            true => BISECTIONS,
            false => 0,
        };
        let mut step = (next - possible) / 2.0;
        for _ in 0..rounds {
            if is_possible(self, possible + step) {
                possible += step;
            }
            step /= 2.0;
        }
        Some(possible)
    }

    /// Returns the cross sections at two positions along an axis, or supersets of them.
    fn straight_sections(
        &self,
        id: ShapeId,
        bounds: &Bounds,
        (axis, near, far): (usize, f64, f64),
    ) -> [Section; 2] {
        let is_2d = self.scene.shapes[id.0 as usize].is_2d;
        let section_at = |end: f64, points: Vec<DVec3>, is_round: bool| {
            let at_end = |mut point: DVec3| {
                point[axis] = end;
                point
            };
            Section {
                points: points.into_iter().map(at_end).collect(),
                is_round,
                is_2d,
            }
        };
        let (points, is_round) = match self.kind(id) {
            ShapeKind::Primitive {
                op: Op::Cylinder, ..
            } => (vec![DVec3::new(bounds.max[0], 0.0, 0.0)], true),
            ShapeKind::Distance {
                op: Op::Extrude,
                child,
                ..
            } => match outline(self.scene, *child) {
                Some(points) => (points, false),
                None => (bounds.corners().map(DVec3::from).to_vec(), false),
            },
            _ => (bounds.corners().map(DVec3::from).to_vec(), false),
        };
        let flattened = |point: &DVec3| match is_2d {
            true => point.with_z(0.0),
            false => *point,
        };
        let points: Vec<DVec3> = points.iter().map(flattened).collect();
        [
            section_at(near, points.clone(), is_round),
            section_at(far, points, is_round),
        ]
    }
}
