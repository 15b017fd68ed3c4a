//! The bodies of this crate as WGSL: each is recorded under the name that kernels call it by.

use crate::{beam, camera, claim, marching, normals, occlusion, reflectance, shadow, sky, views};
use sdfc_vm::record::{Function, Recorded, Scalar, Type, record, record_struct};

/// A function that kernels can call: its name, and how to record it.
pub struct Entry {
    /// Its name in WGSL.
    pub name: &'static str,
    record: fn() -> Function,
}

impl Entry {
    /// Records it.
    pub fn function(&self) -> Function {
        (self.record)()
    }
}

/// Functions of one result are recorded as they are; those that give a struct name it, with the
/// fields that are scalars.
macro_rules! functions {
    ($($name:ident = $module:ident::$body:ident($($parameter:ident),*)
        $(-> $structure:ident { $($field:ident),+ })?;)+) => {
        /// All functions, those that others read before them in the order of a picture.
        pub const ALL: &[Entry] = &[$(
            Entry {
                name: stringify!($name),
                record: || functions!(
                    @record $name $module $body ($($parameter),*) $($structure { $($field),+ })?
                ),
            },
        )+];
    };
    (@record $name:ident $module:ident $body:ident ($($parameter:ident),*)) => {
        record(stringify!($name), |s| {
            $module::$body::<Scalar>($(s.parameter(stringify!($parameter))),*)
        })
    };
    (@record $name:ident $module:ident $body:ident ($($parameter:ident),*)
        $structure:ident { $($field:ident),+ }) => {
        record_struct(stringify!($name), stringify!($structure), |s| {
            let result = $module::$body::<Scalar>($(s.parameter(stringify!($parameter))),*);
            vec![$((stringify!($field), Type::Scalar, result.$field.node())),+]
        })
    };
}

functions! {
    place_in_view = camera::place_in_view(pixel, offset, size);
    across = camera::across(place, centre, right, up);
    way_beyond = camera::way_beyond(side, approach);
    unit = camera::unit(v);
    along = camera::along(origin, direction, t);
    half_pixel = camera::half_pixel(t, footprint, growth);
    crossing = camera::crossing(origin, direction, low, high, far);
    meet_plane = camera::meet_plane(origin, direction, centre, forward);

    apart = beam::apart(a, b);
    beam_begin = beam::begin(origin, low, high, spread);
    beam_within = beam::within(p, low, high);
    beam_advance = beam::advance(t, field, spread, widening, threshold);
    beam_goes_on = beam::goes_on(way, half_pixel);

    march_step = marching::march_step(
        t, radius, step, trend, t_before, radius_before, field, count, threshold, half_pixel,
        relaxation, rounding, raw, leave
    ) -> MarchStep { t, radius, step, trend, t_before, radius_before, arrived };
    threshold = marching::threshold(t, half_pixel, cone, rounding);
    rounding_at = marching::rounding_at(t, rounding);
    nearly_arrived = marching::nearly_arrived(
        t, radius, trend, t_before, radius_before, half_pixel, far
    );
    settled = marching::settled(t, field, t_other, field_other, rounding, raw);
    next_guess = marching::next_guess(t, field, t_other, field_other, rounding, raw);
    secant_guess = marching::secant_guess(t, field, t_other, field_other);
    secant_step = marching::secant_step(t, field, t_other, field_other, guess, field_at_guess)
        -> Bracket { t, field, t_other, field_other };

    tap_distance = normals::tap_distance(p, half_pixel, spread);
    facing = normals::facing(gradient, direction, side);
    bumped = normals::bumped(normal, bump);
    lift = normals::lift(p, half_pixel, rounding, sharp);
    outside = normals::outside(rounding);
    inside = normals::inside(rounding);
    is_doubtful = normals::is_doubtful(value, slope, rounding);
    jumps = normals::jumps(value, slope, apart);

    claim_apart = claim::apart(value, at, limit);
    claim_offset = claim::offset(at, offset, phase, value, gradient, limit);
    claim_place = claim::place(at, offset, phase, value, gradient, limit);
    claim_gradient = claim::gradient(gradient, phase, change, apart);
    claim_outcome = claim::outcome(at, gradient, round, phase, value, field, offset, next, limit);
    claim_repeated = claim::repeated(field);
    claim_surface = claim::surface(offset, next, value, field);
    shadow_shortest = shadow::shortest(half_pixel, above);
    shadow_begin = shadow::begin(shortest, sharp);
    shadow_leave = shadow::leave(origin, direction, low, high, reach, size);
    shadow_limit = shadow::limit(t, size);
    shadow_moved = shadow::moved(way, gradient, direction, t, leave, value, round, moves);
    shadow_earlier = shadow::earlier(t, size, moves);
    shadow_is_vain = shadow::is_vain(h, t, size, visibility);
    shadow_aside = shadow::aside(way, gradient, direction);
    occlusion_limit = occlusion::limit(height);

    march_noise = marching::noise(rounding, slope, raw);
    shadow_hard = shadow::hard(visibility, h, noise);
    shadow_hurry = shadow::hurry(count);
    shadow_claims = shadow::claims(visible, last, visibility);
    shadow_seen = shadow::seen(h, t, size);
    shadow_beside = shadow::beside(
        visibility, way, direction, t, size, value, leave
    );
    shadow_slope = shadow::slope(h, last, step);
    shadow_passed = shadow::passed(h, last, step, fall, noise);
    shadow_stride = shadow::stride(h, t, threshold, size);
    shadow_short_stride = shadow::short_stride(h, t, threshold, size);
    shadow_inner_stride = shadow::inner_stride(t, threshold, size);
    shadow_rim = shadow::rim(axis, number);
    shadow_aim = shadow::aim(axis, rim, size);
    shadow_rim_reach = shadow::rim_reach(direction, axis, reach);
    shadow_room = shadow::room(reach, size);
    shadow_fitting = shadow::fitting(room, reach);
    shadow_beside_rim = shadow::beside_rim(
        visibility, way, direction, axis, t, size, leave
    );
    shadow_claimed = shadow::claimed(visibility, number);
    shadow_cleared = shadow::cleared(cleared, h, t, size);
    shadow_arriving = shadow::arriving(visibility);
    shadow_arriving_sized = shadow::arriving_sized(visibility);

    five_distance = occlusion::five_distance(index, reach);
    five_weight = occlusion::five_weight(index);
    many_direction = occlusion::many_direction(normal, index, count, place);
    many_distance = occlusion::many_distance(index, place, reach);
    many_cosine = occlusion::many_cosine(index, count);
    occlusion_hidden = occlusion::hidden(field, height, distance, weight);
    occlusion_claims = occlusion::claims(field, height, slope);
    occlusion_open = occlusion::open(hidden, weight);

    cosine_between = reflectance::cosine(a, b);
    diffuse_share = reflectance::diffuse(normal, to_eye, albedo, roughness, metallic);
    reflected = reflectance::reflected(
        normal, to_eye, to_light, albedo, diffuse, roughness, metallic
    );
    attenuation = reflectance::attenuation(distance);
    mirror = reflectance::mirror(direction, normal);
    ambient_light = reflectance::ambient(
        normal, to_eye, albedo, diffuse, roughness, metallic, around, ahead, open
    );

    sky_color = sky::sky(direction, up, top, horizon, ground, blur);
    sky_on = sky::sky_on(normal, up, top, horizon, ground);
    hidden_by_fog = sky::hidden_by_fog(t, density);

    heat = views::heat(share);
    direction_color = views::direction_color(direction);
    depth_color = views::depth_color(t, range);
    id_color = views::id_color(id);
    distance_color = views::distance_color(field, spacing, pixel);
    coverage = views::coverage(field, pixel);
    edge_between = views::edge_between(
        p, normal, id, p_other, normal_other, id_other, half_pixel, both
    );
    edge_color = views::edge_color(edge, paper);
    paper = views::paper(normal, direction);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recorded_functions() {
        let text: Vec<String> = ALL.iter().map(|entry| entry.function().text).collect();
        insta::assert_snapshot!(text.join("\n"));
    }
}
