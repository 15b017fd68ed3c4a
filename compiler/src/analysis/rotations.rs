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
#[derive(Clone, Copy)]
struct TurnedTerm {
    factor: f64,
    number: ExprId,
    op: Op,
    angle: ExprId,
}

/// Returns the rotations among numbers. Those of the last numbers come first.
pub(super) fn rotations(e: &Expressions, numbers: &[ExprId]) -> Vec<Rotation> {
    let turned = numbers.iter().rev();
    let turned = turned.filter_map(|&id| Some((id, turned_terms(e, id)?)));
    let turned: Vec<(ExprId, [TurnedTerm; 2])> = turned.take(MAX_NUMBERS).collect();
    let mut result = Vec::new();
    for (index, (second, second_terms)) in turned.iter().enumerate() {
        for (first, first_terms) in &turned[..index] {
            let rotated = rotated_numbers(*first_terms, *second_terms);
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
    let [c, d] = match is_partner(&a, &second[0]) && is_partner(&b, &second[1]) {
        true => second,
        false => [second[1], second[0]],
    };
    let terms = [a, b, c, d];
    let is_rotation = is_partner(&a, &c)
        && is_partner(&b, &d)
        && a.op != b.op
        && terms.iter().all(|term| term.angle == a.angle)
        && terms.iter().all(is_scaled)
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
    [[a, b], [b, a]].into_iter().find_map(|[number, turn]| {
        let Expression::Apply {
            op: op @ (Op::Sin | Op::Cos),
            values,
            ..
        } = e.get(turn)
        else {
            return None;
        };
        let (number, factor) = match e.operands_of(number, Op::Neg) {
            Some(&[inner]) => (inner, -term.factor),
            _ => (number, term.factor),
        };
        Some(TurnedTerm {
            factor,
            number,
            op: *op,
            angle: *values.first()?,
        })
    })
}
