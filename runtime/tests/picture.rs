//! Renders on the CPU, of fields given by formulas, compared with geometry.

#[path = "picture/analytic.rs"]
mod analytic;
#[path = "picture/divided.rs"]
mod divided;
#[path = "picture/light.rs"]
mod light;

use analytic::{Analytic, Formula, Sphere};
use glam::{DVec3, Vec3};
use sdfc_runtime::cpu::{RenderField, render};
use sdfc_runtime::render::{
    CellMode, Image, LightEmitter, Lighting, Mode, Normals, Occlusion, RenderSettings,
    ResolvedLens, ResolvedLight, ResolvedShadow, Status, Tonemap, View, prepare,
};
use sdfc_shaders::camera::SAMPLE_SHIFT;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::real::{Real, Vector3, lit};
use sdfc_vm::settings::Enclosure;

fn settings() -> RenderSettings {
    RenderSettings {
        size: [96, 64],
        aa: 1,
        steps: 256,
        far: 1000.0,
        extended_far: 1000.0,
        threshold_fraction: RenderSettings::DEFAULT_THRESHOLD_FRACTION,
        relaxation: RenderSettings::DEFAULT_RELAXATION,
        cells: CellMode::Auto,
        mode: Mode::Shaded,
        normals: Normals::Exact,
        occlusion: Occlusion::Off,
        occlusion_reach: 1.0,
        tonemap: Tonemap::None,
        exposure: 1.0,
        view: View {
            from: [0.0, 0.0, 5.0],
            look: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            lens: ResolvedLens::Perspective(0.7),
        },
        parts: vec![],
        enclosure: None,
        lighting: Lighting {
            lights: vec![],
            sky_top: [0.2, 0.4, 0.9],
            sky_horizon: [0.8; 3],
            sky_ground: [0.1; 3],
            up: [0.0, 1.0, 0.0],
            ambient: 1.0,
            fog: None,
        },
        is_2d: false,
    }
}

fn render_image(field: &dyn RenderField, settings: &RenderSettings) -> Image {
    let picture = prepare(settings, &field.facts());
    render(field, &picture, &|_| ()).expect("nothing stops it")
}

/// The normal of a pixel, in `f64`.
fn normal_at(image: &Image, pixel: usize) -> DVec3 {
    Vec3::from(image.normal[pixel]).as_dvec3()
}

/// The ray through the sample of a pixel, in `f64` and from the settings alone.
fn ray(settings: &RenderSettings, x: usize, y: usize) -> (DVec3, DVec3) {
    let view = &settings.view;
    let from = DVec3::from(view.from);
    let unit = |v: DVec3| v / v.length();
    let forward = unit(DVec3::from(view.look) - from);
    let right = unit(forward.cross(view.up.into()));
    let up = right.cross(forward);
    let [w, h] = settings.size.map(f64::from);
    let [sample_x, sample_y] = SAMPLE_SHIFT.map(|shift| 0.5 + shift);
    let (u, v) = (
        (x as f64 + sample_x) / w * 2.0 - 1.0,
        1.0 - (y as f64 + sample_y) / h * 2.0,
    );
    match view.lens {
        ResolvedLens::Perspective(fov) => {
            let k = (fov / 2.0).tan();
            let direction = forward + k * (right * u * w / h + up * v);
            (from, unit(direction))
        }
        ResolvedLens::Orthographic(height) => {
            let k = height / 2.0;
            (from + k * (right * u * w / h + up * v), forward)
        }
    }
}

/// The parameters at which a ray enters and leaves a sphere, if it hits it.
fn sphere_crossings(sphere: &Sphere, (from, direction): (DVec3, DVec3)) -> Option<(f64, f64)> {
    let to = DVec3::from(sphere.centre) - from;
    let middle = to.dot(direction);
    let aside = to - middle * direction;
    let half = sphere.radius * sphere.radius - aside.length_squared();
    (half >= 0.0).then(|| (middle - half.sqrt(), middle + half.sqrt()))
}

/// Compares the image of a sphere with the quadratic equation. Every hit and miss is correct except at the
/// very edge, and depths have a relative error of at most `tolerance`.
fn check_sphere(sphere: Sphere, settings: &RenderSettings, tolerance: f64) {
    let field = Analytic(sphere);
    let image = render_image(&field, settings);
    let sphere = &field.0;
    let (mut worst, mut hits) = (0.0_f64, 0);
    for y in 0..image.height {
        for x in 0..image.width {
            let index = y * image.width + x;
            // At the edge, a miss within a quarter of half a pixel counts as a hit.
            let wider = Sphere {
                centre: sphere.centre,
                radius: sphere.radius * 1.01,
            };
            let smaller = Sphere {
                centre: sphere.centre,
                radius: sphere.radius * 0.98,
            };
            let ray = ray(settings, x, y);
            let status = image.status[index];
            if sphere_crossings(&wider, ray).is_none() {
                assert_eq!(status, Status::Miss, "pixel {x} {y}");
                assert_eq!(image.depth[index], f32::INFINITY);
                continue;
            }
            if sphere_crossings(&smaller, ray).is_none() {
                continue;
            }
            let (enter, _) = sphere_crossings(sphere, ray).expect("a hit");
            assert_eq!(status, Status::Hit, "pixel {x} {y}");
            worst = worst.max((f64::from(image.depth[index]) - enter).abs() / enter);
            hits += 1;
        }
    }
    assert!(hits > 500, "{hits} hits");
    assert!(worst <= tolerance, "a depth is off by {worst:e} of itself");
}

#[test]
fn a_sphere_has_its_hits_and_depths() {
    check_sphere(
        Sphere {
            centre: [0.3, -0.2, 0.1],
            radius: 1.2,
        },
        &settings(),
        2e-6,
    );
    let view = View {
        lens: ResolvedLens::Orthographic(4.0),
        ..settings().view
    };
    check_sphere(
        Sphere {
            centre: [0.3, -0.2, 0.1],
            radius: 1.2,
        },
        &RenderSettings { view, ..settings() },
        2e-6,
    );
}

#[test]
fn distant_spheres_are_as_exact() {
    for distance in [1e4, 1e6] {
        let view = View {
            from: [0.0, 0.0, distance * 5.0],
            look: [0.0; 3],
            ..settings().view
        };
        let ball = Sphere {
            centre: [0.0; 3],
            radius: distance * 1.2,
        };
        check_sphere(
            ball,
            &RenderSettings {
                view,
                far: distance * 100.0,
                ..settings()
            },
            2e-6,
        );
        // The equivalent view from a camera at the origin, of a distant sphere.
        let view = View {
            from: [0.0; 3],
            look: [0.0, 0.0, -1.0],
            ..settings().view
        };
        let ball = Sphere {
            centre: [0.0, 0.0, -5.0 * distance],
            radius: distance * 1.2,
        };
        check_sphere(
            ball,
            &RenderSettings {
                view,
                far: distance * 100.0,
                ..settings()
            },
            2e-6,
        );
    }
}

/// At a distance of a million, coordinates near the sphere that are rounded at the camera would have an error
/// of a sixteenth. Rays that start near the sphere have normals as good as those of a near camera.
#[test]
fn a_telescope_shows_a_sphere_as_round() {
    let ball = || Sphere {
        centre: [0.3, -0.2, 0.1],
        radius: 1.2,
    };
    let lenses = [
        ResolvedLens::Perspective(4e-6),
        ResolvedLens::Perspective(2e-5),
        ResolvedLens::Orthographic(4.0),
    ];
    for lens in lenses {
        let view = View {
            from: [6e5, 5e5, 6e5],
            look: [0.3, -0.2, 0.1],
            up: [0.0, 1.0, 0.0],
            lens,
        };
        let settings = RenderSettings {
            view,
            far: 1e7,
            ..settings()
        };
        let image = render_image(&Analytic(Boxed(ball())), &settings);
        let (mut worst, mut hits) = (0.0_f64, 0);
        for index in 0..image.status.len() {
            let (from, direction) = ray(&settings, index % 96, index / 96);
            let ball = ball();
            let Some((enter, _)) = sphere_crossings(&ball, (from, direction)) else {
                // A near miss, within a fraction of a pixel, counts as a hit.
                let wider = Sphere {
                    radius: 1.3,
                    ..ball
                };
                let is_near_miss = sphere_crossings(&wider, (from, direction)).is_some();
                let missed = image.status[index] == Status::Miss;
                assert!(is_near_miss || missed, "{lens:?}, pixel {index}");
                continue;
            };
            let normal = (from + enter * direction - DVec3::from(ball.centre)) / ball.radius;
            // At the edge a tiny offset rotates the normal.
            if -normal.dot(direction) < 0.2 {
                continue;
            }
            assert_eq!(image.status[index], Status::Hit, "{lens:?}, pixel {index}");
            let depth = f64::from(image.depth[index]);
            assert!((depth - enter).abs() < 0.1, "{lens:?}: {depth} {enter}");
            let sine = normal.cross(normal_at(&image, index)).length();
            worst = worst.max(sine.to_degrees());
            hits += 1;
        }
        assert!(hits > 40, "{lens:?}: {hits} hits");
        assert!(
            worst < 0.002,
            "{lens:?}: a normal is off by {worst} degrees"
        );
    }
}

/// A cube with known bounds.
struct Cube(f64);

impl Formula for Cube {
    fn distance<R: Real>(&self, p: R::Vec3) -> R {
        let q = p.abs() - R::Vec3::splat(R::constant(self.0));
        q.max(R::Vec3::splat(lit(0.0))).length() + q.max_component().min(lit(0.0))
    }
    fn bounds(&self) -> Bounds {
        Bounds::centred([self.0; 3])
    }
}

/// The corner of a cube is the point of a box farthest in front of its centre.
#[test]
fn a_telescope_sees_the_corner_of_a_cube() {
    for lens in [
        ResolvedLens::Perspective(1e-5),
        ResolvedLens::Orthographic(2.0),
    ] {
        let settings = RenderSettings {
            size: [65, 65],
            view: View {
                from: [2e5; 3],
                look: [0.0; 3],
                up: [0.0, 1.0, 0.0],
                lens,
            },
            far: 1e7,
            ..settings()
        };
        let image = render_image(&Analytic(Cube(1.0)), &settings);
        let middle = 32 * 65 + 32;
        assert_eq!(image.status[middle], Status::Hit, "{lens:?}");
        let (depth, corner) = (f64::from(image.depth[middle]), (2e5 - 1.0) * 3.0_f64.sqrt());
        assert!(
            (depth - corner).abs() < 0.1,
            "{lens:?}: {depth}, not {corner}"
        );
    }
}

/// The ground: a half-space below a height.
struct Ground(f64);

impl Formula for Ground {
    fn distance<R: Real>(&self, p: R::Vec3) -> R {
        p.y() - R::constant(self.0)
    }
}

#[test]
fn the_ground_is_flat_up_to_the_horizon() {
    let mut settings = settings();
    settings.view.from = [0.0, 1.0, 0.0];
    settings.view.look = [0.0, 0.9, -1.0];
    settings.enclosure = Some(Enclosure {
        bounds: Bounds::EMPTY,
        half_spaces: vec![[0.0, 1.0, 0.0, 0.0]],
        exact_half_spaces: 1,
        solid_half_spaces: 1,
        solid_depth: 0.0,
    });
    let image = render_image(&Analytic(Ground(0.0)), &settings);
    let (mut worst, mut most_slanted) = (0.0_f64, 1.0_f64);
    for y in 0..image.height {
        for x in 0..image.width {
            let (from, way) = ray(&settings, x, y);
            let t = -from[1] / way[1];
            let index = y * image.width + x;
            if way[1] > -1e-3 || t > 900.0 {
                continue;
            }
            assert_eq!(image.status[index], Status::Hit, "pixel {x} {y}, {t} away");
            worst = worst.max((f64::from(image.depth[index]) - t).abs() / t);
            most_slanted = most_slanted.min(-way[1]);
        }
    }
    assert!(
        most_slanted < 0.02,
        "the picture has no grazing rays: {most_slanted}"
    );
    assert!(worst < 1e-5, "a depth is off by {worst:e} of itself");
    assert_eq!(image.stats.rays(), 96 * 64);
    assert_eq!(image.stats.nans, 0);
}

#[test]
fn from_inside_the_far_side_is_seen() {
    let ball = Sphere {
        centre: [0.0, 0.0, 4.0],
        radius: 2.0,
    };
    let settings = settings();
    let field = Analytic(ball);
    let image = render_image(&field, &settings);
    assert_eq!(image.stats.inside, 96 * 64);
    for y in 0..image.height {
        for x in 0..image.width {
            let ray = ray(&settings, x, y);
            let (_, leave) = sphere_crossings(&field.0, ray).expect("the camera is inside");
            let index = y * image.width + x;
            assert!((f64::from(image.depth[index]) - leave).abs() < 1e-5 * leave);
            // The surface faces the camera.
            assert!(normal_at(&image, index).dot(ray.1) < 0.0);
        }
    }
}

#[test]
fn rays_out_of_steps_are_counted() {
    let mut settings = settings();
    settings.steps = 3;
    settings.view.from = [0.0, 1.0, 0.0];
    settings.view.look = [0.0, 0.9, -1.0];
    let image = render_image(&Analytic(Ground(0.0)), &settings);
    assert!(image.stats.step_caps > 1000, "{:?}", image.stats);
    assert_eq!(image.stats.rays(), 96 * 64);
    assert!(image.steps.iter().all(|&steps| steps <= 3 + 6));
}

#[test]
fn rays_that_end_at_far_are_counted_where_the_scene_goes_on() {
    let mut settings = settings();
    settings.view.from = [0.0, 1.0, 0.0];
    settings.view.look = [0.0, 0.9, -1.0];
    settings.far = 20.0;
    let ground = render_image(&Analytic(Ground(0.0)), &settings).stats;
    assert_eq!(ground.at_far, ground.misses);
    let places = (0..64).flat_map(|y| (0..96).map(move |x| (x, y)));
    let beyond = places.filter(|&(x, y)| {
        let (from, way) = ray(&settings, x, y);
        way[1] >= 0.0 || -from[1] / way[1] > settings.far
    });
    let expected = beyond.count() as u64;
    assert!(expected > 1000, "{expected}");
    assert!(
        ground.at_far.abs_diff(expected) <= 96,
        "{ground:?}, {expected}"
    );
    // Rays leave a finite scene without reaching `far`; a sphere behind `far` is cut off.
    let bounded = Analytic(Boxed(Sphere {
        centre: [0.0, 0.0, -10.0],
        radius: 2.0,
    }));
    let ball = render_image(&bounded, &settings).stats;
    assert!(ball.misses > 1000 && ball.at_far == 0, "{ball:?}");
    settings.far = 9.0;
    let cut = render_image(&bounded, &settings).stats;
    assert!(cut.at_far > 100 && cut.at_far < cut.misses, "{cut:?}");
}

/// NaN everywhere, or on one side.
struct Broken {
    everywhere: bool,
}

impl Formula for Broken {
    fn distance<R: Real>(&self, p: R::Vec3) -> R {
        let nan = R::constant(f64::NAN);
        let beside = if self.everywhere {
            nan
        } else {
            (p.x() - lit(0.1)).sqrt()
        };
        (p.length() - lit(1.0)) + beside * lit(0.0)
    }
}

#[test]
fn nan_ends_rays() {
    for mode in [Mode::Shaded, Mode::Steps, Mode::Distance, Mode::Edges] {
        for everywhere in [true, false] {
            let lights = vec![lamp(ResolvedShadow::Soft(0.1))];
            let lighting = Lighting {
                lights,
                ..settings().lighting
            };
            let occlusion = Occlusion::Multi(4);
            let settings = RenderSettings {
                mode,
                lighting,
                occlusion,
                ..settings()
            };
            let image = render_image(&Analytic(Broken { everywhere }), &settings);
            let min_count = if everywhere { 96 * 64 } else { 96 * 64 / 3 };
            assert!(image.stats.nans >= min_count, "{mode:?}: {:?}", image.stats);
            assert!(
                image.color.iter().flatten().all(|c| c.is_finite()),
                "{mode:?}"
            );
        }
    }
}

/// A sphere with known bounds.
struct Boxed(Sphere);

impl Formula for Boxed {
    fn distance<R: Real>(&self, p: R::Vec3) -> R {
        self.0.distance(p)
    }
    fn bounds(&self) -> Bounds {
        Bounds {
            min: self.0.centre.map(|c| c - self.0.radius),
            max: self.0.centre.map(|c| c + self.0.radius),
        }
    }
}

#[test]
fn bounds_change_nothing_but_the_work() {
    let ball = || Sphere {
        centre: [0.3, -0.2, 0.1],
        radius: 1.2,
    };
    let free = render_image(&Analytic(ball()), &settings());
    let bound = render_image(&Analytic(Boxed(ball())), &settings());
    let [less, more] = [&bound, &free].map(|image| image.stats.evaluations);
    assert!(less < more * 3 / 4, "{less} instead of {more}");
    let mut differences = 0;
    for at in 0..free.status.len() {
        if free.status[at] != bound.status[at] {
            differences += 1;
            continue;
        }
        // Rays that only touch the sphere have no well-defined root.
        let (_, way) = ray(&settings(), at % 96, at / 96);
        let facing = -normal_at(&free, at).dot(way);
        let slanted = facing < 0.1;
        if free.status[at] == Status::Hit && !slanted {
            let (a, b) = (free.depth[at], bound.depth[at]);
            assert!(
                (a - b).abs() < 1e-5 * a,
                "{a} {b}, {:?} {facing}",
                free.normal[at]
            );
        }
    }
    assert!(differences <= 4, "{differences} pixels at the edge");
}

fn lamp(shadow: ResolvedShadow) -> ResolvedLight {
    let source = LightEmitter::Directional([0.3, 0.5, 0.4]);
    ResolvedLight {
        source,
        color: [2.0; 3],
        shadow,
    }
}

/// A sphere with waves on it, with a slope of at most one.
struct Wavy;

impl Formula for Wavy {
    fn distance<R: Real>(&self, p: R::Vec3) -> R {
        let wave = |v: R| (v * lit(6.0)).sin();
        (p.length() - lit(1.2) + wave(p.x()) * wave(p.y()) * wave(p.z()) * lit(0.1)) * lit(0.625)
    }
}

#[test]
fn all_ways_to_find_normals_agree() {
    let with = |normals| {
        render_image(
            &Analytic(Wavy),
            &RenderSettings {
                normals,
                ..settings()
            },
        )
    };
    let exact = with(Normals::Exact);
    for (method, tolerance) in [
        (Normals::Forward, 0.15),
        (Normals::Reverse, 0.15),
        (Normals::Central, 0.1),
        (Normals::Tetrahedron, 0.15),
        (Normals::Wide, 0.5),
    ] {
        let image = with(method);
        let mut angles: Vec<f64> = (0..image.normal.len())
            .filter(|&index| exact.status[index] == Status::Hit)
            .map(|index| {
                let sine = normal_at(&exact, index).cross(normal_at(&image, index));
                sine.length().asin().to_degrees()
            })
            .collect();
        angles.sort_by(f64::total_cmp);
        let p99 = angles[angles.len() * 99 / 100];
        assert!(angles.len() > 1000 && p99 < tolerance, "{method:?}: {p99}°");
    }
}

#[test]
fn more_samples_measure_areas() {
    let view = View {
        lens: ResolvedLens::Orthographic(2.0),
        ..settings().view
    };
    let ball = Analytic(Sphere {
        centre: [0.0; 3],
        radius: 0.7,
    });
    let settings = RenderSettings {
        aa: 4,
        mode: Mode::Mask,
        view,
        ..settings()
    };
    let image = render_image(&ball, &settings);
    assert_eq!(image.stats.rays(), 96 * 64 * 16);
    let pixel = 2.0 / 64.0;
    let area: f64 = image.color.iter().map(|c| f64::from(c[3])).sum::<f64>() * pixel * pixel;
    let expected = std::f64::consts::PI * 0.49;
    assert!(
        (area / expected - 1.0).abs() < 0.005,
        "{area} for {expected}"
    );
}

#[test]
fn shapes_in_the_plane_are_filled() {
    let view = View::plane([0.0, 0.0], 2.0);
    let ball = Analytic(Sphere {
        centre: [0.0; 3],
        radius: 0.7,
    });
    for mode in [Mode::Mask, Mode::Shaded] {
        let settings = RenderSettings {
            mode,
            view,
            is_2d: true,
            ..settings()
        };
        let image = render_image(&ball, &settings);
        let area: f64 = image.color.iter().map(|c| f64::from(c[3])).sum::<f64>() / 1024.0;
        let expected = std::f64::consts::PI * 0.49;
        assert!(
            (area / expected - 1.0).abs() < 0.002,
            "{area} for {expected}"
        );
        assert_eq!(image.stats.evaluations, 96 * 64);
    }
}

#[test]
fn pictures_of_any_size_come_out_the_same_every_time() {
    for size in [[1, 1], [7, 3], [33, 65], [64, 1]] {
        for mode in [Mode::Shaded, Mode::Edges, Mode::Normal] {
            let settings = RenderSettings {
                size,
                mode,
                ..settings()
            };
            let ball = Analytic(Sphere {
                centre: [0.0; 3],
                radius: 1.0,
            });
            let (a, b) = (
                render_image(&ball, &settings),
                render_image(&ball, &settings),
            );
            assert_eq!(a.rgba8().len(), (size[0] * size[1] * 4) as usize);
            assert_eq!(a.color, b.color);
            assert_eq!(a.stats, b.stats);
        }
    }
}

#[test]
fn lines_are_drawn_around_shapes() {
    let settings = RenderSettings {
        mode: Mode::Edges,
        ..settings()
    };
    let image = render_image(
        &Analytic(Sphere {
            centre: [0.0; 3],
            radius: 1.0,
        }),
        &settings,
    );
    let dark = |x: usize, y: usize| image.color[y * image.width + x][0] < 0.3;
    let row: Vec<usize> = (0..image.width).filter(|&x| dark(x, 32)).collect();
    assert_eq!(row.len(), 2, "{row:?}");
    let inside = row[0] + 5..row[1] - 5;
    assert!(inside.clone().len() > 20 && inside.into_iter().all(|x| !dark(x, 32)));
}

#[test]
fn images_are_encoded_as_the_bytes_of_their_values() {
    // Modes that show numbers are not encoded as light.
    let settings = RenderSettings {
        mode: Mode::Normal,
        ..settings()
    };
    let image = render_image(&Analytic(Ground(-1.0)), &settings);
    let index = 63 * image.width + 40;
    assert_eq!(
        &image.rgba8()[index * 4..index * 4 + 4],
        &[128, 255, 128, 255]
    );
}
