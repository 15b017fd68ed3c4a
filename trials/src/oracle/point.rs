//! Points, and the distances from them to points, segments and triangles.

/// A point or a vector of space.
pub(super) type Point = [f64; 3];
/// A point of a plane.
pub(super) type Flat = [f64; 2];

/// The sum of products.
pub(super) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The vector across both.
pub(super) fn cross(a: Point, b: Point) -> Point {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// The vector from the second point to the first.
pub(super) fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The point that is `by` times the vector away.
pub(super) fn beyond(p: Point, vector: Point, by: f64) -> Point {
    [
        p[0] + vector[0] * by,
        p[1] + vector[1] * by,
        p[2] + vector[2] * by,
    ]
}

/// The length of a vector.
pub(super) fn norm(a: Point) -> f64 {
    dot(a, a).sqrt()
}

/// The length of a vector of the plane.
pub(super) fn norm2(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

/// The largest magnitude of the coordinates.
pub(super) fn magnitude(a: Point) -> f64 {
    a[0].abs().max(a[1].abs()).max(a[2].abs())
}

/// Two directions across a vector and across each other, of length one.
pub(super) fn across(vector: Point) -> [Point; 2] {
    let least = (0..3).min_by(|&i, &j| vector[i].abs().total_cmp(&vector[j].abs()));
    let mut axis = [0.0; 3];
    axis[least.unwrap_or(0)] = 1.0;
    let unit = |v: Point| {
        let length = norm(v).max(f64::MIN_POSITIVE);
        v.map(|x| x / length)
    };
    let first = unit(cross(vector, axis));
    [first, unit(cross(vector, first))]
}

/// The distance to a segment of the plane.
pub(super) fn to_flat_segment(q: Flat, a: Flat, b: Flat) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let square = along[0] * along[0] + along[1] * along[1];
    let from = [q[0] - a[0], q[1] - a[1]];
    let share = if square > 0.0 {
        ((from[0] * along[0] + from[1] * along[1]) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    norm2(from[0] - share * along[0], from[1] - share * along[1])
}

/// The distance to a segment of space.
pub(super) fn to_segment(p: Point, a: Point, b: Point) -> f64 {
    let (along, from) = (minus(b, a), minus(p, a));
    let square = dot(along, along);
    let share = if square > 0.0 {
        (dot(from, along) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    norm(beyond(from, along, -share))
}

/// The distance to a triangle.
pub(super) fn to_triangle(p: Point, corners: [Point; 3]) -> f64 {
    let [a, b, c] = corners;
    let normal = cross(minus(b, a), minus(c, a));
    let length = norm(normal);
    let is_left = |a: Point, b: Point| dot(cross(normal, minus(b, a)), minus(p, a)) >= 0.0;
    if length > 0.0 && is_left(a, b) && is_left(b, c) && is_left(c, a) {
        return dot(normal, minus(p, a)).abs() / length;
    }
    to_segment(p, a, b)
        .min(to_segment(p, b, c))
        .min(to_segment(p, c, a))
}
