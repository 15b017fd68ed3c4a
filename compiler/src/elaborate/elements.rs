//! Elements of lists, vectors and ranges, which loops and functions of lists run over.

use super::Elaborator;
use super::constness::Demand;
use super::value::{List, Range, ScalarValue, Value};
use sdfc_lang::{Diagnostic, Span, codes};

/// Maximum number of elements of a loop.
pub(crate) const MAX_LOOP: f64 = 100_000.0;

impl<'a> Elaborator<'a> {
    /// Returns the elements that a loop runs over, each of which costs a step; reports a value without elements.
    pub(crate) fn elements(&mut self, value: Value<'a>, span: Span) -> Option<List<'a>> {
        let list = self.elements_without_cost(value, span)?;
        // Each element costs a step, whatever the loop does with it.
        self.steps += list.len() as u64;
        Some(list)
    }

    fn elements_without_cost(&mut self, value: Value<'a>, span: Span) -> Option<List<'a>> {
        match value {
            Value::Poison => None,
            Value::List(list) => Some(list),
            Value::Vector(vector) => Some(
                vector
                    .components()
                    .iter()
                    .map(|n| Value::Number(*n))
                    .collect(),
            ),
            Value::Range(range) => self.range_elements(range, span),
            other => {
                self.report_wrong(&other, "a loop goes through a range or a list", span);
                None
            }
        }
    }

    fn range_elements(&mut self, range: Range, span: Span) -> Option<List<'a>> {
        let demand = Demand::new("a loop count", span);
        let start = self.demand(range.start.id, &demand);
        let end = self.demand(range.end.id, &demand);
        let (start, end) = (start?, end?);
        let last = if range.inclusive {
            end.floor()
        } else {
            end.ceil() - 1.0
        };
        if start.fract() != 0.0 {
            let message = format!("a loop counts from a whole number, and this is {start}");
            self.report(Diagnostic::error(codes::E0401, span, message));
            return None;
        }
        let count = (last - start + 1.0).max(0.0);
        if count.is_nan() || count > MAX_LOOP {
            let message =
                format!("this loop has {count} rounds, and at most {MAX_LOOP} are allowed");
            let help = "use `repeat` or `polar` for many copies: they cost nothing";
            self.report(Diagnostic::error(codes::E0412, span, message).help(help));
            return None;
        }
        let element = |i: u32| {
            let id = self.expressions.constant(start + f64::from(i));
            Value::Number(ScalarValue {
                id,
                quantity: range.start.quantity,
                is_integer: true,
            })
        };
        Some((0..count as u32).map(element).collect())
    }
}
