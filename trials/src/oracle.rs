//! An oracle that tells the place at which a ray meets a scene, by dense evaluation in `f64`.
//!
//! Engines are tested against it, so it shares the language front end with them and nothing else.
//! Shapes, combinations, distances, slopes and hits are written here once more, from the meaning of
//! the table's rows. Only the lattice of gradient noise is that of the crate `vm`.

mod build;
mod combine;
mod extent;
mod facts;
mod figures;
mod hierarchy;
mod number;
mod paint;
mod point;
mod probe;
mod range;
mod solids;
mod space;
mod span;
mod trace;
mod tree;

use point::{Point, magnitude};
use sdfc_compiler::scene::{MaterialId, Scene, ShapeId};
use sdfc_vm::table::Op;
pub use trace::Trace;
use tree::Tree;

/// The length over which gradients are taken, by size of coordinates.
const DEFAULT_GRADIENT_LENGTH_PER_SIZE: f64 = 1e-6;
/// The largest difference of values in a place that operands share, by size of coordinates.
const MAX_PAINT_DIFFERENCE_PER_SIZE: f64 = 1e-6;
/// The least share of the scene's size that coordinates count as.
const MIN_SIZE_SHARE: f64 = 1e-3;

/// A scene at the present values of its parameters and at a time.
#[derive(Debug)]
pub struct Oracle {
    tree: Tree,
    /// The size of the scene if it is known, else one.
    size: f64,
}

impl Oracle {
    /// The oracle of a shape of the scene at a time in seconds.
    pub fn new(scene: &Scene, root: ShapeId, time: f64) -> Self {
        let tree = build::build(scene, root, time);
        let size = tree.node(tree.root).extent.diagonal().unwrap_or(1.0);
        Self { tree, size }
    }

    /// Tells if the oracle knows a row that makes or changes shapes.
    pub fn knows(op: Op) -> bool {
        // Any numbers do: each of them becomes a shape.
        let numbers = [1.0; 16];
        op == Op::PolygonEdge
            || build::leaf(op, &numbers).is_some()
            || combine::set(op, &numbers).is_some()
            || build::change(op, 0, &numbers, false).is_some()
    }

    /// The value at a point, which is negative inside. NaN counts as outside.
    pub fn value(&self, p: Point) -> f64 {
        self.tree.value(self.tree.root, p)
    }

    /// The value's slopes along the axes, by differences.
    pub fn gradient(&self, p: Point) -> Point {
        let length = DEFAULT_GRADIENT_LENGTH_PER_SIZE * self.size_at(p);
        [0, 1, 2].map(|axis| {
            let (mut ahead, mut behind) = (p, p);
            ahead[axis] += length;
            behind[axis] -= length;
            (self.value(ahead) - self.value(behind)) / (ahead[axis] - behind[axis])
        })
    }

    /// The end of a ray between two of its parameters, which are multiples of its direction.
    ///
    /// A ray is undecided within a millionth of the largest coordinate from a surface that it passes.
    /// Coordinates are those of the place and of the begin of the range.
    pub fn trace(&self, origin: Point, direction: Point, range: [f64; 2]) -> Trace {
        trace::Ray::new(&self.tree, origin, direction, range).trace()
    }

    /// The number of steps of formulas that this thread has run for oracles, as a measure of effort.
    pub fn effort() -> u64 {
        number::effort()
    }

    /// The material of the surface at a point of it, if it has a paint there.
    pub fn material(&self, p: Point) -> Option<MaterialId> {
        let tolerance = MAX_PAINT_DIFFERENCE_PER_SIZE * self.size_at(p);
        self.tree.paint(self.tree.root, p, tolerance)
    }

    fn size_at(&self, p: Point) -> f64 {
        magnitude(p).max(MIN_SIZE_SHARE * self.size)
    }
}
