//! How far a shape reaches beyond its box where it is only almost hit.
//!
//! A blend adds to a shape where its distance is small. Where a shape's distance is exact that is
//! near the shape, and the box of the blend is the shape's, grown by what the blend adds. But a
//! distance may be less than the true one, far less for a ball scaled to a needle, and then the
//! places where it is small reach farther beyond the box. A [`Spread`] bounds how much.

use sdfc_vm::bounds::Bounds;

/// How many units beyond its box a shape's distance may still be one unit (and so in proportion).
/// Both numbers are at least one, and infinite where nothing is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spread {
    /// Along the axes: within the box grown by this much on every side.
    pub(crate) along: f64,
    /// In a straight line, whatever its direction. A turned shape needs it.
    pub(crate) around: f64,
}

impl Spread {
    /// Of a shape that is at least as far as its box.
    pub(crate) const NONE: Self = Self {
        along: 1.0,
        around: 1.0,
    };
    /// Of a shape about which nothing is known.
    pub(crate) const UNKNOWN: Self = Self {
        along: f64::INFINITY,
        around: f64::INFINITY,
    };

    /// Of a shape that is known along the axes only: a corner of a box is √3 times as far as its
    /// sides at most.
    pub(crate) fn along_axes(along: f64) -> Self {
        Self {
            along,
            around: along * 3.0_f64.sqrt(),
        }
    }

    /// Of either of two shapes.
    pub(crate) fn join(self, other: Self) -> Self {
        Self {
            along: self.along.max(other.along),
            around: self.around.max(other.around),
        }
    }

    /// Of a shape with something added to its distance, and its box grown for it.
    pub(crate) fn grown(self) -> Self {
        if self.around <= self.along {
            return self;
        }
        // The box grew along the axes; a straight line may have a longer way out of it.
        Self::along_axes(self.along)
    }

    /// Of a shape that is turned by some angle, another one for each point.
    pub(crate) fn turned(self) -> Self {
        Self {
            along: self.around,
            around: self.around,
        }
    }

    /// Of a shape with this box in a frame of its own. `rows` leads from the inner to the outer
    /// point, and `scale` is what an inner distance is worth outside.
    pub(crate) fn framed(self, inner: &Bounds, rows: &[[f64; 4]; 3], scale: f64) -> Self {
        // Where the box is endless along an axis, positions along it do not matter.
        let counts: [bool; 3] =
            std::array::from_fn(|i| inner.min[i].is_finite() || inner.max[i].is_finite());
        let at = |r: usize, c: usize| if counts[c] { rows[r][c] } else { 0.0 };
        let sum = |f: &dyn Fn(usize) -> f64| (0..3).map(f).sum::<f64>();
        let most = |f: &dyn Fn(usize) -> f64| (0..3).map(f).fold(0.0, f64::max);
        let along_axes = most(&|r| sum(&|c| at(r, c).abs()));
        // The matrix's norm, squared, is at most the largest sum of a row of its square; for turns
        // and for scales by axes that is what it is.
        let square = |a: usize, b: usize| sum(&|r| at(r, a) * at(r, b));
        let norm = most(&|a| sum(&|b| square(a, b).abs())).sqrt();
        let around = tidy(self.around * norm / scale.abs());
        let along = tidy(self.along * along_axes / scale.abs()).min(around);
        Self {
            along,
            around: around.min(Self::along_axes(along).around),
        }
    }

    /// Of what shapes have in common, given their boxes: each side of the common box is that of
    /// some of them, and what is beyond it is beyond those.
    pub(crate) fn common(shapes: &[(Bounds, Self)]) -> Self {
        let boxes = shapes.iter().map(|(bounds, _)| *bounds);
        let common = boxes.fold(Bounds::EVERYTHING, |common, b| common.common(&b));
        let gap = |b: &Bounds, side: usize| match side % 2 {
            0 => (b.min[side / 2], common.min[side / 2]),
            _ => (b.max[side / 2], common.max[side / 2]),
        };
        let has = |b: &Bounds, side: usize| {
            let (own, whole) = gap(b, side);
            own == whole || (own - whole).abs() <= 1e-9 * whole.abs().max(1.0)
        };
        let along = (0..6)
            .filter(|&side| gap(&common, side).0.is_finite())
            .map(|side| {
                let holders = shapes.iter().filter(|(bounds, _)| has(bounds, side));
                holders.map(|(_, s)| s.along).fold(f64::INFINITY, f64::min)
            })
            .fold(1.0, f64::max);
        let within = shapes
            .iter()
            .filter(|(b, _)| (0..6).all(|side| has(b, side)));
        let around = within.map(|(_, spread)| spread.around);
        Self {
            along,
            around: around.fold(Self::along_axes(along).around, f64::min),
        }
    }
}

/// A number that is one but for rounding.
fn tidy(v: f64) -> f64 {
    if (v - 1.0).abs() < 1e-9 {
        1.0
    } else {
        v.max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOT: f64 = std::f64::consts::SQRT_2;

    #[test]
    fn a_turn_keeps_what_is_known_in_a_straight_line() {
        let h = 1.0 / ROOT;
        let rows = [[h, -h, 0.0, 2.0], [h, h, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
        let cube = Bounds::centred([1.0; 3]);
        assert_eq!(Spread::NONE.framed(&cube, &rows, 1.0), Spread::NONE);
        let boxy = Spread::along_axes(1.0).framed(&cube, &rows, 1.0);
        assert!((boxy.along - ROOT).abs() < 1e-12, "{boxy:?}");
        assert!((boxy.around - 3.0_f64.sqrt()).abs() < 1e-12, "{boxy:?}");
    }

    #[test]
    fn a_scale_by_axes_spreads_along_the_longest() {
        let rows = [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 4.0, 0.0, 0.0],
            [0.0, 0.0, 2.0, 0.0],
        ];
        let cube = Bounds::centred([1.0; 3]);
        let needle = Spread::NONE.framed(&cube, &rows, 1.0);
        assert_eq!((needle.along, needle.around), (4.0, 4.0));
        // Along an axis without end it does not matter.
        let prism = Bounds::centred([1.0, f64::INFINITY, 1.0]);
        assert_eq!(Spread::NONE.framed(&prism, &rows, 1.0).along, 2.0);
    }

    #[test]
    fn what_is_common_spreads_as_those_do_that_bound_it() {
        let unknown = (Bounds::centred([2.0, 1.0, 2.0]), Spread::UNKNOWN);
        let ball = (Bounds::ball(1.0), Spread::NONE);
        assert_eq!(Spread::common(&[unknown, ball]), Spread::NONE);
        let slab = (Bounds::centred([9.0, 9.0, 0.5]), Spread::NONE);
        assert_eq!(Spread::common(&[slab, ball]), Spread::along_axes(1.0));
        let inner = (Bounds::ball(0.5), Spread::UNKNOWN);
        assert_eq!(Spread::common(&[inner, ball]), Spread::UNKNOWN);
    }
}
