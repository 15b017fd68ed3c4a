//! Which way the surface faces at a hit, by duals of `f64`, and whether that is known there.

use super::field::Field;

/// The cosine of the largest angle, 0.1°, by which directions next to a hit may differ from its own;
/// more, so near, are several faces.
const ALIKE: f64 = 0.999_998_4;
/// The cosine of the angle, 5°, by which a surface may turn over half a pixel without having an edge
/// there.
const BEND: f64 = 0.996_194_7;

/// The direction of the gradient at a hit at `p`, turned to the side of the ray; `None` where it is
/// zero or not finite, or where there are several within `near`.
pub(super) fn normal(field: &Field, p: [f64; 3], near: f64, side: f64) -> Option<[f64; 3]> {
    let gradient = field.gradient(p);
    let size = length(gradient);
    if !(size > 1e-30 && size < 1e30) {
        return None;
    }
    let normal = gradient.map(|v| v * side / size);
    (!turns(field, p, normal, near, ALIKE)).then_some(normal)
}

/// The direction of the gradient at a point where no normal is proved, turned to the side of the ray; the direction back
/// along the ray where that is none, or faces away from the eye.
pub(super) fn likely(field: &Field, p: [f64; 3], direction: [f64; 3], side: f64) -> [f64; 3] {
    let gradient = field.gradient(p).map(|v| v * side);
    let size = length(gradient);
    let faces_eye = dot(gradient, direction) < 0.0;
    match faces_eye && size > 1e-30 && size < 1e30 {
        true => gradient.map(|v| v / size),
        false => direction.map(|v| -v),
    }
}

/// Whether the surface has an edge within half a pixel, `half`, of a hit at `p`.
pub(super) fn is_at_edge(field: &Field, p: [f64; 3], normal: [f64; 3], half: f64) -> bool {
    turns(field, p, normal, half, BEND)
}

/// Whether the gradient has another direction at one of eight places around `p` in the tangent
/// plane: one whose angle with the normal has a smaller cosine.
fn turns(field: &Field, p: [f64; 3], normal: [f64; 3], reach: f64, cosine: f64) -> bool {
    let smallest = (0..3).min_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs()));
    let mut axis = [0.0; 3];
    axis[smallest.unwrap_or(0)] = 1.0;
    let u = cross(normal, axis);
    let u = u.map(|v| v / length(u));
    let v = cross(normal, u);
    (0..8).any(|i| {
        let (sin, cos) = (f64::from(i) * std::f64::consts::FRAC_PI_4).sin_cos();
        let near = std::array::from_fn(|axis| p[axis] + reach * (u[axis] * cos + v[axis] * sin));
        let gradient = field.gradient(near);
        let along = dot(gradient, normal).abs();
        // What is not a number is no direction either.
        !(along >= cosine * length(gradient) && length(gradient) > 0.0)
    })
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
fn length(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}
