//! How far a step may go: slopes are bounded and not guessed, what a claim of a smaller slope does is
//! seen, and rays that end in no surface are told.

use super::SIZE;
use super::measure::{changed, measured, shot_of};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::frame::CellUse;

/// Ridges thinner than the steps that a guessed slope allows: their sides have slopes of up to 5.6.
const RIDGES: &str = "0.7 * exp(-8 * abs(p.x)) + 0.05 * sin(3 * p.y);";

/// The hills of the case as ridges; with a slope that is claimed instead of bounded, if one is.
fn ridges(claimed: Option<f64>) -> String {
    let text = changed(
        "steep_terrain",
        "0.5 * sin(1.9 * p.x)",
        &format!("{RIDGES} //"),
    );
    let Some(slope) = claimed else { return text };
    let bounded = "heightfield(fn(p) => height(p), over: [6, 6])";
    assert!(text.contains(bounded));
    let field = format!("field(fn(p) => p.y - height(p.xz), lipschitz: {slope}) & box(6, 4, 6)");
    text.replace(bounded, &field)
}

#[test]
fn the_published_factor_steps_through_ridges_and_the_bound_does_not() {
    // 0.879 is safe up to slopes of √(1 / 0.879² − 1) = 0.542.
    let published = shot_of("ridges at 0.879", &ridges(Some(1.0 / 0.879)), SIZE);
    let ours = shot_of("ridges by their bound", &ridges(None), SIZE);
    let [wrong, right] =
        [&published, &ours].map(|shot| measured(shot, EngineKind::Cpu, CellUse::Never));
    wrong.print();
    right.print();
    assert!(
        wrong.errors.mismatches_inside + wrong.errors.mismatches() > 20
            || wrong.errors.depth_smooth.p99 > 1e-2,
        "the factor 0.879 was safe: {wrong}"
    );
    assert_eq!(right.errors.mismatches_inside, 0, "{right}");
    assert!(right.errors.depth_smooth.p99 < 1e-5, "{right}");
}

#[test]
fn rays_that_run_out_of_steps_are_counted() {
    let text = changed("grazing_plane", "far: 2000", "far: 2000, steps: 12");
    let shot = shot_of("grazing_plane in 12 steps", &text, SIZE);
    for cells in [CellUse::Never, CellUse::Always] {
        let measured = measured(&shot, EngineKind::Cpu, cells);
        measured.print();
        let stats = measured.frame.stats;
        assert!(stats.step_caps > 0, "{stats:?}");
        assert_eq!(stats.step_caps, measured.errors.step_caps as u64);
        assert_eq!(stats.rays(), measured.errors.pixels as u64, "{stats:?}");
    }
}
