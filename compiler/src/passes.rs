//! The optimizer: passes from graph to graph, in order, each of which can be switched off.

pub mod bounding;
pub mod cse;
pub mod dead;
pub mod fold;
pub mod lipschitz;
pub mod lod;

use crate::graph::{Graph, Node, NodeId};
use crate::lower::Purpose;
use lod::{Loss, Sight};

/// A pass.
#[derive(Clone, Copy, Debug)]
pub struct Pass {
    /// The name by which it is switched off.
    pub name: &'static str,
    /// What it does, in a line.
    pub summary: &'static str,
    /// Whether it runs only for a [`Sight`].
    pub needs_sight: bool,
    run: fn(&Graph, &Context) -> Passed,
}

/// All passes, in the order in which they run.
pub const PASSES: [Pass; 6] = [
    Pass {
        name: "fold",
        summary: "constant values, and operations that change nothing; values stay the same",
        needs_sight: false,
        run: fold::fold,
    },
    Pass {
        name: "cse",
        summary: "what is computed twice, if with operands exchanged; values stay the same",
        needs_sight: false,
        run: cse::cse,
    },
    Pass {
        name: "lipschitz",
        summary: "divisions by slopes that need not be so large; values stay safe steps",
        needs_sight: false,
        run: lipschitz::lipschitz,
    },
    Pass {
        name: "lod",
        summary: "only where asked for: what is smaller than pixels made simpler; values change by a bound",
        needs_sight: true,
        run: lod::lod,
    },
    Pass {
        name: "bounding",
        summary: "guards in front of what is too far away to matter; values stay the same",
        needs_sight: false,
        run: bounding::bounding,
    },
    Pass {
        name: "dead",
        summary: "nodes that nothing reads; values stay the same",
        needs_sight: false,
        run: dead::dead,
    },
];

/// What passes know besides the graph.
#[derive(Clone, Copy, Debug)]
pub struct Context {
    /// What the graph is for.
    pub purpose: Purpose,
    /// Who looks at it, where what is too small to be seen may be made simpler.
    pub sight: Option<Sight>,
}

/// What a pass gives: a graph, and what it did, in its own terms.
#[derive(Clone, Debug, Default)]
pub struct Passed {
    /// The new graph.
    pub graph: Graph,
    /// What was done and how often; nothing that was not done.
    pub notes: Vec<String>,
    /// What was lost by it, where it may change the value.
    pub loss: Option<Loss>,
}

/// Which passes run.
#[derive(Clone, Debug, Default)]
pub struct PassOptions {
    /// None at all (`-O0`).
    pub none: bool,
    /// All but these.
    pub without: Vec<String>,
}

/// What a pass did.
#[derive(Clone, Debug, PartialEq)]
pub struct Done {
    /// Its name.
    pub name: &'static str,
    /// Nodes of the graph before and after; `None` if it was left out.
    pub nodes: Option<[usize; 2]>,
    /// What it did, in its own terms.
    pub notes: Vec<String>,
    /// What was lost by it, where it may change the value.
    pub loss: Option<Loss>,
}

/// The graph after all passes that the options leave on, and what each did.
pub fn optimize(graph: &Graph, context: &Context, options: &PassOptions) -> (Graph, Vec<Done>) {
    let mut graph = graph.clone();
    let mut done = Vec::with_capacity(PASSES.len());
    for pass in PASSES {
        let off = options.none
            || options.without.iter().any(|name| name == pass.name)
            || (pass.needs_sight && context.sight.is_none());
        let mut this = Done {
            name: pass.name,
            nodes: None,
            notes: Vec::new(),
            loss: None,
        };
        if !off {
            let passed = (pass.run)(&graph, context);
            this.nodes = Some([graph.len(), passed.graph.len()]);
            this.notes = passed.notes;
            this.loss = passed.loss;
            graph = passed.graph;
        }
        done.push(this);
    }
    (graph, done)
}

/// A copy of the graph in which each node that the root reaches is what `rewrite` makes of it, given
/// the new graph, the node's old place and the node with its inputs replaced.
fn rebuilt(graph: &Graph, mut rewrite: impl FnMut(&mut Graph, NodeId, Node) -> NodeId) -> Graph {
    let mut to = Graph::default();
    let uses = graph.uses();
    let mut moved = vec![NodeId::default(); graph.len()];
    // The world's point stays the first node.
    to.add(Node::World);
    for (id, node) in graph.nodes() {
        if uses[id.0 as usize] == 0 {
            continue;
        }
        let node = node.with_inputs(|input| moved[input.0 as usize]);
        let new = rewrite(&mut to, id, node);
        if let Some(origin) = graph.origin(id) {
            to.set_origin(new, origin.clone());
        }
        moved[id.0 as usize] = new;
    }
    to.root = moved[graph.root.0 as usize];
    to
}

/// "3 guards", "1 guard"; nothing where there are none.
fn counted(count: usize, one: &str, many: &str) -> Option<String> {
    match count {
        0 => None,
        1 => Some(format!("1 {one}")),
        _ => Some(format!("{count} {many}")),
    }
}
