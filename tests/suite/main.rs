//! The suites that look at the whole: what a person types, and what comes out.

mod agreement;
mod cells;
mod cli;
mod corpus;
mod framing;
mod general;
mod gpu_cells;
mod hard;
mod light;
mod lod;
mod metamorphic;
mod passes;
mod rounding;
mod soundness;
mod stages;
mod strangers;
mod strict;
mod truth;
