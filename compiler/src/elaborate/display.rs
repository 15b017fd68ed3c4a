//! Values as text: for `print`, `str`, messages, and sums of texts. Values of the wrong type are
//! reported here.

use super::Elaborator;
use super::value::{Quantity, ScalarValue, Value};
use sdfc_lang::{Diagnostic, Span, codes};

/// Maximum size of a text in bytes; longer texts are cut.
const MAX_TEXT_BYTES: usize = 10_000;

impl<'a> Elaborator<'a> {
    /// Formats values, with a separator between them.
    pub(crate) fn display<'v>(
        &mut self,
        values: impl IntoIterator<Item = &'v Value<'a>>,
        separator: &str,
    ) -> String
    where
        'a: 'v,
    {
        let mut text = String::new();
        for (index, value) in values.into_iter().enumerate() {
            if index > 0 {
                text.push_str(separator);
            }
            self.write(&mut text, value);
        }
        if text.len() > MAX_TEXT_BYTES {
            text.truncate(text.floor_char_boundary(MAX_TEXT_BYTES));
            text.push('…');
        }
        text
    }

    /// Appends a value to a text. It recurses over nested lists, whose depth is bounded, and stops once the text
    /// is too long.
    fn write(&mut self, text: &mut String, value: &Value<'a>) {
        if text.len() > MAX_TEXT_BYTES {
            return;
        }
        match value {
            Value::Number(number) => text.push_str(&self.number_text(*number)),
            Value::Bool(id) => {
                let is_true = self.current_value(*id) != 0.0;
                text.push_str(if is_true { "true" } else { "false" });
            }
            Value::Text(inner) => text.push_str(inner),
            Value::Vector(vector) => {
                let components = vector.components().iter().map(|n| self.number_text(*n));
                let components: Vec<String> = components.collect();
                text.push_str(&format!("[{}]", components.join(", ")));
            }
            Value::Color(components) => {
                let components = components.map(|id| self.number_text(ScalarValue::plain(id)));
                text.push_str(&format!("rgb({})", components.join(", ")));
            }
            Value::List(list) => {
                text.push('[');
                for (index, element) in list.iter().enumerate() {
                    if index > 0 {
                        text.push_str(", ");
                    }
                    self.write(text, element);
                    if text.len() > MAX_TEXT_BYTES {
                        return;
                    }
                }
                text.push(']');
            }
            Value::Range(range) => {
                let dots = if range.inclusive { "..=" } else { ".." };
                let (start, end) = (self.number_text(range.start), self.number_text(range.end));
                text.push_str(&format!("{start}{dots}{end}"));
            }
            Value::Poison
            | Value::Nothing
            | Value::Shape(_)
            | Value::Material(_)
            | Value::Record(_)
            | Value::Function(_)
            | Value::Builtin(_)
            | Value::Word(_) => text.push_str(&self.describe(value)),
        }
    }

    fn number_text(&mut self, number: ScalarValue) -> String {
        let value = self.current_value(number.id);
        match number.quantity {
            _ if value.is_nan() => "(depends on the point)".to_owned(),
            Quantity::Angle => format!("{}deg", format_short(value.to_degrees())),
            Quantity::Time => format!("{}s", format_short(value)),
            Quantity::Plain | Quantity::Length(_) => format_short(value),
        }
    }

    /// Describes a value for messages.
    pub(crate) fn describe(&self, value: &Value<'_>) -> String {
        match value {
            Value::Poison | Value::Nothing => "nothing".to_owned(),
            Value::Number(number) => number.quantity.noun().to_owned(),
            Value::Bool(_) => "a bool".to_owned(),
            Value::Text(_) => "a text".to_owned(),
            Value::Vector(vector) => format!("a vec{}", vector.len()),
            Value::Color(_) => "a color".to_owned(),
            Value::List(list) if !list.is_empty() && self.is_shape_list(list) => {
                "a list of shapes".to_owned()
            }
            Value::List(list) => format!("a list of {}", list.len()),
            Value::Range(_) => "a range".to_owned(),
            Value::Shape(id) if self.shapes[id.0 as usize].is_2d => "a 2D shape".to_owned(),
            Value::Shape(_) => "a 3D shape".to_owned(),
            Value::Material(_) => "a material".to_owned(),
            Value::Record(record) => format!("the record `{}`", record.name),
            Value::Function(_) | Value::Builtin(_) => "a function".to_owned(),
            Value::Word(word) => format!("the word `{word}`"),
        }
    }

    fn is_shape_list(&self, list: &[Value<'_>]) -> bool {
        match list.first() {
            Some(Value::Shape(_)) => true,
            Some(Value::List(list)) => self.is_shape_list(list),
            _ => false,
        }
    }

    /// Reports a value of the wrong type.
    pub(crate) fn report_wrong(
        &mut self,
        value: &Value<'a>,
        requirement: &str,
        span: Span,
    ) -> Value<'a> {
        if !value.is_poison() {
            let message = format!("{requirement}, and this is {}", self.describe(value));
            self.report(Diagnostic::error(codes::E0301, span, message));
        }
        Value::Poison
    }
}

/// Formats a number with at most six decimals.
pub(crate) fn format_short(value: f64) -> String {
    let rounded = (value * 1e6).round() / 1e6;
    if value.abs() < 1e9 && rounded != 0.0 {
        format!("{rounded}")
    } else {
        format!("{value}")
    }
}
