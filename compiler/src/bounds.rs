//! Boxes around the shapes of a scene, at the present values of its parameters.
//!
//! A box follows from the rules of the table, shape by shape; what the rules do not know (a warp, a
//! displacement, a field) follows by interval arithmetic where that gives something finite.

use crate::expression::{ExprId, Expression, Expressions};
use crate::scene::{Param, Scene, Shape, ShapeKind};
use sdfc_vm::apply::{Applied, apply, laid_out};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::row::BoundsRule;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::collections::{BTreeSet, HashMap};

/// The values that numbers have at the present parameters and time, computed in the order of the
/// graph, once each. Numbers of a point have none.
#[derive(Clone, Debug, Default)]
pub struct Present {
    values: Vec<f64>,
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
                let param = params.get(param.0 as usize);
                param
                    .and_then(|p| p.value.get(usize::from(*component)))
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

/// The box of every shape of a scene.
pub fn shape_bounds(scene: &Scene) -> Vec<Bounds> {
    let mut present = Present::default();
    let mut value = |id| present.value(&scene.expressions, &scene.params, 0.0, id);
    let mut bounds = Vec::with_capacity(scene.shapes.len());
    for shape in &scene.shapes {
        let next = bounds_of(shape, &bounds, &scene.expressions, &mut value);
        bounds.push(next);
    }
    bounds
}

/// The box of every shape of a scene, whatever the live parameters and the time: what reads one of
/// them may be anywhere. Rays are cut to these boxes, and slopes hold within them.
pub fn lasting_bounds(scene: &Scene) -> Vec<Bounds> {
    let graph = &scene.expressions;
    let mut live = vec![false; graph.len()];
    for (id, node, _) in graph.since(0) {
        live[id.index()] = match node {
            Expression::Param(..) | Expression::Time => true,
            Expression::Constant(_)
            | Expression::Coordinate(_)
            | Expression::NormalComponent(_) => false,
            Expression::Apply {
                point,
                values,
                parameters,
                ..
            } => {
                let mut inputs = point.iter().flatten().chain(values).chain(parameters);
                inputs.any(|input| live[input.index()])
            }
        };
    }
    let mut present = Present::default();
    let mut value = |id| present.value(graph, &scene.params, 0.0, id);
    let mut bounds = Vec::with_capacity(scene.shapes.len());
    for shape in &scene.shapes {
        let moves = numbers_of(&shape.kind).iter().any(|id| live[id.index()]);
        let next = match moves {
            true => Bounds::EVERYTHING,
            false => bounds_of(shape, &bounds, graph, &mut value),
        };
        bounds.push(next);
    }
    bounds
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

/// The box of a shape, given those of all shapes before it.
pub fn bounds_of(
    shape: &Shape,
    known: &[Bounds],
    graph: &Expressions,
    value: &mut dyn FnMut(ExprId) -> f64,
) -> Bounds {
    let mut numbers = |ids: &[ExprId]| ids.iter().map(|&id| value(id)).collect::<Vec<f64>>();
    match &shape.kind {
        ShapeKind::Primitive { op, parameters } => {
            ruled(*op, &numbers(parameters), &mut std::iter::empty())
        }
        ShapeKind::Field { region, .. } => *region,
        ShapeKind::Polygon { points } => {
            let mut hull = Bounds::EMPTY;
            for [x, y] in points {
                let (x, y) = (value(*x), value(*y));
                hull = hull
                    .including([x, y, f64::NEG_INFINITY])
                    .including([x, y, f64::INFINITY]);
            }
            hull
        }
        ShapeKind::Combine {
            op,
            children,
            parameters,
        } => {
            let numbers = numbers(parameters);
            let mut children = children.iter().map(|id| known[id.0 as usize]);
            ruled(*op, &numbers, &mut children)
        }
        ShapeKind::Frame { child, matrix, .. } => {
            let matrix = numbers(matrix);
            match inverse(&matrix) {
                Some(rows) => known[child.0 as usize].mapped(&rows),
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
            let child = known[child.0 as usize];
            ruled(*op, &numbers(parameters), &mut std::iter::once(child))
        }
        ShapeKind::Warp { child, point } => {
            let child = known[child.0 as usize];
            let mut result = child;
            for (axis, &coordinate) in point.iter().enumerate() {
                if *graph.get(coordinate) == Expression::Coordinate(axis as u8) {
                    continue;
                }
                let moved = shift(graph, coordinate, axis as u8)
                    .map(|by| range(graph, by, &Bounds::EVERYTHING, value));
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
            let amount = range(graph, *amount, &Bounds::EVERYTHING, value);
            known[child.0 as usize].grown((-amount.lo).max(0.0))
        }
        ShapeKind::Painted { child, .. } => known[child.0 as usize],
        ShapeKind::Nothing => Bounds::EMPTY,
    }
}

/// The box by the rule of a row.
fn ruled(op: Op, numbers: &[f64], operands: &mut dyn Iterator<Item = Bounds>) -> Bounds {
    let mut hull = || operands.fold(Bounds::EMPTY, |hull, b| hull.hull(&b));
    match op.row().meta.bounds {
        BoundsRule::Shape(rule) => rule(numbers),
        BoundsRule::Hull => hull(),
        BoundsRule::HullGrown(rule) => {
            let mut count = 0_u32;
            let hull = operands.fold(Bounds::EMPTY, |hull, b| {
                count += 1;
                hull.hull(&b)
            });
            // Each step of a chain may add to what the one before it added.
            hull.grown(rule(numbers) * f64::from(count.saturating_sub(1).max(1)))
        }
        BoundsRule::Common => operands.fold(Bounds::EVERYTHING, |common, b| common.common(&b)),
        BoundsRule::First => operands.next().unwrap_or(Bounds::EVERYTHING),
        BoundsRule::Map(rule) => operands
            .next()
            .map_or(Bounds::EVERYTHING, |child| rule(numbers, &child)),
        BoundsRule::Everything => Bounds::EVERYTHING,
    }
}

/// The matrix from the inner to the outer point, if there is one.
fn inverse(m: &[f64]) -> Option<[[f64; 4]; 3]> {
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

/// All values that a number may have while its point is in a box.
pub fn range(
    graph: &Expressions,
    id: ExprId,
    region: &Bounds,
    value: &mut dyn FnMut(ExprId) -> f64,
) -> Interval {
    let mut needed = BTreeSet::new();
    let mut pending = vec![id];
    while let Some(id) = pending.pop() {
        if needed.insert(id)
            && let Expression::Apply { point, values, .. } = graph.get(id)
        {
            pending.extend(point.iter().flatten().chain(values));
        }
    }
    // Ids grow from operands to what uses them.
    let mut known: HashMap<ExprId, Interval> = HashMap::with_capacity(needed.len());
    let mut last = Interval::ALL;
    for id in needed {
        last = match graph.get(id) {
            Expression::Constant(_) | Expression::Param(..) | Expression::Time => {
                Interval::point(value(id))
            }
            Expression::Coordinate(axis) => {
                let axis = usize::from(*axis);
                Interval {
                    lo: region.min[axis],
                    hi: region.max[axis],
                }
            }
            Expression::NormalComponent(_) => Interval { lo: -1.0, hi: 1.0 },
            Expression::Apply {
                op,
                point,
                values,
                parameters,
            } => {
                let get = |id: &ExprId| known.get(id).copied().unwrap_or(Interval::ALL);
                let p = point.map_or([Interval::ALL; 3], |p| [0, 1, 2].map(|i| get(&p[i])));
                let mut operands = [Interval::point(0.0); 3];
                for (slot, id) in operands.iter_mut().zip(values) {
                    *slot = get(id);
                }
                let parameters: Vec<f64> = parameters.iter().map(|&id| value(id)).collect();
                let [x, y, z] = p;
                match apply(*op, V3::of(x, y, z), operands, &laid_out(*op, &parameters)) {
                    Applied::Value(range) => range,
                    Applied::Point(_) => Interval::ALL,
                }
            }
        };
        known.insert(id, last);
    }
    last
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
