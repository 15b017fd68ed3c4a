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
        t, visibility, steps, least, side, rounding, last, claim_t, ends, again,
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
        if soft(FORM) && any(&b.phase) {
            for i in (0..LANES).filter(|&i| b.phase.0[i] > 0.0) {
                let (phase, value) = (b.phase.0[i], b.value.0[i]);
                let offset = offset_of(b, i);
                let at = V3::of(points[0].0[i], points[1].0[i], points[2].0[i]) + offset;
                let limit = shadow::limit(b.claim_t.0[i], self.light.size);
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
            *ended = shared.step(b, i, field, checking[i]);
        }
        if any_checking {
            for i in (0..LANES).filter(|&i| checking[i]) {
                let field = values.0[i] * b.side.0[i];
                ended[i] = shared.check(b, i, field) | is_nan(field);
            }
        }
    }

    fn end(&mut self, item: u32, b: &ShadowLanes, lane: usize) {
        let visibility = b.visibility.0[lane];
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

/// The way from the claim in a lane to the place of its round.
#[inline(always)]
fn offset_of(b: &ShadowLanes, i: usize) -> V3<f32> {
    V3::of(b.offset_x.0[i], b.offset_y.0[i], b.offset_z.0[i])
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
    /// The most evaluations of a ray.
    most_steps: f32,
}

impl<const FORM: u32> Shared<FORM> {
    /// The visibility of a light that is covered.
    const DARK: f32 = if FORM == SIZED { -1.0 } else { 0.0 };

    /// Takes the evaluation of a point on the ray into account, but for lanes that check a claim; tells whether
    /// the ray has ended.
    ///
    /// A claim is checked once the ray has passed the point where it is greatest.
    #[inline(always)]
    fn step(self, b: &mut ShadowLanes, i: usize, h: f32, checking: bool) -> bool {
        let keep = |old: f32, new: f32| if checking { old } else { new };
        let (t, v) = (b.t.0[i], b.visibility.0[i]);
        let noise = marching::noise(b.rounding.0[i], 1.0, 0.0);
        let shortest = b.least.0[i] * shadow::hurry(b.steps.0[i]);
        let next = match FORM {
            PLAIN | SIZED => shadow::short_stride(h, t, shortest, self.size),
            _ => shadow::stride(h, t, shortest, self.size),
        };
        // The last point is the end of the ray itself, wherever the steps before it were.
        let left = b.leave.0[i] - t;
        let left = if left > 0.0 { left } else { 0.0 };
        let next = if next < left { next } else { left };
        let out_of_steps = b.steps.0[i] >= self.most_steps;
        let at_end = (t >= b.leave.0[i]) | out_of_steps;
        let nan = is_nan(h);
        b.t.0[i] = keep(t, t + next);
        if !soft(FORM) {
            let new = shadow::hard(v, h, noise);
            b.visibility.0[i] = new;
            return at_end | (new <= 0.0) | nan;
        }
        let new = shadow::seen(h, t, self.size);
        let is_inside = if FORM == SIZED {
            new <= -1.0
        } else {
            h < -noise
        };
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
        b.visibility.0[i] = if is_inside & !checking { Self::DARK } else { v };
        is_inside | (at_end & !begins) | nan
    }

    /// Takes an evaluation for the check of a claim into account; tells whether the ray has ended. The phases
    /// are those of [`claim`].
    #[inline(always)]
    fn check(self, b: &mut ShadowLanes, i: usize, field: f32) -> bool {
        let (phase, value) = (b.phase.0[i], b.value.0[i]);
        let out_of_steps = b.steps.0[i] >= self.most_steps;
        let at = place_of(b, i);
        let gradient = gradient_of(b, i);
        let limit = shadow::limit(b.claim_t.0[i], self.size);
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
            let (t, v, size) = (b.claim_t.0[i], b.visibility.0[i], self.size);
            let (direction, leave) = (direction_of(b, i), b.leave.0[i]);
            b.visibility.0[i] = shadow::beside::<f32>(v, way, direction, t, size, value, leave);
            let to = shadow::moved::<f32>(way, direction, t, leave, value);
            let moves = (to > 0.0) & (b.again.0[i] == 0.0) & (b.visibility.0[i] > Self::DARK);
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
        b.phase.0[i] = 0.0;
        b.again.0[i] = 0.0;
        b.claim_t.0[i] = shadow::NO_CLAIM;
        out_of_steps | (b.ends.0[i] > 0.0) | (b.visibility.0[i] <= Self::DARK)
    }
}
