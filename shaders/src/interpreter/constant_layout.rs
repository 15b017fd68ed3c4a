//! Layout of the constants of instructions on a device. Each instruction has a record, all of the same size,
//! so that its number determines the position. Lanes that run different tapes then read a clause, and with it
//! all the rest at once.
//!
//! ```text
//! a record   the blend's constants, or the operand's      if any instruction has one
//!            the point transform: a shift, or three rows  as many as the widest takes
//!            the parameters                               likewise
//! ```
//! The words of an instruction hold the same positions, for the stack interpreter, in which all lanes run the
//! same instruction.

use super::operation::max_pool_width;
use sdfc_vm::encode::encode_instruction;
use sdfc_vm::program::{
    Destination, Instruction, KernelRequirements, Operands, PointTransform, Program,
};

/// The sections of a record, in vectors of four numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ConstantLayout {
    operand: u32,
    transform: u32,
    parameters: u32,
}

impl ConstantLayout {
    /// Returns the layout for the constants of programs with these requirements.
    pub fn for_requirements(requirements: &KernelRequirements) -> Self {
        let transform = match (requirements.maps_affinely, requirements.translates) {
            (true, _) => 3,
            (false, true) => 1,
            (false, false) => 0,
        };
        Self {
            operand: u32::from(
                requirements.constant_operands || !requirements.blend_kernels.is_empty(),
            ),
            transform,
            parameters: max_pool_width(requirements) as u32,
        }
    }

    /// Returns the layout for the programs of both.
    pub fn union(self, other: Self) -> Self {
        Self {
            operand: self.operand.max(other.operand),
            transform: self.transform.max(other.transform),
            parameters: self.parameters.max(other.parameters),
        }
    }

    /// Returns the number of vectors, at least one, since buffers cannot be empty.
    pub const fn size(self) -> u32 {
        let size = self.operand + self.transform + self.parameters;
        if size == 0 { 1 } else { size }
    }

    /// Returns the offset of the point transform.
    pub(super) const fn transform_offset(self) -> u32 {
        self.operand
    }

    /// Returns the offset of the parameters.
    pub(super) const fn parameters_offset(self) -> u32 {
        self.operand + self.transform
    }

    /// Returns the words of programs' instructions, one program after the other.
    pub fn words<'a>(self, programs: impl Iterator<Item = &'a Program>) -> Vec<u32> {
        let code = programs.flat_map(|program| &program.code);
        let records = (0..).step_by(self.size() as usize);
        let word =
            |(i, record): (&Instruction, u32)| encode_instruction(&self.relocated(i, record));
        code.zip(records).flat_map(word).collect()
    }

    /// Returns an instruction whose constants are in the record at this position.
    fn relocated(self, i: &Instruction, record: u32) -> Instruction {
        let transform = record + self.transform_offset();
        Instruction {
            parameters: record + self.parameters_offset(),
            transform: match i.transform {
                PointTransform::Identity => PointTransform::Identity,
                PointTransform::Translate(_) => PointTransform::Translate(transform),
                PointTransform::Affine(_) => PointTransform::Affine(transform),
            },
            operands: match i.operands {
                Operands::Stack => Operands::Stack,
                Operands::Right(_) => Operands::Right(record),
                Operands::Left(_) => Operands::Left(record),
            },
            destination: match i.destination {
                Destination::Push => Destination::Push,
                Destination::Blend { kernel, .. } => Destination::Blend {
                    kernel,
                    index: record,
                },
            },
            ..*i
        }
    }

    /// Returns the records of programs' instructions, one program after the other.
    pub fn constants<'a>(self, programs: impl Iterator<Item = &'a Program>) -> Vec<[f32; 4]> {
        let mut records = Vec::new();
        for program in programs {
            for i in &program.code {
                let start = records.len();
                let mut copy = |offset: u32, from: u32, count: usize| {
                    let (to, from) = (start + offset as usize, from as usize);
                    records.resize(records.len().max(to + count), [0.0; 4]);
                    records[to..to + count].copy_from_slice(&program.pool[from..from + count]);
                };
                match (i.operands, i.destination) {
                    (Operands::Left(from) | Operands::Right(from), _)
                    | (_, Destination::Blend { index: from, .. }) => copy(0, from, 1),
                    (Operands::Stack, Destination::Push) => {}
                }
                match i.transform {
                    PointTransform::Identity => {}
                    PointTransform::Translate(from) => copy(self.transform_offset(), from, 1),
                    PointTransform::Affine(from) => copy(self.transform_offset(), from, 3),
                }
                copy(self.parameters_offset(), i.parameters, i.code.pool_width());
                records.resize(start + self.size() as usize, [0.0; 4]);
            }
        }
        records
    }
}
