//! Points at which a number is not defined. There, roots, logarithms or powers have a negative operand, arc functions
//! one beyond −1 and 1, or zero is divided by zero.
//!
//! The rows of the table return finite numbers there, so that no engine meets NaN. A field is outside there: its
//! value is replaced by a distance that no ray reaches. Whatever is computed from such a number is undefined, too,
//! but for the branch of a selection that is not taken. Colours keep the finite numbers.
//!
//! Intervals over all of space prove that most operands lie in the domain of their operation. Only the others are
//! compared. A sum less than 1e-6 of its terms below zero counts as rounding of zero.

use crate::analysis::box_eval::{BoxNumber, UniformInput};
use crate::analysis::param_ranges::ParamRanges;
use crate::analysis::pieces::PieceSearch;
use crate::expression::{ExprId, Expression, Expressions, Stage};
use crate::scene::NO_SURFACE_DISTANCE;
use crate::symbolic::simplified;
use crate::uniforms::postorder;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::row::DefinedFor;
use sdfc_vm::table::Op;
use std::collections::{HashMap, HashSet};

/// Maximum share of the magnitude of its terms that counts as the rounding of a sum: 17 roundings in `f32`.
pub(crate) const ROUNDING_SHARE: f64 = 1e-6;
/// Maximum share of its upper end by which a range extends below zero for its rounding alone.
const INTERVAL_ROUNDING: f64 = 1e-12;
/// Maximum depth of the sums whose terms count one by one.
const MAX_TERM_DEPTH: u32 = 8;

/// Maximum number of steps of the search for even powers.
const MAX_FACTORS: usize = 64;

/// Returns the value of a field, and a distance without a surface wherever the value is not defined.
pub(crate) fn outside_where_undefined(
    expressions: &mut Expressions,
    value: ExprId,
    ranges: &ParamRanges,
) -> ExprId {
    let Some(condition) = undefined_condition(expressions, &[value], ranges) else {
        return value;
    };
    let outside = expressions.constant(NO_SURFACE_DISTANCE);
    match expressions.as_constant(condition) {
        Some(_) => outside,
        None => expressions.call(Op::Select, &[condition, outside, value]),
    }
}

/// Takes apart a field that [`outside_where_undefined`] built: the condition that it is not defined, and its value
/// elsewhere. `None` for a field that is defined everywhere.
pub(crate) fn parts_by_definedness(
    expressions: &Expressions,
    field: ExprId,
) -> Option<[ExprId; 2]> {
    let Expression::Apply {
        op: Op::Select,
        values,
        ..
    } = expressions.get(field)
    else {
        return None;
    };
    let &[undefined, outside, value] = values.as_slice() else {
        return None;
    };
    let is_outside = expressions.as_constant(outside) == Some(NO_SURFACE_DISTANCE);
    is_outside.then_some([undefined, value])
}

/// Returns the condition that one of these numbers is not defined at the point; `None` if all are proved to be
/// defined everywhere.
pub(crate) fn undefined_condition(
    expressions: &mut Expressions,
    ids: &[ExprId],
    ranges: &ParamRanges,
) -> Option<ExprId> {
    let conditions: Vec<ExprId> = ids
        .iter()
        .filter_map(|&id| UndefinedSearch::new(expressions, id, ranges)?.condition())
        .collect();
    any_of(expressions, conditions)
}

/// Facts about one number that decide where others are defined.
#[derive(Clone, Copy, Debug)]
struct NumberFacts {
    range: Interval,
    /// Set if it is proved not to be negative, rounding included.
    is_not_negative: bool,
    /// Set if it varies, and may yet be zero in a part of space.
    has_zero_pieces: bool,
    /// Condition that it is not defined.
    undefined: Option<ExprId>,
}

impl NumberFacts {
    /// Reports whether a number that is no live parameter may be zero in a part of space.
    fn may_vanish(&self) -> bool {
        let contains_zero = self.range.lo <= 0.0 && self.range.hi >= 0.0;
        contains_zero && (self.has_zero_pieces || self.range.lo == self.range.hi)
    }
}

struct UndefinedSearch<'a> {
    expressions: &'a mut Expressions,
    order: Vec<ExprId>,
    facts: Vec<NumberFacts>,
    ranges: Vec<Interval>,
    pieces: PieceSearch,
    /// Numbers that must not be negative, by the condition that they are.
    must_not_be_negative: HashMap<ExprId, ExprId>,
}

impl<'a> UndefinedSearch<'a> {
    /// Prepares the search; `None` if no operation has a limited domain.
    fn new(
        expressions: &'a mut Expressions,
        id: ExprId,
        param_ranges: &ParamRanges,
    ) -> Option<Self> {
        let order = postorder(expressions, id, |_| false);
        let is_limited = |&id: &ExprId| match expressions.get(id) {
            Expression::Apply { op, .. } => op.row().facts.defined_for != DefinedFor::All,
            _ => false,
        };
        if !order.iter().any(is_limited) {
            return None;
        }
        let mut leaf = |id| UniformInput::Known(param_ranges.leaf(expressions, id));
        let mut number = BoxNumber::<Interval>::new(expressions, id, &mut leaf);
        let ranges = number.eval_all(&Bounds::ALL_SPACE, &[]).to_vec();
        Some(Self {
            expressions,
            facts: Vec::with_capacity(order.len()),
            order,
            ranges,
            pieces: PieceSearch::default(),
            must_not_be_negative: HashMap::new(),
        })
    }

    /// Returns the condition that the number is not defined.
    fn condition(mut self) -> Option<ExprId> {
        for index in 0..self.order.len() {
            let facts = self.facts_of(index);
            self.facts.push(facts);
        }
        self.facts.last()?.undefined
    }

    fn of(&self, id: ExprId) -> NumberFacts {
        let index = self.order.binary_search(&id);
        self.facts[index.unwrap_or_else(|_| unreachable!("operands come first"))]
    }

    fn facts_of(&mut self, index: usize) -> NumberFacts {
        let (id, range) = (self.order[index], self.ranges[index]);
        let is_uniform = self.expressions.stage(id) <= Stage::Uniform;
        let rounding = match range.hi.is_finite() {
            true => INTERVAL_ROUNDING * range.hi,
            false => 0.0,
        };
        let leaf = NumberFacts {
            range,
            is_not_negative: range.lo >= -rounding,
            has_zero_pieces: !is_uniform && self.pieces.of(self.expressions, id).may_contain(0.0),
            undefined: None,
        };
        let Expression::Apply {
            op,
            point,
            values,
            parameters,
        } = self.expressions.get(id).clone()
        else {
            return leaf;
        };
        let inputs = point.iter().flatten().chain(&values).chain(&parameters);
        let operands: Vec<NumberFacts> = inputs.map(|&id| self.of(id)).collect();
        let undefined = match (op, values.as_slice()) {
            (Op::Select, &[condition, a, b]) => self.undefined_selection(condition, a, b),
            (Op::And, &[a, b]) => self.undefined_unless_decided(a, b, true),
            (Op::Or, &[a, b]) => self.undefined_unless_decided(a, b, false),
            _ => {
                let own = self.outside_domain(op, &values);
                let inherited = operands.iter().filter_map(|facts| facts.undefined);
                let all = inherited.chain(own).collect();
                any_of(self.expressions, all)
            }
        };
        NumberFacts {
            is_not_negative: leaf.is_not_negative || self.is_not_negative(op, &values),
            undefined,
            ..leaf
        }
    }

    /// Returns the condition that operands lie outside the domain of their operation.
    fn outside_domain(&mut self, op: Op, values: &[ExprId]) -> Option<ExprId> {
        match (op.row().facts.defined_for, values) {
            (DefinedFor::NotNegative, &[a, ..]) => self.negative(a),
            (DefinedFor::UpToOne, &[a]) => self.beyond_one(a),
            (DefinedFor::NotBothZero, &[a, b])
                if self.of(a).may_vanish() && self.of(b).may_vanish() =>
            {
                let [a, b] = [a, b].map(|id| self.call(Op::Abs, &[id]));
                let sum = self.call(Op::Add, &[a, b]);
                Some(self.is_zero(sum))
            }
            (DefinedFor::DivisorNotZero, &[_, b]) if self.of(b).may_vanish() => {
                let magnitude = self.call(Op::Abs, &[b]);
                Some(self.is_zero(magnitude))
            }
            _ => None,
        }
    }

    /// Reports whether the signs of operands prove that a result is not negative.
    fn is_not_negative(&self, op: Op, values: &[ExprId]) -> bool {
        let all = || values.iter().all(|&id| self.of(id).is_not_negative);
        match op {
            Op::Square | Op::Abs => true,
            Op::Add | Op::Div | Op::Min | Op::Union | Op::Sqrt => all(),
            Op::Max | Op::Intersection => values.iter().any(|&id| self.of(id).is_not_negative),
            Op::Select => values[1..].iter().all(|&id| self.of(id).is_not_negative),
            Op::Mul => all() || self.is_even_product(values),
            _ => false,
        }
    }

    /// Reports whether each factor of a product that may be negative occurs an even number of times.
    fn is_even_product(&self, factors: &[ExprId]) -> bool {
        let mut pending = factors.to_vec();
        let mut odd = HashSet::new();
        for _ in 0..MAX_FACTORS {
            let Some(factor) = pending.pop() else {
                return odd.is_empty();
            };
            match self.expressions.get(factor) {
                Expression::Apply {
                    op: Op::Mul,
                    values,
                    ..
                } => pending.extend(values),
                _ if self.of(factor).is_not_negative => {}
                _ if odd.remove(&factor) => {}
                _ => _ = odd.insert(factor),
            }
        }
        false
    }

    fn call(&mut self, op: Op, values: &[ExprId]) -> ExprId {
        simplified(self.expressions, op, values)
    }

    fn is_zero(&mut self, magnitude: ExprId) -> ExprId {
        let zero = self.expressions.constant(0.0);
        let is_positive = self.call(Op::Less, &[zero, magnitude]);
        self.call(Op::Not, &[is_positive])
    }

    /// Returns the condition that a number is negative by more than its rounding.
    fn negative(&mut self, id: ExprId) -> Option<ExprId> {
        let facts = self.of(id);
        if facts.is_not_negative {
            return None;
        }
        if facts.range.hi < 0.0 {
            return Some(self.expressions.constant(1.0));
        }
        let mut limit = self.expressions.constant(0.0);
        if is_sum(self.expressions, id) {
            let terms = self.magnitude(id, MAX_TERM_DEPTH);
            let share = self.expressions.constant(-ROUNDING_SHARE);
            limit = self.call(Op::Mul, &[terms, share]);
        }
        let condition = self.call(Op::Less, &[id, limit]);
        self.must_not_be_negative.insert(condition, id);
        Some(condition)
    }

    /// Returns the sum of the magnitudes of a number's terms.
    fn magnitude(&mut self, id: ExprId, depth: u32) -> ExprId {
        let Expression::Apply { op, values, .. } = self.expressions.get(id).clone() else {
            return self.call(Op::Abs, &[id]);
        };
        match (op, values.as_slice()) {
            (Op::Add | Op::Sub, &[a, b]) if depth > 0 => {
                let [a, b] = [a, b].map(|id| self.magnitude(id, depth - 1));
                self.call(Op::Add, &[a, b])
            }
            (Op::Neg, &[a]) => self.magnitude(a, depth),
            _ if self.of(id).is_not_negative => id,
            _ => self.call(Op::Abs, &[id]),
        }
    }

    /// Returns the condition that the magnitude of a number is above one by more than rounding.
    fn beyond_one(&mut self, id: ExprId) -> Option<ExprId> {
        let range = self.of(id).range;
        if (range.lo >= -1.0 && range.hi <= 1.0) || self.is_component_of_direction(id) {
            return None;
        }
        if range.lo > 1.0 || range.hi < -1.0 {
            return Some(self.expressions.constant(1.0));
        }
        let magnitude = self.call(Op::Abs, &[id]);
        let limit = self.expressions.constant(1.0 + ROUNDING_SHARE);
        Some(self.call(Op::Less, &[limit, magnitude]))
    }

    /// Reports whether a number is a quotient by the root of a sum that contains the dividend's square, and
    /// otherwise no negative terms.
    fn is_component_of_direction(&self, id: ExprId) -> bool {
        let operands = |id: ExprId, wanted: Op| match self.expressions.get(id) {
            Expression::Apply { op, values, .. } if *op == wanted => Some(values.as_slice()),
            _ => None,
        };
        if let Some(&[a]) = operands(id, Op::Neg) {
            return self.is_component_of_direction(a);
        }
        let Some([dividend, divisor]) = operands(id, Op::Div) else {
            return false;
        };
        let dividend = match operands(*dividend, Op::Neg) {
            Some([negated]) => negated,
            _ => dividend,
        };
        // A divisor that is kept above a limit is not smaller.
        let limited = operands(*divisor, Op::Max).unwrap_or(std::slice::from_ref(divisor));
        let mut roots = limited.iter().filter_map(|&id| operands(id, Op::Sqrt));
        let Some(&[sum]) = roots.next() else {
            return false;
        };
        let mut terms = vec![sum];
        let mut has_square = false;
        while let Some(term) = terms.pop() {
            if let Some(sum) = operands(term, Op::Add) {
                terms.extend(sum);
            } else if !self.of(term).is_not_negative {
                return false;
            }
            has_square |= operands(term, Op::Square) == Some(std::slice::from_ref(dividend));
        }
        has_square
    }

    /// Returns the condition that a selection is not defined: its condition, or the branch that is taken.
    fn undefined_selection(&mut self, condition: ExprId, a: ExprId, b: ExprId) -> Option<ExprId> {
        let never = self.expressions.constant(0.0);
        let [a, b] = [(a, true), (b, false)].map(|(branch, holds)| {
            let undefined = self.of(branch).undefined?;
            self.unless_excluded(undefined, condition, holds)
        });
        let taken = (a.is_some() || b.is_some()).then(|| {
            let branches = [condition, a.unwrap_or(never), b.unwrap_or(never)];
            self.call(Op::Select, &branches)
        });
        let conditions = self.of(condition).undefined.into_iter().chain(taken);
        let conditions = conditions.collect();
        any_of(self.expressions, conditions)
    }

    /// Returns the condition that `a` or, unless `a` decides, `b` is not defined. A conjunction is decided by what is
    /// false, a disjunction by what is true.
    fn undefined_unless_decided(
        &mut self,
        a: ExprId,
        b: ExprId,
        is_conjunction: bool,
    ) -> Option<ExprId> {
        let second = self.of(b).undefined.and_then(|undefined| {
            let undefined = self.unless_excluded(undefined, a, is_conjunction)?;
            let is_undecided = match is_conjunction {
                true => a,
                false => self.call(Op::Not, &[a]),
            };
            Some(self.call(Op::And, &[is_undecided, undefined]))
        });
        let conditions = self.of(a).undefined.into_iter().chain(second).collect();
        any_of(self.expressions, conditions)
    }

    /// Returns what remains of an undefined condition where another condition holds or does not.
    fn unless_excluded(
        &mut self,
        undefined: ExprId,
        condition: ExprId,
        holds: bool,
    ) -> Option<ExprId> {
        if let Expression::Apply {
            op: Op::Or, values, ..
        } = self.expressions.get(undefined).clone()
        {
            let remaining = values
                .iter()
                .filter_map(|&part| self.unless_excluded(part, condition, holds));
            let remaining = remaining.collect();
            return any_of(self.expressions, remaining);
        }
        let number = self.must_not_be_negative.get(&undefined);
        let is_excluded =
            number.is_some_and(|&number| self.implies_not_negative(condition, holds, number));
        (!is_excluded).then_some(undefined)
    }

    /// Reports whether a number is proved not to be negative where a condition holds or does not.
    fn implies_not_negative(&self, condition: ExprId, holds: bool, number: ExprId) -> bool {
        let Expression::Apply { op, values, .. } = self.expressions.get(condition) else {
            return false;
        };
        let is_difference = |larger: ExprId, smaller: ExprId| match self.expressions.get(number) {
            Expression::Apply {
                op: Op::Sub,
                values,
                ..
            } => **values == [larger, smaller],
            _ => false,
        };
        let mut parts = values.iter();
        match (op, values.as_slice()) {
            (Op::Not, &[a]) => self.implies_not_negative(a, !holds, number),
            (Op::And, _) if holds => parts.any(|&a| self.implies_not_negative(a, true, number)),
            (Op::Or, _) if !holds => parts.any(|&a| self.implies_not_negative(a, false, number)),
            (Op::Less, &[a, b]) => {
                let (smaller, larger) = if holds { (a, b) } else { (b, a) };
                let is_above_zero = larger == number && self.of(smaller).is_not_negative;
                is_above_zero || is_difference(larger, smaller)
            }
            _ => false,
        }
    }
}

/// Returns the disjunction of conditions, without repetitions; `None` for no conditions.
fn any_of(expressions: &mut Expressions, conditions: Vec<ExprId>) -> Option<ExprId> {
    let mut parts = Vec::new();
    let mut visited = HashSet::new();
    let mut pending = conditions;
    while let Some(condition) = pending.pop() {
        if !visited.insert(condition) {
            continue;
        }
        match expressions.get(condition) {
            Expression::Apply {
                op: Op::Or, values, ..
            } => pending.extend(values),
            Expression::Constant(value) if *value == 0.0 => {}
            Expression::Constant(_) => return Some(condition),
            _ => parts.push(condition),
        }
    }
    parts.sort_unstable();
    let either = |a, b| expressions.call(Op::Or, &[a, b]);
    parts.into_iter().reduce(either)
}

fn is_sum(expressions: &Expressions, id: ExprId) -> bool {
    matches!(
        expressions.get(id),
        Expression::Apply {
            op: Op::Add | Op::Sub,
            ..
        }
    )
}
