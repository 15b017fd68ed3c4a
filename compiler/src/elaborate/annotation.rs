//! Type annotations, such as `length` or `vec3`, and conversion of values to them.

use super::Elaborator;
use super::angles;
use super::constness::Demand;
use super::diagnose::unknown_name;
use super::display::format_short;
use super::numbers::{Form, components};
use super::value::{Quantity, ScalarValue, Value, Vector};
use sdfc_lang::ast::TypeName;
use sdfc_lang::{Diagnostic, Span, codes};

/// A type that an annotation may name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AnnotatedType {
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

const TYPES: [(&str, AnnotatedType, &str); 17] = [
    ("float", AnnotatedType::Float, "a number"),
    ("int", AnnotatedType::Int, "a whole number"),
    ("bool", AnnotatedType::Bool, "a bool"),
    ("string", AnnotatedType::Text, "a text"),
    ("vec2", AnnotatedType::Vec2, "a vec2"),
    ("vec3", AnnotatedType::Vec3, "a vec3"),
    ("vec4", AnnotatedType::Vec4, "a vec4"),
    ("color", AnnotatedType::Color, "a color"),
    ("angle", AnnotatedType::Angle, "an angle"),
    ("length", AnnotatedType::Length, "a length"),
    ("time", AnnotatedType::Time, "a time"),
    ("shape2", AnnotatedType::Shape2, "a 2D shape"),
    ("shape3", AnnotatedType::Shape3, "a 3D shape"),
    ("shape", AnnotatedType::Shape, "a shape"),
    ("material", AnnotatedType::Material, "a material"),
    ("list", AnnotatedType::List, "a list"),
    ("function", AnnotatedType::Function, "a function"),
];

impl<'a> Elaborator<'a> {
    /// Returns the type of this name; reports an unknown one.
    pub(crate) fn resolve_type(&mut self, name: &TypeName) -> Option<AnnotatedType> {
        let entry = TYPES.iter().find(|(word, ..)| *word == name.name);
        if entry.is_none() {
            let names = TYPES.iter().map(|(word, ..)| *word);
            let mut diagnostic =
                unknown_name(codes::E0216, "type", &name.name, name.span, names.clone());
            if diagnostic.fixes.is_empty() {
                let list = names.collect::<Vec<_>>().join(", ");
                diagnostic = diagnostic.help(format!("the types are {list}"));
            }
            self.report(diagnostic);
        }
        entry.map(|(_, ty, _)| *ty)
    }

    /// Converts a value to its annotated type.
    pub(crate) fn convert_annotated(
        &mut self,
        value: Value<'a>,
        annotation: &TypeName,
        span: Span,
    ) -> Value<'a> {
        let Some(ty) = self.resolve_type(annotation) else {
            return Value::Poison;
        };
        if value.is_poison() {
            return value;
        }
        if let Some(converted) = self.convert_to(&value, ty, span) {
            return converted;
        }
        if ty == AnnotatedType::Angle && matches!(value, Value::Number(_)) {
            let diagnostic = self.missing_unit(&annotation.name, span);
            let label = "this needs an angle".to_owned();
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
        let message = format!("{noun} is required, and this is {got}");
        let mut diagnostic = Diagnostic::error(codes::E0301, span, message);
        if annotation.span.file == span.file {
            diagnostic = diagnostic.label(annotation.span, "required here");
        }
        if let (AnnotatedType::Float, Value::Number(number)) = (ty, &value) {
            let text = self.sources.slice(span);
            diagnostic = angles::advise(diagnostic, number.quantity, text, span);
        }
        self.report(diagnostic);
        Value::Poison
    }

    /// Converts the value to the type, if it has that type or converts without loss.
    fn convert_to(
        &mut self,
        value: &Value<'a>,
        ty: AnnotatedType,
        span: Span,
    ) -> Option<Value<'a>> {
        match (ty, value) {
            (AnnotatedType::Float, Value::Number(number)) if number.quantity != Quantity::Angle => {
                Some(Value::Number(ScalarValue {
                    is_integer: false,
                    ..*number
                }))
            }
            (AnnotatedType::Int, Value::Number(number)) => {
                if number.is_integer {
                    return Some(value.clone());
                }
                // A number that is not an integer by type requires its value.
                let names = self.demand(number.id, &Demand::new("a whole number", span))?;
                (names.fract() == 0.0)
                    .then(|| Value::Number(ScalarValue::int(self.expressions.constant(names))))
            }
            (AnnotatedType::Length, Value::Number(number)) => match number.quantity {
                Quantity::Plain | Quantity::Length(1) => Some(Value::Number(ScalarValue {
                    quantity: Quantity::Length(1),
                    ..*number
                })),
                Quantity::Length(_) | Quantity::Angle | Quantity::Time => None,
            },
            (AnnotatedType::Angle, Value::Number(number)) => {
                (number.quantity == Quantity::Angle).then(|| value.clone())
            }
            (AnnotatedType::Time, Value::Number(number)) => match number.quantity {
                Quantity::Plain | Quantity::Time => Some(Value::Number(ScalarValue {
                    quantity: Quantity::Time,
                    ..*number
                })),
                Quantity::Length(_) | Quantity::Angle => None,
            },
            (AnnotatedType::Bool, Value::Bool(_))
            | (AnnotatedType::Text, Value::Text(_))
            | (AnnotatedType::Material, Value::Material(_))
            | (AnnotatedType::Function, Value::Function(_) | Value::Builtin(_)) => {
                Some(value.clone())
            }
            (AnnotatedType::Vec2 | AnnotatedType::Vec3 | AnnotatedType::Vec4, _) => {
                let width = match ty {
                    AnnotatedType::Vec2 => 2,
                    AnnotatedType::Vec3 => 3,
                    _ => 4,
                };
                match components(value)? {
                    (Form::Vector(len), numbers) if len == width => {
                        Vector::from_slice(&numbers[..len]).map(Value::Vector)
                    }
                    (Form::Color, numbers) if width == 3 => {
                        Vector::from_slice(&numbers[..3]).map(Value::Vector)
                    }
                    _ => None,
                }
            }
            (AnnotatedType::Color, _) => self.as_color(value).map(Value::Color),
            (AnnotatedType::Shape | AnnotatedType::Shape2 | AnnotatedType::Shape3, _)
                if value.is_shape() =>
            {
                let Some(id) = self.shape(value, span) else {
                    return Some(Value::Poison);
                };
                let is_2d = self.shapes[id.0 as usize].is_2d;
                let fits = match ty {
                    AnnotatedType::Shape2 => is_2d || self.is_nothing(id),
                    AnnotatedType::Shape3 => !is_2d,
                    _ => true,
                };
                fits.then_some(Value::Shape(id))
            }
            (AnnotatedType::List, Value::List(_) | Value::Vector(_) | Value::Range(_)) => {
                self.elements(value.clone(), span).map(Value::List)
            }
            _ => None,
        }
    }

    /// Reports a fractional number where an integer is required.
    pub(crate) fn report_not_integer(&mut self, what: &str, value: f64, span: Span) {
        let message = format!(
            "{what} is a whole number, and this is {}",
            format_short(value)
        );
        self.report(Diagnostic::error(codes::E0401, span, message));
    }
}
