//! The playground.

pub mod camera;
pub mod timeline;
