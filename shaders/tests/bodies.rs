//! The functions of pictures, compared with closed forms, standards and physics.

use sdfc_shaders::{camera, marching, normals, occlusion, reflectance, shadow, sky, tone, views};
use sdfc_trials::random::Random;
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::{V2, V3};

/// Returns a direction over the hemisphere around y, distributed evenly by area.
fn upwards(random: &mut Random) -> V3<f32> {
    let (y, turn) = (random.unit_f32(), random.unit_f32() * std::f32::consts::TAU);
    let r = (1.0 - y * y).sqrt();
    V3::new(r * turn.cos(), y, r * turn.sin())
}

#[test]
fn the_picture_goes_from_corner_to_corner() {
    let size = V2 { x: 640.0, y: 360.0 };
    let position =
        |x, y, dx, dy| camera::view_position::<f32>(V2 { x, y }, V2 { x: dx, y: dy }, size);
    let corner = |x: f32, y: f32| {
        let [shift_x, shift_y] = camera::SAMPLE_SHIFT.map(|shift| shift as f32);
        position(x, y, -0.5 - shift_x, -0.5 - shift_y)
    };
    assert_eq!(corner(0.0, 0.0), V2 { x: -1.0, y: 1.0 });
    assert_eq!(corner(640.0, 360.0), V2 { x: 1.0, y: -1.0 });
    assert_eq!(corner(320.0, 180.0), V2 { x: 0.0, y: 0.0 });
}

#[test]
fn rays_cross_boxes_where_they_should() {
    let cross = |o: [f32; 3], d: [f32; 3], far| {
        let [o, d] = [o, d].map(|[x, y, z]| V3::new(x, y, z));
        let corner = V3::new(1.0, 1.0, 1.0);
        camera::intersect_box::<f32>(o, d, -corner, corner, far)
    };
    assert_eq!(
        cross([0.0, 0.0, 5.0], [0.0, 0.0, -1.0], 100.0),
        V2 { x: 4.0, y: 6.0 }
    );
    assert_eq!(
        cross([0.0, 0.0, 5.0], [0.0, 0.0, -1.0], 5.0),
        V2 { x: 4.0, y: 5.0 }
    );
    assert_eq!(
        cross([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], 100.0),
        V2 { x: 0.0, y: 1.0 }
    );
    let beside = cross([2.0, 0.0, 5.0], [0.0, 0.0, -1.0], 100.0);
    assert!(beside.y < beside.x, "{beside:?}");
    let behind = cross([0.0, 0.0, 5.0], [0.0, 0.0, 1.0], 100.0);
    assert!(behind.y < behind.x, "{behind:?}");
    let endless = V3::new(1e18, 1e18, 1e18);
    let (o, d) = (V3::new(3.0, 4.0, 5.0), V3::new(0.6, -0.8, 0.0));
    let full = camera::intersect_box::<f32>(o, d, -endless, endless, 1000.0);
    assert_eq!(full, V2 { x: 0.0, y: 1000.0 });
}

#[test]
fn a_half_space_ends_shadow_rays_as_a_large_box_does() {
    let mut random = Random::new(7);
    let (low, height) = (V3::new(-1e6, -1e6, -1e6), 0.75);
    let high = V3::new(1e6, height, 1e6);
    for _ in 0..2000 {
        let origin = V3::new(random.unit_f32(), random.unit_f32(), random.unit_f32());
        let (direction, size) = (upwards(&mut random), 0.5 * random.unit_f32());
        let light_t = 100.0;
        let expected = shadow::exit_t::<f32>(origin, direction, low, high, light_t, size);
        let up = V3::new(0.0, 1.0, 0.0);
        let end = shadow::half_space_exit_t::<f32>(origin, direction, up, -height, light_t, size);
        let difference = (end.min(light_t) - expected).abs();
        assert!(
            difference <= 1e-3 * expected.abs().max(1.0),
            "{end} {expected}"
        );
    }
}

#[test]
fn rays_leave_half_spaces_where_they_should() {
    // A floor at a height of −1, and a ray from the origin with this rise.
    let exit = |height: f32, rise: f32, extended_far| {
        let run = (1.0 - rise * rise).sqrt();
        let origin = V3::new(3.0, height - 1.0, 0.0);
        let direction = V3::new(run, rise, 0.0);
        let up = V3::new(0.0, 1.0, 0.0);
        camera::half_space_exit::<f32>(origin, direction, up, 1.0, 0.5, 100.0, extended_far)
    };
    assert_eq!(exit(1.0, -0.6, 1e18), 100.0, "falls");
    assert_eq!(exit(1.0, 0.6, 1e18), 0.0, "rises");
    assert_eq!(exit(1.0, 0.0, 1e18), 0.0, "is level");
    let late = exit(1.0, -0.001, 1e18);
    assert!((2200.0..2300.0).contains(&late), "arrives late: {late}");
    let deep = exit(1.0, -0.0105, 1e18);
    assert!(
        (210.0..220.0).contains(&deep),
        "is in what is solid late: {deep}"
    );
    assert_eq!(exit(1.0, -0.001, 100.0), 0.0, "would arrive too late");
    assert_eq!(exit(-0.3, 0.6, 1e18), 100.0, "leaves");
    assert_eq!(exit(-0.3, -0.6, 1e18), 100.0, "goes deeper");
    assert_eq!(exit(-0.7, 0.0, 1e18), -1.0, "stays in what is solid");
    assert_eq!(exit(-0.7, 0.001, 1e18), -1.0, "leaves too late");
    assert_eq!(exit(-0.7, 0.6, 1e18), 100.0, "leaves what is solid");
}

#[test]
fn rays_enter_half_spaces_where_they_should() {
    let entry = |height: f32, rise: f32| {
        let direction = V3::new((1.0 - rise * rise).sqrt(), rise, 0.0);
        let up = V3::new(0.0, 1.0, 0.0);
        camera::half_space_entry::<f32>(V3::new(3.0, height, 0.0), direction, up, 0.0)
    };
    assert_eq!(entry(3.0, -0.6), 5.0, "falls");
    assert_eq!(entry(-3.0, -0.6), 0.0, "starts in it");
    assert!(entry(3.0, 0.6) > 1e20 && entry(3.0, 0.0) > 1e20, "never");
    assert_eq!(camera::free_start::<f32>(7.0, 5.0), 4.5);
    assert_eq!(camera::free_start::<f32>(2.0, 5.0), 2.0);
    assert_eq!(camera::free_start::<f32>(-2.0, 5.0), 0.0);
}

#[test]
fn rays_out_of_steps_are_shown_where_they_approach_a_surface() {
    // A field of 0.1 before, half a pixel of 1, and rays up to 100.
    let shown = |field: f32, trend: f32| {
        marching::accept_at_step_cap::<f32>(10.0, field, trend, 9.0, 0.1, 1.0, 100.0) > 0.0
    };
    assert!(shown(0.09, -0.01), "creeps towards it");
    assert!(shown(0.11, 0.01), "creeps past a crest");
    assert!(!shown(0.1, 0.0), "runs parallel to it");
    assert!(!shown(2.5, 0.0), "is far from it");
}

#[test]
fn slanted_ways_to_a_far_start_are_longer() {
    for approach in [1.0_f32, 1e3, 1e6] {
        for aside in [0.0_f32, 1e-5, 1e-2, 0.5, 3.0] {
            let found = camera::start_excess::<f32>(V3::new(0.6, 0.0, -0.8) * aside, approach);
            let [distance, aside] = [approach, aside].map(f64::from);
            // The difference of two lengths, for which f64 is accurate enough.
            let expected = distance * (1.0 + aside * aside).sqrt() - distance;
            let error = (f64::from(found) - expected).abs();
            assert!(
                error <= 1e-6 * expected + 1e-9 * distance,
                "{found}: {error} error {expected}"
            );
        }
    }
}

#[test]
fn normals_survive_vanishing_gradients() {
    let direction = V3::new(0.0, 0.0, -1.0);
    let facing = |g: [f32; 3]| normals::facing::<f32>(V3::new(g[0], g[1], g[2]), direction, 1.0);
    assert_eq!(facing([0.0; 3]), V3::new(0.0, 0.0, 1.0));
    assert_eq!(facing([0.0, 1e-25, 0.0]), V3::new(0.0, 1.0, 0.0));
    assert_eq!(facing([0.0, -3e20, 0.0]), V3::new(0.0, -1.0, 0.0));
    assert_eq!(facing([f32::NAN, 0.0, 0.0]), V3::new(0.0, 0.0, 1.0));
    assert_eq!(
        normals::facing::<f32>(V3::new(2.0, 0.0, 0.0), direction, -1.0),
        V3::new(-1.0, 0.0, 0.0)
    );
}

#[test]
fn shadows_are_numbers_between_none_and_all() {
    let mut numbers = Random::new(1);
    for _ in 0..200_000 {
        let mut any = |scale: f32| numbers.unit_f32().powi(4) * scale;
        let (h, t, size) = (any(3.0) - 0.1, any(50.0), any(0.5));
        let to_surface = V3::new(any(3.0), any(3.0) - 0.1, any(3.0));
        let ahead = V3::new(1.0, 0.0, 0.0);
        let v = shadow::hard_visibility(1.0, h, 1e-4);
        assert!((0.0..=1.0).contains(&v), "{v} from {h}");
        let v = shadow::visibility_beside::<f32>(
            1.0,
            to_surface,
            -to_surface,
            ahead,
            t,
            size,
            h,
            0.0,
            60.0,
            shadow::HALF_VISIBILITY,
        );
        assert!((-1.0..=1.0).contains(&v), "{v} from {h} {t} {size}");
        for v in [shadow::light_fraction(v), shadow::light_fraction_sized(v)] {
            assert!((0.0..=1.0).contains(&v), "{v}");
        }
        assert!(shadow::stride(h, t, 1e-4, size) >= 1e-4);
    }
}

/// The penumbra of an edge depends on the edge and the ray, not on the position of the candidate. Inside of
/// the solid the visibility is lower by as much as it is higher outside.
#[test]
fn penumbras_of_shadows_do_not_depend_on_the_place_of_a_candidate() {
    let mut numbers = Random::new(5);
    for _ in 0..1000 {
        let [at, aside] = [1.0 + numbers.unit_f32(), 0.05 + 0.5 * numbers.unit_f32()];
        let t = at + aside * (2.0 * numbers.unit_f32() - 1.0);
        let (to_surface, direction) = (V3::new(at - t, aside, 0.0), V3::new(1.0, 0.0, 0.0));
        for side in [1.0, -1.0] {
            let found = shadow::visibility_beside::<f32>(
                1.0,
                to_surface,
                -to_surface,
                direction,
                t,
                1.0,
                side * aside,
                0.0,
                9.0,
                shadow::HALF_VISIBILITY,
            );
            let expected = side * aside / at;
            assert!(
                (found - expected).abs() < 1e-5,
                "{found} for {expected} at {t}"
            );
        }
    }
}

/// A light hangs below a ceiling. The plane of the light meets the ceiling above it, or not at all.
#[test]
fn ceilings_hide_as_much_of_a_light_as_they_cut_off() {
    let (below, size) = (0.1, 0.2);
    // Rays that end at the light, and rests of them on which the nearest point lies beyond its plane.
    for (angle, rests) in [
        (0.0_f32, [0.0, 0.5]),
        (0.3, [0.0, 0.5]),
        (0.9, [0.0, 0.05]),
        (1.4, [0.0, 0.01]),
    ] {
        let direction = V3::new(angle.sin(), angle.cos(), 0.0);
        for rest in rests {
            // From the candidate, the ceiling is higher by the rest of the ray.
            let to_surface = V3::new(0.0, below + rest * angle.cos(), 0.0);
            // Of a light with a size, and of others: a ball whose centre is below the ceiling is seen from below.
            for grazing in [0.0, shadow::HALF_VISIBILITY] {
                let found = shadow::visibility_beside::<f32>(
                    1.0,
                    to_surface,
                    V3::new(0.0, -1.0, 0.0),
                    direction,
                    2.0 - rest,
                    size,
                    1.0,
                    0.0,
                    2.0,
                    grazing,
                );
                let open = (below / angle.sin() / (size * 2.0)).min(1.0);
                let cosine = angle.cos();
                let backed = grazing + (1.0 - grazing) * cosine;
                let expected = open + (1.0 - open) * backed * (cosine / 0.25).min(1.0);
                assert!(
                    (found - expected).abs() < 1e-3,
                    "{found} for {expected} at {angle}, {rest}"
                );
            }
        }
    }
}

/// A ray that leaves a surface is not in it, and rounding alone makes no surface.
#[test]
fn sharp_shadows_begin_below_what_rounding_makes() {
    let noise = 1e-4;
    for (h, seen) in [(1.0, 1.0), (0.5e-4, 1.0), (-0.5e-4, 1.0), (-1.5e-4, 0.0)] {
        assert_eq!(shadow::hard_visibility(1.0, h, noise), seen, "{h}");
    }
}

/// Returns the visible fraction of the sky at the origin, facing along y.
fn open(field: impl Fn(V3<f32>) -> f32, count: u32, pixel: f32) -> f32 {
    let (mut hidden, mut weight) = (0.0, 0.0);
    let seed = V3::new(pixel, 3.0, 0.0);
    for i in 0..count {
        let (i, n) = (i as f32, count as f32);
        let direction = occlusion::hemisphere_direction::<f32>(V3::new(0.0, 1.0, 0.0), i, n, seed);
        assert!((direction.length() - 1.0).abs() < 1e-5 && direction.y >= 0.0);
        let distance = occlusion::hemisphere_distance(i, seed, 1.0);
        let cosine = occlusion::hemisphere_cosine(i, n);
        assert!((direction.y - cosine).abs() < 1e-5);
        let height = distance * cosine;
        hidden += occlusion::hidden_weight(field(direction * distance), height, distance, 1.0);
        weight += cosine;
    }
    occlusion::open_fraction(hidden, weight)
}

#[test]
fn occlusion_of_planes_and_corners() {
    assert_eq!(open(|p| p.y, 64, 0.0), 1.0);
    assert_eq!(open(|_| -1.0, 64, 0.0), 0.0);
    // In the corner of floor and wall half of the sky is hidden.
    let mean = (0..50)
        .map(|pixel| open(|p| p.y.min(p.x), 16, pixel as f32))
        .sum::<f32>()
        / 50.0;
    assert!((0.3..0.6).contains(&mean), "{mean}");
}

#[test]
fn surfaces_send_on_no_more_than_arrives() {
    let mut numbers = Random::new(3);
    let normal = V3::new(0.0, 1.0, 0.0);
    let white = V3::new(1.0, 1.0, 1.0);
    for roughness in [0.35, 0.6, 1.0] {
        for metallic in [0.0, 0.5, 1.0] {
            for slant in [0.05_f32, 0.3, 0.7, 1.0] {
                let to_eye = V3::new((1.0 - slant * slant).sqrt(), slant, 0.0);
                let count = 100_000;
                let mut sum = 0.0_f64;
                for _ in 0..count {
                    let to_light = upwards(&mut numbers);
                    let diffuse = reflectance::diffuse_albedo::<f32>(
                        normal, to_eye, white, roughness, metallic,
                    );
                    let sent = reflectance::reflected::<f32>(
                        normal, to_eye, to_light, white, diffuse, roughness, metallic,
                    );
                    sum += f64::from(sent.y);
                }
                // The hemisphere has an area of 2π.
                let fraction = sum / f64::from(count) * std::f64::consts::TAU;
                assert!(
                    (0.2..1.06).contains(&fraction),
                    "roughness {roughness}, metallic {metallic}, cosine {slant}: {fraction}"
                );
                let diffuse =
                    reflectance::diffuse_albedo::<f32>(normal, to_eye, white, roughness, metallic);
                let sky = reflectance::ambient_light::<f32>(
                    normal, to_eye, white, diffuse, roughness, metallic, white, white, 1.0,
                );
                assert!(sky.x <= 1.03 && sky.x > 0.2, "{sky:?}");
            }
        }
    }
}

#[test]
fn light_takes_the_same_way_back() {
    let mut numbers = Random::new(11);
    let normal = V3::new(0.0, 1.0, 0.0);
    let (albedo, diffuse) = (V3::new(0.8, 0.5, 0.2), V3::new(0.3, 0.2, 0.1));
    for _ in 0..1000 {
        let (a, b) = (upwards(&mut numbers), upwards(&mut numbers));
        if a.y < 0.05 || b.y < 0.05 {
            continue;
        }
        let there = reflectance::reflected::<f32>(normal, a, b, albedo, diffuse, 0.4, 0.3).x / b.y;
        let back = reflectance::reflected::<f32>(normal, b, a, albedo, diffuse, 0.4, 0.3).x / a.y;
        assert!((there - back).abs() <= 1e-3 * there, "{there} {back}");
    }
}

#[test]
fn the_sky_has_its_three_colours() {
    let [up, top, horizon, ground] = [
        [0.0, 1.0, 0.0],
        [0.1, 0.2, 0.8],
        [0.9, 0.8, 0.7],
        [0.2, 0.1, 0.0],
    ]
    .map(|[x, y, z]| V3::new(x, y, z));
    let seen = |d| sky::sky_color::<f32>(d, up, top, horizon, ground, 0.0);
    let close = |a: V3<f32>, b: V3<f32>| (a - b).length() < 1e-5;
    assert!(close(seen(up), top));
    assert!(close(seen(V3::new(1.0, 0.0, 0.0)), horizon));
    assert!(close(seen(-up), ground));
    assert!((sky::fog_opacity(10.0, 0.1_f32) - (1.0 - (-1.0_f32).exp())).abs() < 1e-5);
}

#[test]
fn srgb_is_the_standards() {
    let encode = |c: f32| tone::encode::<f32>(V3::new(c, c, c)).x;
    let numbers = [
        (0.0, 0.0),
        (0.001, 0.01292),
        (0.003_130_8, 0.040_449_9),
        (0.01, 0.099_852_8),
        (0.18, 0.461_356_1),
        (0.5, 0.735_357),
        (1.0, 1.0),
        (7.0, 1.0),
        (-1.0, 0.0),
    ];
    for (linear, encoded) in numbers {
        assert!(
            (encode(linear) - encoded).abs() < 3e-6,
            "{linear}: {} for {encoded}",
            encode(linear)
        );
    }
    // Every byte comes back from its decoding.
    for byte in 0..=255_u32 {
        let e = f64::from(byte) / 255.0;
        let linear = if e <= 0.04045 {
            e / 12.92
        } else {
            ((e + 0.055) / 1.055).powf(2.4)
        };
        assert_eq!(tone::to_byte(encode(linear as f32)), byte as f32);
    }
}

#[test]
fn tone_curves_go_through_their_points() {
    let filmic = |c: f32| tone::filmic::<f32>(V3::new(c, c, c)).y;
    for (light, shown) in [
        (0.0, 0.0),
        (0.18, 0.18),
        (1.0, 0.75),
        (16.0, 1.0),
        (1e6, 1.0),
    ] {
        assert!(
            (filmic(light) - shown).abs() < 1e-4,
            "{light}: {}",
            filmic(light)
        );
    }
    let mut last = -1.0;
    for i in 0..2000 {
        let shown = filmic((i as f32 - 1000.0).exp2().min(1e6));
        assert!(shown >= last);
        last = shown;
    }
    let grey = tone::reinhard::<f32>(V3::new(1.0, 1.0, 1.0));
    assert!((grey.x - 0.5).abs() < 1e-6);
}

#[test]
fn edges_that_bend_along_diagonals_alone_are_uneven() {
    // Around the point a field is the product of two lines, as where two strokes cross.
    let is_uneven = |factor: f32| {
        let at = |x: f32, y: f32| factor * (x + 0.3) * (y + 0.2) + 0.05 * (1.0 - factor) * (x - y);
        let change = V2 {
            x: at(1.0, 0.0) - at(0.0, 0.0),
            y: at(0.0, 1.0) - at(0.0, 0.0),
        };
        views::is_uneven_edge(
            at(0.0, 0.0),
            at(-1.0, 0.0),
            at(1.0, 0.0),
            at(0.0, 1.0),
            at(0.0, -1.0),
            at(-1.0, 1.0),
            at(1.0, 1.0),
            at(-1.0, -1.0),
            at(1.0, -1.0),
            change,
            0.1,
        )
    };
    assert_eq!([is_uneven(1.0), is_uneven(0.0)], [1.0, 0.0]);
}

#[test]
fn false_colours_distinguish_values() {
    assert_eq!(views::heat(0.0_f32), V3::new(0.0, 0.0, 0.0));
    assert_eq!(views::heat(1.0_f32), V3::new(1.0, 1.0, 1.0));
    for a in 0..24 {
        for b in 0..a {
            let gap = views::id_color(a as f32) - views::id_color(b as f32);
            assert!(gap.length() > 0.03, "materials {a} and {b}");
        }
    }
    let line = views::distance_color(0.0_f32, 0.1, 0.001);
    let near = views::distance_color(0.004_f32, 0.1, 0.001);
    assert!(line.x < 0.1 && near.x > 0.8);
}
