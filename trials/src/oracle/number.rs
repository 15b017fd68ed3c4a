//! Numbers of a scene: the arithmetic of rows, and formulas of the point.

use super::point::{Point, beyond};
use super::range::{self, Range};
use sdfc_compiler::expression::{ExprId, Expression, Expressions, ParamId, Stage};
use sdfc_compiler::scene::Scene;
use sdfc_vm::real::Real;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::cell::Cell;

/// The smallest divisor, for which smaller ones count.
const MIN_DIVISOR: f64 = 1e-18;
/// The smallest number that an inverse root is taken of.
const MIN_INVERSE_ROOT_OPERAND: f64 = 1e-30;
/// The distance of the points between which the slope of noise is found.
const SLOPE_STEP: f64 = 1e-3;

/// The number that an operation of arithmetic makes of its operands, in order.
///
/// # Panics
///
/// For operations that are no arithmetic: the elaborator makes no number of them.
pub(super) fn arithmetic(op: Op, [a, b, c]: [f64; 3]) -> f64 {
    let truth = |holds: bool| if holds { 1.0 } else { 0.0 };
    match op {
        Op::Add => a + b,
        Op::Sub => a - b,
        Op::Mul => a * b,
        Op::Square => a * a,
        Op::Div => a / divisor(b),
        Op::Modulo => a - divisor(b) * (a / divisor(b)).floor(),
        Op::Neg => -a,
        Op::Abs => a.abs(),
        Op::Sign if a == 0.0 => 0.0,
        Op::Sign => a.signum(),
        Op::Min => a.min(b),
        Op::Max => a.max(b),
        Op::Clamp => a.max(b).min(c),
        Op::Floor => a.floor(),
        Op::Ceil => a.ceil(),
        Op::Round => (a + 0.5).floor(),
        Op::Fract => a - a.floor(),
        Op::Trunc => a.trunc(),
        Op::Sqrt => a.max(0.0).sqrt(),
        Op::InverseSqrt => a.max(MIN_INVERSE_ROOT_OPERAND).sqrt().recip(),
        Op::Sin => a.sin(),
        Op::Cos => a.cos(),
        Op::Tan => a.tan(),
        Op::Asin => a.clamp(-1.0, 1.0).asin(),
        Op::Acos => a.clamp(-1.0, 1.0).acos(),
        Op::Atan => a.atan(),
        Op::Atan2 => a.atan2(b),
        Op::Sinh => a.sinh(),
        Op::Cosh => a.cosh(),
        Op::Tanh => a.tanh(),
        Op::Exp => a.exp(),
        Op::Exp2 => a.exp2(),
        Op::Ln => a.max(f64::MIN_POSITIVE).ln(),
        Op::Log2 => a.max(f64::MIN_POSITIVE).log2(),
        Op::Pow => a.max(0.0).powf(b),
        Op::Step => truth(b >= a),
        Op::Smoothstep => {
            let t = ((c - a) / divisor(b - a)).clamp(0.0, 1.0);
            t * t * (3.0 - 2.0 * t)
        }
        Op::Mix => a + (b - a) * c,
        Op::Less => truth(a < b),
        Op::And => a.min(b),
        Op::Or => a.max(b),
        Op::Not => 1.0 - a,
        Op::Select if a > 0.5 => b,
        Op::Select => c,
        _ => panic!("`{op:?}` is no arithmetic"),
    }
}

/// A divisor kept away from zero.
fn divisor(b: f64) -> f64 {
    if b.abs() < MIN_DIVISOR {
        MIN_DIVISOR
    } else {
        b
    }
}

/// Tells if a row is one of those of noise.
fn is_noise(op: Op) -> bool {
    matches!(
        op,
        Op::Noise | Op::NoiseOctave | Op::RidgeOctave | Op::NoiseSlope
    )
}

/// The noise that a row of noise reads at a point.
///
/// Gradient noise is made of a hash, which only the crate `vm` defines: its noise is called, in
/// `f64`.
fn lattice_noise(p: Point, numbers: &[f64]) -> f64 {
    match *numbers {
        [x, y, z, frequency, _, seed] => {
            let q = beyond([x, y, z], p, frequency);
            <f64 as Real>::noise(V3::of(q[0], q[1], q[2]), seed)
        }
        [seed, ..] => <f64 as Real>::noise(V3::of(p[0], p[1], p[2]), seed),
        [] => f64::NAN,
    }
}

/// The slope of noise along a direction, as a difference.
fn slope_of_noise(p: Point, along: Point, seed: f64) -> f64 {
    let at = |by: f64| lattice_noise(beyond(p, along, by), &[seed]);
    let difference = |by: f64| (at(by) - at(-by)) / (2.0 * by);
    // The error of the third order is taken out.
    (4.0 * difference(SLOPE_STEP) - difference(2.0 * SLOPE_STEP)) / 3.0
}

/// Noise of one of the rows on top of a number.
fn noise(op: Op, sum: f64, p: Point, numbers: &[f64]) -> f64 {
    if let (Op::NoiseSlope, [x, y, z, seed]) = (op, numbers) {
        return slope_of_noise(p, [*x, *y, *z], *seed);
    }
    let value = lattice_noise(p, numbers);
    match (op, numbers) {
        (Op::NoiseOctave, [_, _, _, _, amplitude, _]) => sum + amplitude * value,
        (Op::RidgeOctave, [_, _, _, _, amplitude, _]) => {
            sum + amplitude * (1.0 - 2.0 * value.abs())
        }
        _ => value,
    }
}

/// All constant and uniform numbers of a scene at a time, and NaN for others.
pub(super) struct Numbers {
    values: Vec<f64>,
}

impl Numbers {
    /// The numbers for the present values of the scene's parameters.
    pub(super) fn new(scene: &Scene, time: f64) -> Self {
        let mut numbers = Self {
            values: Vec::with_capacity(scene.expressions.len()),
        };
        for (_, expression, stage) in scene.expressions.since(0) {
            let value = match expression {
                _ if stage > Stage::Uniform => f64::NAN,
                Expression::Constant(value) => *value,
                Expression::Param(ParamId(param), component) => {
                    scene.params[*param as usize].value[usize::from(*component)]
                }
                Expression::Time => time,
                Expression::Apply {
                    op,
                    point,
                    values,
                    parameters,
                } => numbers.apply(*op, *point, values, parameters),
                Expression::Coordinate(_) | Expression::NormalComponent(_) => f64::NAN,
            };
            numbers.values.push(value);
        }
        numbers
    }

    fn apply(
        &self,
        op: Op,
        point: Option<[ExprId; 3]>,
        values: &[ExprId],
        parameters: &[ExprId],
    ) -> f64 {
        let mut operands = [0.0; 3];
        for (operand, &id) in operands.iter_mut().zip(values) {
            *operand = self.one(id);
        }
        match point {
            Some(p) if is_noise(op) => {
                let p = p.map(|id| self.one(id));
                noise(op, operands[0], p, &self.all(parameters))
            }
            _ => arithmetic(op, operands),
        }
    }

    /// One number.
    pub(super) fn one(&self, id: ExprId) -> f64 {
        self.values[id.index()]
    }

    /// Several numbers.
    pub(super) fn all(&self, ids: &[ExprId]) -> Vec<f64> {
        ids.iter().map(|&id| self.one(id)).collect()
    }
}

/// A number that a step of a formula reads.
#[derive(Clone, Copy, Debug)]
enum Operand {
    Number(f64),
    Coordinate(u8),
    Step(u32),
}

/// A step of a formula.
#[derive(Clone, Debug)]
enum Step {
    Arithmetic {
        op: Op,
        operands: [Operand; 3],
    },
    Noise {
        op: Op,
        sum: Operand,
        point: [Operand; 3],
        numbers: Vec<f64>,
    },
}

thread_local! {
    /// The number of steps of formulas that this thread has run.
    static EFFORT: Cell<u64> = const { Cell::new(0) };
}

/// The number of steps of formulas that this thread has run.
pub(super) fn effort() -> u64 {
    EFFORT.get()
}

/// Numbers of point stage as steps that run on each point, all uniform ones computed before.
#[derive(Clone, Debug)]
pub(super) struct Formula {
    steps: Vec<Step>,
    results: [Operand; 3],
}

impl Formula {
    /// The formula of up to three numbers. Results that are not asked for are zero.
    pub(super) fn new(expressions: &Expressions, numbers: &Numbers, wanted: &[ExprId]) -> Self {
        let mut formula = Self {
            steps: Vec::new(),
            results: [Operand::Number(0.0); 3],
        };
        let mut needed: Vec<bool> = vec![false; expressions.len()];
        for id in wanted {
            needed[id.index()] = true;
        }
        // Operands stand before what uses them: one pass from the end finds all, one from the start
        // places them.
        let all: Vec<(ExprId, &Expression, Stage)> = expressions.since(0).collect();
        for (id, expression, stage) in all.iter().rev() {
            if let Expression::Apply {
                point,
                values,
                parameters: _,
                ..
            } = expression
                && needed[id.index()]
                && *stage > Stage::Uniform
            {
                for operand in point.iter().flatten().chain(values) {
                    needed[operand.index()] = true;
                }
            }
        }
        let mut places: Vec<Operand> = vec![Operand::Number(f64::NAN); expressions.len()];
        for (id, expression, stage) in all {
            if !needed[id.index()] {
                continue;
            }
            places[id.index()] = match expression {
                _ if stage <= Stage::Uniform => Operand::Number(numbers.one(id)),
                Expression::Coordinate(axis) => Operand::Coordinate(*axis),
                Expression::Apply {
                    op,
                    point,
                    values,
                    parameters,
                } => {
                    let place = |id: &ExprId| places[id.index()];
                    let mut operands = [Operand::Number(0.0); 3];
                    for (operand, id) in operands.iter_mut().zip(values) {
                        *operand = place(id);
                    }
                    let step = match point {
                        Some(point) if is_noise(*op) => Step::Noise {
                            op: *op,
                            sum: operands[0],
                            point: [place(&point[0]), place(&point[1]), place(&point[2])],
                            numbers: numbers.all(parameters),
                        },
                        _ => Step::Arithmetic { op: *op, operands },
                    };
                    formula.steps.push(step);
                    Operand::Step(formula.steps.len() as u32 - 1)
                }
                _ => Operand::Number(f64::NAN),
            };
        }
        for (result, id) in formula.results.iter_mut().zip(wanted) {
            *result = places[id.index()];
        }
        formula
    }

    /// The results at a point.
    pub(super) fn at(&self, p: Point) -> [f64; 3] {
        match self.steps.len() {
            0..=16 => self.run(p, &mut [0.0; 16]),
            17..=64 => self.run(p, &mut [0.0; 64]),
            65..=256 => self.run(p, &mut [0.0; 256]),
            long => self.run(p, &mut vec![0.0; long]),
        }
    }

    fn run(&self, p: Point, done: &mut [f64]) -> [f64; 3] {
        EFFORT.set(EFFORT.get() + self.steps.len() as u64);
        let read = |operand: Operand, done: &[f64]| match operand {
            Operand::Number(value) => value,
            Operand::Coordinate(axis) => p[usize::from(axis)],
            Operand::Step(at) => done[at as usize],
        };
        for (at, step) in self.steps.iter().enumerate() {
            done[at] = match step {
                Step::Arithmetic { op, operands } => {
                    arithmetic(*op, operands.map(|operand| read(operand, done)))
                }
                Step::Noise {
                    op,
                    sum,
                    point,
                    numbers,
                } => {
                    let q = point.map(|operand| read(operand, done));
                    noise(*op, read(*sum, done), q, numbers)
                }
            };
        }
        self.results.map(|result| read(result, done))
    }

    /// The ranges of the results within a radius of a point.
    pub(super) fn range(&self, p: Point, radius: f64) -> [Range; 3] {
        let nothing = Range::EVERYTHING;
        match self.steps.len() {
            0..=16 => self.run_range(p, radius, &mut [nothing; 16]),
            17..=64 => self.run_range(p, radius, &mut [nothing; 64]),
            long => self.run_range(p, radius, &mut vec![nothing; long]),
        }
    }

    fn run_range(&self, p: Point, radius: f64, done: &mut [Range]) -> [Range; 3] {
        EFFORT.set(EFFORT.get() + self.steps.len() as u64);
        let read = |operand: Operand, done: &[Range]| match operand {
            Operand::Number(value) => Range::around(value, 0.0),
            Operand::Coordinate(axis) => Range::around(p[usize::from(axis)], radius),
            Operand::Step(at) => done[at as usize],
        };
        for (at, step) in self.steps.iter().enumerate() {
            done[at] = match step {
                Step::Arithmetic { op, operands } => {
                    range::arithmetic(*op, operands.map(|operand| read(operand, done)))
                }
                Step::Noise {
                    op,
                    sum,
                    point,
                    numbers,
                } => {
                    let q = point.map(|operand| read(operand, done));
                    let middle = lattice_noise(q.map(|r| 0.5 * (r.low + r.high)), numbers);
                    range::noise(*op, read(*sum, done), q, middle, numbers)
                }
            };
        }
        self.results.map(|result| read(result, done))
    }
}
