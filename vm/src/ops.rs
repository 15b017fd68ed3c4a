//! The bodies of all operations, by family; the table ([`crate::table`]) refers to them.

pub mod affine;
pub mod combine;
pub mod dimension;
pub mod distance;
pub mod domain;
pub mod map_bounds;
pub mod math;
pub mod prepare;
pub mod shapes;
