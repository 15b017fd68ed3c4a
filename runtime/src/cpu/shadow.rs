//! The stage `shadow`: what lies between surfaces and a light.

use super::lanes::{Walk, is_nan, lanes, stream};
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
        t, radius_before, stride, visibility, steps, least, side, rounding,
        last, claimed, claim_t, value, claim_before, claim_stride,
        phase, beyond, gradient_x, gradient_y, gradient_z,
    }
}

const HARD: u32 = Shadow::Hard as u32;
const PLAIN: u32 = Shadow::Plain as u32;
const IMPROVED: u32 = Shadow::Improved as u32;
const SIZED: u32 = Shadow::Sized as u32;

/// Rays towards a light whose shadow has the form `FORM`, with values checked before they are taken for
/// distances or not: items are places in the tile.
struct ShadowRays<'a, const FORM: u32, const CHECKED: bool> {
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
    (form, checked): (Shadow, bool),
    tile: &mut Tile,
    evaluator: &mut dyn Evaluator,
) -> u64 {
    macro_rules! cast {
        ($form:ident, $checked:literal) => {{
            let mut walk = ShadowRays::<$form, $checked> {
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
        Shadow::Hard => cast!(HARD, false),
        Shadow::Plain if checked => cast!(PLAIN, true),
        Shadow::Plain => cast!(PLAIN, false),
        Shadow::Improved if checked => cast!(IMPROVED, true),
        Shadow::Improved => cast!(IMPROVED, false),
        Shadow::Sized if checked => cast!(SIZED, true),
        Shadow::Sized => cast!(SIZED, false),
    }
}

impl<const FORM: u32, const CHECKED: bool> Walk for ShadowRays<'_, FORM, CHECKED> {
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
        b.radius_before.0[lane] = 0.0;
        b.stride.0[lane] = 0.0;
        b.visibility.0[lane] = 1.0;
        b.steps.0[lane] = 0.0;
        b.least.0[lane] = above * 0.25;
        b.side.0[lane] = side;
        b.rounding.0[lane] = rounding;
        b.phase.0[lane] = 0.0;
        b.value.0[lane] = 0.0;
        b.last.0[lane] = 1.0;
        b.claimed.0[lane] = shadow::NO_CLAIM;
        b.claim_t.0[lane] = 0.0;
        true
    }

    #[inline(always)]
    fn points(&self, b: &ShadowLanes, points: &mut Points) {
        for i in 0..LANES {
            let start = V3::of(b.start_x.0[i], b.start_y.0[i], b.start_z.0[i]);
            let direction = V3::of(b.direction_x.0[i], b.direction_y.0[i], b.direction_z.0[i]);
            let p = if CHECKED {
                let (phase, value) = (b.phase.0[i], b.value.0[i]);
                let t = if phase > 0.0 { b.claim_t.0[i] } else { b.t.0[i] };
                let at = camera::along::<f32>(start, direction, t);
                let apart = claim::apart(value, b.rounding.0[i]);
                claim::place::<f32>(at, phase, value, gradient_of(b, i), apart)
            } else {
                camera::along::<f32>(start, direction, b.t.0[i])
            };
            points[0].0[i] = p.x;
            points[1].0[i] = p.y;
            points[2].0[i] = p.z;
        }
    }

    #[inline(always)]
    fn advance(&self, b: &mut ShadowLanes, values: &Column, ended: &mut [bool; LANES]) {
        for (i, ended) in ended.iter_mut().enumerate() {
            let field = values.0[i] * b.side.0[i];
            let steps = b.steps.0[i] + 1.0;
            b.steps.0[i] = steps;
            let nan = is_nan(field);
            let noise = marching::noise(b.rounding.0[i], 1.0, self.frame.raw);
            let out_of_steps = steps >= self.frame.shadow_steps as f32;
            *ended = if CHECKED && b.phase.0[i] > 0.0 {
                self.check(b, i, field, noise) | out_of_steps
            } else {
                self.step(b, i, field, noise, out_of_steps)
            } | nan;
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

/// What is known of the gradient in a lane.
#[inline(always)]
fn gradient_of(b: &ShadowLanes, i: usize) -> V3<f32> {
    V3::of(b.gradient_x.0[i], b.gradient_y.0[i], b.gradient_z.0[i])
}

#[inline(always)]
fn set_gradient(b: &mut ShadowLanes, i: usize, gradient: V3<f32>) {
    b.gradient_x.0[i] = gradient.x;
    b.gradient_y.0[i] = gradient.y;
    b.gradient_z.0[i] = gradient.z;
}

impl<const FORM: u32, const CHECKED: bool> ShadowRays<'_, FORM, CHECKED> {
    /// What is seen of the light by a point of the ray at `t`, if a surface is at a distance `h` there.
    #[inline(always)]
    fn visible(&self, visibility: f32, h: f32, before: f32, stride: f32, t: f32, noise: f32) -> f32 {
        let size = self.light.size;
        match FORM {
            HARD => shadow::hard(visibility, h, noise),
            PLAIN => shadow::plain(visibility, h, t, size),
            IMPROVED => shadow::improved(visibility, h, before, stride, t, size),
            _ => shadow::sized(visibility, h, t, size),
        }
    }

    /// Takes the evaluation of a point on the ray into account; tells whether the ray has ended.
    ///
    /// A claim is checked once the ray has passed the point where it is greatest.
    #[inline(always)]
    fn step(&self, b: &mut ShadowLanes, i: usize, h: f32, noise: f32, out_of_steps: bool) -> bool {
        let (t, v, stride) = (b.t.0[i], b.visibility.0[i], b.stride.0[i]);
        let before = b.radius_before.0[i];
        let start = if CHECKED { 1.0 } else { v };
        let new = self.visible(start, h, before, stride, t, noise);
        let dark = if FORM == SIZED { -1.0 } else { 0.0 };
        let is_inside = if FORM == SIZED { new <= dark } else { h < -noise };
        let shortest = b.least.0[i] * shadow::hurry(b.steps.0[i]);
        let next = match FORM {
            PLAIN | SIZED => shadow::short_stride(h, t, shortest, self.light.size),
            _ => shadow::stride(h, t, shortest, self.light.size),
        };
        // The last point is the end of the ray itself, wherever the steps before it were.
        let left = b.leave.0[i] - t;
        let left = if left > 0.0 { left } else { 0.0 };
        let next = if next < left { next } else { left };
        b.radius_before.0[i] = h;
        b.stride.0[i] = next;
        b.t.0[i] = t + next;
        let at_end = (t >= b.leave.0[i]) | out_of_steps;
        if !CHECKED {
            b.visibility.0[i] = new;
            return at_end | (new <= dark);
        }
        if is_inside {
            b.visibility.0[i] = dark;
            return true;
        }
        let claims = shadow::claims(new, b.last.0[i], v, h, noise) > 0.0;
        b.last.0[i] = new;
        if claims {
            b.claimed.0[i] = new;
            b.claim_t.0[i] = t;
            b.value.0[i] = h;
            b.claim_before.0[i] = before;
            b.claim_stride.0[i] = stride;
        }
        let is_passed = !claims | at_end;
        if is_passed & (b.claimed.0[i] < shadow::NO_CLAIM) & !out_of_steps {
            b.phase.0[i] = 1.0;
            set_gradient(b, i, V3::of(0.0, 0.0, 0.0));
            b.stride.0[i] = if at_end { -1.0 } else { next };
            return false;
        }
        at_end
    }

    /// Takes an evaluation for the check of a claim into account; tells whether the ray has ended. The phases
    /// are those of [`claim`].
    #[inline(always)]
    fn check(&self, b: &mut ShadowLanes, i: usize, field: f32, noise: f32) -> bool {
        let (phase, value) = (b.phase.0[i], b.value.0[i]);
        if phase < 3.5 {
            let apart = claim::apart(value, b.rounding.0[i]);
            let gradient = claim::gradient::<f32>(gradient_of(b, i), phase, field - value, apart);
            set_gradient(b, i, gradient);
            b.phase.0[i] = phase + 1.0;
            return false;
        }
        if claim::decided(phase, value, field) == 0.0 {
            b.beyond.0[i] = field;
            b.phase.0[i] = claim::LAST_PHASE;
            return false;
        }
        let gradient = gradient_of(b, i);
        let distance = claim::distance::<f32>(value, gradient, phase, field, b.beyond.0[i]);
        if distance < claim::NOTHING {
            let before = b.claim_before.0[i] * (distance / value);
            let (t, stride, v) = (b.claim_t.0[i], b.claim_stride.0[i], b.visibility.0[i]);
            b.visibility.0[i] = self.visible(v, distance, before, stride, t, noise);
        }
        b.phase.0[i] = 0.0;
        b.claimed.0[i] = shadow::NO_CLAIM;
        b.stride.0[i] < 0.0
    }
}
