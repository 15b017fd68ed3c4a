//! Rays through all scenes against thousands of uniform steps: no surface before a hit is missed.

use super::{
    Point, elaborate_in, norm, oracle, point_along, random_direction, random_point, read_scene,
    scene_files, unit_number,
};
use sdfc_compiler::scene::Scene;
use sdfc_trials::campaign::{CheckOutcome, input_count, run};
use sdfc_trials::oracle::{Oracle, TraceOutcome};
use sdfc_trials::random::Random;
use sdfc_trials::scenes::{SceneStyle, scene as random_scene};
use std::path::Path;
use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering::Relaxed;

/// Rays per scene.
const RAYS_PER_SCENE: usize = 24;
/// Uniform steps per ray.
const STEPS_PER_RAY: usize = 3000;
/// Half the size of the cube that rays aim at.
const CUBE_HALF_LENGTH: f64 = 2.5;

/// Returns the slope of the value, to separate depth from rounding.
fn slope_length(oracle: &Oracle, p: Point) -> f64 {
    norm(oracle.gradient(p)).max(1e-3)
}

/// Asserts that uniform steps up to the end of a ray find no surface that the oracle missed. Returns
/// whether the oracle decided.
fn is_decided(
    oracle: &Oracle,
    name: &str,
    origin: Point,
    direction: Point,
    range: [f64; 2],
) -> bool {
    let trace = oracle.trace(origin, direction, range);
    let sign = if oracle.value(origin) < 0.0 {
        -1.0
    } else {
        1.0
    };
    let end = match trace {
        TraceOutcome::Hit { t, normal, inside } => {
            let value = |t: f64| sign * oracle.value(point_along(origin, direction, t));
            assert!(
                value(t - 1e-9) > 0.0,
                "{name}: {origin:?} {direction:?} {t}"
            );
            let values_past_hit =
                [1e-9, 1e-8, 1e-7, 1e-6, 1e-5].map(|distance| value(t + distance));
            assert!(
                values_past_hit.iter().any(|v| *v < 0.0),
                "{name}: {origin:?} {direction:?} {t}"
            );
            assert_eq!(inside, sign < 0.0);
            if let Some(normal) = normal {
                assert!((norm(normal) - 1.0).abs() < 1e-9);
                let cosine: f64 = (0..3).map(|i| sign * normal[i] * direction[i]).sum();
                assert!(cosine < 1e-3, "{name}: {origin:?} {direction:?} {normal:?}");
            }
            t
        }
        TraceOutcome::Miss => range[1],
        TraceOutcome::Undecided { .. } => return false,
    };
    for step in 0..STEPS_PER_RAY {
        let t = range[0] + (range[1] - range[0]) * step as f64 / STEPS_PER_RAY as f64;
        if t >= end - 1e-6 {
            break;
        }
        let p = point_along(origin, direction, t);
        let value = sign * oracle.value(p);
        assert!(
            value >= 0.0 || value >= -1e-6 * slope_length(oracle, p),
            "{name}: {origin:?} {direction:?} is at {value} at {t}, before {trace:?}"
        );
    }
    true
}

/// Checks rays through a scene, and returns the number of undecided ones.
fn count_undecided(scene: &Scene, name: &str, rays: usize) -> usize {
    let oracle = oracle(scene);
    let mut r = Random::new(4);
    let mut undecided = 0;
    for _ in 0..rays {
        let origin = random_point(&mut r, 2.0 * CUBE_HALF_LENGTH);
        let target = random_point(&mut r, CUBE_HALF_LENGTH);
        let delta = [0, 1, 2].map(|i| target[i] - origin[i]);
        let length = norm(delta);
        let ray = match unit_number(&mut r) < 0.8 {
            true => delta.map(|v| v / length),
            false => random_direction(&mut r),
        };
        undecided += usize::from(!is_decided(&oracle, name, origin, ray, [0.0, 12.0]));
    }
    undecided
}

#[test]
fn even_steps_find_no_surface_before_the_hit() {
    let scenes: Vec<_> = scene_files().iter().map(|path| read_scene(path)).collect();
    let solids = scenes.iter().filter(|(scene, _)| !scene.is_2d);
    let undecided: usize = solids
        .map(|(scene, name)| count_undecided(scene, name, RAYS_PER_SCENE))
        .sum();
    assert!(
        undecided * 200 < RAYS_PER_SCENE * scenes.len(),
        "{undecided} rays are undecided"
    );
}

#[test]
fn even_steps_find_no_surface_before_the_hit_in_random_scenes() {
    let undecided = AtomicUsize::new(0);
    let check = |seed: &u64| {
        let text = random_scene(*seed).text(SceneStyle::default());
        let scene = elaborate_in(Path::new("."), &text).0;
        undecided.fetch_add(count_undecided(&scene, &text, RAYS_PER_SCENE / 2), Relaxed);
        CheckOutcome::Accepted
    };
    let scenes = input_count(30, 400);
    run("rays through random scenes", scenes, |seed| seed, check);
    let (undecided, rays) = (undecided.into_inner(), RAYS_PER_SCENE / 2 * scenes as usize);
    assert!(
        undecided * 100 < rays,
        "{undecided} of {rays} rays are undecided"
    );
}
