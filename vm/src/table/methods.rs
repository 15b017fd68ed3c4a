//! Methods of rows and of operations.

use super::{Op, ROWS, Row};
use crate::row::{Input, Parameter, align};

impl Row {
    /// Reports whether its two operands may be exchanged without a change of any bit. Blends may, unless they
    /// negate the second operand.
    pub fn is_commutative(&self) -> bool {
        let by_blend = self.facts.blend.is_some_and(|blend| !blend.negate_second);
        by_blend || self.facts.is_commutative
    }
    /// Reports whether it reads the current point.
    pub fn reads_point(&self) -> bool {
        self.inputs.contains(&Input::Point)
    }
    /// Returns the number of operands.
    pub fn arity(&self) -> usize {
        self.inputs
            .iter()
            .filter(|&&input| input == Input::Value)
            .count()
    }
    /// Returns the offset of each parameter, counted in numbers; see [`align`].
    pub fn offsets(&self) -> Vec<usize> {
        let mut next = 0;
        let offset = |p: &Parameter| {
            let start = align(next, p.ty.width());
            next = start + p.ty.width();
            start
        };
        self.parameters.iter().map(offset).collect()
    }
    /// Returns the number of numbers of the parameters, gaps included.
    pub fn parameter_width(&self) -> usize {
        match (self.offsets().last(), self.parameters.last()) {
            (Some(start), Some(last)) => start + last.ty.width(),
            _ => 0,
        }
    }
}

impl Op {
    /// Returns the row.
    pub fn row(self) -> &'static Row {
        &ROWS[self as usize]
    }
    /// Returns the operation with this opcode.
    pub fn from_code(code: u8) -> Option<Self> {
        ROWS.get(usize::from(code)).map(|row| row.op)
    }
    /// Returns the operation with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        ROWS.iter().find(|row| row.name == name).map(|row| row.op)
    }
    /// Reports whether the operation turns a raw field into a distance.
    pub fn is_raw_distance(self) -> bool {
        matches!(
            self,
            Self::FieldDistance | Self::FieldGrowth | Self::Piecewise
        )
    }
}
