//! Values of expressions, the environments that functions capture, and results of evaluations.

use super::blend_spec::BlendSpec;
use super::scope::Scope;
use crate::expression::ExprId;
use crate::scene::{MaterialId, ShapeId};
use sdfc_lang::Span;
use sdfc_lang::ast;
use std::ops::Deref;
use std::rc::Rc;

/// Quantity of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Quantity {
    /// A plain number.
    Plain,
    /// A length to this power, never 0, in scene units.
    Length(i8),
    /// An angle in radians.
    Angle,
    /// A time in seconds; arithmetic treats it like a plain number.
    Time,
}

impl Quantity {
    /// Returns a length to a power; a plain number for power 0.
    pub(crate) fn length(power: i8) -> Self {
        if power == 0 {
            Self::Plain
        } else {
            Self::Length(power)
        }
    }
    fn power(self) -> i8 {
        match self {
            Self::Length(power) => power,
            Self::Plain | Self::Angle | Self::Time => 0,
        }
    }
    /// Returns the quantity of a product: powers of lengths add up. An angle stays an angle, unless multiplied by
    /// a length (arc length).
    pub(crate) fn product(self, other: Self) -> Self {
        match (self, other) {
            (Self::Angle, Self::Plain | Self::Time) | (Self::Plain | Self::Time, Self::Angle) => {
                Self::Angle
            }
            (Self::Time, Self::Plain) | (Self::Plain, Self::Time) => Self::Time,
            _ => Self::length(self.power().saturating_add(other.power())),
        }
    }
    /// Returns the quantity of a quotient; an angle per length is an angle per scene unit.
    pub(crate) fn quotient(self, other: Self) -> Self {
        match (self, other) {
            (Self::Angle, Self::Plain | Self::Time | Self::Length(_)) => Self::Angle,
            (Self::Time, Self::Plain) => Self::Time,
            _ => Self::length(self.power().saturating_sub(other.power())),
        }
    }
    /// Returns the quantity of a sum, if the two can be added. A plain number adapts to the other quantity.
    pub(crate) fn sum(self, other: Self) -> Option<Self> {
        match (self, other) {
            (a, b) if a == b => Some(a),
            (Self::Plain | Self::Time, other) | (other, Self::Plain | Self::Time) => Some(other),
            _ => None,
        }
    }
    /// Returns the quantity of the square root; half of an odd power of a length is rounded towards zero.
    pub(crate) fn root(self) -> Self {
        match self {
            Self::Length(power) => Self::length(power / 2),
            other => other,
        }
    }
    /// Returns the name in messages, with its article.
    pub(crate) fn noun(self) -> &'static str {
        match self {
            Self::Plain => "a number",
            Self::Length(1) => "a length",
            Self::Length(2) => "an area",
            Self::Length(3) => "a volume",
            Self::Length(_) => "a power of a length",
            Self::Angle => "an angle",
            Self::Time => "a time",
        }
    }
}

/// A number with its quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ScalarValue {
    /// Expression that defines it.
    pub(crate) id: ExprId,
    /// Physical quantity, which decides where units are allowed.
    pub(crate) quantity: Quantity,
    /// True if it is known to be an integer.
    pub(crate) is_integer: bool,
}

impl ScalarValue {
    /// Returns a number of a quantity that need not be an integer.
    pub(crate) fn new(id: ExprId, quantity: Quantity) -> Self {
        Self {
            id,
            quantity,
            is_integer: false,
        }
    }
    /// Returns a plain number that need not be an integer.
    pub(crate) fn plain(id: ExprId) -> Self {
        Self::new(id, Quantity::Plain)
    }
    /// Returns a plain number that is an integer.
    pub(crate) fn int(id: ExprId) -> Self {
        Self {
            id,
            quantity: Quantity::Plain,
            is_integer: true,
        }
    }
}

/// A vector of two to four numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vector {
    components: [ScalarValue; 4],
    len: u8,
}

impl Vector {
    /// Creates a vector from two to four numbers.
    pub(crate) fn from_slice(numbers: &[ScalarValue]) -> Option<Self> {
        let len = numbers.len();
        if !(2..=4).contains(&len) {
            return None;
        }
        let numbers = std::array::from_fn(|i| numbers[i.min(len - 1)]);
        Some(Self {
            components: numbers,
            len: len as u8,
        })
    }
    /// Creates a vector from three numbers.
    pub(crate) fn from_array(numbers: [ScalarValue; 3]) -> Self {
        let [x, y, z] = numbers;
        Self {
            components: [x, y, z, z],
            len: 3,
        }
    }
    /// Returns the components, from two to four.
    pub(crate) fn components(&self) -> &[ScalarValue] {
        &self.components[..usize::from(self.len)]
    }
    /// Returns the number of components, at most 4.
    pub(crate) fn len(&self) -> usize {
        usize::from(self.len)
    }
}

/// `start..end`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Range {
    /// First value of the range.
    pub(crate) start: ScalarValue,
    /// Last value, or the one after it.
    pub(crate) end: ScalarValue,
    /// True if the end belongs to the range.
    pub(crate) inclusive: bool,
}

/// Environment of an expression: the names in scope, and the blend of plain operators.
#[derive(Clone, Debug)]
pub(crate) struct Env<'a> {
    /// Parameters and local definitions, which hide those of the module.
    pub(crate) scope: Scope<'a, Value<'a>>,
    /// Index of the module.
    pub(crate) module: usize,
    /// Number of definitions of the module that precede the expression.
    pub(crate) visible_items: u32,
    /// Blend of operators without one of their own.
    pub(crate) blend: Option<Rc<BlendSpec>>,
}

impl<'a> Env<'a> {
    /// Returns this environment with one more name.
    pub(crate) fn with(&self, name: &'a str, value: Value<'a>) -> Self {
        let depth = value.depth();
        Self {
            scope: self.scope.with(name, value, depth),
            ..self.clone()
        }
    }
}

/// A function or lambda of a scene, with its captured environment.
#[derive(Debug)]
pub(crate) struct Closure<'a> {
    /// Name; empty for a lambda.
    pub(crate) name: &'a str,
    /// Parameters, in the order of positional arguments.
    pub(crate) params: &'a [ast::FnParam],
    /// Result type, if it is annotated.
    pub(crate) result: Option<&'a ast::TypeName>,
    /// Body, evaluated at each call.
    pub(crate) body: &'a ast::Body,
    /// Environment of the definition, in which the body is evaluated.
    pub(crate) env: Env<'a>,
    /// Span of the name, or of the lambda.
    pub(crate) span: Span,
}

/// Shared list of values.
#[derive(Clone, Debug)]
pub(crate) struct List<'a>(Rc<(Vec<Value<'a>>, u32)>);

impl<'a> From<Vec<Value<'a>>> for List<'a> {
    fn from(values: Vec<Value<'a>>) -> Self {
        let inner = values.iter().map(Value::depth).max().unwrap_or(0);
        Self(Rc::new((values, inner + 1)))
    }
}

impl<'a> FromIterator<Value<'a>> for List<'a> {
    fn from_iter<T: IntoIterator<Item = Value<'a>>>(values: T) -> Self {
        values.into_iter().collect::<Vec<_>>().into()
    }
}

impl<'a> Deref for List<'a> {
    type Target = [Value<'a>];
    fn deref(&self) -> &[Value<'a>] {
        &self.0.0
    }
}

/// Named values, `record M4 { clearance: 4.5mm }`.
#[derive(Debug)]
pub(crate) struct Record<'a> {
    /// Name after the word `record`.
    pub(crate) name: &'a str,
    /// Values, in order.
    pub(crate) fields: Vec<(&'a str, Value<'a>)>,
}

/// Value of an expression.
#[derive(Clone, Debug)]
pub(crate) enum Value<'a> {
    /// Result of a mistake that has been reported; operations on it are silent.
    Poison,
    /// Result of `print` and `assert`.
    Nothing,
    /// A number.
    Number(ScalarValue),
    /// A condition: a number that is 1 or 0.
    Bool(ExprId),
    /// A text.
    Text(Rc<str>),
    /// Two to four numbers.
    Vector(Vector),
    /// A colour: linear red, green, blue.
    Color([ExprId; 3]),
    /// Values in order.
    List(List<'a>),
    /// A range of numbers.
    Range(Range),
    /// A 2-D or 3-D shape.
    Shape(ShapeId),
    /// A material.
    Material(MaterialId),
    /// Named values.
    Record(Rc<Record<'a>>),
    /// A function of the scene.
    Function(Rc<Closure<'a>>),
    /// A built-in function, by its name.
    Builtin(&'static str),
    /// A word that only its argument interprets, such as the name of a kernel.
    Word(&'a str),
}

impl Value<'_> {
    /// Returns the nesting depth of a value: lists in lists, and functions that capture functions.
    pub(crate) fn depth(&self) -> u32 {
        match self {
            Value::List(list) => list.0.1,
            Value::Function(closure) => closure.env.scope.depth() + 1,
            Value::Record(record) => {
                let fields = record.fields.iter().map(|(_, value)| value.depth());
                fields.max().unwrap_or(0) + 1
            }
            Value::Poison
            | Value::Nothing
            | Value::Number(_)
            | Value::Bool(_)
            | Value::Text(_)
            | Value::Vector(_)
            | Value::Color(_)
            | Value::Range(_)
            | Value::Shape(_)
            | Value::Material(_)
            | Value::Builtin(_)
            | Value::Word(_) => 0,
        }
    }
    /// Reports whether the value results from a mistake.
    pub(crate) fn is_poison(&self) -> bool {
        matches!(self, Value::Poison)
    }
    /// Reports whether the value is a shape, or a list of shapes.
    pub(crate) fn is_shape(&self) -> bool {
        match self {
            Value::Shape(_) => true,
            Value::List(list) => list.first().is_none_or(Value::is_shape),
            _ => false,
        }
    }
    /// Reports whether the value is a function that is annotated to take a point of the plane.
    pub(crate) fn takes_vec2(&self) -> bool {
        let Value::Function(closure) = self else {
            return false;
        };
        let first = closure.params.first();
        let annotation = first.and_then(|param| param.annotation.as_ref());
        annotation.is_some_and(|annotation| annotation.name == "vec2")
    }
    /// Returns the number, if the value is one.
    pub(crate) fn as_number(&self) -> Option<ScalarValue> {
        match self {
            Value::Number(number) => Some(*number),
            _ => None,
        }
    }
}

/// The run cannot continue; the reason has been reported.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Abort;

/// Result of an evaluation.
pub(crate) type EvalResult<'a> = Result<Value<'a>, Abort>;
