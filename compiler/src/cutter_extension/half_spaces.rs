//! Half spaces and slabs in cutters, such as `sphere(1) & plane(Y)`. If they cut off nothing that meets the
//! body, they are moved out of the intersection of the other operands.

use super::free_space::GrowingPart;
use super::{CutContext, CutterExtension, IDENTITY, PathStep, scale};
use crate::scene::{ShapeId, ShapeKind};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::table::Op;

impl CutterExtension<'_> {
    /// Moves a half space or a slab of an intersection outwards, if possible.
    pub(super) fn widen_half_space(
        &mut self,
        id: ShapeId,
        others: &[ShapeId],
        path: &[PathStep],
        cut: &CutContext,
    ) -> ShapeId {
        let mut kind = self.kind(id).clone();
        let ShapeKind::Primitive {
            op: op @ (Op::Plane | Op::Slab),
            parameters,
        } = &mut kind
        else {
            return id;
        };
        let Some(&[x, y, z, offset]) = self.constants(parameters).as_deref() else {
            return id;
        };
        let normal = [x, y, z];
        let Some(axis) = (0..3).find(|&axis| normal[axis].abs() == 1.0) else {
            return id;
        };
        let common = others.iter().fold(Bounds::ALL_SPACE, |common, &other| {
            common.intersection(&self.bounds(other))
        });
        let max_step = cut.size / scale(path);
        if !common.is_finite() || common.is_empty() || !max_step.is_finite() {
            return id;
        }
        let signs: &[f64] = match op {
            Op::Plane => &[normal[axis]],
            _ => &[-1.0, 1.0],
        };
        let mut max_offset = offset;
        for &sign in signs {
            let support = if sign > 0.0 {
                common.max[axis]
            } else {
                -common.min[axis]
            };
            let mut added_box = common;
            match sign > 0.0 {
                true => added_box.min[axis] = added_box.min[axis].max(offset),
                false => added_box.max[axis] = added_box.max[axis].min(-offset),
            }
            let part = GrowingPart {
                id: others[0],
                is_straight: false,
                blend_radius: 0.0,
                axis,
                placement: IDENTITY,
                sections: None,
            };
            if support > offset && !self.is_free(&part, &added_box, path, cut) {
                return id;
            }
            max_offset = max_offset.max(support + max_step);
        }
        parameters[3] = self.scene.expressions.constant(max_offset);
        self.scene.derived(id, kind)
    }
}
