//! Proofs that an extension of a cutter removes nothing from the body.
//!
//! Bounding boxes are compared first. The region that they leave undecided is bisected. For each half,
//! intervals show whether it lies outside the extended part, outside the body, or in another cutter. Values
//! that are zero up to rounding count as outside: faces may touch. Spans that other cutters contain entirely
//! are removed first (`cover`).

use super::mapped::{MappedRange, PointSet, frame_rows};
use super::regions::{FrameMap, Region, aligned_column};
use super::section::Section;
use super::{
    AffineRows, CutContext, CutterExtension, F32_TOLERANCE, PathStep, TOUCH_TOLERANCE, compose,
};
use crate::analysis::bounds::inverse;
use crate::analysis::slope::surface_slope;
use crate::scene::{ShapeId, ShapeKind, children};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;

/// Maximum number of boxes in one proof by bisection.
const MAX_BISECTIONS: usize = 400;
/// Minimum side of a part on either side of a face, as a fraction of the box that it divides.
const MIN_PART_FRACTION: f64 = 1e-3;
/// Size of the smallest boxes, as a fraction of the region.
const MIN_BOX_FRACTION: f64 = 1.0 / 64.0;

/// A part of a cutter that is extended at one of its faces.
pub(super) struct GrowingPart {
    /// The extended part, or the original part if it is straight.
    pub(super) id: ShapeId,
    /// True if its profile beyond the flat faces is that in its middle.
    pub(super) is_straight: bool,
    /// Width of the blend with the body, in the part's frame.
    pub(super) blend_radius: f64,
    /// The axis of the region's frame along which the face moves.
    pub(super) axis: usize,
    /// The map from the region's frame to that of the part.
    pub(super) placement: AffineRows,
    /// Cross sections at the old and the farthest new position of the face. Their hull contains the
    /// extension.
    pub(super) sections: Option<[Section; 2]>,
}

impl CutterExtension<'_> {
    /// Reports whether extending a part by a box removes nothing from the solid.
    pub(super) fn is_free(
        &mut self,
        part: &GrowingPart,
        added_box: &Bounds,
        path: &[PathStep],
        cut: &CutContext,
    ) -> bool {
        let Some(regions) = Region::images_of_box(added_box, &part.placement, path) else {
            return false;
        };
        let is_2d = self.scene.shapes[cut.body.unwrap_or(part.id).0 as usize].is_2d;
        regions.into_iter().all(|mut region| {
            if is_2d {
                (region.bounds.min[2], region.bounds.max[2]) = (0.0, 0.0);
            }
            self.is_free_within(part, &region, cut)
        })
    }

    fn is_free_within(&mut self, part: &GrowingPart, region: &Region, cut: &CutContext) -> bool {
        if region.bounds.is_empty() {
            return true;
        }
        let Some(inverse_rows) = inverse(region.rows.as_flattened()) else {
            return false;
        };
        let bounds_of = |region: &Region| region.point_set(region.bounds).bounds();
        let is_clear_by_boxes = |this: &mut Self, region: &Region| {
            cut.body
                .is_some_and(|body| this.is_clear_by_boxes(body, &inverse_rows, &bounds_of(region)))
        };
        if is_clear_by_boxes(self, region) {
            return true;
        }
        let outer_bounds = bounds_of(region).mapped(&region.rows);
        if part.blend_radius > 0.0 {
            // Other cutters may contain the part, but not its blend zone.
            return self.is_outside_by_intervals(part, region, cut.body, [&[], &[]]);
        }
        let clips: Vec<(ShapeId, FrameMap)> = cut
            .clips
            .iter()
            .filter_map(|&(id, depth)| Some((id, region.frame_map(depth)?.clone())))
            .collect();
        let nearby: Vec<(ShapeId, FrameMap)> = cut
            .other_cutters
            .iter()
            .filter(|_| cut.has_one_material)
            .filter(|other| !other.is_extended && !are_disjoint(&other.bounds, &outer_bounds))
            .filter_map(|other| Some((other.id, region.frame_map(other.depth)?.clone())))
            .collect();
        let mut remaining = region.clone();
        for (other, level) in &nearby {
            for (axis, span) in self.covered_spans(part, region, (*other, level)) {
                remaining.subtract_span(axis, span);
            }
        }
        if remaining.bounds.is_empty() {
            return true;
        }
        if remaining.bounds != region.bounds && is_clear_by_boxes(self, &remaining) {
            return true;
        }
        // Nothing is removed outside of the body's box. Bisection would hardly meet its faces.
        if let (false, Some(body)) = (region.is_ring, cut.body) {
            let body = self.bounds(body).mapped(&inverse_rows);
            remaining.bounds = remaining.bounds.intersection(&body);
        }
        remaining.bounds.is_empty()
            || self.is_outside_by_intervals(part, &remaining, cut.body, [&nearby, &clips])
    }

    /// Reports whether boxes prove a box free of a shape; `rows` map from the shape's frame to that of the
    /// box.
    fn is_clear_by_boxes(&mut self, id: ShapeId, rows: &AffineRows, region: &Bounds) -> bool {
        let Some(remaining) = self.remaining_box_tests.checked_sub(1) else {
            return false;
        };
        self.remaining_box_tests = remaining;
        let bounds = self.bounds(id);
        if bounds.is_empty() || are_disjoint(&bounds.mapped(rows), region) {
            return true;
        }
        match self.kind(id).clone() {
            ShapeKind::Painted { child, .. } => self.is_clear_by_boxes(child, rows, region),
            ShapeKind::Frame { child, matrix, .. } => {
                let rows_of_child = frame_rows(self.scene, &matrix);
                rows_of_child
                    .and_then(|rows| inverse(rows.as_flattened()))
                    .is_some_and(|inner| {
                        self.is_clear_by_boxes(child, &compose(rows, &inner), region)
                    })
            }
            ShapeKind::Combine { op, children, .. } => {
                let mut is_child_clear =
                    |child: ShapeId| self.is_clear_by_boxes(child, rows, region);
                match op {
                    Op::Union => children.into_iter().all(is_child_clear),
                    Op::Intersection => children.into_iter().any(is_child_clear),
                    Op::Subtraction => is_child_clear(children[0]),
                    _ => false,
                }
            }
            _ => false,
        }
    }

    /// Reports whether intervals prove that the part lies outside the body or in other cutters, within a
    /// region.
    fn is_outside_by_intervals(
        &mut self,
        part: &GrowingPart,
        region: &Region,
        body: Option<ShapeId>,
        others: [&[(ShapeId, FrameMap)]; 2],
    ) -> bool {
        let (ShapeKind::Primitive { op, .. } | ShapeKind::Distance { op, .. }) = self.kind(part.id)
        else {
            return self.bisect_intervals(part, None, region, body, others);
        };
        let flats = op.row().facts.flats.iter().map(|flat| flat.axis).collect();
        let centre = part.is_straight.then(|| self.bounds(part.id).centre());
        let centre = centre.map(|centre| (centre, flats));
        self.bisect_intervals(part, centre, region, body, others)
    }

    /// Returns the change of a shape's value over a unit of length at its surface, at most 1. A tolerance in units of
    /// length times this is one of values: a flat field is nearly zero everywhere.
    fn value_unit(&mut self, id: ShapeId) -> f64 {
        if let Some(&unit) = self.value_units.get(&id) {
            return unit;
        }
        let kind = self.kind(id).clone();
        let unit = match kind {
            ShapeKind::Field { value, .. } => {
                let bounds = self.bounds(id);
                let slope = surface_slope(&self.scene.expressions, value, &bounds, &self.ranges);
                slope.map_or(0.0, |slope| slope.min(1.0))
            }
            other => {
                let units = children(&other).iter().map(|&child| self.value_unit(child));
                units.fold(1.0, f64::min)
            }
        };
        self.value_units.insert(id, unit);
        unit
    }

    /// Divides the region, at faces of the boxes of other cutters first. `centre` holds the centre of a straight part and the
    /// axes of its flat faces.
    fn bisect_intervals(
        &mut self,
        part: &GrowingPart,
        centre: Option<([f64; 3], Vec<usize>)>,
        region: &Region,
        body: Option<ShapeId>,
        [cutters, clips]: [&[(ShapeId, FrameMap)]; 2],
    ) -> bool {
        let faces = self.faces_of(region, cutters);
        let clip_units: Vec<f64> = clips.iter().map(|(id, _)| self.value_unit(*id)).collect();
        let body_unit = body.map_or(1.0, |body| self.value_unit(body));
        let cutter_units: Vec<f64> = cutters.iter().map(|(id, _)| self.value_unit(*id)).collect();
        let scene = &*self.scene;
        let mut uniform = |id| {
            let constant = scene.expressions.as_constant(id);
            constant.map_or(Interval::ALL, Interval::point)
        };
        let mut range = MappedRange::new(scene, &mut uniform);
        let point_set_in = |level: &FrameMap, bounds: &Bounds| match level.is_half_plane {
            true => PointSet::Box(PointSet::half_plane(bounds)),
            false => region.point_set(*bounds),
        };
        // The least depth of a box in what the extension removes; `None` if intervals prove that nothing is.
        let removed_depth = |range: &mut MappedRange, bounds: &Bounds, tolerance: f64| {
            let points = region.point_set(*bounds);
            let value = body.map_or(Interval::point(f64::NEG_INFINITY), |body| {
                range.over(body, &region.rows, &points)
            });
            if value.lo >= -tolerance * body_unit {
                return None;
            }
            let mut own_value = Interval::point(-1.0);
            if let Some(level) = region.to_part() {
                own_value = match (&centre, point_set_in(level, bounds)) {
                    (Some((centre, flats)), PointSet::Box(inner)) => {
                        let mut profile = inner.mapped(&level.rows);
                        for &axis in flats {
                            (profile.min[axis], profile.max[axis]) = (centre[axis], centre[axis]);
                        }
                        range.range.range_in_box(part.id, &profile)
                    }
                    (_, points) => range.over(part.id, &level.rows, &points),
                };
                if own_value.lo >= part.blend_radius - tolerance {
                    return None;
                }
            }
            for ((clip, level), unit) in clips.iter().zip(&clip_units) {
                let value = range.over(*clip, &level.rows, &point_set_in(level, bounds));
                if value.lo >= -tolerance * unit {
                    return None;
                }
                own_value.hi = own_value.hi.max(value.hi);
            }
            let mut depth = -value.hi.max(own_value.hi);
            for ((other, level), unit) in cutters.iter().zip(&cutter_units) {
                let value = range.over(*other, &level.rows, &point_set_in(level, bounds));
                if value.hi <= tolerance * unit {
                    return None;
                }
                depth = depth.min(value.lo);
            }
            Some(depth)
        };
        let inner = without_margin(region);
        let full_size = longest_side(region, &inner).1;
        let mut pending = vec![inner];
        let mut is_proved = true;
        for _ in 0..MAX_BISECTIONS {
            let Some(bounds) = pending.pop() else { break };
            let (axis, side) = longest_side(region, &bounds);
            let points = region.point_set(bounds).bounds();
            let tolerance = F32_TOLERANCE
                * max_coordinate(&points.mapped(&region.rows)).max(max_coordinate(&bounds));
            let Some(depth) = removed_depth(&mut range, &bounds, tolerance) else {
                continue;
            };
            // No box around such a point can be proved: most failures end at the first box.
            let has_unproved_sample = |range: &mut MappedRange| {
                samples(&bounds).any(|point| removed_depth(range, &point, tolerance).is_some())
            };
            if depth > 0.0
                || side <= full_size * MIN_BOX_FRACTION
                || range.range.operations >= self.remaining_interval_operations
                || side == full_size && has_unproved_sample(&mut range)
            {
                is_proved = false;
                break;
            }
            let (low, high) = divided(&bounds, axis, &faces, tolerance);
            pending.extend([low, high]);
        }
        self.remaining_interval_operations = self
            .remaining_interval_operations
            .saturating_sub(range.range.operations);
        is_proved && pending.is_empty()
    }
}

impl CutterExtension<'_> {
    /// Returns the faces of the boxes of cutters in the frame of a region, as axes and coordinates. Of turned boxes there are none.
    fn faces_of(&mut self, region: &Region, cutters: &[(ShapeId, FrameMap)]) -> Vec<(usize, f64)> {
        let mut faces = Vec::new();
        if region.is_ring {
            return faces;
        }
        for (id, level) in cutters {
            let bounds = self.bounds(*id);
            let is_aligned = (0..3).all(|axis| aligned_column(&level.rows, axis).is_some());
            let to_region = inverse(level.rows.as_flattened()).filter(|_| is_aligned);
            let ends = to_region.map(|rows| bounds.mapped(&rows));
            for axis in 0..3 {
                let ends = ends
                    .iter()
                    .flat_map(|ends| [ends.min[axis], ends.max[axis]]);
                faces.extend(ends.filter(|end| end.is_finite()).map(|end| (axis, end)));
            }
        }
        faces
    }
}

/// Returns the bounds of a region without a margin at its faces, which may touch others.
fn without_margin(region: &Region) -> Bounds {
    let bounding_box = region.point_set(region.bounds).bounds();
    let margin = TOUCH_TOLERANCE
        * max_coordinate(&bounding_box.mapped(&region.rows)).max(max_coordinate(&bounding_box));
    let mut inner = region.bounds.grown(-margin);
    if region.is_ring {
        (inner.min[2], inner.max[2]) = (region.bounds.min[2], region.bounds.max[2]);
    }
    for axis in 0..3 {
        if inner.min[axis] > inner.max[axis] {
            (inner.min[axis], inner.max[axis]) = (region.bounds.min[axis], region.bounds.max[axis]);
        }
    }
    inner
}

/// Divides a box at a face inside of it, or else in the middle of an axis.
fn divided(
    bounds: &Bounds,
    axis: usize,
    faces: &[(usize, f64)],
    tolerance: f64,
) -> (Bounds, Bounds) {
    let middle = (bounds.min[axis] + bounds.max[axis]) / 2.0;
    let is_inside = |&&(axis, end): &&(usize, f64)| {
        let margin = tolerance + (bounds.max[axis] - bounds.min[axis]) * MIN_PART_FRACTION;
        bounds.min[axis] + margin < end && end < bounds.max[axis] - margin
    };
    let (axis, end) = *faces.iter().find(is_inside).unwrap_or(&(axis, middle));
    let (mut low, mut high) = (*bounds, *bounds);
    (low.max[axis], high.min[axis]) = (end, end);
    (low, high)
}

/// Returns points of a box on a grid, as boxes: its centre first.
fn samples(bounds: &Bounds) -> impl Iterator<Item = Bounds> {
    const FRACTIONS: [f64; 3] = [1.0 / 2.0, 1.0 / 6.0, 5.0 / 6.0];
    let coordinate = |axis: usize, index: usize| {
        bounds.min[axis] + FRACTIONS[index] * (bounds.max[axis] - bounds.min[axis])
    };
    (0..27).map(move |index| {
        let point = [
            coordinate(0, index % 3),
            coordinate(1, index / 3 % 3),
            coordinate(2, index / 9),
        ];
        Bounds {
            min: point,
            max: point,
        }
    })
}

/// Returns the axis of the longest side of a region, and its length; for a full turn the diameter.
fn longest_side(region: &Region, bounds: &Bounds) -> (usize, f64) {
    let length = |axis: usize| {
        let side = bounds.max[axis] - bounds.min[axis];
        match region.is_ring && axis == 2 {
            true => side * bounds.max[0] / std::f64::consts::PI,
            false => side,
        }
    };
    let sides = (0..3).map(|axis| (axis, length(axis)));
    sides.fold((0, f64::NEG_INFINITY), |best, next| {
        if next.1 > best.1 { next } else { best }
    })
}

/// Returns the largest finite coordinate of a box, in magnitude.
pub(super) fn max_coordinate(bounds: &Bounds) -> f64 {
    let ends = bounds.min.into_iter().chain(bounds.max);
    let finite = ends.filter(|end| end.is_finite());
    finite.fold(0.0, |max: f64, end| max.max(end.abs()))
}

/// Returns the overlap of two boxes along an axis that counts as none, in units of length.
fn overlap_tolerance(a: &Bounds, b: &Bounds, axis: usize) -> f64 {
    let ends = [a.min[axis], a.max[axis], b.min[axis], b.max[axis]];
    let finite = ends.into_iter().filter(|end| end.is_finite());
    TOUCH_TOLERANCE * finite.fold(0.0, |max: f64, end| max.max(end.abs()))
}

/// Reports whether two boxes have at most faces in common.
fn are_disjoint(a: &Bounds, b: &Bounds) -> bool {
    (0..3).any(|axis| {
        let tolerance = overlap_tolerance(a, b, axis);
        a.min[axis] + tolerance >= b.max[axis] || a.max[axis] - tolerance <= b.min[axis]
    })
}
