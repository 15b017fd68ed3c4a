//! The verifier: every program must pass it before it may run.
//!
//! It proves that every opcode is known, every operand was computed, and every pool index and slot exists.
//! It also proves that stacks stay within the format's limits, all constants are finite, and exactly one
//! value remains at the end. The block of a guard follows the guard and lies within the enclosing block. It
//! leaves the height of both stacks unchanged and never accesses values below the one on top. It never
//! replaces the current point, and stores nothing that is loaded later. As jumps only lead forward, every
//! run ends after at most as many steps as there are instructions, without an access out of range.

use crate::program::{
    CHANNELS, Destination, Instruction, MAX_GUARDS, MAX_INSTRUCTIONS, MAX_SLOTS, MAX_STACK_POINTS,
    MAX_STACK_VALUES, Opcode, Operands, PointTransform, Program,
};

/// The reasons why a program is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VerifyError {
    /// The program is empty.
    #[error("the program is empty")]
    Empty,
    /// A limit of the format is exceeded.
    #[error("the program needs {need} {what}, more than the {allowed} that the format allows")]
    Limit {
        /// The limited quantity.
        what: &'static str,
        /// The number that the program requires.
        need: usize,
        /// The largest number that the format allows.
        allowed: usize,
    },
    /// An instruction pops more values than the stack holds.
    #[error("instruction {at} takes {need} values but the stack holds {have}")]
    Underflow {
        /// Index of the instruction.
        at: usize,
        /// The number of values that it pops.
        need: usize,
        /// The number of values on the stack.
        have: usize,
    },
    /// An instruction pops more points than were saved.
    #[error("instruction {at} goes back {need} points but only {have} were kept")]
    Points {
        /// Index of the instruction.
        at: usize,
        /// The number of points that it pops.
        need: usize,
        /// The number of saved points.
        have: usize,
    },
    /// An instruction refers to a constant outside the pool.
    #[error("instruction {at} reads constant {index} of a pool of {size}")]
    Pool {
        /// Index of the instruction.
        at: usize,
        /// Index of the constant.
        index: usize,
        /// Size of the pool.
        size: usize,
    },
    /// An instruction loads a slot before a value is stored in it.
    #[error("instruction {at} reads slot {slot}, which holds nothing yet")]
    Slot {
        /// Index of the instruction.
        at: usize,
        /// Number of the slot.
        slot: u8,
    },
    /// The fields of an instruction contradict each other.
    #[error("instruction {at} (`{name}`) {problem}")]
    Malformed {
        /// Index of the instruction.
        at: usize,
        /// The name of its operation.
        name: &'static str,
        /// The contradiction, as the predicate of a sentence.
        problem: &'static str,
    },
    /// A constant is not finite.
    #[error("constant {index} of the pool is not a finite number")]
    Constant {
        /// Index of the constant.
        index: usize,
    },
    /// A patch refers to a number outside the pool or to an output that does not exist.
    #[error("patch {at} of the constants points outside the program")]
    Patch {
        /// Index of the patch.
        at: usize,
    },
    /// The stack does not hold exactly one value at the end.
    #[error("the program leaves {left} values instead of one")]
    Leftover {
        /// The number of values at the end.
        left: usize,
    },
}

/// Verifies a program. `outputs` is the number of results of its uniform program; `surface` is set for
/// surface programs.
pub fn verify(program: &Program, outputs: usize, surface: bool) -> Result<(), VerifyError> {
    verify_tables(program, outputs)?;
    let mut state = VerifierState {
        program,
        surface,
        depth: 0,
        points: 0,
        stored: vec![false; program.slots as usize],
        pending: 0,
        blocks: Vec::new(),
    };
    for (at, instruction) in program.code.iter().enumerate() {
        state.close_blocks(at)?;
        state.check(at, instruction)?;
    }
    state.close_blocks(program.code.len())?;
    match state.depth {
        1 => Ok(()),
        left => Err(VerifyError::Leftover { left }),
    }
}

/// Checks everything that does not depend on the state before an instruction.
fn verify_tables(program: &Program, outputs: usize) -> Result<(), VerifyError> {
    if program.code.is_empty() {
        return Err(VerifyError::Empty);
    }
    check_limit("instructions", program.code.len(), MAX_INSTRUCTIONS)?;
    check_limit("slots", program.slots as usize, MAX_SLOTS)?;
    let is_finite = |constant: &[f32; 4]| constant.iter().all(|v| v.is_finite());
    if let Some(index) = program.pool.iter().position(|c| !is_finite(c)) {
        return Err(VerifyError::Constant { index });
    }
    let numbers = program.pool.len() * 4;
    for (at, patch) in program.patches.iter().enumerate() {
        if patch.index as usize >= numbers || patch.output as usize >= outputs {
            return Err(VerifyError::Patch { at });
        }
    }
    Ok(())
}

/// Checks a quantity against the format's limit.
fn check_limit(what: &'static str, need: usize, allowed: usize) -> Result<(), VerifyError> {
    match need > allowed {
        true => Err(VerifyError::Limit {
            what,
            need,
            allowed,
        }),
        false => Ok(()),
    }
}

/// Returns the error of an instruction whose fields contradict each other.
fn malformed(at: usize, i: &Instruction, problem: &'static str) -> VerifyError {
    VerifyError::Malformed {
        at,
        name: i.code.name(),
        problem,
    }
}

/// State of the machine before an instruction, as far as it is known without running the program.
struct VerifierState<'a> {
    program: &'a Program,
    /// Set for surface programs.
    surface: bool,
    /// Number of values on the stack.
    depth: usize,
    /// Number of saved points.
    points: usize,
    /// The slots that hold a value.
    stored: Vec<bool>,
    /// Number of channels that are not assigned to a material yet.
    pending: usize,
    /// The guards' blocks around the instruction, from the outermost one.
    blocks: Vec<OpenBlock>,
}

impl VerifierState<'_> {
    /// Closes the blocks that end before an instruction.
    fn close_blocks(&mut self, at: usize) -> Result<(), VerifyError> {
        while let Some(block) = self.blocks.pop_if(|block| block.end == at) {
            block.close(self.depth, self.points, self.pending, &mut self.stored)?;
        }
        Ok(())
    }

    /// Checks an instruction, and updates the state.
    fn check(&mut self, at: usize, i: &Instruction) -> Result<(), VerifyError> {
        if i.code.is_surface() && !self.surface {
            return Err(malformed(at, i, "occurs in a program without surfaces"));
        }
        self.check_point(at, i)?;
        let popped = self.pop_operands(at, i)?;
        self.check_opcode(at, i)?;
        if i.skips > 0 && i.code != Opcode::Guard {
            return Err(malformed(at, i, "skips, but is no guard"));
        }
        self.check_destination(at, i, popped)?;
        check_limit("values on the stack", self.depth, MAX_STACK_VALUES)
    }

    /// Checks that constants lie within the pool.
    fn check_pool(&self, at: usize, index: u32, width: usize) -> Result<(), VerifyError> {
        let (index, size) = (index as usize, self.program.pool.len());
        match index + width > size {
            true => Err(VerifyError::Pool { at, index, size }),
            false => Ok(()),
        }
    }

    /// Checks the point of an instruction: those that it pops and saves, and its transform.
    fn check_point(&mut self, at: usize, i: &Instruction) -> Result<(), VerifyError> {
        if i.pops as usize > self.points {
            return Err(VerifyError::Points {
                at,
                need: i.pops.into(),
                have: self.points,
            });
        }
        self.points -= i.pops as usize;
        if let Some(block) = self.blocks.last()
            && let Some(problem) = block.point_error(self.points, i)
        {
            return Err(malformed(at, i, problem));
        }
        self.points += usize::from(i.push);
        check_limit("points", self.points, MAX_STACK_POINTS)?;
        match i.transform {
            PointTransform::Identity => Ok(()),
            _ if !i.code.reads_point() => Err(malformed(at, i, "has a frame but reads no point")),
            PointTransform::Translate(index) => self.check_pool(at, index, 1),
            PointTransform::Affine(index) => self.check_pool(at, index, 3),
        }
    }

    /// Checks the operands and parameters of an instruction, and pops the operands. Returns their number on the
    /// stack.
    fn pop_operands(&mut self, at: usize, i: &Instruction) -> Result<usize, VerifyError> {
        match i.operands {
            Operands::Stack => {}
            _ if i.code.arity() != 2 => return Err(malformed(at, i, "has a constant operand")),
            Operands::Right(index) | Operands::Left(index) => self.check_pool(at, index, 1)?,
        }
        self.check_pool(at, i.parameters, i.code.pool_width())?;
        let popped = i.pop_count();
        if popped > self.depth {
            return Err(VerifyError::Underflow {
                at,
                need: popped,
                have: self.depth,
            });
        }
        self.depth -= popped;
        let blends = usize::from(i.destination != Destination::Push);
        if let Some(block) = self.blocks.last()
            && self.depth < block.depth + blends - 1
        {
            let problem = "reaches below the value that its guard stands for";
            return Err(malformed(at, i, problem));
        }
        Ok(popped)
    }

    /// Checks an instruction's slot, channel or guard.
    fn check_opcode(&mut self, at: usize, i: &Instruction) -> Result<(), VerifyError> {
        let malformed = |problem| Err(malformed(at, i, problem));
        match i.code {
            Opcode::Load if !self.stored.get(usize::from(i.slot)).is_some_and(|&s| s) => {
                return Err(VerifyError::Slot { at, slot: i.slot });
            }
            Opcode::Store => match self.stored.get_mut(usize::from(i.slot)) {
                Some(slot) => {
                    *slot = true;
                    self.blocks
                        .iter_mut()
                        .for_each(|block| block.stores(i.slot));
                }
                None => return malformed("names a slot that the program does not have"),
            },
            Opcode::Normal if i.slot > 2 => return malformed("names no axis"),
            Opcode::Channel if usize::from(i.slot) >= CHANNELS => {
                return malformed("names no channel");
            }
            Opcode::Channel => self.pending += 1,
            Opcode::Paint => self.pending = 0,
            Opcode::Guard => return self.open_block(at, i),
            Opcode::Op(_) | Opcode::Load | Opcode::Top | Opcode::Normal => {}
        }
        Ok(())
    }

    /// Checks a guard, and opens its block.
    fn open_block(&mut self, at: usize, i: &Instruction) -> Result<(), VerifyError> {
        let malformed = |problem| Err(malformed(at, i, problem));
        let end = at + 1 + i.skips as usize;
        let outer = self.blocks.last();
        let outer_end = outer.map_or(self.program.code.len(), |block| block.end);
        if i.skips == 0 {
            return malformed("skips nothing");
        }
        if end > outer_end {
            return malformed("skips more than there is behind it");
        }
        if self.depth == 0 {
            return malformed("has no value to compare with");
        }
        if self.pending > 0 {
            return malformed("stands between a channel and its material");
        }
        self.blocks.push(OpenBlock {
            at,
            end,
            depth: self.depth,
            points: self.points,
            stored: Vec::new(),
        });
        check_limit("guards within each other", self.blocks.len(), MAX_GUARDS)
    }

    /// Checks the destination of an instruction that popped some operands, and pushes its value.
    fn check_destination(
        &mut self,
        at: usize,
        i: &Instruction,
        popped: usize,
    ) -> Result<(), VerifyError> {
        let malformed = |problem| Err(malformed(at, i, problem));
        let keeps = !i.has_no_value();
        match i.destination {
            Destination::Push => self.depth += usize::from(keeps),
            _ if !keeps => return malformed("blends, but gives no value"),
            Destination::Blend { .. } if i.operands != Operands::Stack => {
                return malformed("both blends and has a constant operand");
            }
            Destination::Blend { index, .. } => {
                self.check_pool(at, index, 1)?;
                if self.depth == 0 {
                    return Err(VerifyError::Underflow {
                        at,
                        need: popped + 1,
                        have: popped,
                    });
                }
            }
        }
        Ok(())
    }
}

/// The block of instructions that a guard may skip.
struct OpenBlock {
    /// Index of the guard.
    at: usize,
    /// Index of the first instruction after the block.
    end: usize,
    /// Number of values on the stack at the guard.
    depth: usize,
    /// Number of saved points at the guard.
    points: usize,
    /// The slots stored within the block.
    stored: Vec<u8>,
}

impl OpenBlock {
    /// Returns the error of an instruction of the block that has popped points down to this number, if
    /// there is one.
    fn point_error(&self, points: usize, i: &Instruction) -> Option<&'static str> {
        if points < self.points {
            return Some("goes back to a point from before its guard");
        }
        let replaces = points == self.points && i.code.returns_point() && !i.push;
        replaces.then_some("replaces the point that its guard looks at")
    }

    fn stores(&mut self, slot: u8) {
        if !self.stored.contains(&slot) {
            self.stored.push(slot);
        }
    }

    /// Checks that skipping the block is equivalent to running it. Slots stored in the block become
    /// undefined.
    fn close(
        self,
        depth: usize,
        points: usize,
        pending: usize,
        stored: &mut [bool],
    ) -> Result<(), VerifyError> {
        let problem = if depth != self.depth {
            "stands for instructions that leave more values or fewer"
        } else if points != self.points {
            "stands for instructions that keep points"
        } else if pending > 0 {
            "stands for instructions that leave a channel without its material"
        } else {
            for slot in self.stored {
                stored[usize::from(slot)] = false;
            }
            return Ok(());
        };
        Err(VerifyError::Malformed {
            at: self.at,
            name: Opcode::Guard.name(),
            problem,
        })
    }
}
