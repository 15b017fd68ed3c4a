//! Pruning: the part of a tape that matters where some of its choices are decided.
//!
//! One backward liveness pass: a clause is kept if a later kept clause reads the register that it writes. A
//! decided choice makes its register another name of the chosen operand, so clauses that only the other
//! operand needs are dropped. The same pass renames the registers, so that a short tape uses few of them
//! and they stay in the cache. Only the output vector allocates memory.

use super::build::UNASSIGNED;
use super::{Clause, ClauseKind, NO_REGISTER, flags};

/// The decision about a choice in a region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// Undecided: either operand may matter.
    Both,
    /// Only the first operand matters: the accumulator, or operand 0.
    First,
    /// Only the second operand matters.
    Second,
}

/// Numbers of registers that a pruned tape uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RegisterCounts {
    /// Number of value registers.
    pub values: usize,
    /// Number of point registers.
    pub points: usize,
}

/// Live registers during the backward pass, and their new names.
#[derive(Default)]
struct RegisterMap {
    /// The new name of each old register.
    new: Vec<u16>,
    free: Vec<u16>,
    count: u16,
}

impl RegisterMap {
    /// Clears the map; register 0 keeps its name.
    fn reset(&mut self) {
        self.new.fill(NO_REGISTER);
        self.free.clear();
        self.new[0] = 0;
        self.count = 1;
    }
    /// Returns the new name of a register that is read, and assigns one if it has none.
    #[inline(always)]
    fn use_register(&mut self, old: usize) -> u16 {
        let name = self.new[old];
        if name != NO_REGISTER {
            return name;
        }
        let name = self.free.pop().unwrap_or_else(|| {
            self.count += 1;
            self.count - 1
        });
        self.new[old] = name;
        name
    }
    /// Returns the new name of a register that is written, and ends its life. The result is [`NO_REGISTER`]
    /// if no later clause reads it.
    #[inline(always)]
    fn define_register(&mut self, old: usize) -> u16 {
        std::mem::replace(&mut self.new[old], NO_REGISTER)
    }
}

/// A register number that may be absent.
pub trait RegisterIndex: Copy {
    /// Returns the register as an index, if there is one.
    fn index(self) -> Option<usize>;
}
impl RegisterIndex for u16 {
    #[inline(always)]
    fn index(self) -> Option<usize> {
        (self != NO_REGISTER).then_some(usize::from(self))
    }
}
impl RegisterIndex for u32 {
    #[inline(always)]
    fn index(self) -> Option<usize> {
        (self != UNASSIGNED).then_some(self as usize)
    }
}

/// Reusable memory for pruning.
#[derive(Default)]
pub struct Pruner {
    values: RegisterMap,
    points: RegisterMap,
}

impl Pruner {
    /// Reserves memory for tapes with these numbers of registers.
    pub fn reserve(&mut self, values: usize, points: usize) {
        if self.values.new.len() < values.max(1) {
            self.values.new.resize(values.max(1), NO_REGISTER);
        }
        if self.points.new.len() < points.max(1) {
            self.points.new.resize(points.max(1), NO_REGISTER);
        }
    }

    /// Appends the pruned clauses of `tape` to the output. `choice` is called with the index of each live
    /// clause that has [`flags::CHOICE`].
    #[inline]
    pub fn prune<R: RegisterIndex>(
        &mut self,
        tape: &[Clause<R>],
        mut choice: impl FnMut(usize) -> Choice,
        output: &mut Vec<Clause>,
    ) -> RegisterCounts {
        let start = output.len();
        self.values.reset();
        self.points.reset();
        // Set while the clauses that set channels belong to a live material assignment.
        let mut painting = false;
        for (index, clause) in tape.iter().enumerate().rev() {
            const RARE: u8 = flags::RETURNS_POINT | flags::CHANNEL | flags::PAINT;
            let dst = if clause.flags & RARE == 0 {
                match clause.dst.index() {
                    Some(old) => self.values.define_register(old),
                    None => NO_REGISTER,
                }
            } else if clause.flags & flags::CHANNEL != 0 {
                if painting {
                    self.emit(clause, clause.kind, NO_REGISTER, output);
                }
                continue;
            } else if clause.flags & flags::RETURNS_POINT != 0 {
                clause
                    .dst
                    .index()
                    .map_or(NO_REGISTER, |old| self.points.define_register(old))
            } else {
                let dst = clause
                    .dst
                    .index()
                    .map_or(NO_REGISTER, |old| self.values.define_register(old));
                painting = dst != NO_REGISTER;
                dst
            };
            if dst == NO_REGISTER {
                continue;
            }
            if clause.flags & flags::CHOICE != 0 {
                match choice(index) {
                    Choice::Both => {}
                    Choice::First => {
                        let winner = clause.accumulator.index().or(clause.operands[0].index());
                        self.forward(clause, winner, false, dst, output);
                        continue;
                    }
                    Choice::Second => {
                        let negates = clause.flags & flags::NEGATES != 0;
                        if clause.accumulator.index().is_none() {
                            let winner = clause.operands[1].index();
                            self.forward(clause, winner, negates, dst, output);
                        } else if clause.kind == ClauseKind::Blend {
                            let winner = clause.operands[0].index();
                            self.forward(clause, winner, negates, dst, output);
                        } else {
                            let kind = if negates {
                                ClauseKind::NegatedOp
                            } else {
                                ClauseKind::OpOnly
                            };
                            self.values.free.push(dst);
                            self.emit(clause, kind, dst, output);
                        }
                        continue;
                    }
                }
            }
            if clause.flags & flags::RETURNS_POINT != 0 {
                self.points.free.push(dst);
            } else {
                self.values.free.push(dst);
            }
            self.emit(clause, clause.kind, dst, output);
        }
        output[start..].reverse();
        RegisterCounts {
            values: self.values.count.into(),
            points: self.points.count.into(),
        }
    }

    /// Emits a clause of this kind.
    #[inline(always)]
    fn emit<R: RegisterIndex>(
        &mut self,
        clause: &Clause<R>,
        kind: ClauseKind,
        dst: u16,
        output: &mut Vec<Clause>,
    ) {
        let is_op_only = matches!(kind, ClauseKind::OpOnly | ClauseKind::NegatedOp);
        // The accumulator is named first: it then usually gets the register of the result.
        let accumulator = match clause.accumulator.index() {
            Some(old) if !is_op_only => self.values.use_register(old),
            _ => NO_REGISTER,
        };
        let mut operands = [NO_REGISTER; 3];
        for (new, old) in operands.iter_mut().zip(clause.operands) {
            if let Some(old) = old.index() {
                *new = self.values.use_register(old);
            }
        }
        let point = match clause.point.index() {
            Some(old) => self.points.use_register(old),
            None => NO_REGISTER,
        };
        output.push(Clause {
            instruction: clause.instruction,
            kind,
            flags: if is_op_only {
                clause.flags & !flags::CHOICE
            } else {
                clause.flags
            },
            dst,
            accumulator,
            operands,
            point,
        });
    }

    /// Makes an existing value the result. Its register takes the name of the result if it has none yet;
    /// otherwise the value is copied.
    #[inline(always)]
    fn forward<R: RegisterIndex>(
        &mut self,
        clause: &Clause<R>,
        winner: Option<usize>,
        negate: bool,
        dst: u16,
        output: &mut Vec<Clause>,
    ) {
        let Some(winner) = winner else { return };
        if !negate && self.values.new[winner] == NO_REGISTER {
            self.values.new[winner] = dst;
            return;
        }
        self.values.free.push(dst);
        let from = self.values.use_register(winner);
        output.push(Clause {
            instruction: clause.instruction,
            kind: if negate {
                ClauseKind::Negate
            } else {
                ClauseKind::Copy
            },
            flags: 0,
            dst,
            accumulator: NO_REGISTER,
            operands: [from, NO_REGISTER, NO_REGISTER],
            point: NO_REGISTER,
        });
    }
}
