//! A field next to another one that is divided by a large slope bound.

use super::analytic::{Analytic, Formula};
use super::{ray, render_image, settings};
use sdfc_runtime::render::RenderSettings;
use sdfc_vm::real::{Real, Vector3, lit};

/// A wall, and a sphere whose field is divided by a large slope bound: even near the wall, that field is the
/// smaller one.
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
    let image = render_image(&Analytic(Divided), &settings);
    let [width, height] = settings.size.map(|side| side as usize);
    let mut count = 0;
    for y in 0..height {
        for x in 0..width {
            let (from, way) = ray(&settings, x, y);
            let along = from.dot(way);
            let near = from.length_squared() - along * along;
            if near < 0.51 * 0.51 {
                continue;
            }
            count += 1;
            let normal = image.normal[y * width + x];
            assert!(normal[2] > 0.99, "{normal:?} at {x}, {y}");
        }
    }
    assert!(count > 1000, "{count} pixels of the wall");
}
