//! End-to-end suites: command lines and scenes in, text and pictures out.

mod agreement;
mod cells;
mod clauses;
mod cli;
mod contacts;
mod conventions;
mod corpus;
mod estimated_slopes;
mod fields;
mod framing;
mod generic_kernels;
mod gpu_cells;
mod hard;
mod light;
mod lod;
mod metamorphic;
mod passes;
mod penumbra;
mod plane_edges;
mod rounding;
mod shapes;
mod soundness;
mod stages;
mod strangers;
mod strict;
mod truth;
