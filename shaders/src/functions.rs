//! The functions of this crate as WGSL, each recorded under its name in the kernels.

use crate::{
    beam, camera, candidate, marching, normals, occlusion, reflectance, shadow, sky, views,
};
use sdfc_vm::record::{Recorded, RecordedFunction, RecordedType, Scalar, record, record_struct};

/// A function that kernels can call.
pub struct Entry {
    /// Its name in WGSL.
    pub name: &'static str,
    record: fn() -> RecordedFunction,
}

impl Entry {
    /// Records the function as WGSL.
    pub fn function(&self) -> RecordedFunction {
        (self.record)()
    }
}

/// Declares functions with a single result, or with a struct: its name and its scalar fields.
macro_rules! functions {
    ($($name:ident = $module:ident::$body:ident($($parameter:ident),*)
        $(-> $structure:ident { $($field:ident),+ })?;)+) => {
        /// All functions, each after those that it calls, in the order of the stages.
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
            vec![$((stringify!($field), RecordedType::Scalar, result.$field.node())),+]
        })
    };
}

functions! {
    view_position = camera::view_position(pixel, offset, size);
    interpolate_view = camera::interpolate_view(position, centre, right, up);
    start_excess = camera::start_excess(offset, approach);
    unit = camera::unit(v);
    point_along = camera::point_along(origin, direction, t);
    half_pixel = camera::half_pixel(t, half_pixel_size, growth);
    intersect_box = camera::intersect_box(origin, direction, low, high, far);
    half_space_exit = camera::half_space_exit(
        origin, direction, normal, offset, solid_depth, far, extended_far
    );
    half_space_entry = camera::half_space_entry(origin, direction, normal, offset);
    free_start = camera::free_start(crowd_enter, plane_t);
    intersect_plane = camera::intersect_plane(origin, direction, centre, forward);

    distance_between = beam::distance_between(a, b);
    beam_start = beam::start_t(origin, low, high, spread);
    beam_clamp_to_box = beam::clamp_to_box(p, low, high);
    beam_advance = beam::advance(t, field, spread, widening, threshold);
    beam_continues = beam::should_continue(advance, half_pixel);

    takes_probe = marching::takes_probe(t, field, step, trend, field_before, rounding);
    sample_point = marching::sample_point(
        origin, direction, t, step, trend, is_probe, low, high, half_pixel, rounding
    );
    march_step = marching::march_step(
        t, field, step, trend, t_before, field_before, next_field, count, threshold, half_pixel,
        relaxation, rounding, value_rounding, is_raw, t_exit, crowd_enter, crowd_exit, plane_t, is_probe
    ) -> MarchStep { t, field, step, trend, t_before, field_before, arrived };
    threshold = marching::threshold(t, half_pixel, threshold_fraction, rounding);
    rounding_at = marching::rounding_at(t, rounding);
    rounding_near = marching::rounding_near(point, along, least);
    accept_at_step_cap = marching::accept_at_step_cap(
        t, field, trend, t_before, field_before, half_pixel, far
    );
    first_sample_t = marching::first_sample_t(t, field, factor, min_step, end_t, proved_t);
    later_sample_t = marching::later_sample_t(t, field, factor, min_step, end_t);
    proved_fraction = marching::proved_fraction(t, step, sample_t);
    min_sample_step = marching::min_sample_step(half_pixel, threshold);
    is_settled = marching::is_settled(t, field, t_other, field_other, rounding, is_raw);
    next_estimate = marching::next_estimate(
        t, field, t_other, field_other, rounding, is_raw, count
    );
    secant_estimate = marching::secant_estimate(t, field, t_other, field_other);
    secant_step = marching::secant_step(t, field, t_other, field_other, estimate, field_at_estimate)
        -> Bracket { t, field, t_other, field_other };

    tap_distance = normals::tap_distance(p, half_pixel, spread_half_pixels);
    facing = normals::facing(gradient, direction, side);
    bumped = normals::bumped(normal, bump);
    lift = normals::lift(p, half_pixel, rounding, is_sharp);
    outside_distance = normals::outside_distance(rounding);
    inside_depth = normals::inside_depth(rounding);
    is_doubtful = normals::is_doubtful(value, slope, rounding);
    is_discontinuous = normals::is_discontinuous(value, slope, distance);

    candidate_tap_distance = candidate::tap_distance(value, point, limit);
    candidate_next_offset = candidate::next_offset(point, offset, face, phase, value, gradient, limit);
    candidate_sample_point = candidate::sample_point(point, offset, face, phase, value, gradient, limit);
    candidate_add_tap = candidate::add_tap(gradient, phase, change, distance);
    candidate_outcome = candidate::probe_outcome(point, gradient, round, phase, value, field, offset, face, next, limit);
    candidate_restart_value = candidate::restart_value(field);
    candidate_surface_offset = candidate::surface_offset(offset, next, value, field);
    shadow_min_step = shadow::min_step(half_pixel, height);
    shadow_start = shadow::start_t(min_step, is_sharp);
    shadow_exit = shadow::exit_t(origin, direction, low, high, light_t, size);
    shadow_half_space_exit = shadow::half_space_exit_t(origin, direction, normal, offset, light_t, size);
    shadow_candidate_limit = shadow::candidate_limit(t, size);
    shadow_last_visibility = shadow::last_visibility(sample_visibility, checks);
    shadow_step_to_check = shadow::step_to_check(step, t, next_check_t, checks);
    shadow_is_checked = shadow::is_checked(is_candidate, t, next_check_t, checks);
    shadow_next_check = shadow::next_check_t(t, value, gradient, size, t_end);
    shadow_moved_candidate = shadow::moved_candidate_t(to_surface, gradient, direction, t, t_end, size, value, round, moves, gain);
    shadow_hides_most_at_end = shadow::hides_most_at_end(to_surface, gradient, direction, rest);
    shadow_earlier_candidate = shadow::earlier_candidate_t(t, size, moves, ahead);
    shadow_cannot_darken = shadow::cannot_darken(field, t, size, bound);
    shadow_plane_offset = shadow::plane_offset(to_surface, gradient, direction);
    occlusion_candidate_limit = occlusion::candidate_limit(height);

    sign_margin = marching::sign_margin(rounding, slope, is_raw);
    shadow_hard_visibility = shadow::hard_visibility(visibility, field, margin);
    shadow_late_speedup = shadow::late_speedup(count);
    shadow_is_candidate = shadow::is_candidate(sample_visibility, last_visibility, visibility);
    shadow_sample_visibility = shadow::visibility_at(field, t, size);
    shadow_visibility_beside = shadow::visibility_beside(
        visibility, to_surface, gradient, direction, t, size, value, round, t_end, grazing_visibility
    );
    shadow_slope = shadow::slope(field, field_before, step);
    shadow_step_to_passed_sheet = shadow::step_to_passed_sheet(field, field_before, step, slope_before, margin);
    shadow_stride = shadow::stride(field, t, min_step, size);
    shadow_short_stride = shadow::short_stride(field, t, min_step, size);
    shadow_inner_stride = shadow::inner_stride(t, min_step, size);
    shadow_rim_direction = shadow::rim_direction(axis, number);
    shadow_rim_ray_direction = shadow::rim_ray_direction(axis, rim, size);
    shadow_light_plane = shadow::light_plane_t(direction, axis, light_t);
    shadow_required_room = shadow::required_room(light_t, size);
    shadow_size_in_room = shadow::size_in_room(room, light_t);
    shadow_rim_visibility_beside = shadow::rim_visibility_beside(
        visibility, to_surface, direction, axis, t, size, t_end
    );
    shadow_candidate_bound = shadow::candidate_bound(visibility, number);
    shadow_clear_until = shadow::clear_until(clear_t, field, t, size, checks);
    shadow_light_fraction = shadow::light_fraction(visibility);
    shadow_light_fraction_sized = shadow::light_fraction_sized(visibility);

    five_tap_distance = occlusion::five_tap_distance(index, reach);
    five_tap_weight = occlusion::five_tap_weight(index);
    hemisphere_direction = occlusion::hemisphere_direction(normal, index, count, seed);
    hemisphere_distance = occlusion::hemisphere_distance(index, seed, reach);
    hemisphere_cosine = occlusion::hemisphere_cosine(index, count);
    occlusion_hidden_weight = occlusion::hidden_weight(field, height, distance, weight);
    occlusion_is_candidate = occlusion::is_candidate(field, height, slope);
    occlusion_open_margin = occlusion::open_margin(t, rounding);
    occlusion_open_fraction = occlusion::open_fraction(hidden_sum, weight_sum);

    cosine_between = reflectance::cosine(a, b);
    diffuse_albedo = reflectance::diffuse_albedo(normal, to_camera, albedo, roughness, metallic);
    reflected = reflectance::reflected(
        normal, to_camera, to_light, albedo, diffuse, roughness, metallic
    );
    attenuation = reflectance::attenuation(distance);
    mirror_direction = reflectance::mirror_direction(direction, normal);
    ambient_light = reflectance::ambient_light(
        normal, to_camera, albedo, diffuse, roughness, metallic, mean_sky, mirrored_sky, open_fraction
    );

    sky_color = sky::sky_color(direction, up, top, horizon, ground, blur);
    mean_sky_color = sky::mean_sky_color(normal, up, top, horizon, ground);
    fog_opacity = sky::fog_opacity(t, density);

    heat = views::heat(fraction);
    direction_color = views::direction_color(direction);
    depth_color = views::depth_color(t, range);
    id_color = views::id_color(id);
    distance_color = views::distance_color(field, spacing, pixel_size);
    change_per_pixel = views::change_per_pixel(before, field, after);
    steepest_change = views::steepest_change(
        change, field, upper_left, upper_right, lower_left, lower_right
    );
    pixels_to_edge = views::pixels_to_edge(field, change);
    coverage = views::coverage(pixels, samples);
    is_uneven_edge = views::is_uneven_edge(
        field, left, right, above, below, upper_left, upper_right, lower_left, lower_right, change, pixels
    );
    count_offset = views::count_offset(index, samples);
    edge_between = views::edge_between(
        p, normal, id, p_other, normal_other, id_other, half_pixel, same_coverage
    );
    edge_color = views::edge_color(edge, paper);
    paper_color = views::paper_color(normal, direction);
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
