//! Whether a scene's own cells are worth what they cost, where its slopes are not known. That is tried with
//! the first picture that is large enough, and kept for as long as edits leave the instructions alone.
//!
//! What a ray saves in a cell is told by two numbers: how much of the program is left there, and how steep
//! the field can be there, since steps are longer by as much. Their product, in the mean over all leaves, is
//! the share of the work that is left. Measured, 960×540 on two threads:
//!
//! | scene | share | time with cells, of that without |
//! |---|---:|---:|
//! | primitives, city | 0.02 to 0.05 | 0.62 to 0.76 |
//! | tanglecube (orthographic) | 0.08 to 0.17 | 0.28 to 0.62 |
//! | landscape, degenerate | 0.10 | 0.60 to 0.77 |
//! | hi (orthographic) | 0.13 to 0.23 | 0.06 to 0.13 |
//! | clock, temple (repeated) | 0.23, 0.27 | 1.19, 1.30 |
//! | flat_field, gyroid, cog | 0.28, 0.40, 0.40 | 1.21, 1.04, 1.18 |
//! | displacement, jumps, steep_terrain, crests | 0.43 to 0.77 | 1.05 to 1.40 |

use super::cut::{Pixels, is_rough};
use crate::cells::{self, Cells, Cut};
use sdfc_vm::program::Program;
use sdfc_vm::tape::Tape;
use std::sync::OnceLock;

/// The largest share of the work that may be left.
const MOST: f32 = 0.25;
/// The same where space is repeated or rough: rays are spread over more cells.
const MOST_ROUGH: f32 = 0.15;
/// Such fields are tried with cells this many times as large first, of which a few milliseconds' worth
/// is enough to see those that are hopeless: with more of the work left than this.
const COARSER: f32 = 4.0;
const HOPELESS: f32 = 0.3;

/// Whether cells are worth it, once that is known.
#[derive(Clone, Debug, Default)]
pub(super) struct Worth(OnceLock<bool>);

impl Worth {
    /// Whether it is worth to make cells, if only to find out.
    pub(super) fn is_possible(
        &self,
        program: &Program,
        tape: &Tape,
        cut: &Cut<'_>,
        pixels: &Pixels,
    ) -> bool {
        if let Some(&known) = self.0.get() {
            return known;
        }
        if !is_rough(program) {
            return true;
        }
        let refine = &pixels.coarser(COARSER);
        let trial = cells::build(program, tape, &Cut { refine, ..*cut });
        trial.share() <= HOPELESS || *self.0.get_or_init(|| false)
    }

    /// Whether these cells are worth it.
    pub(super) fn of(&self, program: &Program, cells: &Cells) -> bool {
        let most = if is_rough(program) { MOST_ROUGH } else { MOST };
        *self.0.get_or_init(|| cells.share() <= most)
    }
}
