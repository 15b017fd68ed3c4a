//! Step lengths. Slopes are bounded rather than guessed, the effect of a stated smaller slope is visible, and
//! rays that end without a hit are reported.

use super::SIZE;
use super::chains::distances;
use super::measure::{Shot, changed, measured, shot_of};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::render::CellMode;
use sdfc_trials::random::Random;

/// Ridges thinner than the steps of a guessed slope; their sides have slopes of up to 5.6.
const RIDGES: &str = "0.7 * exp(-8 * abs(p.x)) + 0.05 * sin(3 * p.y);";

/// Returns the hills of the case as ridges, with a stated instead of a derived slope bound if one is
/// given.
fn ridges(stated_slope: Option<f64>) -> String {
    let text = changed(
        "steep_terrain",
        "0.5 * sin(1.9 * p.x)",
        &format!("{RIDGES} //"),
    );
    let Some(slope) = stated_slope else {
        return text;
    };
    let bounded = "heightfield(fn(p) => height(p), over: [6, 6])";
    assert!(text.contains(bounded));
    let field = format!("field(fn(p) => p.y - height(p.xz), lipschitz: {slope}) & box(6, 4, 6)");
    text.replace(bounded, &field)
}

/// Returns the largest slope of a shot's distance between nearby points.
fn max_slope(shot: &Shot) -> f64 {
    let mut random = Random::for_case("slopes");
    let mut offset = || random.unit_f32() - 0.5;
    let pairs = (0..4000).flat_map(|_| {
        let p = [offset() * 0.6, offset() * 1.6, offset() * 4.0];
        [p, p.map(|v| v + offset() * 0.02)]
    });
    let points: Vec<[f32; 3]> = pairs.collect();
    let values = distances(shot, EngineKind::Reference, &points);
    let slope = |i: usize| {
        let squared_offsets =
            (0..3).map(|axis| f64::from(points[i][axis] - points[i + 1][axis]).powi(2));
        (values[i] - values[i + 1]).abs() / squared_offsets.sum::<f64>().sqrt().max(1e-3)
    };
    (0..points.len()).step_by(2).map(slope).fold(0.0, f64::max)
}

#[test]
fn the_published_factor_for_ridges_is_refuted_and_a_bound_is_used() {
    // 0.879 is safe up to slopes of √(1 / 0.879² − 1) = 0.542.
    let published = shot_of("ridges at 0.879", &ridges(Some(1.0 / 0.879)), SIZE);
    let bounded = shot_of("ridges by their bound", &ridges(None), SIZE);
    for shot in [&published, &bounded] {
        let slope = max_slope(shot);
        assert!(slope <= 1.0 + 1e-4, "{slope}");
        let measured = measured(shot, EngineKind::Cpu, CellMode::Never);
        measured.print();
        assert_eq!(measured.errors.mismatches_inside, 0, "{measured}");
        assert!(measured.errors.depth_smooth.p99 < 1e-5, "{measured}");
    }
}

#[test]
fn rays_that_run_out_of_steps_are_counted() {
    let text = changed("grazing_plane", "far: 2000", "far: 2000, steps: 12");
    let shot = shot_of("grazing_plane in 12 steps", &text, SIZE);
    for cells in [CellMode::Never, CellMode::Always] {
        let measured = measured(&shot, EngineKind::Cpu, cells);
        measured.print();
        let stats = measured.image.stats;
        assert!(stats.step_caps > 0, "{stats:?}");
        assert_eq!(stats.step_caps, measured.errors.step_caps as u64);
        assert_eq!(stats.rays(), measured.errors.pixels as u64, "{stats:?}");
    }
}
