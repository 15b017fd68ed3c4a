//! The stage `shadow`: what lies between surfaces and a light.

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
        t, visibility, steps, least, side, rounding, before, step, fall, last, claim_t, ends, again,
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
        let to_place = vector(light.place) - p * light.near;
        let direction = camera::unit::<f32>(to_place);
        if reflectance::cosine::<f32>(normal, direction) <= 0.0 {
            self.arriving[item as usize] = 0.0;
            return false;
        }
        let half = camera::half_pixel(seen.t, f.footprint, f.footprint_growth);
        let rounding = marching::rounding_at(seen.t, f.rounding);
        let above = normals::lift::<f32>(p, half, rounding);
        let start = camera::along::<f32>(p, normal, above);
        let length = to_place.length();
        let near = if length < f.far { length } else { f.far };
        let reach = if light.near > 0.0 { near } else { f.far };
        let (low, high) = (vector(f.bounds_min), vector(f.bounds_max));
        let bounds = camera::crossing::<f32>(start, direction, low, high, reach);
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
        b.leave.0[lane] = bounds.y;
        b.axis_x.0[lane] = direction.x;
        b.axis_y.0[lane] = direction.y;
        b.axis_z.0[lane] = direction.z;
        b.reach.0[lane] = reach;
        b.size.0[lane] = self.light.size;
        b.number.0[lane] = 0.0;
        b.best.0[lane] = -1.0;
        b.cleared.0[lane] = above * 0.25;
        b.begun.0[lane] = 0.0;
        b.before.0[lane] = 0.0;
        b.step.0[lane] = 0.0;
        b.fall.0[lane] = 0.0;
        b.t.0[lane] = above * 0.25;
        b.visibility.0[lane] = 1.0;
        b.steps.0[lane] = 0.0;
        b.least.0[lane] = above * 0.25;
        b.side.0[lane] = side;
        b.rounding.0[lane] = rounding;
        b.phase.0[lane] = 0.0;
        b.value.0[lane] = 0.0;
        b.last.0[lane] = 1.0;
        b.claim_t.0[lane] = shadow::NO_CLAIM;
        b.ends.0[lane] = 0.0;
        b.again.0[lane] = 0.0;
        true
    }

    #[inline(always)]
    fn points(&self, b: &ShadowLanes, points: &mut Points) {
        for i in 0..LANES {
            let start = V3::of(b.start_x.0[i], b.start_y.0[i], b.start_z.0[i]);
            let direction = V3::of(b.direction_x.0[i], b.direction_y.0[i], b.direction_z.0[i]);
            let checking = soft(FORM) & (b.phase.0[i] > 0.0);
            let t = if checking { b.claim_t.0[i] } else { b.t.0[i] };
            let p = camera::along::<f32>(start, direction, t);
            points[0].0[i] = p.x;
            points[1].0[i] = p.y;
            points[2].0[i] = p.z;
        }
        if FORM == SIZED && any(&b.number) {
            for i in (0..LANES).filter(|&i| b.size.0[i] == 0.0) {
                let centre = axis_of(b, i) * b.reach.0[i];
                points[0].0[i] += centre.x;
                points[1].0[i] += centre.y;
                points[2].0[i] += centre.z;
            }
        }
        if soft(FORM) && any(&b.phase) {
            for i in (0..LANES).filter(|&i| b.phase.0[i] > 0.0) {
                let (phase, value) = (b.phase.0[i], b.value.0[i]);
                let offset = offset_of(b, i);
                let at = V3::of(points[0].0[i], points[1].0[i], points[2].0[i]) + offset;
                let limit = shadow::limit(b.claim_t.0[i], size_of::<FORM>(b, i, self.light.size));
                let p = claim::place::<f32>(at, offset, phase, value, gradient_of(b, i), limit);
                points[0].0[i] = p.x;
                points[1].0[i] = p.y;
                points[2].0[i] = p.z;
            }
        }
    }

    #[inline(always)]
    fn advance(&self, b: &mut ShadowLanes, values: &Column, ended: &mut [bool; LANES]) {
        // Held here, since a pointer could lead to what is written in the loop.
        let shared = Shared::<FORM> {
            size: self.light.size,
            near: self.light.near,
            raw: self.frame.raw,
            low: vector(self.frame.bounds_min),
            high: vector(self.frame.bounds_max),
            most_steps: self.frame.shadow_steps as f32,
        };
        let mut checking = [false; LANES];
        let any_checking = soft(FORM) && any(&b.phase);
        if any_checking {
            checking = std::array::from_fn(|i| b.phase.0[i] > 0.0);
        }
        for (i, ended) in ended.iter_mut().enumerate() {
            b.steps.0[i] += 1.0;
            let field = values.0[i] * b.side.0[i];
            *ended = match FORM {
                SIZED => !checking[i] && shared.step_sized(b, i, field),
                _ => shared.step(b, i, field, checking[i]),
            };
        }
        if any_checking {
            for i in (0..LANES).filter(|&i| checking[i]) {
                let field = values.0[i] * b.side.0[i];
                ended[i] = shared.check(b, i, field) | is_nan(field);
            }
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

#[inline(always)]
fn set_offset(b: &mut ShadowLanes, i: usize, offset: V3<f32>) {
    b.offset_x.0[i] = offset.x;
    b.offset_y.0[i] = offset.y;
    b.offset_z.0[i] = offset.z;
}

#[inline(always)]
fn set_gradient(b: &mut ShadowLanes, i: usize, gradient: V3<f32>) {
    b.gradient_x.0[i] = gradient.x;
    b.gradient_y.0[i] = gradient.y;
    b.gradient_z.0[i] = gradient.z;
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
    /// Takes the evaluation of a point on the ray into account, but for lanes that check a claim; tells whether
    /// the ray has ended.
    ///
    /// A claim is checked once the ray has passed the point where it is greatest.
    #[inline(always)]
    fn step(self, b: &mut ShadowLanes, i: usize, h: f32, checking: bool) -> bool {
        let keep = |old: f32, new: f32| if checking { old } else { new };
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
        let goes_back = (back > 0.0) & !checking & !out_of_steps;
        let next = if goes_back { back - b.step.0[i] } else { next };
        b.t.0[i] = keep(t, t + next);
        let keep = |old: f32, new: f32| if checking | goes_back { old } else { new };
        b.before.0[i] = keep(b.before.0[i], h);
        b.step.0[i] = if goes_back {
            back
        } else {
            keep(b.step.0[i], next)
        };
        b.fall.0[i] = if goes_back {
            0.0
        } else {
            keep(b.fall.0[i], slope)
        };
        if goes_back {
            return false;
        }
        if !soft(FORM) {
            let new = shadow::hard(v, h, noise);
            b.visibility.0[i] = new;
            return at_end | (new <= 0.0) | nan;
        }
        let new = shadow::seen(h, t, self.size);
        let is_inside = h < -noise;
        let claims = (shadow::claims(new, b.last.0[i], v) > 0.0) & !checking;
        let claim = |old: f32, new: f32| if claims { new } else { old };
        b.claim_t.0[i] = claim(b.claim_t.0[i], t);
        b.value.0[i] = claim(b.value.0[i], h);
        b.last.0[i] = keep(b.last.0[i], new);
        let is_passed = !claims | at_end;
        let has_claim = b.claim_t.0[i] > 0.0;
        let begins = is_passed & has_claim & !out_of_steps & !is_inside & !checking;
        b.phase.0[i] = if begins { 1.0 } else { b.phase.0[i] };
        let zeroed = |old: f32| if begins { 0.0 } else { old };
        b.round.0[i] = zeroed(b.round.0[i]);
        b.offset_x.0[i] = zeroed(b.offset_x.0[i]);
        b.offset_y.0[i] = zeroed(b.offset_y.0[i]);
        b.offset_z.0[i] = zeroed(b.offset_z.0[i]);
        b.gradient_x.0[i] = zeroed(b.gradient_x.0[i]);
        b.gradient_y.0[i] = zeroed(b.gradient_y.0[i]);
        b.gradient_z.0[i] = zeroed(b.gradient_z.0[i]);
        // What comes to its end with a claim ends after the check of it.
        b.ends.0[i] = if begins & at_end { 1.0 } else { b.ends.0[i] };
        b.visibility.0[i] = if is_inside & !checking { 0.0 } else { v };
        is_inside | (at_end & !begins) | nan
    }

    /// Takes the evaluation of a point on a ray towards a light with a size into account; reports whether the last of
    /// its rays has ended.
    #[inline(always)]
    fn step_sized(self, b: &mut ShadowLanes, i: usize, h: f32) -> bool {
        let (t, number, size) = (b.t.0[i], b.number.0[i], b.size.0[i]);
        let out_of_steps = b.steps.0[i] >= self.most_steps;
        if is_nan(h) | (out_of_steps & (number > 0.0)) {
            return true;
        }
        let slope = shadow::slope(h, b.before.0[i], b.step.0[i]);
        let noise = marching::noise(b.rounding.0[i], slope, self.raw);
        let shortest = b.least.0[i] * shadow::hurry(b.steps.0[i] - b.begun.0[i]);
        let is_inside = h < -noise;
        let measures = size == 0.0;
        let next = if is_inside {
            shadow::inner_stride(t, shortest, size)
        } else if measures {
            shadow::stride(h, t, shortest, size)
        } else {
            shadow::short_stride(h, t, shortest, size)
        };
        let left = if b.leave.0[i] > t {
            b.leave.0[i] - t
        } else {
            0.0
        };
        let next = if next < left { next } else { left };
        let at_end = (t >= b.leave.0[i]) | out_of_steps;
        if measures & (is_inside | at_end) {
            let room = if is_inside { t - b.step.0[i] } else { t };
            let fitting = shadow::fitting(room, b.reach.0[i]);
            return fitting <= 0.0 || self.begin_rim(b, i, fitting.min(self.size));
        }
        let back = shadow::passed(h, b.before.0[i], b.step.0[i], b.fall.0[i], noise);
        if (back > 0.0) & (number != shadow::INSIDE) & !out_of_steps {
            b.t.0[i] = t + back - b.step.0[i];
            b.step.0[i] = back;
            b.fall.0[i] = 0.0;
            return false;
        }
        b.t.0[i] = t + next;
        b.before.0[i] = h;
        b.step.0[i] = next;
        b.fall.0[i] = slope;
        if measures {
            return false;
        }
        let seen = shadow::seen(h, t, size);
        if is_inside & (number < 1.0) {
            b.number.0[i] = shadow::INSIDE;
            b.claim_t.0[i] = shadow::NO_CLAIM;
            if (seen <= -1.0) | !at_end {
                return seen <= -1.0;
            }
        }
        if is_inside | (number == shadow::INSIDE) {
            return self.end_ray(b, i, -1.0);
        }
        if number == 0.0 {
            b.cleared.0[i] = shadow::cleared(b.cleared.0[i], h, t, size);
        }
        let claimed = shadow::claimed(b.visibility.0[i], number);
        let claims = shadow::claims(seen, b.last.0[i], claimed) > 0.0;
        b.last.0[i] = seen;
        if claims {
            b.claim_t.0[i] = t;
            b.value.0[i] = h;
        }
        if (!claims | at_end) & (b.claim_t.0[i] > 0.0) & !out_of_steps {
            b.phase.0[i] = 1.0;
            b.round.0[i] = 0.0;
            set_offset(b, i, V3::splat(0.0));
            set_gradient(b, i, V3::splat(0.0));
            b.ends.0[i] = if at_end { 1.0 } else { 0.0 };
            return false;
        }
        at_end && self.end_ray(b, i, b.visibility.0[i])
    }

    /// Ends a ray towards a light with a size: `visibility` is what this ray sees of it. Where the centre is hidden,
    /// rays to the rim follow. Reports whether that was the last one.
    fn end_ray(self, b: &mut ShadowLanes, i: usize, visibility: f32) -> bool {
        let number = b.number.0[i];
        if number == 0.0 && visibility > shadow::HIDDEN {
            return true;
        }
        let best = if number < 1.0 {
            -1.0
        } else {
            b.best.0[i].max(visibility)
        };
        let next = number.floor() + 1.0;
        b.number.0[i] = next;
        b.best.0[i] = best;
        let is_hidden = next > shadow::FIRST_RIM_RAYS && best <= -1.0;
        if is_hidden || best >= 0.0 || next > shadow::RIM_RAYS {
            return true;
        }
        let rim = shadow::rim::<f32>(axis_of(b, i), next);
        set_direction(b, i, rim);
        if self.near == 0.0 {
            return self.begin_rim(b, i, self.size);
        }
        b.size.0[i] = 0.0;
        b.t.0[i] = 0.0;
        b.leave.0[i] = shadow::room(b.reach.0[i], self.size);
        b.begun.0[i] = b.steps.0[i];
        b.before.0[i] = 0.0;
        b.step.0[i] = 0.0;
        b.fall.0[i] = 0.0;
        b.claim_t.0[i] = shadow::NO_CLAIM;
        false
    }

    /// Begins a ray to the rim of a light, which has the `size` on that side. The lane's direction leads there from
    /// the light's centre. It has not ended.
    fn begin_rim(self, b: &mut ShadowLanes, i: usize, size: f32) -> bool {
        let axis = axis_of(b, i);
        let direction = shadow::aim::<f32>(axis, direction_of(b, i), size);
        let reach = shadow::rim_reach::<f32>(direction, axis, b.reach.0[i]);
        let start = V3::of(b.start_x.0[i], b.start_y.0[i], b.start_z.0[i]);
        let bounds = camera::crossing::<f32>(start, direction, self.low, self.high, reach);
        set_direction(b, i, direction);
        b.size.0[i] = size;
        b.leave.0[i] = bounds.y;
        b.begun.0[i] = b.steps.0[i];
        b.t.0[i] = b.cleared.0[i].abs();
        b.before.0[i] = 0.0;
        b.step.0[i] = 0.0;
        b.fall.0[i] = 0.0;
        b.visibility.0[i] = 0.0;
        b.last.0[i] = shadow::NO_LAST;
        b.claim_t.0[i] = shadow::NO_CLAIM;
        b.ends.0[i] = 0.0;
        false
    }

    /// Takes an evaluation for the check of a claim into account; tells whether the ray has ended. The phases
    /// are those of [`claim`].
    #[inline(always)]
    fn check(self, b: &mut ShadowLanes, i: usize, field: f32) -> bool {
        let (phase, value) = (b.phase.0[i], b.value.0[i]);
        let out_of_steps = b.steps.0[i] >= self.most_steps;
        let at = place_of(b, i);
        let gradient = gradient_of(b, i);
        let limit = shadow::limit(b.claim_t.0[i], size_of::<FORM>(b, i, self.size));
        if phase < 0.75 {
            b.value.0[i] = field;
            b.phase.0[i] = 1.0;
            return out_of_steps;
        }
        if phase < 3.5 {
            let apart = claim::apart::<f32>(value, at, limit);
            let gradient = claim::gradient::<f32>(gradient, phase, field - value, apart);
            set_gradient(b, i, gradient);
            b.phase.0[i] = phase + 1.0;
            return out_of_steps;
        }
        let offset = offset_of(b, i);
        let next = claim::offset::<f32>(at, offset, value, gradient, limit);
        let outcome = claim::outcome::<f32>(at, gradient, b.round.0[i], value, field, next, limit);
        if outcome == 0.0 {
            set_offset(b, i, next);
            set_gradient(b, i, V3::splat(0.0));
            b.value.0[i] = field;
            b.round.0[i] += 1.0;
            b.phase.0[i] = 1.0;
            return out_of_steps;
        }
        if outcome > 0.0 {
            let way = claim::surface::<f32>(offset, next, value, field);
            let (t, v) = (b.claim_t.0[i], b.visibility.0[i]);
            let size = size_of::<FORM>(b, i, self.size);
            let (direction, leave) = (direction_of(b, i), b.leave.0[i]);
            b.visibility.0[i] = if FORM == SIZED && b.number.0[i] > 0.0 {
                let axis = axis_of(b, i);
                shadow::beside_rim::<f32>(v, way, direction, axis, t, size, leave)
            } else {
                shadow::beside::<f32>(v, way, direction, t, size, value, leave)
            };
            let to = shadow::moved::<f32>(way, direction, t, leave, value);
            let moves = (to > 0.0) & (b.again.0[i] == 0.0) & !self.is_dark(b, i);
            if moves {
                b.again.0[i] = 1.0;
                b.claim_t.0[i] = to;
                b.phase.0[i] = claim::MOVED;
                b.round.0[i] = 0.0;
                set_offset(b, i, V3::splat(0.0));
                set_gradient(b, i, V3::splat(0.0));
                return out_of_steps;
            }
        }
        // Where nothing is behind a claim, the next point may claim what is farther.
        b.last.0[i] = if outcome > 0.0 {
            b.last.0[i]
        } else {
            shadow::NO_LAST
        };
        b.phase.0[i] = 0.0;
        b.again.0[i] = 0.0;
        b.claim_t.0[i] = shadow::NO_CLAIM;
        if FORM == SIZED {
            let ends = (b.ends.0[i] > 0.0) | self.is_dark(b, i) | out_of_steps;
            return ends && self.end_ray(b, i, b.visibility.0[i]);
        }
        out_of_steps | (b.ends.0[i] > 0.0) | self.is_dark(b, i)
    }

    /// Reports whether no more of the light is seen by the present ray. That to the centre of a light with a size is
    /// followed by others.
    #[inline(always)]
    fn is_dark(self, b: &ShadowLanes, i: usize) -> bool {
        let dark = match FORM {
            SIZED if b.number.0[i] == 0.0 => shadow::HIDDEN,
            SIZED => -1.0,
            _ => 0.0,
        };
        b.visibility.0[i] <= dark
    }
}
