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
        phase, value, beyond, gradient_x, gradient_y, gradient_z,
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
        true
    }

    #[inline(always)]
    fn points(&self, b: &ShadowLanes, points: &mut Points) {
        for i in 0..LANES {
            let start = V3::of(b.start_x.0[i], b.start_y.0[i], b.start_z.0[i]);
            let direction = V3::of(b.direction_x.0[i], b.direction_y.0[i], b.direction_z.0[i]);
            let at = camera::along::<f32>(start, direction, b.t.0[i]);
            let p = if CHECKED {
                let value = b.value.0[i];
                let apart = claim::apart(value, b.rounding.0[i]);
                claim::place::<f32>(at, b.phase.0[i], value, gradient_of(b, i), apart)
            } else {
                at
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
            let (mut h, mut distance) = (field, field);
            if CHECKED {
                let size = self.light.size;
                let check = self.check(b, i, field, noise, size);
                if check.goes_on & !nan {
                    *ended = steps >= self.frame.shadow_steps as f32;
                    continue;
                }
                (h, distance) = (check.value, check.distance);
            }
            *ended = self.step(b, i, h, distance, noise) | nan;
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

/// What came of an evaluation where values are checked.
struct Check {
    /// Whether another evaluation is needed.
    goes_on: bool,
    /// The field on the ray.
    value: f32,
    /// How far a surface is.
    distance: f32,
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
    /// Takes an evaluation into account where values are checked; the phases are those of [`claim`].
    #[inline(always)]
    fn check(&self, b: &mut ShadowLanes, i: usize, field: f32, noise: f32, size: f32) -> Check {
        let phase = b.phase.0[i];
        let goes_on = |value: f32| Check {
            goes_on: true,
            value,
            distance: value,
        };
        if phase == 0.0 {
            let claims = shadow::claims(b.visibility.0[i], field, b.t.0[i], size, noise);
            if claims > 0.0 {
                b.value.0[i] = field;
                b.phase.0[i] = 1.0;
                set_gradient(b, i, V3::of(0.0, 0.0, 0.0));
                return goes_on(field);
            }
            // What rounding can make of the field is no surface.
            return Check {
                goes_on: false,
                value: field,
                distance: if field > -noise { claim::NOTHING } else { field },
            };
        }
        let value = b.value.0[i];
        if phase < 3.5 {
            let apart = claim::apart(value, b.rounding.0[i]);
            let gradient = claim::gradient::<f32>(gradient_of(b, i), phase, field - value, apart);
            set_gradient(b, i, gradient);
            b.phase.0[i] = phase + 1.0;
            return goes_on(value);
        }
        if claim::decided(phase, field) == 0.0 {
            b.beyond.0[i] = field;
            b.phase.0[i] = claim::LAST_PHASE;
            return goes_on(value);
        }
        b.phase.0[i] = 0.0;
        let distance =
            claim::distance::<f32>(value, gradient_of(b, i), phase, field, b.beyond.0[i]);
        Check {
            goes_on: false,
            value,
            distance,
        }
    }

    /// Goes on from a point of the ray with the field `h`, where a surface is at a `distance`; tells whether
    /// the ray has ended.
    #[inline(always)]
    fn step(&self, b: &mut ShadowLanes, i: usize, h: f32, distance: f32, noise: f32) -> bool {
        let size = self.light.size;
        let (t, least, steps) = (b.t.0[i], b.least.0[i], b.steps.0[i]);
        let v = b.visibility.0[i];
        let scale = if h > noise { distance / h } else { 1.0 };
        let before = b.radius_before.0[i] * scale;
        let new = match FORM {
            HARD => shadow::hard(v, distance, noise),
            PLAIN => shadow::plain(v, distance, t, size),
            IMPROVED => shadow::improved(v, distance, before, b.stride.0[i], t, size),
            _ => shadow::sized(v, distance, t, size),
        };
        let is_surface = (distance < claim::NOTHING) & !is_nan(distance);
        let new = if is_surface { new } else { v };
        let shortest = least * shadow::hurry(steps);
        let stride = match FORM {
            PLAIN | SIZED => shadow::short_stride(h, t, shortest, size),
            _ => shadow::stride(h, t, shortest, size),
        };
        // The last point is the end of the ray itself, wherever the steps before it were.
        let left = b.leave.0[i] - t;
        let left = if left > 0.0 { left } else { 0.0 };
        let stride = if stride < left { stride } else { left };
        let dark = if FORM == SIZED { -1.0 } else { 0.0 };
        b.visibility.0[i] = new;
        b.radius_before.0[i] = h;
        b.stride.0[i] = stride;
        b.t.0[i] = t + stride;
        (t >= b.leave.0[i]) | (new <= dark) | (steps >= self.frame.shadow_steps as f32)
    }
}
