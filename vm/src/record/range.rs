//! Recorded intervals: a body recorded on them is the WGSL that bounds it over a box.
//!
//! An interval is a `vec2f` of its ends; what is done with it is a function of the
//! [prelude](crate::prelude), recorded from [`crate::outward`]. One that is a single number is known to
//! be one, as all parameters of operations are.

use super::{
    ARENA, Bool, Kind, Recorded, RecordedNode, Scalar, Type, Vec3, call, component, is_one,
    is_zero, push, set_name,
};
use crate::interval::NOISE_SLOPE;
use crate::outward::{ANY, Ends, Known};
use crate::real::{Real, Vector3, lit};
use crate::vector::{V2, V3};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// The WGSL declaration of a box of points: the ends of each coordinate.
pub const BOX_POINT: &str = "struct BoxPoint { x: vec2f, y: vec2f, z: vec2f }\n";

/// A recorded interval.
#[derive(Clone, Copy, Debug)]
pub struct Range(u32);

impl Range {
    /// The interval of one number.
    pub fn point(number: Scalar) -> Self {
        Self(call("vec2f", vec![number.0], Type::Range))
    }

    /// The points whose coordinates are these numbers.
    pub fn points(p: Vec3) -> V3<Self> {
        V3::of(Self::point(p.x()), Self::point(p.y()), Self::point(p.z()))
    }

    /// The interval with these ends.
    pub fn of(ends: Ends<Scalar>) -> Self {
        Self(call("vec2f", vec![ends.low.0, ends.high.0], Type::Range))
    }

    /// Its ends.
    pub fn ends(self) -> Ends<Scalar> {
        Ends {
            low: Scalar(component(self.0, "x", 0, "vec2f")),
            high: Scalar(component(self.0, "y", 1, "vec2f")),
        }
    }

    /// Its number, if it is known to be one.
    fn number(self) -> Option<Scalar> {
        ARENA.with_borrow(|arena| match &arena.nodes[self.0 as usize].kind {
            Kind::Call("vec2f", parts) if parts.len() == 1 => Some(Scalar(parts[0])),
            _ => None,
        })
    }

    fn literals(low: f64, high: f64) -> Self {
        Self::of(Ends {
            low: lit(low),
            high: lit(high),
        })
    }

    fn one(self, function: &'static str) -> Self {
        Self(call(function, vec![self.0], Type::Range))
    }

    fn two(self, function: &'static str, other: Self) -> Self {
        Self(call(function, vec![self.0, other.0], Type::Range))
    }

    fn is_zero(self) -> bool {
        is_zero(self.0)
    }

    fn is_one(self) -> bool {
        self.number().is_some_and(|number| is_one(number.0))
    }
}

impl Add for Range {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        match (self.is_zero(), other.is_zero()) {
            (true, _) => other,
            (_, true) => self,
            _ => self.two("interval_add", other),
        }
    }
}

impl Sub for Range {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        match (self.is_zero(), other.is_zero()) {
            (_, true) => self,
            (true, _) => -other,
            _ => self.two("interval_sub", other),
        }
    }
}

impl Mul for Range {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        if self.is_zero() || other.is_one() {
            return self;
        }
        if other.is_zero() || self.is_one() {
            return other;
        }
        if self.0 == other.0 {
            return self.square();
        }
        let scaled = |a: Self, factor: Scalar| {
            let scaled = call("interval_scale", vec![a.0, factor.0], Type::Range);
            Self(scaled)
        };
        match (self.number(), other.number()) {
            (_, Some(factor)) => scaled(self, factor),
            (Some(factor), _) => scaled(other, factor),
            _ => self.two("interval_mul", other),
        }
    }
}

impl Div for Range {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        if self.is_zero() || other.is_one() {
            return self;
        }
        self.two("interval_div", other)
    }
}

impl Neg for Range {
    type Output = Self;
    fn neg(self) -> Self {
        if self.is_zero() {
            return self;
        }
        if let Some(number) = self.number() {
            return Self::point(-number);
        }
        let swapped = push(Kind::Member(self.0, "yx"), Type::Range);
        Self(push(Kind::Prefix("-", swapped), Type::Range))
    }
}

impl Real for Range {
    type Bool = Known<Bool>;
    type Vec2 = V2<Self>;
    type Vec3 = V3<Self>;

    fn constant(value: f64) -> Self {
        Self::point(lit(value))
    }
    fn abs(self) -> Self {
        self.one("interval_abs")
    }
    fn sqrt(self) -> Self {
        self.one("interval_sqrt")
    }
    fn square(self) -> Self {
        self.one("interval_square")
    }
    fn floor(self) -> Self {
        self.one("floor")
    }
    fn fract(self) -> Self {
        self.one("interval_fract")
    }
    fn min(self, other: Self) -> Self {
        self.two("min", other)
    }
    fn max(self, other: Self) -> Self {
        self.two("max", other)
    }
    fn length2(x: Self, y: Self) -> Self {
        x.two("interval_length2", y)
    }
    fn length3(x: Self, y: Self, z: Self) -> Self {
        let parts = vec![x.0, y.0, z.0];
        Self(call("interval_length3", parts, Type::Range))
    }
    fn sin(self) -> Self {
        self.one("interval_sine")
    }
    fn cos(self) -> Self {
        self.one("interval_cosine")
    }
    fn atan2(self, x: Self) -> Self {
        self.two("interval_arctangent", x)
    }
    fn exp2(self) -> Self {
        self.one("interval_exponential")
    }
    fn log2(self) -> Self {
        self.one("interval_logarithm")
    }
    fn power_of_two(self) -> Self {
        self.exp2()
    }
    fn exponent(self) -> Self {
        self.log2().floor()
    }
    fn mantissa(self) -> Self {
        Self::literals(1.0, 2.0)
    }
    fn lattice(_: V3<Self>, _: Self) -> V3<Self> {
        let any = Self::literals(-1.0, 1.0);
        V3::of(any, any, any)
    }
    fn lattice_edge(_: V3<Self>, _: Self) -> V3<Self> {
        let sign = Self::literals(-1.0, 1.0);
        V3::of(Self::literals(1.0, 2.0), sign, sign)
    }
    fn noise(p: V3<Self>, seed: Self) -> Self {
        match seed.number() {
            Some(seed) => {
                let parts = vec![p.x.0, p.y.0, p.z.0, seed.0];
                Self(call("interval_noise", parts, Type::Range))
            }
            None => Self::literals(-1.5, 1.5),
        }
    }
    fn noise_gradient(p: V3<Self>, seed: Self) -> (Self, V3<Self>) {
        let slope = Self::literals(-NOISE_SLOPE, NOISE_SLOPE);
        (Self::noise(p, seed), V3::of(slope, slope, slope))
    }
    fn ellipsoid(p: V3<Self>, r: V3<Self>) -> Self {
        match [r.x.number(), r.y.number(), r.z.number()] {
            [Some(x), Some(y), Some(z)] => {
                let parts = vec![p.x.0, p.y.0, p.z.0, Vec3::new(x, y, z).0];
                Self(call("interval_ellipsoid", parts, Type::Range))
            }
            _ => Self::literals(-ANY, ANY),
        }
    }
    fn ellipsoid_gradient(p: V3<Self>, r: V3<Self>) -> (Self, V3<Self>) {
        let any = Self::literals(-1.0, 1.0);
        (Self::ellipsoid(p, r), V3::of(any, any, any))
    }
    fn noise_slope(p: V3<Self>, seed: Self) -> V3<Self> {
        Self::noise_gradient(p, seed).1
    }
    fn jump_gradient(_: V3<Self>, _: Known<Bool>) -> V3<Self> {
        let any = Self::literals(-ANY, ANY);
        V3::of(any, any, any)
    }
    fn unit_component(self) -> Self {
        self.clamp(lit(-1.0), lit(1.0))
    }
    fn named(self, name: &'static str) -> Self {
        set_name(self.0, name);
        self
    }
    fn less(self, other: Self) -> Known<Bool> {
        crate::outward::less(self.ends(), other.ends())
    }
    fn and(a: Known<Bool>, b: Known<Bool>) -> Known<Bool> {
        Known {
            may: Scalar::and(a.may, b.may),
            may_not: Scalar::or(a.may_not, b.may_not),
        }
    }
    fn or(a: Known<Bool>, b: Known<Bool>) -> Known<Bool> {
        Known {
            may: Scalar::or(a.may, b.may),
            may_not: Scalar::and(a.may_not, b.may_not),
        }
    }
    fn not(a: Known<Bool>) -> Known<Bool> {
        Known {
            may: a.may_not,
            may_not: a.may,
        }
    }
    fn select(condition: Known<Bool>, then: Self, otherwise: Self) -> Self {
        if then.0 == otherwise.0 {
            return then;
        }
        let parts = vec![condition.may.0, condition.may_not.0, then.0, otherwise.0];
        Self(call("interval_select", parts, Type::Range))
    }
}

impl Recorded for Range {
    const TYPE: Type = Type::Range;
    fn parameter(name: &str) -> Self {
        Self(push(Kind::Parameter(name.to_owned()), Type::Range))
    }
    fn node(self) -> RecordedNode {
        RecordedNode(self.0)
    }
}

impl Recorded for V3<Range> {
    const TYPE: Type = Type::BoxPoint;
    fn parameter(name: &str) -> Self {
        let whole = push(Kind::Parameter(name.to_owned()), Type::BoxPoint);
        let member = |axis| Range(push(Kind::Member(whole, axis), Type::Range));
        V3::of(member("x"), member("y"), member("z"))
    }
    fn node(self) -> RecordedNode {
        let parts = vec![self.x.0, self.y.0, self.z.0];
        RecordedNode(call("BoxPoint", parts, Type::BoxPoint))
    }
}
