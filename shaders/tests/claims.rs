//! Claims of light against fields that are known: what is found, how far it is, and what is nothing.

use sdfc_shaders::claim;
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;

/// The distance that the check of a claim at a point finds, phase after phase as engines go through them, where what
/// matters is ten times as far away as `distance`.
fn checked(field: impl Fn(V3<f32>) -> f32, claim: V3<f32>, distance: f32) -> f32 {
    let none = V3::splat(0.0);
    let limit = 10.0 * distance;
    let (mut value, mut phase, mut round) = (field(claim), 1.0, 0.0);
    let (mut offset, mut gradient) = (none, none);
    for _ in 0..40 {
        let at = claim + offset;
        let place = claim::place::<f32>(at, offset, phase, value, gradient, limit);
        let found = field(place);
        if phase < 3.5 {
            let apart = claim::apart::<f32>(value, at, limit);
            gradient = claim::gradient::<f32>(gradient, phase, found - value, apart);
            phase += 1.0;
            continue;
        }
        let next = claim::offset::<f32>(at, offset, phase, value, gradient, limit);
        let outcome = claim::outcome::<f32>(
            at, gradient, round, phase, value, found, offset, next, limit,
        );
        if outcome == claim::TOO_FAR {
            phase += 1.0;
            continue;
        }
        if outcome > 0.0 {
            return claim::surface::<f32>(offset, next, value, found).length();
        }
        if outcome < 0.0 {
            return claim::NOTHING;
        }
        (offset, value, gradient) = (next, claim::repeated::<f32>(found), none);
        (round, phase) = (round + 1.0, 1.0);
    }
    panic!("not decided after 40 evaluations");
}

fn close(found: f32, expected: f32) -> bool {
    (found - expected).abs() <= 0.03 * expected
}

#[test]
fn walls_are_as_far_as_they_are() {
    let normal = V3::of(0.36, 0.48, 0.8);
    for height in [1e-3_f32, 0.1, 3.0] {
        let found = checked(|p| p.dot(normal), normal * height, height);
        assert!(close(found, height), "{found} for {height}");
        // A sheet that is thicker than the look goes beyond it.
        let sheet = |p: V3<f32>| p.dot(normal).max(-0.1 * height - p.dot(normal));
        let found = checked(sheet, normal * height, height);
        assert!(close(found, height), "{found} for {height}");
        // What was divided by more than its slope.
        for slope in [0.1_f32, 0.7] {
            let found = checked(|p| slope * p.dot(normal), normal * height, height);
            assert!(close(found, height), "{found} for {height}, {slope}");
        }
    }
}

/// The field of a cut is the distance to the farther face. The edge is where both meet.
#[test]
fn edges_are_farther_than_their_faces() {
    for (x, y) in [(0.3_f32, 0.4_f32), (0.4, 0.3), (0.05, 0.2)] {
        let found = checked(|p| p.x.max(p.y), V3::of(x, y, 0.0), x.hypot(y));
        assert!(close(found, x.hypot(y)), "{found} for {x}, {y}");
    }
}

/// A cutter that ends in the face of what it cuts leaves the field at zero there, and nothing else.
#[test]
fn where_a_field_only_touches_zero_there_is_nothing() {
    for height in [1e-3_f32, 0.1, 3.0] {
        let at = V3::of(0.0, height, 0.0);
        let flush = checked(|p| p.y.abs(), at, height);
        assert_eq!(flush, claim::NOTHING, "{height}");
        // Nor where it comes near to zero.
        let near = checked(|p| p.y.abs() + 0.02 * height, at, height);
        assert_eq!(near, claim::NOTHING, "{height}");
        let raw = checked(|p| 0.5 * p.y.abs(), at, height);
        assert_eq!(raw, claim::NOTHING, "{height}");
    }
}

/// Later looks go on into the surface where rounding put the last one a little below zero. The first one leads out.
#[test]
fn only_a_claim_itself_is_in_a_solid() {
    let (at, up) = (V3::of(0.0, 1.0, 0.0), V3::of(0.0, 1.0, 0.0));
    let way = V3::of(0.5, 0.0, 0.0);
    let later = claim::offset::<f32>(at, way, 4.0, claim::repeated::<f32>(-1e-7), up, 1.0);
    assert!(later.y < 0.0, "{later:?}");
    let first = claim::offset::<f32>(at, V3::splat(0.0), 4.0, -0.25, up, 1.0);
    assert!(first.y > 0.25, "{first:?}");
}
