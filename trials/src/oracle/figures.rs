//! Figures of the plane: signed distances by the nearest point of the outline.

use super::extent::Extent;
use super::point::{Flat, Point, norm2, to_flat_segment};
use super::solids::{Body, Leaf};
use sdfc_vm::table::Op;

/// The figure of a row, if it is one.
pub(super) fn figure(op: Op, k: &[f64]) -> Option<Leaf> {
    let upright = |x: f64, y: f64| Extent::centred([x, y, f64::INFINITY]);
    let mut numbers = k.to_vec();
    let (body, extent): (Body, Extent) = match op {
        Op::Circle => (|k, p| norm2(p[0], p[1]) - k[0], upright(k[0], k[0])),
        Op::Rect => (
            |k, p| to_rectangle([k[0], k[1]], [p[0], p[1]]),
            upright(k[0], k[1]),
        ),
        Op::RoundedRect => (
            |k, p| to_rectangle([k[0] - k[2], k[1] - k[2]], [p[0], p[1]]) - k[2],
            upright(k[0], k[1]),
        ),
        Op::Segment => (segment, {
            let ends = [0, 1].map(|i| [k[i], k[i] + k[2 + i]]);
            let low = ends.map(|[a, b]| a.min(b) - k[5]);
            let high = ends.map(|[a, b]| a.max(b) + k[5]);
            Extent {
                low: [low[0], low[1], f64::NEG_INFINITY],
                high: [high[0], high[1], f64::INFINITY],
                rate: 1.0,
            }
        }),
        Op::Ngon => (|k, p| regular_polygon(k, [p[1], p[0]]), {
            let wide = norm2(k[2], k[3]);
            upright(wide, wide)
        }),
        Op::Star => {
            // The corner beside a tip: the side leads there, across its normal.
            let corner = [k[2] - k[3] * k[5], k[3] * k[4]];
            numbers = vec![k[0], k[2], corner[0], corner[1]];
            let wide = k[2].max(norm2(corner[0], corner[1]));
            (star, upright(wide, wide))
        }
        _ => return None,
    };
    Some(Leaf {
        body,
        numbers,
        extent,
        steepness: 1.0,
    })
}

/// The polygon with these corners, in order.
///
/// From a point inside, a line to the right crosses an odd number of sides.
pub(super) fn polygon(points: &[Flat]) -> Leaf {
    let mut extent = Extent {
        low: [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY],
        high: [f64::NEG_INFINITY, f64::NEG_INFINITY, f64::INFINITY],
        rate: 1.0,
    };
    for point in points {
        for (axis, &v) in point.iter().enumerate() {
            extent.low[axis] = extent.low[axis].min(v);
            extent.high[axis] = extent.high[axis].max(v);
        }
    }
    Leaf {
        body: outline,
        numbers: points.as_flattened().to_vec(),
        extent,
        steepness: 1.0,
    }
}

/// The signed distance to a rectangle of these half sizes.
///
/// The first coordinate may also be a radius, and the second a height.
pub(super) fn to_rectangle(half: Flat, q: Flat) -> f64 {
    let x = q[0].abs() - half[0];
    let y = q[1].abs() - half[1];
    if x > 0.0 && y > 0.0 {
        norm2(x, y)
    } else {
        x.max(y)
    }
}

fn segment(k: &[f64], p: Point) -> f64 {
    let start = [k[0], k[1]];
    to_flat_segment([p[0], p[1]], start, [k[0] + k[2], k[1] + k[3]]) - k[5]
}

/// The signed distance to a regular polygon with a corner on the first axis.
///
/// `k` holds the angle of a side, its inverse, the distance of a side, and half its length.
pub(super) fn regular_polygon(k: &[f64], q: Flat) -> f64 {
    let (sector, apothem, side) = (k[0], k[2], k[3]);
    let direction = ((q[1].atan2(q[0]) / sector).floor() + 0.5) * sector;
    let (sine, cosine) = direction.sin_cos();
    let out = q[0] * cosine + q[1] * sine - apothem;
    let past = (q[1] * cosine - q[0] * sine).abs() - side;
    if out > 0.0 && past > 0.0 {
        norm2(out, past)
    } else {
        out
    }
}

/// `k` holds the angle of a tip, the distance of a tip and the corner beside it.
fn star(k: &[f64], p: Point) -> f64 {
    let (tip, corner) = ([k[1], 0.0], [k[2], k[3]]);
    // From the +y axis to the nearest tip, and there to the side of the corner.
    let angle = p[0].atan2(p[1]);
    let folded = (angle - (angle / k[0]).round() * k[0]).abs();
    let radius = norm2(p[0], p[1]);
    let q = [radius * folded.cos(), radius * folded.sin()];
    let distance = to_flat_segment(q, tip, corner);
    let along = [corner[0] - tip[0], corner[1] - tip[1]];
    let turn = |q: Flat| along[0] * (q[1] - tip[1]) - along[1] * (q[0] - tip[0]);
    // Inside is the side of the origin.
    let is_inside = turn(q) * turn([0.0, 0.0]) > 0.0;
    if is_inside { -distance } else { distance }
}

fn outline(k: &[f64], p: Point) -> f64 {
    let q = [p[0], p[1]];
    let (corners, _) = k.as_chunks::<2>();
    let mut distance = f64::INFINITY;
    let mut is_inside = false;
    let mut a = corners.last().copied().unwrap_or([0.0; 2]);
    for &b in corners {
        distance = distance.min(to_flat_segment(q, a, b));
        if (a[1] > q[1]) != (b[1] > q[1]) {
            let x = a[0] + (b[0] - a[0]) * (q[1] - a[1]) / (b[1] - a[1]);
            is_inside ^= q[0] < x;
        }
        a = b;
    }
    if is_inside { -distance } else { distance }
}
