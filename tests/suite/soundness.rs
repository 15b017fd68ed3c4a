//! Soundness of what engines leave out: in every cell its tape, its bounds and its gradient hold, at corners, on
//! faces, inside, and where the field is zero.
//!
//! Pictures say little of this: a bound that is too narrow by a tenth may be so where no ray goes.

mod cells;
mod passes;
mod rays;
mod samples;
mod slack;
