//! Engines, marching, shading, frames and verification. The only crate that knows wgpu.
//!
//! [`settings`] turns a compiled scene's settings into plain numbers, an [`engine`] makes a
//! [`frame`] of them, and [`verify`] compares what engines made. [`cpu`] and [`gpu`] are what
//! engines stand on.

pub mod cells;
pub mod cpu;
mod crew;
pub mod engine;
pub mod frame;
pub mod gpu;
pub mod perceptual;
pub mod reference;
pub mod rounding;
pub mod settings;
pub mod unseen;
pub mod verify;
