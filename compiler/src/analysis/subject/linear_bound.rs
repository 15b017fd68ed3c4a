//! Bounds of a field in a box that fall linearly from the value in its middle.

/// Lower bound of a field in a box: its value in the middle, and the ranges of its gradient in the box.
#[derive(Clone, Copy, Debug)]
pub(super) struct LinearBound {
    /// Lower bound of the value in the middle.
    pub(super) value: f64,
    /// True if the middle is proved to be inside.
    pub(super) is_middle_inside: bool,
    /// Range of each component of the gradient.
    pub(super) gradient: [[f64; 2]; 3],
    /// Half the length of each side of the box.
    pub(super) half_sides: [f64; 3],
}

impl LinearBound {
    /// Reports whether the field is above zero in all of the box.
    pub(super) fn is_positive(&self) -> bool {
        let falls = self.gradient.iter().zip(self.half_sides);
        let fall: f64 = falls.map(|(range, half)| magnitude(*range) * half).sum();
        // False for NaN.
        fall < self.value
    }

    /// Returns the length by which a direction's extent of the solid is less than that of the box; zero if nothing is
    /// known.
    ///
    /// The field exceeds zero at least by some value where the box extends farthest. Along each axis it falls from there
    /// at most as fast as its gradient, and the extent falls with the direction. The axis with the best ratio bounds the
    /// loss.
    pub(super) fn unreached(&self, direction: [f64; 3]) -> f64 {
        let mut farthest_value = self.value;
        let mut steepest_fall = 0.0_f64;
        for ((&[low, high], half), along) in
            self.gradient.iter().zip(self.half_sides).zip(direction)
        {
            if along == 0.0 {
                farthest_value -= magnitude([low, high]) * half;
                continue;
            }
            let [least, greatest] = if along > 0.0 {
                [low, high]
            } else {
                [-high, -low]
            };
            farthest_value += least * half;
            steepest_fall = steepest_fall.max(greatest / along.abs());
        }
        let unreached = farthest_value / steepest_fall;
        match farthest_value > 0.0 && steepest_fall > 0.0 && unreached.is_finite() {
            true => unreached,
            false => 0.0,
        }
    }
}

/// Returns the largest magnitude in a range.
fn magnitude([low, high]: [f64; 2]) -> f64 {
    low.abs().max(high.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bound of a field that is −0.5 in the middle of a box of half side 1, and rises along x by 2 to 3.
    fn rising() -> LinearBound {
        LinearBound {
            value: -0.5,
            is_middle_inside: true,
            gradient: [[2.0, 3.0], [0.0, 0.0], [-0.25, 0.25]],
            half_sides: [1.0; 3],
        }
    }

    #[test]
    fn rising_fields_end_before_the_box() {
        // At x = 1 the value is at least −0.5 + 2 − 0.25, and it falls by at most 3.
        assert_eq!(rising().unreached([1.0, 0.0, 0.0]), 1.25 / 3.0);
        assert_eq!(rising().unreached([-1.0, 0.0, 0.0]), 0.0);
        assert_eq!(rising().unreached([2.0, 0.0, 0.0]), 2.5 / 3.0);
        assert!(!rising().is_positive());
    }

    #[test]
    fn unknown_gradients_bound_nothing() {
        for unknown in [f64::NAN, f64::INFINITY] {
            let bound = LinearBound {
                gradient: [[-unknown, unknown], [0.0, 0.0], [0.0, 0.0]],
                value: 1.0,
                ..rising()
            };
            for direction in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]] {
                assert_eq!(bound.unreached(direction), 0.0, "{unknown} {direction:?}");
            }
            assert!(!bound.is_positive());
        }
    }
}
