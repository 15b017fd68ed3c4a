//! Lists at compile time: going through them, picking from them, and putting them together. Also
//! what a scene says about itself: `print` and `assert`.

use super::Elaborator;
use super::arguments::Invocation;
use super::bound::{Bound, short};
use super::evaluate::{MAX_LOOP, Outcome};
use super::stage::Demand;
use super::value::{List, Number, Quantity, Value};
use crate::expression::Stage;
use sdfc_lang::ast::BinaryOp;
use sdfc_lang::{Diagnostic, codes};
use sdfc_vm::table::Op;

/// The most lines that `print` keeps.
const MAX_PRINTED: usize = 1_000;

impl<'a> Elaborator<'a> {
    /// `len(list)`
    pub(crate) fn len(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        if let Value::Text(text) = bound.value(0) {
            let count = text.chars().count() as f64;
            return Ok(Value::Number(Number::int(self.graph.constant(count))));
        }
        Ok(match self.elements_of(&bound, 0) {
            Some(list) => Value::Number(Number::int(self.graph.constant(list.len() as f64))),
            None => Value::Poison,
        })
    }

    /// `map(list, f)`
    pub(crate) fn map(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let Some(list) = self.elements_of(&bound, 0) else {
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

    /// `filter(list, f)`
    pub(crate) fn filter(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let Some(list) = self.elements_of(&bound, 0) else {
            return Ok(Value::Poison);
        };
        let function = bound.value(1).clone();
        let mut results = Vec::new();
        for value in list.iter() {
            let keep = self.apply(&function, [value.clone()], bound.span)?;
            let Some(keep) = self.condition(keep, bound.span_of(1)) else {
                return Ok(Value::Poison);
            };
            match self.demand(keep, &Demand::new("what a list holds", bound.span_of(1))) {
                Some(keep) if keep != 0.0 => results.push(value.clone()),
                Some(_) => {}
                None => return Ok(Value::Poison),
            }
        }
        Ok(Value::List(results.into()))
    }

    /// `fold(list, start, f)`: `f(f(start, first), second)` and so on.
    pub(crate) fn fold(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let Some(list) = self.elements_of(&bound, 0) else {
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

    /// `sum(list)`
    pub(crate) fn sum(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let Some(list) = self.elements_of(&bound, 0) else {
            return Ok(Value::Poison);
        };
        let zero = Number::int(self.graph.constant(0.0));
        let mut result = Value::Number(zero);
        let span = bound.span_of(0);
        for value in list.iter() {
            result = self.binary(BinaryOp::Add, result, value.clone(), (span, span, span));
        }
        Ok(result)
    }

    /// `at(list, index)`, counted from zero.
    pub(crate) fn element_at(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let Some(list) = self.elements_of(&bound, 0) else {
            return Ok(Value::Poison);
        };
        let span = bound.span_of(1);
        let demand = Demand::new("the place in a list", span);
        let Some(index) = self.demand(bound.number(1), &demand) else {
            return Ok(Value::Poison);
        };
        let found = (index >= 0.0 && index.fract() == 0.0).then(|| list.get(index as usize));
        match found.flatten() {
            Some(value) => Ok(value.clone()),
            None => {
                let message = format!("a list of {} has no element {}", list.len(), short(index));
                let help = "elements are counted from 0";
                self.report(Diagnostic::error(codes::E0410, span, message).help(help));
                Ok(Value::Poison)
            }
        }
    }

    /// `reverse(list)`
    pub(crate) fn reverse(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let Some(list) = self.elements_of(&bound, 0) else {
            return Ok(Value::Poison);
        };
        Ok(Value::List(list.iter().rev().cloned().collect()))
    }

    /// `concat(a, b, ..)`
    pub(crate) fn concat(&mut self, call: Invocation<'a>) -> Outcome<'a> {
        if self.wrong_count(&call, 1..=usize::MAX) {
            return Ok(Value::Poison);
        }
        let mut all = Vec::new();
        for given in &call.given {
            match self.elements(given.value.clone(), given.span) {
                Some(list) => all.extend(list.iter().cloned()),
                None => return Ok(Value::Poison),
            }
            if all.len() as f64 > MAX_LOOP {
                let message = format!("a list has at most {MAX_LOOP} elements");
                self.report(Diagnostic::error(codes::E0412, call.span, message));
                return Ok(Value::Poison);
            }
        }
        Ok(Value::List(all.into()))
    }

    /// `list(..)`: its arguments as a list, whatever they are.
    pub(crate) fn as_list(&mut self, call: Invocation<'a>) -> Outcome<'a> {
        if self.wrong_count(&call, 0..=usize::MAX) {
            return Ok(Value::Poison);
        }
        let values: List<'a> = match call.given.as_slice() {
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
            given => given.iter().map(|given| given.value.clone()).collect(),
        };
        Ok(Value::List(values))
    }

    /// `random(i, seed)`: a number from 0 to 1 that is always the same for the same whole numbers.
    pub(crate) fn random(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let mut hash: u64 = 0x9e37_79b9_7f4a_7c15;
        for at in 0..2 {
            let demand = Demand::new("what a random number is made of", bound.span_of(at));
            let Some(value) = self.demand(bound.number(at), &demand) else {
                return Ok(Value::Poison);
            };
            // The finaliser of SplitMix64, a bijection that mixes all bits.
            hash ^= value.to_bits();
            hash = (hash ^ (hash >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            hash = (hash ^ (hash >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            hash ^= hash >> 31;
        }
        let share = (hash >> 11) as f64 / (1_u64 << 53) as f64;
        Ok(Value::Number(Number::of(
            self.graph.constant(share),
            Quantity::Plain,
        )))
    }

    /// `print(..)`
    pub(crate) fn print(&mut self, call: Invocation<'a>) -> Outcome<'a> {
        let values = call.given.iter().map(|given| &given.value);
        match self.printed.len() {
            ..MAX_PRINTED => {
                let line = self.display(values, " ");
                self.printed.push(line);
            }
            MAX_PRINTED => self.printed.push("…".to_owned()),
            _ => {}
        }
        // `x.print()` goes on with `x`.
        Ok(match call.given.into_iter().next() {
            Some(first) if first.span.start == call.span.start => first.value,
            _ => Value::Nothing,
        })
    }

    /// `str(..)`: values as text.
    pub(crate) fn text(&mut self, call: Invocation<'a>) -> Outcome<'a> {
        let values = call.given.iter().map(|given| &given.value);
        Ok(Value::Text(self.display(values, "").as_str().into()))
    }

    /// `assert(condition, message)`: now, or whenever a parameter changes.
    pub(crate) fn assertion(&mut self, call: Invocation<'a>) -> Outcome<'a> {
        if self.wrong_count(&call, 1..=2) {
            return Ok(Value::Poison);
        }
        let span = Self::place(&call, 0);
        let Some(condition) = self.condition(call.given[0].value.clone(), span) else {
            return Ok(Value::Poison);
        };
        let message = match call.given.get(1) {
            Some(given) => self.display([&given.value], ""),
            None => format!("`{}` does not hold", self.sources.slice(span)),
        };
        let stage = self.graph.stage(condition);
        if stage > Stage::Uniform {
            self.report_late("what is asserted", stage, span);
            return Ok(Value::Poison);
        }
        let half = self.graph.constant(0.5);
        let margin = self.op(Op::Sub, &[condition, half]);
        let text = message.clone();
        let failed = |_| Diagnostic::error(codes::E0406, span, text);
        self.check(margin, true, span, failed, &message);
        Ok(Value::Nothing)
    }
}
