//! Numbers that a scene computes: a hash-consed graph of scalar operations.
//!
//! A number is known at one of four stages. *Constant* numbers are folded as they are built.
//! *Uniform* numbers depend on live `param`s or `time`: they become a small program that runs once
//! per change, in `f64`. *Point* numbers depend on the point of the field or material they stand
//! in, *normal* numbers also on the surface's normal; they become instructions.
//!
//! The operations are the rows of the table, so a sum means the same at every stage.

use sdfc_vm::apply::{Applied, apply};
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::collections::HashMap;

/// A number of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ExprId(u32);

impl ExprId {
    /// Its position among all numbers; a number's operands stand before it.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A parameter of the scene, by its position in [`crate::scene::Scene::params`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ParamId(pub u32);

/// When a number is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// While compiling.
    Constant,
    /// When the parameters and the time are.
    Uniform,
    /// At a point.
    Point,
    /// At a point of the surface, with its normal.
    Normal,
}

/// How a number comes about.
#[derive(Clone, Debug, PartialEq)]
pub enum Expression {
    /// It was written, or folded.
    Constant(f64),
    /// A component of a live parameter (colours and vectors have three).
    Param(ParamId, u8),
    /// The time of the animation, in seconds.
    Time,
    /// A coordinate of the point of the field or material that the number stands in.
    Coordinate(u8),
    /// A component of the surface's unit normal, in the same frame as the coordinates.
    NormalComponent(u8),
    /// A row of the table.
    Apply {
        /// The operation; it gives a value.
        op: Op,
        /// The point it reads, if it reads one.
        point: Option<[ExprId; 3]>,
        /// Its operands.
        values: Vec<ExprId>,
        /// The numbers of its parameters, without gaps; uniform at the latest.
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

/// All numbers of a scene; equal ones are one.
#[derive(Clone, Debug, Default)]
pub struct Expressions {
    nodes: Vec<(Expression, Stage)>,
    known: HashMap<Key, ExprId>,
}

impl Expressions {
    /// The number's definition.
    pub fn get(&self, id: ExprId) -> &Expression {
        &self.nodes[id.0 as usize].0
    }
    /// When the number is known.
    pub fn stage(&self, id: ExprId) -> Stage {
        self.nodes[id.0 as usize].1
    }
    /// All numbers from the `start`-th on, operands before what uses them.
    pub fn since(&self, start: usize) -> impl Iterator<Item = (ExprId, &Expression, Stage)> {
        let nodes = self.nodes.iter().enumerate().skip(start);
        nodes.map(|(at, (node, stage))| (ExprId(at as u32), node, *stage))
    }
    /// How many different numbers there are.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }
    /// The value of a constant.
    pub fn as_constant(&self, id: ExprId) -> Option<f64> {
        match self.get(id) {
            Expression::Constant(v) => Some(*v),
            _ => None,
        }
    }

    fn insert(&mut self, key: Key, node: impl FnOnce() -> Expression, stage: Stage) -> ExprId {
        if let Some(&id) = self.known.get(&key) {
            return id;
        }
        let id = ExprId(self.nodes.len() as u32);
        self.nodes.push((node(), stage));
        self.known.insert(key, id);
        id
    }

    /// A constant.
    pub fn constant(&mut self, value: f64) -> ExprId {
        // Both zeros are one number.
        let value = value + 0.0;
        self.insert(
            Key::Constant(value.to_bits()),
            || Expression::Constant(value),
            Stage::Constant,
        )
    }
    /// A component of a live parameter.
    pub fn param(&mut self, param: ParamId, component: u8) -> ExprId {
        let node = || Expression::Param(param, component);
        self.insert(Key::Param(param, component), node, Stage::Uniform)
    }
    /// The time.
    pub fn time(&mut self) -> ExprId {
        self.insert(Key::Time, || Expression::Time, Stage::Uniform)
    }
    /// A coordinate of the local point.
    pub fn coordinate(&mut self, axis: u8) -> ExprId {
        self.insert(
            Key::Coordinate(axis),
            || Expression::Coordinate(axis),
            Stage::Point,
        )
    }
    /// A component of the normal.
    pub fn normal(&mut self, axis: u8) -> ExprId {
        self.insert(
            Key::NormalComponent(axis),
            || Expression::NormalComponent(axis),
            Stage::Normal,
        )
    }

    /// The result of an operation; folded if all it reads is constant, and kept as a uniform
    /// expression if all it reads is uniform.
    pub fn apply(
        &mut self,
        op: Op,
        point: Option<[ExprId; 3]>,
        values: &[ExprId],
        parameters: &[ExprId],
    ) -> ExprId {
        // What is said in one operation, more is known of: of a square, and of what a number has beyond a whole one.
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

    /// Reports whether a number is the largest whole one not above another.
    fn is_floor_of(&self, id: ExprId, of: ExprId) -> bool {
        let Expression::Apply { op, values, .. } = self.get(id) else {
            return false;
        };
        *op == Op::Floor && **values == [of]
    }

    /// An operation without a point or parameters.
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
            Some([x, y, z]) => V3::of(value(x)?, value(y)?, value(z)?),
            None => V3::of(0.0, 0.0, 0.0),
        };
        let mut operands = [0.0; 3];
        for (slot, &id) in operands.iter_mut().zip(values) {
            *slot = value(id)?;
        }
        let constants: Option<Vec<f64>> = parameters.iter().map(|&id| value(id)).collect();
        match apply::<f64>(op, p, operands, &sdfc_vm::apply::laid_out(op, &constants?)) {
            Applied::Value(v) => Some(v),
            Applied::Point(_) => None,
        }
    }
}
