//! The virtual machine: one definition per operation, the number types that evaluate it, and programs.
//!
//! Independent of the scene language and of wgpu.
#![warn(missing_docs)]

pub mod apply;
pub mod blend;
pub mod bounds;
pub mod branching;
pub mod dual;
pub mod elementary;
pub mod ellipsoid;
pub mod encode;
pub mod evaluate;
pub mod file;
mod float;
pub mod guard;
pub mod interval;
pub mod lanes;
pub mod listing;
mod local_normal;
pub mod material_weights;
mod multiversion;
pub mod ops;
pub mod outline;
pub mod pool;
pub mod prelude;
pub mod program;
pub mod real;
pub mod record;
pub mod rounding;
pub mod row;
pub mod settings;
pub mod surface;
pub mod table;
pub mod tape;
pub mod uniform;
pub mod vector;
pub mod verify;
pub mod wgsl_interval;
pub mod wgsl_library;
