//! Pairs of numbers that are a rotation of two others, by an angle that may vary with the point.

use crate::analysis::terms::{Sum, Term};
use crate::expression::{ExprId, Expression, Expressions};
use sdfc_vm::table::Op;

/// Maximum relative difference of two factors that count as equal.
const MAX_DIFFERENCE: f64 = 1e-12;
/// Maximum number of numbers that are compared with each other.
const MAX_NUMBERS: usize = 64;

/// Rotation or reflection of a pair of numbers in their plane. It may be scaled.
#[derive(Clone, Copy)]
pub(super) struct Rotation {
    pub(super) from: [ExprId; 2],
    pub(super) to: [ExprId; 2],
    /// Ratio of the length of `to` to that of `from`.
    pub(super) scale: f64,
}

/// A term `factor * number * cos(angle)`, or the same with `sin`.
#[derive(Clone)]
struct TurnedTerm {
    factor: f64,
    number: ExprId,
    op: Op,
    angle: Angle,
}

/// Angle as a sum of multiples, in the order of their numbers and with a positive first one.
#[derive(Clone, PartialEq)]
struct Angle {
    terms: Vec<Term>,
    constant: f64,
}

impl Angle {
    /// Returns an angle with its sign; `None` if it has too many terms.
    fn of(e: &Expressions, number: ExprId) -> Option<(Self, f64)> {
        let Sum {
            mut terms,
            constant,
        } = Sum::of(e, number)?;
        terms.sort_by_key(|term| term.number);
        let is_negative = terms.first().is_some_and(|term| term.factor < 0.0);
        let sign = if is_negative { -1.0 } else { 1.0 };
        for term in &mut terms {
            term.factor *= sign;
        }
        let constant = constant * sign;
        Some((Self { terms, constant }, sign))
    }
}

/// Returns the rotations among numbers. Those of the last numbers come first.
pub(super) fn rotations(e: &Expressions, numbers: &[ExprId]) -> Vec<Rotation> {
    let turned = numbers.iter().rev();
    let turned = turned.filter_map(|&id| Some((id, turned_terms(e, id)?)));
    let turned: Vec<(ExprId, [TurnedTerm; 2])> = turned.take(MAX_NUMBERS).collect();
    let mut result = Vec::new();
    for (index, (second, second_terms)) in turned.iter().enumerate() {
        for (first, first_terms) in &turned[..index] {
            let rotated = rotated_numbers(first_terms.clone(), second_terms.clone());
            result.extend(rotated.map(|(from, scale)| Rotation {
                from,
                to: [*first, *second],
                scale,
            }));
        }
    }
    result
}

/// Returns the two numbers of which a pair is a rotation, and the scale of that map.
fn rotated_numbers([a, b]: [TurnedTerm; 2], second: [TurnedTerm; 2]) -> Option<([ExprId; 2], f64)> {
    let scale = a.factor.abs();
    let is_scaled = |term: &TurnedTerm| (term.factor.abs() - scale).abs() <= MAX_DIFFERENCE * scale;
    // Each number has the other function of the same angle in the second sum.
    let is_partner =
        |one: &TurnedTerm, other: &TurnedTerm| one.number == other.number && one.op != other.op;
    let [c, d] = match (
        is_partner(&a, &second[0]) && is_partner(&b, &second[1]),
        second,
    ) {
        (true, second) => second,
        (false, [c, d]) => [d, c],
    };
    let is_rotation = is_partner(&a, &c)
        && is_partner(&b, &d)
        && a.op != b.op
        && [&b, &c, &d].iter().all(|term| term.angle == a.angle && is_scaled(term))
        // Columns of a rotation are at right angles.
        && a.factor * b.factor * c.factor * d.factor < 0.0;
    is_rotation.then_some(([a.number, b.number], scale))
}

/// Returns the terms of a sum of two numbers, each times the sine or cosine of an angle.
fn turned_terms(e: &Expressions, number: ExprId) -> Option<[TurnedTerm; 2]> {
    let is_sum = [Op::Add, Op::Sub]
        .iter()
        .any(|&op| e.operands_of(number, op).is_some());
    let sum = is_sum.then(|| Sum::of(e, number))??;
    let &[first, second] = sum.terms.as_slice() else {
        return None;
    };
    if sum.constant != 0.0 {
        return None;
    }
    Some([turned_term(e, first)?, turned_term(e, second)?])
}

/// Returns a term as a number times the sine or cosine of an angle.
fn turned_term(e: &Expressions, term: Term) -> Option<TurnedTerm> {
    let &[a, b] = e.operands_of(term.number, Op::Mul)? else {
        return None;
    };
    let without_sign = |number: ExprId| match e.operands_of(number, Op::Neg) {
        Some(&[inner]) => (inner, -1.0),
        _ => (number, 1.0),
    };
    [[a, b], [b, a]].into_iter().find_map(|[number, turn]| {
        let ((number, sign), (turn, turn_sign)) = (without_sign(number), without_sign(turn));
        let Expression::Apply {
            op: op @ (Op::Sin | Op::Cos),
            values,
            ..
        } = e.get(turn)
        else {
            return None;
        };
        let (angle, angle_sign) = Angle::of(e, *values.first()?)?;
        let angle_sign = if *op == Op::Sin { angle_sign } else { 1.0 };
        Some(TurnedTerm {
            factor: term.factor * sign * turn_sign * angle_sign,
            number,
            op: *op,
            angle,
        })
    })
}
