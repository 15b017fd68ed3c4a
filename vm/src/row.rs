//! What a row of the operation table says of an operation, besides its body.

use crate::bounds::Bounds;
use crate::kernel::Blend;
use crate::table::Op;

/// The type of an operation's parameter: a constant of the program, or one that follows `param`s.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterType {
    /// One number.
    Scalar,
    /// Two numbers.
    Vec2,
    /// Three numbers.
    Vec3,
}

impl ParameterType {
    /// How many numbers it is made of.
    pub const fn width(self) -> usize {
        match self {
            Self::Scalar => 1,
            Self::Vec2 => 2,
            Self::Vec3 => 3,
        }
    }
}

/// A parameter of an operation.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Its name, the same in Rust, WGSL and the listing.
    pub name: &'static str,
    /// Its type.
    pub ty: ParameterType,
}

/// What an operation reads besides its parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// The current point.
    Point,
    /// A value computed before: a distance, or any number of a raw field.
    Value,
}

/// What an operation gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// A value.
    Value,
    /// A new current point.
    Point,
}

/// Where an operation belongs in the reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Category {
    /// A solid: its distance at a point.
    Shape3,
    /// A shape in the xy plane.
    Shape2,
    /// Two distances into one.
    Combine,
    /// A change of the point, before the shape is evaluated.
    Domain,
    /// A change of the distance, after the shape is evaluated.
    Distance,
    /// From a plane shape to a solid, or back.
    Dimension,
    /// Arithmetic of raw fields.
    Math,
    /// What the compiler inserts; not a word of the language.
    Internal,
}

/// How far a result may be from the true distance to the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exactness {
    /// The Euclidean distance (given exact operands), inside and outside.
    Exact,
    /// Exact outside, no more than the distance inside.
    ExactOutside,
    /// Never more than the distance, but perhaps less.
    Bound,
    /// Neither: only the slope bound makes it safe to march.
    Field,
}

/// How the steepest slope of a result follows from those of its operands.
#[derive(Clone, Copy, Debug)]
pub enum Slope {
    /// A fixed number, for shapes (per unit of the local point).
    Constant(f64),
    /// A function of the parameters.
    Of(fn(&[f64]) -> f64),
    /// The largest operand's, times a factor.
    Largest(f64),
    /// The largest operand's, but at least one: the operation adds a distance of its own.
    LargestOrOne,
    /// The same for steps: the value jumps, and is a safe step on both sides.
    Step,
    /// The sum of the operands'.
    Sum,
    /// The root of the sum of the operands' squares.
    Norm,
    /// The largest operand's, plus a function of the parameters.
    Plus(fn(&[f64]) -> f64),
    /// The operand's, times a function of the parameters.
    Times(fn(&[f64]) -> f64),
    /// For point maps: how much the map stretches, given the parameters and the bounds of what is
    /// evaluated behind it.
    Stretch(fn(&[f64], &Bounds) -> f64),
    /// Nothing is known; the compiler finds it by interval arithmetic.
    Unknown,
}

/// How a bounding volume of the solid follows from those of its operands.
#[derive(Clone, Copy, Debug)]
pub enum BoundsRule {
    /// A shape: from its parameters.
    Shape(fn(&[f64]) -> Bounds),
    /// The hull of all operands.
    Hull,
    /// The hull of all operands, grown by a function of the parameters.
    HullGrown(fn(&[f64]) -> f64),
    /// What the operands have in common.
    Common,
    /// The first operand's.
    First,
    /// The first operand's, mapped by a function of the parameters.
    Map(fn(&[f64], &Bounds) -> Bounds),
    /// All of space.
    Everything,
}

/// What an argument in a scene is, which decides how it is written and what is allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArgumentKind {
    /// A radius, larger than zero; may be given as a diameter under the name with `d` for `r`.
    Radius,
    /// A radius that may be zero.
    RadiusOrZero,
    /// A length larger than zero.
    Length,
    /// A length that may be zero.
    LengthOrZero,
    /// A length of either sign.
    Offset,
    /// Full sizes along x, y and z, larger than zero; one number stands for all three.
    Size3,
    /// Full sizes along x and y, larger than zero; one number stands for both.
    Size2,
    /// Radii along x, y and z, larger than zero; one number stands for all three.
    Radii3,
    /// Lengths along x, y and z that may be zero; one number stands for all three.
    Lengths3,
    /// Whole numbers of at least one along x, y and z; one number stands for all three.
    Counts3,
    /// A point or an offset in space.
    Vec3,
    /// A point or an offset in the plane.
    Vec2,
    /// A direction, normalised; not the zero vector.
    Direction,
    /// An angle.
    Angle,
    /// Any number.
    Number,
    /// A whole number of at least one.
    Count,
}

impl ArgumentKind {
    /// How many numbers it is made of.
    pub const fn width(self) -> usize {
        match self {
            Self::Size3
            | Self::Radii3
            | Self::Lengths3
            | Self::Counts3
            | Self::Vec3
            | Self::Direction => 3,
            Self::Size2 | Self::Vec2 => 2,
            _ => 1,
        }
    }
}

/// An argument of a built-in of the language.
#[derive(Clone, Copy, Debug)]
pub struct Argument {
    /// Its name in a call.
    pub name: &'static str,
    /// What it is.
    pub kind: ArgumentKind,
    /// Its value where a call does not give it; lengths are in scene units.
    pub default: Option<&'static [f64]>,
}

/// An argument that every call must give.
pub const fn required(name: &'static str, kind: ArgumentKind) -> Argument {
    Argument {
        name,
        kind,
        default: None,
    }
}

/// An argument that a call may leave out.
pub const fn optional(name: &'static str, kind: ArgumentKind, default: &'static [f64]) -> Argument {
    Argument {
        name,
        kind,
        default: Some(default),
    }
}

/// The built-in of the language that makes an operation. Rows that share a name are variants: a
/// call takes the first row that knows all arguments it gives.
#[derive(Clone, Copy, Debug)]
pub struct Language {
    /// The word in a scene.
    pub name: &'static str,
    /// Its arguments, in order.
    pub arguments: &'static [Argument],
}

/// A set operation of two solids.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SetOperation {
    /// All that is in either.
    Union,
    /// All that is in both.
    Intersection,
    /// The first without the second.
    Subtraction,
}

/// The part of a row that is written as data.
#[derive(Clone, Copy, Debug)]
pub struct Meta {
    /// Where it belongs in the reference.
    pub category: Category,
    /// The built-in that makes it, if there is one.
    pub language: Option<Language>,
    /// How near the result is to a distance.
    pub exactness: Exactness,
    /// How its slope follows.
    pub slope: Slope,
    /// How its bounding volume follows.
    pub bounds: BoundsRule,
    /// The set operation that it is, with a blend or without.
    pub set: Option<SetOperation>,
    /// The blend that it is, if it is one.
    pub blend: Option<Blend>,
    /// Whether operands are compared by sign and order alone: dividing each by a slope of its own
    /// leaves the surface where it is.
    pub only_signs: bool,
    /// The flat faces that it has whatever its parameters.
    pub flats: &'static [Flat],
    /// Who published the formula, and where.
    pub source: &'static str,
}

/// Two flat faces across a coordinate axis, as far from the origin on both sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flat {
    /// The axis.
    pub axis: usize,
    /// The position of their distance from the origin among the prepared numbers; nothing else follows from it.
    pub half: usize,
}

/// A row of the table.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// The operation.
    pub op: Op,
    /// Its name in Rust, WGSL and listings.
    pub name: &'static str,
    /// Its meaning.
    pub doc: &'static str,
    /// What it reads.
    pub inputs: &'static [Input],
    /// Its parameters.
    pub parameters: &'static [Parameter],
    /// What it gives.
    pub output: Output,
    /// The rest.
    pub meta: Meta,
}

impl Row {
    /// Whether it reads the current point.
    pub fn reads_point(&self) -> bool {
        self.inputs.contains(&Input::Point)
    }
    /// How many values it reads.
    pub fn arity(&self) -> usize {
        self.inputs
            .iter()
            .filter(|&&input| input == Input::Value)
            .count()
    }
    /// Where each parameter starts, counted in numbers; see [`align`].
    pub fn offsets(&self) -> Vec<usize> {
        let mut at = 0;
        let place = |p: &Parameter| {
            let start = align(at, p.ty.width());
            at = start + p.ty.width();
            start
        };
        self.parameters.iter().map(place).collect()
    }
    /// How many numbers the parameters take, gaps included.
    pub fn parameter_width(&self) -> usize {
        match (self.offsets().last(), self.parameters.last()) {
            (Some(start), Some(last)) => start + last.ty.width(),
            _ => 0,
        }
    }
}

/// The first position from `at` on where `width` numbers lie within one vec4 of the pool, so that
/// a kernel reads each parameter from a single load.
pub const fn align(at: usize, width: usize) -> usize {
    if at % 4 + width > 4 {
        at.next_multiple_of(4)
    } else {
        at
    }
}
