//! The largest running error on a surface, by branch and bound: the box with the largest bound is cut
//! in two until its bound is not much more than what was found at a point. Boxes in which the field is
//! known to have no zero are left out.

use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::{evaluate, evaluate_f64};
use sdfc_vm::interval::Interval;
use sdfc_vm::program::Program;
use sdfc_vm::rounding::{Rounded, bound};
use sdfc_vm::tape::steep::divides_raw;
use sdfc_vm::vector::V3;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// How many instructions are evaluated at most, and how many boxes and points at least and at most.
const WORK: usize = 20_000;
const BOXES: [usize; 2] = [48, 900];
/// The search ends where the bound is no more than this many times what was found.
const NEAR: f64 = 1.5;

/// The largest error of many.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worst {
    /// No point is off by more; infinite where that could not be shown.
    pub at_most: f64,
    /// The bound at the worst of the points that were looked at.
    pub found: f64,
    /// Nothing bounds the error at one of these, and `f32` puts it on the other side of a surface.
    pub is_beyond: bool,
}

impl Worst {
    /// Whether the search came to an end: both numbers are nearly the same.
    pub fn is_settled(&self) -> bool {
        self.at_most <= 4.0 * self.found
    }
}

/// An error that was found at a point.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Found {
    pub(super) error: f64,
    /// Nothing bounds it.
    is_beyond: bool,
}

impl Found {
    /// The larger of two errors.
    pub(super) fn or(self, other: Self) -> Self {
        Self {
            error: self.error.max(other.error),
            is_beyond: self.is_beyond || other.is_beyond,
        }
    }

    /// The same in another unit.
    pub(super) fn per(self, unit: f64) -> Self {
        Self {
            error: self.error / unit.max(f64::MIN_POSITIVE),
            ..self
        }
    }
}

/// What a box is measured by.
pub(super) struct Gauge {
    /// How far its coordinates are off.
    pub(super) off: [f64; 3],
    /// The unit in which errors are told.
    pub(super) unit: f64,
    /// How large a box may be for its middle to be a place on a surface nearby, in half diagonals.
    pub(super) coarse: f64,
}

struct Part {
    score: f64,
    place: [Interval; 3],
}

impl Ord for Part {
    fn cmp(&self, other: &Self) -> Ordering {
        self.score.total_cmp(&other.score)
    }
}
impl PartialOrd for Part {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl PartialEq for Part {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}
impl Eq for Part {}

/// The largest error in a finite region where there may be a surface, in units of the gauge, which
/// leaves out boxes that do not matter; `None` if there is no surface. `found` is what some point is
/// known to be off.
pub(super) fn worst(
    program: &Program,
    region: &Bounds,
    mut found: Found,
    gauge: impl Fn(&[Interval; 3]) -> Option<Gauge>,
) -> Option<Worst> {
    let measured = |place: [Interval; 3]| {
        let gauge = gauge(&place)?;
        let bound = bound(program, place, gauge.off);
        bound.may_be_zero().then(|| Part {
            score: bound.error / gauge.unit.max(f64::MIN_POSITIVE),
            place,
        })
    };
    let whole = std::array::from_fn(|i| Interval::between(region.min[i], region.max[i]));
    let mut parts: BinaryHeap<Part> = measured(whole).into_iter().collect();
    let mut settled = None::<f64>;
    let [least, most] = BOXES;
    let mut left = (WORK / program.code.len().max(1)).clamp(least, most);
    while let Some(part) = parts.pop() {
        left = left.saturating_sub(3);
        let halves = halves(&part.place);
        if let Some(error) = at_middle(program, &part.place, &gauge) {
            found = found.or(error);
        }
        let done = part.score <= NEAR * found.error || left == 0;
        match halves {
            Some(halves) if !done => parts.extend(halves.into_iter().filter_map(measured)),
            _ => settled = Some(settled.map_or(part.score, |most| most.max(part.score))),
        }
        if done {
            break;
        }
    }
    let waiting = parts.peek().map(|part| part.score);
    let at_most = settled.into_iter().chain(waiting).reduce(f64::max)?;
    Some(Worst {
        at_most: at_most.max(found.error),
        found: found.error,
        is_beyond: found.is_beyond,
    })
}

/// The error near the middle of a box (not at it, where seams often are), if that is about where a
/// surface may be and nothing is torn there.
fn at_middle(
    program: &Program,
    place: &[Interval; 3],
    gauge: &impl Fn(&[Interval; 3]) -> Option<Gauge>,
) -> Option<Found> {
    let reach = place.iter().map(|side| (side.hi - side.lo).powi(2));
    let reach = reach.sum::<f64>().sqrt() / 2.0;
    let middle = place.map(|side| Interval::point(side.lo + 0.4871 * (side.hi - side.lo)));
    let gauge = gauge(&middle).filter(|gauge| reach <= gauge.coarse)?;
    let bound = bound(program, middle, gauge.off);
    let near = bound.value.lo.abs().min(bound.value.hi.abs()) <= 2.0 * reach;
    let error = error_at(program, middle.map(|side| side.lo), &bound)?;
    let is_known = bound.error.is_finite();
    let may_be = near || is_known && bound.may_be_zero();
    let is_there =
        error.is_beyond || !program.code.iter().any(divides_raw) || changes_sign(program, place);
    (may_be && is_there).then(|| error.per(gauge.unit))
}

/// Reports whether the field has both signs at the corners of a box. Near a pole, the value of a field that was divided
/// by a bound of its slope is small though no surface is near.
fn changes_sign(program: &Program, place: &[Interval; 3]) -> bool {
    let corner = |corner: usize| {
        std::array::from_fn(|axis| match corner >> axis & 1 {
            0 => place[axis].lo,
            _ => place[axis].hi,
        })
    };
    let mut signs = (0..8).map(|at| evaluate_f64(program, corner(at)) < 0.0);
    let first = signs.next();
    signs.any(|sign| Some(sign) != first)
}

/// The error at a point, given its bound there; none at a tear, and where the field is no number.
///
/// An error that nothing bounds, as beyond the range of `f32`, counts if the value in `f32` is on the other side of
/// the surface. Rays that meet what is no number are counted when the picture is drawn.
pub(super) fn error_at(program: &Program, point: [f64; 3], bound: &Rounded) -> Option<Found> {
    if bound.torn {
        return None;
    }
    if bound.error.is_finite() {
        return Some(Found {
            error: bound.error,
            is_beyond: false,
        });
    }
    let [x, y, z] = point.map(|v| v as f32);
    let single = f64::from(evaluate::<f32>(program, V3::of(x, y, z)));
    let double = evaluate_f64(program, point);
    let moves_surface = (single < 0.0) != (double < 0.0);
    let error = (single - double).abs();
    (moves_surface && error.is_finite()).then_some(Found {
        error,
        is_beyond: true,
    })
}

/// A box cut in two across its longest side; `None` if it is too small for that.
fn halves(place: &[Interval; 3]) -> Option<[[Interval; 3]; 2]> {
    let length = |i: &usize| place[*i].hi - place[*i].lo;
    let axis = (0..3).max_by(|a, b| length(a).total_cmp(&length(b)))?;
    let side = place[axis];
    let middle = side.lo + (side.hi - side.lo) / 2.0;
    let is_between = side.lo < middle && middle < side.hi;
    if !is_between {
        return None;
    }
    let (mut first, mut second) = (*place, *place);
    first[axis].hi = middle;
    second[axis].lo = middle;
    Some([first, second])
}
