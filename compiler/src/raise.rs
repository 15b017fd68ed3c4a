//! Program → graph: a module read from bytecode, back in the form that generated code comes from.
//!
//! A program jumps only where that changes nothing, so running all of it once on nodes instead of
//! numbers gives its graph. What lies behind a guard becomes steps of a chain; where it is more than
//! blends of one kind, which the compiler never writes, the guard is left out.

use crate::compile::Compiled;
use crate::graph::{Graph, Guard, Node, NodeId, Number, Step};
use sdfc_vm::kernel::{Blend, Kernel};
use sdfc_vm::program::{Code, Frame, Instruction, Module, Operands, Place, Program};
use sdfc_vm::row::Row;
use sdfc_vm::table::{Op, ROWS};
use std::collections::HashMap;

/// The compiled scene that a verified module came from, as far as the module tells.
pub fn raise(module: Module) -> Compiled {
    let graph = graph_of(&module.distance);
    let surface = module.surface.as_ref().map(graph_of);
    Compiled {
        optimized: graph.clone(),
        graph,
        surface,
        module,
        passes: Vec::new(),
        known: None,
    }
}

fn graph_of(program: &Program) -> Graph {
    let mut graph = Graph::default();
    let world = graph.add(Node::World);
    let mut raising = Raising {
        program,
        outputs: program
            .patches
            .iter()
            .map(|patch| (patch.at, patch.output))
            .collect(),
        graph,
        stack: Vec::new(),
        points: Vec::new(),
        current: world,
        slots: vec![world; program.slots as usize],
        channels: Vec::new(),
        blocks: Vec::new(),
    };
    for (at, instruction) in program.code.iter().enumerate() {
        raising.close(at);
        raising.step(at, instruction);
    }
    raising.close(program.code.len());
    let root = raising.pop();
    raising.graph.root = root;
    raising.graph
}

struct Raising<'a> {
    program: &'a Program,
    outputs: HashMap<u32, u32>,
    graph: Graph,
    stack: Vec<NodeId>,
    points: Vec<NodeId>,
    current: NodeId,
    slots: Vec<NodeId>,
    channels: Vec<(u8, NodeId)>,
    /// The guards whose blocks have not ended, each within the one before.
    blocks: Vec<Block>,
}

/// What lies behind a guard, as far as it was read.
struct Block {
    /// Where it ends.
    end: usize,
    guard: Guard,
    /// The value on top in front of the guard, and how many lie on the stack with it.
    first: NodeId,
    depth: usize,
    /// The operation and its parameters, once there was a blend.
    kind: Option<(Op, Vec<Number>)>,
    /// What was blended into the value on top; nothing once something else was done with it.
    steps: Option<Vec<Step>>,
}

impl Block {
    /// Something is blended into the value on top of a stack of so many values.
    fn blend(&mut self, depth: usize, kind: &(Op, Vec<Number>), step: Step) {
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

impl Raising<'_> {
    /// A verified program never pops more than it pushed.
    fn pop(&mut self) -> NodeId {
        self.stack.pop().unwrap_or_default()
    }

    fn number(&self, at: usize) -> Number {
        match self.outputs.get(&(at as u32)) {
            Some(&output) => Number::Uniform(output),
            None => Number::Constant(self.program.pool.as_flattened()[at]),
        }
    }

    fn constant(&mut self, index: u32) -> NodeId {
        let number = self.number(index as usize * 4);
        self.graph.add(Node::Constant(number))
    }

    fn point(&mut self, i: &Instruction) -> NodeId {
        let at = |index: u32, offset: usize| index as usize * 4 + offset;
        match i.frame {
            Frame::Same => self.current,
            Frame::Moved(index) => {
                let by = std::array::from_fn(|k| self.number(at(index, k)));
                self.graph.add(Node::Moved {
                    point: self.current,
                    by,
                })
            }
            Frame::Mapped(index) => {
                let rows = std::array::from_fn(|k| self.number(at(index, k)));
                self.graph.add(Node::Mapped {
                    point: self.current,
                    rows,
                })
            }
        }
    }

    /// Ends the blocks that end in front of an instruction.
    fn close(&mut self, at: usize) {
        while let Some(block) = self.blocks.pop_if(|block| block.end == at) {
            let (Some((op, parameters)), Some(mut steps)) = (block.kind, block.steps) else {
                if let Some(outer) = self.blocks.last_mut()
                    && outer.depth == block.depth
                {
                    outer.steps = None;
                }
                continue;
            };
            let guard = Step::Guard(Guard {
                steps: steps.len() as u32,
                ..block.guard
            });
            steps.insert(0, guard);
            // Within a block that blends into the same value, the guard is one of its steps.
            if let Some(outer) = self.blocks.last_mut()
                && outer.depth == block.depth
            {
                let kind = (op, parameters);
                for step in steps {
                    outer.blend(block.depth, &kind, step);
                }
                continue;
            }
            let chain = self.graph.add(Node::Chain {
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

    /// What a guard is, in front of its block.
    fn guard(&mut self, at: usize, i: &Instruction) {
        let start = i.parameters as usize * 4;
        let guard = Guard {
            point: self.point(i),
            volume: std::array::from_fn(|k| self.number(start + k)),
            steps: 0,
        };
        self.blocks.push(Block {
            end: at + 1 + i.skips as usize,
            guard,
            first: self.stack.last().copied().unwrap_or_default(),
            depth: self.stack.len(),
            kind: None,
            steps: Some(Vec::new()),
        });
    }

    fn step(&mut self, at: usize, i: &Instruction) {
        for _ in 0..i.pops {
            self.current = self.points.pop().unwrap_or(self.current);
        }
        if i.push {
            self.points.push(self.current);
        }
        let before = self.stack.len() - i.taken().min(self.stack.len());
        // What takes the value on top, instead of blending into it, is no step of a chain. A value
        // that is taken to be put back is as it was.
        if let Some(block) = self.blocks.last_mut()
            && before < block.depth
            && !(i.code == Code::Take && i.place == Place::Push)
        {
            block.steps = None;
        }
        let result = match i.code {
            Code::Op(op) => {
                let point = op.row().reads_point().then(|| self.point(i));
                let values = self.operands(i);
                let parameters = self.parameters(op.row(), i);
                let node = if op == Op::Constant {
                    Node::Constant(parameters[0])
                } else {
                    Node::Apply {
                        op,
                        point,
                        values,
                        parameters,
                    }
                };
                let id = self.graph.add(node);
                if i.code.gives_point() {
                    self.current = id;
                    return;
                }
                id
            }
            Code::Load => self.slots[usize::from(i.slot)],
            Code::Store => {
                let top = self.pop();
                self.slots[usize::from(i.slot)] = top;
                top
            }
            Code::Take => self.pop(),
            Code::Normal => {
                let point = self.point(i);
                self.graph.add(Node::Normal {
                    point,
                    axis: i.slot,
                })
            }
            Code::Channel => {
                let value = self.pop();
                self.channels.push((i.slot, value));
                return;
            }
            Code::Guard => {
                self.guard(at, i);
                return;
            }
            Code::Paint => {
                let value = self.pop();
                let start = i.parameters as usize * 4;
                let constants = std::array::from_fn(|k| self.number(start + k));
                let channels = std::mem::take(&mut self.channels);
                self.graph.add(Node::Paint {
                    value,
                    constants,
                    channels,
                })
            }
        };
        let result = match i.place {
            Place::Push => result,
            Place::Blend { kernel, index } => {
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

    fn parameters(&self, row: &Row, i: &Instruction) -> Vec<Number> {
        let start = i.parameters as usize * 4;
        row.parameters
            .iter()
            .zip(row.offsets())
            .flat_map(|(parameter, offset)| offset..offset + parameter.ty.width())
            .map(|offset| self.number(start + offset))
            .collect()
    }

    /// The row whose blend has this kernel and these signs.
    fn blend(&mut self, kernel: Kernel, index: u32, a: NodeId, b: NodeId) -> NodeId {
        // Both are off the stack.
        let depth = self.stack.len() + 1;
        let constants = self.program.pool[index as usize];
        let wanted = Blend {
            kernel,
            sign: constants[0],
            negate_second: constants[1].is_sign_negative(),
        };
        let row = ROWS
            .iter()
            .find(|row| row.meta.blend == Some(wanted))
            .unwrap_or(&ROWS[0]);
        let start = index as usize * 4;
        let parameters: Vec<Number> = (0..row.parameters.len())
            .map(|k| self.number(start + 2 + k))
            .collect();
        let kind = (row.op, parameters);
        if let Some(block) = self.blocks.last_mut() {
            block.blend(depth, &kind, Step::Blend(b));
        }
        let (op, parameters) = kind;
        self.graph.add(Node::Apply {
            op,
            point: None,
            values: vec![a, b],
            parameters,
        })
    }
}
