//! Edges of 2-D shapes, compared with areas that are counted by thousands of samples of a formula for each pixel.
//!
//! The edge is where a field changes its sign: factors, flush cuts and joints move nothing.

use crate::metamorphic::draw::{DrawOptions, image};
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{Engine, EngineKind, open};
use sdfc_runtime::render::CellMode;
use sdfc_shaders::camera::SAMPLE_SHIFT;
use sdfc_trials::skip::is_gpu_skipped;

/// Number of samples along a side of a pixel.
const SAMPLES: usize = 24;
const SIZE: [u32; 2] = [96, 72];
/// Height of the view, in units of the scene.
const HEIGHT: f64 = 3.0;

/// Maximum error of a pixel whose signs are counted at 16 points.
const TOLERANCE: f64 = 0.17;

/// A 2-D scene, and the points that it covers.
struct Figure {
    text: &'static str,
    covers: fn(f64, f64) -> bool,
}

fn disc(x: f64, y: f64) -> bool {
    x.hypot(y) < 1.0
}

fn half_square(x: f64, y: f64) -> bool {
    x.abs() < 1.0 && y > -1.0 && y < 0.013
}

fn figures() -> Vec<Figure> {
    let figure = |text, covers| Figure { text, covers };
    vec![
        figure("circle(1)", disc),
        figure("field(fn(p: vec2) => 1000 * (length(p) - 1))", disc),
        figure("field(fn(p: vec2) => 0.001 * (length(p) - 1))", disc),
        figure("field(fn(p: vec2) => dot(p, p) - 1)", disc),
        figure("field(fn(p: vec2) => 1e-12 * (dot(p, p) - 1))", disc),
        // Values near the largest of `f32`.
        figure("field(fn(p: vec2) => 1e25 * (length(p) - 1))", disc),
        figure(
            "field(fn(p: vec2) => pow(dot(p, p), 4) * 1e18 - 1e18)",
            disc,
        ),
        // A cut that ends flush leaves no line.
        figure(
            "field(fn(p: vec2) => max(abs(p.x) - 1, abs(p.y) - 1)) - field(fn(p: vec2) => max(abs(p.x) - 1, abs(p.y - 0.513) - 0.5))",
            half_square,
        ),
        // Parts that touch have no line between them.
        figure(
            "(circle(1) - rect(1, 3).rotate(20deg).translate(0.5, 0)) | (circle(1) & rect(1, 3).rotate(20deg).translate(0.5, 0))",
            disc,
        ),
        figure(
            "union(for i in 0..3 { circle(1) & rect(0.7, 3).translate(0.7 * (i - 1), 0) })",
            disc,
        ),
        figure("field(fn(p: vec2) => 0 * p.x)", |_, _| false),
        figure("field(fn(p: vec2) => abs(length(p) - 1))", |_, _| false),
        figure(
            "field(fn(p: vec2) => -abs(length(p) - 1)) & circle(1)",
            disc,
        ),
        // Jumps of equal and of unequal sides.
        figure(
            "field(fn(p: vec2) => if length(p) < 1 { -1 } else { 5 })",
            disc,
        ),
        figure(
            "field(fn(p: vec2) => if length(p) < 1 { -1 } else { 100 })",
            disc,
        ),
        figure(
            "field(fn(p: vec2) => if length(p) < 1 { -300 } else { 0.2 })",
            disc,
        ),
        // Parts of very unequal slopes.
        figure(
            "rect(4, 2).translate(0, -0.987) & field(fn(p: vec2) => 1000 * (length(p) - 1))",
            |x, y| disc(x, y) && y < 0.013,
        ),
        figure(
            "rect(2, 2).translate(0, 0.1) | field(fn(p: vec2) => 30 * (length(p) - 1))",
            |x, y| disc(x, y) || (x.abs() < 1.0 && (y - 0.1).abs() < 1.0),
        ),
        figure(
            "rect(2, 2) - field(fn(p: vec2) => 1e-4 * (dot(p, p) - 1))",
            |x, y| x.abs() < 1.0 && y.abs() < 1.0 && !disc(x, y),
        ),
        // Lines thinner than a pixel cross beside a pixel's middle, where four neighbours have one value.
        figure(
            "(rect(0.02, 8) | rect(8, 0.02)).translate(0.00969, 0.0053)",
            |x, y| (x - 0.00969).abs() < 0.01 || (y - 0.0053).abs() < 0.01,
        ),
        // A saddle has no slope in its middle.
        figure(
            "field(fn(p: vec2) => (p.x + 0.017) * (p.y - 0.023))",
            |x, y| (x + 0.017) * (y - 0.023) < 0.0,
        ),
        // Points without a value are outside.
        figure(
            "field(fn(p: vec2) => max(length(p) - 1, p.y - 0.5 * sqrt(p.x) - 1.1))",
            |x, y| x >= 0.0 && disc(x, y),
        ),
    ]
}

/// Returns the fraction of each pixel that a figure covers.
fn areas(covers: fn(f64, f64) -> bool) -> Vec<f64> {
    let [width, height] = SIZE.map(|n| n as usize);
    let unit = HEIGHT / height as f64;
    let [shift_x, shift_y] = SAMPLE_SHIFT;
    let area = |pixel: usize| {
        let (column, row) = (pixel % width, pixel / width);
        let offset = |i: usize| (i as f64 + 0.5) / SAMPLES as f64;
        let mut count = 0;
        for i in 0..SAMPLES * SAMPLES {
            let x = column as f64 + offset(i % SAMPLES) + shift_x - width as f64 / 2.0;
            let y = row as f64 + offset(i / SAMPLES) + shift_y - height as f64 / 2.0;
            count += usize::from(covers(x * unit, -y * unit));
        }
        count as f64 / (SAMPLES * SAMPLES) as f64
    };
    (0..width * height).map(area).collect()
}

/// Draws the figures with cells and without; returns the differences.
fn failures(engine: &mut dyn Engine, name: &str) -> String {
    let mut failures = String::new();
    for figure in figures() {
        let expected = areas(figure.covers);
        for cells in [CellMode::Never, CellMode::Always] {
            let options = DrawOptions {
                size: SIZE,
                passes: PassOptions::default(),
                cells,
                scale: 1.0,
            };
            let text = format!(
                "camera {{ from: [0, 0, 5], look: [0, 0, 0], height: {HEIGHT} }}\n{}\n",
                figure.text
            );
            let picture = image(engine, &text, &options)
                .unwrap_or_else(|errors| panic!("{}: {errors}", figure.text));
            let errors = picture.color.iter().zip(&expected);
            let errors = errors.map(|(color, area)| (f64::from(color[3]) - area).abs());
            let (pixel, worst) =
                errors.enumerate().fold(
                    (0, 0.0),
                    |worst, error| if error.1 > worst.1 { error } else { worst },
                );
            if worst > TOLERANCE {
                failures += &format!(
                    "{name}, {cells:?}, {}: {worst:.3} at {}, {}, where {:.3} is covered\n",
                    figure.text,
                    pixel % SIZE[0] as usize,
                    pixel / SIZE[0] as usize,
                    expected[pixel]
                );
            }
        }
    }
    failures
}

#[test]
fn pixels_are_covered_as_far_as_the_sign_is_negative() {
    let mut cpu = open(EngineKind::Cpu).expect("there is always a CPU");
    let mut all = failures(&mut *cpu, "cpu");
    if !is_gpu_skipped() {
        for kind in [EngineKind::Interp, EngineKind::Wgsl] {
            let mut engine = open(kind).expect("a GPU");
            all += &failures(&mut *engine, kind.name());
        }
    }
    assert!(all.is_empty(), "\n{all}");
}

/// A line thinner than a pixel stays a line: each row shows some of it.
#[test]
fn thin_lines_have_no_gaps() {
    let mut cpu = open(EngineKind::Cpu).expect("there is always a CPU");
    let options = DrawOptions {
        size: SIZE,
        passes: PassOptions::default(),
        cells: CellMode::Never,
        scale: 1.0,
    };
    for text in [
        "rect(0.01, 8).rotate(11deg)",
        "field(fn(p: vec2) => 40 * (abs(p.x + 0.2 * p.y) - 0.004))",
        "!rect(0.01, 8).rotate(11deg)",
        "rect(0.02, 8) | rect(8, 0.005)",
    ] {
        let text =
            format!("camera {{ from: [0, 0, 5], look: [0, 0, 0], height: {HEIGHT} }}\n{text}\n");
        let picture = image(&mut *cpu, &text, &options).expect("it compiles");
        let is_gap = text.contains('!');
        for row in picture.color.chunks(SIZE[0] as usize) {
            let covered = row
                .iter()
                .map(|color| if is_gap { 1.0 - color[3] } else { color[3] });
            let sum: f32 = covered.sum();
            let is_row_of_a_line = sum > 10.0;
            assert!(
                (0.06..2.0).contains(&sum) || is_row_of_a_line,
                "{text}: {sum} in a row"
            );
        }
    }
}
