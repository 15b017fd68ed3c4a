//! Shapes in the xy plane.
