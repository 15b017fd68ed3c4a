//! The scene as a tree of shapes with known numbers, and its value at points.

use super::bvh::UnionBvh;
use super::combine::SetOp;
use super::formula::PointFormula;
use super::influence_box::InfluenceBox;
use super::leaf_shape::LeafShape;
use super::point::{Point, norm2, point_along};
use super::sample::OracleSample;
use super::solids::extrusion_distance;
use super::space::{CopyGrid, CopyRing, Wedge, radius_before_turn, rotated};
use sdfc_compiler::scene::MaterialId;

/// Value of an empty scene, and replacement for NaN.
pub(super) const OUTSIDE_VALUE: f64 = 1e9;
/// Assumed growth of a formula's slope within the estimated radius, as a factor.
const MAX_SLOPE_GROWTH_FACTOR: f64 = 3.0;

/// Longest radius for which a proof is attempted, in difference steps.
const MAX_PROOF_RADIUS_STEPS: f64 = 400.0;

/// Index of a shape in the tree.
pub(super) type TreeNodeId = u32;

/// A shape of the tree.
#[derive(Clone, Debug)]
pub(super) struct TreeNode {
    /// Kind of shape, with its data.
    pub(super) kind: NodeKind,
    /// Influence box.
    pub(super) bounds: InfluenceBox,
    /// Slope bound of its value, or infinity if there is none.
    pub(super) slope_bound: f64,
    /// Longest estimated radius to trust for a formula.
    pub(super) trusted_radius: f64,
    /// Set if a material is assigned to any part of it.
    pub(super) has_material: bool,
}

/// Kind of shape.
#[derive(Clone, Debug)]
pub(super) enum NodeKind {
    /// Solid or 2-D shape.
    Leaf(LeafShape),
    /// Formula of the point.
    Field(PointFormula),
    /// Hard union.
    Union {
        /// Operands in order.
        children: Vec<TreeNodeId>,
        /// BVH over the operands, including those of nested unions.
        bvh: UnionBvh,
    },
    /// Any other combination, from left to right.
    Combine {
        /// Set operation.
        set_op: SetOp,
        /// Operands in order.
        children: Vec<TreeNodeId>,
    },
    /// Child under an affine map.
    Frame {
        /// Shape in the inner coordinates of the frame.
        child: TreeNodeId,
        /// Map from the outer to the local point.
        matrix: [f64; 12],
        /// Outer length of one unit of the child's value.
        scale: f64,
        /// Largest stretch of the matrix.
        stretch: f64,
    },
    /// Copies along the axes.
    CopyGrid(TreeNodeId, CopyGrid),
    /// Copies around an axis.
    CopyRing(TreeNodeId, CopyRing),
    /// Mirror images at the marked coordinate planes.
    Mirror(TreeNodeId, [bool; 3]),
    /// Child twisted about the y axis by a rate.
    Twist(TreeNodeId, f64),
    /// Child rotated about the z axis by a rate along x.
    Bend(TreeNodeId, f64),
    /// Child elongated by these half lengths.
    Elongate(TreeNodeId, Point),
    /// Correction of the distance inside an elongated child.
    ElongateCorrect {
        /// Elongated child.
        child: TreeNodeId,
        /// Half lengths.
        half: Point,
        /// Number of axes that count, which is 2 for 2-D shapes.
        axes: usize,
    },
    /// 2-D shape revolved around the y axis at this offset from it.
    Revolve(TreeNodeId, f64),
    /// 2-D shape revolved within a wedge.
    RevolvePart(TreeNodeId, f64, Wedge),
    /// Ends of a partial revolution.
    RevolveClose(TreeNodeId, Wedge),
    /// Section of a solid at z = 0.
    Slice(TreeNodeId),
    /// Extrusion of a 2-D shape by this half height.
    Extrude(TreeNodeId, f64),
    /// Extrusion by a half height, with edges rounded by a radius.
    RoundedExtrude(TreeNodeId, f64, f64),
    /// Complement of a child.
    Complement(TreeNodeId),
    /// Child grown by a length.
    Offset(TreeNodeId, f64),
    /// Surface of a child as a wall of this half thickness.
    Shell(TreeNodeId, f64),
    /// Child with its value scaled by a factor.
    Scale(TreeNodeId, f64),
    /// Child evaluated at the point of a formula.
    Warp(TreeNodeId, PointFormula),
    /// Child with a formula added to its value.
    Displace(TreeNodeId, PointFormula),
    /// Child with a material assigned.
    WithMaterial(TreeNodeId, MaterialId),
    /// Empty shape.
    Nothing,
}

/// Shapes of a scene, operands before their users.
#[derive(Debug)]
pub(super) struct ShapeTree {
    /// All shapes.
    pub(super) nodes: Vec<TreeNode>,
    /// Root of the tree.
    pub(super) root: TreeNodeId,
}

/// Multiplies one row of an affine matrix by a point.
fn row(matrix: &[f64; 12], start: usize, p: Point) -> f64 {
    matrix[start] * p[0] + matrix[start + 1] * p[1] + matrix[start + 2] * p[2] + matrix[start + 3]
}

/// Applies an affine map to a point.
pub(super) fn affine_image(matrix: &[f64; 12], p: Point) -> Point {
    [row(matrix, 0, p), row(matrix, 4, p), row(matrix, 8, p)]
}

impl ShapeTree {
    /// Returns a shape of the tree.
    pub(super) fn node(&self, id: TreeNodeId) -> &TreeNode {
        &self.nodes[id as usize]
    }

    /// Returns the value of a shape at a point.
    pub(super) fn value(&self, id: TreeNodeId, p: Point) -> f64 {
        self.sample(id, p, 0.0).value
    }

    /// Samples a shape at a point.
    ///
    /// `difference_step` is the step of differences for slopes of formulas. If it is zero, no radius is
    /// estimated.
    pub(super) fn sample(&self, id: TreeNodeId, p: Point, difference_step: f64) -> OracleSample {
        let node = self.node(id);
        match &node.kind {
            NodeKind::Leaf(leaf) => OracleSample::from_slope_bound(leaf.value(p), leaf.slope_bound),
            NodeKind::Union { bvh, .. } => {
                bvh.union(p, |child| self.sample(child, p, difference_step))
            }
            NodeKind::Combine { set_op, children } => {
                self.combined(node, *set_op, children, p, difference_step)
            }
            NodeKind::Frame {
                child,
                matrix,
                scale,
                stretch,
            } => {
                let inner = self.sample(*child, affine_image(matrix, p), difference_step * stretch);
                inner.pulled_back(*stretch).with_value(inner.value * scale)
            }
            NodeKind::Twist(child, distance_ratio) => {
                let inner = self.sample(
                    *child,
                    rotated(p, 1, distance_ratio * p[1]),
                    difference_step,
                );
                pulled_back_from_turn(inner, *distance_ratio, norm2(p[0], p[2]))
            }
            NodeKind::Bend(child, distance_ratio) => {
                let inner = self.sample(
                    *child,
                    rotated(p, 2, distance_ratio * p[0]),
                    difference_step,
                );
                pulled_back_from_turn(inner, *distance_ratio, norm2(p[0], p[1]))
            }
            NodeKind::CopyGrid(child, grid) => {
                let bounds = &self.node(*child).bounds;
                self.copies(*child, difference_step, |visit| {
                    grid.for_each_copy(bounds, p, visit)
                })
            }
            NodeKind::CopyRing(child, ring) => {
                let bounds = &self.node(*child).bounds;
                self.copies(*child, difference_step, |visit| {
                    ring.for_each_copy(bounds, p, visit)
                })
            }
            NodeKind::ElongateCorrect { child, half, axes } => {
                let inner = self.sample(*child, p, difference_step);
                let gap = (0..*axes).map(|i| p[i].abs() - half[i]);
                let inside_excess = gap.fold(f64::NEG_INFINITY, f64::max).min(0.0);
                match inner.is_inside() {
                    true => inner.with_value(inner.value + inside_excess),
                    false => inner,
                }
            }
            NodeKind::RevolveClose(child, wedge) => {
                self.partial_revolution(*child, *wedge, p, difference_step)
            }
            NodeKind::Extrude(child, half) => {
                let shape_2d = self.sample(*child, p, difference_step);
                let slab = OracleSample::from_slope_bound(p[2].abs() - half, 1.0);
                let value = extrusion_distance(shape_2d.value, slab.value);
                shape_2d.intersection(slab).with_value(value)
            }
            NodeKind::Complement(child) => self.sample(*child, p, difference_step).complement(),
            NodeKind::Scale(child, factor) => {
                let inner = self.sample(*child, p, difference_step);
                inner.with_value(inner.value * factor)
            }
            NodeKind::WithMaterial(child, _) => self.sample(*child, p, difference_step),
            NodeKind::Mirror(child, _)
            | NodeKind::Elongate(child, _)
            | NodeKind::Revolve(child, _)
            | NodeKind::RevolvePart(child, _, _)
            | NodeKind::Slice(child) => {
                self.sample(*child, self.child_point(node, p), difference_step)
            }
            NodeKind::Nothing => OracleSample::from_slope_bound(OUTSIDE_VALUE, 1.0),
            NodeKind::Field(_)
            | NodeKind::Warp(..)
            | NodeKind::Displace(..)
            | NodeKind::Offset(..)
            | NodeKind::Shell(..)
            | NodeKind::RoundedExtrude(..) => self.derived_sample(node, p, difference_step),
        }
    }

    /// Returns the local point of the child of a shape with a single child.
    pub(super) fn child_point(&self, node: &TreeNode, p: Point) -> Point {
        match &node.kind {
            NodeKind::Frame { matrix, .. } => affine_image(matrix, p),
            NodeKind::Twist(_, distance_ratio) => rotated(p, 1, distance_ratio * p[1]),
            NodeKind::Bend(_, distance_ratio) => rotated(p, 2, distance_ratio * p[0]),
            NodeKind::Mirror(_, axes) => [0, 1, 2].map(|i| if axes[i] { p[i].abs() } else { p[i] }),
            NodeKind::Elongate(_, half) => [0, 1, 2].map(|i| p[i] - p[i].clamp(-half[i], half[i])),
            NodeKind::Revolve(_, offset) => [norm2(p[0], p[2]) - offset, p[1], 0.0],
            NodeKind::RevolvePart(_, offset, wedge) => [wedge.radius(p) - offset, p[1], 0.0],
            NodeKind::Slice(_) => [p[0], p[1], 0.0],
            NodeKind::Warp(_, formula) => formula.at(p),
            _ => p,
        }
    }

    /// Returns the union of the copies that `for_each_copy` visits.
    fn copies(
        &self,
        child: TreeNodeId,
        difference_step: f64,
        for_each_copy: impl FnOnce(&mut dyn FnMut(Point) -> f64) -> f64,
    ) -> OracleSample {
        let mut accumulated: Option<OracleSample> = None;
        let skipped_distance = for_each_copy(&mut |q| {
            let copy = self.sample(child, q, difference_step);
            let union = accumulated.map_or(copy, |accumulated| accumulated.union(copy));
            accumulated = Some(union);
            union.value
        });
        accumulated
            .unwrap_or(OracleSample::from_slope_bound(OUTSIDE_VALUE, 1.0))
            .limited_to(skipped_distance)
    }

    /// Samples the partial revolution of a child.
    ///
    /// Outside the wedge, the nearer end is a 2-D shape in its half plane.
    fn partial_revolution(
        &self,
        child: TreeNodeId,
        wedge: Wedge,
        p: Point,
        difference_step: f64,
    ) -> OracleSample {
        let shape_2d = self.sample(child, p, difference_step);
        let ends = wedge.distance_to_ends(p);
        let side = if wedge.contains(p) { -ends } else { ends };
        let value = match side > 0.0 {
            true => norm2(shape_2d.value.max(0.0), wedge.along_end(p)[1]),
            false => shape_2d.value.max(side),
        };
        shape_2d
            .intersection(OracleSample::from_slope_bound(side, 1.0))
            .with_value(value)
    }

    /// Samples a combination other than a hard union.
    fn combined(
        &self,
        node: &TreeNode,
        set_op: SetOp,
        children: &[TreeNodeId],
        p: Point,
        difference_step: f64,
    ) -> OracleSample {
        use super::combine::EdgeProfile::Hard;
        let mut operands = children.iter().copied();
        let Some(first) = operands.next() else {
            return OracleSample::from_slope_bound(OUTSIDE_VALUE, 1.0);
        };
        if !matches!(
            set_op,
            SetOp::Intersection(Hard) | SetOp::Subtraction(Hard) | SetOp::Xor
        ) {
            return self.derived_sample(node, p, difference_step);
        }
        let mut accumulated = self.sample(first, p, difference_step);
        for child in operands {
            let bounds = &self.node(child).bounds;
            if matches!(set_op, SetOp::Subtraction(_)) {
                // Cutters farther away than this surface do not matter.
                let distance = bounds.distance(p);
                if distance > 0.0 && bounds.distance_ratio * distance >= -accumulated.value {
                    accumulated = accumulated.complement().limited_to(distance).complement();
                    continue;
                }
            }
            let other = self.sample(child, p, difference_step);
            accumulated = match set_op {
                SetOp::Subtraction(_) => accumulated.intersection(other.complement()),
                SetOp::Xor => accumulated.xor(other),
                _ => accumulated.intersection(other),
            };
        }
        accumulated
    }

    /// Samples a shape whose sign follows from the values of others, or from a formula.
    fn derived_sample(&self, node: &TreeNode, p: Point, difference_step: f64) -> OracleSample {
        let value = self.derived_value(node, p);
        if node.slope_bound.is_finite() {
            return OracleSample::from_slope_bound(value, node.slope_bound);
        }
        let mut sample = OracleSample {
            value,
            proven_radius: 0.0,
            estimated_radius: 0.0,
        };
        if difference_step > 0.0 {
            let mut gradient_sq = 0.0;
            for axis in 0..3 {
                let mut direction = [0.0; 3];
                direction[axis] = 1.0;
                let change =
                    self.derived_value(node, point_along(p, direction, difference_step)) - value;
                gradient_sq += change * change;
            }
            let root_distance = value.abs() * difference_step / gradient_sq.sqrt();
            sample.estimated_radius =
                (root_distance / MAX_SLOPE_GROWTH_FACTOR).min(node.trusted_radius);
            // Attempts a proof for half the distance to the estimated root, then for less.
            let first_radius = (root_distance / 2.0).min(difference_step * MAX_PROOF_RADIUS_STEPS);
            let radii = [first_radius, first_radius / 4.0, first_radius / 16.0].into_iter();
            let mut proved =
                radii.filter(|&radius| self.derived_span(node, p, radius).excludes_zero());
            sample.proven_radius = proved.next().unwrap_or(0.0);
            sample.estimated_radius = sample.estimated_radius.max(sample.proven_radius);
        }
        sample
    }

    fn derived_value(&self, node: &TreeNode, p: Point) -> f64 {
        let value = match &node.kind {
            NodeKind::Field(formula) => formula.at(p)[0],
            NodeKind::Displace(child, formula) => self.value(*child, p) + formula.at(p)[0],
            NodeKind::Warp(child, formula) => self.value(*child, formula.at(p)),
            NodeKind::Offset(child, by) => self.value(*child, p) - by,
            NodeKind::Shell(child, half) => self.value(*child, p).abs() - half,
            NodeKind::RoundedExtrude(child, half, round) => {
                let shape_2d = self.value(*child, p) + round;
                extrusion_distance(shape_2d, p[2].abs() - half + round) - round
            }
            NodeKind::Combine { set_op, children } => {
                let mut values = children.iter().map(|&child| self.value(child, p));
                let first = values.next().unwrap_or(OUTSIDE_VALUE);
                values.fold(first, |accumulated, other| {
                    set_op.value(accumulated, other, p)
                })
            }
            _ => OUTSIDE_VALUE,
        };
        if value.is_nan() { OUTSIDE_VALUE } else { value }
    }
}

fn pulled_back_from_turn(inner: OracleSample, distance_ratio: f64, radius: f64) -> OracleSample {
    OracleSample {
        proven_radius: radius_before_turn(inner.proven_radius, distance_ratio, radius),
        estimated_radius: radius_before_turn(inner.estimated_radius, distance_ratio, radius),
        ..inner
    }
}
