//! Boxes around the shapes of a scene, at the present values of its parameters or at all.
//!
//! A box follows from the rules of the table, shape by shape; what the rules do not know (a warp, a
//! displacement, a field) follows by interval arithmetic where that gives something finite. What is
//! added to a shape grows its box by as much as the shape's distance is less than it should be, see
//! `spread.rs`.

use crate::expression::{ExprId, Expression, Expressions, ParamId};
use crate::extent::{extent, extent_of_preimage, narrowed, search};
use crate::range::range;
use crate::scene::{Animation, Param, Scene, Shape, ShapeId, ShapeKind, children};
use crate::shape_range::ShapeRange;
use crate::slope::Ranges;
use crate::spread::Spread;
use sdfc_vm::apply::{Applied, apply, laid_out};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::row::{BoundsRule, Exactness};
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::collections::HashMap;

/// The values that numbers have at the present parameters and time, computed in the order of the
/// graph, once each. Numbers of a point have none.
#[derive(Clone, Debug, Default)]
pub struct Present {
    values: Vec<f64>,
    /// Values that some parameters are taken to have instead of their own.
    instead: HashMap<ParamId, Vec<f64>>,
}

impl Present {
    /// The value of a number that does not depend on a point; NaN for others.
    pub fn value(&mut self, graph: &Expressions, params: &[Param], time: f64, id: ExprId) -> f64 {
        if id.index() >= self.values.len() {
            for (_, node, _) in graph.since(self.values.len()) {
                let value = self.compute(node, params, time);
                self.values.push(value);
            }
        }
        self.values[id.index()]
    }

    fn compute(&self, node: &Expression, params: &[Param], time: f64) -> f64 {
        let value = |id: &ExprId| self.values[id.index()];
        match node {
            Expression::Constant(value) => *value,
            Expression::Time => time,
            Expression::Param(param, component) => {
                let own = || params.get(param.0 as usize).map(|p| &p.value);
                let values = self.instead.get(param).or_else(own);
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
                match apply::<f64>(*op, V3::of(x, y, z), operands, &laid_out(*op, &parameters)) {
                    Applied::Value(value) => value,
                    Applied::Point(_) => f64::NAN,
                }
            }
        }
    }
}

/// What boxes are computed from: a scene, or as much of one as there is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct World<'s> {
    pub(crate) shapes: &'s [Shape],
    pub(crate) expressions: &'s Expressions,
    pub(crate) params: &'s [Param],
    pub(crate) animation: Option<Animation>,
}

impl<'s> From<&'s Scene> for World<'s> {
    fn from(scene: &'s Scene) -> Self {
        Self {
            shapes: &scene.shapes,
            expressions: &scene.expressions,
            params: &scene.params,
            animation: scene.animation,
        }
    }
}

/// The box of every shape of a scene at the present values of the parameters.
pub fn shape_bounds(scene: &Scene) -> Vec<Bounds> {
    let world = World::from(scene);
    let ids = || (0..scene.shapes.len() as u32).map(ShapeId);
    let mut boxes = Boxes::at(0.0, HashMap::new());
    ids().map(|id| boxes.of(world, id)).collect()
}

/// The most operations that are spent on the box of a shape whose rule says too little.
const MAX_SEARCH_OPERATIONS: usize = 200_000;

/// The boxes of shapes, and what else is known of where they are. Everything is found when it is
/// asked for, once.
#[derive(Clone, Debug, Default)]
pub(crate) struct Boxes {
    /// Whether boxes hold whatever the live parameters and the time; else they are those of the
    /// present values.
    is_lasting: bool,
    present: Present,
    time: f64,
    /// Which numbers follow a live parameter or the time.
    live: Vec<bool>,
    boxes: Vec<Bounds>,
    spreads: HashMap<ShapeId, Spread>,
}

impl Boxes {
    /// Boxes that hold whatever the live parameters and the time: what reads one of them may be
    /// anywhere. Rays are cut to these boxes, and slopes hold within them.
    pub(crate) fn lasting() -> Self {
        Self {
            is_lasting: true,
            ..Self::default()
        }
    }

    /// Boxes at a time, with other values for some of the parameters.
    pub(crate) fn at(time: f64, values: HashMap<ParamId, Vec<f64>>) -> Self {
        Self {
            time,
            present: Present {
                instead: values,
                ..Present::default()
            },
            ..Self::default()
        }
    }

    /// The box of a shape.
    pub(crate) fn of(&mut self, world: World<'_>, id: ShapeId) -> Bounds {
        while self.boxes.len() <= id.0 as usize {
            let at = self.boxes.len();
            let shape = &world.shapes[at];
            let moves = self.is_lasting
                && numbers_of(&shape.kind)
                    .iter()
                    .any(|&n| self.is_live(world, n));
            let bounds = match (moves, &shape.kind) {
                // By whatever rate, what is turned about an axis stays as far from it.
                (
                    true,
                    ShapeKind::Domain {
                        op: op @ (Op::Twist | Op::Bend),
                        child,
                        ..
                    },
                ) => self.ruled(world, *op, &[1.0], &[*child]),
                (true, _) => Bounds::EVERYTHING,
                (false, _) => {
                    let ruled = self.bounds_of(world, &shape.kind);
                    self.searched(world, ShapeId(at as u32), &ruled)
                }
            };
            self.boxes.push(bounds);
        }
        self.boxes[id.0 as usize]
    }

    /// Replaces the box of a shape.
    pub(crate) fn set(&mut self, world: World<'_>, id: ShapeId, bounds: Bounds) {
        self.of(world, id);
        self.boxes[id.0 as usize] = bounds;
    }

    /// Whether a number follows a live parameter or the time.
    pub(crate) fn is_live(&mut self, world: World<'_>, id: ExprId) -> bool {
        if id.index() >= self.live.len() {
            for (_, node, _) in world.expressions.since(self.live.len()) {
                let is_live = match node {
                    Expression::Param(..) | Expression::Time => true,
                    Expression::Constant(_)
                    | Expression::Coordinate(_)
                    | Expression::NormalComponent(_) => false,
                    Expression::Apply { .. } => {
                        operands(node).any(|operand| self.live[operand.index()])
                    }
                };
                self.live.push(is_live);
            }
        }
        self.live[id.index()]
    }

    /// The value of a number that does not depend on a point.
    pub(crate) fn number(&mut self, world: World<'_>, id: ExprId) -> f64 {
        let (graph, params) = (world.expressions, world.params);
        self.present.value(graph, params, self.time, id)
    }

    fn numbers(&mut self, world: World<'_>, ids: &[ExprId]) -> Vec<f64> {
        ids.iter().map(|&id| self.number(world, id)).collect()
    }

    /// All values that a number of a point may have anywhere.
    fn range(&mut self, world: World<'_>, id: ExprId) -> Interval {
        let (graph, params, time) = (world.expressions, world.params, self.time);
        let present = &mut self.present;
        let mut value = |id| present.value(graph, params, time, id);
        range(graph, id, &Bounds::EVERYTHING, &mut value)
    }

    /// The box of a shape whose operands are known.
    fn bounds_of(&mut self, world: World<'_>, kind: &ShapeKind) -> Bounds {
        match kind {
            ShapeKind::Primitive { op, parameters } => {
                let numbers = self.numbers(world, parameters);
                self.ruled(world, *op, &numbers, &[])
            }
            ShapeKind::Field { value, region, .. } => self.extent_of(world, *value, region),
            ShapeKind::Polygon { points } => {
                let mut hull = Bounds::EMPTY;
                for point in points {
                    let [x, y] = point.map(|id| self.number(world, id));
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
                let numbers = self.numbers(world, parameters);
                self.ruled(world, *op, &numbers, children)
            }
            ShapeKind::Frame { child, matrix, .. } => {
                let matrix = self.numbers(world, matrix);
                match inverse(&matrix) {
                    Some(rows) => self.of(world, *child).mapped(&rows),
                    None => Bounds::EVERYTHING,
                }
            }
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
                let numbers = self.numbers(world, parameters);
                self.ruled(world, *op, &numbers, &[*child])
            }
            ShapeKind::Warp { child, point } => {
                let mut result = self.of(world, *child);
                // Of a point that is only shifted, what is farther away than that is clear at once.
                let mut is_shift = true;
                for (axis, &coordinate) in point.iter().enumerate() {
                    let graph = world.expressions;
                    if *graph.get(coordinate) == Expression::Coordinate(axis as u8) {
                        continue;
                    }
                    let moved = shift(graph, coordinate, axis as u8);
                    let moved = moved.map(|by| self.range(world, by));
                    match moved {
                        Some(by) if by.lo.is_finite() && by.hi.is_finite() => {
                            result.min[axis] -= by.hi;
                            result.max[axis] -= by.lo;
                        }
                        Some(_) | None => is_shift = false,
                    }
                }
                if is_shift {
                    return result;
                }
                let image = self.of(world, *child);
                let (graph, params, time) = (world.expressions, world.params, self.time);
                let present = &mut self.present;
                extent_of_preimage(graph, *point, &image, &mut |id| {
                    Interval::point(present.value(graph, params, time, id))
                })
            }
            ShapeKind::Displace { child, amount } => {
                let bounds = self.of(world, *child);
                let by = (-self.range(world, *amount).lo).max(0.0);
                self.grown(world, &bounds, by, &[*child])
            }
            ShapeKind::Painted { child, .. } => self.of(world, *child),
            ShapeKind::Nothing => Bounds::EMPTY,
        }
    }

    /// The box of a written field: the region it is stated for, and where it is not proved positive. One
    /// that follows no parameter was looked for when it was made.
    fn extent_of(&mut self, world: World<'_>, value: ExprId, region: &Bounds) -> Bounds {
        if !self.is_live(world, value) {
            return *region;
        }
        let found = if self.is_lasting {
            let ranges = Ranges::of(world);
            let graph = world.expressions;
            extent(graph, value, &mut |id| ranges.of_leaf(graph, id))
        } else {
            let (graph, params, time) = (world.expressions, world.params, self.time);
            let present = &mut self.present;
            extent(graph, value, &mut |id| {
                Interval::point(present.value(graph, params, time, id))
            })
        };
        region.common(&found)
    }

    /// The box of the cells in which a repetition evaluates its child.
    pub(crate) fn cell_of(&mut self, world: World<'_>, id: ShapeId) -> Bounds {
        let ShapeKind::Repeat {
            parameters, others, ..
        } = &world.shapes[id.0 as usize].kind
        else {
            return Bounds::EVERYTHING;
        };
        let ranges = Ranges::of(world);
        let half: [f64; 3] = std::array::from_fn(|axis| {
            let spacing = ranges.of_number(world.expressions, parameters[axis]);
            let cells = f64::from(others[axis].near.max(others[axis].far)) + 0.5;
            let half = spacing.magnitude() * cells;
            // Without a spacing along an axis, the point is what it was there.
            if half > 0.0 { half } else { f64::INFINITY }
        });
        Bounds::centred(half)
    }

    /// The box of a shape whose rule says too little: one that has no end although its operands do, or that
    /// may be turned by any angle.
    fn searched(&mut self, world: World<'_>, id: ShapeId, ruled: &Bounds) -> Bounds {
        let kind = &world.shapes[id.0 as usize].kind;
        let has_ends = |boxes: &Self, kind: &ShapeKind| {
            let children = children(kind);
            !children.is_empty()
                && children
                    .iter()
                    .all(|child| boxes.boxes[child.0 as usize].is_finite())
        };
        let is_vague = match kind {
            ShapeKind::Combine { .. } | ShapeKind::Distance { .. } | ShapeKind::Displace { .. } => {
                !ruled.is_finite() && !ruled.is_void() && has_ends(self, kind)
            }
            ShapeKind::Domain {
                op: Op::Twist | Op::Bend,
                ..
            } => ruled.is_finite(),
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
            return *ruled;
        }
        let found = self.sublevel(world, id, 0.0, ruled);
        if found.is_empty() {
            *ruled
        } else {
            ruled.common(&found)
        }
    }

    /// The box by the rule of a row.
    fn ruled(&mut self, world: World<'_>, op: Op, numbers: &[f64], children: &[ShapeId]) -> Bounds {
        let boxes: Vec<Bounds> = children.iter().map(|&id| self.of(world, id)).collect();
        let first = || boxes.first().copied().unwrap_or(Bounds::EVERYTHING);
        let hull = || boxes.iter().fold(Bounds::EMPTY, |hull, b| hull.hull(b));
        let meta = &op.row().meta;
        match meta.bounds {
            BoundsRule::Shape(rule) => rule(numbers),
            BoundsRule::Hull => hull(),
            BoundsRule::HullGrown(rule) => {
                let by = match meta.blend {
                    Some(blend) => blend.kernel.most(numbers[0], boxes.len()),
                    // Each step of a chain may add to what the one before it added.
                    None => rule(numbers) * boxes.len().saturating_sub(1).max(1) as f64,
                };
                self.grown(world, &hull(), by, children)
            }
            BoundsRule::Common => boxes
                .iter()
                .fold(Bounds::EVERYTHING, |common, b| common.common(b)),
            BoundsRule::First => first(),
            BoundsRule::Map(rule) => rule(numbers, &first()),
            BoundsRule::Everything => Bounds::EVERYTHING,
        }
    }

    /// A box around shapes, grown by what is added to their distances.
    fn grown(
        &mut self,
        world: World<'_>,
        bounds: &Bounds,
        by: f64,
        children: &[ShapeId],
    ) -> Bounds {
        if by <= 0.0 {
            return bounds.grown(by);
        }
        let spread = self.joined(world, children);
        if spread.along.is_finite() {
            return bounds.grown(by * spread.along);
        }
        self.hull_below(world, children, by)
    }

    /// The hull of boxes outside of which the values of shapes are no less than `most`.
    fn hull_below(&mut self, world: World<'_>, shapes: &[ShapeId], most: f64) -> Bounds {
        let boxes = shapes.iter().map(|&id| self.below(world, id, most));
        boxes.fold(Bounds::EMPTY, |hull, bounds| hull.hull(&bounds))
    }

    /// A box outside of which a shape's value is no less than `most`. Recursion over shapes within shapes, whose
    /// depth the elaborator bounds.
    fn below(&mut self, world: World<'_>, id: ShapeId, most: f64) -> Bounds {
        let along = self.spread(world, id).along;
        if along.is_finite() {
            return self.of(world, id).grown(most * along);
        }
        match &world.shapes[id.0 as usize].kind {
            ShapeKind::Painted { child, .. } => self.below(world, *child, most),
            ShapeKind::Combine {
                op: Op::Union,
                children,
                ..
            } => self.hull_below(world, children, most),
            _ => self.sublevel(world, id, most, &Bounds::EVERYTHING),
        }
    }

    /// A box outside of which intervals prove a shape's value to be more than `most`, as far as that is within
    /// another one.
    fn sublevel(&mut self, world: World<'_>, id: ShapeId, most: f64, within: &Bounds) -> Bounds {
        let (graph, params, time) = (world.expressions, world.params, self.time);
        let (present, is_lasting) = (&mut self.present, self.is_lasting);
        let ranges = Ranges::of(world);
        let mut uniform = |id| match is_lasting {
            true => ranges.of_number(graph, id),
            false => Interval::point(present.value(graph, params, time, id)),
        };
        let mut range = ShapeRange::new(world, &mut uniform);
        _ = range.over(id, &Bounds::EVERYTHING);
        let evaluations = MAX_SEARCH_OPERATIONS / range.operations.max(1);
        let mut over = |bounds: &Bounds| range.over(id, bounds) - Interval::point(most);
        if within.is_finite() {
            return narrowed(within, evaluations, &mut over);
        }
        let plane = world.shapes[id.0 as usize].plane;
        search([false, false, plane], evaluations, &mut over)
    }

    fn joined(&mut self, world: World<'_>, children: &[ShapeId]) -> Spread {
        let spreads = children.iter().map(|&id| self.spread(world, id));
        spreads.fold(Spread::NONE, Spread::join)
    }

    /// How far a shape reaches beyond its box where it is only almost hit. Recursion over shapes
    /// within shapes, whose depth the elaborator bounds.
    fn spread(&mut self, world: World<'_>, id: ShapeId) -> Spread {
        if let Some(&spread) = self.spreads.get(&id) {
            return spread;
        }
        let bounds = self.of(world, id);
        let ends = bounds.min.into_iter().chain(bounds.max);
        let spread = match ends.into_iter().all(f64::is_infinite) {
            true => Spread::NONE,
            false => self.spread_of(world, id),
        };
        self.spreads.insert(id, spread);
        spread
    }

    fn spread_of(&mut self, world: World<'_>, id: ShapeId) -> Spread {
        match &world.shapes[id.0 as usize].kind {
            ShapeKind::Primitive { op, .. } => match op.row().meta.exactness {
                Exactness::Exact | Exactness::ExactOutside => Spread::NONE,
                Exactness::Bound | Exactness::Field => Spread::along_axes(1.0),
            },
            ShapeKind::Polygon { .. } | ShapeKind::Nothing => Spread::NONE,
            // Its region is where it is wanted, not where it is small.
            ShapeKind::Field { .. } => Spread::UNKNOWN,
            ShapeKind::Painted { child, .. } => self.spread(world, *child),
            ShapeKind::Combine { op, children, .. } => match op.row().meta.bounds {
                BoundsRule::Common => {
                    let known = |id: &ShapeId| (self.of(world, *id), self.spread(world, *id));
                    let known: Vec<_> = children.iter().map(known).collect();
                    Spread::common(&known)
                }
                BoundsRule::First => self.spread(world, children[0]),
                BoundsRule::Hull => self.joined(world, children),
                BoundsRule::HullGrown(_) => self.joined(world, children).grown(),
                BoundsRule::Shape(_) | BoundsRule::Map(_) | BoundsRule::Everything => {
                    Spread::UNKNOWN
                }
            },
            ShapeKind::Frame {
                child,
                matrix,
                scale,
            } => {
                let (inner, bounds) = (self.spread(world, *child), self.of(world, *child));
                let scale = self.number(world, *scale);
                match inverse(&self.numbers(world, matrix)) {
                    Some(rows) => inner.framed(&bounds, &rows, scale),
                    None => Spread::UNKNOWN,
                }
            }
            ShapeKind::Repeat { child, .. } => self.spread(world, *child),
            ShapeKind::Polar { child, .. } => self.spread(world, *child).turned(),
            ShapeKind::Domain { op, child, .. } => {
                let inner = self.spread(world, *child);
                match op {
                    Op::Twist | Op::Bend => inner.turned(),
                    // Others fold and move space along the axes.
                    _ => inner,
                }
            }
            ShapeKind::Distance {
                op,
                child,
                parameters,
            } => match op {
                Op::Offset | Op::Shell => {
                    let inner = self.spread(world, *child).grown();
                    let by = self.number(world, parameters[0]);
                    // Where the box shrinks, a straight line may have a longer way out of it.
                    if by < 0.0 {
                        Spread::along_axes(inner.along)
                    } else {
                        inner
                    }
                }
                _ => self.spread(world, *child),
            },
            // Maps that only shift points shift the box around them.
            ShapeKind::Warp { child, .. } => self.spread(world, *child),
            ShapeKind::Displace { child, .. } => self.spread(world, *child).grown(),
        }
    }
}

/// What a computed number is computed from.
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

/// The numbers that decide where a shape is, besides its operands.
fn numbers_of(kind: &ShapeKind) -> Vec<ExprId> {
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
        // A field's extent is looked for over all values of the parameters.
        ShapeKind::Field { .. } | ShapeKind::Painted { .. } | ShapeKind::Nothing => Vec::new(),
    }
}

/// The matrix from the inner to the outer point, if there is one.
pub(crate) fn inverse(m: &[f64]) -> Option<[[f64; 4]; 3]> {
    let at = |row: usize, column: usize| m[4 * row + column];
    let minor = |r: usize, c: usize| {
        let (r1, r2, c1, c2) = ((r + 1) % 3, (r + 2) % 3, (c + 1) % 3, (c + 2) % 3);
        at(r1, c1) * at(r2, c2) - at(r1, c2) * at(r2, c1)
    };
    let determinant: f64 = (0..3).map(|c| at(0, c) * minor(0, c)).sum();
    if !determinant.is_finite() || determinant == 0.0 {
        return None;
    }
    let mut rows = [[0.0; 4]; 3];
    for (r, row) in rows.iter_mut().enumerate() {
        for c in 0..3 {
            row[c] = minor(c, r) / determinant;
            row[3] -= row[c] * at(c, 3);
        }
    }
    Some(rows)
}

/// What is added to a coordinate in a sum that holds it, if the number is such a sum.
fn shift(graph: &Expressions, id: ExprId, axis: u8) -> Option<ExprId> {
    let is_axis = |id: ExprId| matches!(graph.get(id), Expression::Coordinate(a) if *a == axis);
    match graph.get(id) {
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

/// The value of a number of point stage, without parameters, at a point.
pub fn value_at(graph: &Expressions, id: ExprId, point: [f64; 3]) -> f64 {
    let order = crate::uniforms::operands_first(graph, id, |_| false);
    let mut values: HashMap<ExprId, f64> = HashMap::with_capacity(order.len());
    for id in order {
        let value = |id: &ExprId| values[id];
        let result = match graph.get(id) {
            Expression::Constant(value) => *value,
            Expression::Coordinate(axis) => point[usize::from(*axis)],
            Expression::Apply {
                op,
                point: None,
                values: operands,
                parameters,
            } => {
                let mut given = [0.0; 3];
                for (slot, id) in given.iter_mut().zip(operands) {
                    *slot = value(id);
                }
                let parameters: Vec<f64> = parameters.iter().map(value).collect();
                let p = V3::of(0.0, 0.0, 0.0);
                match apply::<f64>(*op, p, given, &laid_out(*op, &parameters)) {
                    Applied::Value(value) => value,
                    Applied::Point(_) => f64::NAN,
                }
            }
            _ => f64::NAN,
        };
        values.insert(id, result);
    }
    values[&id]
}
