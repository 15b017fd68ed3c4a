//! What adds less than can be seen is dropped: the bulges of smooth blends, offsets, displacements.

use super::reach::{Reach, Runs, magnitude, reaches, width};
use super::{Sight, in_world};
use crate::graph::{Graph, Node, NodeId, Number};
use crate::passes::bounding::volumes::Volumes;
use sdfc_vm::kernel::Kernel;
use sdfc_vm::table::Op;

/// The share of the tolerance that may be used here.
const SHARE: f64 = 0.5;

/// A graph with less in it.
pub(super) struct Dropped {
    pub(super) graph: Graph,
    /// How many smooth blends became hard.
    pub(super) blends: usize,
    pub(super) offsets: usize,
    pub(super) displacements: usize,
    /// The largest error in pixels.
    pub(super) pixels: f64,
}

/// What a node becomes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Simpler {
    /// The hard blend of the same sign.
    Hard(Op),
    /// Its operand of this place.
    Operand(usize),
}

/// The graph without what adds too little.
pub(super) fn drop(graph: &Graph, sight: &Sight) -> Dropped {
    let volumes = Volumes::of(graph);
    let runs = Runs::of(graph);
    let reaches = reaches(graph, &volumes, &runs);
    let mut choice = Choice {
        graph,
        sight,
        volumes,
        runs,
        reaches,
        simpler: vec![None; graph.len()],
        pixels: vec![0.0; graph.len()],
        limit: sight.tolerance * SHARE,
    };
    for (id, node) in graph.nodes() {
        choice.consider(id, node);
    }
    let (mut blends, mut offsets, mut displacements) = (0, 0, 0);
    let simple = super::super::rebuilt(graph, |to, id, node| {
        let Node::Apply { op, values, .. } = &node else {
            return to.add(node);
        };
        match choice.simpler[id.0 as usize] {
            None => to.add(node),
            Some(Simpler::Hard(hard)) => {
                blends += 1;
                to.add(Node::Apply {
                    op: hard,
                    point: None,
                    values: values.clone(),
                    parameters: Vec::new(),
                })
            }
            Some(Simpler::Operand(at)) => {
                match op {
                    Op::Offset => offsets += 1,
                    _ => displacements += 1,
                }
                values[at]
            }
        }
    });
    Dropped {
        graph: simple,
        blends,
        offsets,
        displacements,
        pixels: choice.pixels[graph.root.0 as usize],
    }
}

/// What is to be dropped, found from the operands to the root.
struct Choice<'g> {
    graph: &'g Graph,
    sight: &'g Sight,
    volumes: Volumes<'g>,
    runs: Runs,
    reaches: Vec<Reach>,
    simpler: Vec<Option<Simpler>>,
    /// The errors of the nodes so far, in pixels.
    pixels: Vec<f64>,
    limit: f64,
}

impl Choice<'_> {
    fn consider(&mut self, id: NodeId, node: &Node) {
        self.pixels[id.0 as usize] = self.beneath(node);
        if self.reaches[id.0 as usize].band.is_infinite() {
            return;
        }
        let Node::Apply {
            op,
            values,
            parameters,
            ..
        } = node
        else {
            return;
        };
        match op {
            Op::Offset => {
                if let [Number::Constant(by)] = parameters[..] {
                    self.consider_change(id, 0, values[0], f64::from(by).abs());
                }
            }
            Op::Add | Op::Sub => {
                let by = magnitude(self.volumes.range(values[1]));
                if by.is_finite() {
                    self.consider_change(id, 0, values[0], by);
                } else if *op == Op::Add {
                    let by = magnitude(self.volumes.range(values[0]));
                    self.consider_change(id, 1, values[1], by);
                }
            }
            _ if op.row().meta.blend.is_some() && !self.runs.is_interior(id) => {
                self.consider_run(id);
            }
            _ => {}
        }
    }

    /// The error that a node's inputs bring.
    fn beneath(&self, node: &Node) -> f64 {
        let inputs = node.inputs().into_iter();
        let errors = inputs.map(|input| self.pixels[input.0 as usize]);
        match node {
            // The errors of two that are added may be so too.
            Node::Apply {
                op: Op::Add | Op::Sub,
                ..
            } => errors.sum(),
            _ => errors.fold(0.0, f64::max),
        }
    }

    /// Drops a change of a value by this much, if it can. The value has to be a distance, or a known
    /// share of one.
    fn consider_change(&mut self, id: NodeId, at: usize, operand: NodeId, by: f64) {
        if in_world(self.graph, &self.volumes, operand).is_none() {
            return;
        }
        let pixels = self.pixels_of(id, &[operand], by, by);
        if let Some(pixels) = pixels
            && by > 0.0
            && self.pixels[operand.0 as usize] + pixels <= self.limit
        {
            self.pixels[id.0 as usize] = self.pixels[operand.0 as usize] + pixels;
            self.simpler[id.0 as usize] = Some(Simpler::Operand(at));
        }
    }

    /// Makes the blends of a run hard where they may be. However many of them are, what they add
    /// together is no more than [`Kernel::most`].
    fn consider_run(&mut self, root: NodeId) {
        let members = self.runs.members(self.graph, root);
        let Node::Apply { op, parameters, .. } = self.graph.get(root) else {
            return;
        };
        let Some(blend) = op.row().meta.blend.filter(|b| b.kernel != Kernel::Hard) else {
            return;
        };
        let Some((support, thickness)) = width(*op, parameters) else {
            return;
        };
        let hard = match (blend.sign > 0.0, blend.negate_second) {
            (true, _) => Op::Union,
            (false, true) => Op::Subtraction,
            (false, false) => Op::Intersection,
        };
        let all = (thickness * members.len() as f64).min(support);
        let beneath = self.pixels[root.0 as usize];
        let mut added: f64 = 0.0;
        for id in members {
            let Node::Apply { values, .. } = self.graph.get(id) else {
                continue;
            };
            let pixels = self.pixels_of(id, values, all, support + thickness);
            if let Some(pixels) = pixels.filter(|pixels| beneath + pixels <= self.limit) {
                self.simpler[id.0 as usize] = Some(Simpler::Hard(hard));
                added = added.max(pixels);
            }
        }
        self.pixels[root.0 as usize] = beneath + added;
    }

    /// How many pixels a change of a node's value by `change` is, where all of these operands are no
    /// larger than what matters of the node and `margin`.
    fn pixels_of(&self, id: NodeId, operands: &[NodeId], change: f64, margin: f64) -> Option<f64> {
        let reach = self.reaches[id.0 as usize];
        let (mut distance, mut gain) = (0.0_f64, reach.gain);
        for &operand in operands {
            if let Some((bounds, rate)) = in_world(self.graph, &self.volumes, operand) {
                let near = bounds.grown((reach.band + margin) / rate);
                distance = distance.max(self.sight.distance(&near));
                gain = gain.max(1.0 / rate);
            }
        }
        let footprint = self.sight.footprint(distance);
        (footprint > 0.0).then(|| change * gain / footprint)
    }
}
