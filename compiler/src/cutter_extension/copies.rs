//! Copies of a cutter as operands of their own.
//!
//! A face that ends flush is often that of the outermost copies alone, and copies may touch each other. All copies are extended
//! together first. Where one of them can be extended farther, all become a union of shapes.

use super::regions::copy_maps;
use super::{CutContext, CutterExtension, PathStep};
use crate::analysis::bounds::inverse;
use crate::scene::{ShapeId, ShapeKind, children};
use sdfc_vm::table::Op;

/// Maximum number of copies that become shapes of their own.
const MAX_COPIES: usize = 16;

impl CutterExtension<'_> {
    /// Returns the union of the copies of a repetition, where faces of single copies are extended. The same shape if there are
    /// too many copies, or if no face of one can be extended.
    pub(super) fn extend_copies(
        &mut self,
        id: ShapeId,
        path: &mut Vec<PathStep>,
        cut: &mut CutContext,
    ) -> ShapeId {
        let (op, child, parameters) = match self.kind(id) {
            ShapeKind::Repeat {
                op,
                child,
                parameters,
                ..
            }
            | ShapeKind::Polar {
                op,
                child,
                parameters,
                ..
            } => (*op, *child, parameters.clone()),
            _ => return id,
        };
        let maps = self
            .constants(&parameters)
            .and_then(|numbers| copy_maps(op, &numbers))
            .filter(|maps| maps.len() <= MAX_COPIES);
        let to_copies: Option<Vec<_>> = maps.filter(|_| !self.has_copies(child)).and_then(|maps| {
            let mut maps = maps.iter();
            maps.try_fold(Vec::new(), |mut to_copies, map| {
                to_copies.push(inverse(map.as_flattened())?);
                Some(to_copies)
            })
        });
        let Some(to_copies) = to_copies else {
            return id;
        };
        let mut copies = Vec::new();
        for rows in to_copies {
            let rows = rows.as_flattened();
            let mut number = |value: f64| self.scene.expressions.constant(value);
            let scale = number(1.0);
            let matrix = std::array::from_fn(|index| number(rows[index]));
            let kind = ShapeKind::Frame {
                child,
                matrix,
                scale,
            };
            copies.push(self.scene.derived(id, kind));
        }
        let united = ShapeKind::Combine {
            op: Op::Union,
            children: copies,
            parameters: Vec::new(),
        };
        let united = self.scene.derived(id, united);
        match self.extend_cutter(united, path, cut) {
            extended if extended == united => id,
            extended => extended,
        }
    }

    /// Reports whether a shape contains a repetition. Recursion over nested shapes, whose depth the elaborator bounds.
    fn has_copies(&self, id: ShapeId) -> bool {
        let kind = self.kind(id);
        matches!(kind, ShapeKind::Repeat { .. } | ShapeKind::Polar { .. })
            || children(kind).iter().any(|&child| self.has_copies(child))
    }
}
