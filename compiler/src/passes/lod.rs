//! Level of detail: what an eye cannot tell from something simpler is made simpler. It runs only where
//! a [`Sight`] says who looks; a picture of final quality has none. Before: any graph without guards.
//! After: the same kinds of nodes, fewer of them.
//!
//! **The value changes**, but in whatever place, by no more than the tolerance times what a pixel
//! covers there. That size, the footprint, is taken at the point nearest to the eye at which a change
//! can move the surface: not farther from what is changed than the kernels and offsets above it reach
//! (`reach.rs`). Errors are carried in pixels: those beneath a node count at their largest, since no
//! operation here enlarges the larger of its operands' changes, and what is changed above them is added.
//!
//! A first part (`drop.rs`), which may use half of the tolerance, makes smooth blends hard where their
//! bulge is too thin to be seen, and drops offsets and displacements that are too small. The second
//! one (`merge.rs`) may use what is left: operands of a union that together are little else than the
//! box around them, or smaller than the error altogether, become that box. It holds what it replaces
//! and is an exact distance, so unions only grow: after that part no value is larger than before, and
//! outside of the solid none is less by more than the error. Each is a safe step to the surface that
//! it belongs to. Of materials, a box has that of all it replaces; in the graph of surfaces what
//! differs in paint is not merged.
//!
//! What is said of the picture holds for what is seen directly: the shadow of something far may fall
//! on something near. What moves with a parameter, or lies in space that is folded, bent or scaled
//! inside, has no footprint that is known and stays as it is.

mod drop;
mod merge;
mod probe;
mod reach;

use super::bounding::volumes::Volumes;
use super::{Context, Passed, counted};
use crate::graph::{Graph, Node, NodeId};
use sdfc_vm::bounds::Bounds;

/// Who looks at a scene, and what may be lost on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Where the eye is.
    pub eye: [f64; 3],
    /// What a pixel covers.
    pub pixel: Pixel,
    /// The largest error, in pixels.
    pub tolerance: f64,
}

/// What a pixel covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pixel {
    /// An angle in radians: the least that any pixel of the picture covers.
    Angle(f64),
    /// A length, the same at all distances.
    Length(f64),
}

impl Pixel {
    /// The pixel of a perspective picture of this height that sees so much from its lower to its upper
    /// edge: one in a corner, where the picture is stretched most.
    pub fn of_perspective(field_of_view: f64, [width, height]: [u32; 2]) -> Self {
        let [width, height] = [width, height].map(f64::from);
        let up = (field_of_view / 2.0).tan();
        let corner = (up * up) * (1.0 + (width / height).powi(2));
        Self::Angle(2.0 * up / height / (1.0 + corner))
    }

    /// The pixel of a picture along parallel rays that shows this much from its lower to its upper edge.
    pub fn of_parallel(shown: f64, [_, height]: [u32; 2]) -> Self {
        Self::Length(shown / f64::from(height))
    }
}

impl Sight {
    /// What a pixel covers so far from the eye.
    pub fn footprint(&self, distance: f64) -> f64 {
        match self.pixel {
            Pixel::Angle(angle) => distance * angle,
            Pixel::Length(length) => length,
        }
    }

    /// How far a box is from the eye.
    fn distance(&self, bounds: &Bounds) -> f64 {
        let gap = |i: usize| {
            let below = bounds.min[i] - self.eye[i];
            let above = self.eye[i] - bounds.max[i];
            below.max(above).max(0.0)
        };
        (0..3).map(|i| gap(i).powi(2)).sum::<f64>().sqrt()
    }
}

/// What a pass that may change the value has done.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Loss {
    /// How many nodes were replaced.
    pub replaced: usize,
    /// The largest error, in pixels.
    pub pixels: f64,
}

/// The graph as simple as the sight allows; the same graph where there is none.
pub fn lod(graph: &Graph, context: &Context) -> Passed {
    let usable = |sight: &Sight| sight.tolerance > 0.0;
    let Some(sight) = context.sight.filter(usable) else {
        return Passed {
            graph: graph.clone(),
            ..Passed::default()
        };
    };
    let dropped = drop::drop(graph, &sight);
    let rest = sight.tolerance - dropped.pixels;
    let merged = merge::merge(&dropped.graph, &sight, rest);
    let loss = Loss {
        replaced: dropped.blends + dropped.offsets + dropped.displacements + merged.shapes,
        pixels: dropped.pixels + merged.pixels,
    };
    let boxes = counted(merged.boxes, "box", "boxes");
    let shapes = counted(merged.shapes, "shape", "shapes");
    let notes = [
        counted(dropped.blends, "blend made hard", "blends made hard"),
        counted(dropped.offsets, "offset dropped", "offsets dropped"),
        counted(
            dropped.displacements,
            "displacement dropped",
            "displacements dropped",
        ),
        shapes
            .zip(boxes)
            .map(|(shapes, boxes)| format!("{shapes} merged into {boxes}")),
        (loss.replaced > 0).then(|| format!("error at most {:.2} px", loss.pixels)),
    ];
    Passed {
        graph: merged.graph,
        notes: notes.into_iter().flatten().collect(),
        loss: Some(loss),
    }
}

/// The box in the world from which a value keeps its distance, and at which rate.
fn in_world(graph: &Graph, volumes: &Volumes<'_>, id: NodeId) -> Option<(Bounds, f64)> {
    let volume = volumes.outermost(id)?;
    let is_world = *graph.get(volume.space) == Node::World;
    is_world.then_some((volume.bounds, volume.rate))
}
