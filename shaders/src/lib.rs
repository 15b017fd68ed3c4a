//! The functions that turn a distance field into a picture, and the WGSL kernels that loop over
//! them.
//!
//! Every function with arithmetic in it is a body over [`Real`](sdfc_vm::real::Real), written
//! once: the CPU runs it on `f32`, kernels call the WGSL that [`functions`] records from it. What
//! is left by hand in `kernels/*.wgsl` is which ray an invocation works on, what it reads and
//! writes, and how often it asks the scene. [`assemble`] puts the two and the scene's own functions
//! together. Knows no scene.

pub mod assemble;
pub mod beam;
pub mod camera;
pub mod claim;
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
