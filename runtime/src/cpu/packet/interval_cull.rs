//! Culling of the remaining ray segments in a leaf by interval bounds of the field.

use super::{LeafRays, whole_chunks};
use crate::cpu::RangeLanes;
use crate::cpu::march::outcome;
use sdfc_vm::multiversion;

multiversion! {
    /// Culls the rays along which the field cannot change its sign.
    pub(super) fn cull_clear(range: &RangeLanes, count: usize, leaf_rays: &mut LeafRays) = cull_clear_body;
}

#[inline(always)]
fn cull_clear_body([low, high]: &RangeLanes, count: usize, block: &mut LeafRays) {
    for i in 0..whole_chunks(count) {
        let slope = block.slope.0[i];
        let outside = block.side.0[i] > 0.0;
        let nearest = if outside { low.0[i] } else { -high.0[i] };
        let is_clear = nearest > 0.0;
        block.outcome.0[i] = if is_clear {
            outcome::EXITED
        } else {
            outcome::ACTIVE
        };
        // The empty sphere must not extend beyond the leaf, so it is centred on the remaining segment.
        let (from, to) = (block.t.0[i], block.leaf_exit_t.0[i]);
        let (centre, half) = ((from + to) * 0.5, (to - from) * 0.5 / slope);
        block.t.0[i] = if is_clear { centre } else { from };
        block.field.0[i] = if is_clear { half } else { block.field.0[i] };
    }
}
