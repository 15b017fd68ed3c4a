//! Evaluation of a tape at 64 points at once, for pictures on the CPU.
//!
//! Every register is a block of 64 lanes, and every operation is a loop over them ([`crate::lanes`]). The
//! number type decides the result: duals give gradients, intervals give bounds. A hook adds materials
//! ([`crate::surface`]) or records the choices that pruning needs ([`super::trace`]).

use super::{Clause, ClauseKind, flags};
use crate::blend::BlendKernel;
use crate::lanes::{LaneNumber, OpInputs, SimdLevel, SimdOps};
use crate::program::{Destination, Opcode, Operands, PointTransform, Program};
use crate::table::Op;

/// An observer of the evaluation, for data that accompanies the values. It is called first with the source
/// of the result, then with the result's register. Each method does nothing by default.
pub trait EvalHook<L: LaneNumber> {
    /// Reserves memory for this many value registers.
    #[inline(always)]
    fn reserve(&mut self, _values: usize) {}
    /// Receives an operation at the point `_q`. `_values` are the first two operands and `_registers` are their
    /// registers, which are [`super::NO_REGISTER`] for constant or missing operands.
    #[inline(always)]
    fn operate(
        &mut self,
        _op: Op,
        _q: &L::PointBlock,
        _values: [&L::Block; 2],
        _registers: [u16; 2],
        _constants: &[f32],
    ) {
    }
    /// Receives the register of which the result is a copy.
    #[inline(always)]
    fn copy(&mut self, _from: u16) {}
    /// Computes a component of the normal in the local frame of the point `_q`.
    #[inline(always)]
    fn normal(&mut self, _q: &L::PointBlock, _axis: u8, _result: &mut L::Block) {}
    /// Receives a value that becomes a channel of the next material.
    #[inline(always)]
    fn channel(&mut self, _channel: u8, _value: &L::Block) {}
    /// Receives the register of which the result is a copy with a new material.
    #[inline(always)]
    fn paint(&mut self, _from: u16, _constants: &[[f32; 4]], _mask: u8) {}
    /// Receives the two operands `_values` of a blend, before it changes the register `_accumulator`.
    #[inline(always)]
    fn blend(
        &mut self,
        _kernel: BlendKernel,
        _constants: [f32; 4],
        _values: [&L::Block; 2],
        _accumulator: u16,
    ) {
    }
    /// Receives every clause with [`flags::CHOICE`], with the index of its `_instruction` and its two operands.
    #[inline(always)]
    fn choose(
        &mut self,
        _instruction: u32,
        _kernel: BlendKernel,
        _constants: [f32; 4],
        _values: [&L::Block; 2],
    ) {
    }
    /// Receives the register in which the result is stored.
    #[inline(always)]
    fn set(&mut self, _out: u16) {}
}

/// A hook without effect: distances and gradients only.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoHook;

impl<L: LaneNumber> EvalHook<L> for NoHook {}

/// A tape evaluator. It owns the registers and can run any number of tapes.
pub struct TapeEvaluator<L: LaneNumber, A: EvalHook<L> = NoHook> {
    values: Vec<Box<L::Block>>,
    points: Vec<Box<L::PointBlock>>,
    result: Box<L::Block>,
    constant: Box<L::Block>,
    transformed: Box<L::PointBlock>,
    point_result: Box<L::PointBlock>,
    hook: A,
    simd_ops: SimdOps<L>,
}

impl<L: LaneNumber, A: EvalHook<L> + Default> Default for TapeEvaluator<L, A> {
    fn default() -> Self {
        Self {
            values: Vec::new(),
            points: Vec::new(),
            result: Box::default(),
            constant: Box::default(),
            transformed: Box::default(),
            point_result: Box::default(),
            hook: A::default(),
            simd_ops: L::simd_ops(SimdLevel::Avx512),
        }
    }
}

impl<L: LaneNumber, A: EvalHook<L> + Default> TapeEvaluator<L, A> {
    /// Creates an evaluator for tapes of at most this many registers.
    pub fn new(values: usize, points: usize) -> Self {
        let mut machine = Self::default();
        machine.reserve(values, points);
        machine
    }

    /// Limits the evaluator to this SIMD level; its results keep the same bits.
    pub fn with_max_simd(mut self, widest: SimdLevel) -> Self {
        self.simd_ops = L::simd_ops(widest);
        self
    }
}

impl<L: LaneNumber, A: EvalHook<L>> TapeEvaluator<L, A> {
    /// Reserves memory for tapes with these numbers of registers.
    pub fn reserve(&mut self, values: usize, points: usize) {
        if self.values.len() < values.max(1) {
            self.values.resize_with(values.max(1), Box::default);
            self.hook.reserve(values.max(1));
        }
        if self.points.len() < points.max(1) {
            self.points.resize_with(points.max(1), Box::default);
        }
    }

    /// Returns the hook.
    pub fn hook(&mut self) -> &mut A {
        &mut self.hook
    }

    /// Returns the input points of the next run.
    pub fn inputs_mut(&mut self) -> &mut L::PointBlock {
        &mut self.points[0]
    }

    /// Returns the result of the last run.
    pub fn result(&self) -> &L::Block {
        &self.values[0]
    }

    /// Evaluates a tape of a verified program, or a pruned one, on the first `count` lanes of the inputs.
    pub fn run(&mut self, program: &Program, tape: &[Clause], count: usize) -> &L::Block {
        let remaining = self.run_simple_prefix(program, tape, count);
        let m = self;
        for clause in remaining {
            let i = &program.code[clause.instruction as usize];
            let [a, b, c] = clause.operands;
            let value = |r: u16| usize::from(r);
            match clause.kind {
                ClauseKind::Full | ClauseKind::OpOnly | ClauseKind::NegatedOp => {
                    if clause.flags & flags::CHANNEL != 0 {
                        m.hook.channel(i.slot, &m.values[value(a)]);
                        continue;
                    }
                    let stay = &m.points[0];
                    let from = m.points.get(usize::from(clause.point)).unwrap_or(stay);
                    let q: &L::PointBlock = match i.transform {
                        PointTransform::Identity => from,
                        PointTransform::Translate(index) => {
                            let by = program.pool[index as usize];
                            (m.simd_ops.translate)(from, &by, &mut m.transformed, count);
                            &m.transformed
                        }
                        PointTransform::Affine(index) => {
                            let row = |row: u32| program.pool[(index + row) as usize];
                            let rows = [row(0), row(1), row(2)];
                            (m.simd_ops.apply_affine)(from, &rows, &mut m.transformed, count);
                            &m.transformed
                        }
                    };
                    // Nearly always an operation of the table: a test here, not a jump table.
                    if let Opcode::Op(op) = i.code {
                        if let Operands::Right(index) | Operands::Left(index) = i.operands {
                            let number = program.pool[index as usize][0];
                            (m.simd_ops.fill)(number, &mut m.constant, count);
                        }
                        let get = |r: u16| m.values.get(value(r)).unwrap_or(&m.constant);
                        let values = [&**get(a), &**get(b), &**get(c)];
                        let numbers = program.pool[i.parameters as usize..].as_flattened();
                        let reads = OpInputs {
                            point: q,
                            values,
                            constants: numbers,
                            count,
                        };
                        let operation = m.simd_ops.operations[op as usize];
                        operation(&reads, &mut m.result, &mut m.point_result);
                        if clause.flags & flags::RETURNS_POINT != 0 {
                            let out = &mut m.points[usize::from(clause.dst)];
                            std::mem::swap(out, &mut m.point_result);
                            continue;
                        }
                        let operands = [values[0], values[1]];
                        if clause.flags & flags::CHOICE != 0
                            && clause.accumulator == super::NO_REGISTER
                        {
                            m.hook.choose(
                                clause.instruction,
                                BlendKernel::Hard,
                                hard_blend_constants(op),
                                operands,
                            );
                        }
                        m.hook.operate(op, q, operands, [a, b], numbers);
                    } else if i.code == Opcode::Normal {
                        m.hook.normal(q, i.slot, &mut m.result);
                    } else {
                        debug_assert_eq!(
                            i.code,
                            Opcode::Paint,
                            "moves leave no clause of their own"
                        );
                        m.result.clone_from(&m.values[value(a)]);
                        let start = i.parameters as usize;
                        let numbers = &program.pool[start..start + 3];
                        m.hook.paint(a, numbers, i.slot);
                    }
                    if clause.kind == ClauseKind::NegatedOp {
                        m.negate_result(count);
                    }
                }
                ClauseKind::Blend | ClauseKind::Copy | ClauseKind::Negate => {
                    m.result.clone_from(&m.values[value(a)]);
                    m.hook.copy(a);
                    if clause.kind == ClauseKind::Negate {
                        m.negate_result(count);
                    }
                }
            }
            let (out, accumulator) = (value(clause.dst), value(clause.accumulator));
            match i.destination {
                Destination::Blend { kernel, index }
                    if clause.accumulator != super::NO_REGISTER =>
                {
                    let numbers = program.pool[index as usize];
                    let operands = [&*m.values[accumulator], &*m.result];
                    m.hook.choose(clause.instruction, kernel, numbers, operands);
                    m.hook.blend(kernel, numbers, operands, clause.accumulator);
                    if out != accumulator {
                        let (first, second) = m.values.split_at_mut(out.max(accumulator));
                        let (to, from) = if out < accumulator {
                            (&mut first[out], &second[0])
                        } else {
                            (&mut second[0], &first[accumulator])
                        };
                        to.clone_from(from);
                    }
                    (m.simd_ops.blend)(kernel, &mut m.values[out], &m.result, &numbers, count);
                }
                _ => std::mem::swap(&mut m.values[out], &mut m.result),
            }
            m.hook.set(clause.dst);
        }
        &m.values[0]
    }

    /// Evaluates the leading clauses that have [`flags::SIMPLE_OP`] and returns the others. Fields written
    /// with coordinates often have no others. Their operations take no longer than the tests for transforms
    /// and blends.
    fn run_simple_prefix<'a>(
        &mut self,
        program: &Program,
        tape: &'a [Clause],
        count: usize,
    ) -> &'a [Clause] {
        let m = self;
        let mut remaining = tape;
        while let [clause, others @ ..] = remaining {
            let i = &program.code[clause.instruction as usize];
            let (true, Opcode::Op(op)) = (clause.flags & flags::SIMPLE_OP != 0, i.code) else {
                break;
            };
            remaining = others;
            if let Operands::Right(index) | Operands::Left(index) = i.operands {
                (m.simd_ops.fill)(program.pool[index as usize][0], &mut m.constant, count);
            }
            let get = |r: u16| m.values.get(usize::from(r)).unwrap_or(&m.constant);
            let [a, b, c] = clause.operands;
            let values = [&**get(a), &**get(b), &**get(c)];
            let point = m.points.get(usize::from(clause.point));
            let point = &**point.unwrap_or(&m.points[0]);
            let numbers = program.pool[i.parameters as usize..].as_flattened();
            let reads = OpInputs {
                point,
                values,
                constants: numbers,
                count,
            };
            (m.simd_ops.operations[op as usize])(&reads, &mut m.result, &mut m.point_result);
            let operands = [values[0], values[1]];
            if clause.flags & flags::CHOICE != 0 {
                m.hook.choose(
                    clause.instruction,
                    BlendKernel::Hard,
                    hard_blend_constants(op),
                    operands,
                );
            }
            m.hook.operate(op, point, operands, [a, b], numbers);
            std::mem::swap(&mut m.values[usize::from(clause.dst)], &mut m.result);
            m.hook.set(clause.dst);
        }
        remaining
    }

    fn negate_result(&mut self, count: usize) {
        let reads = OpInputs {
            point: &*self.points[0],
            values: [&*self.result; 3],
            constants: &[],
            count,
        };
        let negate = self.simd_ops.operations[Op::Neg as usize];
        negate(&reads, &mut self.constant, &mut self.point_result);
        std::mem::swap(&mut self.result, &mut self.constant);
    }
}

/// Returns the blend constants of the hard minimum or maximum that an operation is.
pub(super) fn hard_blend_constants(op: Op) -> [f32; 4] {
    let (sign, negate) = match op.row().facts.blend {
        Some(blend) => (blend.sign, blend.negate_second),
        None if op == Op::Max => (-1.0, false),
        None => (1.0, false),
    };
    [sign, if negate { -1.0 } else { 1.0 }, 0.0, 0.0]
}
