//! Arithmetic, comparisons and choices: on numbers, and component by component on vectors and
//! colours. Quantities are kept: a length times a length is an area, and an angle and a length
//! cannot be added.

use super::Elaborator;
use super::value::{Number, Value, Vector};
use crate::expression::{ExprId, Stage};
use crate::symbolic::simplified;
use sdfc_lang::ast::{BinaryOp, Unary};
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::table::Op;

/// What a value made of numbers looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// One number.
    Scalar,
    /// A vector of this many.
    Vector(usize),
    /// A colour.
    Color,
}

impl Form {
    /// How many numbers there are.
    pub(crate) fn len(self) -> usize {
        match self {
            Form::Scalar => 1,
            Form::Vector(len) => len,
            Form::Color => 3,
        }
    }
    /// The form of what two values give together, if they go together.
    pub(crate) fn with(self, other: Self) -> Option<Self> {
        match (self, other) {
            (a, b) if a == b => Some(a),
            (Form::Scalar, form) | (form, Form::Scalar) => Some(form),
            (Form::Color, Form::Vector(3)) | (Form::Vector(3), Form::Color) => Some(Form::Color),
            _ => None,
        }
    }
}

/// The numbers that a value is made of; positions past the end repeat the last one.
pub(crate) fn parts(value: &Value<'_>) -> Option<(Form, [Number; 4])> {
    match value {
        Value::Number(number) => Some((Form::Scalar, [*number; 4])),
        Value::Vector(vector) => {
            let parts = vector.parts();
            let form = Form::Vector(parts.len());
            Some((form, std::array::from_fn(|i| parts[i.min(parts.len() - 1)])))
        }
        Value::Color([r, g, b]) => Some((Form::Color, [*r, *g, *b, *b].map(Number::plain))),
        // A list that a loop made is a vector where its length allows.
        Value::List(list) if (2..=4).contains(&list.len()) => {
            let numbers: Option<Vec<Number>> =
                list.iter().map(super::evaluate::as_number).collect();
            parts(&Value::Vector(Vector::from_slice(&numbers?)?))
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

/// A value of the form made of the first of these numbers.
pub(crate) fn assembled<'a>(form: Form, numbers: &[Number]) -> Value<'a> {
    match (form, numbers) {
        (Form::Color, [r, g, b, ..]) => Value::Color([r.id, g.id, b.id]),
        (Form::Vector(len), numbers) => match Vector::from_slice(&numbers[..len]) {
            Some(vector) => Value::Vector(vector),
            None => Value::Poison,
        },
        (_, [one, ..]) => Value::Number(*one),
        (_, []) => Value::Poison,
    }
}

/// The spans of the left operand, the operator and the right operand.
pub(crate) type OperatorSpans = (Span, Span, Span);

impl<'a> Elaborator<'a> {
    /// The 1 or 0 of a truth.
    pub(crate) fn truth(&mut self, truth: bool) -> ExprId {
        self.graph.constant(if truth { 1.0 } else { 0.0 })
    }

    /// An operation on numbers, with neutral operands left out.
    pub(crate) fn op(&mut self, op: Op, values: &[ExprId]) -> ExprId {
        simplified(&mut self.graph, op, values)
    }

    /// A binary operator other than those of shapes.
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
            BinaryOp::And | BinaryOp::Or | BinaryOp::Both | BinaryOp::Either => {
                self.mismatch(op, &left, &right, spans)
            }
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
        let (Some((left_form, a)), Some((right_form, b))) = (parts(left), parts(right)) else {
            return self.mismatch(op, left, right, spans);
        };
        let Some(form) = left_form.with(right_form) else {
            return self.mismatch(op, left, right, spans);
        };
        let mut results = a;
        for i in 0..form.len() {
            match self.arithmetic_of_numbers(op, a[i], b[i], spans) {
                Some(number) => results[i] = number,
                None => return Value::Poison,
            }
        }
        assembled(form, &results)
    }

    fn arithmetic_of_numbers(
        &mut self,
        op: BinaryOp,
        a: Number,
        b: Number,
        spans: OperatorSpans,
    ) -> Option<Number> {
        let (left, sign, right) = spans;
        if matches!(op, BinaryOp::Div | BinaryOp::Rem) && self.graph.as_constant(b.id) == Some(0.0)
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
        let whole = a.whole && b.whole && op != BinaryOp::Div;
        self.finite(id, left.to(right))?;
        Some(Number {
            id,
            quantity,
            whole,
        })
    }

    /// Reports a constant that is not finite.
    pub(crate) fn finite(&mut self, id: ExprId, span: Span) -> Option<ExprId> {
        match self.graph.as_constant(id) {
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
                (Number::plain(*a), Number::plain(*b))
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
            BinaryOp::LessEqual => self.not(Op::Less, b, a),
            BinaryOp::GreaterEqual => self.not(Op::Less, a, b),
            _ => {
                let below = self.op(Op::Less, &[a, b]);
                let above = self.op(Op::Less, &[b, a]);
                let differ = self.op(Op::Or, &[below, above]);
                if op == BinaryOp::NotEqual {
                    differ
                } else {
                    self.op(Op::Not, &[differ])
                }
            }
        };
        Value::Bool(id)
    }

    fn not(&mut self, op: Op, a: ExprId, b: ExprId) -> ExprId {
        let id = self.op(op, &[a, b]);
        self.op(Op::Not, &[id])
    }

    /// Operands that an operator does not go with.
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
        if op == BinaryOp::Add && (self.is_shape(left) || self.is_shape(right)) {
            diagnostic = diagnostic.fix(sign, "|", "the union of shapes is written `|`");
        } else if op == BinaryOp::Mul && self.is_shape(left) {
            diagnostic = diagnostic.help("write `.scale(factor)` to change a shape's size");
        } else if op == BinaryOp::Mul && self.is_shape(right) {
            diagnostic = diagnostic.fix(sign, "&", "the intersection of shapes is written `&`");
        }
        self.report(diagnostic);
        Value::Poison
    }

    /// `-value`
    pub(crate) fn negated(&mut self, value: Value<'a>, unary: &'a Unary, span: Span) -> Value<'a> {
        if value.is_poison() {
            return value;
        }
        let Some((form, mut numbers)) = parts(&value) else {
            let what = self.describe(&value);
            let message = format!("`-` does not go with {what}");
            let mut diagnostic = Diagnostic::error(codes::E0302, span, message).primary(what);
            if self.is_shape(&value) {
                let text = "everything outside a shape is written `!shape`";
                diagnostic = diagnostic.fix(unary.op_span, "!", text);
            }
            self.report(diagnostic);
            return Value::Poison;
        };
        for number in &mut numbers[..form.len()] {
            number.id = self.op(Op::Neg, &[number.id]);
        }
        assembled(form, &numbers)
    }

    /// `!value`
    pub(crate) fn inverted(&mut self, value: Value<'a>, unary: &'a Unary, span: Span) -> Value<'a> {
        if self.is_shape(&value) {
            return self.complement(&value, unary.operand.span, span);
        }
        match self.condition(value, unary.operand.span) {
            Some(condition) => Value::Bool(self.op(Op::Not, &[condition])),
            None => Value::Poison,
        }
    }

    /// The condition that a value is; reports one that is none.
    pub(crate) fn condition(&mut self, value: Value<'a>, span: Span) -> Option<ExprId> {
        match value {
            Value::Bool(id) => Some(id),
            Value::Poison => None,
            other => {
                self.wrong(&other, "a condition is true or false", span);
                None
            }
        }
    }

    /// A choice by a condition that is not known yet, if it is one between numbers.
    pub(crate) fn choice(
        &mut self,
        condition: ExprId,
        then: &Value<'a>,
        otherwise: &Value<'a>,
    ) -> Option<Value<'a>> {
        if let (Value::Bool(a), Value::Bool(b)) = (then, otherwise) {
            return Some(Value::Bool(
                self.graph.call(Op::Select, &[condition, *a, *b]),
            ));
        }
        let ((left, a), (right, b)) = (parts(then)?, parts(otherwise)?);
        let form = left.with(right)?;
        let mut numbers = a;
        for i in 0..form.len() {
            let quantity = a[i].quantity.sum(b[i].quantity)?;
            let id = match a[i].id == b[i].id {
                true => a[i].id,
                false => self.graph.call(Op::Select, &[condition, a[i].id, b[i].id]),
            };
            numbers[i] = Number {
                id,
                quantity,
                whole: a[i].whole && b[i].whole,
            };
        }
        Some(assembled(form, &numbers))
    }

    /// A colour of the screen as linear numbers.
    pub(crate) fn srgb(&mut self, [r, g, b, _]: [u8; 4]) -> [ExprId; 3] {
        [r, g, b].map(|byte| self.graph.constant(linear(f64::from(byte) / 255.0)))
    }

    /// Whether a number is known before there is a point.
    pub(crate) fn is_uniform(&self, id: ExprId) -> bool {
        self.graph.stage(id) <= Stage::Uniform
    }
}

/// The light of an sRGB value between 0 and 1.
pub(crate) fn linear(value: f64) -> f64 {
    if value <= 0.04045 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}
