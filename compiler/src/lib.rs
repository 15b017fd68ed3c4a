//! Compiler from syntax trees to scenes, graphs, verified programs and WGSL. It is deterministic: equal
//! text and options produce equal bytes. It does no input or output and uses no GPU.

pub mod analysis;
pub mod compile;
pub mod cutter_extension;
mod distribute;
pub mod dump;
pub mod elaborate;
pub mod export;
pub mod expression;
pub mod fidget_text;
mod field_factors;
mod formula;
pub mod graph;
mod half_spaces;
mod leaves;
pub mod lower;
pub mod open;
pub mod passes;
pub mod provenance;
pub mod raise;
pub mod scene;
pub mod schedule;
mod seams;
mod sublevel;
mod symbolic;
pub mod uniforms;
pub mod wgsl;
mod written_value;
