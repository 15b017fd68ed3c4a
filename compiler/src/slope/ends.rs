//! The least and the greatest that a number which jumps may be, as numbers that do not jump: interval arithmetic on
//! expressions.
//!
//! A floor is between its operand and one less, a fraction between zero and one, a choice between both of what is chosen
//! from. The ends hold in every piece of the number, so a step by them need not end where the next piece begins.

use crate::expression::{ExprId, Expression, Expressions, Stage};
use crate::uniforms::operands_first;
use sdfc_vm::row::SetOperation;
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// The least and the greatest that a number may be at a point.
type Ends = [ExprId; 2];

/// The ends of a number, whose jumps are all among rows that have a rule here.
pub(super) fn ends(expressions: &mut Expressions, number: ExprId) -> Option<Ends> {
    let mut writer = Writer(expressions);
    let mut found: HashMap<ExprId, Ends> = HashMap::new();
    for id in operands_first(writer.0, number, |_| false) {
        let ends = match writer.0.get(id).clone() {
            Expression::Apply {
                op,
                point,
                values,
                parameters,
            } if writer.0.stage(id) > Stage::Uniform => {
                let is_wide = |id: &ExprId| found[id][0] != found[id][1];
                let operands: Vec<Ends> = values.iter().map(|id| found[id]).collect();
                if let Some(ends) = writer.jump(op, &operands) {
                    ends
                } else if point.iter().flatten().any(is_wide) {
                    writer.bounded(op)?
                } else if !values.iter().any(is_wide) {
                    [id; 2]
                } else {
                    writer.row(op, &operands, &parameters)?
                }
            }
            _ => [id; 2],
        };
        found.insert(id, ends);
    }
    found.get(&number).copied()
}

struct Writer<'a>(&'a mut Expressions);

impl Writer<'_> {
    /// The ends of an operation that jumps.
    fn jump(&mut self, op: Op, operands: &[Ends]) -> Option<Ends> {
        Some(match op {
            Op::Floor => {
                let one = self.constant(1.0);
                [self.call(Op::Sub, &[operands[0][0], one]), operands[0][1]]
            }
            Op::Fract | Op::Less => self.between(0.0, 1.0),
            Op::Modulo => {
                let zero = self.constant(0.0);
                [
                    self.call(Op::Min, &[operands[1][0], zero]),
                    self.call(Op::Max, &[operands[1][1], zero]),
                ]
            }
            _ => return None,
        })
    }

    /// The ends of a row whatever it reads.
    fn bounded(&mut self, op: Op) -> Option<Ends> {
        match op {
            Op::Sin | Op::Cos | Op::Noise => Some(self.between(-1.0, 1.0)),
            _ => None,
        }
    }

    /// The ends of a row by those of its operands.
    fn row(&mut self, op: Op, operands: &[Ends], parameters: &[ExprId]) -> Option<Ends> {
        if let Some(ends) = self.bounded(op) {
            return Some(ends);
        }
        match op {
            Op::Add
            | Op::Min
            | Op::Max
            | Op::Clamp
            | Op::Sqrt
            | Op::Exp
            | Op::Exp2
            | Op::Ln
            | Op::Log2
            | Op::Atan
            | Op::Tanh
            | Op::Offset
            | Op::And
            | Op::Or => Some(self.rising(op, operands, parameters)),
            Op::Neg | Op::Not | Op::Complement => {
                let [lo, hi] = self.rising(op, operands, parameters);
                Some([hi, lo])
            }
            Op::Sub => {
                let [a, b] = [operands[0], operands[1]];
                Some(self.rising(op, &[a, [b[1], b[0]]], parameters))
            }
            Op::Mul => {
                let products = self.pairs(op, operands[0], operands[1]);
                Some(self.around(&products))
            }
            // A divisor that may be zero leaves no ends.
            Op::Div if operands[1][0] == operands[1][1] => {
                let quotients = self.pairs(op, operands[0], operands[1]);
                Some(self.around(&quotients))
            }
            Op::Abs => Some(self.size(operands[0])),
            Op::Square => {
                let [lo, hi] = self.size(operands[0]);
                Some([self.call(op, &[lo]), self.call(op, &[hi])])
            }
            Op::Shell => {
                let size = self.size(operands[0]);
                let outer = self.rising(op, &[size], parameters);
                Some(outer)
            }
            Op::Select => {
                let [a, b] = [operands[1], operands[2]];
                Some(self.around(&[a[0], a[1], b[0], b[1]]))
            }
            _ => match op.row().meta.set? {
                SetOperation::Union | SetOperation::Intersection => {
                    Some(self.rising(op, operands, parameters))
                }
                SetOperation::Subtraction => {
                    let [a, b] = [operands[0], operands[1]];
                    Some(self.rising(op, &[a, [b[1], b[0]]], parameters))
                }
            },
        }
    }

    /// A row of all lower and of all upper ends.
    fn rising(&mut self, op: Op, operands: &[Ends], parameters: &[ExprId]) -> Ends {
        [0, 1].map(|end| {
            let values: Vec<ExprId> = operands.iter().map(|ends| ends[end]).collect();
            let is_zero = |id: ExprId| self.0.as_constant(id) == Some(0.0);
            match (op, values.as_slice()) {
                // A length is known as such by its squares alone.
                (Op::Add, &[a, b]) if is_zero(b) => a,
                (Op::Add, &[a, b]) if is_zero(a) => b,
                _ => self.0.apply(op, None, &values, parameters),
            }
        })
    }

    /// A row of each end of one number with each of another.
    fn pairs(&mut self, op: Op, a: Ends, b: Ends) -> Vec<ExprId> {
        let mut all: Vec<ExprId> = Vec::new();
        for a in a {
            for b in b {
                all.push(self.call(op, &[a, b]));
            }
        }
        all
    }

    /// The least and the greatest of some numbers.
    fn around(&mut self, numbers: &[ExprId]) -> Ends {
        let mut numbers = numbers.to_vec();
        numbers.sort_unstable();
        numbers.dedup();
        let (first, others) = (numbers[0], &numbers[1..]);
        [Op::Min, Op::Max].map(|op| {
            others
                .iter()
                .fold(first, |sum, &next| self.call(op, &[sum, next]))
        })
    }

    /// The ends of a number without its sign.
    fn size(&mut self, [lo, hi]: Ends) -> Ends {
        let zero = self.constant(0.0);
        let opposite = self.call(Op::Neg, &[hi]);
        let larger = self.call(Op::Max, &[lo, opposite]);
        let least = self.call(Op::Max, &[larger, zero]);
        let [lo, hi] = [lo, hi].map(|end| self.call(Op::Abs, &[end]));
        [least, self.call(Op::Max, &[lo, hi])]
    }

    fn between(&mut self, lo: f64, hi: f64) -> Ends {
        [lo, hi].map(|end| self.constant(end))
    }

    fn constant(&mut self, value: f64) -> ExprId {
        self.0.constant(value)
    }

    fn call(&mut self, op: Op, values: &[ExprId]) -> ExprId {
        self.0.call(op, values)
    }
}
