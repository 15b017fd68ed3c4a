//! Rounded shapes, of which a flat face ends flush. The face is that of a sharp part within the shape, which is moved
//! outwards in union with it.

use super::{CutContext, CutterExtension, PathStep};
use crate::scene::{ShapeId, ShapeKind};
use sdfc_vm::table::Op;

impl CutterExtension<'_> {
    /// Moves the flat faces of a rounded shape outwards where possible.
    pub(super) fn extend_rounded_faces(
        &mut self,
        id: ShapeId,
        path: &[PathStep],
        cut: &CutContext,
    ) -> ShapeId {
        let ShapeKind::Primitive { op, parameters } = self.kind(id).clone() else {
            return id;
        };
        let Some(numbers) = self.constants(&parameters) else {
            return id;
        };
        let mut operands = vec![id];
        for (op, numbers, flat) in sharp_parts(op, &numbers) {
            let expressions = &mut self.scene.expressions;
            let parameters = numbers.iter().map(|&v| expressions.constant(v)).collect();
            let part = self
                .scene
                .derived(id, ShapeKind::Primitive { op, parameters });
            let flats = &op.row().facts.flats[flat..=flat];
            let extended = self.extend_faces_along(part, flats, path, cut);
            if extended != part {
                operands.push(extended);
            }
        }
        if operands.len() == 1 {
            return id;
        }
        let kind = ShapeKind::Combine {
            op: Op::Union,
            children: operands,
            parameters: Vec::new(),
        };
        self.scene.derived(id, kind)
    }
}

/// Returns the sharp parts of a rounded shape that reach to its flat faces: rows, parameters, and the index of these faces
/// in the row.
fn sharp_parts(op: Op, numbers: &[f64]) -> Vec<(Op, Vec<f64>, usize)> {
    let Some((&round, sizes)) = numbers.split_last() else {
        return Vec::new();
    };
    let along = |axis: usize| -> Vec<f64> {
        let sizes = sizes.iter().enumerate();
        let inner = sizes.map(|(index, &half)| if index == axis { half } else { half - round });
        inner.collect()
    };
    let parts: Vec<(Op, Vec<f64>, usize)> = match op {
        Op::RoundedRect => (0..2).map(|axis| (Op::Rect, along(axis), axis)).collect(),
        Op::RoundedCuboid => (0..3).map(|axis| (Op::Cuboid, along(axis), axis)).collect(),
        Op::RoundedCylinder => vec![(Op::Cylinder, along(1), 0)],
        _ => Vec::new(),
    };
    let is_solid = |(_, sizes, _): &(Op, Vec<f64>, usize)| sizes.iter().all(|&half| half > 0.0);
    parts.into_iter().filter(is_solid).collect()
}
