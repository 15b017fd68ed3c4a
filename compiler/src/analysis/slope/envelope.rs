//! Continuous lower and upper bounds of a number with discontinuities, as numbers: interval arithmetic
//! on expressions.
//!
//! A floor is between its operand and one less, a fraction between zero and one, a choice between its
//! two alternatives. The bounds hold in every piece of the number, so a step by them need not end where
//! the next piece begins.

use crate::expression::{ExprId, Expression, Expressions, Stage};
use crate::uniforms::postorder;
use sdfc_vm::row::SetOperation;
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// Lower and upper bound of a number at a point.
type Envelope = [ExprId; 2];

/// Builds the bounds of a number. `None` if a discontinuity reaches an operation without a rule here.
pub(super) fn envelope(expressions: &mut Expressions, number: ExprId) -> Option<Envelope> {
    let mut writer = EnvelopeBuilder(expressions);
    let mut envelopes: HashMap<ExprId, Envelope> = HashMap::new();
    for id in postorder(writer.0, number, |_| false) {
        let envelope = match writer.0.get(id).clone() {
            Expression::Apply {
                op,
                point,
                values,
                parameters,
            } if writer.0.stage(id) > Stage::Uniform => {
                let has_width = |id: &ExprId| envelopes[id][0] != envelopes[id][1];
                let operands: Vec<Envelope> = values.iter().map(|id| envelopes[id]).collect();
                if let Some(envelope) = writer.discontinuous_envelope(op, &operands) {
                    envelope
                } else if point.iter().flatten().any(has_width) {
                    writer.constant_envelope(op)?
                } else if !values.iter().any(has_width) {
                    [id; 2]
                } else {
                    writer.operation_envelope(op, &operands, &parameters)?
                }
            }
            _ => [id; 2],
        };
        envelopes.insert(id, envelope);
    }
    envelopes.get(&number).copied()
}

struct EnvelopeBuilder<'a>(&'a mut Expressions);

impl EnvelopeBuilder<'_> {
    /// Returns the bounds of a discontinuous operation.
    fn discontinuous_envelope(&mut self, op: Op, operands: &[Envelope]) -> Option<Envelope> {
        Some(match op {
            Op::Floor => {
                let unit = self.constant(1.0);
                [self.call(Op::Sub, &[operands[0][0], unit]), operands[0][1]]
            }
            Op::Fract | Op::Less => self.constants(0.0, 1.0),
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

    /// Returns the bounds of an operation for any operands.
    fn constant_envelope(&mut self, op: Op) -> Option<Envelope> {
        match op {
            Op::Sin | Op::Cos | Op::Noise => Some(self.constants(-1.0, 1.0)),
            _ => None,
        }
    }

    /// Returns the bounds of an operation by those of its operands.
    fn operation_envelope(
        &mut self,
        op: Op,
        operands: &[Envelope],
        parameters: &[ExprId],
    ) -> Option<Envelope> {
        if let Some(envelope) = self.constant_envelope(op) {
            return Some(envelope);
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
            | Op::Or => Some(self.monotonic_envelope(op, operands, parameters)),
            Op::Neg | Op::Not | Op::Complement => {
                let [lo, hi] = self.monotonic_envelope(op, operands, parameters);
                Some([hi, lo])
            }
            Op::Sub => {
                let [a, b] = [operands[0], operands[1]];
                Some(self.monotonic_envelope(op, &[a, [b[1], b[0]]], parameters))
            }
            Op::Mul => {
                let products = self.at_all_ends(op, operands[0], operands[1]);
                Some(self.min_and_max(&products))
            }
            // A divisor that may be zero leaves no bounds.
            Op::Div if operands[1][0] == operands[1][1] => {
                let quotients = self.at_all_ends(op, operands[0], operands[1]);
                Some(self.min_and_max(&quotients))
            }
            Op::Abs => Some(self.magnitude(operands[0])),
            Op::Square => {
                let [lo, hi] = self.magnitude(operands[0]);
                Some([self.call(op, &[lo]), self.call(op, &[hi])])
            }
            Op::Shell => {
                let magnitude = self.magnitude(operands[0]);
                let outer = self.monotonic_envelope(op, &[magnitude], parameters);
                Some(outer)
            }
            Op::Select => {
                let [a, b] = [operands[1], operands[2]];
                Some(self.min_and_max(&[a[0], a[1], b[0], b[1]]))
            }
            _ => match op.row().facts.set? {
                SetOperation::Union | SetOperation::Intersection => {
                    Some(self.monotonic_envelope(op, operands, parameters))
                }
                SetOperation::Subtraction => {
                    let [a, b] = [operands[0], operands[1]];
                    Some(self.monotonic_envelope(op, &[a, [b[1], b[0]]], parameters))
                }
            },
        }
    }

    /// Applies an operation to all lower and to all upper bounds.
    fn monotonic_envelope(
        &mut self,
        op: Op,
        operands: &[Envelope],
        parameters: &[ExprId],
    ) -> Envelope {
        [0, 1].map(|end| {
            let values: Vec<ExprId> = operands.iter().map(|envelope| envelope[end]).collect();
            let is_zero = |id: ExprId| self.0.as_constant(id) == Some(0.0);
            match (op, values.as_slice()) {
                // A length is recognized by a sum of squares only, without a zero in it.
                (Op::Add, &[a, b]) if is_zero(b) => a,
                (Op::Add, &[a, b]) if is_zero(a) => b,
                _ => self.0.apply(op, None, &values, parameters),
            }
        })
    }

    /// Applies an operation to each bound of one number with each of another.
    fn at_all_ends(&mut self, op: Op, a: Envelope, b: Envelope) -> Vec<ExprId> {
        let mut results: Vec<ExprId> = Vec::new();
        for a in a {
            for b in b {
                results.push(self.call(op, &[a, b]));
            }
        }
        results
    }

    /// Returns the minimum and the maximum of numbers.
    fn min_and_max(&mut self, numbers: &[ExprId]) -> Envelope {
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

    /// Returns the bounds of a number's magnitude.
    fn magnitude(&mut self, [lo, hi]: Envelope) -> Envelope {
        let zero = self.constant(0.0);
        let opposite = self.call(Op::Neg, &[hi]);
        let larger = self.call(Op::Max, &[lo, opposite]);
        let min_magnitude = self.call(Op::Max, &[larger, zero]);
        let [lo, hi] = [lo, hi].map(|end| self.call(Op::Abs, &[end]));
        [min_magnitude, self.call(Op::Max, &[lo, hi])]
    }

    fn constants(&mut self, lo: f64, hi: f64) -> Envelope {
        [lo, hi].map(|end| self.constant(end))
    }

    fn constant(&mut self, value: f64) -> ExprId {
        self.0.constant(value)
    }

    fn call(&mut self, op: Op, values: &[ExprId]) -> ExprId {
        self.0.call(op, values)
    }
}
