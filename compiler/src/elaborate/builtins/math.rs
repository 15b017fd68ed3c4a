//! Functions of numbers, applied to vectors and colours component by component, as in WGSL.

use crate::elaborate::Elaborator;
use crate::elaborate::arguments::{Invocation, PassedArg, count_noun};
use crate::elaborate::dialects::dialect_advice;
use crate::elaborate::numbers::{Form, assemble_value, components};
use crate::elaborate::value::{EvalResult, Quantity, ScalarValue, Value};
use crate::expression::ExprId;
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::table::Op;

/// Quantity of a function's result.
#[derive(Clone, Copy, Debug)]
enum ResultQuantity {
    /// The common quantity of the arguments.
    Same,
    /// A plain number, whatever the arguments are.
    Plain,
    /// An angle.
    Angle,
    /// The quantity of the square root.
    Root,
    /// The common quantity of the first two arguments; the third is plain.
    Mix,
}

/// A function of numbers that is an operation of the table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MathRow {
    name: &'static str,
    op: Op,
    arity: usize,
    result: ResultQuantity,
}

const fn row(name: &'static str, op: Op, arity: usize, result: ResultQuantity) -> MathRow {
    MathRow {
        name,
        op,
        arity,
        result,
    }
}

/// Functions that are operations of the table.
pub(crate) const MATH: &[MathRow] = &[
    row("abs", Op::Abs, 1, ResultQuantity::Same),
    row("sign", Op::Sign, 1, ResultQuantity::Plain),
    row("floor", Op::Floor, 1, ResultQuantity::Same),
    row("ceil", Op::Ceil, 1, ResultQuantity::Same),
    row("round", Op::Round, 1, ResultQuantity::Same),
    row("fract", Op::Fract, 1, ResultQuantity::Same),
    row("trunc", Op::Trunc, 1, ResultQuantity::Same),
    row("sqrt", Op::Sqrt, 1, ResultQuantity::Root),
    row("inverse_sqrt", Op::InverseSqrt, 1, ResultQuantity::Plain),
    row("sin", Op::Sin, 1, ResultQuantity::Plain),
    row("cos", Op::Cos, 1, ResultQuantity::Plain),
    row("tan", Op::Tan, 1, ResultQuantity::Plain),
    row("asin", Op::Asin, 1, ResultQuantity::Angle),
    row("acos", Op::Acos, 1, ResultQuantity::Angle),
    row("atan", Op::Atan, 1, ResultQuantity::Angle),
    row("atan2", Op::Atan2, 2, ResultQuantity::Angle),
    row("sinh", Op::Sinh, 1, ResultQuantity::Plain),
    row("cosh", Op::Cosh, 1, ResultQuantity::Plain),
    row("tanh", Op::Tanh, 1, ResultQuantity::Plain),
    row("exp", Op::Exp, 1, ResultQuantity::Plain),
    row("exp2", Op::Exp2, 1, ResultQuantity::Plain),
    row("ln", Op::Ln, 1, ResultQuantity::Plain),
    row("log", Op::Ln, 1, ResultQuantity::Plain),
    row("log2", Op::Log2, 1, ResultQuantity::Plain),
    row("step", Op::Step, 2, ResultQuantity::Plain),
    row("smoothstep", Op::Smoothstep, 3, ResultQuantity::Plain),
    row("clamp", Op::Clamp, 3, ResultQuantity::Same),
    row("mix", Op::Mix, 3, ResultQuantity::Mix),
    row("lerp", Op::Mix, 3, ResultQuantity::Mix),
];

impl MathRow {
    /// Returns the row of the function of this name.
    pub(crate) fn from_name(name: &str) -> Option<&'static MathRow> {
        MATH.iter().find(|row| row.name == name)
    }
    /// Returns the names of the arguments, for the reference.
    pub(crate) fn arguments(&self) -> &'static str {
        match (self.op, self.arity) {
            (Op::Step, _) => "edge, x",
            (Op::Smoothstep, _) => "low, high, x",
            (Op::Clamp, _) => "x, low, high",
            (Op::Mix, _) => "a, b, t",
            (Op::Atan2, _) => "y, x",
            (_, 1) => "x",
            _ => "a, b",
        }
    }
    /// Returns the description of the operation, from its row.
    pub(crate) fn doc(&self) -> &'static str {
        self.op.row().doc.trim()
    }
    /// Returns the name in the scene language.
    pub(crate) fn name(&self) -> &'static str {
        self.name
    }
}

impl<'a> Elaborator<'a> {
    /// Evaluates a call of a function that is an operation of the table.
    pub(crate) fn math(&mut self, row: &MathRow, call: &Invocation<'a>) -> Value<'a> {
        if let Some(shape) = call.args.first().filter(|arg| arg.value.is_shape()) {
            let what = self.describe(&shape.value);
            let message = format!("`{}` takes numbers, and this is {what}", call.name);
            let mut diagnostic = Diagnostic::error(codes::E0301, shape.span, message);
            if let (Op::Round, Some((_, advice))) = (row.op, dialect_advice("rounded")) {
                diagnostic = diagnostic.help(advice);
            }
            self.report(diagnostic);
            return Value::Poison;
        }
        if self.has_wrong_arg_count(call, row.arity..=row.arity) {
            return Value::Poison;
        }
        self.componentwise(call, |e, numbers| {
            let quantity = e.result_quantity(row, call, numbers)?;
            e.check_domain(row, call, numbers)?;
            let ids: Vec<ExprId> = numbers.iter().map(|number| number.id).collect();
            let id = e.op(row.op, &ids);
            e.require_finite(id, call.span)?;
            let makes_integer = matches!(row.op, Op::Floor | Op::Ceil | Op::Round | Op::Trunc);
            let is_integer = makes_integer && quantity == Quantity::Plain
                || row.op == Op::Abs && numbers[0].is_integer;
            Some(ScalarValue {
                id,
                quantity,
                is_integer,
            })
        })
    }

    fn result_quantity(
        &mut self,
        row: &MathRow,
        call: &Invocation<'a>,
        numbers: &[ScalarValue],
    ) -> Option<Quantity> {
        let common_quantity = |numbers: &[ScalarValue]| {
            let mut quantities = numbers.iter().map(|number| number.quantity);
            let first = quantities.next()?;
            quantities.try_fold(first, Quantity::sum)
        };
        let quantity = match row.result {
            ResultQuantity::Same => common_quantity(numbers),
            ResultQuantity::Plain => Some(Quantity::Plain),
            ResultQuantity::Angle => Some(Quantity::Angle),
            ResultQuantity::Root => Some(numbers[0].quantity.root()),
            ResultQuantity::Mix => common_quantity(&numbers[..2]),
        };
        if quantity.is_none() {
            let nouns: Vec<&str> = numbers
                .iter()
                .map(|number| number.quantity.noun())
                .collect();
            let message = format!("`{}` does not go with {}", call.name, nouns.join(" and "));
            self.report(Diagnostic::error(codes::E0303, call.span, message));
        }
        quantity
    }

    /// Reports constants outside the domain of a function.
    fn check_domain(
        &mut self,
        row: &MathRow,
        call: &Invocation<'a>,
        numbers: &[ScalarValue],
    ) -> Option<()> {
        let value = self.expressions.as_constant(numbers[0].id);
        let message = match (row.op, value) {
            (Op::Sqrt, Some(v)) if v < 0.0 => "this is the square root of a negative number",
            (Op::InverseSqrt, Some(v)) if v <= 0.0 => {
                "this is one over the square root of zero or less"
            }
            (Op::Ln | Op::Log2, Some(v)) if v <= 0.0 => "this is the logarithm of zero or less",
            (Op::Asin | Op::Acos, Some(v)) if v.abs() > 1.0 + 1e-9 => {
                "no angle has this sine or cosine: it lies beyond -1 or 1"
            }
            _ => return Some(()),
        };
        self.report(Diagnostic::error(codes::E0401, call.span, message));
        None
    }

    /// Reports a call with the wrong number of arguments, or with named ones.
    pub(crate) fn has_wrong_arg_count(
        &mut self,
        call: &Invocation<'a>,
        allowed: std::ops::RangeInclusive<usize>,
    ) -> bool {
        let name = call.name;
        if let Some(passed) = call.args.iter().find(|passed| passed.name.is_some()) {
            let message = format!("the arguments of `{name}` have no names");
            self.report(Diagnostic::error(codes::E0203, passed.span, message));
            return true;
        }
        let passed = call.args.len();
        if allowed.contains(&passed) {
            return false;
        }
        let requirement = match (*allowed.start(), *allowed.end()) {
            (min, max) if min == max => count_noun(min, "argument"),
            (min, usize::MAX) => format!("at least {}", count_noun(min, "argument")),
            (min, max) => format!("{min} to {max} arguments"),
        };
        let (code, span) = match call.args.get(*allowed.end()) {
            Some(extra) => (codes::E0205, extra.span),
            None => (codes::E0204, call.name_span),
        };
        let message = format!("`{name}` takes {requirement}, and {passed} are given");
        let mut diagnostic = Diagnostic::error(code, span, message);
        if name == "atan" && passed == 2 {
            let text = "the angle of a vector is `atan2(y, x)`";
            diagnostic = diagnostic.fix(call.name_span, "atan2", text);
        }
        self.report(diagnostic);
        true
    }

    /// Returns the components of all arguments, and their common form; reports an argument that does not fit.
    pub(crate) fn common_form(
        &mut self,
        call: &Invocation<'a>,
    ) -> Option<(Form, Vec<[ScalarValue; 4]>)> {
        let mut form = Form::Scalar;
        let mut rows = Vec::with_capacity(call.args.len());
        for arg in &call.args {
            let Some((arg_form, numbers)) = components(&arg.value) else {
                let message = format!("`{}` takes numbers", call.name);
                self.report_wrong(&arg.value, &message, arg.span);
                return None;
            };
            let Some(common) = form.with(arg_form) else {
                let message = format!("`{}` needs vectors of one length", call.name);
                let what = self.describe(&arg.value);
                let diagnostic = Diagnostic::error(codes::E0311, arg.span, message);
                self.report(diagnostic.primary(format!("this is {what}")));
                return None;
            };
            form = common;
            rows.push(numbers);
        }
        Some((form, rows))
    }

    pub(crate) fn componentwise(
        &mut self,
        call: &Invocation<'a>,
        mut compute: impl FnMut(&mut Self, &[ScalarValue]) -> Option<ScalarValue>,
    ) -> Value<'a> {
        let Some((form, args)) = self.common_form(call) else {
            return Value::Poison;
        };
        let mut results = Vec::with_capacity(4);
        for i in 0..form.len() {
            let numbers: Vec<ScalarValue> = args.iter().map(|numbers| numbers[i]).collect();
            match compute(self, &numbers) {
                Some(number) => results.push(number),
                None => return Value::Poison,
            }
        }
        assemble_value(form, &results)
    }

    /// Evaluates `min(..)` or `max(..)` of any number of values, or of a vector's components.
    pub(crate) fn min_or_max(&mut self, op: Op, call: Invocation<'a>) -> EvalResult<'a> {
        if self.has_wrong_arg_count(&call, 1..=usize::MAX) {
            return Ok(Value::Poison);
        }
        let call = match self.expand_single_arg(&call) {
            Some(call) => call,
            None => return Ok(Value::Poison),
        };
        Ok(self.componentwise(&call, |e, numbers| {
            let mut result = numbers[0];
            for number in &numbers[1..] {
                let Some(quantity) = result.quantity.sum(number.quantity) else {
                    let nouns = [result.quantity.noun(), number.quantity.noun()].join(" and ");
                    let message = format!("`{}` does not go with {nouns}", call.name);
                    e.report(Diagnostic::error(codes::E0303, call.span, message));
                    return None;
                };
                let id = e.op(op, &[result.id, number.id]);
                result = ScalarValue {
                    id,
                    quantity,
                    is_integer: result.is_integer && number.is_integer,
                };
            }
            Some(result)
        }))
    }

    /// Replaces a single list or vector argument by its elements.
    fn expand_single_arg(&mut self, call: &Invocation<'a>) -> Option<Invocation<'a>> {
        let [only] = call.args.as_slice() else {
            return Some(call.clone());
        };
        let elements: Vec<Value<'a>> = match &only.value {
            Value::List(list) => list.to_vec(),
            Value::Vector(vector) => vector
                .components()
                .iter()
                .map(|n| Value::Number(*n))
                .collect(),
            _ => return Some(call.clone()),
        };
        if elements.is_empty() {
            let message = format!("`{}` of an empty list", call.name);
            self.report(Diagnostic::error(codes::E0410, only.span, message));
            return None;
        }
        let args = elements.into_iter().map(|value| PassedArg {
            name: None,
            value,
            span: only.span,
        });
        Some(Invocation {
            args: args.collect(),
            ..call.clone()
        })
    }

    /// Evaluates `pow(a, b)`. Integer powers up to 16 are products.
    pub(crate) fn power(&mut self, call: Invocation<'a>) -> EvalResult<'a> {
        if self.has_wrong_arg_count(&call, 2..=2) {
            return Ok(Value::Poison);
        }
        Ok(self.componentwise(&call, |e, numbers| {
            let [base, exponent] = [numbers[0], numbers[1]];
            let Some(n) = e.expressions.product_exponent(exponent.id) else {
                let [base_value, exponent_value] =
                    [base, exponent].map(|number| e.expressions.as_constant(number.id));
                let is_integer = exponent_value.is_some_and(|v| v.fract() == 0.0);
                if base_value.is_some_and(|v| v < 0.0) && !is_integer {
                    let message = "a negative number has only integer powers";
                    e.report(Diagnostic::error(codes::E0401, call.span, message));
                    return None;
                }
                let id = e.expressions.power(base.id, exponent.id);
                e.require_finite(id, call.span)?;
                return Some(ScalarValue::plain(id));
            };
            let mut result = ScalarValue::int(e.expressions.constant(1.0));
            for _ in 0..n.unsigned_abs() {
                let quantity = result.quantity.product(base.quantity);
                let id = e.op(Op::Mul, &[result.id, base.id]);
                result = ScalarValue {
                    id,
                    quantity,
                    is_integer: result.is_integer && base.is_integer,
                };
            }
            if n < 0 {
                if e.expressions.as_constant(result.id) == Some(0.0) {
                    e.report(Diagnostic::error(
                        codes::E0402,
                        call.span,
                        "this divides by zero",
                    ));
                    return None;
                }
                let one = e.expressions.constant(1.0);
                let quantity = Quantity::Plain.quotient(result.quantity);
                result = ScalarValue::new(e.op(Op::Div, &[one, result.id]), quantity);
            }
            e.require_finite(result.id, call.span)?;
            Some(result)
        }))
    }

    /// Evaluates `saturate(x)`: clamps to the range from 0 to 1.
    pub(crate) fn saturate(&mut self, call: Invocation<'a>) -> EvalResult<'a> {
        if self.has_wrong_arg_count(&call, 1..=1) {
            return Ok(Value::Poison);
        }
        Ok(self.componentwise(&call, |e, numbers| {
            let (zero, one) = (e.expressions.constant(0.0), e.expressions.constant(1.0));
            Some(ScalarValue::plain(
                e.op(Op::Clamp, &[numbers[0].id, zero, one]),
            ))
        }))
    }

    /// Evaluates `radians(x)`: converts a plain number of degrees to an angle.
    pub(crate) fn radians(&mut self, call: Invocation<'a>) -> EvalResult<'a> {
        self.convert_units(call, 1.0_f64.to_radians(), Quantity::Angle)
    }

    /// Evaluates `degrees(angle)`: converts an angle to a plain number of degrees.
    pub(crate) fn degrees(&mut self, call: Invocation<'a>) -> EvalResult<'a> {
        self.convert_units(call, 1.0_f64.to_degrees(), Quantity::Plain)
    }

    fn convert_units(
        &mut self,
        call: Invocation<'a>,
        factor: f64,
        quantity: Quantity,
    ) -> EvalResult<'a> {
        if self.has_wrong_arg_count(&call, 1..=1) {
            return Ok(Value::Poison);
        }
        Ok(self.componentwise(&call, |e, numbers| {
            let factor = e.expressions.constant(factor);
            Some(ScalarValue::new(
                e.op(Op::Mul, &[numbers[0].id, factor]),
                quantity,
            ))
        }))
    }

    /// Evaluates `fma(a, b, c)`: `a * b + c`.
    pub(crate) fn product_and_sum(&mut self, call: Invocation<'a>) -> EvalResult<'a> {
        if self.has_wrong_arg_count(&call, 3..=3) {
            return Ok(Value::Poison);
        }
        Ok(self.componentwise(&call, |e, numbers| {
            let product = e.op(Op::Mul, &[numbers[0].id, numbers[1].id]);
            let quantity = numbers[0].quantity.product(numbers[1].quantity);
            Some(ScalarValue::new(
                e.op(Op::Add, &[product, numbers[2].id]),
                quantity,
            ))
        }))
    }

    /// Evaluates an inverse hyperbolic function, by logarithms. `op` is the function that it inverts.
    pub(crate) fn inverse_hyperbolic(&mut self, op: Op, call: Invocation<'a>) -> EvalResult<'a> {
        if self.has_wrong_arg_count(&call, 1..=1) {
            return Ok(Value::Poison);
        }
        Ok(self.componentwise(&call, |e, numbers| {
            let x = numbers[0].id;
            let one = e.expressions.constant(1.0);
            let logarithm = match op {
                Op::Tanh => {
                    let (above, below) = (e.op(Op::Add, &[one, x]), e.op(Op::Sub, &[one, x]));
                    let quotient = e.op(Op::Div, &[above, below]);
                    let (half, logarithm) =
                        (e.expressions.constant(0.5), e.op(Op::Ln, &[quotient]));
                    e.op(Op::Mul, &[half, logarithm])
                }
                _ => {
                    // The sum with the magnitude has no cancellation.
                    let size = e.op(Op::Abs, &[x]);
                    let square = e.op(Op::Mul, &[x, x]);
                    let shifted = if op == Op::Sinh { Op::Add } else { Op::Sub };
                    let under = e.op(shifted, &[square, one]);
                    let root = e.op(Op::Sqrt, &[under]);
                    let sum = e.op(Op::Add, &[size, root]);
                    let logarithm = e.op(Op::Ln, &[sum]);
                    let sign = if op == Op::Sinh {
                        e.op(Op::Sign, &[x])
                    } else {
                        one
                    };
                    e.op(Op::Mul, &[sign, logarithm])
                }
            };
            e.require_finite(logarithm, call.span)?;
            Some(ScalarValue::plain(logarithm))
        }))
    }

    /// Returns the span of an argument, or of the call if it is absent.
    pub(crate) fn arg_span(call: &Invocation<'a>, index: usize) -> Span {
        call.args.get(index).map_or(call.span, |arg| arg.span)
    }
}
