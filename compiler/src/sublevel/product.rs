//! Sets of products and quotients, from the signs of their factors.

use super::{Level, Node, Signs, Sublevels, is_above_zero};
use crate::expression::{ExprId, Expression, Expressions, Stage};
use crate::sublevel::set::{Set, negated};
use crate::uniforms::postorder;
use sdfc_vm::table::Op;

/// Maximum number of factors of a product in which powers are found.
const MAX_FACTORS: usize = 64;

/// All factors of a product that are zero at the same points.
#[derive(Clone, Copy)]
struct Power {
    base: ExprId,
    /// Set if the product changes its sign with the base.
    is_odd: bool,
    /// One factor, as it is written.
    written: ExprId,
    count: u32,
}

impl Signs {
    /// Signs of a positive number.
    const POSITIVE: Self = Self {
        negative: Set::Empty,
        positive: Set::All,
    };

    fn negated(self) -> Self {
        Self {
            negative: self.positive,
            positive: self.negative,
        }
    }

    /// Returns the signs of a product.
    fn times(self, other: Self, e: &mut Expressions) -> Self {
        let mut either = |[a, b]: [Set; 2], [c, d]: [Set; 2]| {
            let first = a.intersection(b, e);
            let second = c.intersection(d, e);
            first.union(second, e)
        };
        Self {
            negative: either(
                [self.negative, other.positive],
                [self.positive, other.negative],
            ),
            positive: either(
                [self.positive, other.positive],
                [self.negative, other.negative],
            ),
        }
    }

    /// Returns the field that has both signs.
    fn field(self, e: &mut Expressions) -> Option<ExprId> {
        let (Set::Field(field), Set::Field(negative)) = (self.negative, self.positive) else {
            return None;
        };
        (negative == negated(e, field)).then_some(field)
    }

    fn below(self, level: Level, e: &mut Expressions) -> Set {
        match level.is_included {
            false => self.negative,
            true => self.positive.complement(e),
        }
    }
}

impl Sublevels<'_, '_> {
    /// Returns the set at which a product or a quotient is negative, or not positive.
    pub(super) fn of_product(
        &mut self,
        Node { number, op, values }: Node<'_>,
        level: Level,
        depth: u32,
    ) -> Option<Set> {
        match (op, values) {
            (Op::Div, &[a, b]) => self.of_quotient(number, [a, b], level, depth),
            _ => self.of_powers(number, level, depth),
        }
    }

    fn of_quotient(
        &mut self,
        number: ExprId,
        [a, b]: [ExprId; 2],
        level: Level,
        depth: u32,
    ) -> Option<Set> {
        let signs = self.signs(a, depth);
        let dividend = signs.field(self.e);
        if dividend == Some(a) && !self.is_one_sided(b) {
            return Some(Set::Field(number));
        }
        if self.e.stage(b) <= Stage::Uniform {
            let divisor = self.signs_of_uniform(b)?;
            return Some(signs.times(divisor, self.e).below(level, self.e));
        }
        if let Some(dividend) = dividend
            && !self.is_one_sided(b)
        {
            return Some(Set::Field(self.e.call(Op::Div, &[dividend, b])));
        }
        let divisor = self.signs(b, depth);
        Some(signs.times(divisor, self.e).below(level, self.e))
    }

    /// Reports whether a number has a plateau at zero, or is a root that is not defined beyond it.
    fn is_one_sided(&mut self, number: ExprId) -> bool {
        self.e.stage(number) > Stage::Uniform
            && (self.has_plateau(number, Level::ZERO) || self.is_root(number))
    }

    /// Returns the signs of a number that depends on no point; `None` if they vary.
    fn signs_of_uniform(&mut self, number: ExprId) -> Option<Signs> {
        let range = self.range(number);
        match range.lo > 0.0 {
            true => Some(Signs::POSITIVE),
            false => (range.hi < 0.0).then(|| Signs::POSITIVE.negated()),
        }
    }

    /// Returns the set of a product without odd powers, in which factors that are never negative are sets.
    fn of_powers(&mut self, product: ExprId, level: Level, depth: u32) -> Option<Set> {
        let (uniform, mut powers) = powers_of(self.e, product)?;
        let count = powers.len();
        // A square is zero in sheets without thickness at most.
        if powers.iter().any(|power| power.is_odd) {
            powers.retain(|power| power.is_odd || !has_thin_zeros(self.e, power.base));
        }
        let is_set = |this: &mut Self, power: &Power| {
            this.is_one_sided(power.written) || this.is_one_sided(power.base)
        };
        let are_sets: Vec<bool> = powers.iter().map(|power| is_set(self, power)).collect();
        if !are_sets.contains(&true) {
            if let Some(signs) = self.signs_of_multiple(&uniform, &powers, depth) {
                return Some(signs.below(level, self.e));
            }
            let powers = self.rebuilt(product, &uniform, &powers, powers.len() < count, depth);
            return Some(Set::Field(powers));
        }
        let mut signs = Signs::POSITIVE;
        let mut scale = None;
        for factor in uniform {
            if let Some(factor) = self.signs_of_uniform(factor) {
                signs = signs.times(factor, self.e);
                continue;
            }
            // A live factor may be zero. Then nothing is inside.
            if scale.is_some() || self.range(factor).lo < 0.0 {
                return None;
            }
            scale = Some(factor);
        }
        let mut rest = None;
        for (power, is_set) in powers.iter().zip(are_sets) {
            if !is_set {
                let factor = self.reduced(power);
                rest = Some(rest.map_or(factor, |rest| self.e.call(Op::Mul, &[rest, factor])));
                continue;
            }
            let mut factor = self.proved_signs(power.base, depth);
            if !power.is_odd {
                factor = factor.times(factor, self.e);
            }
            signs = signs.times(factor, self.e);
        }
        if let Some(rest) = rest {
            let rest = self.proved_signs(rest, depth);
            signs = signs.times(rest, self.e);
        }
        Some(match (scale, signs.below(level, self.e)) {
            (Some(scale), Set::Field(field)) => Set::Field(self.e.call(Op::Mul, &[scale, field])),
            (_, set) => set,
        })
    }

    /// Returns the signs of a multiple of a number whose parts have plateaus: they are those of the number alone. `None` for
    /// other products.
    fn signs_of_multiple(
        &mut self,
        uniform: &[ExprId],
        powers: &[Power],
        depth: u32,
    ) -> Option<Signs> {
        let &[power @ Power { is_odd: true, .. }] = powers else {
            return None;
        };
        let factor = self.reduced(&power);
        let signs = self.signs(factor, depth);
        if signs.field(self.e).is_some() {
            return None;
        }
        uniform.iter().try_fold(signs, |signs, &factor| {
            let factor = self.signs_of_uniform(factor)?;
            Some(signs.times(factor, self.e))
        })
    }

    /// Returns the signs of a factor, of which its range may exclude one.
    fn proved_signs(&mut self, number: ExprId, depth: u32) -> Signs {
        let range = self.range(number);
        let signs = self.signs(number, depth);
        Signs {
            negative: if range.lo >= 0.0 {
                Set::Empty
            } else {
                signs.negative
            },
            positive: if range.hi <= 0.0 {
                Set::Empty
            } else {
                signs.positive
            },
        }
    }

    /// Returns one factor for all of a power.
    fn reduced(&mut self, power: &Power) -> ExprId {
        match (power.is_odd, power.count) {
            (_, 1) => power.written,
            (true, _) => power.base,
            (false, _) => self.e.call(Op::Square, &[power.base]),
        }
    }

    /// Returns the product of numbers without plateaus, or the product as written if nothing of it is changed.
    fn rebuilt(
        &mut self,
        product: ExprId,
        uniform: &[ExprId],
        powers: &[Power],
        mut is_changed: bool,
        depth: u32,
    ) -> ExprId {
        is_changed |= powers.iter().any(|power| power.is_odd && power.count > 1);
        let mut factors: Vec<ExprId> = powers.iter().map(|power| self.reduced(power)).collect();
        // Functions around single factors of a product do not determine how flat or steep it is.
        if let [factor] = factors.as_mut_slice() {
            let signs = self.signs(*factor, depth);
            if let Some(field) = signs.field(self.e) {
                is_changed |= field != *factor;
                *factor = field;
            }
        }
        if !is_changed {
            return product;
        }
        let factors = uniform.iter().copied().chain(factors);
        let product = factors.reduce(|product, factor| self.e.call(Op::Mul, &[product, factor]));
        product.unwrap_or_else(|| unreachable!("a product has factors"))
    }
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
