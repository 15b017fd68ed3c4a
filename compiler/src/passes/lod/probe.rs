//! Fit of a box to a shape, by sampling. It also requires that the shape has an inside: a shape that
//! was cut away entirely must not come back as a box.

use crate::graph::{Graph, GraphNode, NodeId, constants};
use sdfc_vm::apply::{OpResult, apply, pack_parameters};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::collections::HashMap;

/// Maximum number of nodes of a sampled shape.
const MAX_SAMPLED_NODES: usize = 512;
/// Number of sample points along each axis; odd, so that the centre is one of them.
const SAMPLES_PER_AXIS: usize = 5;

/// Returns a bound on the distance of the points of a box from the shape inside it. `None` if no sample is
/// inside, if the shape has too many nodes, or if it cannot be evaluated.
///
/// A value of −r that changes no faster than the point moves has a sphere of radius r around its point that
/// is inside. The farthest corner is as far from that sphere as from its centre, less r.
pub(super) fn box_slack(graph: &Graph, id: NodeId, bounds: &Bounds) -> Option<f64> {
    if is_upright_box(graph, id) {
        return Some(0.0);
    }
    let order = subgraph(graph, id)?;
    let coordinate = |axis: usize, step: usize| {
        let fraction = (step as f64 + 0.5) / SAMPLES_PER_AXIS as f64;
        bounds.min[axis] + (bounds.max[axis] - bounds.min[axis]) * fraction
    };
    let distances = (0..SAMPLES_PER_AXIS.pow(3)).filter_map(|step| {
        let p = [
            coordinate(0, step % SAMPLES_PER_AXIS),
            coordinate(1, step / SAMPLES_PER_AXIS % SAMPLES_PER_AXIS),
            coordinate(2, step / SAMPLES_PER_AXIS / SAMPLES_PER_AXIS),
        ];
        let value = evaluate(graph, &order, V3::new(p[0], p[1], p[2]))?;
        let distance = |i: usize| (p[i] - bounds.min[i]).max(bounds.max[i] - p[i]);
        let corner = (0..3).map(|i| distance(i).powi(2)).sum::<f64>().sqrt();
        (value < 0.0).then_some(corner + value)
    });
    distances
        .min_by(f64::total_cmp)
        .map(|distance| distance.max(0.0))
}

/// Reports whether a shape is an axis-aligned box: it is equal to its bounding box.
fn is_upright_box(graph: &Graph, mut id: NodeId) -> bool {
    while let GraphNode::Paint { value, .. } = graph.get(id) {
        id = *value;
    }
    let GraphNode::Apply {
        op: Op::Cuboid,
        point: Some(point),
        ..
    } = graph.get(id)
    else {
        return false;
    };
    match graph.get(*point) {
        GraphNode::World => true,
        GraphNode::Moved { point, .. } => *graph.get(*point) == GraphNode::World,
        _ => false,
    }
}

/// Returns the nodes of a shape, in the order of the graph, itself last.
fn subgraph(graph: &Graph, id: NodeId) -> Option<Vec<NodeId>> {
    let mut nodes = vec![id];
    let mut next = 0;
    while let Some(&id) = nodes.get(next) {
        for input in graph.get(id).inputs() {
            if !nodes.contains(&input) {
                nodes.push(input);
            }
        }
        next += 1;
        if nodes.len() > MAX_SAMPLED_NODES {
            return None;
        }
    }
    nodes.sort_unstable();
    Some(nodes)
}

/// Evaluates the last of these nodes; `None` if it depends on parameters.
fn evaluate(graph: &Graph, order: &[NodeId], p: V3<f64>) -> Option<f64> {
    let mut points: HashMap<NodeId, V3<f64>> = HashMap::new();
    let mut values: HashMap<NodeId, f64> = HashMap::new();
    for &id in order {
        match graph.get(id) {
            GraphNode::World => {
                points.insert(id, p);
            }
            GraphNode::Moved { point, by } => {
                let (p, by) = (points.get(point)?, constants(by)?);
                points.insert(id, V3::new(p.x + by[0], p.y + by[1], p.z + by[2]));
            }
            GraphNode::Mapped { point, rows } => {
                let (p, r) = (points.get(point)?, constants(rows)?);
                let row = |i: usize| r[i] * p.x + r[i + 1] * p.y + r[i + 2] * p.z + r[i + 3];
                points.insert(id, V3::new(row(0), row(4), row(8)));
            }
            GraphNode::Constant(number) => {
                values.insert(id, constants(&[*number])?[0]);
            }
            GraphNode::Apply {
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
                let numbers = pack_parameters(*op, &constants(parameters)?);
                match apply::<f64>(*op, p, operands, &numbers) {
                    OpResult::Value(value) => drop(values.insert(id, value)),
                    OpResult::Point(point) => drop(points.insert(id, point)),
                }
            }
            GraphNode::Paint { value, .. } => {
                values.insert(id, *values.get(value)?);
            }
            GraphNode::Normal { .. } | GraphNode::Chain { .. } => return None,
        }
    }
    values.get(order.last()?).copied()
}
