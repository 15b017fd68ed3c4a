//! Sublevel sets of numbers: the points at which a number is below a level.
//!
//! A solid is the set at which its field is below zero. Where nothing else counts, any other field with this set may be
//! drawn instead. Some fields need that:
//! - Beside its surface, `pow(g, 7)` is so flat that its gradient is rounding. `tanh(1e7 * g)` is steep there and
//!   constant elsewhere. The field `g` has the same sign.
//! - `min(g, 0)` is zero outside of its solid. It has a plateau: rays do not advance there, and a surface has no normal.
//!   So have products, sums and compositions of such numbers.
//! - `-sqrt(g)` is infinitely steep at its surface, and not defined beyond it.
//!
//! Sets are built along the operations of a field. The set of a maximum is the intersection of two sets. So is that of
//! a product with a factor that is never negative. Sets count up to parts without thickness.
//!
//! `atan(1 / x)` jumps at the pole of `1 / x`, and a jump is a surface. So saturating functions of a field that may
//! have poles are kept.

mod by_sign;
mod by_value;
mod cases;
mod conditions;
mod integer_sum;
mod jumps;
mod limits;
mod live;
mod product;
mod samples;
mod set;
mod sum;

use crate::analysis::box_eval::{BoxNumber, UniformInput};
use crate::analysis::definedness::parts_by_definedness;
use crate::analysis::param_ranges::ParamRanges;
use crate::analysis::pieces::PieceSearch;
use crate::expression::{ExprId, Expression, Expressions, Stage};
use crate::scene::NO_SURFACE_DISTANCE;
use crate::uniforms::postorder;
use jumps::without_wide_jumps;
use live::{Replaced, by_live_cases};
use samples::SampledValues;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;
use set::{Set, implies_outside};
use std::collections::HashMap;

/// Maximum depth of operations along which sets are built.
const MAX_DEPTH: u32 = 128;
/// Maximum number of sets that are built for one field.
const MAX_SETS: usize = 20_000;

/// Fields that replace another one.
pub(crate) struct Replacements {
    /// Field with the same values, but for parts without thickness, that jumps at surfaces alone.
    pub(crate) same_values: ExprId,
    /// Field of the same sign without plateaus at zero and without odd functions around it.
    pub(crate) same_sign: ExprId,
}

/// Returns fields that replace another one. Without `by_sign`, both have the same values.
pub(crate) fn without_plateaus(
    e: &mut Expressions,
    field: ExprId,
    by_sign: bool,
    param_ranges: &ParamRanges,
) -> Replacements {
    let mut facts = Facts::new(param_ranges);
    let same_values = without_wide_jumps(e, field, param_ranges, &mut facts);
    let same_sign = match by_sign && e.stage(same_values) > Stage::Uniform {
        true => {
            let replaced = Replaced {
                field: same_values,
                by: field_with_same_sign(e, same_values, param_ranges, &mut facts),
                has_selections: facts.selections > 0,
            };
            by_live_cases(e, replaced, param_ranges)
        }
        false => same_values,
    };
    Replacements {
        same_values,
        same_sign,
    }
}

/// Returns a field that is negative at the same points.
fn field_with_same_sign<'r>(
    e: &mut Expressions,
    field: ExprId,
    param_ranges: &'r ParamRanges,
    facts: &mut Facts<'r>,
) -> ExprId {
    let parts = parts_by_definedness(e, field);
    let defined = parts.map_or(field, |[_, defined]| defined);
    let mut sublevels = Sublevels {
        e,
        param_ranges,
        facts,
    };
    let set = sublevels.below(defined, Level::ZERO, MAX_DEPTH);
    let negative = match set {
        Set::Field(negative) => negative,
        Set::Empty => e.constant(1.0),
        Set::All => e.constant(-1.0),
    };
    let Some([undefined, _]) = parts else {
        return negative;
    };
    if set == Set::Empty || implies_outside(e, undefined, negative) {
        return negative;
    }
    let outside = e.constant(NO_SURFACE_DISTANCE);
    e.call(Op::Select, &[undefined, outside, negative])
}

/// Upper end of a sublevel set.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Level {
    value: f64,
    /// Set if points at which a number has exactly this value belong to its set.
    is_included: bool,
}

impl Level {
    /// Numbers below zero.
    const ZERO: Self = Self {
        value: 0.0,
        is_included: false,
    };

    fn at(self, value: f64) -> Self {
        Self {
            value: value + 0.0,
            ..self
        }
    }

    /// Returns the level below which the negative of a number lies where that number does not lie below this one.
    fn of_rest(self) -> Self {
        Self {
            value: -self.value + 0.0,
            is_included: !self.is_included,
        }
    }

    fn excluding(value: f64) -> Self {
        Self::ZERO.at(value)
    }

    fn including(value: f64) -> Self {
        Self {
            is_included: true,
            ..Self::excluding(value)
        }
    }
}

/// Both sets of a number: where it is negative, and where it is positive.
#[derive(Clone, Copy, Debug)]
struct Signs {
    negative: Set,
    positive: Set,
}

/// Number that an operation without a point computes, or with one that its rules do not read.
#[derive(Clone, Copy)]
struct Node<'a> {
    number: ExprId,
    op: Op,
    values: &'a [ExprId],
}

/// Numbers and sets that were computed for a field.
struct Facts<'a> {
    pieces: PieceSearch,
    ranges: HashMap<ExprId, Interval>,
    samples: SampledValues<'a>,
    known: HashMap<(ExprId, u64, bool), Set>,
    /// Number of sets for which no rule was found.
    selections: usize,
}

impl<'a> Facts<'a> {
    fn new(param_ranges: &'a ParamRanges) -> Self {
        Self {
            pieces: PieceSearch::default(),
            ranges: HashMap::new(),
            samples: SampledValues::new(param_ranges),
            known: HashMap::new(),
            selections: 0,
        }
    }
}

struct Sublevels<'a, 'r> {
    e: &'a mut Expressions,
    param_ranges: &'r ParamRanges,
    facts: &'a mut Facts<'r>,
}

impl Sublevels<'_, '_> {
    /// Returns the set at which a number lies below a level.
    fn below(&mut self, number: ExprId, level: Level, depth: u32) -> Set {
        let key = (number, level.value.to_bits(), level.is_included);
        if let Some(&set) = self.facts.known.get(&key) {
            return set;
        }
        let set = match self.proved(number, level) {
            Some(set) => set,
            None if depth == 0 || self.facts.known.len() > MAX_SETS => {
                Set::Field(self.shifted(number, level))
            }
            None => self.built(number, level, depth - 1),
        };
        self.facts.known.insert(key, set);
        set
    }

    /// Returns the set at which a number lies above a level, or has its value.
    fn not_below(&mut self, number: ExprId, level: Level, depth: u32) -> Set {
        let below = self.below(number, level, depth);
        below.complement(self.e)
    }

    /// Returns the sets at which a number is negative and positive.
    fn signs(&mut self, number: ExprId, depth: u32) -> Signs {
        Signs {
            negative: self.below(number, Level::ZERO, depth),
            positive: self.not_below(number, Level::including(0.0), depth),
        }
    }

    /// Returns the set of a constant, or of a number with plateaus whose range proves it.
    fn proved(&mut self, number: ExprId, level: Level) -> Option<Set> {
        let range = match self.e.as_constant(number) {
            Some(value) => [value; 2],
            None if self.e.stage(number) <= Stage::Uniform => return None,
            None if !self.facts.pieces.of(self.e, number).may_have_any() => return None,
            None => {
                let range = self.range(number);
                [range.lo, range.hi]
            }
        };
        let is_below = |end: f64| end < level.value || level.is_included && end == level.value;
        match range.map(is_below) {
            [_, true] => Some(Set::All),
            [false, false] => Some(Set::Empty),
            _ => None,
        }
    }

    /// Returns the range of a number over all of space.
    fn range(&mut self, number: ExprId) -> Interval {
        if let Some(&range) = self.facts.ranges.get(&number) {
            return range;
        }
        let mut leaf = |id| UniformInput::Known(self.param_ranges.leaf(self.e, id));
        let mut program = BoxNumber::<Interval>::new(self.e, number, &mut leaf);
        let ranges = program.eval_all(&Bounds::ALL_SPACE, &[]).iter().copied();
        let operands = postorder(self.e, number, |_| false).into_iter();
        self.facts.ranges.extend(operands.zip(ranges));
        self.facts.ranges[&number]
    }

    /// Returns a number minus a level.
    fn shifted(&mut self, number: ExprId, level: Level) -> ExprId {
        if level.value == 0.0 {
            return number;
        }
        let value = self.e.constant(level.value);
        self.e.call(Op::Sub, &[number, value])
    }

    fn built(&mut self, number: ExprId, level: Level, depth: u32) -> Set {
        if self.e.stage(number) <= Stage::Uniform {
            return self.of_uniform(number, level);
        }
        let Expression::Apply { op, values, .. } = self.e.get(number).clone() else {
            return Set::Field(self.shifted(number, level));
        };
        let node = Node {
            number,
            op,
            values: &values,
        };
        let is_magnitude = op == Op::Sqrt || is_magnitude(self.e, number);
        if is_magnitude && level.value <= 0.0 && !level.is_included {
            return Set::Empty;
        }
        let has_plateau = self.has_plateau(number, level);
        if !has_plateau && let Some(set) = self.without_limit(node, level, depth) {
            return set;
        }
        let set = match level.value == 0.0 {
            true => self.by_sign(node, level, depth),
            false => None,
        };
        if let Some(set) = set {
            return set;
        }
        if !has_plateau {
            return Set::Field(self.shifted(number, level));
        }
        let set = self.by_value(node, level, depth);
        let set = set.or_else(|| self.in_cases(number, level, depth));
        set.unwrap_or_else(|| self.by_selection(number, level))
    }

    /// Returns the set of a number that depends on no point: all of space, or no point.
    fn of_uniform(&mut self, number: ExprId, level: Level) -> Set {
        let limit = self.e.constant(level.value);
        let condition = match level.is_included {
            false => self.e.call(Op::Less, &[number, limit]),
            true => {
                let is_above = self.e.call(Op::Less, &[limit, number]);
                self.e.call(Op::Not, &[is_above])
            }
        };
        let [inside, outside] =
            [-NO_SURFACE_DISTANCE, NO_SURFACE_DISTANCE].map(|distance| self.e.constant(distance));
        Set::Field(self.e.call(Op::Select, &[condition, inside, outside]))
    }

    /// Reports whether a number may have the value of a level in a part of space.
    fn has_plateau(&mut self, number: ExprId, level: Level) -> bool {
        self.facts.pieces.of(self.e, number).are_all_unknown() || self.shows_plateau(number, level)
    }

    /// Reports whether a number has the value of a level at a sampled point.
    fn shows_plateau(&mut self, number: ExprId, level: Level) -> bool {
        self.e.stage(number) > Stage::Uniform
            && self.facts.pieces.are_possible(self.e, number)
            && self.facts.samples.show_plateau(self.e, number, level.value)
    }

    /// Returns the union of sets for a minimum, and their intersection for a maximum.
    fn combined(&mut self, op: Op, [a, b]: [Set; 2]) -> Set {
        match op {
            Op::Min => a.union(b, self.e),
            _ => a.intersection(b, self.e),
        }
    }
}

fn is_above_zero(e: &Expressions, number: ExprId) -> bool {
    e.as_constant(number).is_some_and(|value| value > 0.0)
}

/// Reports whether a number is a sum of squares or of magnitudes, which is negative nowhere.
fn is_magnitude(e: &Expressions, number: ExprId) -> bool {
    let mut pending = vec![number];
    while let Some(id) = pending.pop() {
        match e.get(id) {
            Expression::Apply {
                op: Op::Add,
                values,
                ..
            } => pending.extend(values),
            Expression::Apply {
                op: Op::Square | Op::Abs,
                ..
            } => {}
            _ if e.as_constant(id).is_some_and(|constant| constant >= 0.0) => {}
            _ => return false,
        }
    }
    true
}
