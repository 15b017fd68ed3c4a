//! Built-in functions that are an operation of the table: shapes, and modifications of a shape.

use crate::elaborate::Elaborator;
use crate::elaborate::argument_conversion::BoundArgs;
use crate::elaborate::value::Value;
use crate::expression::ExprId;
use crate::scene::ShapeKind;
use sdfc_lang::{Diagnostic, codes};
use sdfc_vm::row::{ArgumentKind, Category};
use sdfc_vm::table::Op;

impl<'a> Elaborator<'a> {
    /// Evaluates a call of an operation of the table: a shape, or a modification of one.
    pub(crate) fn row(&mut self, op: Op, bound: &BoundArgs<'a>) -> Value<'a> {
        let row = op.row();
        let is_shape = matches!(row.facts.category, Category::Shape3 | Category::Shape2);
        let first = usize::from(!is_shape);
        let arguments = &bound.arguments[first..];
        if self.has_equal_ends(op, arguments.iter().map(|a| a.numbers.as_slice())) {
            let message = format!("`from` and `to` of `{}` are the same point", bound.name);
            let help = "a cylinder without a length is empty; `capsule` gives a sphere here, and `cylinder(r, h)` takes a length";
            self.report(Diagnostic::error(codes::E0405, bound.span, message).help(help));
            return Value::Poison;
        }
        let numbers: Vec<ExprId> = arguments
            .iter()
            .flat_map(|a| a.numbers.iter().copied())
            .collect();
        let parameters = self.prepare_parameters(op, &numbers);
        let id = match row.facts.category {
            Category::Shape3 => {
                let id = self.add(ShapeKind::Primitive { op, parameters }, false, bound.span);
                if has_axis(op) {
                    self.rotated_to_scene_up(id, bound.span)
                } else {
                    id
                }
            }
            Category::Shape2 => self.add(ShapeKind::Primitive { op, parameters }, true, bound.span),
            Category::Domain => {
                let child = bound.shape(0);
                let is_2d = self.shapes[child.0 as usize].is_2d;
                self.add(
                    ShapeKind::Domain {
                        op,
                        child,
                        parameters,
                    },
                    is_2d,
                    bound.span,
                )
            }
            Category::Dimension | Category::Distance => {
                let child = bound.shape(0);
                let is_2d =
                    self.shapes[child.0 as usize].is_2d && row.facts.category == Category::Distance;
                self.add(
                    ShapeKind::Distance {
                        op,
                        child,
                        parameters,
                    },
                    is_2d,
                    bound.span,
                )
            }
            Category::Combine | Category::Math | Category::Internal => {
                unreachable!("`{}` is not a word of the language", row.name)
            }
        };
        Value::Shape(id)
    }

    /// Reports whether the end points `from` and `to` of a shape are equal, and nothing is left of it. Around equal ends, a
    /// capsule is a sphere, and a segment a disc.
    fn has_equal_ends<'n>(&self, op: Op, arguments: impl Iterator<Item = &'n [ExprId]>) -> bool {
        if matches!(op, Op::CapsuleBetween | Op::Segment) {
            return false;
        }
        let Some(language) = &op.row().facts.language else {
            return false;
        };
        let mut ends = language
            .arguments
            .iter()
            .zip(arguments)
            .filter(|(argument, _)| matches!(argument.name, "from" | "to"))
            .map(|(_, numbers)| numbers);
        match (ends.next(), ends.next()) {
            (Some(from), Some(to)) => from == to,
            _ => false,
        }
    }
}

/// Reports whether a solid of the table has an axis of its own, which is aligned with the up axis.
/// Solids with vector arguments take their directions from these.
fn has_axis(op: Op) -> bool {
    let facts = &op.row().facts;
    let is_vector = |kind: ArgumentKind| kind.width() == 3;
    let has_direction_arguments = facts
        .language
        .is_some_and(|language| language.arguments.iter().any(|a| is_vector(a.kind)));
    !facts.has_equal_axes && !has_direction_arguments
}
