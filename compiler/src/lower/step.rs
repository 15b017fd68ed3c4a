//! Safe steps: a written value becomes one that changes no faster than the point moves.
//!
//! The sign stays, and so does the surface. A value is divided by a Lipschitz bound. For a finite shape
//! the bound need hold near it only, and farther out the distance to its box is used. For an infinite
//! shape whose bound grows with the region, the divisor is a power of the distance from the origin.

use super::{LocalPoint, Lowering};
use crate::analysis::definedness::parts_by_definedness;
use crate::analysis::param_ranges::ParamRanges;
use crate::analysis::shape_range::ShapeRange;
use crate::analysis::slope::{
    CappedField, MAX_SLOPE, RefutedSlope, SlopeScope, has_discontinuities, is_unmarchable, margin,
    near_region,
};
use crate::analysis::visible_bounds::farthest;
use crate::elaborate::{field_without_inside, format_short};
use crate::expression::ExprId;
use crate::formula::numbers;
use crate::graph::{GraphNode, GraphNumber, NodeId};
use crate::scene::{NO_SURFACE_DISTANCE, SceneRef, ShapeId, ShapeKind, children};
use crate::written_value::written_value;
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::table::{Op, prepare};
use std::collections::HashSet;
use std::ops::RangeInclusive;

/// Maximum ratio by which a bound that counts as one exceeds it, for rounding.
const MAX_UNIT_RATIO: f64 = 1.0 + 1e-9;
/// Distance that exceeds the length of any ray, but can still be scaled.
const BEYOND_ALL_RAYS: f32 = 1e9;
/// Minimum slope: a flatter shape has no surface that `f32` could find.
const MIN_SLOPE: f64 = 1e-18;
/// Maximum slope that a message advises to state: steps for a greater one are too short to be useful.
const MAX_STATED_SLOPE: f64 = 1e3;
/// Minimum distance at which a message advises to end a field. In larger scenes it is their size.
const MIN_ADVISED_END: f64 = 4.0;
/// Slopes that are divided by in `f32`.
const REPRESENTABLE_SLOPES: RangeInclusive<f64> = 1e-30..=1e30;
/// Largest value at undefined points, below the end of `f32`.
const MAX_OUTSIDE_DISTANCE: f64 = 1e38;
/// Minimum ratio of two bounds for the smaller one to be used.
const MIN_IMPROVEMENT: f64 = 1.25;
/// Half side of a cube, in sizes of the scene. A finite shape that extends beyond it is treated as
/// infinite.
const MAX_FINITE_HALF_SIDE: f64 = 4.0;
/// Maximum exponent of a slope's growth, in halves.
const MAX_EXPONENT_HALVES: u32 = 48;
/// Distance within which the exponent is chosen for the longest steps, in sizes of the scene.
const EXPONENT_RANGE: f64 = 8.0;
/// Distance by which a shape is drawn beyond the region that others leave to it, in half diagonals of
/// that region.
const REGION_MARGIN: f64 = 0.01;
/// Half side of the cube that contains all rays, in sizes of the scene.
const RAY_HALF_SIDE: f64 = 1e6;
/// Half side of the cube that contains most rays, in the same unit. Where no bound holds in all of it, the slope counts as
/// estimated.
const MIN_BOUNDED_RATIO: f64 = 64.0;

impl Lowering<'_> {
    /// Converts a written value of a shape to a safe step to its surface.
    pub(super) fn step(&mut self, node: NodeId, id: ShapeId, local_point: LocalPoint) -> NodeId {
        // Nothing marches on a 2-D scene.
        if self.scene.shapes[id.0 as usize].is_2d && self.scene.is_2d {
            return self.comparable(node, id, local_point);
        }
        self.warn_without_inside(id);
        let discontinuous = self.discontinuous_number(id);
        if let Some(node) = self.piecewise(
            discontinuous,
            &Bounds::ALL_SPACE,
            SlopeScope::Region,
            local_point,
        ) {
            return node;
        }
        let own_bounds = self.boxes.get(SceneRef::from(&*self.scene), id);
        let mut bounds = own_bounds.intersection(&local_point.region);
        let unit = self.slopes.size() * local_point.unit;
        let global_slope = self.global_slope(id, &bounds, unit);
        if is_unit_slope(global_slope) || global_slope < MIN_SLOPE {
            return node;
        }
        if bounds.is_finite() && !bounds.is_empty() {
            // Where a region ends at another operand, no surface of both is created.
            let region_margin = bounds.half_diagonal() * REGION_MARGIN;
            bounds = bounds.grown(region_margin).intersection(&own_bounds);
        }
        if bounds.is_empty() {
            // There is no surface to step over, and the value must not look like one.
            return self
                .graph
                .add(GraphNode::Constant(GraphNumber::Constant(BEYOND_ALL_RAYS)));
        }
        let extent = farthest(bounds.min.into_iter().chain(bounds.max));
        let is_large = extent.is_some_and(|extent| extent > MAX_FINITE_HALF_SIDE * unit);
        if bounds.is_finite() && !is_large {
            let margin = margin(&bounds);
            if let Some(node) = self.piecewise(
                discontinuous,
                &near_region(&bounds),
                SlopeScope::PerPoint,
                local_point,
            ) {
                return self.bounded(
                    node,
                    &bounds,
                    [margin, max_surface_distance(&bounds)],
                    local_point,
                );
            }
            let unbounded = self.unbounded_number(id, &near_region(&bounds));
            if let Some(node) = self.piecewise(
                unbounded,
                &near_region(&bounds),
                SlopeScope::PerPoint,
                local_point,
            ) {
                return self.bounded(
                    node,
                    &bounds,
                    [margin, max_surface_distance(&bounds)],
                    local_point,
                );
            }
            let (node, near_slope) = self.clamp_poles(node, id, &near_region(&bounds), local_point);
            if near_slope * MIN_IMPROVEMENT > global_slope {
                return self.divide_by_slope(node, global_slope, local_point);
            }
            let divided = self.divide_by_slope(node, near_slope, local_point);
            // A field too steep for `f32` may have a surface anywhere.
            let limit = match near_slope < MAX_SLOPE {
                true => max_surface_distance(&bounds),
                false => margin,
            };
            return self.bounded(divided, &bounds, [margin, limit], local_point);
        }
        if let Some(node) = self.piecewise(
            discontinuous,
            &Bounds::ALL_SPACE,
            SlopeScope::PerPoint,
            local_point,
        ) {
            return node;
        }
        let unbounded = self.unbounded_number(id, &Bounds::centred([unit; 3]));
        if let Some(node) = self.piecewise(
            unbounded,
            &Bounds::ALL_SPACE,
            SlopeScope::PerPoint,
            local_point,
        ) {
            return node;
        }
        let inner_slope = self.slope_or_estimate(id, &Bounds::centred([unit; 3]));
        if inner_slope * MIN_IMPROVEMENT > global_slope {
            return self.divide_by_slope(node, global_slope, local_point);
        }
        let growth = self.slope_growth(id, unit, inner_slope, global_slope);
        let outer_slope = growth.last().map_or(inner_slope, |cube| cube.outer);
        if inner_slope * MIN_IMPROVEMENT > outer_slope {
            return self.divide_by_slope(node, outer_slope, local_point);
        }
        let (factor, exponent) = fit_power_law(&growth, inner_slope);
        self.apply_constants(
            Op::FieldGrowth,
            local_point,
            node,
            &[unit, inner_slope, factor, exponent],
        )
    }

    /// Divides an operand of a set operation by its slope at the surface. A factor on a raw field then changes
    /// neither the order of operands inside several of them nor the edge of a thin one.
    fn comparable(&mut self, node: NodeId, id: ShapeId, local_point: LocalPoint) -> NodeId {
        let is_raw = |_, kind: &ShapeKind| matches!(kind, ShapeKind::Field { .. });
        if !self.has_operands || !self.find_shape(id, is_raw) {
            return node;
        }
        let number = match self.scene.shapes[id.0 as usize].kind {
            ShapeKind::Field { value, .. } => Some(value),
            _ => written_value(self.scene, id),
        };
        let bounds = self.boxes.get(SceneRef::from(&*self.scene), id);
        let expressions = &self.scene.expressions;
        let slope = number.and_then(|it| self.slopes.at_surface(expressions, it, &bounds));
        match slope {
            Some(slope) if REPRESENTABLE_SLOPES.contains(&slope) => {
                let scaled = number.and_then(|it| self.with_outside_times(it, slope));
                let node = scaled.map_or(node, |it| self.field(it, local_point));
                self.divide_by_slope(node, slope, local_point)
            }
            _ => node,
        }
    }

    /// Returns a field whose value at undefined points is multiplied by a factor; `None` if it is defined everywhere.
    fn with_outside_times(&mut self, number: ExprId, factor: f64) -> Option<ExprId> {
        let expressions = &mut self.scene.expressions;
        let [undefined, value] = parts_by_definedness(expressions, number)?;
        let outside = (NO_SURFACE_DISTANCE * factor).min(MAX_OUTSIDE_DISTANCE);
        let outside = expressions.constant(outside);
        Some(expressions.call(Op::Select, &[undefined, outside, value]))
    }

    /// Restricts a value to the neighbourhood of its shape's box; farther out, the distance to the box
    /// is used.
    fn bounded(
        &mut self,
        node: NodeId,
        bounds: &Bounds,
        [margin, limit]: [f64; 2],
        local_point: LocalPoint,
    ) -> NodeId {
        let corners = bounds.min.into_iter().chain(bounds.max);
        let numbers: Vec<f64> = corners.chain([margin, limit]).collect();
        self.apply_constants(Op::Bounded, local_point, node, &numbers)
    }

    /// Returns the value of a shape with discontinuous operations, as a number.
    fn discontinuous_number(&mut self, id: ShapeId) -> Option<ExprId> {
        match self.scene.shapes[id.0 as usize].kind {
            _ if !self.contains_discontinuities(id) => None,
            ShapeKind::Field { value, .. } => Some(value),
            _ => written_value(self.scene, id),
        }
    }

    /// Returns the value of a shape whose slope has no bound in a region, or none to march by, as a
    /// number.
    fn unbounded_number(&mut self, id: ShapeId, region: &Bounds) -> Option<ExprId> {
        if self.slope(id, region).is_finite() {
            return None;
        }
        let scene_ref = SceneRef::from(&*self.scene);
        // Nothing marches by numbers beyond the range of `f32`.
        if self.slopes.estimate(scene_ref, self.boxes, id, region) >= MAX_SLOPE {
            return None;
        }
        let capped = self.slopes.capped(scene_ref, id, region);
        let number = match self.scene.shapes[id.0 as usize].kind {
            ShapeKind::Field { value, .. } => value,
            _ => written_value(self.scene, id)?,
        };
        let Some(slope) = capped.and_then(|capped| capped.slope) else {
            return Some(number);
        };
        let expressions = &self.scene.expressions;
        let is_far = self
            .slopes
            .exceeds_median_slope(expressions, number, slope, region);
        is_far.then_some(number)
    }

    /// Lowers a number with discontinuities as a step that is safe in a region. The step is built piece
    /// by piece, whatever slope is declared.
    fn piecewise(
        &mut self,
        number: Option<ExprId>,
        region: &Bounds,
        scope: SlopeScope,
        local_point: LocalPoint,
    ) -> Option<NodeId> {
        let expressions = &mut self.scene.expressions;
        let step = self
            .slopes
            .discontinuous_step(expressions, number?, region, scope)?;
        Some(self.field(step, local_point))
    }

    /// Reports whether a shape contains discontinuous operations.
    fn contains_discontinuities(&self, id: ShapeId) -> bool {
        self.find_shape(id, |_, kind| {
            let is_discontinuous =
                |&number: &ExprId| has_discontinuities(&self.scene.expressions, number);
            numbers(kind).iter().any(is_discontinuous)
        })
    }

    /// Reports whether a condition holds for a shape or for one below it.
    pub(super) fn find_shape(
        &self,
        root: ShapeId,
        mut condition: impl FnMut(ShapeId, &ShapeKind) -> bool,
    ) -> bool {
        let (mut visited, mut pending) = (HashSet::from([root]), vec![root]);
        while let Some(id) = pending.pop() {
            let kind = &self.scene.shapes[id.0 as usize].kind;
            if condition(id, kind) {
                return true;
            }
            pending.extend(
                children(kind)
                    .iter()
                    .filter(|&&child| visited.insert(child)),
            );
        }
        false
    }

    /// Returns a value and a bound of its slope in a region. If only poles prevent a bound, deep inside
    /// or far from the surface, the values there are clamped.
    fn clamp_poles(
        &mut self,
        node: NodeId,
        id: ShapeId,
        region: &Bounds,
        local_point: LocalPoint,
    ) -> (NodeId, f64) {
        if self.slope(id, region).is_infinite() {
            let scene_ref = SceneRef::from(&*self.scene);
            if let Some(CappedField { values, slope }) = self.slopes.capped(scene_ref, id, region) {
                let mut end = |node: NodeId, op: Op, end: f64| match end.is_finite() {
                    true => {
                        let end = GraphNode::Constant(GraphNumber::Constant(end as f32));
                        let end = self.graph.add(end);
                        self.apply(op, local_point, vec![node, end], Vec::new())
                    }
                    false => node,
                };
                let node = end(node, Op::Max, values.lo);
                let node = end(node, Op::Min, values.hi);
                let slope = slope.map(|slope| slope.max(MIN_SLOPE));
                return (
                    node,
                    slope.unwrap_or_else(|| self.slope_or_estimate(id, region)),
                );
            }
        }
        (node, self.slope_or_estimate(id, region))
    }

    /// Warns of a field that intervals prove to be negative nowhere: its zeros are no surface.
    fn warn_without_inside(&mut self, id: ShapeId) {
        let shape = &self.scene.shapes[id.0 as usize];
        let ShapeKind::Field { region, .. } = shape.kind else {
            return;
        };
        let (span, scene_ref) = (shape.span, SceneRef::from(&*self.scene));
        if !self.checked_for_inside.insert(id) {
            return;
        }
        let ranges = ParamRanges::for_scene(scene_ref);
        let mut uniform = |id| ranges.number(&self.scene.expressions, id);
        let value = ShapeRange::new(scene_ref, &mut uniform).range_in_box(id, &region);
        if value.lo >= 0.0 {
            self.diagnostics.push(field_without_inside(span));
        }
    }

    /// Returns the slope bounds of a shape in cubes around the origin, each twice as large as the one
    /// before. It ends where rays or bounds do.
    fn slope_growth(
        &mut self,
        id: ShapeId,
        side: f64,
        inner_slope: f64,
        global_slope: f64,
    ) -> Vec<Cube> {
        let is_guessed = self.unbounded.contains(&id);
        let mut cubes = Vec::new();
        let (mut ratio, mut inner) = (1.0, inner_slope);
        while ratio < RAY_HALF_SIDE {
            let region = Bounds::centred([2.0 * ratio * side; 3]);
            let bound = match is_guessed {
                true => self.slope_or_estimate(id, &region),
                false => self.outer_slope(id, &region),
            };
            let outer = bound.max(inner).min(global_slope);
            // Values that grow ever faster are too steep to march by any bound.
            if outer >= MAX_SLOPE {
                if ratio < MIN_BOUNDED_RATIO {
                    self.slopes.note_estimate(f64::INFINITY);
                }
                break;
            }
            cubes.push(Cube {
                ratio,
                inner,
                outer,
            });
            (ratio, inner) = (2.0 * ratio, outer);
        }
        cubes
    }

    /// Returns a bound of a shape's slope in all of space; infinite if unknown. Notes for the settings if its fields lack close
    /// bounds where its surface may be, in `bounds` or near the origin.
    fn global_slope(&mut self, id: ShapeId, bounds: &Bounds, unit: f64) -> f64 {
        let scene_ref = SceneRef::from(&*self.scene);
        let region = match bounds.is_finite() {
            true => near_region(bounds),
            false => Bounds::centred([unit; 3]),
        };
        let mut is_loose =
            |region| (self.slopes).has_loose_bounds(scene_ref, self.boxes, id, region);
        let is_loose = is_loose(&Bounds::ALL_SPACE) && is_loose(&region);
        self.slopes.meets_loose_bounds |= is_loose;
        self.slope(id, &Bounds::ALL_SPACE)
    }

    /// Returns a bound of a shape's slope in a region of its frame; infinite if unknown.
    fn slope(&mut self, id: ShapeId, region: &Bounds) -> f64 {
        let scene_ref = SceneRef::from(&*self.scene);
        self.slopes
            .bound_in_region(scene_ref, self.boxes, id, region)
    }

    /// Returns the same for a region that begins beyond the scene. A value that grows ever faster
    /// there, as a polynomial does, needs no bound. For any other value without a bound the slope is
    /// estimated.
    fn outer_slope(&mut self, id: ShapeId, region: &Bounds) -> f64 {
        let slope = self.slope(id, region);
        if slope.is_finite() {
            return slope;
        }
        let scene_ref = SceneRef::from(&*self.scene);
        let guess = self.slopes.estimate(scene_ref, self.boxes, id, region);
        match is_unmarchable(guess) {
            true => f64::INFINITY,
            false => self.slope_or_estimate(id, region),
        }
    }

    /// Returns the bound or, where there is none, an estimate, with one warning per shape.
    fn slope_or_estimate(&mut self, id: ShapeId, region: &Bounds) -> f64 {
        let slope = self.slope(id, region);
        if slope.is_finite() {
            return slope.max(MIN_SLOPE);
        }
        let scene_ref = SceneRef::from(&*self.scene);
        let guess = self.slopes.estimate(scene_ref, self.boxes, id, region);
        let divisor = guess.clamp(MIN_SLOPE, MAX_SLOPE);
        let stated = (self.slopes).stated_in_region(scene_ref, self.boxes, id, region);
        // A statement guides steps only: the values are those without it.
        self.slopes.note_estimate(stated / divisor);
        if stated.is_infinite() && self.unbounded.insert(id) {
            let shape = &self.scene.shapes[id.0 as usize];
            let (sampled_slope, may_state_end) = match &shape.kind {
                ShapeKind::Field {
                    value,
                    slope: None,
                    region,
                } => (
                    self.slopes.steepest_near(scene_ref, self.boxes, id, *value),
                    !region.is_finite(),
                ),
                ShapeKind::Field { region, .. } => (None, !region.is_finite()),
                _ => (None, false),
            };
            // A stated bound above the sampled slopes is not refuted by them.
            let bound = sampled_slope.map(|(slope, _)| (slope * 1.1).ceil());
            let bound = bound.filter(|bound| (1.0..=MAX_STATED_SLOPE).contains(bound));
            let stated_slope =
                bound.map(|bound| format!("state a bound, `field(…, lipschitz: {bound})`"));
            let end = round_up(self.slopes.size().max(MIN_ADVISED_END));
            let stated_end = may_state_end
                .then(|| format!("state where the shape ends, `field(…, within: {end})`"));
            let advice = [
                stated_slope.as_deref(),
                stated_end.as_deref(),
                Some("keep away from poles with `max`"),
            ];
            let advice: Vec<&str> = advice.into_iter().flatten().collect();
            self.diagnostics
                .push(unbounded_warning(shape.span, guess, &advice));
        }
        divisor
    }

    /// Warns of declared slopes of a shape and of those below it that do not hold, even where no bound is
    /// used.
    pub(super) fn warn_refuted_slopes(&mut self, root: ShapeId) {
        let written = self.slopes.written_fields().iter();
        let mut declared: Vec<(ShapeId, ExprId, ExprId)> = written
            .filter_map(|it| Some((it.shape, it.value, it.slope?)))
            .collect();
        self.find_shape(root, |id, kind| {
            if let ShapeKind::Field {
                value,
                slope: Some(slope),
                ..
            } = kind
            {
                declared.push((id, *value, *slope));
            }
            false
        });
        for (id, value, slope) in declared {
            let scene_ref = SceneRef::from(&*self.scene);
            self.slopes
                .find_refutation(scene_ref, self.boxes, (id, value), slope);
        }
        for (id, refuted) in self.slopes.refuted_slopes() {
            let RefutedSlope {
                declared,
                slope,
                point: [x, y, z],
            } = refuted;
            let round = |v: f64| format_short((v * 1e3).round() / 1e3);
            let span = self.scene.shapes[id.0 as usize].span;
            let slope = format_short((slope * 1e3).ceil() / 1e3);
            let point_text = format!("[{}, {}, {}]", round(x), round(y), round(z));
            self.diagnostics.push(
                Diagnostic::warning(
                    codes::W0502,
                    span,
                    format!(
                        "the slope of this field exceeds the stated {}",
                        format_short(declared)
                    ),
                )
                .primary(format!(
                    "its slope is {slope} at {point_text}, so the stated bound is not used"
                ))
                .help(format!(
                    "leave `lipschitz` out: a bound is found where there is one. A stated bound is at least {slope}"
                )),
            );
        }
    }

    /// Divides a value by a bound of its slope. A bound below one enlarges the value, so that rays take
    /// longer steps.
    fn divide_by_slope(&mut self, node: NodeId, slope: f64, local_point: LocalPoint) -> NodeId {
        if is_unit_slope(slope) {
            return node;
        }
        self.apply_constants(Op::FieldDistance, local_point, node, &[slope])
    }

    /// Applies an operation with constant arguments to a value.
    pub(super) fn apply_constants(
        &mut self,
        op: Op,
        local_point: LocalPoint,
        value: NodeId,
        arguments: &[f64],
    ) -> NodeId {
        let parameters = prepare::<f64>(op, arguments);
        let parameters = parameters
            .into_iter()
            .map(|v| GraphNumber::Constant(v as f32));
        self.apply(op, local_point, vec![value], parameters.collect())
    }
}

/// Builds the warning about a field whose slope has no bound, or none within the range of `f32`.
fn unbounded_warning(span: Span, guess: f64, advice: &[&str]) -> Diagnostic {
    let warning = Diagnostic::warning(
        codes::W0501,
        span,
        "the slope of this field cannot be bounded",
    );
    if guess < MAX_SLOPE {
        return warning
            .primary("it may rise arbitrarily fast, so rays on a GPU may step over it")
            .help(join_alternatives(advice));
    }
    warning
        .primary(format!(
            "its slope is about {guess:.0e} at sampled points, so rays step over it"
        ))
        .help(
            "write the same surface with a smaller slope: compare a root or a logarithm, `pow(a, 1/8) - 1` or `ln(a)` \
             for `a - 1`",
        )
}

/// Returns the largest distance from a point near a box to a surface in it.
fn max_surface_distance(bounds: &Bounds) -> f64 {
    margin(bounds) + 2.0 * bounds.half_diagonal()
}

/// Rounds a positive number up to one digit.
fn round_up(v: f64) -> f64 {
    let unit = 10.0_f64.powf(v.log10().floor());
    (v / unit).ceil() * unit
}

/// Joins words as a list of alternatives.
fn join_alternatives(words: &[&str]) -> String {
    match words {
        [others @ .., last] if !others.is_empty() => format!("{}, or {last}", others.join(", ")),
        _ => words.concat(),
    }
}

/// A cube around the origin, and the one twice as large.
#[derive(Clone, Copy, Debug)]
struct Cube {
    /// Size relative to the first cube.
    ratio: f64,
    /// Slope bound within the cube.
    inner: f64,
    /// Slope bound within the larger cube.
    outer: f64,
}

/// Returns the factor and the exponent of a power of the distance from the origin that bounds the slope
/// beyond the first cube. They are chosen for the longest steps near the scene.
fn fit_power_law(growth: &[Cube], inner_slope: f64) -> (f64, f64) {
    let candidate = |number: u32| {
        let exponent = 0.5 * f64::from(number);
        let required_factor = |cube: &Cube| cube.outer / cube.ratio.powf(exponent);
        let factor = growth
            .iter()
            .map(required_factor)
            .fold(inner_slope, f64::max);
        let near_cubes = growth.iter().filter(|cube| cube.ratio <= EXPONENT_RANGE);
        let loss = |cube: &Cube| factor * cube.ratio.powf(exponent) / cube.inner;
        (near_cubes.map(loss).fold(1.0, f64::max), factor, exponent)
    };
    let candidates = (1..=MAX_EXPONENT_HALVES).map(candidate);
    let best = candidates.min_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or((inner_slope, 1.0), |(_, factor, exponent)| {
        (factor, exponent)
    })
}

/// Reports whether a bound is one up to rounding.
fn is_unit_slope(slope: f64) -> bool {
    (1.0 / MAX_UNIT_RATIO..=MAX_UNIT_RATIO).contains(&slope)
}
