//! Shared helpers of the tests: random numbers, arguments for every row, and evaluation.

use glam::DVec3;
use sdfc_vm::apply::{Apply, OpResult, apply, pack_parameters};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::dual::{Dual, DualVec3};
use sdfc_vm::real::{Real, Vector3};
use sdfc_vm::row::{Argument, ArgumentKind, Output};
use sdfc_vm::table::{Op, ROWS, prepare};
use sdfc_vm::vector::V3;

pub(crate) type Point = [f64; 3];

/// A small reproducible random generator (xorshift). The one of `sdfc-trials` is not used here, because that crate
/// depends on this one. The tests of operations are to build without the compiler.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }
    /// Creates the generator of a named case, so that no case changes the numbers of another one.
    pub(crate) fn for_case(seed: u64, name: &str) -> Self {
        let hash = name.bytes().fold(seed, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
        Self::new(hash ^ hash >> 32)
    }
    /// Returns a number in [0, 1), on a grid that `f32` represents exactly.
    pub(crate) fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 42) as f64 / f64::from(1 << 22)
    }
    pub(crate) fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
    /// Returns a number in a range, on a coarse grid: such arguments are exact in `f32`.
    fn coarse(&mut self, low: f64, high: f64) -> f64 {
        (self.range(low, high) * 64.0).round() / 64.0
    }
    pub(crate) fn point(&mut self, reach: f64) -> Point {
        std::array::from_fn(|_| self.range(-reach, reach))
    }
    /// Returns a point in a box, which may be infinite, and at most 2.5 from each coordinate plane.
    pub(crate) fn point_in(&mut self, bounds: &Bounds) -> Point {
        std::array::from_fn(|axis| {
            let (low, high) = (bounds.min[axis].max(-2.5), bounds.max[axis].min(2.5));
            self.range(low, high)
        })
    }
    pub(crate) fn direction(&mut self) -> Point {
        loop {
            let p = self.point(1.0);
            let length = length(p);
            if (0.1..1.0).contains(&length) {
                return p.map(|v| v / length);
            }
        }
    }
    fn argument(&mut self, argument: &Argument) -> Vec<f64> {
        use ArgumentKind as A;
        let zero = argument.name != "spacing" && self.unit() < 0.15;
        let n = argument.kind.width();
        match argument.kind {
            A::Radius if argument.name == "r1" => vec![self.coarse(0.55, 0.9)],
            A::Radius => vec![self.coarse(0.15, 0.5)],
            // A cone has an apex at one end at most.
            A::RadiusOrZero | A::LengthOrZero if zero && argument.name != "r1" => vec![0.0],
            A::RadiusOrZero => vec![self.coarse(0.1, 0.9)],
            A::Length if argument.name == "thickness" => vec![self.coarse(0.125, 0.25)],
            A::Length if argument.name == "cell" => vec![self.coarse(1.0, 1.6)],
            A::Length => vec![self.coarse(0.3, 1.6)],
            A::LengthOrZero => vec![self.coarse(0.05, 0.4)],
            A::Offset => vec![self.coarse(-0.5, 0.5)],
            A::Size3 | A::Size2 => (0..n).map(|_| self.coarse(0.5, 2.0)).collect(),
            A::Radii3 => (0..n).map(|_| self.coarse(0.2, 1.0)).collect(),
            A::Lengths3 => (0..n).map(|_| self.coarse(0.5, 1.5)).collect(),
            A::Counts3 => (0..n).map(|_| self.range(1.0, 4.999).floor()).collect(),
            A::Vec3 | A::Vec2 => (0..n).map(|_| self.coarse(-0.8, 0.8)).collect(),
            A::Direction => self.direction().to_vec(),
            A::Angle => vec![self.coarse(0.3, 3.0)],
            A::Number => vec![self.coarse(0.0, 1.0)],
            A::Count => vec![self.range(3.0, 8.999).floor()],
        }
    }
    /// Returns arguments for an operation: those of its built-in, or those that the compiler generates.
    pub(crate) fn arguments(&mut self, op: Op) -> Vec<f64> {
        let row = op.row();
        if let Some(language) = row.facts.language {
            return language
                .arguments
                .iter()
                .flat_map(|a| self.argument(a))
                .collect();
        }
        let mut list = |kinds: &[(&'static str, ArgumentKind)]| -> Vec<f64> {
            let list = kinds.iter().map(|&(name, kind)| Argument {
                name,
                kind,
                default: None,
            });
            list.flat_map(|a| self.argument(&a)).collect()
        };
        use ArgumentKind as A;
        match op {
            _ if row.parameters.is_empty() => vec![],
            Op::PolygonEdge => list(&[("a", A::Vec2), ("b", A::Vec2)]),
            Op::RevolveClose => list(&[("angle", A::Angle)]),
            Op::DistanceUnion => [
                list(&[("focus", A::Vec3), ("k", A::LengthOrZero)]),
                vec![0.125, 0.75],
            ]
            .concat(),
            Op::StairsUnion | Op::StairsIntersection | Op::StairsSubtraction => {
                list(&[("size", A::LengthOrZero), ("n", A::Count)])
            }
            Op::RepeatNeighbour => {
                [list(&[("spacing", A::Lengths3)]), vec![1.0, 0.0, 1.0]].concat()
            }
            Op::RepeatLimitedNeighbour => [
                list(&[("spacing", A::Lengths3), ("n", A::Counts3)]),
                vec![0.0, 1.0, 1.0],
            ]
            .concat(),
            Op::PolarNeighbour | Op::PolarPlaneNeighbour => {
                [list(&[("n", A::Count), ("phase", A::Angle)]), vec![1.0]].concat()
            }
            // The operands of these tests have slope one.
            Op::FieldGrowth => vec![0.5, 1.0, 1.5, 2.0],
            Op::ElongateCorrect => list(&[("by", A::Lengths3)]),
            Op::Bounded => vec![-0.5, -1.0, -0.75, 0.5, 0.25, 1.0, 0.5, 4.0],
            Op::NoiseOctave | Op::RidgeOctave => vec![self.coarse(0.5, 3.0), 0.5, 3.0],
            Op::Noise => vec![7.0],
            _ => (0..row.parameter_width())
                .map(|_| self.coarse(0.1, 1.0))
                .collect(),
        }
    }
}

/// Returns the constants of an operation, from its arguments.
pub(crate) fn constants(op: Op, arguments: &[f64]) -> Vec<f32> {
    pack_parameters(op, &prepare::<f64>(op, arguments))
}

/// An operation with its constants, ready to be evaluated.
pub(crate) struct Case {
    pub(crate) op: Op,
    pub(crate) arguments: Vec<f64>,
    pub(crate) constants: Vec<f32>,
}

impl Case {
    pub(crate) fn new(op: Op, arguments: &[f64]) -> Self {
        Self {
            op,
            arguments: arguments.to_vec(),
            constants: constants(op, arguments),
        }
    }
    /// Returns the value at a point, for given values of the operands.
    pub(crate) fn with(&self, p: Point, values: [f64; 3]) -> f64 {
        match apply::<f64>(self.op, point::<f64>(p), values, &self.constants) {
            OpResult::Value(v) => v,
            OpResult::Point(_) => panic!("{} gives a point", self.op.row().name),
        }
    }
    /// Returns the distance at a point, for a shape.
    pub(crate) fn at(&self, p: Point) -> f64 {
        self.with(p, [0.0; 3])
    }
    /// Returns the value and its gradient at a point, for operands with gradients.
    pub(crate) fn dual(&self, p: V3<f64>, values: [Dual<f64>; 3]) -> Dual<f64> {
        match apply::<Dual<f64>>(self.op, DualVec3::seed(p), values, &self.constants) {
            OpResult::Value(v) => v,
            OpResult::Point(_) => panic!("{} gives a point", self.op.row().name),
        }
    }
    /// Returns the result of a map of the point.
    pub(crate) fn map(&self, p: Point) -> Point {
        match apply::<f64>(self.op, point::<f64>(p), [0.0; 3], &self.constants) {
            OpResult::Point(q) => [q.x, q.y, q.z],
            OpResult::Value(_) => panic!("{} gives a value", self.op.row().name),
        }
    }
    /// Returns the value at a point, for the operands of [`operands`]. For a map of the point, it is the
    /// sum of the result's coordinates with different weights.
    pub(crate) fn on<R: Apply>(&self, p: R::Vec3) -> R {
        match apply::<R>(self.op, p, operands::<R>(self.op, p), &self.constants) {
            OpResult::Value(v) => v,
            OpResult::Point(q) => q.x() + q.y() * R::constant(0.75) + q.z() * R::constant(0.5),
        }
    }
    /// Returns the parameters, without gaps.
    pub(crate) fn parameters(&self) -> Vec<f64> {
        prepare::<f64>(self.op, &self.arguments)
    }
    pub(crate) fn name(&self) -> String {
        format!("{}{:?}", self.op.row().name, self.arguments)
    }
}

/// Returns operands as in a scene: three spheres; for arithmetic, numbers of a field.
pub(crate) fn operands<R: Real>(op: Op, p: R::Vec3) -> [R; 3] {
    let ball = |x: f64, y: f64, r: f64| {
        let c = R::Vec3::new(R::constant(x), R::constant(y), R::constant(0.125));
        (p - c).length() - R::constant(r)
    };
    match op {
        // A cosine, a truth value, …: within the valid range.
        Op::Asin | Op::Acos => [ball(0.0, 0.0, 1.0) * R::constant(0.25); 3],
        Op::Extrude | Op::RoundedExtrude => {
            let q = R::Vec3::new(p.x(), p.y(), R::constant(0.0));
            [q.length() - R::constant(0.5); 3]
        }
        _ => [
            ball(-0.375, 0.125, 0.5),
            ball(0.25, -0.25, 0.625),
            ball(0.5, 0.5, 0.25),
        ],
    }
}

pub(crate) fn point<R: Real>([x, y, z]: Point) -> R::Vec3 {
    R::Vec3::new(R::constant(x), R::constant(y), R::constant(z))
}

/// Returns the number of tries: `few` by default, and a million for each operation with `SDFC_LONG=1`.
pub(crate) fn tries(few: usize, cases: usize) -> usize {
    match std::env::var_os("SDFC_LONG") {
        Some(_) => few.max(1_000_000 / cases.max(1)),
        None => few,
    }
}

/// Returns random cases of every operation that satisfies a predicate.
pub(crate) fn cases(seed: u64, each: usize, wanted: impl Fn(Op) -> bool) -> Vec<Case> {
    let ops = ROWS.iter().map(|row| row.op).filter(|&op| wanted(op));
    ops.flat_map(|op| {
        let each = if op.row().parameters.is_empty() {
            1
        } else {
            each
        };
        let mut random = Random::for_case(seed, op.row().name);
        (0..each)
            .map(|_| Case::new(op, &random.arguments(op)))
            .collect::<Vec<_>>()
    })
    .collect()
}

pub(crate) fn is_shape(op: Op) -> bool {
    let row = op.row();
    row.reads_point() && row.arity() == 0 && row.output == Output::Value && !is_math(op)
}

pub(crate) fn is_math(op: Op) -> bool {
    op.row().facts.category == sdfc_vm::row::Category::Math
}

pub(crate) fn length(p: Point) -> f64 {
    DVec3::from(p).length()
}
pub(crate) fn sub(a: Point, b: Point) -> Point {
    (DVec3::from(a) - DVec3::from(b)).to_array()
}
pub(crate) fn add(a: Point, b: Point, t: f64) -> Point {
    (DVec3::from(a) + DVec3::from(b) * t).to_array()
}
pub(crate) fn dot(a: Point, b: Point) -> f64 {
    DVec3::from(a).dot(b.into())
}
pub(crate) fn distance(a: Point, b: Point) -> f64 {
    DVec3::from(a).distance(b.into())
}

/// Returns the value and the gradient at a point, by dual numbers.
pub(crate) fn gradient(case: &Case, p: Point) -> (f64, Point) {
    let d = case.on::<Dual<f64>>(DualVec3::seed(V3::new(p[0], p[1], p[2])));
    (d.value, [d.gradient.x, d.gradient.y, d.gradient.z])
}
