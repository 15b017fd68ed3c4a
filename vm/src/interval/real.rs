//! The operations of intervals as numbers.

use super::{Endpoint, GenericInterval, MAX_NOISE_CURVATURE, Tristate};
use crate::real::{Real, eased, lit};
use crate::vector::V3;

impl<E: Endpoint> Real for GenericInterval<E> {
    type Bool = Tristate;
    type Vec2 = crate::vector::V2<Self>;
    type Vec3 = V3<Self>;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::point(lit(value))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self {
            lo: self.lo.max(-self.hi).max(lit(0.0)),
            hi: self.hi.max(-self.lo),
        }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let zero = lit::<E>(0.0);
        Self {
            lo: self.lo.max(zero).sqrt().down().max(zero),
            hi: self.hi.max(zero).sqrt().up(),
        }
    }
    #[inline(always)]
    fn square(self) -> Self {
        let a = self.abs();
        Self {
            lo: (a.lo * a.lo).down().max(lit(0.0)),
            hi: (a.hi * a.hi).up(),
        }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Self {
            lo: self.lo.floor(),
            hi: self.hi.floor(),
        }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self {
            lo: self.lo.min(other.lo),
            hi: self.hi.min(other.hi),
        }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self {
            lo: self.lo.max(other.lo),
            hi: self.hi.max(other.hi),
        }
    }
    #[inline(always)]
    fn sin(self) -> Self {
        self.wave(E::sin, std::f64::consts::FRAC_PI_2)
    }
    #[inline(always)]
    fn cos(self) -> Self {
        self.wave(E::cos, 0.0)
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        // Away from the cut along the negative x axis, the angle is monotone along every edge of the box.
        // So its extremes lie at the corners.
        let zero = lit::<E>(0.0);
        let corners = Self::hull_of_four([
            self.lo.atan2(x.lo),
            self.lo.atan2(x.hi),
            self.hi.atan2(x.lo),
            self.hi.atan2(x.hi),
        ]);
        let monotone = (x.lo > zero) | (self.lo > zero) | (self.hi < zero);
        let limit = lit::<E>(std::f64::consts::PI);
        let error = E::trigonometric_error(lit(1.0));
        Self {
            lo: E::select(monotone, corners.lo, -limit) - error,
            hi: E::select(monotone, corners.hi, limit) + error,
        }
    }
    #[inline(always)]
    fn exp2(self) -> Self {
        let e = self.increasing(E::exp2, E::exponential_error);
        Self {
            lo: e.lo.max(lit(0.0)),
            hi: e.hi,
        }
    }
    #[inline(always)]
    fn log2(self) -> Self {
        let range = self.increasing(E::log2, E::logarithm_error);
        // For infinite or NaN arguments, the logarithm is unbounded.
        Self {
            lo: range.lo,
            hi: E::select(self.hi < E::INFINITY, range.hi, E::INFINITY),
        }
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        self.exp2()
    }
    #[inline(always)]
    fn exponent(self) -> Self {
        Self {
            lo: self.lo.exponent(),
            hi: self.hi.exponent(),
        }
    }
    #[inline(always)]
    fn mantissa(self) -> Self {
        Self {
            lo: lit(1.0),
            hi: lit(2.0),
        }
    }
    #[inline(always)]
    fn lattice(cell: V3<Self>, seed: Self) -> V3<Self> {
        let v = E::lattice(V3::new(cell.x.lo, cell.y.lo, cell.z.lo), seed.lo);
        let component = |v: E| Self::random(v, [-1.0, 1.0], cell, seed);
        V3::new(component(v.x), component(v.y), component(v.z))
    }
    #[inline(always)]
    fn noise_corner_gradient(cell: V3<Self>, seed: Self) -> V3<Self> {
        let v = E::noise_corner_gradient(V3::new(cell.x.lo, cell.y.lo, cell.z.lo), seed.lo);
        let component = |v: E, range| Self::random(v, range, cell, seed);
        V3::new(
            component(v.x, [1.0, 2.0]),
            component(v.y, [-1.0, 1.0]),
            component(v.z, [-1.0, 1.0]),
        )
    }
    #[inline(always)]
    fn ellipsoid_gradient(p: V3<Self>, r: V3<Self>) -> (Self, V3<Self>) {
        crate::ellipsoid::interval::over(p, r)
    }
    fn noise_slope(p: V3<Self>, seed: Self) -> V3<Self> {
        <E as Endpoint>::noise_gradient(p, seed).1
    }
    /// Returns bounds that hold everywhere.
    fn noise_curvature(_: V3<Self>, _: Self) -> [V3<Self>; 3] {
        let any = GenericInterval {
            lo: lit(-MAX_NOISE_CURVATURE),
            hi: lit(MAX_NOISE_CURVATURE),
        };
        [V3::new(any, any, any); 3]
    }
    #[inline(always)]
    fn noise_gradient(p: V3<Self>, seed: Self) -> (Self, V3<Self>) {
        <E as Endpoint>::noise_gradient(p, seed)
    }
    #[inline(always)]
    fn discontinuity_gradient(gradient: V3<Self>, condition: Tristate) -> V3<Self> {
        let either = |g: Self| Self {
            lo: E::select(
                condition.can_be_true & condition.can_be_false,
                -E::INFINITY,
                g.lo,
            ),
            hi: E::select(
                condition.can_be_true & condition.can_be_false,
                E::INFINITY,
                g.hi,
            ),
        };
        V3::new(either(gradient.x), either(gradient.y), either(gradient.z))
    }
    #[inline(always)]
    fn floor_gradient(floor: Self) -> V3<Self> {
        let zero = Self::point(lit(0.0));
        let flat = V3::new(zero, zero, zero);
        let ambiguous = Tristate {
            can_be_true: !floor.is_point(),
            can_be_false: !floor.is_point(),
        };
        Self::discontinuity_gradient(flat, ambiguous)
    }
    #[inline(always)]
    fn fract(self) -> Self {
        let within = self.lo.floor() == self.hi.floor();
        let inside = self - self.floor();
        Self {
            lo: E::select(within, inside.lo, lit(0.0)),
            hi: E::select(within, inside.hi, lit(1.0)),
        }
    }
    #[inline(always)]
    fn mix(self, other: Self, t: Self) -> Self {
        let line = self + (other - self) * t;
        let is_between = E::BOUNDS_REALS & (lit::<E>(0.0) <= t.lo) & (t.hi <= lit(1.0));
        let error = E::distance_error(self.magnitude() + other.magnitude());
        let between = Self {
            lo: line.lo.max(self.lo.min(other.lo) - error),
            hi: line.hi.min(self.hi.max(other.hi) + error),
        };
        Self {
            lo: E::select(is_between, between.lo, line.lo),
            hi: E::select(is_between, between.hi, line.hi),
        }
    }
    #[inline(always)]
    fn smoothstep(self, low: Self, high: Self) -> Self {
        let t = Self::ramp(self, low, high);
        if !E::BOUNDS_REALS {
            return eased(t);
        }
        // Monotone in `t`, except for rounding.
        let error = E::distance_error(lit(1.0));
        Self {
            lo: (eased(t.lo) - error).max(lit(0.0)),
            hi: (eased(t.hi) + error).min(lit(1.0)),
        }
    }
    #[inline(always)]
    fn modulo(self, divisor: Self) -> Self {
        let quotient = (self / divisor).floor();
        let remainder = self - divisor * quotient;
        let error = E::distance_error(self.magnitude() + divisor.magnitude());
        let has_sign =
            E::BOUNDS_REALS & (lit::<E>(0.0).less(divisor.lo) | divisor.hi.less(lit(0.0)));
        // The remainder has the sign of the divisor, and a smaller magnitude.
        let lower = divisor.lo.min(lit(0.0)) - error;
        let limit = divisor.hi.max(lit(0.0)) + error;
        Self {
            lo: E::select(has_sign, remainder.lo.max(lower), remainder.lo),
            hi: E::select(has_sign, remainder.hi.min(limit), remainder.hi),
        }
    }
    #[inline(always)]
    fn unit_component(self) -> Self {
        self.clamp(lit(-1.0), lit(1.0))
    }
    #[inline(always)]
    fn less(self, other: Self) -> Tristate {
        // Comparisons with NaN fail, which leaves the result undecided.
        let never = self.lo >= other.hi;
        let always = self.hi < other.lo;
        Tristate {
            can_be_true: !never,
            can_be_false: !always,
        }
    }
    #[inline(always)]
    fn and(a: Tristate, b: Tristate) -> Tristate {
        Tristate {
            can_be_true: a.can_be_true & b.can_be_true,
            can_be_false: a.can_be_false | b.can_be_false,
        }
    }
    #[inline(always)]
    fn or(a: Tristate, b: Tristate) -> Tristate {
        Tristate {
            can_be_true: a.can_be_true | b.can_be_true,
            can_be_false: a.can_be_false & b.can_be_false,
        }
    }
    #[inline(always)]
    fn not(a: Tristate) -> Tristate {
        Tristate {
            can_be_true: a.can_be_false,
            can_be_false: a.can_be_true,
        }
    }
    #[inline(always)]
    fn select(condition: Tristate, then: Self, otherwise: Self) -> Self {
        let hull = then.hull(otherwise);
        let sure = Self {
            lo: E::select(condition.can_be_false, hull.lo, then.lo),
            hi: E::select(condition.can_be_false, hull.hi, then.hi),
        };
        Self {
            lo: E::select(condition.can_be_true, sure.lo, otherwise.lo),
            hi: E::select(condition.can_be_true, sure.hi, otherwise.hi),
        }
    }
}
