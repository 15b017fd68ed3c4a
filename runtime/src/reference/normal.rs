//! Surface normals at hits, by duals of `f64`, and detection of edges.

use super::field::ReferenceField;
use glam::DVec3;

/// Cosine of the largest angle, 0.1°, between a hit's direction and those next to it. A larger angle so close
/// means several faces.
const MIN_SAME_DIRECTION_COSINE: f64 = 0.999_998_4;
/// Cosine of the angle, 5°, by which a surface may turn over half a pixel without an edge there.
const MIN_SMOOTH_COSINE: f64 = 0.996_194_7;

/// Returns the direction of the gradient at a hit at `p`, turned to the side of the ray. Returns `None` where
/// the gradient is zero or not finite, or has several directions within `radius`.
pub(super) fn normal(
    field: &ReferenceField,
    p: [f64; 3],
    radius: f64,
    side: f64,
) -> Option<[f64; 3]> {
    let gradient = DVec3::from(field.gradient(p));
    let size = gradient.length();
    if !(size > 1e-30 && size < 1e30) {
        return None;
    }
    let normal = (gradient * side / size).into();
    (!direction_varies(field, p, normal, radius, MIN_SAME_DIRECTION_COSINE)).then_some(normal)
}

/// Returns the direction of the gradient at a point without a proved normal, turned to the side of the ray.
/// Returns the direction back along the ray if there is none, or if it faces away from the camera.
pub(super) fn likely_normal(
    field: &ReferenceField,
    p: [f64; 3],
    direction: [f64; 3],
    side: f64,
) -> [f64; 3] {
    let gradient = DVec3::from(field.gradient(p)) * side;
    let size = gradient.length();
    let faces_camera = gradient.dot(direction.into()) < 0.0;
    match faces_camera && size > 1e-30 && size < 1e30 {
        true => (gradient / size).into(),
        false => direction.map(|v| -v),
    }
}

/// Reports whether the surface has an edge within half a pixel, `half`, of a hit at `p`.
pub(super) fn is_at_edge(field: &ReferenceField, p: [f64; 3], normal: [f64; 3], half: f64) -> bool {
    direction_varies(field, p, normal, half, MIN_SMOOTH_COSINE)
}

/// Reports whether the gradient has another direction at one of eight points around `p` in the tangent plane.
/// It does where its angle with the normal has a smaller cosine than `cosine`.
fn direction_varies(
    field: &ReferenceField,
    p: [f64; 3],
    normal: [f64; 3],
    radius: f64,
    cosine: f64,
) -> bool {
    let (p, normal) = (DVec3::from(p), DVec3::from(normal));
    let u = normal.cross(DVec3::AXES[normal.abs().min_position()]);
    let u = u / u.length();
    let v = normal.cross(u);
    (0..8).any(|i| {
        let (sin, cos) = (f64::from(i) * std::f64::consts::FRAC_PI_4).sin_cos();
        let neighbor = p + radius * (u * cos + v * sin);
        let gradient = DVec3::from(field.gradient(neighbor.into()));
        let projection = gradient.dot(normal).abs();
        // NaN is no direction either.
        !(projection >= cosine * gradient.length() && gradient.length() > 0.0)
    })
}
