//! The stages `march` and `polish`: where rays end.

use super::lanes::{Walk, is_nan, lanes};
use super::tile::{Camera, camera_ray};
use super::{Column, LANES, Points};
use sdfc_shaders::layout::{Beam, Frame, Ray};
use sdfc_shaders::marching::{self, FROM_INSIDE, SECANT_STEPS, Status};
use sdfc_shaders::{beam, camera};
use sdfc_vm::real::Real;
use sdfc_vm::vector::V3;

lanes! {
    /// Rays under way.
    MarchLanes {
        origin_x, origin_y, origin_z, direction_x, direction_y, direction_z, leave,
        t, radius, step, trend, t_before, radius_before, side, steps, outcome,
    }
}

/// How a step left a ray.
pub(super) mod outcome {
    use sdfc_shaders::marching::{SHOWN, Status};

    pub(in crate::cpu) const UNDER_WAY: f32 = 0.0;
    pub(in crate::cpu) const HIT: f32 = 1.0;
    pub(in crate::cpu) const THROUGH: f32 = 2.0;
    pub(in crate::cpu) const STEP_CAP: f32 = 3.0;
    pub(in crate::cpu) const NEARLY: f32 = 4.0;
    pub(in crate::cpu) const NOT_A_NUMBER: f32 = 5.0;

    /// What a ray with it becomes.
    pub(in crate::cpu) fn status(outcome: f32) -> u32 {
        match outcome {
            HIT => Status::Hit as u32 | SHOWN,
            THROUGH => Status::Miss as u32,
            NEARLY => Status::StepCap as u32 | SHOWN,
            NOT_A_NUMBER => Status::NotANumber as u32,
            _ => Status::StepCap as u32,
        }
    }
}

/// On which side of the surface a ray is that has taken so many steps: one that starts where the field is
/// below zero sees it from inside.
#[inline(always)]
pub(super) fn side_from(steps: f32, t: f32, distance: f32, side: f32) -> f32 {
    let inside = (steps == 0.0) & (t == 0.0) & (distance < 0.0);
    if inside { -1.0 } else { side }
}

/// Takes the step of the ray in a lane of a block with the columns of a march: `$distance` is what the
/// field says where it is, and times `$factor` it has a slope of one. `$decide` says what became of
/// the ray, from the next state and whether it may go on.
macro_rules! step_lane {
    (
        $frame:expr, $b:ident, $i:ident, $distance:expr, $factor:expr,
        |$next:ident, $out:ident| $decide:expr
    ) => {{
        let distance: f32 = $distance;
        let t = $b.t.0[$i] + $b.step.0[$i];
        let steps = $b.steps.0[$i] + 1.0;
        let side = $crate::cpu::march::side_from($b.steps.0[$i], t, distance, $b.side.0[$i]);
        let half = camera::half_pixel(t, $frame.footprint, $frame.footprint_growth);
        let enough = marching::threshold(t, half, $frame.cone, $frame.rounding);
        let $next = marching::march_step(
            $b.t.0[$i],
            $b.radius.0[$i],
            $b.step.0[$i],
            $b.trend.0[$i],
            $b.t_before.0[$i],
            $b.radius_before.0[$i],
            distance * side * $factor,
            steps,
            enough,
            half,
            $frame.relaxation,
            marching::rounding_at(t, $frame.rounding),
            $frame.raw,
            $b.leave.0[$i],
        );
        let near = marching::nearly_arrived(
            $next.t,
            $next.radius,
            $next.trend,
            $next.t_before,
            $next.radius_before,
            half.max(enough),
            $frame.far,
        ) > 0.0;
        let capped = if near {
            outcome::NEARLY
        } else {
            outcome::STEP_CAP
        };
        let $out = if steps >= $frame.steps as f32 {
            capped
        } else {
            outcome::UNDER_WAY
        };
        let out = $decide;
        let out = if is_nan(distance) {
            outcome::NOT_A_NUMBER
        } else {
            out
        };
        $b.t.0[$i] = $next.t;
        $b.radius.0[$i] = $next.radius;
        $b.step.0[$i] = $next.step;
        $b.trend.0[$i] = $next.trend;
        $b.t_before.0[$i] = $next.t_before;
        $b.radius_before.0[$i] = $next.radius_before;
        $b.side.0[$i] = side;
        $b.steps.0[$i] = steps;
        $b.outcome.0[$i] = out;
    }};
}
pub(super) use step_lane;

/// Rays through pixels: items are places in the tile.
pub(super) struct March<'a> {
    pub(super) frame: &'a Frame,
    pub(super) pixels: &'a [[f32; 2]],
    pub(super) rays: &'a mut [Ray],
    /// How far the rays of each block can go, and how many blocks and pixels are in a row.
    pub(super) beams: &'a [Beam],
    pub(super) columns: u32,
    pub(super) width: u32,
}

impl Walk for March<'_> {
    type Block = MarchLanes;

    fn begin(&mut self, item: u32, b: &mut MarchLanes, lane: usize) -> bool {
        let f = self.frame;
        let Camera {
            origin, direction, ..
        } = camera_ray(f, self.pixels[item as usize]);
        let (low, high) = (vector(f.bounds_min), vector(f.bounds_max));
        let bounds = camera::crossing::<f32>(origin, direction, low, high, f.far);
        let [x, y] = [item % self.width, item / self.width].map(|pixel| pixel / beam::SIDE);
        let beam = &self.beams[(y * self.columns + x) as usize];
        let start = Real::max(bounds.x, beam.t);
        let ray = &mut self.rays[item as usize];
        *ray = Ray {
            t: start,
            trend: -1.0,
            t_before: start,
            ..Ray::default()
        };
        if bounds.y < start {
            ray.status = Status::Miss as u32;
            return false;
        }
        b.origin_x.0[lane] = origin.x;
        b.origin_y.0[lane] = origin.y;
        b.origin_z.0[lane] = origin.z;
        b.direction_x.0[lane] = direction.x;
        b.direction_y.0[lane] = direction.y;
        b.direction_z.0[lane] = direction.z;
        b.leave.0[lane] = bounds.y;
        b.t.0[lane] = ray.t;
        b.radius.0[lane] = 0.0;
        b.step.0[lane] = 0.0;
        b.trend.0[lane] = ray.trend;
        b.t_before.0[lane] = ray.t_before;
        b.radius_before.0[lane] = 0.0;
        b.side.0[lane] = 1.0;
        b.steps.0[lane] = 0.0;
        true
    }

    #[inline(always)]
    fn points(&self, b: &MarchLanes, points: &mut Points) {
        for i in 0..LANES {
            let origin = V3::of(b.origin_x.0[i], b.origin_y.0[i], b.origin_z.0[i]);
            let direction = V3::of(b.direction_x.0[i], b.direction_y.0[i], b.direction_z.0[i]);
            let p = camera::along::<f32>(origin, direction, b.t.0[i] + b.step.0[i]);
            points[0].0[i] = p.x;
            points[1].0[i] = p.y;
            points[2].0[i] = p.z;
        }
    }

    #[inline(always)]
    fn advance(&self, b: &mut MarchLanes, values: &Column, ended: &mut [bool; LANES]) {
        let f = self.frame;
        for i in 0..LANES {
            step_lane!(f, b, i, values.0[i], 1.0, |next, out| {
                let out = if next.arrived > 0.0 {
                    outcome::HIT
                } else {
                    out
                };
                if next.t > b.leave.0[i] {
                    outcome::THROUGH
                } else {
                    out
                }
            });
        }
        for (ended, &out) in ended.iter_mut().zip(&b.outcome.0) {
            *ended = out != outcome::UNDER_WAY;
        }
    }

    fn end(&mut self, item: u32, b: &MarchLanes, lane: usize) {
        let status = outcome::status(b.outcome.0[lane]);
        self.rays[item as usize] = Ray {
            t: b.t.0[lane],
            radius: b.radius.0[lane],
            step: b.step.0[lane],
            trend: b.trend.0[lane],
            t_before: b.t_before.0[lane],
            radius_before: b.radius_before.0[lane],
            status: status | if b.side.0[lane] < 0.0 { FROM_INSIDE } else { 0 },
            steps: b.steps.0[lane] as u32,
        };
    }
}

lanes! {
    /// Ends of rays on their way to the root.
    PolishLanes {
        origin_x, origin_y, origin_z, direction_x, direction_y, direction_z,
        t, field, t_other, field_other, guess, side, steps,
    }
}

/// Ends of rays that are moved onto the surface: items are places in the tile.
pub(super) struct Polish<'a> {
    pub(super) frame: &'a Frame,
    pub(super) pixels: &'a [[f32; 2]],
    pub(super) rays: &'a mut [Ray],
}

impl Walk for Polish<'_> {
    type Block = PolishLanes;

    fn begin(&mut self, item: u32, b: &mut PolishLanes, lane: usize) -> bool {
        let f = self.frame;
        let ray = &mut self.rays[item as usize];
        // What ran out of steps has no change of sign to close in on.
        if !matches!(Status::of(ray.status), Status::Hit | Status::Inside) {
            return false;
        }
        let rounding = marching::rounding_at(ray.t, f.rounding);
        let (t, field, other, field_other) = (ray.t, ray.radius, ray.t_before, ray.radius_before);
        if marching::settled(t, field, other, field_other, rounding, f.raw) > 0.0 {
            ray.t = marching::secant_guess(t, field, other, field_other);
            return false;
        }
        let Camera {
            origin, direction, ..
        } = camera_ray(f, self.pixels[item as usize]);
        b.origin_x.0[lane] = origin.x;
        b.origin_y.0[lane] = origin.y;
        b.origin_z.0[lane] = origin.z;
        b.direction_x.0[lane] = direction.x;
        b.direction_y.0[lane] = direction.y;
        b.direction_z.0[lane] = direction.z;
        b.t.0[lane] = ray.t;
        b.field.0[lane] = ray.radius;
        b.t_other.0[lane] = ray.t_before;
        b.field_other.0[lane] = ray.radius_before;
        b.guess.0[lane] = marching::next_guess(t, field, other, field_other, rounding, f.raw);
        b.side.0[lane] = if ray.status & FROM_INSIDE != 0 {
            -1.0
        } else {
            1.0
        };
        b.steps.0[lane] = 0.0;
        true
    }

    #[inline(always)]
    fn points(&self, b: &PolishLanes, points: &mut Points) {
        for i in 0..LANES {
            let origin = V3::of(b.origin_x.0[i], b.origin_y.0[i], b.origin_z.0[i]);
            let direction = V3::of(b.direction_x.0[i], b.direction_y.0[i], b.direction_z.0[i]);
            let p = camera::along::<f32>(origin, direction, b.guess.0[i]);
            points[0].0[i] = p.x;
            points[1].0[i] = p.y;
            points[2].0[i] = p.z;
        }
    }

    #[inline(always)]
    fn advance(&self, b: &mut PolishLanes, values: &Column, ended: &mut [bool; LANES]) {
        for (i, ended) in ended.iter_mut().enumerate() {
            let distance = values.0[i];
            let nan = is_nan(distance);
            let next = marching::secant_step(
                b.t.0[i],
                b.field.0[i],
                b.t_other.0[i],
                b.field_other.0[i],
                b.guess.0[i],
                distance * b.side.0[i],
            );
            // An estimate without a value is not taken.
            let select = |new: f32, old: f32| if nan { old } else { new };
            b.t.0[i] = select(next.t, b.t.0[i]);
            b.field.0[i] = select(next.field, b.field.0[i]);
            b.t_other.0[i] = select(next.t_other, b.t_other.0[i]);
            b.field_other.0[i] = select(next.field_other, b.field_other.0[i]);
            let (t, field) = (b.t.0[i], b.field.0[i]);
            let (other, field_other) = (b.t_other.0[i], b.field_other.0[i]);
            let raw = self.frame.raw;
            let rounding = marching::rounding_at(t, self.frame.rounding);
            let steps = b.steps.0[i] + 1.0;
            *ended = (steps >= SECANT_STEPS as f32)
                | nan
                | (marching::settled(t, field, other, field_other, rounding, raw) > 0.0);
            b.guess.0[i] = if *ended {
                marching::secant_guess(t, field, other, field_other)
            } else {
                marching::next_guess(t, field, other, field_other, rounding, raw)
            };
            b.steps.0[i] = steps;
        }
    }

    fn end(&mut self, item: u32, b: &PolishLanes, lane: usize) {
        let ray = &mut self.rays[item as usize];
        ray.t = b.guess.0[lane];
        ray.steps += b.steps.0[lane] as u32;
    }
}

/// Three numbers as a vector.
pub(super) fn vector([x, y, z]: [f32; 3]) -> V3<f32> {
    V3::of(x, y, z)
}
