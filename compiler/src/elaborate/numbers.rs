//! Arithmetic, comparisons and selections: on numbers, and component by component on vectors and
//! colours. Quantities are tracked: a length times a length is an area, and an angle cannot be
//! added to a length.

use super::Elaborator;
use super::value::{ScalarValue, Value, Vector};
use crate::expression::{ExprId, Stage};
use crate::symbolic::simplified;
use sdfc_lang::ast::{BinaryOp, Unary};
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::table::Op;

/// Form of a value that consists of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// One number.
    Scalar,
    /// A vector of this length.
    Vector(usize),
    /// A colour.
    Color,
}

impl Form {
    /// Returns the number of components, at least 1.
    pub(crate) fn len(self) -> usize {
        match self {
            Form::Scalar => 1,
            Form::Vector(len) => len,
            Form::Color => 3,
        }
    }
    /// Returns the common form of two operands, if they are compatible.
    pub(crate) fn with(self, other: Self) -> Option<Self> {
        match (self, other) {
            (a, b) if a == b => Some(a),
            (Form::Scalar, form) | (form, Form::Scalar) => Some(form),
            (Form::Color, Form::Vector(3)) | (Form::Vector(3), Form::Color) => Some(Form::Color),
            _ => None,
        }
    }
}

/// Returns the components of a value, if it is numeric; positions past the end repeat the last one.
pub(crate) fn components(value: &Value<'_>) -> Option<(Form, [ScalarValue; 4])> {
    match value {
        Value::Number(number) => Some((Form::Scalar, [*number; 4])),
        Value::Vector(vector) => {
            let components = vector.components();
            let form = Form::Vector(components.len());
            Some((
                form,
                std::array::from_fn(|i| components[i.min(components.len() - 1)]),
            ))
        }
        Value::Color([r, g, b]) => Some((Form::Color, [*r, *g, *b, *b].map(ScalarValue::plain))),
        // A list, such as the result of a loop, is a vector if its length allows.
        Value::List(list) if (2..=4).contains(&list.len()) => {
            let numbers: Option<Vec<ScalarValue>> = list.iter().map(Value::as_number).collect();
            components(&Value::Vector(Vector::from_slice(&numbers?)?))
        }
        Value::Poison
        | Value::Nothing
        | Value::Bool(_)
        | Value::Text(_)
        | Value::List(_)
        | Value::Range(_)
        | Value::Shape(_)
        | Value::Material(_)
        | Value::Record(_)
        | Value::Function(_)
        | Value::Builtin(_)
        | Value::Word(_) => None,
    }
}

/// Builds a value of the form from the first of these numbers.
pub(crate) fn assemble_value<'a>(form: Form, numbers: &[ScalarValue]) -> Value<'a> {
    match (form, numbers) {
        (Form::Color, [r, g, b, ..]) => Value::Color([r.id, g.id, b.id]),
        (Form::Vector(len), numbers) => match Vector::from_slice(&numbers[..len]) {
            Some(vector) => Value::Vector(vector),
            None => Value::Poison,
        },
        (_, [number, ..]) => Value::Number(*number),
        (_, []) => Value::Poison,
    }
}

/// Spans of the left operand, the operator and the right operand.
pub(crate) type OperatorSpans = (Span, Span, Span);

impl<'a> Elaborator<'a> {
    /// Returns a truth value as the constant 1 or 0.
    pub(crate) fn truth(&mut self, truth: bool) -> ExprId {
        self.expressions.constant(if truth { 1.0 } else { 0.0 })
    }

    /// Applies an operation to numbers; neutral operands are left out.
    pub(crate) fn op(&mut self, op: Op, values: &[ExprId]) -> ExprId {
        simplified(&mut self.expressions, op, values)
    }

    /// Evaluates a binary operator other than those of shapes.
    pub(crate) fn binary(
        &mut self,
        op: BinaryOp,
        left: Value<'a>,
        right: Value<'a>,
        spans: OperatorSpans,
    ) -> Value<'a> {
        if left.is_poison() || right.is_poison() {
            return Value::Poison;
        }
        match op {
            BinaryOp::Mul | BinaryOp::Div | BinaryOp::Rem | BinaryOp::Add | BinaryOp::Sub => {
                self.arithmetic(op, &left, &right, spans)
            }
            BinaryOp::Equal
            | BinaryOp::NotEqual
            | BinaryOp::Less
            | BinaryOp::LessEqual
            | BinaryOp::Greater
            | BinaryOp::GreaterEqual => self.comparison(op, &left, &right, spans),
            BinaryOp::Intersection
            | BinaryOp::Union
            | BinaryOp::LogicalAnd
            | BinaryOp::LogicalOr => self.mismatch(op, &left, &right, spans),
        }
    }

    fn arithmetic(
        &mut self,
        op: BinaryOp,
        left: &Value<'a>,
        right: &Value<'a>,
        spans: OperatorSpans,
    ) -> Value<'a> {
        if let (BinaryOp::Add, Value::Text(_), _) | (BinaryOp::Add, _, Value::Text(_)) =
            (op, left, right)
        {
            let text = self.display([left, right], "");
            return Value::Text(text.as_str().into());
        }
        let (Some((left_form, a)), Some((right_form, b))) = (components(left), components(right))
        else {
            return self.mismatch(op, left, right, spans);
        };
        let Some(form) = left_form.with(right_form) else {
            return self.mismatch(op, left, right, spans);
        };
        let mut results = a;
        for i in 0..form.len() {
            match self.scalar_arithmetic(op, a[i], b[i], spans) {
                Some(number) => results[i] = number,
                None => return Value::Poison,
            }
        }
        assemble_value(form, &results)
    }

    fn scalar_arithmetic(
        &mut self,
        op: BinaryOp,
        a: ScalarValue,
        b: ScalarValue,
        spans: OperatorSpans,
    ) -> Option<ScalarValue> {
        let (left, sign, right) = spans;
        if matches!(op, BinaryOp::Div | BinaryOp::Rem)
            && self.expressions.as_constant(b.id) == Some(0.0)
        {
            let diagnostic = Diagnostic::error(codes::E0402, right, "this divides by zero")
                .primary("it is zero");
            self.report(diagnostic);
            return None;
        }
        let (row, quantity) = match op {
            BinaryOp::Mul => (Op::Mul, Some(a.quantity.product(b.quantity))),
            BinaryOp::Div => (Op::Div, Some(a.quantity.quotient(b.quantity))),
            BinaryOp::Rem => (Op::Modulo, a.quantity.sum(b.quantity)),
            BinaryOp::Add => (Op::Add, a.quantity.sum(b.quantity)),
            _ => (Op::Sub, a.quantity.sum(b.quantity)),
        };
        let Some(quantity) = quantity else {
            let (a, b) = (a.quantity.noun(), b.quantity.noun());
            let message = format!("`{}` does not go with {a} and {b}", op.symbol());
            let diagnostic = Diagnostic::error(codes::E0303, sign, message)
                .label(left, a)
                .label(right, b);
            self.report(diagnostic);
            return None;
        };
        let id = self.op(row, &[a.id, b.id]);
        let is_integer = a.is_integer && b.is_integer && op != BinaryOp::Div;
        self.require_finite(id, left.to(right))?;
        Some(ScalarValue {
            id,
            quantity,
            is_integer,
        })
    }

    /// Reports a constant that is not finite.
    pub(crate) fn require_finite(&mut self, id: ExprId, span: Span) -> Option<ExprId> {
        match self.expressions.as_constant(id) {
            Some(value) if !value.is_finite() => {
                let what = if value.is_nan() {
                    "not a number"
                } else {
                    "infinite"
                };
                let message = format!("the result of this is {what}");
                self.report(Diagnostic::error(codes::E0403, span, message));
                None
            }
            _ => Some(id),
        }
    }

    fn comparison(
        &mut self,
        op: BinaryOp,
        left: &Value<'a>,
        right: &Value<'a>,
        spans: OperatorSpans,
    ) -> Value<'a> {
        let is_equality = matches!(op, BinaryOp::Equal | BinaryOp::NotEqual);
        let (a, b) = match (left, right) {
            (Value::Number(a), Value::Number(b)) => (*a, *b),
            (Value::Text(a), Value::Text(b)) if is_equality => {
                return Value::Bool(self.truth((a == b) == (op == BinaryOp::Equal)));
            }
            (Value::Bool(a), Value::Bool(b)) if is_equality => {
                (ScalarValue::plain(*a), ScalarValue::plain(*b))
            }
            _ => return self.mismatch(op, left, right, spans),
        };
        if a.quantity.sum(b.quantity).is_none() {
            return self.mismatch(op, left, right, spans);
        }
        let (a, b) = (a.id, b.id);
        let id = match op {
            BinaryOp::Less => self.op(Op::Less, &[a, b]),
            BinaryOp::Greater => self.op(Op::Less, &[b, a]),
            BinaryOp::LessEqual => self.negated_op(Op::Less, b, a),
            BinaryOp::GreaterEqual => self.negated_op(Op::Less, a, b),
            _ => {
                let is_less = self.op(Op::Less, &[a, b]);
                let is_greater = self.op(Op::Less, &[b, a]);
                let is_different = self.op(Op::Or, &[is_less, is_greater]);
                if op == BinaryOp::NotEqual {
                    is_different
                } else {
                    self.op(Op::Not, &[is_different])
                }
            }
        };
        Value::Bool(id)
    }

    fn negated_op(&mut self, op: Op, a: ExprId, b: ExprId) -> ExprId {
        let id = self.op(op, &[a, b]);
        self.op(Op::Not, &[id])
    }

    /// Reports operands that are incompatible with an operator.
    fn mismatch(
        &mut self,
        op: BinaryOp,
        left: &Value<'a>,
        right: &Value<'a>,
        (left_span, sign, right_span): OperatorSpans,
    ) -> Value<'a> {
        let (a, b) = (self.describe(left), self.describe(right));
        let message = format!("`{}` does not go with {a} and {b}", op.symbol());
        let mut diagnostic = Diagnostic::error(codes::E0302, sign, message)
            .label(left_span, a)
            .label(right_span, b);
        let are_shapes = left.is_shape() && right.is_shape();
        if op == BinaryOp::Add && are_shapes {
            diagnostic = diagnostic.fix(sign, "|", "the union of shapes is written `|`");
        } else if op == BinaryOp::Add && left.is_shape() {
            diagnostic = diagnostic.help("`.offset(-0.2)` takes 0.2 off a shape on all sides");
        } else if op == BinaryOp::Mul && left.is_shape() {
            diagnostic = diagnostic.help("write `.scale(factor)` to change a shape's size");
        } else if op == BinaryOp::Mul && right.is_shape() {
            diagnostic = diagnostic.fix(sign, "&", "the intersection of shapes is written `&`");
        }
        self.report(diagnostic);
        Value::Poison
    }

    /// Evaluates `-value`, component by component.
    pub(crate) fn negate(&mut self, value: Value<'a>, unary: &'a Unary, span: Span) -> Value<'a> {
        if value.is_poison() {
            return value;
        }
        let Some((form, mut numbers)) = components(&value) else {
            let what = self.describe(&value);
            let message = format!("`-` does not go with {what}");
            let mut diagnostic = Diagnostic::error(codes::E0302, span, message).primary(what);
            if value.is_shape() {
                let text = "everything outside a shape is written `!shape`";
                diagnostic = diagnostic.fix(unary.op_span, "!", text);
            }
            self.report(diagnostic);
            return Value::Poison;
        };
        for number in &mut numbers[..form.len()] {
            number.id = self.op(Op::Neg, &[number.id]);
        }
        assemble_value(form, &numbers)
    }

    /// Returns the condition that a value represents; reports any other value.
    pub(crate) fn condition(&mut self, value: Value<'a>, span: Span) -> Option<ExprId> {
        match value {
            Value::Bool(id) => Some(id),
            Value::Poison => None,
            other => {
                self.report_wrong(&other, "a condition is true or false", span);
                None
            }
        }
    }

    /// Selects between two values by a condition, if both are numbers of compatible forms.
    pub(crate) fn select_value(
        &mut self,
        condition: ExprId,
        then: &Value<'a>,
        otherwise: &Value<'a>,
    ) -> Option<Value<'a>> {
        if let (Value::Bool(a), Value::Bool(b)) = (then, otherwise) {
            return Some(Value::Bool(
                self.expressions.call(Op::Select, &[condition, *a, *b]),
            ));
        }
        let ((left, a), (right, b)) = (components(then)?, components(otherwise)?);
        let form = left.with(right)?;
        let mut numbers = a;
        for i in 0..form.len() {
            let quantity = a[i].quantity.sum(b[i].quantity)?;
            let id = match a[i].id == b[i].id {
                true => a[i].id,
                false => self
                    .expressions
                    .call(Op::Select, &[condition, a[i].id, b[i].id]),
            };
            numbers[i] = ScalarValue {
                id,
                quantity,
                is_integer: a[i].is_integer && b[i].is_integer,
            };
        }
        Some(assemble_value(form, &numbers))
    }

    /// Converts an sRGB colour to linear numbers.
    pub(crate) fn srgb(&mut self, [r, g, b, _]: [u8; 4]) -> [ExprId; 3] {
        [r, g, b].map(|byte| self.expressions.constant(linear(f64::from(byte) / 255.0)))
    }

    /// Reports whether a number does not depend on the point or the normal.
    pub(crate) fn is_uniform(&self, id: ExprId) -> bool {
        self.expressions.stage(id) <= Stage::Uniform
    }

    /// Reports a number that depends on the point or the normal where it may not.
    pub(crate) fn report_too_late(&mut self, what: &str, stage: Stage, span: Span) {
        let dependency = if stage == Stage::Normal {
            "the normal"
        } else {
            "the point"
        };
        let message = format!("{what} cannot depend on {dependency}");
        let help = "`field`, `displace` and `warp` take functions of the point";
        self.report(Diagnostic::error(codes::E0309, span, message).help(help));
    }
}

/// Decodes an sRGB value between 0 and 1 to linear light.
pub(crate) fn linear(value: f64) -> f64 {
    if value <= 0.04045 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}
