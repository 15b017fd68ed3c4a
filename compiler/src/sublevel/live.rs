//! Fields that have a plateau at one value of a live number alone.
//!
//! At `k = 0`, `min(g, 0) + k * p.x` is zero outside of `g`. At all other values it has no plateau. So it gets one field
//! for each case.

use super::{Facts, field_with_same_sign};
use crate::analysis::param_ranges::ParamRanges;
use crate::expression::{ExprId, Expression, Expressions, Stage};
use crate::symbolic::simplified;
use crate::uniforms::{postorder, rewrite_number};
use sdfc_vm::table::Op;

/// Maximum number of combinations of cases for one field.
const MAX_CASES: u32 = 16;

/// Live number, and a value at which an operation ignores one of its operands.
#[derive(Clone, Copy)]
struct Case {
    number: ExprId,
    value: f64,
}

/// Field, and one of the same sign that replaces it.
#[derive(Clone, Copy)]
pub(super) struct Replaced {
    pub(super) field: ExprId,
    pub(super) by: ExprId,
    /// Set if values that the field has in parts of space select what is drawn.
    pub(super) has_selections: bool,
}

/// Returns a field of the same sign, which has no plateau at zero at any value of live numbers.
pub(super) fn by_live_cases(
    e: &mut Expressions,
    replaced: Replaced,
    param_ranges: &ParamRanges,
) -> ExprId {
    let mut cases = cases_of(e, replaced.field);
    cases.retain(|case| {
        let range = param_ranges.number(e, case.number);
        range.lo <= case.value && case.value <= range.hi
    });
    let mut left = MAX_CASES;
    by_cases(e, replaced, &cases, param_ranges, &mut left)
}

/// Returns a field of the same sign with one field for each of these cases.
fn by_cases(
    e: &mut Expressions,
    replaced: Replaced,
    cases: &[Case],
    param_ranges: &ParamRanges,
    left: &mut u32,
) -> ExprId {
    let mut result = replaced.by;
    for (index, &case) in cases.iter().enumerate() {
        let field = with_number(e, replaced.field, case);
        let mut facts = Facts::new(param_ranges);
        let has_pieces = facts.pieces.are_possible(e, field);
        // The factor of a complete field is removed otherwise.
        if *left == 0 || !has_pieces || e.stage(field) <= Stage::Uniform {
            continue;
        }
        let before = with_number(e, replaced.by, case);
        *left -= 1;
        let mut equal = Replaced {
            field,
            by: before,
            has_selections: false,
        };
        if replaced.has_selections || facts.samples.show_plateau(e, before, 0.0) {
            equal.by = field_with_same_sign(e, field, param_ranges, &mut facts);
            equal.has_selections = facts.selections > 0;
        }
        let equal = by_cases(e, equal, &cases[index + 1..], param_ranges, left);
        if equal == before {
            continue;
        }
        let [number, value] = [case.number, e.constant(case.value)];
        let other = [[number, value], [value, number]].map(|pair| e.call(Op::Less, &pair));
        let is_other = e.call(Op::Or, &other);
        result = e.call(Op::Select, &[is_other, result, equal]);
    }
    result
}

/// Returns the live numbers that are factors or weights of functions of the point.
fn cases_of(e: &Expressions, field: ExprId) -> Vec<Case> {
    let mut cases: Vec<Case> = Vec::new();
    let mut add = |number: ExprId, value: f64| {
        let is_known = |case: &Case| case.number == number && case.value == value;
        if e.stage(number) == Stage::Uniform && !cases.iter().any(is_known) {
            cases.push(Case { number, value });
        }
    };
    for id in postorder(e, field, |_| false) {
        let Expression::Apply { op, values, .. } = e.get(id) else {
            continue;
        };
        match (op, values.as_slice()) {
            _ if e.stage(id) <= Stage::Uniform => {}
            (Op::Mul, _) => values.iter().for_each(|&factor| add(factor, 0.0)),
            (Op::Mix, &[_, _, weight]) => {
                add(weight, 0.0);
                add(weight, 1.0);
            }
            _ => {}
        }
    }
    cases
}

/// Returns a number in which a live number has this value.
fn with_number(e: &mut Expressions, number: ExprId, case: Case) -> ExprId {
    rewrite_number(e, number, |e, id, rebuilt, values| {
        if id == case.number {
            return e.constant(case.value);
        }
        match e.get(rebuilt).clone() {
            Expression::Apply {
                op, point: None, ..
            } if !values.is_empty() => simplified(e, op, values),
            _ => rebuilt,
        }
    })
}
