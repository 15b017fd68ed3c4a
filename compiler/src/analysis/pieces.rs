//! Plateaus of numbers: values that a number that varies may have in a part of space.

use crate::expression::{ExprId, Expression, Expressions, Stage};
use crate::uniforms::postorder;
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// Maximum number of values of plateaus that are counted one by one.
const MAX_VALUES: usize = 16;

/// Values that a number may have in a part of space. Plateaus of sums whose terms cancel are not found.
#[derive(Clone, Debug)]
pub(crate) struct Pieces {
    /// Values, without repetitions; `None` for unknown or too many ones.
    values: Option<Vec<f64>>,
    /// Set if the number has no other values, but for parts without thickness.
    are_all: bool,
}

impl Pieces {
    /// Number without plateaus.
    const NONE: Self = Self {
        values: Some(Vec::new()),
        are_all: false,
    };
    /// Number that consists of unknown plateaus.
    const UNKNOWN: Self = Self {
        values: None,
        are_all: true,
    };

    fn of_values(values: &[f64], are_all: bool) -> Self {
        let mut distinct: Vec<f64> = Vec::new();
        for &value in values {
            if !distinct.contains(&value) {
                distinct.push(value);
            }
        }
        Self {
            values: (distinct.len() <= MAX_VALUES).then_some(distinct),
            are_all,
        }
    }

    /// Reports whether there may be a plateau of any value.
    pub(crate) fn may_have_any(&self) -> bool {
        self.values.as_ref().is_none_or(|values| !values.is_empty())
    }

    /// Reports whether there may be a plateau of this value.
    pub(crate) fn may_contain(&self, value: f64) -> bool {
        (self.values.as_ref()).is_none_or(|values| values.contains(&value))
    }

    /// Reports whether a number consists of plateaus of any values.
    pub(crate) fn are_all_unknown(&self) -> bool {
        self.are_all && self.values.is_none()
    }

    /// Returns the values of plateaus, if they are known.
    pub(crate) fn values(&self) -> Option<&[f64]> {
        self.values.as_deref()
    }

    /// Returns all values of a number that has few.
    pub(crate) fn all_values(&self) -> Option<Vec<f64>> {
        self.values.clone().filter(|_| self.are_all)
    }

    /// Reports whether a number is zero or one everywhere.
    pub(crate) fn is_switch(&self) -> bool {
        let is_end = |value: &f64| *value == 0.0 || *value == 1.0;
        let values = self.values.as_ref().filter(|_| self.are_all);
        values.is_some_and(|values| values.iter().all(is_end))
    }

    fn is_zero(&self) -> bool {
        self.values.as_deref() == Some(&[0.0])
    }
}

/// Plateaus of numbers that were searched.
#[derive(Debug, Default)]
pub(crate) struct PieceSearch {
    known: HashMap<ExprId, Pieces>,
    /// Numbers that are taken apart, and whether they may have plateaus.
    possible: HashMap<ExprId, bool>,
}

impl PieceSearch {
    /// Returns the plateaus of a number. Those of a uniform number are its values.
    pub(crate) fn of(&mut self, e: &mut Expressions, number: ExprId) -> &Pieces {
        if !self.known.contains_key(&number) {
            for id in postorder(e, number, |id| self.known.contains_key(&id)) {
                if !self.known.contains_key(&id) {
                    let pieces = self.search(e, id);
                    self.known.insert(id, pieces);
                }
            }
        }
        &self.known[&number]
    }

    /// Reports whether a number has operands that may have plateaus.
    pub(crate) fn are_possible(&mut self, e: &Expressions, number: ExprId) -> bool {
        let mut pending = vec![number];
        let mut order = Vec::new();
        while let Some(id) = pending.pop() {
            if self.possible.contains_key(&id) {
                continue;
            }
            self.possible.insert(id, false);
            order.push(id);
            if let Expression::Apply { point, values, .. } = e.get(id) {
                pending.extend(point.iter().flatten().chain(values));
            }
        }
        order.sort_unstable();
        for id in order {
            let Expression::Apply {
                op, point, values, ..
            } = e.get(id)
            else {
                continue;
            };
            let mut operands = point.iter().flatten().chain(values);
            let is_possible = makes_plateaus(*op) || operands.any(|id| self.possible[id]);
            self.possible.insert(id, is_possible);
        }
        self.possible[&number]
    }

    fn search(&self, e: &mut Expressions, id: ExprId) -> Pieces {
        if let Some(value) = e.as_constant(id) {
            return Pieces::of_values(&[value], true);
        }
        if e.stage(id) <= Stage::Uniform {
            return Pieces::UNKNOWN;
        }
        let Expression::Apply {
            op,
            point: None,
            values,
            parameters,
        } = e.get(id).clone()
        else {
            return Pieces::NONE;
        };
        let operands: Vec<&Pieces> = values.iter().map(|id| &self.known[id]).collect();
        let are_all = operands.iter().all(|pieces| pieces.are_all);
        match op {
            Op::Floor | Op::Ceil | Op::Round | Op::Trunc => Pieces::UNKNOWN,
            Op::Sign => match operands[0].may_contain(0.0) {
                true => Pieces::of_values(&[-1.0, 0.0, 1.0], true),
                false => Pieces::of_values(&[-1.0, 1.0], true),
            },
            Op::Step | Op::Less | Op::And | Op::Or | Op::Not => {
                Pieces::of_values(&[0.0, 1.0], true)
            }
            Op::Smoothstep => Pieces::of_values(&[0.0, 1.0], false),
            Op::Min | Op::Max | Op::Clamp => united(&operands, are_all),
            Op::Select => {
                let are_all = operands[1..].iter().all(|pieces| pieces.are_all);
                united(&operands[1..], are_all)
            }
            Op::Mix if operands[2].is_switch() => united(&operands[..2], are_all),
            Op::Mul if operands.iter().any(|pieces| pieces.is_zero()) => {
                Pieces::of_values(&[0.0], are_all)
            }
            Op::Div if operands[0].is_zero() => Pieces::of_values(&[0.0], are_all),
            Op::Mul | Op::Div
                if operands[0].may_contain(0.0)
                    || op == Op::Mul && operands[1].may_contain(0.0) =>
            {
                let zero = Pieces::of_values(&[0.0], false);
                united(&[&zero, &results(e, op, &operands)], are_all)
            }
            _ if parameters.is_empty() => results(e, op, &operands),
            _ => {
                match operands.iter().all(|pieces| pieces.may_have_any()) && !operands.is_empty() {
                    true => Pieces {
                        are_all,
                        ..Pieces::UNKNOWN
                    },
                    false => Pieces::NONE,
                }
            }
        }
    }
}

/// Reports whether an operation may have plateaus where its operands have none.
fn makes_plateaus(op: Op) -> bool {
    matches!(
        op,
        Op::Min
            | Op::Max
            | Op::Clamp
            | Op::Abs
            | Op::Floor
            | Op::Ceil
            | Op::Round
            | Op::Trunc
            | Op::Sign
            | Op::Step
            | Op::Smoothstep
            | Op::Select
            | Op::Less
            | Op::And
            | Op::Or
            | Op::Not
    )
}

/// Returns the plateaus of a number that has the value of one operand everywhere.
fn united(operands: &[&Pieces], are_all: bool) -> Pieces {
    let values: Option<Vec<&Vec<f64>>> = operands.iter().map(|it| it.values.as_ref()).collect();
    match values {
        Some(values) => {
            let values: Vec<f64> = values.into_iter().flatten().copied().collect();
            Pieces::of_values(&values, are_all)
        }
        None => Pieces {
            are_all,
            ..Pieces::UNKNOWN
        },
    }
}

/// Returns the plateaus of an operation: where all of its operands have one.
fn results(e: &mut Expressions, op: Op, operands: &[&Pieces]) -> Pieces {
    let are_all = operands.iter().all(|pieces| pieces.are_all);
    if !operands.iter().all(|pieces| pieces.may_have_any()) {
        return Pieces::NONE;
    }
    let unknown = Pieces {
        are_all,
        ..Pieces::UNKNOWN
    };
    let mut tuples = vec![Vec::new()];
    for pieces in operands {
        let Some(values) = &pieces.values else {
            return unknown;
        };
        if tuples.len() * values.len() > MAX_VALUES * MAX_VALUES {
            return unknown;
        }
        let extended = tuples.iter().flat_map(|tuple: &Vec<f64>| {
            values.iter().map(|&value| {
                let mut tuple = tuple.clone();
                tuple.push(value);
                tuple
            })
        });
        tuples = extended.collect();
    }
    let mut values = Vec::with_capacity(tuples.len());
    for tuple in tuples {
        let operands: Vec<ExprId> = tuple.iter().map(|&value| e.constant(value)).collect();
        let result = e.call(op, &operands);
        match (e.as_constant(result), op, tuple.as_slice()) {
            // Powers of zero are rounded up.
            (_, Op::Pow, &[0.0, exponent]) if exponent > 0.0 => values.push(0.0),
            (Some(value), ..) => values.push(value),
            _ => return unknown,
        }
    }
    Pieces::of_values(&values, are_all)
}
