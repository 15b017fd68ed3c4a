//! The first root of a field along a ray, isolated.
//!
//! The way from the camera to `far` is a stack of segments, the nearest on top. A segment on which
//! the field's interval does not hold zero is proved empty. Otherwise, where the field is whole
//! (no jump in it), bounds of its slope along the ray trim the segment from both ends by what the
//! values there cannot reach, and where it only falls, values of both signs at the ends prove one
//! root, which interval Newton steps close in on. What is left is halved, and the nearer half comes
//! first. At the finest width a value of the other sign behind the segment proves a change of sign,
//! be it a root or a jump; without one, the ray is undecided.
//!
//! The program is pruned for each segment by what its intervals decide, so the work near a surface
//! is that of the shapes that are near.

use super::camera::Ray;
use super::field::{Asker, Part};
use super::{Options, Outcome, Why};
use sdfc_vm::interval::Interval;

/// The share of a segment that is not trimmed although it could be, against rounding of the trim
/// itself.
const CAUTION: f64 = 1e-9;
/// Slopes beyond this say that there is a pole, of which duals know a finite part only.
const STEEPEST: f64 = 1e9;
/// The width at which segments are halved no more, as a share of the coordinates.
const FINEST: f64 = 1.0 / (1_u64 << 44) as f64;
/// The width that a proved hit may have near the camera, as a share of the coordinates.
const NEAR: f64 = 1.0 / (1_u64 << 40) as f64;
/// How far behind a place where the sign of the field is not known it is looked for, as a share of
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
    let start = asker.value(ray, 0.0, &whole);
    if start.contains(0.0) {
        let here = Outcome::Undecided {
            t0: 0.0,
            t1: 0.0,
            why: Why::Start,
        };
        return (here, false);
    }
    let inside = start.hi < 0.0;
    let mut search = Search {
        asker,
        ray,
        far,
        options,
        side: if inside { -1.0 } else { 1.0 },
    };
    (search.run(whole), inside)
}

/// What a segment turned out to be.
enum Verdict {
    Empty,
    Root(Interval),
    /// Only this part of it may hold a root.
    Open(Interval),
}

impl Search<'_, '_> {
    fn run(&mut self, whole: Part) -> Outcome {
        let budget = self.asker.evaluations + u64::from(self.options.evaluations);
        let mut stack = vec![Segment {
            t: Interval::between(0.0, self.far),
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
            let open = if whole {
                match self.trimmed(t, &part) {
                    Verdict::Empty => continue,
                    Verdict::Root(root) if root.hi - root.lo <= self.widest(root.lo) => {
                        return Outcome::Hit {
                            t0: root.lo,
                            t1: root.hi,
                        };
                    }
                    Verdict::Root(root) => return touching(root),
                    Verdict::Open(open) => open,
                }
            } else if self.asker.explored(self.ray, t, &part).contains(0.0) {
                t
            } else {
                continue;
            };
            let middle = open.lo + (open.hi - open.lo) / 2.0;
            if open.hi - open.lo <= self.finest(open.hi) {
                return self.at_the_finest(open);
            }
            if open.hi - open.lo < (t.hi - t.lo) / 2.0 {
                stack.push(Segment { t: open, part });
                continue;
            }
            for (lo, hi) in [(middle, open.hi), (open.lo, middle)] {
                let t = Interval { lo, hi };
                let part = part.clone();
                stack.push(Segment { t, part });
            }
        }
        Outcome::Miss
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

    /// What a segment is that cannot be halved: a hit if the field has the other sign close behind
    /// it.
    fn at_the_finest(&mut self, t: Interval) -> Outcome {
        let whole = self.asker.whole();
        let mut width = self.finest(t.hi);
        while width < self.size(t.hi) * VAGUEST {
            let t1 = (t.lo + width).min(self.far);
            let value = self.value(t1, &whole);
            let is_narrow = width <= self.widest(t.lo);
            if value.hi < 0.0 && is_narrow {
                return Outcome::Hit { t0: t.lo, t1 };
            }
            // Up to here the sign is not known, and behind it is. Where it is still the first one so
            // near, it may well change a little farther on.
            if !value.contains(0.0) && t1 > t.hi && !is_narrow {
                return touching(Interval { lo: t.lo, hi: t1 });
            }
            width *= 2.0;
        }
        touching(t)
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

/// A guess where a ray ends that spent its budget at `t`: plain steps in `f64`.
pub(super) fn guess(asker: &mut Asker<'_>, ray: &Ray, from: f64, far: f64) -> Option<f64> {
    let field = asker.field();
    let step = 1.0 / field.slope().max(f64::MIN_POSITIVE);
    let mut t = from;
    for _ in 0..GUESS_STEPS {
        let distance = field.distance(ray.at(t)).abs();
        asker.evaluations += 1;
        if distance.is_nan() || t > far {
            return None;
        }
        if distance <= 1e-9 * t {
            return Some(t);
        }
        t += distance * step;
    }
    Some(t)
}

/// The most steps of a guess.
const GUESS_STEPS: usize = 4_096;
