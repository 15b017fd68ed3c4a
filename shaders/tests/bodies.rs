//! The functions that pictures are made of, against closed forms, standards and physics.

use sdfc_shaders::{camera, marching, normals, occlusion, reflectance, shadow, sky, tone, views};
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::{V2, V3};

/// Numbers in [0, 1) that are the same in every run.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1_u64 << 24) as f32
    }
    /// A direction over the hemisphere around y, spread evenly by area.
    fn upwards(&mut self) -> V3<f32> {
        let (y, turn) = (self.next(), self.next() * std::f32::consts::TAU);
        let r = (1.0 - y * y).sqrt();
        V3::of(r * turn.cos(), y, r * turn.sin())
    }
}

#[test]
fn the_picture_goes_from_corner_to_corner() {
    let size = V2 { x: 640.0, y: 360.0 };
    let place = |x, y, dx, dy| camera::place_in_view::<f32>(V2 { x, y }, V2 { x: dx, y: dy }, size);
    assert_eq!(place(0.0, 0.0, -0.5, -0.5), V2 { x: -1.0, y: 1.0 });
    assert_eq!(place(639.0, 359.0, 0.5, 0.5), V2 { x: 1.0, y: -1.0 });
    assert_eq!(place(319.0, 179.0, 0.5, 0.5), V2 { x: 0.0, y: 0.0 });
}

#[test]
fn rays_cross_boxes_where_they_should() {
    let cross = |o: [f32; 3], d: [f32; 3], far| {
        let [o, d] = [o, d].map(|[x, y, z]| V3::of(x, y, z));
        let one = V3::of(1.0, 1.0, 1.0);
        camera::crossing::<f32>(o, d, -one, one, far)
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
    let endless = V3::of(1e18, 1e18, 1e18);
    let (o, d) = (V3::of(3.0, 4.0, 5.0), V3::of(0.6, -0.8, 0.0));
    let all = camera::crossing::<f32>(o, d, -endless, endless, 1000.0);
    assert_eq!(all, V2 { x: 0.0, y: 1000.0 });
}

/// Marches a field along a line; gives how far it came and how many steps that took.
fn march(field: impl Fn(f32) -> f32, eps: f32, steps: usize) -> (f32, usize) {
    march_with(marching::RELAXATION as f32, field, eps, steps)
}

/// The same with another weight of the newest slope.
fn march_with(relaxation: f32, field: impl Fn(f32) -> f32, eps: f32, steps: usize) -> (f32, usize) {
    let (mut t, mut radius, mut step, mut trend) = (0.0, 0.0, 0.0, -1.0);
    let (mut t_before, mut radius_before) = (0.0, 0.0);
    for n in 1..=steps {
        let next = marching::march_step(
            t,
            radius,
            step,
            trend,
            t_before,
            radius_before,
            field(t + step),
            n as f32,
            eps,
            4.0 * eps,
            relaxation,
            1e-6,
            0.0,
            1e9,
        );
        (t, radius, step, trend) = (next.t, next.radius, next.step, next.trend);
        (t_before, radius_before) = (next.t_before, next.radius_before);
        if next.arrived > 0.0 {
            let ends = [(t, radius), (t_before, radius_before)];
            return (root_between(&field, ends), n);
        }
    }
    (t, steps)
}

/// The root between two places of which one is inside, as engines look for it where slopes are not known.
fn root_between(field: impl Fn(f32) -> f32, ends: [(f32, f32); 2]) -> f32 {
    let [(mut t, mut value), (mut other, mut value_other)] = ends;
    for _ in 0..marching::SECANT_STEPS {
        let rounding = marching::rounding_at(t, 2e-7);
        if marching::settled(t, value, other, value_other, rounding, 1.0) > 0.0 {
            break;
        }
        let guess = marching::next_guess(t, value, other, value_other, rounding, 1.0);
        let best = marching::secant_step(t, value, other, value_other, guess, field(guess));
        (t, value, other, value_other) = (best.t, best.field, best.t_other, best.field_other);
    }
    marching::secant_guess(t, value, other, value_other)
}

#[test]
fn relaxed_steps_never_jump_over_a_surface() {
    let mut numbers = Numbers(7);
    for _ in 0..20_000 {
        // A ray past two balls, seen as the field along it: the first hit must not be missed.
        let ball = |n: &mut Numbers| (2.0 + 20.0 * n.next(), 2.5 * n.next(), 0.2 + n.next());
        let balls = [ball(&mut numbers), ball(&mut numbers), ball(&mut numbers)];
        let field = |t: f32| {
            let to =
                |(at, aside, r): (f32, f32, f32)| ((t - at).powi(2) + aside * aside).sqrt() - r;
            balls.map(to).into_iter().fold(30.0 - t, f32::min)
        };
        let enter = |&(at, aside, r): &(f32, f32, f32)| {
            // Rays that only touch a ball may or may not stop at it.
            (aside < r - 1e-3).then(|| at - (r * r - aside * aside).sqrt())
        };
        let first = balls.iter().filter_map(enter).fold(30.0, f32::min);
        let (t, steps) = march(field, 1e-4, 500);
        assert!(t <= first + 1e-3, "{balls:?}: came to {t} beyond {first}");
        assert!(steps < 500, "{balls:?}: {steps} steps");
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
    // The field along a ray past a ball towards a wall, as plain sphere tracing sees it.
    let field = |t: f32| (((t - 3.0).powi(2) + 1.21).sqrt() - 1.0).min(9.0 - t);
    let (mut plain, mut count) = (0.0_f32, 0);
    while field(plain) >= 1e-4 {
        plain += field(plain);
        count += 1;
    }
    let (t, steps) = march_with(0.0, field, 1e-4, 1000);
    // The last steps are guesses at the root.
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
        let ball = |t: f32| (t - 5.0).hypot(1.0 + above) - 1.0;
        let (t, steps) = march(|t| ball(t).min(12.0 - t), threshold, 200);
        assert!((t - 12.0).abs() < 1e-4, "{above}: stopped at {t}");
        assert!(steps < 80, "{above}: {steps} steps");
    }
}

#[test]
fn jumps_are_closed_in_on() {
    // Half a unit above zero, and half below from 2.3 on: no step of a distance ends in there.
    let jump = |t: f32| if t < 2.3 { 0.5 } else { -0.5 };
    let threshold = 1e-3;
    let (t, steps) = march(jump, threshold, 100);
    assert!((t - 2.3).abs() <= threshold, "stopped at {t}");
    assert!(steps < 60, "{steps} steps");
    // And on: of two points with different signs, those between which it lies are kept.
    let ends = [2.300_5_f32, 2.299_5].map(|t| (t, jump(t)));
    let t = root_between(jump, ends);
    assert!((t - 2.3).abs() < 3e-5, "{t}");
}

#[test]
fn secant_steps_find_the_root() {
    let field = |t: f32| 5.0 - (t * t + 1.0).sqrt();
    let root = 24.0_f32.sqrt();
    let t = root_between(field, [5.0_f32, 4.0].map(|t| (t, field(t))));
    assert!((t - root).abs() < 1e-6, "{t} for {root}");
    // Inside of a fold the field may be so flat that a value there tells nothing.
    for flat in [1e-1, 1e-3, 1e-5] {
        let fold = |t: f32| (2.3 - t) * if t < 2.3 { 1.0 } else { flat };
        let t = root_between(fold, [2.300_1_f32, 2.29].map(|t| (t, fold(t))));
        assert!(
            (t - 2.3).abs() < 3e-6,
            "{t} where it falls {flat} times as fast"
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
        let guess = marching::secant_guess(1.0, field, 0.5, other);
        assert!((0.5..=1.0).contains(&guess), "{field}, {other}: {guess}");
        let next = marching::next_guess(1.0, field, 0.5, other, 1e-6, 1.0);
        assert!((0.5..=1.0).contains(&next), "{field}, {other}: {next}");
    }
}

#[test]
fn normals_survive_vanishing_gradients() {
    let direction = V3::of(0.0, 0.0, -1.0);
    let facing = |g: [f32; 3]| normals::facing::<f32>(V3::of(g[0], g[1], g[2]), direction, 1.0);
    assert_eq!(facing([0.0; 3]), V3::of(0.0, 0.0, 1.0));
    assert_eq!(facing([0.0, 1e-25, 0.0]), V3::of(0.0, 1.0, 0.0));
    assert_eq!(facing([0.0, -3e20, 0.0]), V3::of(0.0, -1.0, 0.0));
    assert_eq!(facing([f32::NAN, 0.0, 0.0]), V3::of(0.0, 0.0, 1.0));
    assert_eq!(
        normals::facing::<f32>(V3::of(2.0, 0.0, 0.0), direction, -1.0),
        V3::of(-1.0, 0.0, 0.0)
    );
}

#[test]
fn shadows_are_numbers_between_none_and_all() {
    let mut numbers = Numbers(1);
    for _ in 0..200_000 {
        let mut any = |scale: f32| numbers.next().powi(4) * scale;
        let (h, before, stride, t, size) =
            (any(3.0) - 0.1, any(3.0), any(3.0), any(50.0), any(0.5));
        let all = [
            shadow::hard(1.0, h, 1e-4),
            shadow::plain(1.0, h, t, size),
            shadow::improved(1.0, h, before, stride, t, size),
        ];
        for v in all {
            assert!(
                (0.0..=1.0).contains(&v),
                "{v} from {h} {before} {stride} {t} {size}"
            );
        }
        let v = shadow::sized(1.0, h, t, size);
        assert!((-1.0..=1.0).contains(&v), "{v}");
        for v in [shadow::arriving(all[2]), shadow::arriving_sized(v)] {
            assert!((0.0..=1.0).contains(&v), "{v}");
        }
        assert!(shadow::stride(h, t, 1e-4, size) >= 1e-4);
    }
}

#[test]
fn the_improved_shadow_finds_the_nearest_miss() {
    // A ray along x past the edge of a half plane at x = 2, 0.3 away: the steps fall where they
    // will, and yet the estimate is the true ratio.
    let (size, edge) = (0.5_f32, [2.0_f32, 0.3]);
    let true_ratio = 0.3 / (size * 2.0);
    let field = |t: f32| ((t - edge[0]).powi(2) + edge[1] * edge[1]).sqrt();
    let (mut t, mut v, mut before, mut stride) = (0.05, 1.0_f32, 0.0, 0.0);
    let mut plain = 1.0_f32;
    while t < 5.0 {
        let h = field(t);
        v = shadow::improved(v, h, before, stride, t, size);
        plain = shadow::plain(plain, h, t, size);
        stride = shadow::stride(h, t, 1e-4, 0.0);
        before = h;
        t += stride;
    }
    assert!(
        (v - true_ratio).abs() < 0.06,
        "{v} for {true_ratio}; the plain form gives {plain}"
    );
    assert!((v - true_ratio).abs() < (plain - true_ratio).abs());
}

/// What is seen of the sky at the origin, facing along y.
fn open(field: impl Fn(V3<f32>) -> f32, count: u32, pixel: f32) -> f32 {
    let (mut hidden, mut weight) = (0.0, 0.0);
    let place = V3::of(pixel, 3.0, 0.0);
    for i in 0..count {
        let (i, n) = (i as f32, count as f32);
        let direction = occlusion::many_direction::<f32>(V3::of(0.0, 1.0, 0.0), i, n, place);
        assert!((direction.length() - 1.0).abs() < 1e-5 && direction.y >= 0.0);
        let distance = occlusion::many_distance(i, place, 1.0);
        let cosine = occlusion::many_cosine(i, n);
        assert!((direction.y - cosine).abs() < 1e-5);
        let height = distance * cosine;
        hidden += occlusion::hidden(field(direction * distance), height, distance, 1.0);
        weight += cosine;
    }
    occlusion::open(hidden, weight)
}

#[test]
fn occlusion_of_known_places() {
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
    let mut numbers = Numbers(3);
    let normal = V3::of(0.0, 1.0, 0.0);
    let white = V3::of(1.0, 1.0, 1.0);
    for roughness in [0.35, 0.6, 1.0] {
        for metallic in [0.0, 0.5, 1.0] {
            for slant in [0.05_f32, 0.3, 0.7, 1.0] {
                let to_eye = V3::of((1.0 - slant * slant).sqrt(), slant, 0.0);
                let count = 100_000;
                let mut sum = 0.0_f64;
                for _ in 0..count {
                    let to_light = numbers.upwards();
                    let diffuse =
                        reflectance::diffuse::<f32>(normal, to_eye, white, roughness, metallic);
                    let sent = reflectance::reflected::<f32>(
                        normal, to_eye, to_light, white, diffuse, roughness, metallic,
                    );
                    sum += f64::from(sent.y);
                }
                // The hemisphere has an area of 2π.
                let share = sum / f64::from(count) * std::f64::consts::TAU;
                assert!(
                    (0.2..1.06).contains(&share),
                    "roughness {roughness}, metallic {metallic}, cosine {slant}: {share}"
                );
                let diffuse =
                    reflectance::diffuse::<f32>(normal, to_eye, white, roughness, metallic);
                let sky = reflectance::ambient::<f32>(
                    normal, to_eye, white, diffuse, roughness, metallic, white, white, 1.0,
                );
                assert!(sky.x <= 1.03 && sky.x > 0.2, "{sky:?}");
            }
        }
    }
}

#[test]
fn light_takes_the_same_way_back() {
    let mut numbers = Numbers(11);
    let normal = V3::of(0.0, 1.0, 0.0);
    let (albedo, diffuse) = (V3::of(0.8, 0.5, 0.2), V3::of(0.3, 0.2, 0.1));
    for _ in 0..1000 {
        let (a, b) = (numbers.upwards(), numbers.upwards());
        if a.y < 0.05 || b.y < 0.05 {
            continue;
        }
        let there = reflectance::reflected::<f32>(normal, a, b, albedo, diffuse, 0.4, 0.3).x / b.y;
        let back = reflectance::reflected::<f32>(normal, b, a, albedo, diffuse, 0.4, 0.3).x / a.y;
        assert!((there - back).abs() <= 1e-3 * there, "{there} {back}");
    }
}

#[test]
fn the_sky_is_what_its_colours_say() {
    let [up, top, horizon, ground] = [
        [0.0, 1.0, 0.0],
        [0.1, 0.2, 0.8],
        [0.9, 0.8, 0.7],
        [0.2, 0.1, 0.0],
    ]
    .map(|[x, y, z]| V3::of(x, y, z));
    let seen = |d| sky::sky::<f32>(d, up, top, horizon, ground, 0.0);
    let close = |a: V3<f32>, b: V3<f32>| (a - b).length() < 1e-5;
    assert!(close(seen(up), top));
    assert!(close(seen(V3::of(1.0, 0.0, 0.0)), horizon));
    assert!(close(seen(-up), ground));
    assert!((sky::hidden_by_fog(10.0, 0.1_f32) - (1.0 - (-1.0_f32).exp())).abs() < 1e-5);
}

#[test]
fn srgb_is_the_standards() {
    let encode = |c: f32| tone::encode::<f32>(V3::of(c, c, c)).x;
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
    let filmic = |c: f32| tone::filmic::<f32>(V3::of(c, c, c)).y;
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
    let grey = tone::reinhard::<f32>(V3::of(1.0, 1.0, 1.0));
    assert!((grey.x - 0.5).abs() < 1e-6);
}

#[test]
fn false_colours_tell_things_apart() {
    assert_eq!(views::heat(0.0_f32), V3::of(0.0, 0.0, 0.0));
    assert_eq!(views::heat(1.0_f32), V3::of(1.0, 1.0, 1.0));
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
