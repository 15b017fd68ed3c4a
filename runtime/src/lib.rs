//! Placeholder.

pub mod cpu;
pub mod frame;
pub mod gpu;
