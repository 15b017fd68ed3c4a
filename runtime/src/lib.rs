//! Engines, marching, shading, images and verification. The only crate that computes with wgpu.
//!
//! [`settings`] resolves a compiled scene's settings to plain numbers, an [`engine`] renders an image from
//! them ([`render`]), and [`comparison`] compares the results of engines. Engines are built on [`cpu`] and
//! [`gpu`].

pub mod cells;
pub mod comparison;
pub mod cpu;
pub mod engine;
pub mod gpu;
pub mod perceptual;
pub mod reference;
pub mod render;
pub mod rounding;
pub mod settings;
pub mod visibility_notes;
mod work_stealing;
