//! From syntax trees to scenes, graphs, verified programs and WGSL. Deterministic: the same text
//! and options give the same bytes. No input or output, no GPU.

pub mod bounds;
mod boxes;
pub mod clauses;
mod climb;
pub mod compile;
pub mod cutters;
mod distribute;
pub mod dump;
pub mod elaborate;
pub mod export;
pub mod expression;
mod extent;
mod formula;
pub mod graph;
pub mod lower;
pub mod open;
pub mod origins;
pub mod passes;
pub mod raise;
pub mod range;
pub mod scene;
pub mod schedule;
mod seams;
mod seen;
mod shape_range;
pub mod slope;
mod spread;
mod subject;
mod symbolic;
mod symmetry;
pub mod uniforms;
pub mod wgsl;
mod written;
