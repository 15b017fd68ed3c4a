//! Origins: which text made what is seen at a point.
//!
//! A scene is compiled once more, with a material of its own for each leaf in place of its paints. A
//! blend of materials has the number of the operand with the larger share in the result, so what an
//! engine tells as the material at a point ([`sdfc_vm::surface`]) is the leaf to which that point of
//! the surface belongs: in a hard union the nearer one, in a smooth one the one that weighs more, in a
//! cut the tool where it left its face. The distance is that of the scene, in every bit, and takes the
//! same parameters, so that an engine may be brought to their present values as with the scene itself.
//!
//! A leaf is a primitive, a raw field or a polygon *as often as it occurs*: copies that a loop makes, or
//! a shape that is used twice, are leaves of their own with the same span. Copies that space itself
//! makes (`repeat`, `polar`, `mirror`) are one leaf.
//!
//! Numbers of leaves travel as `f32`, which is exact up to 2²⁴; a program has at most
//! [`MAX_INSTRUCTIONS`](sdfc_vm::program::MAX_INSTRUCTIONS), two for a leaf and more, so a scene with
//! more leaves has been refused before.

use crate::compile::{Compiled, Options, compile_with};
use crate::scene::{Scene, Shape, ShapeKind};
use sdfc_lang::{Diagnostic, Span};

/// A scene whose materials are its leaves.
#[derive(Clone, Debug)]
pub struct Origins {
    /// What engines run. The number of a material is that of a leaf, counted from one in the order of
    /// the text; nothing has the number 0.
    pub compiled: Compiled,
    /// The leaves: the first has the number 1.
    pub leaves: Vec<Leaf>,
    /// The shapes around leaves, each as often as it occurs.
    around: Vec<Leaf>,
}

/// A shape that others are made of, at one of the places where it occurs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Leaf {
    /// The name that it was given in the text; empty if none.
    pub name: String,
    /// The text that made it.
    pub span: Span,
    /// The shape around it, in the list of these.
    within: Option<u32>,
}

/// Compiles a scene for its leaves. There is no result if a diagnostic is an error; warnings are those
/// that [`compile`](crate::compile::compile) gives, too.
pub fn origins(scene: Scene, options: &Options) -> (Option<Origins>, Vec<Diagnostic>) {
    let mut trail = Trail::default();
    let (compiled, diagnostics) = compile_with(scene, options, Some(&mut trail));
    let Trail { leaves, around, .. } = trail;
    let origins = compiled.map(|mut compiled| {
        let names = leaves.iter().map(|leaf| leaf.name.clone());
        compiled.module.settings.materials = std::iter::once(String::new()).chain(names).collect();
        Origins {
            compiled,
            leaves,
            around,
        }
    });
    (origins, diagnostics)
}

impl Origins {
    /// The leaf of this number, as pictures and points have it; `None` for 0, which is nothing.
    pub fn leaf(&self, number: u32) -> Option<&Leaf> {
        self.leaves.get((number as usize).checked_sub(1)?)
    }

    /// A leaf and the shapes around it, from the inside out, each with the text that made it. What
    /// stands for the same text as the one before is left out, unless it has a name.
    pub fn chain<'o>(&'o self, leaf: &'o Leaf) -> impl Iterator<Item = &'o Leaf> {
        let outer = |leaf: &&'o Leaf| self.around.get(leaf.within? as usize);
        let mut last = None;
        std::iter::successors(Some(leaf), outer).filter(move |leaf| {
            let is_new = last != Some(leaf.span) || !leaf.name.is_empty();
            last = Some(leaf.span);
            is_new
        })
    }

    /// The name by which a person knows a leaf: its own, or that of the nearest shape around it which
    /// has one; empty if there is none.
    pub fn name<'o>(&'o self, leaf: &'o Leaf) -> &'o str {
        let mut names = self.chain(leaf).map(|leaf| leaf.name.as_str());
        names.find(|name| !name.is_empty()).unwrap_or("")
    }
}

/// The leaves met on a walk through a scene's shapes, and where the walk is.
#[derive(Clone, Debug, Default)]
pub(crate) struct Trail {
    leaves: Vec<Leaf>,
    around: Vec<Leaf>,
    now: Option<u32>,
}

impl Trail {
    /// Goes into a shape; gives the one around it, for [`Trail::leave`].
    pub(crate) fn enter(&mut self, shape: &Shape) -> Option<u32> {
        let outer = self.now;
        if !is_leaf(shape) {
            self.around.push(self.met(shape));
            self.now = Some(self.around.len() as u32 - 1);
        }
        outer
    }

    /// Comes out of a shape, to the one around it.
    pub(crate) fn leave(&mut self, outer: Option<u32>) {
        self.now = outer;
    }

    /// The number of a shape that is a leaf, counted here.
    pub(crate) fn number(&mut self, shape: &Shape) -> Option<u32> {
        is_leaf(shape).then(|| {
            self.leaves.push(self.met(shape));
            self.leaves.len() as u32
        })
    }

    fn met(&self, shape: &Shape) -> Leaf {
        Leaf {
            name: shape.name.clone(),
            span: shape.span,
            within: self.now,
        }
    }
}

/// Whether a shape is made of no others.
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
