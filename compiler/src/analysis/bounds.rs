//! Bounding boxes of the shapes of a scene, for the current values of its parameters or for all values.
//!
//! A box follows from the bounds rules of the operation table, shape by shape. Where a rule gives too
//! little (a warp, a displacement, a field), interval arithmetic finds the box if it is finite. An
//! amount that is added to a shape's distance grows its box. Where the distance underestimates, the box
//! grows by more, see `bounds_slack.rs`.

mod distance_slope;

use crate::analysis::bounds_slack::DistanceSlack;
use crate::analysis::extent::{extent, narrow_bounds, search_extent};
use crate::analysis::param_ranges::ParamRanges;
use crate::analysis::preimage::extent_of_preimage;
use crate::analysis::range::range;
use crate::analysis::shape_range::ShapeRange;
use crate::expression::{ExprId, Expression, Expressions, ParamId};
use crate::scene::{ExprTriple, Scene, SceneParam, SceneRef, ShapeId, ShapeKind, children};
use sdfc_vm::apply::{OpResult, apply, pack_parameters};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::row::{BoundsRule, Exactness};
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::collections::HashMap;
use std::ops::{Add, Div, Mul, Sub};

/// Uniform numbers at the current parameters and time, each computed once, in the order of the graph.
/// Numbers of point stage are NaN.
#[derive(Clone, Debug, Default)]
pub struct UniformValues {
    values: Vec<f64>,
    /// Values that replace the current values of some parameters.
    overrides: HashMap<ParamId, Vec<f64>>,
}

impl UniformValues {
    /// Returns the value of a uniform number, and NaN for numbers of a point.
    pub fn value(
        &mut self,
        expressions: &Expressions,
        params: &[SceneParam],
        time: f64,
        id: ExprId,
    ) -> f64 {
        if id.index() >= self.values.len() {
            for (_, node, _) in expressions.since(self.values.len()) {
                let value = self.compute(node, params, time);
                self.values.push(value);
            }
        }
        self.values[id.index()]
    }

    fn compute(&self, node: &Expression, params: &[SceneParam], time: f64) -> f64 {
        let value = |id: &ExprId| self.values[id.index()];
        match node {
            Expression::Constant(value) => *value,
            Expression::Time => time,
            Expression::Param(param, component) => {
                let declared = || params.get(param.0 as usize).map(|p| &p.value);
                let values = self.overrides.get(param).or_else(declared);
                values
                    .and_then(|values| values.get(usize::from(*component)))
                    .map_or(f64::NAN, |v| *v)
            }
            Expression::Coordinate(_) | Expression::NormalComponent(_) => f64::NAN,
            Expression::Apply {
                op,
                point,
                values,
                parameters,
            } => {
                let inputs = point.iter().flatten().chain(values).chain(parameters);
                if inputs.map(value).any(f64::is_nan) {
                    return f64::NAN;
                }
                let [x, y, z] = point.map_or([0.0; 3], |p| [0, 1, 2].map(|i| value(&p[i])));
                let mut operands = [0.0; 3];
                for (slot, id) in operands.iter_mut().zip(values) {
                    *slot = value(id);
                }
                let parameters: Vec<f64> = parameters.iter().map(value).collect();
                match apply::<f64>(
                    *op,
                    V3::new(x, y, z),
                    operands,
                    &pack_parameters(*op, &parameters),
                ) {
                    OpResult::Value(value) => value,
                    OpResult::Point(_) => f64::NAN,
                }
            }
        }
    }
}

/// Returns the box of every shape of a scene at the current values of the parameters.
pub fn shape_bounds(scene: &Scene) -> Vec<Bounds> {
    let scene_ref = SceneRef::from(scene);
    let ids = || (0..scene.shapes.len() as u32).map(ShapeId);
    let mut boxes = ShapeBounds::at_time_and_values(0.0, HashMap::new());
    ids().map(|id| boxes.get(scene_ref, id)).collect()
}

/// Maximum number of operations for the box of one shape whose rule gives too little.
const MAX_SEARCH_OPERATIONS: usize = 200_000;

/// Cache of the boxes of shapes and of their distance slack. Entries are computed on first use.
#[derive(Clone, Debug, Default)]
pub(crate) struct ShapeBounds {
    /// Set if boxes hold for all values of the live parameters and of the time. Otherwise they hold for
    /// the current values.
    holds_for_all_params: bool,
    uniform_values: UniformValues,
    time: f64,
    /// For each number: it depends on a live parameter or the time.
    is_live: Vec<bool>,
    bounds: Vec<Bounds>,
    slacks: HashMap<ShapeId, DistanceSlack>,
    /// For shapes: their values change by at most one per unit of length.
    distance_slopes: HashMap<ShapeId, bool>,
}

impl ShapeBounds {
    /// Creates a cache of boxes that hold for all values of the live parameters and the time. A primitive or a map of
    /// points that reads one of them may be anywhere. Rays are clipped to these boxes, and slope bounds hold within them.
    pub(crate) fn for_all_params() -> Self {
        Self {
            holds_for_all_params: true,
            ..Self::default()
        }
    }

    /// Creates a cache of boxes at a time, with other values for some of the parameters.
    pub(crate) fn at_time_and_values(time: f64, values: HashMap<ParamId, Vec<f64>>) -> Self {
        Self {
            time,
            uniform_values: UniformValues {
                overrides: values,
                ..UniformValues::default()
            },
            ..Self::default()
        }
    }

    /// Returns the box of a shape.
    pub(crate) fn get(&mut self, scene: SceneRef<'_>, id: ShapeId) -> Bounds {
        while self.bounds.len() <= id.0 as usize {
            let index = self.bounds.len();
            let shape = &scene.shapes[index];
            let depends_on_live = self.holds_for_all_params
                && placement_numbers(&shape.kind)
                    .iter()
                    .any(|&n| self.is_live(scene, n));
            let bounds = match (depends_on_live, &shape.kind) {
                // A twist or bend, by any rate, keeps the distance from its axis.
                (
                    true,
                    ShapeKind::Domain {
                        op: op @ (Op::Twist | Op::Bend),
                        child,
                        ..
                    },
                ) => self.bounds_by_rule(scene, *op, &[1.0], &[*child]),
                (true, kind) => self.bounds_over_ranges(scene, kind),
                (false, _) => {
                    let rule_bounds = self.compute_bounds(scene, &shape.kind);
                    self.tightened(scene, ShapeId(index as u32), &rule_bounds)
                }
            };
            self.bounds.push(bounds);
        }
        self.bounds[id.0 as usize]
    }

    /// Returns the box of a shape that depends on live parameters, for all their values.
    fn bounds_over_ranges(&mut self, scene: SceneRef<'_>, kind: &ShapeKind) -> Bounds {
        let ranges = ParamRanges::for_scene(scene);
        match kind {
            ShapeKind::Combine {
                op,
                children,
                parameters,
            } => {
                let ranges: Vec<Interval> = parameters
                    .iter()
                    .map(|&id| ranges.number(scene.expressions, id))
                    .collect();
                // Boxes grow with the magnitudes of parameters, so the largest one is at an end.
                let ends = [|range: &Interval| range.lo, |range: &Interval| range.hi];
                let boxes = ends.map(|end| {
                    let numbers: Vec<f64> = ranges.iter().map(end).collect();
                    match numbers.iter().all(|v| v.is_finite()) {
                        true => self.bounds_by_rule(scene, *op, &numbers, children),
                        false => Bounds::ALL_SPACE,
                    }
                });
                boxes[0].hull(&boxes[1])
            }
            ShapeKind::Frame { child, matrix, .. } => {
                let rows = matrix.map(|id| ranges.number(scene.expressions, id));
                match inverse_of_ranges(&rows) {
                    Some(rows) => self.get(scene, *child).mapped_within(&rows),
                    None => Bounds::ALL_SPACE,
                }
            }
            _ => Bounds::ALL_SPACE,
        }
    }

    /// Returns the box of a transformed shape. Of nested transforms, boxes are those of their product: each of them alone
    /// would grow the box.
    fn frame_bounds(
        &mut self,
        scene: SceneRef<'_>,
        mut child: ShapeId,
        matrix: &[ExprId; 12],
    ) -> Bounds {
        let Some(mut rows) = inverse(&self.numbers(scene, matrix)) else {
            return Bounds::ALL_SPACE;
        };
        let mut bounds = self.get(scene, child).mapped(&rows);
        while let ShapeKind::Frame {
            child: inner,
            matrix,
            ..
        } = &scene.shapes[child.0 as usize].kind
        {
            if self.holds_for_all_params && matrix.iter().any(|&n| self.is_live(scene, n)) {
                break;
            }
            let Some(inner_rows) = inverse(&self.numbers(scene, matrix)) else {
                break;
            };
            rows = composed(&rows, &inner_rows);
            child = *inner;
            bounds = bounds.intersection(&self.get(scene, child).mapped(&rows));
        }
        bounds
    }

    /// Replaces the box of a shape.
    pub(crate) fn set(&mut self, scene: SceneRef<'_>, id: ShapeId, bounds: Bounds) {
        self.get(scene, id);
        self.bounds[id.0 as usize] = bounds;
    }

    /// Reports whether a number depends on a live parameter or the time.
    pub(crate) fn is_live(&mut self, scene: SceneRef<'_>, id: ExprId) -> bool {
        if id.index() >= self.is_live.len() {
            for (_, node, _) in scene.expressions.since(self.is_live.len()) {
                let is_live = match node {
                    Expression::Param(..) | Expression::Time => true,
                    Expression::Constant(_)
                    | Expression::Coordinate(_)
                    | Expression::NormalComponent(_) => false,
                    Expression::Apply { .. } => {
                        operands(node).any(|operand| self.is_live[operand.index()])
                    }
                };
                self.is_live.push(is_live);
            }
        }
        self.is_live[id.index()]
    }

    /// Returns the value of a uniform number.
    pub(crate) fn number(&mut self, scene: SceneRef<'_>, id: ExprId) -> f64 {
        let (expressions, params) = (scene.expressions, scene.params);
        self.uniform_values
            .value(expressions, params, self.time, id)
    }

    fn numbers(&mut self, scene: SceneRef<'_>, ids: &[ExprId]) -> Vec<f64> {
        ids.iter().map(|&id| self.number(scene, id)).collect()
    }

    /// Returns the range of a number of the point over all of space.
    fn range(&mut self, scene: SceneRef<'_>, id: ExprId) -> Interval {
        let (expressions, params, time) = (scene.expressions, scene.params, self.time);
        let present = &mut self.uniform_values;
        let mut value = |id| present.value(expressions, params, time, id);
        range(expressions, id, &Bounds::ALL_SPACE, &mut value)
    }

    /// Computes the box of a shape from the boxes of its operands.
    fn compute_bounds(&mut self, scene: SceneRef<'_>, kind: &ShapeKind) -> Bounds {
        match kind {
            ShapeKind::Primitive { op, parameters } => {
                let numbers = self.numbers(scene, parameters);
                self.bounds_by_rule(scene, *op, &numbers, &[])
            }
            ShapeKind::Field { value, region, .. } => self.field_extent(scene, *value, region),
            ShapeKind::Polygon { points } => {
                let mut hull = Bounds::EMPTY;
                for point in points {
                    let [x, y] = point.map(|id| self.number(scene, id));
                    hull =
                        hull.including([x, y, f64::NEG_INFINITY])
                            .including([x, y, f64::INFINITY]);
                }
                hull
            }
            ShapeKind::Combine {
                op,
                children,
                parameters,
            } => {
                let numbers = self.numbers(scene, parameters);
                self.bounds_by_rule(scene, *op, &numbers, children)
            }
            ShapeKind::Frame { child, matrix, .. } => self.frame_bounds(scene, *child, matrix),
            ShapeKind::Repeat {
                op,
                child,
                parameters,
                ..
            }
            | ShapeKind::Polar {
                op,
                child,
                parameters,
                ..
            }
            | ShapeKind::Domain {
                op,
                child,
                parameters,
            }
            | ShapeKind::Distance {
                op,
                child,
                parameters,
            } => {
                let numbers = self.numbers(scene, parameters);
                self.bounds_by_rule(scene, *op, &numbers, &[*child])
            }
            ShapeKind::Warp { child, point } => {
                let image = self.get(scene, *child);
                if let Some(shifts) = self.shift_ranges(scene, point) {
                    let mut result = image;
                    for (axis, by) in shifts.into_iter().enumerate() {
                        result.min[axis] -= by.hi;
                        result.max[axis] -= by.lo;
                    }
                    return result;
                }
                let (expressions, params, time) = (scene.expressions, scene.params, self.time);
                let present = &mut self.uniform_values;
                extent_of_preimage(expressions, *point, &image, &mut |id| {
                    Interval::point(present.value(expressions, params, time, id))
                })
            }
            ShapeKind::Displace { child, amount } => {
                let bounds = self.get(scene, *child);
                let amount_below_zero = (-self.range(scene, *amount).lo).max(0.0);
                self.grown_by(scene, &bounds, amount_below_zero, &[*child])
            }
            ShapeKind::Painted { child, .. } => self.get(scene, *child),
            ShapeKind::Nothing => Bounds::EMPTY,
        }
    }

    /// Returns the ranges of the numbers that a warp adds to the coordinates. `None` if it does more than
    /// shift points, or shifts them without a limit.
    fn shift_ranges(&mut self, scene: SceneRef<'_>, point: &ExprTriple) -> Option<[Interval; 3]> {
        let mut shifts = [Interval::point(0.0); 3];
        for (axis, &coordinate) in point.iter().enumerate() {
            if *scene.expressions.get(coordinate) == Expression::Coordinate(axis as u8) {
                continue;
            }
            let by = self.range(scene, shift(scene.expressions, coordinate, axis as u8)?);
            if !(by.lo.is_finite() && by.hi.is_finite()) {
                return None;
            }
            shifts[axis] = by;
        }
        Some(shifts)
    }

    /// Returns the box of a written field: its declared region, less the part where it is proved
    /// positive. For a field without parameters that search was done when it was created.
    fn field_extent(&mut self, scene: SceneRef<'_>, value: ExprId, region: &Bounds) -> Bounds {
        if !self.is_live(scene, value) {
            return *region;
        }
        let search_result = if self.holds_for_all_params {
            let ranges = ParamRanges::for_scene(scene);
            let expressions = scene.expressions;
            extent(expressions, value, &mut |id| ranges.leaf(expressions, id))
        } else {
            let (expressions, params, time) = (scene.expressions, scene.params, self.time);
            let present = &mut self.uniform_values;
            extent(expressions, value, &mut |id| {
                Interval::point(present.value(expressions, params, time, id))
            })
        };
        region.intersection(&search_result)
    }

    /// Returns the box of the cells in which a repetition evaluates its child.
    pub(crate) fn repetition_cells(&mut self, scene: SceneRef<'_>, id: ShapeId) -> Bounds {
        let ShapeKind::Repeat {
            parameters, others, ..
        } = &scene.shapes[id.0 as usize].kind
        else {
            return Bounds::ALL_SPACE;
        };
        let ranges = ParamRanges::for_scene(scene);
        let half: [f64; 3] = std::array::from_fn(|axis| {
            let spacing = ranges.number(scene.expressions, parameters[axis]);
            let cells = f64::from(others[axis].near.max(others[axis].far)) + 0.5;
            let half = spacing.magnitude() * cells;
            // Without a spacing along an axis, the coordinate is unchanged.
            if half > 0.0 { half } else { f64::INFINITY }
        });
        Bounds::centred(half)
    }

    /// Tightens the box of a shape by a search, where its rule gives too little. That is an infinite
    /// box over finite operands, or the box of a twist or bend, whose rule allows any angle.
    fn tightened(&mut self, scene: SceneRef<'_>, id: ShapeId, rule_bounds: &Bounds) -> Bounds {
        let kind = &scene.shapes[id.0 as usize].kind;
        let has_ends = |boxes: &Self, kind: &ShapeKind| {
            let children = children(kind);
            !children.is_empty()
                && children
                    .iter()
                    .all(|child| boxes.bounds[child.0 as usize].is_finite())
        };
        let is_vague = match kind {
            ShapeKind::Combine { .. } | ShapeKind::Distance { .. } | ShapeKind::Displace { .. } => {
                !rule_bounds.is_finite() && !rule_bounds.is_void() && has_ends(self, kind)
            }
            ShapeKind::Domain {
                op: Op::Twist | Op::Bend,
                ..
            } => rule_bounds.is_finite(),
            _ => false,
        };
        if !is_vague
            || matches!(
                kind,
                ShapeKind::Distance {
                    op: Op::Complement,
                    ..
                }
            )
        {
            return *rule_bounds;
        }
        let searched = self.searched_sublevel(scene, id, 0.0, rule_bounds);
        if searched.is_empty() {
            *rule_bounds
        } else {
            rule_bounds.intersection(&searched)
        }
    }

    /// Returns the box by the bounds rule of an operation.
    fn bounds_by_rule(
        &mut self,
        scene: SceneRef<'_>,
        op: Op,
        numbers: &[f64],
        children: &[ShapeId],
    ) -> Bounds {
        let boxes: Vec<Bounds> = children.iter().map(|&id| self.get(scene, id)).collect();
        let first = || boxes.first().copied().unwrap_or(Bounds::ALL_SPACE);
        let hull = || boxes.iter().fold(Bounds::EMPTY, |hull, b| hull.hull(b));
        let facts = &op.row().facts;
        match facts.bounds {
            BoundsRule::Centred(_) | BoundsRule::Shape(_) => facts
                .bounds
                .shape_bounds(numbers)
                .unwrap_or(Bounds::ALL_SPACE),
            BoundsRule::Hull | BoundsRule::HullGrown(_) => {
                let growth = facts.hull_growth(numbers, boxes.len());
                self.grown_by(scene, &hull(), growth.unwrap_or(f64::INFINITY), children)
            }
            BoundsRule::Intersection => boxes
                .iter()
                .fold(Bounds::ALL_SPACE, |common, b| common.intersection(b)),
            BoundsRule::FirstOperand => first(),
            BoundsRule::Map(rule) => rule(numbers, &first()),
            BoundsRule::Infinite => Bounds::ALL_SPACE,
        }
    }

    /// Grows a box around shapes by an amount that is added to their distances, or shrinks it.
    fn grown_by(
        &mut self,
        scene: SceneRef<'_>,
        bounds: &Bounds,
        growth: f64,
        children: &[ShapeId],
    ) -> Bounds {
        if growth == 0.0 {
            return *bounds;
        }
        if growth > 0.0 {
            let slack = self.joined_slack(scene, children);
            if slack.axis.is_finite() {
                return bounds.grown(growth * slack.axis);
            }
        }
        self.sublevel_hull(scene, children, growth)
    }

    /// Returns the hull of boxes outside of which the values of shapes are at least `level`.
    fn sublevel_hull(&mut self, scene: SceneRef<'_>, shapes: &[ShapeId], level: f64) -> Bounds {
        let boxes = shapes
            .iter()
            .map(|&id| self.sublevel_bounds(scene, id, level));
        boxes.fold(Bounds::EMPTY, |hull, bounds| hull.hull(&bounds))
    }

    /// Returns a box outside of which a shape's value is at least `level`. Recursion over nested
    /// shapes, whose depth the elaborator bounds.
    pub(super) fn sublevel_bounds(
        &mut self,
        scene: SceneRef<'_>,
        id: ShapeId,
        level: f64,
    ) -> Bounds {
        let bounds = self.get(scene, id);
        if let Some(growth) = self.box_growth(scene, id, level) {
            return bounds.grown(level * growth);
        }
        match &scene.shapes[id.0 as usize].kind {
            ShapeKind::Painted { child, .. } => self.sublevel_bounds(scene, *child, level),
            ShapeKind::Combine {
                op: Op::Union,
                children,
                ..
            } => self.sublevel_hull(scene, children, level),
            ShapeKind::Frame {
                child,
                matrix,
                scale,
            } if !self.holds_for_all_params
                || !matrix
                    .iter()
                    .chain([scale])
                    .any(|&n| self.is_live(scene, n)) =>
            {
                let (matrix, scale) = (self.numbers(scene, matrix), self.number(scene, *scale));
                let inner_level = level / scale;
                match inverse(&matrix) {
                    Some(rows) if scale > 0.0 && inner_level.is_finite() => self
                        .sublevel_bounds(scene, *child, inner_level)
                        .mapped(&rows),
                    _ => self.searched_sublevel(scene, id, level, &Bounds::ALL_SPACE),
                }
            }
            _ if level < 0.0 => self
                .searched_sublevel(scene, id, level, &bounds)
                .intersection(&bounds),
            _ => self.searched_sublevel(scene, id, level, &Bounds::ALL_SPACE),
        }
    }

    /// Returns the growth of a shape's box per unit of the level. `None` if only a search can tell: above zero
    /// for values that grow too slowly, below zero for those that may fall faster than distances.
    fn box_growth(&mut self, scene: SceneRef<'_>, id: ShapeId, level: f64) -> Option<f64> {
        if level < 0.0 {
            return self.has_distance_slope(scene, id).then_some(1.0);
        }
        let slack = self.slack(scene, id).axis;
        slack.is_finite().then_some(slack)
    }

    /// Searches a box, inside `outer_box`, outside of which intervals prove a shape's value to exceed
    /// `level`.
    fn searched_sublevel(
        &mut self,
        scene: SceneRef<'_>,
        id: ShapeId,
        level: f64,
        outer_box: &Bounds,
    ) -> Bounds {
        let (expressions, params, time) = (scene.expressions, scene.params, self.time);
        let (present, is_lasting) = (&mut self.uniform_values, self.holds_for_all_params);
        let ranges = ParamRanges::for_scene(scene);
        let mut uniform = |id| match is_lasting {
            true => ranges.number(expressions, id),
            false => Interval::point(present.value(expressions, params, time, id)),
        };
        let mut range = ShapeRange::new(scene, &mut uniform);
        _ = range.range_in_box(id, &Bounds::ALL_SPACE);
        let evaluations = MAX_SEARCH_OPERATIONS / range.operations.max(1);
        let mut over = |bounds: &Bounds| range.range_in_box(id, bounds) - Interval::point(level);
        if outer_box.is_finite() {
            return narrow_bounds(outer_box, evaluations, &mut over);
        }
        let is_2d = scene.shapes[id.0 as usize].is_2d;
        search_extent([false, false, is_2d], evaluations, &mut over, &mut |it| *it)
    }

    fn joined_slack(&mut self, scene: SceneRef<'_>, children: &[ShapeId]) -> DistanceSlack {
        let slacks = children.iter().map(|&id| self.slack(scene, id));
        slacks.fold(DistanceSlack::NONE, DistanceSlack::join)
    }

    /// Returns the distance slack of a shape, cached. Recursion over nested shapes, whose depth the
    /// elaborator bounds.
    fn slack(&mut self, scene: SceneRef<'_>, id: ShapeId) -> DistanceSlack {
        if let Some(&slack) = self.slacks.get(&id) {
            return slack;
        }
        let bounds = self.get(scene, id);
        let ends = bounds.min.into_iter().chain(bounds.max);
        let slack = match ends.into_iter().all(f64::is_infinite) {
            true => DistanceSlack::NONE,
            false => self.compute_slack(scene, id),
        };
        self.slacks.insert(id, slack);
        slack
    }

    fn compute_slack(&mut self, scene: SceneRef<'_>, id: ShapeId) -> DistanceSlack {
        match &scene.shapes[id.0 as usize].kind {
            ShapeKind::Primitive { op, .. } => match op.row().facts.exactness {
                Exactness::Exact | Exactness::ExactOutside => DistanceSlack::NONE,
                Exactness::Bound | Exactness::Unknown => DistanceSlack::from_axis(1.0),
            },
            ShapeKind::Polygon { .. } | ShapeKind::Nothing => DistanceSlack::NONE,
            // A field's declared region says nothing of where it is small.
            ShapeKind::Field { .. } => DistanceSlack::UNKNOWN,
            ShapeKind::Painted { child, .. } => self.slack(scene, *child),
            ShapeKind::Combine { op, children, .. } => match op.row().facts.bounds {
                BoundsRule::Intersection => {
                    let bounds_and_slack =
                        |id: &ShapeId| (self.get(scene, *id), self.slack(scene, *id));
                    let operands: Vec<_> = children.iter().map(bounds_and_slack).collect();
                    DistanceSlack::intersection(&operands)
                }
                BoundsRule::FirstOperand => self.slack(scene, children[0]),
                BoundsRule::Hull => self.joined_slack(scene, children),
                BoundsRule::HullGrown(_) => self.joined_slack(scene, children).after_growth(),
                BoundsRule::Centred(_)
                | BoundsRule::Shape(_)
                | BoundsRule::Map(_)
                | BoundsRule::Infinite => DistanceSlack::UNKNOWN,
            },
            ShapeKind::Frame {
                child,
                matrix,
                scale,
            } => {
                let (inner, bounds) = (self.slack(scene, *child), self.get(scene, *child));
                let scale = self.number(scene, *scale);
                match inverse(&self.numbers(scene, matrix)) {
                    Some(rows) => inner.in_frame(&bounds, &rows, scale),
                    None => DistanceSlack::UNKNOWN,
                }
            }
            ShapeKind::Repeat { child, .. } => self.slack(scene, *child),
            ShapeKind::Polar { child, .. } => self.slack(scene, *child).rotated(),
            ShapeKind::Domain { op, child, .. } => {
                let inner = self.slack(scene, *child);
                match op {
                    Op::Twist | Op::Bend => inner.rotated(),
                    // Other domain operations fold and move space along the axes.
                    _ => inner,
                }
            }
            ShapeKind::Distance {
                op,
                child,
                parameters,
            } => match op {
                Op::Offset | Op::Shell => {
                    let inner = self.slack(scene, *child).after_growth();
                    let amount = self.number(scene, parameters[0]);
                    if amount >= 0.0 {
                        inner
                    } else if self.has_distance_slope(scene, *child) {
                        // Where the box shrinks, a straight line out of it may be longer.
                        DistanceSlack::from_axis(inner.axis)
                    } else {
                        DistanceSlack::UNKNOWN
                    }
                }
                _ => self.slack(scene, *child),
            },
            // Where a warp contracts space, small values are farther from the shape than they say.
            ShapeKind::Warp { child, point } => match self.shift_ranges(scene, point) {
                Some(_) => self.slack(scene, *child),
                None => DistanceSlack::UNKNOWN,
            },
            ShapeKind::Displace { child, .. } => self.slack(scene, *child).after_growth(),
        }
    }
}

/// Returns the numbers from which a computed number is computed.
fn operands(node: &Expression) -> impl Iterator<Item = &ExprId> {
    let (point, values, parameters): (&[ExprId], &[ExprId], &[ExprId]) = match node {
        Expression::Apply {
            point,
            values,
            parameters,
            ..
        } => (point.as_ref().map_or(&[], |p| p), values, parameters),
        _ => (&[], &[], &[]),
    };
    point.iter().chain(values).chain(parameters)
}

/// Returns the numbers that determine where a shape is, besides its operands.
fn placement_numbers(kind: &ShapeKind) -> Vec<ExprId> {
    match kind {
        ShapeKind::Primitive { parameters, .. }
        | ShapeKind::Combine { parameters, .. }
        | ShapeKind::Repeat { parameters, .. }
        | ShapeKind::Polar { parameters, .. }
        | ShapeKind::Domain { parameters, .. }
        | ShapeKind::Distance { parameters, .. } => parameters.clone(),
        ShapeKind::Polygon { points } => points.as_flattened().to_vec(),
        ShapeKind::Frame { matrix, .. } => matrix.to_vec(),
        ShapeKind::Warp { point, .. } => point.to_vec(),
        ShapeKind::Displace { amount, .. } => vec![*amount],
        // The extent of a field was searched over all values of the parameters.
        ShapeKind::Field { .. } | ShapeKind::Painted { .. } | ShapeKind::Nothing => Vec::new(),
    }
}

/// Returns the matrix from the inner to the outer point, unless it is singular.
pub(crate) fn inverse(m: &[f64]) -> Option<[[f64; 4]; 3]> {
    let is_regular = |determinant: f64| determinant.is_finite() && determinant != 0.0;
    let rows = inverse_if(m, is_regular)?;
    let row = |row: usize| std::array::from_fn(|column| rows[4 * row + column]);
    Some([row(0), row(1), row(2)])
}

/// Returns the map of points by `inner` and then by `outer`.
pub(super) fn composed(outer: &[[f64; 4]; 3], inner: &[[f64; 4]; 3]) -> [[f64; 4]; 3] {
    outer.map(|row| {
        std::array::from_fn(|column| {
            let sum: f64 = (0..3).map(|k| row[k] * inner[k][column]).sum();
            sum + if column == 3 { row[3] } else { 0.0 }
        })
    })
}

/// Returns bounds of the matrices from the inner to the outer point, unless one of them may be singular.
fn inverse_of_ranges(m: &[Interval; 12]) -> Option<[Interval; 12]> {
    let is_regular = |determinant: Interval| {
        let excludes_zero = determinant.lo > 0.0 || determinant.hi < 0.0;
        excludes_zero && determinant.magnitude().is_finite()
    };
    let rows = inverse_if(m, is_regular)?;
    let is_finite = rows.iter().all(|range| range.magnitude().is_finite());
    is_finite.then_some(rows)
}

/// Returns the inverse of an affine matrix by its minors, if its determinant passes a test.
fn inverse_if<T>(m: &[T], is_regular: impl Fn(T) -> bool) -> Option<[T; 12]>
where
    T: Copy + Default + Add<Output = T> + Sub<Output = T> + Mul<Output = T> + Div<Output = T>,
{
    let entry = |row: usize, column: usize| m[4 * row + column];
    let minor = |r: usize, c: usize| {
        let (r1, r2, c1, c2) = ((r + 1) % 3, (r + 2) % 3, (c + 1) % 3, (c + 2) % 3);
        entry(r1, c1) * entry(r2, c2) - entry(r1, c2) * entry(r2, c1)
    };
    let term = |c: usize| entry(0, c) * minor(0, c);
    let determinant = term(0) + term(1) + term(2);
    if !is_regular(determinant) {
        return None;
    }
    let mut rows = [T::default(); 12];
    for r in 0..3 {
        for c in 0..3 {
            let factor = minor(c, r) / determinant;
            rows[4 * r + c] = factor;
            rows[4 * r + 3] = rows[4 * r + 3] - factor * entry(c, 3);
        }
    }
    Some(rows)
}

/// Returns the number that is added to a coordinate, where `id` is such a sum.
fn shift(expressions: &Expressions, id: ExprId, axis: u8) -> Option<ExprId> {
    let is_axis =
        |id: ExprId| matches!(expressions.get(id), Expression::Coordinate(a) if *a == axis);
    match expressions.get(id) {
        Expression::Apply {
            op: Op::Add,
            values,
            ..
        } => match values.as_slice() {
            [a, b] if is_axis(*a) => Some(*b),
            [a, b] if is_axis(*b) => Some(*a),
            _ => None,
        },
        _ => None,
    }
}
