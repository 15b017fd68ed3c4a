//! The stage `shadow`: what lies between surfaces and a light.

mod check;
mod sized;

use super::lanes::{Walk, any, is_nan, lanes, stream};
use super::march::vector;
use super::tile::Tile;
use super::{Column, Evaluator, LANES, Points};
use sdfc_shaders::features::Shadow;
use sdfc_shaders::layout::{Frame, Light, Ray};
use sdfc_shaders::marching::FROM_INSIDE;
use sdfc_shaders::{camera, claim, marching, normals, reflectance, shadow};
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;

lanes! {
    /// Rays towards a light.
    ShadowLanes {
        start_x, start_y, start_z, direction_x, direction_y, direction_z, leave,
        axis_x, axis_y, axis_z, reach, size, number, best, cleared, begun,
        t, visibility, steps, least, side, rounding, before, step, fall, last, claim_t, ends, moves,
        value, phase, round, gradient_x, gradient_y, gradient_z, offset_x, offset_y, offset_z,
    }
}

const HARD: u32 = Shadow::Hard as u32;
const PLAIN: u32 = Shadow::Plain as u32;
const IMPROVED: u32 = Shadow::Improved as u32;
const SIZED: u32 = Shadow::Sized as u32;

/// Rays towards a light whose shadow has the form `FORM`: items are places in the tile.
struct ShadowRays<'a, const FORM: u32> {
    frame: &'a Frame,
    light: &'a Light,
    points: &'a [V3<f32>],
    rays: &'a [Ray],
    normals: &'a [[f32; 3]],
    arriving: &'a mut [f32],
}

/// Finds what arrives of a light at the shown pixels; gives the number of evaluations.
pub(super) fn cast(
    frame: &Frame,
    light: &Light,
    number: usize,
    form: Shadow,
    tile: &mut Tile,
    evaluator: &mut dyn Evaluator,
) -> u64 {
    macro_rules! cast {
        ($form:ident) => {{
            let mut walk = ShadowRays::<$form> {
                frame,
                light,
                points: &tile.points,
                rays: &tile.rays,
                normals: &tile.normals,
                arriving: &mut tile.arriving[number],
            };
            stream(&mut walk, evaluator, &tile.shown)
        }};
    }
    match form {
        Shadow::None => {
            tile.arriving[number].fill(1.0);
            0
        }
        Shadow::Hard => cast!(HARD),
        Shadow::Plain => cast!(PLAIN),
        Shadow::Improved => cast!(IMPROVED),
        Shadow::Sized => cast!(SIZED),
    }
}

impl<const FORM: u32> Walk for ShadowRays<'_, FORM> {
    type Block = ShadowLanes;

    fn begin(&mut self, item: u32, b: &mut ShadowLanes, lane: usize) -> bool {
        let (f, light) = (self.frame, self.light);
        let seen = &self.rays[item as usize];
        let p = self.points[item as usize];
        let normal = vector(self.normals[item as usize]);
        let place = vector(light.place);
        let seen_from = camera::unit::<f32>(place - p * light.near);
        if reflectance::cosine::<f32>(normal, seen_from) <= 0.0 {
            self.arriving[item as usize] = 0.0;
            return false;
        }
        let half = camera::half_pixel(seen.t, f.footprint, f.footprint_growth);
        let rounding = marching::rounding_at(seen.t, f.rounding);
        let sharp = if FORM == HARD { 1.0 } else { 0.0 };
        let above = normals::lift::<f32>(p, half, rounding, sharp);
        let least = shadow::shortest::<f32>(half, above);
        let begin = shadow::begin::<f32>(least, sharp);
        let start = camera::along::<f32>(p, normal, above);
        // From where the ray starts, so that it ends at the lamp and not beside it.
        let to_place = place - start * light.near;
        let direction = camera::unit::<f32>(to_place);
        let length = to_place.length();
        let near = if length < f.far { length } else { f.far };
        let reach = if light.near > 0.0 { near } else { f.far };
        let (low, high) = (vector(f.bounds_min), vector(f.bounds_max));
        let size = if soft(FORM) { self.light.size } else { 0.0 };
        let leave = shadow::leave::<f32>(start, direction, low, high, reach, size);
        let side = if seen.status & FROM_INSIDE != 0 {
            -1.0
        } else {
            1.0
        };
        b.start_x.0[lane] = start.x;
        b.start_y.0[lane] = start.y;
        b.start_z.0[lane] = start.z;
        b.direction_x.0[lane] = direction.x;
        b.direction_y.0[lane] = direction.y;
        b.direction_z.0[lane] = direction.z;
        b.leave.0[lane] = leave;
        b.reach.0[lane] = reach;
        b.before.0[lane] = 0.0;
        b.step.0[lane] = 0.0;
        b.fall.0[lane] = 0.0;
        b.t.0[lane] = begin;
        b.visibility.0[lane] = 1.0;
        b.steps.0[lane] = 0.0;
        b.least.0[lane] = least;
        b.side.0[lane] = side;
        b.rounding.0[lane] = rounding;
        if soft(FORM) {
            b.phase.0[lane] = 0.0;
            b.last.0[lane] = 1.0;
            b.claim_t.0[lane] = shadow::NO_CLAIM;
            b.moves.0[lane] = 0.0;
        }
        if FORM == SIZED {
            b.axis_x.0[lane] = direction.x;
            b.axis_y.0[lane] = direction.y;
            b.axis_z.0[lane] = direction.z;
            b.size.0[lane] = self.light.size;
            b.number.0[lane] = 0.0;
            b.best.0[lane] = -1.0;
            b.cleared.0[lane] = begin;
            b.begun.0[lane] = 0.0;
        }
        true
    }

    #[inline(always)]
    fn points(&self, b: &ShadowLanes, points: &mut Points) {
        for i in 0..LANES {
            let start = V3::of(b.start_x.0[i], b.start_y.0[i], b.start_z.0[i]);
            let direction = V3::of(b.direction_x.0[i], b.direction_y.0[i], b.direction_z.0[i]);
            let p = camera::along::<f32>(start, direction, b.t.0[i]);
            points[0].0[i] = p.x;
            points[1].0[i] = p.y;
            points[2].0[i] = p.z;
        }
        if FORM == SIZED && any(&b.number) {
            for i in 0..LANES {
                let centre = axis_of(b, i) * b.reach.0[i];
                let measures = b.size.0[i] == 0.0;
                let add = |to: f32, more: f32| if measures { to + more } else { to };
                points[0].0[i] = add(points[0].0[i], centre.x);
                points[1].0[i] = add(points[1].0[i], centre.y);
                points[2].0[i] = add(points[2].0[i], centre.z);
            }
        }
    }

    #[inline(always)]
    fn advance(&self, b: &mut ShadowLanes, values: &Column, ended: &mut [bool; LANES]) {
        // Held here, since a pointer could lead to what is written in the loop.
        let shared = self.shared();
        let mut ends = sized::Ends::default();
        for (i, ended) in ended.iter_mut().enumerate() {
            b.steps.0[i] += 1.0;
            let field = values.0[i] * b.side.0[i];
            if FORM == SIZED {
                (*ended, ends.kind.0[i], ends.amount.0[i]) = shared.step_sized(b, i, field);
            } else {
                *ended = shared.step(b, i, field);
            }
        }
        if FORM == SIZED {
            shared.go_on(b, &ends, ended);
        }
    }

    #[inline(always)]
    fn asides(b: &ShadowLanes) -> Option<&Column> {
        soft(FORM).then_some(&b.phase)
    }

    #[inline(always)]
    fn points_aside(&self, b: &ShadowLanes, points: &mut Points) {
        for i in 0..LANES {
            let limit = shadow::limit(b.claim_t.0[i], size_of::<FORM>(b, i, self.light.size));
            let (phase, value) = (b.phase.0[i], b.value.0[i]);
            let (at, offset, gradient) = (place_of(b, i), offset_of(b, i), gradient_of(b, i));
            let p = claim::place::<f32>(at, offset, phase, value, gradient, limit);
            points[0].0[i] = p.x;
            points[1].0[i] = p.y;
            points[2].0[i] = p.z;
        }
    }

    #[inline(always)]
    fn advance_aside(&self, b: &mut ShadowLanes, values: &Column, ended: &mut [bool; LANES]) {
        let shared = self.shared();
        let mut ends = sized::Ends::default();
        for (i, ended) in ended.iter_mut().enumerate() {
            b.steps.0[i] += 1.0;
            let field = values.0[i] * b.side.0[i];
            let (gives_up, done) = shared.check(b, i, field);
            *ended = gives_up | is_nan(field) | (done & (FORM != SIZED));
            if FORM == SIZED {
                ends.kind.0[i] = if done { sized::ARRIVES } else { 0.0 };
                ends.amount.0[i] = b.visibility.0[i];
            }
        }
        if FORM == SIZED {
            shared.go_on(b, &ends, ended);
        }
    }

    fn end(&mut self, item: u32, b: &ShadowLanes, lane: usize) {
        let visibility = match FORM {
            SIZED if b.number.0[lane] > 0.0 => b.best.0[lane],
            _ => b.visibility.0[lane],
        };
        self.arriving[item as usize] = match FORM {
            SIZED => shadow::arriving_sized(visibility),
            _ => shadow::arriving(visibility),
        };
    }
}

impl<const FORM: u32> ShadowRays<'_, FORM> {
    /// The common part of all rays.
    #[inline(always)]
    fn shared(&self) -> Shared<FORM> {
        Shared {
            size: self.light.size,
            near: self.light.near,
            raw: self.frame.raw,
            low: vector(self.frame.bounds_min),
            high: vector(self.frame.bounds_max),
            most_steps: self.frame.shadow_steps as f32,
        }
    }
}

/// Reports whether a form of shadows has penumbras.
const fn soft(form: u32) -> bool {
    form != HARD
}

/// The part of the gradient in a lane that is found so far.
#[inline(always)]
fn gradient_of(b: &ShadowLanes, i: usize) -> V3<f32> {
    V3::of(b.gradient_x.0[i], b.gradient_y.0[i], b.gradient_z.0[i])
}

/// The place of the round in a lane.
#[inline(always)]
fn place_of(b: &ShadowLanes, i: usize) -> V3<f32> {
    let start = V3::of(b.start_x.0[i], b.start_y.0[i], b.start_z.0[i]);
    camera::along::<f32>(start, direction_of(b, i), b.claim_t.0[i]) + offset_of(b, i)
}

/// The direction of the ray in a lane.
#[inline(always)]
fn direction_of(b: &ShadowLanes, i: usize) -> V3<f32> {
    V3::of(b.direction_x.0[i], b.direction_y.0[i], b.direction_z.0[i])
}

/// The size by which the ray in a lane is measured.
#[inline(always)]
fn size_of<const FORM: u32>(b: &ShadowLanes, i: usize, size: f32) -> f32 {
    if FORM == SIZED { b.size.0[i] } else { size }
}

/// The direction from the start of the ray in a lane to the centre of the light.
#[inline(always)]
fn axis_of(b: &ShadowLanes, i: usize) -> V3<f32> {
    V3::of(b.axis_x.0[i], b.axis_y.0[i], b.axis_z.0[i])
}

/// The way from the claim in a lane to the place of its round.
#[inline(always)]
fn offset_of(b: &ShadowLanes, i: usize) -> V3<f32> {
    V3::of(b.offset_x.0[i], b.offset_y.0[i], b.offset_z.0[i])
}

#[inline(always)]
fn set_direction(b: &mut ShadowLanes, i: usize, direction: V3<f32>) {
    b.direction_x.0[i] = direction.x;
    b.direction_y.0[i] = direction.y;
    b.direction_z.0[i] = direction.z;
}

/// Begins the check of a lane's claim, if it `begins` now. What comes `at_end` with a claim ends after the check.
#[inline(always)]
fn begin_check(b: &mut ShadowLanes, i: usize, begins: bool, at_end: bool) {
    let set = |old: f32, new: f32| if begins { new } else { old };
    b.phase.0[i] = set(b.phase.0[i], 1.0);
    b.round.0[i] = set(b.round.0[i], 0.0);
    b.offset_x.0[i] = set(b.offset_x.0[i], 0.0);
    b.offset_y.0[i] = set(b.offset_y.0[i], 0.0);
    b.offset_z.0[i] = set(b.offset_z.0[i], 0.0);
    b.gradient_x.0[i] = set(b.gradient_x.0[i], 0.0);
    b.gradient_y.0[i] = set(b.gradient_y.0[i], 0.0);
    b.gradient_z.0[i] = set(b.gradient_z.0[i], 0.0);
    b.ends.0[i] = set(b.ends.0[i], if at_end { 1.0 } else { 0.0 });
}

/// The common part of all rays towards a light.
#[derive(Clone, Copy)]
struct Shared<const FORM: u32> {
    /// The light's size.
    size: f32,
    /// 0 for a light far away, 1 for one at a place.
    near: f32,
    /// 1 where the length of the field's gradient is unknown, else 0.
    raw: f32,
    /// The lower corner of the box outside which there is nothing.
    low: V3<f32>,
    /// Its upper corner.
    high: V3<f32>,
    /// The most evaluations of a ray.
    most_steps: f32,
}

impl<const FORM: u32> Shared<FORM> {
    /// Takes the evaluation of a point on the ray into account; tells whether the ray has ended.
    ///
    /// A claim is checked once the ray has passed the point where it is greatest.
    #[inline(always)]
    fn step(self, b: &mut ShadowLanes, i: usize, h: f32) -> bool {
        let (t, v) = (b.t.0[i], b.visibility.0[i]);
        let slope = shadow::slope(h, b.before.0[i], b.step.0[i]);
        let noise = marching::noise(b.rounding.0[i], slope, self.raw);
        let shortest = b.least.0[i] * shadow::hurry(b.steps.0[i]);
        let next = match FORM {
            PLAIN => shadow::short_stride(h, t, shortest, self.size),
            _ => shadow::stride(h, t, shortest, self.size),
        };
        // The last point is the end of the ray itself, wherever the steps before it were.
        let left = b.leave.0[i] - t;
        let left = if left > 0.0 { left } else { 0.0 };
        let next = if next < left { next } else { left };
        let out_of_steps = b.steps.0[i] >= self.most_steps;
        let at_end = (t >= b.leave.0[i]) | out_of_steps;
        let nan = is_nan(h);
        let back = shadow::passed(h, b.before.0[i], b.step.0[i], b.fall.0[i], noise);
        let goes_back = (back > 0.0) & !out_of_steps;
        let next = if goes_back { back - b.step.0[i] } else { next };
        let keep = |old: f32, new: f32| if goes_back { old } else { new };
        b.t.0[i] = t + next;
        b.before.0[i] = keep(b.before.0[i], h);
        b.step.0[i] = if goes_back { back } else { next };
        b.fall.0[i] = if goes_back { 0.0 } else { slope };
        if !soft(FORM) {
            let new = keep(v, shadow::hard(v, h, noise));
            b.visibility.0[i] = new;
            return !goes_back & (at_end | (new <= 0.0) | nan);
        }
        let new = shadow::seen(h, t, self.size);
        let is_inside = (h < -noise) & !goes_back;
        let claims = (shadow::claims(new, b.last.0[i], v) > 0.0) & !goes_back;
        let claim = |old: f32, new: f32| if claims { new } else { old };
        b.claim_t.0[i] = claim(b.claim_t.0[i], t);
        b.value.0[i] = claim(b.value.0[i], h);
        b.last.0[i] = keep(b.last.0[i], new);
        let is_passed = (!claims | at_end) & !goes_back;
        let has_claim = b.claim_t.0[i] > 0.0;
        let begins = is_passed & has_claim & !out_of_steps & !is_inside;
        begin_check(b, i, begins, at_end);
        b.visibility.0[i] = if is_inside { 0.0 } else { v };
        !goes_back & (is_inside | (at_end & !begins) | nan)
    }
}
