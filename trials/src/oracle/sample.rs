//! Sample of a shape at a point: its value, and a radius within which its sign is constant.

/// Value of a shape at a point, with radii of constant sign around it.
#[derive(Clone, Copy, Debug)]
pub(super) struct OracleSample {
    /// Value, which is negative inside.
    pub(super) value: f64,
    /// Radius within which the sign is proved constant.
    pub(super) proven_radius: f64,
    /// Radius estimated from the slopes of formulas at the point. It is not proved.
    pub(super) estimated_radius: f64,
}

impl OracleSample {
    /// Creates a sample from a value and the bound of its slope.
    pub(super) fn from_slope_bound(value: f64, slope_bound: f64) -> Self {
        let proven_radius = value.abs() / slope_bound;
        Self {
            value,
            proven_radius,
            estimated_radius: proven_radius,
        }
    }

    /// Reports whether the point is inside.
    pub(super) fn is_inside(self) -> bool {
        self.value < 0.0
    }

    /// Returns the sample with another value of the same sign.
    pub(super) fn with_value(self, value: f64) -> Self {
        Self { value, ..self }
    }

    /// Returns the sample of the complement.
    pub(super) fn complement(self) -> Self {
        self.with_value(-self.value)
    }

    /// Returns the sample in the space before a map that stretches by at most `stretch`.
    pub(super) fn pulled_back(self, stretch: f64) -> Self {
        Self {
            proven_radius: self.proven_radius / stretch,
            estimated_radius: self.estimated_radius / stretch,
            ..self
        }
    }

    /// Returns the sample of the union.
    pub(super) fn union(self, other: Self) -> Self {
        let value = self.value.min(other.value);
        match (self.is_inside(), other.is_inside()) {
            (true, true) => Self {
                value,
                proven_radius: self.proven_radius.max(other.proven_radius),
                estimated_radius: self.estimated_radius.max(other.estimated_radius),
            },
            (true, false) => self.with_value(value),
            (false, true) => other.with_value(value),
            (false, false) => Self {
                value,
                proven_radius: self.proven_radius.min(other.proven_radius),
                estimated_radius: self.estimated_radius.min(other.estimated_radius),
            },
        }
    }

    /// Returns the sample of the intersection.
    pub(super) fn intersection(self, other: Self) -> Self {
        self.complement().union(other.complement()).complement()
    }

    /// Returns the sample of the symmetric difference.
    pub(super) fn xor(self, other: Self) -> Self {
        let common = self.intersection(other);
        self.union(other).intersection(common.complement())
    }

    /// Returns the sample of the union with a skipped shape whose inside is at least `distance` away.
    pub(super) fn limited_to(self, distance: f64) -> Self {
        if self.is_inside() {
            return self;
        }
        Self {
            proven_radius: self.proven_radius.min(distance),
            estimated_radius: self.estimated_radius.min(distance),
            ..self
        }
    }
}
