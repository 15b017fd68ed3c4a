//! Cross sections of an extension: points whose convex hull contains it.

use super::{AffineRows, TOUCH_TOLERANCE, compose};
use crate::analysis::bounds::inverse;
use crate::scene::{Scene, ShapeId, ShapeKind};

/// Number of corners of a polygon circumscribed about a circle.
const CIRCUMSCRIBED_CORNERS: u32 = 16;

/// A cross section in the frame of a part.
#[derive(Clone)]
pub(super) struct Section {
    /// Corners, or a point of the rim.
    pub(super) points: Vec<[f64; 3]>,
    /// True for a disc about the y axis of the region's frame.
    pub(super) is_round: bool,
    /// True for a section of a 2-D shape.
    pub(super) is_plane: bool,
}

impl Section {
    /// Corners of the section at a fraction of the way to another one. They are inset by the touch tolerance,
    /// so that rounding leaves no doubt.
    pub(super) fn inset_between(&self, other: &Self, fraction: f64) -> Vec<[f64; 3]> {
        let interpolate = |(a, b): (&[f64; 3], &[f64; 3])| -> [f64; 3] {
            std::array::from_fn(|i| a[i] + (b[i] - a[i]) * fraction)
        };
        let corners: Vec<[f64; 3]> = self
            .points
            .iter()
            .zip(&other.points)
            .map(interpolate)
            .collect();
        let centre: [f64; 3] = match (self.is_round, corners.first()) {
            (true, Some(corner)) => [0.0, corner[1], 0.0],
            _ => std::array::from_fn(|i| {
                corners.iter().map(|corner| corner[i]).sum::<f64>() / corners.len() as f64
            }),
        };
        let inset_corner = |corner: [f64; 3]| {
            std::array::from_fn(|i| corner[i] + (centre[i] - corner[i]) * TOUCH_TOLERANCE)
        };
        corners.into_iter().map(inset_corner).collect()
    }
}

/// Corners of a polygon circumscribed about the circle through a point about the y axis.
pub(super) fn circumscribed_polygon(point: [f64; 3]) -> Vec<[f64; 3]> {
    let half = std::f64::consts::PI / f64::from(CIRCUMSCRIBED_CORNERS);
    let radius = point[0].hypot(point[2]) / half.cos();
    let corner = |i: u32| {
        let (sin, cos) = (2.0 * half * f64::from(i)).sin_cos();
        [radius * cos, point[1], radius * sin]
    };
    (0..CIRCUMSCRIBED_CORNERS).map(corner).collect()
}

/// Applies an affine map to a point.
pub(super) fn transform_point(rows: &AffineRows, p: [f64; 3]) -> [f64; 3] {
    rows.map(|row| row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3])
}

/// The corners of a polygon within frames, in the outermost frame.
pub(super) fn outline(scene: &Scene, id: ShapeId) -> Option<Vec<[f64; 3]>> {
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
                let to_outer = |[x, y]: [f64; 2]| transform_point(&rows, [x, y, 0.0]);
                return Some(corners.into_iter().map(to_outer).collect());
            }
            _ => return None,
        }
    }
}

/// The corners of a polygon, if all are constant.
pub(super) fn corners(scene: &Scene, id: ShapeId) -> Option<Vec<[f64; 2]>> {
    let ShapeKind::Polygon { points } = &scene.shapes[id.0 as usize].kind else {
        return None;
    };
    let constant = |id| scene.expressions.as_constant(id);
    let corner = |[x, y]: &[_; 2]| Some([constant(*x)?, constant(*y)?]);
    points.iter().map(corner).collect()
}
