//! Positive factors of raw fields, which change neither the sign nor the surface.
//!
//! Factors of fields whose sign alone counts are removed before anything is searched or proved. So a factor changes
//! no bit of a picture. Parts of a minimum or maximum have the slopes of their shapes, so that marching and light see the
//! nearest one. Odd functions go with factors. Offsets, blends and displacements act on the written value, and
//! keep it.

use crate::analysis::definedness::parts_by_definedness;
use crate::analysis::extent::extent;
use crate::analysis::param_ranges::ParamRanges;
use crate::analysis::slope::WrittenField;
use crate::elaborate::field_without_inside;
use crate::expression::{ExprId, Expression, Expressions, Stage};
use crate::scene::{NO_SURFACE_DISTANCE, Scene, ShapeId, ShapeKind, children};
use crate::sublevel::without_plateaus;
use crate::uniforms::postorder;
use sdfc_lang::Diagnostic;
use sdfc_vm::interval::Interval;
use sdfc_vm::real::Real;
use sdfc_vm::table::Op;
use std::collections::{HashMap, HashSet};

/// Diagnostics of a removal of factors, and the stated slopes that went with them.
#[derive(Default)]
pub(crate) struct RemovedFactors {
    /// Warnings of fields that are negative nowhere.
    pub(crate) warnings: Vec<Diagnostic>,
    /// Fields that have changed, as written.
    pub(crate) written: Vec<WrittenField>,
}

/// Removes the factors of all fields whose sign alone counts, and odd functions around them. `uses` are those of the shapes
/// that are drawn ([`uses_below`]).
///
/// A stated slope is divided by the least factor. The written value is at least that factor times the rest, so the rest is
/// still the radius of an empty sphere. A statement says nothing about a field without its odd functions. A field that has
/// lost its live factors gets the box that others have from the start. One that is negative nowhere is no shape.
pub(crate) fn remove_factors(
    scene: &mut Scene,
    uses: &HashSet<(ShapeId, bool)>,
    ranges: &ParamRanges,
) -> RemovedFactors {
    let mut removed = RemovedFactors::default();
    // In the order of the text, so that numbers are built in the same order each time.
    for (index, shape) in (0..).zip(&mut scene.shapes) {
        let [by_sign, by_value] = [true, false].map(|it| uses.contains(&(ShapeId(index), it)));
        let ShapeKind::Field {
            value,
            slope,
            region,
        } = &mut shape.kind
        else {
            continue;
        };
        if !by_sign && !by_value {
            continue;
        }
        let by_sign = by_sign && !by_value;
        let written = *value;
        let was_live = !leaves(&scene.expressions, written).is_empty();
        let fields = without_plateaus(&mut scene.expressions, *value, by_sign, ranges);
        *value = fields.same_values;
        if by_sign {
            let e = &mut scene.expressions;
            let Reduced { number, least } = without_factors(e, fields.same_sign, ranges);
            let has_odd_function = fields.same_sign != *value;
            let bound = slope.filter(|_| !has_odd_function);
            if number != *value && (bound.is_none() || least > 0.0) {
                removed.written.push(WrittenField {
                    shape: ShapeId(index),
                    value: written,
                    slope: *slope,
                });
                *slope = bound.map(|slope| {
                    let least = e.constant(least);
                    e.call(Op::Div, &[slope, least])
                });
                *value = number;
            }
        }
        if was_live && leaves(&scene.expressions, *value).is_empty() {
            let e = &scene.expressions;
            let found = extent(e, *value, &mut |id| ranges.leaf(e, id));
            *region = region.intersection(&found);
        }
        if by_sign {
            // A field that is defined nowhere is reported as such.
            let is_undefined = scene.expressions.as_constant(*value) == Some(NO_SURFACE_DISTANCE);
            if !is_undefined && ranges.number(&scene.expressions, *value).lo >= 0.0 {
                shape.kind = ShapeKind::Nothing;
                removed.warnings.push(field_without_inside(shape.span));
            }
        }
    }
    removed
}

/// Returns the shapes below a shape, each with whether its sign alone counts.
pub(crate) fn uses_below(scene: &Scene, root: ShapeId) -> HashSet<(ShapeId, bool)> {
    let start = (root, true);
    let (mut visited, mut pending) = (HashSet::from([start]), vec![start]);
    while let Some((id, by_sign)) = pending.pop() {
        let kind = &scene.shapes[id.0 as usize].kind;
        let by_sign = by_sign && keeps_signs(kind);
        let operands = children(kind).iter().map(|&child| (child, by_sign));
        pending.extend(operands.filter(|&operand| visited.insert(operand)));
    }
    visited
}

/// Reports whether the sign of a shape follows from the signs of the shapes directly below it.
fn keeps_signs(kind: &ShapeKind) -> bool {
    match kind {
        ShapeKind::Combine { op, .. } | ShapeKind::Distance { op, .. } => {
            op.row().facts.uses_only_signs
        }
        ShapeKind::Displace { .. } => false,
        _ => true,
    }
}

/// Maximum depth of products in which factors are found.
const MAX_DEPTH: u32 = 32;

/// Field without factors.
#[derive(Clone, Copy)]
struct Reduced {
    number: ExprId,
    /// Smallest magnitude of a product of removed factors: that of the written value is at least this times the number's.
    least: f64,
}

/// Returns a field with the same sign without factors, also of the operands of minima and maxima. So all parts of a field
/// have the slopes that their shapes give them.
fn without_factors(e: &mut Expressions, number: ExprId, ranges: &ParamRanges) -> Reduced {
    let mut results: HashMap<ExprId, Reduced> = HashMap::new();
    let order = numbers_by_sign(e, number);
    for id in order {
        let result = match sign_operands(e, id) {
            Some(SignOperands {
                op,
                operands,
                factor,
            }) => {
                let least = operands.iter().map(|it| results[it].least);
                let least = least.fold(f64::INFINITY, f64::min) * factor.abs();
                let operands: Vec<ExprId> = operands.iter().map(|it| results[it].number).collect();
                let number = match op {
                    Some(op) => e.call(op, &operands),
                    None => operands[0],
                };
                Reduced { number, least }
            }
            None => without_outer_factors(e, id, ranges),
        };
        results.insert(id, result);
    }
    results[&number]
}

/// Returns a number and all numbers below it from whose signs its own follows. Operands come before their users.
fn numbers_by_sign(e: &Expressions, number: ExprId) -> Vec<ExprId> {
    let (mut reached, mut pending) = (HashSet::from([number]), vec![number]);
    while let Some(id) = pending.pop() {
        let operands = sign_operands(e, id).map(|it| it.operands);
        let operands = operands.into_iter().flatten();
        pending.extend(operands.filter(|&operand| reached.insert(operand)));
    }
    let mut order: Vec<ExprId> = reached.into_iter().collect();
    // Operands are always built before their users.
    order.sort_unstable();
    order
}

/// Numbers from whose signs that of a number follows.
struct SignOperands {
    /// Operation on them, if any is needed.
    op: Option<Op>,
    operands: Vec<ExprId>,
    /// Factor that the number has beside that operation.
    factor: f64,
}

/// Returns the numbers from whose signs that of a number follows.
fn sign_operands(e: &Expressions, number: ExprId) -> Option<SignOperands> {
    let Expression::Apply { op, values, .. } = e.get(number) else {
        return None;
    };
    if e.stage(number) <= Stage::Uniform {
        return None;
    }
    let scaled = |operand: ExprId, factor: f64| {
        let op = (factor < 0.0).then_some(Op::Neg);
        Some(SignOperands {
            op,
            operands: vec![operand],
            factor,
        })
    };
    let unscaled = || SignOperands {
        op: Some(*op),
        operands: values.clone(),
        factor: 1.0,
    };
    match (*op, values.as_slice()) {
        (Op::Neg, _) => Some(unscaled()),
        // A limit has its place beside the values of the other operand.
        (Op::Min | Op::Max, _) => {
            let has_limit = values.iter().any(|&id| e.stage(id) <= Stage::Uniform);
            (!has_limit).then(unscaled)
        }
        (Op::Mul, &[a, b]) if let Some(factor) = constant_factor(e, b) => scaled(a, factor),
        (Op::Div, &[a, b]) if let Some(factor) = constant_factor(e, b) => scaled(a, factor.recip()),
        (Op::Mul, &[a, b]) => scaled(b, constant_factor(e, a)?),
        _ => None,
    }
}

/// Returns a constant factor that has a sign.
fn constant_factor(e: &Expressions, id: ExprId) -> Option<f64> {
    let factor = e.as_constant(id)?;
    (factor.is_finite() && factor != 0.0).then_some(factor)
}

/// Returns a field with the same sign without the factors around it.
fn without_outer_factors(e: &mut Expressions, number: ExprId, ranges: &ParamRanges) -> Reduced {
    if let Some([undefined, defined]) = parts_by_definedness(e, number) {
        let Reduced { number, least } = without_factors(e, defined, ranges);
        let outside = e.constant(NO_SURFACE_DISTANCE);
        let number = e.call(Op::Select, &[undefined, outside, number]);
        return Reduced { number, least };
    }
    let mut factors = Factors::new(e, ranges, true);
    let mut rest = factors.remove(number, MAX_DEPTH);
    let leaves = leaves(factors.e, rest);
    if factors.leaves.iter().any(|leaf| leaves.contains(leaf)) {
        // Of `r * sin(p.x / r)`, the slope does not depend on `r`.
        factors = Factors::new(e, ranges, false);
        rest = factors.remove(number, MAX_DEPTH);
    }
    let Factors {
        is_negated,
        live,
        mut least,
        ..
    } = factors;
    if rest != number && sign_operands(e, rest).is_some() {
        let reduced = without_factors(e, rest, ranges);
        (rest, least) = (reduced.number, least * reduced.least);
    }
    let value = match is_negated {
        true => e.call(Op::Neg, &[rest]),
        false => rest,
    };
    let number = live.into_iter().fold(value, |value, factor| {
        let value = match factor.may_be_negative {
            true => {
                let sign = e.call(Op::Sign, &[factor.number]);
                e.call(Op::Mul, &[sign, value])
            }
            false => value,
        };
        outside_at_zero(e, value, factor.number)
    });
    Reduced { number, least }
}

/// Returns the value, and a distance without a surface if a factor of the field is zero. Then the field is zero, too.
fn outside_at_zero(e: &mut Expressions, value: ExprId, factor: ExprId) -> ExprId {
    let [zero, far, reduced] =
        [0.0, NO_SURFACE_DISTANCE, -2.0 * NO_SURFACE_DISTANCE].map(|number| e.constant(number));
    let magnitude = e.call(Op::Abs, &[factor]);
    let is_above = e.call(Op::Less, &[zero, magnitude]);
    let change = e.call(Op::Mul, &[is_above, reduced]);
    let least = e.call(Op::Add, &[far, change]);
    e.call(Op::Max, &[value, least])
}

/// A live factor that may be zero.
struct LiveFactor {
    number: ExprId,
    may_be_negative: bool,
}

/// Factors that were removed from a product.
struct Factors<'a> {
    e: &'a mut Expressions,
    ranges: &'a ParamRanges,
    /// Set if the product of the constant ones is negative.
    is_negated: bool,
    /// Smallest magnitude of the product.
    least: f64,
    /// Set while factors of a divisor are removed.
    is_in_divisor: bool,
    /// Set if live ones are removed, too.
    takes_live: bool,
    /// Live ones that may be zero.
    live: Vec<LiveFactor>,
    /// Parameters and time of all live ones.
    leaves: HashSet<ExprId>,
    /// Results of the search for common factors. Sums may share their terms many times.
    common_factors: HashMap<ExprId, Option<CommonFactor>>,
}

/// A live factor of all terms of a sum, and the sum without it.
type CommonFactor = (ExprId, ExprId);

impl<'a> Factors<'a> {
    fn new(e: &'a mut Expressions, ranges: &'a ParamRanges, takes_live: bool) -> Self {
        Self {
            e,
            ranges,
            is_negated: false,
            least: 1.0,
            is_in_divisor: false,
            takes_live,
            live: Vec::new(),
            leaves: HashSet::new(),
            common_factors: HashMap::new(),
        }
    }

    /// Returns a product without its factors. It recurses over products, up to a depth.
    fn remove(&mut self, number: ExprId, depth: u32) -> ExprId {
        let Expression::Apply { op, values, .. } = self.e.get(number).clone() else {
            return number;
        };
        match (op, values.as_slice()) {
            _ if depth == 0 || self.e.stage(number) <= Stage::Uniform => number,
            (Op::Neg, &[a]) => {
                self.is_negated = !self.is_negated;
                self.remove(a, depth - 1)
            }
            (Op::Mul, &[a, b]) if self.take(a, op) => self.remove(b, depth - 1),
            (Op::Mul | Op::Div, &[a, b]) if self.take(b, op) => self.remove(a, depth - 1),
            (Op::Mul | Op::Div, &[a, b]) => {
                let first = self.remove(a, depth - 1);
                self.is_in_divisor ^= op == Op::Div;
                let operands = [first, self.remove(b, depth - 1)];
                self.is_in_divisor ^= op == Op::Div;
                match operands == [a, b] {
                    true => number,
                    false => self.e.call(op, &operands),
                }
            }
            (Op::Add | Op::Sub, _) => match self.common_factor(number, depth) {
                Some((factor, rest)) if self.take(factor, Op::Mul) => self.remove(rest, depth - 1),
                _ => number,
            },
            _ => number,
        }
    }

    /// Returns a live factor of all terms of a sum, and the sum without it.
    fn common_factor(&mut self, number: ExprId, depth: u32) -> Option<CommonFactor> {
        if let Some(&known) = self.common_factors.get(&number) {
            return known;
        }
        let found = self.find_common_factor(number, depth);
        self.common_factors.insert(number, found);
        found
    }

    /// Searches the terms of a sum for a common factor, up to a depth.
    fn find_common_factor(&mut self, number: ExprId, depth: u32) -> Option<CommonFactor> {
        let is_live = |e: &Expressions, id: ExprId| {
            e.stage(id) <= Stage::Uniform && e.as_constant(id).is_none()
        };
        if is_live(self.e, number) {
            return Some((number, self.e.constant(1.0)));
        }
        let Expression::Apply { op, values, .. } = self.e.get(number).clone() else {
            return None;
        };
        match (op, values.as_slice()) {
            _ if depth == 0 => None,
            (Op::Mul, &[a, b]) if is_live(self.e, a) => Some((a, b)),
            (Op::Mul, &[a, b]) if is_live(self.e, b) => Some((b, a)),
            (Op::Div, &[a, b]) if is_live(self.e, a) => {
                let one = self.e.constant(1.0);
                Some((a, self.e.call(Op::Div, &[one, b])))
            }
            (Op::Neg, &[a]) => {
                let (factor, rest) = self.common_factor(a, depth - 1)?;
                Some((factor, self.e.call(Op::Neg, &[rest])))
            }
            (Op::Add | Op::Sub, &[a, b]) => {
                let (factor, first) = self.common_factor(a, depth - 1)?;
                let (other, second) = self.common_factor(b, depth - 1)?;
                (factor == other).then(|| (factor, self.e.call(op, &[first, second])))
            }
            _ => None,
        }
    }

    /// Notes the smallest and the largest magnitude of a factor or divisor that is removed.
    fn include(&mut self, [smallest, largest]: [f64; 2], op: Op) {
        let is_divisor = (op == Op::Div) ^ self.is_in_divisor;
        self.least *= if is_divisor {
            largest.recip()
        } else {
            smallest
        };
    }

    /// Removes a uniform factor or divisor, and reports whether it can be.
    fn take(&mut self, factor: ExprId, op: Op) -> bool {
        if self.e.stage(factor) > Stage::Uniform {
            return false;
        }
        match self.e.as_constant(factor) {
            Some(_) => {
                let Some(factor) = constant_factor(self.e, factor) else {
                    return false;
                };
                self.is_negated ^= factor < 0.0;
                self.include([factor.abs(); 2], op);
                true
            }
            None => {
                let range = self.ranges.number(self.e, factor);
                let is_factor = self.takes_live && op == Op::Mul && range.lo < range.hi;
                if is_factor {
                    self.leaves.extend(leaves(self.e, factor));
                    let may_be_zero = range.lo <= 0.0 && range.hi >= 0.0;
                    self.is_negated ^= range.hi < 0.0;
                    let Interval { lo, hi } = range.abs();
                    self.include([lo, hi], op);
                    self.live.extend(may_be_zero.then_some(LiveFactor {
                        number: factor,
                        may_be_negative: range.lo < 0.0,
                    }));
                }
                is_factor
            }
        }
    }
}

/// Returns the parameters, and the time, that a number depends on.
fn leaves(expressions: &Expressions, number: ExprId) -> HashSet<ExprId> {
    let operands = postorder(expressions, number, |_| false).into_iter();
    let is_leaf = |&id: &ExprId| {
        matches!(
            expressions.get(id),
            Expression::Param(..) | Expression::Time
        )
    };
    operands.filter(is_leaf).collect()
}
