//! Vector arithmetic, and distances from points to segments and triangles.

/// Point or vector in space.
pub type Point = [f64; 3];
/// Point in a plane.
pub(super) type Point2 = [f64; 2];

/// Returns the dot product.
pub(super) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the cross product.
pub(super) fn cross(a: Point, b: Point) -> Point {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Returns the vector from `b` to `a`.
pub(super) fn subtract(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Returns the point at `factor` times the vector from `p`.
pub fn point_along(p: Point, vector: Point, factor: f64) -> Point {
    [
        p[0] + vector[0] * factor,
        p[1] + vector[1] * factor,
        p[2] + vector[2] * factor,
    ]
}

/// Returns the length of a vector.
pub fn norm(a: Point) -> f64 {
    dot(a, a).sqrt()
}

/// Returns the length of a 2-D vector.
pub(super) fn norm2(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

/// Returns the largest absolute value of the coordinates.
pub(super) fn max_coordinate(a: Point) -> f64 {
    a[0].abs().max(a[1].abs()).max(a[2].abs())
}

/// Returns two unit vectors perpendicular to a vector and to each other.
pub(super) fn orthonormal_pair(vector: Point) -> [Point; 2] {
    let smallest = (0..3).min_by(|&i, &j| vector[i].abs().total_cmp(&vector[j].abs()));
    let mut axis = [0.0; 3];
    axis[smallest.unwrap_or(0)] = 1.0;
    let unit = |v: Point| {
        let length = norm(v).max(f64::MIN_POSITIVE);
        v.map(|x| x / length)
    };
    let first = unit(cross(vector, axis));
    [first, unit(cross(vector, first))]
}

/// Returns the distance to a 2-D segment.
pub(super) fn segment_distance_2d(q: Point2, a: Point2, b: Point2) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let length_sq = along[0] * along[0] + along[1] * along[1];
    let from = [q[0] - a[0], q[1] - a[1]];
    let fraction = if length_sq > 0.0 {
        ((from[0] * along[0] + from[1] * along[1]) / length_sq).clamp(0.0, 1.0)
    } else {
        0.0
    };
    norm2(from[0] - fraction * along[0], from[1] - fraction * along[1])
}

/// Returns the distance to a 3-D segment.
pub(super) fn segment_distance(p: Point, a: Point, b: Point) -> f64 {
    let (along, from) = (subtract(b, a), subtract(p, a));
    let length_sq = dot(along, along);
    let fraction = if length_sq > 0.0 {
        (dot(from, along) / length_sq).clamp(0.0, 1.0)
    } else {
        0.0
    };
    norm(point_along(from, along, -fraction))
}

/// Returns the distance to a triangle.
pub(super) fn triangle_distance(p: Point, corners: [Point; 3]) -> f64 {
    let [a, b, c] = corners;
    let normal = cross(subtract(b, a), subtract(c, a));
    let length = norm(normal);
    let is_left = |a: Point, b: Point| dot(cross(normal, subtract(b, a)), subtract(p, a)) >= 0.0;
    if length > 0.0 && is_left(a, b) && is_left(b, c) && is_left(c, a) {
        return dot(normal, subtract(p, a)).abs() / length;
    }
    segment_distance(p, a, b)
        .min(segment_distance(p, b, c))
        .min(segment_distance(p, c, a))
}
