//! Bounding volume hierarchy over the operands of a union, used to skip distant ones.

use super::influence_box::InfluenceBox;
use super::point::Point;
use super::sample::OracleSample;

/// Largest number of pending branches during a traversal, which is one per level.
const MAX_PENDING_BRANCHES: usize = 64;

/// Node of the BVH.
#[derive(Clone, Debug)]
struct Branch {
    bounds: InfluenceBox,
    content: BranchContent,
}

#[derive(Clone, Copy, Debug)]
enum BranchContent {
    /// Two child branches.
    Pair([u32; 2]),
    /// One operand.
    Operand(u32),
}

/// Operands of a union, sorted in space.
#[derive(Clone, Debug)]
pub(super) struct UnionBvh {
    branches: Vec<Branch>,
    root: u32,
    /// Operands unbounded along all axes.
    unbounded: Vec<u32>,
}

impl UnionBvh {
    /// Builds the BVH of these operands, given by ids and boxes.
    pub(super) fn new(operands: &[(u32, InfluenceBox)]) -> Self {
        let is_bounded = |e: &InfluenceBox| e.low.iter().chain(&e.high).any(|v| v.is_finite());
        let (mut bounded, unbounded): (Vec<_>, Vec<_>) =
            operands.iter().copied().partition(|(_, e)| is_bounded(e));
        let mut bvh = Self {
            branches: Vec::new(),
            root: 0,
            unbounded: unbounded.into_iter().map(|(id, _)| id).collect(),
        };
        if !bounded.is_empty() {
            bvh.root = bvh.add(&mut bounded);
        }
        bvh
    }

    fn add(&mut self, operands: &mut [(u32, InfluenceBox)]) -> u32 {
        let hull = |a: InfluenceBox, b: &(u32, InfluenceBox)| a.hull(&b.1);
        let bounds = operands[1..].iter().fold(operands[0].1, hull);
        let content = if let [(only, _)] = operands {
            BranchContent::Operand(*only)
        } else {
            let middle = |e: &InfluenceBox, axis: usize| {
                let sum = e.low[axis] + e.high[axis];
                if sum.is_finite() { sum } else { 0.0 }
            };
            let spread = |axis: usize| {
                let middles = operands.iter().map(|(_, e)| middle(e, axis));
                let (low, high) = middles.fold((f64::MAX, f64::MIN), |(low, high), v| {
                    (low.min(v), high.max(v))
                });
                high - low
            };
            let spreads = [spread(0), spread(1), spread(2)];
            let axis = (0..3).max_by(|&i, &j| spreads[i].total_cmp(&spreads[j]));
            let axis = axis.unwrap_or(0);
            operands.sort_by(|a, b| middle(&a.1, axis).total_cmp(&middle(&b.1, axis)));
            let (left, right) = operands.split_at_mut(operands.len() / 2);
            BranchContent::Pair([self.add(left), self.add(right)])
        };
        self.branches.push(Branch { bounds, content });
        self.branches.len() as u32 - 1
    }

    /// Returns the union of all operands at a point, where `sample` evaluates one operand.
    pub(super) fn union(&self, p: Point, sample: impl Fn(u32) -> OracleSample) -> OracleSample {
        let mut accumulated = OracleSample {
            value: f64::INFINITY,
            proven_radius: f64::INFINITY,
            estimated_radius: f64::INFINITY,
        };
        for &id in &self.unbounded {
            accumulated = accumulated.union(sample(id));
        }
        if self.branches.is_empty() {
            return accumulated;
        }
        // Distance to the nearest skipped box.
        let mut skipped_distance = f64::INFINITY;
        let distance_to = |index: u32| self.branches[index as usize].bounds.distance(p);
        let mut pending = [(0_u32, 0.0_f64); MAX_PENDING_BRANCHES];
        pending[0] = (self.root, distance_to(self.root));
        let mut pending_count = 1;
        while pending_count > 0 {
            pending_count -= 1;
            let (index, distance) = pending[pending_count];
            let branch = &self.branches[index as usize];
            if distance > 0.0 && branch.bounds.distance_ratio * distance >= accumulated.value {
                skipped_distance = skipped_distance.min(distance);
                continue;
            }
            match branch.content {
                BranchContent::Operand(id) => accumulated = accumulated.union(sample(id)),
                BranchContent::Pair([a, b]) => {
                    let (a, b) = ((a, distance_to(a)), (b, distance_to(b)));
                    let (near, far) = if a.1 <= b.1 { (a, b) } else { (b, a) };
                    pending[pending_count] = far;
                    pending[pending_count + 1] = near;
                    pending_count += 2;
                }
            }
        }
        accumulated.limited_to(skipped_distance)
    }
}
