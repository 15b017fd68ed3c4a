//! The stage `march` through cells: the rays of a packet go from leaf to leaf together.
//!
//! In a leaf a ray goes from where it enters to where it leaves, on the leaf's own tape and with the
//! slope that the field has there. Between leaves there is nothing to be met, and no evaluation; a
//! leaf that lies in the ball that the last value leaves clear is passed without one, too.
//! In fields written with coordinates, bounds of the gradient say how fast the field changes along
//! each ray in the leaf: that is the slope it marches with, and where the field cannot fall to zero
//! before the ray leaves, the ray is through; where it falls to below zero for certain, there is one
//! root, which secant steps find. A ray that runs along a surface still creeps; so after a
//! few steps bounds of the field on what is left of the rays in the leaf say which of them meet nothing
//! there. Where all rays are parallel to an axis that is asked of whole rays first.
//! Lists are sorted by the nearest that any ray can be in a leaf, which is not the order for each
//! ray; so a hit counts until a nearer one is found, and leaves behind it are not entered.

use super::lanes::{Lanes, is_nan, lanes};
use super::march::{outcome, step_lane, vector};
use super::meet::Meeting;
use super::tile::camera_ray;
use super::{Boxes, Column, Evaluator, LANES, Points, Range};
use crate::cells::{Cell, Cells, Region};
use sdfc_shaders::camera;
use sdfc_shaders::layout::{Frame, Ray};
use sdfc_shaders::marching::{self, FROM_INSIDE, SECANT_STEPS, SHOWN, Status};
use sdfc_vm::lanes::CHUNK;
use sdfc_vm::real::Real;
use sdfc_vm::vector::V3;
use sdfc_vm::widest;

lanes! {
    /// 64 rays, and where they may still meet something.
    Packet {
        origin_x, origin_y, origin_z, direction_x, direction_y, direction_z,
        inverse_x, inverse_y, inverse_z, begin, leave, clear_from, clear_to, side, steps, enter, exit,
    }
}

lanes! {
    /// Rays under way in a leaf, and then those that hit on their way to the root.
    Inside {
        lane, origin_x, origin_y, origin_z, direction_x, direction_y, direction_z, leave,
        t, radius, step, trend, t_before, radius_before, side, steps, outcome, slope, fall, steady,
    }
}

lanes! {
    /// Rays that hit in a leaf, on their way to the root.
    Roots {
        lane, origin_x, origin_y, origin_z, direction_x, direction_y, direction_z, low, high,
        t, field, t_other, field_other, reach, side, slope,
    }
}

/// The memory of a march.
#[derive(Default)]
pub(super) struct Marcher {
    packet: Packet,
    inside: Inside,
    roots: Roots,
    /// How many of them there are.
    arrived: usize,
    /// The leaf in which each ray ended.
    ended_in: Vec<u32>,
    points: Points,
    values: Column,
    boxes: Boxes,
    range: Range,
}

/// The leaf of a ray that ended in none.
pub(super) const NO_LEAF: u32 = u32::MAX;

/// Whether all rays are parallel to an axis.
fn along_an_axis(frame: &Frame) -> bool {
    let crooked = frame.forward.iter().filter(|d| d.abs() > 1e-6).count();
    frame.footprint_growth == 0.0 && crooked == 1
}

/// After so many steps in a leaf, what is left of the rays in it is looked at as a whole; and again
/// after as many times so many.
const FEW_STEPS: u32 = 4;

/// A field that falls no faster in one place of a leaf than this many times as fast as in another is
/// near enough to a line for secant steps to go to its root from anywhere in the leaf.
const UNEVEN: f32 = 4.0;

impl Marcher {
    /// Marches the rays of a packet, which are the places `items` of a tile, and says in which leaf
    /// each ended; gives the number of evaluations.
    pub(super) fn march(
        &mut self,
        frame: &Frame,
        (cells, meetings): (&Cells, &[Meeting]),
        items: &[u32],
        pixels: &[[f32; 2]],
        (rays, points, leaves): (&mut [Ray], &mut [V3<f32>], &mut [u32]),
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        self.ended_in.clear();
        self.ended_in.resize(LANES, NO_LEAF);
        start(frame, items, pixels, &mut self.packet);
        for (lane, &item) in items.iter().enumerate() {
            let begin = self.packet.begin.0[lane];
            rays[item as usize] = Ray {
                t: self.packet.leave.0[lane],
                trend: -1.0,
                t_before: begin,
                status: Status::Miss as u32,
                ..Ray::default()
            };
            self.packet.side.0[lane] = self.first_side(cells, lane);
        }
        let mut evaluations = 0;
        if !meetings.is_empty() && evaluator.is_raw() && along_an_axis(frame) {
            // The box around a ray is the ray itself, and walls often run along all of its way.
            self.packet.enter = self.packet.begin;
            self.packet.exit = self.packet.leave;
            let count = self.go_in(items.len());
            let whole = cells.cell(0);
            bound_slopes(whole, count, &mut self.inside);
            evaluations += self.look(frame, 0, count, evaluator);
            for place in 0..count {
                let lane = self.inside.lane.0[place] as usize;
                if self.inside.outcome.0[place] == outcome::THROUGH {
                    self.packet.leave.0[lane] = f32::NEG_INFINITY;
                }
            }
        }
        for meeting in meetings {
            let cell = cells.cell(meeting.cell);
            let met = enter(&cell.region, items.len(), &mut self.packet);
            if met.farthest < meeting.near {
                break;
            }
            if met.any {
                let count = self.go_in(items.len());
                bound_slopes(cell, count, &mut self.inside);
                evaluations += self.cross(frame, meeting.cell, count, items, rays, evaluator);
            }
        }
        let p = &self.packet;
        for (lane, &item) in items.iter().enumerate() {
            let ray = &mut rays[item as usize];
            ray.steps = p.steps.0[lane] as u32;
            leaves[item as usize] = self.ended_in[lane];
            if p.side.0[lane] < 0.0 {
                ray.status |= FROM_INSIDE;
            }
            if ray.status & SHOWN == 0 {
                continue;
            }
            let origin = V3::of(p.origin_x.0[lane], p.origin_y.0[lane], p.origin_z.0[lane]);
            let direction = V3::of(
                p.direction_x.0[lane],
                p.direction_y.0[lane],
                p.direction_z.0[lane],
            );
            points[item as usize] = camera::along::<f32>(origin, direction, ray.t);
        }
        evaluations
    }

    /// −1 for a ray that starts where all of a cell is inside; a ray that starts in a leaf finds out
    /// there.
    fn first_side(&self, cells: &Cells, lane: usize) -> f32 {
        let p = &self.packet;
        if p.begin.0[lane] > 0.0 {
            return 1.0;
        }
        let origin = [p.origin_x.0[lane], p.origin_y.0[lane], p.origin_z.0[lane]];
        if cells.full_at(origin) { -1.0 } else { 1.0 }
    }

    /// Collects the rays that cross the leaf; gives how many there are.
    fn go_in(&mut self, lanes: usize) -> usize {
        let (p, b) = (&self.packet, &mut self.inside);
        let mut count = 0;
        if lanes == LANES && (0..LANES).all(|lane| p.enter.0[lane] <= p.exit.0[lane]) {
            for lane in 0..LANES {
                b.lane.0[lane] = lane as f32;
            }
            b.origin_x = p.origin_x;
            b.origin_y = p.origin_y;
            b.origin_z = p.origin_z;
            b.direction_x = p.direction_x;
            b.direction_y = p.direction_y;
            b.direction_z = p.direction_z;
            b.leave = p.exit;
            b.t = p.enter;
            b.radius = Column::default();
            b.step = Column::default();
            b.trend = Column([-1.0; LANES]);
            b.t_before = p.enter;
            b.radius_before = Column::default();
            b.side = p.side;
            b.steps = p.steps;
            return LANES;
        }
        for lane in 0..lanes {
            let (enter, exit) = (p.enter.0[lane], p.exit.0[lane]);
            if enter > exit {
                continue;
            }
            b.lane.0[count] = lane as f32;
            b.origin_x.0[count] = p.origin_x.0[lane];
            b.origin_y.0[count] = p.origin_y.0[lane];
            b.origin_z.0[count] = p.origin_z.0[lane];
            b.direction_x.0[count] = p.direction_x.0[lane];
            b.direction_y.0[count] = p.direction_y.0[lane];
            b.direction_z.0[count] = p.direction_z.0[lane];
            b.leave.0[count] = exit;
            b.t.0[count] = enter;
            b.radius.0[count] = 0.0;
            b.step.0[count] = 0.0;
            b.trend.0[count] = -1.0;
            b.t_before.0[count] = enter;
            b.radius_before.0[count] = 0.0;
            b.side.0[count] = p.side.0[lane];
            b.steps.0[count] = p.steps.0[lane];
            count += 1;
        }
        count
    }

    /// Takes the collected rays through the leaf. Those that have ended stay in their lanes until half
    /// of the lanes are theirs: carrying them along costs less than moving the others each time.
    fn cross(
        &mut self,
        frame: &Frame,
        cell: u32,
        mut count: usize,
        items: &[u32],
        rays: &mut [Ray],
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        let mut evaluations = 0;
        self.arrived = 0;
        let mut under_way = lowest(count);
        let mut next_look = FEW_STEPS;
        for steps in 0.. {
            if steps == next_look {
                next_look = FEW_STEPS.max(next_look * FEW_STEPS);
                evaluations += self.look(frame, cell, count, evaluator);
                let left = under_way & open_lanes(&self.inside);
                self.end_those(under_way & !left, cell, items, rays);
                (under_way, count) = self.close_ranks(left, count);
            }
            if under_way == 0 {
                break;
            }
            place(&self.inside, count, &mut self.points);
            evaluator.distances_in(cell, &self.points, count, &mut self.values);
            evaluations += u64::from(under_way.count_ones());
            let left = under_way & advance(frame, &self.values, count, &mut self.inside);
            if left == under_way {
                continue;
            }
            if left == 0 && under_way == !0 && all_went_through(&self.inside, &mut self.packet) {
                break;
            }
            self.end_those(under_way & !left, cell, items, rays);
            (under_way, count) = self.close_ranks(left, count);
        }
        evaluations + self.settle(frame, cell, items, rays, evaluator)
    }

    /// Lets those of the collected rays through that bounds of the field keep from meeting anything in
    /// the cell.
    fn look(
        &mut self,
        frame: &Frame,
        cell: u32,
        count: usize,
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        spans(&self.inside, count, &mut self.boxes);
        let known = evaluator.ranges_in(cell, &self.boxes, count, &mut self.range);
        if !known {
            self.inside.outcome = Column([outcome::UNDER_WAY; LANES]);
            return 0;
        }
        rule_out(frame, &self.range, count, &mut self.inside);
        count as u64
    }

    /// Keeps how these rays left the leaf.
    fn end_those(&mut self, mut ended: u64, cell: u32, items: &[u32], rays: &mut [Ray]) {
        while ended != 0 {
            self.end(ended.trailing_zeros() as usize, cell, items, rays);
            ended &= ended - 1;
        }
    }

    /// Moves the rays under way to the front if that halves the lanes that are run; gives the lanes
    /// where they are, and how many are run.
    fn close_ranks(&mut self, under_way: u64, count: usize) -> (u64, usize) {
        let left = under_way.count_ones() as usize;
        if whole_chunks(left) * 2 > whole_chunks(count) {
            return (under_way, count);
        }
        let front = lowest(left);
        let (mut free, mut behind) = (front & !under_way, under_way & !front);
        while behind != 0 {
            let (from, to) = (behind.trailing_zeros(), free.trailing_zeros());
            self.inside.move_lane(from as usize, to as usize);
            behind &= behind - 1;
            free &= free - 1;
        }
        (front, left)
    }

    /// Moves the rays that hit in the leaf onto the surface, as far as it lies in the leaf; the stage
    /// `polish` does the others.
    fn settle(
        &mut self,
        frame: &Frame,
        cell: u32,
        items: &[u32],
        rays: &mut [Ray],
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        let count = self.arrived;
        if count == 0 {
            return 0;
        }
        let mut evaluations = 0;
        begin_roots(frame, &mut self.roots);
        for _ in 0..SECANT_STEPS {
            let open = place_roots(frame, &self.roots, count, &mut self.points);
            if !open {
                break;
            }
            evaluator.distances_in(cell, &self.points, count, &mut self.values);
            evaluations += count as u64;
            step_roots(frame, &self.values, count, &mut self.roots);
        }
        let b = &self.roots;
        for place in 0..count {
            let lane = b.lane.0[place] as usize;
            self.packet.leave.0[lane] = b.t.0[place];
            let ray = &mut rays[items[lane] as usize];
            ray.t = b.t.0[place];
            ray.radius = b.field.0[place] * b.slope.0[place];
            ray.t_before = b.t_other.0[place];
            ray.radius_before = b.field_other.0[place] * b.slope.0[place];
        }
        evaluations
    }

    /// Keeps how a ray left the leaf.
    fn end(&mut self, place: usize, cell: u32, items: &[u32], rays: &mut [Ray]) {
        let b = &self.inside;
        let lane = b.lane.0[place] as usize;
        self.packet.steps.0[lane] = b.steps.0[place];
        self.packet.side.0[lane] = b.side.0[place];
        // The ball around the last point is clear of surfaces beyond the leaf, too.
        let slope = b.slope.0[place];
        let radius = b.radius.0[place] * slope;
        self.packet.clear_from.0[lane] = b.t.0[place] - radius;
        self.packet.clear_to.0[lane] = b.t.0[place] + radius;
        let outcome = b.outcome.0[place];
        if outcome == outcome::THROUGH {
            return;
        }
        if outcome == outcome::HIT {
            let r = &mut self.roots;
            let at = self.arrived;
            self.arrived += 1;
            r.lane.0[at] = b.lane.0[place];
            r.origin_x.0[at] = b.origin_x.0[place];
            r.origin_y.0[at] = b.origin_y.0[place];
            r.origin_z.0[at] = b.origin_z.0[place];
            r.direction_x.0[at] = b.direction_x.0[place];
            r.direction_y.0[at] = b.direction_y.0[place];
            r.direction_z.0[at] = b.direction_z.0[place];
            r.low.0[at] = self.packet.enter.0[lane];
            r.high.0[at] = b.leave.0[place];
            r.t.0[at] = b.t.0[place];
            r.field.0[at] = b.radius.0[place];
            r.t_other.0[at] = b.t_before.0[place];
            r.field_other.0[at] = b.radius_before.0[place];
            r.side.0[at] = b.side.0[place];
            r.slope.0[at] = slope;
        }
        // Nothing behind it counts any more.
        self.packet.leave.0[lane] = b.t.0[place];
        self.ended_in[lane] = cell;
        rays[items[lane] as usize] = Ray {
            t: b.t.0[place],
            radius: b.radius.0[place] * slope,
            step: b.step.0[place],
            trend: b.trend.0[place],
            t_before: b.t_before.0[place],
            radius_before: b.radius_before.0[place] * slope,
            status: outcome::status(outcome),
            steps: 0,
        };
    }
}

/// The lanes of the chunks that hold so many rays: loops over them become vectors without remainders.
#[inline(always)]
fn whole_chunks(count: usize) -> usize {
    count.div_ceil(CHUNK).min(LANES / CHUNK) * CHUNK
}

/// The first lanes, as bits.
fn lowest(count: usize) -> u64 {
    u64::MAX.checked_shr((LANES - count) as u32).unwrap_or(0)
}

/// Whether a packet's rays cross a leaf.
pub(super) struct Met {
    any: bool,
    /// The farthest that any ray still goes.
    farthest: f32,
}

widest! {
    /// The rays of pixels, and where they cross the scene's bounds.
    fn start(frame: &Frame, items: &[u32], pixels: &[[f32; 2]], packet: &mut Packet) = start_body;
}

#[inline(always)]
fn start_body(f: &Frame, items: &[u32], pixels: &[[f32; 2]], p: &mut Packet) {
    let mut at = [[0.0_f32; 2]; LANES];
    for (lane, at) in at.iter_mut().enumerate() {
        // Lanes that are left over repeat the first ray.
        let item = items.get(lane).or(items.first()).copied().unwrap_or(0);
        *at = pixels[item as usize];
    }
    let (low, high) = (vector(f.bounds_min), vector(f.bounds_max));
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
        p.leave.0[lane] = bounds.y;
        p.clear_from.0[lane] = 0.0;
        p.clear_to.0[lane] = 0.0;
        p.steps.0[lane] = 0.0;
    }
}

widest! {
    /// Where the rays enter and leave a box.
    fn enter(region: &Region, lanes: usize, packet: &mut Packet) -> Met = enter_body;
}

#[inline(always)]
fn enter_body(region: &Region, lanes: usize, p: &mut Packet) -> Met {
    let (low, high) = (region.low, region.high);
    for lane in 0..LANES {
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
        let exit = Real::min(Real::min(x1, y1), Real::min(z1, p.leave.0[lane]));
        // A ray along the common face of two boxes must be in one of them at least.
        let exit = exit + exit.abs() * 4e-7;
        p.enter.0[lane] = enter;
        p.exit.0[lane] = exit;
    }
    // The largest of a column is found in as many parts as there are lanes in a chunk: one after the other
    // would be a loop that does not become vectors.
    let mut crossing = 0;
    let mut farthest = [f32::NEG_INFINITY; CHUNK];
    for first in (0..LANES).step_by(CHUNK) {
        for (offset, part) in farthest.iter_mut().enumerate() {
            let lane = first + offset;
            let real = lane < lanes;
            crossing |= u32::from((p.enter.0[lane] <= p.exit.0[lane]) & real);
            *part = Real::max(*part, if real { p.leave.0[lane] } else { *part });
        }
    }
    Met {
        any: crossing != 0,
        farthest: farthest.into_iter().fold(f32::NEG_INFINITY, f32::max),
    }
}

widest! {
    /// How fast the field changes along the rays in a leaf, how fast it falls at most, and at least:
    /// where its gradient is bounded, that is less than its slope.
    fn bound_slopes(cell: &Cell, count: usize, inside: &mut Inside) = bound_slopes_body;
}

#[inline(always)]
fn bound_slopes_body(cell: &Cell, count: usize, b: &mut Inside) {
    let Some(gradient) = cell.gradient else {
        b.slope = Column([cell.slope; LANES]);
        b.fall = Column([cell.slope; LANES]);
        b.steady = Column::default();
        return;
    };
    for i in 0..whole_chunks(count) {
        let way = [b.direction_x.0[i], b.direction_y.0[i], b.direction_z.0[i]];
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
        let outside = b.side.0[i] > 0.0;
        let fall = if outside { -low } else { high } + rounding;
        let steady = if outside { -high } else { low } - rounding;
        let slope = Real::min(Real::max(most, 1e-3 * cell.slope), cell.slope);
        b.slope.0[i] = slope;
        b.fall.0[i] = Real::min(Real::max(fall, 0.0), slope);
        b.steady.0[i] = Real::min(Real::max(steady, 0.0), slope);
    }
}

widest! {
    /// Where all 64 rays are through: keeps how they left the leaf, and says so.
    fn all_went_through(inside: &Inside, packet: &mut Packet) -> bool = all_through_body;
}

#[inline(always)]
fn all_through_body(b: &Inside, p: &mut Packet) -> bool {
    let mut others = 0;
    for i in 0..LANES {
        others |= u32::from(b.outcome.0[i] != outcome::THROUGH);
    }
    if others != 0 {
        return false;
    }
    // No ray has been taken out, so all are in their lanes.
    p.steps = b.steps;
    p.side = b.side;
    for i in 0..LANES {
        let radius = b.radius.0[i] * b.slope.0[i];
        p.clear_from.0[i] = b.t.0[i] - radius;
        p.clear_to.0[i] = b.t.0[i] + radius;
    }
    true
}

widest! {
    /// Where the rays ask the field next.
    fn place(inside: &Inside, count: usize, points: &mut Points) = place_body;
}

#[inline(always)]
fn place_body(b: &Inside, count: usize, points: &mut Points) {
    for i in 0..whole_chunks(count) {
        let origin = V3::of(b.origin_x.0[i], b.origin_y.0[i], b.origin_z.0[i]);
        let direction = V3::of(b.direction_x.0[i], b.direction_y.0[i], b.direction_z.0[i]);
        let p = camera::along::<f32>(origin, direction, b.t.0[i] + b.step.0[i]);
        points[0].0[i] = p.x;
        points[1].0[i] = p.y;
        points[2].0[i] = p.z;
    }
}

widest! {
    /// The boxes around what is left of the rays in the leaf.
    fn spans(inside: &Inside, count: usize, boxes: &mut Boxes) = spans_body;
}

#[inline(always)]
fn spans_body(b: &Inside, count: usize, boxes: &mut Boxes) {
    for i in 0..whole_chunks(count) {
        let origin = V3::of(b.origin_x.0[i], b.origin_y.0[i], b.origin_z.0[i]);
        let direction = V3::of(b.direction_x.0[i], b.direction_y.0[i], b.direction_z.0[i]);
        // Rounding keeps the order of points along a ray, so these ends hold all between them.
        let from = camera::along::<f32>(origin, direction, b.t.0[i]).to_array();
        let to = camera::along::<f32>(origin, direction, b.leave.0[i]).to_array();
        for axis in 0..3 {
            boxes[axis].0[i] = Real::min(from[axis], to[axis]);
            boxes[axis + 3].0[i] = Real::max(from[axis], to[axis]);
        }
    }
}

widest! {
    /// Lets those rays through that stay farther from the surface than where they would stop.
    fn rule_out(frame: &Frame, range: &Range, count: usize, inside: &mut Inside) = rule_out_body;
}

#[inline(always)]
fn rule_out_body(f: &Frame, [low, high]: &Range, count: usize, b: &mut Inside) {
    for i in 0..whole_chunks(count) {
        let slope = b.slope.0[i];
        let factor = f.inverse_slope / slope;
        let half = camera::half_pixel(b.leave.0[i], f.footprint, f.footprint_growth);
        let enough = marching::threshold(b.leave.0[i], half, f.cone, f.rounding);
        let outside = b.side.0[i] > 0.0;
        let nearest = if outside { low.0[i] } else { -high.0[i] };
        let clear = nearest * factor > enough * marching::LEFT as f32;
        b.outcome.0[i] = if clear {
            outcome::THROUGH
        } else {
            outcome::UNDER_WAY
        };
        // What is clear is a ball around the last point; nothing is known beyond the leaf.
        let (from, to) = (b.t.0[i], b.leave.0[i]);
        let (middle, half) = ((from + to) * 0.5, (to - from) * 0.5 / slope);
        b.t.0[i] = if clear { middle } else { from };
        b.radius.0[i] = if clear { half } else { b.radius.0[i] };
    }
}

widest! {
    /// The lanes whose rays are under way, as bits.
    fn open_lanes(inside: &Inside) -> u64 = open_lanes_body;
}

#[inline(always)]
fn open_lanes_body(b: &Inside) -> u64 {
    let mut open = 0;
    for (i, &out) in b.outcome.0.iter().enumerate() {
        open |= u64::from(out == outcome::UNDER_WAY) << i;
    }
    open
}

widest! {
    /// Takes a step with each ray; gives the lanes where they are still under way, as bits.
    fn advance(frame: &Frame, values: &Column, count: usize, inside: &mut Inside) -> u64 =
        advance_body;
}

#[inline(always)]
fn advance_body(f: &Frame, values: &Column, count: usize, b: &mut Inside) -> u64 {
    for i in 0..whole_chunks(count) {
        let slope = b.slope.0[i];
        let factor = f.inverse_slope / slope;
        step_lane!(f, b, i, values.0[i], factor, |next, enough, out| {
            // What is left lies in the ball around the last point: there is nothing there.
            let left = b.leave.0[i] - next.t;
            // Nor is there where the field does not fall fast enough.
            let last = next.radius - b.fall.0[i] / slope * left;
            let least = enough * marching::LEFT as f32;
            let never = (last > least) & (next.step > 0.0);
            let out = if (next.radius >= left) | (left <= 0.0) | never {
                outcome::THROUGH
            } else {
                out
            };
            if next.arrived > 0.0 {
                outcome::HIT
            } else {
                out
            }
        });
        // The tape holds in the leaf, so no step leads out of it.
        let left = b.leave.0[i] - b.t.0[i];
        b.step.0[i] = Real::min(b.step.0[i], left);
        // A field that falls all the way, and to below zero, has one root: the line to begin with has
        // the slope between the least and the most.
        let (least, most) = (b.steady.0[i] / slope, b.fall.0[i] / slope);
        let under_way = b.outcome.0[i] == outcome::UNDER_WAY;
        let even = most < least * UNEVEN;
        let (radius, falls) = (b.radius.0[i], least * left);
        let certain = under_way & even & (radius > 0.0) & (radius < falls);
        let before = radius + (least + most) * 0.5 * left;
        b.outcome.0[i] = if certain {
            outcome::HIT
        } else {
            b.outcome.0[i]
        };
        b.t_before.0[i] = if certain {
            b.t.0[i] - left
        } else {
            b.t_before.0[i]
        };
        b.radius_before.0[i] = if certain {
            before
        } else {
            b.radius_before.0[i]
        };
    }
    open_lanes_body(b)
}

widest! {
    /// How far the steps to the root may go.
    fn begin_roots(frame: &Frame, roots: &mut Roots) = begin_roots_body;
}

#[inline(always)]
fn begin_roots_body(f: &Frame, b: &mut Roots) {
    for i in 0..LANES {
        let half = camera::half_pixel(b.t.0[i], f.footprint, f.footprint_growth);
        b.reach.0[i] = marching::secant_reach(b.t.0[i], b.t_other.0[i], half, f.rounding, 0.0);
    }
}

widest! {
    /// Where the roots are guessed to be; whether any of them is still to be found.
    fn place_roots(frame: &Frame, roots: &Roots, count: usize, points: &mut Points) -> bool =
        place_roots_body;
}

/// The guess for a root, kept within its leaf.
#[inline(always)]
fn guess(b: &Roots, i: usize) -> f32 {
    let guess = marching::secant_guess(
        b.t.0[i],
        b.field.0[i],
        b.t_other.0[i],
        b.field_other.0[i],
        b.reach.0[i],
    );
    Real::max(Real::min(guess, b.high.0[i]), b.low.0[i])
}

#[inline(always)]
fn place_roots_body(f: &Frame, b: &Roots, count: usize, points: &mut Points) -> bool {
    let mut open = 0;
    for i in 0..whole_chunks(count) {
        let rounding = marching::rounding_at(b.t.0[i], f.rounding);
        let settled = marching::settled(b.field.0[i], rounding) > 0.0;
        open |= u32::from(!settled & (i < count));
        let origin = V3::of(b.origin_x.0[i], b.origin_y.0[i], b.origin_z.0[i]);
        let direction = V3::of(b.direction_x.0[i], b.direction_y.0[i], b.direction_z.0[i]);
        let p = camera::along::<f32>(origin, direction, guess(b, i));
        points[0].0[i] = p.x;
        points[1].0[i] = p.y;
        points[2].0[i] = p.z;
    }
    open != 0
}

widest! {
    /// Takes the field at the guesses into account.
    fn step_roots(frame: &Frame, values: &Column, count: usize, roots: &mut Roots) =
        step_roots_body;
}

#[inline(always)]
fn step_roots_body(f: &Frame, values: &Column, count: usize, b: &mut Roots) {
    for i in 0..whole_chunks(count) {
        let factor = f.inverse_slope / b.slope.0[i];
        let field = values.0[i] * b.side.0[i] * factor;
        let best = marching::secant_step(
            b.t.0[i],
            b.field.0[i],
            b.t_other.0[i],
            b.field_other.0[i],
            guess(b, i),
            field,
        );
        let rounding = marching::rounding_at(b.t.0[i], f.rounding);
        // What is settled stays; comparing with NaN is false, so a guess without a value is not
        // taken.
        let keep = marching::settled(b.field.0[i], rounding) > 0.0;
        b.t_other.0[i] = if keep { b.t_other.0[i] } else { best.t_other };
        b.field_other.0[i] = if keep {
            b.field_other.0[i]
        } else {
            best.field_other
        };
        b.t.0[i] = if keep { b.t.0[i] } else { best.t };
        b.field.0[i] = if keep { b.field.0[i] } else { best.field };
    }
}
