//! Where in the text a node is computed: in the innermost block that holds everything that reads it,
//! so that what a guard leaves out is left out with all that only it needs.

use crate::graph::{Graph, Node, NodeId, Step};
use std::collections::HashMap;

/// The body of a function.
pub(super) const OUTERMOST: usize = 0;

/// A function's blocks: its body, and one behind each guard.
pub(super) struct Blocks {
    /// The block around each block, and how many there are around it.
    around: Vec<(usize, usize)>,
    /// The block behind a step of a chain.
    behind: HashMap<(NodeId, usize), usize>,
    /// The block of each node; none where nothing reads it.
    homes: Vec<Option<usize>>,
    /// The nodes of each block, in order.
    members: Vec<Vec<NodeId>>,
}

impl Blocks {
    /// The blocks of a graph's function.
    pub(super) fn of(graph: &Graph) -> Self {
        let mut blocks = Self {
            around: vec![(OUTERMOST, 0)],
            behind: HashMap::new(),
            homes: vec![None; graph.len()],
            members: Vec::new(),
        };
        blocks.homes[graph.root.0 as usize] = Some(OUTERMOST);
        let nodes: Vec<(NodeId, &Node)> = graph.nodes().collect();
        // What reads a node comes behind it, so its block is known by then.
        for (id, node) in nodes.into_iter().rev() {
            let Some(home) = blocks.homes[id.0 as usize] else {
                continue;
            };
            match node {
                Node::Chain { first, steps, .. } => {
                    blocks.read(*first, home);
                    blocks.read_steps(id, steps, home);
                }
                _ => {
                    for input in node.inputs() {
                        blocks.read(input, home);
                    }
                }
            }
        }
        blocks.members = vec![Vec::new(); blocks.around.len()];
        for (at, home) in blocks.homes.iter().enumerate() {
            if let Some(home) = home {
                blocks.members[*home].push(NodeId(at as u32));
            }
        }
        blocks
    }

    /// How many blocks a block lies in.
    pub(super) fn depth(&self, block: usize) -> usize {
        self.around[block].1
    }
    /// What is computed in a block, inputs before what reads them.
    pub(super) fn members(&self, block: usize) -> Vec<NodeId> {
        self.members[block].clone()
    }
    /// The block behind a guard that is this step of a chain.
    pub(super) fn behind(&self, chain: NodeId, step: usize) -> usize {
        self.behind
            .get(&(chain, step))
            .copied()
            .unwrap_or(OUTERMOST)
    }

    fn read_steps(&mut self, id: NodeId, steps: &[Step], home: usize) {
        let mut open: Vec<(usize, usize)> = Vec::new();
        for (at, step) in steps.iter().enumerate() {
            while open.pop_if(|(end, _)| *end <= at).is_some() {}
            let block = open.last().map_or(home, |&(_, block)| block);
            match step {
                Step::Blend(value) => self.read(*value, block),
                Step::Guard(guard) => {
                    self.read(guard.point, block);
                    let inner = self.around.len();
                    self.around.push((block, self.depth(block) + 1));
                    self.behind.insert((id, at), inner);
                    open.push((at + 1 + guard.steps as usize, inner));
                }
            }
        }
    }

    /// A node is read in a block.
    fn read(&mut self, id: NodeId, block: usize) {
        let home = match self.homes[id.0 as usize] {
            Some(before) => self.common(before, block),
            None => block,
        };
        self.homes[id.0 as usize] = Some(home);
    }

    /// The innermost block around both.
    fn common(&self, mut a: usize, mut b: usize) -> usize {
        while a != b {
            if self.depth(a) >= self.depth(b) {
                a = self.around[a].0;
            } else {
                b = self.around[b].0;
            }
        }
        a
    }
}
