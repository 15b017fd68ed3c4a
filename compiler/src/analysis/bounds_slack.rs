//! Bounds on how far the region {distance < ε} extends beyond a shape's bounding box.
//!
//! A blend adds to a shape where its distance is small. With an exact distance that region is near the
//! shape: the box of the blend is the shape's, grown by the added amount. A distance may underestimate
//! the true one, by far for a sphere scaled to a needle. Then the region where it is small extends
//! farther beyond the box. [`DistanceSlack`] bounds by how much.

use sdfc_vm::bounds::Bounds;

/// Factors k: where the shape's distance is at most d, the point is at most k·d from the box. They are at least
/// one, and infinite where nothing is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DistanceSlack {
    /// Along the axes: the region lies within the box grown by this much on every side.
    pub(crate) axis: f64,
    /// Euclidean distance from the box, in any direction. Rotated shapes need it.
    pub(crate) radial: f64,
}

impl DistanceSlack {
    /// Slack of a shape whose distance is at least the distance to its box.
    pub(crate) const NONE: Self = Self {
        axis: 1.0,
        radial: 1.0,
    };
    /// Slack of a shape of which nothing is known.
    pub(crate) const UNKNOWN: Self = Self {
        axis: f64::INFINITY,
        radial: f64::INFINITY,
    };

    /// Returns the slack of a shape for which only the axes are known. A corner of a grown box is at most √3 times
    /// as far as its sides.
    pub(crate) fn from_axis(axis: f64) -> Self {
        Self {
            axis,
            radial: axis * 3.0_f64.sqrt(),
        }
    }

    /// Returns the slack of the union of two shapes.
    pub(crate) fn join(self, other: Self) -> Self {
        Self {
            axis: self.axis.max(other.axis),
            radial: self.radial.max(other.radial),
        }
    }

    /// Returns the slack after an amount was added to the distance, with the box grown for it.
    pub(crate) fn after_growth(self) -> Self {
        if self.radial <= self.axis {
            return self;
        }
        // The box grew along the axes, so a straight line out of it may be longer.
        Self::from_axis(self.axis)
    }

    /// Returns the slack of a shape that is rotated by an angle that may differ from point to point.
    pub(crate) fn rotated(self) -> Self {
        Self {
            axis: self.radial,
            radial: self.radial,
        }
    }

    /// Returns the slack of a shape with the box `inner` within an affine frame. `rows` maps the inner
    /// to the outer point, and `scale` is the outer length of an inner unit.
    pub(crate) fn in_frame(self, inner: &Bounds, rows: &[[f64; 4]; 3], scale: f64) -> Self {
        // Along an axis on which the box is infinite, positions do not matter.
        let is_bounded: [bool; 3] =
            std::array::from_fn(|i| inner.min[i].is_finite() || inner.max[i].is_finite());
        let entry = |r: usize, c: usize| if is_bounded[c] { rows[r][c] } else { 0.0 };
        let sum = |f: &dyn Fn(usize) -> f64| (0..3).map(f).sum::<f64>();
        let max = |f: &dyn Fn(usize) -> f64| (0..3).map(f).fold(0.0, f64::max);
        let max_row_sum = max(&|r| sum(&|c| entry(r, c).abs()));
        // The squared matrix norm is at most the largest row sum of its square. For rotations and for
        // scales along axes it is equal to it.
        let square = |a: usize, b: usize| sum(&|r| entry(r, a) * entry(r, b));
        let norm = max(&|a| sum(&|b| square(a, b).abs())).sqrt();
        let radial = at_least_one(self.radial * norm / scale.abs());
        let axis = at_least_one(self.axis * max_row_sum / scale.abs()).min(radial);
        Self {
            axis,
            radial: radial.min(Self::from_axis(axis).radial),
        }
    }

    /// Returns the slack of an intersection, given the boxes of its operands. Each side of the common
    /// box is a side of at least one operand, and a point beyond it is beyond that operand's box.
    pub(crate) fn intersection(shapes: &[(Bounds, Self)]) -> Self {
        let boxes = shapes.iter().map(|(bounds, _)| *bounds);
        let common = boxes.fold(Bounds::ALL_SPACE, |common, b| common.intersection(&b));
        let side_and_common = |b: &Bounds, side: usize| match side % 2 {
            0 => (b.min[side / 2], common.min[side / 2]),
            _ => (b.max[side / 2], common.max[side / 2]),
        };
        let shares_side = |b: &Bounds, side: usize| {
            let (operand, common) = side_and_common(b, side);
            operand == common || (operand - common).abs() <= 1e-9 * common.abs().max(1.0)
        };
        let axis = (0..6)
            .filter(|&side| side_and_common(&common, side).0.is_finite())
            .map(|side| {
                let holders = shapes
                    .iter()
                    .filter(|(bounds, _)| shares_side(bounds, side));
                holders.map(|(_, s)| s.axis).fold(f64::INFINITY, f64::min)
            })
            .fold(1.0, f64::max);
        let same_box = shapes
            .iter()
            .filter(|(b, _)| (0..6).all(|side| shares_side(b, side)));
        let radials = same_box.map(|(_, slack)| slack.radial);
        Self {
            axis,
            radial: radials.fold(Self::from_axis(axis).radial, f64::min),
        }
    }
}

/// Returns at least one, and exactly one for values within rounding of it.
fn at_least_one(v: f64) -> f64 {
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
    fn a_rotation_keeps_the_slack_of_euclidean_distances() {
        let h = 1.0 / ROOT;
        let rows = [[h, -h, 0.0, 2.0], [h, h, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
        let cube = Bounds::centred([1.0; 3]);
        assert_eq!(
            DistanceSlack::NONE.in_frame(&cube, &rows, 1.0),
            DistanceSlack::NONE
        );
        let boxy = DistanceSlack::from_axis(1.0).in_frame(&cube, &rows, 1.0);
        assert!((boxy.axis - ROOT).abs() < 1e-12, "{boxy:?}");
        assert!((boxy.radial - 3.0_f64.sqrt()).abs() < 1e-12, "{boxy:?}");
    }

    #[test]
    fn a_scale_by_axes_spreads_along_the_longest() {
        let rows = [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 4.0, 0.0, 0.0],
            [0.0, 0.0, 2.0, 0.0],
        ];
        let cube = Bounds::centred([1.0; 3]);
        let needle = DistanceSlack::NONE.in_frame(&cube, &rows, 1.0);
        assert_eq!((needle.axis, needle.radial), (4.0, 4.0));
        // An infinite axis does not matter.
        let prism = Bounds::centred([1.0, f64::INFINITY, 1.0]);
        assert_eq!(DistanceSlack::NONE.in_frame(&prism, &rows, 1.0).axis, 2.0);
    }

    #[test]
    fn the_slack_of_an_intersection_is_that_of_the_operands_that_bound_it() {
        let unknown = (Bounds::centred([2.0, 1.0, 2.0]), DistanceSlack::UNKNOWN);
        let ball = (Bounds::centred([1.0; 3]), DistanceSlack::NONE);
        assert_eq!(
            DistanceSlack::intersection(&[unknown, ball]),
            DistanceSlack::NONE
        );
        let slab = (Bounds::centred([9.0, 9.0, 0.5]), DistanceSlack::NONE);
        assert_eq!(
            DistanceSlack::intersection(&[slab, ball]),
            DistanceSlack::from_axis(1.0)
        );
        let inner = (Bounds::centred([0.5; 3]), DistanceSlack::UNKNOWN);
        assert_eq!(
            DistanceSlack::intersection(&[inner, ball]),
            DistanceSlack::UNKNOWN
        );
    }
}
