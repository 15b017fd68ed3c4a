//! Slices of shapes whose distance is a formula.

use super::*;
use crate::seeing::slice::{Front, Slice};
use sdfc_runtime::frame::{Lens, Mode, View};
use sdfc_vm::real::Vector3;

const BALL: &str = "camera { from: [0, 3, 4], look: [0, 0, 0], fov: 40deg }\nsphere(1)";

fn length([x, y, z]: [f32; 3]) -> f32 {
    (x * x + y * y + z * z).sqrt()
}

fn level(front: Front) -> Slice {
    Slice {
        point: [0.0; 3],
        normal: [0.0, 2.0, 0.0],
        reach: Some(2.0),
        front,
    }
}

#[test]
fn what_is_asked_lies_on_the_plane_and_before_the_surface() {
    let mut stage = Stage::of(BALL, [160, 90]);
    let frame = stage.frame();
    let seen = level(Front::Hides).cut(&frame, &stage.settings).asked;
    let all = level(Front::Ghost).cut(&frame, &stage.settings).asked;
    assert!(seen.points.len() > 1000, "{}", seen.points.len());
    for &[x, y, z] in &all.points {
        assert!(
            y.abs() < 1e-5 && x.abs() < 2.1 && z.abs() < 2.1,
            "{x} {y} {z}"
        );
    }
    // What is inside of the ball, or behind it, is hidden by it.
    for &p in &seen.points {
        assert!(length(p) > 0.999, "{p:?}");
    }
    let hidden = all.points.len() - seen.points.len();
    let inside = all.points.iter().filter(|&&p| length(p) < 1.0).count();
    assert!(inside > 300 && hidden > inside, "{inside} {hidden}");
}

#[test]
fn the_bold_line_is_where_the_field_is_zero_and_as_wide_from_all_sides() {
    for from in ["[0, 6, 0.1]", "[0, 1.2, 5]", "[3, 2, -4]"] {
        let text = format!("camera {{ from: {from}, look: [0, 0, 0], fov: 40deg }}\nsphere(1)");
        let mut stage = Stage::of(&text, [320, 180]);
        let frame = stage.frame();
        let cut = level(Front::Ghost).cut(&frame, &stage.settings);
        let samples = stage.ask(&cut.asked);
        let mut picture = vec![255; 320 * 180 * 4];
        cut.draw(&mut picture, &samples);
        let rays = Rays::of(&stage.settings);
        let plane = level(Front::Ghost);
        let mut dark = 0;
        for (&pixel, &p) in cut.asked.pixels.iter().zip(&cut.asked.points) {
            let [column, row] = [pixel % 320, pixel / 320].map(f64::from);
            // How many pixels away the circle is: the distance there and in the neighbours, in f64.
            let away = |x: f64, y: f64| -> f64 {
                let ray = rays.through([column + x, row + y]);
                plane.meet(&ray).map_or(9.0, |t| ray.at(t).length() - 1.0)
            };
            let here = away(0.0, 0.0);
            let change = (away(1.0, 0.0) - here).hypot(away(0.0, 1.0) - here);
            let pixels = here.abs() / change;
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
                assert_eq!(is_warm, here > 0.0, "{from}: {p:?} is {r} {g} {b}");
            }
        }
        assert!(dark > 100, "{from}: {dark} dark pixels");
    }
}

#[test]
fn colours_are_those_of_the_mode_distance() {
    let mut stage = Stage::of(
        "box([1.2, 0.8, 0.5]) | sphere(0.4).translate(1.1, 0.3, 0)",
        [160, 90],
    );
    stage.settings.view = View {
        from: [0.0, 0.0, 5.0],
        look: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        lens: Lens::Orthographic(2.4),
    };
    stage.settings.far = 20.0;
    let frame = stage.frame();
    let slice = Slice {
        point: [0.0; 3],
        normal: [0.0, 0.0, 1.0],
        reach: None,
        front: Front::Ghost,
    };
    let cut = slice.cut(&frame, &stage.settings);
    let samples = stage.ask(&cut.asked);
    stage.settings.mode = Mode::Distance;
    let mode = stage.frame().rgba8();
    // Laid over the colour itself, without surfaces before it, the same colour is left.
    let mut empty = frame.clone();
    empty.depth.fill(f32::INFINITY);
    let cut = slice.cut(&empty, &stage.settings);
    let mut picture = mode.clone();
    cut.draw(&mut picture, &samples);
    let differs = mode.chunks(4).zip(picture.chunks(4)).filter(|(a, b)| {
        let apart = a.iter().zip(b.iter()).map(|(a, b)| a.abs_diff(*b));
        apart.max().unwrap_or(0) > 12
    });
    // Where the field bends, between faces, it changes by less than a pixel's width.
    let differs = differs.count();
    assert!(differs < 160 * 90 / 50, "{differs} pixels differ");
}

#[test]
fn where_the_field_is_the_same_all_over_there_are_no_lines() {
    // The plane is 0.5 above the floor, where a line would be, and a line's width below it.
    for height in [0.5, 0.0] {
        let text = "camera { from: [0, 3, 6], look: [0, 0.5, 0], fov: 40deg }\nplane(Y)";
        let mut stage = Stage::of(text, [80, 45]);
        let frame = stage.frame();
        let slice = Slice {
            point: [0.0, height, 0.0],
            ..level(Front::Ghost)
        };
        let cut = slice.cut(&frame, &stage.settings);
        let samples = stage.ask(&cut.asked);
        let mut picture = vec![255; 80 * 45 * 4];
        cut.draw(&mut picture, &samples);
        let rim = |p: &[f32; 3]| p[0].abs() > 1.2 || p[2].abs() > 1.2;
        let inner = cut.asked.pixels.iter().zip(&cut.asked.points);
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
    let mut stage = Stage::of(text, [80, 45]);
    let frame = stage.frame();
    let floor = |front| Slice {
        point: [0.0, -0.7, 0.0],
        ..level(front)
    };
    let hides = floor(Front::Hides).cut(&frame, &stage.settings);
    let all = floor(Front::Ghost).cut(&frame, &stage.settings);
    assert_eq!(hides, all);
    assert!(all.asked.points.len() > 500);
}

#[test]
fn a_slice_of_a_figure_is_its_plane() {
    let mut stage = Stage::of("circle(1)", [64, 64]);
    let frame = stage.frame();
    let cut = level(Front::Hides).cut(&frame, &stage.settings);
    assert_eq!(cut.asked.pixels.len(), 64 * 64);
    let samples = stage.ask(&cut.asked);
    for (&[x, y, z], sample) in cut.asked.points.iter().zip(&samples) {
        assert!(z.abs() < 1e-6);
        assert!((sample.distance - (x.hypot(y) - 1.0)).abs() < 1e-5);
    }
}

#[test]
fn nothing_panics_where_lists_are_too_short() {
    let mut stage = Stage::of(BALL, [32, 18]);
    let mut frame = stage.frame();
    frame.depth.truncate(10);
    frame.id.truncate(3);
    frame.steps.clear();
    let cut = level(Front::Hides).cut(&frame, &stage.settings);
    let mut picture = vec![0; 101];
    cut.draw(&mut picture, &[Sample::default(); 4]);
    let few = slopes::slopes(&cut.asked, &[Sample::default(); 4], 0);
    few.draw(&mut picture, &cut.asked);
    cells::draw(&mut picture, 0, &cut.asked, &[None; 5], 0, true);
    objects::outline(&mut picture, &frame, 1);
    objects::draw(&frame, &stage.settings, Some(1));
    steps::draw(&frame);
    assert_eq!(objects::leaf_at(&frame, [31, 17]), 0);
    assert_eq!(pick::Spot::at(&frame, &stage.settings, [31, 17]), None);
    fade(&mut picture);
    let nowhere = Slice {
        point: [f64::NAN; 3],
        normal: [0.0; 3],
        reach: Some(f64::NAN),
        front: Front::Ghost,
    };
    assert!(nowhere.cut(&frame, &stage.settings).asked.points.is_empty());
}
