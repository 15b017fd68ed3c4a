//! Exclusive unions as the union without the common part, whose faces can be moved. Their values are the same.

use super::CutterExtension;
use crate::scene::{ShapeId, ShapeKind};
use sdfc_vm::table::Op;

impl CutterExtension<'_> {
    /// Returns the subtraction that is the exclusive union of operands; `None` where this changes no common part.
    pub(super) fn as_subtraction(
        &mut self,
        id: ShapeId,
        operands: &[ShapeId],
    ) -> Option<ShapeKind> {
        let (&last, others) = operands.split_last()?;
        let changed = match others {
            [] => return None,
            [_] => None,
            _ => self.as_subtraction(id, others),
        };
        let has_changed = changed.is_some();
        let first = match others {
            &[first] => first,
            _ => {
                let kind = changed.unwrap_or_else(|| combination(Op::Xor, others.to_vec()));
                self.scene.derived(id, kind)
            }
        };
        let pair = vec![first, last];
        let body = self.scene.derived(id, combination(Op::Union, pair.clone()));
        let common = self
            .scene
            .derived(id, combination(Op::Intersection, pair.clone()));
        let mut cutters = [common];
        self.extend_cutters_of(body, &mut cutters, 0.0);
        match cutters == [common] {
            true if has_changed => Some(combination(Op::Xor, pair)),
            true => None,
            false => Some(combination(Op::Subtraction, vec![body, cutters[0]])),
        }
    }
}

/// Returns a combination of shapes without parameters.
fn combination(op: Op, children: Vec<ShapeId>) -> ShapeKind {
    ShapeKind::Combine {
        op,
        children,
        parameters: Vec::new(),
    }
}
