//! The functions of numbers: component by component on vectors and colours, as in WGSL.

use super::Elaborator;
use super::arguments::{Invocation, count};
use super::evaluate::Outcome;
use super::numbers::{Form, assembled, parts};
use super::value::{Number, Quantity, Value};
use crate::expression::ExprId;
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::table::Op;

/// Of what a function's result is.
#[derive(Clone, Copy, Debug)]
enum Gives {
    /// Of the same as the arguments, which have to agree.
    Same,
    /// A bare number, whatever the arguments are.
    Plain,
    /// An angle.
    Angle,
    /// The square root's quantity.
    Root,
    /// Of what the first two arguments are, with a bare third one.
    Mix,
}

/// A function of numbers that is a row of the table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MathRow {
    name: &'static str,
    op: Op,
    arity: usize,
    gives: Gives,
}

const fn row(name: &'static str, op: Op, arity: usize, gives: Gives) -> MathRow {
    MathRow {
        name,
        op,
        arity,
        gives,
    }
}

/// The functions that are rows of the table.
pub(crate) const MATH: &[MathRow] = &[
    row("abs", Op::Abs, 1, Gives::Same),
    row("sign", Op::Sign, 1, Gives::Plain),
    row("floor", Op::Floor, 1, Gives::Same),
    row("ceil", Op::Ceil, 1, Gives::Same),
    row("round", Op::Round, 1, Gives::Same),
    row("fract", Op::Fract, 1, Gives::Same),
    row("trunc", Op::Trunc, 1, Gives::Same),
    row("sqrt", Op::Sqrt, 1, Gives::Root),
    row("inverse_sqrt", Op::InverseSqrt, 1, Gives::Plain),
    row("sin", Op::Sin, 1, Gives::Plain),
    row("cos", Op::Cos, 1, Gives::Plain),
    row("tan", Op::Tan, 1, Gives::Plain),
    row("asin", Op::Asin, 1, Gives::Angle),
    row("acos", Op::Acos, 1, Gives::Angle),
    row("atan", Op::Atan, 1, Gives::Angle),
    row("atan2", Op::Atan2, 2, Gives::Angle),
    row("sinh", Op::Sinh, 1, Gives::Plain),
    row("cosh", Op::Cosh, 1, Gives::Plain),
    row("tanh", Op::Tanh, 1, Gives::Plain),
    row("exp", Op::Exp, 1, Gives::Plain),
    row("exp2", Op::Exp2, 1, Gives::Plain),
    row("ln", Op::Ln, 1, Gives::Plain),
    row("log", Op::Ln, 1, Gives::Plain),
    row("log2", Op::Log2, 1, Gives::Plain),
    row("step", Op::Step, 2, Gives::Plain),
    row("smoothstep", Op::Smoothstep, 3, Gives::Plain),
    row("clamp", Op::Clamp, 3, Gives::Same),
    row("mix", Op::Mix, 3, Gives::Mix),
    row("lerp", Op::Mix, 3, Gives::Mix),
];

impl MathRow {
    /// The function of this name.
    pub(crate) fn of(name: &str) -> Option<&'static MathRow> {
        MATH.iter().find(|row| row.name == name)
    }
    /// Its arguments, for the reference.
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
    /// Its meaning.
    pub(crate) fn doc(&self) -> &'static str {
        self.op.row().doc.trim()
    }
    /// Its name.
    pub(crate) fn name(&self) -> &'static str {
        self.name
    }
}

impl<'a> Elaborator<'a> {
    /// A call of a function that is a row of the table.
    pub(crate) fn math(&mut self, row: &MathRow, call: &Invocation<'a>) -> Value<'a> {
        if self.wrong_count(call, row.arity..=row.arity) {
            return Value::Poison;
        }
        self.componentwise(call, |e, numbers| {
            let quantity = e.quantity_of(row, call, numbers)?;
            e.check_domain(row, call, numbers)?;
            let ids: Vec<ExprId> = numbers.iter().map(|number| number.id).collect();
            let id = e.op(row.op, &ids);
            e.finite(id, call.span)?;
            let makes_whole = matches!(row.op, Op::Floor | Op::Ceil | Op::Round | Op::Trunc);
            let whole =
                makes_whole && quantity == Quantity::Plain || row.op == Op::Abs && numbers[0].whole;
            Some(Number {
                id,
                quantity,
                whole,
            })
        })
    }

    fn quantity_of(
        &mut self,
        row: &MathRow,
        call: &Invocation<'a>,
        numbers: &[Number],
    ) -> Option<Quantity> {
        let same = |numbers: &[Number]| {
            let mut quantities = numbers.iter().map(|number| number.quantity);
            let first = quantities.next()?;
            quantities.try_fold(first, Quantity::sum)
        };
        let quantity = match row.gives {
            Gives::Same => same(numbers),
            Gives::Plain => Some(Quantity::Plain),
            Gives::Angle => Some(Quantity::Angle),
            Gives::Root => Some(numbers[0].quantity.root()),
            Gives::Mix => same(&numbers[..2]),
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

    /// Constants for which a function has no value.
    fn check_domain(
        &mut self,
        row: &MathRow,
        call: &Invocation<'a>,
        numbers: &[Number],
    ) -> Option<()> {
        let value = self.graph.as_constant(numbers[0].id);
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
    pub(crate) fn wrong_count(
        &mut self,
        call: &Invocation<'a>,
        allowed: std::ops::RangeInclusive<usize>,
    ) -> bool {
        let name = call.name;
        if let Some(given) = call.given.iter().find(|given| given.name.is_some()) {
            let message = format!("the arguments of `{name}` have no names");
            self.report(Diagnostic::error(codes::E0203, given.span, message));
            return true;
        }
        let given = call.given.len();
        if allowed.contains(&given) {
            return false;
        }
        let wanted = match (*allowed.start(), *allowed.end()) {
            (least, most) if least == most => count(least, "argument"),
            (least, usize::MAX) => format!("at least {}", count(least, "argument")),
            (least, most) => format!("{least} to {most} arguments"),
        };
        let (code, place) = match call.given.get(*allowed.end()) {
            Some(extra) => (codes::E0205, extra.span),
            None => (codes::E0204, call.name_span),
        };
        let message = format!("`{name}` takes {wanted}, and {given} are given");
        self.report(Diagnostic::error(code, place, message));
        true
    }

    /// The numbers of the arguments, with their common form.
    pub(crate) fn common_form(
        &mut self,
        call: &Invocation<'a>,
    ) -> Option<(Form, Vec<[Number; 4]>)> {
        let mut form = Form::Scalar;
        let mut all = Vec::with_capacity(call.given.len());
        for given in &call.given {
            let Some((one, numbers)) = parts(&given.value) else {
                let wanted = format!("`{}` is of numbers", call.name);
                self.wrong(&given.value, &wanted, given.span);
                return None;
            };
            let Some(both) = form.with(one) else {
                let message = format!("`{}` wants vectors of one length", call.name);
                let what = self.describe(&given.value);
                let diagnostic = Diagnostic::error(codes::E0311, given.span, message);
                self.report(diagnostic.primary(format!("this is {what}")));
                return None;
            };
            form = both;
            all.push(numbers);
        }
        Some((form, all))
    }

    pub(crate) fn componentwise(
        &mut self,
        call: &Invocation<'a>,
        mut compute: impl FnMut(&mut Self, &[Number]) -> Option<Number>,
    ) -> Value<'a> {
        let Some((form, all)) = self.common_form(call) else {
            return Value::Poison;
        };
        let mut results = Vec::with_capacity(4);
        for i in 0..form.len() {
            let numbers: Vec<Number> = all.iter().map(|numbers| numbers[i]).collect();
            match compute(self, &numbers) {
                Some(number) => results.push(number),
                None => return Value::Poison,
            }
        }
        assembled(form, &results)
    }

    /// `min(..)` and `max(..)` of any number of values, or of a vector's components.
    pub(crate) fn extreme(&mut self, op: Op, call: Invocation<'a>) -> Outcome<'a> {
        if self.wrong_count(&call, 1..=usize::MAX) {
            return Ok(Value::Poison);
        }
        let call = match self.spread(&call) {
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
                result = Number {
                    id,
                    quantity,
                    whole: result.whole && number.whole,
                };
            }
            Some(result)
        }))
    }

    /// A call with one list or vector as a call with its elements.
    fn spread(&mut self, call: &Invocation<'a>) -> Option<Invocation<'a>> {
        let [only] = call.given.as_slice() else {
            return Some(call.clone());
        };
        let elements: Vec<Value<'a>> = match &only.value {
            Value::List(list) => list.to_vec(),
            Value::Vector(vector) => vector.parts().iter().map(|n| Value::Number(*n)).collect(),
            _ => return Some(call.clone()),
        };
        if elements.is_empty() {
            let message = format!("`{}` of an empty list", call.name);
            self.report(Diagnostic::error(codes::E0410, only.span, message));
            return None;
        }
        let given = elements.into_iter().map(|value| super::arguments::Given {
            name: None,
            value,
            span: only.span,
        });
        Some(Invocation {
            given: given.collect(),
            ..call.clone()
        })
    }

    /// `pow(a, b)`; small whole powers are products, which hold for negative numbers too.
    pub(crate) fn power(&mut self, call: Invocation<'a>) -> Outcome<'a> {
        if self.wrong_count(&call, 2..=2) {
            return Ok(Value::Poison);
        }
        Ok(self.componentwise(&call, |e, numbers| {
            let [base, exponent] = [numbers[0], numbers[1]];
            let whole = e
                .graph
                .as_constant(exponent.id)
                .filter(|n| n.fract() == 0.0 && n.abs() <= 16.0);
            let Some(n) = whole else {
                if e.graph.as_constant(base.id).is_some_and(|base| base < 0.0) {
                    let message = "a negative number has no power that is not whole";
                    e.report(Diagnostic::error(codes::E0401, call.span, message));
                    return None;
                }
                let id = e.op(Op::Pow, &[base.id, exponent.id]);
                e.finite(id, call.span)?;
                return Some(Number::plain(id));
            };
            let mut result = Number::int(e.graph.constant(1.0));
            for _ in 0..n.abs() as u32 {
                let quantity = result.quantity.product(base.quantity);
                let id = e.op(Op::Mul, &[result.id, base.id]);
                result = Number {
                    id,
                    quantity,
                    whole: result.whole && base.whole,
                };
            }
            if n < 0.0 {
                if e.graph.as_constant(result.id) == Some(0.0) {
                    e.report(Diagnostic::error(
                        codes::E0402,
                        call.span,
                        "this divides by zero",
                    ));
                    return None;
                }
                let one = e.graph.constant(1.0);
                let quantity = Quantity::Plain.quotient(result.quantity);
                result = Number::of(e.op(Op::Div, &[one, result.id]), quantity);
            }
            e.finite(result.id, call.span)?;
            Some(result)
        }))
    }

    /// `saturate(x)`: kept within 0 and 1.
    pub(crate) fn saturate(&mut self, call: Invocation<'a>) -> Outcome<'a> {
        if self.wrong_count(&call, 1..=1) {
            return Ok(Value::Poison);
        }
        Ok(self.componentwise(&call, |e, numbers| {
            let (zero, one) = (e.graph.constant(0.0), e.graph.constant(1.0));
            Some(Number::plain(e.op(Op::Clamp, &[numbers[0].id, zero, one])))
        }))
    }

    /// `radians(x)`: a bare number of degrees as an angle.
    pub(crate) fn radians(&mut self, call: Invocation<'a>) -> Outcome<'a> {
        self.scaled(call, 1.0_f64.to_radians(), Quantity::Angle)
    }

    /// `degrees(angle)`: an angle as a bare number of degrees.
    pub(crate) fn degrees(&mut self, call: Invocation<'a>) -> Outcome<'a> {
        self.scaled(call, 1.0_f64.to_degrees(), Quantity::Plain)
    }

    fn scaled(&mut self, call: Invocation<'a>, factor: f64, quantity: Quantity) -> Outcome<'a> {
        if self.wrong_count(&call, 1..=1) {
            return Ok(Value::Poison);
        }
        Ok(self.componentwise(&call, |e, numbers| {
            let factor = e.graph.constant(factor);
            Some(Number::of(
                e.op(Op::Mul, &[numbers[0].id, factor]),
                quantity,
            ))
        }))
    }

    /// `fma(a, b, c)`: `a * b + c`.
    pub(crate) fn product_and_sum(&mut self, call: Invocation<'a>) -> Outcome<'a> {
        if self.wrong_count(&call, 3..=3) {
            return Ok(Value::Poison);
        }
        Ok(self.componentwise(&call, |e, numbers| {
            let product = e.op(Op::Mul, &[numbers[0].id, numbers[1].id]);
            let quantity = numbers[0].quantity.product(numbers[1].quantity);
            Some(Number::of(
                e.op(Op::Add, &[product, numbers[2].id]),
                quantity,
            ))
        }))
    }

    /// The inverse hyperbolic functions, by logarithms.
    pub(crate) fn area(&mut self, op: Op, call: Invocation<'a>) -> Outcome<'a> {
        if self.wrong_count(&call, 1..=1) {
            return Ok(Value::Poison);
        }
        Ok(self.componentwise(&call, |e, numbers| {
            let x = numbers[0].id;
            let one = e.graph.constant(1.0);
            let logarithm = match op {
                Op::Tanh => {
                    let (above, below) = (e.op(Op::Add, &[one, x]), e.op(Op::Sub, &[one, x]));
                    let quotient = e.op(Op::Div, &[above, below]);
                    let (half, logarithm) = (e.graph.constant(0.5), e.op(Op::Ln, &[quotient]));
                    e.op(Op::Mul, &[half, logarithm])
                }
                _ => {
                    // The magnitude, for a sum without cancellation.
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
            e.finite(logarithm, call.span)?;
            Some(Number::plain(logarithm))
        }))
    }

    /// A span's first argument, or the call's.
    pub(crate) fn place(call: &Invocation<'a>, at: usize) -> Span {
        call.given.get(at).map_or(call.span, |given| given.span)
    }
}
