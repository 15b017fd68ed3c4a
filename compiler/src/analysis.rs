//! Facts about the shapes and numbers of a scene: boxes, ranges, slopes, symmetries.
//!
//! They hold over regions of space, and for the current or all values of the parameters. Elaboration and
//! lowering read them.

pub mod bounds;
mod bounds_slack;
pub(crate) mod box_eval;
mod climb;
mod contraction;
pub(crate) mod definedness;
pub(crate) mod enclosure;
pub(crate) mod extent;
pub(crate) mod extents;
pub(crate) mod overflow;
pub(crate) mod param_ranges;
pub(crate) mod pieces;
mod preimage;
pub mod range;
mod rotations;
pub(crate) mod shape_range;
pub mod slope;
pub(crate) mod subject;
pub(crate) mod symmetry;
pub(crate) mod terms;
pub(crate) mod visible_bounds;
