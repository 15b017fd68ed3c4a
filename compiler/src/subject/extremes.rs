//! Numbers that are written as a minimum or a maximum of others.

use crate::expression::{ExprId, Expression, Expressions, Stage};
use sdfc_vm::table::Op;

/// The most operands of a minimum.
const MAX_OPERANDS: usize = 64;
/// The deepest nesting of the operations around a minimum.
const MAX_DEPTH: u32 = 12;

/// The operands of a minimum or a maximum.
#[derive(Debug, PartialEq)]
pub(super) struct Extremes {
    pub(super) is_minimum: bool,
    pub(super) values: Vec<ExprId>,
}

impl Extremes {
    /// The operands of the minimum or the maximum that a number is.
    ///
    /// Operations around it that keep or turn the order of numbers are moved into its operands.
    pub(super) fn of(graph: &mut Expressions, id: ExprId) -> Option<Self> {
        nested(graph, id, MAX_DEPTH)
    }
}

/// Recursion to at most `depth`.
fn nested(graph: &mut Expressions, id: ExprId, depth: u32) -> Option<Extremes> {
    let Expression::Apply { op, values, .. } = graph.get(id).clone() else {
        return None;
    };
    if depth == 0 || graph.stage(id) <= Stage::Uniform {
        return None;
    }
    let sign = |graph: &Expressions, id| match graph.as_constant(id) {
        Some(v) if v > 0.0 => Some(false),
        Some(v) if v < 0.0 => Some(true),
        _ => None,
    };
    match (op, &*values) {
        (Op::Min | Op::Max, _) => {
            let is_minimum = op == Op::Min;
            let mut all = Vec::new();
            for &value in &values {
                match nested(graph, value, depth - 1) {
                    Some(inner) if inner.is_minimum == is_minimum => all.extend(inner.values),
                    _ => all.push(value),
                }
            }
            (all.len() <= MAX_OPERANDS).then_some(Extremes {
                is_minimum,
                values: all,
            })
        }
        (Op::Neg, &[a]) => {
            let inner = nested(graph, a, depth - 1)?;
            Some(inner.each(true, |value| graph.call(op, &[value])))
        }
        (Op::Sqrt, &[a]) => {
            let inner = nested(graph, a, depth - 1)?;
            Some(inner.each(false, |value| graph.call(op, &[value])))
        }
        (Op::Add | Op::Sub, &[a, b]) => match nested(graph, a, depth - 1) {
            Some(inner) => Some(inner.each(false, |value| graph.call(op, &[value, b]))),
            None => {
                let inner = nested(graph, b, depth - 1)?;
                Some(inner.each(op == Op::Sub, |value| graph.call(op, &[a, value])))
            }
        },
        (Op::Mul, &[a, b]) => match (sign(graph, a), sign(graph, b)) {
            (Some(turns), _) => {
                let inner = nested(graph, b, depth - 1)?;
                Some(inner.each(turns, |value| graph.call(op, &[a, value])))
            }
            (_, Some(turns)) => {
                let inner = nested(graph, a, depth - 1)?;
                Some(inner.each(turns, |value| graph.call(op, &[value, b])))
            }
            _ => None,
        },
        (Op::Div, &[a, b]) => {
            let turns = sign(graph, b)?;
            let inner = nested(graph, a, depth - 1)?;
            Some(inner.each(turns, |value| graph.call(op, &[value, b])))
        }
        _ => None,
    }
}

impl Extremes {
    /// The same of other numbers, whose order is turned if `turns`.
    fn each(self, turns: bool, change: impl FnMut(ExprId) -> ExprId) -> Self {
        Self {
            is_minimum: self.is_minimum != turns,
            values: self.values.into_iter().map(change).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn minima_are_found_below_what_keeps_the_order_of_numbers() {
        let mut graph = Expressions::default();
        let [x, y, z] = [0, 1, 2].map(|axis| graph.coordinate(axis));
        let two = graph.constant(2.0);
        let minus = graph.constant(-2.0);
        let largest = graph.call(Op::Max, &[x, y]);
        let both = graph.call(Op::Min, &[largest, z]);
        let scaled = graph.call(Op::Mul, &[two, both]);
        let [a, b] = [largest, z].map(|value| graph.call(Op::Mul, &[two, value]));
        let found = Extremes::of(&mut graph, scaled).expect("a minimum");
        assert_eq!((found.is_minimum, found.values), (true, vec![a, b]));
        let turned = graph.call(Op::Div, &[both, minus]);
        let found = Extremes::of(&mut graph, turned).expect("a maximum");
        assert!(!found.is_minimum && found.values.len() == 2);
        let three = graph.call(Op::Min, &[both, x]);
        let shifted = graph.call(Op::Sub, &[y, three]);
        let found = Extremes::of(&mut graph, shifted).expect("a maximum");
        assert!(!found.is_minimum && found.values.len() == 3);
        // A factor of either sign keeps no order, and a product of a minimum is none.
        let product = graph.call(Op::Mul, &[both, x]);
        assert_eq!(Extremes::of(&mut graph, product), None);
        let sum = graph.call(Op::Add, &[x, y]);
        assert_eq!(Extremes::of(&mut graph, sum), None);
    }
}
