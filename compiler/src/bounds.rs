//! Boxes around the shapes of a scene, at the present values of its parameters or at all.
//!
//! A box follows from the rules of the table, shape by shape; what the rules do not know (a warp, a
//! displacement, a field) follows by interval arithmetic where that gives something finite. What is
//! added to a shape grows its box by as much as the shape's distance is less than it should be, see
//! `spread.rs`.

use crate::expression::{ExprId, Expression, Expressions, ParamId};
use crate::range::range;
use crate::scene::{Animation, Param, Scene, Shape, ShapeId, ShapeKind};
use crate::slope::{self, Budget, Ranges};
use crate::spread::Spread;
use sdfc_vm::apply::{Applied, apply, laid_out};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::row::{BoundsRule, Exactness, Slope};
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
    let mut lasting = Boxes::lasting();
    ids().for_each(|id| _ = lasting.slope(world, id));
    let mut boxes = lasting.now(0.0);
    ids().map(|id| boxes.of(world, id)).collect()
}

/// Fields without bounds of their own are examined within this cube around the origin, in units.
const FIELD_REGION: f64 = 100.0;

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
    slopes: HashMap<ShapeId, Option<f64>>,
    /// What finding more slopes may take.
    budget: Budget,
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

    /// The same shapes' boxes at the present values of the parameters and this time.
    pub(crate) fn now(&self, time: f64) -> Self {
        Self {
            time,
            // What a value is divided by holds for all parameters.
            slopes: self.slopes.clone(),
            ..Self::default()
        }
    }

    /// The same shapes' boxes at a time, with these values of the parameters.
    pub(crate) fn with(&self, time: f64, values: HashMap<ParamId, Vec<f64>>) -> Self {
        Self {
            slopes: self.slopes.clone(),
            ..Self::at(time, values)
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
            let bounds = match moves {
                true => Bounds::EVERYTHING,
                false => self.bounds_of(world, &shape.kind),
            };
            self.boxes.push(bounds);
        }
        self.boxes[id.0 as usize]
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
            ShapeKind::Field { region, .. } => *region,
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
            ShapeKind::Domain {
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
                for (axis, &coordinate) in point.iter().enumerate() {
                    let graph = world.expressions;
                    if *graph.get(coordinate) == Expression::Coordinate(axis as u8) {
                        continue;
                    }
                    let moved = shift(graph, coordinate, axis as u8);
                    let moved = moved.map(|by| self.range(world, by));
                    // The shape is where the point, moved by this much, is inside the child.
                    match moved {
                        Some(by) if by.lo.is_finite() && by.hi.is_finite() => {
                            result.min[axis] -= by.hi;
                            result.max[axis] -= by.lo;
                        }
                        Some(_) | None => {
                            result.min[axis] = f64::NEG_INFINITY;
                            result.max[axis] = f64::INFINITY;
                        }
                    }
                }
                result
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
        bounds.grown(by * spread.along)
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
            ShapeKind::Domain { op, child, .. } => {
                let inner = self.spread(world, *child);
                match op {
                    Op::Polar | Op::PolarNeighbour | Op::PolarPlane | Op::PolarPlaneNeighbour => {
                        inner.turned()
                    }
                    Op::Twist | Op::Bend => inner.turned().slowed(self.divisor(world, id)),
                    // Others fold and move space along the axes.
                    _ => inner.slowed(self.divisor(world, id)),
                }
            }
            ShapeKind::Distance {
                op,
                child,
                parameters,
            } => match op {
                // Beyond the box that bounds it, it is at least as far as the box.
                Op::Bounded => Spread::NONE,
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
            ShapeKind::Warp { child, .. } => {
                let inner = self.spread(world, *child);
                inner.slowed(self.divisor(world, id))
            }
            ShapeKind::Displace { child, .. } => {
                let inner = self.spread(world, *child).grown();
                inner.slowed(self.divisor(world, id))
            }
        }
    }

    /// What the value of a shape is divided by where it stands, so that it is safe to march.
    fn divisor(&mut self, world: World<'_>, id: ShapeId) -> f64 {
        let slope = self.slope(world, id).unwrap_or(1.0);
        match world.shapes[id.0 as usize].kind {
            ShapeKind::Displace { .. } => 1.0 + slope,
            _ => slope.max(1.0),
        }
    }

    /// How steep what a shape is computed from can be, if it can be bounded: a field, a
    /// displacement, or the point that a warp or a change of the point makes. Other shapes have a
    /// slope of one.
    pub(crate) fn slope(&mut self, world: World<'_>, id: ShapeId) -> Option<f64> {
        if let Some(&slope) = self.slopes.get(&id) {
            return slope;
        }
        let slope = match &world.shapes[id.0 as usize].kind {
            ShapeKind::Field { value, region, .. } => self.field_slope(world, &[*value], region),
            ShapeKind::Warp { child, point } => {
                let region = self.of(world, *child);
                self.field_slope(world, point, &region)
            }
            ShapeKind::Displace { amount, .. } => {
                let region = self.of(world, id);
                self.field_slope(world, &[*amount], &region)
            }
            ShapeKind::Domain {
                op,
                child,
                parameters,
            } => Some(self.stretch(world, *op, parameters, *child, id)),
            ShapeKind::Primitive { .. }
            | ShapeKind::Polygon { .. }
            | ShapeKind::Combine { .. }
            | ShapeKind::Frame { .. }
            | ShapeKind::Distance { .. }
            | ShapeKind::Painted { .. }
            | ShapeKind::Nothing => Some(1.0),
        };
        self.slopes.insert(id, slope);
        slope
    }

    /// How much a row of the table stretches space near its child, whatever the parameters within
    /// their ranges. Farther out the elaborator has put a bound that needs no map; near means within
    /// an eighth of the result's size.
    fn stretch(
        &mut self,
        world: World<'_>,
        op: Op,
        parameters: &[ExprId],
        child: ShapeId,
        id: ShapeId,
    ) -> f64 {
        let Slope::Stretch(stretch) = op.row().meta.slope else {
            return 1.0;
        };
        let cube = Bounds::centred([FIELD_REGION; 3]);
        let inner = self.of(world, child).common(&cube);
        let outer = self.of(world, id);
        let size = if outer.is_finite() { outer } else { inner }.half_diagonal();
        let bounds = inner.grown(size * 0.125);
        let ranges = Ranges::of(world);
        let ranges: Vec<_> = parameters
            .iter()
            .map(|&id| ranges.of_number(world.expressions, id))
            .collect();
        // The rules grow with the magnitude of each parameter, so the ends of the ranges decide.
        let ends = [
            ranges.iter().map(|r| r.lo).collect::<Vec<_>>(),
            ranges.iter().map(|r| r.hi).collect::<Vec<_>>(),
        ];
        ends.iter()
            .map(|numbers| stretch(numbers, &bounds))
            .fold(1.0, f64::max)
    }

    /// The slope bound of numbers of point stage over a region, if there is one.
    fn field_slope(
        &mut self,
        world: World<'_>,
        numbers: &[ExprId],
        region: &Bounds,
    ) -> Option<f64> {
        let region = region.common(&Bounds::centred([FIELD_REGION; 3]));
        let ranges = Ranges::of(world);
        let budget = &mut self.budget;
        let slope = slope::bound(world.expressions, numbers, &region, &ranges, budget)?;
        Some(slope.max(1e-6))
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
        | ShapeKind::Domain { parameters, .. }
        | ShapeKind::Distance { parameters, .. } => parameters.clone(),
        ShapeKind::Polygon { points } => points.as_flattened().to_vec(),
        ShapeKind::Frame { matrix, .. } => matrix.to_vec(),
        ShapeKind::Warp { point, .. } => point.to_vec(),
        ShapeKind::Displace { amount, .. } => vec![*amount],
        // A field is where its region is, which is constant.
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
