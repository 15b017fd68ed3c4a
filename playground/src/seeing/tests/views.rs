//! Slopes, cells, objects, steps and differences.

use super::*;
use crate::seeing::slice::{Front, Slice};
use crate::seeing::slopes::{Slope, slopes};
use sdfc_runtime::cells::{Part, Region};
use std::collections::HashSet;

/// The plane z = 0, as far as a field's region goes.
fn upright() -> Slice {
    Slice {
        point: [0.0; 3],
        normal: [0.0, 0.0, 1.0],
        reach: Some(1.5),
        front: Front::Ghost,
    }
}

/// A field whose slope is `steep` near the origin, stated to be 2. No bound of it can be found.
fn stating(steep: &str) -> String {
    format!(
        "camera {{ from: [0, 0, 9], look: [0, 0, 0], fov: 30deg }}\n\
         field(fn(p) => ({steep} + 1e-6 * pow(abs(p.x), 0.5)) * (length(p.xz) - 1), lipschitz: 2)"
    )
}

#[test]
fn a_stated_slope_that_does_not_hold_is_marked_where_it_does_not() {
    // In so thin a slice no point is tried when the scene is compiled.
    let steep_on_the_right = stating("2 + step(0, p.x) * step(abs(p.z), 1e-7)");
    let mut stage = Stage::of(&steep_on_the_right, [96, 96]);
    let frame = stage.frame();
    let asked = upright().cut(&frame, &stage.settings).asked;
    let samples = stage.ask(&asked);
    let found = slopes(&asked, &samples, 96);
    let (mut right, mut left) = (0, 0);
    for (&[x, y, _], &slope) in asked.points.iter().zip(&found.slopes) {
        let within = x.hypot(y) < 1.4 && x.hypot(y) > 0.05;
        if within && x.abs() > 0.06 {
            let expected = if x > 0.0 { Slope::Steep } else { Slope::Good };
            assert_eq!(slope, expected, "at {x}, {y}");
            right += usize::from(x > 0.0);
            left += usize::from(x < 0.0);
        }
    }
    assert!(right > 500 && left > 500, "{right} {left}");
    let count = found.count;
    assert!(
        count.steep >= right && count.steep < right + left,
        "{count:?}"
    );
    assert!((count.steepest - 1.5).abs() < 1e-3, "{count:?}");
    // Where the two halves meet, the field jumps.
    assert!(count.jumps > 50 && count.jumps < 200, "{count:?}");
    let mut picture = vec![128; 96 * 96 * 4];
    found.draw(&mut picture, &asked);
    let [r, g, b] = [0, 1, 2].map(|i| picture[4 * (48 * 96 + 60) + i]);
    assert!(r > 180 && g < 60 && b < 90, "{r} {g} {b}");
    assert_eq!(picture[4 * (48 * 96 + 36)..][..3], [128; 3]);
}

#[test]
fn slopes_that_hold_are_marked_nowhere_and_slow_ones_told() {
    for (steep, slow) in [("2", false), ("1.01", false), ("0.9", true)] {
        let mut stage = Stage::of(&stating(steep), [64, 64]);
        let frame = stage.frame();
        let surface = Asked::on_surface(&frame, &stage.settings);
        assert!(surface.points.len() > 200, "{steep}");
        let samples = stage.ask(&surface);
        let count = slopes(&surface, &samples, 64).count;
        let expected = if slow { count.points } else { 0 };
        assert_eq!(
            (count.steep, count.jumps, count.slow),
            (0, 0, expected),
            "{steep}: {count:?}"
        );
    }
}

/// A row of balls, so that different programs hold in different places.
const ROW: &str = "camera { from: [0, 2, 9], look: [0, 0, 0], fov: 40deg }\n\
    union(for i in 0..9 { sphere(0.4).translate(i - 4, 0, 0) })";

fn overlap(a: &Region, b: &Region) -> bool {
    (0..3).all(|i| a.low[i].max(b.low[i]) < a.high[i].min(b.high[i]))
}

#[test]
fn cells_tile_space() {
    let mut stage = Stage::of(ROW, [160, 90]);
    stage.settings.cells = CellUse::Always;
    let frame = stage.frame();
    let asked = upright().cut(&frame, &stage.settings).asked;
    let parts = stage.engine.cells_at(&stage.settings, &asked.points);
    let parts = parts.expect("the CPU answers").expect("it has cells");
    let inside: Vec<(&Part, &[f32; 3])> = (parts.iter().zip(&asked.points))
        .filter_map(|(part, p)| Some((part.as_ref()?, p)))
        .collect();
    assert!(inside.len() > 1000, "{}", inside.len());
    let mut kinds = HashSet::new();
    let mut distinct: Vec<Part> = Vec::new();
    for (part, p) in inside {
        assert!(
            part.region.with_margin(Default::default()).holds(*p),
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
    // Some hold one ball, some two or more, some none at all.
    assert!(kinds.len() > 2 && kinds.contains(&None), "{kinds:?}");
    let on_surface = Asked::on_surface(&frame, &stage.settings);
    let parts = stage.engine.cells_at(&stage.settings, &on_surface.points);
    let parts = parts.expect("the CPU answers").expect("it has cells");
    assert!(
        parts
            .iter()
            .all(|part| part.is_some_and(|part| part.clauses.is_some()))
    );
}

#[test]
fn without_cells_there_is_nothing_to_show() {
    let mut stage = Stage::of(ROW, [32, 18]);
    stage.settings.cells = CellUse::Never;
    let points = [[0.0; 3]];
    assert_eq!(stage.engine.cells_at(&stage.settings, &points), Ok(None));
    let mut figure = Stage::of("circle(1)", [32, 32]);
    figure.settings.cells = CellUse::Always;
    assert_eq!(figure.engine.cells_at(&figure.settings, &points), Ok(None));
}

#[test]
fn longer_programs_are_brighter_and_lines_part_cells() {
    let part = |x: f32, clauses| {
        Some(Part {
            region: Region {
                low: [x, 0.0, 0.0],
                high: [x + 1.0, 1.0, 1.0],
            },
            clauses,
        })
    };
    let asked = Asked {
        pixels: (0..6).collect(),
        points: vec![[0.0; 3]; 6],
    };
    let (few, many) = (part(0.0, Some(2)), part(1.0, Some(60)));
    let parts = [few, few, few, many, many, part(2.0, None)];
    let mut picture = vec![0; 4 * 6];
    let legend = cells::draw(&mut picture, 6, &asked, &parts, 64, false);
    assert_eq!(
        (legend.most, legend.mean),
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
            let apart: u32 = a
                .iter()
                .zip(b)
                .map(|(a, b)| u32::from(a.abs_diff(*b)))
                .sum();
            assert!(apart > 12, "{a:?} {b:?}");
        }
        if let Some(next) = colors.get(i + 1) {
            let apart: u32 = a
                .iter()
                .zip(next)
                .map(|(a, b)| u32::from(a.abs_diff(*b)))
                .sum();
            assert!(apart > 90, "neighbours in the text: {a:?} {next:?}");
        }
    }
}

#[test]
fn the_object_under_the_cursor_is_picked_out() {
    let mut stage = Stage::of(ROW, [160, 90]);
    let settings = stage.settings.clone();
    let frame = stage.leaves.render(&settings, &|_| {}).expect("draws");
    let shown: HashSet<u32> = frame.id.iter().copied().collect();
    assert_eq!(shown.len(), 10, "nine balls and nothing");
    let leaf = objects::leaf_at(&frame, [80, 45]);
    assert_eq!(leaf, 5, "the middle of nine");
    let plain = objects::draw(&frame, &settings, None);
    let picked = objects::draw(&frame, &settings, Some(leaf));
    let at = |picture: &[u8], pixel: [usize; 2]| -> [u8; 3] {
        std::array::from_fn(|i| picture[4 * (pixel[1] * 160 + pixel[0]) + i])
    };
    let light = |[r, g, b]: [u8; 3]| u32::from(r) + u32::from(g) + u32::from(b);
    assert_eq!(at(&plain, [80, 45]), at(&picked, [80, 45]));
    let other = frame.id.iter().position(|&id| id == 2).expect("seen");
    let other = [other % 160, other / 160 + 3];
    assert!(light(at(&picked, other)) < light(at(&plain, other)));
    let white = picked
        .chunks(4)
        .filter(|pixel| pixel[..3].iter().all(|&v| v > 220));
    let around = white.count();
    let own = frame.id.iter().filter(|&&id| id == leaf).count();
    assert!(around > 20 && around < own, "{around} pixels around {own}");
}

#[test]
fn steps_fill_their_scale() {
    let mut stage = Stage::of(ROW, [160, 90]);
    let frame = stage.frame();
    let (picture, legend) = steps::draw(&frame);
    assert_eq!(picture.len(), 160 * 90 * 4);
    let top = legend.entries.last().expect("entries").0;
    let above = frame.steps.iter().filter(|&&steps| steps > top).count();
    assert!(above <= 160 * 90 / 200, "{above}");
    assert!(top < 4 * legend.most.max(8), "{legend:?}");
    assert_eq!(legend.most, frame.steps.iter().copied().max().unwrap_or(0));
}

#[test]
fn pictures_that_are_equal_have_no_difference() {
    let mut stage = Stage::of(ROW, [64, 36]);
    let frame = stage.frame();
    let same = difference::difference(&frame, &frame).expect("of one size");
    assert_eq!(same.failures, [""; 0]);
    assert_eq!(
        (same.numbers.differing, same.numbers.hit_mismatches),
        (0, 0)
    );
    let is_grey = |pixel: &[u8]| pixel[0] == pixel[1] && pixel[1] == pixel[2];
    assert!(same.picture.chunks(4).all(is_grey));
    let mut other = frame.clone();
    let ball = frame.id.len() / 2 + 32;
    other.color[ball] = [9.0, 0.0, 0.0, 1.0];
    let one = difference::difference(&frame, &other).expect("of one size");
    assert_eq!(one.numbers.differing, 1);
    let marked =
        (0..frame.id.len()).filter(|&i| one.picture[4 * i..][..4] != same.picture[4 * i..][..4]);
    assert_eq!(marked.collect::<Vec<_>>(), [ball], "{one}");
    stage.settings.size = [32, 18];
    assert!(difference::difference(&frame, &stage.frame()).is_none());
}
