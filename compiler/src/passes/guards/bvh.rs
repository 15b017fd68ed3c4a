//! Bounding volume hierarchy over the operands of a chain, and the guards in it that are profitable.
//!
//! It is built top-down. Each cut minimizes the sum of the boxes' areas, weighted with the work inside
//! (the surface area heuristic: J. Goldsmith and J. Salmon, *Automatic Creation of Object Hierarchies
//! for Ray Tracing*, 1987). The probability that a box is not skipped, if its parent is not, is
//! estimated as the ratio of their areas.

use super::influence::NodeInfluenceBox;
use crate::graph::NodeId;
use sdfc_vm::bounds::Bounds;

/// Cost of a guard, in instructions, and the minimum gain beyond it.
const GUARD_COST: f64 = 1.2;
const MIN_GUARD_GAIN: f64 = 0.8;
/// Estimated probability that a top-level box is not skipped.
const TOP_LEVEL_PROBABILITY: f64 = 0.8;
/// Margin of boxes for comparisons, as a fraction of the mean distance between them: operands near a
/// point are required too.
const MARGIN_FRACTION: f64 = 0.3;
/// Minimum distance ratio from which on values count as distances.
const MIN_EXACT_RATIO: f64 = 0.95;
/// Maximum number of operands for which all three axes are tried.
const MAX_OPERANDS_FOR_ALL_AXES: usize = 512;
/// Depth from which on the hierarchy is cut in the middle.
const MAX_SAH_LEVELS: usize = 40;
/// Coordinate at which infinite boxes are clamped for comparisons.
const MAX_COORDINATE: f64 = 1e6;

/// An operand of a chain, as a leaf of the hierarchy of boxes.
#[derive(Clone, Debug)]
pub(super) struct BvhLeaf {
    pub(super) id: NodeId,
    /// Its influence box, if it can be skipped.
    pub(super) influence_box: Option<NodeInfluenceBox>,
    /// Cost of running it, in instructions.
    pub(super) work: f64,
}

/// A step of a chain.
#[derive(Clone, Debug)]
pub(super) enum ChainStep {
    /// A blend of the value with an operand.
    Blend(NodeId),
    /// A guard of the next `steps` steps.
    Guard {
        influence_box: NodeInfluenceBox,
        steps: usize,
    },
}

/// Builder of a chain's steps.
pub(super) struct BvhBuilder<'a> {
    leaves: &'a [BvhLeaf],
    /// Margin of the boxes for comparisons.
    margin: f64,
    /// Area of the hull of all boxes.
    total_area: f64,
    /// Maximum nesting of guards.
    max_depth: usize,
    /// Steps so far.
    pub(super) steps: Vec<ChainStep>,
}

/// A node of the hierarchy.
struct BvhNode {
    influence_box: NodeInfluenceBox,
    area: f64,
    /// Mean cost of running it, provided that it is not skipped.
    work: f64,
    kind: BvhNodeKind,
}

enum BvhNodeKind {
    Leaf(NodeId),
    Pair(Box<[BvhNode; 2]>),
}

impl<'a> BvhBuilder<'a> {
    pub(super) fn new(leaves: &'a [BvhLeaf], max_depth: usize) -> Self {
        let boxes = leaves.iter().filter_map(|leaf| leaf.influence_box.as_ref());
        let hull_of_all = boxes.fold(Bounds::EMPTY, |hull, v| hull.hull(&v.bounds));
        let margin = match hull_of_all.is_void() {
            true => 0.0,
            false => MARGIN_FRACTION * (half_area(&hull_of_all, 0.0) / leaves.len() as f64).sqrt(),
        };
        Self {
            leaves,
            margin,
            total_area: if hull_of_all.is_void() {
                0.0
            } else {
                half_area(&hull_of_all, margin)
            },
            max_depth,
            steps: Vec::new(),
        }
    }

    /// Emits all operands; `is_reorderable` allows any order.
    pub(super) fn emit_all(&mut self, is_reorderable: bool) {
        self.emit_except(None, is_reorderable);
    }

    fn emit_except(&mut self, first: Option<usize>, is_reorderable: bool) {
        let indices: Vec<usize> = (0..self.leaves.len())
            .filter(|&index| Some(index) != first)
            .collect();
        if is_reorderable {
            let (with_box, without_box) = self.group_by_space(indices);
            self.emit_unguarded(&without_box);
            // One value that may be less than its distance would make all guards around it
            // conservative.
            let is_exact = |index: &usize| {
                let influence_box = self.leaves[*index].influence_box.as_ref();
                influence_box
                    .is_some_and(|influence_box| influence_box.distance_ratio > MIN_EXACT_RATIO)
            };
            let (exact, inexact) = with_box.into_iter().partition(is_exact);
            self.emit_guarded(exact, true);
            self.emit_guarded(inexact, true);
            return;
        }
        let mut remaining = indices.as_slice();
        while let Some(&index) = remaining.first() {
            let space = self.space(index);
            let is_same_space = |index: &&usize| space.is_some() && self.space(**index) == space;
            let count = remaining.iter().take_while(is_same_space).count();
            let (run, following) = remaining.split_at(count.max(1));
            remaining = following;
            if count > 0 {
                self.emit_guarded(run.to_vec(), false);
            } else {
                self.emit_unguarded(run);
            }
        }
    }

    /// Emits all operands in any order, except one that becomes the first value: the one that wastes
    /// the least work.
    pub(super) fn emit_with_first(&mut self) -> NodeId {
        let wasted = |leaf: &BvhLeaf| match &leaf.influence_box {
            Some(influence_box) => {
                leaf.work * (1.0 - half_area(&influence_box.bounds, self.margin) / self.total_area)
            }
            None => f64::NEG_INFINITY,
        };
        let leaves = self.leaves.iter().enumerate();
        let least_wasted = leaves.min_by(|(_, a), (_, b)| wasted(a).total_cmp(&wasted(b)));
        let Some((index, leaf)) = least_wasted else {
            unreachable!("a chain has operands")
        };
        self.emit_except(Some(index), true);
        leaf.id
    }

    /// Returns the maximum nesting of guards.
    pub(super) fn max_nesting(&self) -> usize {
        let mut ends: Vec<usize> = Vec::new();
        let mut deepest = 0;
        for (index, step) in self.steps.iter().enumerate() {
            while ends.pop_if(|end| *end <= index).is_some() {}
            if let ChainStep::Guard { steps, .. } = step {
                ends.push(index + 1 + steps);
                deepest = deepest.max(ends.len());
            }
        }
        deepest
    }

    /// Returns the point in whose space an operand's box lies.
    fn space(&self, index: usize) -> Option<NodeId> {
        self.leaves[index]
            .influence_box
            .as_ref()
            .map(|influence_box| influence_box.space)
    }

    /// Partitions operands by the space in which most boxes lie.
    fn group_by_space(&self, indices: Vec<usize>) -> (Vec<usize>, Vec<usize>) {
        let mut counts: Vec<(NodeId, usize)> = Vec::new();
        for space in indices.iter().filter_map(|&index| self.space(index)) {
            match counts
                .iter_mut()
                .find(|(counted_space, _)| *counted_space == space)
            {
                Some((_, count)) => *count += 1,
                None => counts.push((space, 1)),
            }
        }
        // At equal counts, the first one.
        let most_frequent = counts.iter().rev().max_by_key(|(_, count)| *count);
        let most_frequent = most_frequent.map(|(space, _)| *space);
        indices
            .into_iter()
            .partition(|&index| most_frequent.is_some() && self.space(index) == most_frequent)
    }

    /// Emits operands one by one, each with a guard of its own where that is profitable.
    fn emit_unguarded(&mut self, operands: &[usize]) {
        for &index in operands {
            match self.leaf_node(index) {
                Some(tree) => self.emit(&tree, tree.area / TOP_LEVEL_PROBABILITY, 0),
                None => self.steps.push(ChainStep::Blend(self.leaves[index].id)),
            }
        }
    }

    /// Emits operands whose boxes lie in one space, with guards where they are profitable.
    fn emit_guarded(&mut self, operands: Vec<usize>, is_reorderable: bool) {
        let trees: Vec<BvhNode> = operands
            .iter()
            .filter_map(|&index| self.leaf_node(index))
            .collect();
        if let Some(tree) = self.build(trees, is_reorderable, 0) {
            let parent_area = (self.total_area).max(tree.area) / TOP_LEVEL_PROBABILITY;
            self.emit(&tree, parent_area, 0);
        }
    }

    fn leaf_node(&self, index: usize) -> Option<BvhNode> {
        let leaf = &self.leaves[index];
        let influence_box = leaf.influence_box.clone()?;
        Some(BvhNode {
            area: half_area(&influence_box.bounds, self.margin),
            work: leaf.work,
            kind: BvhNodeKind::Leaf(leaf.id),
            influence_box,
        })
    }

    /// Builds the hierarchy. Recursion is as deep as the hierarchy, which is bounded.
    fn build(
        &self,
        mut trees: Vec<BvhNode>,
        is_reorderable: bool,
        level: usize,
    ) -> Option<BvhNode> {
        if trees.len() <= 1 {
            return trees.pop();
        }
        let cut = if level < MAX_SAH_LEVELS {
            self.best_cut(&mut trees, is_reorderable)
        } else {
            trees.len() / 2
        };
        let right = self.build(trees.split_off(cut), is_reorderable, level + 1)?;
        let left = self.build(trees, is_reorderable, level + 1)?;
        let influence_box = left.influence_box.hull_with(&right.influence_box);
        let area = half_area(&influence_box.bounds, self.margin);
        let work = [&left, &right].map(|tree| {
            let fraction = tree.area / area;
            tree.work.min(GUARD_COST + fraction * tree.work)
        });
        Some(BvhNode {
            influence_box,
            area,
            work: work[0] + work[1],
            kind: BvhNodeKind::Pair(Box::new([left, right])),
        })
    }

    /// Returns the index at which to cut, and sorts the operands for it if `is_reorderable`.
    fn best_cut(&self, trees: &mut [BvhNode], is_reorderable: bool) -> usize {
        if !is_reorderable {
            return self.cheapest_cut(trees).1;
        }
        let hull = trees.iter().fold(Bounds::EMPTY, |hull, tree| {
            hull.hull(&tree.influence_box.bounds)
        });
        let side = |axis: usize| clamped(hull.max[axis]) - clamped(hull.min[axis]);
        let mut axes = vec![0, 1, 2];
        axes.sort_by(|&a, &b| side(b).total_cmp(&side(a)));
        if trees.len() > MAX_OPERANDS_FOR_ALL_AXES {
            axes.truncate(1);
        }
        let mut best = (f64::INFINITY, trees.len() / 2, axes[0]);
        let mut sorted_axis = axes[0];
        for axis in axes {
            sort_by_centre(trees, axis);
            sorted_axis = axis;
            let (cost, cut) = self.cheapest_cut(trees);
            if cost < best.0 {
                best = (cost, cut, axis);
            }
        }
        if sorted_axis != best.2 {
            sort_by_centre(trees, best.2);
        }
        best.1
    }

    /// Returns the lowest cost of a cut in this order, and its index.
    fn cheapest_cut(&self, trees: &[BvhNode]) -> (f64, usize) {
        let mut costs_after = vec![0.0; trees.len()];
        let (mut hull, mut work) = (Bounds::EMPTY, 0.0);
        for (index, tree) in trees.iter().enumerate().rev() {
            hull = hull.hull(&tree.influence_box.bounds);
            work += tree.work;
            costs_after[index] = half_area(&hull, self.margin) * work;
        }
        let mut best = (f64::INFINITY, trees.len() / 2);
        let (mut hull, mut work) = (Bounds::EMPTY, 0.0);
        for (index, tree) in trees.iter().enumerate().take(trees.len() - 1) {
            hull = hull.hull(&tree.influence_box.bounds);
            work += tree.work;
            let cost = half_area(&hull, self.margin) * work + costs_after[index + 1];
            if cost < best.0 {
                best = (cost, index + 1);
            }
        }
        best
    }

    /// Emits the steps of a node. `parent_area` is the area of the innermost guard around it. At the top
    /// level it is the total area, or that of a single operand, over [`TOP_LEVEL_PROBABILITY`].
    fn emit(&mut self, tree: &BvhNode, parent_area: f64, level: usize) {
        let skipped = 1.0 - (tree.area / parent_area).min(1.0);
        let is_profitable = skipped * tree.work > GUARD_COST + MIN_GUARD_GAIN;
        if !is_profitable || level >= self.max_depth {
            self.emit_content(tree, parent_area, level);
            return;
        }
        let guard_index = self.steps.len();
        self.steps.push(ChainStep::Guard {
            influence_box: tree.influence_box.clone(),
            steps: 0,
        });
        self.emit_content(tree, tree.area, level + 1);
        let count = self.steps.len() - guard_index - 1;
        if let ChainStep::Guard { steps, .. } = &mut self.steps[guard_index] {
            *steps = count;
        }
    }

    fn emit_content(&mut self, tree: &BvhNode, parent_area: f64, level: usize) {
        match &tree.kind {
            BvhNodeKind::Leaf(id) => self.steps.push(ChainStep::Blend(*id)),
            BvhNodeKind::Pair(pair) => {
                for tree in &**pair {
                    self.emit(tree, parent_area, level);
                }
            }
        }
    }
}

/// Sorts by the midpoints along an axis; sorting is stable.
fn sort_by_centre(trees: &mut [BvhNode], axis: usize) {
    let middle = |tree: &BvhNode| {
        let b = &tree.influence_box.bounds;
        clamped(b.min[axis]) + clamped(b.max[axis])
    };
    trees.sort_by(|a, b| middle(a).total_cmp(&middle(b)));
}

fn clamped(v: f64) -> f64 {
    v.clamp(-MAX_COORDINATE, MAX_COORDINATE)
}

/// Returns half the surface area of a box that is grown by `margin`.
fn half_area(bounds: &Bounds, margin: f64) -> f64 {
    let [x, y, z] =
        [0, 1, 2].map(|i| clamped(bounds.max[i]) - clamped(bounds.min[i]) + 2.0 * margin);
    (x * y + y * z + z * x).max(1e-12)
}
