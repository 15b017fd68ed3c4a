//! Built-in functions and set operators of the language, a file for each theme. The vocabulary lists
//! the functions by name.

mod blend;
mod csg;
mod field;
mod lists;
pub(super) mod math;
mod normalized;
mod operations;
mod repetition;
mod sweeps;
mod transform;
mod unequal_scale;
mod vectors;
