//! Placement of nodes in generated text: each is computed in the innermost block that contains all its
//! users. So a skipped block skips all nodes that only it uses.

use crate::graph::{Graph, GraphChainStep, GraphNode, NodeId};
use std::collections::HashMap;

/// The body of a function.
pub(super) const ROOT_BLOCK: usize = 0;

/// Blocks of a function: its body, and one behind each guard.
pub(super) struct Blocks {
    /// Parent of each block, and its nesting depth.
    parents: Vec<(usize, usize)>,
    /// Block behind a step of a chain.
    guarded_blocks: HashMap<(NodeId, usize), usize>,
    /// Block of each node; `None` if it is unused.
    node_blocks: Vec<Option<usize>>,
    /// Nodes of each block, in order.
    members: Vec<Vec<NodeId>>,
}

impl Blocks {
    /// Computes the blocks of a graph's function.
    pub(super) fn new(graph: &Graph) -> Self {
        let mut blocks = Self {
            parents: vec![(ROOT_BLOCK, 0)],
            guarded_blocks: HashMap::new(),
            node_blocks: vec![None; graph.len()],
            members: Vec::new(),
        };
        blocks.node_blocks[graph.root.0 as usize] = Some(ROOT_BLOCK);
        let nodes: Vec<(NodeId, &GraphNode)> = graph.nodes().collect();
        // The users of a node follow it, so its block is known by then.
        for (id, node) in nodes.into_iter().rev() {
            let Some(block) = blocks.node_blocks[id.0 as usize] else {
                continue;
            };
            match node {
                GraphNode::Chain { first, steps, .. } => {
                    blocks.record_use(*first, block);
                    blocks.record_step_uses(id, steps, block);
                }
                _ => {
                    for input in node.inputs() {
                        blocks.record_use(input, block);
                    }
                }
            }
        }
        blocks.members = vec![Vec::new(); blocks.parents.len()];
        for (index, block) in blocks.node_blocks.iter().enumerate() {
            if let Some(block) = block {
                blocks.members[*block].push(NodeId(index as u32));
            }
        }
        blocks
    }

    /// Returns the nesting depth of a block.
    pub(super) fn depth(&self, block: usize) -> usize {
        self.parents[block].1
    }
    /// Returns the nodes of a block, inputs before their users.
    pub(super) fn members(&self, block: usize) -> Vec<NodeId> {
        self.members[block].clone()
    }
    /// Returns the block behind a guard that is this step of a chain.
    pub(super) fn block_behind(&self, chain: NodeId, step: usize) -> usize {
        self.guarded_blocks
            .get(&(chain, step))
            .copied()
            .unwrap_or(ROOT_BLOCK)
    }

    fn record_step_uses(&mut self, id: NodeId, steps: &[GraphChainStep], outer_block: usize) {
        let mut open_blocks: Vec<(usize, usize)> = Vec::new();
        for (index, step) in steps.iter().enumerate() {
            while open_blocks.pop_if(|(end, _)| *end <= index).is_some() {}
            let block = open_blocks.last().map_or(outer_block, |&(_, block)| block);
            match step {
                GraphChainStep::Blend(value) => self.record_use(*value, block),
                GraphChainStep::Guard(guard) => {
                    self.record_use(guard.point, block);
                    let inner = self.parents.len();
                    self.parents.push((block, self.depth(block) + 1));
                    self.guarded_blocks.insert((id, index), inner);
                    open_blocks.push((index + 1 + guard.steps as usize, inner));
                }
            }
        }
    }

    /// Records a use of a node in a block.
    fn record_use(&mut self, id: NodeId, block: usize) {
        let new_block = match self.node_blocks[id.0 as usize] {
            Some(previous) => self.innermost_common(previous, block),
            None => block,
        };
        self.node_blocks[id.0 as usize] = Some(new_block);
    }

    /// Returns the innermost block around both.
    fn innermost_common(&self, mut a: usize, mut b: usize) -> usize {
        while a != b {
            if self.depth(a) >= self.depth(b) {
                a = self.parents[a].0;
            } else {
                b = self.parents[b].0;
            }
        }
        a
    }
}
