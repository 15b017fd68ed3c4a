//! The graph: a scene as a hash-consed, typed, directed acyclic graph of operations.
//!
//! Invariants of every graph: equal nodes are one node; a node's inputs have smaller indices; every
//! operand has the kind that its operation requires. A node is a point or a value, see
//! [`GraphNode::is_point`].

use rustc_hash::FxHashMap;
use sdfc_lang::Span;
use sdfc_vm::program::CHANNELS;
use sdfc_vm::row::Output;
use sdfc_vm::table::Op;
use std::fmt::Write;

/// A node, by its index.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeId(pub u32);

/// A number that is the same at all points.
#[derive(Clone, Copy, Debug)]
pub enum GraphNumber {
    /// Number that is known while compiling.
    Constant(f32),
    /// Result of the uniform program.
    Uniform(u32),
}

impl GraphNumber {
    fn key(self) -> (u32, u32) {
        match self {
            GraphNumber::Constant(v) => (0, v.to_bits()),
            GraphNumber::Uniform(u) => (1, u),
        }
    }
    /// Reports whether it is this constant.
    pub fn is(self, value: f32) -> bool {
        matches!(self, GraphNumber::Constant(v) if v == value)
    }
}

impl PartialEq for GraphNumber {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}
impl Eq for GraphNumber {}
impl std::hash::Hash for GraphNumber {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        self.key().hash(state);
    }
}

/// A step of a [`GraphNode::Chain`].
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum GraphChainStep {
    /// Blends a value in.
    Blend(NodeId),
    /// Skips the next steps where they do not matter.
    Guard(Guard),
}

/// Test that skips steps of a chain where they do not matter; see [`sdfc_vm::guard`].
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Guard {
    /// Point that it reads.
    pub point: NodeId,
    /// Centre of a box and the influence radius, then the box's half size and the factor.
    pub numbers: [GraphNumber; 8],
    /// Number of steps that it skips, including those behind nested guards.
    pub steps: u32,
}

/// A node of the graph.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum GraphNode {
    /// The point in the world.
    World,
    /// A point moved by a vector.
    Moved {
        /// Node of the point that is moved.
        point: NodeId,
        /// Translation in the point's frame, along x, y and z.
        by: [GraphNumber; 3],
    },
    /// A point mapped by three rows of three factors and a shift.
    Mapped {
        /// Node of the point that is mapped.
        point: NodeId,
        /// Row-major 3×4 matrix from the point's frame to the new one: three factors and a shift per row.
        rows: [GraphNumber; 12],
    },
    /// A number.
    Constant(GraphNumber),
    /// An operation of the table.
    Apply {
        /// Row of the table that is applied.
        op: Op,
        /// Point that it reads, if any.
        point: Option<NodeId>,
        /// Nodes of the operands, in the row's order.
        values: Vec<NodeId>,
        /// Numbers of its parameters, without gaps.
        parameters: Vec<GraphNumber>,
    },
    /// Values blended one after the other into a first one by the same operation, with guards among
    /// them. The guards do not change the value. Only the pass `guards` creates chains.
    Chain {
        /// Operation: a blend.
        op: Op,
        /// Numbers of its parameters.
        parameters: Vec<GraphNumber>,
        /// Value that the others are blended into.
        first: NodeId,
        /// The other values, in order.
        steps: Vec<GraphChainStep>,
    },
    /// A component of the normal in the frame of a point; only in graphs of surfaces.
    Normal {
        /// Node of the point in whose frame the normal is given.
        point: NodeId,
        /// Index of the component: 0 to 2 for x, y and z.
        axis: u8,
    },
    /// A value in a material; only in graphs of surfaces.
    Paint {
        /// Node of the distance that is painted.
        value: NodeId,
        /// Albedo, roughness, emission, metallic, the material's number, and a flag for a bump.
        constants: [GraphNumber; 12],
        /// Channels that are computed, in place of the constants.
        channels: Vec<(u8, NodeId)>,
    },
}

impl GraphNode {
    /// Reports whether it is a point; otherwise it is a value.
    pub fn is_point(&self) -> bool {
        match self {
            GraphNode::World | GraphNode::Moved { .. } | GraphNode::Mapped { .. } => true,
            GraphNode::Apply { op, .. } => op.row().output == Output::Point,
            GraphNode::Constant(_)
            | GraphNode::Chain { .. }
            | GraphNode::Normal { .. }
            | GraphNode::Paint { .. } => false,
        }
    }
    /// Returns the nodes that it reads, the point first.
    pub fn inputs(&self) -> Vec<NodeId> {
        match self {
            GraphNode::World | GraphNode::Constant(_) => Vec::new(),
            GraphNode::Moved { point, .. } | GraphNode::Mapped { point, .. } => vec![*point],
            GraphNode::Normal { point, .. } => vec![*point],
            GraphNode::Apply { point, values, .. } => point.iter().chain(values).copied().collect(),
            GraphNode::Chain { first, steps, .. } => {
                let steps = steps.iter().map(|step| match step {
                    GraphChainStep::Blend(value) => *value,
                    GraphChainStep::Guard(guard) => guard.point,
                });
                std::iter::once(*first).chain(steps).collect()
            }
            GraphNode::Paint {
                value, channels, ..
            } => std::iter::once(*value)
                .chain(channels.iter().map(|&(_, id)| id))
                .collect(),
        }
    }
    /// Returns the same node with its inputs replaced.
    pub fn with_inputs(&self, mut to: impl FnMut(NodeId) -> NodeId) -> GraphNode {
        match self {
            GraphNode::World | GraphNode::Constant(_) => self.clone(),
            GraphNode::Moved { point, by } => GraphNode::Moved {
                point: to(*point),
                by: *by,
            },
            GraphNode::Mapped { point, rows } => GraphNode::Mapped {
                point: to(*point),
                rows: *rows,
            },
            GraphNode::Normal { point, axis } => GraphNode::Normal {
                point: to(*point),
                axis: *axis,
            },
            GraphNode::Apply {
                op,
                point,
                values,
                parameters,
            } => GraphNode::Apply {
                op: *op,
                point: point.map(&mut to),
                values: values.iter().map(|&v| to(v)).collect(),
                parameters: parameters.clone(),
            },
            GraphNode::Chain {
                op,
                parameters,
                first,
                steps,
            } => GraphNode::Chain {
                op: *op,
                parameters: parameters.clone(),
                first: to(*first),
                steps: steps
                    .iter()
                    .map(|step| match step {
                        GraphChainStep::Blend(value) => GraphChainStep::Blend(to(*value)),
                        GraphChainStep::Guard(guard) => GraphChainStep::Guard(Guard {
                            point: to(guard.point),
                            ..guard.clone()
                        }),
                    })
                    .collect(),
            },
            GraphNode::Paint {
                value,
                constants,
                channels,
            } => GraphNode::Paint {
                value: to(*value),
                constants: *constants,
                channels: channels.iter().map(|&(c, id)| (c, to(id))).collect(),
            },
        }
    }
}

/// Source of a node, for names in generated text and for diagnostics.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Origin {
    /// Name in the scene; empty if there is none.
    pub name: String,
    /// Place in the text that made the node, if there is one.
    pub span: Option<Span>,
}

/// Purpose of a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// The distance only.
    Distance,
    /// The distance and the material.
    Surface,
    /// The distance and the leaf that determines it.
    LeafIds,
}

/// The graph of a scene.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    nodes: Vec<GraphNode>,
    ids: FxHashMap<GraphNode, NodeId>,
    origins: FxHashMap<NodeId, Origin>,
    /// The scene's distance.
    pub root: NodeId,
}

impl Graph {
    /// Returns a node.
    pub fn get(&self, id: NodeId) -> &GraphNode {
        &self.nodes[id.0 as usize]
    }
    /// Returns all nodes, inputs before their users.
    pub fn nodes(&self) -> impl Iterator<Item = (NodeId, &GraphNode)> {
        self.nodes
            .iter()
            .enumerate()
            .map(|(i, node)| (NodeId(i as u32), node))
    }
    /// Returns the number of nodes.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }
    /// Reports whether there are no nodes.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }
    /// Returns the node equal to `node`, and adds it if necessary.
    pub fn add(&mut self, node: GraphNode) -> NodeId {
        if let Some(&id) = self.ids.get(&node) {
            return id;
        }
        let id = NodeId(self.nodes.len() as u32);
        self.ids.insert(node.clone(), id);
        self.nodes.push(node);
        id
    }
    /// Returns the node equal to `node`, if there is one.
    pub fn find(&self, node: &GraphNode) -> Option<NodeId> {
        self.ids.get(node).copied()
    }
    /// Sets the origin of a node, as far as it is not set.
    pub fn set_origin(&mut self, id: NodeId, origin: Origin) {
        let stored = self.origins.entry(id).or_default();
        if stored.name.is_empty() {
            stored.name = origin.name;
        }
        stored.span = stored.span.or(origin.span);
    }
    /// Returns the origin of a node.
    pub fn origin(&self, id: NodeId) -> Option<&Origin> {
        self.origins.get(&id)
    }
    /// Returns the number of uses of each node by the nodes that the root reaches.
    pub fn uses(&self) -> Vec<u32> {
        let mut uses = vec![0; self.nodes.len()];
        uses[self.root.0 as usize] = 1;
        for (id, node) in self.nodes.iter().enumerate().rev() {
            if uses[id] > 0 {
                for input in node.inputs() {
                    uses[input.0 as usize] += 1;
                }
            }
        }
        uses
    }
    /// Returns the graph as text, with one node per line.
    pub fn dump(&self) -> String {
        let mut text = String::new();
        for (id, node) in self.nodes() {
            let _ = write!(text, "%{:<4} = ", id.0);
            match node {
                GraphNode::World => text.push_str("world"),
                GraphNode::Moved { point, by } => {
                    let _ = write!(text, "moved %{} {}", point.0, numbers(by));
                }
                GraphNode::Mapped { point, rows } => {
                    let _ = write!(text, "mapped %{} {}", point.0, numbers(rows));
                }
                GraphNode::Constant(number) => {
                    let _ = write!(text, "constant {}", numbers(&[*number]));
                }
                GraphNode::Normal { point, axis } => {
                    let _ = write!(
                        text,
                        "normal.{} %{}",
                        ["x", "y", "z"][usize::from(*axis)],
                        point.0
                    );
                }
                GraphNode::Apply {
                    op,
                    point,
                    values,
                    parameters,
                } => {
                    text.push_str(op.row().name);
                    for input in point.iter().chain(values) {
                        let _ = write!(text, " %{}", input.0);
                    }
                    if !parameters.is_empty() {
                        let _ = write!(text, " {}", numbers(parameters));
                    }
                }
                GraphNode::Chain {
                    op,
                    parameters,
                    first,
                    steps,
                } => {
                    let _ = write!(text, "chain of {} %{}", op.row().name, first.0);
                    if !parameters.is_empty() {
                        let _ = write!(text, " {}", numbers(parameters));
                    }
                    write_steps(&mut text, steps);
                }
                GraphNode::Paint {
                    value,
                    constants,
                    channels,
                } => {
                    let _ = write!(text, "paint %{} {}", value.0, numbers(constants));
                    for (channel, id) in channels {
                        let _ = write!(text, " {}=%{}", channel_name(*channel), id.0);
                    }
                }
            }
            if let Some(origin) = self.origins.get(&id)
                && !origin.name.is_empty()
            {
                let _ = write!(text, "  // {}", origin.name);
            }
            text.push('\n');
        }
        let _ = writeln!(text, "result %{}", self.root.0);
        text
    }
}

/// Writes the steps of a chain, one per line, with those behind a guard indented.
fn write_steps(text: &mut String, steps: &[GraphChainStep]) {
    // Ends of the guards around a step.
    let mut ends: Vec<usize> = Vec::new();
    for (index, step) in steps.iter().enumerate() {
        while ends.last().is_some_and(|&end| end <= index) {
            ends.pop();
        }
        let _ = write!(text, "\n{:indent$}", "", indent = 9 + 2 * ends.len());
        match step {
            GraphChainStep::Blend(value) => {
                let _ = write!(text, "%{}", value.0);
            }
            GraphChainStep::Guard(guard) => {
                let _ = write!(text, "near %{} {}:", guard.point.0, numbers(&guard.numbers));
                ends.push(index + 1 + guard.steps as usize);
            }
        }
    }
}

/// Returns the name of a material's channel in listings.
pub fn channel_name(channel: u8) -> &'static str {
    const NAMES: [&str; CHANNELS] = [
        "albedo.r",
        "albedo.g",
        "albedo.b",
        "roughness",
        "emission.r",
        "emission.g",
        "emission.b",
        "metallic",
        "bump",
    ];
    NAMES[usize::from(channel)]
}

/// Returns the numbers, if none depends on a parameter.
pub fn constants(numbers: &[GraphNumber]) -> Option<Vec<f64>> {
    let constant = |n: &GraphNumber| match n {
        GraphNumber::Constant(v) => Some(f64::from(*v)),
        GraphNumber::Uniform(_) => None,
    };
    numbers.iter().map(constant).collect()
}

fn numbers(numbers: &[GraphNumber]) -> String {
    let list: Vec<String> = numbers
        .iter()
        .map(|n| match n {
            GraphNumber::Constant(v) => format!("{v:?}"),
            GraphNumber::Uniform(u) => format!("u{u}"),
        })
        .collect();
    format!("[{}]", list.join(", "))
}
