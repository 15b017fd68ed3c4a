//! The functions that turn a distance field into a picture, and the WGSL kernels that call them in loops.
//!
//! Every arithmetic function is a body over [`Real`](sdfc_vm::real::Real), written once. The CPU runs it on
//! `f32`, and kernels call the WGSL that [`functions`] records from it. The files `kernels/*.wgsl` are
//! written by hand: they select the ray of an invocation, read and write its state, and evaluate the scene in
//! loops. [`assemble`] joins both with the scene's own functions. This crate is independent of scenes.

pub mod assemble;
pub mod beam;
pub mod camera;
pub mod candidate;
pub mod features;
pub mod functions;
pub mod interpreter;
pub mod layout;
pub mod marching;
pub mod normals;
pub mod occlusion;
pub mod reflectance;
pub mod shadow;
pub mod sky;
pub mod tone;
pub mod views;
