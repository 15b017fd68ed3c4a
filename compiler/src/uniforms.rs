//! Collects the uniform numbers that programs and pictures read, and makes the program that
//! computes them.

use crate::expression::{ExprId, Expression, Expressions, ParamId};
use crate::graph::Number;
use sdfc_vm::uniform::{Step, UniformProgram};
use std::collections::{HashMap, HashSet};

/// The uniform numbers wanted so far.
#[derive(Clone, Debug, Default)]
pub struct Uniforms {
    program: UniformProgram,
    steps: HashMap<ExprId, u32>,
    outputs: HashMap<ExprId, u32>,
    /// Where each parameter's numbers start among the inputs.
    starts: Vec<u32>,
}

impl Uniforms {
    /// For parameters of these many numbers each.
    pub fn new(widths: impl IntoIterator<Item = usize>) -> Self {
        let mut uniforms = Self::default();
        for width in widths {
            uniforms.starts.push(uniforms.program.inputs);
            uniforms.program.inputs += width as u32;
        }
        uniforms
    }

    /// The number, folded or as a result of the uniform program. It must be uniform.
    pub fn number(&mut self, expressions: &Expressions, id: ExprId) -> Number {
        if let Some(v) = expressions.as_constant(id) {
            return Number::Constant(v as f32);
        }
        if let Some(&output) = self.outputs.get(&id) {
            return Number::Uniform(output);
        }
        let step = self.step(expressions, id);
        let output = self.program.outputs.len() as u32;
        self.program.outputs.push(step);
        self.outputs.insert(id, output);
        Number::Uniform(output)
    }

    /// The step that computes a number; those of its operands first.
    fn step(&mut self, expressions: &Expressions, id: ExprId) -> u32 {
        for needed in operands_first(expressions, id, |id| self.steps.contains_key(&id)) {
            let at = |id: &ExprId| self.steps[id];
            let step = match expressions.get(needed) {
                Expression::Constant(v) => Step::Constant(*v),
                Expression::Param(ParamId(p), component) => {
                    Step::Param(self.starts[*p as usize] + u32::from(*component))
                }
                Expression::Time => Step::Time,
                Expression::Coordinate(_) | Expression::NormalComponent(_) => {
                    unreachable!("a uniform number reads no point")
                }
                Expression::Apply {
                    op,
                    point,
                    values,
                    parameters,
                } => Step::Apply {
                    op: *op as u8,
                    point: point.map(|p| p.map(|id| at(&id))),
                    values: values.iter().map(at).collect(),
                    parameters: parameters.iter().map(at).collect(),
                },
            };
            self.steps.insert(needed, self.program.steps.len() as u32);
            self.program.steps.push(step);
        }
        self.steps[&id]
    }

    /// The program that computes all of them.
    pub fn finish(self) -> UniformProgram {
        self.program
    }
    /// The program so far.
    pub fn program(&self) -> &UniformProgram {
        &self.program
    }
}

/// A number with some of what it is computed from exchanged. `change` gets each part, that part made of the new
/// operands, and these.
pub(crate) fn rewritten(
    expressions: &mut Expressions,
    number: ExprId,
    mut change: impl FnMut(&mut Expressions, ExprId, ExprId, &[ExprId]) -> ExprId,
) -> ExprId {
    let mut new: HashMap<ExprId, ExprId> = HashMap::new();
    for id in operands_first(expressions, number, |_| false) {
        let other = |id: &ExprId| new.get(id).copied().unwrap_or(*id);
        let changed = match expressions.get(id).clone() {
            Expression::Apply {
                op,
                point,
                values,
                parameters,
            } => {
                let point = point.map(|point| point.map(|id| other(&id)));
                let [values, parameters] =
                    [values, parameters].map(|ids| ids.iter().map(other).collect::<Vec<_>>());
                let written = expressions.apply(op, point, &values, &parameters);
                change(expressions, id, written, &values)
            }
            _ => change(expressions, id, id, &[]),
        };
        new.insert(id, changed);
    }
    new.get(&number).copied().unwrap_or(number)
}

/// The number and all that it is computed from, each after its operands, but for those that are
/// `known`. A loop and not a recursion: sums can be as long as the text's loops run.
pub fn operands_first(
    expressions: &Expressions,
    id: ExprId,
    known: impl Fn(ExprId) -> bool,
) -> Vec<ExprId> {
    let mut found = HashSet::new();
    let mut pending = vec![id];
    while let Some(id) = pending.pop() {
        if known(id) || !found.insert(id) {
            continue;
        }
        if let Expression::Apply {
            point,
            values,
            parameters,
            ..
        } = expressions.get(id)
        {
            pending.extend(point.iter().flatten().chain(values).chain(parameters));
        }
    }
    // Operands are always built before what reads them.
    let mut order: Vec<ExprId> = found.into_iter().collect();
    order.sort_unstable();
    order
}
