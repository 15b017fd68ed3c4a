//! How well a box fits a shape, found by looking at the shape: also that it has an inside at all, since
//! what is cut away to nothing must not come back as a box.

use crate::graph::{Graph, Node, NodeId};
use crate::passes::bounding::volumes::constants;
use sdfc_vm::apply::{Applied, apply, laid_out};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::collections::HashMap;

/// Shapes of more nodes than this are not looked at.
const LARGEST: usize = 512;
/// So many points along each axis are tried; an odd number, so that the middle is one.
const SIDE: usize = 5;

/// How far the points of a box around a shape are from the shape at most; nothing if no inside of it
/// was found.
///
/// A value of −r that changes no faster than the point moves has a ball of the radius r around it that
/// is inside. From that the farthest corner is as far away as from its middle, less r.
pub(super) fn slack(graph: &Graph, id: NodeId, bounds: &Bounds) -> Option<f64> {
    if is_upright_box(graph, id) {
        return Some(0.0);
    }
    let order = within(graph, id)?;
    let place = |axis: usize, step: usize| {
        let share = (step as f64 + 0.5) / SIDE as f64;
        bounds.min[axis] + (bounds.max[axis] - bounds.min[axis]) * share
    };
    let ways = (0..SIDE.pow(3)).filter_map(|step| {
        let p = [
            place(0, step % SIDE),
            place(1, step / SIDE % SIDE),
            place(2, step / SIDE / SIDE),
        ];
        let value = value(graph, &order, V3::of(p[0], p[1], p[2]))?;
        let way = |i: usize| (p[i] - bounds.min[i]).max(bounds.max[i] - p[i]);
        let corner = (0..3).map(|i| way(i).powi(2)).sum::<f64>().sqrt();
        (value < 0.0).then_some(corner + value)
    });
    ways.min_by(f64::total_cmp).map(|way| way.max(0.0))
}

/// Whether a shape is a box along the axes: it is its own box.
fn is_upright_box(graph: &Graph, mut id: NodeId) -> bool {
    while let Node::Paint { value, .. } = graph.get(id) {
        id = *value;
    }
    let Node::Apply {
        op: Op::Cuboid,
        point: Some(point),
        ..
    } = graph.get(id)
    else {
        return false;
    };
    match graph.get(*point) {
        Node::World => true,
        Node::Moved { point, .. } => *graph.get(*point) == Node::World,
        _ => false,
    }
}

/// What a node is made of, in the order of the graph, itself last.
fn within(graph: &Graph, id: NodeId) -> Option<Vec<NodeId>> {
    let mut found = vec![id];
    let mut at = 0;
    while let Some(&id) = found.get(at) {
        for input in graph.get(id).inputs() {
            if !found.contains(&input) {
                found.push(input);
            }
        }
        at += 1;
        if found.len() > LARGEST {
            return None;
        }
    }
    found.sort_unstable();
    Some(found)
}

/// The value of the last of these nodes; nothing where it depends on parameters or materials.
fn value(graph: &Graph, order: &[NodeId], p: V3<f64>) -> Option<f64> {
    let mut points: HashMap<NodeId, V3<f64>> = HashMap::new();
    let mut values: HashMap<NodeId, f64> = HashMap::new();
    for &id in order {
        match graph.get(id) {
            Node::World => {
                points.insert(id, p);
            }
            Node::Moved { point, by } => {
                let (p, by) = (points.get(point)?, constants(by)?);
                points.insert(id, V3::of(p.x + by[0], p.y + by[1], p.z + by[2]));
            }
            Node::Mapped { point, rows } => {
                let (p, r) = (points.get(point)?, constants(rows)?);
                let row = |i: usize| r[i] * p.x + r[i + 1] * p.y + r[i + 2] * p.z + r[i + 3];
                points.insert(id, V3::of(row(0), row(4), row(8)));
            }
            Node::Constant(number) => {
                values.insert(id, constants(&[*number])?[0]);
            }
            Node::Apply {
                op,
                point,
                values: inputs,
                parameters,
            } => {
                let p = point.map_or(Some(p), |point| points.get(&point).copied())?;
                let mut operands = [0.0; 3];
                for (slot, input) in operands.iter_mut().zip(inputs) {
                    *slot = *values.get(input)?;
                }
                let numbers = laid_out(*op, &constants(parameters)?);
                match apply::<f64>(*op, p, operands, &numbers) {
                    Applied::Value(value) => drop(values.insert(id, value)),
                    Applied::Point(point) => drop(points.insert(id, point)),
                }
            }
            Node::Paint { value, .. } => {
                values.insert(id, *values.get(value)?);
            }
            Node::Normal { .. } | Node::Chain { .. } => return None,
        }
    }
    values.get(order.last()?).copied()
}
