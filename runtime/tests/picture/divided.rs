//! A field beside which another one is divided by a large bound.

use super::analytic::{Analytic, Formula};
use super::{picture, ray, settings};
use sdfc_runtime::frame::RenderSettings;
use sdfc_vm::real::{Real, Vector3, lit};

/// A wall, and a ball whose field was divided by a large bound: near the wall, too, it is the smaller one.
struct Divided;

impl Formula for Divided {
    fn is_raw(&self) -> bool {
        true
    }
    fn distance<R: Real>(&self, p: R::Vec3) -> R {
        let ball = (p.length() - lit(0.5)) * lit(1e-6);
        let wall = p.z() + lit(0.6);
        wall.min(ball)
    }
}

#[test]
fn normals_are_those_of_what_is_hit() {
    let settings = RenderSettings {
        steps: 20_000,
        ..settings()
    };
    let frame = picture(&Analytic(Divided), &settings);
    let [width, height] = settings.size.map(|side| side as usize);
    let mut seen = 0;
    for y in 0..height {
        for x in 0..width {
            let (from, way) = ray(&settings, x, y);
            let along: f64 = (0..3).map(|i| from[i] * way[i]).sum();
            let near: f64 = (0..3).map(|i| from[i] * from[i]).sum::<f64>() - along * along;
            if near < 0.51 * 0.51 {
                continue;
            }
            seen += 1;
            let normal = frame.normal[y * width + x];
            assert!(normal[2] > 0.99, "{normal:?} at {x}, {y}");
        }
    }
    assert!(seen > 1000, "{seen} pixels of the wall");
}
