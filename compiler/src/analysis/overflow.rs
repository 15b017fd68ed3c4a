//! Numbers that overflow `f32`: infinities of both signs cancel to NaN.
//!
//! An iteration such as `z² + c` exceeds `f32` after a few rounds, where a real number would be large. A field is
//! outside where it is not a number. A maximum would forget that, since it returns its other operand. So its operand is
//! limited first: the minimum of NaN and a large number is that number. Points of warps and displacements are limited,
//! since shapes contain maxima, too.

use crate::analysis::box_eval::{BoxNumber, UniformInput};
use crate::analysis::param_ranges::ParamRanges;
use crate::expression::{ExprId, Expression, Expressions, Stage};
use crate::scene::{NO_SURFACE_DISTANCE, Scene, ShapeId, ShapeKind};
use crate::uniforms::{postorder, rewrite_number};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;
use std::collections::{HashMap, HashSet};

/// Limit of values that may overflow: no distance is as large.
const MAX_VALUE: f64 = 1e30;
/// Limit of coordinates that may overflow: their cubes are numbers.
const MAX_COORDINATE: f64 = 1e12;

/// Limits the numbers of the shapes that are drawn, where they may overflow.
pub(crate) fn limit_overflow(
    scene: &mut Scene,
    root: ShapeId,
    uses: &HashSet<(ShapeId, bool)>,
    param_ranges: &ParamRanges,
) {
    let e = &mut scene.expressions;
    for (id, shape) in (0..).map(ShapeId).zip(&mut scene.shapes) {
        if ![true, false]
            .iter()
            .any(|&by_sign| uses.contains(&(id, by_sign)))
        {
            continue;
        }
        match &mut shape.kind {
            ShapeKind::Field { value, .. } => {
                let limit = (id != root).then_some(MAX_VALUE);
                *value = outside_where_overflown(e, *value, limit, param_ranges);
            }
            ShapeKind::Warp { point, .. } => {
                for coordinate in point {
                    let limit = Some(MAX_COORDINATE);
                    *coordinate = outside_where_overflown(e, *coordinate, limit, param_ranges);
                }
            }
            ShapeKind::Displace { amount, .. } => {
                *amount = outside_where_overflown(e, *amount, Some(MAX_VALUE), param_ranges);
            }
            _ => {}
        }
    }
}

/// Returns a number whose maxima are large where an operand is NaN by overflow. With a limit, it is never NaN itself.
fn outside_where_overflown(
    e: &mut Expressions,
    number: ExprId,
    own_limit: Option<f64>,
    param_ranges: &ParamRanges,
) -> ExprId {
    let has_limits = |id: &ExprId| {
        let node = e.get(*id);
        matches!(
            node,
            Expression::Apply {
                op: Op::Max | Op::Clamp,
                ..
            }
        )
    };
    let order = postorder(e, number, |_| false);
    if own_limit.is_none() && !order.iter().any(has_limits) {
        return number;
    }
    let may_be_nan = numbers_that_overflow(e, &order, param_ranges);
    if !may_be_nan[&number] {
        return number;
    }
    let limited = |e: &mut Expressions, new: ExprId, limit: f64| {
        let limit = e.constant(limit);
        e.call(Op::Min, &[new, limit])
    };
    let rewritten = rewrite_number(e, number, |e, id, rebuilt, values| {
        let Expression::Apply {
            op,
            values: old_values,
            ..
        } = e.get(id).clone()
        else {
            return rebuilt;
        };
        let limited_count = match op {
            Op::Max => 2,
            Op::Clamp => 1,
            _ => return rebuilt,
        };
        let mut values = values.to_vec();
        for (value, old) in values.iter_mut().zip(old_values).take(limited_count) {
            if may_be_nan[&old] {
                *value = limited(e, *value, MAX_VALUE);
            }
        }
        e.call(op, &values)
    });
    match own_limit {
        Some(limit) => limited(e, rewritten, limit),
        None => rewritten,
    }
}

/// Results of overflow that a number may have at points that rays reach.
#[derive(Clone, Copy, Default)]
struct Overflow {
    /// Set for −∞ and ∞. Poles do not count: they are single points.
    is_infinite: [bool; 2],
    is_nan: bool,
}

/// Returns for each number whether it may be NaN by overflow, at points that rays reach.
fn numbers_that_overflow(
    e: &Expressions,
    order: &[ExprId],
    param_ranges: &ParamRanges,
) -> HashMap<ExprId, bool> {
    let mut found: HashMap<ExprId, Overflow> = HashMap::new();
    let Some(&last) = order.last() else {
        return HashMap::new();
    };
    let mut leaf = |id| UniformInput::Known(param_ranges.leaf(e, id));
    let mut program = BoxNumber::<Interval>::new(e, last, &mut leaf);
    let reached = Bounds::centred([2.0 * NO_SURFACE_DISTANCE; 3]);
    let ranges = program.eval_all(&reached, &[]).to_vec();
    let range_of = |id: ExprId| {
        let index = order.binary_search(&id);
        index.map_or(Interval::ALL, |index| ranges[index])
    };
    for &id in order {
        let overflow = match e.get(id) {
            Expression::Apply {
                op,
                point,
                values,
                parameters,
            } if e.stage(id) > Stage::Uniform => {
                let operands = point.iter().flatten().chain(values).chain(parameters);
                let operands: Vec<_> = operands.map(|it| (range_of(*it), found[it])).collect();
                overflow_of(*op, range_of(id), &operands)
            }
            _ => Overflow::default(),
        };
        found.insert(id, overflow);
    }
    let is_nan = found
        .into_iter()
        .map(|(id, overflow)| (id, overflow.is_nan));
    is_nan.collect()
}

/// Returns the overflow of an operation from its range, and the ranges and overflows of its operands.
fn overflow_of(op: Op, range: Interval, operands: &[(Interval, Overflow)]) -> Overflow {
    if matches!(op, Op::Less | Op::And | Op::Or | Op::Not | Op::Step) {
        return Overflow::default();
    }
    let is_infinite = |(_, overflow): &(Interval, Overflow)| overflow.is_infinite.contains(&true);
    let max = f64::from(f32::MAX);
    let exceeds = [range.lo < -max, range.hi > max];
    let is_finite =
        |(range, _): &(Interval, Overflow)| range.lo.is_finite() && range.hi.is_finite();
    let is_pole = !operands.iter().any(is_infinite) && !operands.iter().all(is_finite);
    let contains_zero = |range: Interval| range.lo <= 0.0 && range.hi >= 0.0;
    let is_own_nan = match (op, operands) {
        (Op::Add, [(_, a), (_, b)]) => [0, 1]
            .iter()
            .any(|&end| a.is_infinite[end] && b.is_infinite[1 - end]),
        (Op::Sub, [(_, a), (_, b)]) => [0, 1]
            .iter()
            .any(|&end| a.is_infinite[end] && b.is_infinite[end]),
        (Op::Mul, [a, b]) => {
            is_infinite(a) && contains_zero(b.0) || is_infinite(b) && contains_zero(a.0)
        }
        (Op::Div, [a, b]) => is_infinite(a) && is_infinite(b),
        (Op::Mix, [a, b, _]) => is_infinite(a) || is_infinite(b),
        _ => false,
    };
    Overflow {
        is_infinite: exceeds.map(|exceeds| exceeds && !is_pole && op != Op::Div),
        is_nan: is_own_nan || operands.iter().any(|(_, overflow)| overflow.is_nan),
    }
}
