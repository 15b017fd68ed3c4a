//! The scene as a tree of shapes whose numbers are known, and its value at points.

use super::combine::Set;
use super::extent::Extent;
use super::hierarchy::Hierarchy;
use super::number::Formula;
use super::point::{Point, beyond, norm2};
use super::probe::Probe;
use super::solids::{Leaf, extruded};
use super::space::{Grid, Ring, Wedge, before_turn, turned};
use sdfc_compiler::scene::MaterialId;

/// The value of no shape at all, and in place of NaN.
pub(super) const DEFAULT_OUTSIDE_VALUE: f64 = 1e9;
/// The most that a formula is taken to grow steeper within the radius that is guessed.
const MAX_SLOPE_GROWTH_FACTOR: f64 = 3.0;

/// The longest radius that a proof is tried for, in lengths over which slopes are taken.
const MAX_PROOF_RADIUS_REACHES: f64 = 400.0;

/// A shape by its position in the tree.
pub(super) type NodeId = u32;

/// A shape of the tree.
#[derive(Clone, Debug)]
pub(super) struct Node {
    /// The kind of shape, and all that makes it.
    pub(super) kind: Kind,
    /// The box around it.
    pub(super) extent: Extent,
    /// The most that its value changes per unit of length, which is infinite if it is not known.
    pub(super) steepness: f64,
    /// The longest radius to trust a formula with.
    pub(super) grain: f64,
    /// Set if any of it has a paint.
    pub(super) is_painted: bool,
}

/// A kind of shape.
#[derive(Clone, Debug)]
pub(super) enum Kind {
    /// A solid or a figure.
    Leaf(Leaf),
    /// A formula of the point.
    Field(Formula),
    /// A hard union.
    Union {
        /// The operands in order.
        children: Vec<NodeId>,
        /// The operands, and those of unions among them, by place.
        hierarchy: Hierarchy,
    },
    /// Any other combination, from left to right.
    Combine {
        /// The set operation.
        set: Set,
        /// The operands in order.
        children: Vec<NodeId>,
    },
    /// A child in a frame of its own.
    Frame {
        /// The child.
        child: NodeId,
        /// From the outer to the inner point.
        matrix: [f64; 12],
        /// The length outside of a unit of the child's value.
        scale: f64,
        /// The most that the matrix stretches.
        stretch: f64,
    },
    /// Copies along the axes.
    Grid(NodeId, Grid),
    /// Copies around an axis.
    Ring(NodeId, Ring),
    /// Both sides of planes.
    Mirror(NodeId, [bool; 3]),
    /// A child turned about the y axis by a rate.
    Twist(NodeId, f64),
    /// A child turned about the z axis by a rate along x.
    Bend(NodeId, f64),
    /// A child pulled apart by these half lengths.
    Elongate(NodeId, Point),
    /// The inside of an elongated child.
    Elongated {
        /// The child, pulled apart.
        child: NodeId,
        /// Half the lengths.
        half: Point,
        /// The number of axes that count, which is two for a figure.
        axes: usize,
    },
    /// A figure turned around the y axis, this far from it.
    Revolve(NodeId, f64),
    /// The same within a wedge.
    RevolvePart(NodeId, f64, Wedge),
    /// The ends of a partial revolution.
    RevolveClose(NodeId, Wedge),
    /// A solid's section with z = 0.
    Slice(NodeId),
    /// A figure's prism of this half height.
    Extrude(NodeId, f64),
    /// The same with rims rounded by a radius.
    RoundedExtrude(NodeId, f64, f64),
    /// All points outside of a child.
    Complement(NodeId),
    /// A child grown by a length.
    Offset(NodeId, f64),
    /// A child's surface as a wall of this half thickness.
    Shell(NodeId, f64),
    /// A child's value times a factor.
    Scale(NodeId, f64),
    /// A child at the point of a formula.
    Warp(NodeId, Formula),
    /// A child whose value a formula is added to.
    Displace(NodeId, Formula),
    /// A child in a material.
    Painted(NodeId, MaterialId),
    /// No shape.
    Nothing,
}

/// A scene's shapes, operands before what uses them.
#[derive(Debug)]
pub(super) struct Tree {
    /// All of them.
    pub(super) nodes: Vec<Node>,
    /// The whole.
    pub(super) root: NodeId,
}

/// A row of a matrix times a point, and the shift.
fn row(matrix: &[f64; 12], at: usize, p: Point) -> f64 {
    matrix[at] * p[0] + matrix[at + 1] * p[1] + matrix[at + 2] * p[2] + matrix[at + 3]
}

/// The point that an affine map leads to.
pub(super) fn mapped(matrix: &[f64; 12], p: Point) -> Point {
    [row(matrix, 0, p), row(matrix, 4, p), row(matrix, 8, p)]
}

impl Tree {
    /// A shape of the tree.
    pub(super) fn node(&self, id: NodeId) -> &Node {
        &self.nodes[id as usize]
    }

    /// The value of a shape at a point.
    pub(super) fn value(&self, id: NodeId, p: Point) -> f64 {
        self.probe(id, p, 0.0).value
    }

    /// The knowledge of a shape at a point.
    ///
    /// `reach` is the length over which slopes of formulas are taken. If it is zero there is no guess.
    pub(super) fn probe(&self, id: NodeId, p: Point, reach: f64) -> Probe {
        let node = self.node(id);
        match &node.kind {
            Kind::Leaf(leaf) => Probe::steady((leaf.body)(&leaf.numbers, p), leaf.steepness),
            Kind::Union { hierarchy, .. } => {
                hierarchy.union(p, |child| self.probe(child, p, reach))
            }
            Kind::Combine { set, children } => self.combined(node, *set, children, p, reach),
            Kind::Frame {
                child,
                matrix,
                scale,
                stretch,
            } => {
                let inner = self.probe(*child, mapped(matrix, p), reach * stretch);
                inner.before(*stretch).with_value(inner.value * scale)
            }
            Kind::Twist(child, rate) => {
                let inner = self.probe(*child, turned(p, 1, rate * p[1]), reach);
                before_turned(inner, *rate, norm2(p[0], p[2]))
            }
            Kind::Bend(child, rate) => {
                let inner = self.probe(*child, turned(p, 2, rate * p[0]), reach);
                before_turned(inner, *rate, norm2(p[0], p[1]))
            }
            Kind::Grid(child, grid) => {
                let extent = &self.node(*child).extent;
                self.copies(*child, reach, |visit| grid.each(extent, p, visit))
            }
            Kind::Ring(child, ring) => {
                let extent = &self.node(*child).extent;
                self.copies(*child, reach, |visit| ring.each(extent, p, visit))
            }
            Kind::Elongated { child, half, axes } => {
                let inner = self.probe(*child, p, reach);
                let gap = (0..*axes).map(|i| p[i].abs() - half[i]);
                let within = gap.fold(f64::NEG_INFINITY, f64::max).min(0.0);
                match inner.is_inside() {
                    true => inner.with_value(inner.value + within),
                    false => inner,
                }
            }
            Kind::RevolveClose(child, wedge) => self.closed(*child, *wedge, p, reach),
            Kind::Extrude(child, half) => {
                let figure = self.probe(*child, p, reach);
                let slab = Probe::steady(p[2].abs() - half, 1.0);
                let value = extruded(figure.value, slab.value);
                figure.intersection(slab).with_value(value)
            }
            Kind::Complement(child) => self.probe(*child, p, reach).complement(),
            Kind::Scale(child, factor) => {
                let inner = self.probe(*child, p, reach);
                inner.with_value(inner.value * factor)
            }
            Kind::Painted(child, _) => self.probe(*child, p, reach),
            Kind::Mirror(child, _)
            | Kind::Elongate(child, _)
            | Kind::Revolve(child, _)
            | Kind::RevolvePart(child, _, _)
            | Kind::Slice(child) => self.probe(*child, self.seen(node, p), reach),
            Kind::Nothing => Probe::steady(DEFAULT_OUTSIDE_VALUE, 1.0),
            Kind::Field(_)
            | Kind::Warp(..)
            | Kind::Displace(..)
            | Kind::Offset(..)
            | Kind::Shell(..)
            | Kind::RoundedExtrude(..) => self.made(node, p, reach),
        }
    }

    /// The point that the child of a shape with a single one sees.
    pub(super) fn seen(&self, node: &Node, p: Point) -> Point {
        match &node.kind {
            Kind::Frame { matrix, .. } => mapped(matrix, p),
            Kind::Twist(_, rate) => turned(p, 1, rate * p[1]),
            Kind::Bend(_, rate) => turned(p, 2, rate * p[0]),
            Kind::Mirror(_, axes) => [0, 1, 2].map(|i| if axes[i] { p[i].abs() } else { p[i] }),
            Kind::Elongate(_, half) => [0, 1, 2].map(|i| p[i] - p[i].clamp(-half[i], half[i])),
            Kind::Revolve(_, offset) => [norm2(p[0], p[2]) - offset, p[1], 0.0],
            Kind::RevolvePart(_, offset, wedge) => [wedge.radius(p) - offset, p[1], 0.0],
            Kind::Slice(_) => [p[0], p[1], 0.0],
            Kind::Warp(_, formula) => formula.at(p),
            _ => p,
        }
    }

    /// The union of copies that `each` visits.
    fn copies(
        &self,
        child: NodeId,
        reach: f64,
        each: impl FnOnce(&mut dyn FnMut(Point) -> f64) -> f64,
    ) -> Probe {
        let mut whole: Option<Probe> = None;
        let beside = each(&mut |q| {
            let copy = self.probe(child, q, reach);
            let union = whole.map_or(copy, |whole| whole.union(copy));
            whole = Some(union);
            union.value
        });
        whole
            .unwrap_or(Probe::steady(DEFAULT_OUTSIDE_VALUE, 1.0))
            .beside(beside)
    }

    /// The partial revolution of a child. Outside of the wedge, the nearer end is a figure in its
    /// half plane.
    fn closed(&self, child: NodeId, wedge: Wedge, p: Point, reach: f64) -> Probe {
        let figure = self.probe(child, p, reach);
        let ends = wedge.to_ends(p);
        let side = if wedge.holds(p) { -ends } else { ends };
        let value = match side > 0.0 {
            true => norm2(figure.value.max(0.0), wedge.along_end(p)[1]),
            false => figure.value.max(side),
        };
        figure
            .intersection(Probe::steady(side, 1.0))
            .with_value(value)
    }

    /// A combination that is no hard union.
    fn combined(&self, node: &Node, set: Set, children: &[NodeId], p: Point, reach: f64) -> Probe {
        use super::combine::Edge::Hard;
        let mut operands = children.iter().copied();
        let Some(first) = operands.next() else {
            return Probe::steady(DEFAULT_OUTSIDE_VALUE, 1.0);
        };
        if !matches!(
            set,
            Set::Intersection(Hard) | Set::Subtraction(Hard) | Set::Xor
        ) {
            return self.made(node, p, reach);
        }
        let mut whole = self.probe(first, p, reach);
        for child in operands {
            let extent = &self.node(child).extent;
            if matches!(set, Set::Subtraction(_)) {
                // What is cut away and is farther than this surface does not matter.
                let distance = extent.distance(p);
                if distance > 0.0 && extent.rate * distance >= -whole.value {
                    whole = whole.complement().beside(distance).complement();
                    continue;
                }
            }
            let other = self.probe(child, p, reach);
            whole = match set {
                Set::Subtraction(_) => whole.intersection(other.complement()),
                Set::Xor => whole.xor(other),
                _ => whole.intersection(other),
            };
        }
        whole
    }

    /// The knowledge of a shape whose sign follows from the values of others, or from a formula.
    fn made(&self, node: &Node, p: Point, reach: f64) -> Probe {
        let value = self.made_value(node, p);
        if node.steepness.is_finite() {
            return Probe::steady(value, node.steepness);
        }
        let mut probe = Probe {
            value,
            safe: 0.0,
            guess: 0.0,
        };
        if reach > 0.0 {
            let mut square = 0.0;
            for axis in 0..3 {
                let mut direction = [0.0; 3];
                direction[axis] = 1.0;
                let change = self.made_value(node, beyond(p, direction, reach)) - value;
                square += change * change;
            }
            let root = value.abs() * reach / square.sqrt();
            probe.guess = (root / MAX_SLOPE_GROWTH_FACTOR).min(node.grain);
            // A proof for half the way to where the root seems to be, or for less.
            let far = (root / 2.0).min(reach * MAX_PROOF_RADIUS_REACHES);
            let radii = [far, far / 4.0, far / 16.0].into_iter();
            let mut proved = radii.filter(|&radius| self.made_span(node, p, radius).is_signed());
            probe.safe = proved.next().unwrap_or(0.0);
            probe.guess = probe.guess.max(probe.safe);
        }
        probe
    }

    fn made_value(&self, node: &Node, p: Point) -> f64 {
        let value = match &node.kind {
            Kind::Field(formula) => formula.at(p)[0],
            Kind::Displace(child, formula) => self.value(*child, p) + formula.at(p)[0],
            Kind::Warp(child, formula) => self.value(*child, formula.at(p)),
            Kind::Offset(child, by) => self.value(*child, p) - by,
            Kind::Shell(child, half) => self.value(*child, p).abs() - half,
            Kind::RoundedExtrude(child, half, round) => {
                let figure = self.value(*child, p) + round;
                extruded(figure, p[2].abs() - half + round) - round
            }
            Kind::Combine { set, children } => {
                let mut values = children.iter().map(|&child| self.value(child, p));
                let first = values.next().unwrap_or(DEFAULT_OUTSIDE_VALUE);
                values.fold(first, |whole, other| set.value(whole, other, p))
            }
            _ => DEFAULT_OUTSIDE_VALUE,
        };
        if value.is_nan() {
            DEFAULT_OUTSIDE_VALUE
        } else {
            value
        }
    }
}

fn before_turned(inner: Probe, rate: f64, radius: f64) -> Probe {
    Probe {
        safe: before_turn(inner.safe, rate, radius),
        guess: before_turn(inner.guess, rate, radius),
        ..inner
    }
}
