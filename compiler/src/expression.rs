//! Numbers that a scene computes: a hash-consed graph of scalar operations.
//!
//! Each number has one of four stages:
//! - constant: folded as it is built;
//! - uniform: depends on live `param`s or `time`, and is computed once per change, in `f64`;
//! - point: depends on the point of its field or material, and becomes instructions;
//! - normal: depends on the surface's normal, too, and becomes instructions.
//!
//! The operations are the rows of the table, so a sum means the same at every stage.

use rustc_hash::FxHashMap;
use sdfc_vm::apply::{OpResult, apply};
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;

/// Largest exponent of a power that is written as products.
const MAX_PRODUCT_EXPONENT: f64 = 16.0;

/// Number of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ExprId(u32);

impl ExprId {
    /// Returns its index among all numbers; operands have smaller indices.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Parameter of the scene, by its index in [`crate::scene::Scene::params`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ParamId(pub u32);

/// Stage at which a number is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// While compiling.
    Constant,
    /// Once the parameters and the time are.
    Uniform,
    /// At a point.
    Point,
    /// At a point of the surface, with its normal.
    Normal,
}

/// Definition of a number.
#[derive(Clone, Debug, PartialEq)]
pub enum Expression {
    /// Written or folded number.
    Constant(f64),
    /// Component of a live parameter (colours and vectors have three).
    Param(ParamId, u8),
    /// Time of the animation, in seconds.
    Time,
    /// Coordinate of the point of the field or material that contains the number.
    Coordinate(u8),
    /// Component of the surface's unit normal, in the same frame as the coordinates.
    NormalComponent(u8),
    /// Operation of the table.
    Apply {
        /// Operation that returns a value.
        op: Op,
        /// Point that it reads, if any.
        point: Option<[ExprId; 3]>,
        /// Operands, in the row's order; each has a smaller index.
        values: Vec<ExprId>,
        /// Numbers of its parameters, without gaps; of uniform stage at the latest.
        parameters: Vec<ExprId>,
    },
}

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum Key {
    Constant(u64),
    Param(ParamId, u8),
    Time,
    Coordinate(u8),
    NormalComponent(u8),
    Apply(Op, Option<[ExprId; 3]>, Vec<ExprId>, Vec<ExprId>),
}

/// All numbers of a scene, without duplicates.
#[derive(Clone, Debug, Default)]
pub struct Expressions {
    nodes: Vec<(Expression, Stage)>,
    ids: FxHashMap<Key, ExprId>,
}

impl Expressions {
    /// Returns the definition of a number.
    pub fn get(&self, id: ExprId) -> &Expression {
        &self.nodes[id.0 as usize].0
    }
    /// Returns the stage of a number.
    pub fn stage(&self, id: ExprId) -> Stage {
        self.nodes[id.0 as usize].1
    }
    /// Returns all numbers from index `start` on, operands before their users.
    pub fn since(&self, start: usize) -> impl Iterator<Item = (ExprId, &Expression, Stage)> {
        let nodes = self.nodes.iter().enumerate().skip(start);
        nodes.map(|(index, (node, stage))| (ExprId(index as u32), node, *stage))
    }
    /// Returns the number of distinct numbers.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }
    /// Reports whether there are no numbers.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }
    /// Returns the value of a constant.
    pub fn as_constant(&self, id: ExprId) -> Option<f64> {
        match self.get(id) {
            Expression::Constant(v) => Some(*v),
            _ => None,
        }
    }

    /// Returns the operands of a number that an operation computes; `None` for any other number.
    pub(crate) fn operands_of(&self, id: ExprId, op: Op) -> Option<&[ExprId]> {
        match self.get(id) {
            Expression::Apply {
                op: own, values, ..
            } if *own == op => Some(values),
            _ => None,
        }
    }

    fn insert(&mut self, key: Key, node: impl FnOnce() -> Expression, stage: Stage) -> ExprId {
        if let Some(&id) = self.ids.get(&key) {
            return id;
        }
        let id = ExprId(self.nodes.len() as u32);
        self.nodes.push((node(), stage));
        self.ids.insert(key, id);
        id
    }

    /// Adds a constant.
    pub fn constant(&mut self, value: f64) -> ExprId {
        // Both zeros are one number.
        let value = value + 0.0;
        self.insert(
            Key::Constant(value.to_bits()),
            || Expression::Constant(value),
            Stage::Constant,
        )
    }
    /// Adds a component of a live parameter.
    pub fn param(&mut self, param: ParamId, component: u8) -> ExprId {
        let node = || Expression::Param(param, component);
        self.insert(Key::Param(param, component), node, Stage::Uniform)
    }
    /// Adds the time.
    pub fn time(&mut self) -> ExprId {
        self.insert(Key::Time, || Expression::Time, Stage::Uniform)
    }
    /// Adds a coordinate of the local point.
    pub fn coordinate(&mut self, axis: u8) -> ExprId {
        self.insert(
            Key::Coordinate(axis),
            || Expression::Coordinate(axis),
            Stage::Point,
        )
    }
    /// Adds a component of the normal.
    pub fn normal(&mut self, axis: u8) -> ExprId {
        self.insert(
            Key::NormalComponent(axis),
            || Expression::NormalComponent(axis),
            Stage::Normal,
        )
    }

    /// Adds the result of an operation. It is folded if all operands are constant, and has the uniform
    /// stage if all of them are at most uniform.
    pub fn apply(
        &mut self,
        op: Op,
        point: Option<[ExprId; 3]>,
        values: &[ExprId],
        parameters: &[ExprId],
    ) -> ExprId {
        // Analyses are tighter for one operation than for two: for squares, and for fractional parts.
        let (op, values) = match (op, values) {
            (Op::Mul, [a, b]) if a == b => (Op::Square, &values[..1]),
            (Op::Sub, [a, b]) if self.is_floor_of(*b, *a) => (Op::Fract, &values[..1]),
            other => other,
        };
        let inputs = || point.iter().flatten().chain(values).chain(parameters);
        let stage = inputs()
            .map(|&id| self.stage(id))
            .max()
            .unwrap_or(Stage::Constant);
        if stage == Stage::Constant
            && let Some(value) = self.fold(op, point, values, parameters)
        {
            return self.constant(value);
        }
        let key = Key::Apply(op, point, values.to_vec(), parameters.to_vec());
        let node = || Expression::Apply {
            op,
            point,
            values: values.to_vec(),
            parameters: parameters.to_vec(),
        };
        self.insert(key, node, stage)
    }

    /// Reports whether `id` is the floor of `operand`.
    fn is_floor_of(&self, id: ExprId, operand: ExprId) -> bool {
        let Expression::Apply { op, values, .. } = self.get(id) else {
            return false;
        };
        *op == Op::Floor && **values == [operand]
    }

    /// Returns the exponent of a power that is written as products: a constant integer of at most 16.
    pub(crate) fn product_exponent(&self, exponent: ExprId) -> Option<i32> {
        let value = self.as_constant(exponent)?;
        let is_product = value.fract() == 0.0 && value.abs() <= MAX_PRODUCT_EXPONENT;
        is_product.then_some(value as i32)
    }

    /// Adds a power that is not written as products. A constant integer exponent also applies to negative bases.
    pub(crate) fn power(&mut self, base: ExprId, exponent: ExprId) -> ExprId {
        let integer = self.as_constant(exponent).filter(|v| v.fract() == 0.0);
        let Some(integer) = integer else {
            return self.call_where_defined(Op::Pow, &[base, exponent]);
        };
        let magnitude = self.call(Op::Abs, &[base]);
        let power = self.call(Op::Pow, &[magnitude, exponent]);
        if integer % 2.0 == 0.0 {
            return power;
        }
        let sign = self.call(Op::Sign, &[base]);
        self.call(Op::Mul, &[sign, power])
    }

    /// Adds an operation that is not folded where its result is not defined.
    pub(crate) fn call_where_defined(&mut self, op: Op, values: &[ExprId]) -> ExprId {
        let constants: Option<Vec<f64>> = values.iter().map(|&id| self.as_constant(id)).collect();
        let defined_for = op.row().facts.defined_for;
        if constants.is_none_or(|operands| defined_for.includes(&operands)) {
            return self.call(op, values);
        }
        let node = Expression::Apply {
            op,
            point: None,
            values: values.to_vec(),
            parameters: Vec::new(),
        };
        let key = Key::Apply(op, None, values.to_vec(), Vec::new());
        self.insert(key, || node, Stage::Constant)
    }

    /// Adds an operation without a point or parameters.
    pub fn call(&mut self, op: Op, values: &[ExprId]) -> ExprId {
        self.apply(op, None, values, &[])
    }

    fn fold(
        &self,
        op: Op,
        point: Option<[ExprId; 3]>,
        values: &[ExprId],
        parameters: &[ExprId],
    ) -> Option<f64> {
        let value = |id: ExprId| self.as_constant(id);
        let p = match point {
            Some([x, y, z]) => V3::new(value(x)?, value(y)?, value(z)?),
            None => V3::new(0.0, 0.0, 0.0),
        };
        let mut operands = [0.0; 3];
        for (slot, &id) in operands.iter_mut().zip(values) {
            *slot = value(id)?;
        }
        let constants: Option<Vec<f64>> = parameters.iter().map(|&id| value(id)).collect();
        match apply::<f64>(
            op,
            p,
            operands,
            &sdfc_vm::apply::pack_parameters(op, &constants?),
        ) {
            OpResult::Value(v) => Some(v),
            OpResult::Point(_) => None,
        }
    }
}
