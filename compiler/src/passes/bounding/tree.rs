//! A hierarchy of boxes over the operands of a chain, and where in it guards pay.
//!
//! It is built from the top, each time where the sum of the boxes' areas, weighted with the work
//! inside, is least (the surface area heuristic: J. Goldsmith and J. Salmon, *Automatic Creation of
//! Object Hierarchies for Ray Tracing*, 1987). How often a box is not skipped, where the box around it
//! is not, is taken to be the ratio of their areas.

use super::volumes::Volume;
use crate::graph::NodeId;
use sdfc_vm::bounds::Bounds;

/// What a guard takes, in instructions, and what it has to save besides.
const GUARD: f64 = 1.2;
const GAIN: f64 = 0.8;
/// How often a box is not skipped that no other is around.
const OUTERMOST: f64 = 0.8;
/// Boxes are compared with this share of the mean distance between them added on each side: what is
/// near is needed too.
const NEAR: f64 = 0.3;
/// From this rate on, values count as distances.
const EXACT: f64 = 0.95;
/// Up to so many operands, all three axes are tried.
const FEW: usize = 512;
/// From this level on, the hierarchy is cut in the middle.
const LEVELS: usize = 40;
/// Endless boxes are compared as if they ended here.
const FAR: f64 = 1e6;

/// An operand.
#[derive(Clone, Debug)]
pub(super) struct Leaf {
    pub(super) id: NodeId,
    /// Its box, if it can be left out.
    pub(super) volume: Option<Volume>,
    /// What it takes.
    pub(super) work: f64,
}

/// A step of a chain.
#[derive(Clone, Debug)]
pub(super) enum Planned {
    /// An operand.
    Blend(NodeId),
    /// A guard of this many steps behind it.
    Guard { volume: Volume, steps: usize },
}

/// Puts the steps of a chain together.
pub(super) struct Planner<'a> {
    leaves: &'a [Leaf],
    /// What the boxes are grown by to be compared.
    near: f64,
    /// The area of all boxes together.
    whole: f64,
    /// The most guards within each other.
    most: usize,
    /// The steps so far.
    pub(super) steps: Vec<Planned>,
}

/// A box of the hierarchy.
struct Tree {
    volume: Volume,
    area: f64,
    /// What running it takes on the average, once it is not skipped.
    work: f64,
    kind: Kind,
}

enum Kind {
    Leaf(NodeId),
    Pair(Box<[Tree; 2]>),
}

impl<'a> Planner<'a> {
    pub(super) fn new(leaves: &'a [Leaf], most: usize) -> Self {
        let boxes = leaves.iter().filter_map(|leaf| leaf.volume.as_ref());
        let all = boxes.fold(Bounds::EMPTY, |hull, v| hull.hull(&v.bounds));
        let near = match all.is_void() {
            true => 0.0,
            false => NEAR * (area(&all, 0.0) / leaves.len() as f64).sqrt(),
        };
        Self {
            leaves,
            near,
            whole: if all.is_void() { 0.0 } else { area(&all, near) },
            most,
            steps: Vec::new(),
        }
    }

    /// Plans all operands; `is_free` tells whether in any order.
    pub(super) fn plan(&mut self, is_free: bool) {
        self.plan_without(None, is_free);
    }

    fn plan_without(&mut self, first: Option<usize>, is_free: bool) {
        let all: Vec<usize> = (0..self.leaves.len())
            .filter(|&at| Some(at) != first)
            .collect();
        if is_free {
            let (with, without) = self.grouped(all);
            self.plainly(&without);
            // One value that may be less than its distance would make all guards around it cautious.
            let is_exact = |at: &usize| {
                let volume = self.leaves[*at].volume.as_ref();
                volume.is_some_and(|volume| volume.rate > EXACT)
            };
            let (exact, other) = with.into_iter().partition(is_exact);
            self.guarded(exact, true);
            self.guarded(other, true);
            return;
        }
        let mut rest = all.as_slice();
        while let Some(&at) = rest.first() {
            let space = self.space(at);
            let same = |at: &&usize| space.is_some() && self.space(**at) == space;
            let count = rest.iter().take_while(same).count();
            let (run, after) = rest.split_at(count.max(1));
            rest = after;
            if count > 0 {
                self.guarded(run.to_vec(), false);
            } else {
                self.plainly(run);
            }
        }
    }

    /// Plans all operands in any order, of which one is to be the first value: the one that most of
    /// the work is not wasted on.
    pub(super) fn plan_with_first(&mut self) -> NodeId {
        let wasted = |leaf: &Leaf| match &leaf.volume {
            Some(volume) => leaf.work * (1.0 - area(&volume.bounds, self.near) / self.whole),
            None => f64::NEG_INFINITY,
        };
        let all = self.leaves.iter().enumerate();
        let least = all.min_by(|(_, a), (_, b)| wasted(a).total_cmp(&wasted(b)));
        let Some((at, leaf)) = least else {
            unreachable!("a chain has operands")
        };
        self.plan_without(Some(at), true);
        leaf.id
    }

    /// How many guards lie within each other at most.
    pub(super) fn deepest(&self) -> usize {
        let mut ends: Vec<usize> = Vec::new();
        let mut deepest = 0;
        for (at, step) in self.steps.iter().enumerate() {
            while ends.pop_if(|end| *end <= at).is_some() {}
            if let Planned::Guard { steps, .. } = step {
                ends.push(at + 1 + steps);
                deepest = deepest.max(ends.len());
            }
        }
        deepest
    }

    /// The point in whose space an operand's box lies.
    fn space(&self, at: usize) -> Option<NodeId> {
        self.leaves[at].volume.as_ref().map(|volume| volume.space)
    }

    /// Those whose boxes lie in the space that most lie in, and the others.
    fn grouped(&self, all: Vec<usize>) -> (Vec<usize>, Vec<usize>) {
        let mut counts: Vec<(NodeId, usize)> = Vec::new();
        for space in all.iter().filter_map(|&at| self.space(at)) {
            match counts.iter_mut().find(|(known, _)| *known == space) {
                Some((_, count)) => *count += 1,
                None => counts.push((space, 1)),
            }
        }
        // Of two with as many, the first.
        let most = counts.iter().rev().max_by_key(|(_, count)| *count);
        let most = most.map(|(space, _)| *space);
        all.into_iter()
            .partition(|&at| most.is_some() && self.space(at) == most)
    }

    /// Operands one by one, each behind a guard of its own where that pays.
    fn plainly(&mut self, operands: &[usize]) {
        for &at in operands {
            match self.leaf(at) {
                Some(tree) => self.write(&tree, tree.area / OUTERMOST, 0),
                None => self.steps.push(Planned::Blend(self.leaves[at].id)),
            }
        }
    }

    /// Operands whose boxes lie in one space, with guards where they pay.
    fn guarded(&mut self, operands: Vec<usize>, is_free: bool) {
        let trees: Vec<Tree> = operands.iter().filter_map(|&at| self.leaf(at)).collect();
        if let Some(tree) = self.tree(trees, is_free, 0) {
            let around = (self.whole).max(tree.area) / OUTERMOST;
            self.write(&tree, around, 0);
        }
    }

    fn leaf(&self, at: usize) -> Option<Tree> {
        let leaf = &self.leaves[at];
        let volume = leaf.volume.clone()?;
        Some(Tree {
            area: area(&volume.bounds, self.near),
            work: leaf.work,
            kind: Kind::Leaf(leaf.id),
            volume,
        })
    }

    /// The hierarchy over these. Recursion is as deep as the hierarchy is, which is bounded.
    fn tree(&self, mut trees: Vec<Tree>, is_free: bool, level: usize) -> Option<Tree> {
        if trees.len() <= 1 {
            return trees.pop();
        }
        let at = if level < LEVELS {
            self.best_cut(&mut trees, is_free)
        } else {
            trees.len() / 2
        };
        let right = self.tree(trees.split_off(at), is_free, level + 1)?;
        let left = self.tree(trees, is_free, level + 1)?;
        let volume = left.volume.around(&right.volume);
        let area = area(&volume.bounds, self.near);
        let work = [&left, &right].map(|tree| {
            let share = tree.area / area;
            tree.work.min(GUARD + share * tree.work)
        });
        Some(Tree {
            volume,
            area,
            work: work[0] + work[1],
            kind: Kind::Pair(Box::new([left, right])),
        })
    }

    /// Where to cut, with the operands put in an order for it if they may be.
    fn best_cut(&self, trees: &mut [Tree], is_free: bool) -> usize {
        if !is_free {
            return self.cut(trees).1;
        }
        let hull = trees
            .iter()
            .fold(Bounds::EMPTY, |hull, tree| hull.hull(&tree.volume.bounds));
        let side = |axis: usize| clipped(hull.max[axis]) - clipped(hull.min[axis]);
        let mut axes = vec![0, 1, 2];
        axes.sort_by(|&a, &b| side(b).total_cmp(&side(a)));
        if trees.len() > FEW {
            axes.truncate(1);
        }
        let mut best = (f64::INFINITY, trees.len() / 2, axes[0]);
        let mut last = axes[0];
        for axis in axes {
            sort(trees, axis);
            last = axis;
            let (cost, at) = self.cut(trees);
            if cost < best.0 {
                best = (cost, at, axis);
            }
        }
        if last != best.2 {
            sort(trees, best.2);
        }
        best.1
    }

    /// The best place to cut in this order, and what is expected of it.
    fn cut(&self, trees: &[Tree]) -> (f64, usize) {
        let mut behind = vec![0.0; trees.len()];
        let (mut hull, mut work) = (Bounds::EMPTY, 0.0);
        for (at, tree) in trees.iter().enumerate().rev() {
            hull = hull.hull(&tree.volume.bounds);
            work += tree.work;
            behind[at] = area(&hull, self.near) * work;
        }
        let mut best = (f64::INFINITY, trees.len() / 2);
        let (mut hull, mut work) = (Bounds::EMPTY, 0.0);
        for (at, tree) in trees.iter().enumerate().take(trees.len() - 1) {
            hull = hull.hull(&tree.volume.bounds);
            work += tree.work;
            let cost = area(&hull, self.near) * work + behind[at + 1];
            if cost < best.0 {
                best = (cost, at + 1);
            }
        }
        best
    }

    /// The steps of a box; `around` is the area of that which a guard stands in front of already.
    fn write(&mut self, tree: &Tree, around: f64, level: usize) {
        let skipped = 1.0 - (tree.area / around).min(1.0);
        let pays = skipped * tree.work > GUARD + GAIN;
        if !pays || level >= self.most {
            self.write_inside(tree, around, level);
            return;
        }
        let at = self.steps.len();
        self.steps.push(Planned::Guard {
            volume: tree.volume.clone(),
            steps: 0,
        });
        self.write_inside(tree, tree.area, level + 1);
        let count = self.steps.len() - at - 1;
        if let Planned::Guard { steps, .. } = &mut self.steps[at] {
            *steps = count;
        }
    }

    fn write_inside(&mut self, tree: &Tree, around: f64, level: usize) {
        match &tree.kind {
            Kind::Leaf(id) => self.steps.push(Planned::Blend(*id)),
            Kind::Pair(pair) => {
                for tree in &**pair {
                    self.write(tree, around, level);
                }
            }
        }
    }
}

/// In the order of their middles along an axis; sorting is stable.
fn sort(trees: &mut [Tree], axis: usize) {
    let middle = |tree: &Tree| {
        let b = &tree.volume.bounds;
        clipped(b.min[axis]) + clipped(b.max[axis])
    };
    trees.sort_by(|a, b| middle(a).total_cmp(&middle(b)));
}

fn clipped(v: f64) -> f64 {
    v.clamp(-FAR, FAR)
}

/// Half the surface of a box that is grown by `by`.
fn area(bounds: &Bounds, by: f64) -> f64 {
    let [x, y, z] = [0, 1, 2].map(|i| clipped(bounds.max[i]) - clipped(bounds.min[i]) + 2.0 * by);
    (x * y + y * z + z * x).max(1e-12)
}
