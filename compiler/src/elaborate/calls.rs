//! Calls of functions of the scene, of built-in functions, and of operations of the table.
//!
//! For every function, `x.f(a)` means `f(x, a)`. A function of the scene hides a built-in of that
//! name.

use super::arguments::{self, Invocation, ParamSpec, PassedArg, WORD_ARGUMENTS, count_noun, word};
use super::diagnose::{self, nearest};
use super::value::{Abort, Closure, Env, EvalResult, Value};
use super::vocabulary::{self, BuiltinFunction};
use super::{CallFrame, Elaborator};
use sdfc_lang::ast::{Arg, Args, Call, FnParam, Ident, Suffix};
use sdfc_lang::{Diagnostic, Span, codes};
use std::rc::Rc;

/// Maximum depth of nested calls of the scene's functions.
pub(crate) const MAX_CALLS: usize = 256;

impl<'a> Elaborator<'a> {
    /// Evaluates `name(args)`.
    pub(crate) fn call(&mut self, env: &Env<'a>, call: &'a Call, span: Span) -> EvalResult<'a> {
        let args = self.arguments(env, &call.args, Vec::new())?;
        let Some(name) = call.callee.segments.last() else {
            return Ok(Value::Poison);
        };
        let Some(callee) = self.lookup(env, &call.callee) else {
            self.report_unknown(env, &call.callee, "function");
            return Ok(Value::Poison);
        };
        let call = Invocation {
            name: &name.name,
            name_span: call.callee.span,
            span,
            args,
        };
        self.invoke(&callee, call)
    }

    /// Evaluates `value.name(args)`: the call of a function with the value as its first argument, or of a record's
    /// field.
    pub(crate) fn method_call(
        &mut self,
        env: &Env<'a>,
        value: Value<'a>,
        value_span: Span,
        suffix: &'a Suffix,
        args: &'a Args,
    ) -> EvalResult<'a> {
        let object = PassedArg {
            name: None,
            value,
            span: value_span,
        };
        let all_args = self.arguments(env, &args.args, vec![object])?;
        let name = &suffix.name;
        let call = Invocation {
            name: &name.name,
            name_span: name.span,
            span: value_span.to(suffix.span),
            args: all_args,
        };
        // A field of a record may hold a function.
        if let Value::Record(record) = &call.args[0].value
            && let Some((_, callee)) = record.fields.iter().find(|(field, _)| *field == name.name)
        {
            let callee = callee.clone();
            let args = call.args[1..].to_vec();
            return self.invoke(&callee, Invocation { args, ..call });
        }
        let Some(callee) = self.lookup_name(env, &name.name) else {
            self.report_unknown_method(env, name);
            return Ok(Value::Poison);
        };
        self.invoke(&callee, call)
    }

    fn report_unknown_method(&mut self, env: &Env<'a>, name: &'a Ident) {
        let names = self.globals[env.module].names().chain(vocabulary::names());
        let diagnostic =
            diagnose::unknown_name(codes::E0201, "function", &name.name, name.span, names);
        self.report(diagnostic);
    }

    fn arguments(
        &mut self,
        env: &Env<'a>,
        args: &'a [Arg],
        mut passed: Vec<PassedArg<'a>>,
    ) -> Result<Vec<PassedArg<'a>>, Abort> {
        passed.reserve(args.len());
        for arg in args {
            let takes_word = arg
                .name
                .as_ref()
                .is_some_and(|name| WORD_ARGUMENTS.contains(&name.name.as_str()));
            let value = match word(&arg.value) {
                Some(ident) if takes_word => Value::Word(&ident.name),
                _ => self.eval(env, &arg.value)?,
            };
            passed.push(PassedArg {
                name: arg.name.as_ref(),
                value,
                span: arg.value.span,
            });
        }
        Ok(passed)
    }

    /// Calls any callable value.
    pub(crate) fn invoke(&mut self, callee: &Value<'a>, call: Invocation<'a>) -> EvalResult<'a> {
        let span = call.span;
        let result = self.dispatch_call(callee, call)?;
        self.check_value_depth(&result, span)?;
        Ok(result)
    }

    fn dispatch_call(&mut self, callee: &Value<'a>, call: Invocation<'a>) -> EvalResult<'a> {
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
    ) -> EvalResult<'a> {
        let args = values
            .into_iter()
            .map(|value| PassedArg {
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
                args,
            },
        )
    }

    fn call_closure(&mut self, closure: &Rc<Closure<'a>>, call: Invocation<'a>) -> EvalResult<'a> {
        self.charge_step(call.span)?;
        let Some(env) = self.bind_params(closure, &call)? else {
            return Ok(Value::Poison);
        };
        if self.calls.len() >= MAX_CALLS {
            let message = format!("calls nest more than {MAX_CALLS} levels deep");
            let help = "a recursion must end: give it an `if` that stops it";
            let diagnostic = Diagnostic::error(codes::E0408, call.name_span, message).help(help);
            self.report(diagnostic);
            return Err(Abort);
        }
        self.calls.push(CallFrame {
            site: call.span,
            name: call.name,
            body: closure.body.span,
        });
        let result = self.body(&env, closure.body)?;
        self.calls.pop();
        Ok(match closure.result {
            Some(annotation) => {
                self.convert_annotated(result, annotation, closure.body.result.span)
            }
            None => result,
        })
    }

    /// Reports whether the innermost active function was already active when it was called.
    pub(crate) fn is_recursive(&self) -> bool {
        match self.calls.split_last() {
            Some((last, outer)) => outer.iter().any(|call| call.body == last.body),
            None => false,
        }
    }

    /// Binds the arguments of a call to the parameters of a scene's function.
    fn bind_params(
        &mut self,
        closure: &Closure<'a>,
        call: &Invocation<'a>,
    ) -> Result<Option<Env<'a>>, Abort> {
        let params = closure.params;
        let mut values: Vec<Option<(Value<'a>, Span)>> = vec![None; params.len()];
        let mut fits = true;
        for (position, passed) in call.args.iter().enumerate() {
            let index = match passed.name {
                None if position < params.len() => position,
                None => {
                    let max_count = count_noun(params.len(), "argument");
                    let message = format!("`{}` takes no more than {max_count}", call.name);
                    let diagnostic = Diagnostic::error(codes::E0205, passed.span, message)
                        .primary("one too many")
                        .label(closure.span, "defined here");
                    self.report(diagnostic);
                    return Ok(None);
                }
                Some(name) => match params.iter().position(|p| p.name.name == name.name) {
                    Some(index) => index,
                    None => {
                        let message = format!("`{}` has no argument `{}`", call.name, name.name);
                        let names = params.iter().map(|p| p.name.name.as_str());
                        let diagnostic = Diagnostic::error(codes::E0203, name.span, message)
                            .label(closure.span, "defined here");
                        let suggestion = nearest(&name.name, names);
                        self.report(diagnose::suggest(diagnostic, name.span, suggestion));
                        fits = false;
                        continue;
                    }
                },
            };
            if values[index].is_some() {
                let message = format!("`{}` is given twice", params[index].name.name);
                self.report(Diagnostic::error(codes::E0206, passed.span, message));
                fits = false;
            }
            values[index] = Some((passed.value.clone(), passed.span));
        }
        if !fits {
            return Ok(None);
        }
        let mut env = closure.env.clone();
        for (param, value) in params.iter().zip(values) {
            let name = &param.name.name;
            let (value, span) = match (value, &param.default) {
                (Some(passed_value), _) => passed_value,
                (None, Some(default)) => (self.eval(&env, default)?, default.span),
                (None, None) => {
                    let message = format!("`{}` needs `{name}`", call.name);
                    let diagnostic = Diagnostic::error(codes::E0204, call.name_span, message)
                        .label(closure.span, "defined here");
                    self.report(diagnostic);
                    return Ok(None);
                }
            };
            let value = match &param.annotation {
                Some(annotation) => self.convert_annotated(value, annotation, span),
                None => value,
            };
            env = env.with(name, value);
        }
        Ok(Some(env))
    }

    fn call_builtin(
        &mut self,
        function: &'static BuiltinFunction,
        call: Invocation<'a>,
    ) -> EvalResult<'a> {
        if call.args.iter().any(|arg| arg.value.is_poison()) {
            return Ok(Value::Poison);
        }
        match function {
            BuiltinFunction::Untyped { run, .. } => run(self, call),
            BuiltinFunction::Typed { params, run } => self.call_typed(params, *run, call),
            BuiltinFunction::Rows(variants) => {
                let is_2d = self.is_2d_call(&call);
                let lists: Vec<&[ParamSpec]> =
                    variants.iter().map(|v| v.params.as_slice()).collect();
                match arguments::choose_variant(lists.iter().copied(), &call.args, is_2d) {
                    Ok((index, slots)) => {
                        let bound = self.convert_arguments(&call, lists[index], &slots, is_2d);
                        Ok(match bound {
                            Some(bound) => self.row(variants[index].op, &bound),
                            None => Value::Poison,
                        })
                    }
                    Err((index, error)) => {
                        self.report_mismatch(&call, &lists, index, error, is_2d);
                        Ok(Value::Poison)
                    }
                }
            }
        }
    }

    /// Calls a function of the point. Inside it, shapes cannot be made.
    pub(crate) fn call_at_point(
        &mut self,
        callee: &Value<'a>,
        values: impl IntoIterator<Item = Value<'a>>,
        span: Span,
    ) -> EvalResult<'a> {
        let values: Vec<Value<'a>> = values.into_iter().collect();
        if let (Value::Function(closure), [Value::Vector(_)]) = (callee, values.as_slice())
            && let Some(coordinates) = names_of_coordinates(closure.params)
        {
            let point = closure.params[0].name.span;
            let message = "this function takes coordinates, and is given the point as one vector";
            let diagnostic = Diagnostic::error(codes::E0204, closure.span, message);
            self.report(diagnostic.label(point, "the point").help(format!(
                "name the point, and read its coordinates: `fn(p) =>`, and {coordinates}"
            )));
            return Ok(Value::Poison);
        }
        self.point_function_depth += 1;
        let result = self.apply(callee, values, span)?;
        self.point_function_depth -= 1;
        Ok(result)
    }
}

/// Returns how the coordinates of a point are written instead of two or three parameters without defaults.
fn names_of_coordinates(params: &[FnParam]) -> Option<String> {
    let is_required = |param: &FnParam| param.default.is_none();
    if !(2..=3).contains(&params.len()) || !params.iter().all(is_required) {
        return None;
    }
    let coordinates = params.iter().zip(["p.x", "p.y", "p.z"]);
    let names = coordinates.map(|(param, axis)| format!("`{axis}` for `{}`", param.name.name));
    Some(names.collect::<Vec<_>>().join(", "))
}
