//! Calls: of the scene's own functions, of the language's, and of rows of the table.
//!
//! `x.f(a)` is `f(x, a)` for every function. A name means the scene's own function if there is one.

use super::arguments::{self, Formal, Given, Invocation, Slot, count};
use super::diagnose::{self, nearest};
use super::evaluate::{Halt, Here, Outcome};
use super::value::{Closure, Value};
use super::vocabulary::{self, Function, RunFixed};
use super::{Active, Elaborator};
use crate::expression::Stage;
use sdfc_lang::ast::{self, Arg, Args, Call, ExprKind, Ident, Suffix};
use sdfc_lang::{Diagnostic, Span, codes};
use std::rc::Rc;

/// The deepest that calls of the scene's own functions go into each other.
pub(crate) const MAX_CALLS: usize = 256;

/// The arguments that take a word of their own, such as a kernel's name.
pub(crate) const WORD_ARGUMENTS: [&str; 1] = ["kernel"];

impl<'a> Elaborator<'a> {
    /// `name(args)`
    pub(crate) fn call(&mut self, here: &Here<'a>, call: &'a Call, span: Span) -> Outcome<'a> {
        let given = self.arguments(here, &call.args, Vec::new())?;
        let Some(name) = call.callee.segments.last() else {
            return Ok(Value::Poison);
        };
        let Some(callee) = self.lookup(here, &call.callee) else {
            self.report_unknown(here, &call.callee, "function");
            return Ok(Value::Poison);
        };
        let call = Invocation {
            name: &name.name,
            name_span: call.callee.span,
            span,
            given,
        };
        self.invoke(&callee, call)
    }

    /// `value.name(args)`
    pub(crate) fn method(
        &mut self,
        here: &Here<'a>,
        value: Value<'a>,
        value_span: Span,
        suffix: &'a Suffix,
        args: &'a Args,
    ) -> Outcome<'a> {
        let object = Given {
            name: None,
            value,
            span: value_span,
        };
        let given = self.arguments(here, &args.args, vec![object])?;
        let name = &suffix.name;
        let call = Invocation {
            name: &name.name,
            name_span: name.span,
            span: value_span.to(suffix.span),
            given,
        };
        // A record's field may hold a function.
        if let Value::Record(record) = &call.given[0].value
            && let Some((_, callee)) = record.fields.iter().find(|(field, _)| *field == name.name)
        {
            let callee = callee.clone();
            let given = call.given[1..].to_vec();
            return self.invoke(&callee, Invocation { given, ..call });
        }
        let Some(callee) = self.lookup_name(here, &name.name) else {
            self.report_unknown_method(here, name);
            return Ok(Value::Poison);
        };
        self.invoke(&callee, call)
    }

    fn report_unknown_method(&mut self, here: &Here<'a>, name: &'a Ident) {
        let known = self.globals[here.module].names().chain(vocabulary::names());
        let diagnostic =
            diagnose::unknown_name(codes::E0201, "function", &name.name, name.span, known);
        self.report(diagnostic);
    }

    fn arguments(
        &mut self,
        here: &Here<'a>,
        args: &'a [Arg],
        mut given: Vec<Given<'a>>,
    ) -> Result<Vec<Given<'a>>, Halt> {
        given.reserve(args.len());
        for arg in args {
            let takes_word = arg
                .name
                .as_ref()
                .is_some_and(|name| WORD_ARGUMENTS.contains(&name.name.as_str()));
            let value = match word(&arg.value) {
                Some(ident) if takes_word => Value::Word(&ident.name),
                _ => self.eval(here, &arg.value)?,
            };
            given.push(Given {
                name: arg.name.as_ref(),
                value,
                span: arg.value.span,
            });
        }
        Ok(given)
    }

    /// Calls whatever can be called.
    pub(crate) fn invoke(&mut self, callee: &Value<'a>, call: Invocation<'a>) -> Outcome<'a> {
        let span = call.span;
        let result = self.invoked(callee, call)?;
        self.check_value_depth(&result, span)?;
        Ok(result)
    }

    fn invoked(&mut self, callee: &Value<'a>, call: Invocation<'a>) -> Outcome<'a> {
        match callee {
            Value::Function(closure) => {
                let closure = Rc::clone(closure);
                self.call_closure(&closure, call)
            }
            Value::Builtin(name) => match vocabulary::get(name) {
                Some(function) => self.call_builtin(function, Invocation { name, ..call }),
                None => Ok(Value::Poison),
            },
            Value::Poison => Ok(Value::Poison),
            other => {
                let what = self.describe(other);
                let message = format!("`{}` is {what}, and cannot be called", call.name);
                let mut diagnostic = Diagnostic::error(codes::E0305, call.name_span, message);
                if vocabulary::get(call.name).is_some() {
                    let name = call.name;
                    diagnostic = diagnostic.help(format!(
                        "it hides the function `{name}` of the language; give it another name"
                    ));
                }
                self.report(diagnostic);
                Ok(Value::Poison)
            }
        }
    }

    /// Calls a function value with positional arguments, as `map` and `field` do.
    pub(crate) fn apply(
        &mut self,
        callee: &Value<'a>,
        values: impl IntoIterator<Item = Value<'a>>,
        span: Span,
    ) -> Outcome<'a> {
        let given = values
            .into_iter()
            .map(|value| Given {
                name: None,
                value,
                span,
            })
            .collect();
        let name = match callee {
            Value::Function(closure) if !closure.name.is_empty() => closure.name,
            Value::Builtin(name) => name,
            _ => "this function",
        };
        self.invoke(
            callee,
            Invocation {
                name,
                name_span: span,
                span,
                given,
            },
        )
    }

    fn call_closure(&mut self, closure: &Rc<Closure<'a>>, call: Invocation<'a>) -> Outcome<'a> {
        self.tick(call.span)?;
        let Some(here) = self.bind(closure, &call)? else {
            return Ok(Value::Poison);
        };
        if self.calls.len() >= MAX_CALLS {
            let message = format!("calls go more than {MAX_CALLS} deep into each other");
            let help = "a recursion must end: give it an `if` that stops it";
            let diagnostic = Diagnostic::error(codes::E0408, call.name_span, message).help(help);
            self.report(diagnostic);
            return Err(Halt);
        }
        self.calls.push(Active {
            site: call.span,
            name: call.name,
            body: closure.body.span,
        });
        let result = self.body(&here, closure.body)?;
        self.calls.pop();
        Ok(match closure.result {
            Some(wanted) => self.annotated(result, wanted, closure.body.result.span),
            None => result,
        })
    }

    /// Whether the function that runs now was running when it was called.
    pub(crate) fn is_recursive(&self) -> bool {
        match self.calls.split_last() {
            Some((last, rest)) => rest.iter().any(|call| call.body == last.body),
            None => false,
        }
    }

    /// The parameters of a scene's function with their values.
    fn bind(
        &mut self,
        closure: &Closure<'a>,
        call: &Invocation<'a>,
    ) -> Result<Option<Here<'a>>, Halt> {
        let params = closure.params;
        let mut values: Vec<Option<(Value<'a>, Span)>> = vec![None; params.len()];
        let mut fits = true;
        for (at, given) in call.given.iter().enumerate() {
            let place = match given.name {
                None if at < params.len() => at,
                None => {
                    let most = count(params.len(), "argument");
                    let message = format!("`{}` takes no more than {most}", call.name);
                    let diagnostic = Diagnostic::error(codes::E0205, given.span, message)
                        .primary("one too many")
                        .label(closure.span, "defined here");
                    self.report(diagnostic);
                    return Ok(None);
                }
                Some(name) => match params.iter().position(|p| p.name.name == name.name) {
                    Some(place) => place,
                    None => {
                        let message = format!("`{}` has no argument `{}`", call.name, name.name);
                        let names = params.iter().map(|p| p.name.name.as_str());
                        let diagnostic = Diagnostic::error(codes::E0203, name.span, message)
                            .label(closure.span, "defined here");
                        let near = nearest(&name.name, names);
                        self.report(diagnose::suggest(diagnostic, name.span, near));
                        fits = false;
                        continue;
                    }
                },
            };
            if values[place].is_some() {
                let message = format!("`{}` is given twice", params[place].name.name);
                self.report(Diagnostic::error(codes::E0206, given.span, message));
                fits = false;
            }
            values[place] = Some((given.value.clone(), given.span));
        }
        if !fits {
            return Ok(None);
        }
        let mut here = closure.here.clone();
        for (param, value) in params.iter().zip(values) {
            let name = &param.name.name;
            let (value, span) = match (value, &param.default) {
                (Some(given), _) => given,
                (None, Some(default)) => (self.eval(&here, default)?, default.span),
                (None, None) => {
                    let message = format!("`{}` needs `{name}`", call.name);
                    let diagnostic = Diagnostic::error(codes::E0204, call.name_span, message)
                        .label(closure.span, "defined here");
                    self.report(diagnostic);
                    return Ok(None);
                }
            };
            let value = match &param.annotation {
                Some(wanted) => self.annotated(value, wanted, span),
                None => value,
            };
            here = here.with(name, value);
        }
        Ok(Some(here))
    }

    fn call_builtin(&mut self, function: &'static Function, call: Invocation<'a>) -> Outcome<'a> {
        if call.given.iter().any(|given| given.value.is_poison()) {
            return Ok(Value::Poison);
        }
        match function {
            Function::Free { run, .. } => run(self, call),
            Function::Fixed { formals, run } => self.call_fixed(formals, *run, call),
            Function::Rows(variants) => {
                let flat = self.is_flat(&call);
                let lists: Vec<&[Formal]> = variants.iter().map(|v| v.formals.as_slice()).collect();
                match arguments::choose(lists.iter().copied(), &call.given, flat) {
                    Ok((at, slots)) => {
                        let bound = self.converted(&call, lists[at], &slots, flat);
                        Ok(match bound {
                            Some(bound) => self.row(variants[at].op, &bound),
                            None => Value::Poison,
                        })
                    }
                    Err((at, misfit)) => {
                        self.report_misfit(&call, &lists, at, misfit, flat);
                        Ok(Value::Poison)
                    }
                }
            }
        }
    }

    /// Calls a function of the language whose arguments are bound to parameters.
    pub(crate) fn call_fixed(
        &mut self,
        formals: &'static [Formal],
        run: RunFixed,
        call: Invocation<'a>,
    ) -> Outcome<'a> {
        let flat = self.is_flat(&call);
        match arguments::fit(formals, &call.given, flat) {
            Ok(slots) => match self.converted(&call, formals, &slots, flat) {
                Some(bound) => run(self, bound),
                None => Ok(Value::Poison),
            },
            Err(misfit) => {
                self.report_misfit(&call, &[formals], 0, misfit, flat);
                Ok(Value::Poison)
            }
        }
    }

    /// Whether the call is about a figure, whose vectors have two numbers.
    fn is_flat(&self, call: &Invocation<'a>) -> bool {
        let figure = |value: &Value<'a>| match value {
            Value::Shape(id) => self.shapes[id.0 as usize].plane,
            _ => false,
        };
        match call.given.first().map(|given| &given.value) {
            Some(Value::List(list)) => list.first().is_some_and(figure),
            Some(value) => figure(value),
            None => false,
        }
    }

    fn report_misfit(
        &mut self,
        call: &Invocation<'a>,
        lists: &[&[Formal]],
        at: usize,
        misfit: arguments::Misfit,
        flat: bool,
    ) {
        let describe = |value: &Value<'_>| self.describe(value);
        let diagnostic = arguments::explain(call, lists, at, misfit, flat, describe);
        self.report(diagnostic);
    }

    /// Calls a function of the point. Nothing is made of shapes within it.
    pub(crate) fn at_point(
        &mut self,
        callee: &Value<'a>,
        values: impl IntoIterator<Item = Value<'a>>,
        span: Span,
    ) -> Outcome<'a> {
        self.at_point += 1;
        let result = self.apply(callee, values, span)?;
        self.at_point -= 1;
        Ok(result)
    }

    /// Says that a number is known too late.
    pub(crate) fn report_late(&mut self, what: &str, stage: Stage, span: Span) {
        let blamed = if stage == Stage::Normal {
            "the normal"
        } else {
            "the point"
        };
        let message = format!("{what} cannot depend on {blamed}");
        let help = "`field`, `displace` and `warp` take functions of the point";
        self.report(Diagnostic::error(codes::E0309, span, message).help(help));
    }
}

/// The word that an expression is, if it is nothing but one.
pub(crate) fn word(expr: &ast::Expr) -> Option<&Ident> {
    match &expr.kind {
        ExprKind::Path(path) => path.as_ident(),
        _ => None,
    }
}

/// The positions of a parameter's arguments.
pub(crate) fn sources(slot: Slot, width: usize) -> std::ops::Range<usize> {
    match slot {
        Slot::Default => 0..0,
        Slot::One(at) | Slot::Diameter(at) => at..at + 1,
        Slot::Spread(at) => at..at + width,
    }
}
