//! Graph → program: an order for the nodes on the stack machine, and the fusing of what one
//! instruction can do at once.
//!
//! Operands of commutative operations are ordered heavier side first (R. Sethi and J. D. Ullman,
//! *The Generation of Optimal Code for Arithmetic Expressions*, 1970), so that the stack stays
//! shallow; the last instruction of a blend's second operand does the blend too; a value that is
//! read more than once is kept in a slot until its last use. The walk is a loop over explicit
//! tasks: a chain of ten thousand unions is no deeper than one of ten.

use crate::graph::{Graph, Node, NodeId, Number, Step, is_commutative};
use sdfc_vm::kernel::Blend;
use sdfc_vm::pool::{PoolBuilder, PoolNumber};
use sdfc_vm::program::{Code, Frame, Instruction, Operands, Place, Program};
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// The program of a graph, with zeros where uniform numbers go ([`Program::patch`] sets them). It
/// is still to be verified: limits are the verifier's to state.
pub fn schedule(graph: &Graph) -> Program {
    let mut scheduler = Scheduler {
        graph,
        uses: graph.uses(),
        needs: needs(graph),
        painted: graph
            .nodes()
            .any(|(_, node)| matches!(node, Node::Paint { .. })),
        code: Vec::new(),
        pool: PoolBuilder::default(),
        points: vec![World::NODE],
        slots: Slots::default(),
        tasks: vec![Task::Visit(graph.root)],
        sealed: 0,
    };
    scheduler.run();
    let (pool, patches) = scheduler.pool.finish();
    Program {
        code: scheduler.code,
        pool,
        patches,
        slots: scheduler.slots.count,
    }
}

struct World;
impl World {
    /// The world's point is the first node of every graph.
    const NODE: NodeId = NodeId(0);
}

/// What is still to be done; the last first.
#[derive(Clone, Copy, Debug)]
enum Task {
    /// Put the value of a node on the stack.
    Visit(NodeId),
    /// The operands of a node are on the stack: run it.
    Emit(NodeId),
    /// Both operands of a blend are on the stack, the second by the instruction before.
    Blend(NodeId),
    /// Make sure that a point is the current one or below it.
    Reach(NodeId),
    /// What a point is computed from is there: compute it.
    EmitPoint(NodeId),
    /// Take the value on top as a channel of the next material.
    Channel(u8),
    /// Keep the value on top if it is read again.
    Keep(NodeId),
    /// The value that a chain has so far is on top: run the guard that is this step.
    Guard(NodeId, usize),
    /// What a guard stands for ends here.
    EndGuard {
        /// Where the guard is among the instructions.
        at: usize,
        /// How many points there were behind it.
        points: usize,
    },
}

/// Slots, given out lowest first.
#[derive(Default)]
struct Slots {
    /// Where a value is kept, and how often it is still to be read.
    kept: HashMap<NodeId, (u8, u32)>,
    free: Vec<u8>,
    count: u32,
}

/// The number of stack entries from which on an operand comes first in a program of surfaces, too.
const DEEP: u32 = 32;

struct Scheduler<'a> {
    graph: &'a Graph,
    uses: Vec<u32>,
    needs: Vec<u32>,
    /// Tells if values carry materials, of which the first operand's shows where both are alike.
    painted: bool,
    code: Vec<Instruction>,
    pool: PoolBuilder,
    /// The points on the machine's stack, the current one last.
    points: Vec<NodeId>,
    slots: Slots,
    tasks: Vec<Task>,
    /// Instructions before this one are in blocks that have ended; what comes later is not fused
    /// into them.
    sealed: usize,
}

/// How many stack entries each value needs while it is computed.
fn needs(graph: &Graph) -> Vec<u32> {
    let mut needs: Vec<u32> = Vec::with_capacity(graph.len());
    for (_, node) in graph.nodes() {
        let of = |id: &NodeId| needs[id.0 as usize];
        let need = match node {
            Node::Apply { op, values, .. } => match values.as_slice() {
                [a, b] if is_commutative(*op) => {
                    let (a, b) = (of(a), of(b));
                    if a == b { a + 1 } else { a.max(b) }
                }
                values => {
                    let each = values.iter().enumerate().map(|(i, v)| of(v) + i as u32);
                    each.max().unwrap_or(1)
                }
            },
            Node::Chain { first, steps, .. } => {
                let each = steps.iter().map(|step| match step {
                    Step::Blend(value) => of(value) + 1,
                    Step::Guard(_) => 0,
                });
                each.max().unwrap_or(0).max(of(first))
            }
            Node::Paint {
                value, channels, ..
            } => {
                let each = channels.iter().map(|(_, id)| of(id) + 1);
                each.max().unwrap_or(0).max(of(value))
            }
            _ => 1,
        };
        needs.push(need.min(1 << 20));
    }
    needs
}

impl Scheduler<'_> {
    fn run(&mut self) {
        while let Some(task) = self.tasks.pop() {
            match task {
                Task::Visit(id) => self.visit(id),
                Task::Emit(id) => self.emit(id),
                Task::Blend(id) => self.blend(id),
                Task::Reach(id) => self.reach(id),
                Task::EmitPoint(id) => self.emit_point(id),
                Task::Channel(channel) => {
                    let slot = channel;
                    self.code.push(Instruction {
                        slot,
                        ..Instruction::new(Code::Channel)
                    });
                }
                Task::Keep(id) => self.keep(id),
                Task::Guard(id, step) => self.guard(id, step),
                Task::EndGuard { at, points } => self.end_guard(at, points),
            }
        }
    }

    fn node(&self, id: NodeId) -> &Node {
        self.graph.get(id)
    }

    fn constant(&self, id: NodeId) -> Option<Number> {
        match self.node(id) {
            Node::Constant(number) => Some(*number),
            _ => None,
        }
    }

    /// Whether computing a value again costs no more than reading a slot.
    fn is_cheap(&self, id: NodeId) -> bool {
        matches!(
            self.node(id),
            Node::Constant(_)
                | Node::Apply {
                    op: Op::X | Op::Y | Op::Z,
                    ..
                }
        )
    }

    fn visit(&mut self, id: NodeId) {
        if let Some((slot, left)) = self.slots.kept.get_mut(&id) {
            let slot = *slot;
            *left -= 1;
            if *left == 0 {
                self.slots.kept.remove(&id);
                self.slots.free.push(slot);
                self.slots.free.sort_unstable_by(|a, b| b.cmp(a));
            }
            self.code.push(Instruction {
                slot,
                ..Instruction::new(Code::Load)
            });
            return;
        }
        if self.uses[id.0 as usize] > 1 && !self.is_cheap(id) {
            self.tasks.push(Task::Keep(id));
        }
        match self.node(id) {
            Node::Apply { op, values, .. } => {
                let (op, mut values) = (*op, values.clone());
                if let [a, b] = values[..] {
                    let need = self.needs[b.0 as usize];
                    let heavier = need > self.needs[a.0 as usize];
                    if is_commutative(op) && heavier && (!self.painted || need > DEEP) {
                        values.swap(0, 1);
                    }
                }
                let blend = op.row().meta.blend.is_some();
                self.tasks.push(if blend {
                    Task::Blend(id)
                } else {
                    Task::Emit(id)
                });
                let constants = !blend && values.len() == 2;
                let skipped = values
                    .iter()
                    .position(|&v| constants && self.constant(v).is_some());
                for (i, &value) in values.iter().enumerate().rev() {
                    if skipped != Some(i) {
                        self.tasks.push(Task::Visit(value));
                    }
                }
            }
            Node::Paint {
                value, channels, ..
            } => {
                let (value, channels) = (*value, channels.clone());
                self.tasks.push(Task::Emit(id));
                for (channel, node) in channels.into_iter().rev() {
                    self.tasks.push(Task::Channel(channel));
                    self.tasks.push(Task::Visit(node));
                }
                self.tasks.push(Task::Visit(value));
            }
            Node::Chain { .. } => self.chain(id),
            Node::Constant(_) | Node::Normal { .. } => self.tasks.push(Task::Emit(id)),
            Node::World | Node::Moved { .. } | Node::Mapped { .. } => {
                unreachable!("a point is not a value")
            }
        }
    }

    /// The frame of a point and the point it is a frame on.
    fn frame(&mut self, point: NodeId) -> (Frame, NodeId) {
        match self.graph.get(point) {
            Node::Moved { point, by } => {
                let index = self.add(by);
                (Frame::Moved(index), *point)
            }
            Node::Mapped { point, rows } => {
                let index = self.add(rows);
                (Frame::Mapped(index), *point)
            }
            _ => (Frame::Same, point),
        }
    }

    fn add(&mut self, numbers: &[Number]) -> u32 {
        let numbers: Vec<PoolNumber> = numbers
            .iter()
            .map(|number| match *number {
                Number::Constant(value) => PoolNumber {
                    value,
                    output: None,
                },
                Number::Uniform(output) => PoolNumber {
                    value: 0.0,
                    output: Some(output),
                },
            })
            .collect();
        self.pool.add(&numbers)
    }

    /// A row's parameters, laid out as the row wants them.
    fn add_parameters(&mut self, op: Op, parameters: &[Number]) -> u32 {
        if parameters.is_empty() {
            return 0;
        }
        let row = op.row();
        let mut laid = vec![Number::Constant(0.0); row.parameter_width()];
        let mut next = parameters.iter();
        for (parameter, offset) in row.parameters.iter().zip(row.offsets()) {
            for slot in &mut laid[offset..offset + parameter.ty.width()] {
                *slot = *next.next().expect("a node has all its row's parameters");
            }
        }
        self.add(&laid)
    }

    /// How many points to go back to reach `base`, which then is the current one; `None` if it is
    /// not on the stack.
    fn back_to(&mut self, base: NodeId) -> Option<u8> {
        let at = self.points.iter().rposition(|&p| p == base)?;
        let pops = self.points.len() - 1 - at;
        self.points.truncate(at + 1);
        Some(pops as u8)
    }

    fn emit(&mut self, id: NodeId) {
        let point = match self.node(id) {
            Node::Apply { point, .. } => *point,
            Node::Normal { point, .. } => Some(*point),
            _ => None,
        };
        let mut instruction = Instruction::new(Code::Take);
        if let Some(point) = point {
            let (frame, base) = self.frame(point);
            match self.back_to(base) {
                Some(pops) => instruction.pops = pops,
                None => {
                    self.tasks.push(Task::Emit(id));
                    self.tasks.push(Task::Reach(base));
                    return;
                }
            }
            instruction.frame = frame;
        }
        match self.graph.get(id) {
            Node::Constant(number) => {
                instruction.code = Code::Op(Op::Constant);
                instruction.parameters = self.add(&[*number]);
            }
            Node::Normal { axis, .. } => {
                instruction.code = Code::Normal;
                instruction.slot = *axis;
            }
            Node::Paint {
                constants,
                channels,
                ..
            } => {
                instruction.code = Code::Paint;
                instruction.parameters = self.add(constants);
                let bits = channels.iter().filter(|(c, _)| *c < 8).map(|(c, _)| 1 << c);
                instruction.slot = bits.fold(0, |mask, bit: u8| mask | bit);
            }
            Node::Apply {
                op,
                values,
                parameters,
                ..
            } => {
                instruction.code = Code::Op(*op);
                instruction.parameters = self.add_parameters(*op, parameters);
                if let [a, b] = values[..] {
                    instruction.operands = match (self.constant(a), self.constant(b)) {
                        (Some(number), _) => Operands::Left(self.add(&[number])),
                        (_, Some(number)) => Operands::Right(self.add(&[number])),
                        _ => Operands::Stack,
                    };
                }
            }
            Node::Chain { .. } => unreachable!("its steps are emitted one by one"),
            Node::World | Node::Moved { .. } | Node::Mapped { .. } => {
                unreachable!("a point is not a value")
            }
        }
        self.code.push(instruction);
    }

    /// The tasks of a chain: its first value, then its steps, of which guards add the tasks of
    /// their own.
    fn chain(&mut self, id: NodeId) {
        let Node::Chain { first, steps, .. } = self.node(id) else {
            unreachable!("only chains are visited so")
        };
        let (first, count) = (*first, steps.len());
        self.steps(id, 0, count);
        self.tasks.push(Task::Visit(first));
    }

    /// The tasks of a chain's steps from one up to another.
    fn steps(&mut self, id: NodeId, from: usize, to: usize) {
        let graph = self.graph;
        let Node::Chain { steps, .. } = graph.get(id) else {
            unreachable!("only chains have steps")
        };
        let mut tasks = Vec::new();
        let mut at = from;
        while at < to {
            match &steps[at] {
                Step::Blend(value) => {
                    tasks.extend([Task::Visit(*value), Task::Blend(id)]);
                    at += 1;
                }
                Step::Guard(guard) => {
                    tasks.push(Task::Guard(id, at));
                    at += 1 + guard.steps as usize;
                }
            }
        }
        self.tasks.extend(tasks.into_iter().rev());
    }

    fn guard(&mut self, id: NodeId, at: usize) {
        let graph = self.graph;
        let Node::Chain { steps, .. } = graph.get(id) else {
            unreachable!("only chains have guards")
        };
        let Step::Guard(guard) = &steps[at] else {
            unreachable!("the step is a guard")
        };
        let (frame, base) = self.frame(guard.point);
        let Some(pops) = self.back_to(base) else {
            self.tasks.push(Task::Guard(id, at));
            self.tasks.push(Task::Reach(base));
            return;
        };
        let instruction = Instruction {
            pops,
            frame,
            parameters: self.add(&guard.volume),
            ..Instruction::new(Code::Guard)
        };
        self.tasks.push(Task::EndGuard {
            at: self.code.len(),
            points: self.points.len(),
        });
        self.code.push(instruction);
        self.steps(id, at + 1, at + 1 + guard.steps as usize);
    }

    /// Goes back to the guard's point, if the block has moved on to others, and says how long the
    /// block is.
    fn end_guard(&mut self, at: usize, points: usize) {
        let pops = self.points.len() - points;
        if pops > 0 {
            self.points.truncate(points);
            self.code.push(Instruction {
                pops: pops as u8,
                ..Instruction::new(Code::Take)
            });
        }
        self.sealed = self.code.len();
        self.code[at].skips = (self.sealed - at - 1) as u32;
    }

    fn blend(&mut self, id: NodeId) {
        let (Node::Apply { op, parameters, .. } | Node::Chain { op, parameters, .. }) =
            self.graph.get(id)
        else {
            unreachable!("only applications and chains blend")
        };
        let Some(Blend {
            kernel,
            sign,
            negate_second,
        }) = op.row().meta.blend
        else {
            unreachable!("only blends are visited so")
        };
        let zero = Number::Constant(0.0);
        let index = self.add(&[
            Number::Constant(sign),
            Number::Constant(if negate_second { -1.0 } else { 1.0 }),
            parameters.first().copied().unwrap_or(zero),
            parameters.get(1).copied().unwrap_or(zero),
        ]);
        let place = Place::Blend { kernel, index };
        let is_open = self.code.len() > self.sealed;
        match self.code.last_mut() {
            Some(last)
                if is_open
                    && last.place == Place::Push
                    && last.operands == Operands::Stack
                    && !last.gives_none() =>
            {
                last.place = place;
            }
            _ => self.code.push(Instruction {
                place,
                ..Instruction::new(Code::Take)
            }),
        }
    }

    fn keep(&mut self, id: NodeId) {
        let slot = self.slots.free.pop().unwrap_or_else(|| {
            self.slots.count += 1;
            // A program with more is refused by the verifier, which counts what is declared.
            (self.slots.count - 1).min(255) as u8
        });
        let left = self.uses[id.0 as usize] - 1;
        self.slots.kept.insert(id, (slot, left));
        self.code.push(Instruction {
            slot,
            ..Instruction::new(Code::Store)
        });
    }

    fn reach(&mut self, point: NodeId) {
        if self.points.contains(&point) {
            return;
        }
        let Node::Apply {
            point: from,
            values,
            ..
        } = self.graph.get(point)
        else {
            unreachable!("the world is always below; frames are part of instructions")
        };
        self.tasks.push(Task::EmitPoint(point));
        if let Some(from) = from {
            let (_, base) = match self.graph.get(*from) {
                Node::Moved { point, .. } | Node::Mapped { point, .. } => ((), *point),
                _ => ((), *from),
            };
            self.tasks.push(Task::Reach(base));
        }
        for &value in values.iter().rev() {
            self.tasks.push(Task::Visit(value));
        }
    }

    fn emit_point(&mut self, id: NodeId) {
        let Node::Apply {
            op,
            point,
            parameters,
            ..
        } = self.graph.get(id)
        else {
            unreachable!("only operations are reached")
        };
        let mut instruction = Instruction {
            push: true,
            ..Instruction::new(Code::Op(*op))
        };
        if let Some(point) = point {
            let (frame, base) = self.frame(*point);
            match self.back_to(base) {
                Some(pops) => instruction.pops = pops,
                None => {
                    self.tasks.push(Task::EmitPoint(id));
                    self.tasks.push(Task::Reach(base));
                    return;
                }
            }
            instruction.frame = frame;
        }
        instruction.parameters = self.add_parameters(*op, parameters);
        self.points.push(id);
        self.code.push(instruction);
    }
}
