//! Tests of slopes, cells, objects, steps and differences.

use super::*;
use crate::inspect::slice::{FrontSurfaces, Slice};
use crate::inspect::slopes::{SlopeClass, classify_slopes};
use sdfc_runtime::cells::{Aabb, CellInfo};
use std::collections::HashSet;

/// Returns a slice in the plane z = 0 with a half side of 1.5.
fn upright() -> Slice {
    Slice {
        point: [0.0; 3],
        normal: [0.0, 0.0, 1.0],
        half_side: Some(1.5),
        front: FrontSurfaces::Ghost,
    }
}

/// Returns a field whose slope near the origin is `steep`, with a stated bound of 2. No bound of it can
/// be derived.
fn stating(steep: &str) -> String {
    format!(
        "camera {{ from: [0, 0, 9], look: [0, 0, 0], fov: 30deg }}\n\
         field(fn(p) => ({steep} + 1e-6 * pow(abs(p.x), 0.5)) * (length(p.xz) - 1), lipschitz: 2)"
    )
}

#[test]
fn a_stated_slope_that_does_not_hold_is_marked_where_it_does_not() {
    // The compiler samples no point in a slice this thin.
    let steep_on_the_right = stating("2 + step(0, p.x) * step(abs(p.z), 1e-7)");
    let mut fixture = Fixture::new(&steep_on_the_right, [96, 96]);
    let image = fixture.image();
    let query_points = upright()
        .visible_part(&image, &fixture.settings)
        .query_points;
    let samples = fixture.sample(&query_points);
    let classified = classify_slopes(&query_points, &samples, 96);
    let (mut right, mut left) = (0, 0);
    for (&[x, y, _], &slope) in query_points.points.iter().zip(&classified.classes) {
        let within = x.hypot(y) < 1.4 && x.hypot(y) > 0.05;
        if within && x.abs() > 0.06 {
            let expected = if x > 0.0 {
                SlopeClass::Steep
            } else {
                SlopeClass::Good
            };
            assert_eq!(slope, expected, "at {x}, {y}");
            right += usize::from(x > 0.0);
            left += usize::from(x < 0.0);
        }
    }
    assert!(right > 500 && left > 500, "{right} {left}");
    let counts = classified.counts;
    assert!(
        counts.steep >= right && counts.steep < right + left,
        "{counts:?}"
    );
    assert!((counts.max_slope - 1.5).abs() < 1e-3, "{counts:?}");
    // The field is discontinuous where the two halves meet.
    assert!(
        counts.discontinuities > 50 && counts.discontinuities < 200,
        "{counts:?}"
    );
    let mut picture = vec![128; 96 * 96 * 4];
    classified.draw(&mut picture, &query_points);
    let [r, g, b] = [0, 1, 2].map(|i| picture[4 * (48 * 96 + 60) + i]);
    assert!(r > 180 && g < 60 && b < 90, "{r} {g} {b}");
    assert_eq!(picture[4 * (48 * 96 + 36)..][..3], [128; 3]);
}

#[test]
fn valid_slopes_are_not_marked_and_slow_ones_are_counted() {
    for (steep, slow) in [("2", false), ("1.01", false), ("0.9", true)] {
        let mut fixture = Fixture::new(&stating(steep), [64, 64]);
        let image = fixture.image();
        let surface = QueryPoints::on_surface(&image, &fixture.settings);
        assert!(surface.points.len() > 200, "{steep}");
        let samples = fixture.sample(&surface);
        let counts = classify_slopes(&surface, &samples, 64).counts;
        let expected = if slow { counts.points } else { 0 };
        assert_eq!(
            (counts.steep, counts.discontinuities, counts.slow),
            (0, 0, expected),
            "{steep}: {counts:?}"
        );
    }
}

/// A row of spheres, so that different cells have different programs.
const ROW: &str = "camera { from: [0, 2, 9], look: [0, 0, 0], fov: 40deg }\n\
    union(for i in 0..9 { sphere(0.4).translate(i - 4, 0, 0) })";

fn overlap(a: &Aabb, b: &Aabb) -> bool {
    (0..3).all(|i| a.low[i].max(b.low[i]) < a.high[i].min(b.high[i]))
}

#[test]
fn cells_tile_space() {
    let mut fixture = Fixture::new(ROW, [160, 90]);
    fixture.settings.cells = CellMode::Always;
    let image = fixture.image();
    let query_points = upright()
        .visible_part(&image, &fixture.settings)
        .query_points;
    let parts = fixture
        .engine
        .cells_at(&fixture.settings, &query_points.points);
    let parts = parts.expect("the CPU answers").expect("it has cells");
    let inside: Vec<(&CellInfo, &[f32; 3])> = (parts.iter().zip(&query_points.points))
        .filter_map(|(part, p)| Some((part.as_ref()?, p)))
        .collect();
    assert!(inside.len() > 1000, "{}", inside.len());
    let mut kinds = HashSet::new();
    let mut distinct: Vec<CellInfo> = Vec::new();
    for (part, p) in inside {
        assert!(
            part.region
                .with_margin(Default::default(), 0.0)
                .contains(*p),
            "{part:?} {p:?}"
        );
        kinds.insert(part.clauses);
        if !distinct.contains(part) {
            distinct.push(*part);
        }
    }
    for (i, a) in distinct.iter().enumerate() {
        for b in &distinct[..i] {
            assert!(!overlap(&a.region, &b.region), "{a:?} {b:?}");
        }
    }
    // Cells contain one sphere, several, or none.
    assert!(kinds.len() > 2 && kinds.contains(&None), "{kinds:?}");
    let on_surface = QueryPoints::on_surface(&image, &fixture.settings);
    let parts = fixture
        .engine
        .cells_at(&fixture.settings, &on_surface.points);
    let parts = parts.expect("the CPU answers").expect("it has cells");
    assert!(
        parts
            .iter()
            .all(|part| part.is_some_and(|part| part.clauses.is_some()))
    );
}

#[test]
fn without_cells_there_is_nothing_to_show() {
    let mut fixture = Fixture::new(ROW, [32, 18]);
    fixture.settings.cells = CellMode::Never;
    let points = [[0.0; 3]];
    assert_eq!(
        fixture.engine.cells_at(&fixture.settings, &points),
        Ok(None)
    );
    let mut figure = Fixture::new("circle(1)", [32, 32]);
    figure.settings.cells = CellMode::Always;
    assert_eq!(figure.engine.cells_at(&figure.settings, &points), Ok(None));
}

#[test]
fn longer_programs_are_brighter_and_lines_part_cells() {
    let part = |x: f32, clauses| {
        Some(CellInfo {
            region: Aabb {
                low: [x, 0.0, 0.0],
                high: [x + 1.0, 1.0, 1.0],
            },
            clauses,
        })
    };
    let query_points = QueryPoints {
        pixels: (0..6).collect(),
        points: vec![[0.0; 3]; 6],
    };
    let (few, many) = (part(0.0, Some(2)), part(1.0, Some(60)));
    let parts = [few, few, few, many, many, part(2.0, None)];
    let mut picture = vec![0; 4 * 6];
    let legend = cells::draw(&mut picture, 6, &query_points, &parts, 64, false);
    assert_eq!(
        (legend.max, legend.mean),
        (60, (3 * 2 + 2 * 60) as f64 / 6.0)
    );
    let numbers: Vec<usize> = legend.entries.iter().map(|(n, _)| *n).collect();
    assert_eq!(numbers, [1, 4, 16, 64]);
    let light = |pixel: usize| {
        picture[4 * pixel..][..3]
            .iter()
            .map(|&v| u32::from(v))
            .sum::<u32>()
    };
    assert_eq!(light(0), light(1));
    assert!(light(2) < light(1), "a line before the next cell");
    assert!(light(3) > light(1) + 100);
    assert!(light(4) < light(3), "a line before the idle part");
    assert!(light(5) > 600, "pale where nothing is run");
}

#[test]
fn objects_have_colours_of_their_own() {
    let colors: Vec<[u8; 4]> = (1..=24).map(objects::color).collect();
    for (i, a) in colors.iter().enumerate() {
        for b in &colors[..i] {
            let difference: u32 = a
                .iter()
                .zip(b)
                .map(|(a, b)| u32::from(a.abs_diff(*b)))
                .sum();
            assert!(difference > 12, "{a:?} {b:?}");
        }
        if let Some(next) = colors.get(i + 1) {
            let difference: u32 = a
                .iter()
                .zip(next)
                .map(|(a, b)| u32::from(a.abs_diff(*b)))
                .sum();
            assert!(difference > 90, "neighbours in the text: {a:?} {next:?}");
        }
    }
}

#[test]
fn the_object_under_the_cursor_is_picked_out() {
    let mut fixture = Fixture::new(ROW, [160, 90]);
    let settings = fixture.settings.clone();
    let image = fixture.leaves.render(&settings, &|_| {}).expect("draws");
    let shown: HashSet<u32> = image.id.iter().copied().collect();
    assert_eq!(shown.len(), 10, "nine balls and nothing");
    let leaf = objects::leaf_at(&image, [80, 45]);
    assert_eq!(leaf, 5, "the middle of nine");
    let unpicked = objects::draw(&image, &settings, None);
    let picked = objects::draw(&image, &settings, Some(leaf));
    let color_at = |picture: &[u8], pixel: [usize; 2]| -> [u8; 3] {
        std::array::from_fn(|i| picture[4 * (pixel[1] * 160 + pixel[0]) + i])
    };
    let light = |[r, g, b]: [u8; 3]| u32::from(r) + u32::from(g) + u32::from(b);
    assert_eq!(color_at(&unpicked, [80, 45]), color_at(&picked, [80, 45]));
    let other = image.id.iter().position(|&id| id == 2).expect("seen");
    let other = [other % 160, other / 160 + 3];
    assert!(light(color_at(&picked, other)) < light(color_at(&unpicked, other)));
    let white = picked
        .chunks(4)
        .filter(|pixel| pixel[..3].iter().all(|&v| v > 220));
    let outline_pixels = white.count();
    let leaf_pixels = image.id.iter().filter(|&&id| id == leaf).count();
    assert!(
        outline_pixels > 20 && outline_pixels < leaf_pixels,
        "{outline_pixels} pixels around {leaf_pixels}"
    );
}

#[test]
fn steps_fill_their_scale() {
    let mut fixture = Fixture::new(ROW, [160, 90]);
    let image = fixture.image();
    let (picture, legend) = steps::draw(&image);
    assert_eq!(picture.len(), 160 * 90 * 4);
    let top = legend.entries.last().expect("entries").0;
    let above = image.steps.iter().filter(|&&steps| steps > top).count();
    assert!(above <= 160 * 90 / 200, "{above}");
    assert!(top < 4 * legend.max.max(8), "{legend:?}");
    assert_eq!(legend.max, image.steps.iter().copied().max().unwrap_or(0));
}

#[test]
fn pictures_that_are_equal_have_no_difference() {
    let mut fixture = Fixture::new(ROW, [64, 36]);
    let image = fixture.image();
    let no_difference = difference::difference(&image, &image).expect("of one size");
    assert_eq!(no_difference.failures, [""; 0]);
    assert_eq!(
        (
            no_difference.numbers.differing,
            no_difference.numbers.hit_mismatches
        ),
        (0, 0)
    );
    let is_grey = |pixel: &[u8]| pixel[0] == pixel[1] && pixel[1] == pixel[2];
    assert!(no_difference.picture.chunks(4).all(is_grey));
    let mut other = image.clone();
    let ball = image.id.len() / 2 + 32;
    other.color[ball] = [9.0, 0.0, 0.0, 1.0];
    let one_pixel = difference::difference(&image, &other).expect("of one size");
    assert_eq!(one_pixel.numbers.differing, 1);
    let marked = (0..image.id.len())
        .filter(|&i| one_pixel.picture[4 * i..][..4] != no_difference.picture[4 * i..][..4]);
    assert_eq!(marked.collect::<Vec<_>>(), [ball], "{one_pixel}");
    fixture.settings.size = [32, 18];
    assert!(difference::difference(&image, &fixture.image()).is_none());
}
