//! Our own elementary functions in `f32` against the standard library's in `f64`, with the errors that
//! their documentation states.

use crate::fixture::Random;
use sdfc_vm::elementary::{arctangent, cosine, exponential, logarithm, sine};
use sdfc_vm::prelude;
use sdfc_vm::real::Real;
use sdfc_vm::vector::V3;

/// Returns the largest error over random arguments.
fn worst(seed: u64, mut error: impl FnMut(&mut Random) -> f64) -> f64 {
    let mut random = Random::new(seed);
    (0..400_000).map(|_| error(&mut random)).fold(0.0, f64::max)
}

#[test]
fn errors_are_as_documented() {
    let (exact, f) = (|x: f32| f64::from(x), |v: f64| v as f32);
    let sines = worst(80, |r| {
        let x = f(r.range(-100.0, 100.0));
        let s = (exact(sine(x)) - exact(x).sin()).abs();
        s.max((exact(cosine(x)) - exact(x).cos()).abs())
    });
    assert!(sines < 2e-7, "sine: {sines}");
    let far = worst(81, |r| {
        let x = f(r.range(-1e4, 1e4));
        (exact(sine(x)) - exact(x).sin()).abs()
    });
    assert!(far < 2e-5, "sine far out: {far}");
    let powers = worst(82, |r| {
        let x = f(r.range(-126.0, 127.0));
        (exact(exponential(x)) / exact(x).exp2() - 1.0).abs()
    });
    assert!(powers < 4e-7, "exponential: {powers}");
    let near_one = worst(83, |r| {
        let x = f(r.range(0.5, 2.0));
        (exact(logarithm(x)) - exact(x).log2()).abs()
    });
    assert!(near_one < 6e-7, "logarithm near one: {near_one}");
    let logarithms = worst(84, |r| {
        let x = f(r.range(-125.9, 127.0).exp2());
        let expected = exact(x).log2();
        (exact(logarithm(x)) - expected).abs() / expected.abs().max(1.0)
    });
    assert!(logarithms < 4e-7, "logarithm: {logarithms}");
    let angles = worst(85, |r| {
        let scale = r.range(-60.0, 60.0).exp2();
        let (y, x) = (f(r.range(-1.0, 1.0) * scale), f(r.range(-1.0, 1.0) * scale));
        (exact(arctangent(y, x)) - exact(y).atan2(exact(x))).abs()
    });
    assert!(angles < 4e-7, "arctangent: {angles}");
}

/// Overflow counts as large, and NaN does not become a small number.
#[test]
fn overflow_and_nan_do_not_become_small() {
    use sdfc_vm::ops::math;
    let none = f32::NAN;
    let kept = [
        math::sqrt(none),
        math::inverse_sqrt(none),
        math::exp(none),
        math::asin(none),
        math::acos(none),
        math::sin(f32::INFINITY),
        math::cos(none),
    ];
    assert!(kept.iter().all(|v| v.is_nan()), "{kept:?}");
    let large = [math::ln(none), math::log2(none), math::pow(none, 2.0)];
    assert!(large.iter().all(|&v| v > 88.0), "{large:?}");
}

#[test]
fn the_ends_of_their_ranges_are_numbers() {
    assert_eq!(exponential(-1e30_f32), exponential(-126.0_f32));
    assert!(exponential(1e30_f32).is_finite());
    assert!(logarithm(0.0_f32) < -125.0 && logarithm(0.0_f32).is_finite());
    assert!(logarithm(-1.0_f32).is_finite());
    assert_eq!(logarithm(1.0_f32), 0.0);
    assert_eq!(arctangent(0.0_f32, 0.0), 0.0);
    assert_eq!(arctangent(0.0_f32, -1.0), std::f32::consts::PI);
    for x in [1e6_f32, 1e10, 1e18, -1e18, 3e38] {
        assert!(sine(x).abs() <= 1.0001 && cosine(x).abs() <= 1.0001, "{x}");
    }
}

/// Noise: zero at the lattice, within its bounds, with the gradient of its differences, equal in both
/// precisions, and different by seed.
#[test]
fn noise_keeps_its_documented_limits() {
    let mut random = Random::new(86);
    let mut different = 0;
    for _ in 0..20_000 {
        let p = random.point(50.0);
        let at = |x: f64, y: f64, z: f64| f64::noise_gradient(V3::new(x, y, z), 3.0);
        let (v, g) = at(p[0], p[1], p[2]);
        assert!(v.abs() < 1.5);
        assert!(g.x.abs().max(g.y.abs()).max(g.z.abs()) < sdfc_vm::interval::MAX_NOISE_SLOPE);
        let length = (g.x * g.x + g.y * g.y + g.z * g.z).sqrt();
        assert!(length < sdfc_vm::interval::MAX_NOISE_STEEPNESS);
        let h = 1e-6;
        let along = (at(p[0] + h, p[1], p[2]).0 - at(p[0] - h, p[1], p[2]).0) / (2.0 * h);
        assert!((along - g.x).abs() < 1e-5, "{along}, {}", g.x);
        let single = f32::noise(V3::new(p[0] as f32, p[1] as f32, p[2] as f32), 3.0);
        assert!((f64::from(single) - v).abs() < 3e-5, "{single}, {v}");
        different += usize::from((f64::noise(V3::new(p[0], p[1], p[2]), 4.0) - v).abs() > 1e-3);
        assert_eq!(at(p[0].floor(), p[1].floor(), p[2].floor()).0, 0.0);
        let curvature = f64::noise_curvature(V3::new(p[0], p[1], p[2]), 3.0);
        for row in curvature {
            let largest = row.x.abs().max(row.y.abs()).max(row.z.abs());
            assert!(
                largest < sdfc_vm::interval::MAX_NOISE_CURVATURE,
                "{largest}"
            );
        }
        let beside = at(p[0] + h, p[1], p[2]).1;
        let bent = (beside.y - at(p[0] - h, p[1], p[2]).1.y) / (2.0 * h);
        assert!((bent - curvature[1].x).abs() < 1e-4, "{bent}");
    }
    assert!(different > 19_000);
}

#[test]
fn every_function_of_the_prelude_comes_after_those_it_calls() {
    let functions = prelude::functions(prelude::NAMES);
    assert_eq!(functions.len(), prelude::NAMES.len());
    for (i, function) in functions.iter().enumerate() {
        for call in &function.calls {
            assert!(
                functions[..i].iter().any(|f| f.name == *call),
                "{}",
                function.name
            );
        }
    }
}
