//! The facts about an operation in its row of the table, besides its body.

use crate::blend::Blend;
use crate::bounds::Bounds;

/// The type of an operation's parameter: a constant of the program, possibly dependent on `param`s.
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
    /// Returns the number of numbers it consists of.
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
    /// Its type, which gives the number of constants that it takes.
    pub ty: ParameterType,
}

/// An input of an operation besides its parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// The current point.
    Point,
    /// A previously computed value: a distance, or any number of a raw field.
    Value,
}

/// The result of an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// A value.
    Value,
    /// A new current point.
    Point,
}

/// The section of the reference that describes an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Category {
    /// A solid: its distance at a point.
    Shape3,
    /// A 2-D shape in the xy plane.
    Shape2,
    /// A combination of two distances.
    Combine,
    /// A map of the point, before the shape is evaluated.
    Domain,
    /// A change of the distance, after the shape is evaluated.
    Distance,
    /// A conversion between 2-D shapes and solids.
    Dimension,
    /// Arithmetic of raw fields.
    Math,
    /// An operation that the compiler inserts; not a word of the language.
    Internal,
}

/// The relation of a result to the true distance to the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exactness {
    /// The Euclidean distance (given exact operands), inside and outside.
    Exact,
    /// Exact outside, at most the distance inside.
    ExactOutside,
    /// At most the distance, but possibly less.
    Bound,
    /// Unknown: only the slope bound makes it safe to march.
    Unknown,
}

/// The rule for the slope bound of a result, given those of its operands.
#[derive(Clone, Copy, Debug)]
pub enum SlopeRule {
    /// A constant, for shapes (per unit of the local point).
    Constant(f64),
    /// A function of the parameters.
    FromParams(fn(&[f64]) -> f64),
    /// The largest operand's, times a factor.
    MaxOfOperands(f64),
    /// The largest operand's, but at least one: the operation contributes a distance of its own.
    MaxOfOperandsOrOne,
    /// For steps: the value is discontinuous, but a safe step on both sides.
    Step,
    /// The sum of the operands'.
    Sum,
    /// The root of the sum of the operands' squares.
    Norm,
    /// The largest operand's, plus a function of the parameters.
    PlusParams(fn(&[f64]) -> f64),
    /// The operand's, times a function of the parameters.
    ScaledBy(fn(&[f64]) -> f64),
    /// For motions, folds and projections of the point: nothing is stretched.
    Fold,
    /// For other maps of the point: the largest stretch of the map. It depends on the parameters and on the
    /// bounds of the shape that is evaluated at its result.
    PointMap(fn(&[f64], &Bounds) -> f64),
    /// No bound follows from the row; the compiler derives one by interval arithmetic.
    Unbounded,
}

impl SlopeRule {
    /// Returns the bound of a value, given those of its operands and the largest stretch of the point. For a
    /// fold, returns the stretch of its result.
    ///
    /// `at_parameters` evaluates a function of the parameters: at their values, or at its largest over
    /// all their values. The bound is infinite for maps that stretch, and where no rule is known.
    pub fn bound(
        self,
        operands: &[f64],
        stretch: f64,
        at_parameters: impl FnOnce(fn(&[f64]) -> f64) -> f64,
    ) -> f64 {
        let largest = operands.iter().copied().fold(0.0, f64::max);
        match self {
            Self::Constant(slope) => slope * stretch,
            Self::FromParams(slope) => at_parameters(slope) * stretch,
            Self::MaxOfOperands(factor) => largest * factor,
            Self::MaxOfOperandsOrOne | Self::Step => largest.max(stretch),
            Self::Sum => operands.iter().sum(),
            Self::Norm => operands.iter().map(|v| v * v).sum::<f64>().sqrt(),
            Self::PlusParams(addend) => largest + at_parameters(addend) * stretch,
            Self::ScaledBy(factor) => largest * at_parameters(factor),
            Self::Fold => stretch,
            Self::PointMap(_) | Self::Unbounded => f64::INFINITY,
        }
    }
}

/// The continuity of a result as a function of its operands, or of the point that it maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Continuity {
    /// Continuous, at any slope.
    Continuous,
    /// Jumps at certain operands or points: a floor, a comparison, an angle, the border of two cells.
    Jumps,
    /// Equal to one of two operands: it jumps with the condition where these differ.
    Selects,
    /// Unbounded on both sides of a pole: a quotient, a tangent.
    HasPoles,
}

/// The operands for which a result is defined. For others, it is a finite number without a meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DefinedFor {
    /// All operands.
    All,
    /// A first operand of at least 0: roots, logarithms and powers.
    NotNegative,
    /// A first operand from −1 to 1: arc functions.
    UpToOne,
    /// Two operands that are not both zero: quotients.
    NotBothZero,
    /// A second operand other than zero: remainders.
    DivisorNotZero,
}

impl DefinedFor {
    /// Reports whether a result is defined for these operands.
    pub fn includes(self, operands: &[f64]) -> bool {
        match (self, operands) {
            (Self::NotNegative, [a, ..]) => *a >= 0.0,
            (Self::UpToOne, [a, ..]) => a.abs() <= 1.0,
            (Self::NotBothZero, [a, b, ..]) => *a != 0.0 || *b != 0.0,
            (Self::DivisorNotZero, [_, b, ..]) => *b != 0.0,
            _ => true,
        }
    }
}

/// The rule for the bounding box of a result, given those of its operands.
#[derive(Clone, Copy, Debug)]
pub enum BoundsRule {
    /// For shapes that have the same extent on both sides of the origin: the extents along x, y and z.
    Centred([AxisExtent; 3]),
    /// For other shapes: a function of the parameters.
    Shape(fn(&[f64]) -> Bounds),
    /// The hull of all operands.
    Hull,
    /// The hull of all operands, grown by a function of the parameters.
    HullGrown(fn(&[f64]) -> f64),
    /// The intersection of all operands.
    Intersection,
    /// The first operand's.
    FirstOperand,
    /// The first operand's, mapped by a function of the parameters.
    Map(fn(&[f64], &Bounds) -> Bounds),
    /// All of space.
    Infinite,
}

impl BoundsRule {
    /// Returns the bounding box of a shape by its parameters; `None` for a rule that is none for shapes.
    pub fn shape_bounds(&self, parameters: &[f64]) -> Option<Bounds> {
        match self {
            Self::Centred(extents) => Some(Bounds::centred(extents.map(|e| e.value(parameters)))),
            Self::Shape(bounds) => Some(bounds(parameters)),
            _ => None,
        }
    }
}

/// The extent of a shape along an axis, from the origin. Parameters are given by their indices.
#[derive(Clone, Copy, Debug)]
pub enum AxisExtent {
    /// The sum of some parameters.
    Sum(&'static [usize]),
    /// The largest of some parameters.
    Largest(&'static [usize]),
    /// Another function of the parameters.
    Function(fn(&[f64]) -> f64),
    /// No limit.
    Infinite,
}

impl AxisExtent {
    /// Returns the extent of a shape with some parameters.
    pub fn value(self, parameters: &[f64]) -> f64 {
        let values = |indices: &'static [usize]| indices.iter().map(|&index| parameters[index]);
        match self {
            Self::Sum(indices) => values(indices).sum(),
            Self::Largest(indices) => values(indices).fold(f64::NEG_INFINITY, f64::max),
            Self::Function(extent) => extent(parameters),
            Self::Infinite => f64::INFINITY,
        }
    }
}

/// The kind of an argument in a scene, which determines its syntax and its valid values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArgumentKind {
    /// A radius, larger than zero. It may be given as a diameter, under the name with `d` for `r`.
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
    /// Integers of at least one along x, y and z; one number stands for all three.
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
    /// An integer of at least one.
    Count,
}

impl ArgumentKind {
    /// Returns the number of numbers it consists of.
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
    /// Its kind, which gives the range of valid values.
    pub kind: ArgumentKind,
    /// Its default value; lengths are in scene units. `None` if every call must give it.
    pub default: Option<&'static [f64]>,
}

/// Creates an argument that every call must give.
pub const fn required(name: &'static str, kind: ArgumentKind) -> Argument {
    Argument {
        name,
        kind,
        default: None,
    }
}

/// Creates an argument that a call may omit.
pub const fn optional(name: &'static str, kind: ArgumentKind, default: &'static [f64]) -> Argument {
    Argument {
        name,
        kind,
        default: Some(default),
    }
}

/// The built-in of the language that creates an operation. Rows that share a name are variants: a call
/// selects the first row that has all its arguments.
#[derive(Clone, Copy, Debug)]
pub struct BuiltinSignature {
    /// The word in a scene.
    pub name: &'static str,
    /// Its arguments, in order.
    pub arguments: &'static [Argument],
}

/// A set operation of two solids.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SetOperation {
    /// The region inside at least one of them.
    Union,
    /// The region inside both.
    Intersection,
    /// The region inside the first, but not inside the second.
    Subtraction,
}

/// The part of a row that is data.
#[derive(Clone, Copy, Debug)]
pub struct OpFacts {
    /// The section of the reference.
    pub category: Category,
    /// The built-in that creates it, if there is one.
    pub language: Option<BuiltinSignature>,
    /// The relation of the result to the true distance.
    pub exactness: Exactness,
    /// The rule for its slope bound.
    pub slope: SlopeRule,
    /// Its continuity as a function of operands or point.
    pub continuity: Continuity,
    /// The operands for which its result is defined.
    pub defined_for: DefinedFor,
    /// The rule for its bounding box.
    pub bounds: BoundsRule,
    /// The set operation that it performs, with a blend or without.
    pub set: Option<SetOperation>,
    /// The blend that it performs, if it is one.
    pub blend: Option<Blend>,
    /// Set if two numbers may be exchanged without a change of any bit. Of blends, the method of the row decides.
    pub is_commutative: bool,
    /// Set if operands are compared by sign and order alone: dividing each by its own slope bound leaves
    /// the surface unchanged.
    pub uses_only_signs: bool,
    /// Set if it reads a lattice of hashed values, as noise does: it varies at the lattice's scale, so bounds over
    /// larger boxes are loose.
    pub reads_lattice: bool,
    /// The flat faces that it has for all parameters.
    pub flats: &'static [Flat],
    /// Set if its shapes are convex for all parameters. Unset is safe: fewer cutters are then extended.
    pub is_convex: bool,
    /// The axis about which its shapes are rotationally symmetric for all parameters. `None` is safe: more
    /// copies are then evaluated.
    pub axis_of_revolution: Option<usize>,
    /// Set if its solids stay the same when x becomes y, y becomes z and z becomes x. None of the axes is up
    /// then, and the solid is not turned in scenes with z up.
    pub has_equal_axes: bool,
    /// The author and the publication of the formula.
    pub source: &'static str,
}

impl OpFacts {
    /// Returns the growth of the hull of the operands' boxes; `None` if no growth bounds the result.
    pub fn hull_growth(&self, numbers: &[f64], operands: usize) -> Option<f64> {
        match (self.bounds, self.blend) {
            (BoundsRule::Hull, _) => Some(0.0),
            (BoundsRule::HullGrown(_), Some(blend)) => {
                Some(blend.kernel.max_chain_offset(numbers[0], operands))
            }
            // Each step of a chain may add to the sum of the steps before it.
            (BoundsRule::HullGrown(rule), None) => {
                Some(rule(numbers) * operands.saturating_sub(1).max(1) as f64)
            }
            _ => None,
        }
    }
}

/// Two flat faces across a coordinate axis, at the same distance from the origin on both sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flat {
    /// Index of the axis across which they lie: 0 to 2.
    pub axis: usize,
    /// Index of the parameter that is their distance from the origin; nothing else depends on it.
    pub half: usize,
}

/// Returns the first position from `at` on where `width` numbers lie within one vec4 of the pool. So a
/// kernel reads each parameter by a single load.
pub const fn align(at: usize, width: usize) -> usize {
    if at % 4 + width > 4 {
        at.next_multiple_of(4)
    } else {
        at
    }
}
