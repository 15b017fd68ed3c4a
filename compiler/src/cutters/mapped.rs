//! Values of a shape over boxes and rings of another frame.
//!
//! Maps between frames are composed first: the box of a turned box is larger than the box itself, and two turns that
//! cancel would leave it so. Solids of revolution around the axis of a ring are evaluated in its half plane, where
//! their walls are straight.

use super::cover::is_convex_row;
use super::section::{corners, moved};
use super::{Rows, SAME, TOUCHING, composed};
use crate::bounds::{World, inverse};
use crate::expression::ExprId;
use crate::scene::{NO_EDGE, Scene, ShapeId, ShapeKind};
use crate::shape_range::ShapeRange;
use crate::symmetry::is_turned;
use sdfc_vm::apply::{Applied, apply, laid_out};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::Interval;
use sdfc_vm::real::{Real, Vector3};
use sdfc_vm::row::Exactness;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;

/// A set of points in some frame.
#[derive(Clone, Copy)]
pub(super) enum Place {
    /// A box.
    Box(Bounds),
    /// The radii, heights and angles of a piece of a ring around the y axis.
    Ring(Bounds),
}

impl Place {
    /// The box around it.
    pub(super) fn bounds(&self) -> Bounds {
        match self {
            Self::Box(bounds) => *bounds,
            Self::Ring(ring) => {
                let [x, z] = [f64::cos as fn(f64) -> f64, f64::sin]
                    .map(|part| span([ring.min[0], ring.max[0]], [ring.min[2], ring.max[2]], part));
                Bounds {
                    min: [x[0], ring.min[1], z[0]],
                    max: [x[1], ring.max[1], z[1]],
                }
            }
        }
    }

    /// A ring's half plane, as a box without depth.
    pub(super) fn half_plane(ring: &Bounds) -> Bounds {
        Bounds {
            min: [ring.min[0], ring.min[1], 0.0],
            max: [ring.max[0], ring.max[1], 0.0],
        }
    }
}

/// The ends of a sine or cosine of angles, times radii.
fn span(radii: [f64; 2], angles: [f64; 2], part: fn(f64) -> f64) -> [f64; 2] {
    // Sine and cosine turn at multiples of a right angle.
    let quarters = (-2..=2).map(|quarter| f64::from(quarter) * std::f64::consts::FRAC_PI_2);
    let inside = quarters.filter(|angle| (angles[0]..=angles[1]).contains(angle));
    let values = angles.into_iter().chain(inside).map(part);
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
            range: ShapeRange::new(World::from(scene), uniform),
        }
    }

    /// All values of a shape; `rows` lead from the frame of the place to the shape's. Recursion over shapes within
    /// shapes, whose depth the elaborator bounds.
    pub(super) fn over(&mut self, id: ShapeId, rows: &Rows, place: &Place) -> Interval {
        let scene = self.scene;
        self.range.operations += 1;
        match &scene.shapes[id.0 as usize].kind {
            ShapeKind::Painted { child, .. } => self.over(*child, rows, place),
            ShapeKind::Frame {
                child,
                matrix,
                scale,
            } => match (
                rows_of_frame(scene, matrix),
                scene.expressions.as_constant(*scale),
            ) {
                (Some(inner), Some(scale)) => {
                    let value = self.over(*child, &composed(&inner, rows), place);
                    value * Interval::point(scale)
                }
                _ => self.leaf(id, rows, place),
            },
            ShapeKind::Combine {
                op: op @ (Op::Union | Op::Intersection | Op::Subtraction),
                children,
                ..
            } => {
                let mut value = self.over(children[0], rows, place);
                for &child in &children[1..] {
                    let next = self.over(child, rows, place);
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
                Some(half) => self.extruded(*child, half, rows, place),
                None => self.leaf(id, rows, place),
            },
            ShapeKind::Polygon { points } => {
                self.range.operations += points.len();
                let value = match place {
                    Place::Box(bounds) => corners(scene, id)
                        .and_then(|corners| side_of_polygon(&corners, rows, bounds)),
                    Place::Ring(_) => None,
                };
                value.unwrap_or_else(|| self.leaf(id, rows, place))
            }
            _ => self.leaf(id, rows, place),
        }
    }

    /// The values of an extrusion, by the sign of those of the figure and of the place along z.
    fn extruded(&mut self, child: ShapeId, half: f64, rows: &Rows, place: &Place) -> Interval {
        let bounds = place.bounds().mapped(rows);
        let height = Interval {
            lo: bounds.min[2],
            hi: bounds.max[2],
        };
        let figure = self.over(child, rows, place);
        figure.max(height.abs() - Interval::point(half))
    }

    /// The value of a shape at a point, or more.
    pub(super) fn most_at(&mut self, id: ShapeId, p: [f64; 3]) -> f64 {
        self.range.over(id, &Bounds { min: p, max: p }).hi
    }

    fn leaf(&mut self, id: ShapeId, rows: &Rows, place: &Place) -> Interval {
        if let Place::Ring(ring) = place
            && is_round(self.scene, id)
            && let Some(axial) = axial(rows)
        {
            return self.range.over(id, &Place::half_plane(ring).mapped(&axial));
        }
        let rows = match is_round(self.scene, id) {
            true => unturned(rows).unwrap_or(*rows),
            false => *rows,
        };
        let value = self.range.over(id, &place.bounds().mapped(&rows));
        match place {
            Place::Box(bounds) => match self.supported(id, &rows, bounds) {
                Some(least) if least > value.lo => Interval {
                    lo: least.min(value.hi),
                    ..value
                },
                _ => value,
            },
            Place::Ring(_) => value,
        }
    }

    /// The least value in a box by the plane that touches a convex solid's distance in the middle: a turned box has no
    /// larger one around it.
    fn supported(&self, id: ShapeId, rows: &Rows, bounds: &Bounds) -> Option<f64> {
        let ShapeKind::Primitive { op, parameters } = &self.scene.shapes[id.0 as usize].kind else {
            return None;
        };
        if op.row().meta.exactness != Exactness::Exact || !is_convex_row(*op) {
            return None;
        }
        let constant = |&id| self.scene.expressions.as_constant(id);
        let numbers: Vec<f64> = parameters.iter().map(constant).collect::<Option<_>>()?;
        let middle = moved(rows, bounds.centre());
        if !middle.iter().all(|v| v.is_finite()) {
            return None;
        }
        let number = |axis: usize| {
            let mut gradient = [0.0; 3];
            gradient[axis] = 1.0;
            let [x, y, z] = gradient;
            Dual {
                value: middle[axis],
                gradient: V3::of(x, y, z),
            }
        };
        let point = Vector3::new(number(0), number(1), number(2));
        let none = Dual {
            value: 0.0,
            gradient: V3::of(0.0, 0.0, 0.0),
        };
        let Applied::Value(found) = apply(*op, point, [none; 3], &laid_out(*op, &numbers)) else {
            return None;
        };
        let slopes = [found.gradient.x, found.gradient.y, found.gradient.z];
        let reach = |axis: usize| {
            let along: f64 = (0..3).map(|row| slopes[row] * rows[row][axis]).sum();
            along.abs() * (bounds.max[axis] - bounds.min[axis]) / 2.0
        };
        let least = found.value - (0..3).map(reach).sum::<f64>();
        least.is_finite().then_some(least)
    }
}

/// Values with the sign of a polygon's in a box: of one sign where no edge is in the box.
fn side_of_polygon(corners: &[[f64; 2]], rows: &Rows, bounds: &Bounds) -> Option<Interval> {
    let is_upright = [rows[0][2], rows[1][2], rows[2][0], rows[2][1]];
    if is_upright.iter().any(|&factor| factor != 0.0) {
        return None;
    }
    let back = inverse(rows.as_flattened())?;
    let place = |&[x, y]: &[f64; 2]| moved(&back, [x, y, 0.0]);
    let corners: Vec<[f64; 3]> = corners.iter().map(place).collect();
    let middle = bounds.centre();
    let mut is_inside = false;
    for (at, &a) in corners.iter().enumerate() {
        let b = corners[(at + 1) % corners.len()];
        if crosses(a, b, bounds) {
            return Some(Interval::ALL);
        }
        if (a[1] > middle[1]) != (b[1] > middle[1]) {
            let x = a[0] + (b[0] - a[0]) * (middle[1] - a[1]) / (b[1] - a[1]);
            is_inside ^= middle[0] < x;
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

/// Reports whether a piece of a line passes a box in the plane.
fn crosses(a: [f64; 3], b: [f64; 3], bounds: &Bounds) -> bool {
    let (mut first, mut last) = (0.0_f64, 1.0_f64);
    for axis in 0..2 {
        let (min, max, way) = (bounds.min[axis], bounds.max[axis], b[axis] - a[axis]);
        if way == 0.0 {
            if a[axis] < min || a[axis] > max {
                return false;
            }
            continue;
        }
        let ends = [(min - a[axis]) / way, (max - a[axis]) / way];
        first = first.max(ends[0].min(ends[1]));
        last = last.min(ends[0].max(ends[1]));
    }
    first <= last
}

/// The map of points that a frame of constants makes of outer ones.
pub(super) fn rows_of_frame(scene: &Scene, matrix: &[ExprId; 12]) -> Option<Rows> {
    let mut rows = SAME;
    for (at, &id) in matrix.iter().enumerate() {
        rows[at / 4][at % 4] = scene.expressions.as_constant(id)?;
    }
    Some(rows)
}

/// The map without its turn around the y axis, with the same distances from that.
fn unturned(rows: &Rows) -> Option<Rows> {
    let [x, y, z] = rows;
    let zero = |value: f64| value.abs() <= TOUCHING;
    let is_axis = [x[1], z[1], y[0], y[2]].into_iter().all(zero);
    let radial = x[0].hypot(z[0]);
    let even = [x[0] * x[2] + z[0] * z[2], radial - x[2].hypot(z[2])];
    if !is_axis || radial <= 0.0 || !even.iter().all(|v| v.abs() <= TOUCHING * radial.max(1.0)) {
        return None;
    }
    let shift = |column: usize| (x[column] * x[3] + z[column] * z[3]) / radial;
    Some([
        [radial, 0.0, 0.0, shift(0)],
        [0.0, y[1], 0.0, y[3]],
        [0.0, 0.0, radial, shift(2)],
    ])
}

/// Reports whether a shape is a solid of revolution around the y axis.
pub(super) fn is_round(scene: &Scene, id: ShapeId) -> bool {
    let (ShapeKind::Primitive { op, .. } | ShapeKind::Domain { op, .. }) =
        &scene.shapes[id.0 as usize].kind
    else {
        return false;
    };
    is_turned(*op)
}

/// The map of the half plane of a ring that a map of space stands for, if that takes the y axis to itself and keeps
/// angles between others.
pub(super) fn axial(rows: &Rows) -> Option<Rows> {
    let size = (0..3).fold(0.0, |most: f64, i| most.max(rows[1][i].abs()));
    let zero = |value: f64, unit: f64| value.abs() <= TOUCHING * unit.max(1.0);
    let [x, y, z] = rows;
    let is_axis = [x[1], z[1], y[0], y[2]].iter().all(|&v| zero(v, size));
    let is_through = [x[3], z[3]].iter().all(|&v| zero(v, y[3].abs()));
    let radial = x[0].hypot(z[0]);
    let other = x[2].hypot(z[2]);
    let is_even = zero(radial - other, radial) && zero(x[0] * x[2] + z[0] * z[2], radial * radial);
    (is_axis && is_through && is_even).then(|| {
        let mut axial = SAME;
        axial[0] = [radial, 0.0, 0.0, 0.0];
        axial[1] = [0.0, y[1], 0.0, y[3]];
        axial
    })
}
