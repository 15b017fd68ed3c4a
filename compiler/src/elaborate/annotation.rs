//! Types that are written down, `length` or `vec3`, and values that take them.

use super::Elaborator;
use super::bound::short;
use super::diagnose::unknown_name;
use super::numbers::{Form, parts};
use super::stage::Demand;
use super::value::{Number, Quantity, Value, Vector};
use sdfc_lang::ast::TypeName;
use sdfc_lang::{Diagnostic, Span, codes};

/// A type that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Type {
    Float,
    Int,
    Bool,
    Text,
    Vec2,
    Vec3,
    Vec4,
    Color,
    Angle,
    Length,
    Time,
    Shape2,
    Shape3,
    Shape,
    Material,
    List,
    Function,
}

const TYPES: [(&str, Type, &str); 17] = [
    ("float", Type::Float, "a number"),
    ("int", Type::Int, "a whole number"),
    ("bool", Type::Bool, "a bool"),
    ("string", Type::Text, "a text"),
    ("vec2", Type::Vec2, "a vec2"),
    ("vec3", Type::Vec3, "a vec3"),
    ("vec4", Type::Vec4, "a vec4"),
    ("color", Type::Color, "a color"),
    ("angle", Type::Angle, "an angle"),
    ("length", Type::Length, "a length"),
    ("time", Type::Time, "a time"),
    ("shape2", Type::Shape2, "a 2D shape"),
    ("shape3", Type::Shape3, "a 3D shape"),
    ("shape", Type::Shape, "a shape"),
    ("material", Type::Material, "a material"),
    ("list", Type::List, "a list"),
    ("function", Type::Function, "a function"),
];

impl<'a> Elaborator<'a> {
    /// The type of this name; reports one that does not exist.
    pub(crate) fn type_of(&mut self, name: &TypeName) -> Option<Type> {
        let found = TYPES.iter().find(|(word, ..)| *word == name.name);
        if found.is_none() {
            let known = TYPES.iter().map(|(word, ..)| *word);
            let mut diagnostic =
                unknown_name(codes::E0216, "type", &name.name, name.span, known.clone());
            if diagnostic.fixes.is_empty() {
                let all = known.collect::<Vec<_>>().join(", ");
                diagnostic = diagnostic.help(format!("the types are {all}"));
            }
            self.report(diagnostic);
        }
        found.map(|(_, ty, _)| *ty)
    }

    /// A value as the type that is written for it.
    pub(crate) fn annotated(
        &mut self,
        value: Value<'a>,
        wanted: &TypeName,
        span: Span,
    ) -> Value<'a> {
        let Some(ty) = self.type_of(wanted) else {
            return Value::Poison;
        };
        if value.is_poison() {
            return value;
        }
        if let Some(taken) = self.taken(&value, ty, span) {
            return taken;
        }
        if ty == Type::Angle && matches!(value, Value::Number(_)) {
            let diagnostic = self.no_unit(&wanted.name, span);
            let label = "this wants an angle".to_owned();
            self.report(Diagnostic {
                label,
                ..diagnostic
            });
            return Value::Poison;
        }
        let noun = TYPES
            .iter()
            .find(|(_, t, _)| *t == ty)
            .map_or("", |(.., noun)| *noun);
        let got = self.describe(&value);
        let message = format!("{noun} is wanted, and this is {got}");
        let mut diagnostic = Diagnostic::error(codes::E0301, span, message);
        if wanted.span.file == span.file {
            diagnostic = diagnostic.label(wanted.span, "wanted here");
        }
        self.report(diagnostic);
        Value::Poison
    }

    /// The value as the type, if it is of that type or becomes it without a loss.
    fn taken(&mut self, value: &Value<'a>, ty: Type, span: Span) -> Option<Value<'a>> {
        match (ty, value) {
            (Type::Float, Value::Number(number)) if number.quantity != Quantity::Angle => {
                Some(Value::Number(Number {
                    whole: false,
                    ..*number
                }))
            }
            (Type::Int, Value::Number(number)) => {
                if number.whole {
                    return Some(value.clone());
                }
                // A number of another kind has to show that it is whole.
                let known = self.demand(number.id, &Demand::new("a whole number", span))?;
                (known.fract() == 0.0)
                    .then(|| Value::Number(Number::int(self.graph.constant(known))))
            }
            (Type::Length, Value::Number(number)) => match number.quantity {
                Quantity::Plain | Quantity::Length(1) => Some(Value::Number(Number {
                    quantity: Quantity::Length(1),
                    ..*number
                })),
                Quantity::Length(_) | Quantity::Angle | Quantity::Time => None,
            },
            (Type::Angle, Value::Number(number)) => {
                (number.quantity == Quantity::Angle).then(|| value.clone())
            }
            (Type::Time, Value::Number(number)) => match number.quantity {
                Quantity::Plain | Quantity::Time => Some(Value::Number(Number {
                    quantity: Quantity::Time,
                    ..*number
                })),
                Quantity::Length(_) | Quantity::Angle => None,
            },
            (Type::Bool, Value::Bool(_))
            | (Type::Text, Value::Text(_))
            | (Type::Material, Value::Material(_))
            | (Type::Function, Value::Function(_) | Value::Builtin(_)) => Some(value.clone()),
            (Type::Vec2 | Type::Vec3 | Type::Vec4, _) => {
                let wanted = match ty {
                    Type::Vec2 => 2,
                    Type::Vec3 => 3,
                    _ => 4,
                };
                match parts(value)? {
                    (Form::Vector(len), numbers) if len == wanted => {
                        Vector::from_slice(&numbers[..len]).map(Value::Vector)
                    }
                    (Form::Color, numbers) if wanted == 3 => {
                        Vector::from_slice(&numbers[..3]).map(Value::Vector)
                    }
                    _ => None,
                }
            }
            (Type::Color, _) => self.as_color(value).map(Value::Color),
            (Type::Shape | Type::Shape2 | Type::Shape3, _) if self.is_shape(value) => {
                let Some(id) = self.shape(value, span) else {
                    return Some(Value::Poison);
                };
                let plane = self.shapes[id.0 as usize].plane;
                let fits = match ty {
                    Type::Shape2 => plane || self.is_nothing(id),
                    Type::Shape3 => !plane,
                    _ => true,
                };
                fits.then_some(Value::Shape(id))
            }
            (Type::List, Value::List(_) | Value::Vector(_) | Value::Range(_)) => {
                self.elements(value.clone(), span).map(Value::List)
            }
            _ => None,
        }
    }

    /// Reports a number that is not whole where one is wanted.
    pub(crate) fn not_whole(&mut self, what: &str, value: f64, span: Span) {
        let message = format!("{what} is a whole number, and this is {}", short(value));
        self.report(Diagnostic::error(codes::E0401, span, message));
    }
}
