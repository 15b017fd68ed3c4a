//! One operation on one number type: the dispatch that evaluation and recording use.

use crate::branching::BranchInterval;
use crate::dual::{Dual, DualVec2, DualVec3};
use crate::interval::{FloatInterval, Interval};
use crate::ops::{combine, dimension, distance, domain, math, shapes};
use crate::real::{Real, Vector2, Vector3, lit};
use crate::record::{
    Recorded, RecordedFunction, RecordedInterval, Scalar, Signature, Vec2, Vec3, record,
};
use crate::rounding::RunningError;
use crate::row::align;
use crate::table::{Op, for_each_operation};
use crate::vector::{V2, V3};

/// The result of an operation.
#[derive(Clone, Copy, Debug)]
pub enum OpResult<R: Real> {
    /// A value.
    Value(R),
    /// A new current point.
    Point(R::Vec3),
}

/// Runs one operation on one point. `values` are its operands, as many as the row's arity. `constants` are
/// its parameters in the layout of [`crate::table::Row::offsets`].
pub fn apply<R: Apply>(op: Op, p: R::Vec3, values: [R; 3], constants: &[f32]) -> OpResult<R> {
    R::apply(op, p, values, constants)
}

/// The number types that all operations are compiled for. They are compiled here and not in each crate that
/// uses them, since there are more than a hundred bodies.
pub trait Apply: Real {
    /// Runs one operation; see [`apply`].
    fn apply(op: Op, p: Self::Vec3, values: [Self; 3], constants: &[f32]) -> OpResult<Self>;
}

macro_rules! impl_apply_for {
    ($($number:ty),+) => {
        $(impl Apply for $number {
            fn apply(op: Op, p: Self::Vec3, v: [Self; 3], k: &[f32]) -> OpResult<Self> {
                apply_body(op, p, v, ParameterReader::new(k))
            }
        })+
    };
}
impl_apply_for!(
    f32,
    f64,
    Interval,
    BranchInterval,
    FloatInterval,
    RunningError,
    Dual<f32>,
    Dual<f64>,
    Dual<Interval>,
    Dual<FloatInterval>
);

/// Runs one operation whose parameters are numbers of the same type: those of the row, in order and
/// without gaps.
pub fn apply_numbers<R: Real>(op: Op, p: R::Vec3, values: [R; 3], parameters: &[R]) -> OpResult<R> {
    apply_body(op, p, values, parameters)
}

/// A source of an operation's parameters, in order.
trait ParameterSource<R: Real> {
    /// Returns the next number.
    fn scalar(&mut self) -> R;
    /// Returns the next two numbers.
    fn vec2(&mut self) -> R::Vec2;
    /// Returns the next three numbers.
    fn vec3(&mut self) -> R::Vec3;
}

impl<R: Real> ParameterSource<R> for ParameterReader<'_> {
    #[inline(always)]
    fn scalar(&mut self) -> R {
        ParameterReader::scalar(self)
    }
    #[inline(always)]
    fn vec2(&mut self) -> R::Vec2 {
        ParameterReader::vec2::<R>(self)
    }
    #[inline(always)]
    fn vec3(&mut self) -> R::Vec3 {
        ParameterReader::vec3::<R>(self)
    }
}

impl<R: Real> ParameterSource<R> for &[R] {
    fn scalar(&mut self) -> R {
        let (&first, rest) = self.split_first().unwrap_or((&lit(0.0), self));
        *self = rest;
        first
    }
    fn vec2(&mut self) -> R::Vec2 {
        let (x, y) = (self.scalar(), self.scalar());
        R::Vec2::new(x, y)
    }
    fn vec3(&mut self) -> R::Vec3 {
        let (x, y, z) = (self.scalar(), self.scalar(), self.scalar());
        R::Vec3::new(x, y, z)
    }
}

/// Reads an operation's parameters from its constants, in order.
pub(crate) struct ParameterReader<'a> {
    constants: &'a [f32],
    position: usize,
}

impl<'a> ParameterReader<'a> {
    pub(crate) fn new(constants: &'a [f32]) -> Self {
        Self {
            constants,
            position: 0,
        }
    }
    #[inline(always)]
    fn take(&mut self, width: usize) -> &'a [f32] {
        let start = align(self.position, width);
        self.position = start + width;
        &self.constants[start..self.position]
    }
    #[inline(always)]
    pub(crate) fn scalar<R: Real>(&mut self) -> R {
        R::constant(self.take(1)[0].into())
    }
    #[inline(always)]
    pub(crate) fn vec2<R: Real>(&mut self) -> R::Vec2 {
        let v = self.take(2);
        R::Vec2::new(R::constant(v[0].into()), R::constant(v[1].into()))
    }
    #[inline(always)]
    pub(crate) fn vec3<R: Real>(&mut self) -> R::Vec3 {
        let v = self.take(3);
        let c = |i: usize| R::constant(v[i].into());
        R::Vec3::new(c(0), c(1), c(2))
    }
}

/// Reads one parameter, by its type.
macro_rules! read_parameter {
    ($k:ident, $R:ty, Scalar) => {
        $k.scalar::<$R>()
    };
    ($k:ident, $R:ty, Vec2) => {
        $k.vec2::<$R>()
    };
    ($k:ident, $R:ty, Vec3) => {
        $k.vec3::<$R>()
    };
}
pub(crate) use read_parameter;

/// Takes the next parameter, by its type.
macro_rules! take_parameter {
    ($k:ident, Scalar) => {
        $k.scalar()
    };
    ($k:ident, Vec2) => {
        $k.vec2()
    };
    ($k:ident, Vec3) => {
        $k.vec3()
    };
}

macro_rules! read_input {
    ($p:ident, $v:ident, Point) => {
        $p
    };
    ($p:ident, $v:ident, Plane) => {
        $p.xy()
    };
    ($p:ident, $v:ident, Value) => {{
        let [first, rest @ ..] = $v;
        $v = [rest[0], rest[1], first];
        first
    }};
}

macro_rules! define_apply {
    ($(
        $(#[doc = $doc:literal])+
        $name:ident $text:literal = $module:ident::$body:ident(
            $($input:ident: $kind:ident),* ; $($parameter:ident: $ty:ident),*
        ) -> $output:ident, $prepare:ident::$prepared:ident, $facts:expr;
    )+) => {
        fn apply_body<R: Real>(
            op: Op,
            p: R::Vec3,
            values: [R; 3],
            mut parameters: impl ParameterSource<R>,
        ) -> OpResult<R> {
            match op {
                $(Op::$name => {
                    // One function per operation: compilers take minutes for one function that contains all
                    // bodies.
                    #[inline(never)]
                    #[allow(unused_mut, unused_variables, unused_assignments, reason = "rows differ in what they read")]
                    fn apply_row<R: Real>(
                        p: R::Vec3,
                        mut v: [R; 3],
                        k: &mut impl ParameterSource<R>,
                    ) -> OpResult<R> {
                        OpResult::$output($module::$body::<R>(
                            $(read_input!(p, v, $kind),)*
                            $(take_parameter!(k, $ty)),*
                        ))
                    }
                    apply_row::<R>(p, values, &mut parameters)
                })+
            }
        }

        fn record_on<R: Recordable>(op: Op, name: &str) -> RecordedFunction
        where
            R::Vec3: Recorded,
        {
            match op {
                $(Op::$name => record(name, |_s| $module::$body::<R>(
                    $(record_input!(_s, R, $input, $kind),)*
                    $(record_parameter!(_s, R, $parameter, $ty)),*
                )),)+
            }
        }
    };
}

/// A recordable number: plain, with its gradient, or an interval.
trait Recordable: Real + Recorded {
    fn scalar(s: &mut Signature, name: &str) -> Self;
    fn vec2(s: &mut Signature, name: &str) -> Self::Vec2;
    fn vec3(s: &mut Signature, name: &str) -> Self::Vec3;
}

impl Recordable for Scalar {
    fn scalar(s: &mut Signature, name: &str) -> Self {
        s.parameter(name)
    }
    fn vec2(s: &mut Signature, name: &str) -> Vec2 {
        s.parameter(name)
    }
    fn vec3(s: &mut Signature, name: &str) -> Vec3 {
        s.parameter(name)
    }
}

impl Recordable for Dual<Scalar> {
    fn scalar(s: &mut Signature, name: &str) -> Self {
        Dual::fixed(s.parameter(name))
    }
    fn vec2(s: &mut Signature, name: &str) -> DualVec2<Scalar> {
        DualVec2::fixed(s.parameter(name))
    }
    fn vec3(s: &mut Signature, name: &str) -> DualVec3<Scalar> {
        DualVec3::fixed(s.parameter(name))
    }
}

impl Recordable for RecordedInterval {
    fn scalar(s: &mut Signature, name: &str) -> Self {
        RecordedInterval::point(s.parameter(name))
    }
    fn vec2(s: &mut Signature, name: &str) -> V2<RecordedInterval> {
        let v: Vec2 = s.parameter(name);
        V2 {
            x: RecordedInterval::point(v.x()),
            y: RecordedInterval::point(v.y()),
        }
    }
    fn vec3(s: &mut Signature, name: &str) -> V3<RecordedInterval> {
        RecordedInterval::points(s.parameter(name))
    }
}

macro_rules! record_input {
    ($s:ident, $R:ty, $input:ident, Point) => {
        $s.parameter::<<$R as Real>::Vec3>(stringify!($input))
    };
    ($s:ident, $R:ty, $input:ident, Plane) => {
        $s.parameter::<<$R as Real>::Vec3>(stringify!($input)).xy()
    };
    ($s:ident, $R:ty, $input:ident, Value) => {
        $s.parameter::<$R>(stringify!($input))
    };
}

macro_rules! record_parameter {
    ($s:ident, $R:ty, $parameter:ident, Scalar) => {
        <$R>::scalar($s, stringify!($parameter))
    };
    ($s:ident, $R:ty, $parameter:ident, Vec2) => {
        <$R>::vec2($s, stringify!($parameter))
    };
    ($s:ident, $R:ty, $parameter:ident, Vec3) => {
        <$R>::vec3($s, stringify!($parameter))
    };
}

for_each_operation!(define_apply);

macro_rules! define_body_names {
    ($(
        $(#[doc = $doc:literal])+
        $name:ident $text:literal = $module:ident::$body:ident($($signature:tt)*)
            -> $output:ident, $prepare:ident::$prepared:ident, $facts:expr;
    )+) => {
        /// The function that computes an operation, by the operation's name. Callers with a loop of their own over few
        /// operations call it without the dispatch of [`apply`].
        #[macro_export]
        macro_rules! operation_body {
            $(($name) => { $crate::ops::$module::$body };)+
        }
    };
}
for_each_operation!(define_body_names);

/// Returns the name of an operation's WGSL function; the prefix avoids clashes with WGSL's own names.
pub fn wgsl_name(op: Op) -> String {
    format!("sdf_{}", op.row().name)
}

/// Records the operation's body as the WGSL function [`wgsl_name`]: inputs first, then parameters.
pub fn record_value(op: Op) -> RecordedFunction {
    record_on::<Scalar>(op, &wgsl_name(op))
}

/// Records the operation's body with its gradient, as a WGSL function with the suffix `_gradient`. Values
/// are `vec4f` with the gradient in `xyz`, points are `DualPoint`, parameters are plain.
pub fn record_gradient(op: Op) -> RecordedFunction {
    record_on::<Dual<Scalar>>(op, &format!("{}_gradient", wgsl_name(op)))
}

/// Records the operation's body on intervals, as a WGSL function with the suffix `_interval`. Values are
/// `vec2f` of the ends, points are `BoxPoint`, parameters are plain.
pub fn record_interval(op: Op) -> RecordedFunction {
    record_on::<RecordedInterval>(op, &format!("{}_interval", wgsl_name(op)))
}

/// Packs numbers without gaps into the aligned layout of [`crate::table::Row::offsets`].
pub fn pack_parameters(op: Op, numbers: &[f64]) -> Vec<f32> {
    let row = op.row();
    let mut laid = vec![0.0; row.parameter_width()];
    let mut numbers = numbers.iter();
    for (parameter, offset) in row.parameters.iter().zip(row.offsets()) {
        for slot in &mut laid[offset..offset + parameter.ty.width()] {
            *slot = numbers.next().map_or(0.0, |&v| v as f32);
        }
    }
    laid
}
