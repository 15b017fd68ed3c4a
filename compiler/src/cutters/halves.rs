//! Half spaces and slabs in cutters: `sphere(1) & plane(Y)`. Where they cut off nothing that meets the body, they are
//! moved out of what else is in the intersection.

use super::room::Part;
use super::{Cut, Lengthening, SAME, Step, scale};
use crate::scene::{ShapeId, ShapeKind};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::table::Op;

impl Lengthening<'_> {
    /// A half space or a slab among others of an intersection, farther out where that is possible.
    pub(super) fn opened(
        &mut self,
        id: ShapeId,
        others: &[ShapeId],
        path: &[Step],
        cut: &Cut,
    ) -> ShapeId {
        let mut kind = self.kind(id).clone();
        let ShapeKind::Primitive {
            op: op @ (Op::Plane | Op::Slab),
            parameters,
        } = &mut kind
        else {
            return id;
        };
        let Some(&[x, y, z, reach]) = self.constants(parameters).as_deref() else {
            return id;
        };
        let normal = [x, y, z];
        let Some(axis) = (0..3).find(|&axis| normal[axis].abs() == 1.0) else {
            return id;
        };
        let common = others.iter().fold(Bounds::EVERYTHING, |common, &other| {
            common.common(&self.bounds(other))
        });
        let out = cut.size / scale(path);
        if !common.is_finite() || common.is_empty() || !out.is_finite() {
            return id;
        }
        let signs: &[f64] = match op {
            Op::Plane => &[normal[axis]],
            _ => &[-1.0, 1.0],
        };
        let mut farthest = reach;
        for &sign in signs {
            let end = if sign > 0.0 {
                common.max[axis]
            } else {
                -common.min[axis]
            };
            let mut added = common;
            match sign > 0.0 {
                true => added.min[axis] = added.min[axis].max(reach),
                false => added.max[axis] = added.max[axis].min(-reach),
            }
            let part = Part {
                id: others[0],
                is_straight: false,
                reach: 0.0,
                axis,
                frame: SAME,
                sections: None,
            };
            if end > reach && !self.is_free(&part, &added, path, cut) {
                return id;
            }
            farthest = farthest.max(end + out);
        }
        parameters[3] = self.scene.expressions.constant(farthest);
        self.scene.derived(id, kind)
    }
}
