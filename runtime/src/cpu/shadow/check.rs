//! The check of what a shadow ray's point claims: a surface beside the ray, by the phases of [`claim`].

use super::{
    SIZED, ShadowLanes, Shared, axis_of, direction_of, gradient_of, offset_of, place_of, size_of,
};
use sdfc_shaders::{claim, shadow};
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;

impl<const FORM: u32> Shared<FORM> {
    /// Takes an evaluation for the check of a claim into account. Reports whether the ray gives up, out of steps, and
    /// whether it is done after the check.
    #[inline(always)]
    pub(super) fn check(self, b: &mut ShadowLanes, i: usize, field: f32) -> (bool, bool) {
        let (phase, value) = (b.phase.0[i], b.value.0[i]);
        let out_of_steps = b.steps.0[i] >= self.most_steps;
        let size = size_of::<FORM>(b, i, self.size);
        let (at, offset, gradient) = (place_of(b, i), offset_of(b, i), gradient_of(b, i));
        let limit = shadow::limit(b.claim_t.0[i], size);
        let starts = phase < 0.75;
        let looks = phase > 3.5;
        let measures = !looks & (phase > 0.75);

        let apart = claim::apart::<f32>(value, at, limit);
        let measured = claim::gradient::<f32>(gradient, phase, field - value, apart);
        let next = claim::offset::<f32>(at, offset, phase, value, gradient, limit);
        let outcome = claim::outcome::<f32>(
            at,
            gradient,
            b.round.0[i],
            phase,
            value,
            field,
            offset,
            next,
            limit,
        );
        let repeats = looks & (outcome == 0.0);
        let shortens = looks & (outcome == claim::TOO_FAR);
        let finds = looks & (outcome == 1.0);
        let is_misled = finds & (b.round.0[i] > 0.0);

        let way = claim::surface::<f32>(offset, next, value, field);
        let (t, v) = (b.claim_t.0[i], b.visibility.0[i]);
        let direction = direction_of(b, i);
        // At the light, not where the ray leaves the bounds: light does not depend on these.
        let end = b.reach.0[i];
        let visible = shadow::beside::<f32>(v, way, direction, t, size, value, end);
        let (visible, end) = if FORM == SIZED && b.number.0[i] > 0.0 {
            let axis = axis_of(b, i);
            let end = shadow::rim_reach::<f32>(direction, axis, end);
            let by_rim = shadow::beside_rim::<f32>(v, way, direction, axis, t, size, end);
            (by_rim, end)
        } else {
            (visible, end)
        };
        b.visibility.0[i] = if finds { visible } else { v };
        let (round, moved) = (b.round.0[i], b.moves.0[i]);
        let to = shadow::moved::<f32>(way, gradient, direction, t, end, value, round, moved);
        let aside = shadow::aside::<f32>(way, gradient, direction);
        let is_dark = self.is_dark(b, i);
        let moves = finds & (to > 0.0) & !is_dark;
        // After a roundabout way the next one counts as one, too.
        let bends = moves & is_misled;
        let is_aside = offset.dot(offset) > 0.0;
        let most = shadow::claimed(v, b.number.0[i]);
        let is_vain = starts & !is_aside & (shadow::is_vain::<f32>(field, t, size, most) > 0.0);
        let closes = looks & !repeats & !shortens & !moves;
        let earlier = shadow::earlier(t, size, moved);
        let returns = closes & !finds & (earlier > 0.0);
        let finished = is_vain | (closes & !returns);
        let begins = finished | returns;

        let repeated = claim::repeated::<f32>(field);
        let kept = if repeats { repeated } else { value };
        let begun = if is_aside { repeated } else { field };
        b.value.0[i] = if starts { begun } else { kept };
        let none = V3::splat(0.0);
        let kept = if repeats | moves | begins {
            none
        } else {
            gradient
        };
        b.gradient_x.0[i] = if measures { measured.x } else { kept.x };
        b.gradient_y.0[i] = if measures { measured.y } else { kept.y };
        b.gradient_z.0[i] = if measures { measured.z } else { kept.z };
        let kept = if moves | begins { none } else { offset };
        let kept = if bends { aside } else { kept };
        b.offset_x.0[i] = if repeats { next.x } else { kept.x };
        b.offset_y.0[i] = if repeats { next.y } else { kept.y };
        b.offset_z.0[i] = if repeats { next.z } else { kept.z };
        let ahead = if measures | shortens {
            phase + 1.0
        } else {
            phase
        };
        let ahead = if starts | repeats { 1.0 } else { ahead };
        let ahead = if moves | returns { claim::MOVED } else { ahead };
        b.phase.0[i] = if finished { 0.0 } else { ahead };
        let round = b.round.0[i] + if repeats { 1.0 } else { 0.0 };
        let round = if begins { 0.0 } else { round };
        b.round.0[i] = if bends { 1.0 } else { round };
        let kept = if moves | returns { moved + 1.0 } else { moved };
        b.moves.0[i] = if finished { 0.0 } else { kept };
        let kept = if returns { earlier } else { t };
        let kept = if moves { to } else { kept };
        b.claim_t.0[i] = if finished { shadow::NO_CLAIM } else { kept };
        // Where the field led nowhere, or by a roundabout way, the next point may claim what is farther.
        let strays = closes & (!finds | is_misled);
        b.last.0[i] = if strays { shadow::NO_LAST } else { b.last.0[i] };
        let done = finished & ((b.ends.0[i] > 0.0) | is_dark | out_of_steps);
        (!finished & out_of_steps, done)
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
