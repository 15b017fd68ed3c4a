//! Occluder candidates in known fields: the found surface, its distance, and fields without one.

use sdfc_shaders::candidate;
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;

/// Returns the distance that the probe of a candidate finds, phase by phase as in the engines, with a limit
/// of ten times `distance`.
fn probed_distance(field: impl Fn(V3<f32>) -> f32, candidate_point: V3<f32>, distance: f32) -> f32 {
    let none = V3::splat(0.0);
    let limit = 10.0 * distance;
    let (mut value, mut phase, mut round) = (field(candidate_point), 1.0, 0.0);
    let (mut offset, mut gradient, mut face) = (none, none, none);
    for _ in 0..80 {
        let point = candidate_point + offset;
        let sample =
            candidate::sample_point::<f32>(point, offset, face, phase, value, gradient, limit);
        let sampled = field(sample);
        if phase < 3.5 {
            let tap = candidate::tap_distance::<f32>(value, point, limit);
            gradient = candidate::add_tap::<f32>(gradient, phase, sampled - value, tap);
            phase += 1.0;
            continue;
        }
        let next =
            candidate::next_offset::<f32>(point, offset, face, phase, value, gradient, limit);
        let outcome = candidate::probe_outcome::<f32>(
            point, gradient, round, phase, value, sampled, offset, face, next, limit,
        );
        if outcome > candidate::MIN_PHASE_OUTCOME {
            phase = outcome;
            continue;
        }
        if outcome > 0.0 {
            return candidate::surface_offset::<f32>(offset, next, value, sampled).length();
        }
        if outcome < 0.0 {
            return candidate::NO_SURFACE;
        }
        face = gradient;
        (offset, value, gradient) = (next, candidate::restart_value::<f32>(sampled), none);
        (round, phase) = (round + 1.0, 1.0);
    }
    panic!("not decided after 80 evaluations");
}

fn close(distance: f32, expected: f32) -> bool {
    (distance - expected).abs() <= 0.03 * expected
}

#[test]
fn walls_have_their_true_distance() {
    let normal = V3::new(0.36, 0.48, 0.8);
    for height in [1e-3_f32, 0.1, 3.0] {
        let distance = probed_distance(|p| p.dot(normal), normal * height, height);
        assert!(close(distance, height), "{distance} for {height}");
        // Sheets, also some that are thinner than the overshoot of the probe.
        for thickness in [0.1 * height, 0.01 * height, 1e-4 * height] {
            let sheet = |p: V3<f32>| p.dot(normal).max(-thickness - p.dot(normal));
            let distance = probed_distance(sheet, normal * height, height);
            assert!(
                close(distance, height),
                "{distance} for {height}, {thickness}"
            );
        }
        // A field divided by more than its slope.
        for slope in [0.1_f32, 0.7] {
            let distance = probed_distance(|p| slope * p.dot(normal), normal * height, height);
            assert!(close(distance, height), "{distance} for {height}, {slope}");
        }
    }
}

/// The field of a cut is the distance to the farther face. The edge is where both meet.
#[test]
fn edges_are_farther_than_their_faces() {
    for (x, y) in [(0.3_f32, 0.4_f32), (0.4, 0.3), (0.05, 0.2)] {
        let distance = probed_distance(|p| p.x.max(p.y), V3::new(x, y, 0.0), x.hypot(y));
        assert!(close(distance, x.hypot(y)), "{distance} for {x}, {y}");
    }
}

/// A cutter that ends in the face of what it cuts leaves the field at zero there, without a surface.
#[test]
fn a_field_that_only_touches_zero_has_no_candidate() {
    for height in [1e-3_f32, 0.1, 3.0] {
        let point = V3::new(0.0, height, 0.0);
        let flush = probed_distance(|p| p.y.abs(), point, height);
        assert_eq!(flush, candidate::NO_SURFACE, "{height}");
        // Near zero, there is none either.
        let near = probed_distance(|p| p.y.abs() + 0.02 * height, point, height);
        assert_eq!(near, candidate::NO_SURFACE, "{height}");
        let raw = probed_distance(|p| 0.5 * p.y.abs(), point, height);
        assert_eq!(raw, candidate::NO_SURFACE, "{height}");
    }
}

/// Later probes lead into the surface where rounding left the last one slightly below zero. The first one
/// leads out.
#[test]
fn only_a_candidate_itself_is_in_a_solid() {
    let (point, up) = (V3::new(0.0, 1.0, 0.0), V3::new(0.0, 1.0, 0.0));
    let offset = V3::new(0.5, 0.0, 0.0);
    let later = candidate::next_offset::<f32>(
        point,
        offset,
        V3::splat(0.0),
        4.0,
        candidate::restart_value::<f32>(-1e-7),
        up,
        1.0,
    );
    assert!(later.y < 0.0, "{later:?}");
    let first =
        candidate::next_offset::<f32>(point, V3::splat(0.0), V3::splat(0.0), 4.0, -0.25, up, 1.0);
    assert!(first.y > 0.25, "{first:?}");
}

/// A bore of the radius 19.5 breaks through the top of a block by half a unit, so its wall leads over the gap there.
#[test]
fn the_edge_of_a_gap_is_found_along_both_of_its_faces() {
    let field = |p: V3<f32>| (p.y - 20.0).max(19.5 - p.x.hypot(p.y - 1.0));
    let edge = (19.5_f32 * 19.5 - 19.0 * 19.0).sqrt();
    for (x, y) in [
        (0.1_f32, 20.0),
        (1.0, 20.0),
        (2.0, 20.0),
        (4.0, 20.0),
        (1.0, 21.0),
        (2.0, 22.0),
        (1.0, 19.0),
        (2.0, 18.0),
        (0.5, 17.0),
    ] {
        let expected = (x - edge).hypot(y - 20.0);
        let distance = probed_distance(field, V3::new(x, y, 0.0), 1.0);
        let is_close = (distance - expected).abs() <= 0.06 * expected;
        assert!(is_close, "{distance} instead of {expected} for {x}, {y}");
    }
}

/// The faces of a knife are nearly opposed. Before its edge, the field is far less than the distance.
#[test]
fn the_edge_of_a_knife_has_its_true_distance() {
    for slope in [0.1_f32, 0.2, 0.5, 1.0] {
        let field =
            move |p: V3<f32>| (p.y - slope * p.x).max(-p.y - slope * p.x) / slope.hypot(1.0);
        for (x, y) in [(-0.5_f32, 0.1), (-0.3, 0.0), (-1.0, -0.4), (-0.1, 0.02)] {
            let expected = x.hypot(y);
            let distance = probed_distance(field, V3::new(x, y, 0.0), 0.2 * expected);
            let is_close = (distance - expected).abs() <= 0.08 * expected;
            assert!(is_close, "{distance} for {x}, {y}, {slope}");
        }
    }
}
