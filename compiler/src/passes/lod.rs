//! Level of detail: detail that the camera cannot distinguish from something simpler is simplified. It
//! runs only with an [`LodTarget`]; a picture of final quality has none. Before: any graph without
//! guards. After: the same kinds of nodes, fewer of them.
//!
//! **The value changes**, but everywhere by at most the tolerance times the size of a pixel there.
//! The size of the pixel is taken at the point nearest to the camera at which a change can move the surface.
//! Its distance from the changed node is at most the range of the blends and offsets above
//! (`sensitivity.rs`). Errors are measured in pixels. Those below a node count at their largest, since
//! no operation here enlarges the larger of its operands' changes; changes above are added.
//!
//! The first part (`drop.rs`) may use half of the tolerance. It makes smooth blends hard where their
//! bulge is too thin to be visible, and drops offsets and displacements that are too small. The second
//! part (`merge.rs`) may use the rest. It replaces operands of a union by the box around them. They
//! must fill it up to the error, or be smaller than the error altogether. The box contains what it
//! replaces and is an exact distance, so unions only grow. After that part no value is larger than
//! before, and outside of the solid none is less by more than the error. Each is a safe step to its
//! surface. A box has the material of everything it replaces; in the graph of surfaces operands with
//! different materials are not merged.
//!
//! The bound holds for directly visible surfaces: the shadow of a distant object may fall on a near
//! one. Nodes that depend on a parameter, or lie in folded, bent or scaled space inside, have no known
//! pixel and stay as they are.

mod drop;
mod merge;
mod probe;
mod sensitivity;
pub(super) mod target;

use super::guards::influence::InfluenceBoxes;
use super::pass::{Context, PassOutput, plural};
use crate::graph::{Graph, GraphNode, NodeId};
use sdfc_vm::bounds::Bounds;
pub use target::{LodReport, LodTarget, PixelSize};

/// Simplifies the graph as far as the target allows; without a target the graph stays the same.
pub fn lod(graph: &Graph, context: &Context) -> PassOutput {
    let is_usable = |target: &LodTarget| target.tolerance > 0.0;
    let Some(target) = context.lod_target.filter(is_usable) else {
        return PassOutput {
            graph: graph.clone(),
            ..PassOutput::default()
        };
    };
    let dropped = drop::drop(graph, &target);
    let remaining_tolerance = target.tolerance - dropped.pixels;
    let merged = merge::merge(&dropped.graph, &target, remaining_tolerance);
    let report = LodReport {
        replaced: dropped.blends + dropped.offsets + dropped.displacements + merged.shapes,
        max_error_pixels: dropped.pixels + merged.pixels,
    };
    let boxes = plural(merged.boxes, "box", "boxes");
    let shapes = plural(merged.shapes, "shape", "shapes");
    let notes = [
        plural(dropped.blends, "blend made hard", "blends made hard"),
        plural(dropped.offsets, "offset dropped", "offsets dropped"),
        plural(
            dropped.displacements,
            "displacement dropped",
            "displacements dropped",
        ),
        shapes
            .zip(boxes)
            .map(|(shapes, boxes)| format!("{shapes} merged into {boxes}")),
        (report.replaced > 0).then(|| format!("error at most {:.2} px", report.max_error_pixels)),
    ];
    PassOutput {
        graph: merged.graph,
        notes: notes.into_iter().flatten().collect(),
        lod_report: Some(report),
    }
}

/// Returns the influence box of a value in world space, and its distance ratio.
fn in_world(
    graph: &Graph,
    influence_boxes: &InfluenceBoxes<'_>,
    id: NodeId,
) -> Option<(Bounds, f64)> {
    let influence_box = influence_boxes.outermost(id)?;
    let is_world = *graph.get(influence_box.space) == GraphNode::World;
    is_world.then_some((influence_box.bounds, influence_box.distance_ratio))
}
