//! What an expression of the language can mean, and how such a thing is called in a message.

use super::evaluate::Here;
use crate::expression::ExprId;
use crate::scene::{MaterialId, ShapeId};
use sdfc_lang::Span;
use sdfc_lang::ast;
use std::ops::Deref;
use std::rc::Rc;

/// Of what a number is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Quantity {
    /// A bare number.
    Plain,
    /// A length to this power, never 0, in scene units.
    Length(i8),
    /// An angle in radians.
    Angle,
    /// A time in seconds; it calculates like a bare number.
    Time,
}

impl Quantity {
    /// A length to a power, a bare number if that is 0.
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
    /// Of what a product is: lengths add up, an angle stays one unless a length measures its arc.
    pub(crate) fn product(self, other: Self) -> Self {
        match (self, other) {
            (Self::Angle, Self::Plain | Self::Time) | (Self::Plain | Self::Time, Self::Angle) => {
                Self::Angle
            }
            (Self::Time, Self::Plain) | (Self::Plain, Self::Time) => Self::Time,
            _ => Self::length(self.power().saturating_add(other.power())),
        }
    }
    /// Of what a quotient is; an angle per length is an angle per scene unit.
    pub(crate) fn quotient(self, other: Self) -> Self {
        match (self, other) {
            (Self::Angle, Self::Plain | Self::Time | Self::Length(_)) => Self::Angle,
            (Self::Time, Self::Plain) => Self::Time,
            _ => Self::length(self.power().saturating_sub(other.power())),
        }
    }
    /// Of what a sum is, if the two can be added: a bare number is of whatever it meets.
    pub(crate) fn sum(self, other: Self) -> Option<Self> {
        match (self, other) {
            (a, b) if a == b => Some(a),
            (Self::Plain | Self::Time, other) | (other, Self::Plain | Self::Time) => Some(other),
            _ => None,
        }
    }
    /// Of what the square root is.
    pub(crate) fn root(self) -> Self {
        match self {
            Self::Length(power) => Self::length(power / 2),
            other => other,
        }
    }
    /// What such a number is called.
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

/// A number with what it is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Number {
    /// Its definition.
    pub(crate) id: ExprId,
    /// Of what.
    pub(crate) quantity: Quantity,
    /// Whether it is known to be whole, as integers are.
    pub(crate) whole: bool,
}

impl Number {
    /// A number of something.
    pub(crate) fn of(id: ExprId, quantity: Quantity) -> Self {
        Self {
            id,
            quantity,
            whole: false,
        }
    }
    /// A bare number.
    pub(crate) fn plain(id: ExprId) -> Self {
        Self::of(id, Quantity::Plain)
    }
    /// A bare whole number.
    pub(crate) fn int(id: ExprId) -> Self {
        Self {
            id,
            quantity: Quantity::Plain,
            whole: true,
        }
    }
}

/// Two to four numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vector {
    parts: [Number; 4],
    len: u8,
}

impl Vector {
    /// From two to four numbers.
    pub(crate) fn from_slice(parts: &[Number]) -> Option<Self> {
        let len = parts.len();
        if !(2..=4).contains(&len) {
            return None;
        }
        let parts = std::array::from_fn(|i| parts[i.min(len - 1)]);
        Some(Self {
            parts,
            len: len as u8,
        })
    }
    /// From three numbers.
    pub(crate) fn three(parts: [Number; 3]) -> Self {
        let [x, y, z] = parts;
        Self {
            parts: [x, y, z, z],
            len: 3,
        }
    }
    /// Its numbers.
    pub(crate) fn parts(&self) -> &[Number] {
        &self.parts[..usize::from(self.len)]
    }
    /// How many it has.
    pub(crate) fn len(&self) -> usize {
        usize::from(self.len)
    }
}

/// `start..end`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Range {
    /// The first value.
    pub(crate) start: Number,
    /// The last value, or the one after it.
    pub(crate) end: Number,
    /// Whether the end belongs to it.
    pub(crate) inclusive: bool,
}

/// A function or lambda of a scene, with the names that it can see.
#[derive(Debug)]
pub(crate) struct Closure<'a> {
    /// What it is called; empty for a lambda.
    pub(crate) name: &'a str,
    /// What it takes.
    pub(crate) params: &'a [ast::FnParam],
    /// What it gives, if that is written.
    pub(crate) result: Option<&'a ast::TypeName>,
    /// What it does.
    pub(crate) body: &'a ast::Body,
    /// Where it stands: the names that it sees.
    pub(crate) here: Here<'a>,
    /// Where its name, or the lambda, stands.
    pub(crate) span: Span,
}

/// Values in order, shared.
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
    /// What it is called.
    pub(crate) name: &'a str,
    /// Its values, in order.
    pub(crate) fields: Vec<(&'a str, Value<'a>)>,
}

/// What an expression means.
#[derive(Clone, Debug)]
pub(crate) enum Value<'a> {
    /// Nothing is known because of a mistake that has been reported; whatever it meets is silent.
    Poison,
    /// What `print` and `assert` give.
    Nothing,
    /// A number.
    Number(Number),
    /// A condition: a number that is 1 or 0.
    Bool(ExprId),
    /// Text.
    Text(Rc<str>),
    /// Two to four numbers.
    Vector(Vector),
    /// A colour: linear red, green, blue.
    Color([ExprId; 3]),
    /// Values in order.
    List(List<'a>),
    /// The numbers between two.
    Range(Range),
    /// A solid or a figure.
    Shape(ShapeId),
    /// A material.
    Material(MaterialId),
    /// Named values.
    Record(Rc<Record<'a>>),
    /// A function of a scene.
    Function(Rc<Closure<'a>>),
    /// A function of the language, by its name.
    Builtin(&'static str),
    /// A word that means something only to the argument in which it stands, such as a kernel's name.
    Word(&'a str),
}

impl Value<'_> {
    /// How deep values are within each other: lists in lists, functions that remember functions.
    pub(crate) fn depth(&self) -> u32 {
        match self {
            Value::List(list) => list.0.1,
            Value::Function(closure) => closure.here.scope.depth() + 1,
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
    /// Whether a mistake made it.
    pub(crate) fn is_poison(&self) -> bool {
        matches!(self, Value::Poison)
    }
}
