//! Cross sections of an extension: points whose convex hull contains it.

use super::{AffineRows, TOUCH_TOLERANCE, compose};
use crate::analysis::bounds::inverse;
use crate::scene::{Scene, ShapeId, ShapeKind};
use glam::{DVec2, DVec3};

/// Number of corners of a polygon circumscribed about a circle.
const CIRCUMSCRIBED_CORNERS: u32 = 16;

/// A cross section in the frame of a part.
#[derive(Clone)]
pub(super) struct Section {
    /// Corners, or a point of the rim.
    pub(super) points: Vec<DVec3>,
    /// True for a disc about the y axis of the region's frame.
    pub(super) is_round: bool,
    /// True for a section of a 2-D shape.
    pub(super) is_2d: bool,
}

impl Section {
    /// Returns the corners of the section at a fraction of the way to another one. They are inset by the touch
    /// tolerance, so that rounding leaves no doubt.
    pub(super) fn inset_between(&self, other: &Self, fraction: f64) -> Vec<DVec3> {
        let pairs = self.points.iter().zip(&other.points);
        let corners: Vec<DVec3> = pairs.map(|(&a, &b)| a + (b - a) * fraction).collect();
        let centre = match (self.is_round, corners.first()) {
            (true, Some(corner)) => DVec3::new(0.0, corner.y, 0.0),
            _ => corners.iter().sum::<DVec3>() / corners.len() as f64,
        };
        let inset_corner = |corner: DVec3| corner + (centre - corner) * TOUCH_TOLERANCE;
        corners.into_iter().map(inset_corner).collect()
    }
}

/// Returns the corners of a polygon circumscribed about the circle through a point about the y axis.
pub(super) fn circumscribed_polygon(point: DVec3) -> Vec<DVec3> {
    let half = std::f64::consts::PI / f64::from(CIRCUMSCRIBED_CORNERS);
    let radius = point.x.hypot(point.z) / half.cos();
    let corner = |i: u32| {
        let (sin, cos) = (2.0 * half * f64::from(i)).sin_cos();
        DVec3::new(radius * cos, point.y, radius * sin)
    };
    (0..CIRCUMSCRIBED_CORNERS).map(corner).collect()
}

/// Applies an affine map to a point.
pub(super) fn transform_point(rows: &AffineRows, p: DVec3) -> DVec3 {
    rows.map(|[x, y, z, shift]| DVec3::new(x, y, z).dot(p) + shift)
        .into()
}

/// Returns the corners of a polygon within frames, in the outermost frame.
pub(super) fn outline(scene: &Scene, id: ShapeId) -> Option<Vec<DVec3>> {
    let mut rows = super::IDENTITY;
    let mut id = id;
    loop {
        match &scene.shapes[id.0 as usize].kind {
            ShapeKind::Painted { child, .. } => id = *child,
            ShapeKind::Frame { child, matrix, .. } => {
                let constant = |id| scene.expressions.as_constant(id);
                let matrix: Option<Vec<f64>> = matrix.iter().map(|&id| constant(id)).collect();
                rows = compose(&rows, &inverse(&matrix?)?);
                id = *child;
            }
            ShapeKind::Polygon { .. } => {
                let corners = corners(scene, id)?;
                let to_outer = |corner: DVec2| transform_point(&rows, corner.extend(0.0));
                return Some(corners.into_iter().map(to_outer).collect());
            }
            _ => return None,
        }
    }
}

/// Returns the corners of a polygon, if all are constant.
pub(super) fn corners(scene: &Scene, id: ShapeId) -> Option<Vec<DVec2>> {
    let ShapeKind::Polygon { points } = &scene.shapes[id.0 as usize].kind else {
        return None;
    };
    let constant = |id| scene.expressions.as_constant(id);
    let corner = |[x, y]: &[_; 2]| Some(DVec2::new(constant(*x)?, constant(*y)?));
    points.iter().map(corner).collect()
}
