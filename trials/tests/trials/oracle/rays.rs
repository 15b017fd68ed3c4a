//! Rays through all scenes against thousands of even steps: nothing in front of a hit is missed.

use super::{Point, beyond, direction, elaborated, files, norm, oracle, point, read, unit};
use sdfc_compiler::scene::Scene;
use sdfc_trials::campaign::{Verdict, count, run};
use sdfc_trials::oracle::{Oracle, Trace};
use sdfc_trials::random::Random;
use sdfc_trials::scenes::{Style, scene as random_scene};
use std::path::Path;
use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering::Relaxed;

/// Rays per scene.
const DEFAULT_RAYS_PER_SCENE: usize = 24;
/// Even steps per ray.
const DEFAULT_STEPS_PER_RAY: usize = 3000;
/// Half the size of the cube that rays aim at.
const DEFAULT_CUBE_HALF_LENGTH: f64 = 2.5;

/// The steepness of the value, to tell depth from noise.
fn slope(oracle: &Oracle, p: Point) -> f64 {
    norm(oracle.gradient(p)).max(1e-3)
}

/// Demands that steps up to the end of a ray find nothing that the oracle did not. Tells if the
/// oracle decided.
fn check(oracle: &Oracle, name: &str, origin: Point, direction: Point, range: [f64; 2]) -> bool {
    let trace = oracle.trace(origin, direction, range);
    let sign = if oracle.value(origin) < 0.0 {
        -1.0
    } else {
        1.0
    };
    let end = match trace {
        Trace::Hit { t, normal, inside } => {
            let value = |t: f64| sign * oracle.value(beyond(origin, direction, t));
            assert!(
                value(t - 1e-9) > 0.0,
                "{name}: {origin:?} {direction:?} {t}"
            );
            let behind = [1e-9, 1e-8, 1e-7, 1e-6, 1e-5].map(|by| value(t + by));
            assert!(
                behind.iter().any(|v| *v < 0.0),
                "{name}: {origin:?} {direction:?} {t}"
            );
            assert_eq!(inside, sign < 0.0);
            if let Some(normal) = normal {
                assert!((norm(normal) - 1.0).abs() < 1e-9);
                let towards: f64 = (0..3).map(|i| sign * normal[i] * direction[i]).sum();
                assert!(
                    towards < 1e-3,
                    "{name}: {origin:?} {direction:?} {normal:?}"
                );
            }
            t
        }
        Trace::Miss => range[1],
        Trace::Undecided { .. } => return false,
    };
    for step in 0..DEFAULT_STEPS_PER_RAY {
        let t = range[0] + (range[1] - range[0]) * step as f64 / DEFAULT_STEPS_PER_RAY as f64;
        if t >= end - 1e-6 {
            break;
        }
        let p = beyond(origin, direction, t);
        let value = sign * oracle.value(p);
        assert!(
            value >= 0.0 || value >= -1e-6 * slope(oracle, p),
            "{name}: {origin:?} {direction:?} is at {value} at {t}, before {trace:?}"
        );
    }
    true
}

/// Demands that rays through a scene are right, and counts those that are undecided.
fn demand(scene: &Scene, name: &str, rays: usize) -> usize {
    let oracle = oracle(scene);
    let mut r = Random::new(4);
    let mut undecided = 0;
    for _ in 0..rays {
        let origin = point(&mut r, 2.0 * DEFAULT_CUBE_HALF_LENGTH);
        let target = point(&mut r, DEFAULT_CUBE_HALF_LENGTH);
        let way = [0, 1, 2].map(|i| target[i] - origin[i]);
        let length = norm(way);
        let ray = match unit(&mut r) < 0.8 {
            true => way.map(|v| v / length),
            false => direction(&mut r),
        };
        undecided += usize::from(!check(&oracle, name, origin, ray, [0.0, 12.0]));
    }
    undecided
}

#[test]
fn even_steps_find_no_surface_before_the_hit() {
    let scenes: Vec<_> = files().iter().map(|path| read(path)).collect();
    let solids = scenes.iter().filter(|(scene, _)| !scene.plane);
    let undecided: usize = solids
        .map(|(scene, name)| demand(scene, name, DEFAULT_RAYS_PER_SCENE))
        .sum();
    assert!(
        undecided * 200 < DEFAULT_RAYS_PER_SCENE * scenes.len(),
        "{undecided} rays are undecided"
    );
}

#[test]
fn even_steps_find_no_surface_before_the_hit_in_random_scenes() {
    let undecided = AtomicUsize::new(0);
    let check = |seed: &u64| {
        let text = random_scene(*seed).text(Style::default());
        let scene = elaborated(Path::new("."), &text).0;
        undecided.fetch_add(demand(&scene, &text, DEFAULT_RAYS_PER_SCENE / 2), Relaxed);
        Verdict::Accepted
    };
    let scenes = count(30, 400);
    run("rays through random scenes", scenes, |seed| seed, check);
    let (undecided, rays) = (
        undecided.into_inner(),
        DEFAULT_RAYS_PER_SCENE / 2 * scenes as usize,
    );
    assert!(
        undecided * 100 < rays,
        "{undecided} of {rays} rays are undecided"
    );
}
