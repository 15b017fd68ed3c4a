//! Operations on all rays of a packet at once, each in its own lane. They are the intersection with a leaf's
//! box, and the test that rejects most rays after a single evaluation of the field.

use super::{LeafRays, Packet};
use crate::cells::{Aabb, Cell};
use crate::cpu::camera_rays::CameraRay;
use crate::cpu::march::initial_side;
use crate::cpu::ray_tasks::{ColumnChoice, lane_ray, set_lane_ray, store_point};
use crate::cpu::{F32x64, LANES, Points};
use sdfc_shaders::camera;
use sdfc_shaders::layout::{self, FrameUniforms};
use sdfc_shaders::marching;
use sdfc_vm::lanes::{CHUNK, bits};
use sdfc_vm::multiversion;
use sdfc_vm::real::Real;

multiversion! {
    /// Sets up the rays of pixels, between the scene's bounds. Reports whether any ray's
    /// segment begins at its origin.
    pub(super) fn init_packet(
        items: &[u32], camera_rays: &[CameraRay], packet: &mut Packet,
    ) -> bool = init_packet_body;
}

#[inline(always)]
fn init_packet_body(items: &[u32], camera_rays: &[CameraRay], p: &mut Packet) -> bool {
    let mut rays = [CameraRay::default(); LANES];
    for (lane, ray) in rays.iter_mut().enumerate() {
        // Unused lanes repeat the first ray, with an empty segment.
        let item = items.get(lane).or(items.first()).copied().unwrap_or(0);
        *ray = camera_rays[item as usize];
    }
    let mut starts_inside = 0;
    for (lane, ray) in rays.iter().enumerate() {
        let (origin, direction) = (ray.origin, ray.direction);
        set_lane_ray!(p, lane, origin, direction);
        let inverse = |d: f32| 1.0 / (Real::max(Real::abs(d), 1e-12) * d.sign_nonzero());
        p.inverse_x.0[lane] = inverse(direction.x);
        p.inverse_y.0[lane] = inverse(direction.y);
        p.inverse_z.0[lane] = inverse(direction.z);
        p.begin_t.0[lane] = ray.enter;
        p.end_t.0[lane] = if lane < items.len() {
            ray.exit
        } else {
            f32::NEG_INFINITY
        };
        p.clear_from.0[lane] = 0.0;
        p.clear_to.0[lane] = 0.0;
        p.side.0[lane] = 1.0;
        p.steps.0[lane] = 0.0;
        starts_inside |= u32::from(ray.enter <= 0.0);
    }
    starts_inside != 0
}

/// Rays of a packet that cross a leaf.
pub(super) struct Crossings {
    /// Mask of their lanes.
    pub(super) lanes: u64,
    /// Largest end of a segment of any ray of the packet.
    pub(super) farthest: f32,
}

multiversion! {
    /// Intersects the rays with a box.
    pub(super) fn intersect_box(region: &Aabb, packet: &mut Packet) -> Crossings = intersect_box_body;
}

#[inline(always)]
fn intersect_box_body(region: &Aabb, p: &mut Packet) -> Crossings {
    let (low, high) = (region.low, region.high);
    let mut crosses = [false; LANES];
    // The largest of a column is found with one maximum for each lane of a chunk: a single running maximum
    // would not become vectors.
    let mut farthest = [f32::NEG_INFINITY; CHUNK];
    for first in (0..LANES).step_by(CHUNK) {
        for (offset, maximum) in farthest.iter_mut().enumerate() {
            let lane = first + offset;
            let slab = |axis: usize, origin: f32, inverse: f32| {
                let a = (low[axis] - origin) * inverse;
                let block = (high[axis] - origin) * inverse;
                (Real::min(a, block), Real::max(a, block))
            };
            let (x0, x1) = slab(0, p.origin_x.0[lane], p.inverse_x.0[lane]);
            let (y0, y1) = slab(1, p.origin_y.0[lane], p.inverse_y.0[lane]);
            let (z0, z1) = slab(2, p.origin_z.0[lane], p.inverse_z.0[lane]);
            let enter = Real::max(Real::max(x0, y0), Real::max(z0, p.begin_t.0[lane]));
            // Leaves are not sorted along each ray.
            let is_clear = p.clear_from.0[lane] <= enter;
            let enter = Real::max(enter, if is_clear { p.clear_to.0[lane] } else { enter });
            // Common faces have the same coordinates: a ray that leaves one box there enters the next.
            let exit = Real::min(Real::min(x1, y1), Real::min(z1, p.end_t.0[lane]));
            p.entry_t.0[lane] = enter;
            p.exit_t.0[lane] = exit;
            crosses[lane] = enter <= exit;
            *maximum = Real::max(*maximum, p.end_t.0[lane]);
        }
    }
    Crossings {
        lanes: bits(&crosses),
        farthest: farthest.into_iter().fold(f32::NEG_INFINITY, f32::max),
    }
}

/// Bounds of the field's directional derivative along a ray in a cell.
#[derive(Clone, Copy)]
pub(super) struct DirectionalBounds {
    /// Largest absolute value.
    pub(super) slope: f32,
    /// Largest rate of decrease.
    pub(super) decrease_max: f32,
    /// Smallest rate of decrease.
    pub(super) decrease_min: f32,
}

/// Bounds the directional derivative along a ray. Where the gradient is bounded, it may be far less than the
/// slope.
#[inline(always)]
pub(super) fn directional_bounds(
    (cell_slope, gradient): (f32, Option<[[f32; 2]; 3]>),
    direction: [f32; 3],
    side: f32,
) -> DirectionalBounds {
    let Some(gradient) = gradient else {
        return DirectionalBounds {
            slope: cell_slope,
            decrease_max: cell_slope,
            decrease_min: 0.0,
        };
    };
    let (mut change_min, mut change_max) = (0.0, 0.0);
    for axis in 0..3 {
        let [min_slope, max_slope] = gradient[axis];
        let (a, c) = (min_slope * direction[axis], max_slope * direction[axis]);
        change_min += Real::min(a, c);
        change_max += Real::max(a, c);
    }
    // Directions and these sums have a relative rounding error.
    let rounding = 1e-5 * cell_slope;
    let max_abs = Real::max(-change_min, change_max) + rounding;
    let outside = side > 0.0;
    let decrease_max = if outside { -change_min } else { change_max } + rounding;
    let decrease_min = if outside { -change_max } else { change_min } - rounding;
    let slope = Real::min(Real::max(max_abs, 1e-3 * cell_slope), cell_slope);
    DirectionalBounds {
        slope,
        decrease_max: Real::min(Real::max(decrease_max, 0.0), slope),
        decrease_min: Real::min(Real::max(decrease_min, 0.0), slope),
    }
}

multiversion! {
    /// Bounds the directional derivatives along the rays in a leaf.
    pub(super) fn bound_directions(cell: &Cell, leaf_rays: &mut LeafRays) = bound_directions_body;
}

#[inline(always)]
fn bound_directions_body(cell: &Cell, block: &mut LeafRays) {
    for i in 0..LANES {
        let direction = [
            block.direction_x.0[i],
            block.direction_y.0[i],
            block.direction_z.0[i],
        ];
        let bounds = directional_bounds((cell.slope, cell.gradient), direction, block.side.0[i]);
        block.slope.0[i] = bounds.slope;
        block.decrease_max.0[i] = bounds.decrease_max;
        block.decrease_min.0[i] = bounds.decrease_min;
    }
}

multiversion! {
    /// Computes the entry points of the rays.
    pub(super) fn entry_points(packet: &Packet, points: &mut Points) = entry_points_body;
}

#[inline(always)]
fn entry_points_body(p: &Packet, points: &mut Points) {
    for i in 0..LANES {
        let (origin, direction) = lane_ray!(p, i);
        let p_ = camera::point_along::<f32>(origin, direction, p.entry_t.0[i]);
        store_point(points, i, p_);
    }
}

/// Reports whether a ray meets no surface in the `remaining` part of its segment in a leaf. The ray is at
/// `t`, its value there is `field`, and its next step is `step`. The field decreases at most at the rate
/// `decrease_max`.
#[inline(always)]
pub(super) fn misses_leaf(
    t: f32,
    field: f32,
    step: f32,
    decrease_max: f32,
    remaining: f32,
) -> bool {
    // The remaining segment lies in the empty sphere around the point, or is too short to change `t`. A
    // surface on the face of the next leaf is found there.
    let covered = (field >= remaining) | (remaining <= t.abs() * f32::EPSILON);
    // Nor is there a surface if the field does not decrease fast enough to change its sign.
    let end_value = field - decrease_max * remaining;
    covered | (end_value > 0.0) & (step > 0.0)
}

/// Returns the fraction of a value up to which the sphere around a point is empty beyond its leaf. A value that was divided
/// by an estimate says nothing there.
#[inline(always)]
pub(super) fn clear_fraction(frame: &FrameUniforms) -> f32 {
    let is_distance = frame.flags & layout::ESTIMATE_FLAG == 0;
    if is_distance { 1.0 } else { 0.0 }
}

multiversion! {
    /// Culls the rays that meet no surface in the leaf, by the field's values at their entry points, as their
    /// first step in it would. Returns a mask of their lanes.
    pub(super) fn cull_entered(
        frame: &FrameUniforms, cell: &Cell, values: &F32x64, packet: &mut Packet,
    ) -> u64 = cull_entered_body;
}

#[inline(always)]
fn cull_entered_body(frame: &FrameUniforms, cell: &Cell, values: &F32x64, p: &mut Packet) -> u64 {
    let mut culled = [false; LANES];
    let choice = ColumnChoice::new();
    for (i, culled) in culled.iter_mut().enumerate() {
        let direction = [p.direction_x.0[i], p.direction_y.0[i], p.direction_z.0[i]];
        let bounds = directional_bounds((cell.slope, cell.gradient), direction, p.side.0[i]);
        let (t, distance) = (p.entry_t.0[i], values.0[i]);
        let side = initial_side(p.steps.0[i], t, distance, p.side.0[i]);
        let field = distance * side / bounds.slope;
        let remaining = p.exit_t.0[i] - t;
        let is_through = misses_leaf(
            t,
            field,
            field,
            bounds.decrease_max / bounds.slope,
            remaining,
        );
        // Comparing with NaN is false.
        let rounding = marching::rounding_at(t, frame.rounding);
        let is_apart = field >= marching::sign_margin(rounding, 1.0, 0.0);
        let crosses = p.entry_t.0[i] <= p.exit_t.0[i];
        *culled = crosses & is_through & is_apart;
        let clear_radius = field * bounds.slope * clear_fraction(frame);
        let select = |new: f32, old: f32| choice.choose(*culled, new, old);
        p.steps.0[i] = select(p.steps.0[i] + 1.0, p.steps.0[i]);
        p.side.0[i] = select(side, p.side.0[i]);
        // The sphere around that point is empty beyond the leaf, too.
        p.clear_from.0[i] = select(t - clear_radius, p.clear_from.0[i]);
        p.clear_to.0[i] = select(t + clear_radius, p.clear_to.0[i]);
    }
    bits(&culled)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::leaf_bins::tests::cells;

    /// Beyond its leaf a field may have its global slope bound. So the empty sphere around an entry point is no
    /// larger than the value there.
    #[test]
    fn empty_spheres_are_no_larger_than_the_value() {
        let cells = cells();
        let leaf = cells.leaves().next().expect("a leaf");
        for slope in [0.1, 0.5, 1.0] {
            let mut cell = *cells.cell(leaf);
            (cell.slope, cell.gradient) = (slope, None);
            let (mut packet, mut values) = (Packet::default(), F32x64::default());
            packet.side.0.fill(1.0);
            packet.direction_x.0.fill(1.0);
            packet.entry_t.0.fill(2.0);
            packet.exit_t.0.fill(2.1);
            values.0.fill(0.3);
            let culled = cull_entered(&FrameUniforms::default(), &cell, &values, &mut packet);
            assert_eq!(culled, u64::MAX, "{slope}");
            for (from, to) in packet.clear_from.0.iter().zip(&packet.clear_to.0) {
                let clear = [2.0 - from, to - 2.0];
                assert!(
                    clear.iter().all(|radius| (radius - 0.3).abs() < 1e-5),
                    "{clear:?}"
                );
            }
        }
    }
}
