//! Cross sections of what a part grows by: their points, whose hull holds all of it.

use super::{Rows, TOUCHING, composed};
use crate::bounds::inverse;
use crate::scene::{Scene, ShapeId, ShapeKind};

/// The number of corners of a polygon around a circle.
const AROUND: u32 = 16;

/// A cross section in the frame of a part.
#[derive(Clone)]
pub(super) struct Section {
    /// Its corners, or a point of its rim.
    pub(super) points: Vec<[f64; 3]>,
    /// A disc around the y axis of the region's frame.
    pub(super) is_round: bool,
    /// A section of a figure in the plane.
    pub(super) is_plane: bool,
}

impl Section {
    /// Corners of the section between this one and another, a fraction on the way there. They stand inside by what
    /// counts as touching, where rounding leaves no doubt.
    pub(super) fn inset_between(&self, other: &Self, fraction: f64) -> Vec<[f64; 3]> {
        let mix = |(a, b): (&[f64; 3], &[f64; 3])| -> [f64; 3] {
            std::array::from_fn(|i| a[i] + (b[i] - a[i]) * fraction)
        };
        let corners: Vec<[f64; 3]> = self.points.iter().zip(&other.points).map(mix).collect();
        let middle: [f64; 3] = match (self.is_round, corners.first()) {
            (true, Some(corner)) => [0.0, corner[1], 0.0],
            _ => std::array::from_fn(|i| {
                corners.iter().map(|corner| corner[i]).sum::<f64>() / corners.len() as f64
            }),
        };
        let inset = |corner: [f64; 3]| {
            std::array::from_fn(|i| corner[i] + (middle[i] - corner[i]) * TOUCHING)
        };
        corners.into_iter().map(inset).collect()
    }
}

/// Corners of a polygon around the circle through a point around the y axis.
pub(super) fn around(point: [f64; 3]) -> Vec<[f64; 3]> {
    let half = std::f64::consts::PI / f64::from(AROUND);
    let radius = point[0].hypot(point[2]) / half.cos();
    let corner = |i: u32| {
        let (sin, cos) = (2.0 * half * f64::from(i)).sin_cos();
        [radius * cos, point[1], radius * sin]
    };
    (0..AROUND).map(corner).collect()
}

/// A point moved by rows.
pub(super) fn moved(rows: &Rows, p: [f64; 3]) -> [f64; 3] {
    rows.map(|row| row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3])
}

/// The corners of a polygon in frames, in the outermost one.
pub(super) fn outline(scene: &Scene, id: ShapeId) -> Option<Vec<[f64; 3]>> {
    let mut rows = super::SAME;
    let mut id = id;
    loop {
        match &scene.shapes[id.0 as usize].kind {
            ShapeKind::Painted { child, .. } => id = *child,
            ShapeKind::Frame { child, matrix, .. } => {
                let constant = |id| scene.expressions.as_constant(id);
                let matrix: Option<Vec<f64>> = matrix.iter().map(|&id| constant(id)).collect();
                rows = composed(&rows, &inverse(&matrix?)?);
                id = *child;
            }
            ShapeKind::Polygon { .. } => {
                let corners = corners(scene, id)?;
                let place = |[x, y]: [f64; 2]| moved(&rows, [x, y, 0.0]);
                return Some(corners.into_iter().map(place).collect());
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
