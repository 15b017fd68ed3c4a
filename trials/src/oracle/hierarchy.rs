//! Boxes around the operands of a union, by which far ones are left out.

use super::extent::Extent;
use super::point::Point;
use super::probe::Probe;

/// The most boxes that wait during a walk, of which there is one at each level.
const MAX_PENDING_BRANCHES: usize = 64;

/// A box of the hierarchy.
#[derive(Clone, Debug)]
struct Branch {
    extent: Extent,
    inner: Inner,
}

#[derive(Clone, Copy, Debug)]
enum Inner {
    /// Two boxes.
    Pair([u32; 2]),
    /// An operand.
    Operand(u32),
}

/// Operands by place.
#[derive(Clone, Debug)]
pub(super) struct Hierarchy {
    branches: Vec<Branch>,
    root: u32,
    /// Operands without an end.
    endless: Vec<u32>,
}

impl Hierarchy {
    /// The hierarchy of these operands, by their numbers and boxes.
    pub(super) fn new(operands: &[(u32, Extent)]) -> Self {
        let is_ended = |e: &Extent| e.low.iter().chain(&e.high).any(|v| v.is_finite());
        let (mut ended, endless): (Vec<_>, Vec<_>) =
            operands.iter().copied().partition(|(_, e)| is_ended(e));
        let mut hierarchy = Self {
            branches: Vec::new(),
            root: 0,
            endless: endless.into_iter().map(|(id, _)| id).collect(),
        };
        if !ended.is_empty() {
            hierarchy.root = hierarchy.add(&mut ended);
        }
        hierarchy
    }

    fn add(&mut self, operands: &mut [(u32, Extent)]) -> u32 {
        let hull = |a: Extent, b: &(u32, Extent)| a.hull(&b.1);
        let extent = operands[1..].iter().fold(operands[0].1, hull);
        let inner = if let [(only, _)] = operands {
            Inner::Operand(*only)
        } else {
            let middle = |e: &Extent, axis: usize| {
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
            Inner::Pair([self.add(left), self.add(right)])
        };
        self.branches.push(Branch { extent, inner });
        self.branches.len() as u32 - 1
    }

    /// The union of all operands at a point, whose probes `probe` gives.
    pub(super) fn union(&self, p: Point, probe: impl Fn(u32) -> Probe) -> Probe {
        let mut whole = Probe {
            value: f64::INFINITY,
            safe: f64::INFINITY,
            guess: f64::INFINITY,
        };
        for &id in &self.endless {
            whole = whole.union(probe(id));
        }
        if self.branches.is_empty() {
            return whole;
        }
        // The distance of the nearest one that was left out.
        let mut beside = f64::INFINITY;
        let away = |at: u32| self.branches[at as usize].extent.distance(p);
        let mut pending = [(0_u32, 0.0_f64); MAX_PENDING_BRANCHES];
        pending[0] = (self.root, away(self.root));
        let mut left = 1;
        while left > 0 {
            left -= 1;
            let (at, distance) = pending[left];
            let branch = &self.branches[at as usize];
            if distance > 0.0 && branch.extent.rate * distance >= whole.value {
                beside = beside.min(distance);
                continue;
            }
            match branch.inner {
                Inner::Operand(id) => whole = whole.union(probe(id)),
                Inner::Pair([a, b]) => {
                    let (a, b) = ((a, away(a)), (b, away(b)));
                    let (near, far) = if a.1 <= b.1 { (a, b) } else { (b, a) };
                    pending[left] = far;
                    pending[left + 1] = near;
                    left += 2;
                }
            }
        }
        whole.beside(beside)
    }
}
