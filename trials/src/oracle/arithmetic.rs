//! Arithmetic rows in `f64`.

use sdfc_vm::table::Op;

/// Smallest magnitude of a divisor. Smaller ones are replaced by it.
const MIN_DIVISOR: f64 = 1e-18;
/// Lower limit of the operand of an inverse square root.
const MIN_INVERSE_SQRT_OPERAND: f64 = 1e-30;

/// Applies an arithmetic operation to its operands, in order.
///
/// # Panics
///
/// Panics for operations that are not arithmetic. The elaborator creates no numbers from those.
pub(super) fn arithmetic(op: Op, [a, b, c]: [f64; 3]) -> f64 {
    let truth = |holds: bool| if holds { 1.0 } else { 0.0 };
    match op {
        Op::Add => a + b,
        Op::Sub => a - b,
        Op::Mul => a * b,
        Op::Square => a * a,
        Op::Div => a / divisor(b),
        Op::Modulo => a - divisor(b) * (a / divisor(b)).floor(),
        Op::Neg => -a,
        Op::Abs => a.abs(),
        Op::Sign if a == 0.0 => 0.0,
        Op::Sign => a.signum(),
        Op::Min | Op::Union => a.min(b),
        Op::Max | Op::Intersection => a.max(b),
        Op::Clamp => a.max(b).min(c),
        Op::Floor => a.floor(),
        Op::Ceil => a.ceil(),
        Op::Round => (a + 0.5).floor(),
        Op::Fract => a - a.floor(),
        Op::Trunc => a.trunc(),
        Op::Sqrt => a.max(0.0).sqrt(),
        Op::InverseSqrt => a.max(MIN_INVERSE_SQRT_OPERAND).sqrt().recip(),
        Op::Sin => a.sin(),
        Op::Cos => a.cos(),
        Op::Tan => a.tan(),
        Op::Asin => a.clamp(-1.0, 1.0).asin(),
        Op::Acos => a.clamp(-1.0, 1.0).acos(),
        Op::Atan => a.atan(),
        Op::Atan2 => a.atan2(b),
        Op::Sinh => a.sinh(),
        Op::Cosh => a.cosh(),
        Op::Tanh => a.tanh(),
        Op::Exp => a.exp(),
        Op::Exp2 => a.exp2(),
        Op::Ln => a.max(f64::MIN_POSITIVE).ln(),
        Op::Log2 => a.max(f64::MIN_POSITIVE).log2(),
        Op::Pow => a.max(0.0).powf(b),
        Op::Step => truth(b >= a),
        Op::Smoothstep => {
            let t = ((c - a) / divisor(b - a)).clamp(0.0, 1.0);
            t * t * (3.0 - 2.0 * t)
        }
        Op::Mix => a + (b - a) * c,
        Op::Less => truth(a < b),
        Op::And => a.min(b),
        Op::Or => a.max(b),
        Op::Not => 1.0 - a,
        Op::Select if a > 0.5 => b,
        Op::Select => c,
        _ => panic!("`{op:?}` is no arithmetic"),
    }
}

/// Returns a divisor kept away from zero.
fn divisor(b: f64) -> f64 {
    if b.abs() < MIN_DIVISOR {
        MIN_DIVISOR
    } else {
        b
    }
}
