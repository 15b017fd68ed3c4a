//! Where the constants of instructions lie on a device: those of each in a record of its own, all records
//! of a size, so that an instruction's number says where they begin. Lanes that run different tapes then
//! read a clause, and with it in hand all the rest at once.
//!
//! ```text
//! a record   the blend's constants, or the operand's      if any instruction has one
//!            the frame: a shift, or three rows            as many as the widest takes
//!            the parameters                               likewise
//! ```
//! The words of an instruction say the same, for the interpreter of stacks, in which all lanes run the
//! same one.

use super::operation::widest;
use sdfc_vm::encode::encode_instruction;
use sdfc_vm::program::{Frame, Instruction, Needs, Operands, Place, Program};

/// The parts of a record, in vectors of four numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Record {
    operand: u32,
    frame: u32,
    parameters: u32,
}

impl Record {
    /// What has room for the constants of programs that need these.
    pub fn of(needs: &Needs) -> Self {
        let frame = match (needs.mapped, needs.moved) {
            (true, _) => 3,
            (false, true) => 1,
            (false, false) => 0,
        };
        Self {
            operand: u32::from(needs.constant_operands || !needs.kernels.is_empty()),
            frame,
            parameters: widest(needs) as u32,
        }
    }

    /// What has room for those of both.
    pub fn join(self, other: Self) -> Self {
        Self {
            operand: self.operand.max(other.operand),
            frame: self.frame.max(other.frame),
            parameters: self.parameters.max(other.parameters),
        }
    }

    /// How many vectors it takes; one at least, since buffers cannot be empty.
    pub const fn size(self) -> u32 {
        let size = self.operand + self.frame + self.parameters;
        if size == 0 { 1 } else { size }
    }

    /// Which of them is the first of the frame.
    pub(super) const fn frame_at(self) -> u32 {
        self.operand
    }

    /// Which of them is the first of the parameters.
    pub(super) const fn parameters_at(self) -> u32 {
        self.operand + self.frame
    }

    /// The words of programs' instructions, one program behind the other.
    pub fn words<'a>(self, programs: impl Iterator<Item = &'a Program>) -> Vec<u32> {
        let code = programs.flat_map(|program| &program.code);
        let places = (0..).step_by(self.size() as usize);
        let word = |(i, place): (&Instruction, u32)| encode_instruction(&self.placed(i, place));
        code.zip(places).flat_map(word).collect()
    }

    /// An instruction whose constants lie in the record that begins here.
    fn placed(self, i: &Instruction, record: u32) -> Instruction {
        let frame = record + self.frame_at();
        Instruction {
            parameters: record + self.parameters_at(),
            frame: match i.frame {
                Frame::Same => Frame::Same,
                Frame::Moved(_) => Frame::Moved(frame),
                Frame::Mapped(_) => Frame::Mapped(frame),
            },
            operands: match i.operands {
                Operands::Stack => Operands::Stack,
                Operands::Right(_) => Operands::Right(record),
                Operands::Left(_) => Operands::Left(record),
            },
            place: match i.place {
                Place::Push => Place::Push,
                Place::Blend { kernel, .. } => Place::Blend {
                    kernel,
                    index: record,
                },
            },
            ..*i
        }
    }

    /// The records of programs' instructions, one program behind the other.
    pub fn constants<'a>(self, programs: impl Iterator<Item = &'a Program>) -> Vec<[f32; 4]> {
        let mut records = Vec::new();
        for program in programs {
            for i in &program.code {
                let start = records.len();
                let mut put = |at: u32, from: u32, count: usize| {
                    let (at, from) = (start + at as usize, from as usize);
                    records.resize(records.len().max(at + count), [0.0; 4]);
                    records[at..at + count].copy_from_slice(&program.pool[from..from + count]);
                };
                match (i.operands, i.place) {
                    (Operands::Left(from) | Operands::Right(from), _)
                    | (_, Place::Blend { index: from, .. }) => put(0, from, 1),
                    (Operands::Stack, Place::Push) => {}
                }
                match i.frame {
                    Frame::Same => {}
                    Frame::Moved(from) => put(self.frame_at(), from, 1),
                    Frame::Mapped(from) => put(self.frame_at(), from, 3),
                }
                put(self.parameters_at(), i.parameters, i.code.pool_width());
                records.resize(start + self.size() as usize, [0.0; 4]);
            }
        }
        records
    }
}
