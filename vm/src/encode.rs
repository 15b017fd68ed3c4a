//! The encoding of a program as little-endian `u32` words, for GPU upload and `.sdfb` files.
//!
//! An instruction takes four words, in the layout of [`crate::program`]. Decoding returns an equal program,
//! or an error; it does not verify.

use crate::blend::BlendKernel;
use crate::program::{Destination, Instruction, Opcode, Operands, PointTransform};

/// The reasons why words are not a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// The number of words is not a multiple of four.
    #[error("{0} words are not a whole number of instructions of four")]
    Length(usize),
    /// The opcode is neither a row's nor one of the machine's own.
    #[error("instruction {at} has the unknown opcode {opcode}")]
    Opcode {
        /// Index of the instruction.
        at: usize,
        /// Its unknown opcode.
        opcode: u8,
    },
    /// A field has an invalid value, or an unused word is not zero.
    #[error("instruction {at} has no meaning in its {field}")]
    Field {
        /// Index of the instruction.
        at: usize,
        /// The invalid field.
        field: &'static str,
    },
}

/// Encodes an instruction as four words.
pub fn encode_instruction(i: &Instruction) -> [u32; 4] {
    let (blend, blend_index) = match i.destination {
        Destination::Push => (0, 0),
        Destination::Blend { kernel, index } => (u32::from(kernel.number()), index),
    };
    let (operands, operand_index) = match i.operands {
        Operands::Stack => (0, 0),
        Operands::Right(index) => (1, index),
        Operands::Left(index) => (2, index),
    };
    let (frame, frame_index) = match i.transform {
        PointTransform::Identity => (0, 0),
        PointTransform::Translate(index) => (1, index),
        PointTransform::Affine(index) => (2, index),
    };
    let word = u32::from(i.code.number())
        | blend << 8
        | u32::from(i.has_no_value()) << 11
        | operands << 12
        | frame << 14
        | u32::from(i.pops) << 16
        | (i.pop_count() as u32) << 21
        | u32::from(i.push) << 23
        | u32::from(i.slot) << 24;
    let last = blend_index | operand_index | i.skips;
    [word, i.parameters, frame_index, last]
}

/// Encodes the instructions of a program.
pub fn encode(code: &[Instruction]) -> Vec<u32> {
    code.iter().flat_map(encode_instruction).collect()
}

/// Decodes instructions.
pub fn decode(words: &[u32]) -> Result<Vec<Instruction>, DecodeError> {
    let (chunks, rest) = words.as_chunks::<4>();
    if !rest.is_empty() {
        return Err(DecodeError::Length(words.len()));
    }
    chunks
        .iter()
        .enumerate()
        .map(|(index, chunk)| decode_instruction(index, *chunk))
        .collect()
}

fn decode_instruction(index: usize, words: [u32; 4]) -> Result<Instruction, DecodeError> {
    let [word, parameters, frame_index, last] = words;
    let field = |field| DecodeError::Field { at: index, field };
    let bits = |from: u32, count: u32| word >> from & ((1 << count) - 1);
    let opcode = bits(0, 8) as u8;
    let code = Opcode::from_number(opcode).ok_or(DecodeError::Opcode { at: index, opcode })?;
    let destination = match bits(8, 3) {
        0 => Destination::Push,
        number => Destination::Blend {
            kernel: BlendKernel::from_number(number as u8).ok_or_else(|| field("blend"))?,
            index: last,
        },
    };
    let operands = match bits(12, 2) {
        0 => Operands::Stack,
        1 => Operands::Right(last),
        2 => Operands::Left(last),
        _ => return Err(field("operands")),
    };
    let transform = match bits(14, 2) {
        0 => PointTransform::Identity,
        1 => PointTransform::Translate(frame_index),
        2 => PointTransform::Affine(frame_index),
        _ => return Err(field("frame")),
    };
    let instruction = Instruction {
        code,
        pops: bits(16, 5) as u8,
        push: bits(23, 1) == 1,
        transform,
        operands,
        destination,
        slot: bits(24, 8) as u8,
        parameters,
        skips: if code == Opcode::Guard { last } else { 0 },
    };
    // Unused bits must be zero, so that equal programs have equal words.
    if encode_instruction(&instruction) != words || (instruction.slot != 0 && !code.has_slot()) {
        return Err(field("unused bits"));
    }
    Ok(instruction)
}
