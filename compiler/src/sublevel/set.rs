//! Sets of points, each by a field that is negative in it.

use crate::expression::{ExprId, Expression, Expressions};
use sdfc_vm::table::Op;

/// Maximum depth of conditions and fields that are compared.
const MAX_DEPTH: u32 = 16;
/// Maximum number of cases into which a condition is split.
const MAX_CASES: usize = 32;

/// Set of points, up to parts without thickness.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Set {
    /// No point.
    Empty,
    /// All points.
    All,
    /// Points at which a field is negative.
    Field(ExprId),
}

impl Set {
    /// Returns all other points.
    pub(super) fn complement(self, e: &mut Expressions) -> Self {
        match self {
            Self::Empty => Self::All,
            Self::All => Self::Empty,
            Self::Field(field) => Self::Field(negated(e, field)),
        }
    }

    /// Returns the points of one set or the other.
    pub(super) fn union(self, other: Self, e: &mut Expressions) -> Self {
        match (self, other) {
            (Self::All, _) | (_, Self::All) => Self::All,
            (Self::Empty, set) | (set, Self::Empty) => set,
            (Self::Field(a), Self::Field(b)) if a == b => self,
            (Self::Field(a), Self::Field(b)) => Self::Field(e.call(Op::Min, &[a, b])),
        }
    }

    /// Returns the points of both sets.
    pub(super) fn intersection(self, other: Self, e: &mut Expressions) -> Self {
        match (self, other) {
            (Self::Empty, _) | (_, Self::Empty) => Self::Empty,
            (Self::All, set) | (set, Self::All) => set,
            (Self::Field(a), Self::Field(b)) if a == b => self,
            (Self::Field(a), Self::Field(b)) => Self::Field(e.call(Op::Max, &[a, b])),
        }
    }
}

/// Returns the negative of a number.
pub(super) fn negated(e: &mut Expressions, number: ExprId) -> ExprId {
    match e.operands_of(number, Op::Neg) {
        Some(&[inner]) => inner,
        _ => e.call(Op::Neg, &[number]),
    }
}

/// Reports whether a field is proved not to be negative where a condition holds.
pub(super) fn implies_outside(e: &mut Expressions, condition: ExprId, field: ExprId) -> bool {
    let mut cases = Vec::new();
    let is_split = split(e, condition, true, Vec::new(), &mut cases, MAX_DEPTH).is_some();
    let is_excluded = |not_positive: &Vec<ExprId>| is_outside(e, field, not_positive, MAX_DEPTH);
    is_split && cases.iter().all(is_excluded)
}

/// Splits a condition into cases: numbers that are not positive in each. `None` for too many.
fn split(
    e: &mut Expressions,
    condition: ExprId,
    holds: bool,
    known: Vec<ExprId>,
    cases: &mut Vec<Vec<ExprId>>,
    depth: u32,
) -> Option<()> {
    let depth = depth.checked_sub(1)?;
    let Expression::Apply { op, values, .. } = e.get(condition).clone() else {
        let is_true = e.as_constant(condition)? != 0.0;
        cases.extend((is_true == holds).then_some(known));
        return Some(());
    };
    match (op, values.as_slice()) {
        (Op::Not, &[a]) => split(e, a, !holds, known, cases, depth)?,
        (Op::And | Op::Or, &[a, b]) if (op == Op::And) == holds => {
            let mut first = Vec::new();
            split(e, a, holds, known, &mut first, depth)?;
            for known in first {
                split(e, b, holds, known, cases, depth)?;
            }
        }
        (Op::And | Op::Or, &[a, b]) => {
            split(e, a, holds, known.clone(), cases, depth)?;
            split(e, b, holds, known, cases, depth)?;
        }
        (Op::Select, &[condition, a, b]) => {
            for (branch, is_taken) in [(a, true), (b, false)] {
                let mut first = Vec::new();
                split(e, condition, is_taken, known.clone(), &mut first, depth)?;
                for known in first {
                    split(e, branch, holds, known, cases, depth)?;
                }
            }
        }
        (Op::Less, &[a, b]) => {
            let (smaller, larger) = if holds { (a, b) } else { (b, a) };
            let mut known = known;
            known.extend(not_positive(e, smaller, larger));
            cases.push(known);
        }
        _ => cases.push(known),
    }
    (cases.len() <= MAX_CASES).then_some(())
}

/// Returns numbers that are not positive where one number is at most another one.
fn not_positive(e: &mut Expressions, smaller: ExprId, larger: ExprId) -> Vec<ExprId> {
    let mut numbers = Vec::new();
    // The limit of a sum is a negative share of its terms (`definedness`).
    let is_negative = match e.operands_of(larger, Op::Mul) {
        Some(&[_, share]) => e.as_constant(share).is_some_and(|share| share < 0.0),
        _ => e.as_constant(larger).is_some_and(|limit| limit <= 0.0),
    };
    if is_negative {
        numbers.push(smaller);
    }
    if let Some(limit) = e.as_constant(smaller)
        && limit >= 0.0
    {
        numbers.push(negated(e, larger));
    }
    numbers.push(e.call(Op::Sub, &[smaller, larger]));
    let reversed = e.call(Op::Sub, &[larger, smaller]);
    numbers.push(negated(e, reversed));
    numbers
}

/// Reports whether a field is not negative where these numbers are not positive.
fn is_outside(e: &mut Expressions, field: ExprId, not_positive: &[ExprId], depth: u32) -> bool {
    if depth == 0 {
        return false;
    }
    if let Some(value) = e.as_constant(field) {
        return value >= 0.0;
    }
    let negative = negated(e, field);
    if not_positive.contains(&negative) {
        return true;
    }
    let Expression::Apply { op, values, .. } = e.get(field).clone() else {
        return false;
    };
    let mut is_outside = |id: &ExprId| is_outside(e, *id, not_positive, depth - 1);
    match op {
        Op::Max => values.iter().any(is_outside),
        Op::Min => values.iter().all(is_outside),
        Op::Select => values[1..].iter().all(&mut is_outside),
        _ => false,
    }
}
