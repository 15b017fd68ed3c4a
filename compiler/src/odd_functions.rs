//! Odd functions around raw fields, such as a cube, which change neither the sign nor the surface.
//!
//! At its surface, `pow(g, 7)` is so flat that its gradient is rounding, and `tanh(1e7 * g)` is steep there and constant
//! elsewhere. The field `g` has the same sign everywhere, and so the same surface. It is drawn instead, also in sums of
//! solids (`min`, `max`), in the branches of a selection and above a divisor.
//!
//! `atan(1 / x)` jumps at the pole of `1 / x`, and a jump is a surface. So saturating functions of a field that may
//! have poles are kept.
//!
//! Fields that are zero outside of their solid are replaced, too (`plateaus`).

use crate::expression::{ExprId, Expression, Expressions, Stage};
use crate::plateaus::{KeptSet, without_plateau};
use crate::uniforms::postorder;
use sdfc_vm::row::Continuity;
use sdfc_vm::table::Op;

/// Maximum depth at which functions are found.
const MAX_DEPTH: u32 = 32;
/// Maximum number of factors of a product in which powers are found.
const MAX_FACTORS: usize = 64;

/// Returns a field with the same sign without the odd functions around it, and without plateaus at zero.
pub(crate) fn without_odd_functions(e: &mut Expressions, field: ExprId) -> ExprId {
    without(e, field, KeptSet::Negative, MAX_DEPTH)
}

fn without(e: &mut Expressions, number: ExprId, kept: KeptSet, depth: u32) -> ExprId {
    let Expression::Apply { op, values, .. } = e.get(number).clone() else {
        return number;
    };
    if depth == 0 || e.stage(number) <= Stage::Uniform {
        return number;
    }
    if let Some(rest) = without_plateau(e, op, &values, kept) {
        return without(e, rest, kept, depth - 1);
    }
    match (op, values.as_slice()) {
        (Op::Neg, &[a]) => {
            let a = without(e, a, kept.negated(), depth - 1);
            e.call(Op::Neg, &[a])
        }
        (Op::Min | Op::Max, &[a, b]) => {
            let operands = [a, b].map(|operand| without(e, operand, kept, depth - 1));
            e.call(op, &operands)
        }
        (Op::Select, &[condition, a, b]) => {
            let [a, b] = [a, b].map(|branch| without(e, branch, kept, depth - 1));
            e.call(Op::Select, &[condition, a, b])
        }
        (Op::Div, &[a, b]) => {
            let dividend = without(e, a, kept.divided_by(e, b), depth - 1);
            e.call(Op::Div, &[dividend, b])
        }
        (Op::Sinh, &[a]) => without(e, a, kept, depth - 1),
        (Op::Atan | Op::Tanh | Op::Asin | Op::Sign, &[a]) if !may_have_poles(e, a) => {
            without(e, a, kept, depth - 1)
        }
        (Op::Mul, _) => without_powers(e, number, kept, depth),
        _ => number,
    }
}

/// Reports whether a number may be infinite on both sides of a point.
fn may_have_poles(e: &Expressions, number: ExprId) -> bool {
    postorder(e, number, |_| false)
        .into_iter()
        .any(|id| match e.get(id) {
            Expression::Apply {
                op: Op::Pow,
                values,
                ..
            } => !is_above_zero(e, values[1]),
            Expression::Apply { op, .. } => op.row().facts.continuity == Continuity::HasPoles,
            _ => false,
        })
}

fn is_above_zero(e: &Expressions, number: ExprId) -> bool {
    e.as_constant(number).is_some_and(|value| value > 0.0)
}

/// All factors of a product that are zero at the same points.
struct Power {
    base: ExprId,
    /// Set if the product changes its sign with the base.
    is_odd: bool,
    /// One factor, as it is written.
    written: ExprId,
    count: u32,
}

/// Returns a product with the same sign, in which no odd power of a factor is left.
fn without_powers(e: &mut Expressions, product: ExprId, kept: KeptSet, depth: u32) -> ExprId {
    let Some((uniform, powers)) = powers_of(e, product) else {
        return product;
    };
    let is_single = powers.len() == 1;
    let kept = (uniform.iter()).fold(kept, |kept, &factor| kept.divided_by(e, factor));
    let mut is_changed = false;
    let mut factors = uniform;
    // A square is zero in sheets without thickness at most.
    let takes_squares = kept != KeptSet::Both && powers.iter().any(|power| power.is_odd);
    for power in powers {
        if takes_squares && !power.is_odd && has_thin_zeros(e, power.base) {
            is_changed = true;
            continue;
        }
        let factor = match (power.is_odd, power.count) {
            (true, 1) => power.written,
            (true, _) => power.base,
            (false, 1) => power.written,
            (false, _) => e.call(Op::Square, &[power.base]),
        };
        is_changed |= power.is_odd && power.count > 1;
        // Functions around single factors of a product do not determine how flat or steep it is.
        let reduced = match is_single {
            true => without(e, factor, kept, depth - 1),
            false => factor,
        };
        is_changed |= reduced != factor;
        factors.push(reduced);
    }
    if !is_changed {
        return product;
    }
    let factors = factors.into_iter();
    let product = factors.reduce(|product, factor| e.call(Op::Mul, &[product, factor]));
    product.unwrap_or_else(|| unreachable!("a product has factors"))
}

/// Takes apart a product into its uniform factors and the powers of all others. `None` for too many.
fn powers_of(e: &mut Expressions, product: ExprId) -> Option<(Vec<ExprId>, Vec<Power>)> {
    let mut uniform = Vec::new();
    let mut powers: Vec<Power> = Vec::new();
    let mut pending = vec![product];
    for _ in 0..MAX_FACTORS {
        let Some(factor) = pending.pop() else {
            return Some((uniform, powers));
        };
        if e.stage(factor) <= Stage::Uniform {
            uniform.push(factor);
            continue;
        }
        let (op, values) = match e.get(factor) {
            Expression::Apply { op, values, .. } => (Some(*op), values.as_slice()),
            _ => (None, &[][..]),
        };
        match (op, values) {
            (Some(Op::Mul), &[a, b]) => pending.extend([b, a]),
            (Some(Op::Square), &[a]) if is_product(e, a) => pending.extend([a, a]),
            (Some(Op::Neg), &[a]) => {
                pending.push(a);
                uniform.push(e.constant(-1.0));
            }
            (Some(Op::Sign), &[base]) => add(&mut powers, base, true, factor),
            _ => match base_of_magnitude(e, factor) {
                Some(base) => add(&mut powers, base, false, factor),
                None => add(&mut powers, factor, true, factor),
            },
        }
    }
    None
}

/// Reports whether a number is zero in no part of space, unless everywhere: a polynomial with constant coefficients, or a
/// root of one.
fn has_thin_zeros(e: &Expressions, number: ExprId) -> bool {
    postorder(e, number, |_| false)
        .into_iter()
        .all(|id| match e.get(id) {
            Expression::Constant(_) | Expression::Coordinate(_) => true,
            Expression::Apply { op, .. } => matches!(
                op,
                Op::X
                    | Op::Y
                    | Op::Z
                    | Op::Add
                    | Op::Sub
                    | Op::Mul
                    | Op::Neg
                    | Op::Square
                    | Op::Sqrt
            ),
            _ => false,
        })
}

fn is_product(e: &Expressions, number: ExprId) -> bool {
    matches!(
        e.get(number),
        Expression::Apply {
            op: Op::Mul | Op::Square | Op::Neg,
            ..
        }
    )
}

/// Returns the number of which this is a power that is negative nowhere, such as a square.
fn base_of_magnitude(e: &Expressions, number: ExprId) -> Option<ExprId> {
    let Expression::Apply { op, values, .. } = e.get(number) else {
        return None;
    };
    match (op, values.as_slice()) {
        (Op::Square | Op::Abs, &[a]) => Some(base_of_magnitude(e, a).unwrap_or(a)),
        (Op::Sqrt, &[a]) => base_of_magnitude(e, a),
        (Op::Pow, &[a, exponent]) if is_above_zero(e, exponent) => base_of_magnitude(e, a),
        _ => None,
    }
}

/// Adds a factor to the powers of a product.
fn add(powers: &mut Vec<Power>, base: ExprId, changes_sign: bool, written: ExprId) {
    match powers.iter_mut().find(|power| power.base == base) {
        Some(power) => {
            power.is_odd ^= changes_sign;
            power.count += 1;
        }
        None => powers.push(Power {
            base,
            is_odd: changes_sign,
            written,
            count: 1,
        }),
    }
}
