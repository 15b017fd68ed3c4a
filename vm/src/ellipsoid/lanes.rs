//! The distance to an ellipsoid, its gradient and its bounds over lanes.

use super::interval::{corners, over_by};
use super::{MAX_STEPS, NormalVector, NormalizedEllipsoid, Search, facing, lengths};
use crate::dual::Dual;
use crate::interval::FloatInterval;
use crate::lanes::{F32x64, LaneNumber, Points, for_each_lane};
use crate::real::Vector3;
use crate::vector::V3;

/// Computes the distance in the first `count` lanes, with the same values as [`ellipsoid`].
#[inline(always)]
pub(crate) fn in_lanes(p: &Points, r: V3<f32>, count: usize, out: &mut F32x64) {
    let r = lengths::<f32>(r);
    let ellipsoid = NormalizedEllipsoid::<f32>::new(V3::splat(0.0), r);
    let point = |lane| f32::load_point(p, lane).abs();
    let mut t = F32x64::default();
    ellipsoid.multipliers(point, count, &mut t);
    let mut v = Points::default();
    let mut lack = F32x64::default();
    let mut lacks = 0;
    for_each_lane!(count, lane => {
        let short = ellipsoid.with_point(point(lane)).normal_vector(t.0[lane]);
        v[0].0[lane] = short.v.x;
        v[1].0[lane] = short.v.y;
        v[2].0[lane] = short.v.z;
        lack.0[lane] = short.deficit;
        lacks |= u32::from(short.deficit > 0.0);
    });
    let short = |lane: usize| NormalVector {
        v: V3::new(v[0].0[lane], v[1].0[lane], v[2].0[lane]),
        deficit: lack.0[lane],
    };
    // Only points deep inside have a lack, and completing their vectors takes two more roots.
    if lacks == 0 {
        for_each_lane!(count, lane => {
            let nearest = ellipsoid.nearest_along(short(lane));
            out.0[lane] = point(lane).dot(nearest.normal) - nearest.support;
        });
    } else {
        for_each_lane!(count, lane => {
            let nearest = ellipsoid.completed(short(lane));
            out.0[lane] = point(lane).dot(nearest.normal) - nearest.support;
        });
    }
}

/// Computes the distance and its gradient in the first `count` lanes, with the same values as
/// [`ellipsoid`].
#[inline(always)]
pub(crate) fn gradients_in_lanes(
    p: &<Dual<f32> as LaneNumber>::PointBlock,
    r: V3<f32>,
    count: usize,
    out: &mut <Dual<f32> as LaneNumber>::Block,
) {
    let r = lengths::<f32>(r);
    let ellipsoid = NormalizedEllipsoid::<f32>::new(V3::splat(0.0), r);
    let point = |lane| Dual::<f32>::load_point(p, lane);
    let mut t = F32x64::default();
    ellipsoid.multipliers(|lane| point(lane).value.abs(), count, &mut t);
    for_each_lane!(count, lane => {
        let p = point(lane);
        let q = p.value.abs();
        let nearest = ellipsoid.with_point(q).nearest(t.0[lane]);
        let value = q.dot(nearest.normal) - nearest.support;
        let gradient = p.along(facing::<f32>(p.value, nearest.normal));
        Dual { value, gradient }.store(out, lane);
    });
}

/// Computes bounds of the distance in the first `count` lanes.
#[inline(always)]
pub(crate) fn bounds_in_lanes(
    p: &<FloatInterval as LaneNumber>::PointBlock,
    r: V3<FloatInterval>,
    count: usize,
    out: &mut <FloatInterval as LaneNumber>::Block,
) {
    let radii = lengths::<f32>(V3::new(r.x.lo, r.y.lo, r.z.lo));
    let ellipsoid = NormalizedEllipsoid::<f32>::new(V3::splat(0.0), radii);
    let point = |lane| FloatInterval::load_point(p, lane);
    let [mut first, mut last] = [F32x64::default(); 2];
    ellipsoid.multipliers(|lane| corners(point(lane))[0], count, &mut first);
    ellipsoid.multipliers(|lane| corners(point(lane))[1], count, &mut last);
    for_each_lane!(count, lane => {
        over_by(point(lane), r, [first.0[lane], last.0[lane]]).0.store(out, lane);
    });
}

impl NormalizedEllipsoid<f32> {
    /// Computes the `t` of the nearest points in the first `count` lanes, with one step of all lanes at a
    /// time. A step depends on the previous one, so several lanes at once take no longer than one. Ends
    /// after the last lane's last step.
    #[inline(always)]
    fn multipliers(&self, q: impl Fn(usize) -> V3<f32>, count: usize, t: &mut F32x64) {
        let mut a = Points::default();
        let [mut low, mut high, mut goes_on] = [F32x64::default(); 3];
        for_each_lane!(count, lane => {
            let (search, first) = self.with_point(q(lane)).search();
            a[0].0[lane] = search.a.x;
            a[1].0[lane] = search.a.y;
            a[2].0[lane] = search.a.z;
            low.0[lane] = search.low;
            high.0[lane] = search.high;
            t.0[lane] = first;
            goes_on.0[lane] = 1.0;
        });
        for _ in 0..MAX_STEPS {
            let mut open = 0;
            for_each_lane!(count, lane => {
                let search = Search {
                    a: V3::new(a[0].0[lane], a[1].0[lane], a[2].0[lane]),
                    low: low.0[lane],
                    high: high.0[lane],
                };
                let last = t.0[lane];
                let next = self.step(&search, last);
                let is_open = goes_on.0[lane] > 0.0;
                t.0[lane] = if is_open { next } else { last };
                let still = is_open & self.needs_step(last, next);
                goes_on.0[lane] = if still { 1.0 } else { 0.0 };
                open |= u32::from(still);
            });
            if open == 0 {
                break;
            }
        }
    }
}
