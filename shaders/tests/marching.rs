//! Rays along lines through known fields: where they end, and their number of steps.

use sdfc_shaders::{camera, marching};
use sdfc_trials::random::Random;
use sdfc_vm::vector::V3;

/// The parameters of the rays of a frame.
#[derive(Clone, Copy)]
struct Rays {
    threshold: f32,
    half_pixel: f32,
    relaxation: f32,
    rounding: f32,
    is_raw: f32,
    /// Start and end of the parts of the scene, and the first floor or wall without an end.
    crowd: [f32; 3],
}

/// A scene without parts in the way.
const NO_CROWD: [f32; 3] = [camera::NEVER as f32, 0.0, camera::NEVER as f32];

impl Rays {
    fn with_threshold(threshold: f32) -> Self {
        Self {
            threshold,
            half_pixel: 4.0 * threshold,
            relaxation: marching::DEFAULT_RELAXATION as f32,
            rounding: 1e-6,
            is_raw: 0.0,
            crowd: NO_CROWD,
        }
    }

    /// Marches a field along a line; returns the distance and the number of steps.
    fn march(self, field: impl Fn(f32) -> f32, steps: usize) -> (f32, usize) {
        let (mut t, mut value, mut step, mut trend) = (0.0, 0.0, 0.0, -1.0);
        let (mut t_before, mut value_before) = (0.0, 0.0);
        for n in 1..=steps {
            let next = marching::march_step(
                t,
                value,
                step,
                trend,
                t_before,
                value_before,
                field(t + step),
                n as f32,
                self.threshold,
                self.half_pixel,
                self.relaxation,
                self.rounding,
                self.rounding,
                self.is_raw,
                1e9,
                self.crowd[0],
                self.crowd[1],
                self.crowd[2],
                0.0,
            );
            (t, value, step, trend) = (next.t, next.field, next.step, next.trend);
            (t_before, value_before) = (next.t_before, next.field_before);
            if next.arrived > 0.0 {
                let ends = [(t, value), (t_before, value_before)];
                return (self.root_between(&field, ends), n);
            }
        }
        (t, steps)
    }

    /// Returns the root between two points of which one is inside, as the engines find it.
    fn root_between(self, field: impl Fn(f32) -> f32, ends: [(f32, f32); 2]) -> f32 {
        let [(mut t, mut value), (mut other, mut value_other)] = ends;
        for steps in 0..marching::MAX_SECANT_STEPS {
            let (steps, is_raw) = (steps as f32, self.is_raw);
            let rounding = marching::rounding_at(t, self.rounding);
            if marching::is_settled(t, value, other, value_other, rounding, is_raw) > 0.0 {
                break;
            }
            let guess =
                marching::next_estimate(t, value, other, value_other, rounding, is_raw, steps);
            let best = marching::secant_step(t, value, other, value_other, guess, field(guess));
            (t, value, other, value_other) = (best.t, best.field, best.t_other, best.field_other);
        }
        marching::secant_estimate(t, value, other, value_other)
    }
}

/// Returns the root between two points of which one is inside, for unknown slopes.
fn between(field: impl Fn(f32) -> f32, ends: [(f32, f32); 2]) -> f32 {
    let rays = Rays {
        rounding: 2e-7,
        is_raw: 1.0,
        ..Rays::with_threshold(1e-3)
    };
    rays.root_between(field, ends)
}

/// Marches with default parameters.
fn march(field: impl Fn(f32) -> f32, threshold: f32, steps: usize) -> (f32, usize) {
    Rays::with_threshold(threshold).march(field, steps)
}

#[test]
fn relaxed_steps_never_jump_over_a_surface() {
    let mut numbers = Random::new(7);
    for _ in 0..20_000 {
        // A ray past spheres, seen as the field along it: the first hit must not be missed.
        let sphere = |n: &mut Random| {
            (
                2.0 + 20.0 * n.unit_f32(),
                2.5 * n.unit_f32(),
                0.2 + n.unit_f32(),
            )
        };
        let spheres = [
            sphere(&mut numbers),
            sphere(&mut numbers),
            sphere(&mut numbers),
        ];
        let field = |t: f32| {
            let to =
                |(at, aside, r): (f32, f32, f32)| ((t - at).powi(2) + aside * aside).sqrt() - r;
            spheres.map(to).into_iter().fold(30.0 - t, f32::min)
        };
        let enter = |&(at, aside, r): &(f32, f32, f32)| {
            // Rays that only touch a sphere may or may not stop at it.
            (aside < r - 1e-3).then(|| at - (r * r - aside * aside).sqrt())
        };
        let first = spheres.iter().filter_map(enter).fold(30.0, f32::min);
        let (t, steps) = march(field, 1e-4, 500);
        assert!(t <= first + 1e-3, "{spheres:?}: came to {t} beyond {first}");
        assert!(steps < 500, "{spheres:?}: {steps} steps");
    }
}

#[test]
fn relaxed_steps_are_fewer() {
    // Down onto a plane at an angle of 6°: plain steps shrink by a tenth each.
    let sine = 0.1_f32;
    let (t, steps) = march(|t| 1.0 - t * sine, 1e-4, 1000);
    assert!((t - 10.0).abs() < 2e-3, "{t}");
    assert!(steps < 60, "{steps} steps, 88 without relaxation");
}

#[test]
fn without_relaxation_each_step_is_the_radius() {
    // The field along a ray past a sphere towards a wall, as plain sphere tracing sees it.
    let field = |t: f32| (((t - 3.0).powi(2) + 1.21).sqrt() - 1.0).min(9.0 - t);
    let (mut plain, mut count) = (0.0_f32, 0);
    while field(plain) >= 1e-4 {
        plain += field(plain);
        count += 1;
    }
    let unrelaxed = Rays {
        relaxation: 0.0,
        ..Rays::with_threshold(1e-4)
    };
    let (t, steps) = unrelaxed.march(field, 1000);
    // The last steps are estimates of the root.
    assert!(
        (t - plain).abs() < 2e-4 && (count..count + 4).contains(&steps),
        "{t}, {steps} steps"
    );
    let (_, relaxed) = march(field, 1e-4, 1000);
    assert!(relaxed < steps, "{relaxed} steps, {steps} without");
}

#[test]
fn rays_stop_at_roots_and_not_beside_them() {
    let threshold = 1e-2;
    // Past a wire, nearer to it than the threshold, to a wall.
    let wire = |t: f32| (t - 3.0).hypot(6e-3) - 1e-3;
    let (t, steps) = march(|t| wire(t).min(8.0 - t), threshold, 200);
    assert!((t - 8.0).abs() < 1e-4, "stopped at {t}");
    assert!(steps < 60, "{steps} steps");
    // Through the wire.
    let (t, _) = march(|t| (t - 3.0).abs() - 1e-3, threshold, 200);
    assert!((t - 2.999).abs() < 1e-5, "stopped at {t}");
    // Through sheets far thinner than the threshold, from the front and at an angle of 3°.
    for sine in [1.0_f32, 0.3, 0.05] {
        let sheet = |t: f32| (t - 3.0).abs() * sine - 1e-4;
        let (t, steps) = march(|t| sheet(t).min(80.0 - t), threshold, 200);
        assert!(
            sheet(t).abs() < 2e-4,
            "{sine}: stopped at {t} after {steps}"
        );
    }
    // A field a hundred times as flat as its bound.
    let (t, steps) = march(|t| (3.0 - t) * 0.01, threshold, 600);
    assert!((t - 3.0).abs() < 1e-4, "stopped at {t} after {steps}");
}

#[test]
fn rays_that_all_but_touch_pass_without_creeping() {
    let threshold = 1e-2;
    for above in [1e-3_f32, 3e-4, 1e-4, 1e-5] {
        let sphere = |t: f32| (t - 5.0).hypot(1.0 + above) - 1.0;
        let (t, steps) = march(|t| sphere(t).min(12.0 - t), threshold, 200);
        assert!((t - 12.0).abs() < 1e-4, "{above}: stopped at {t}");
        assert!(steps < 80, "{above}: {steps} steps");
    }
}

#[test]
fn jumps_are_bisected() {
    // Half a unit above zero, and half below from 2.3 on: no step of a distance field ends there.
    let jump = |t: f32| if t < 2.3 { 0.5 } else { -0.5 };
    let threshold = 1e-3;
    let (t, steps) = march(jump, threshold, 100);
    assert!((t - 2.3).abs() <= threshold, "stopped at {t}");
    assert!(steps < 60, "{steps} steps");
    // From far away: secant steps alone would halve a step of 20 too few times.
    let (t, steps) = march(|t| if t < 33.0 { 20.0 } else { -20.0 }, threshold, 1000);
    assert!((t - 33.0).abs() <= threshold, "stopped at {t}");
    assert!(steps < 200, "{steps} steps");
    // The bracket keeps two points with different signs.
    let ends = [2.300_5_f32, 2.299_5].map(|t| (t, jump(t)));
    let t = between(jump, ends);
    assert!((t - 2.3).abs() < 3e-5, "{t}");
}

#[test]
fn secant_steps_find_the_root() {
    let field = |t: f32| 5.0 - (t * t + 1.0).sqrt();
    let root = 24.0_f32.sqrt();
    let t = between(field, [5.0_f32, 4.0].map(|t| (t, field(t))));
    assert!((t - root).abs() < 1e-6, "{t} for {root}");
    // Inside of a fold the field may be so flat that a value there is useless.
    for flat in [1e-1, 1e-3, 1e-5] {
        let fold = |t: f32| (2.3 - t) * if t < 2.3 { 1.0 } else { flat };
        let t = between(fold, [2.300_1_f32, 2.29].map(|t| (t, fold(t))));
        assert!(
            (t - 2.3).abs() < 3e-6,
            "{t} where it falls {flat} times as fast"
        );
    }
    // Before a surface it may be as flat, and almost zero far from it.
    for flat in [1e-1, 1e-3, 1e-5] {
        let fold = |t: f32| (2.3 - t) * if t < 2.3 { flat } else { 1.0 };
        let t = between(fold, [2.31_f32, 2.29].map(|t| (t, fold(t))));
        assert!(
            (t - 2.3).abs() < 3e-6,
            "{t} where it is {flat} times as steep before"
        );
    }
    // Whatever the values, it stays between the two places.
    for (field, other) in [
        (0.25, 0.25),
        (0.0, 0.0),
        (0.1, 0.100_001),
        (f32::NAN, -1.0),
        (1e30, -1e-30),
        (f32::INFINITY, -1.0),
    ] {
        let guess = marching::secant_estimate(1.0, field, 0.5, other);
        assert!((0.5..=1.0).contains(&guess), "{field}, {other}: {guess}");
        for steps in [0.0, 6.0] {
            let next = marching::next_estimate(1.0, field, 0.5, other, 1e-6, 1.0, steps);
            assert!((0.5..=1.0).contains(&next), "{field}, {other}: {next}");
        }
    }
}

/// Before a floor, a field that was divided by a large bound is nearly zero. The root is that of the floor, within less
/// than the depth at which materials are read.
#[test]
fn roots_behind_a_flat_field_are_found() {
    for flat in [1e-4, 1e-6, 6e-9, 1e-20, 0.0] {
        for root in [0.13, 0.5, 0.88_f32] {
            let (start, width) = (74.0, 0.05);
            let root = start + width * root;
            let field = |t: f32| f32::min(flat, (root - t) * 0.045);
            let end = start + width;
            let found = between(field, [(end, field(end)), (start, field(start))]);
            let rounding = marching::rounding_at(root, 2e-7);
            let error = (found - root).abs() / rounding;
            assert!(error < 8.0, "{flat}, {root}: {error}");
        }
    }
}

/// Faces that are flush leave a field about zero without a surface. Rays pass it where it is no farther below
/// zero than rounding.
#[test]
fn values_below_zero_by_rounding_alone_are_passed() {
    let rays = Rays::with_threshold(1e-2);
    for below in [0.0, 1e-7, 1e-6, 3e-6] {
        let flush = |t: f32| ((t - 4.0).abs() - 1.0).max(-below);
        let (t, steps) = rays.march(|t| flush(t).min(8.0 - t), 800);
        assert!((t - 8.0).abs() < 1e-4, "{below}: stopped at {t}");
        assert!(steps < 400, "{below}: {steps} steps");
    }
    // A field farther below zero is a surface.
    let (t, _) = rays.march(|t| ((t - 4.0).abs() - 1.0).max(-1e-5), 800);
    assert!((t - 3.0).abs() < 1e-4, "stopped at {t}");
}

/// Rays past surfaces that they all but touch take steps of a fraction of a pixel, however small their
/// threshold.
#[test]
fn rays_with_small_thresholds_do_not_creep_either() {
    let rays = Rays {
        threshold: 1e-5,
        half_pixel: 1e-2,
        rounding: 1e-8,
        ..Rays::with_threshold(0.0)
    };
    for above in [3e-4_f32, 1e-4, 1e-5, 1e-6] {
        let sphere = |t: f32| (t - 5.0).hypot(1.0 + above) - 1.0;
        let (t, steps) = rays.march(|t| sphere(t).min(12.0 - t), 2000);
        assert!((t - 12.0).abs() < 1e-4, "{above}: stopped at {t}");
        assert!(steps < 210, "{above}: {steps} steps");
    }
}

/// The minimum step of rays that creep for a thousand steps grows, but not beyond half a pixel.
#[test]
fn rays_that_creep_pass_nothing_as_thick_as_a_pixel() {
    let rays = Rays {
        threshold: 1e-5,
        half_pixel: 1e-2,
        rounding: 1e-8,
        ..Rays::with_threshold(0.0)
    };
    // Values below and above those near which roots are estimated.
    for value in [1e-6_f32, 1e-3] {
        for i in 0..20 {
            let face = 3.0 + 0.0123 * i as f32;
            let wall = |t: f32| {
                if (face..face + 0.012).contains(&t) {
                    -1.0
                } else {
                    value
                }
            };
            let (t, steps) = rays.march(wall, 2048);
            assert!((t - face).abs() < 1e-4, "{value}: {t} for {face}");
            assert!(steps > 1024, "{value}: {steps} steps");
        }
    }
}

/// A line that leads many pixels ahead may lead through a wall into a surface behind it.
#[test]
fn far_roots_behind_parts_are_not_followed() {
    // A floor at a grazing angle, and a wall far before the root.
    let (sine, root, wall) = (0.002, 100.0, 55.0);
    let field = |t: f32| ((root - t) * sine).min((t - wall).abs() - 0.5);
    let rays = Rays {
        half_pixel: 0.1,
        ..Rays::with_threshold(0.005)
    };
    let blocked = Rays {
        crowd: [wall - 1.0, wall + 1.0, root],
        ..rays
    };
    let (t, _) = blocked.march(field, 1000);
    assert!((t - wall + 0.5).abs() < 1e-2, "{t}: the wall");
    let (t, free_steps) = blocked.march(|t| (root - t) * sine, 1000);
    assert!((t - root).abs() < 1e-1, "{t}: the floor");
    let behind = Rays {
        crowd: [wall - 1.0, wall + 1.0, root / 4.0],
        ..rays
    };
    let (_, slow_steps) = behind.march(|t| (root - t) * sine, 1000);
    assert!(free_steps < slow_steps, "{free_steps}, {slow_steps}");
}

#[test]
fn lines_that_lead_through_walls_are_not_followed() {
    let mut numbers = Random::new(5);
    let rays = Rays {
        threshold: 1e-3,
        half_pixel: 1e-2,
        ..Rays::with_threshold(0.0)
    };
    let mut wrong = 0;
    for _ in 0..20_000 {
        // Down onto a plane, with a wall before the root, and a solid in which the step ends, not deep.
        let sine = 0.005 + 0.015 * numbers.unit_f32();
        let root = 3.0 + numbers.unit_f32();
        let wall = root - (0.2 + 0.6 * numbers.unit_f32()) * 0.01 / sine;
        let thick = 0.002 + 0.005 * numbers.unit_f32();
        let end = root + 0.028 * rays.threshold / sine;
        let behind = end - (0.5 + 0.4 * numbers.unit_f32()) * rays.threshold;
        let field = |t: f32| {
            let floor = (root - t) * sine;
            floor.min((t - wall).abs() - thick).min(behind - t)
        };
        let first = (wall - thick).min(behind).min(root);
        let (t, _) = rays.march(field, 1000);
        wrong += usize::from((t - first).abs() > 1e-3);
    }
    assert_eq!(wrong, 0, "rays went through walls");
}

/// Estimates land slightly beyond roots, so that rays to curved surfaces end after few steps.
#[test]
fn estimated_roots_take_few_steps() {
    let mut numbers = Random::new(5);
    let rays = Rays {
        half_pixel: 2e-2,
        ..Rays::with_threshold(1e-3)
    };
    let steps = (0..20_000).map(|_| {
        let (at, aside) = (2.0 + numbers.unit_f32(), numbers.unit_f32());
        let sphere = |t: f32| (t - at).hypot(aside) - 1.0;
        rays.march(|t| sphere(t).min(12.0 - t), 2000).1
    });
    let mean = steps.sum::<usize>() as f32 / 20_000.0;
    assert!(mean < 7.1, "{mean} steps in the mean");
}

#[test]
fn far_estimates_of_raw_fields_are_sampled_halfway() {
    let rays = Rays {
        half_pixel: 0.02,
        is_raw: 1.0,
        ..Rays::with_threshold(0.001)
    };
    // Ground that was divided by two hundred, and before it a wall that was divided by ten.
    let ground = |t: f32| (1.3 - t) * 0.005;
    let wall = |t: f32| ((t - 1.18).abs() - 0.02) * 0.1;
    let (t, steps) = rays.march(|t| ground(t).min(wall(t)), 3000);
    assert!((t - 1.16).abs() < 1e-4, "stopped at {t} after {steps}");
}

/// A wall stands on a plate, and its foot lies in the top of it: there the field is zero within the solid,
/// too.
#[test]
fn rays_to_the_foot_of_a_wall_end_on_its_face() {
    let mut numbers = Random::new(11);
    for _ in 0..20_000 {
        let (down, along) = (
            0.02 + 0.6 * numbers.unit_f32(),
            0.3 + 0.6 * numbers.unit_f32(),
        );
        let (face, height) = (
            60.0 + 40.0 * numbers.unit_f32(),
            0.2 * numbers.unit_f32().powi(3),
        );
        let field = |t: f32| {
            let (depth, above) = (along * (t - face), height - down * (t - face));
            let wall = match (depth < 0.0, above < 0.0) {
                (true, true) => depth.hypot(above),
                (true, false) => -depth,
                (false, true) => -above,
                (false, false) => -depth.min(above),
            };
            wall.min(above)
        };
        let rays = Rays {
            threshold: 0.03,
            half_pixel: 0.12,
            rounding: 2e-6,
            ..Rays::with_threshold(0.0)
        };
        let (t, _) = rays.march(field, 400);
        let least = (t - face).abs() * down.min(along);
        assert!(
            least < 4e-4,
            "{t} for {face}, {height} above, {down} down, {along} along"
        );
    }
}

/// Reports where a ray along z arrives, 4e-7 beside the plane x = 0, within which solids begin at z = 1.
/// `is_raw` is 1 for a field with unknown slopes.
fn arrival(field: impl Fn(V3<f32>) -> f32, is_raw: f32) -> Option<f32> {
    let (origin, direction) = (V3::new(4e-7, 0.3, 0.0), V3::new(0.0, 0.0, 1.0));
    let [low, high] = [-10.0, 10.0].map(|v| V3::new(v, v, v));
    let (rounding, half_pixel, t_exit) = (1e-6, 1e-3, 2.0);
    let mut ray = marching::Step {
        t: 0.0,
        field: 0.0,
        step: 0.0,
        trend: -1.0,
        t_before: 0.0,
        field_before: 0.0,
        arrived: 0.0,
    };
    let mut count = 0.0;
    while ray.arrived == 0.0 {
        let (t, step, trend) = (ray.t, ray.step, ray.trend);
        let is_probe =
            marching::takes_probe::<f32>(t, ray.field, step, trend, ray.field_before, rounding);
        let point = marching::sample_point::<f32>(
            origin, direction, t, step, trend, is_probe, low, high, half_pixel, rounding,
        );
        count += 1.0;
        ray = marching::march_step::<f32>(
            t,
            ray.field,
            step,
            trend,
            ray.t_before,
            ray.field_before,
            field(point),
            count,
            half_pixel * 0.05,
            half_pixel,
            marching::DEFAULT_RELAXATION as f32,
            marching::rounding_at::<f32>(t + step, rounding),
            marching::rounding_at::<f32>(t + step, rounding),
            is_raw,
            t_exit,
            camera::NEVER as f32,
            0.0,
            camera::NEVER as f32,
            is_probe,
        );
        if ray.t > t_exit {
            return None;
        }
    }
    let rays = Rays {
        threshold: half_pixel * 0.05,
        half_pixel,
        rounding,
        is_raw: 1.0,
        ..Rays::with_threshold(0.0)
    };
    let ends = [(ray.t, ray.field), (ray.t_before, ray.field_before)];
    Some(rays.root_between(|t| field(origin + direction * t), ends))
}

#[test]
fn rays_stop_in_contacts_and_pass_sheets_and_grazed_faces() {
    let left = |p: V3<f32>| p.x.max(1.0 - p.z);
    let right = |p: V3<f32>| (-p.x).max(1.0 - p.z);
    let mirrored = |p: V3<f32>| right(V3::new(p.x - 8e-7, p.y, p.z));
    for is_raw in [0.0, 1.0] {
        let contact = arrival(|p| left(p).min(right(p)), is_raw);
        let contact = contact.expect("solids that touch are hit");
        assert!((contact - 1.0).abs() < 1e-5, "{contact}");
        assert_eq!(arrival(|p| left(p).max(right(p)), is_raw), None, "a sheet");
        // The plane through both axes is grazed from its outer side.
        assert_eq!(arrival(left, is_raw), None, "a face beside the ray");
        assert_eq!(arrival(mirrored, is_raw), None, "a face on the other side");
    }
    let floor = |p: V3<f32>| (1.0 - p.z).min((1.0 - 3e-5 - p.z).max(5e-7));
    let behind = arrival(floor, 1.0).expect("a solid behind values near zero is hit");
    assert!((behind - 1.0).abs() < 5e-6, "{behind}");
}
