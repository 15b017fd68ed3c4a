//! Tests of the engine `reference` against closed forms, and of its judgement of wrong images.

use crate::closed::{self, Solid};
use crate::scenes::{cpu, drawn, loaded, module};
use glam::DVec3;
use sdfc_runtime::engine::{EngineKind, open};
use sdfc_runtime::reference::{
    GroundTruth, Outcome, PictureErrors, RayEnd, ReferenceCamera, ReferenceField, ReferenceRay,
    ReferenceTracer, RenderedPixels, TraceOptions, UndecidedReason, compare, trace,
};
use sdfc_runtime::render::{CellMode, RenderSettings, ResolvedLens, Status, View};
use sdfc_shaders::marching;
use sdfc_vm::program::Module;
use sdfc_vm::vector::V3;

/// The settings of an image of a module from this camera.
fn settings_from(
    module: &Module,
    from: [f64; 3],
    look: [f64; 3],
    lens: ResolvedLens,
) -> RenderSettings {
    RenderSettings {
        size: [24, 16],
        far: 5_000.0,
        view: View {
            from,
            look,
            up: [0.0, 1.0, 0.0],
            lens,
        },
        ..drawn(module, &[])
    }
}

/// Cameras around an object of size one: near, far, askew, orthographic, nearly along a face, and inside.
fn poses() -> [([f64; 3], [f64; 3], ResolvedLens); 7] {
    use ResolvedLens::{Orthographic, Perspective};
    [
        ([2.5, 2.0, 5.0], [0.0; 3], Perspective(0.7)),
        ([-3.0, 0.4, 0.7], [0.1, 0.0, -0.2], Perspective(0.9)),
        ([300.0, 500.0, 400.0], [0.0; 3], Perspective(0.005)),
        ([1.0, -4.0, 2.0], [0.0; 3], Orthographic(3.0)),
        ([6.0, 0.501, 0.3], [0.0, 0.5, 0.0], Perspective(0.01)),
        ([0.07, 0.03, -0.05], [1.0, 0.3, 0.2], Perspective(1.2)),
        ([0.6, 0.02, 0.01], [1.0, 0.3, 0.9], Perspective(1.0)),
    ]
}

/// Compares all rays of an image with a solid's own roots. Returns the numbers of hits, misses and undecided
/// rays.
fn check(module: &Module, solid: &dyn Solid, settings: &RenderSettings) -> [usize; 3] {
    let truth = trace(module, settings, &TraceOptions::default());
    let camera = ReferenceCamera::new(settings);
    let mut counts = [0; 3];
    for (index, end) in truth.pixels.iter().map(|pixel| &pixel.ray).enumerate() {
        let pixel = [index % truth.size[0], index / truth.size[0]];
        let ray = camera.ray(pixel.map(|v| v as f64), [0.0; 2]);
        let expected = solid.first(&ray, settings.far);
        let message = format!(
            "{pixel:?} of {:?}: {end:?}, not {expected:?}",
            settings.view
        );
        match (end.outcome, expected) {
            (Outcome::Hit { t0, t1 }, Some(t)) => {
                counts[0] += 1;
                assert!(t0 <= t1 && t1 - t0 <= 1e-9 * t0, "{message}");
                // Rounding error of the closed form itself in `f64`, larger where the ray grazes.
                let [n, sine] = solid.normal(&ray, t);
                let slack = 4e-15 * (1.0 + t) / sine[0].max(1e-6);
                assert!(t0 - slack <= t && t <= t1 + slack, "{message}");
                assert_eq!(end.inside, solid.inside(ray.origin), "{message}");
                let side = if end.inside { -1.0 } else { 1.0 };
                if let (Some(normal), false) = (end.normal, end.edge) {
                    for axis in 0..3 {
                        assert!(
                            (normal[axis] - side * n[axis]).abs() < 1e-9,
                            "{message}, {n:?}"
                        );
                    }
                }
            }
            (Outcome::Miss, None) => counts[1] += 1,
            (Outcome::Miss, Some(t)) if is_within_rounding(solid, &ray, t) => counts[1] += 1,
            (Outcome::Undecided { .. }, _) => {
                counts[2] += 1;
                eprintln!("{message}, {ray:?}");
            }
            _ => panic!("{message}"),
        }
    }
    counts
}

/// Fraction of a chord's depth that is certainly seen. The search beyond a root doubles its steps, so that a
/// sample lies in the middle third. A parabola has 8/9 of its height there.
const SEEN_DEPTH_FRACTION: f64 = 8.0 / 9.0;

/// Reports whether a ray that enters a solid at `t` stays so near to its surface that single precision does not
/// resolve it.
fn is_within_rounding(solid: &dyn Solid, ray: &ReferenceRay, t: f64) -> bool {
    let crossings = solid.crossings(ray);
    let later = crossings.into_iter().filter(|&crossing| crossing > t);
    let deepest = ray.at((t + later.fold(f64::INFINITY, f64::min)) / 2.0);
    let largest = ray.origin.iter().fold(0.0_f64, |max, v| max.max(v.abs()));
    let along = marching::rounding_at(t, marching::ROUNDING_PER_UNIT * largest);
    let [x, y, z] = ray.at(t);
    let rounding = marching::rounding_near::<f64>(V3::new(x, y, z), along, 0.0);
    let margin = marching::sign_margin(rounding, 1.0, 0.0) / SEEN_DEPTH_FRACTION;
    let outward = DVec3::from(solid.outward(deepest)).normalize();
    !solid.inside((DVec3::from(deepest) + outward * margin).into())
}

/// Checks all poses of a solid: every ray is decided, except one that meets the surface at less than a
/// thousandth.
fn check_all(listing: &str, solid: &dyn Solid) {
    let module = module(listing, None);
    let mut total = [0; 3];
    for (from, look, lens) in poses() {
        let counts = check(&module, solid, &settings_from(&module, from, look, lens));
        for (total, count) in total.iter_mut().zip(counts) {
            *total += count;
        }
    }
    assert!(total[2] <= 1, "{listing}: {total:?}");
    assert!(total[0] > 400, "{listing}: {total:?}");
}

#[test]
fn spheres() {
    check_all("sphere [0.75]", &closed::Sphere { r: 0.75 });
}

/// Newton's method doubles the digits of a root with each step; bisection would take fifty steps.
#[test]
fn roots_take_few_evaluations() {
    let module = module("sphere [0.75]", None);
    let settings = settings_from(
        &module,
        [2.5, 2.0, 5.0],
        [0.0; 3],
        ResolvedLens::Perspective(0.3),
    );
    let truth = trace(&module, &settings, &TraceOptions::default());
    let mean = truth.evaluations / truth.pixels.len() as u64;
    assert!(mean < 60, "{mean} evaluations for a ray");
}

#[test]
fn planes() {
    // The numbers of a program are `f32`; the plane is that of the rounded numbers.
    let normal = [0.6_f32, 0.8, 0.0].map(f64::from);
    check_all(
        "plane [0.6, 0.8, 0.0, 0.25]",
        &closed::Plane { normal, at: 0.25 },
    );
}

#[test]
fn boxes() {
    let half = [0.75, 0.5, 0.25];
    check_all("cuboid [0.75, 0.5, 0.25]", &closed::Cuboid { half });
}

#[test]
fn capsules() {
    let (half, r) = (0.5, 0.375);
    check_all("capsule [0.5, 0.375]", &closed::Capsule { half, r });
}

#[test]
fn cylinders() {
    let (r, half) = (0.625, 0.5);
    check_all("cylinder [0.625, 0.5]", &closed::Cylinder { r, half });
}

#[test]
fn cones() {
    let [sine, cosine] = [0.6_f32, 0.8].map(f64::from);
    check_all(
        "infinite_cone [0.6, 0.8]",
        &closed::Cone {
            ratio: sine / cosine,
        },
    );
}

#[test]
fn tori() {
    let (ring, tube) = (0.625, 0.25);
    check_all("torus [0.625, 0.25]", &closed::Torus { ring, tube });
}

/// The end of a single ray through a program.
fn trace_one(listing: &str, origin: [f64; 3], direction: [f64; 3], far: f64) -> RayEnd {
    let field = ReferenceField::from_module(&module(listing, None));
    let mut tracer = ReferenceTracer::new(&field, &TraceOptions::default());
    tracer.ray(&ReferenceRay { origin, direction }, far, |_| 1e-3)
}

fn is_hit_at(ended: &RayEnd, t: f64) -> bool {
    matches!(ended.outcome, Outcome::Hit { t0, t1 } if t0 <= t && t <= t1 && t1 - t0 <= 1e-9 * t)
}

/// A field that touches zero, or falls below it by less than single precision resolves, has no surface there.
#[test]
fn rays_that_touch_are_no_hits_and_those_beside_are_decided() {
    let ball = |height: f64| trace_one("sphere [0.5]", [-3.0, height, 0.0], [1.0, 0.0, 0.0], 10.0);
    for touching in [0.5, 0.5 - 1e-12, 0.5 + 1e-12] {
        let touching = ball(touching);
        assert!(
            !matches!(touching.outcome, Outcome::Hit { .. }),
            "{touching:?}"
        );
    }
    assert_eq!(ball(0.5 + 1e-6).outcome, Outcome::Miss);
    let grazing = ball(0.5 - 1e-4);
    let half = (0.25 - (0.5_f64 - 1e-4).powi(2)).sqrt();
    assert!(is_hit_at(&grazing, 3.0 - half), "{grazing:?}");
}

#[test]
fn rays_end_at_far_and_a_start_on_a_surface_is_inside() {
    let ball = |far| trace_one("sphere [0.5]", [0.0, 0.0, -2.0], [0.0, 0.0, 1.0], far);
    assert!(is_hit_at(&ball(1.500_01), 1.5));
    assert_eq!(ball(1.499_999).outcome, Outcome::Miss);
    let on_it = trace_one("sphere [0.5]", [0.0, 0.0, -0.5], [0.0, 0.0, 1.0], 9.0);
    // A start without a sign is skipped: the ray goes through the sphere.
    assert!(on_it.inside && is_hit_at(&on_it, 1.0), "{on_it:?}");
}

#[test]
fn a_jump_across_zero_is_a_surface_and_others_are_passed() {
    // −1 where x is above 0.3, else 1; and 2 or 1.
    let (origin, direction) = ([-1.0, 0.2, 0.1], [1.0, 0.0, 0.0]);
    let third = f64::from(0.3_f32);
    let across = "x\n step  left [0.3]\n mul  right [-2.0]\n add  right [1.0]";
    let jump = trace_one(across, origin, direction, 9.0);
    assert!(is_hit_at(&jump, 1.0 + third), "{jump:?}");
    assert!(jump.normal.is_none() && jump.edge);
    let aside = "x\n step  left [0.3]\n add  right [1.0]";
    assert_eq!(
        trace_one(aside, origin, direction, 9.0).outcome,
        Outcome::Miss
    );
}

#[test]
fn repeated_boxes_are_found_across_all_cells() {
    // A cell evaluates only its own copy, so the field is discontinuous at every cell boundary.
    let listing = "repeat [2.0, 0.0, 2.0, 0.0, 0.5, 0.0, 0.5]\n cuboid [0.5, 1.0, 0.25]";
    let module = module(listing, None);
    let field = closed::City {
        half: [0.5, 1.0, 0.25],
        spacing: 2.0,
    };
    let lens = ResolvedLens::Perspective(0.9);
    let mut settings = settings_from(&module, [0.9, 1.3, 0.7], [9.0, 0.4, 5.0], lens);
    settings.far = 40.0;
    let [hits, misses, undecided] = check(&module, &field, &settings);
    assert!(hits > 80 && misses > 20, "{hits}, {misses}");
    assert_eq!(undecided, 0);
}

#[test]
fn a_ray_beyond_its_limit_is_undecided() {
    let field = ReferenceField::from_module(&module("gyroid [40.0, 0.5, 0.01]", None));
    let options = TraceOptions {
        evaluations: 5,
        ..TraceOptions::default()
    };
    let (origin, direction) = ([-3.0, 0.1, 0.2], [1.0, 0.0, 0.0]);
    let ray = ReferenceRay { origin, direction };
    let ended = ReferenceTracer::new(&field, &options).ray(&ray, 100.0, |_| 1e-3);
    let why = |outcome| match outcome {
        Outcome::Undecided { why, .. } => Some(why),
        _ => None,
    };
    assert_eq!(
        why(ended.outcome),
        Some(UndecidedReason::Budget),
        "{ended:?}"
    );
}

#[test]
fn hits_near_edges_are_marked_and_apexes_have_no_normal() {
    let hit = |y: f64| {
        trace_one(
            "cuboid [0.5, 0.5, 0.5]",
            [0.1, y, -3.0],
            [0.0, 0.0, 1.0],
            9.0,
        )
    };
    let face = hit(0.2);
    assert_eq!((face.normal, face.edge), (Some([0.0, 0.0, -1.0]), false));
    // Within the half pixel of 1e-3 that `trace_one` uses, and outside of it.
    assert!(hit(0.499_5).edge);
    assert!(!hit(0.498).edge);
    let tip = trace_one(
        "infinite_cone [0.6, 0.8]",
        [0.0, 3.0, 0.0],
        [0.0, -1.0, 0.0],
        9.0,
    );
    assert_eq!(tip.normal, None, "{tip:?}");
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let module = module(crate::scenes::EVERYTHING, None);
    let lens = ResolvedLens::Perspective(0.7);
    let settings = settings_from(&module, [2.5, 2.0, 5.0], [0.0; 3], lens);
    let traced = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.expect("threads can be started");
        pool.install(|| trace(&module, &settings, &TraceOptions::default()))
    };
    let (single, triple) = (traced(1), traced(3));
    assert_eq!(single, triple);
    assert_eq!(single.undecided(), 0);
}

#[test]
fn the_engine_draws_the_truth() {
    let module = module(crate::scenes::EVERYTHING, None);
    let lens = ResolvedLens::Perspective(0.7);
    let settings = settings_from(&module, [2.5, 2.0, 5.0], [0.0; 3], lens);
    let mut engine = open(EngineKind::Reference).expect("it needs no device");
    engine.load(&loaded(&module, &[])).expect("it loads");
    let image = engine.render(&settings, &|_| {}).expect("it draws");
    let truth = trace(&module, &settings, &TraceOptions::default());
    let drawn = truth.pixels.iter().map(|pixel| pixel.ray.depth);
    let expected: Vec<f32> = drawn
        .map(|t| t.map_or(f32::INFINITY, |t| t as f32))
        .collect();
    assert_eq!(image.depth, expected);
    assert!(image.stats.evaluations >= truth.evaluations);
    assert!(image.stats.hits > 50 && image.stats.undecided == 0);
    let errors = compare(&truth, &image);
    assert!(
        errors.depth.max < 1e-7 && errors.normals.max < 1e-4,
        "{errors:?}"
    );
    // Equals the image of the CPU engine, except for edges.
    let report = {
        let mut engines = [cpu(), engine];
        sdfc_runtime::comparison::compare_engines(&loaded(&module, &[]), &mut engines, &settings)
    };
    let report = report.expect("both draw");
    let differences = &report.comparisons[0].picture;
    assert_eq!(differences.hit_mismatches_inside, 0, "{report}");
    assert_eq!(differences.differing_inside, 0, "{report}");
}

#[test]
fn the_cpu_engine_is_near_the_truth() {
    let module = module(crate::scenes::EVERYTHING, None);
    let lens = ResolvedLens::Perspective(0.7);
    let mut settings = settings_from(&module, [2.5, 2.0, 5.0], [0.0; 3], lens);
    settings.size = [60, 40];
    let truth = trace(&module, &settings, &TraceOptions::default());
    for cells in [CellMode::Never, CellMode::Always] {
        settings.cells = cells;
        let errors = cpu_errors(&module, &settings, &truth);
        assert_eq!(errors.mismatches_inside, 0, "{errors:?}");
        assert_eq!((errors.nans, errors.step_caps), (0, 0));
        assert!(errors.depth_smooth.p99 < 1e-5, "{errors:?}");
        assert!(errors.normals.p99 < 0.1, "{errors:?}");
    }
}

fn cpu_errors(module: &Module, settings: &RenderSettings, truth: &GroundTruth) -> PictureErrors {
    let mut engine = cpu();
    engine.load(&loaded(module, &[])).expect("it loads");
    let image = engine.render(settings, &|_| {}).expect("it draws");
    compare(truth, &image)
}

#[test]
fn a_field_with_too_large_values_is_detected() {
    // A thin wall with three times its distance: rays step through it.
    let wall = |factor: &str| {
        let listing = format!("cuboid [1.5, 1.5, 0.02]\n mul  right [{factor}]");
        let module = module(&listing, None);
        let lens = ResolvedLens::Perspective(0.5);
        let settings = settings_from(&module, [0.5, 0.4, 3.0], [0.0; 3], lens);
        let truth = trace(&module, &settings, &TraceOptions::default());
        cpu_errors(&module, &settings, &truth)
    };
    assert_eq!(wall("1.0").mismatches_inside, 0);
    let wrong = wall("3.0");
    assert!(wrong.mismatches_inside > 20, "{wrong:?}");
    assert_eq!(wrong.mismatches_inside, wrong.false_misses, "{wrong:?}");
}

#[test]
fn errors_are_counted_for_what_they_are() {
    let module = module("sphere [1.0]", None);
    let lens = ResolvedLens::Perspective(0.8);
    let settings = settings_from(&module, [0.0, 0.0, 4.0], [0.0; 3], lens);
    let truth = trace(&module, &settings, &TraceOptions::default());
    let depth: Vec<f32> = truth
        .pixels
        .iter()
        .map(|pixel| pixel.ray.depth.map_or(f32::INFINITY, |t| t as f32))
        .collect();
    let normal: Vec<[f32; 3]> = truth
        .pixels
        .iter()
        .map(|pixel| pixel.ray.normal.map_or([0.0; 3], |n| n.map(|v| v as f32)))
        .collect();
    let status = vec![Status::Hit; depth.len()];
    let errors_for = |depth: &[f32], normal: &[[f32; 3]]| {
        let status = &status;
        compare(
            &truth,
            RenderedPixels {
                depth,
                normal,
                status,
            },
        )
    };
    let right = errors_for(&depth, &normal);
    assert_eq!((right.mismatches(), right.undecided, right.nans), (0, 0, 0));
    assert_eq!(right.hits + right.misses, right.pixels);
    assert!(
        right.depth_ulps.max <= 1.0 && right.normals.max < 1e-4,
        "{right:?}"
    );
    assert!(right.depth_smooth.count < right.depth.count);

    let farther: Vec<f32> = depth.iter().map(|t| t * 1.001).collect();
    let errors = errors_for(&farther, &normal);
    assert!((errors.depth.p50 - 1e-3).abs() < 1e-6, "{errors:?}");
    assert!((errors.depth.max - 1e-3).abs() < 1e-6, "{errors:?}");
    let ulps = errors.depth_ulps.p50;
    assert!((1e3..2e4).contains(&ulps), "{errors:?}");

    // At the centre, at the rim, and outside.
    let middle = 8 * 24 + 12;
    let rim = (0..24 * 16)
        .find(|&index| depth[index].is_finite())
        .expect("there is one");
    for (index, wrong, inside) in [
        (middle, f32::INFINITY, 1),
        (rim, f32::INFINITY, 0),
        (0, 3.0, 1),
    ] {
        let mut changed = depth.clone();
        changed[index] = wrong;
        let errors = errors_for(&changed, &normal);
        assert_eq!(
            (errors.mismatches(), errors.mismatches_inside),
            (1, inside),
            "{index}"
        );
        assert_eq!(errors.false_hits, usize::from(wrong.is_finite()));
    }
    let mut nan = normal.clone();
    nan[middle][1] = f32::NAN;
    assert_eq!(errors_for(&depth, &nan).nans, 1);
    let (sine, cosine) = 1.0_f32.to_radians().sin_cos();
    let turn = |[x, y, z]: [f32; 3]| [x * cosine - y * sine, x * sine + y * cosine, z];
    let turned: Vec<[f32; 3]> = normal.iter().map(|&n| turn(n)).collect();
    let errors = errors_for(&depth, &turned).normals;
    assert!(errors.max <= 1.000_1 && errors.max > 0.4, "{errors:?}");
}
