//! Program → graph: a module from bytecode, back in the form that code is generated from.
//!
//! A program jumps only where that does not change the value, so running all of it once on nodes
//! instead of numbers yields its graph. Instructions behind a guard become steps of a chain. If they
//! are more than blends of one kind, which the compiler never writes, the guard is left out.

use crate::compile::Compiled;
use crate::graph::{Graph, GraphChainStep, GraphNode, GraphNumber, Guard, NodeId};
use sdfc_vm::blend::{Blend, BlendKernel};
use sdfc_vm::program::{
    Destination, Instruction, Module, Opcode, Operands, PointTransform, Program,
};
use sdfc_vm::table::{Op, ROWS, Row};
use std::collections::HashMap;

/// Rebuilds the compiled scene of a verified module, as far as the module contains it.
pub fn raise(module: Module) -> Compiled {
    let graph = raise_program(&module.distance);
    let surface = module.surface.as_ref().map(raise_program);
    Compiled {
        optimized: graph.clone(),
        graph,
        surface,
        module,
        passes: Vec::new(),
        bounds_context: None,
    }
}

fn raise_program(program: &Program) -> Graph {
    let mut graph = Graph::default();
    let world = graph.add(GraphNode::World);
    let mut raiser = Raiser {
        program,
        outputs: program
            .patches
            .iter()
            .map(|patch| (patch.index, patch.output))
            .collect(),
        graph,
        stack: Vec::new(),
        points: Vec::new(),
        current: world,
        slots: vec![world; program.slots as usize],
        channels: Vec::new(),
        blocks: Vec::new(),
    };
    for (index, instruction) in program.code.iter().enumerate() {
        raiser.end_blocks(index);
        raiser.step(index, instruction);
    }
    raiser.end_blocks(program.code.len());
    let root = raiser.pop();
    raiser.graph.root = root;
    raiser.graph
}

struct Raiser<'a> {
    program: &'a Program,
    outputs: HashMap<u32, u32>,
    graph: Graph,
    stack: Vec<NodeId>,
    points: Vec<NodeId>,
    current: NodeId,
    slots: Vec<NodeId>,
    channels: Vec<(u8, NodeId)>,
    /// Guards whose blocks have not ended, each nested in the one before.
    blocks: Vec<RaisedBlock>,
}

/// Instructions behind a guard, as far as they were read.
struct RaisedBlock {
    /// Index of the instruction after its end.
    end: usize,
    guard: Guard,
    /// Value on top before the guard, and the stack's depth including it.
    first: NodeId,
    depth: usize,
    /// Operation and parameters, once there was a blend.
    kind: Option<(Op, Vec<GraphNumber>)>,
    /// Steps blended into the value on top; `None` once it was used otherwise.
    steps: Option<Vec<GraphChainStep>>,
}

impl RaisedBlock {
    /// Records a blend into the value on top of a stack of `depth` values.
    fn blend(&mut self, depth: usize, kind: &(Op, Vec<GraphNumber>), step: GraphChainStep) {
        if depth > self.depth {
            return;
        }
        if self.kind.get_or_insert_with(|| kind.clone()) != kind {
            self.steps = None;
        }
        if let Some(steps) = &mut self.steps {
            steps.push(step);
        }
    }
}

impl Raiser<'_> {
    /// Removes the node on top of the stack. A verified program never pops more than it pushed.
    fn pop(&mut self) -> NodeId {
        self.stack.pop().unwrap_or_default()
    }

    fn number(&self, index: usize) -> GraphNumber {
        match self.outputs.get(&(index as u32)) {
            Some(&output) => GraphNumber::Uniform(output),
            None => GraphNumber::Constant(self.program.pool.as_flattened()[index]),
        }
    }

    fn constant(&mut self, index: u32) -> NodeId {
        let number = self.number(index as usize * 4);
        self.graph.add(GraphNode::Constant(number))
    }

    fn point(&mut self, i: &Instruction) -> NodeId {
        let constant_index = |index: u32, offset: usize| index as usize * 4 + offset;
        match i.transform {
            PointTransform::Identity => self.current,
            PointTransform::Translate(index) => {
                let by = std::array::from_fn(|k| self.number(constant_index(index, k)));
                self.graph.add(GraphNode::Moved {
                    point: self.current,
                    by,
                })
            }
            PointTransform::Affine(index) => {
                let rows = std::array::from_fn(|k| self.number(constant_index(index, k)));
                self.graph.add(GraphNode::Mapped {
                    point: self.current,
                    rows,
                })
            }
        }
    }

    /// Ends the blocks that end before an instruction.
    fn end_blocks(&mut self, index: usize) {
        while let Some(block) = self.blocks.pop_if(|block| block.end == index) {
            let (Some((op, parameters)), Some(mut steps)) = (block.kind, block.steps) else {
                if let Some(outer) = self.blocks.last_mut()
                    && outer.depth == block.depth
                {
                    outer.steps = None;
                }
                continue;
            };
            let guard = GraphChainStep::Guard(Guard {
                steps: steps.len() as u32,
                ..block.guard
            });
            steps.insert(0, guard);
            // Inside a block that blends into the same value, the guard is one of its steps.
            if let Some(outer) = self.blocks.last_mut()
                && outer.depth == block.depth
            {
                let kind = (op, parameters);
                for step in steps {
                    outer.blend(block.depth, &kind, step);
                }
                continue;
            }
            let chain = self.graph.add(GraphNode::Chain {
                op,
                parameters,
                first: block.first,
                steps,
            });
            if let Some(top) = self.stack.last_mut() {
                *top = chain;
            }
        }
    }

    /// Begins the block of a guard.
    fn begin_block(&mut self, index: usize, i: &Instruction) {
        let start = i.parameters as usize * 4;
        let guard = Guard {
            point: self.point(i),
            numbers: std::array::from_fn(|k| self.number(start + k)),
            steps: 0,
        };
        self.blocks.push(RaisedBlock {
            end: index + 1 + i.skips as usize,
            guard,
            first: self.stack.last().copied().unwrap_or_default(),
            depth: self.stack.len(),
            kind: None,
            steps: Some(Vec::new()),
        });
    }

    fn step(&mut self, instruction_index: usize, i: &Instruction) {
        for _ in 0..i.pops {
            self.current = self.points.pop().unwrap_or(self.current);
        }
        if i.push {
            self.points.push(self.current);
        }
        let remaining = self.stack.len() - i.pop_count().min(self.stack.len());
        // An instruction that pops the value on top without blending into it is no step of a chain. A
        // value that is popped and pushed again is unchanged.
        if let Some(block) = self.blocks.last_mut()
            && remaining < block.depth
            && !(i.code == Opcode::Top && i.destination == Destination::Push)
        {
            block.steps = None;
        }
        let result = match i.code {
            Opcode::Op(op) => {
                let point = op.row().reads_point().then(|| self.point(i));
                let values = self.operands(i);
                let parameters = self.parameters(op.row(), i);
                let node = if op == Op::Constant {
                    GraphNode::Constant(parameters[0])
                } else {
                    GraphNode::Apply {
                        op,
                        point,
                        values,
                        parameters,
                    }
                };
                let id = self.graph.add(node);
                if i.code.returns_point() {
                    self.current = id;
                    return;
                }
                id
            }
            Opcode::Load => self.slots[usize::from(i.slot)],
            Opcode::Store => {
                let top = self.pop();
                self.slots[usize::from(i.slot)] = top;
                top
            }
            Opcode::Top => self.pop(),
            Opcode::Normal => {
                let point = self.point(i);
                self.graph.add(GraphNode::Normal {
                    point,
                    axis: i.slot,
                })
            }
            Opcode::Channel => {
                let value = self.pop();
                self.channels.push((i.slot, value));
                return;
            }
            Opcode::Guard => {
                self.begin_block(instruction_index, i);
                return;
            }
            Opcode::Paint => {
                let value = self.pop();
                let start = i.parameters as usize * 4;
                let constants = std::array::from_fn(|k| self.number(start + k));
                let channels = std::mem::take(&mut self.channels);
                self.graph.add(GraphNode::Paint {
                    value,
                    constants,
                    channels,
                })
            }
        };
        let result = match i.destination {
            Destination::Push => result,
            Destination::Blend { kernel, index } => {
                let below = self.pop();
                self.blend(kernel, index, below, result)
            }
        };
        self.stack.push(result);
    }

    fn operands(&mut self, i: &Instruction) -> Vec<NodeId> {
        match i.operands {
            Operands::Stack => {
                let mut values: Vec<NodeId> = (0..i.code.arity()).map(|_| self.pop()).collect();
                values.reverse();
                values
            }
            Operands::Right(index) => {
                let first = self.pop();
                vec![first, self.constant(index)]
            }
            Operands::Left(index) => {
                let second = self.pop();
                vec![self.constant(index), second]
            }
        }
    }

    fn parameters(&self, row: &Row, i: &Instruction) -> Vec<GraphNumber> {
        let start = i.parameters as usize * 4;
        row.parameters
            .iter()
            .zip(row.offsets())
            .flat_map(|(parameter, offset)| offset..offset + parameter.ty.width())
            .map(|offset| self.number(start + offset))
            .collect()
    }

    /// Adds the operation whose blend has this kernel and these signs.
    fn blend(&mut self, kernel: BlendKernel, index: u32, a: NodeId, b: NodeId) -> NodeId {
        // Both operands were popped.
        let depth = self.stack.len() + 1;
        let constants = self.program.pool[index as usize];
        let wanted_blend = Blend {
            kernel,
            sign: constants[0],
            negate_second: constants[1].is_sign_negative(),
        };
        let row = ROWS
            .iter()
            .find(|row| row.facts.blend == Some(wanted_blend))
            .unwrap_or(&ROWS[0]);
        let start = index as usize * 4;
        let parameters: Vec<GraphNumber> = (0..row.parameters.len())
            .map(|k| self.number(start + 2 + k))
            .collect();
        let kind = (row.op, parameters);
        if let Some(block) = self.blocks.last_mut() {
            block.blend(depth, &kind, GraphChainStep::Blend(b));
        }
        let (op, parameters) = kind;
        self.graph.add(GraphNode::Apply {
            op,
            point: None,
            values: vec![a, b],
            parameters,
        })
    }
}
