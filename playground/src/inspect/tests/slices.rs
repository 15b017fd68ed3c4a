//! Tests of slices of shapes with closed-form distances.

use super::*;
use crate::inspect::slice::{FrontSurfaces, Slice};
use sdfc_runtime::render::{Mode, ResolvedLens, View};

const SPHERE: &str = "camera { from: [0, 3, 4], look: [0, 0, 0], fov: 40deg }\nsphere(1)";

fn length([x, y, z]: [f32; 3]) -> f32 {
    (x * x + y * y + z * z).sqrt()
}

fn level(front: FrontSurfaces) -> Slice {
    Slice {
        point: [0.0; 3],
        normal: [0.0, 2.0, 0.0],
        half_side: Some(2.0),
        front,
    }
}

#[test]
fn sampled_points_lie_on_the_plane_and_before_the_surface() {
    let mut fixture = Fixture::new(SPHERE, [160, 90]);
    let image = fixture.image();
    let visible = level(FrontSurfaces::Opaque)
        .visible_part(&image, &fixture.settings)
        .query_points;
    let translucent = level(FrontSurfaces::Ghost)
        .visible_part(&image, &fixture.settings)
        .query_points;
    assert!(visible.points.len() > 1000, "{}", visible.points.len());
    for &[x, y, z] in &translucent.points {
        assert!(
            y.abs() < 1e-5 && x.abs() < 2.1 && z.abs() < 2.1,
            "{x} {y} {z}"
        );
    }
    // The sphere hides points inside and behind it.
    for &p in &visible.points {
        assert!(length(p) > 0.999, "{p:?}");
    }
    let hidden = translucent.points.len() - visible.points.len();
    let inside = translucent
        .points
        .iter()
        .filter(|&&p| length(p) < 1.0)
        .count();
    assert!(inside > 300 && hidden > inside, "{inside} {hidden}");
}

#[test]
fn the_bold_line_is_where_the_field_is_zero_and_as_wide_from_all_sides() {
    for from in ["[0, 6, 0.1]", "[0, 1.2, 5]", "[3, 2, -4]"] {
        let text = format!("camera {{ from: {from}, look: [0, 0, 0], fov: 40deg }}\nsphere(1)");
        let mut fixture = Fixture::new(&text, [320, 180]);
        let image = fixture.image();
        let cut = level(FrontSurfaces::Ghost).visible_part(&image, &fixture.settings);
        let samples = fixture.sample(&cut.query_points);
        let mut picture = vec![255; 320 * 180 * 4];
        cut.draw(&mut picture, &samples);
        let rays = PictureRays::new(&fixture.settings);
        let plane = level(FrontSurfaces::Ghost);
        let mut dark = 0;
        for (&pixel, &p) in cut.query_points.pixels.iter().zip(&cut.query_points.points) {
            let [column, row] = [pixel % 320, pixel / 320].map(f64::from);
            // Distance to the circle in pixels, from the distances here and at the adjacent pixels, in
            // `f64`.
            let circle_distance = |x: f64, y: f64| -> f64 {
                let ray = rays.through([column + x, row + y]);
                plane
                    .intersect(&ray)
                    .map_or(9.0, |t| ray.at(t).length() - 1.0)
            };
            let signed_distance = circle_distance(0.0, 0.0);
            let change = (circle_distance(1.0, 0.0) - signed_distance)
                .hypot(circle_distance(0.0, 1.0) - signed_distance);
            let pixels = signed_distance.abs() / change;
            let [r, g, b] = [0, 1, 2].map(|i| picture[4 * pixel as usize + i]);
            let is_dark = u32::from(r) + u32::from(g) + u32::from(b) < 300;
            dark += usize::from(is_dark);
            if pixels < 0.6 {
                assert!(
                    is_dark,
                    "{from}: {p:?}, {pixels} pixels away, is {r} {g} {b}"
                );
            }
            let is_rim = p[0].abs() > 1.9 || p[2].abs() > 1.9;
            if pixels > 2.0 && !is_rim {
                assert!(
                    !is_dark,
                    "{from}: {p:?}, {pixels} pixels away, is {r} {g} {b}"
                );
                let is_warm = r > b;
                assert_eq!(
                    is_warm,
                    signed_distance > 0.0,
                    "{from}: {p:?} is {r} {g} {b}"
                );
            }
        }
        assert!(dark > 100, "{from}: {dark} dark pixels");
    }
}

#[test]
fn colours_are_those_of_the_mode_distance() {
    let mut fixture = Fixture::new(
        "box([1.2, 0.8, 0.5]) | sphere(0.4).translate(1.1, 0.3, 0)",
        [160, 90],
    );
    fixture.settings.view = View {
        from: [0.0, 0.0, 5.0],
        look: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        lens: ResolvedLens::Orthographic(2.4),
    };
    fixture.settings.far = 20.0;
    let image = fixture.image();
    let slice = Slice {
        point: [0.0; 3],
        normal: [0.0, 0.0, 1.0],
        half_side: None,
        front: FrontSurfaces::Ghost,
    };
    let cut = slice.visible_part(&image, &fixture.settings);
    let samples = fixture.sample(&cut.query_points);
    fixture.settings.mode = Mode::Distance;
    let mode = fixture.image().rgba8();
    // Drawn over its own colour, without surfaces in front, the slice leaves the colour unchanged.
    let mut empty = image.clone();
    empty.depth.fill(f32::INFINITY);
    let cut = slice.visible_part(&empty, &fixture.settings);
    let mut picture = mode.clone();
    cut.draw(&mut picture, &samples);
    let differs = mode.chunks(4).zip(picture.chunks(4)).filter(|(a, b)| {
        let difference = a.iter().zip(b.iter()).map(|(a, b)| a.abs_diff(*b));
        difference.max().unwrap_or(0) > 12
    });
    // At kinks between faces the field changes by less than a pixel's width.
    let differs = differs.count();
    assert!(differs < 160 * 90 / 50, "{differs} pixels differ");
}

#[test]
fn constant_fields_have_no_lines() {
    // The slice lies 0.5 above the floor, at the distance of a line, or in the floor.
    for height in [0.5, 0.0] {
        let text = "camera { from: [0, 3, 6], look: [0, 0.5, 0], fov: 40deg }\nplane(Y)";
        let mut fixture = Fixture::new(text, [80, 45]);
        let image = fixture.image();
        let slice = Slice {
            point: [0.0, height, 0.0],
            ..level(FrontSurfaces::Ghost)
        };
        let cut = slice.visible_part(&image, &fixture.settings);
        let samples = fixture.sample(&cut.query_points);
        let mut picture = vec![255; 80 * 45 * 4];
        cut.draw(&mut picture, &samples);
        let rim = |p: &[f32; 3]| p[0].abs() > 1.2 || p[2].abs() > 1.2;
        let inner = cut.query_points.pixels.iter().zip(&cut.query_points.points);
        let inner: Vec<u32> = inner
            .filter(|(_, p)| !rim(p))
            .map(|(&pixel, _)| pixel)
            .collect();
        assert!(inner.len() > 200, "{}", inner.len());
        for pixel in inner {
            let [r, g, b] = [0, 1, 2].map(|i| picture[4 * pixel as usize + i]);
            assert!(r > 200 && g > 150 && b > 90, "{height}: {r} {g} {b}");
        }
    }
}

#[test]
fn a_plane_that_lies_in_a_surface_is_seen() {
    let text = "camera { from: [0, 3, 6], look: [0, 0.5, 0], fov: 40deg }\nplane(Y, at: -0.7)";
    let mut fixture = Fixture::new(text, [80, 45]);
    let image = fixture.image();
    let floor = |front| Slice {
        point: [0.0, -0.7, 0.0],
        ..level(front)
    };
    let hides = floor(FrontSurfaces::Opaque).visible_part(&image, &fixture.settings);
    let translucent = floor(FrontSurfaces::Ghost).visible_part(&image, &fixture.settings);
    assert_eq!(hides, translucent);
    assert!(translucent.query_points.points.len() > 500);
}

#[test]
fn a_slice_of_a_2d_shape_is_its_plane() {
    let mut fixture = Fixture::new("circle(1)", [64, 64]);
    let image = fixture.image();
    let cut = level(FrontSurfaces::Opaque).visible_part(&image, &fixture.settings);
    assert_eq!(cut.query_points.pixels.len(), 64 * 64);
    let samples = fixture.sample(&cut.query_points);
    for (&[x, y, z], sample) in cut.query_points.points.iter().zip(&samples) {
        assert!(z.abs() < 1e-6);
        assert!((sample.distance - (x.hypot(y) - 1.0)).abs() < 1e-5);
    }
}

#[test]
fn nothing_panics_where_lists_are_too_short() {
    let mut fixture = Fixture::new(SPHERE, [32, 18]);
    let mut image = fixture.image();
    image.depth.truncate(10);
    image.id.truncate(3);
    image.steps.clear();
    let cut = level(FrontSurfaces::Opaque).visible_part(&image, &fixture.settings);
    let mut picture = vec![0; 101];
    cut.draw(&mut picture, &[FieldSample::default(); 4]);
    let classes = slopes::classify_slopes(&cut.query_points, &[FieldSample::default(); 4], 0);
    classes.draw(&mut picture, &cut.query_points);
    cells::draw(&mut picture, 0, &cut.query_points, &[None; 5], 0, true);
    objects::outline(&mut picture, &image, 1);
    objects::draw(&image, &fixture.settings, Some(1));
    steps::draw(&image);
    assert_eq!(objects::leaf_at(&image, [31, 17]), 0);
    assert_eq!(
        pick::PixelHit::from_image(&image, &fixture.settings, [31, 17]),
        None
    );
    fade(&mut picture);
    let nowhere = Slice {
        point: [f64::NAN; 3],
        normal: [0.0; 3],
        half_side: Some(f64::NAN),
        front: FrontSurfaces::Ghost,
    };
    assert!(
        nowhere
            .visible_part(&image, &fixture.settings)
            .query_points
            .points
            .is_empty()
    );
}
