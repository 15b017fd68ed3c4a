//! From syntax trees to scenes, graphs, verified programs and WGSL. Deterministic: the same text
//! and options give the same bytes. No input or output, no GPU.

pub mod expression;
pub mod scene;
