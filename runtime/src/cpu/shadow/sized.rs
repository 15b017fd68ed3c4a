//! Rays towards a light with a size: one to its centre and, where that is hidden, some to its rim.

use super::{
    Column, LANES, ShadowLanes, Shared, any, axis_of, begin_check, direction_of, is_nan,
    set_direction,
};
use sdfc_shaders::{marching, shadow};
use sdfc_vm::vector::V3;

/// The rays of 64 lanes that do not just go on after an evaluation.
#[derive(Default)]
pub(super) struct Ends {
    /// 0 for a ray that goes on, [`ARRIVES`] or [`BEGINS`].
    pub(super) kind: Column,
    /// The visibility by a ray that has ended, or the light's size for one that begins.
    pub(super) amount: Column,
}

/// The kind of a ray that has ended.
pub(super) const ARRIVES: f32 = 1.0;
/// The kind of a ray to the rim that begins, once its way from the light's centre is known.
const BEGINS: f32 = 2.0;

impl<const FORM: u32> Shared<FORM> {
    /// Takes the evaluation of a point on a ray towards a light with a size into account. Reports whether the lane's
    /// last ray has ended, and gives its part of [`Ends`].
    #[inline(always)]
    pub(super) fn step_sized(self, b: &mut ShadowLanes, i: usize, h: f32) -> (bool, f32, f32) {
        let (t, number, size) = (b.t.0[i], b.number.0[i], b.size.0[i]);
        let out_of_steps = b.steps.0[i] >= self.most_steps;
        let over = is_nan(h) | (out_of_steps & (number > 0.0));
        let runs = !over;
        let slope = shadow::slope(h, b.before.0[i], b.step.0[i]);
        let noise = marching::noise(b.rounding.0[i], slope, self.raw);
        let shortest = b.least.0[i] * shadow::hurry(b.steps.0[i] - b.begun.0[i]);
        let is_inside = h < -noise;
        let measures = size == 0.0;
        let free = shadow::stride(h, t, shortest, size);
        let short = shadow::short_stride(h, t, shortest, size);
        let inner = shadow::inner_stride(t, shortest, size);
        let next = if measures { free } else { short };
        let next = if is_inside { inner } else { next };
        let left = b.leave.0[i] - t;
        let left = if left > 0.0 { left } else { 0.0 };
        let next = if next < left { next } else { left };
        let at_end = (t >= b.leave.0[i]) | out_of_steps;

        let measured = runs & measures & (is_inside | at_end);
        let room = if is_inside { t - b.step.0[i] } else { t };
        let fitting = shadow::fitting(room, b.reach.0[i]);
        let begins = measured & (fitting > 0.0);
        let over = over | (measured & !begins);
        let runs = runs & !measured;

        let back = shadow::passed(h, b.before.0[i], b.step.0[i], b.fall.0[i], noise);
        let is_passed = (back > 0.0) & (number != shadow::INSIDE) & !out_of_steps;
        let goes_back = runs & is_passed;
        let runs = runs & !is_passed;
        let ahead = if runs { t + next } else { t };
        b.t.0[i] = if goes_back {
            t + back - b.step.0[i]
        } else {
            ahead
        };
        let step = if goes_back { back } else { b.step.0[i] };
        b.step.0[i] = if runs { next } else { step };
        let fall = if goes_back { 0.0 } else { b.fall.0[i] };
        b.fall.0[i] = if runs { slope } else { fall };
        b.before.0[i] = if runs { h } else { b.before.0[i] };

        let runs = runs & !measures;
        let seen = shadow::seen(h, t, size);
        let enters = runs & is_inside & (number < 1.0);
        let now = if enters { shadow::INSIDE } else { number };
        b.number.0[i] = now;
        let kept = if enters {
            shadow::NO_CLAIM
        } else {
            b.claim_t.0[i]
        };
        let over = over | (enters & (seen <= -1.0));
        let runs = runs & !(enters & ((seen <= -1.0) | !at_end));
        let blocked = runs & (is_inside | (now == shadow::INSIDE));
        let runs = runs & !blocked;

        let cleared = shadow::cleared(b.cleared.0[i], h, t, size);
        let is_central = runs & (number == 0.0);
        b.cleared.0[i] = if is_central { cleared } else { b.cleared.0[i] };
        let claimed = shadow::claimed(b.visibility.0[i], number);
        let claims = runs & (shadow::claims(seen, b.last.0[i], claimed) > 0.0);
        b.last.0[i] = if runs { seen } else { b.last.0[i] };
        let claim_t = if claims { t } else { kept };
        b.claim_t.0[i] = claim_t;
        b.value.0[i] = if claims { h } else { b.value.0[i] };
        let checks = runs & (!claims | at_end) & (claim_t > 0.0) & !out_of_steps;
        begin_check(b, i, checks, at_end);
        let arrives = runs & !checks & at_end;
        let visibility = if blocked { -1.0 } else { b.visibility.0[i] };
        let amount = if begins {
            fitting.min(self.size)
        } else {
            visibility
        };
        let kind = if blocked | arrives { ARRIVES } else { 0.0 };
        (over, if begins { BEGINS } else { kind }, amount)
    }

    /// Begins the next rays of the lanes in which one has ended; sets `ended` where that was the last one.
    pub(super) fn go_on(self, b: &mut ShadowLanes, ends: &Ends, ended: &mut [bool; LANES]) {
        if !any(&ends.kind) {
            return;
        }
        for (i, ended) in ended.iter_mut().enumerate() {
            let amount = ends.amount.0[i];
            if ends.kind.0[i] == ARRIVES {
                *ended |= self.end_ray(b, i, amount);
            } else if ends.kind.0[i] == BEGINS {
                self.begin_rim(b, i, amount);
            }
        }
    }

    /// Ends a ray towards a light with a size: `visibility` is what this ray sees of it. Where the centre is hidden,
    /// rays to the rim follow. Reports whether that was the last one.
    fn end_ray(self, b: &mut ShadowLanes, i: usize, visibility: f32) -> bool {
        let number = b.number.0[i];
        if number == 0.0 && visibility > shadow::HIDDEN {
            return true;
        }
        let is_rim = number >= 1.0;
        let best = b.best.0[i].max(if is_rim { visibility } else { -1.0 });
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
            self.begin_rim(b, i, self.size);
            return false;
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
    /// the light's centre.
    fn begin_rim(self, b: &mut ShadowLanes, i: usize, size: f32) {
        let axis = axis_of(b, i);
        let direction = shadow::aim::<f32>(axis, direction_of(b, i), size);
        let reach = shadow::rim_reach::<f32>(direction, axis, b.reach.0[i]);
        let start = V3::of(b.start_x.0[i], b.start_y.0[i], b.start_z.0[i]);
        let leave = shadow::leave::<f32>(start, direction, self.low, self.high, reach, size);
        set_direction(b, i, direction);
        b.size.0[i] = size;
        b.leave.0[i] = leave;
        b.begun.0[i] = b.steps.0[i];
        b.t.0[i] = b.cleared.0[i].abs();
        b.before.0[i] = 0.0;
        b.step.0[i] = 0.0;
        b.fall.0[i] = 0.0;
        b.visibility.0[i] = 0.0;
        b.last.0[i] = shadow::NO_LAST;
        b.claim_t.0[i] = shadow::NO_CLAIM;
    }
}
