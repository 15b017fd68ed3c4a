//! Compiler from syntax trees to scenes, graphs, verified programs and WGSL. It is deterministic: equal
//! text and options produce equal bytes. It does no input or output and uses no GPU.

pub mod bounds;
mod bounds_slack;
mod box_eval;
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
mod leaves;
pub mod lower;
pub mod open;
mod param_ranges;
pub mod passes;
pub mod provenance;
pub mod raise;
pub mod range;
pub mod scene;
pub mod schedule;
mod seams;
mod shape_range;
pub mod slope;
mod subject;
mod symbolic;
mod symmetry;
pub mod uniforms;
mod visible_bounds;
pub mod wgsl;
mod written_value;
