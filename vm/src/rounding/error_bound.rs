//! The error bound of a whole program.

use super::RunningError;
use crate::evaluate::evaluate;
use crate::interval::Interval;
use crate::program::Program;
use crate::vector::V3;

/// Bounds the error of a program for the points of a box; `error` is the error of each coordinate. The
/// program must be verified ([`crate::verify`]).
pub fn error_bound(program: &Program, region: [Interval; 3], error: [f64; 3]) -> RunningError {
    let [x, y, z] = std::array::from_fn(|axis| RunningError {
        value: region[axis],
        error: error[axis],
        branch_uncertain: false,
        is_integer: false,
    });
    evaluate::<RunningError>(program, V3::new(x, y, z))
}
