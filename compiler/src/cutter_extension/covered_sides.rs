//! Sides of cutters that enclose the body, as where a shoulder is turned: `cylinder(20, 40) - cylinder(20, 15)`.
//!
//! A side of a cutter may coincide with one of the body, or lie slightly outside. There, values are near zero although
//! nothing is left. A side that encloses the body cuts nothing. So a cylinder, a cone, a prism or an extrusion becomes
//! the slab between its faces. An intersection loses the operand, and a subtraction becomes a complement.
//!
//! Three facts prove it. The body has the same profile, or it has a smaller radius, or a convex profile contains the
//! corners of its box.

use super::convex::is_convex;
use super::free_space::max_coordinate;
use super::mapped::frame_rows;
use super::section::{outline, transform_point};
use super::{AffineRows, CutContext, CutterExtension, F32_TOLERANCE, IDENTITY, PathStep, compose};
use crate::analysis::bounds::inverse;
use crate::analysis::shape_range::ShapeRange;
use crate::expression::ExprId;
use crate::field_factors::uses_below;
use crate::scene::{SceneRef, ShapeId, ShapeKind, children};
use glam::DVec3;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;

/// Sides of a cutter's part, without its faces; or all of a part.
#[derive(Clone, Copy)]
struct Sides {
    part: ShapeId,
    /// Axis across both faces; `None` if the faces count, too.
    axis: Option<usize>,
    /// Half the distance of the faces.
    half: f64,
    /// Radii at the lower and the upper face, if the sides are those of a cylinder or a cone.
    radii: Option<[f64; 2]>,
}

impl CutterExtension<'_> {
    /// Returns the slab between the faces of a part, extended; `None` if its sides are not proved to enclose the body.
    pub(super) fn as_slab(
        &mut self,
        id: ShapeId,
        path: &[PathStep],
        cut: &CutContext,
    ) -> Option<ShapeId> {
        let slab = self.without_covering_sides(id, path, cut)?;
        let straight = self.with_straight_sides(id);
        let extended = self.extend_flat_faces(straight, path, cut);
        Some(
            self.without_covering_sides(extended, path, cut)
                .unwrap_or(slab),
        )
    }

    /// Returns a cylinder around a cone, whose faces can be moved; any other part as it is.
    fn with_straight_sides(&mut self, id: ShapeId) -> ShapeId {
        let Some(Sides {
            half,
            radii: Some([bottom, top]),
            ..
        }) = self.sides_of(id)
        else {
            return id;
        };
        if bottom == top {
            return id;
        }
        let numbers = [bottom.max(top), half];
        let expressions = &mut self.scene.expressions;
        let parameters = numbers.map(|number| expressions.constant(number)).to_vec();
        let kind = ShapeKind::Primitive {
            op: Op::Cylinder,
            parameters,
        };
        self.scene.derived(id, kind)
    }

    /// Returns a part of a cutter without its sides; `None` if they are not proved to enclose the body. `path` leads from
    /// the part to the body.
    pub(super) fn without_covering_sides(
        &mut self,
        id: ShapeId,
        path: &[PathStep],
        cut: &CutContext,
    ) -> Option<ShapeId> {
        let mut kind = self.kind(id).clone();
        if let ShapeKind::Frame { child, matrix, .. } = &mut kind {
            let rows = inverse(frame_rows(self.scene, matrix)?.as_flattened())?;
            let path = [path, &[PathStep::Map(rows)]].concat();
            *child = self.without_covering_sides(*child, &path, cut)?;
            return Some(self.scene.derived(id, kind));
        }
        let sides = self.sides_of(id)?;
        let axis = sides.axis.filter(|_| cut.blend_radius == 0.0)?;
        if !self.encloses(sides, cut.body?, &rows_to_part(path)?) {
            return None;
        }
        let mut slab = [0.0; 4];
        (slab[axis], slab[3]) = (1.0, sides.half);
        let expressions = &mut self.scene.expressions;
        let parameters = slab.map(|number| expressions.constant(number)).to_vec();
        let kind = ShapeKind::Primitive {
            op: Op::Slab,
            parameters,
        };
        Some(self.scene.derived(id, kind))
    }

    /// Returns the operands of an intersection that do not enclose the body; at least one.
    pub(super) fn without_covering_operands(
        &mut self,
        operands: &[ShapeId],
        path: &[PathStep],
        cut: &CutContext,
    ) -> Vec<ShapeId> {
        let mut remaining = operands.to_vec();
        let mut index = 0;
        while index < remaining.len() && remaining.len() > 1 {
            match self.covers_body(remaining[index], path, cut) {
                true => drop(remaining.remove(index)),
                false => index += 1,
            }
        }
        remaining
    }

    /// Reports whether a part of a cutter is proved to enclose the body; a 2-D part if it does so in its plane. A part with
    /// a material lines the cut, and stays.
    pub(super) fn covers_body(&mut self, id: ShapeId, path: &[PathStep], cut: &CutContext) -> bool {
        let (Some(body), Some(rows)) = (cut.body, rows_to_part(path)) else {
            return false;
        };
        let Some((part, part_rows)) = self.innermost(id) else {
            return false;
        };
        let is_2d = self.scene.shapes[part.0 as usize].is_2d;
        let sides = Sides {
            part,
            axis: is_2d.then_some(2),
            half: f64::INFINITY,
            radii: None,
        };
        if !self.encloses(sides, body, &compose(&part_rows, &rows)) {
            return false;
        }
        let mut parts = uses_below(self.scene, id).into_iter();
        !parts.any(|(id, _)| matches!(self.kind(id), ShapeKind::Painted { .. }))
    }

    /// Returns the complement of the union of shapes, in place of one that they were subtracted from.
    pub(super) fn complement_of(&mut self, like: ShapeId, children: Vec<ShapeId>) -> ShapeId {
        let child = match children.as_slice() {
            &[child] => child,
            _ => {
                let kind = ShapeKind::Combine {
                    op: Op::Union,
                    children,
                    parameters: Vec::new(),
                };
                self.scene.derived(like, kind)
            }
        };
        let kind = ShapeKind::Distance {
            op: Op::Complement,
            child,
            parameters: Vec::new(),
        };
        self.scene.derived(like, kind)
    }

    /// Returns the shape within frames, and the map to its frame.
    fn innermost(&self, mut id: ShapeId) -> Option<(ShapeId, AffineRows)> {
        let mut rows = IDENTITY;
        loop {
            match self.kind(id) {
                ShapeKind::Frame { child, matrix, .. } => {
                    rows = compose(&frame_rows(self.scene, matrix)?, &rows);
                    id = *child;
                }
                _ => return Some((id, rows)),
            }
        }
    }

    /// Returns the sides of a part with two flat faces.
    fn sides_of(&self, id: ShapeId) -> Option<Sides> {
        let (op, parameters) = match self.kind(id) {
            ShapeKind::Primitive { op, parameters } => (*op, parameters),
            ShapeKind::Distance {
                op: Op::Extrude,
                parameters,
                ..
            } => (Op::Extrude, parameters),
            _ => return None,
        };
        let numbers = self.constants(parameters)?;
        let (axis, half, radii) = match (op, numbers.as_slice(), op.row().facts.flats) {
            (Op::Cone, &[bottom, top, half, ..], _) => (1, half, Some([bottom, top])),
            (Op::Cylinder, &[r, half], _) => (1, half, Some([r, r])),
            (Op::Prism | Op::Extrude, numbers, [flat]) => (flat.axis, numbers[flat.half], None),
            _ => return None,
        };
        Some(Sides {
            part: id,
            axis: Some(axis),
            half,
            radii,
        })
    }

    /// Reports whether sides are proved to enclose a shape, as far as it lies between the faces. `rows` map to the frame of
    /// the part. Recursion over nested shapes, whose depth the elaborator bounds.
    fn encloses(&mut self, sides: Sides, id: ShapeId, rows: &AffineRows) -> bool {
        let Some(remaining) = self.remaining_box_tests.checked_sub(1) else {
            return false;
        };
        self.remaining_box_tests = remaining;
        let bounds = self.bounds(id);
        if bounds.is_empty() || self.is_beyond_faces(sides, &bounds.mapped(rows)) {
            return true;
        }
        match self.kind(id).clone() {
            ShapeKind::Painted { child, .. } => self.encloses(sides, child, rows),
            ShapeKind::Frame { child, matrix, .. } => {
                let to_outer =
                    frame_rows(self.scene, &matrix).and_then(|inner| inverse(inner.as_flattened()));
                to_outer
                    .is_some_and(|to_outer| self.encloses(sides, child, &compose(rows, &to_outer)))
            }
            ShapeKind::Combine { op, children, .. } => match op {
                Op::Union => children
                    .iter()
                    .all(|&child| self.encloses(sides, child, rows)),
                Op::Intersection => children
                    .iter()
                    .any(|&child| self.encloses(sides, child, rows)),
                Op::Subtraction => self.encloses(sides, children[0], rows),
                _ => self.encloses_points(sides, id, rows),
            },
            _ => self.has_same_profile(sides, id, rows) || self.encloses_points(sides, id, rows),
        }
    }

    /// Reports whether a box lies beyond one of the faces.
    fn is_beyond_faces(&self, sides: Sides, bounds: &Bounds) -> bool {
        sides
            .axis
            .filter(|_| sides.half.is_finite())
            .is_some_and(|axis| {
                let tolerance = F32_TOLERANCE * max_coordinate(bounds).max(sides.half);
                bounds.min[axis] >= sides.half - tolerance
                    || bounds.max[axis] <= tolerance - sides.half
            })
    }

    /// Reports whether a shape has the profile of the sides, at the same place.
    fn has_same_profile(&mut self, sides: Sides, id: ShapeId, rows: &AffineRows) -> bool {
        let size = max_coordinate(&self.bounds(id)).max(1e-30);
        let is_free = |row: usize, column: usize| {
            sides
                .axis
                .is_some_and(|axis| row == axis && (column == axis || column == 3))
        };
        let is_in_place = (0..3).all(|row| {
            (0..4).all(|column| {
                let unit = if column == 3 { size } else { 1.0 };
                let difference = rows[row][column] - IDENTITY[row][column];
                is_free(row, column) || difference.abs() <= F32_TOLERANCE * unit
            })
        });
        let profile_of = |id| match self.kind(id) {
            ShapeKind::Distance {
                op: Op::Extrude | Op::RoundedExtrude,
                child,
                ..
            } if sides.axis.is_some() => *child,
            _ => id,
        };
        is_in_place && self.is_same_shape(sides, profile_of(sides.part), profile_of(id))
    }

    /// Reports whether two shapes are the same, up to the distance of the faces.
    fn is_same_shape(&self, sides: Sides, a: ShapeId, b: ShapeId) -> bool {
        if a == b {
            return true;
        }
        let (first, second) = (self.kind(a), self.kind(b));
        let ignored = |op: Op| match (sides.axis, a == sides.part) {
            (Some(axis), true) => {
                let flats = op.row().facts.flats.iter();
                flats
                    .clone()
                    .find(|flat| flat.axis == axis)
                    .map(|flat| flat.half)
            }
            _ => None,
        };
        let have_same_numbers = |op: Op, first: &[ExprId], second: &[ExprId]| {
            let mut pairs = first.iter().zip(second).enumerate();
            first.len() == second.len()
                && pairs.all(|(index, (&a, &b))| Some(index) == ignored(op) || self.are_equal(a, b))
        };
        let is_same = match (first, second) {
            (
                ShapeKind::Primitive { op, parameters },
                ShapeKind::Primitive {
                    op: other,
                    parameters: others,
                },
            )
            | (
                ShapeKind::Distance { op, parameters, .. },
                ShapeKind::Distance {
                    op: other,
                    parameters: others,
                    ..
                },
            )
            | (
                ShapeKind::Domain { op, parameters, .. },
                ShapeKind::Domain {
                    op: other,
                    parameters: others,
                    ..
                },
            )
            | (
                ShapeKind::Combine { op, parameters, .. },
                ShapeKind::Combine {
                    op: other,
                    parameters: others,
                    ..
                },
            ) => op == other && have_same_numbers(*op, parameters, others),
            (ShapeKind::Frame { matrix, .. }, ShapeKind::Frame { matrix: other, .. }) => matrix
                .iter()
                .zip(other)
                .all(|(&a, &b)| self.are_equal(a, b)),
            (ShapeKind::Polygon { points }, ShapeKind::Polygon { points: others }) => {
                let (points, others) = (points.as_flattened(), others.as_flattened());
                points.len() == others.len()
                    && points
                        .iter()
                        .zip(others)
                        .all(|(&a, &b)| self.are_equal(a, b))
            }
            (ShapeKind::Field { value, .. }, ShapeKind::Field { value: other, .. }) => {
                // Values that count stay as written.
                let have_signs = [a, b].iter().all(|&id| !self.uses.contains(&(id, false)));
                value == other && have_signs
            }
            _ => return false,
        };
        let (first, second) = (children(first), children(second));
        let mut operands = first.iter().zip(second.iter());
        is_same
            && first.len() == second.len()
            && operands.all(|(&a, &b)| self.is_same_shape(sides, a, b))
    }

    /// Reports whether two numbers are the same at all values of the parameters.
    fn are_equal(&self, a: ExprId, b: ExprId) -> bool {
        let constant = |id| self.scene.expressions.as_constant(id);
        let is_near = |a: f64, b: f64| (a - b).abs() <= F32_TOLERANCE * a.abs().max(b.abs());
        a == b
            || constant(a)
                .zip(constant(b))
                .is_some_and(|(a, b)| is_near(a, b))
    }

    /// Reports whether sides enclose points whose hull contains a shape.
    fn encloses_points(&mut self, sides: Sides, id: ShapeId, rows: &AffineRows) -> bool {
        let bounds = self.bounds(id);
        if !bounds.is_finite() {
            return false;
        }
        if let Some(radii) = sides.radii {
            let rate = (radii[1] - radii[0]) / (2.0 * sides.half);
            let points = self.radii_and_heights(sides, id, &bounds, rows);
            return points.into_iter().all(|[radius, height]| {
                let limit = radii[0] + rate * (height + sides.half);
                radius <= limit + F32_TOLERANCE * radius.max(height.abs())
            });
        }
        if !is_convex(self.scene, sides.part) {
            return false;
        }
        let centre = self.bounds(sides.part).centre();
        let points = self.hull_points(id, &bounds);
        let scene = &*self.scene;
        let mut uniform = |id| {
            let constant = scene.expressions.as_constant(id);
            constant.map_or(Interval::ALL, Interval::point)
        };
        let mut range = ShapeRange::new(SceneRef::from(scene), &mut uniform);
        points.into_iter().all(|point| {
            let mut point = transform_point(rows, point);
            if let Some(axis) = sides.axis {
                point[axis] = centre[axis];
            }
            let at = Bounds {
                min: point.to_array(),
                max: point.to_array(),
            };
            range.range_in_box(sides.part, &at).hi <= F32_TOLERANCE * max_coordinate(&at)
        })
    }

    /// Returns points whose convex hull contains a shape, in its own frame.
    fn hull_points(&self, id: ShapeId, bounds: &Bounds) -> Vec<DVec3> {
        let outline = match self.kind(id) {
            ShapeKind::Distance {
                op: Op::Extrude,
                child,
                ..
            } => outline(self.scene, *child),
            _ => None,
        };
        match outline {
            Some(corners) => corners
                .into_iter()
                .flat_map(|corner| [bounds.min[2], bounds.max[2]].map(|z| corner.with_z(z)))
                .collect(),
            None => bounds.corners().map(DVec3::from).to_vec(),
        }
    }

    /// Returns radii and heights of circles about the y axis of a part. The hull of their discs contains a shape, as far as
    /// it lies between the faces.
    fn radii_and_heights(
        &self,
        sides: Sides,
        id: ShapeId,
        bounds: &Bounds,
        rows: &AffineRows,
    ) -> Vec<[f64; 2]> {
        let column = |column: usize| DVec3::from([0, 1, 2].map(|row| rows[row][column]));
        let [x, y, z] = [column(0), column(1), column(2)];
        let are_orthogonal =
            |a: DVec3, b: DVec3| a.dot(b).abs() <= F32_TOLERANCE * a.length() * b.length();
        let is_upright = [
            (x, DVec3::Y),
            (z, DVec3::Y),
            (x, z),
            (y, DVec3::X),
            (y, DVec3::Z),
        ]
        .iter()
        .all(|&(a, b)| are_orthogonal(a, b));
        match self.ends_of_revolution(id, bounds) {
            Some(ends) if is_upright => {
                let stretch = x.length().max(z.length());
                let circle = |[radius, height]: [f64; 2]| {
                    let centre = transform_point(rows, DVec3::new(0.0, height, 0.0));
                    [centre.x.hypot(centre.z) + radius * stretch, centre.y]
                };
                let [a, b] = ends.map(circle);
                // The discs between both ends are the rest of the hull.
                let at_height = |[radius, height]: [f64; 2]| {
                    let clipped = height.clamp(-sides.half, sides.half);
                    let rate = (b[0] - a[0]) / (b[1] - a[1]);
                    match rate.is_finite() {
                        true => [radius + rate * (clipped - height), clipped],
                        false => [radius, height],
                    }
                };
                [a, b].map(at_height).to_vec()
            }
            _ => {
                let points = self.hull_points(id, bounds).into_iter();
                let in_part = points.map(|point| transform_point(rows, point));
                in_part.map(|p| [p.x.hypot(p.z), p.y]).collect()
            }
        }
    }

    /// Returns the radii and the heights of both ends of a solid of revolution about its y axis.
    fn ends_of_revolution(&self, id: ShapeId, bounds: &Bounds) -> Option<[[f64; 2]; 2]> {
        let (low, high) = (bounds.min[1], bounds.max[1]);
        let radius = bounds.max[0].max(-bounds.min[0]);
        match self.kind(id) {
            ShapeKind::Primitive {
                op: Op::Cone,
                parameters,
            } => match self.constants(parameters)?.as_slice() {
                &[bottom, top, half, ..] => Some([[bottom, -half], [top, half]]),
                _ => None,
            },
            ShapeKind::Primitive { op, .. } if op.row().facts.axis_of_revolution == Some(1) => {
                Some([[radius, low], [radius, high]])
            }
            ShapeKind::Domain {
                op: Op::Revolve, ..
            } => Some([[radius, low], [radius, high]]),
            _ => None,
        }
    }
}

/// Returns the map from the frame at the end of a path to that at its start. Intersections on the way only make a part
/// smaller.
pub(super) fn rows_to_part(path: &[PathStep]) -> Option<AffineRows> {
    let to_body = path
        .iter()
        .rev()
        .try_fold(IDENTITY, |rows, step| match step {
            PathStep::Map(map) => Some(compose(map, &rows)),
            PathStep::Clip(_) => Some(rows),
            PathStep::Copies { .. } | PathStep::Revolve(_) => None,
        })?;
    inverse(to_body.as_flattened())
}
