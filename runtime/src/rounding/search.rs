//! The largest running error on a surface, by branch and bound. The box with the largest bound is bisected
//! until its bound is not much more than the largest error found at a point. Boxes in which the field has no
//! zero are left out.

use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::{evaluate, evaluate_f64};
use sdfc_vm::interval::Interval;
use sdfc_vm::program::Program;
use sdfc_vm::rounding::{RunningError, error_bound};
use sdfc_vm::tape::lipschitz::divides_raw;
use sdfc_vm::vector::V3;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Number of evaluated instructions that sets the number of boxes and points.
const MAX_INSTRUCTIONS: usize = 20_000;
/// Minimum number of boxes, for long programs.
const MIN_BOXES: usize = 48;
/// Maximum number of boxes.
const MAX_BOXES: usize = 900;
/// The search ends when the bound is at most this many times the largest error found.
const MAX_GAP_RATIO: f64 = 1.5;

/// Bounds of the largest error in a region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorBound {
    /// Upper bound of the error at any point; infinite if that could not be proved.
    pub upper_bound: f64,
    /// Largest bound at one of the sampled points.
    pub largest_found: f64,
    /// Set if the error at a sampled point is unbounded, and `f32` puts the point on the other side of a
    /// surface.
    pub is_unbounded: bool,
}

impl ErrorBound {
    /// Reports whether the search converged: the bound is at most four times the largest error
    /// found.
    pub fn is_settled(&self) -> bool {
        self.upper_bound <= 4.0 * self.largest_found
    }
}

/// An error at a sampled point.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SampledError {
    pub(super) error: f64,
    /// Set if the error is unbounded.
    pub(super) is_beyond: bool,
}

impl SampledError {
    /// Returns the larger of two errors.
    pub(super) fn or(self, other: Self) -> Self {
        Self {
            error: self.error.max(other.error),
            is_beyond: self.is_beyond || other.is_beyond,
        }
    }

    /// Returns the error, limited to what was measured.
    pub(super) fn at_most(self, measured: f64) -> Self {
        Self {
            error: self.error.min(measured),
            ..self
        }
    }

    /// Converts the error to another unit.
    pub(super) fn in_units(self, unit: f64) -> Self {
        Self {
            error: self.error / unit.max(f64::MIN_POSITIVE),
            ..self
        }
    }
}

/// Scale by which the error in a box is measured.
pub(super) struct ErrorScale {
    /// Errors of the coordinates.
    pub(super) coordinate_errors: [f64; 3],
    /// Unit in which errors are reported.
    pub(super) unit: f64,
    /// Largest half diagonal of a box whose centre may stand for a point on a surface nearby.
    pub(super) max_half_diagonal: f64,
}

struct SearchBox {
    priority: f64,
    region_box: [Interval; 3],
}

impl Ord for SearchBox {
    fn cmp(&self, other: &Self) -> Ordering {
        self.priority.total_cmp(&other.priority)
    }
}
impl PartialOrd for SearchBox {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl PartialEq for SearchBox {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}
impl Eq for SearchBox {}

/// Returns the largest error in a finite region where there may be a surface, in units of `error_scale`.
/// Boxes without a scale are left out. Returns `None` if there is no surface. `largest` is an error that is
/// already known.
pub(super) fn max_error(
    program: &Program,
    region: &Bounds,
    mut largest: SampledError,
    error_scale: impl Fn(&[Interval; 3]) -> Option<ErrorScale>,
) -> Option<ErrorBound> {
    let bounded_box = |region_box: [Interval; 3]| {
        let error_scale = error_scale(&region_box)?;
        let bound = error_bound(program, region_box, error_scale.coordinate_errors);
        bound.may_be_zero().then(|| SearchBox {
            priority: bound.error / error_scale.unit.max(f64::MIN_POSITIVE),
            region_box,
        })
    };
    let root = std::array::from_fn(|i| Interval::between(region.min[i], region.max[i]));
    let mut queue: BinaryHeap<SearchBox> = bounded_box(root).into_iter().collect();
    let mut bound_of_finished = None::<f64>;
    let mut remaining_boxes =
        (MAX_INSTRUCTIONS / program.code.len().max(1)).clamp(MIN_BOXES, MAX_BOXES);
    while let Some(search_box) = queue.pop() {
        remaining_boxes = remaining_boxes.saturating_sub(3);
        let halves = bisect(&search_box.region_box);
        if let Some(error) = error_near_centre(program, &search_box.region_box, &error_scale) {
            largest = largest.or(error);
        }
        let is_done = search_box.priority <= MAX_GAP_RATIO * largest.error || remaining_boxes == 0;
        match halves {
            Some(halves) if !is_done => queue.extend(halves.into_iter().filter_map(bounded_box)),
            _ => {
                bound_of_finished = Some(
                    bound_of_finished
                        .map_or(search_box.priority, |bound| bound.max(search_box.priority)),
                )
            }
        }
        if is_done {
            break;
        }
    }
    let bound_of_waiting = queue.peek().map(|search_box| search_box.priority);
    let at_most = bound_of_finished
        .into_iter()
        .chain(bound_of_waiting)
        .reduce(f64::max)?;
    Some(ErrorBound {
        upper_bound: at_most.max(largest.error),
        largest_found: largest.error,
        is_unbounded: largest.is_beyond,
    })
}

/// Returns the error near the centre of a box, if a surface may be nearby and no branch is uncertain there.
/// At the centre itself there often are discontinuities.
fn error_near_centre(
    program: &Program,
    region_box: &[Interval; 3],
    error_scale: &impl Fn(&[Interval; 3]) -> Option<ErrorScale>,
) -> Option<SampledError> {
    let half_diagonal = region_box.iter().map(|side| (side.hi - side.lo).powi(2));
    let half_diagonal = half_diagonal.sum::<f64>().sqrt() / 2.0;
    let centre = region_box.map(|side| Interval::point(side.lo + 0.4871 * (side.hi - side.lo)));
    let error_scale = error_scale(&centre)
        .filter(|error_scale| half_diagonal <= error_scale.max_half_diagonal)?;
    let bound = error_bound(program, centre, error_scale.coordinate_errors);
    let is_near_surface = bound.value.lo.abs().min(bound.value.hi.abs()) <= 2.0 * half_diagonal;
    let error = sampled_error(program, centre.map(|side| side.lo), &bound)?;
    let is_known = bound.error.is_finite();
    let may_be = is_near_surface || is_known && bound.may_be_zero();
    let has_surface = error.is_beyond
        || !program.code.iter().any(divides_raw)
        || changes_sign(program, region_box);
    (may_be && has_surface).then(|| error.in_units(error_scale.unit))
}

/// Reports whether the field has both signs at the corners of a box. Near a pole, the value of a field that
/// was divided by a slope bound is small though no surface is near.
fn changes_sign(program: &Program, region_box: &[Interval; 3]) -> bool {
    let corner = |corner: usize| {
        std::array::from_fn(|axis| match corner >> axis & 1 {
            0 => region_box[axis].lo,
            _ => region_box[axis].hi,
        })
    };
    let mut signs = (0..8).map(|index| evaluate_f64(program, corner(index)) < 0.0);
    let first = signs.next();
    signs.any(|sign| Some(sign) != first)
}

/// Returns the error at a point, given its bound there. Returns `None` where a branch is uncertain, and where
/// the field is NaN.
///
/// An unbounded error, as beyond the range of `f32`, counts if the value in `f32` is on the other side of the
/// surface. Rays that meet NaN are counted when the picture is rendered.
pub(super) fn sampled_error(
    program: &Program,
    point: [f64; 3],
    bound: &RunningError,
) -> Option<SampledError> {
    if bound.branch_uncertain {
        return None;
    }
    if bound.error.is_finite() {
        return Some(SampledError {
            error: bound.error,
            is_beyond: false,
        });
    }
    let [x, y, z] = point.map(|v| v as f32);
    let single = f64::from(evaluate::<f32>(program, V3::new(x, y, z)));
    let double = evaluate_f64(program, point);
    let moves_surface = (single < 0.0) != (double < 0.0);
    let error = (single - double).abs();
    (moves_surface && error.is_finite()).then_some(SampledError {
        error,
        is_beyond: true,
    })
}

/// Bisects a box across its longest side. Returns `None` if it is too small for that.
fn bisect(region_box: &[Interval; 3]) -> Option<[[Interval; 3]; 2]> {
    let length = |i: &usize| region_box[*i].hi - region_box[*i].lo;
    let axis = (0..3).max_by(|a, b| length(a).total_cmp(&length(b)))?;
    let side = region_box[axis];
    let middle = side.lo + (side.hi - side.lo) / 2.0;
    let is_between = side.lo < middle && middle < side.hi;
    if !is_between {
        return None;
    }
    let (mut low_half, mut high_half) = (*region_box, *region_box);
    low_half[axis].hi = middle;
    high_half[axis].lo = middle;
    Some([low_half, high_half])
}
