//! Influence boxes: for each value `v` of the graph, a box `B` and a ratio `r` such that `v(p) ≥ r ·
//! dist(p, B)` for every `p` outside of `B`.
//!
//! A shape's value is exact outside, or bounds the distance along each axis. Composed values inherit a
//! box by the rules below. A point map such as a mirror, a repetition or a twist moves each single
//! point by a motion of space. So a distance after it is that to a moved box, and the table's rule
//! gives the hull of all moved boxes. Without a rule, or with a number that depends on a parameter,
//! there is no box.

use crate::analysis::bounds::inverse;
use crate::graph::{Graph, GraphNode, GraphNumber, NodeId, constants};
use sdfc_vm::apply::{OpResult, apply, pack_parameters};
use sdfc_vm::blend::Blend;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::row::{BoundsRule, Category, Exactness};
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;

/// Influence box of a value.
#[derive(Clone, Debug)]
pub(in crate::passes) struct NodeInfluenceBox {
    /// Point in whose space the box lies.
    pub(in crate::passes) space: NodeId,
    pub(in crate::passes) bounds: Bounds,
    /// Minimum ratio of the value to the distance from the box.
    pub(in crate::passes) distance_ratio: f64,
    /// Largest coordinate in the computation of the value, for rounding.
    pub(in crate::passes) max_coordinate: f64,
    /// For a chain of blends: the box of the operands, and their number.
    chain: Option<(Bounds, usize)>,
}

impl NodeInfluenceBox {
    fn new(space: NodeId, bounds: Bounds, distance_ratio: f64) -> Option<Self> {
        let is_usable = !bounds.is_void()
            && (0..3).all(|i| bounds.min[i] <= bounds.max[i])
            && distance_ratio.is_finite()
            && distance_ratio > 1e-6;
        is_usable.then(|| Self {
            space,
            bounds,
            distance_ratio,
            max_coordinate: largest_coordinate(&bounds),
            chain: None,
        })
    }

    fn with_bounds(self, bounds: Bounds, distance_ratio: f64) -> Option<Self> {
        let max_coordinate = self.max_coordinate;
        let influence_box = Self::new(self.space, bounds, distance_ratio)?;
        Some(influence_box.with_coordinate(max_coordinate))
    }

    fn with_coordinate(mut self, max_coordinate: f64) -> Self {
        self.max_coordinate = self.max_coordinate.max(max_coordinate);
        self
    }

    /// Returns the hull with another box in the same space.
    pub(in crate::passes) fn hull_with(&self, other: &Self) -> Self {
        Self {
            space: self.space,
            bounds: self.bounds.hull(&other.bounds),
            distance_ratio: self.distance_ratio.min(other.distance_ratio),
            max_coordinate: self.max_coordinate.max(other.max_coordinate),
            chain: None,
        }
    }

    /// Returns the influence box of the value less `amount`.
    fn less_by(self, amount: f64) -> Option<Self> {
        let (bounds, distance_ratio) = (
            self.bounds.grown(amount.max(0.0) / self.distance_ratio),
            self.distance_ratio,
        );
        self.with_bounds(bounds, distance_ratio)
    }
}

/// Returns the largest finite coordinate of a box.
fn largest_coordinate(bounds: &Bounds) -> f64 {
    let corners = bounds.min.iter().chain(&bounds.max);
    let finite = corners.map(|v| v.abs()).filter(|v| v.is_finite());
    finite.fold(0.0, f64::max)
}

/// Influence boxes of all values of a graph.
pub(in crate::passes) struct InfluenceBoxes<'g> {
    graph: &'g Graph,
    influence_boxes: Vec<Option<NodeInfluenceBox>>,
    /// Ranges of the values over all of space.
    ranges: Vec<Interval>,
}

impl<'g> InfluenceBoxes<'g> {
    /// Computes them, in the order of the graph.
    pub(in crate::passes) fn new(graph: &'g Graph) -> Self {
        let mut influence_boxes = Self {
            graph,
            influence_boxes: Vec::with_capacity(graph.len()),
            ranges: Vec::with_capacity(graph.len()),
        };
        for (id, node) in graph.nodes() {
            let range = influence_boxes.compute_range(node);
            influence_boxes.ranges.push(range);
            let influence_box = influence_boxes.compute_influence_box(id, node);
            influence_boxes.influence_boxes.push(influence_box);
        }
        influence_boxes
    }

    /// Returns the influence box of a value, in the space of the outermost point for which there is
    /// one.
    pub(in crate::passes) fn outermost(&self, id: NodeId) -> Option<NodeInfluenceBox> {
        Some(self.hoisted(self.get(id)?.clone()))
    }

    fn get(&self, id: NodeId) -> Option<&NodeInfluenceBox> {
        self.influence_boxes[id.0 as usize].as_ref()
    }

    /// Returns the range of a value over all of space.
    pub(in crate::passes) fn range(&self, id: NodeId) -> Interval {
        self.ranges[id.0 as usize]
    }

    fn compute_range(&self, node: &GraphNode) -> Interval {
        match node {
            GraphNode::Constant(GraphNumber::Constant(v)) => Interval::point(f64::from(*v)),
            GraphNode::Normal { .. } => Interval { lo: -1.0, hi: 1.0 },
            GraphNode::Paint { value, .. } => self.range(*value),
            GraphNode::Apply {
                op,
                values,
                parameters,
                ..
            } => {
                let Some(numbers) = constants(parameters) else {
                    return Interval::ALL;
                };
                let mut operands = [Interval::point(0.0); 3];
                for (slot, value) in operands.iter_mut().zip(values) {
                    *slot = self.range(*value);
                }
                let anywhere = V3::new(Interval::ALL, Interval::ALL, Interval::ALL);
                match apply(*op, anywhere, operands, &pack_parameters(*op, &numbers)) {
                    OpResult::Value(range) => range,
                    OpResult::Point(_) => Interval::ALL,
                }
            }
            GraphNode::World
            | GraphNode::Moved { .. }
            | GraphNode::Mapped { .. }
            | GraphNode::Chain { .. }
            | GraphNode::Constant(GraphNumber::Uniform(_)) => Interval::ALL,
        }
    }

    fn compute_influence_box(&self, id: NodeId, node: &GraphNode) -> Option<NodeInfluenceBox> {
        match node {
            GraphNode::Paint { value, .. } => self.get(*value).cloned(),
            GraphNode::Apply {
                op,
                point,
                values,
                parameters,
            } => {
                let numbers = constants(parameters)?;
                if *op == Op::PolygonEdge {
                    return self.polygon_box(id);
                }
                match op.row().facts.category {
                    Category::Shape3 | Category::Shape2 => shape_box(*op, (*point)?, &numbers),
                    Category::Combine => self.combined_box(*op, values, parameters, &numbers),
                    Category::Math => self.arithmetic_box(*op, values),
                    Category::Dimension | Category::Distance | Category::Internal => {
                        self.modified_box(*op, *point, values, &numbers)
                    }
                    Category::Domain => None,
                }
            }
            GraphNode::World
            | GraphNode::Moved { .. }
            | GraphNode::Mapped { .. }
            | GraphNode::Constant(_)
            | GraphNode::Chain { .. }
            | GraphNode::Normal { .. } => None,
        }
    }

    fn combined_box(
        &self,
        op: Op,
        values: &[NodeId],
        parameters: &[GraphNumber],
        numbers: &[f64],
    ) -> Option<NodeInfluenceBox> {
        let [a, b] = values[..] else { return None };
        let facts = &op.row().facts;
        match (facts.bounds, facts.blend) {
            // At least the smaller operand, less the amount that the blend adds.
            (BoundsRule::Hull, _) => self.hull(a, b),
            (BoundsRule::HullGrown(_), Some(blend)) => {
                self.blended_box(op, blend, [a, b], parameters, numbers)
            }
            (BoundsRule::HullGrown(by), None) => self.hull(a, b)?.less_by(by(numbers)),
            // At least either operand.
            (BoundsRule::Intersection, _) => self.smaller(a, b),
            // At least the first operand.
            (BoundsRule::FirstOperand, _) => self.get(a).cloned(),
            _ => None,
        }
    }

    /// Returns the box of a smooth union. A chain of them adds at most the kernel's maximum for all of
    /// its operands.
    fn blended_box(
        &self,
        op: Op,
        blend: Blend,
        [a, b]: [NodeId; 2],
        parameters: &[GraphNumber],
        numbers: &[f64],
    ) -> Option<NodeInfluenceBox> {
        let first = match (self.graph.get(a), self.get(a)) {
            (
                GraphNode::Apply {
                    op: inner,
                    parameters: inner_parameters,
                    ..
                },
                Some(NodeInfluenceBox {
                    chain: Some((bounds, operands)),
                    distance_ratio,
                    space,
                    max_coordinate,
                    ..
                }),
            ) if *inner == op && inner_parameters == parameters => Some((
                NodeInfluenceBox::new(*space, *bounds, *distance_ratio)?
                    .with_coordinate(*max_coordinate),
                *operands,
            )),
            (_, Some(influence_box)) => Some((influence_box.clone(), 1)),
            (_, None) => None,
        };
        let (first, operands) = first?;
        let hull = self.hull_of_boxes(first, self.get(b)?.clone())?;
        let operands = operands + 1;
        let bounds = hull.bounds;
        let mut result = hull.less_by(blend.kernel.max_chain_offset(numbers[0], operands))?;
        result.chain = Some((bounds, operands));
        Some(result)
    }

    fn arithmetic_box(&self, op: Op, values: &[NodeId]) -> Option<NodeInfluenceBox> {
        let [a, b] = values[..] else { return None };
        match op {
            Op::Min => self.hull(a, b),
            Op::Max => self.smaller(a, b),
            Op::Add => {
                let less_by_range = |influence_box, subtrahend| {
                    self.box_less_by(influence_box, -self.range(subtrahend).lo)
                };
                less_by_range(a, b).or_else(|| less_by_range(b, a))
            }
            Op::Sub => self.box_less_by(a, self.range(b).hi),
            _ => None,
        }
    }

    /// Returns the box of a value that is less by `amount`.
    fn box_less_by(&self, id: NodeId, amount: f64) -> Option<NodeInfluenceBox> {
        let influence_box = self.get(id).filter(|_| amount.is_finite())?;
        influence_box.clone().less_by(amount)
    }

    fn modified_box(
        &self,
        op: Op,
        point: Option<NodeId>,
        values: &[NodeId],
        numbers: &[f64],
    ) -> Option<NodeInfluenceBox> {
        let inner = || self.get(*values.first()?).cloned();
        match op {
            Op::Offset => inner()?.less_by(numbers[0]),
            // Outside of the box the value is its own magnitude.
            Op::Shell => inner()?.less_by(numbers[0]),
            Op::ScaleDistance | Op::FieldDistance => {
                let inner = inner()?;
                let (bounds, distance_ratio) = (inner.bounds, inner.distance_ratio * numbers[0]);
                inner.with_bounds(bounds, distance_ratio)
            }
            // It subtracts more inside only.
            Op::ElongateCorrect => inner(),
            // At least the first of two values.
            Op::RevolveClose => inner(),
            // At least the distance to its own box.
            Op::Bounded => NodeInfluenceBox::new(point?, bounds_by_rule(op, numbers)?, 1.0),
            Op::Extrude | Op::RoundedExtrude => {
                let plane = inner().filter(|plane| Some(plane.space) == point)?;
                let BoundsRule::Map(rule) = op.row().facts.bounds else {
                    return None;
                };
                let (bounds, distance_ratio) =
                    (rule(numbers, &plane.bounds), plane.distance_ratio.min(1.0));
                plane.with_bounds(bounds, distance_ratio)
            }
            _ => None,
        }
    }

    /// Returns the box of a polygon with a closed chain of edges: only then is its value positive
    /// outside.
    fn polygon_box(&self, last: NodeId) -> Option<NodeInfluenceBox> {
        let mut bounds = Bounds::EMPTY;
        let (mut id, mut space, mut start, mut end) = (last, None, None, None);
        loop {
            match self.graph.get(id) {
                GraphNode::Apply {
                    op: op @ Op::PolygonEdge,
                    point,
                    values,
                    parameters,
                } => {
                    let numbers = constants(parameters)?;
                    let [ax, ay, bx, by] = numbers[..] else {
                        return None;
                    };
                    let point = (*point)?;
                    let is_joined = start.is_none_or(|start| start == [bx, by]);
                    if !is_joined || *space.get_or_insert(point) != point {
                        return None;
                    }
                    start = Some([ax, ay]);
                    end.get_or_insert([bx, by]);
                    let BoundsRule::Map(rule) = op.row().facts.bounds else {
                        return None;
                    };
                    bounds = rule(&numbers, &bounds);
                    id = values[0];
                }
                GraphNode::Constant(GraphNumber::Constant(v)) if *v >= 1e30 => break,
                _ => return None,
            }
        }
        if start != end {
            return None;
        }
        NodeInfluenceBox::new(space?, bounds, 1.0)
    }

    fn hull(&self, a: NodeId, b: NodeId) -> Option<NodeInfluenceBox> {
        self.hull_of_boxes(self.get(a)?.clone(), self.get(b)?.clone())
    }

    fn hull_of_boxes(&self, a: NodeInfluenceBox, b: NodeInfluenceBox) -> Option<NodeInfluenceBox> {
        let [a, b] = self.in_common_space(a, b)?;
        Some(a.hull_with(&b))
    }

    /// Returns the smaller one of two boxes.
    fn smaller(&self, a: NodeId, b: NodeId) -> Option<NodeInfluenceBox> {
        let (a, b) = match (self.get(a), self.get(b)) {
            (Some(a), Some(b)) => (a, b),
            (existing, None) | (None, existing) => return existing.cloned(),
        };
        let is_first_smaller = a.bounds.half_diagonal() <= b.bounds.half_diagonal();
        Some(if is_first_smaller { a } else { b }.clone())
    }

    /// Brings two boxes to the same space, if there is one.
    fn in_common_space(
        &self,
        a: NodeInfluenceBox,
        b: NodeInfluenceBox,
    ) -> Option<[NodeInfluenceBox; 2]> {
        if a.space == b.space {
            return Some([a, b]);
        }
        let (a, b) = (self.hoisted(a), self.hoisted(b));
        (a.space == b.space).then_some([a, b])
    }

    /// Returns the box in the space of the world's point, or the outermost one that can be reached.
    fn hoisted(&self, mut influence_box: NodeInfluenceBox) -> NodeInfluenceBox {
        while let Some(outer) = self.hoist_once(&influence_box) {
            influence_box = outer;
        }
        influence_box
    }

    /// Returns the box in the next outer space.
    fn hoist_once(&self, influence_box: &NodeInfluenceBox) -> Option<NodeInfluenceBox> {
        let b = &influence_box.bounds;
        let (space, bounds, distance_ratio) = match self.graph.get(influence_box.space) {
            GraphNode::Moved { point, by } => {
                let by = constants(by)?;
                let bounds = Bounds {
                    min: std::array::from_fn(|i| b.min[i] - by[i]),
                    max: std::array::from_fn(|i| b.max[i] - by[i]),
                };
                (*point, bounds, influence_box.distance_ratio)
            }
            GraphNode::Mapped { point, rows } => {
                let rows = inverse(&constants(rows)?)?;
                (
                    *point,
                    b.mapped(&rows),
                    influence_box.distance_ratio / max_stretch(&rows),
                )
            }
            GraphNode::Apply {
                op: Op::MakePoint,
                values,
                ..
            } => {
                let (point, shifts) = self.shifted_point(values)?;
                let bounds = Bounds {
                    min: std::array::from_fn(|i| b.min[i] - shifts[i].hi),
                    max: std::array::from_fn(|i| b.max[i] - shifts[i].lo),
                };
                (point, bounds, influence_box.distance_ratio)
            }
            GraphNode::Apply {
                op,
                point,
                parameters,
                ..
            } if moves_points(*op) => {
                let BoundsRule::Map(rule) = op.row().facts.bounds else {
                    return None;
                };
                (
                    (*point)?,
                    rule(&constants(parameters)?, b),
                    influence_box.distance_ratio,
                )
            }
            _ => return None,
        };
        let hoisted = NodeInfluenceBox::new(space, bounds, distance_ratio)?;
        Some(hoisted.with_coordinate(influence_box.max_coordinate))
    }

    /// Returns the point that these coordinates shift, and the ranges of the shifts.
    fn shifted_point(&self, values: &[NodeId]) -> Option<(NodeId, [Interval; 3])> {
        let mut from = None;
        let mut shifts = [Interval::point(0.0); 3];
        for (axis, &value) in values.iter().enumerate() {
            let is_axis = |id: NodeId| match self.graph.get(id) {
                GraphNode::Apply { op, point, .. } if *op == [Op::X, Op::Y, Op::Z][axis] => *point,
                _ => None,
            };
            let (point, shift) = match (is_axis(value), self.graph.get(value)) {
                (Some(point), _) => (point, Interval::point(0.0)),
                (
                    None,
                    GraphNode::Apply {
                        op: Op::Add,
                        values,
                        ..
                    },
                ) => match (is_axis(values[0]), is_axis(values[1])) {
                    (Some(point), _) => (point, self.range(values[1])),
                    (None, Some(point)) => (point, self.range(values[0])),
                    (None, None) => return None,
                },
                _ => return None,
            };
            if *from.get_or_insert(point) != point || !(shift.hi - shift.lo).is_finite() {
                return None;
            }
            shifts[axis] = shift;
        }
        Some((from?, shifts))
    }
}

/// Returns the box of an operation that does not depend on an operand's box.
fn bounds_by_rule(op: Op, numbers: &[f64]) -> Option<Bounds> {
    match op.row().facts.bounds {
        BoundsRule::Map(rule) => Some(rule(numbers, &Bounds::ALL_SPACE)),
        rule => rule.shape_bounds(numbers),
    }
}

fn shape_box(op: Op, point: NodeId, numbers: &[f64]) -> Option<NodeInfluenceBox> {
    match op.row().facts.exactness {
        Exactness::Exact | Exactness::ExactOutside => {
            NodeInfluenceBox::new(point, bounds_by_rule(op, numbers)?, 1.0)
        }
        Exactness::Bound | Exactness::Unknown => None,
    }
}

/// Reports whether an operation moves each point by one of the motions that its bounds rule covers.
fn moves_points(op: Op) -> bool {
    matches!(
        op,
        Op::Mirror
            | Op::Repeat
            | Op::RepeatNeighbour
            | Op::RepeatLimited
            | Op::RepeatLimitedNeighbour
            | Op::Polar
            | Op::PolarNeighbour
            | Op::PolarPlane
            | Op::PolarPlaneNeighbour
            | Op::Revolve
            | Op::Elongate
            | Op::Twist
            | Op::Bend
    )
}

/// Returns a bound on the stretch of a map. Its squared norm is at most the largest row sum of its
/// square, with equality for rotations and for scales along axes.
fn max_stretch(rows: &[[f64; 4]; 3]) -> f64 {
    let square = |a: usize, b: usize| (0..3).map(|r| rows[r][a] * rows[r][b]).sum::<f64>();
    let sum = |a: usize| (0..3).map(|b| square(a, b).abs()).sum::<f64>();
    (0..3).map(sum).fold(0.0, f64::max).sqrt()
}

#[cfg(test)]
mod tests;
