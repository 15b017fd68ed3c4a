//! Plain vectors of two or three numbers, for every number type whose vectors have no special structure
//! (`f32`, `f64`, intervals).

use crate::real::{Real, Vector2, Vector3};
use std::ops::{Add, Mul, Neg, Sub};

/// A vector of two numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct V2<R> {
    /// The first component.
    pub x: R,
    /// The second component.
    pub y: R,
}

/// A vector of three numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct V3<R> {
    /// The first component.
    pub x: R,
    /// The second component.
    pub y: R,
    /// The third component.
    pub z: R,
}

impl<R> V3<R> {
    /// Creates a vector from its components.
    #[inline(always)]
    pub const fn new(x: R, y: R, z: R) -> Self {
        Self { x, y, z }
    }
}

impl V3<f32> {
    /// Returns the components as an array.
    pub fn to_array(self) -> [f32; 3] {
        [self.x, self.y, self.z]
    }
}

macro_rules! componentwise {
    ($vector:ident { $($field:ident),+ }) => {
        impl<R: Real> Add for $vector<R> {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                Self { $($field: self.$field + other.$field),+ }
            }
        }
        impl<R: Real> Sub for $vector<R> {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                Self { $($field: self.$field - other.$field),+ }
            }
        }
        impl<R: Real> Mul for $vector<R> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                Self { $($field: self.$field * other.$field),+ }
            }
        }
        impl<R: Real> Mul<R> for $vector<R> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, factor: R) -> Self {
                Self { $($field: self.$field * factor),+ }
            }
        }
        impl<R: Real> Neg for $vector<R> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self { $($field: -self.$field),+ }
            }
        }
    };
}

componentwise!(V2 { x, y });
componentwise!(V3 { x, y, z });

impl<R: Real> Vector2<R> for V2<R> {
    #[inline(always)]
    fn new(x: R, y: R) -> Self {
        Self { x, y }
    }
    #[inline(always)]
    fn x(self) -> R {
        self.x
    }
    #[inline(always)]
    fn y(self) -> R {
        self.y
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self {
            x: self.x.abs(),
            y: self.y.abs(),
        }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self {
            x: self.x.min(other.x),
            y: self.y.min(other.y),
        }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self {
            x: self.x.max(other.x),
            y: self.y.max(other.y),
        }
    }
    #[inline(always)]
    fn length(self) -> R {
        R::length2(self.x, self.y)
    }
    #[inline(always)]
    fn select(condition: R::Bool, then: Self, otherwise: Self) -> Self {
        Self {
            x: R::select(condition, then.x, otherwise.x),
            y: R::select(condition, then.y, otherwise.y),
        }
    }
}

impl<R: Real> Vector3<R> for V3<R> {
    #[inline(always)]
    fn new(x: R, y: R, z: R) -> Self {
        Self { x, y, z }
    }
    #[inline(always)]
    fn x(self) -> R {
        self.x
    }
    #[inline(always)]
    fn y(self) -> R {
        self.y
    }
    #[inline(always)]
    fn z(self) -> R {
        self.z
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self {
            x: self.x.abs(),
            y: self.y.abs(),
            z: self.z.abs(),
        }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Self {
            x: self.x.floor(),
            y: self.y.floor(),
            z: self.z.floor(),
        }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self {
            x: self.x.min(other.x),
            y: self.y.min(other.y),
            z: self.z.min(other.z),
        }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self {
            x: self.x.max(other.x),
            y: self.y.max(other.y),
            z: self.z.max(other.z),
        }
    }
    #[inline(always)]
    fn length(self) -> R {
        R::length3(self.x, self.y, self.z)
    }
    #[inline(always)]
    fn select(condition: R::Bool, then: Self, otherwise: Self) -> Self {
        Self {
            x: R::select(condition, then.x, otherwise.x),
            y: R::select(condition, then.y, otherwise.y),
            z: R::select(condition, then.z, otherwise.z),
        }
    }
}
