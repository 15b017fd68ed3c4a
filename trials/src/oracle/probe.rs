//! Knowledge of a shape at a point: its value, and a radius within which its sign stays.

/// The knowledge of a shape at a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Probe {
    /// The value, which is negative inside.
    pub(super) value: f64,
    /// The radius within which the sign is proved to stay.
    pub(super) safe: f64,
    /// The radius by the slopes that formulas have at the point. It is no proof.
    pub(super) guess: f64,
}

impl Probe {
    /// A value that changes by no more than `steepness` per unit of length.
    pub(super) fn steady(value: f64, steepness: f64) -> Self {
        let safe = value.abs() / steepness;
        Self {
            value,
            safe,
            guess: safe,
        }
    }

    /// Tells if the point is inside.
    pub(super) fn is_inside(self) -> bool {
        self.value < 0.0
    }

    /// The same shape with another value of the same sign.
    pub(super) fn with_value(self, value: f64) -> Self {
        Self { value, ..self }
    }

    /// The knowledge of the complement.
    pub(super) fn complement(self) -> Self {
        self.with_value(-self.value)
    }

    /// The same in a space that a map led to, which stretches by no more than `stretch`.
    pub(super) fn before(self, stretch: f64) -> Self {
        Self {
            safe: self.safe / stretch,
            guess: self.guess / stretch,
            ..self
        }
    }

    /// The knowledge of the union.
    pub(super) fn union(self, other: Self) -> Self {
        let value = self.value.min(other.value);
        match (self.is_inside(), other.is_inside()) {
            (true, true) => Self {
                value,
                safe: self.safe.max(other.safe),
                guess: self.guess.max(other.guess),
            },
            (true, false) => self.with_value(value),
            (false, true) => other.with_value(value),
            (false, false) => Self {
                value,
                safe: self.safe.min(other.safe),
                guess: self.guess.min(other.guess),
            },
        }
    }

    /// The knowledge of the intersection.
    pub(super) fn intersection(self, other: Self) -> Self {
        self.complement().union(other.complement()).complement()
    }

    /// The knowledge of the symmetric difference.
    pub(super) fn xor(self, other: Self) -> Self {
        let both = self.intersection(other);
        self.union(other).intersection(both.complement())
    }

    /// The same, near something else whose inside begins no nearer than `distance`.
    pub(super) fn beside(self, distance: f64) -> Self {
        if self.is_inside() {
            return self;
        }
        Self {
            safe: self.safe.min(distance),
            guess: self.guess.min(distance),
            ..self
        }
    }
}
