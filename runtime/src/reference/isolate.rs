//! The first root of a field along a ray, isolated.
//!
//! The way from the camera to `far` is a stack of segments, the nearest on top. A segment on which
//! the field's interval does not hold zero is proved empty. Otherwise, where the field is whole
//! (no jump in it), bounds of its slope along the ray trim the segment from both ends by what the
//! values there cannot reach, and where it only falls, values of both signs at the ends prove one
//! root, which interval Newton steps close in on. What is left is halved, and the nearer half comes
//! first. At the finest width a value of the other sign behind the segment proves a change of sign,
//! be it a root or a jump.
//!
//! A change of sign is a hit if the field gets below zero behind it by more than rounding alone can do
//! ([`marching::noise`]). If it is above zero again before that, the ray has passed a sheet without
//! thickness, or touched a surface, and the search goes on behind.
//!
//! The program is pruned for each segment by what its intervals decide, so the work near a surface
//! is that of the shapes that are near.

use super::camera::Ray;
use super::field::Asker;
use super::{Options, Outcome, Why};
use sdfc_shaders::marching;
use sdfc_vm::interval::Interval;
use sdfc_vm::tape::parts::Part;

/// The share of a segment that is not trimmed although it could be, against rounding of the trim
/// itself.
const CAUTION: f64 = 1e-9;
/// Slopes beyond this say that there is a pole, of which duals know a finite part only.
const STEEPEST: f64 = 1e9;
/// The width at which segments are halved no more, as a share of the coordinates.
const FINEST: f64 = 1.0 / (1_u64 << 44) as f64;
/// The width that a proved hit may have near the camera, as a share of the coordinates.
const NEAR: f64 = 1.0 / (1_u64 << 40) as f64;
/// How far behind a place where the sign of the field is not known it is looked for, as a fraction of
/// the coordinates.
const VAGUEST: f64 = 1e-3;
/// A bracket goes on being narrowed as long as it becomes less wide than this share of itself.
const LESS: f64 = 0.8;

/// A piece of a ray that may hold a root. The field at its start is not zero, nor before.
struct Segment {
    t: Interval,
    part: Part,
}

/// A search along one ray.
struct Search<'s, 'a> {
    asker: &'s mut Asker<'a>,
    ray: &'s Ray,
    far: f64,
    options: &'s Options,
    /// 1 where the ray starts outside, −1 inside: times the field, what starts above zero.
    side: f64,
}

/// The first root up to `far`, and whether the ray starts inside the solid.
pub(super) fn first_root(
    asker: &mut Asker<'_>,
    ray: &Ray,
    far: f64,
    options: &Options,
) -> (Outcome, bool) {
    let whole = asker.whole();
    asker.forget_after(&whole);
    let mut search = Search {
        asker,
        ray,
        far,
        options,
        side: 1.0,
    };
    // What is so near to zero where the ray starts that it has no sign is left behind.
    let mut start = 0.0;
    let mut width = search.finest(0.0);
    let sign = loop {
        let value = search.value(start, &whole);
        if value.lo > 0.0 || value.hi < -search.depth(start, 1.0) {
            break value;
        }
        start = width;
        width *= 2.0;
        if width > search.size(0.0).max(f64::MIN_POSITIVE) * VAGUEST {
            let here = Outcome::Undecided {
                t0: 0.0,
                t1: start,
                why: Why::Start,
            };
            return (here, false);
        }
    };
    let inside = sign.hi < 0.0;
    search.side = if inside { -1.0 } else { 1.0 };
    (search.run(whole, start), inside)
}

/// What lies behind a place where the sign of the field may change.
enum Behind {
    /// A solid: the field is below zero by more than rounding, and is so from here on at the latest.
    Solid(f64),
    /// Nothing: here the field is above zero again.
    Clear(f64),
    /// It could not be decided.
    Unknown(f64),
}

/// What a segment turned out to be.
enum Verdict {
    Empty,
    Root(Interval),
    /// Only this part of it may hold a root.
    Open(Interval),
}

impl Search<'_, '_> {
    fn run(&mut self, whole: Part, start: f64) -> Outcome {
        let budget = self.asker.evaluations + u64::from(self.options.evaluations);
        let mut stack = vec![Segment {
            t: Interval::between(start, self.far),
            part: whole,
        }];
        while let Some(Segment { t, part }) = stack.pop() {
            if self.asker.evaluations > budget {
                return Outcome::Undecided {
                    t0: t.lo,
                    t1: self.far,
                    why: Why::Budget,
                };
            }
            self.asker.forget_after(&part);
            let (range, whole) = self.asker.between(self.ray, t, &part);
            if !range.contains(0.0) {
                continue;
            }
            let part = self.asker.prune(&part);
            let (found, open) = if whole {
                match self.trimmed(t, &part) {
                    Verdict::Empty => continue,
                    Verdict::Root(root) => (Some(root), root),
                    Verdict::Open(open) => (None, open),
                }
            } else if self.asker.explored(self.ray, t, &part).contains(0.0) {
                (None, t)
            } else {
                continue;
            };
            let is_finest = open.hi - open.lo <= self.finest(open.hi);
            if found.is_some() || is_finest {
                match self.behind(open) {
                    Behind::Solid(t1) if t1 - open.lo <= self.widest(open.lo) => {
                        return Outcome::Hit { t0: open.lo, t1 };
                    }
                    Behind::Solid(t1) | Behind::Unknown(t1) => {
                        return touching(Interval {
                            lo: open.lo,
                            hi: t1,
                        });
                    }
                    Behind::Clear(from) => {
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
            if open.hi - open.lo < (t.hi - t.lo) / 2.0 {
                stack.push(Segment { t: open, part });
                continue;
            }
            let middle = open.lo + (open.hi - open.lo) / 2.0;
            for (lo, hi) in [(middle, open.hi), (open.lo, middle)] {
                let t = Interval { lo, hi };
                let part = part.clone();
                stack.push(Segment { t, part });
            }
        }
        Outcome::Miss
    }

    /// How far below zero the field must get at `t` to be inside, where it changes by `slope` per unit.
    fn depth(&self, t: f64, slope: f64) -> f64 {
        let origin = self.ray.origin.iter();
        let largest = origin.fold(0.0_f64, |most, v| most.max(v.abs()));
        let rounding = marching::rounding_at(t, marching::ROUNDING * largest);
        let raw = if self.asker.field().is_raw() {
            1.0
        } else {
            0.0
        };
        marching::noise(rounding, slope, raw)
    }

    /// What lies behind a piece in which the sign of the field may change.
    fn behind(&mut self, piece: Interval) -> Behind {
        let whole = self.asker.whole();
        let mut width = self.finest(piece.hi);
        let mut at = piece.hi;
        let mut below = None;
        loop {
            let value = self.value(at, &whole);
            let slope = -value.hi / (at - piece.lo).max(f64::MIN_POSITIVE);
            if value.hi < 0.0 {
                let first = *below.get_or_insert(at);
                if value.hi < -self.depth(at, slope) {
                    return Behind::Solid(first);
                }
            }
            if value.lo > 0.0 && at > piece.lo {
                return Behind::Clear(at);
            }
            if at >= self.far || width > self.size(piece.hi) * VAGUEST {
                return Behind::Unknown(at);
            }
            at = (piece.hi + width).min(self.far);
            width *= 2.0;
        }
    }

    /// How large numbers along the ray are at `t`.
    fn size(&self, t: f64) -> f64 {
        let origin = self.ray.origin.iter();
        t + origin.fold(0.0_f64, |most, v| most.max(v.abs()))
    }

    /// The width at which segments are halved no more.
    fn finest(&self, t: f64) -> f64 {
        self.size(t) * FINEST
    }

    /// The width that a hit at `t` may have.
    fn widest(&self, t: f64) -> f64 {
        (t * self.options.tolerance).max(self.size(t) * NEAR)
    }

    /// The field times the side.
    fn value(&mut self, t: f64, part: &Part) -> Interval {
        let value = self.asker.value(self.ray, t, part);
        self.outside(value)
    }

    fn outside(&self, v: Interval) -> Interval {
        if self.side < 0.0 { -v } else { v }
    }

    /// Bounds of the slope of the field times the side, where they can be trusted.
    fn slope(&mut self, t: Interval, part: &Part) -> Option<Interval> {
        let slope = self.asker.slope(self.ray, t, part);
        (slope.magnitude() < STEEPEST).then(|| self.outside(slope))
    }

    /// What slopes say of a segment on which the field is whole.
    fn trimmed(&mut self, t: Interval, part: &Part) -> Verdict {
        let Some(slope) = self.slope(t, part) else {
            return Verdict::Open(t);
        };
        // The field starts above zero.
        if slope.lo >= 0.0 {
            return Verdict::Empty;
        }
        let mut open = t;
        let (first, last) = (self.value(t.lo, part), self.value(t.hi, part));
        if first.lo > 0.0 {
            open.lo += first.lo / -slope.lo * (1.0 - CAUTION);
        }
        if last.lo > 0.0 {
            if slope.hi <= 0.0 {
                return Verdict::Empty;
            }
            open.hi -= last.lo / slope.hi * (1.0 - CAUTION);
        }
        // Sums are rounded; so much they may be off.
        let rounding = t.hi * f64::EPSILON;
        open.lo = (open.lo - rounding).max(t.lo);
        open.hi = (open.hi + rounding).min(t.hi);
        if open.lo >= open.hi {
            return Verdict::Empty;
        }
        if slope.hi <= 0.0 && last.hi < 0.0 {
            return Verdict::Root(self.newton(open, slope, part));
        }
        Verdict::Open(open)
    }

    /// Closes in on the only root of a bracket on which the field falls, or is level, from above to
    /// below zero.
    fn newton(&mut self, bracket: Interval, slope: Interval, part: &Part) -> Interval {
        let (mut t, mut slope) = (bracket, slope);
        loop {
            let before = t.hi - t.lo;
            if before <= self.finest(t.hi) {
                return t;
            }
            // Where the sign at one place is not known, it most likely is at another.
            for share in [0.5, 0.25, 0.75] {
                let at = t.lo + (t.hi - t.lo) * share;
                let value = self.value(at, part);
                if value.lo > 0.0 {
                    t.lo = at;
                } else if value.hi < 0.0 {
                    t.hi = at;
                }
                if slope.hi < 0.0 {
                    let step = Interval::point(at) - value / slope;
                    t.lo = t.lo.max(step.lo).min(t.hi);
                    t.hi = t.hi.min(step.hi).max(t.lo);
                }
                if t.hi - t.lo < before * LESS {
                    break;
                }
            }
            let width = t.hi - t.lo;
            if width >= before * LESS {
                return t;
            }
            if width < before / 4.0
                && let Some(near) = self.slope(t, part)
                && near.hi <= 0.0
            {
                slope = near;
            }
        }
    }
}

/// The outcome of a ray that comes too near to a surface to tell whether it meets it.
fn touching(t: Interval) -> Outcome {
    Outcome::Undecided {
        t0: t.lo,
        t1: t.hi,
        why: Why::Touching,
    }
}

/// A guess where a ray ends that is undecided from `from` on: plain steps in `f64` until the sign changes.
pub(super) fn guess(
    asker: &mut Asker<'_>,
    ray: &Ray,
    from: f64,
    far: f64,
    inside: bool,
) -> Option<f64> {
    let field = asker.field();
    let side = if inside { -1.0 } else { 1.0 };
    let mut t = from;
    for _ in 0..GUESS_STEPS {
        let distance = field.distance(ray.at(t)) * side;
        asker.evaluations += 1;
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

/// The most steps of a guess.
const GUESS_STEPS: usize = 4_096;
