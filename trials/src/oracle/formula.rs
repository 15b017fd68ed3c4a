//! Numbers of a scene: the arithmetic of rows, and formulas of the point.

use super::arithmetic::arithmetic;
use super::point::{Point, point_along};
use super::range::{self, ValueRange};
use sdfc_compiler::expression::{ExprId, Expression, Expressions, ParamId, Stage};
use sdfc_compiler::scene::Scene;
use sdfc_vm::real::Real;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::cell::Cell;

/// Step of the central differences for the slope of noise.
const NOISE_DIFFERENCE_STEP: f64 = 1e-3;

/// Reports whether a row is a noise operation.
fn is_noise(op: Op) -> bool {
    matches!(
        op,
        Op::Noise | Op::NoiseOctave | Op::RidgeOctave | Op::NoiseSlope
    )
}

/// Returns the lattice noise that a noise row reads at a point.
///
/// Gradient noise is based on a hash that only the crate `vm` defines. Its noise is evaluated in `f64`.
fn lattice_noise(p: Point, numbers: &[f64]) -> f64 {
    match *numbers {
        [x, y, z, frequency, _, seed] => {
            let q = point_along([x, y, z], p, frequency);
            <f64 as Real>::noise(V3::new(q[0], q[1], q[2]), seed)
        }
        [seed, ..] => <f64 as Real>::noise(V3::new(p[0], p[1], p[2]), seed),
        [] => f64::NAN,
    }
}

/// Returns the directional derivative of noise, by differences.
fn slope_of_noise(p: Point, along: Point, seed: f64) -> f64 {
    let noise_at = |distance: f64| lattice_noise(point_along(p, along, distance), &[seed]);
    let difference = |distance: f64| (noise_at(distance) - noise_at(-distance)) / (2.0 * distance);
    // Richardson extrapolation cancels the third-order error.
    (4.0 * difference(NOISE_DIFFERENCE_STEP) - difference(2.0 * NOISE_DIFFERENCE_STEP)) / 3.0
}

/// Applies a noise row, which adds noise to `sum` where it is an octave.
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

/// All constant and uniform numbers of a scene at a time. Other numbers are NaN.
pub(super) struct SceneNumbers {
    values: Vec<f64>,
}

impl SceneNumbers {
    /// Computes the numbers for the current values of the scene's parameters.
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
            *operand = self.get(id);
        }
        match point {
            Some(p) if is_noise(op) => {
                let p = p.map(|id| self.get(id));
                noise(op, operands[0], p, &self.get_all(parameters))
            }
            _ => arithmetic(op, operands),
        }
    }

    /// Returns one number.
    pub(super) fn get(&self, id: ExprId) -> f64 {
        self.values[id.index()]
    }

    /// Returns several numbers.
    pub(super) fn get_all(&self, ids: &[ExprId]) -> Vec<f64> {
        ids.iter().map(|&id| self.get(id)).collect()
    }
}

/// Operand of a formula step.
#[derive(Clone, Copy, Debug)]
enum Operand {
    Number(f64),
    Coordinate(u8),
    Step(u32),
}

/// Step of a formula.
#[derive(Clone, Debug)]
enum FormulaStep {
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
    /// Number of formula steps that this thread has run.
    static STEPS_RUN: Cell<u64> = const { Cell::new(0) };
}

/// Returns the number of formula steps that this thread has run.
pub(super) fn effort() -> u64 {
    STEPS_RUN.get()
}

/// Point-dependent numbers as a list of steps per point. Uniform numbers are computed in advance.
#[derive(Clone, Debug)]
pub(super) struct PointFormula {
    steps: Vec<FormulaStep>,
    results: [Operand; 3],
}

impl PointFormula {
    /// Compiles the formula of up to three numbers. Results beyond the requested ones are zero.
    pub(super) fn new(
        expressions: &Expressions,
        numbers: &SceneNumbers,
        requested: &[ExprId],
    ) -> Self {
        let mut formula = Self {
            steps: Vec::new(),
            results: [Operand::Number(0.0); 3],
        };
        let mut needed: Vec<bool> = vec![false; expressions.len()];
        for id in requested {
            needed[id.index()] = true;
        }
        // Operands precede their users. One backward pass finds all of them, and one forward pass places
        // them.
        let listed: Vec<(ExprId, &Expression, Stage)> = expressions.since(0).collect();
        for (id, expression, stage) in listed.iter().rev() {
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
        let mut operands_by_id: Vec<Operand> = vec![Operand::Number(f64::NAN); expressions.len()];
        for (id, expression, stage) in listed {
            if !needed[id.index()] {
                continue;
            }
            operands_by_id[id.index()] = match expression {
                _ if stage <= Stage::Uniform => Operand::Number(numbers.get(id)),
                Expression::Coordinate(axis) => Operand::Coordinate(*axis),
                Expression::Apply {
                    op,
                    point,
                    values,
                    parameters,
                } => {
                    let operand_of = |id: &ExprId| operands_by_id[id.index()];
                    let mut operands = [Operand::Number(0.0); 3];
                    for (operand, id) in operands.iter_mut().zip(values) {
                        *operand = operand_of(id);
                    }
                    let step = match point {
                        Some(point) if is_noise(*op) => FormulaStep::Noise {
                            op: *op,
                            sum: operands[0],
                            point: [
                                operand_of(&point[0]),
                                operand_of(&point[1]),
                                operand_of(&point[2]),
                            ],
                            numbers: numbers.get_all(parameters),
                        },
                        _ => FormulaStep::Arithmetic { op: *op, operands },
                    };
                    formula.steps.push(step);
                    Operand::Step(formula.steps.len() as u32 - 1)
                }
                _ => Operand::Number(f64::NAN),
            };
        }
        for (result, id) in formula.results.iter_mut().zip(requested) {
            *result = operands_by_id[id.index()];
        }
        formula
    }

    /// Evaluates the formula at a point.
    pub(super) fn at(&self, p: Point) -> [f64; 3] {
        match self.steps.len() {
            0..=16 => self.run(p, &mut [0.0; 16]),
            17..=64 => self.run(p, &mut [0.0; 64]),
            65..=256 => self.run(p, &mut [0.0; 256]),
            long => self.run(p, &mut vec![0.0; long]),
        }
    }

    fn run(&self, p: Point, step_values: &mut [f64]) -> [f64; 3] {
        STEPS_RUN.set(STEPS_RUN.get() + self.steps.len() as u64);
        let read = |operand: Operand, step_values: &[f64]| match operand {
            Operand::Number(value) => value,
            Operand::Coordinate(axis) => p[usize::from(axis)],
            Operand::Step(index) => step_values[index as usize],
        };
        for (index, step) in self.steps.iter().enumerate() {
            step_values[index] = match step {
                FormulaStep::Arithmetic { op, operands } => {
                    arithmetic(*op, operands.map(|operand| read(operand, step_values)))
                }
                FormulaStep::Noise {
                    op,
                    sum,
                    point,
                    numbers,
                } => {
                    let q = point.map(|operand| read(operand, step_values));
                    noise(*op, read(*sum, step_values), q, numbers)
                }
            };
        }
        self.results.map(|result| read(result, step_values))
    }

    /// Returns ranges of the results within a cube of this half size around a point.
    pub(super) fn range(&self, p: Point, radius: f64) -> [ValueRange; 3] {
        let initial = ValueRange::UNBOUNDED;
        match self.steps.len() {
            0..=16 => self.run_range(p, radius, &mut [initial; 16]),
            17..=64 => self.run_range(p, radius, &mut [initial; 64]),
            long => self.run_range(p, radius, &mut vec![initial; long]),
        }
    }

    fn run_range(&self, p: Point, radius: f64, step_values: &mut [ValueRange]) -> [ValueRange; 3] {
        STEPS_RUN.set(STEPS_RUN.get() + self.steps.len() as u64);
        let read = |operand: Operand, step_values: &[ValueRange]| match operand {
            Operand::Number(value) => ValueRange::centred(value, 0.0),
            Operand::Coordinate(axis) => ValueRange::centred(p[usize::from(axis)], radius),
            Operand::Step(index) => step_values[index as usize],
        };
        for (index, step) in self.steps.iter().enumerate() {
            step_values[index] = match step {
                FormulaStep::Arithmetic { op, operands } => {
                    range::arithmetic(*op, operands.map(|operand| read(operand, step_values)))
                }
                FormulaStep::Noise {
                    op,
                    sum,
                    point,
                    numbers,
                } => {
                    let q = point.map(|operand| read(operand, step_values));
                    let centre_value = lattice_noise(q.map(|r| 0.5 * (r.low + r.high)), numbers);
                    range::noise(*op, read(*sum, step_values), q, centre_value, numbers)
                }
            };
        }
        self.results.map(|result| read(result, step_values))
    }
}
