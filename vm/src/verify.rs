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
        /// The contradiction.
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
    let limit = |what, need: usize, allowed: usize| {
        if need > allowed {
            Err(VerifyError::Limit {
                what,
                need,
                allowed,
            })
        } else {
            Ok(())
        }
    };
    if program.code.is_empty() {
        return Err(VerifyError::Empty);
    }
    limit("instructions", program.code.len(), MAX_INSTRUCTIONS)?;
    limit("slots", program.slots as usize, MAX_SLOTS)?;
    if let Some(index) = program
        .pool
        .iter()
        .position(|c| c.iter().any(|v| !v.is_finite()))
    {
        return Err(VerifyError::Constant { index });
    }
    let numbers = program.pool.len() * 4;
    for (at, patch) in program.patches.iter().enumerate() {
        if patch.index as usize >= numbers || patch.output as usize >= outputs {
            return Err(VerifyError::Patch { at });
        }
    }

    let (mut depth, mut points) = (0_usize, 0_usize);
    let mut stored = vec![false; program.slots as usize];
    let mut blocks: Vec<OpenBlock> = Vec::new();
    // Channels that are not assigned to a material yet.
    let mut pending = 0_usize;
    for (at, i) in program.code.iter().enumerate() {
        while let Some(block) = blocks.pop_if(|block| block.end == at) {
            block.close(depth, points, pending, &mut stored)?;
        }
        let malformed = |problem| {
            Err(VerifyError::Malformed {
                at,
                name: i.code.name(),
                problem,
            })
        };
        let pool = |index: u32, width: usize| {
            let (index, size) = (index as usize, program.pool.len());
            if index + width > size {
                Err(VerifyError::Pool { at, index, size })
            } else {
                Ok(())
            }
        };
        if i.code.is_surface() && !surface {
            return malformed("occurs in a program without surfaces");
        }
        if i.pops as usize > points {
            return Err(VerifyError::Points {
                at,
                need: i.pops.into(),
                have: points,
            });
        }
        points -= i.pops as usize;
        if let Some(block) = blocks.last()
            && let Some(problem) = block.point_error(points, i)
        {
            return malformed(problem);
        }
        points += usize::from(i.push);
        limit("points", points, MAX_STACK_POINTS)?;
        match i.transform {
            PointTransform::Identity => {}
            _ if !i.code.reads_point() => return malformed("has a frame but reads no point"),
            PointTransform::Translate(index) => pool(index, 1)?,
            PointTransform::Affine(index) => pool(index, 3)?,
        }
        match i.operands {
            Operands::Stack => {}
            _ if i.code.arity() != 2 => return malformed("has a constant operand"),
            Operands::Right(index) | Operands::Left(index) => pool(index, 1)?,
        }
        pool(i.parameters, i.code.pool_width())?;
        let popped = i.pop_count();
        if popped > depth {
            return Err(VerifyError::Underflow {
                at,
                need: popped,
                have: depth,
            });
        }
        depth -= popped;
        let blends = usize::from(i.destination != Destination::Push);
        if let Some(block) = blocks.last()
            && depth < block.depth + blends - 1
        {
            return malformed("reaches below the value that its guard stands for");
        }
        match i.code {
            Opcode::Load if !stored.get(usize::from(i.slot)).is_some_and(|&s| s) => {
                return Err(VerifyError::Slot { at, slot: i.slot });
            }
            Opcode::Store => match stored.get_mut(usize::from(i.slot)) {
                Some(slot) => {
                    *slot = true;
                    blocks.iter_mut().for_each(|block| block.stores(i.slot));
                }
                None => return malformed("names a slot that the program does not have"),
            },
            Opcode::Normal if i.slot > 2 => return malformed("names no axis"),
            Opcode::Channel if usize::from(i.slot) >= CHANNELS => {
                return malformed("names no channel");
            }
            Opcode::Channel => pending += 1,
            Opcode::Paint => pending = 0,
            Opcode::Guard => {
                let end = at + 1 + i.skips as usize;
                let outer = blocks.last().map_or(program.code.len(), |block| block.end);
                if i.skips == 0 {
                    return malformed("skips nothing");
                }
                if end > outer {
                    return malformed("skips more than there is behind it");
                }
                if depth == 0 {
                    return malformed("has no value to compare with");
                }
                if pending > 0 {
                    return malformed("stands between a channel and its material");
                }
                blocks.push(OpenBlock {
                    at,
                    end,
                    depth,
                    points,
                    stored: Vec::new(),
                });
                limit("guards within each other", blocks.len(), MAX_GUARDS)?;
            }
            Opcode::Op(_) | Opcode::Load | Opcode::Top | Opcode::Normal => {}
        }
        if i.skips > 0 && i.code != Opcode::Guard {
            return malformed("skips, but is no guard");
        }
        let keeps = !i.has_no_value();
        match i.destination {
            Destination::Push => depth += usize::from(keeps),
            _ if !keeps => return malformed("blends, but gives no value"),
            Destination::Blend { .. } if i.operands != Operands::Stack => {
                return malformed("both blends and has a constant operand");
            }
            Destination::Blend { index, .. } => {
                pool(index, 1)?;
                if depth == 0 {
                    return Err(VerifyError::Underflow {
                        at,
                        need: popped + 1,
                        have: popped,
                    });
                }
            }
        }
        limit("values on the stack", depth, MAX_STACK_VALUES)?;
    }
    for block in blocks.into_iter().rev() {
        block.close(depth, points, pending, &mut stored)?;
    }
    if depth != 1 {
        return Err(VerifyError::Leftover { left: depth });
    }
    Ok(())
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
