//! Parts of an extension that other cutters already remove.
//!
//! The hull of two cross sections lies in a convex cutter that contains their corners. A cutter with the same
//! profile as the part, and coinciding walls, covers everything between its own flat faces.

use super::convex::is_convex;
use super::free_space::{GrowingPart, max_coordinate};
use super::mapped::{MappedRange, frame_rows, half_plane_rows, is_round};
use super::regions::{FrameMap, Region};
use super::section::{Section, circumscribed_polygon, transform_point};
use super::{AffineRows, CutterExtension, F32_TOLERANCE, IDENTITY, TOUCH_TOLERANCE, compose};
use crate::analysis::bounds::inverse;
use crate::scene::{Scene, ShapeId, ShapeKind};
use glam::DVec3;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;

/// A span along an axis.
type AxisSpan = (usize, [f64; 2]);

impl CutterExtension<'_> {
    /// Returns spans of a region in which another cutter contains the entire part; `level` maps to that cutter's
    /// frame.
    pub(super) fn covered_spans(
        &mut self,
        part: &GrowingPart,
        region: &Region,
        (other, level): (ShapeId, &FrameMap),
    ) -> Vec<AxisSpan> {
        let mut spans = Vec::new();
        if !region.is_ring
            && let Some(to_part) = region.to_part()
            && to_part.rows == IDENTITY
            && let Some(span) = self.span_of_same_profile(other, part, &level.rows)
        {
            spans.push((part.axis, span));
        }
        let mut parts = Vec::new();
        convex_parts(self.scene, other, &level.rows, &mut parts);
        for (id, rows) in parts {
            let bounds = self.bounds(id);
            spans.extend(self.span_in_convex(part, region, level, (id, &rows), &bounds));
        }
        spans
    }

    /// Returns the span in which a convex cutter contains the cross sections of a part.
    fn span_in_convex(
        &mut self,
        part: &GrowingPart,
        region: &Region,
        level: &FrameMap,
        (id, rows): (ShapeId, &AffineRows),
        cutter_bounds: &Bounds,
    ) -> Option<AxisSpan> {
        let [near_section, far_section] = part.sections.as_ref()?;
        let from_part = inverse(region.to_part()?.rows.as_flattened())?;
        let [near_section, far_section] = [near_section, far_section].map(|section| Section {
            points: section
                .points
                .iter()
                .map(|&p| transform_point(&from_part, p))
                .collect(),
            ..section.clone()
        });
        let is_round_pair = is_round(self.scene, id) && half_plane_rows(rows).is_some();
        // In the half plane of a ring, only solids about the same axis can be compared.
        if region.is_ring && !level.is_half_plane && !is_round_pair {
            return None;
        }
        // A solid of revolution of a convex profile need not be convex.
        let is_revolved = matches!(self.kind(id), ShapeKind::Domain { .. });
        if is_revolved && !(is_round_pair && (near_section.is_round || region.is_ring)) {
            return None;
        }
        if near_section.is_round && region.to_part()?.rows != part.placement {
            return None;
        }
        let axes = if near_section.is_round { 1..2 } else { 0..3 };
        let (axis, from, to) = axes.into_iter().find_map(|axis| {
            let from = common_coordinate(&near_section.points, axis)?;
            let to = common_coordinate(&far_section.points, axis)?;
            let tolerance = TOUCH_TOLERANCE * from.abs().max(to.abs());
            ((to - from).abs() > tolerance).then_some((axis, from, to))
        })?;
        let mut span = [region.bounds.min[axis], region.bounds.max[axis]];
        if let Some(to_region) = inverse(rows.as_flattened()) {
            let ends = cutter_bounds.mapped(&to_region);
            span = [span[0].max(ends.min[axis]), span[1].min(ends.max[axis])];
        }
        if span.iter().any(|end| !end.is_finite()) || span[0] >= span[1] {
            return None;
        }
        // Signs are certain only slightly inside.
        let margin = TOUCH_TOLERANCE * max_coordinate(&region.bounds);
        let mut points = Vec::new();
        for end in [span[0] + margin, span[1] - margin] {
            let corners = near_section.inset_between(&far_section, (end - from) / (to - from));
            for corner in corners {
                match near_section.is_round {
                    true if is_round_pair => {
                        points.extend([corner, DVec3::new(0.0, corner.y, 0.0)])
                    }
                    true => points.extend(circumscribed_polygon(corner)),
                    false if near_section.is_2d && !region.is_ring => {
                        let ends = [region.bounds.min[2] + margin, region.bounds.max[2] - margin];
                        points.extend(ends.map(|z| corner.with_z(z)));
                    }
                    false => points.push(corner),
                }
            }
        }
        let is_finite = points.iter().all(|p| p.is_finite());
        let size = points
            .iter()
            .flat_map(|p| p.to_array())
            .fold(0.0, |max: f64, v| max.max(v.abs()));
        let scene = &*self.scene;
        let mut uniform = |id| {
            let constant = scene.expressions.as_constant(id);
            constant.map_or(Interval::ALL, Interval::point)
        };
        let mut range = MappedRange::new(scene, &mut uniform);
        let mut is_inside =
            |&p: &DVec3| range.upper_bound_at(id, transform_point(rows, p)) <= F32_TOLERANCE * size;
        (is_finite && points.iter().all(&mut is_inside)).then_some((axis, span))
    }

    /// Returns the ends, along the part's axis and in its frame, of a shape with the part's profile. `rows` map
    /// from that frame to the shape's.
    fn span_of_same_profile(
        &mut self,
        id: ShapeId,
        part: &GrowingPart,
        rows: &AffineRows,
    ) -> Option<[f64; 2]> {
        match self.kind(id).clone() {
            ShapeKind::Painted { child, .. } => self.span_of_same_profile(child, part, rows),
            ShapeKind::Frame { child, matrix, .. } => {
                let inner = frame_rows(self.scene, &matrix)?;
                self.span_of_same_profile(child, part, &compose(&inner, rows))
            }
            ShapeKind::Combine {
                op: Op::Union,
                children,
                ..
            } => children
                .into_iter()
                .find_map(|child| self.span_of_same_profile(child, part, rows)),
            ShapeKind::Primitive { .. } | ShapeKind::Distance { .. } => {
                let (bounds, axis) = (self.bounds(id), part.axis);
                let shift = rows[axis][3];
                (is_shift_along(rows, axis, &bounds) && self.have_same_profile(id, part.id, axis))
                    .then(|| [bounds.min[axis] - shift, bounds.max[axis] - shift])
            }
            _ => None,
        }
    }

    /// Reports whether two shapes are equal except for their extent along an axis.
    fn have_same_profile(&self, a: ShapeId, b: ShapeId, axis: usize) -> bool {
        let definition = |id: ShapeId| match self.kind(id) {
            ShapeKind::Primitive { op, parameters } => Some((*op, None, parameters)),
            ShapeKind::Distance {
                op,
                child,
                parameters,
            } => Some((*op, Some(*child), parameters)),
            _ => None,
        };
        let (Some((op, child, numbers)), Some((other, other_child, others))) =
            (definition(a), definition(b))
        else {
            return false;
        };
        let mut flats = op.row().facts.flats.iter();
        let Some(flat) = flats.find(|flat| flat.axis == axis) else {
            return false;
        };
        let other_parameters = (0..numbers.len()).filter(|&index| index != flat.half);
        let (Some(numbers), Some(others)) = (self.constants(numbers), self.constants(others))
        else {
            return false;
        };
        let is_equal = |index: usize| {
            (numbers[index] - others[index]).abs() <= TOUCH_TOLERANCE * numbers[index].abs()
        };
        op == other && child == other_child && other_parameters.into_iter().all(is_equal)
    }
}

/// Returns the coordinate of points along an axis, if it is common to all.
fn common_coordinate(points: &[DVec3], axis: usize) -> Option<f64> {
    let first = points.first()?[axis];
    let size = points
        .iter()
        .flat_map(|p| p.to_array())
        .fold(0.0, |max: f64, v| max.max(v.abs()));
    let is_equal = |p: &DVec3| (p[axis] - first).abs() <= TOUCH_TOLERANCE * size;
    points.iter().all(is_equal).then_some(first)
}

/// Collects the convex solids and revolved convex profiles of a union, with the maps to their frames.
/// Recursion over nested shapes, whose depth the elaborator bounds.
fn convex_parts(
    scene: &Scene,
    id: ShapeId,
    rows: &AffineRows,
    parts: &mut Vec<(ShapeId, AffineRows)>,
) {
    match &scene.shapes[id.0 as usize].kind {
        ShapeKind::Painted { child, .. } => convex_parts(scene, *child, rows, parts),
        ShapeKind::Frame { child, matrix, .. } => {
            if let Some(inner) = frame_rows(scene, matrix) {
                convex_parts(scene, *child, &compose(&inner, rows), parts);
            }
        }
        ShapeKind::Combine {
            op: Op::Union,
            children,
            ..
        } => {
            for &child in children {
                convex_parts(scene, child, rows, parts);
            }
        }
        ShapeKind::Domain {
            op: Op::Revolve,
            child,
            ..
        } if is_convex(scene, *child) => parts.push((id, *rows)),
        _ if is_convex(scene, id) => parts.push((id, *rows)),
        _ => {}
    }
}

/// Reports whether a map is a translation along an axis.
fn is_shift_along(rows: &AffineRows, axis: usize, bounds: &Bounds) -> bool {
    let size = max_coordinate(bounds);
    (0..3).all(|row| {
        (0..4).all(|column| {
            let (value, unit) = (rows[row][column], IDENTITY[row][column]);
            match column {
                3 => row == axis || value.abs() <= TOUCH_TOLERANCE * size,
                _ => (value - unit).abs() <= TOUCH_TOLERANCE,
            }
        })
    })
}
