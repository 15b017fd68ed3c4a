//! Lists at compile time: iteration, selection and concatenation. Also `print` and `assert`.

use crate::elaborate::Elaborator;
use crate::elaborate::argument_conversion::BoundArgs;
use crate::elaborate::arguments::Invocation;
use crate::elaborate::constness::Demand;
use crate::elaborate::display::format_short;
use crate::elaborate::elements::MAX_LOOP;
use crate::elaborate::value::{EvalResult, List, Quantity, ScalarValue, Value};
use crate::expression::Stage;
use sdfc_lang::ast::BinaryOp;
use sdfc_lang::{Diagnostic, codes};
use sdfc_vm::table::Op;

/// Maximum number of lines that `print` keeps.
const MAX_PRINTED: usize = 1_000;

impl<'a> Elaborator<'a> {
    /// Evaluates `len(list)`: the number of elements, or of a text's characters.
    pub(crate) fn len(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        if let Value::Text(text) = bound.value(0) {
            let count = text.chars().count() as f64;
            return Ok(Value::Number(ScalarValue::int(
                self.expressions.constant(count),
            )));
        }
        Ok(match self.argument_elements(&bound, 0) {
            Some(list) => Value::Number(ScalarValue::int(
                self.expressions.constant(list.len() as f64),
            )),
            None => Value::Poison,
        })
    }

    /// Evaluates `map(list, f)`: the list of the values of `f`.
    pub(crate) fn map(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let Some(list) = self.argument_elements(&bound, 0) else {
            return Ok(Value::Poison);
        };
        let function = bound.value(1).clone();
        let mut results = Vec::with_capacity(list.len());
        for value in list.iter() {
            results.push(self.apply(&function, [value.clone()], bound.span)?);
        }
        if results.iter().any(Value::is_poison) {
            return Ok(Value::Poison);
        }
        Ok(Value::List(results.into()))
    }

    /// Evaluates `filter(list, f)`: the elements for which `f` is true, at compile time.
    pub(crate) fn filter(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let Some(list) = self.argument_elements(&bound, 0) else {
            return Ok(Value::Poison);
        };
        let function = bound.value(1).clone();
        let mut results = Vec::new();
        for value in list.iter() {
            let keep = self.apply(&function, [value.clone()], bound.span)?;
            let Some(keep) = self.condition(keep, bound.span_at(1)) else {
                return Ok(Value::Poison);
            };
            match self.demand(
                keep,
                &Demand::new("the condition of `filter`", bound.span_at(1)),
            ) {
                Some(keep) if keep != 0.0 => results.push(value.clone()),
                Some(_) => {}
                None => return Ok(Value::Poison),
            }
        }
        Ok(Value::List(results.into()))
    }

    /// Evaluates `fold(list, start, f)`: `f(f(start, first), second)` and so on.
    pub(crate) fn fold(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let Some(list) = self.argument_elements(&bound, 0) else {
            return Ok(Value::Poison);
        };
        let function = bound.value(2).clone();
        let mut result = bound.value(1).clone();
        for value in list.iter() {
            result = self.apply(&function, [result, value.clone()], bound.span)?;
            if result.is_poison() {
                break;
            }
        }
        Ok(result)
    }

    /// Evaluates `sum(list)`; the sum of an empty list is 0.
    pub(crate) fn sum(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let Some(list) = self.argument_elements(&bound, 0) else {
            return Ok(Value::Poison);
        };
        let zero = ScalarValue::int(self.expressions.constant(0.0));
        let mut result = Value::Number(zero);
        let span = bound.span_at(0);
        for value in list.iter() {
            result = self.binary(BinaryOp::Add, result, value.clone(), (span, span, span));
        }
        Ok(result)
    }

    /// Evaluates `at(list, index)`, counted from zero.
    pub(crate) fn element_at(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let Some(list) = self.argument_elements(&bound, 0) else {
            return Ok(Value::Poison);
        };
        let span = bound.span_at(1);
        let demand = Demand::new("the index of a list", span);
        let Some(index) = self.demand(bound.number(1), &demand) else {
            return Ok(Value::Poison);
        };
        let element = (index >= 0.0 && index.fract() == 0.0).then(|| list.get(index as usize));
        match element.flatten() {
            Some(value) => Ok(value.clone()),
            None => {
                let message = format!(
                    "a list of {} has no element {}",
                    list.len(),
                    format_short(index)
                );
                let help = "elements are counted from 0";
                self.report(Diagnostic::error(codes::E0410, span, message).help(help));
                Ok(Value::Poison)
            }
        }
    }

    /// Evaluates `reverse(list)`: the elements in reverse order.
    pub(crate) fn reverse(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let Some(list) = self.argument_elements(&bound, 0) else {
            return Ok(Value::Poison);
        };
        Ok(Value::List(list.iter().rev().cloned().collect()))
    }

    /// Evaluates `concat(a, b, ..)`: one list of at most `MAX_LOOP` elements.
    pub(crate) fn concat(&mut self, call: Invocation<'a>) -> EvalResult<'a> {
        if self.has_wrong_arg_count(&call, 1..=usize::MAX) {
            return Ok(Value::Poison);
        }
        let mut elements = Vec::new();
        for arg in &call.args {
            match self.elements(arg.value.clone(), arg.span) {
                Some(list) => elements.extend(list.iter().cloned()),
                None => return Ok(Value::Poison),
            }
            if elements.len() as f64 > MAX_LOOP {
                let message = format!("a list has at most {MAX_LOOP} elements");
                self.report(Diagnostic::error(codes::E0412, call.span, message));
                return Ok(Value::Poison);
            }
        }
        Ok(Value::List(elements.into()))
    }

    /// Evaluates `list(..)`: its arguments as a list, of any type.
    pub(crate) fn as_list(&mut self, call: Invocation<'a>) -> EvalResult<'a> {
        if self.has_wrong_arg_count(&call, 0..=usize::MAX) {
            return Ok(Value::Poison);
        }
        let values: List<'a> = match call.args.as_slice() {
            [only]
                if matches!(
                    only.value,
                    Value::Range(_) | Value::Vector(_) | Value::List(_)
                ) =>
            {
                match self.elements(only.value.clone(), only.span) {
                    Some(list) => list,
                    None => return Ok(Value::Poison),
                }
            }
            args => args.iter().map(|args| args.value.clone()).collect(),
        };
        Ok(Value::List(values))
    }

    /// Evaluates `random(i, seed)`: a number from 0 to 1 that is a function of the two arguments.
    pub(crate) fn random(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let mut hash: u64 = 0x9e37_79b9_7f4a_7c15;
        for index in 0..2 {
            let demand = Demand::new("an argument of `random`", bound.span_at(index));
            let Some(value) = self.demand(bound.number(index), &demand) else {
                return Ok(Value::Poison);
            };
            // Finalizer of SplitMix64, a bijection that mixes all bits.
            hash ^= value.to_bits();
            hash = (hash ^ (hash >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            hash = (hash ^ (hash >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            hash ^= hash >> 31;
        }
        let fraction = (hash >> 11) as f64 / (1_u64 << 53) as f64;
        Ok(Value::Number(ScalarValue::new(
            self.expressions.constant(fraction),
            Quantity::Plain,
        )))
    }

    /// Evaluates `print(..)`, which keeps at most `MAX_PRINTED` lines. `x.print()` evaluates to `x`.
    pub(crate) fn print(&mut self, call: Invocation<'a>) -> EvalResult<'a> {
        let values = call.args.iter().map(|arg| &arg.value);
        match self.printed.len() {
            ..MAX_PRINTED => {
                let line = self.display(values, " ");
                self.printed.push(line);
            }
            MAX_PRINTED => self.printed.push("…".to_owned()),
            _ => {}
        }
        // `x.print()` evaluates to `x`.
        Ok(match call.args.into_iter().next() {
            Some(first) if first.span.start == call.span.start => first.value,
            _ => Value::Nothing,
        })
    }

    /// Evaluates `str(..)`: values as text, without separators.
    pub(crate) fn text(&mut self, call: Invocation<'a>) -> EvalResult<'a> {
        let values = call.args.iter().map(|arg| &arg.value);
        Ok(Value::Text(self.display(values, "").as_str().into()))
    }

    /// Evaluates `assert(condition, message)`, which is checked now, and after each change of a parameter.
    pub(crate) fn assertion(&mut self, call: Invocation<'a>) -> EvalResult<'a> {
        if self.has_wrong_arg_count(&call, 1..=2) {
            return Ok(Value::Poison);
        }
        let span = Self::arg_span(&call, 0);
        let Some(condition) = self.condition(call.args[0].value.clone(), span) else {
            return Ok(Value::Poison);
        };
        let message = match call.args.get(1) {
            Some(arg) => self.display([&arg.value], ""),
            None => format!("`{}` does not hold", self.sources.slice(span)),
        };
        let stage = self.expressions.stage(condition);
        if stage > Stage::Uniform {
            self.report_too_late("the condition of `assert`", stage, span);
            return Ok(Value::Poison);
        }
        let half = self.expressions.constant(0.5);
        let margin = self.op(Op::Sub, &[condition, half]);
        let text = message.clone();
        let failed = |_| Diagnostic::error(codes::E0406, span, text);
        self.check(margin, true, span, failed, &message);
        Ok(Value::Nothing)
    }
}
