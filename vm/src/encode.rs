//! Words: a program as little-endian `u32`s, which is what is uploaded and what `.sdfb` files hold.
//!
//! Four words per instruction, laid out as [`crate::program`] draws them. Decoding gives an equal
//! program, or says what is wrong; it does not verify.

use crate::kernel::Kernel;
use crate::program::{Code, Frame, Instruction, Operands, Place};

/// Why words are no program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// The words are not a whole number of instructions.
    #[error("{0} words are not a whole number of instructions of four")]
    Length(usize),
    /// An opcode that no row and no machine code has.
    #[error("instruction {at} has the unknown opcode {opcode}")]
    Opcode {
        /// Which instruction.
        at: usize,
        /// Its opcode.
        opcode: u8,
    },
    /// A field holds a number that means nothing, or a word that must be zero is not.
    #[error("instruction {at} has no meaning in its {field}")]
    Field {
        /// Which instruction.
        at: usize,
        /// Which part of it.
        field: &'static str,
    },
}

/// An instruction as four words.
pub fn encode_instruction(i: &Instruction) -> [u32; 4] {
    let (blend, blend_index) = match i.place {
        Place::Push => (0, 0),
        Place::Blend { kernel, index } => (u32::from(kernel.number()), index),
    };
    let (operands, operand_index) = match i.operands {
        Operands::Stack => (0, 0),
        Operands::Right(index) => (1, index),
        Operands::Left(index) => (2, index),
    };
    let (frame, frame_index) = match i.frame {
        Frame::Same => (0, 0),
        Frame::Moved(index) => (1, index),
        Frame::Mapped(index) => (2, index),
    };
    let word = u32::from(i.code.number())
        | blend << 8
        | u32::from(i.gives_none()) << 11
        | operands << 12
        | frame << 14
        | u32::from(i.pops) << 16
        | (i.taken() as u32) << 21
        | u32::from(i.push) << 23
        | u32::from(i.slot) << 24;
    let last = blend_index | operand_index | i.skips;
    [word, i.parameters, frame_index, last]
}

/// A program's instructions as words.
pub fn encode(code: &[Instruction]) -> Vec<u32> {
    code.iter().flat_map(encode_instruction).collect()
}

/// The instructions that the words stand for.
pub fn decode(words: &[u32]) -> Result<Vec<Instruction>, DecodeError> {
    let (chunks, rest) = words.as_chunks::<4>();
    if !rest.is_empty() {
        return Err(DecodeError::Length(words.len()));
    }
    chunks
        .iter()
        .enumerate()
        .map(|(at, chunk)| decode_instruction(at, *chunk))
        .collect()
}

fn decode_instruction(at: usize, words: [u32; 4]) -> Result<Instruction, DecodeError> {
    let [word, parameters, frame_index, last] = words;
    let field = |field| DecodeError::Field { at, field };
    let bits = |from: u32, count: u32| word >> from & ((1 << count) - 1);
    let opcode = bits(0, 8) as u8;
    let code = Code::from_number(opcode).ok_or(DecodeError::Opcode { at, opcode })?;
    let place = match bits(8, 3) {
        0 => Place::Push,
        number => Place::Blend {
            kernel: Kernel::from_number(number as u8).ok_or_else(|| field("blend"))?,
            index: last,
        },
    };
    let operands = match bits(12, 2) {
        0 => Operands::Stack,
        1 => Operands::Right(last),
        2 => Operands::Left(last),
        _ => return Err(field("operands")),
    };
    let frame = match bits(14, 2) {
        0 => Frame::Same,
        1 => Frame::Moved(frame_index),
        2 => Frame::Mapped(frame_index),
        _ => return Err(field("frame")),
    };
    let instruction = Instruction {
        code,
        pops: bits(16, 5) as u8,
        push: bits(23, 1) == 1,
        frame,
        operands,
        place,
        slot: bits(24, 8) as u8,
        parameters,
        skips: if code == Code::Guard { last } else { 0 },
    };
    // What means nothing must be zero, so that equal programs have equal words.
    if encode_instruction(&instruction) != words || (instruction.slot != 0 && !code.has_slot()) {
        return Err(field("unused bits"));
    }
    Ok(instruction)
}
