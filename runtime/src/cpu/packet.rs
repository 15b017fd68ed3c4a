//! The stage `march` through cells: the rays of a packet go from leaf to leaf together.
//!
//! In a leaf a ray goes from where it enters to where it leaves, on the leaf's own tape and with the
//! slope that the field has there. Between leaves there is nothing to be met, and no evaluation; a
//! leaf that lies in the ball that the last value leaves clear is passed without one, too. Most of the
//! others are passed after one ([`first`]); the rays that are not through are collected and marched.
//! In fields written with coordinates, bounds of the gradient say how fast the field changes along
//! each ray in the leaf: that is the slope it marches with, and where the field cannot fall to zero
//! before the ray leaves, the ray is through; where it falls to below zero for certain, there is one
//! root, which secant steps find. A ray that runs along a surface still creeps; so after some
//! steps bounds of the field on what is left of the rays in the leaf say which of them meet nothing
//! there. Where all rays are parallel to an axis that is asked of whole rays first.
//! Lists are sorted by the nearest that any ray can be in a leaf, which is not the order for each
//! ray; so a hit counts until a nearer one is found, and leaves behind it are not entered.

mod first;
mod look;
mod roots;

use super::lanes::{Lanes, is_nan, lanes};
use super::march::{outcome, step_lane};
use super::meet::Meeting;
use super::{Boxes, Column, Evaluator, LANES, Points, Range};
use crate::cells::{Cell, Cells, Held};
use first::{bound_slopes, enter, entries, pass, passes, start};
use look::{rule_out, spans};
use roots::{place_roots, step_roots};
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
        t, field, t_other, field_other, side, slope,
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
    entered: Column,
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
/// After so many for the first time where bounds of the gradient say already what rays pass.
const FIRST_LOOK: u32 = 16;

/// A field that falls no faster in one place of a leaf than this many times as fast as in another is
/// near enough to a line for secant steps to find its root from anywhere in the leaf.
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
        let within = start(frame, items, pixels, &mut self.packet);
        for (lane, &item) in items.iter().enumerate() {
            rays[item as usize] = Ray {
                t: self.packet.leave.0[lane],
                trend: -1.0,
                t_before: self.packet.begin.0[lane],
                status: Status::Miss as u32,
                ..Ray::default()
            };
        }
        if within {
            self.find_sides(cells, items.len(), evaluator);
        } else if meetings.is_empty() {
            return 0;
        }
        self.ended_in.clear();
        self.ended_in.resize(LANES, NO_LEAF);
        let mut evaluations = 0;
        if !meetings.is_empty() && evaluator.is_raw() && along_an_axis(frame) {
            evaluations += self.look_along(cells.cell(0), items.len(), evaluator);
        }
        for meeting in meetings {
            let cell = cells.cell(meeting.cell);
            if cells.jumps() {
                // Beyond a jump, no ball around a point is known to be clear.
                self.packet.clear_to = Column([f32::NEG_INFINITY; LANES]);
            }
            let met = enter(&cell.region, &mut self.packet);
            if met.farthest < meeting.near {
                break;
            }
            if met.lanes != 0 {
                let leaf = (meeting.cell, cell);
                evaluations += self.cross(frame, leaf, met.lanes, items, rays, evaluator);
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

    /// Finds on which side of the surface the rays start, before any goes through a leaf: where they start may
    /// lie in the wall between two.
    fn find_sides(&mut self, cells: &Cells, lanes: usize, evaluator: &mut dyn Evaluator) {
        let mut known: Option<([f32; 3], f32)> = None;
        for lane in 0..lanes {
            let p = &self.packet;
            if p.begin.0[lane] > 0.0 {
                continue;
            }
            let origin = [p.origin_x.0[lane], p.origin_y.0[lane], p.origin_z.0[lane]];
            let side = match known {
                Some((place, side)) if place == origin => side,
                _ => self.side_at(cells, origin, evaluator),
            };
            known = Some((origin, side));
            self.packet.side.0[lane] = side;
        }
    }

    /// −1 for a point inside the solid, else 1.
    fn side_at(&mut self, cells: &Cells, at: [f32; 3], evaluator: &mut dyn Evaluator) -> f32 {
        match cells.held_at(at) {
            Held::Solid => -1.0,
            Held::Nothing => 1.0,
            Held::Leaf(cell) => {
                for (column, v) in self.points.iter_mut().zip(at) {
                    column.0.fill(v);
                }
                evaluator.distances_in(cell, &self.points, 1, &mut self.values);
                if self.values.0[0] < 0.0 { -1.0 } else { 1.0 }
            }
        }
    }

    /// Ends rays that meet nothing at all. The box around a ray along an axis is the ray itself, and walls
    /// often run along all of its way.
    fn look_along(&mut self, whole: &Cell, lanes: usize, evaluator: &mut dyn Evaluator) -> u64 {
        let p = &mut self.packet;
        p.enter = p.begin;
        p.exit = p.leave;
        let crossing = (0..lanes).filter(|&lane| p.enter.0[lane] <= p.exit.0[lane]);
        let met = crossing.fold(0, |met, lane| met | 1 << lane);
        let count = self.collect(met);
        bound_slopes(whole, &mut self.inside);
        let evaluations = self.look(0, count, evaluator);
        for place in 0..count {
            let lane = self.inside.lane.0[place] as usize;
            if self.inside.outcome.0[place] == outcome::THROUGH {
                self.packet.leave.0[lane] = f32::NEG_INFINITY;
            }
        }
        evaluations
    }

    /// Collects rays where they enter the leaf, with what the field says there; gives how many there are.
    fn collect(&mut self, rays: u64) -> usize {
        let (p, b) = (&self.packet, &mut self.inside);
        let mut count = 0;
        for lane in ones(rays) {
            b.lane.0[count] = lane as f32;
            b.origin_x.0[count] = p.origin_x.0[lane];
            b.origin_y.0[count] = p.origin_y.0[lane];
            b.origin_z.0[count] = p.origin_z.0[lane];
            b.direction_x.0[count] = p.direction_x.0[lane];
            b.direction_y.0[count] = p.direction_y.0[lane];
            b.direction_z.0[count] = p.direction_z.0[lane];
            b.leave.0[count] = p.exit.0[lane];
            b.t.0[count] = p.enter.0[lane];
            b.t_before.0[count] = p.enter.0[lane];
            b.side.0[count] = p.side.0[lane];
            b.steps.0[count] = p.steps.0[lane];
            self.values.0[count] = self.values.0[lane];
            count += 1;
        }
        b.radius = Column::default();
        b.step = Column::default();
        b.trend = Column([-1.0; LANES]);
        b.radius_before = Column::default();
        count
    }

    /// Asks the field where these rays enter the leaf; each one's answer is in its lane.
    fn ask_at_entries(&mut self, cell: u32, met: u64, evaluator: &mut dyn Evaluator) {
        entries(&self.packet, &mut self.points);
        let (lanes, few) = (LANES - met.leading_zeros() as usize, met.count_ones());
        if whole_chunks(few as usize) == whole_chunks(lanes) {
            evaluator.distances_in(cell, &self.points, lanes, &mut self.values);
            return;
        }
        for (place, lane) in ones(met).enumerate() {
            for axis in &mut self.points {
                axis.0[place] = axis.0[lane];
            }
        }
        evaluator.distances_in(cell, &self.points, few as usize, &mut self.entered);
        for (place, lane) in ones(met).enumerate() {
            self.values.0[lane] = self.entered.0[place];
        }
    }

    /// Takes these rays through the leaf. Those that the first look does not let through are collected; of
    /// them, those that have ended stay in their lanes until half of the lanes are theirs: carrying them
    /// along costs less than moving the others each time.
    fn cross(
        &mut self,
        frame: &Frame,
        (number, cell): (u32, &Cell),
        met: u64,
        items: &[u32],
        rays: &mut [Ray],
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        let mut evaluations = u64::from(met.count_ones());
        self.ask_at_entries(number, met, evaluator);
        let gone = match cell.jumps {
            true => 0,
            false => pass(frame, cell, &self.values, &mut self.packet),
        };
        let rest = met & !gone;
        if rest == 0 {
            return evaluations;
        }
        let mut count = self.collect(rest);
        bound_slopes(cell, &mut self.inside);
        self.arrived = 0;
        let mut under_way = lowest(count);
        let mut next_look = match cell.gradient {
            Some(_) => FIRST_LOOK,
            None => FEW_STEPS,
        };
        for steps in 1.. {
            let left = under_way & advance(frame, cell, &self.values, count, &mut self.inside);
            if left != under_way {
                self.end_those(frame, under_way & !left, number, items, rays);
                (under_way, count) = self.close_ranks(left, count);
            }
            if steps == next_look && under_way != 0 {
                next_look *= FEW_STEPS;
                evaluations += self.look(number, count, evaluator);
                let left = under_way & open_lanes(&self.inside);
                self.end_those(frame, under_way & !left, number, items, rays);
                (under_way, count) = self.close_ranks(left, count);
            }
            if under_way == 0 {
                break;
            }
            place(&self.inside, count, &mut self.points);
            evaluator.distances_in(number, &self.points, count, &mut self.values);
            evaluations += u64::from(under_way.count_ones());
        }
        evaluations + self.settle(frame, number, items, rays, evaluator)
    }

    /// Lets those of the collected rays through that bounds of the field keep from meeting anything in
    /// the cell.
    fn look(&mut self, cell: u32, count: usize, evaluator: &mut dyn Evaluator) -> u64 {
        spans(&self.inside, count, &mut self.boxes);
        let known = evaluator.ranges_in(cell, &self.boxes, count, &mut self.range);
        if !known {
            self.inside.outcome = Column([outcome::UNDER_WAY; LANES]);
            return 0;
        }
        rule_out(&self.range, count, &mut self.inside);
        count as u64
    }

    /// Keeps how these rays left the leaf.
    fn end_those(&mut self, frame: &Frame, ended: u64, cell: u32, items: &[u32], rays: &mut [Ray]) {
        for place in ones(ended) {
            self.end(frame, place, cell, items, rays);
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
    fn end(&mut self, frame: &Frame, place: usize, cell: u32, items: &[u32], rays: &mut [Ray]) {
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
            // Below zero from where it enters on: rounding hid the root, which lies a little before the leaf.
            let is_before = radius < 0.0 && b.radius_before.0[place] == 0.0;
            let rounding = marching::rounding_at(b.t.0[place], frame.rounding);
            let hidden = marching::noise(rounding, 1.0, frame.raw) * 2.0;
            let back = if is_before { hidden } else { 0.0 };
            r.low.0[at] = self.packet.enter.0[lane] - back;
            r.high.0[at] = b.leave.0[place];
            r.t.0[at] = b.t.0[place];
            r.field.0[at] = b.radius.0[place];
            r.t_other.0[at] = b.t_before.0[place] - back;
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

/// The lanes of these bits, from the lowest on.
fn ones(mut bits: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = (bits != 0).then(|| bits.trailing_zeros() as usize);
        bits &= bits.wrapping_sub(1);
        lane
    })
}

/// The first lanes, as bits.
fn lowest(count: usize) -> u64 {
    u64::MAX.checked_shr((LANES - count) as u32).unwrap_or(0)
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
    fn advance(
        frame: &Frame, cell: &Cell, values: &Column, count: usize, inside: &mut Inside,
    ) -> u64 = advance_body;
}

#[inline(always)]
fn advance_body(f: &Frame, cell: &Cell, values: &Column, count: usize, b: &mut Inside) -> u64 {
    for i in 0..whole_chunks(count) {
        let slope = b.slope.0[i];
        step_lane!(f, b, i, values.0[i], 1.0 / slope, |next, out| {
            let left = b.leave.0[i] - next.t;
            let fall = b.fall.0[i] / slope;
            // Behind a jump may be a surface: the ray goes on to the wall, and sees its sign there.
            let at_wall = left <= next.t.abs() * f32::EPSILON;
            let through =
                passes(next.t, next.radius, next.step, fall, left) & (!cell.jumps | at_wall);
            let out = if through { outcome::THROUGH } else { out };
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
        let rounding = marching::rounding_at(b.leave.0[i], f.rounding);
        let depth = marching::noise(rounding, least, f.raw);
        let certain = under_way & even & (radius > 0.0) & (radius + depth < falls);
        let select = |new: f32, old: f32| if certain { new } else { old };
        b.outcome.0[i] = select(outcome::HIT, b.outcome.0[i]);
        b.t_before.0[i] = select(b.leave.0[i], b.t_before.0[i]);
        let last = radius - (least + most) * 0.5 * left;
        b.radius_before.0[i] = select(Real::min(last, -depth), b.radius_before.0[i]);
    }
    open_lanes_body(b)
}
