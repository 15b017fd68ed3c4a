//! The table of operations: one row each. The enum, the encoding, the listing, the verifier, the
//! evaluation on every number type, the recorded WGSL, the interpreter's `switch`, the language's
//! built-ins and the reference are all derived from it.
//!
//! To add a shape: write its body under [`crate::ops`], add a row here, add a test scene. A row
//! reads: name, body, inputs and parameters, result, how a call's arguments become the parameters,
//! and the facts about it.

use crate::bounds::Bounds;
use crate::ops::{prepare, volumes};
use crate::real::Real;
use crate::row::{
    ArgumentKind as A, BoundsRule, Category, Exactness, Input, Language, Meta, Output, Parameter,
    ParameterType, Row, Slope, optional, required,
};

/// Hands the rows to a macro: `callback! { rows… }`.
macro_rules! for_each_operation {
    ($callback:path) => {
        $callback! {
            // ---------------------------------------------------------------- solids
            /// A ball of radius `r` around the origin.
            Sphere "sphere" = shapes::sphere(p: Point; r: Scalar) -> Value, prepare::same, Meta {
                category: Category::Shape3,
                language: Some(Language { name: "sphere", arguments: &[required("r", A::Radius)] }),
                exactness: Exactness::Exact,
                slope: Slope::Constant(1.0),
                bounds: BoundsRule::Shape(|a| Bounds::ball(a[0])),
                source: "J. C. Hart, Sphere Tracing, 1996, appendix A",
            };
            /// A box of the full size `size`, centred at the origin.
            Cuboid "cuboid" = shapes::cuboid(p: Point; half: Vec3) -> Value, prepare::half_size, Meta {
                category: Category::Shape3,
                language: Some(Language { name: "box", arguments: &[required("size", A::Size3)] }),
                exactness: Exactness::Exact,
                slope: Slope::Constant(1.0),
                bounds: BoundsRule::Shape(volumes::cuboid),
                source: "I. Quilez, Distance Functions: box",
            };
            /// A box of the full size `size` with edges and corners rounded by `round`.
            RoundedCuboid "rounded_cuboid" = shapes::rounded_cuboid(p: Point; half: Vec3, round: Scalar) -> Value, prepare::rounded_size, Meta {
                category: Category::Shape3,
                language: Some(Language { name: "box", arguments: &[required("size", A::Size3), optional("round", A::LengthOrZero, &[0.0])] }),
                exactness: Exactness::Exact,
                slope: Slope::Constant(1.0),
                bounds: BoundsRule::Shape(volumes::cuboid),
                source: "I. Quilez, Distance Functions: round box",
            };
            // ---------------------------------------------------------------- combine
            /// Whatever is in either operand.
            Union "union" = combine::union(a: Value, b: Value;) -> Value, prepare::same, Meta {
                category: Category::Combine,
                language: None,
                exactness: Exactness::ExactOutside,
                slope: Slope::Largest(1.0),
                bounds: BoundsRule::Hull,
                source: "A. Ricci, A Constructive Geometry for Computer Graphics, 1973",
            };
            /// Whatever is in either operand, with a blend that adds at most a quarter of `width`.
            SmoothUnion "smooth_union" = combine::smooth_union(a: Value, b: Value; width: Scalar, coefficient: Scalar) -> Value, prepare::same, Meta {
                category: Category::Combine,
                language: None,
                exactness: Exactness::Bound,
                slope: Slope::Largest(1.0),
                bounds: BoundsRule::HullGrown(|a| a[0] / 4.0),
                source: "I. Quilez, Smooth Minimum, 2013: quadratic",
            };
            // ---------------------------------------------------------------- distance
            /// The surface moved outwards by `by`; rounds edges that stand out.
            Offset "offset" = distance::offset(d: Value; by: Scalar) -> Value, prepare::same, Meta {
                category: Category::Distance,
                language: Some(Language { name: "offset", arguments: &[required("by", A::Offset)] }),
                exactness: Exactness::Exact,
                slope: Slope::Largest(1.0),
                bounds: BoundsRule::HullGrown(|a| a[0]),
                source: "J. C. Hart, Sphere Tracing, 1996",
            };
            // ---------------------------------------------------------------- math
            /// The first coordinate of the point.
            X "x" = math::x(p: Point;) -> Value, prepare::same, Meta { category: Category::Math, ..MATH };
            /// The sum of two numbers.
            Add "add" = math::add(a: Value, b: Value;) -> Value, prepare::same, Meta { slope: Slope::Sum, ..MATH };
            /// A number of the program.
            Constant "constant" = math::constant(; value: Scalar) -> Value, prepare::same, MATH;
            /// The point with the three operands as its coordinates.
            MakePoint "make_point" = math::point(x: Value, y: Value, z: Value;) -> Point, prepare::same, MATH;
        }
    };
}
pub(crate) use for_each_operation;

/// What all rows of arithmetic have in common.
const MATH: Meta = Meta {
    category: Category::Math,
    language: None,
    exactness: Exactness::Field,
    slope: Slope::Unknown,
    bounds: BoundsRule::Everything,
    source: "",
};

macro_rules! input_kind {
    (Point) => {
        Input::Point
    };
    (Plane) => {
        Input::Point
    };
    (Value) => {
        Input::Value
    };
}

/// The enum and the rows.
macro_rules! define_operations {
    ($(
        $(#[doc = $doc:literal])+
        $name:ident $text:literal = $module:ident::$body:ident(
            $($input:ident: $kind:ident),* ; $($parameter:ident: $ty:ident),*
        ) -> $output:ident, $prepare:ident::$prepared:ident, $meta:expr;
    )+) => {
        /// An operation: a row of the table. Its number is its opcode.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum Op {
            $($(#[doc = $doc])+ $name,)+
        }

        /// All rows, in the order of their opcodes.
        pub static ROWS: &[Row] = &[$(
            Row {
                op: Op::$name,
                name: $text,
                doc: concat!($($doc, "\n"),+),
                inputs: &[$(input_kind!($kind)),*],
                parameters: &[$(
                    Parameter { name: stringify!($parameter), ty: ParameterType::$ty }
                ),*],
                output: Output::$output,
                meta: $meta,
            },
        )+];

        /// Turns the numbers of a call's arguments, in order, into the parameters' numbers, in
        /// order and without gaps.
        pub fn prepare<R: Real>(op: Op, arguments: &[R]) -> Vec<R> {
            match op {
                $(Op::$name => $prepare::$prepared::<R>(arguments),)+
            }
        }
    };
}
for_each_operation!(define_operations);

impl Op {
    /// Its row.
    pub fn row(self) -> &'static Row {
        &ROWS[self as usize]
    }
    /// The operation with this opcode.
    pub fn from_code(code: u8) -> Option<Self> {
        ROWS.get(usize::from(code)).map(|row| row.op)
    }
    /// The operation of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        ROWS.iter().find(|row| row.name == name).map(|row| row.op)
    }
}

/// A number that changes whenever a row's name, inputs or parameters do: a program is only
/// readable by the table that wrote it.
pub fn table_hash() -> u32 {
    let mut hash: u32 = 0x811c_9dc5;
    let mut feed = |text: &str| {
        for byte in text.bytes().chain([0]) {
            hash = (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193);
        }
    };
    for row in ROWS {
        feed(row.name);
        feed(&format!("{:?}{:?}{:?}", row.inputs, row.output, row.parameters));
    }
    hash
}
