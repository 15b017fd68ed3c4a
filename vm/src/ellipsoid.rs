//! The distance to an ellipsoid.
//!
//! The nearest point of the ellipsoid with the radii `r` to `p` is `r² p / (t + r²)` for the `t` at which that
//! point lies on the ellipsoid (D. Eberly, *Distance from a Point to an Ellipse, an Ellipsoid, or a
//! Hyperellipsoid*, 2013). Halley's steps find it on one over the norm of that point, which is concave and
//! nearly a line (M. Hebden, 1973). The first `t` is that of the tangent plane below `p`, so most points take
//! one step or two: a step is the last one where it changes no denominator by more than a fiftieth.
//!
//! The distance is then taken along the normal `n` there, as `p · n − |r n|`. Along any direction this is at most
//! the distance to a convex solid, inside and outside, and the error is the square of that of the direction. The
//! root in `|r n|` is that of a number near one, and taken as the tangent of the root there, which is no less.
//! So the value is a lower bound, however far the steps came. Of radii that differ by up to 1,000 to 1 it is
//! exact to rounding outside, and inside as deep as half of the smallest radius of curvature. Beside the
//! place where opposite sides are equally near it may be short by 0.2 % of the smallest radius. Of radii that
//! differ more it may be far short near a rim, by half of the distance at 10,000 to 1.

use crate::dual::Dual;
use crate::interval::{End, FloatInterval, IntervalOf};
use crate::lanes::{Column, Lane, Points, each_lane};
use crate::real::{Real, Vector3, lit};
use crate::vector::V3;

/// The most of Halley's steps.
const STEPS: usize = 6;
/// The largest change of `t + r²` by a last step, as a fraction of that for the smallest radius. A step leaves the
/// cube of the change before it, and the distance takes the square of that.
const SMALL_STEP: f64 = 0.02;
/// The least and the most that Newton's step is multiplied by.
const STEP_RANGE: [f64; 2] = [2.0 / 3.0, 3.0];
/// The least share of `r²` that `t + r²` is taken for.
const LEAST_SHARE: f64 = 1e-3;
/// The least radius that `t` is sought for, as a share of the largest.
const LEAST_RADIUS: f64 = 1e-6;
/// The exponent of the farthest point that `t` is sought for, in units of the largest radius. From there the nearest
/// point is in the direction of the centre but for rounding.
const FARTHEST: f64 = 20.0;
/// The largest exponent of an `f32`.
const LARGEST: f64 = 127.0;
/// The least norm of the nearest point by rounding: it is one.
const LEAST_NORM: f64 = 1.0 - 1e-6;
/// The most that the value may be short of the distance inside, as a fraction of the smallest radius.
const MOST_SHORT: f64 = 2e-3;
/// The same outside, as a fraction of the distance, where the radii differ more than [`STEADY`] to 1.
const SHORT_OUTSIDE: f64 = 0.99;
/// The ratio of radii up to which the value is the distance outside.
const STEADY: f64 = 1000.0;
/// The same in all cases for numbers of any precision, as a fraction of the distance and the largest radius: what
/// the last step leaves.
const LEFT_BY_STEPS: f64 = 1e-10;
/// The error of `t` where the steps come to an end, as a share of itself and the largest square.
const MULTIPLIER_ERROR: f64 = 4e-6;
/// The least number to divide by.
const LEAST: f64 = 1e-37;
/// The least length whose square is a number of `f32`, of vectors that have a direction.
const LEAST_LENGTH: f64 = 1e-18;

/// The distance and its gradient.
#[inline(always)]
pub fn ellipsoid<R: Real>(p: R::Vec3, r: R::Vec3) -> (R, R::Vec3) {
    let (q, r) = (p.abs().named("q"), lengths::<R>(r));
    let unit = Unit::<R>::of(q, r);
    let t = unit.multiplier();
    let nearest = unit.nearest(t);
    let normal = nearest.normal.named("normal");
    (q.dot(normal) - nearest.support, facing::<R>(p, normal))
}

/// The normal on the side of `p`, by that of the point with positive coordinates.
#[inline(always)]
fn facing<R: Real>(p: R::Vec3, normal: R::Vec3) -> R::Vec3 {
    let facing = |p: R, n: R| R::select(p.less(lit(0.0)), -n, n);
    R::Vec3::new(
        facing(p.x(), normal.x()),
        facing(p.y(), normal.y()),
        facing(p.z(), normal.z()),
    )
}

/// The distance in the first `count` lanes. The values are those of [`ellipsoid`], and so are those below.
#[inline(always)]
pub(crate) fn in_lanes(p: &Points, r: V3<f32>, count: usize, out: &mut Column) {
    let r = lengths::<f32>(r);
    let ellipsoid = Unit::<f32>::of(V3::splat(0.0), r);
    let at = |lane| f32::load_point(p, lane).abs();
    let mut t = Column::default();
    ellipsoid.multipliers(at, count, &mut t);
    let mut v = Points::default();
    let mut lack = Column::default();
    let mut lacks = 0;
    each_lane!(count, lane => {
        let short = ellipsoid.moved(at(lane)).short(t.0[lane]);
        v[0].0[lane] = short.v.x;
        v[1].0[lane] = short.v.y;
        v[2].0[lane] = short.v.z;
        lack.0[lane] = short.lack;
        lacks |= u32::from(short.lack > 0.0);
    });
    let short = |lane: usize| Short {
        v: V3::of(v[0].0[lane], v[1].0[lane], v[2].0[lane]),
        lack: lack.0[lane],
    };
    // Only deep inside does anything lack, and to find it takes two roots.
    if lacks == 0 {
        each_lane!(count, lane => {
            let nearest = ellipsoid.on_surface(short(lane));
            out.0[lane] = at(lane).dot(nearest.normal) - nearest.support;
        });
    } else {
        each_lane!(count, lane => {
            let nearest = ellipsoid.lengthened(short(lane));
            out.0[lane] = at(lane).dot(nearest.normal) - nearest.support;
        });
    }
}

/// The distance and its gradient in the first `count` lanes.
#[inline(always)]
pub(crate) fn gradients_in_lanes(
    p: &<Dual<f32> as Lane>::PointBlock,
    r: V3<f32>,
    count: usize,
    out: &mut <Dual<f32> as Lane>::Block,
) {
    let r = lengths::<f32>(r);
    let ellipsoid = Unit::<f32>::of(V3::splat(0.0), r);
    let at = |lane| Dual::<f32>::load_point(p, lane);
    let mut t = Column::default();
    ellipsoid.multipliers(|lane| at(lane).value.abs(), count, &mut t);
    each_lane!(count, lane => {
        let p = at(lane);
        let q = p.value.abs();
        let nearest = ellipsoid.moved(q).nearest(t.0[lane]);
        let value = q.dot(nearest.normal) - nearest.support;
        let gradient = p.along(facing::<f32>(p.value, nearest.normal));
        Dual { value, gradient }.store(out, lane);
    });
}

/// Bounds of the distance in the first `count` lanes.
#[inline(always)]
pub(crate) fn bounds_in_lanes(
    p: &<FloatInterval as Lane>::PointBlock,
    r: V3<FloatInterval>,
    count: usize,
    out: &mut <FloatInterval as Lane>::Block,
) {
    let radii = lengths::<f32>(V3::of(r.x.lo, r.y.lo, r.z.lo));
    let ellipsoid = Unit::<f32>::of(V3::splat(0.0), radii);
    let at = |lane| FloatInterval::load_point(p, lane);
    let [mut first, mut last] = [Column::default(); 2];
    ellipsoid.multipliers(|lane| corners(at(lane))[0], count, &mut first);
    ellipsoid.multipliers(|lane| corners(at(lane))[1], count, &mut last);
    each_lane!(count, lane => {
        over_by(at(lane), r, [first.0[lane], last.0[lane]]).0.store(out, lane);
    });
}

/// Radii, none of them zero.
#[inline(always)]
fn lengths<R: Real>(r: R::Vec3) -> R::Vec3 {
    r.abs().max(R::Vec3::splat(lit(1e-12))).named("lengths")
}

/// The sum of the components.
#[inline(always)]
fn sum<R: Real>(a: R::Vec3) -> R {
    a.x() + a.y() + a.z()
}

#[inline(always)]
fn least<R: Real>(r: R::Vec3) -> R {
    r.x().min(r.y()).min(r.z())
}

/// A point with positive coordinates and an ellipsoid, in units of the largest radius.
#[derive(Clone, Copy)]
struct Unit<R: Real> {
    /// The point.
    q: R::Vec3,
    /// The radii.
    r: R::Vec3,
    /// Their squares.
    squares: R::Vec3,
    /// One over the radii.
    inverse: R::Vec3,
    /// The square of the smallest radius.
    least: R,
    /// One over that.
    sharpness: R,
    /// The unit of before.
    scale: R,
    /// The largest radius, in that unit.
    largest: R,
}

/// A vector in the direction of the normal at a nearest point: the point over the squares of the radii.
#[derive(Clone, Copy)]
struct Short<R: Real> {
    /// The vector, without a component across a smallest radius that it lacks.
    v: R::Vec3,
    /// The difference of its squared norm to that of a nearest point; positive where it lacks something.
    lack: R,
}

/// A nearest point.
#[derive(Clone, Copy)]
struct Nearest<R: Real> {
    /// The unit normal there.
    normal: R::Vec3,
    /// The distance of the tangent plane there from the centre, or a little more.
    support: R,
}

/// The least and the most that `t` can be.
#[derive(Clone, Copy)]
struct Search<R: Real> {
    /// The radii times the point.
    a: R::Vec3,
    low: R,
    high: R,
}

impl Unit<f32> {
    /// The `t` of the nearest points in the first `count` lanes, by steps of all lanes before the next: a step
    /// waits for the one before, so several at once take no longer than one. Ends after the last lane's last step.
    #[inline(always)]
    fn multipliers(&self, q: impl Fn(usize) -> V3<f32>, count: usize, t: &mut Column) {
        let mut a = Points::default();
        let [mut low, mut high, mut goes_on] = [Column::default(); 3];
        each_lane!(count, lane => {
            let (search, first) = self.moved(q(lane)).search();
            a[0].0[lane] = search.a.x;
            a[1].0[lane] = search.a.y;
            a[2].0[lane] = search.a.z;
            low.0[lane] = search.low;
            high.0[lane] = search.high;
            t.0[lane] = first;
            goes_on.0[lane] = 1.0;
        });
        for _ in 0..STEPS {
            let mut open = 0;
            each_lane!(count, lane => {
                let search = Search {
                    a: V3::of(a[0].0[lane], a[1].0[lane], a[2].0[lane]),
                    low: low.0[lane],
                    high: high.0[lane],
                };
                let last = t.0[lane];
                let next = self.step(&search, last);
                let is_open = goes_on.0[lane] > 0.0;
                t.0[lane] = if is_open { next } else { last };
                let still = is_open & self.goes_on(last, next);
                goes_on.0[lane] = if still { 1.0 } else { 0.0 };
                open |= u32::from(still);
            });
            if open == 0 {
                break;
            }
        }
    }
}

impl<R: Real> Unit<R> {
    #[inline(always)]
    fn of(q: R::Vec3, r: R::Vec3) -> Self {
        let one = lit::<R>(1.0);
        let largest = r.max_component().named("largest");
        let scale = (one / largest).named("scale");
        let r = (r * scale).max(R::Vec3::splat(lit(LEAST_RADIUS)));
        let r = r.named("radii");
        let inverse = R::Vec3::new(one / r.x(), one / r.y(), one / r.z()).named("inverse");
        let smallest = least::<R>(r).named("smallest");
        let sharpest = inverse.max_component().named("sharpest");
        let unit = Self {
            q,
            r,
            squares: (r * r).named("squares"),
            inverse,
            least: smallest * smallest,
            sharpness: sharpest * sharpest,
            scale,
            largest,
        };
        unit.moved(q)
    }

    /// The same ellipsoid and another point, in the unit of before.
    #[inline(always)]
    fn moved(&self, q: R::Vec3) -> Self {
        // From far away the normal is the direction alone.
        let exponent = q.max_component().max(lit(LEAST)).exponent();
        let nearer = (lit::<R>(FARTHEST) - exponent).min(lit(LARGEST));
        Self {
            q: (q * self.scale.min(nearer.power_of_two())).named("place"),
            ..*self
        }
    }

    /// One over `t + r²`, which is kept above zero; by one division.
    #[inline(always)]
    fn shares(&self, t: R) -> R::Vec3 {
        let m = R::Vec3::splat(t) + self.squares;
        let m = m.max(self.squares * lit::<R>(LEAST_SHARE)).named("m");
        let others = R::Vec3::new(m.y() * m.z(), m.z() * m.x(), m.x() * m.y());
        let others = others.named("others");
        (others * (lit::<R>(1.0) / (m.x() * others.x()))).named("shares")
    }

    /// The range of the `t` of the nearest point, and a first one.
    #[inline(always)]
    fn search(&self) -> (Search<R>, R) {
        let one = lit::<R>(1.0);
        let a = (self.r * self.q).named("a");
        // No component of the nearest point, seen from a sphere, is larger than one.
        let low = (a - self.squares).max_component();
        let low = low.max(self.least * lit(LEAST_SHARE - 1.0)).named("low");
        // The sum is no less than the length.
        let high = (sum::<R>(a) - self.least).max(low).named("high");
        // The tangent plane of the ellipsoid that is as large as the point is far.
        let v = (self.q * self.inverse).named("seen");
        let w = (v * self.inverse).named("steepness");
        let (square, slope) = (v.dot(v).named("square"), w.dot(w));
        let tangent = (square.sqrt() - one) * (square / slope.max(lit(LEAST)));
        let first = tangent.max(low).min(high).named("t");
        (Search { a, low, high }, first)
    }

    /// The next `t` by one of Halley's steps.
    #[inline(always)]
    fn step(&self, search: &Search<R>, t: R) -> R {
        let shares = self.shares(t);
        let u = (search.a * shares).named("u");
        let w = (u * u).named("w");
        let norm = sum::<R>(w).named("norm");
        let steep = (w * shares).named("steep");
        let slope = sum::<R>(steep).named("slope");
        let bend = sum::<R>(steep * shares);
        let square = (slope * slope).named("square");
        // The root of the norm is `(1 + 3 norm) / (3 + norm)` near one, and the norm is three at most.
        let excess = (norm - lit::<R>(1.0)).named("excess");
        let whole = (square * (norm + lit::<R>(3.0))).named("whole");
        let [short, long] = STEP_RANGE;
        let divisor = (whole + excess * lit(3.0) * (square - norm * bend))
            .max(whole * lit(1.0 / long))
            .min(whole * lit(1.0 / short));
        let step = norm * slope * excess * lit(2.0) / divisor.max(lit(LEAST));
        (t + step).max(search.low).min(search.high).named("t")
    }

    /// Reports whether a step from `t` to `next` was long enough for another one.
    #[inline(always)]
    fn goes_on(&self, t: R, next: R) -> R::Bool {
        let small = (t.min(next) + self.least) * lit(SMALL_STEP);
        small.less((next - t).abs())
    }

    /// The `t` of the nearest point.
    #[inline(always)]
    fn multiplier(&self) -> R {
        let (search, first) = self.search();
        let mut t = self.step(&search, first);
        let mut goes_on = self.goes_on(first, t);
        for _ in 1..STEPS {
            let next = self.step(&search, t);
            let last = t;
            t = R::select(goes_on, next, last).named("t");
            goes_on = R::and(goes_on, self.goes_on(last, next));
        }
        t
    }

    /// The nearest point.
    #[inline(always)]
    fn nearest(&self, t: R) -> Nearest<R> {
        self.lengthened(self.short(t))
    }

    /// The vector in the direction of the normal, as far as the point tells it.
    #[inline(always)]
    fn short(&self, t: R) -> Short<R> {
        let v = (self.q * self.shares(t)).named("v");
        let u = (self.r * v).named("u");
        let lack = (lit::<R>(LEAST_NORM * LEAST_NORM) - u.dot(u)).named("lack");
        Short { v, lack }
    }

    /// The nearest point. Inside, beside the plane across a smallest radius, the norm lacks the component across that
    /// plane. Of several smallest radii it has the direction of the point among them.
    #[inline(always)]
    fn lengthened(&self, short: Short<R>) -> Nearest<R> {
        let Short { v, lack } = short;
        let across = (lack.max(lit(0.0)) * self.sharpness).named("across");
        // One along the axes of the smallest radius, and zero along the others.
        let (zero, one) = (lit::<R>(0.0), lit::<R>(1.0));
        let smallest = |square: R| R::select(self.least.less(square), zero, one);
        let (x, y) = (smallest(self.squares.x()), smallest(self.squares.y()));
        let axes = R::Vec3::new(x, y, smallest(self.squares.z())).named("axes");
        let first = R::Vec3::new(x, y * (one - x), (one - x) * (one - y)).named("first");
        let among = (v * axes).named("among");
        let known = among.length().named("known");
        let least = lit::<R>(LEAST_LENGTH);
        let direction = among * (one / known.max(least));
        let direction = R::Vec3::select(least.less(known), direction, first).named("direction");
        let longer = v + direction * ((known * known + across).sqrt() - known);
        self.on_surface(Short {
            v: R::Vec3::select(zero.less(lack), longer, v).named("longer"),
            lack,
        })
    }

    /// The nearest point by a vector that lacks nothing any more.
    #[inline(always)]
    fn on_surface(&self, Short { v, lack }: Short<R>) -> Nearest<R> {
        let one = lit::<R>(1.0);
        let inverse = (one / v.length().max(lit(1e-30))).named("inverse_length");
        // The least norm where it lacked something; else a tangent of the root, which is no less.
        let excess = (-lack).max(lit(0.0));
        let norm = (lit::<R>(LEAST_NORM) + excess * lit(0.5 / LEAST_NORM)).named("norm");
        Nearest {
            normal: v * inverse,
            support: norm * self.largest * inverse,
        }
    }
}

/// What the value may be short of the distance by, where that is `distance`.
#[inline(always)]
fn shortage<R: Real>(distance: R, r: R::Vec3) -> R {
    let (smallest, largest) = (least::<R>(r), r.max_component());
    // Where the surface is nearer than its centres of curvature the steps come to an end.
    let depth = (-distance).max(lit(0.0)) * largest / (smallest * smallest);
    let inside = smallest * lit(MOST_SHORT) * (depth * depth).min(lit(1.0));
    let is_steady = largest.less(smallest * lit(STEADY));
    let outside = distance.max(lit(0.0)) * R::select(is_steady, lit(0.0), lit(SHORT_OUTSIDE));
    let left = (distance.abs() + largest) * lit(LEFT_BY_STEPS);
    // A radius that is smaller than the least was taken for that.
    let thicker = largest * R::select(is_steady, lit(0.0), lit(LEAST_RADIUS));
    inside + outside + left + thicker
}

/// Bounds of the value over a box from those at the nearest and the farthest of its corners: the distance to a
/// convex solid with three planes of symmetry grows with each coordinate's magnitude. `error` is that of rounding.
pub fn between<R: Real>(near: R::Vec3, far: R::Vec3, r: R::Vec3, error: R) -> [R; 2] {
    let r = lengths::<R>(r);
    let low = ellipsoid::<R>(near, r).0;
    let high = ellipsoid::<R>(far, r).0;
    widened(low, high, r, error)
}

/// The value at a point with positive coordinates, by the `t` of its nearest point.
#[inline(always)]
fn value<R: Real>(q: R::Vec3, r: R::Vec3, t: R) -> R {
    let Nearest { normal, support } = Unit::<R>::of(q, r).nearest(t);
    q.dot(normal) - support
}

/// The corners of a box that are nearest to the centre and farthest from it, on the side of positive coordinates.
#[inline(always)]
fn corners<E: End>(p: V3<IntervalOf<E>>) -> [V3<E>; 2] {
    let q = p.abs();
    [
        V3::of(q.x.lo, q.y.lo, q.z.lo),
        V3::of(q.x.hi, q.y.hi, q.z.hi),
    ]
}

/// The values at the nearest and the farthest corner, and by how much the value may be short.
#[inline(always)]
fn widened<R: Real>(low: R, high: R, r: R::Vec3, error: R) -> [R; 2] {
    [
        low - shortage::<R>(low, r) - error,
        high + shortage::<R>(high, r) + error,
    ]
}

/// The value and its gradient over a box, for radii that are numbers.
#[inline(always)]
pub(crate) fn over<E: End>(
    p: V3<IntervalOf<E>>,
    r: V3<IntervalOf<E>>,
) -> (IntervalOf<E>, V3<IntervalOf<E>>) {
    let radii = lengths::<E>(V3::of(r.x.lo, r.y.lo, r.z.lo));
    let multiplier = |q: V3<E>| Unit::<E>::of(q, radii).multiplier();
    over_by(p, r, corners(p).map(multiplier))
}

/// The same by the `t` of the nearest points to the box's corners. It has no branches, so that loops over lanes become
/// SIMD.
#[inline(always)]
fn over_by<E: End>(
    p: V3<IntervalOf<E>>,
    r: V3<IntervalOf<E>>,
    [first, last]: [E; 2],
) -> (IntervalOf<E>, V3<IntervalOf<E>>) {
    let [near, far] = corners(p);
    let size = far.max_component();
    let same = |r: IntervalOf<E>| r.lo == r.hi;
    let is_known = same(r.x) & same(r.y) & same(r.z) & size.less(E::INFINITY);
    let r = lengths::<E>(V3::of(r.x.lo, r.y.lo, r.z.lo));
    let (low, high) = (value::<E>(near, r, first), value::<E>(far, r, last));
    let [low, high] = widened(low, high, r, E::distance_error(size + r.max_component()));
    let value = IntervalOf {
        lo: E::select(is_known, low, -E::INFINITY),
        hi: E::select(is_known, high, E::INFINITY),
    };
    let moved = |t: E, error: f64| t + (lit::<E>(1.0) + t.abs()) * lit(error);
    let first = moved(first, -MULTIPLIER_ERROR);
    let last = moved(last, MULTIPLIER_ERROR);
    // Beside the plane across the smallest radius the normal may have any direction.
    let Unit { squares, least, .. } = Unit::<E>::of(near, r);
    let is_told = is_known
        & (least * lit(-0.75)).less(first)
        & lit::<E>(1.0).less(least * lit(STEADY * STEADY));
    let zero = lit::<E>(0.0);
    // What rounding does to the quotients is far below the slack of the directions.
    let part = |p: IntervalOf<E>, square: E| {
        let (least, most) = (first + square, last + square);
        IntervalOf {
            lo: p.lo / E::select(p.lo.less(zero), least, most),
            hi: p.hi / E::select(p.hi.less(zero), most, least),
        }
    };
    let v = V3::of(
        part(p.x, squares.x),
        part(p.y, squares.y),
        part(p.z, squares.z),
    );
    let squared = |a: IntervalOf<E>| {
        let a = a.abs();
        (a.lo * a.lo, a.hi * a.hi)
    };
    let (x, y, z) = (squared(v.x), squared(v.y), squared(v.z));
    let component = |a: IntervalOf<E>, b: (E, E), c: (E, E)| {
        let rest = (b.0 + c.0, b.1 + c.1);
        // The component of a unit vector grows with the vector's, and shrinks with the others.
        let share = |a: E, rest: E| a / (a * a + rest).sqrt().max(lit(1e-30));
        let low = share(a.lo, E::select(a.lo.less(zero), rest.0, rest.1));
        let high = share(a.hi, E::select(a.hi.less(zero), rest.1, rest.0));
        let (slack, one) = (lit::<E>(1e-5), lit::<E>(1.0));
        IntervalOf {
            lo: E::select(is_told, (low - slack).max(-one), -one),
            hi: E::select(is_told, (high + slack).min(one), one),
        }
    };
    let gradient = V3::of(
        component(v.x, y, z),
        component(v.y, z, x),
        component(v.z, x, y),
    );
    (value, gradient)
}
