//! Dual numbers: a value together with its gradient with respect to the world point.
//!
//! A body evaluated on duals gives the exact gradient of its formula, up to rounding. A body recorded on
//! duals gives WGSL that does the same. Vectors are kept as vectors: a dual vector is a vector and the
//! gradients of its components.
//!
//! At a kink (`min`, `abs`, a `select`), the gradient is that of the chosen branch. At a pole (a square
//! root at zero), it is finite and otherwise arbitrary.

use crate::real::{Real, Vector2, Vector3, lit};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A value and its gradient.
#[derive(Clone, Copy, Debug)]
pub struct Dual<R: Real> {
    /// The value of the function at the point.
    pub value: R,
    /// Its derivatives along the world's axes.
    pub gradient: R::Vec3,
}

/// Two values and their gradients.
#[derive(Clone, Copy, Debug)]
pub struct DualVec2<R: Real> {
    /// Values of both components.
    pub value: R::Vec2,
    /// The gradient of each value.
    pub gradients: [R::Vec3; 2],
}

/// Three values and their gradients: a point and the Jacobian of the map from the world to it.
#[derive(Clone, Copy, Debug)]
pub struct DualVec3<R: Real> {
    /// Values of the three components.
    pub value: R::Vec3,
    /// The gradient of each value.
    pub gradients: [R::Vec3; 3],
}

#[inline(always)]
fn zero3<R: Real>() -> R::Vec3 {
    R::Vec3::splat(lit(0.0))
}

impl<R: Real> Dual<R> {
    /// Creates a value that does not depend on the point.
    #[inline(always)]
    pub fn fixed(value: R) -> Self {
        Self {
            value,
            gradient: zero3::<R>(),
        }
    }
    #[inline(always)]
    fn chain(self, value: R, slope: R) -> Self {
        Self {
            value,
            gradient: self.gradient * slope,
        }
    }
}

impl<R: Real> DualVec3<R> {
    /// Returns the gradient of a function of the components whose partial derivatives are `slope`.
    #[inline(always)]
    pub(crate) fn along(&self, slope: R::Vec3) -> R::Vec3 {
        self.gradients[0] * slope.x()
            + self.gradients[1] * slope.y()
            + self.gradients[2] * slope.z()
    }

    /// Creates the world point itself; the gradients of its components are the axes.
    #[inline(always)]
    pub fn seed(p: R::Vec3) -> Self {
        let (o, i) = (lit(0.0), lit(1.0));
        let axes = [
            R::Vec3::new(i, o, o),
            R::Vec3::new(o, i, o),
            R::Vec3::new(o, o, i),
        ];
        Self {
            value: p,
            gradients: axes,
        }
    }
    /// Creates a vector that does not depend on the point.
    #[inline(always)]
    pub fn fixed(value: R::Vec3) -> Self {
        Self {
            value,
            gradients: [zero3::<R>(); 3],
        }
    }
}

impl<R: Real> DualVec2<R> {
    /// Creates a vector that does not depend on the point.
    #[inline(always)]
    pub fn fixed(value: R::Vec2) -> Self {
        Self {
            value,
            gradients: [zero3::<R>(); 2],
        }
    }
}

impl<R: Real> Add for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self {
            value: self.value + b.value,
            gradient: self.gradient + b.gradient,
        }
    }
}
impl<R: Real> Sub for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self {
            value: self.value - b.value,
            gradient: self.gradient - b.gradient,
        }
    }
}
impl<R: Real> Mul for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Self {
            value: self.value * b.value,
            gradient: self.gradient * b.value + b.gradient * self.value,
        }
    }
}
impl<R: Real> Div for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        let value = self.value / b.value;
        let gradient = (self.gradient - b.gradient * value) * (lit::<R>(1.0) / b.value);
        Self { value, gradient }
    }
}
impl<R: Real> Neg for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            value: -self.value,
            gradient: -self.gradient,
        }
    }
}

impl<R: Real> Real for Dual<R> {
    type Bool = R::Bool;
    type Vec2 = DualVec2<R>;
    type Vec3 = DualVec3<R>;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::fixed(lit(value))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.chain(self.value.abs(), self.value.sign_nonzero())
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt().named("root");
        self.chain(root, lit::<R>(0.5) / root.max(lit(1e-18)))
    }
    #[inline(always)]
    fn square(self) -> Self {
        self.chain(self.value.square(), self.value * lit(2.0))
    }
    #[inline(always)]
    fn floor(self) -> Self {
        let value = self.value.floor();
        Self {
            value,
            gradient: R::floor_gradient(value),
        }
    }
    #[inline(always)]
    fn mark_discontinuity(self, condition: R::Bool) -> Self {
        Self {
            value: self.value,
            gradient: R::discontinuity_gradient(self.gradient, condition),
        }
    }
    #[inline(always)]
    fn min(self, b: Self) -> Self {
        let first = self.value.less(b.value);
        Self {
            value: self.value.min(b.value),
            gradient: R::Vec3::select(first, self.gradient, b.gradient),
        }
    }
    #[inline(always)]
    // Of equal values, the second one is chosen, as in `min`: a blend may be computed either way.
    fn max(self, b: Self) -> Self {
        let first = b.value.less(self.value);
        Self {
            value: self.value.max(b.value),
            gradient: R::Vec3::select(first, self.gradient, b.gradient),
        }
    }
    #[inline(always)]
    fn at_least(self, low: Self) -> Self {
        let value = self.value.at_least(low.value);
        Self {
            value,
            ..self.max(low)
        }
    }
    #[inline(always)]
    fn at_most(self, high: Self) -> Self {
        let value = self.value.at_most(high.value);
        Self {
            value,
            ..self.min(high)
        }
    }
    #[inline(always)]
    fn sin(self) -> Self {
        self.chain(self.value.sin(), self.value.cos())
    }
    #[inline(always)]
    fn cos(self) -> Self {
        self.chain(self.value.cos(), -self.value.sin())
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        let (y, x) = (self, x);
        let scale = lit::<R>(1.0) / (x.value.square() + y.value.square()).max(lit(1e-30));
        Self {
            value: y.value.atan2(x.value),
            gradient: (y.gradient * x.value - x.gradient * y.value) * scale.named("scale"),
        }
    }
    #[inline(always)]
    fn exp2(self) -> Self {
        let value = self.value.exp2().named("power");
        self.chain(value, value * lit(std::f64::consts::LN_2))
    }
    #[inline(always)]
    fn log2(self) -> Self {
        let least = lit::<R>(1e-30);
        let slope = lit::<R>(std::f64::consts::LOG2_E) / self.value.max(least);
        let slope = R::select(least.less(self.value), slope, lit(0.0));
        self.chain(self.value.log2(), slope)
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        Self::fixed(self.value.power_of_two())
    }
    #[inline(always)]
    fn exponent(self) -> Self {
        Self::fixed(self.value.exponent())
    }
    #[inline(always)]
    fn mantissa(self) -> Self {
        Self::fixed(self.value.mantissa())
    }
    #[inline(always)]
    fn lattice(cell: Self::Vec3, seed: Self) -> Self::Vec3 {
        DualVec3::fixed(R::lattice(cell.value, seed.value))
    }
    #[inline(always)]
    fn noise_corner_gradient(cell: Self::Vec3, seed: Self) -> Self::Vec3 {
        DualVec3::fixed(R::noise_corner_gradient(cell.value, seed.value))
    }
    #[inline(always)]
    fn noise_gradient(p: Self::Vec3, seed: Self) -> (Self, Self::Vec3) {
        let (value, slope) = R::noise_gradient(p.value, seed.value);
        let gradient = p.along(slope);
        // The derivatives of the gradient are never used.
        (Self { value, gradient }, DualVec3::fixed(slope))
    }
    #[inline(always)]
    fn ellipsoid_gradient(p: Self::Vec3, r: Self::Vec3) -> (Self, Self::Vec3) {
        let (value, slope) = R::ellipsoid_gradient(p.value, r.value);
        let gradient = p.along(slope);
        // As for noise: radii are constant, and the derivatives of the gradient are never used.
        (Self { value, gradient }, DualVec3::fixed(slope))
    }
    #[inline(always)]
    fn noise_slope(p: Self::Vec3, seed: Self) -> Self::Vec3 {
        let slope = R::noise_slope(p.value, seed.value);
        DualVec3 {
            value: slope,
            gradients: R::noise_curvature(p.value, seed.value).map(|row| p.along(row)),
        }
    }
    #[inline(always)]
    fn named(self, name: &'static str) -> Self {
        Self {
            value: self.value.named(name),
            gradient: self.gradient,
        }
    }
    #[inline(always)]
    fn less(self, b: Self) -> R::Bool {
        self.value.less(b.value)
    }
    #[inline(always)]
    fn and(a: R::Bool, b: R::Bool) -> R::Bool {
        R::and(a, b)
    }
    #[inline(always)]
    fn or(a: R::Bool, b: R::Bool) -> R::Bool {
        R::or(a, b)
    }
    #[inline(always)]
    fn not(a: R::Bool) -> R::Bool {
        R::not(a)
    }
    #[inline(always)]
    fn is_certain(condition: R::Bool) -> bool {
        R::is_certain(condition)
    }
    #[inline(always)]
    fn select(condition: R::Bool, then: Self, otherwise: Self) -> Self {
        Self {
            value: R::select(condition, then.value, otherwise.value),
            gradient: R::Vec3::select(condition, then.gradient, otherwise.gradient),
        }
    }
}

/// Implements arithmetic and the vector traits, for two or three components.
macro_rules! dual_vector {
    ($dual:ident, $vector:ident, $trait:ident, $n:literal, { $($axis:ident $i:literal),+ }) => {
        impl<R: Real> Add for $dual<R> {
            type Output = Self;
            #[inline(always)]
            fn add(self, b: Self) -> Self {
                Self {
                    value: self.value + b.value,
                    gradients: [$(self.gradients[$i] + b.gradients[$i]),+],
                }
            }
        }
        impl<R: Real> Sub for $dual<R> {
            type Output = Self;
            #[inline(always)]
            fn sub(self, b: Self) -> Self {
                Self {
                    value: self.value - b.value,
                    gradients: [$(self.gradients[$i] - b.gradients[$i]),+],
                }
            }
        }
        impl<R: Real> Mul for $dual<R> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, b: Self) -> Self {
                Self {
                    value: self.value * b.value,
                    gradients: [$(
                        self.gradients[$i] * b.value.$axis() + b.gradients[$i] * self.value.$axis()
                    ),+],
                }
            }
        }
        impl<R: Real> Mul<Dual<R>> for $dual<R> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, b: Dual<R>) -> Self {
                Self {
                    value: self.value * b.value,
                    gradients: [$(
                        self.gradients[$i] * b.value + b.gradient * self.value.$axis()
                    ),+],
                }
            }
        }
        impl<R: Real> Neg for $dual<R> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self { value: -self.value, gradients: [$(-self.gradients[$i]),+] }
            }
        }
        impl<R: Real> $trait<Dual<R>> for $dual<R> {
            #[inline(always)]
            fn new($($axis: Dual<R>),+) -> Self {
                Self {
                    value: R::$vector::new($($axis.value),+),
                    gradients: [$($axis.gradient),+],
                }
            }
            $(
                #[inline(always)]
                fn $axis(self) -> Dual<R> {
                    Dual { value: self.value.$axis(), gradient: self.gradients[$i] }
                }
            )+
            #[inline(always)]
            fn abs(self) -> Self {
                Self {
                    value: self.value.abs(),
                    gradients: [$(self.gradients[$i] * self.value.$axis().sign_nonzero()),+],
                }
            }
            #[inline(always)]
            fn min(self, b: Self) -> Self {
                Self {
                    value: self.value.min(b.value),
                    gradients: [$(R::Vec3::select(
                        self.value.$axis().less(b.value.$axis()),
                        self.gradients[$i],
                        b.gradients[$i],
                    )),+],
                }
            }
            #[inline(always)]
            fn max(self, b: Self) -> Self {
                Self {
                    value: self.value.max(b.value),
                    gradients: [$(R::Vec3::select(
                        b.value.$axis().less(self.value.$axis()),
                        self.gradients[$i],
                        b.gradients[$i],
                    )),+],
                }
            }
            #[inline(always)]
            fn select(condition: R::Bool, then: Self, otherwise: Self) -> Self {
                Self {
                    value: R::$vector::select(condition, then.value, otherwise.value),
                    gradients: [$(R::Vec3::select(
                        condition,
                        then.gradients[$i],
                        otherwise.gradients[$i],
                    )),+],
                }
            }
            #[inline(always)]
            fn named(self, name: &'static str) -> Self {
                Self { value: self.value.named(name), gradients: self.gradients }
            }
            #[inline(always)]
            fn length(self) -> Dual<R> {
                let value = self.value.length().named("len");
                let scale = lit::<R>(1.0) / value.max(lit(1e-30));
                let direction = self.value * scale.named("scale");
                let [first, rest @ ..] = [$(
                    self.gradients[$i] * direction.$axis().unit_component()
                ),+];
                // The call of an iterator is not inlined into the loops over lanes.
                let mut gradient = first;
                for more in rest {
                    gradient = gradient + more;
                }
                Dual { value, gradient }
            }
            dual_vector!(@extra $trait);
        }
    };
    (@extra Vector2) => {};
    (@extra Vector3) => {
        #[inline(always)]
        fn floor(self) -> Self {
            let value = self.value.floor();
            Self {
                value,
                gradients: [
                    R::floor_gradient(value.x()),
                    R::floor_gradient(value.y()),
                    R::floor_gradient(value.z()),
                ],
            }
        }
        #[inline(always)]
        fn xy(self) -> DualVec2<R> {
            DualVec2 { value: self.value.xy(), gradients: [self.gradients[0], self.gradients[1]] }
        }
        #[inline(always)]
        fn xz(self) -> DualVec2<R> {
            DualVec2 { value: self.value.xz(), gradients: [self.gradients[0], self.gradients[2]] }
        }
    };
}

dual_vector!(DualVec2, Vec2, Vector2, 2, { x 0, y 1 });
dual_vector!(DualVec3, Vec3, Vector3, 3, { x 0, y 1, z 2 });
