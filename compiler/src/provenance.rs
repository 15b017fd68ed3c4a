//! Provenance: the source text that made the surface at a point.
//!
//! A scene is compiled once more, with a material per leaf in place of its material assignments. A
//! blend of materials has the number of the operand with the larger weight. So the material that an
//! engine reports at a point ([`sdfc_vm::surface`]) is the leaf to which that point of the surface
//! belongs. In a hard union that is the nearer one, and in a smooth union the one with the larger
//! weight. On the face of a cut it is the tool. The distance is that of the scene, in every bit. It has
//! the same parameters, so an engine can be updated to their current values as for the scene itself.
//!
//! Numbers of leaves ([`Leaf`]) are `f32` values, which are exact up to 2²⁴. A program has at most
//! [`MAX_INSTRUCTIONS`](sdfc_vm::program::MAX_INSTRUCTIONS), at least two per leaf, so a scene with
//! more leaves is refused earlier.

use crate::compile::{Compiled, Options, compile_with};
pub use crate::leaves::Leaf;
use crate::leaves::LeafTracker;
use crate::scene::Scene;
use sdfc_lang::Diagnostic;

/// Scene whose materials are its leaves.
#[derive(Clone, Debug)]
pub struct Provenance {
    /// Module for the engines. The number of a material is that of a leaf, counted from one in the
    /// order of the text; 0 stands for no leaf.
    pub compiled: Compiled,
    /// Leaves; the first has the number 1.
    pub leaves: Vec<Leaf>,
    /// Enclosing shapes of leaves, one per occurrence.
    enclosing: Vec<Leaf>,
}

/// Compiles a scene for its leaves. There is no result if a diagnostic is an error. The warnings are
/// those of [`compile`](crate::compile::compile).
pub fn compile_provenance(
    scene: Scene,
    options: &Options,
) -> (Option<Provenance>, Vec<Diagnostic>) {
    let mut leaf_tracker = LeafTracker::default();
    let (compiled, diagnostics) = compile_with(scene, options, Some(&mut leaf_tracker));
    let LeafTracker {
        leaves, enclosing, ..
    } = leaf_tracker;
    let provenance = compiled.map(|mut compiled| {
        let names = leaves.iter().map(|leaf| leaf.name.clone());
        compiled.module.settings.materials = std::iter::once(String::new()).chain(names).collect();
        Provenance {
            compiled,
            leaves,
            enclosing,
        }
    });
    (provenance, diagnostics)
}

impl Provenance {
    /// Returns the leaf with this number, as in pictures and at points; `None` for 0.
    pub fn leaf(&self, number: u32) -> Option<&Leaf> {
        self.leaves.get((number as usize).checked_sub(1)?)
    }

    /// Returns a leaf and its enclosing shapes, from the inside out, each with its text. A shape with
    /// the same text as the one before is left out, unless it has a name.
    pub fn chain<'o>(&'o self, leaf: &'o Leaf) -> impl Iterator<Item = &'o Leaf> {
        let outer = |leaf: &&'o Leaf| self.enclosing.get(leaf.parent? as usize);
        let mut last = None;
        std::iter::successors(Some(leaf), outer).filter(move |leaf| {
            let is_new = last != Some(leaf.span) || !leaf.name.is_empty();
            last = Some(leaf.span);
            is_new
        })
    }

    /// Returns the name of a leaf for display: its own, or that of the nearest enclosing shape with
    /// one; empty if there is none.
    pub fn name<'o>(&'o self, leaf: &'o Leaf) -> &'o str {
        let mut names = self.chain(leaf).map(|leaf| leaf.name.as_str());
        names.find(|name| !name.is_empty()).unwrap_or("")
    }
}
