//! 2-D shapes: signed distances by the nearest point of the outline.

use super::influence_box::InfluenceBox;
use super::leaf_shape::{DistanceFn, LeafDistance, LeafShape};
use super::point::{Point, Point2, norm2, segment_distance_2d};
use sdfc_vm::table::Op;

/// Returns the 2-D shape of a row, or `None` for other rows.
pub(super) fn shape_2d(op: Op, k: &[f64]) -> Option<LeafShape> {
    let infinite_prism = |x: f64, y: f64| InfluenceBox::centred([x, y, f64::INFINITY]);
    let mut parameters = k.to_vec();
    let (distance, bounds): (DistanceFn, InfluenceBox) = match op {
        Op::Circle => (|k, p| norm2(p[0], p[1]) - k[0], infinite_prism(k[0], k[0])),
        Op::Rect => (
            |k, p| rectangle_distance([k[0], k[1]], [p[0], p[1]]),
            infinite_prism(k[0], k[1]),
        ),
        Op::RoundedRect => (
            |k, p| rectangle_distance([k[0] - k[2], k[1] - k[2]], [p[0], p[1]]) - k[2],
            infinite_prism(k[0], k[1]),
        ),
        Op::Segment => (segment_shape, {
            let ends = [0, 1].map(|i| [k[i], k[i] + k[2 + i]]);
            let low = ends.map(|[a, b]| a.min(b) - k[5]);
            let high = ends.map(|[a, b]| a.max(b) + k[5]);
            InfluenceBox {
                low: [low[0], low[1], f64::NEG_INFINITY],
                high: [high[0], high[1], f64::INFINITY],
                distance_ratio: 1.0,
            }
        }),
        Op::Ngon => (|k, p| regular_polygon(k, [p[1], p[0]]), {
            let radius = norm2(k[2], k[3]);
            infinite_prism(radius, radius)
        }),
        Op::Star => {
            // The inner corner next to a tip, reached along the side from there.
            let corner = [k[2] - k[3] * k[5], k[3] * k[4]];
            parameters = vec![k[0], k[2], corner[0], corner[1]];
            let radius = k[2].max(norm2(corner[0], corner[1]));
            (star, infinite_prism(radius, radius))
        }
        _ => return None,
    };
    Some(LeafShape {
        distance: LeafDistance::Own(distance),
        parameters,
        bounds,
        slope_bound: 1.0,
    })
}

/// Creates the polygon with these corners, in order.
///
/// A point is inside if a ray to the right crosses an odd number of sides.
pub(super) fn polygon(points: &[Point2]) -> LeafShape {
    let mut bounds = InfluenceBox {
        low: [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY],
        high: [f64::NEG_INFINITY, f64::NEG_INFINITY, f64::INFINITY],
        distance_ratio: 1.0,
    };
    for point in points {
        for (axis, &v) in point.iter().enumerate() {
            bounds.low[axis] = bounds.low[axis].min(v);
            bounds.high[axis] = bounds.high[axis].max(v);
        }
    }
    LeafShape {
        distance: LeafDistance::Own(polygon_distance),
        parameters: points.as_flattened().to_vec(),
        bounds,
        slope_bound: 1.0,
    }
}

/// Returns the signed distance to a rectangle of these half sizes.
///
/// The first coordinate may also be a radius, and the second a height.
pub(super) fn rectangle_distance(half: Point2, q: Point2) -> f64 {
    let x = q[0].abs() - half[0];
    let y = q[1].abs() - half[1];
    if x > 0.0 && y > 0.0 {
        norm2(x, y)
    } else {
        x.max(y)
    }
}

fn segment_shape(k: &[f64], p: Point) -> f64 {
    let start = [k[0], k[1]];
    segment_distance_2d([p[0], p[1]], start, [k[0] + k[2], k[1] + k[3]]) - k[5]
}

/// Returns the signed distance to a regular polygon with a corner on the first axis.
///
/// `k` holds the sector angle of a side, its inverse, the apothem, and half the length of a side.
pub(super) fn regular_polygon(k: &[f64], q: Point2) -> f64 {
    let (sector, apothem, side) = (k[0], k[2], k[3]);
    let direction = ((q[1].atan2(q[0]) / sector).floor() + 0.5) * sector;
    let (sine, cosine) = direction.sin_cos();
    let height = q[0] * cosine + q[1] * sine - apothem;
    let excess = (q[1] * cosine - q[0] * sine).abs() - side;
    if height > 0.0 && excess > 0.0 {
        norm2(height, excess)
    } else {
        height
    }
}

/// Returns the signed distance to a star. `k` holds the angle between tips, the distance of a tip, and the
/// inner corner next to it.
fn star(k: &[f64], p: Point) -> f64 {
    let (tip, corner) = ([k[1], 0.0], [k[2], k[3]]);
    // Angle from the nearest tip, measured from the +y axis and folded to the side of the inner corner.
    let angle = p[0].atan2(p[1]);
    let folded = (angle - (angle / k[0]).round() * k[0]).abs();
    let radius = norm2(p[0], p[1]);
    let q = [radius * folded.cos(), radius * folded.sin()];
    let distance = segment_distance_2d(q, tip, corner);
    let along = [corner[0] - tip[0], corner[1] - tip[1]];
    let turn = |q: Point2| along[0] * (q[1] - tip[1]) - along[1] * (q[0] - tip[0]);
    // The inside is on the origin's side.
    let is_inside = turn(q) * turn([0.0, 0.0]) > 0.0;
    if is_inside { -distance } else { distance }
}

fn polygon_distance(k: &[f64], p: Point) -> f64 {
    let q = [p[0], p[1]];
    let (corners, _) = k.as_chunks::<2>();
    let mut distance = f64::INFINITY;
    let mut is_inside = false;
    let mut a = corners.last().copied().unwrap_or([0.0; 2]);
    for &b in corners {
        distance = distance.min(segment_distance_2d(q, a, b));
        if (a[1] > q[1]) != (b[1] > q[1]) {
            let x = a[0] + (b[0] - a[0]) * (q[1] - a[1]) / (b[1] - a[1]);
            is_inside ^= q[0] < x;
        }
        a = b;
    }
    if is_inside { -distance } else { distance }
}
