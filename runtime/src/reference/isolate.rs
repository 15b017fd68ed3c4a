//! Isolation of the first root of a field along a ray.
//!
//! The ray from the camera to `far` is a stack of segments, the nearest on top. A segment on which the
//! field's interval does not contain zero is proved empty. Otherwise, if the field is continuous there,
//! bounds of its slope along the ray trim the segment from both ends. They cut off the parts in which the
//! values cannot reach zero. Where the field only decreases, values of both signs at the ends prove one
//! root, which interval Newton steps narrow down. The remaining segment is bisected, and the nearer half
//! comes first. At the minimum width a value of the other sign beyond the segment proves a change of sign,
//! be it a root or a discontinuity.
//!
//! A change of sign is a hit if the field beyond it falls below zero by more than rounding alone can do in
//! `f32` ([`marching::sign_margin`]). If it is above zero again before that, the ray has passed a sheet
//! without thickness, or touched a surface. The search goes on beyond it.
//!
//! The program is pruned for each segment by the choices that its intervals decide. So the work near a
//! surface is that of the shapes nearby.

use super::camera::ReferenceRay;
use super::field::RayFieldEvaluator;
use super::{Outcome, TraceOptions, UndecidedReason};
use sdfc_shaders::marching;
use sdfc_vm::interval::Interval;
use sdfc_vm::tape::stack::TapeSpan;
use sdfc_vm::vector::V3;

/// Fraction of a trim that is not applied, against rounding of the trim itself.
const TRIM_SAFETY_FRACTION: f64 = 1e-9;
/// Slopes beyond this indicate a pole, of which duals know only a finite part.
const MAX_SLOPE: f64 = 1e9;
/// Minimum width of a segment that is bisected, as a fraction of the coordinates.
const MIN_SEGMENT_FRACTION: f64 = 1.0 / (1_u64 << 44) as f64;
/// Maximum width of a proved hit near the camera, as a fraction of the coordinates.
const MAX_NEAR_HIT_FRACTION: f64 = 1.0 / (1_u64 << 40) as f64;
/// Distance beyond a point with unknown sign at which the search for a sign ends, as a fraction of the
/// coordinates.
const MAX_SIGN_SEARCH_FRACTION: f64 = 1e-3;
/// Newton steps continue as long as they narrow a bracket to less than this fraction of its width.
const MAX_WIDTH_RATIO: f64 = 0.8;

/// A ray segment that may contain a root. The field is not zero at its start, nor before.
struct Segment {
    t: Interval,
    part: TapeSpan,
}

/// A search along one ray.
struct RootSearch<'s, 'a> {
    evaluator: &'s mut RayFieldEvaluator<'a>,
    ray: &'s ReferenceRay,
    far: f64,
    options: &'s TraceOptions,
    /// 1 if the ray starts outside, −1 if inside. The field times this starts above zero.
    side: f64,
}

/// Returns the first root up to `far`, and whether the ray starts inside the solid.
pub(super) fn first_root(
    evaluator: &mut RayFieldEvaluator<'_>,
    ray: &ReferenceRay,
    far: f64,
    options: &TraceOptions,
) -> (Outcome, bool) {
    let full_program = evaluator.full_program();
    evaluator.discard_after(&full_program);
    let mut search = RootSearch {
        evaluator,
        ray,
        far,
        options,
        side: 1.0,
    };
    // The start of a ray is skipped as long as the field is too close to zero to have a sign.
    let mut start = 0.0;
    let mut width = search.min_width(0.0);
    let sign = loop {
        let value = search.value(start, &full_program);
        if value.lo > 0.0 || value.hi < -search.min_inside_depth(start, 1.0) {
            break value;
        }
        start = width;
        width *= 2.0;
        if width > search.max_coordinate(0.0).max(f64::MIN_POSITIVE) * MAX_SIGN_SEARCH_FRACTION {
            let outcome = Outcome::Undecided {
                t0: 0.0,
                t1: start,
                why: UndecidedReason::Start,
            };
            return (outcome, false);
        }
    };
    let inside = sign.hi < 0.0;
    search.side = if inside { -1.0 } else { 1.0 };
    (search.run(full_program, start), inside)
}

/// Content beyond a point at which the sign of the field may change.
enum FarSide {
    /// A solid: the field is below zero by more than rounding. It is below zero at this distance already.
    Solid(f64),
    /// Empty space: the field is above zero again at this distance.
    Clear(f64),
    /// Undecided up to this distance.
    Unknown(f64),
}

/// Result of the slope test on a segment.
enum SegmentVerdict {
    Empty,
    Root(Interval),
    /// Only this part of the segment may contain a root.
    Open(Interval),
}

impl RootSearch<'_, '_> {
    fn run(&mut self, full_program: TapeSpan, start: f64) -> Outcome {
        let budget = self.evaluator.evaluations + u64::from(self.options.evaluations);
        let mut stack = vec![Segment {
            t: Interval::between(start, self.far),
            part: full_program,
        }];
        while let Some(Segment { t, part }) = stack.pop() {
            if self.evaluator.evaluations > budget {
                return Outcome::Undecided {
                    t0: t.lo,
                    t1: self.far,
                    why: UndecidedReason::Budget,
                };
            }
            self.evaluator.discard_after(&part);
            let (range, is_continuous) = self.evaluator.range(self.ray, t, &part);
            if !range.contains(0.0) {
                continue;
            }
            let part = self.evaluator.prune(&part);
            let (root_interval, trimmed) = if is_continuous {
                match self.trim_by_slope(t, &part) {
                    SegmentVerdict::Empty => continue,
                    SegmentVerdict::Root(root) => (Some(root), root),
                    SegmentVerdict::Open(trimmed) => (None, trimmed),
                }
            } else if self
                .evaluator
                .range_over_branches(self.ray, t, &part)
                .contains(0.0)
            {
                (None, t)
            } else {
                continue;
            };
            let is_finest = trimmed.hi - trimmed.lo <= self.min_width(trimmed.hi);
            if root_interval.is_some() || is_finest {
                match self.far_side(trimmed) {
                    FarSide::Solid(t1) if t1 - trimmed.lo <= self.max_hit_width(trimmed.lo) => {
                        return Outcome::Hit { t0: trimmed.lo, t1 };
                    }
                    FarSide::Solid(t1) | FarSide::Unknown(t1) => {
                        return touching(Interval {
                            lo: trimmed.lo,
                            hi: t1,
                        });
                    }
                    FarSide::Clear(from) => {
                        stack.push(Segment { t, part });
                        while let Some(mut segment) = stack.pop() {
                            if segment.t.hi > from {
                                segment.t.lo = segment.t.lo.max(from);
                                stack.push(segment);
                                break;
                            }
                        }
                        continue;
                    }
                }
            }
            if trimmed.hi - trimmed.lo < (t.hi - t.lo) / 2.0 {
                stack.push(Segment { t: trimmed, part });
                continue;
            }
            let middle = trimmed.lo + (trimmed.hi - trimmed.lo) / 2.0;
            for (lo, hi) in [(middle, trimmed.hi), (trimmed.lo, middle)] {
                let t = Interval { lo, hi };
                let part = part.clone();
                stack.push(Segment { t, part });
            }
        }
        Outcome::Miss
    }

    /// Returns the value below zero at which a point at `t` counts as inside, where the field changes by
    /// `slope` per unit.
    fn min_inside_depth(&self, t: f64, slope: f64) -> f64 {
        let origin = self.ray.origin.iter();
        let largest = origin.fold(0.0_f64, |max_abs, v| max_abs.max(v.abs()));
        let along = marching::rounding_at(t, marching::ROUNDING_PER_UNIT * largest);
        let [x, y, z] = self.ray.at(t);
        let rounding = marching::rounding_near::<f64>(V3::new(x, y, z), along, 0.0);
        let is_raw = if self.evaluator.field().is_raw() {
            1.0
        } else {
            0.0
        };
        marching::sign_margin(rounding, slope, is_raw)
    }

    /// Determines the content beyond a segment in which the sign of the field may change.
    fn far_side(&mut self, piece: Interval) -> FarSide {
        let full_program = self.evaluator.full_program();
        let mut width = self.min_width(piece.hi);
        let mut t = piece.hi;
        let mut first_below = None;
        loop {
            let value = self.value(t, &full_program);
            let slope = -value.hi / (t - piece.lo).max(f64::MIN_POSITIVE);
            if value.hi < 0.0 {
                let first_below_t = *first_below.get_or_insert(t);
                if value.hi < -self.min_inside_depth(t, slope) {
                    return FarSide::Solid(first_below_t);
                }
            }
            if value.lo > 0.0 && t > piece.lo {
                return FarSide::Clear(t);
            }
            if t >= self.far || width > self.max_coordinate(piece.hi) * MAX_SIGN_SEARCH_FRACTION {
                return FarSide::Unknown(t);
            }
            t = (piece.hi + width).min(self.far);
            width *= 2.0;
        }
    }

    /// Returns the magnitude of coordinates along the ray at `t`.
    fn max_coordinate(&self, t: f64) -> f64 {
        let origin = self.ray.origin.iter();
        t + origin.fold(0.0_f64, |max_abs, v| max_abs.max(v.abs()))
    }

    /// Returns the width below which segments are not bisected.
    fn min_width(&self, t: f64) -> f64 {
        self.max_coordinate(t) * MIN_SEGMENT_FRACTION
    }

    /// Returns the maximum width of a hit at `t`.
    fn max_hit_width(&self, t: f64) -> f64 {
        (t * self.options.tolerance).max(self.max_coordinate(t) * MAX_NEAR_HIT_FRACTION)
    }

    /// Returns the field times the side.
    fn value(&mut self, t: f64, part: &TapeSpan) -> Interval {
        let value = self.evaluator.value(self.ray, t, part);
        self.oriented(value)
    }

    fn oriented(&self, v: Interval) -> Interval {
        if self.side < 0.0 { -v } else { v }
    }

    /// Returns bounds of the slope of the field times the side, unless there may be a pole.
    fn slope(&mut self, t: Interval, part: &TapeSpan) -> Option<Interval> {
        let slope = self.evaluator.slope(self.ray, t, part);
        (slope.magnitude() < MAX_SLOPE).then(|| self.oriented(slope))
    }

    /// Trims a segment on which the field is continuous, by slope bounds.
    fn trim_by_slope(&mut self, t: Interval, part: &TapeSpan) -> SegmentVerdict {
        let Some(slope) = self.slope(t, part) else {
            return SegmentVerdict::Open(t);
        };
        // The field starts above zero.
        if slope.lo >= 0.0 {
            return SegmentVerdict::Empty;
        }
        let mut open = t;
        let (first, last) = (self.value(t.lo, part), self.value(t.hi, part));
        if first.lo > 0.0 {
            open.lo += first.lo / -slope.lo * (1.0 - TRIM_SAFETY_FRACTION);
        }
        if last.lo > 0.0 {
            if slope.hi <= 0.0 {
                return SegmentVerdict::Empty;
            }
            open.hi -= last.lo / slope.hi * (1.0 - TRIM_SAFETY_FRACTION);
        }
        // Largest error of the rounded sums.
        let rounding = t.hi * f64::EPSILON;
        open.lo = (open.lo - rounding).max(t.lo);
        open.hi = (open.hi + rounding).min(t.hi);
        if open.lo >= open.hi {
            return SegmentVerdict::Empty;
        }
        if slope.hi <= 0.0 && last.hi < 0.0 {
            return SegmentVerdict::Root(self.newton(open, slope, part));
        }
        SegmentVerdict::Open(open)
    }

    /// Narrows down the only root of a bracket on which the field does not increase, from above to below
    /// zero.
    fn newton(&mut self, bracket: Interval, slope: Interval, part: &TapeSpan) -> Interval {
        let (mut t, mut slope) = (bracket, slope);
        loop {
            let width_before = t.hi - t.lo;
            if width_before <= self.min_width(t.hi) {
                return t;
            }
            // If the sign at one point is unknown, it is most likely known at another.
            for fraction in [0.5, 0.25, 0.75] {
                let t_sample = t.lo + (t.hi - t.lo) * fraction;
                let value = self.value(t_sample, part);
                if value.lo > 0.0 {
                    t.lo = t_sample;
                } else if value.hi < 0.0 {
                    t.hi = t_sample;
                }
                if slope.hi < 0.0 {
                    let step = Interval::point(t_sample) - value / slope;
                    t.lo = t.lo.max(step.lo).min(t.hi);
                    t.hi = t.hi.min(step.hi).max(t.lo);
                }
                if t.hi - t.lo < width_before * MAX_WIDTH_RATIO {
                    break;
                }
            }
            let width = t.hi - t.lo;
            if width >= width_before * MAX_WIDTH_RATIO {
                return t;
            }
            if width < width_before / 4.0
                && let Some(tighter_slope) = self.slope(t, part)
                && tighter_slope.hi <= 0.0
            {
                slope = tighter_slope;
            }
        }
    }
}

/// Returns the outcome of a ray that is too close to a surface to tell whether it hits.
fn touching(t: Interval) -> Outcome {
    Outcome::Undecided {
        t0: t.lo,
        t1: t.hi,
        why: UndecidedReason::Touching,
    }
}

/// Estimates the end of a ray that is undecided from `from` on: plain steps in `f64` until the sign changes.
pub(super) fn estimate_end(
    evaluator: &mut RayFieldEvaluator<'_>,
    ray: &ReferenceRay,
    from: f64,
    far: f64,
    inside: bool,
) -> Option<f64> {
    let field = evaluator.field();
    let side = if inside { -1.0 } else { 1.0 };
    let mut t = from;
    for _ in 0..MAX_ESTIMATE_STEPS {
        let distance = field.distance(ray.at(t)) * side;
        evaluator.evaluations += 1;
        if distance.is_nan() || t > far {
            return None;
        }
        if distance < 0.0 {
            return Some(t);
        }
        t += distance.max(1e-7 * t);
    }
    None
}

/// Maximum number of steps of an estimate.
const MAX_ESTIMATE_STEPS: usize = 4_096;
