//! Graph → program: an order of the nodes for the stack machine, with adjacent operations fused into
//! one instruction where possible.
//!
//! Operands of commutative operations are ordered heavier side first (R. Sethi and J. D. Ullman, *The
//! Generation of Optimal Code for Arithmetic Expressions*, 1970), so that the stack stays shallow. The
//! last instruction of a blend's second operand also does the blend. A value with several uses is kept
//! in a slot until its last use. The traversal is a loop over explicit tasks: a chain of ten thousand
//! unions is no deeper than one of ten.

use crate::graph::{Graph, GraphChainStep, GraphNode, GraphNumber, NodeId};
use sdfc_vm::blend::Blend;
use sdfc_vm::pool::{PoolBuilder, PoolNumber};
use sdfc_vm::program::{Destination, Instruction, Opcode, Operands, PointTransform, Program};
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// Builds the program of a graph, with zeros in place of uniform numbers ([`Program::patch`] sets
/// them). It is not verified yet: the verifier checks all limits.
pub fn schedule(graph: &Graph) -> Program {
    let mut scheduler = Scheduler {
        graph,
        uses: graph.uses(),
        stack_needs: stack_needs(graph),
        has_materials: graph
            .nodes()
            .any(|(_, node)| matches!(node, GraphNode::Paint { .. })),
        code: Vec::new(),
        pool: PoolBuilder::default(),
        points: vec![World::NODE],
        slots: Slots::default(),
        tasks: vec![ScheduleTask::Visit(graph.root)],
        closed_end: 0,
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

/// Remaining work; the last task runs first.
#[derive(Clone, Copy, Debug)]
enum ScheduleTask {
    /// Put the value of a node on the stack.
    Visit(NodeId),
    /// Run a node whose operands are on the stack.
    Emit(NodeId),
    /// Blend: both operands are on the stack, the second by the instruction before.
    Blend(NodeId),
    /// Make a point the current one, or one below it on the stack.
    EnsurePoint(NodeId),
    /// Compute a point whose operands are on the stack.
    EmitPoint(NodeId),
    /// Take the value on top as a channel of the next material.
    Channel(u8),
    /// Keep the value on top if it has further uses.
    Store(NodeId),
    /// Run the guard that is this step of a chain; the chain's value so far is on top.
    Guard(NodeId, usize),
    /// End the block of a guard.
    EndGuard {
        /// Index of the guard's instruction.
        instruction: usize,
        /// Number of points at the start of the block.
        points: usize,
    },
}

/// Slots, allocated lowest first.
#[derive(Default)]
struct Slots {
    /// Slot of a value, and its remaining number of uses.
    occupied: HashMap<NodeId, (u8, u32)>,
    free: Vec<u8>,
    count: u32,
}

/// Number of stack entries from which on an operand comes first in a program of surfaces, too.
const MIN_DEEP_STACK: u32 = 32;

struct Scheduler<'a> {
    graph: &'a Graph,
    uses: Vec<u32>,
    stack_needs: Vec<u32>,
    /// Set if values carry materials: at equal values the first operand's material counts.
    has_materials: bool,
    code: Vec<Instruction>,
    pool: PoolBuilder,
    /// Points on the machine's stack, the current one last.
    points: Vec<NodeId>,
    slots: Slots,
    tasks: Vec<ScheduleTask>,
    /// Instructions before this one are in blocks that have ended; later operations are not fused into
    /// them.
    closed_end: usize,
}

/// Returns the number of stack entries that each value requires during its computation.
fn stack_needs(graph: &Graph) -> Vec<u32> {
    let mut needs: Vec<u32> = Vec::with_capacity(graph.len());
    for (_, node) in graph.nodes() {
        let operand_need = |id: &NodeId| needs[id.0 as usize];
        let need = match node {
            GraphNode::Apply { op, values, .. } => match values.as_slice() {
                [a, b] if op.row().is_commutative() => {
                    let (a, b) = (operand_need(a), operand_need(b));
                    if a == b { a + 1 } else { a.max(b) }
                }
                values => {
                    let operand_needs = values
                        .iter()
                        .enumerate()
                        .map(|(i, v)| operand_need(v) + i as u32);
                    operand_needs.max().unwrap_or(1)
                }
            },
            GraphNode::Chain { first, steps, .. } => {
                let operand_needs = steps.iter().map(|step| match step {
                    GraphChainStep::Blend(value) => operand_need(value) + 1,
                    GraphChainStep::Guard(_) => 0,
                });
                operand_needs.max().unwrap_or(0).max(operand_need(first))
            }
            GraphNode::Paint {
                value, channels, ..
            } => {
                let operand_needs = channels.iter().map(|(_, id)| operand_need(id) + 1);
                operand_needs.max().unwrap_or(0).max(operand_need(value))
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
                ScheduleTask::Visit(id) => self.visit(id),
                ScheduleTask::Emit(id) => self.emit(id),
                ScheduleTask::Blend(id) => self.blend(id),
                ScheduleTask::EnsurePoint(id) => self.ensure_point(id),
                ScheduleTask::EmitPoint(id) => self.emit_point(id),
                ScheduleTask::Channel(channel) => {
                    let slot = channel;
                    self.code.push(Instruction {
                        slot,
                        ..Instruction::new(Opcode::Channel)
                    });
                }
                ScheduleTask::Store(id) => self.store(id),
                ScheduleTask::Guard(id, step) => self.guard(id, step),
                ScheduleTask::EndGuard {
                    instruction,
                    points,
                } => self.end_guard(instruction, points),
            }
        }
    }

    fn node(&self, id: NodeId) -> &GraphNode {
        self.graph.get(id)
    }

    fn constant(&self, id: NodeId) -> Option<GraphNumber> {
        match self.node(id) {
            GraphNode::Constant(number) => Some(*number),
            _ => None,
        }
    }

    /// Reports whether recomputing a value costs no more than reading a slot.
    fn is_cheap(&self, id: NodeId) -> bool {
        matches!(
            self.node(id),
            GraphNode::Constant(_)
                | GraphNode::Apply {
                    op: Op::X | Op::Y | Op::Z,
                    ..
                }
        )
    }

    fn visit(&mut self, id: NodeId) {
        if let Some((slot, remaining_uses)) = self.slots.occupied.get_mut(&id) {
            let slot = *slot;
            *remaining_uses -= 1;
            if *remaining_uses == 0 {
                self.slots.occupied.remove(&id);
                self.slots.free.push(slot);
                self.slots.free.sort_unstable_by(|a, b| b.cmp(a));
            }
            self.code.push(Instruction {
                slot,
                ..Instruction::new(Opcode::Load)
            });
            return;
        }
        if self.uses[id.0 as usize] > 1 && !self.is_cheap(id) {
            self.tasks.push(ScheduleTask::Store(id));
        }
        match self.node(id) {
            GraphNode::Apply { op, values, .. } => {
                let (op, mut values) = (*op, values.clone());
                if let [a, b] = values[..] {
                    let need = self.stack_needs[b.0 as usize];
                    let heavier = need > self.stack_needs[a.0 as usize];
                    if op.row().is_commutative()
                        && heavier
                        && (!self.has_materials || need > MIN_DEEP_STACK)
                    {
                        values.swap(0, 1);
                    }
                }
                let blend = op.row().facts.blend.is_some();
                self.tasks.push(if blend {
                    ScheduleTask::Blend(id)
                } else {
                    ScheduleTask::Emit(id)
                });
                let may_fold = !blend && values.len() == 2;
                let folded_operand = values
                    .iter()
                    .position(|&v| may_fold && self.constant(v).is_some());
                for (i, &value) in values.iter().enumerate().rev() {
                    if folded_operand != Some(i) {
                        self.tasks.push(ScheduleTask::Visit(value));
                    }
                }
            }
            GraphNode::Paint {
                value, channels, ..
            } => {
                let (value, channels) = (*value, channels.clone());
                self.tasks.push(ScheduleTask::Emit(id));
                for (channel, node) in channels.into_iter().rev() {
                    self.tasks.push(ScheduleTask::Channel(channel));
                    self.tasks.push(ScheduleTask::Visit(node));
                }
                self.tasks.push(ScheduleTask::Visit(value));
            }
            GraphNode::Chain { .. } => self.chain_tasks(id),
            GraphNode::Constant(_) | GraphNode::Normal { .. } => {
                self.tasks.push(ScheduleTask::Emit(id))
            }
            GraphNode::World | GraphNode::Moved { .. } | GraphNode::Mapped { .. } => {
                unreachable!("a point is not a value")
            }
        }
    }

    /// Returns the transform of a point and its base point.
    fn transform_and_base(&mut self, point: NodeId) -> (PointTransform, NodeId) {
        match self.graph.get(point) {
            GraphNode::Moved { point, by } => {
                let index = self.add_numbers(by);
                (PointTransform::Translate(index), *point)
            }
            GraphNode::Mapped { point, rows } => {
                let index = self.add_numbers(rows);
                (PointTransform::Affine(index), *point)
            }
            _ => (PointTransform::Identity, point),
        }
    }

    fn add_numbers(&mut self, numbers: &[GraphNumber]) -> u32 {
        let numbers: Vec<PoolNumber> = numbers
            .iter()
            .map(|number| match *number {
                GraphNumber::Constant(value) => PoolNumber {
                    value,
                    output: None,
                },
                GraphNumber::Uniform(output) => PoolNumber {
                    value: 0.0,
                    output: Some(output),
                },
            })
            .collect();
        self.pool.add(&numbers)
    }

    /// Adds an operation's parameters to the pool, in the layout of its row.
    fn add_parameters(&mut self, op: Op, parameters: &[GraphNumber]) -> u32 {
        if parameters.is_empty() {
            return 0;
        }
        let row = op.row();
        let mut layout = vec![GraphNumber::Constant(0.0); row.parameter_width()];
        let mut next = parameters.iter();
        for (parameter, offset) in row.parameters.iter().zip(row.offsets()) {
            for slot in &mut layout[offset..offset + parameter.ty.width()] {
                *slot = *next.next().expect("a node has all its row's parameters");
            }
        }
        self.add_numbers(&layout)
    }

    /// Goes back to `base`, which then is the current point, and returns the number of points popped.
    /// `None` if it is not on the stack.
    fn pop_points_to(&mut self, base: NodeId) -> Option<u8> {
        let index = self.points.iter().rposition(|&p| p == base)?;
        let pops = self.points.len() - 1 - index;
        self.points.truncate(index + 1);
        Some(pops as u8)
    }

    fn emit(&mut self, id: NodeId) {
        let point = match self.node(id) {
            GraphNode::Apply { point, .. } => *point,
            GraphNode::Normal { point, .. } => Some(*point),
            _ => None,
        };
        let mut instruction = Instruction::new(Opcode::Top);
        if let Some(point) = point {
            let (transform, base) = self.transform_and_base(point);
            match self.pop_points_to(base) {
                Some(pops) => instruction.pops = pops,
                None => {
                    self.tasks.push(ScheduleTask::Emit(id));
                    self.tasks.push(ScheduleTask::EnsurePoint(base));
                    return;
                }
            }
            instruction.transform = transform;
        }
        match self.graph.get(id) {
            GraphNode::Constant(number) => {
                instruction.code = Opcode::Op(Op::Constant);
                instruction.parameters = self.add_numbers(&[*number]);
            }
            GraphNode::Normal { axis, .. } => {
                instruction.code = Opcode::Normal;
                instruction.slot = *axis;
            }
            GraphNode::Paint {
                constants,
                channels,
                ..
            } => {
                instruction.code = Opcode::Paint;
                instruction.parameters = self.add_numbers(constants);
                let bits = channels.iter().filter(|(c, _)| *c < 8).map(|(c, _)| 1 << c);
                instruction.slot = bits.fold(0, |mask, bit: u8| mask | bit);
            }
            GraphNode::Apply {
                op,
                values,
                parameters,
                ..
            } => {
                instruction.code = Opcode::Op(*op);
                instruction.parameters = self.add_parameters(*op, parameters);
                if let [a, b] = values[..] {
                    instruction.operands = match (self.constant(a), self.constant(b)) {
                        (Some(number), _) => Operands::Left(self.add_numbers(&[number])),
                        (_, Some(number)) => Operands::Right(self.add_numbers(&[number])),
                        _ => Operands::Stack,
                    };
                }
            }
            GraphNode::Chain { .. } => unreachable!("its steps are emitted one by one"),
            GraphNode::World | GraphNode::Moved { .. } | GraphNode::Mapped { .. } => {
                unreachable!("a point is not a value")
            }
        }
        self.code.push(instruction);
    }

    /// Adds the tasks of a chain: its first value, then its steps. A guard adds the tasks of its own
    /// steps.
    fn chain_tasks(&mut self, id: NodeId) {
        let GraphNode::Chain { first, steps, .. } = self.node(id) else {
            unreachable!("only chains are visited so")
        };
        let (first, count) = (*first, steps.len());
        self.step_tasks(id, 0, count);
        self.tasks.push(ScheduleTask::Visit(first));
    }

    /// Adds the tasks of a range of a chain's steps.
    fn step_tasks(&mut self, id: NodeId, start: usize, end: usize) {
        let graph = self.graph;
        let GraphNode::Chain { steps, .. } = graph.get(id) else {
            unreachable!("only chains have steps")
        };
        let mut tasks = Vec::new();
        let mut index = start;
        while index < end {
            match &steps[index] {
                GraphChainStep::Blend(value) => {
                    tasks.extend([ScheduleTask::Visit(*value), ScheduleTask::Blend(id)]);
                    index += 1;
                }
                GraphChainStep::Guard(guard) => {
                    tasks.push(ScheduleTask::Guard(id, index));
                    index += 1 + guard.steps as usize;
                }
            }
        }
        self.tasks.extend(tasks.into_iter().rev());
    }

    fn guard(&mut self, id: NodeId, step_index: usize) {
        let graph = self.graph;
        let GraphNode::Chain { steps, .. } = graph.get(id) else {
            unreachable!("only chains have guards")
        };
        let GraphChainStep::Guard(guard) = &steps[step_index] else {
            unreachable!("the step is a guard")
        };
        let (transform, base) = self.transform_and_base(guard.point);
        let Some(pops) = self.pop_points_to(base) else {
            self.tasks.push(ScheduleTask::Guard(id, step_index));
            self.tasks.push(ScheduleTask::EnsurePoint(base));
            return;
        };
        let instruction = Instruction {
            pops,
            transform,
            parameters: self.add_numbers(&guard.numbers),
            ..Instruction::new(Opcode::Guard)
        };
        self.tasks.push(ScheduleTask::EndGuard {
            instruction: self.code.len(),
            points: self.points.len(),
        });
        self.code.push(instruction);
        self.step_tasks(id, step_index + 1, step_index + 1 + guard.steps as usize);
    }

    /// Goes back to the guard's point, if the block has moved on to others, and sets the block's
    /// length.
    fn end_guard(&mut self, instruction: usize, points: usize) {
        let pops = self.points.len() - points;
        if pops > 0 {
            self.points.truncate(points);
            self.code.push(Instruction {
                pops: pops as u8,
                ..Instruction::new(Opcode::Top)
            });
        }
        self.closed_end = self.code.len();
        self.code[instruction].skips = (self.closed_end - instruction - 1) as u32;
    }

    fn blend(&mut self, id: NodeId) {
        let (GraphNode::Apply { op, parameters, .. } | GraphNode::Chain { op, parameters, .. }) =
            self.graph.get(id)
        else {
            unreachable!("only applications and chains blend")
        };
        let Some(Blend {
            kernel,
            sign,
            negate_second,
        }) = op.row().facts.blend
        else {
            unreachable!("only blends are visited so")
        };
        let zero = GraphNumber::Constant(0.0);
        let index = self.add_numbers(&[
            GraphNumber::Constant(sign),
            GraphNumber::Constant(if negate_second { -1.0 } else { 1.0 }),
            parameters.first().copied().unwrap_or(zero),
            parameters.get(1).copied().unwrap_or(zero),
        ]);
        let destination = Destination::Blend { kernel, index };
        let is_open = self.code.len() > self.closed_end;
        match self.code.last_mut() {
            Some(last)
                if is_open
                    && last.destination == Destination::Push
                    && last.operands == Operands::Stack
                    && !last.has_no_value() =>
            {
                last.destination = destination;
            }
            _ => self.code.push(Instruction {
                destination,
                ..Instruction::new(Opcode::Top)
            }),
        }
    }

    fn store(&mut self, id: NodeId) {
        let slot = self.slots.free.pop().unwrap_or_else(|| {
            self.slots.count += 1;
            // A program with more slots is refused by the verifier, which counts the declared ones.
            (self.slots.count - 1).min(255) as u8
        });
        let remaining_uses = self.uses[id.0 as usize] - 1;
        self.slots.occupied.insert(id, (slot, remaining_uses));
        self.code.push(Instruction {
            slot,
            ..Instruction::new(Opcode::Store)
        });
    }

    fn ensure_point(&mut self, point: NodeId) {
        if self.points.contains(&point) {
            return;
        }
        let GraphNode::Apply {
            point: inner_point,
            values,
            ..
        } = self.graph.get(point)
        else {
            unreachable!("the world is always below; transforms are part of instructions")
        };
        self.tasks.push(ScheduleTask::EmitPoint(point));
        if let Some(inner_point) = inner_point {
            let (_, base) = match self.graph.get(*inner_point) {
                GraphNode::Moved { point, .. } | GraphNode::Mapped { point, .. } => ((), *point),
                _ => ((), *inner_point),
            };
            self.tasks.push(ScheduleTask::EnsurePoint(base));
        }
        for &value in values.iter().rev() {
            self.tasks.push(ScheduleTask::Visit(value));
        }
    }

    fn emit_point(&mut self, id: NodeId) {
        let GraphNode::Apply {
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
            ..Instruction::new(Opcode::Op(*op))
        };
        if let Some(point) = point {
            let (transform, base) = self.transform_and_base(*point);
            match self.pop_points_to(base) {
                Some(pops) => instruction.pops = pops,
                None => {
                    self.tasks.push(ScheduleTask::EmitPoint(id));
                    self.tasks.push(ScheduleTask::EnsurePoint(base));
                    return;
                }
            }
            instruction.transform = transform;
        }
        instruction.parameters = self.add_parameters(*op, parameters);
        self.points.push(id);
        self.code.push(instruction);
    }
}
