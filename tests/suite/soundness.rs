//! Soundness of pruning: in every cell its tape, its bounds and its gradient hold at corners, on faces,
//! inside, and at zeros of the field.
//!
//! Pictures do not test this: a bound may be too narrow by a tenth where no ray passes.

mod cells;
mod enclosures;
mod passes;
mod rays;
mod samples;
mod slack;
