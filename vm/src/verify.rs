//! The verifier: the only way from words to a program that may run.
//!
//! What it proves: every opcode is known, every operand was computed, every pool index and slot
//! exists, stacks stay within the format's limits, all constants are finite, and one value is left
//! at the end. What a guard may skip lies behind it and within the block that it stands in itself,
//! leaves both stacks as high as they were, never reaches below the value on top and the current
//! point, and stores nothing that is loaded later. As jumps lead forward only, every run ends after
//! as many steps as there are instructions at most, without an access out of range.

use crate::program::{
    CHANNELS, Code, Frame, Instruction, MAX_DEPTH, MAX_GUARDS, MAX_INSTRUCTIONS, MAX_POINTS,
    MAX_SLOTS, Operands, Place, Program,
};

/// Why a program is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VerifyError {
    /// There is nothing to run.
    #[error("the program is empty")]
    Empty,
    /// A limit of the format is passed.
    #[error("the program needs {need} {what}, more than the {allowed} that the format allows")]
    Limit {
        /// Of what.
        what: &'static str,
        /// How many it needs.
        need: usize,
        /// How many there may be.
        allowed: usize,
    },
    /// An instruction takes more than the stack holds.
    #[error("instruction {at} takes {need} values but the stack holds {have}")]
    Underflow {
        /// Which instruction.
        at: usize,
        /// How many it takes.
        need: usize,
        /// How many there are.
        have: usize,
    },
    /// An instruction goes back further than points were kept.
    #[error("instruction {at} goes back {need} points but only {have} were kept")]
    Points {
        /// Which instruction.
        at: usize,
        /// How many it wants.
        need: usize,
        /// How many there are.
        have: usize,
    },
    /// An instruction names a constant outside the pool.
    #[error("instruction {at} reads constant {index} of a pool of {size}")]
    Pool {
        /// Which instruction.
        at: usize,
        /// The constant.
        index: usize,
        /// How many there are.
        size: usize,
    },
    /// An instruction reads a slot that nothing was stored in.
    #[error("instruction {at} reads slot {slot}, which holds nothing yet")]
    Slot {
        /// Which instruction.
        at: usize,
        /// The slot.
        slot: u8,
    },
    /// An instruction's parts do not go together.
    #[error("instruction {at} (`{name}`) {problem}")]
    Malformed {
        /// Which instruction.
        at: usize,
        /// What it runs.
        name: &'static str,
        /// What is wrong.
        problem: &'static str,
    },
    /// A constant is not finite.
    #[error("constant {index} of the pool is not a finite number")]
    Constant {
        /// Which constant.
        index: usize,
    },
    /// A patch names a number outside the pool or an output that does not exist.
    #[error("patch {at} of the constants points outside the program")]
    Patch {
        /// Which patch.
        at: usize,
    },
    /// The stack does not hold exactly the result at the end.
    #[error("the program leaves {left} values instead of one")]
    Leftover {
        /// How many are left.
        left: usize,
    },
}

/// Checks a program; `outputs` is how many results its uniform program has, `surface` whether it
/// is one of surfaces.
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
        if patch.at as usize >= numbers || patch.output as usize >= outputs {
            return Err(VerifyError::Patch { at });
        }
    }

    let (mut depth, mut points) = (0_usize, 0_usize);
    let mut stored = vec![false; program.slots as usize];
    let mut blocks: Vec<Block> = Vec::new();
    // Channels that no material has taken yet.
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
            && let Some(problem) = block.point_left(points, i)
        {
            return malformed(problem);
        }
        points += usize::from(i.push);
        limit("points", points, MAX_POINTS)?;
        match i.frame {
            Frame::Same => {}
            _ if !i.code.reads_point() => return malformed("has a frame but reads no point"),
            Frame::Moved(index) => pool(index, 1)?,
            Frame::Mapped(index) => pool(index, 3)?,
        }
        match i.operands {
            Operands::Stack => {}
            _ if i.code.arity() != 2 => return malformed("has a constant operand"),
            Operands::Right(index) | Operands::Left(index) => pool(index, 1)?,
        }
        pool(i.parameters, i.code.pool_width())?;
        let taken = i.taken();
        if taken > depth {
            return Err(VerifyError::Underflow {
                at,
                need: taken,
                have: depth,
            });
        }
        depth -= taken;
        let blends = usize::from(i.place != Place::Push);
        if let Some(block) = blocks.last()
            && depth < block.depth + blends - 1
        {
            return malformed("reaches below the value that its guard stands for");
        }
        match i.code {
            Code::Load if !stored.get(usize::from(i.slot)).is_some_and(|&s| s) => {
                return Err(VerifyError::Slot { at, slot: i.slot });
            }
            Code::Store => match stored.get_mut(usize::from(i.slot)) {
                Some(slot) => {
                    *slot = true;
                    blocks.iter_mut().for_each(|block| block.stores(i.slot));
                }
                None => return malformed("names a slot that the program does not have"),
            },
            Code::Normal if i.slot > 2 => return malformed("names no axis"),
            Code::Channel if usize::from(i.slot) >= CHANNELS => {
                return malformed("names no channel");
            }
            Code::Channel => pending += 1,
            Code::Paint => pending = 0,
            Code::Guard => {
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
                blocks.push(Block {
                    at,
                    end,
                    depth,
                    points,
                    stored: Vec::new(),
                });
                limit("guards within each other", blocks.len(), MAX_GUARDS)?;
            }
            Code::Op(_) | Code::Load | Code::Take | Code::Normal => {}
        }
        if i.skips > 0 && i.code != Code::Guard {
            return malformed("skips, but is no guard");
        }
        let keeps = !i.gives_none();
        match i.place {
            Place::Push => depth += usize::from(keeps),
            _ if !keeps => return malformed("blends, but gives no value"),
            Place::Blend { .. } if i.operands != Operands::Stack => {
                return malformed("both blends and has a constant operand");
            }
            Place::Blend { index, .. } => {
                pool(index, 1)?;
                if depth == 0 {
                    return Err(VerifyError::Underflow {
                        at,
                        need: taken + 1,
                        have: taken,
                    });
                }
            }
        }
        limit("values on the stack", depth, MAX_DEPTH)?;
    }
    for block in blocks.into_iter().rev() {
        block.close(depth, points, pending, &mut stored)?;
    }
    if depth != 1 {
        return Err(VerifyError::Leftover { left: depth });
    }
    Ok(())
}

/// The instructions that a guard may skip.
struct Block {
    /// The guard.
    at: usize,
    /// The instruction behind the last one.
    end: usize,
    /// How many values lay on the stack at the guard, the one on top included.
    depth: usize,
    /// How many points were kept at the guard.
    points: usize,
    /// The slots that were stored since.
    stored: Vec<u8>,
}

impl Block {
    /// What is wrong with an instruction of the block that has gone back to so many kept points.
    fn point_left(&self, points: usize, i: &Instruction) -> Option<&'static str> {
        if points < self.points {
            return Some("goes back to a point from before its guard");
        }
        let replaces = points == self.points && i.code.gives_point() && !i.push;
        replaces.then_some("replaces the point that its guard looks at")
    }

    fn stores(&mut self, slot: u8) {
        if !self.stored.contains(&slot) {
            self.stored.push(slot);
        }
    }

    /// Checks that skipping the block and running it lead to the same place; what it stored is
    /// forgotten.
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
            name: Code::Guard.name(),
            problem,
        })
    }
}
