//! Number type whose values are numbers of the scene. The table's `prepare` functions, the affine
//! bodies and gradients thus run on constants, live parameters and coordinates alike.
//!
//! The scene's expressions are lent to the thread during [`with_expressions`]. Sums and products with neutral
//! constants are left out. So the matrix of a rotation about an axis stays as small as if written by
//! hand.

use crate::expression::{ExprId, Expressions};
use sdfc_vm::real::Real;
use sdfc_vm::table::Op;
use sdfc_vm::vector::{V2, V3};
use std::cell::RefCell;
use std::ops::{Add, Div, Mul, Neg, Sub};

thread_local! {
    static EXPRESSIONS: RefCell<Expressions> = RefCell::default();
}

/// Number among the expressions that [`with_expressions`] lent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Symbolic(pub(crate) ExprId);

/// Condition: a number that is 1 or 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Condition(ExprId);

impl Symbolic {
    /// Returns the point itself.
    pub(crate) fn point() -> V3<Self> {
        let [x, y, z] = [0, 1, 2].map(|axis| {
            Self(EXPRESSIONS.with_borrow_mut(|expressions| expressions.coordinate(axis)))
        });
        V3::new(x, y, z)
    }

    /// Returns the value of an operation of the table, as one operation.
    pub(crate) fn apply_op(op: Op, p: V3<Self>, values: &[Self], parameters: &[Self]) -> Self {
        let [values, parameters] = [values, parameters]
            .map(|numbers| numbers.iter().map(|number| number.0).collect::<Vec<_>>());
        let point = op.row().reads_point().then_some([p.x.0, p.y.0, p.z.0]);
        if point.is_none() && parameters.is_empty() {
            return Self(call(op, &values));
        }
        Self(
            EXPRESSIONS
                .with_borrow_mut(|expressions| expressions.apply(op, point, &values, &parameters)),
        )
    }
}

/// Runs `work` while symbolic numbers refer to `expressions`.
pub(crate) fn with_expressions<T>(expressions: &mut Expressions, work: impl FnOnce() -> T) -> T {
    EXPRESSIONS.with_borrow_mut(|lent| std::mem::swap(lent, expressions));
    let result = work();
    EXPRESSIONS.with_borrow_mut(|lent| std::mem::swap(lent, expressions));
    result
}

/// Returns the result of an operation, or an operand where the operation changes nothing.
pub(crate) fn simplified(expressions: &mut Expressions, op: Op, values: &[ExprId]) -> ExprId {
    let constant = |index: usize| {
        values
            .get(index)
            .and_then(|&id| expressions.as_constant(id))
    };
    let (left, right) = (constant(0), constant(1));
    match op {
        Op::Add if left == Some(0.0) => values[1],
        Op::Add | Op::Sub if right == Some(0.0) => values[0],
        Op::Sub if left == Some(0.0) => simplified(expressions, Op::Neg, &values[1..]),
        Op::Mul if left == Some(1.0) => values[1],
        Op::Mul | Op::Div if right == Some(1.0) => values[0],
        Op::Mul if left == Some(0.0) => values[0],
        Op::Mul if right == Some(0.0) => values[1],
        Op::Select if values[1] == values[2] => values[1],
        Op::Mix if constant(2) == Some(0.0) => values[0],
        Op::Mix if constant(2) == Some(1.0) => values[1],
        _ => expressions.call(op, values),
    }
}

fn call(op: Op, values: &[ExprId]) -> ExprId {
    EXPRESSIONS.with_borrow_mut(|expressions| simplified(expressions, op, values))
}

macro_rules! operators {
    ($($trait:ident $method:ident)*) => {$(
        impl $trait for Symbolic {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                Self(call(Op::$trait, &[self.0, other.0]))
            }
        }
    )*};
}
operators! { Add add Sub sub Mul mul Div div }

impl Neg for Symbolic {
    type Output = Self;
    fn neg(self) -> Self {
        Self(call(Op::Neg, &[self.0]))
    }
}

impl Real for Symbolic {
    type Bool = Condition;
    type Vec2 = V2<Self>;
    type Vec3 = V3<Self>;

    fn constant(value: f64) -> Self {
        Self(EXPRESSIONS.with_borrow_mut(|expressions| expressions.constant(value)))
    }
    fn abs(self) -> Self {
        Self(call(Op::Abs, &[self.0]))
    }
    fn sqrt(self) -> Self {
        Self(call(Op::Sqrt, &[self.0]))
    }
    fn floor(self) -> Self {
        Self(call(Op::Floor, &[self.0]))
    }
    fn min(self, other: Self) -> Self {
        Self(call(Op::Min, &[self.0, other.0]))
    }
    fn max(self, other: Self) -> Self {
        Self(call(Op::Max, &[self.0, other.0]))
    }
    fn sin(self) -> Self {
        Self(call(Op::Sin, &[self.0]))
    }
    fn cos(self) -> Self {
        Self(call(Op::Cos, &[self.0]))
    }
    fn atan2(self, x: Self) -> Self {
        Self(call(Op::Atan2, &[self.0, x.0]))
    }
    fn exp2(self) -> Self {
        Self(call(Op::Exp2, &[self.0]))
    }
    fn log2(self) -> Self {
        Self(call(Op::Log2, &[self.0]))
    }
    fn power_of_two(self) -> Self {
        self.exp2()
    }
    fn exponent(self) -> Self {
        self.log2().floor()
    }
    fn mantissa(self) -> Self {
        self / self.exponent().exp2()
    }
    fn lattice(_cell: V3<Self>, _seed: Self) -> V3<Self> {
        unreachable!("random numbers are no part of a gradient")
    }
    fn noise_corner_gradient(_cell: V3<Self>, _seed: Self) -> V3<Self> {
        unreachable!("noise is a row of its own")
    }
    fn noise_gradient(p: V3<Self>, seed: Self) -> (Self, V3<Self>) {
        (
            Self::apply_op(Op::Noise, p, &[], &[seed]),
            Self::noise_slope(p, seed),
        )
    }
    fn noise_slope(p: V3<Self>, seed: Self) -> V3<Self> {
        let (zero, one) = (Self::constant(0.0), Self::constant(1.0));
        let component = |x, y, z| Self::apply_op(Op::NoiseSlope, p, &[], &[x, y, z, seed]);
        V3::new(
            component(one, zero, zero),
            component(zero, one, zero),
            component(zero, zero, one),
        )
    }
    fn less(self, other: Self) -> Condition {
        Condition(call(Op::Less, &[self.0, other.0]))
    }
    fn and(a: Condition, b: Condition) -> Condition {
        Condition(call(Op::And, &[a.0, b.0]))
    }
    fn or(a: Condition, b: Condition) -> Condition {
        Condition(call(Op::Or, &[a.0, b.0]))
    }
    fn not(a: Condition) -> Condition {
        Condition(call(Op::Not, &[a.0]))
    }
    fn select(condition: Condition, then: Self, otherwise: Self) -> Self {
        Self(call(Op::Select, &[condition.0, then.0, otherwise.0]))
    }
}
