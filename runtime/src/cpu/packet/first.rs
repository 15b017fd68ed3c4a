//! What all rays of a packet do at once, each in its own lane: where they cross a leaf, and which of them
//! are through after a single look at the field, as most are.

use super::{Inside, Packet};
use crate::cells::{Cell, Region};
use crate::cpu::march::{side_from, vector};
use crate::cpu::tile::camera_ray;
use crate::cpu::{Column, LANES, Points};
use sdfc_shaders::camera;
use sdfc_shaders::layout::Frame;
use sdfc_shaders::marching;
use sdfc_vm::lanes::{CHUNK, bits};
use sdfc_vm::real::Real;
use sdfc_vm::vector::V3;
use sdfc_vm::widest;

widest! {
    /// The rays of pixels, and where they cross the scene's bounds; whether any begins where it starts,
    /// and not on its way into the bounds.
    pub(super) fn start(
        frame: &Frame, items: &[u32], pixels: &[[f32; 2]], packet: &mut Packet,
    ) -> bool = start_body;
}

#[inline(always)]
fn start_body(f: &Frame, items: &[u32], pixels: &[[f32; 2]], p: &mut Packet) -> bool {
    let mut at = [[0.0_f32; 2]; LANES];
    for (lane, at) in at.iter_mut().enumerate() {
        // Lanes that are left over repeat the first ray, and go nowhere.
        let item = items.get(lane).or(items.first()).copied().unwrap_or(0);
        *at = pixels[item as usize];
    }
    let (low, high) = (vector(f.bounds_min), vector(f.bounds_max));
    let mut within = 0;
    for (lane, &at) in at.iter().enumerate() {
        let camera = camera_ray(f, at);
        let (origin, direction) = (camera.origin, camera.direction);
        p.origin_x.0[lane] = origin.x;
        p.origin_y.0[lane] = origin.y;
        p.origin_z.0[lane] = origin.z;
        p.direction_x.0[lane] = direction.x;
        p.direction_y.0[lane] = direction.y;
        p.direction_z.0[lane] = direction.z;
        let inverse = |d: f32| 1.0 / (Real::max(Real::abs(d), 1e-12) * d.side());
        p.inverse_x.0[lane] = inverse(direction.x);
        p.inverse_y.0[lane] = inverse(direction.y);
        p.inverse_z.0[lane] = inverse(direction.z);
        let bounds = camera::crossing::<f32>(origin, direction, low, high, f.far);
        p.begin.0[lane] = bounds.x;
        p.leave.0[lane] = if lane < items.len() {
            bounds.y
        } else {
            f32::NEG_INFINITY
        };
        p.clear_from.0[lane] = 0.0;
        p.clear_to.0[lane] = 0.0;
        p.side.0[lane] = 1.0;
        p.steps.0[lane] = 0.0;
        within |= u32::from(bounds.x <= 0.0);
    }
    within != 0
}

/// Which of a packet's rays cross a leaf.
pub(super) struct Met {
    /// As bits.
    pub(super) lanes: u64,
    /// The farthest that any ray still goes.
    pub(super) farthest: f32,
}

widest! {
    /// Where the rays enter and leave a box.
    pub(super) fn enter(region: &Region, packet: &mut Packet) -> Met = enter_body;
}

#[inline(always)]
fn enter_body(region: &Region, p: &mut Packet) -> Met {
    let (low, high) = (region.low, region.high);
    let mut crosses = [false; LANES];
    // The largest of a column is found in as many parts as there are lanes in a chunk: one after the other
    // would be a loop that does not become vectors.
    let mut farthest = [f32::NEG_INFINITY; CHUNK];
    for first in (0..LANES).step_by(CHUNK) {
        for (offset, part) in farthest.iter_mut().enumerate() {
            let lane = first + offset;
            let slab = |axis: usize, origin: f32, inverse: f32| {
                let a = (low[axis] - origin) * inverse;
                let b = (high[axis] - origin) * inverse;
                (Real::min(a, b), Real::max(a, b))
            };
            let (x0, x1) = slab(0, p.origin_x.0[lane], p.inverse_x.0[lane]);
            let (y0, y1) = slab(1, p.origin_y.0[lane], p.inverse_y.0[lane]);
            let (z0, z1) = slab(2, p.origin_z.0[lane], p.inverse_z.0[lane]);
            let enter = Real::max(Real::max(x0, y0), Real::max(z0, p.begin.0[lane]));
            // Leaves do not come in the order of each ray.
            let clear = p.clear_from.0[lane] <= enter;
            let enter = Real::max(enter, if clear { p.clear_to.0[lane] } else { enter });
            // Where faces are common, the same numbers say so: what leaves one box there is in the next.
            let exit = Real::min(Real::min(x1, y1), Real::min(z1, p.leave.0[lane]));
            p.enter.0[lane] = enter;
            p.exit.0[lane] = exit;
            crosses[lane] = enter <= exit;
            *part = Real::max(*part, p.leave.0[lane]);
        }
    }
    Met {
        lanes: bits(&crosses),
        farthest: farthest.into_iter().fold(f32::NEG_INFINITY, f32::max),
    }
}

/// How the field changes along a ray in a cell.
struct Change {
    /// How fast at most.
    slope: f32,
    /// How fast it falls at most.
    fall: f32,
    /// How fast it falls at least.
    steady: f32,
}

/// Bounds of how the field changes along a ray: where its gradient is bounded, that is less than its
/// slope.
#[inline(always)]
fn change(cell: &Cell, way: [f32; 3], side: f32) -> Change {
    let Some(gradient) = cell.gradient else {
        return Change {
            slope: cell.slope,
            fall: cell.slope,
            steady: 0.0,
        };
    };
    let (mut low, mut high) = (0.0, 0.0);
    for axis in 0..3 {
        let [least, most] = gradient[axis];
        let (a, c) = (least * way[axis], most * way[axis]);
        low += Real::min(a, c);
        high += Real::max(a, c);
    }
    // Directions are of unit length but for rounding, and so are the sums.
    let rounding = 1e-5 * cell.slope;
    let most = Real::max(-low, high) + rounding;
    let outside = side > 0.0;
    let fall = if outside { -low } else { high } + rounding;
    let steady = if outside { -high } else { low } - rounding;
    let slope = Real::min(Real::max(most, 1e-3 * cell.slope), cell.slope);
    Change {
        slope,
        fall: Real::min(Real::max(fall, 0.0), slope),
        steady: Real::min(Real::max(steady, 0.0), slope),
    }
}

widest! {
    /// How the field changes along the rays in a leaf.
    pub(super) fn bound_slopes(cell: &Cell, inside: &mut Inside) = bound_slopes_body;
}

#[inline(always)]
fn bound_slopes_body(cell: &Cell, b: &mut Inside) {
    for i in 0..LANES {
        let way = [b.direction_x.0[i], b.direction_y.0[i], b.direction_z.0[i]];
        let change = change(cell, way, b.side.0[i]);
        b.slope.0[i] = change.slope;
        b.fall.0[i] = change.fall;
        b.steady.0[i] = change.steady;
    }
}

widest! {
    /// Where the rays enter.
    pub(super) fn entries(packet: &Packet, points: &mut Points) = entries_body;
}

#[inline(always)]
fn entries_body(p: &Packet, points: &mut Points) {
    for i in 0..LANES {
        let origin = V3::of(p.origin_x.0[i], p.origin_y.0[i], p.origin_z.0[i]);
        let direction = V3::of(p.direction_x.0[i], p.direction_y.0[i], p.direction_z.0[i]);
        let at = camera::along::<f32>(origin, direction, p.enter.0[i]);
        points[0].0[i] = at.x;
        points[1].0[i] = at.y;
        points[2].0[i] = at.z;
    }
}

/// Tells if a ray meets nothing in the `left` of its way through a leaf, at a point at `t` with this field where
/// it would take a `step`; the field falls no faster than `fall`.
#[inline(always)]
pub(super) fn passes(t: f32, radius: f32, step: f32, fall: f32, left: f32) -> bool {
    // What is left lies in the ball around the point: there is nothing there. Or it is less than `t` can grow
    // by: whether there is a surface in the wall to the next leaf is seen there.
    let covered = (radius >= left) | (left <= t.abs() * f32::EPSILON);
    // Nor is there where the field does not fall fast enough to change its sign.
    let last = radius - fall * left;
    covered | (last > 0.0) & (step > 0.0)
}

widest! {
    /// Lets those rays through that meet nothing in the leaf, as their first step in it would, by what
    /// the field says where they enter; gives their lanes.
    pub(super) fn pass(
        frame: &Frame, cell: &Cell, values: &Column, packet: &mut Packet,
    ) -> u64 = pass_body;
}

#[inline(always)]
fn pass_body(f: &Frame, cell: &Cell, values: &Column, p: &mut Packet) -> u64 {
    let mut gone = [false; LANES];
    for (i, gone) in gone.iter_mut().enumerate() {
        let way = [p.direction_x.0[i], p.direction_y.0[i], p.direction_z.0[i]];
        let change = change(cell, way, p.side.0[i]);
        let (t, distance) = (p.enter.0[i], values.0[i]);
        let side = side_from(p.steps.0[i], t, distance, p.side.0[i]);
        let radius = distance * side / change.slope;
        let left = p.exit.0[i] - t;
        let through = passes(t, radius, radius, change.fall / change.slope, left);
        // Comparing with NaN is false.
        let apart = radius >= marching::rounding_at(t, f.rounding);
        let crosses = p.enter.0[i] <= p.exit.0[i];
        *gone = crosses & through & apart;
        let clear = radius * change.slope;
        let select = |new: f32, old: f32| if *gone { new } else { old };
        p.steps.0[i] = select(p.steps.0[i] + 1.0, p.steps.0[i]);
        p.side.0[i] = select(side, p.side.0[i]);
        // The ball around that point is clear of surfaces beyond the leaf, too.
        p.clear_from.0[i] = select(t - clear, p.clear_from.0[i]);
        p.clear_to.0[i] = select(t + clear, p.clear_to.0[i]);
    }
    bits(&gone)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::meet::tests::cells;

    /// Beyond its leaf a field may be as steep as anywhere, so the ball around the point where a ray enters is no larger
    /// than the value there.
    #[test]
    fn no_more_is_clear_of_surfaces_than_the_value_says() {
        let cells = cells();
        let leaf = cells.leaves().next().expect("a leaf");
        for slope in [0.1, 0.5, 1.0] {
            let mut cell = *cells.cell(leaf);
            (cell.slope, cell.gradient) = (slope, None);
            let (mut packet, mut values) = (Packet::default(), Column::default());
            packet.side.0.fill(1.0);
            packet.direction_x.0.fill(1.0);
            packet.enter.0.fill(2.0);
            packet.exit.0.fill(2.1);
            values.0.fill(0.3);
            let gone = pass(&Frame::default(), &cell, &values, &mut packet);
            assert_eq!(gone, u64::MAX, "{slope}");
            for (from, to) in packet.clear_from.0.iter().zip(&packet.clear_to.0) {
                let clear = [2.0 - from, to - 2.0];
                assert!(
                    clear.iter().all(|way| (way - 0.3).abs() < 1e-5),
                    "{clear:?}"
                );
            }
        }
    }
}
