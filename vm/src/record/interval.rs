//! Recorded intervals: a body recorded on them becomes the WGSL that bounds it over a box.
//!
//! An interval is a `vec2f` of its ends. Its arithmetic consists of functions of the
//! [prelude](crate::prelude), recorded from [`crate::wgsl_interval`]. Intervals of a single number are
//! tracked as such, which includes all parameters of operations.

use super::{
    ARENA, Bool, Kind, Recorded, RecordedNode, RecordedType, Scalar, Vec3, call, component, is_one,
    is_zero, push, set_name,
};
use crate::interval::MAX_NOISE_SLOPE;
use crate::real::{Real, Vector3, lit};
use crate::vector::{V2, V3};
use crate::wgsl_interval::{UNBOUNDED, WgslInterval, WgslTristate};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// The WGSL declaration of a box of points: the ends of each coordinate.
pub const BOX_POINT: &str = "struct BoxPoint { x: vec2f, y: vec2f, z: vec2f }\n";

/// A recorded interval.
#[derive(Clone, Copy, Debug)]
pub struct RecordedInterval(u32);

impl RecordedInterval {
    /// Creates the interval of one number.
    pub fn point(number: Scalar) -> Self {
        Self(call("vec2f", vec![number.0], RecordedType::Interval))
    }

    /// Creates the box of a single point.
    pub fn points(p: Vec3) -> V3<Self> {
        V3::new(Self::point(p.x()), Self::point(p.y()), Self::point(p.z()))
    }

    /// Creates the interval with these ends.
    pub fn from_ends(ends: WgslInterval<Scalar>) -> Self {
        Self(call(
            "vec2f",
            vec![ends.low.0, ends.high.0],
            RecordedType::Interval,
        ))
    }

    /// Returns the ends.
    pub fn ends(self) -> WgslInterval<Scalar> {
        WgslInterval {
            low: Scalar(component(self.0, "x", 0, "vec2f")),
            high: Scalar(component(self.0, "y", 1, "vec2f")),
        }
    }

    /// Returns the number, if the interval consists of a single one.
    fn number(self) -> Option<Scalar> {
        ARENA.with_borrow(|arena| match &arena.nodes[self.0 as usize].kind {
            Kind::Call("vec2f", parts) if parts.len() == 1 => Some(Scalar(parts[0])),
            _ => None,
        })
    }

    fn literals(low: f64, high: f64) -> Self {
        Self::from_ends(WgslInterval {
            low: lit(low),
            high: lit(high),
        })
    }

    fn unary(self, function: &'static str) -> Self {
        Self(call(function, vec![self.0], RecordedType::Interval))
    }

    fn binary(self, function: &'static str, other: Self) -> Self {
        Self(call(
            function,
            vec![self.0, other.0],
            RecordedType::Interval,
        ))
    }

    fn is_zero(self) -> bool {
        is_zero(self.0)
    }

    fn is_one(self) -> bool {
        self.number().is_some_and(|number| is_one(number.0))
    }
}

impl Add for RecordedInterval {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        match (self.is_zero(), other.is_zero()) {
            (true, _) => other,
            (_, true) => self,
            _ => self.binary("interval_add", other),
        }
    }
}

impl Sub for RecordedInterval {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        match (self.is_zero(), other.is_zero()) {
            (_, true) => self,
            (true, _) => -other,
            _ => self.binary("interval_sub", other),
        }
    }
}

impl Mul for RecordedInterval {
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
            let scaled = call(
                "interval_scale",
                vec![a.0, factor.0],
                RecordedType::Interval,
            );
            Self(scaled)
        };
        match (self.number(), other.number()) {
            (_, Some(factor)) => scaled(self, factor),
            (Some(factor), _) => scaled(other, factor),
            _ => self.binary("interval_mul", other),
        }
    }
}

impl Div for RecordedInterval {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        if self.is_zero() || other.is_one() {
            return self;
        }
        self.binary("interval_div", other)
    }
}

impl Neg for RecordedInterval {
    type Output = Self;
    fn neg(self) -> Self {
        if self.is_zero() {
            return self;
        }
        if let Some(number) = self.number() {
            return Self::point(-number);
        }
        let swapped = push(Kind::Member(self.0, "yx"), RecordedType::Interval);
        Self(push(Kind::Prefix("-", swapped), RecordedType::Interval))
    }
}

impl Real for RecordedInterval {
    type Bool = WgslTristate<Bool>;
    type Vec2 = V2<Self>;
    type Vec3 = V3<Self>;

    fn constant(value: f64) -> Self {
        Self::point(lit(value))
    }
    fn abs(self) -> Self {
        self.unary("interval_abs")
    }
    fn sqrt(self) -> Self {
        self.unary("interval_sqrt")
    }
    fn square(self) -> Self {
        self.unary("interval_square")
    }
    fn floor(self) -> Self {
        self.unary("floor")
    }
    fn fract(self) -> Self {
        self.unary("interval_fract")
    }
    fn min(self, other: Self) -> Self {
        self.binary("min", other)
    }
    fn max(self, other: Self) -> Self {
        self.binary("max", other)
    }
    fn length2(x: Self, y: Self) -> Self {
        x.binary("interval_length2", y)
    }
    fn length3(x: Self, y: Self, z: Self) -> Self {
        let parts = vec![x.0, y.0, z.0];
        Self(call("interval_length3", parts, RecordedType::Interval))
    }
    fn sin(self) -> Self {
        self.unary("interval_sine")
    }
    fn cos(self) -> Self {
        self.unary("interval_cosine")
    }
    fn atan2(self, x: Self) -> Self {
        self.binary("interval_arctangent", x)
    }
    fn exp2(self) -> Self {
        self.unary("interval_exponential")
    }
    fn log2(self) -> Self {
        self.unary("interval_logarithm")
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
        V3::new(any, any, any)
    }
    fn noise_corner_gradient(_: V3<Self>, _: Self) -> V3<Self> {
        let sign = Self::literals(-1.0, 1.0);
        V3::new(Self::literals(1.0, 2.0), sign, sign)
    }
    fn noise(p: V3<Self>, seed: Self) -> Self {
        match seed.number() {
            Some(seed) => {
                let parts = vec![p.x.0, p.y.0, p.z.0, seed.0];
                Self(call("interval_noise", parts, RecordedType::Interval))
            }
            None => Self::literals(-1.5, 1.5),
        }
    }
    fn noise_gradient(p: V3<Self>, seed: Self) -> (Self, V3<Self>) {
        let slope = Self::literals(-MAX_NOISE_SLOPE, MAX_NOISE_SLOPE);
        (Self::noise(p, seed), V3::new(slope, slope, slope))
    }
    fn ellipsoid(p: V3<Self>, r: V3<Self>) -> Self {
        match [r.x.number(), r.y.number(), r.z.number()] {
            [Some(x), Some(y), Some(z)] => {
                let parts = vec![p.x.0, p.y.0, p.z.0, Vec3::new(x, y, z).0];
                Self(call("interval_ellipsoid", parts, RecordedType::Interval))
            }
            _ => Self::literals(-UNBOUNDED, UNBOUNDED),
        }
    }
    fn ellipsoid_gradient(p: V3<Self>, r: V3<Self>) -> (Self, V3<Self>) {
        let any = Self::literals(-1.0, 1.0);
        (Self::ellipsoid(p, r), V3::new(any, any, any))
    }
    fn noise_slope(p: V3<Self>, seed: Self) -> V3<Self> {
        Self::noise_gradient(p, seed).1
    }
    fn discontinuity_gradient(_: V3<Self>, _: WgslTristate<Bool>) -> V3<Self> {
        let any = Self::literals(-UNBOUNDED, UNBOUNDED);
        V3::new(any, any, any)
    }
    fn unit_component(self) -> Self {
        self.clamp(lit(-1.0), lit(1.0))
    }
    fn named(self, name: &'static str) -> Self {
        set_name(self.0, name);
        self
    }
    fn less(self, other: Self) -> WgslTristate<Bool> {
        crate::wgsl_interval::less(self.ends(), other.ends())
    }
    fn and(a: WgslTristate<Bool>, b: WgslTristate<Bool>) -> WgslTristate<Bool> {
        WgslTristate {
            can_be_true: Scalar::and(a.can_be_true, b.can_be_true),
            can_be_false: Scalar::or(a.can_be_false, b.can_be_false),
        }
    }
    fn or(a: WgslTristate<Bool>, b: WgslTristate<Bool>) -> WgslTristate<Bool> {
        WgslTristate {
            can_be_true: Scalar::or(a.can_be_true, b.can_be_true),
            can_be_false: Scalar::and(a.can_be_false, b.can_be_false),
        }
    }
    fn not(a: WgslTristate<Bool>) -> WgslTristate<Bool> {
        WgslTristate {
            can_be_true: a.can_be_false,
            can_be_false: a.can_be_true,
        }
    }
    fn select(condition: WgslTristate<Bool>, then: Self, otherwise: Self) -> Self {
        if then.0 == otherwise.0 {
            return then;
        }
        let parts = vec![
            condition.can_be_true.0,
            condition.can_be_false.0,
            then.0,
            otherwise.0,
        ];
        Self(call("interval_select", parts, RecordedType::Interval))
    }
}

impl Recorded for RecordedInterval {
    const TYPE: RecordedType = RecordedType::Interval;
    fn parameter(name: &str) -> Self {
        Self(push(
            Kind::Parameter(name.to_owned()),
            RecordedType::Interval,
        ))
    }
    fn node(self) -> RecordedNode {
        RecordedNode(self.0)
    }
}

impl Recorded for V3<RecordedInterval> {
    const TYPE: RecordedType = RecordedType::BoxPoint;
    fn parameter(name: &str) -> Self {
        let parameter = push(Kind::Parameter(name.to_owned()), RecordedType::BoxPoint);
        let member =
            |axis| RecordedInterval(push(Kind::Member(parameter, axis), RecordedType::Interval));
        V3::new(member("x"), member("y"), member("z"))
    }
    fn node(self) -> RecordedNode {
        let parts = vec![self.x.0, self.y.0, self.z.0];
        RecordedNode(call("BoxPoint", parts, RecordedType::BoxPoint))
    }
}
