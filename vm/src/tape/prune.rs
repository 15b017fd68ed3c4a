//! Pruning: the part of a tape that matters where some of its choices are decided.
//!
//! One walk from the back to the front: a clause is kept if a register that it writes is read
//! later. A decided choice becomes another name for the operand that won, so that all that only the
//! other one needed is never reached. The same walk gives out registers anew, so a tape that has
//! become short uses few of them, which stay in the cache. Nothing is allocated but in `kept`.

use super::build::NOWHERE;
use super::{Clause, Form, NONE, flags};

/// What is known of a choice in a region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// Either operand may matter.
    Both,
    /// Only the first one does: what is below, or the first operand.
    First,
    /// Only the second one does.
    Second,
}

/// How many registers a pruned tape uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    /// For values.
    pub values: usize,
    /// For points.
    pub points: usize,
}

/// Registers that are read later, under their old and new names.
#[derive(Default)]
struct Names {
    /// By old name, the new one.
    new: Vec<u16>,
    free: Vec<u16>,
    count: u16,
}

impl Names {
    /// Forgets everything; register 0 keeps its name.
    fn start(&mut self) {
        self.new.fill(NONE);
        self.free.clear();
        self.new[0] = 0;
        self.count = 1;
    }
    /// The new name of a register that is read, given out if it has none.
    #[inline(always)]
    fn read(&mut self, old: usize) -> u16 {
        let name = self.new[old];
        if name != NONE {
            return name;
        }
        let name = self.free.pop().unwrap_or_else(|| {
            self.count += 1;
            self.count - 1
        });
        self.new[old] = name;
        name
    }
    /// The new name of a register that is written, which ends its life; [`NONE`] if nobody reads
    /// it.
    #[inline(always)]
    fn written(&mut self, old: usize) -> u16 {
        std::mem::replace(&mut self.new[old], NONE)
    }
}

/// A register's name as an index, or that there is none.
pub trait Name: Copy {
    /// The index.
    fn index(self) -> Option<usize>;
}
impl Name for u16 {
    #[inline(always)]
    fn index(self) -> Option<usize> {
        (self != NONE).then_some(usize::from(self))
    }
}
impl Name for u32 {
    #[inline(always)]
    fn index(self) -> Option<usize> {
        (self != NOWHERE).then_some(self as usize)
    }
}

/// The memory of pruning, for any number of tapes.
#[derive(Default)]
pub struct Pruner {
    values: Names,
    points: Names,
}

impl Pruner {
    /// Makes room for tapes of so many registers.
    pub fn reserve(&mut self, values: usize, points: usize) {
        if self.values.new.len() < values.max(1) {
            self.values.new.resize(values.max(1), NONE);
        }
        if self.points.new.len() < points.max(1) {
            self.points.new.resize(points.max(1), NONE);
        }
    }

    /// Appends to `kept` what of the tape matters. `choice` is asked for each clause with
    /// [`flags::CHOICE`] that is still needed, by its place in the tape.
    #[inline]
    pub fn prune<R: Name>(
        &mut self,
        tape: &[Clause<R>],
        mut choice: impl FnMut(usize) -> Choice,
        kept: &mut Vec<Clause>,
    ) -> Needs {
        let start = kept.len();
        self.values.start();
        self.points.start();
        // Whether the clauses that set channels belong to a kept one that paints.
        let mut painting = false;
        for (place, clause) in tape.iter().enumerate().rev() {
            const RARE: u8 = flags::GIVES_POINT | flags::CHANNEL | flags::PAINT;
            let out = if clause.flags & RARE == 0 {
                match clause.out.index() {
                    Some(old) => self.values.written(old),
                    None => NONE,
                }
            } else if clause.flags & flags::CHANNEL != 0 {
                if painting {
                    self.keep(clause, clause.form, NONE, kept);
                }
                continue;
            } else if clause.flags & flags::GIVES_POINT != 0 {
                clause
                    .out
                    .index()
                    .map_or(NONE, |old| self.points.written(old))
            } else {
                let out = clause
                    .out
                    .index()
                    .map_or(NONE, |old| self.values.written(old));
                painting = out != NONE;
                out
            };
            if out == NONE {
                continue;
            }
            if clause.flags & flags::CHOICE != 0 {
                match choice(place) {
                    Choice::Both => {}
                    Choice::First => {
                        let winner = clause.below.index().or(clause.operands[0].index());
                        self.hand_on(clause, winner, false, out, kept);
                        continue;
                    }
                    Choice::Second => {
                        let negates = clause.flags & flags::NEGATES != 0;
                        if clause.below.index().is_none() {
                            let winner = clause.operands[1].index();
                            self.hand_on(clause, winner, negates, out, kept);
                        } else if clause.form == Form::Blend {
                            let winner = clause.operands[0].index();
                            self.hand_on(clause, winner, negates, out, kept);
                        } else {
                            let form = if negates { Form::Negated } else { Form::Alone };
                            self.values.free.push(out);
                            self.keep(clause, form, out, kept);
                        }
                        continue;
                    }
                }
            }
            if clause.flags & flags::GIVES_POINT != 0 {
                self.points.free.push(out);
            } else {
                self.values.free.push(out);
            }
            self.keep(clause, clause.form, out, kept);
        }
        kept[start..].reverse();
        Needs {
            values: self.values.count.into(),
            points: self.points.count.into(),
        }
    }

    /// Keeps a clause in this form.
    #[inline(always)]
    fn keep<R: Name>(&mut self, clause: &Clause<R>, form: Form, out: u16, kept: &mut Vec<Clause>) {
        let alone = matches!(form, Form::Alone | Form::Negated);
        // What is below first: it then most often gets the register of the result.
        let below = match clause.below.index() {
            Some(old) if !alone => self.values.read(old),
            _ => NONE,
        };
        let mut operands = [NONE; 3];
        for (new, old) in operands.iter_mut().zip(clause.operands) {
            if let Some(old) = old.index() {
                *new = self.values.read(old);
            }
        }
        let point = match clause.point.index() {
            Some(old) => self.points.read(old),
            None => NONE,
        };
        kept.push(Clause {
            at: clause.at,
            form,
            flags: if alone {
                clause.flags & !flags::CHOICE
            } else {
                clause.flags
            },
            out,
            below,
            operands,
            point,
        });
    }

    /// The result is a value that is there already: its register gets the result's name if it has
    /// none, and is copied otherwise.
    #[inline(always)]
    fn hand_on<R: Name>(
        &mut self,
        clause: &Clause<R>,
        winner: Option<usize>,
        negate: bool,
        out: u16,
        kept: &mut Vec<Clause>,
    ) {
        let Some(winner) = winner else { return };
        if !negate && self.values.new[winner] == NONE {
            self.values.new[winner] = out;
            return;
        }
        self.values.free.push(out);
        let from = self.values.read(winner);
        kept.push(Clause {
            at: clause.at,
            form: if negate { Form::Negate } else { Form::Copy },
            flags: 0,
            out,
            below: NONE,
            operands: [from, NONE, NONE],
            point: NONE,
        });
    }
}
