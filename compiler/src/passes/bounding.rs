//! Guards: what is too far from a point to matter there is skipped. Before: any graph. After: unions
//! and subtractions of much are [`Node::Chain`]s with guards among their steps; hard ones are in
//! another order. The value is the same in every bit, but for the sign of zeros.
//!
//! A union needs an operand where it is no farther than the value so far; with a kernel, no farther
//! than that and the kernel's width. A subtraction needs what it takes away where the point is deeper
//! inside the value so far than it is away from that. So a box around an operand, from which the
//! operand's value is known to keep its distance (`volumes.rs`), tells where it is not needed.
//!
//! Minima and maxima are associative: the operands of a hard union are put in the order of a hierarchy
//! of boxes (`tree.rs`), and a guard in front of a box skips all that is inside. Blends are not, and
//! of materials equally near the first one counts; there the order stays and only what stands side by
//! side is skipped together. A guard costs about as much as a shape, so it stands only where what it
//! skips, and how often it may be skipped, outweigh that; small scenes have none.

pub(super) mod operands;
mod tree;
pub(super) mod volumes;

use super::{Context, Passed, counted};
use crate::graph::{Graph, Guard, Node, NodeId, Number, Step};
use crate::lower::Purpose;
use operands::{Chain, Operands};
use sdfc_vm::program::MAX_GUARDS;
use std::collections::HashMap;
use tree::{Leaf, Planned, Planner};
use volumes::{Volume, Volumes};

/// Chains of less work than this have no guards; an instruction is about one. Measured: from 60 boxes
/// on an interpreter gains, with twenty shapes it does not.
const LEAST_WORK: f64 = 40.0;
/// The most guards within each other that one chain has.
const DEEPEST: usize = 12;
/// What a guard looks at is larger than the box by this share of the coordinates' magnitude: about a
/// thousand roundings of `f32`.
const SLACK: f64 = 1.0 / 8192.0;
/// Sides farther out than this count as endless; its square is finite in `f32`.
const ENDLESS: f64 = 1e15;

/// The graph with guards.
pub fn bounding(graph: &Graph, context: &Context) -> Passed {
    let mut operands = Operands::of(graph);
    let reorder = context.purpose == Purpose::Distance;
    let chains = operands.chains(reorder);
    if chains.is_empty() {
        return Passed {
            graph: graph.clone(),
            ..Passed::default()
        };
    }
    let volumes = Volumes::of(graph);
    let mut plans: HashMap<NodeId, Plan> = HashMap::new();
    // Chains within others come first, so that it is known how deep their guards are.
    for chain in chains {
        if let Some(plan) = plan(&chain, &mut operands, &volumes) {
            operands.set_depth(chain.root, plan.depth);
            plans.insert(chain.root, plan);
        }
    }
    let (mut guards, mut guarded) = (0, 0);
    let mut moved = vec![NodeId::default(); graph.len()];
    let graph = super::rebuilt(graph, |to, id, node| {
        let node = match plans.get(&id) {
            Some(plan) => {
                guards += plan.guards();
                guarded += plan.guarded();
                plan.node(&moved)
            }
            None => node,
        };
        let new = to.add(node);
        moved[id.0 as usize] = new;
        new
    });
    let notes = [
        counted(guards, "guard", "guards"),
        counted(guarded, "shape behind them", "shapes behind them"),
    ];
    Passed {
        graph,
        notes: notes.into_iter().flatten().collect(),
        loss: None,
    }
}

/// A chain as it is to be.
struct Plan {
    chain: Chain,
    first: NodeId,
    steps: Vec<Planned>,
    /// How deep guards lie within each other, those of chains within included.
    depth: usize,
}

impl Plan {
    fn guards(&self) -> usize {
        let is_guard = |step: &&Planned| matches!(step, Planned::Guard { .. });
        self.steps.iter().filter(is_guard).count()
    }

    /// How many operands lie behind a guard.
    fn guarded(&self) -> usize {
        let (mut end, mut count) = (0, 0);
        for (at, step) in self.steps.iter().enumerate() {
            match step {
                Planned::Guard { steps, .. } => end = end.max(at + 1 + steps),
                Planned::Blend(_) => count += usize::from(at < end),
            }
        }
        count
    }

    /// The node, with its inputs where they have been moved to.
    fn node(&self, moved: &[NodeId]) -> Node {
        let to = |id: NodeId| moved[id.0 as usize];
        let steps = self.steps.iter().map(|step| match step {
            Planned::Blend(value) => Step::Blend(to(*value)),
            Planned::Guard { volume, steps } => Step::Guard(Guard {
                point: to(volume.space),
                volume: numbers(volume, self.chain.sign, self.chain.support),
                steps: *steps as u32,
            }),
        });
        Node::Chain {
            op: self.chain.op,
            parameters: self.chain.parameters.clone(),
            first: to(self.first),
            steps: steps.collect(),
        }
    }
}

/// Where guards pay in a chain; nothing where none does.
fn plan(chain: &Chain, operands: &mut Operands<'_>, volumes: &Volumes<'_>) -> Option<Plan> {
    let mut leaves = Vec::with_capacity(chain.operands.len());
    let mut depth = 0;
    for &id in &chain.operands {
        let volume = volumes.outermost(id).filter(is_useful);
        let found = operands.closed(id, volume.as_ref().map(|volume| volume.space));
        let volume = volume.filter(|_| found.is_closed && found.depth + 1 < MAX_GUARDS);
        depth = depth.max(found.depth);
        leaves.push(Leaf {
            id,
            volume,
            work: found.work,
        });
    }
    let work: f64 = leaves.iter().map(|leaf| leaf.work).sum();
    if work < LEAST_WORK {
        return None;
    }
    let mut planner = Planner::new(&leaves, DEEPEST.min(MAX_GUARDS - 1 - depth));
    let first = match chain.first {
        Some(first) => {
            planner.plan(chain.is_free);
            first
        }
        // Any operand may be the first one: better one that is always needed.
        None => planner.plan_with_first(),
    };
    let deepest = planner.deepest();
    (deepest > 0).then(|| Plan {
        chain: chain.clone(),
        first,
        steps: planner.steps,
        depth: depth + deepest,
    })
}

/// Whether a box tells anything: it ends along two axes at least.
fn is_useful(volume: &Volume) -> bool {
    let b = &volume.bounds;
    let ends = |i: &usize| b.min[*i] > -ENDLESS && b.max[*i] < ENDLESS;
    (0..3).filter(ends).count() >= 2
}

/// What a guard compares with, for a chain whose operation has this sign and reaches this far.
fn numbers(volume: &Volume, sign: f64, support: f64) -> [Number; 8] {
    let (reach, factor) = (support / volume.rate, sign / volume.rate);
    let slack = (volume.extent + reach) * SLACK + f64::from(f32::EPSILON);
    let b = volume.bounds.grown(slack);
    let side = |i: usize| {
        let ends = b.min[i] > -ENDLESS && b.max[i] < ENDLESS;
        match ends {
            true => ((b.min[i] + b.max[i]) / 2.0, (b.max[i] - b.min[i]) / 2.0),
            false => (0.0, ENDLESS),
        }
    };
    let [x, y, z] = [0, 1, 2].map(side);
    [x.0, y.0, z.0, reach, x.1, y.1, z.1, factor].map(|v| Number::Constant(v as f32))
}
