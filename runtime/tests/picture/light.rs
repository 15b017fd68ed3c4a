//! Light: occlusion among surfaces, lights and the sky, and unoccluded surfaces.

use super::analytic::{Analytic, Formula, constant};
use super::{Ground, lamp, ray, render_image, settings};
use sdfc_runtime::render::{
    LightEmitter, Lighting, Occlusion, RenderSettings, ResolvedLens, ResolvedLight, ResolvedShadow,
    View,
};
use sdfc_vm::real::{Real, Vector3, lit};

#[test]
fn nothing_shades_itself() {
    // An empty plane is lit evenly, near the origin and far from it, by lights of every kind.
    for shadow in [
        ResolvedShadow::Hard,
        ResolvedShadow::Plain(0.05),
        ResolvedShadow::Soft(0.05),
        ResolvedShadow::Sized(0.05),
    ] {
        for offset in [0.0, 1e2, 1e4, 1e5] {
            let lit_by = |shadow| {
                let lighting = Lighting {
                    lights: vec![lamp(shadow)],
                    ..settings().lighting
                };
                let view = View {
                    from: [offset, offset + 3.0, offset + 5.0],
                    look: [offset, offset, offset],
                    ..settings().view
                };
                RenderSettings {
                    view,
                    lighting,
                    ..settings()
                }
            };
            let field = Analytic(Ground(offset));
            let with = render_image(&field, &lit_by(shadow));
            let without = render_image(&field, &lit_by(ResolvedShadow::None));
            for (a, b) in with.color.iter().zip(&without.color) {
                assert!(
                    (a[0] - b[0]).abs() < 0.01 * b[0],
                    "{shadow:?} at {offset}: {a:?} {b:?}"
                );
            }
        }
    }
}

/// A slope through a point, with the rounding error of large coordinates.
struct Slope([f64; 3]);

impl Formula for Slope {
    fn distance<R: Real>(&self, p: R::Vec3) -> R {
        let across = constant::<R>([0.48, 0.6, 0.64]);
        let [x, y, z] = self.0;
        p.dot(across) - R::constant(0.48 * x + 0.6 * y + 0.64 * z)
    }
}

/// A plane occludes neither the sky nor any light from itself, however rough rounding makes its field.
#[test]
fn slopes_are_lit_evenly_far_from_the_origin() {
    let offset = [2e4, 5e4, -3e4];
    let [x, y, z] = offset;
    let view = View {
        from: [x + 2.0, y + 3.0, z + 4.0],
        look: offset,
        ..settings().view
    };
    let occlusions = [Occlusion::Off, Occlusion::FiveTap, Occlusion::Multi(8)];
    for (occlusion, shadow) in occlusions.into_iter().zip([
        ResolvedShadow::Hard,
        ResolvedShadow::Soft(0.05),
        ResolvedShadow::Sized(0.05),
    ]) {
        let settings = |occlusion, shadow| RenderSettings {
            view,
            occlusion,
            lighting: Lighting {
                lights: vec![lamp(shadow)],
                ..settings().lighting
            },
            ..settings()
        };
        let field = Analytic(Slope(offset));
        let shaded = render_image(&field, &settings(occlusion, shadow));
        let plain = render_image(&field, &settings(Occlusion::Off, ResolvedShadow::None));
        let mut wrong = 0;
        for (a, b) in shaded.color.iter().zip(&plain.color) {
            wrong += usize::from((a[0] - b[0]).abs() > 0.02 * b[0]);
        }
        assert!(wrong == 0, "{occlusion:?}, {shadow:?}: {wrong} pixels");
    }
}

/// A sphere above the ground.
struct Floating;

impl Formula for Floating {
    fn distance<R: Real>(&self, p: R::Vec3) -> R {
        let ball = (p - constant::<R>([0.0, 2.0, 0.0])).length() - lit(1.0);
        ball.min(p.y())
    }
}

#[test]
fn shadows_fall_where_the_light_is_hidden() {
    for shadow in [
        ResolvedShadow::Hard,
        ResolvedShadow::Plain(0.05),
        ResolvedShadow::Soft(0.05),
        ResolvedShadow::Sized(0.05),
    ] {
        let source = LightEmitter::Directional([0.0, 1.0, 0.0]);
        let light = ResolvedLight {
            source,
            color: [3.0; 3],
            shadow,
        };
        let mut settings = settings();
        settings.lighting.lights = vec![light];
        settings.lighting.ambient = 0.0;
        settings.view.from = [0.0, 1.5, 8.0];
        settings.view.look = [0.0, 0.0, 0.0];
        let image = render_image(&Analytic(Floating), &settings);
        let (mut dark, mut bright) = (0, 0);
        for y in 0..image.height {
            for x in 0..image.width {
                let index = y * image.width + x;
                let (from, way) = ray(&settings, x, y);
                let t = f64::from(image.depth[index]);
                let p = from + t * way;
                if !t.is_finite() || p.y.abs() > 1e-3 {
                    continue;
                }
                let aside = p.x.hypot(p.z);
                let [red, ..] = image.color[index];
                if aside < 0.8 {
                    assert!(
                        red < 0.01,
                        "{shadow:?}: {red} below the ball, {aside} from its axis"
                    );
                    dark += 1;
                } else if aside > 1.25 {
                    assert!(
                        red > 0.3,
                        "{shadow:?}: {red} beside the ball, {aside} from its axis"
                    );
                    bright += 1;
                }
            }
        }
        assert!(dark > 30 && bright > 500, "{dark} dark, {bright} bright");
    }
}

/// A step on the ground, from x = 0 on.
struct Step(f64);

impl Formula for Step {
    fn distance<R: Real>(&self, p: R::Vec3) -> R {
        let wall = (-p.x()).max(p.y() - R::constant(self.0));
        p.y().min(wall)
    }
}

/// A low light shortens shadows by at most two pixels.
#[test]
fn low_lights_cast_shadows_of_the_right_length() {
    let (height, side) = (0.01_f64, 2.0);
    for degrees in [1.0_f64, 2.0, 5.0, 20.0] {
        let rise = degrees.to_radians().tan();
        let settings = RenderSettings {
            size: [240, 160],
            view: View {
                from: [-0.6, 5.0, 0.0],
                look: [-0.6, 0.0, 0.0],
                up: [0.0, 0.0, -1.0],
                lens: ResolvedLens::Orthographic(side),
            },
            lighting: Lighting {
                lights: vec![ResolvedLight {
                    source: LightEmitter::Directional([1.0, rise, 0.0]),
                    color: [1e3; 3],
                    shadow: ResolvedShadow::Hard,
                }],
                ambient: 0.0,
                ..settings().lighting
            },
            ..settings()
        };
        let image = render_image(&Analytic(Step(height)), &settings);
        let row = &image.color[80 * 240..81 * 240];
        let dark = row.iter().filter(|color| color[0] < 0.1).count() as f64;
        let expected = height / rise / side * 160.0;
        assert!(
            (dark - expected).abs() <= 2.0,
            "{degrees} degrees: {dark} pixels are dark, {expected:.1} should be"
        );
    }
}
