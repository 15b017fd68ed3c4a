//! Decides by a trial whether pruning in cells is profitable for a scene whose slopes are not bounded.
//!
//! Two numbers determine the savings of a ray in a cell. One is the fraction of the program that remains
//! there. The other is the slope bound of the field there, since steps are longer by its reciprocal. The mean
//! of their product over all leaves is the remaining fraction of the work. Measured, 960×540 on two threads:
//!
//! | scene | fraction | time with cells, relative to without |
//! |---|---:|---:|
//! | primitives, city | 0.02 to 0.05 | 0.62 to 0.76 |
//! | tanglecube (orthographic) | 0.08 to 0.17 | 0.28 to 0.62 |
//! | landscape, degenerate | 0.10 | 0.60 to 0.77 |
//! | hi (orthographic) | 0.13 to 0.23 | 0.06 to 0.13 |
//! | clock, temple (repeated) | 0.23, 0.27 | 1.19, 1.30 |
//! | flat_field, gyroid, cog | 0.28, 0.40, 0.40 | 1.21, 1.04, 1.18 |
//! | displacement, jumps, steep_terrain, crests | 0.43 to 0.77 | 1.05 to 1.40 |

use super::policy::is_rough;
use super::split_rule::ScreenSpaceLeafLimit;
use super::{CellSpec, Cells, build};
use sdfc_vm::program::Program;
use sdfc_vm::tape::Tape;

/// Largest remaining fraction of the work for which cells are used.
const MAX_WORK_FRACTION: f32 = 0.25;
/// Limit where space is repeated or rough: rays visit more cells there.
const MAX_ROUGH_WORK_FRACTION: f32 = 0.15;
/// Factor on the size of cells in the first trial of a rough field, which takes a few milliseconds.
const TRIAL_COARSENING: f32 = 4.0;
/// Largest remaining fraction of the work in that trial; fields with more are rejected.
const MAX_COARSE_WORK_FRACTION: f32 = 0.3;

/// Reports whether cells may be profitable, by larger ones if the field is rough.
pub(crate) fn should_build_cells(
    program: &Program,
    tape: &Tape,
    spec: &CellSpec<'_>,
    pixels: &ScreenSpaceLeafLimit,
) -> bool {
    if !is_rough(program) {
        return true;
    }
    let rule = &pixels.coarsened(TRIAL_COARSENING);
    let trial = build(program, tape, &CellSpec { rule, ..*spec });
    trial.mean_work_fraction() <= MAX_COARSE_WORK_FRACTION
}

/// Reports whether these cells are profitable.
pub(crate) fn should_use_cells(program: &Program, cells: &Cells) -> bool {
    let max_fraction = if is_rough(program) {
        MAX_ROUGH_WORK_FRACTION
    } else {
        MAX_WORK_FRACTION
    };
    cells.mean_work_fraction() <= max_fraction
}
