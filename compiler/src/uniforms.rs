//! Collects the uniform numbers that programs and pictures read, and builds the program that computes
//! them.

use crate::expression::{ExprId, Expression, Expressions, ParamId};
use crate::graph::GraphNumber;
use rustc_hash::{FxHashMap, FxHashSet};
use sdfc_vm::uniform::{UniformProgram, UniformStep};
use std::collections::HashMap;

/// Uniform numbers that are required so far.
#[derive(Clone, Debug, Default)]
pub struct Uniforms {
    program: UniformProgram,
    steps: HashMap<ExprId, u32>,
    outputs: HashMap<ExprId, u32>,
    /// Index of each parameter's first number among the inputs.
    first_inputs: Vec<u32>,
}

impl Uniforms {
    /// Creates an empty set for parameters with these numbers of components.
    pub fn new(widths: impl IntoIterator<Item = usize>) -> Self {
        let mut uniforms = Self::default();
        for width in widths {
            uniforms.first_inputs.push(uniforms.program.inputs);
            uniforms.program.inputs += width as u32;
        }
        uniforms
    }

    /// Returns a number as a constant or as an output of the uniform program. It must be a constant, or depend
    /// only on parameters and time.
    pub fn intern(&mut self, expressions: &Expressions, id: ExprId) -> GraphNumber {
        if let Some(v) = expressions.as_constant(id) {
            return GraphNumber::Constant(v as f32);
        }
        if let Some(&output) = self.outputs.get(&id) {
            return GraphNumber::Uniform(output);
        }
        let step = self.step(expressions, id);
        let output = self.program.outputs.len() as u32;
        self.program.outputs.push(step);
        self.outputs.insert(id, output);
        GraphNumber::Uniform(output)
    }

    /// Returns the step that computes a number, after those of its operands.
    fn step(&mut self, expressions: &Expressions, id: ExprId) -> u32 {
        for operand in postorder(expressions, id, |id| self.steps.contains_key(&id)) {
            let step_index = |id: &ExprId| self.steps[id];
            let step = match expressions.get(operand) {
                Expression::Constant(v) => UniformStep::Constant(*v),
                Expression::Param(ParamId(p), component) => {
                    UniformStep::Param(self.first_inputs[*p as usize] + u32::from(*component))
                }
                Expression::Time => UniformStep::Time,
                Expression::Coordinate(_) | Expression::NormalComponent(_) => {
                    unreachable!("a uniform number reads no point")
                }
                Expression::Apply {
                    op,
                    point,
                    values,
                    parameters,
                } => UniformStep::Apply {
                    op: *op as u8,
                    point: point.map(|p| p.map(|id| step_index(&id))),
                    values: values.iter().map(step_index).collect(),
                    parameters: parameters.iter().map(step_index).collect(),
                },
            };
            self.steps.insert(operand, self.program.steps.len() as u32);
            self.program.steps.push(step);
        }
        self.steps[&id]
    }

    /// Returns the program that computes all of them.
    pub fn finish(self) -> UniformProgram {
        self.program
    }
    /// Returns the program so far.
    pub fn program(&self) -> &UniformProgram {
        &self.program
    }
}

/// Rebuilds a number with some of its operands replaced. `change` receives three arguments: an operand, that
/// operand rebuilt from its replaced values, and these values.
pub(crate) fn rewrite_number(
    expressions: &mut Expressions,
    number: ExprId,
    mut change: impl FnMut(&mut Expressions, ExprId, ExprId, &[ExprId]) -> ExprId,
) -> ExprId {
    let mut new: FxHashMap<ExprId, ExprId> = FxHashMap::default();
    for id in postorder(expressions, number, |_| false) {
        let new_id = |id: &ExprId| new.get(id).copied().unwrap_or(*id);
        let changed = match expressions.get(id).clone() {
            Expression::Apply {
                op,
                point,
                values,
                parameters,
            } => {
                let point = point.map(|point| point.map(|id| new_id(&id)));
                let [values, parameters] =
                    [values, parameters].map(|ids| ids.iter().map(new_id).collect::<Vec<_>>());
                let rebuilt = expressions.apply(op, point, &values, &parameters);
                change(expressions, id, rebuilt, &values)
            }
            _ => change(expressions, id, id, &[]),
        };
        new.insert(id, changed);
    }
    new.get(&number).copied().unwrap_or(number)
}

/// Returns the number and all its transitive operands that are not `is_known`, each after its own
/// operands. A loop and not a recursion: sums can be as long as the loops of the scene.
pub fn postorder(
    expressions: &Expressions,
    id: ExprId,
    is_known: impl Fn(ExprId) -> bool,
) -> Vec<ExprId> {
    let mut reached = FxHashSet::default();
    let mut pending = vec![id];
    while let Some(id) = pending.pop() {
        if is_known(id) || !reached.insert(id) {
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
    // Operands are always built before their users.
    let mut order: Vec<ExprId> = reached.into_iter().collect();
    order.sort_unstable();
    order
}
