//! Solids and 2-D shapes, one file per family. Each solid is centred at the origin with its axis along y,
//! unless it says otherwise.
//!
//! A shape `NAME` consists of functions next to each other:
//!
//! - the body `NAME`: the distance, from the point and the parameters;
//! - `NAME_parameters`: the conversion of a call's arguments to the parameters, unless one of
//!   [`prepare`](super::prepare) does it;
//! - functions of the parameters for its bounding box, if its row needs any: the extent along an axis, or
//!   the whole box, `NAME_bounds`.
//!
//! A shape's distance is at least that to its bounding box along the farthest axis; for exact shapes, it is at
//! least the Euclidean distance. Blends rely on this: their offset is nonzero only where a shape's distance
//! is small, and that must be near its bounding box. The box of a 2-D shape is infinite along z: it is a prism
//! until it is extruded.

mod boxes;
mod cones;
mod cylinders;
mod periodic;
mod planes;
mod polyhedra;
mod round;
mod shapes_2d;

pub use boxes::*;
pub use cones::*;
pub use cylinders::*;
pub use periodic::*;
pub use planes::*;
pub use polyhedra::*;
pub use round::*;
pub use shapes_2d::*;
