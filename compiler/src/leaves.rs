//! Leaves of a scene, and the shapes that enclose them.
//!
//! A leaf is one *occurrence* of a primitive, a raw field or a polygon. Copies that a loop makes, or a shape
//! that is used twice, are separate leaves with the same span. Copies that space itself makes (`repeat`,
//! `polar`, `mirror`) are one leaf.

use crate::scene::{Shape, ShapeKind};
use sdfc_lang::Span;

/// One occurrence of a shape.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Leaf {
    /// Name in the text; empty if none.
    pub name: String,
    /// Text that made it.
    pub span: Span,
    /// Index of the enclosing shape.
    pub(crate) parent: Option<u32>,
}

/// Leaves found while traversing a scene's shapes, and the current position.
#[derive(Clone, Debug, Default)]
pub(crate) struct LeafTracker {
    pub(crate) leaves: Vec<Leaf>,
    /// Enclosing shapes of leaves, one per occurrence.
    pub(crate) enclosing: Vec<Leaf>,
    current: Option<u32>,
}

impl LeafTracker {
    /// Enters a shape; returns the enclosing one, for [`LeafTracker::leave`].
    pub(crate) fn enter(&mut self, shape: &Shape) -> Option<u32> {
        let outer = self.current;
        if !is_leaf(shape) {
            self.enclosing.push(self.new_leaf(shape));
            self.current = Some(self.enclosing.len() as u32 - 1);
        }
        outer
    }

    /// Leaves a shape, to the enclosing one.
    pub(crate) fn leave(&mut self, outer: Option<u32>) {
        self.current = outer;
    }

    /// Returns the next leaf number for a shape that is a leaf.
    pub(crate) fn number(&mut self, shape: &Shape) -> Option<u32> {
        is_leaf(shape).then(|| {
            self.leaves.push(self.new_leaf(shape));
            self.leaves.len() as u32
        })
    }

    fn new_leaf(&self, shape: &Shape) -> Leaf {
        Leaf {
            name: shape.name.clone(),
            span: shape.span,
            parent: self.current,
        }
    }
}

/// Reports whether a shape has no operands.
fn is_leaf(shape: &Shape) -> bool {
    match shape.kind {
        ShapeKind::Primitive { .. } | ShapeKind::Field { .. } | ShapeKind::Polygon { .. } => true,
        ShapeKind::Combine { .. }
        | ShapeKind::Frame { .. }
        | ShapeKind::Repeat { .. }
        | ShapeKind::Polar { .. }
        | ShapeKind::Domain { .. }
        | ShapeKind::Warp { .. }
        | ShapeKind::Distance { .. }
        | ShapeKind::Displace { .. }
        | ShapeKind::Painted { .. }
        | ShapeKind::Nothing => false,
    }
}
