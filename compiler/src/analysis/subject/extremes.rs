//! Numbers that are equivalent to a minimum or a maximum of others.

use crate::expression::{ExprId, Expression, Expressions, Stage};
use sdfc_vm::table::Op;

/// Maximum number of operands of a minimum.
const MAX_OPERANDS: usize = 64;
/// Maximum nesting of operations around a minimum.
const MAX_DEPTH: u32 = 12;

/// The operands of a minimum or a maximum.
#[derive(Debug, PartialEq)]
pub(super) struct Extremes {
    pub(super) is_minimum: bool,
    pub(super) values: Vec<ExprId>,
}

impl Extremes {
    /// Returns the operands of the minimum or the maximum that a number is equivalent to.
    ///
    /// Monotonic operations around it are moved into its operands.
    pub(super) fn find(expressions: &mut Expressions, id: ExprId) -> Option<Self> {
        nested(expressions, id, MAX_DEPTH)
    }
}

/// Finds the operands of nested minima or maxima. It recurses to at most `depth`.
fn nested(expressions: &mut Expressions, id: ExprId, depth: u32) -> Option<Extremes> {
    let Expression::Apply { op, values, .. } = expressions.get(id).clone() else {
        return None;
    };
    if depth == 0 || expressions.stage(id) <= Stage::Uniform {
        return None;
    }
    let sign = |expressions: &Expressions, id| match expressions.as_constant(id) {
        Some(v) if v > 0.0 => Some(false),
        Some(v) if v < 0.0 => Some(true),
        _ => None,
    };
    match (op, &*values) {
        (Op::Min | Op::Max, _) => {
            let is_minimum = op == Op::Min;
            let mut operands = Vec::new();
            for &value in &values {
                match nested(expressions, value, depth - 1) {
                    Some(inner) if inner.is_minimum == is_minimum => operands.extend(inner.values),
                    _ => operands.push(value),
                }
            }
            (operands.len() <= MAX_OPERANDS).then_some(Extremes {
                is_minimum,
                values: operands,
            })
        }
        (Op::Neg, &[a]) => {
            let inner = nested(expressions, a, depth - 1)?;
            Some(inner.map_operands(true, |value| expressions.call(op, &[value])))
        }
        (Op::Sqrt, &[a]) => {
            let inner = nested(expressions, a, depth - 1)?;
            Some(inner.map_operands(false, |value| expressions.call(op, &[value])))
        }
        (Op::Add | Op::Sub, &[a, b]) => match nested(expressions, a, depth - 1) {
            Some(inner) => {
                Some(inner.map_operands(false, |value| expressions.call(op, &[value, b])))
            }
            None => {
                let inner = nested(expressions, b, depth - 1)?;
                Some(inner.map_operands(op == Op::Sub, |value| expressions.call(op, &[a, value])))
            }
        },
        (Op::Mul, &[a, b]) => match (sign(expressions, a), sign(expressions, b)) {
            (Some(reverses), _) => {
                let inner = nested(expressions, b, depth - 1)?;
                Some(inner.map_operands(reverses, |value| expressions.call(op, &[a, value])))
            }
            (_, Some(reverses)) => {
                let inner = nested(expressions, a, depth - 1)?;
                Some(inner.map_operands(reverses, |value| expressions.call(op, &[value, b])))
            }
            _ => None,
        },
        (Op::Div, &[a, b]) => {
            let reverses = sign(expressions, b)?;
            let inner = nested(expressions, a, depth - 1)?;
            Some(inner.map_operands(reverses, |value| expressions.call(op, &[value, b])))
        }
        _ => None,
    }
}

impl Extremes {
    /// Applies a monotonic operation to each operand; a decreasing one (`reverses`) swaps minimum and
    /// maximum.
    fn map_operands(self, reverses: bool, map: impl FnMut(ExprId) -> ExprId) -> Self {
        Self {
            is_minimum: self.is_minimum != reverses,
            values: self.values.into_iter().map(map).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn minima_are_found_below_what_keeps_the_order_of_numbers() {
        let mut expressions = Expressions::default();
        let [x, y, z] = [0, 1, 2].map(|axis| expressions.coordinate(axis));
        let constant_two = expressions.constant(2.0);
        let minus = expressions.constant(-2.0);
        let largest = expressions.call(Op::Max, &[x, y]);
        let smallest = expressions.call(Op::Min, &[largest, z]);
        let scaled = expressions.call(Op::Mul, &[constant_two, smallest]);
        let [a, b] = [largest, z].map(|value| expressions.call(Op::Mul, &[constant_two, value]));
        let extremes = Extremes::find(&mut expressions, scaled).expect("a minimum");
        assert_eq!((extremes.is_minimum, extremes.values), (true, vec![a, b]));
        let divided = expressions.call(Op::Div, &[smallest, minus]);
        let extremes = Extremes::find(&mut expressions, divided).expect("a maximum");
        assert!(!extremes.is_minimum && extremes.values.len() == 2);
        let three = expressions.call(Op::Min, &[smallest, x]);
        let shifted = expressions.call(Op::Sub, &[y, three]);
        let extremes = Extremes::find(&mut expressions, shifted).expect("a maximum");
        assert!(!extremes.is_minimum && extremes.values.len() == 3);
        // A factor of unknown sign is not monotonic, and a sum of coordinates is not a minimum.
        let product = expressions.call(Op::Mul, &[smallest, x]);
        assert_eq!(Extremes::find(&mut expressions, product), None);
        let sum = expressions.call(Op::Add, &[x, y]);
        assert_eq!(Extremes::find(&mut expressions, sum), None);
    }
}
