//! Ranges of a shape's values over boxes and rings of another frame.
//!
//! Maps between frames are composed first: the bounding box of a rotated box is larger than the box, even if
//! two rotations cancel. Solids of revolution about the axis of a ring are evaluated in its half plane, where
//! their walls are straight.

use super::section::{corners, transform_point};
use super::{AffineRows, IDENTITY, TOUCH_TOLERANCE, compose};
use crate::analysis::bounds::inverse;
use crate::analysis::shape_range::ShapeRange;
use crate::expression::ExprId;
use crate::scene::{NO_EDGE, Scene, SceneRef, ShapeId, ShapeKind};
use glam::{DVec2, DVec3};
use sdfc_vm::apply::{OpResult, apply, pack_parameters};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::real::{Real, Vector3};
use sdfc_vm::row::Exactness;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;

/// A set of points in a frame.
#[derive(Clone, Copy)]
pub(super) enum PointSet {
    /// A box.
    Box(Bounds),
    /// Radii, heights and angles of a piece of a ring about the y axis.
    Ring(Bounds),
}

impl PointSet {
    /// Returns the bounding box in space; that of a ring encloses its turn about the y axis.
    pub(super) fn bounds(&self) -> Bounds {
        match self {
            Self::Box(bounds) => *bounds,
            Self::Ring(ring) => {
                let [x, z] = [f64::cos as fn(f64) -> f64, f64::sin].map(|function| {
                    trig_range(
                        [ring.min[0], ring.max[0]],
                        [ring.min[2], ring.max[2]],
                        function,
                    )
                });
                Bounds {
                    min: [x[0], ring.min[1], z[0]],
                    max: [x[1], ring.max[1], z[1]],
                }
            }
        }
    }

    /// Returns the half plane of a ring, as a box without depth.
    pub(super) fn half_plane(ring: &Bounds) -> Bounds {
        Bounds {
            min: [ring.min[0], ring.min[1], 0.0],
            max: [ring.max[0], ring.max[1], 0.0],
        }
    }
}

/// Bounds a sine or cosine of angles, times radii.
fn trig_range(radii: [f64; 2], angles: [f64; 2], function: fn(f64) -> f64) -> [f64; 2] {
    // Sine and cosine have their extremes at multiples of a right angle.
    let quarters = (-2..=2).map(|quarter| f64::from(quarter) * std::f64::consts::FRAC_PI_2);
    let inside = quarters.filter(|angle| (angles[0]..=angles[1]).contains(angle));
    let values = angles.into_iter().chain(inside).map(function);
    let products = values.flat_map(|value| radii.map(|radius| radius * value));
    products.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| {
        [lo.min(v), hi.max(v)]
    })
}

/// Evaluates shapes through maps of points.
pub(super) struct MappedRange<'s, 'u> {
    scene: &'s Scene,
    pub(super) range: ShapeRange<'s, 'u>,
}

impl<'s, 'u> MappedRange<'s, 'u> {
    pub(super) fn new(scene: &'s Scene, uniform: &'u mut dyn FnMut(ExprId) -> Interval) -> Self {
        Self {
            scene,
            range: ShapeRange::new(SceneRef::from(scene), uniform),
        }
    }

    /// Bounds a shape's values; `rows` map from the frame of the set to the shape's. It recurses over nested
    /// shapes, whose depth the elaborator bounds.
    pub(super) fn over(&mut self, id: ShapeId, rows: &AffineRows, set: &PointSet) -> Interval {
        let scene = self.scene;
        self.range.operations += 1;
        match &scene.shapes[id.0 as usize].kind {
            ShapeKind::Painted { child, .. } => self.over(*child, rows, set),
            ShapeKind::Frame {
                child,
                matrix,
                scale,
            } => match (
                frame_rows(scene, matrix),
                scene.expressions.as_constant(*scale),
            ) {
                (Some(inner), Some(scale)) => {
                    let value = self.over(*child, &compose(&inner, rows), set);
                    value * Interval::point(scale)
                }
                _ => self.leaf(id, rows, set),
            },
            ShapeKind::Combine {
                op: op @ (Op::Union | Op::Intersection | Op::Subtraction),
                children,
                ..
            } => {
                let mut value = self.over(children[0], rows, set);
                for &child in &children[1..] {
                    let next = self.over(child, rows, set);
                    value = match op {
                        Op::Union => value.min(next),
                        Op::Intersection => value.max(next),
                        _ => value.max(-next),
                    };
                }
                value
            }
            ShapeKind::Distance {
                op: Op::Extrude,
                child,
                parameters,
            } => match scene.expressions.as_constant(parameters[0]) {
                Some(half) => self.extrusion_range(*child, half, rows, set),
                None => self.leaf(id, rows, set),
            },
            ShapeKind::Polygon { points } => {
                self.range.operations += points.len();
                let value = match set {
                    PointSet::Box(bounds) => corners(scene, id)
                        .and_then(|corners| polygon_sign_range(&corners, rows, bounds)),
                    PointSet::Ring(_) => None,
                };
                value.unwrap_or_else(|| self.leaf(id, rows, set))
            }
            _ => self.leaf(id, rows, set),
        }
    }

    /// Bounds an extrusion, with the signs of its profile's range and of the height.
    fn extrusion_range(
        &mut self,
        child: ShapeId,
        half: f64,
        rows: &AffineRows,
        set: &PointSet,
    ) -> Interval {
        let bounds = set.bounds().mapped(rows);
        let height = Interval {
            lo: bounds.min[2],
            hi: bounds.max[2],
        };
        let profile = self.over(child, rows, set);
        profile.max(height.abs() - Interval::point(half))
    }

    /// Returns an upper bound of the value of a shape at a point.
    pub(super) fn upper_bound_at(&mut self, id: ShapeId, p: DVec3) -> f64 {
        self.range
            .range_in_box(
                id,
                &Bounds {
                    min: p.into(),
                    max: p.into(),
                },
            )
            .hi
    }

    fn leaf(&mut self, id: ShapeId, rows: &AffineRows, set: &PointSet) -> Interval {
        if let PointSet::Ring(ring) = set
            && is_round(self.scene, id)
            && let Some(rows_2d) = half_plane_rows(rows)
        {
            return self
                .range
                .range_in_box(id, &PointSet::half_plane(ring).mapped(&rows_2d));
        }
        let rows = match is_round(self.scene, id) {
            true => without_y_rotation(rows).unwrap_or(*rows),
            false => *rows,
        };
        let value = self.range.range_in_box(id, &set.bounds().mapped(&rows));
        match set {
            PointSet::Box(bounds) => match self.supporting_plane_min(id, &rows, bounds) {
                Some(min) if min > value.lo => Interval {
                    lo: min.min(value.hi),
                    ..value
                },
                _ => value,
            },
            PointSet::Ring(_) => value,
        }
    }

    /// Returns the minimum in a box of the tangent plane of a convex solid's distance at the centre. It avoids the
    /// bounding box of a rotated box.
    fn supporting_plane_min(&self, id: ShapeId, rows: &AffineRows, bounds: &Bounds) -> Option<f64> {
        let ShapeKind::Primitive { op, parameters } = &self.scene.shapes[id.0 as usize].kind else {
            return None;
        };
        if op.row().facts.exactness != Exactness::Exact || !op.row().facts.is_convex {
            return None;
        }
        let constant = |&id| self.scene.expressions.as_constant(id);
        let numbers: Vec<f64> = parameters.iter().map(constant).collect::<Option<_>>()?;
        let centre = transform_point(rows, bounds.centre().into());
        if !centre.is_finite() {
            return None;
        }
        let coordinate = |axis: usize| {
            let mut gradient = [0.0; 3];
            gradient[axis] = 1.0;
            let [x, y, z] = gradient;
            Dual {
                value: centre[axis],
                gradient: V3::new(x, y, z),
            }
        };
        let point = Vector3::new(coordinate(0), coordinate(1), coordinate(2));
        let unused_operand = Dual {
            value: 0.0,
            gradient: V3::new(0.0, 0.0, 0.0),
        };
        let OpResult::Value(result) = apply(
            *op,
            point,
            [unused_operand; 3],
            &pack_parameters(*op, &numbers),
        ) else {
            return None;
        };
        let slopes = [result.gradient.x, result.gradient.y, result.gradient.z];
        let change = |axis: usize| {
            let derivative: f64 = (0..3).map(|row| slopes[row] * rows[row][axis]).sum();
            derivative.abs() * (bounds.max[axis] - bounds.min[axis]) / 2.0
        };
        let min = result.value - (0..3).map(change).sum::<f64>();
        min.is_finite().then_some(min)
    }
}

/// Returns a range with the sign of a polygon's values in a box: of one sign if no edge meets the box.
fn polygon_sign_range(corners: &[DVec2], rows: &AffineRows, bounds: &Bounds) -> Option<Interval> {
    let is_upright = [rows[0][2], rows[1][2], rows[2][0], rows[2][1]];
    if is_upright.iter().any(|&factor| factor != 0.0) {
        return None;
    }
    let inverse_rows = inverse(rows.as_flattened())?;
    let to_box_frame = |corner: &DVec2| transform_point(&inverse_rows, corner.extend(0.0));
    let corners: Vec<DVec3> = corners.iter().map(to_box_frame).collect();
    let centre = bounds.centre();
    let mut is_inside = false;
    for (index, &a) in corners.iter().enumerate() {
        let b = corners[(index + 1) % corners.len()];
        if segment_crosses_box(a, b, bounds) {
            return Some(Interval::ALL);
        }
        if (a.y > centre[1]) != (b.y > centre[1]) {
            let x = a.x + (b.x - a.x) * (centre[1] - a.y) / (b.y - a.y);
            is_inside ^= centre[0] < x;
        }
    }
    Some(match is_inside {
        true => Interval {
            lo: -NO_EDGE,
            hi: -f64::MIN_POSITIVE,
        },
        false => Interval {
            lo: 0.0,
            hi: NO_EDGE,
        },
    })
}

/// Reports whether a line segment meets a box in the plane.
fn segment_crosses_box(a: DVec3, b: DVec3, bounds: &Bounds) -> bool {
    let (mut first, mut last) = (0.0_f64, 1.0_f64);
    for axis in 0..2 {
        let (min, max, direction) = (bounds.min[axis], bounds.max[axis], b[axis] - a[axis]);
        if direction == 0.0 {
            if a[axis] < min || a[axis] > max {
                return false;
            }
            continue;
        }
        let ends = [(min - a[axis]) / direction, (max - a[axis]) / direction];
        first = first.max(ends[0].min(ends[1]));
        last = last.min(ends[0].max(ends[1]));
    }
    first <= last
}

/// Returns the map from outer to inner points of a frame with a constant matrix.
pub(super) fn frame_rows(scene: &Scene, matrix: &[ExprId; 12]) -> Option<AffineRows> {
    let mut rows = IDENTITY;
    for (index, &id) in matrix.iter().enumerate() {
        rows[index / 4][index % 4] = scene.expressions.as_constant(id)?;
    }
    Some(rows)
}

/// Returns the map without its rotation about the y axis, which preserves distances from the axis.
fn without_y_rotation(rows: &AffineRows) -> Option<AffineRows> {
    let [x, y, z] = rows;
    let zero = |value: f64| value.abs() <= TOUCH_TOLERANCE;
    let is_axis = [x[1], z[1], y[0], y[2]].into_iter().all(zero);
    let radial = x[0].hypot(z[0]);
    let uniformity = [x[0] * x[2] + z[0] * z[2], radial - x[2].hypot(z[2])];
    if !is_axis
        || radial <= 0.0
        || !uniformity
            .iter()
            .all(|v| v.abs() <= TOUCH_TOLERANCE * radial.max(1.0))
    {
        return None;
    }
    let shift = |column: usize| (x[column] * x[3] + z[column] * z[3]) / radial;
    Some([
        [radial, 0.0, 0.0, shift(0)],
        [0.0, y[1], 0.0, y[3]],
        [0.0, 0.0, radial, shift(2)],
    ])
}

/// Reports whether a shape is a solid of revolution about the y axis.
pub(super) fn is_round(scene: &Scene, id: ShapeId) -> bool {
    let (ShapeKind::Primitive { op, .. } | ShapeKind::Domain { op, .. }) =
        &scene.shapes[id.0 as usize].kind
    else {
        return false;
    };
    op.row().facts.axis_of_revolution == Some(1)
}

/// Returns the map of a ring's half plane that a map of space induces. It exists if the map of space maps the y
/// axis to itself and preserves angles about it.
pub(super) fn half_plane_rows(rows: &AffineRows) -> Option<AffineRows> {
    let axis_length = (0..3).fold(0.0, |max: f64, i| max.max(rows[1][i].abs()));
    let zero = |value: f64, unit: f64| value.abs() <= TOUCH_TOLERANCE * unit.max(1.0);
    let [x, y, z] = rows;
    let is_axis = [x[1], z[1], y[0], y[2]]
        .iter()
        .all(|&v| zero(v, axis_length));
    let is_centred = [x[3], z[3]].iter().all(|&v| zero(v, y[3].abs()));
    let radial = x[0].hypot(z[0]);
    let other = x[2].hypot(z[2]);
    let is_uniform =
        zero(radial - other, radial) && zero(x[0] * x[2] + z[0] * z[2], radial * radial);
    (is_axis && is_centred && is_uniform).then(|| {
        let mut half_plane_rows = IDENTITY;
        half_plane_rows[0] = [radial, 0.0, 0.0, 0.0];
        half_plane_rows[1] = [0.0, y[1], 0.0, y[3]];
        half_plane_rows
    })
}
