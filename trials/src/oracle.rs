//! Oracle for the first hit of a ray with a scene, by dense evaluation in `f64`.
//!
//! Engines are tested against it, so it shares only the language front end with them. Shapes, combinations,
//! distances, slopes and hits are implemented here independently, from the meaning of the table's rows.
//! Only the lattice of gradient noise comes from the crate `vm`, and the bodies of solids without a distance
//! here. Tests of that crate compare these with the definition of their inside.

mod arithmetic;
mod build;
mod bvh;
mod combine;
mod facts;
mod formula;
mod influence_box;
mod leaf_shape;
mod material;
mod point;
mod range;
mod sample;
mod shapes_2d;
mod solids;
mod space;
mod span;
mod trace;
mod tree;

pub use build::children;
use material::MaterialRules;
use point::max_coordinate;
pub use point::{Point, norm, point_along};
use sdfc_compiler::scene::{MaterialId, Scene, ShapeId};
use sdfc_vm::table::Op;
pub use trace::TraceOutcome;
use tree::ShapeTree;

/// Step of the central differences for gradients, relative to the size of coordinates.
const DEFAULT_GRADIENT_LENGTH_PER_SIZE: f64 = 1e-6;
/// Largest difference of operand values that still counts as equal for materials, relative to the size of
/// coordinates.
const MAX_PAINT_DIFFERENCE_PER_SIZE: f64 = 1e-6;
/// Lower limit of the size of coordinates, as a fraction of the scene's size.
const MIN_SIZE_FRACTION: f64 = 1e-3;

/// A scene at the current values of its parameters and at a fixed time.
#[derive(Debug)]
pub struct Oracle {
    tree: ShapeTree,
    /// Diagonal of the scene's finite extent, or 1 if it has none.
    size: f64,
}

impl Oracle {
    /// Creates the oracle for a shape of the scene at a time in seconds.
    pub fn new(scene: &Scene, root: ShapeId, time: f64) -> Self {
        let tree = build::build(scene, root, time);
        let size = tree.node(tree.root).bounds.diagonal().unwrap_or(1.0);
        Self { tree, size }
    }

    /// Reports whether the oracle implements a row that creates or modifies shapes.
    pub fn supports(op: Op) -> bool {
        // Any 16 numbers are valid parameters of every row.
        let numbers = [1.0; 16];
        op == Op::PolygonEdge
            || build::leaf_shape(op, &numbers).is_some()
            || combine::set_op(op, &numbers).is_some()
            || build::transform(op, 0, &numbers, false).is_some()
    }

    /// Returns the value at a point, which is negative inside. NaN counts as outside.
    pub fn value(&self, p: Point) -> f64 {
        self.tree.value(self.tree.root, p)
    }

    /// Returns the gradient of the value, by central differences.
    pub fn gradient(&self, p: Point) -> Point {
        let length = DEFAULT_GRADIENT_LENGTH_PER_SIZE * self.size_at(p);
        [0, 1, 2].map(|axis| {
            let (mut forward, mut backward) = (p, p);
            forward[axis] += length;
            backward[axis] -= length;
            (self.value(forward) - self.value(backward)) / (forward[axis] - backward[axis])
        })
    }

    /// Traces a ray between two of its parameters, which are multiples of `direction`.
    ///
    /// The outcome is undecided where the ray passes a surface within a millionth of the largest
    /// coordinate. That coordinate is the larger of those at the point and at the start of the range.
    pub fn trace(&self, origin: Point, direction: Point, range: [f64; 2]) -> TraceOutcome {
        trace::OracleRay::new(&self.tree, origin, direction, range).trace()
    }

    /// Returns the number of formula steps that this thread has run for oracles, as a measure of effort.
    pub fn steps_run() -> u64 {
        formula::effort()
    }

    /// Returns the material of the surface at a point on it, if one is assigned there.
    pub fn material(&self, p: Point) -> Option<MaterialId> {
        let tolerance = MAX_PAINT_DIFFERENCE_PER_SIZE * self.size_at(p);
        let rules = MaterialRules {
            tolerance,
            is_uncut: false,
        };
        self.tree.material_at(self.tree.root, p, rules)
    }

    fn size_at(&self, p: Point) -> f64 {
        max_coordinate(p).max(MIN_SIZE_FRACTION * self.size)
    }
}
