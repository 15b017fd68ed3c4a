//! Lipschitz bounds of shapes: bounds on how fast a shape's value, as it is written, changes within a
//! region.
//!
//! A bound follows from the rules of the table, operand by operand. For numbers that a scene writes itself
//! (fields, displacements, warps), a branch-and-bound search finds it. It holds for all points of the region
//! and for all values of the parameters.

use super::region_bounds::RegionBounds;
use super::{
    Budget, CappedField, FoundSlope, MAX_SLOPE_RATIO, SlopeScope, capped_field, contains,
    estimated_slope, has_discontinuities, pieces, slope_bound, steepest_sample, surface_slope,
};
use crate::analysis::bounds::ShapeBounds;
use crate::analysis::param_ranges::ParamRanges;
use crate::analysis::range::range_over;
use crate::expression::{ExprId, Expressions};
use crate::scene::{SceneRef, ShapeId, ShapeKind};
use sdfc_vm::apply::{OpResult, apply, pack_parameters};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::ops::map_bounds;
use sdfc_vm::row::SlopeRule;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::collections::HashMap;

/// Cache of the Lipschitz bounds of a scene's shapes, each computed on first use.
pub(crate) struct ShapeSlopes {
    ranges: ParamRanges,
    budget: Budget,
    /// Bounds of shapes that are the same in every region.
    constant_bounds: HashMap<ShapeId, f64>,
    /// Bounds of written numbers, by the corners of their region.
    number_bounds: HashMap<(Vec<ExprId>, [u64; 6]), Option<FoundSlope>>,
    /// Largest region in which numbers have a bound, and that bound, by numbers.
    largest_proved: HashMap<Vec<ExprId>, (Bounds, f64)>,
    /// Estimates of the same.
    estimates: HashMap<(Vec<ExprId>, [u64; 6]), f64>,
    /// Median slopes of numbers at their surface, by the corners of the shape's bounds.
    surface_slopes: HashMap<(ExprId, [u64; 6]), Option<f64>>,
    /// For each shape: its bound depends on the region.
    is_regional: Vec<bool>,
    /// Set while written numbers without a bound are estimated from sample points.
    is_estimating: bool,
    /// About half the size of the visible scene.
    size: f64,
    /// Fields that have changed since they were written.
    written: Vec<WrittenField>,
    /// Fields whose declared bound was tested, with a counterexample if there is one.
    tested: HashMap<ShapeId, Option<RefutedSlope>>,
    /// Values by which rays march on fields without a bound, by the corners of their region.
    capped: HashMap<(ShapeId, [u64; 6]), Option<CappedField>>,
    /// Steps on numbers with discontinuities, by the corners of their region.
    discontinuous_step: HashMap<(ExprId, [u64; 6], SlopeScope), Option<ExprId>>,
    /// Largest ratio of a stated slope to the estimate that a value was divided by, where rays may pass. Infinite without a
    /// statement; `None` if nothing was divided by an estimate.
    pub(crate) slope_over_estimate: Option<f64>,
    /// Set if a field has no close slope bound where its surface may be.
    pub(crate) meets_loose_bounds: bool,
    /// Set while bounds that the scene states are used beside those that are not close.
    uses_statements: bool,
    /// Set by a search without a close bound of a field.
    has_met_loose_bound: bool,
}

/// Counterexample to a field's declared slope.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RefutedSlope {
    /// Slope bound that the scene states.
    pub(crate) declared: f64,
    /// Slope at the point.
    pub(crate) slope: f64,
    /// Point in the frame of the field.
    pub(crate) point: [f64; 3],
}

/// Minimum ratio of a sampled slope to the declared one that cannot be due to rounding.
const MIN_REFUTING_RATIO: f64 = 1.0 + 1e-6;
/// Half side of the cube in which an infinite field is sampled, in sizes of the scene.
const SAMPLED_CUBE: f64 = 4.0;

/// Returns the corners of a region as keys.
fn corners(region: &Bounds) -> [u64; 6] {
    let [x, y, z] = region.min.map(f64::to_bits);
    let [u, v, w] = region.max.map(f64::to_bits);
    [x, y, z, u, v, w]
}

/// Field that has changed since it was written.
#[derive(Clone, Copy)]
pub(crate) struct WrittenField {
    pub(crate) shape: ShapeId,
    /// The value as written.
    pub(crate) value: ExprId,
    /// The stated bound of its slope.
    pub(crate) slope: Option<ExprId>,
}

impl ShapeSlopes {
    /// Returns a cache for a scene of about twice a size. `written` are the fields that have changed since they were written.
    pub(crate) fn new(scene: SceneRef<'_>, size: f64, written: Vec<WrittenField>) -> Self {
        Self {
            written,
            ranges: ParamRanges::for_scene(scene),
            budget: Budget::default(),
            constant_bounds: HashMap::new(),
            number_bounds: HashMap::new(),
            largest_proved: HashMap::new(),
            estimates: HashMap::new(),
            surface_slopes: HashMap::new(),
            is_regional: Vec::new(),
            is_estimating: false,
            size,
            tested: HashMap::new(),
            capped: HashMap::new(),
            discontinuous_step: HashMap::new(),
            slope_over_estimate: None,
            meets_loose_bounds: false,
            uses_statements: false,
            has_met_loose_bound: false,
        }
    }

    /// Returns the fields that have changed since they were written.
    pub(crate) fn written_fields(&self) -> &[WrittenField] {
        &self.written
    }

    /// Returns a field as written, if it has changed.
    fn written_field(&self, id: ShapeId) -> Option<&WrittenField> {
        self.written.iter().find(|it| it.shape == id)
    }

    /// Returns about half the size of the visible scene.
    pub(crate) fn size(&self) -> f64 {
        self.size
    }

    /// Returns a bound of the shape's slope within a region, in the frame of the shape; infinite if
    /// unknown. Recursion over nested shapes, whose depth the elaborator bounds.
    pub(crate) fn bound_in_region(
        &mut self,
        scene: SceneRef<'_>,
        boxes: &mut ShapeBounds,
        id: ShapeId,
        region: &Bounds,
    ) -> f64 {
        if !self.varies(scene, id)
            && let Some(&cached) = self.constant_bounds.get(&id)
        {
            return cached;
        }
        let bound = self.compute(scene, boxes, id, region);
        let bound = if bound >= 0.0 { bound } else { f64::INFINITY };
        if !self.varies(scene, id) {
            self.constant_bounds.insert(id, bound);
        }
        bound
    }

    /// Returns a bound of the shape's slope within a region by all that the scene states; infinite if unknown.
    pub(crate) fn stated_in_region(
        &mut self,
        scene: SceneRef<'_>,
        boxes: &mut ShapeBounds,
        id: ShapeId,
        region: &Bounds,
    ) -> f64 {
        self.uses_statements = true;
        let bound = self.bound_in_region(scene, boxes, id, region);
        self.uses_statements = false;
        bound
    }

    /// Notes that a value was divided by an estimate, and the ratio of its stated slope to that.
    pub(crate) fn note_estimate(&mut self, ratio: f64) {
        let largest = self.slope_over_estimate.map_or(ratio, |it| it.max(ratio));
        self.slope_over_estimate = Some(largest);
    }

    /// Reports whether a field of a shape has no close slope bound in a region. Bounds that the scene states have no
    /// influence.
    pub(crate) fn has_loose_bounds(
        &mut self,
        scene: SceneRef<'_>,
        boxes: &mut ShapeBounds,
        id: ShapeId,
        region: &Bounds,
    ) -> bool {
        self.has_met_loose_bound = false;
        self.compute(scene, boxes, id, region);
        self.has_met_loose_bound
    }

    /// Returns an estimate of a shape's slope in a region, for use where there is no bound. It is twice
    /// the slope that nine tenths of the sample points of its written numbers do not exceed.
    pub(crate) fn estimate(
        &mut self,
        scene: SceneRef<'_>,
        boxes: &mut ShapeBounds,
        id: ShapeId,
        region: &Bounds,
    ) -> f64 {
        self.is_estimating = true;
        let guess = self.compute(scene, boxes, id, region);
        self.is_estimating = false;
        if guess.is_finite() { guess } else { 1.0 }
    }

    /// Returns the median slope of a number at the surface of its shape; see [`surface_slope`].
    pub(crate) fn at_surface(
        &mut self,
        expressions: &Expressions,
        number: ExprId,
        bounds: &Bounds,
    ) -> Option<f64> {
        *self
            .surface_slopes
            .entry((number, corners(bounds)))
            .or_insert_with(|| surface_slope(expressions, number, bounds, &self.ranges))
    }

    /// Returns the values by which rays march on a field whose slope has no bound in a region; see
    /// [`capped_field`].
    pub(crate) fn capped(
        &mut self,
        scene: SceneRef<'_>,
        id: ShapeId,
        region: &Bounds,
    ) -> Option<CappedField> {
        let ShapeKind::Field { value, .. } = scene.shapes[id.0 as usize].kind else {
            return None;
        };
        let (graph, ranges) = (scene.expressions, &self.ranges);
        *self
            .capped
            .entry((id, corners(region)))
            .or_insert_with(|| capped_field(graph, value, region, ranges))
    }

    /// Reports whether a bound of a number's slope in a region is so far above its median slope there
    /// that it is useless for marching.
    pub(crate) fn exceeds_median_slope(
        &mut self,
        expressions: &Expressions,
        number: ExprId,
        bound: f64,
        region: &Bounds,
    ) -> bool {
        let (ranges, budget) = (&self.ranges, &mut self.budget);
        let mut region_bounds = RegionBounds::new(region, self.size, ranges, budget);
        let usual = region_bounds.median_slope(expressions, number);
        usual.is_some_and(|usual| bound > usual * MAX_SLOPE_RATIO)
    }

    /// Returns a written number with discontinuities, as a step that is safe in a region; see
    /// [`pieces`]. `None` for a continuous number with a slope bound, and where no step is found.
    pub(crate) fn discontinuous_step(
        &mut self,
        expressions: &mut Expressions,
        number: ExprId,
        region: &Bounds,
        scope: SlopeScope,
    ) -> Option<ExprId> {
        if scope == SlopeScope::Region && !has_discontinuities(expressions, number) {
            return None;
        }
        let key = (number, corners(region), scope);
        if let Some(&step) = self.discontinuous_step.get(&key) {
            return step;
        }
        let sampled = self.sampled_region(region);
        let step = match self.proved_slope(expressions, &[number], region) {
            Some(_) => None,
            None => {
                let (ranges, budget) = (&self.ranges, &mut self.budget);
                pieces::step(
                    expressions,
                    number,
                    scope,
                    [region, &sampled],
                    self.size,
                    ranges,
                    budget,
                )
            }
        };
        self.discontinuous_step.insert(key, step);
        step
    }

    /// Reports whether a shape's bound depends on the region.
    pub(crate) fn varies(&mut self, scene: SceneRef<'_>, id: ShapeId) -> bool {
        while self.is_regional.len() <= id.0 as usize {
            let kind = &scene.shapes[self.is_regional.len()].kind;
            let is_own = match kind {
                ShapeKind::Field { .. } | ShapeKind::Warp { .. } | ShapeKind::Displace { .. } => {
                    true
                }
                ShapeKind::Domain { op, .. } => matches!(op, Op::Twist | Op::Bend),
                _ => false,
            };
            let varies = is_own
                || crate::scene::children(kind)
                    .iter()
                    .any(|child| self.is_regional[child.0 as usize]);
            self.is_regional.push(varies);
        }
        self.is_regional[id.0 as usize]
    }

    fn compute(
        &mut self,
        scene: SceneRef<'_>,
        boxes: &mut ShapeBounds,
        id: ShapeId,
        region: &Bounds,
    ) -> f64 {
        match &scene.shapes[id.0 as usize].kind {
            ShapeKind::Primitive { op, parameters } => {
                self.by_rule(scene, *op, parameters, [0.0; 0])
            }
            ShapeKind::Polygon { .. } => 1.0,
            ShapeKind::Nothing => 0.0,
            ShapeKind::Field { value, slope, .. } => {
                let bound = self.written_slope(scene, &[*value], region);
                let found = self.proved_slope(scene.expressions, &[*value], region);
                let is_close = found.is_some_and(|found| found.is_close);
                self.has_met_loose_bound |= !is_close;
                let is_used = self.uses_statements && !is_close;
                let Some(slope) = slope.filter(|_| is_used) else {
                    return bound;
                };
                match self.find_refutation(scene, boxes, (id, *value), slope) {
                    Some(_) => bound,
                    None if self.covers_region(scene, boxes, id, region) => {
                        bound.min(self.range(scene, slope).hi)
                    }
                    None => bound,
                }
            }
            ShapeKind::Combine {
                op,
                children,
                parameters,
            } => {
                let first = self.bound_in_region(scene, boxes, children[0], region);
                children[1..].iter().fold(first, |sum, &child| {
                    let next = self.bound_in_region(scene, boxes, child, region);
                    self.by_rule(scene, *op, parameters, [sum, next])
                })
            }
            // The scale compensates for the stretch of the matrix; see `ShapeKind::Frame`.
            ShapeKind::Frame { child, matrix, .. } => {
                let rows = matrix.map(|id| self.range(scene, id));
                let inner_region = region.mapped_within(&rows);
                self.bound_in_region(scene, boxes, *child, &inner_region)
            }
            ShapeKind::Repeat { child, .. } => {
                let inner_region = boxes.repetition_cells(scene, id).intersection(region);
                let inner_region = if inner_region.is_empty() {
                    *region
                } else {
                    inner_region
                };
                self.bound_in_region(scene, boxes, *child, &inner_region)
            }
            ShapeKind::Polar { child, .. } => {
                let inner_region = rotated_region(region, scene.shapes[id.0 as usize].is_2d);
                self.bound_in_region(scene, boxes, *child, &inner_region)
            }
            ShapeKind::Domain {
                op,
                child,
                parameters,
            } => {
                let (stretch, inner_region) = self.point_map_bound(scene, *op, parameters, region);
                stretch * self.bound_in_region(scene, boxes, *child, &inner_region)
            }
            ShapeKind::Warp { child, point } => {
                let stretch = self.written_slope(scene, point, region);
                let mut inner_region = *region;
                for (axis, &number) in point.iter().enumerate() {
                    let range = range_over(scene.expressions, number, region, &self.ranges);
                    (inner_region.min[axis], inner_region.max[axis]) = (range.lo, range.hi);
                }
                stretch * self.bound_in_region(scene, boxes, *child, &inner_region)
            }
            ShapeKind::Distance {
                op,
                child,
                parameters,
            } => {
                let inner_region = self.bound_in_region(scene, boxes, *child, region);
                self.by_rule(scene, *op, parameters, [inner_region])
            }
            ShapeKind::Displace { child, amount } => {
                let amount = self.written_slope(scene, &[*amount], region);
                amount + self.bound_in_region(scene, boxes, *child, region)
            }
            ShapeKind::Painted { child, .. } => self.bound_in_region(scene, boxes, *child, region),
        }
    }

    /// Returns a sample point at which a field is steeper than the scene declares, if there is one.
    pub(crate) fn find_refutation(
        &mut self,
        scene: SceneRef<'_>,
        boxes: &mut ShapeBounds,
        (id, value): (ShapeId, ExprId),
        slope: ExprId,
    ) -> Option<RefutedSlope> {
        if let Some(cached) = self.tested.get(&id) {
            return *cached;
        }
        let stated = self.written_field(id).and_then(|written| written.slope);
        let declared = self.range(scene, stated.unwrap_or(slope)).hi;
        let refuted = self
            .steepest_near(scene, boxes, id, value)
            .filter(|(slope, _)| *slope > declared * MIN_REFUTING_RATIO)
            .map(|(slope, point)| RefutedSlope {
                declared,
                slope,
                point,
            });
        self.tested.insert(id, refuted);
        refuted
    }

    /// Returns the greatest slope of a field's value as written, at points sampled near its shape, and its point.
    pub(crate) fn steepest_near(
        &self,
        scene: SceneRef<'_>,
        boxes: &mut ShapeBounds,
        id: ShapeId,
        value: ExprId,
    ) -> Option<(f64, [f64; 3])> {
        let value = self
            .written_field(id)
            .map_or(value, |written| written.value);
        let region = self.sampled_region(&near_region(&boxes.get(scene, id)));
        steepest_sample(scene.expressions, &[value], &region, &self.ranges)
    }

    /// Returns the part of a region in which points are sampled.
    fn sampled_region(&self, region: &Bounds) -> Bounds {
        match region.is_finite() {
            true => *region,
            false => region.intersection(&Bounds::centred([self.size * SAMPLED_CUBE; 3])),
        }
    }

    /// Reports whether a declared bound may be used in a region of a field's frame.
    ///
    /// A finite field may grow ever faster farther out, where its author did not consider the bound: it
    /// is not used there. For an infinite field it is assumed to hold everywhere.
    fn covers_region(
        &self,
        scene: SceneRef<'_>,
        boxes: &mut ShapeBounds,
        id: ShapeId,
        region: &Bounds,
    ) -> bool {
        let bounds = boxes.get(scene, id);
        if !bounds.is_finite() {
            return true;
        }
        let near_box = bounds.grown(bounds.half_diagonal());
        (0..3).all(|axis| {
            near_box.min[axis] <= region.min[axis] && region.max[axis] <= near_box.max[axis]
        })
    }

    /// Returns the fields whose declared bounds do not hold, in order.
    pub(crate) fn refuted_slopes(&self) -> Vec<(ShapeId, RefutedSlope)> {
        let refuted = self
            .tested
            .iter()
            .filter_map(|(&id, refuted)| Some((id, (*refuted)?)));
        let mut refuted: Vec<_> = refuted.collect();
        refuted.sort_by_key(|(id, _)| *id);
        refuted
    }

    /// Returns the bound by an operation's rule, for operands with these bounds and for all values of
    /// its parameters.
    fn by_rule<const N: usize>(
        &mut self,
        scene: SceneRef<'_>,
        op: Op,
        parameters: &[ExprId],
        operands: [f64; N],
    ) -> f64 {
        op.row().facts.slope.bound(&operands, 1.0, |rule| {
            larger_at_ends(&self.parameter_ends(scene, parameters), rule)
        })
    }

    /// Returns the stretch of a point map on a region, and a box around the image of the region.
    fn point_map_bound(
        &mut self,
        scene: SceneRef<'_>,
        op: Op,
        parameters: &[ExprId],
        region: &Bounds,
    ) -> (f64, Bounds) {
        let max_stretch = match op.row().facts.slope {
            SlopeRule::Fold => 1.0,
            SlopeRule::PointMap(stretch) => {
                let ends = self.parameter_ends(scene, parameters);
                larger_at_ends(&ends, |numbers| stretch(numbers, region))
            }
            _ => return (f64::INFINITY, Bounds::ALL_SPACE),
        };
        let inner = match op {
            Op::Twist => map_bounds::polar(&[], region),
            Op::Bend => map_bounds::polar_plane(&[], region),
            _ => self.image(scene, op, parameters, region),
        };
        (max_stretch.max(1.0), inner)
    }

    /// Returns a box around the image of a region under a point map, by interval arithmetic.
    fn image(
        &mut self,
        scene: SceneRef<'_>,
        op: Op,
        parameters: &[ExprId],
        region: &Bounds,
    ) -> Bounds {
        let numbers: Vec<Interval> = parameters.iter().map(|&id| self.range(scene, id)).collect();
        if numbers.iter().any(|range| range.lo != range.hi) {
            return Bounds::ALL_SPACE;
        }
        let numbers: Vec<f64> = numbers.iter().map(|range| range.lo).collect();
        let [x, y, z] = [0, 1, 2].map(|axis| Interval {
            lo: region.min[axis],
            hi: region.max[axis],
        });
        let none = [Interval::point(0.0); 3];
        match apply(op, V3::new(x, y, z), none, &pack_parameters(op, &numbers)) {
            OpResult::Point(p) => Bounds {
                min: [p.x.lo, p.y.lo, p.z.lo],
                max: [p.x.hi, p.y.hi, p.z.hi],
            },
            OpResult::Value(_) => Bounds::ALL_SPACE,
        }
    }

    /// Returns a slope bound of numbers of point stage, or an estimate; infinite if unknown.
    fn written_slope(&mut self, scene: SceneRef<'_>, numbers: &[ExprId], region: &Bounds) -> f64 {
        if let Some(found) = self.proved_slope(scene.expressions, numbers, region) {
            return found.bound;
        }
        if !self.is_estimating {
            return f64::INFINITY;
        }
        let key = (numbers.to_vec(), corners(region));
        let (graph, ranges) = (scene.expressions, &self.ranges);
        let guess = self.estimates.entry(key);
        *guess.or_insert_with(|| estimated_slope(graph, numbers, region, ranges).max(MIN_SLOPE))
    }

    /// Returns a slope bound of numbers of point stage, searched once per region.
    fn proved_slope(
        &mut self,
        expressions: &Expressions,
        numbers: &[ExprId],
        region: &Bounds,
    ) -> Option<FoundSlope> {
        let key = (numbers.to_vec(), corners(region));
        if let Some(&cached) = self.number_bounds.get(&key) {
            return cached;
        }
        let sampled = self.sampled_region(region);
        let (ranges, budget) = (&self.ranges, &mut self.budget);
        let known = self.largest_proved.get(numbers).copied();
        let known = known.filter(|(known_region, _)| contains(region, known_region));
        let found = slope_bound(expressions, numbers, region, known, ranges, budget);
        let found = found.or_else(|| match numbers {
            &[number] if has_discontinuities(expressions, number) => {
                let regions = [region, &sampled];
                let (size, ranges) = (self.size, &self.ranges);
                let bound = pieces::continuous(expressions, number, regions, size, ranges, budget)?;
                let steepest = steepest_sample(expressions, numbers, &sampled, ranges);
                Some(FoundSlope::new(
                    bound,
                    steepest.map_or(0.0, |(slope, _)| slope),
                ))
            }
            _ => None,
        });
        let found = found.map(|found| FoundSlope {
            bound: found.bound.max(MIN_SLOPE),
            ..found
        });
        if let Some(FoundSlope { bound, .. }) = found {
            let entry = self.largest_proved.entry(numbers.to_vec());
            let largest = entry.or_insert((*region, bound));
            if contains(region, &largest.0) {
                *largest = (*region, bound);
            }
        }
        self.number_bounds.insert(key, found);
        found
    }

    /// Returns the range of a uniform number.
    fn range(&self, scene: SceneRef<'_>, id: ExprId) -> Interval {
        self.ranges.number(scene.expressions, id)
    }

    /// Returns the lower and the upper end of each parameter's range. Rules grow with the magnitudes of
    /// parameters, so the maximum is at an end.
    fn parameter_ends(&self, scene: SceneRef<'_>, parameters: &[ExprId]) -> [Vec<f64>; 2] {
        let ranges: Vec<_> = parameters.iter().map(|&id| self.range(scene, id)).collect();
        [
            ranges.iter().map(|range| range.lo).collect(),
            ranges.iter().map(|range| range.hi).collect(),
        ]
    }
}

/// Distance around a shape's box in which its own value is used, as a fraction of the box's half
/// diagonal.
const MARGIN_FRACTION: f64 = 0.1;

/// Returns the region around a shape's box in which its own value is used.
pub(crate) fn near_region(bounds: &Bounds) -> Bounds {
    match bounds.is_finite() {
        true => bounds.grown(margin(bounds)),
        false => *bounds,
    }
}

/// Returns the distance around a shape's box in which its own value is used.
pub(crate) fn margin(bounds: &Bounds) -> f64 {
    bounds.half_diagonal() * MARGIN_FRACTION
}

/// Minimum slope that a value is divided by.
const MIN_SLOPE: f64 = 1e-30;

/// Returns the larger of a rule's results at both ends of its parameters.
fn larger_at_ends(ends: &[Vec<f64>; 2], rule: impl Fn(&[f64]) -> f64) -> f64 {
    ends.iter()
        .map(|numbers| rule(numbers))
        .fold(0.0, |max, slope| {
            // NaN is no bound.
            if slope >= 0.0 {
                max.max(slope)
            } else {
                f64::INFINITY
            }
        })
}

/// Returns a region rotated by all angles about the axis of polar copies.
fn rotated_region(region: &Bounds, is_2d: bool) -> Bounds {
    if is_2d {
        map_bounds::polar_plane(&[], region)
    } else {
        map_bounds::polar(&[], region)
    }
}
