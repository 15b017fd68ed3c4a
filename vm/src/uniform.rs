//! Uniform expressions: numbers that depend only on parameters and time. They are computed once per change,
//! in `f64`, and written to the constants. Changing a parameter never changes a program.

use crate::apply::{OpResult, apply, pack_parameters};
use crate::table::Op;
use crate::vector::V3;

/// One number, computed from earlier ones.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum UniformStep {
    /// A constant.
    Constant(f64),
    /// A number of the parameters, by its index in the module's list.
    Param(u32),
    /// The time in seconds.
    Time,
    /// An operation of the table on earlier steps.
    Apply {
        /// The operation's code.
        op: u8,
        /// The coordinates of the point it reads, if it reads one.
        point: Option<[u32; 3]>,
        /// Indices of the steps that compute its operands.
        values: Vec<u32>,
        /// Its parameters, without gaps.
        parameters: Vec<u32>,
    },
}

/// A straight-line program over `f64`.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct UniformProgram {
    /// Number of numbers in the parameters.
    pub inputs: u32,
    /// The steps; each reads only earlier ones.
    pub steps: Vec<UniformStep>,
    /// Indices of the steps whose values are the results.
    pub outputs: Vec<u32>,
}

/// The reasons why a uniform program cannot run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UniformError {
    /// A step reads itself or a later one, or an output refers to a step that does not exist.
    #[error("step {0} of the uniform program reads what is not computed yet")]
    Order(u32),
    /// A step reads a parameter that does not exist.
    #[error("step {0} of the uniform program reads a parameter that does not exist")]
    Input(u32),
    /// The operation of a step is unknown or has the wrong number of operands.
    #[error("step {0} of the uniform program is not an operation of the table")]
    Operation(u32),
}

impl UniformProgram {
    /// Checks that every step reads only existing numbers.
    pub fn verify(&self) -> Result<(), UniformError> {
        for (i, step) in self.steps.iter().enumerate() {
            let i = i as u32;
            match step {
                UniformStep::Constant(_) | UniformStep::Time => {}
                UniformStep::Param(p) if *p < self.inputs => {}
                UniformStep::Param(_) => return Err(UniformError::Input(i)),
                UniformStep::Apply {
                    op,
                    point,
                    values,
                    parameters,
                } => {
                    let mut read = point.iter().flatten().chain(values).chain(parameters);
                    if read.any(|&r| r >= i) {
                        return Err(UniformError::Order(i));
                    }
                    let row = Op::from_code(*op).ok_or(UniformError::Operation(i))?.row();
                    let expected: usize = row.parameters.iter().map(|p| p.ty.width()).sum();
                    let fits = row.arity() == values.len()
                        && row.reads_point() == point.is_some()
                        && expected == parameters.len()
                        && row.output == crate::row::Output::Value;
                    if !fits {
                        return Err(UniformError::Operation(i));
                    }
                }
            }
        }
        match self
            .outputs
            .iter()
            .find(|&&o| o as usize >= self.steps.len())
        {
            Some(&o) => Err(UniformError::Order(o)),
            None => Ok(()),
        }
    }

    /// Returns the uniform values for these parameters and this time. The program must be verified.
    pub fn run(&self, params: &[f64], time: f64) -> Vec<f64> {
        let mut values: Vec<f64> = Vec::with_capacity(self.steps.len());
        for step in &self.steps {
            let value = match step {
                UniformStep::Constant(v) => *v,
                UniformStep::Param(p) => params[*p as usize],
                UniformStep::Time => time,
                UniformStep::Apply {
                    op,
                    point,
                    values: operands,
                    parameters,
                } => {
                    let step_value = |&i: &u32| values[i as usize];
                    let p = point.map_or(V3::new(0.0, 0.0, 0.0), |[x, y, z]| {
                        V3::new(step_value(&x), step_value(&y), step_value(&z))
                    });
                    let mut v = [0.0; 3];
                    for (slot, operand) in v.iter_mut().zip(operands) {
                        *slot = step_value(operand);
                    }
                    let numbers: Vec<f64> = parameters.iter().map(step_value).collect();
                    let op = Op::from_code(*op).expect("verified");
                    match apply::<f64>(op, p, v, &pack_parameters(op, &numbers)) {
                        OpResult::Value(v) => v,
                        OpResult::Point(_) => unreachable!("verified"),
                    }
                }
            };
            values.push(value);
        }
        self.outputs.iter().map(|&o| values[o as usize]).collect()
    }
}
