//! Values as text: for `print`, `str`, messages, and sums of texts.

use super::Elaborator;
use super::bound::short;
use super::value::{Number, Quantity, Value};

/// The most bytes of a text that a scene makes; what is longer is cut.
const MAX_TEXT: usize = 10_000;

impl<'a> Elaborator<'a> {
    /// The text of values, with something between them.
    pub(crate) fn display<'v>(
        &mut self,
        values: impl IntoIterator<Item = &'v Value<'a>>,
        between: &str,
    ) -> String
    where
        'a: 'v,
    {
        let mut text = String::new();
        for (at, value) in values.into_iter().enumerate() {
            if at > 0 {
                text.push_str(between);
            }
            self.write(&mut text, value);
        }
        if text.len() > MAX_TEXT {
            text.truncate(text.floor_char_boundary(MAX_TEXT));
            text.push('…');
        }
        text
    }

    /// Recursion over lists in lists, whose depth is bounded; it stops where the text is long enough.
    fn write(&mut self, text: &mut String, value: &Value<'a>) {
        if text.len() > MAX_TEXT {
            return;
        }
        match value {
            Value::Number(number) => text.push_str(&self.number_text(*number)),
            Value::Bool(id) => {
                let truth = self.present(*id) != 0.0;
                text.push_str(if truth { "true" } else { "false" });
            }
            Value::Text(inner) => text.push_str(inner),
            Value::Vector(vector) => {
                let parts = vector.parts().iter().map(|n| self.number_text(*n));
                let parts: Vec<String> = parts.collect();
                text.push_str(&format!("[{}]", parts.join(", ")));
            }
            Value::Color(parts) => {
                let parts = parts.map(|id| self.number_text(Number::plain(id)));
                text.push_str(&format!("rgb({})", parts.join(", ")));
            }
            Value::List(list) => {
                text.push('[');
                for (at, element) in list.iter().enumerate() {
                    if at > 0 {
                        text.push_str(", ");
                    }
                    self.write(text, element);
                    if text.len() > MAX_TEXT {
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

    fn number_text(&mut self, number: Number) -> String {
        let value = self.present(number.id);
        match number.quantity {
            _ if value.is_nan() => "(depends on the point)".to_owned(),
            Quantity::Angle => format!("{}deg", short(value.to_degrees())),
            Quantity::Time => format!("{}s", short(value)),
            Quantity::Plain | Quantity::Length(_) => short(value),
        }
    }
}
