//! The stage `shadow`: what lies between surfaces and a light.

use super::lanes::{Walk, is_nan, lanes, stream};
use super::march::vector;
use super::tile::Tile;
use super::{Column, Evaluator, LANES, Points};
use sdfc_shaders::features::Shadow;
use sdfc_shaders::layout::{Frame, Light, Ray};
use sdfc_shaders::marching::FROM_INSIDE;
use sdfc_shaders::{camera, marching, normals, reflectance, shadow};
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;

lanes! {
    /// Rays towards a light.
    ShadowLanes {
        start_x, start_y, start_z, direction_x, direction_y, direction_z, leave,
        t, radius_before, stride, visibility, steps, least, factor,
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
        let above = normals::lift::<f32>(p, half, marching::rounding_at(seen.t, f.rounding));
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
        b.factor.0[lane] = side;
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
    }

    #[inline(always)]
    fn advance(&self, b: &mut ShadowLanes, values: &Column, ended: &mut [bool; LANES]) {
        let size = self.light.size;
        let most = self.frame.shadow_steps as f32;
        for (i, ended) in ended.iter_mut().enumerate() {
            let (t, least) = (b.t.0[i], b.least.0[i]);
            let h = values.0[i] * b.factor.0[i];
            let v = b.visibility.0[i];
            let new = match FORM {
                HARD => shadow::hard(v, h, least),
                PLAIN => shadow::plain(v, h, t, size),
                IMPROVED => shadow::improved(v, h, b.radius_before.0[i], b.stride.0[i], t, size),
                _ => shadow::sized(v, h, t, size),
            };
            let stride = match FORM {
                PLAIN | SIZED => shadow::short_stride(h, t, least, size),
                _ => shadow::stride(h, t, least, size),
            };
            // The last point is the end of the ray itself, wherever the steps before it were.
            let left = b.leave.0[i] - t;
            let left = if left > 0.0 { left } else { 0.0 };
            let stride = if stride < left { stride } else { left };
            let steps = b.steps.0[i] + 1.0;
            let dark = if FORM == SIZED { -1.0 } else { 0.0 };
            let nan = is_nan(h);
            b.visibility.0[i] = if nan { v } else { new };
            b.radius_before.0[i] = h;
            b.stride.0[i] = stride;
            b.t.0[i] = t + stride;
            b.steps.0[i] = steps;
            *ended = (t >= b.leave.0[i]) | (new <= dark) | (steps >= most) | nan;
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
