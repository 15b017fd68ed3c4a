//! The optimizer: passes from graph to graph, in order, each of which can be switched off.

pub mod dead;
pub mod fold;

use crate::graph::Graph;

/// A pass.
#[derive(Clone, Copy, Debug)]
pub struct Pass {
    /// The name by which it is switched off.
    pub name: &'static str,
    /// What it does, in a line.
    pub summary: &'static str,
    run: fn(&Graph) -> Graph,
}

/// All passes, in the order in which they run.
pub const PASSES: [Pass; 2] = [
    Pass {
        name: "fold",
        summary: "constant values, and operations that change nothing; values stay the same",
        run: fold::fold,
    },
    Pass {
        name: "dead",
        summary: "nodes that nothing reads; values stay the same",
        run: dead::dead,
    },
];

/// Which passes run.
#[derive(Clone, Debug, Default)]
pub struct PassOptions {
    /// None at all (`-O0`).
    pub none: bool,
    /// All but these.
    pub without: Vec<String>,
}

/// What a pass did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Done {
    /// Its name.
    pub name: &'static str,
    /// Nodes of the graph before and after; `None` if it was left out.
    pub nodes: Option<[usize; 2]>,
}

/// The graph after all passes that the options leave on, and what each did.
pub fn optimize(graph: &Graph, options: &PassOptions) -> (Graph, Vec<Done>) {
    let mut graph = graph.clone();
    let mut done = Vec::with_capacity(PASSES.len());
    for pass in PASSES {
        let off = options.none || options.without.iter().any(|name| name == pass.name);
        let nodes = (!off).then(|| {
            let before = graph.len();
            graph = (pass.run)(&graph);
            [before, graph.len()]
        });
        done.push(Done {
            name: pass.name,
            nodes,
        });
    }
    (graph, done)
}

/// A copy of the graph in which each node that the root reaches is what `rewrite` makes of it, given
/// the new graph and the node with its inputs replaced.
fn rebuilt(
    graph: &Graph,
    mut rewrite: impl FnMut(&mut Graph, crate::graph::Node) -> crate::graph::NodeId,
) -> Graph {
    let mut to = Graph::default();
    let uses = graph.uses();
    let mut moved = vec![crate::graph::NodeId::default(); graph.len()];
    // The world's point stays the first node.
    to.add(crate::graph::Node::World);
    for (id, node) in graph.nodes() {
        if uses[id.0 as usize] == 0 {
            continue;
        }
        let node = node.with_inputs(|input| moved[input.0 as usize]);
        let new = rewrite(&mut to, node);
        if let Some(origin) = graph.origin(id) {
            to.set_origin(new, origin.clone());
        }
        moved[id.0 as usize] = new;
    }
    to.root = moved[graph.root.0 as usize];
    to
}
