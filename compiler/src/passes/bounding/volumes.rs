//! Boxes around what values are small in: for a value of the graph, a box such that the value is at
//! least the distance to the box, or a known share of it, wherever the point is outside.
//!
//! A shape's value is exact outside, or bounds the distance along each axis; what is made of shapes
//! inherits a box by rules that are written out below. A change of the point such as a mirror, a
//! repetition or a twist moves each single point by a motion of space, so a distance after it is that
//! to a moved box, and the hull of all moved boxes is what the table's rule gives. Where there is no
//! rule, or a number follows a parameter, there is no box.

use crate::bounds::inverse;
use crate::graph::{Graph, Node, NodeId, Number};
use sdfc_vm::apply::{Applied, apply, laid_out};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::kernel::Blend;
use sdfc_vm::row::{BoundsRule, Category, Exactness};
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;

/// A box that a value keeps its distance from.
#[derive(Clone, Debug)]
pub(in crate::passes) struct Volume {
    /// The point in whose space the box lies.
    pub(in crate::passes) space: NodeId,
    pub(in crate::passes) bounds: Bounds,
    /// The value is at least so many times the distance to the box.
    pub(in crate::passes) rate: f64,
    /// The largest coordinate that computing the value takes, for the rounding.
    pub(in crate::passes) extent: f64,
    /// Of a chain of blends: the box of what is blended, and how many operands there are.
    chain: Option<(Bounds, usize)>,
}

impl Volume {
    fn new(space: NodeId, bounds: Bounds, rate: f64) -> Option<Self> {
        let usable = !bounds.is_void()
            && (0..3).all(|i| bounds.min[i] <= bounds.max[i])
            && rate.is_finite()
            && rate > 1e-6;
        usable.then(|| Self {
            space,
            bounds,
            rate,
            extent: extent(&bounds),
            chain: None,
        })
    }

    fn with(self, bounds: Bounds, rate: f64) -> Option<Self> {
        let extent = self.extent;
        let volume = Self::new(self.space, bounds, rate)?;
        Some(volume.reaching(extent))
    }

    fn reaching(mut self, extent: f64) -> Self {
        self.extent = self.extent.max(extent);
        self
    }

    /// The box around both, which lie in one space.
    pub(in crate::passes) fn around(&self, other: &Self) -> Self {
        Self {
            space: self.space,
            bounds: self.bounds.hull(&other.bounds),
            rate: self.rate.min(other.rate),
            extent: self.extent.max(other.extent),
            chain: None,
        }
    }

    /// The same for a value that is less by `by`.
    fn grown(self, by: f64) -> Option<Self> {
        let (bounds, rate) = (self.bounds.grown(by.max(0.0) / self.rate), self.rate);
        self.with(bounds, rate)
    }
}

/// The largest finite coordinate of a box.
fn extent(bounds: &Bounds) -> f64 {
    let corners = bounds.min.iter().chain(&bounds.max);
    let finite = corners.map(|v| v.abs()).filter(|v| v.is_finite());
    finite.fold(0.0, f64::max)
}

/// The boxes of all values of a graph.
pub(in crate::passes) struct Volumes<'g> {
    graph: &'g Graph,
    of: Vec<Option<Volume>>,
    /// All that values may be, anywhere.
    ranges: Vec<Interval>,
}

impl<'g> Volumes<'g> {
    /// Finds them, in the order of the graph.
    pub(in crate::passes) fn of(graph: &'g Graph) -> Self {
        let mut volumes = Self {
            graph,
            of: Vec::with_capacity(graph.len()),
            ranges: Vec::with_capacity(graph.len()),
        };
        for (id, node) in graph.nodes() {
            let range = volumes.range_of(node);
            volumes.ranges.push(range);
            let volume = volumes.volume_of(id, node);
            volumes.of.push(volume);
        }
        volumes
    }

    /// The box of a value, in the space of the outermost point for which there is one.
    pub(in crate::passes) fn outermost(&self, id: NodeId) -> Option<Volume> {
        Some(self.lifted(self.get(id)?.clone()))
    }

    fn get(&self, id: NodeId) -> Option<&Volume> {
        self.of[id.0 as usize].as_ref()
    }

    /// All that a value may be, anywhere.
    pub(in crate::passes) fn range(&self, id: NodeId) -> Interval {
        self.ranges[id.0 as usize]
    }

    fn range_of(&self, node: &Node) -> Interval {
        match node {
            Node::Constant(Number::Constant(v)) => Interval::point(f64::from(*v)),
            Node::Normal { .. } => Interval { lo: -1.0, hi: 1.0 },
            Node::Paint { value, .. } => self.range(*value),
            Node::Apply {
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
                let anywhere = V3::of(Interval::ALL, Interval::ALL, Interval::ALL);
                match apply(*op, anywhere, operands, &laid_out(*op, &numbers)) {
                    Applied::Value(range) => range,
                    Applied::Point(_) => Interval::ALL,
                }
            }
            Node::World
            | Node::Moved { .. }
            | Node::Mapped { .. }
            | Node::Chain { .. }
            | Node::Constant(Number::Uniform(_)) => Interval::ALL,
        }
    }

    fn volume_of(&self, id: NodeId, node: &Node) -> Option<Volume> {
        match node {
            Node::Paint { value, .. } => self.get(*value).cloned(),
            Node::Apply {
                op,
                point,
                values,
                parameters,
            } => {
                let numbers = constants(parameters)?;
                if *op == Op::PolygonEdge {
                    return self.polygon(id);
                }
                match op.row().meta.category {
                    Category::Shape3 | Category::Shape2 => shape(*op, (*point)?, &numbers),
                    Category::Combine => self.combination(*op, values, parameters, &numbers),
                    Category::Math => self.arithmetic(*op, values),
                    Category::Dimension | Category::Distance | Category::Internal => {
                        self.changed(*op, *point, values, &numbers)
                    }
                    Category::Domain => None,
                }
            }
            Node::World
            | Node::Moved { .. }
            | Node::Mapped { .. }
            | Node::Constant(_)
            | Node::Chain { .. }
            | Node::Normal { .. } => None,
        }
    }

    fn combination(
        &self,
        op: Op,
        values: &[NodeId],
        parameters: &[Number],
        numbers: &[f64],
    ) -> Option<Volume> {
        let [a, b] = values[..] else { return None };
        let meta = &op.row().meta;
        match (meta.bounds, meta.blend) {
            // No less than the smaller operand, less what the blend adds.
            (BoundsRule::Hull, _) => self.hull(a, b),
            (BoundsRule::HullGrown(_), Some(blend)) => {
                self.blended(op, blend, [a, b], parameters, numbers)
            }
            (BoundsRule::HullGrown(by), None) => self.hull(a, b)?.grown(by(numbers)),
            // No less than either.
            (BoundsRule::Common, _) => self.smaller(a, b),
            // No less than the first.
            (BoundsRule::First, _) => self.get(a).cloned(),
            (BoundsRule::Shape(_) | BoundsRule::Map(_) | BoundsRule::Everything, _) => None,
        }
    }

    /// A smooth union. A chain of them adds no more in all than its kernel reaches.
    fn blended(
        &self,
        op: Op,
        blend: Blend,
        [a, b]: [NodeId; 2],
        parameters: &[Number],
        numbers: &[f64],
    ) -> Option<Volume> {
        let first = match (self.graph.get(a), self.get(a)) {
            (
                Node::Apply {
                    op: inner,
                    parameters: own,
                    ..
                },
                Some(Volume {
                    chain: Some((bounds, operands)),
                    rate,
                    space,
                    extent,
                    ..
                }),
            ) if *inner == op && own == parameters => Some((
                Volume::new(*space, *bounds, *rate)?.reaching(*extent),
                *operands,
            )),
            (_, Some(volume)) => Some((volume.clone(), 1)),
            (_, None) => None,
        };
        let (first, operands) = first?;
        let hull = self.join(first, self.get(b)?.clone())?;
        let operands = operands + 1;
        let bounds = hull.bounds;
        let mut grown = hull.grown(blend.kernel.most(numbers[0], operands))?;
        grown.chain = Some((bounds, operands));
        Some(grown)
    }

    fn arithmetic(&self, op: Op, values: &[NodeId]) -> Option<Volume> {
        let [a, b] = values[..] else { return None };
        match op {
            Op::Min => self.hull(a, b),
            Op::Max => self.smaller(a, b),
            Op::Add => {
                let less = |volume, by| self.less(volume, -self.range(by).lo);
                less(a, b).or_else(|| less(b, a))
            }
            Op::Sub => self.less(a, self.range(b).hi),
            _ => None,
        }
    }

    /// The box of a value that is less by so much.
    fn less(&self, id: NodeId, by: f64) -> Option<Volume> {
        let volume = self.get(id).filter(|_| by.is_finite())?;
        volume.clone().grown(by)
    }

    fn changed(
        &self,
        op: Op,
        point: Option<NodeId>,
        values: &[NodeId],
        numbers: &[f64],
    ) -> Option<Volume> {
        let inner = || self.get(*values.first()?).cloned();
        match op {
            Op::Offset => inner()?.grown(numbers[0]),
            // Outside of the box the value is its own magnitude.
            Op::Shell => inner()?.grown(numbers[0]),
            Op::ScaleDistance | Op::FieldDistance => {
                let inner = inner()?;
                let (bounds, rate) = (inner.bounds, inner.rate * numbers[0]);
                inner.with(bounds, rate)
            }
            // More is taken away inside only.
            Op::ElongateCorrect => inner(),
            // No less than the first of two.
            Op::RevolveClose => inner(),
            // No less than the distance to the box that it is made of.
            Op::Bounded => Volume::new(point?, ruled(op, numbers)?, 1.0),
            Op::Extrude | Op::RoundedExtrude => {
                let plane = inner().filter(|plane| Some(plane.space) == point)?;
                let BoundsRule::Map(rule) = op.row().meta.bounds else {
                    return None;
                };
                let (bounds, rate) = (rule(numbers, &plane.bounds), plane.rate.min(1.0));
                plane.with(bounds, rate)
            }
            _ => None,
        }
    }

    /// A polygon, if its chain of edges is closed: only then is its value positive outside.
    fn polygon(&self, last: NodeId) -> Option<Volume> {
        let mut bounds = Bounds::EMPTY;
        let (mut id, mut space, mut start, mut end) = (last, None, None, None);
        loop {
            match self.graph.get(id) {
                Node::Apply {
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
                    let joins = start.is_none_or(|start| start == [bx, by]);
                    if !joins || *space.get_or_insert(point) != point {
                        return None;
                    }
                    start = Some([ax, ay]);
                    end.get_or_insert([bx, by]);
                    let BoundsRule::Map(rule) = op.row().meta.bounds else {
                        return None;
                    };
                    bounds = rule(&numbers, &bounds);
                    id = values[0];
                }
                Node::Constant(Number::Constant(v)) if *v >= 1e30 => break,
                _ => return None,
            }
        }
        if start != end {
            return None;
        }
        Volume::new(space?, bounds, 1.0)
    }

    fn hull(&self, a: NodeId, b: NodeId) -> Option<Volume> {
        self.join(self.get(a)?.clone(), self.get(b)?.clone())
    }

    fn join(&self, a: Volume, b: Volume) -> Option<Volume> {
        let [a, b] = self.together(a, b)?;
        Some(a.around(&b))
    }

    /// Either of two, whichever is the smaller box.
    fn smaller(&self, a: NodeId, b: NodeId) -> Option<Volume> {
        let (a, b) = match (self.get(a), self.get(b)) {
            (Some(a), Some(b)) => (a, b),
            (only, None) | (None, only) => return only.cloned(),
        };
        let first = a.bounds.half_diagonal() <= b.bounds.half_diagonal();
        Some(if first { a } else { b }.clone())
    }

    /// Two boxes in the same space.
    fn together(&self, a: Volume, b: Volume) -> Option<[Volume; 2]> {
        if a.space == b.space {
            return Some([a, b]);
        }
        let (a, b) = (self.lifted(a), self.lifted(b));
        (a.space == b.space).then_some([a, b])
    }

    /// The box in the space of the world's point, or as near to it as it gets.
    fn lifted(&self, mut volume: Volume) -> Volume {
        while let Some(outer) = self.lift(&volume) {
            volume = outer;
        }
        volume
    }

    /// The box in the space that its own is made from.
    fn lift(&self, volume: &Volume) -> Option<Volume> {
        let b = &volume.bounds;
        let (space, bounds, rate) = match self.graph.get(volume.space) {
            Node::Moved { point, by } => {
                let by = constants(by)?;
                let bounds = Bounds {
                    min: std::array::from_fn(|i| b.min[i] - by[i]),
                    max: std::array::from_fn(|i| b.max[i] - by[i]),
                };
                (*point, bounds, volume.rate)
            }
            Node::Mapped { point, rows } => {
                let rows = inverse(&constants(rows)?)?;
                (*point, b.mapped(&rows), volume.rate / stretch(&rows))
            }
            Node::Apply {
                op: Op::MakePoint,
                values,
                ..
            } => {
                let (point, shifts) = self.shifted(values)?;
                let bounds = Bounds {
                    min: std::array::from_fn(|i| b.min[i] - shifts[i].hi),
                    max: std::array::from_fn(|i| b.max[i] - shifts[i].lo),
                };
                (point, bounds, volume.rate)
            }
            Node::Apply {
                op,
                point,
                parameters,
                ..
            } if moves_points(*op) => {
                let BoundsRule::Map(rule) = op.row().meta.bounds else {
                    return None;
                };
                ((*point)?, rule(&constants(parameters)?, b), volume.rate)
            }
            _ => return None,
        };
        let lifted = Volume::new(space, bounds, rate)?;
        Some(lifted.reaching(volume.extent))
    }

    /// The point whose coordinates these values are, but for shifts within known ranges.
    fn shifted(&self, values: &[NodeId]) -> Option<(NodeId, [Interval; 3])> {
        let mut from = None;
        let mut shifts = [Interval::point(0.0); 3];
        for (axis, &value) in values.iter().enumerate() {
            let is_axis = |id: NodeId| match self.graph.get(id) {
                Node::Apply { op, point, .. } if *op == [Op::X, Op::Y, Op::Z][axis] => *point,
                _ => None,
            };
            let (point, shift) = match (is_axis(value), self.graph.get(value)) {
                (Some(point), _) => (point, Interval::point(0.0)),
                (
                    None,
                    Node::Apply {
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

/// The numbers, if none follows a parameter.
pub(in crate::passes) fn constants(numbers: &[Number]) -> Option<Vec<f64>> {
    let constant = |n: &Number| match n {
        Number::Constant(v) => Some(f64::from(*v)),
        Number::Uniform(_) => None,
    };
    numbers.iter().map(constant).collect()
}

/// The box of a row that needs no operand's.
fn ruled(op: Op, numbers: &[f64]) -> Option<Bounds> {
    match op.row().meta.bounds {
        BoundsRule::Shape(rule) => Some(rule(numbers)),
        BoundsRule::Map(rule) => Some(rule(numbers, &Bounds::EVERYTHING)),
        _ => None,
    }
}

fn shape(op: Op, point: NodeId, numbers: &[f64]) -> Option<Volume> {
    match op.row().meta.exactness {
        Exactness::Exact | Exactness::ExactOutside => Volume::new(point, ruled(op, numbers)?, 1.0),
        Exactness::Bound | Exactness::Field => None,
    }
}

/// Whether an operation moves each point by a motion of space, one of those whose images of a box
/// its rule holds.
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

/// How much a map stretches at most: its norm is at most the root of the largest sum of a row of its
/// square, which is what it is for turns and for scales by axes.
fn stretch(rows: &[[f64; 4]; 3]) -> f64 {
    let square = |a: usize, b: usize| (0..3).map(|r| rows[r][a] * rows[r][b]).sum::<f64>();
    let sum = |a: usize| (0..3).map(|b| square(a, b).abs()).sum::<f64>();
    (0..3).map(sum).fold(0.0, f64::max).sqrt()
}

#[cfg(test)]
mod tests;
