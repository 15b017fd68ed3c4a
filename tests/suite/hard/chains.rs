//! Deep chains of smooth unions: the error of `f32` grows at most with the length. Chains of equal
//! operands add the amount given by the recurrence of their kernel.

use super::measure::{changed, measured, shot_of};
use super::{DEFAULT_LIMIT, DEVICE_SIZE};
use sdfc_runtime::engine::{EngineKind, SceneInput, open};
use sdfc_runtime::render::CellMode;
use sdfc_shaders::assemble::SceneSource;
use sdfc_trials::random::Random;

/// Returns the distances at points, computed by an engine.
pub(super) fn distances(shot: &super::Shot, kind: EngineKind, points: &[[f32; 3]]) -> Vec<f64> {
    let mut engine = open(kind).expect("it needs no device");
    let loaded = SceneInput {
        module: &shot.compiled.module,
        uniform_values: &shot.uniform_values,
        generated: SceneSource::default(),
    };
    engine.load(&loaded).expect("it loads");
    let samples = engine.query(points).expect("it answers");
    samples.iter().map(|s| f64::from(s.distance)).collect()
}

/// Returns random points around the scenes.
fn points_around(count: usize) -> Vec<[f32; 3]> {
    let mut random = Random::for_case("points around the scenes");
    let mut coordinate = || random.unit_f32() * 5.0 - 2.5;
    let point = |_| [coordinate(), coordinate() * 0.4, coordinate()];
    (0..count).map(point).collect()
}

#[test]
fn chains_of_any_length_keep_their_digits_and_their_picture() {
    let points = points_around(2000);
    for count in [4, 16, 64, 256, 1024] {
        let text = changed(
            "deep_chain",
            "let count = 48;",
            &format!("let count = {count};"),
        );
        let shot = shot_of(&format!("deep_chain of {count}"), &text, DEVICE_SIZE);
        let cpu_distances = distances(&shot, EngineKind::Cpu, &points);
        let reference_distances = distances(&shot, EngineKind::Reference, &points);
        let differences = cpu_distances
            .iter()
            .zip(&reference_distances)
            .map(|(a, b)| (a - b).abs());
        let ulps = differences.fold(0.0, f64::max) / f64::from(f32::EPSILON);
        if std::env::var_os("SDFC_MEASURE").is_some() {
            eprintln!("{count} operands: {ulps:.1} ulp of 1");
        }
        // Points are up to 4 away, where a distance is rounded to two units. Each blend that still adds
        // something rounds the sum once more.
        assert!(ulps <= 8.0 + f64::from(count) / 64.0, "{count}: {ulps} ulp");
        if count > 64 {
            // The interval reference takes as long as all other cases together.
            continue;
        }
        for cells in [CellMode::Never, CellMode::Always] {
            let measured = measured(&shot, EngineKind::Cpu, cells);
            measured.print();
            let e = &measured.errors;
            let is_correct = e.mismatches_inside == 0 && e.nans == 0 && e.step_caps == 0;
            assert!(
                is_correct && e.depth_smooth.p99 <= DEFAULT_LIMIT.depth,
                "{measured}"
            );
            assert!(e.normals.p99 <= DEFAULT_LIMIT.normals, "{measured}");
        }
    }
}

#[test]
fn equal_operands_add_the_offset_of_their_recurrence() {
    // A cubic blend adds h³ / 6w² where the operands differ by w − h, and w = 6 · 0.05.
    let (width, count) = (0.3_f64, 200);
    let chain = |a: f64| {
        (1..count).fold(a, |d, _| {
            let h = (width - (d - a).abs()).max(0.0);
            d - h * h * h / (6.0 * width * width)
        })
    };
    let text = changed("equal_chain", "0..12", &format!("0..{count}"));
    let shot = shot_of("equal_chain", &text, DEVICE_SIZE);
    let points = points_around(200);
    let distances_found = distances(&shot, EngineKind::Cpu, &points);
    for (p, d) in points.iter().zip(distances_found) {
        let length = p.iter().map(|&v| f64::from(v).powi(2)).sum::<f64>().sqrt();
        let expected = chain(length - f64::from(0.8_f32));
        assert!((d - expected).abs() < 4e-5, "at {p:?}: {d}, not {expected}");
        assert!(
            length - 0.8 - d > 0.2,
            "two hundred balls are more than one"
        );
    }
}
