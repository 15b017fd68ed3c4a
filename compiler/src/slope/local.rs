//! Bounds of changes near a point, for numbers whose slope has no bound: around the axis of an angle, beside a pole,
//! where a root begins.
//!
//! Within a distance `d`, it changes by at most `slope · d / (1 − growth · d)`. Sums, products and quotients of numbers of
//! which this is known are bounded so again, and so is what the elementary functions make of them. All is written as
//! numbers, for each point its own.

use super::held::Throughout;
use crate::boxes::Held;
use crate::expression::{ExprId, Expression, Expressions};
use crate::scene::NOWHERE;
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// A bound of a number's changes around a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Local {
    /// The slope at the point.
    pub(super) slope: ExprId,
    /// One over the distance at which nothing is known any more; `None` for zero.
    pub(super) growth: Option<ExprId>,
    /// A distance up to which this holds; `None` where it does for all.
    pub(super) radius: Option<ExprId>,
}

impl Local {
    /// One bound for all points.
    pub(super) fn everywhere(expressions: &mut Expressions, slope: f64) -> Self {
        Self {
            slope: expressions.constant(slope),
            growth: None,
            radius: None,
        }
    }

    /// Reports whether it is one bound for all points.
    pub(super) fn is_constant(&self, expressions: &Expressions) -> bool {
        self.growth.is_none() && expressions.as_constant(self.slope).is_some()
    }
}

/// A bound of a number's changes around each point, the same for all points where it has one that is no worse.
/// Operations that jump, and choices, are held. `None` for operations about which nothing is known.
pub(super) fn local(
    expressions: &mut Expressions,
    number: ExprId,
    held: Held,
    throughout: &mut Throughout,
) -> Option<Local> {
    Writer::new(expressions, held, throughout).local(number)
}

/// The same for a number that is known to have no bound throughout.
pub(super) fn unbounded(
    expressions: &mut Expressions,
    number: ExprId,
    held: Held,
    throughout: &mut Throughout,
) -> Option<Local> {
    Writer::new(expressions, held, throughout).of_operation(number)
}

struct Writer<'a, 'b> {
    e: &'a mut Expressions,
    held: Held,
    throughout: &'a mut Throughout<'b>,
    known: HashMap<ExprId, Option<Local>>,
}

impl<'a, 'b> Writer<'a, 'b> {
    fn new(e: &'a mut Expressions, held: Held, throughout: &'a mut Throughout<'b>) -> Self {
        Self {
            e,
            held,
            throughout,
            known: HashMap::new(),
        }
    }

    /// Recursion over operands.
    fn local(&mut self, number: ExprId) -> Option<Local> {
        if let Some(&known) = self.known.get(&number) {
            return known;
        }
        let bound = self.throughout.slope(self.e, &[number], self.held);
        let is_even = bound.is_some_and(|slope| !self.throughout.is_uneven(self.e, number, slope));
        let mut local = None;
        if !is_even {
            local = self.of_operation(number);
        }
        let local = local.or_else(|| Some(Local::everywhere(self.e, bound?)));
        self.known.insert(number, local);
        local
    }

    fn of_operation(&mut self, number: ExprId) -> Option<Local> {
        let Expression::Apply { op, values, .. } = self.e.get(number).clone() else {
            return None;
        };
        match (op, values.as_slice()) {
            (Op::Floor | Op::Less, _) => Some(Local::everywhere(self.e, 0.0)),
            (Op::Neg | Op::Abs | Op::Fract | Op::Sin | Op::Cos | Op::Atan | Op::Tanh, &[a]) => {
                self.local(a)
            }
            (Op::Modulo, &[a, b]) => self.of_remainder(number, a, b),
            (Op::Add | Op::Sub, &[a, b]) => self.of_both(a, b, Op::Add),
            (Op::Min | Op::Max, &[a, b]) => match [a, b].map(|id| self.e.as_constant(id)) {
                [None, Some(_)] => self.of_limited(number, a),
                [Some(_), None] => self.of_limited(number, b),
                _ => self.of_both(a, b, Op::Max),
            },
            (Op::Clamp, &[a, low, high])
                if [low, high]
                    .map(|id| self.e.as_constant(id))
                    .iter()
                    .all(Option::is_some) =>
            {
                self.of_limited(number, a)
            }
            (Op::Select, &[condition, a, b]) => self.of_choice(condition, a, b),
            (Op::Mul, &[a, b]) => self.of_product(a, b),
            (Op::Div, &[a, b]) => self.of_quotient(a, b),
            (Op::Square, &[a]) => self.of_product(a, a),
            (Op::Atan2, &[y, x]) => self.of_angle(y, x),
            // tan(a + h) − tan(a) = (1 + tan²(a)) tan(h) / (1 − tan(a) tan(h)), and tan(h) ≤ h / (1 − 2h/π).
            (Op::Tan, &[a]) => {
                let square = self.call(Op::Mul, &[number, number]);
                let slope = self.plus(square, 1.0);
                let size = self.call(Op::Abs, &[number]);
                let growth = self.plus(size, std::f64::consts::FRAC_2_PI);
                self.chained(a, slope, growth)
            }
            // With x = h/a: −ln(1 − x) ≤ x / (1 − x).
            (Op::Ln | Op::Log2, &[a]) => {
                let growth = self.over(a, 1.0);
                let slope = self.over(a, std::f64::consts::LOG2_E);
                self.chained(a, if op == Op::Ln { growth } else { slope }, growth)
            }
            // exp(h) − 1 ≤ h / (1 − h/2).
            (Op::Exp | Op::Exp2, &[a]) => {
                let base = if op == Op::Exp {
                    1.0
                } else {
                    std::f64::consts::LN_2
                };
                self.of_power(number, a, base)
            }
            (Op::Pow, &[base, a]) if self.e.as_constant(base).is_some_and(|base| base > 0.0) => {
                let base = self.e.as_constant(base)?.ln();
                self.of_power(number, a, base.abs())
            }
            // 1 − √(1 − x) ≤ (x/2) / (1 − x/2).
            (Op::Sqrt, &[a]) => {
                if let Some(parts) = self.squared(a) {
                    return self.of_length(&parts);
                }
                let (slope, growth) = (self.over(number, 0.5), self.over(a, 0.5));
                self.chained(a, slope, growth)
            }
            // 1/√(1 − x) − 1 ≤ (x/2) / (1 − x).
            (Op::InverseSqrt, &[a]) => {
                let cube = self.call(Op::Mul, &[number, number]);
                let cube = self.call(Op::Mul, &[cube, number]);
                let half = self.e.constant(0.5);
                let slope = self.call(Op::Mul, &[cube, half]);
                let growth = self.over(a, 1.0);
                self.chained(a, slope, growth)
            }
            // With x = h / (1 − |a|): 2 − 2√(1 − x) ≤ x / (1 − x/2).
            (Op::Asin | Op::Acos, &[a]) => {
                let one = self.e.constant(1.0);
                let size = self.call(Op::Abs, &[a]);
                let rest = self.call(Op::Sub, &[one, size]);
                let rest = self.call(Op::Abs, &[rest]);
                let other = self.call(Op::Add, &[one, size]);
                let square = self.call(Op::Mul, &[rest, other]);
                let root = self.call(Op::Sqrt, &[square]);
                let (slope, growth) = (self.over(root, 1.0), self.over(rest, 0.5));
                self.chained(a, slope, growth)
            }
            _ => None,
        }
    }

    fn of_both(&mut self, a: ExprId, b: ExprId, op: Op) -> Option<Local> {
        let (a, b) = (self.local(a)?, self.local(b)?);
        let slope = self.call(op, &[a.slope, b.slope]);
        Some(self.within_both(slope, a, b))
    }

    /// One of two numbers, as long as the choice stays.
    fn of_choice(&mut self, condition: ExprId, a: ExprId, b: ExprId) -> Option<Local> {
        let (a, b) = (self.local(a)?, self.local(b)?);
        let mut chosen = |a: Option<ExprId>, b: Option<ExprId>, neither: f64| {
            a.or(b)?;
            let neither = self.e.constant(neither);
            let operands = [condition, a.unwrap_or(neither), b.unwrap_or(neither)];
            Some(self.e.call(Op::Select, &operands))
        };
        Some(Local {
            slope: chosen(Some(a.slope), Some(b.slope), 0.0)?,
            growth: chosen(a.growth, b.growth, 0.0),
            radius: chosen(a.radius, b.radius, NOWHERE),
        })
    }

    /// A number that is kept above or below an end. Well beyond it, nothing changes until the number is back.
    fn of_limited(&mut self, number: ExprId, a: ExprId) -> Option<Local> {
        let local = self.local(a)?;
        let Some(growth) = local.growth else {
            return Some(local);
        };
        let beyond = self.call(Op::Sub, &[a, number]);
        let beyond = self.call(Op::Abs, &[beyond]);
        let more = self.call(Op::Mul, &[growth, beyond]);
        let slope = self.call(Op::Add, &[local.slope, more]);
        let back = self.call(Op::Div, &[beyond, slope]);
        let back = self.of_two(Op::Min, Some(back), local.radius)?;
        // The share of the way to where nothing is known any more.
        let share = self.call(Op::Mul, &[back, growth]);
        let [zero, half, nowhere] = [0.0, 0.5, NOWHERE].map(|value| self.e.constant(value));
        let is_beyond = self.call(Op::Less, &[half, share]);
        let radius = local.radius.unwrap_or(nowhere);
        Some(Local {
            slope: self.call(Op::Select, &[is_beyond, zero, local.slope]),
            growth: local.growth,
            radius: Some(self.call(Op::Select, &[is_beyond, back, radius])),
        })
    }

    /// A remainder, by the whole number of divisors that is taken away.
    fn of_remainder(&mut self, number: ExprId, a: ExprId, b: ExprId) -> Option<Local> {
        let (divided, divisor) = (self.local(a)?, self.local(b)?);
        if self.e.as_constant(divisor.slope) == Some(0.0) {
            return Some(divided);
        }
        let away = self.call(Op::Sub, &[a, number]);
        let whole = self.call(Op::Div, &[away, b]);
        let whole = self.call(Op::Abs, &[whole]);
        let more = self.call(Op::Mul, &[whole, divisor.slope]);
        let slope = self.call(Op::Add, &[divided.slope, more]);
        Some(self.within_both(slope, divided, divisor))
    }

    fn of_product(&mut self, a: ExprId, b: ExprId) -> Option<Local> {
        let (first, second) = (self.local(a)?, self.local(b)?);
        let [a, b] = [a, b].map(|value| self.call(Op::Abs, &[value]));
        let one = self.call(Op::Mul, &[a, second.slope]);
        let other = self.call(Op::Mul, &[b, first.slope]);
        let slope = self.call(Op::Add, &[one, other]);
        // Both change at once.
        let both = self.call(Op::Mul, &[first.slope, second.slope]);
        let growth = match self.e.as_constant(both) {
            Some(0.0) => None,
            _ => Some(self.call(Op::Div, &[both, slope])),
        };
        let operands = self.within_both(slope, first, second);
        Some(Local {
            growth: self.of_two(Op::Add, operands.growth, growth),
            ..operands
        })
    }

    fn of_quotient(&mut self, a: ExprId, b: ExprId) -> Option<Local> {
        let (above, below) = (self.local(a)?, self.local(b)?);
        let size = self.call(Op::Abs, &[b]);
        let quotient = self.call(Op::Div, &[a, b]);
        let quotient = self.call(Op::Abs, &[quotient]);
        let turned = self.call(Op::Mul, &[quotient, below.slope]);
        let sum = self.call(Op::Add, &[above.slope, turned]);
        let growth = self.call(Op::Div, &[below.slope, size]);
        let slope = self.call(Op::Div, &[sum, size]);
        let operands = self.within_both(slope, above, below);
        Some(Local {
            growth: self.of_two(Op::Add, operands.growth, Some(growth)),
            ..operands
        })
    }

    /// The direction of a vector, up to where the vector may be zero: asin(x) ≤ x / (1 − (1 − 2/π) x) there.
    fn of_angle(&mut self, y: ExprId, x: ExprId) -> Option<Local> {
        let steep = self.throughout.slope(self.e, &[y, x], self.held)?;
        let [y, x] = [y, x].map(|v| self.call(Op::Mul, &[v, v]));
        let square = self.call(Op::Add, &[y, x]);
        let length = self.call(Op::Sqrt, &[square]);
        let factor = self.e.constant(1.0 / steep);
        Some(Local {
            slope: self.over(length, steep),
            growth: Some(self.over(length, steep * (1.0 - std::f64::consts::FRAC_2_PI))),
            radius: Some(self.call(Op::Mul, &[length, factor])),
        })
    }

    /// The numbers of whose squares a number is the sum. Recursion over sums.
    fn squared(&self, id: ExprId) -> Option<Vec<ExprId>> {
        let Expression::Apply { op, values, .. } = self.e.get(id) else {
            return None;
        };
        match (op, values.as_slice()) {
            (Op::Add, &[a, b]) => Some([self.squared(a)?, self.squared(b)?].concat()),
            (Op::Mul, &[a, b]) if a == b => Some(vec![a]),
            (Op::Square, &[a]) => Some(vec![a]),
            _ => None,
        }
    }

    /// The length of a vector.
    fn of_length(&mut self, parts: &[ExprId]) -> Option<Local> {
        let mut all: Option<Local> = None;
        for &part in parts {
            let local = self.local(part)?;
            let square = self.call(Op::Mul, &[local.slope, local.slope]);
            all = Some(match all {
                Some(all) => {
                    let sum = self.call(Op::Add, &[all.slope, square]);
                    self.within_both(sum, all, local)
                }
                None => Local {
                    slope: square,
                    ..local
                },
            });
        }
        let all = all?;
        Some(Local {
            slope: self.call(Op::Sqrt, &[all.slope]),
            ..all
        })
    }

    /// An exponential of a number, by the logarithm of its base.
    fn of_power(&mut self, number: ExprId, a: ExprId, base: f64) -> Option<Local> {
        let [factor, growth] = [base, base / 2.0].map(|value| self.e.constant(value));
        let slope = self.call(Op::Mul, &[number, factor]);
        self.chained(a, slope, growth)
    }

    /// A function of a number, by its slope and its growth in that number.
    fn chained(&mut self, a: ExprId, slope: ExprId, growth: ExprId) -> Option<Local> {
        let local = self.local(a)?;
        let own = self.call(Op::Mul, &[growth, local.slope]);
        Some(Local {
            slope: self.call(Op::Mul, &[slope, local.slope]),
            growth: self.of_two(Op::Add, local.growth, Some(own)),
            radius: local.radius,
        })
    }

    fn over(&mut self, a: ExprId, value: f64) -> ExprId {
        let value = self.e.constant(value);
        let size = self.call(Op::Abs, &[a]);
        self.call(Op::Div, &[value, size])
    }

    fn plus(&mut self, a: ExprId, value: f64) -> ExprId {
        let value = self.e.constant(value);
        self.call(Op::Add, &[a, value])
    }

    /// A slope that holds where what is known of two numbers does.
    fn within_both(&mut self, slope: ExprId, a: Local, b: Local) -> Local {
        Local {
            slope,
            growth: self.of_two(Op::Max, a.growth, b.growth),
            radius: self.of_two(Op::Min, a.radius, b.radius),
        }
    }

    fn of_two(&mut self, op: Op, a: Option<ExprId>, b: Option<ExprId>) -> Option<ExprId> {
        match (a, b) {
            (Some(a), Some(b)) => Some(self.call(op, &[a, b])),
            (one, other) => one.or(other),
        }
    }

    fn call(&mut self, op: Op, values: &[ExprId]) -> ExprId {
        self.e.call(op, values)
    }
}
