//! The graph: a scene as a hash-consed, typed, directed acyclic graph of operations.
//!
//! What holds of every graph: equal nodes are one node; a node's inputs stand before it; every
//! operand has the kind that its row asks for. A node is a point or a value, by [`Node::is_point`].

use sdfc_lang::Span;
use sdfc_vm::program::CHANNELS;
use sdfc_vm::row::Output;
use sdfc_vm::table::Op;
use std::collections::HashMap;
use std::fmt::Write;

/// A node, by its position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeId(pub u32);

/// A number that is the same at all points.
#[derive(Clone, Copy, Debug)]
pub enum Number {
    /// Folded.
    Constant(f32),
    /// A result of the uniform program.
    Uniform(u32),
}

impl Number {
    fn key(self) -> (u32, u32) {
        match self {
            Number::Constant(v) => (0, v.to_bits()),
            Number::Uniform(u) => (1, u),
        }
    }
    /// Whether it is this constant.
    pub fn is(self, value: f32) -> bool {
        matches!(self, Number::Constant(v) if v == value)
    }
}

impl PartialEq for Number {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}
impl Eq for Number {}
impl std::hash::Hash for Number {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        self.key().hash(state);
    }
}

/// A step of a [`Node::Chain`].
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Step {
    /// A value is blended in.
    Blend(NodeId),
    /// The next steps are left out where they do not matter.
    Guard(Guard),
}

/// What tells that steps of a chain do not matter at a point; see [`sdfc_vm::guard`].
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Guard {
    /// The point that it looks at.
    pub point: NodeId,
    /// The middle of a box and the reach, the box's half size and the factor.
    pub volume: [Number; 8],
    /// How many steps it stands for, those behind guards among them counted too.
    pub steps: u32,
}

/// A node of the graph.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Node {
    /// The point in the world.
    World,
    /// A point moved by a vector.
    Moved {
        /// The point.
        point: NodeId,
        /// The vector.
        by: [Number; 3],
    },
    /// A point mapped by three rows of three factors and a shift.
    Mapped {
        /// The point.
        point: NodeId,
        /// The rows.
        rows: [Number; 12],
    },
    /// A number.
    Constant(Number),
    /// A row of the table.
    Apply {
        /// The operation.
        op: Op,
        /// The point it reads, if it reads one.
        point: Option<NodeId>,
        /// Its operands.
        values: Vec<NodeId>,
        /// The numbers of its parameters, without gaps.
        parameters: Vec<Number>,
    },
    /// Values blended one after the other into a first one by the same operation, with guards among
    /// them; without the guards it would have the same value. Only the pass `bounding` makes them.
    Chain {
        /// The operation: a blend.
        op: Op,
        /// The numbers of its parameters.
        parameters: Vec<Number>,
        /// The value that the others are blended into.
        first: NodeId,
        /// The others, in order.
        steps: Vec<Step>,
    },
    /// A component of the normal in the frame of a point; only in graphs of surfaces.
    Normal {
        /// The point.
        point: NodeId,
        /// Which component.
        axis: u8,
    },
    /// A value in a material; only in graphs of surfaces.
    Paint {
        /// The value.
        value: NodeId,
        /// Albedo, roughness, emission, metallic, the material's number, whether it is bumped.
        constants: [Number; 12],
        /// Channels that are computed, in place of the constants.
        channels: Vec<(u8, NodeId)>,
    },
}

impl Node {
    /// Whether it is a point; else it is a value.
    pub fn is_point(&self) -> bool {
        match self {
            Node::World | Node::Moved { .. } | Node::Mapped { .. } => true,
            Node::Apply { op, .. } => op.row().output == Output::Point,
            Node::Constant(_) | Node::Chain { .. } | Node::Normal { .. } | Node::Paint { .. } => {
                false
            }
        }
    }
    /// The nodes it reads, the point first.
    pub fn inputs(&self) -> Vec<NodeId> {
        match self {
            Node::World | Node::Constant(_) => Vec::new(),
            Node::Moved { point, .. } | Node::Mapped { point, .. } => vec![*point],
            Node::Normal { point, .. } => vec![*point],
            Node::Apply { point, values, .. } => point.iter().chain(values).copied().collect(),
            Node::Chain { first, steps, .. } => {
                let steps = steps.iter().map(|step| match step {
                    Step::Blend(value) => *value,
                    Step::Guard(guard) => guard.point,
                });
                std::iter::once(*first).chain(steps).collect()
            }
            Node::Paint {
                value, channels, ..
            } => std::iter::once(*value)
                .chain(channels.iter().map(|&(_, id)| id))
                .collect(),
        }
    }
    /// The same node with its inputs replaced.
    pub fn with_inputs(&self, mut to: impl FnMut(NodeId) -> NodeId) -> Node {
        match self {
            Node::World | Node::Constant(_) => self.clone(),
            Node::Moved { point, by } => Node::Moved {
                point: to(*point),
                by: *by,
            },
            Node::Mapped { point, rows } => Node::Mapped {
                point: to(*point),
                rows: *rows,
            },
            Node::Normal { point, axis } => Node::Normal {
                point: to(*point),
                axis: *axis,
            },
            Node::Apply {
                op,
                point,
                values,
                parameters,
            } => Node::Apply {
                op: *op,
                point: point.map(&mut to),
                values: values.iter().map(|&v| to(v)).collect(),
                parameters: parameters.clone(),
            },
            Node::Chain {
                op,
                parameters,
                first,
                steps,
            } => Node::Chain {
                op: *op,
                parameters: parameters.clone(),
                first: to(*first),
                steps: steps
                    .iter()
                    .map(|step| match step {
                        Step::Blend(value) => Step::Blend(to(*value)),
                        Step::Guard(guard) => Step::Guard(Guard {
                            point: to(guard.point),
                            ..guard.clone()
                        }),
                    })
                    .collect(),
            },
            Node::Paint {
                value,
                constants,
                channels,
            } => Node::Paint {
                value: to(*value),
                constants: *constants,
                channels: channels.iter().map(|&(c, id)| (c, to(id))).collect(),
            },
        }
    }
}

/// Where a node comes from, for names in generated text and for diagnostics.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Origin {
    /// The name in the scene; empty if there is none.
    pub name: String,
    /// The text.
    pub span: Option<Span>,
}

/// The graph of a scene.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    nodes: Vec<Node>,
    known: HashMap<Node, NodeId>,
    origins: HashMap<NodeId, Origin>,
    /// The scene's distance.
    pub root: NodeId,
}

impl Graph {
    /// The node itself.
    pub fn get(&self, id: NodeId) -> &Node {
        &self.nodes[id.0 as usize]
    }
    /// All nodes, inputs before what reads them.
    pub fn nodes(&self) -> impl Iterator<Item = (NodeId, &Node)> {
        self.nodes
            .iter()
            .enumerate()
            .map(|(i, node)| (NodeId(i as u32), node))
    }
    /// How many nodes there are.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }
    /// The node equal to `node`, which is added unless it is there.
    pub fn add(&mut self, node: Node) -> NodeId {
        if let Some(&id) = self.known.get(&node) {
            return id;
        }
        let id = NodeId(self.nodes.len() as u32);
        self.known.insert(node.clone(), id);
        self.nodes.push(node);
        id
    }
    /// The node equal to `node`, if there is one.
    pub fn find(&self, node: &Node) -> Option<NodeId> {
        self.known.get(node).copied()
    }
    /// Says where a node comes from, unless that is known.
    pub fn set_origin(&mut self, id: NodeId, origin: Origin) {
        let known = self.origins.entry(id).or_default();
        if known.name.is_empty() {
            known.name = origin.name;
        }
        known.span = known.span.or(origin.span);
    }
    /// Where a node comes from.
    pub fn origin(&self, id: NodeId) -> Option<&Origin> {
        self.origins.get(&id)
    }
    /// For each node, how many times the nodes that the root reaches read it.
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
    /// The graph as text, a node a line.
    pub fn dump(&self) -> String {
        let mut text = String::new();
        for (id, node) in self.nodes() {
            let _ = write!(text, "%{:<4} = ", id.0);
            match node {
                Node::World => text.push_str("world"),
                Node::Moved { point, by } => {
                    let _ = write!(text, "moved %{} {}", point.0, numbers(by));
                }
                Node::Mapped { point, rows } => {
                    let _ = write!(text, "mapped %{} {}", point.0, numbers(rows));
                }
                Node::Constant(number) => {
                    let _ = write!(text, "constant {}", numbers(&[*number]));
                }
                Node::Normal { point, axis } => {
                    let _ = write!(
                        text,
                        "normal.{} %{}",
                        ["x", "y", "z"][usize::from(*axis)],
                        point.0
                    );
                }
                Node::Apply {
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
                Node::Chain {
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
                Node::Paint {
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

/// The steps of a chain, a line each, those behind a guard farther in.
fn write_steps(text: &mut String, steps: &[Step]) {
    // Where the guards end that a step lies behind.
    let mut ends: Vec<usize> = Vec::new();
    for (at, step) in steps.iter().enumerate() {
        while ends.last().is_some_and(|&end| end <= at) {
            ends.pop();
        }
        let _ = write!(text, "\n{:indent$}", "", indent = 9 + 2 * ends.len());
        match step {
            Step::Blend(value) => {
                let _ = write!(text, "%{}", value.0);
            }
            Step::Guard(guard) => {
                let _ = write!(text, "near %{} {}:", guard.point.0, numbers(&guard.volume));
                ends.push(at + 1 + guard.steps as usize);
            }
        }
    }
}

/// What a channel of a material is called in listings.
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

fn numbers(numbers: &[Number]) -> String {
    let list: Vec<String> = numbers
        .iter()
        .map(|n| match n {
            Number::Constant(v) => format!("{v:?}"),
            Number::Uniform(u) => format!("u{u}"),
        })
        .collect();
    format!("[{}]", list.join(", "))
}

/// Whether the order of an operation's two operands does not matter, to the last bit.
pub fn is_commutative(op: Op) -> bool {
    let by_blend = op
        .row()
        .meta
        .blend
        .is_some_and(|blend| !blend.negate_second);
    by_blend || matches!(op, Op::Add | Op::Mul | Op::Min | Op::Max)
}
