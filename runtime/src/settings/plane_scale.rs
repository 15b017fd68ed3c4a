//! Scale at which the edges of a 2-D shape without known extent are seen.

use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::evaluate_f64;
use sdfc_vm::program::Program;

/// Number of points of a square at which signs are compared, and how many of them have the rarer sign at least.
const POINTS: u32 = 64;
const MIN_OF_EACH_SIGN: u32 = 4;
/// Number of doublings, and of halvings, of the square.
const MAX_DOUBLINGS: i32 = 50;
/// Maximum number of instructions that are evaluated; of longer programs fewer scales are tried.
const MAX_INSTRUCTIONS: usize = 4_000_000;

/// Returns a square around the origin in which the field has both signs: the one whose size is closest to that of
/// `preferred`. Returns `None` if there is none.
pub(super) fn square_with_edges(field: &Program, preferred: &Bounds) -> Option<Bounds> {
    let squares = MAX_INSTRUCTIONS / (POINTS as usize * field.code.len().max(1));
    let doublings = (0..=MAX_DOUBLINGS).flat_map(|n| [n, -n]).skip(1);
    doublings.take(squares.max(1)).find_map(|n| {
        let factor = 2.0_f64.powi(n);
        let square = Bounds {
            min: preferred.min.map(|v| v * factor),
            max: preferred.max.map(|v| v * factor),
        };
        let points = (1..=POINTS).map(|number| square.quasi_random_point(number));
        let inside = points.filter(|&[x, y, _]| evaluate_f64(field, [x, y, 0.0]) < 0.0);
        let inside = inside.count() as u32;
        let is_mixed = inside.min(POINTS - inside) >= MIN_OF_EACH_SIGN;
        is_mixed.then_some(square)
    })
}
