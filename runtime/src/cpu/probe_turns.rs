//! Turns of the checks of candidates in a block: either those in probes advance, or all others.
//!
//! A probe takes many times as many operations as the phases that measure the gradient before it. If both advanced at once,
//! each lane would run both. By turns, lanes wait for each other and reach their probes together.

use super::F32x64;
use sdfc_shaders::candidate;

/// Reports whether a phase is that of a probe.
#[inline(always)]
pub(super) fn is_probe(phase: f32) -> bool {
    phase > candidate::MAX_TAP_PHASE
}

/// Reports whether a phase only takes the value at a candidate. In no check, the phase is zero.
#[inline(always)]
pub(super) fn is_start(phase: f32) -> bool {
    (phase > 0.0) & (phase < candidate::MIN_TAP_PHASE)
}

/// Returns the mask of the lanes whose checks wait for the others.
#[inline(always)]
pub(super) fn waiting_lanes(phases: &F32x64) -> u64 {
    let advances = probes_next(phases);
    let lanes = phases.0.iter().enumerate();
    lanes.fold(0, |mask, (lane, &phase)| {
        mask | u64::from(is_probe(phase) != advances) << lane
    })
}

/// Reports whether probes advance next: most checks of the block are in them.
///
/// Lanes without a task advance, too, so each turn ends.
#[inline(always)]
pub(super) fn probes_next(phases: &F32x64) -> bool {
    let (mut checks, mut probes) = (0, 0);
    for &phase in &phases.0 {
        checks += i32::from(phase > 0.0);
        probes += i32::from(is_probe(phase));
    }
    2 * probes > checks
}
