//! Conversion of arguments to the numbers, shapes and functions that each parameter takes, with
//! checks.
//!
//! Constants are checked at compile time. Values that depend on live parameters are checked at the
//! current values, and become a check of the scene for later ones.

use super::Elaborator;
use super::angles;
use super::arguments::{
    self, ArgSlot, ExpectedKind, Invocation, ParamSpec, arg_indices, kind_noun, without_article,
    wrong_type,
};
use super::constness::Demand;
use super::display::format_short;
use super::numbers::{Form, components};
use super::value::{EvalResult, List, Quantity, ScalarValue, Value};
use crate::expression::{ExprId, Stage};
use crate::scene::{MaterialId, ShapeId};
use crate::symbolic::{Symbolic, with_expressions};
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::real::{Real, lit};
use sdfc_vm::row::ArgumentKind as A;
use sdfc_vm::settings::MAX_MAGNITUDE;

/// An argument converted to the form that its parameter takes.
#[derive(Clone, Debug)]
pub(crate) struct BoundArg<'a> {
    /// True if the call passes the argument.
    pub(crate) is_given: bool,
    /// Source span; the span of the function's name if the argument is left out.
    pub(crate) span: Span,
    /// Numbers, for numeric parameters.
    pub(crate) numbers: Vec<ExprId>,
    /// Value, for other parameters.
    pub(crate) value: Value<'a>,
}

/// Converted arguments of a call, one per parameter.
#[derive(Clone, Debug)]
pub(crate) struct BoundArgs<'a> {
    /// Name of the callee.
    pub(crate) name: &'a str,
    /// Span of the name.
    pub(crate) name_span: Span,
    /// Span of the entire call.
    pub(crate) span: Span,
    /// True if the first argument is a 2-D shape.
    pub(crate) is_2d: bool,
    /// Arguments, one per parameter.
    pub(crate) arguments: Vec<BoundArg<'a>>,
}

impl<'a> BoundArgs<'a> {
    /// Returns the number of a scalar argument.
    pub(crate) fn number(&self, index: usize) -> ExprId {
        self.arguments[index].numbers[0]
    }
    /// Returns the three numbers of a vector argument.
    pub(crate) fn vector(&self, index: usize) -> [ExprId; 3] {
        let numbers = &self.arguments[index].numbers;
        [numbers[0], numbers[1], numbers[2]]
    }
    /// Returns the value of an argument that is not numeric.
    pub(crate) fn value(&self, index: usize) -> &Value<'a> {
        &self.arguments[index].value
    }
    /// Reports whether the call passes the argument.
    pub(crate) fn is_given(&self, index: usize) -> bool {
        self.arguments[index].is_given
    }
    /// Returns the source span of the argument.
    pub(crate) fn span_at(&self, index: usize) -> Span {
        self.arguments[index].span
    }
    /// Returns the shape that an argument was converted to.
    pub(crate) fn shape(&self, index: usize) -> ShapeId {
        match self.arguments[index].value {
            Value::Shape(id) => id,
            _ => unreachable!("a parameter of kind shape holds a shape once it is converted"),
        }
    }
    /// Returns the material that an argument was converted to.
    pub(crate) fn material(&self, index: usize) -> MaterialId {
        match self.arguments[index].value {
            Value::Material(id) => id,
            _ => unreachable!("a parameter of kind material holds one once it is converted"),
        }
    }
}

/// Implementation of a function whose arguments are converted to its parameters first.
pub(crate) type TypedBuiltinFn = for<'a> fn(&mut Elaborator<'a>, BoundArgs<'a>) -> EvalResult<'a>;

impl<'a> Elaborator<'a> {
    /// Calls a built-in function whose arguments are converted to its parameters.
    pub(crate) fn call_typed(
        &mut self,
        params: &'static [ParamSpec],
        run: TypedBuiltinFn,
        call: Invocation<'a>,
    ) -> EvalResult<'a> {
        let is_2d = self.is_2d_call(&call);
        match arguments::match_args(params, &call.args, is_2d) {
            Ok(slots) => match self.convert_arguments(&call, params, &slots, is_2d) {
                Some(bound) => run(self, bound),
                None => Ok(Value::Poison),
            },
            Err(error) => {
                self.report_mismatch(&call, &[params], 0, error, is_2d);
                Ok(Value::Poison)
            }
        }
    }

    /// Reports whether the first argument is a 2-D shape, so that vectors have two components. For a
    /// `field` of the plane, they may have two.
    pub(crate) fn is_2d_call(&self, call: &Invocation<'a>) -> bool {
        let is_2d = |value: &Value<'a>| match value {
            Value::Shape(id) => self.shapes[id.0 as usize].is_2d,
            function if call.name == "field" && function.takes_vec2() => {
                let mut forms = call.args.iter().filter_map(|arg| components(&arg.value));
                forms.any(|(form, _)| form == Form::Vector(2))
            }
            _ => false,
        };
        match call.args.first().map(|arg| &arg.value) {
            Some(Value::List(list)) => list.first().is_some_and(is_2d),
            Some(value) => is_2d(value),
            None => false,
        }
    }

    /// Reports a call that fits no variant of a built-in function.
    pub(crate) fn report_mismatch(
        &mut self,
        call: &Invocation<'a>,
        lists: &[&[ParamSpec]],
        best_variant: usize,
        error: arguments::ArgError,
        is_2d: bool,
    ) {
        let describe = |value: &Value<'_>| self.describe(value);
        let diagnostic =
            arguments::mismatch_diagnostic(call, lists, best_variant, error, is_2d, describe);
        self.report(arguments::with_advice(call, diagnostic));
    }

    /// Converts the arguments of a call to the form that the parameters take. Reports all mistakes;
    /// returns `None` if there is one.
    pub(crate) fn convert_arguments(
        &mut self,
        call: &Invocation<'a>,
        params: &[ParamSpec],
        slots: &[ArgSlot],
        is_2d: bool,
    ) -> Option<BoundArgs<'a>> {
        let mut arguments = Vec::with_capacity(params.len());
        let mut all_converted = true;
        for (param, slot) in params.iter().zip(slots) {
            match self.convert_argument(call, param, *slot, is_2d) {
                Some(argument) => arguments.push(argument),
                None => all_converted = false,
            }
        }
        all_converted.then(|| BoundArgs {
            name: call.name,
            name_span: call.name_span,
            span: call.span,
            is_2d,
            arguments,
        })
    }

    fn convert_argument(
        &mut self,
        call: &Invocation<'a>,
        param: &ParamSpec,
        slot: ArgSlot,
        is_2d: bool,
    ) -> Option<BoundArg<'a>> {
        let args = &call.args[arg_indices(slot, param.kind.width(is_2d))];
        let span = match args {
            [] => call.name_span,
            [first, ..] => args.iter().fold(first.span, |span, g| span.to(g.span)),
        };
        let mut argument = BoundArg {
            is_given: !args.is_empty(),
            span,
            numbers: Vec::new(),
            value: Value::Nothing,
        };
        let Some(first) = args.first() else {
            let default = param.default.unwrap_or_default();
            argument.numbers = default
                .iter()
                .map(|v| self.expressions.constant(*v))
                .collect();
            return Some(argument);
        };
        match param.kind {
            ExpectedKind::Row(_) | ExpectedKind::Factors => {
                let numbers = self.argument_numbers(call, param, slot, is_2d)?;
                argument.numbers = self.check_numbers(call, param, numbers, slot, span, is_2d)?;
            }
            ExpectedKind::Shape => argument.value = Value::Shape(self.shape(&first.value, span)?),
            ExpectedKind::Shape2 | ExpectedKind::Shape3 => {
                let id = self.shape(&first.value, span)?;
                let is_2d = self.shapes[id.0 as usize].is_2d;
                if is_2d != (param.kind == ExpectedKind::Shape2) && !self.is_nothing(id) {
                    let got = if is_2d { "a 2D shape" } else { "a 3D shape" };
                    let noun = kind_noun(param.kind, is_2d);
                    self.report(wrong_type(call, param.name, noun, got, span));
                    return None;
                }
                argument.value = Value::Shape(id);
            }
            ExpectedKind::Function => match &first.value {
                function @ (Value::Function(_) | Value::Builtin(_)) => {
                    argument.value = function.clone();
                }
                other => return self.report_wrong_argument(call, param, other, span, is_2d),
            },
            ExpectedKind::Material => match &first.value {
                Value::Material(_) => argument.value = first.value.clone(),
                other => match self.as_color(other) {
                    Some(color) => argument.value = Value::Material(self.plain_material(color)),
                    None => return self.report_wrong_argument(call, param, other, span, is_2d),
                },
            },
            ExpectedKind::List => match &first.value {
                Value::List(_) | Value::Range(_) | Value::Vector(_) => {
                    argument.value = first.value.clone();
                }
                other => return self.report_wrong_argument(call, param, other, span, is_2d),
            },
            ExpectedKind::Any => argument.value = first.value.clone(),
        }
        Some(argument)
    }

    fn report_wrong_argument(
        &mut self,
        call: &Invocation<'a>,
        param: &ParamSpec,
        value: &Value<'a>,
        span: Span,
        is_2d: bool,
    ) -> Option<BoundArg<'a>> {
        let got = self.describe(value);
        let width = param.kind.width(is_2d);
        let is_vector = matches!(components(value), Some((Form::Vector(_), _)));
        if width < 2 || !is_vector {
            let noun = kind_noun(param.kind, is_2d);
            self.report(wrong_type(call, param.name, noun, &got, span));
            return None;
        }
        let one_number = match param.kind.accepts_scalar() {
            true => "one number or ",
            false => "",
        };
        let message = format!(
            "`{}` of `{}` is {one_number}a vec{width}, and this is {got}",
            param.name, call.name
        );
        let mut diagnostic =
            Diagnostic::error(codes::E0311, span, message).label(call.name_span, "");
        if call.name == "field" && width == 3 {
            diagnostic =
                diagnostic.help("a field of the plane is written `field(fn(p: vec2) => …)`");
        }
        self.report(diagnostic);
        None
    }

    /// Returns the numbers of one parameter's arguments; reports a value that does not fit.
    fn argument_numbers(
        &mut self,
        call: &Invocation<'a>,
        param: &ParamSpec,
        slot: ArgSlot,
        is_2d: bool,
    ) -> Option<Vec<ScalarValue>> {
        let width = param.kind.width(is_2d);
        let args = &call.args[arg_indices(slot, width)];
        if let ArgSlot::Components(_) = slot {
            return Some(args.iter().filter_map(|g| g.value.as_number()).collect());
        }
        let value = &args[0].value;
        let numbers = match components(value) {
            Some((Form::Scalar, [number, ..])) if width == 1 => Some(vec![number]),
            Some((Form::Scalar, [number, ..])) if param.kind.accepts_scalar() => {
                Some(vec![number; width])
            }
            Some((Form::Vector(len), numbers)) if len == width => Some(numbers[..len].to_vec()),
            // A 3-vector whose third component has no effect on a 2-D shape.
            Some((Form::Vector(3), numbers)) if is_2d && width == 2 => Some(numbers[..2].to_vec()),
            _ => None,
        };
        if numbers.is_none() {
            self.report_wrong_argument(call, param, value, args[0].span, is_2d);
        }
        numbers
    }

    /// Checks the numbers against the kind of the parameter and pads them to its full width.
    fn check_numbers(
        &mut self,
        call: &Invocation<'a>,
        param: &ParamSpec,
        mut numbers: Vec<ScalarValue>,
        slot: ArgSlot,
        span: Span,
        is_2d: bool,
    ) -> Option<Vec<ExprId>> {
        let what = format!("`{}` of `{}`", param.name, call.name);
        let arg_span = span;
        // Of consecutive numbers, each has its own span.
        let span_at = |index: usize| match slot {
            ArgSlot::Components(first) => call.args[first + index].span,
            ArgSlot::Default | ArgSlot::Single(_) | ArgSlot::Diameter(_) => arg_span,
        };
        for (index, number) in numbers.iter().enumerate() {
            let span = span_at(index);
            self.check_quantity(call, param, *number, span)?;
            let stage = self.expressions.stage(number.id);
            if stage > Stage::Uniform {
                self.report_too_late(&what, stage, span);
                return None;
            }
            self.check_magnitude(&what, number.id, span)?;
        }
        if let ArgSlot::Diameter(_) = slot {
            let half = self.expressions.constant(0.5);
            for number in &mut numbers {
                number.id = self.op(sdfc_vm::table::Op::Mul, &[number.id, half]);
            }
        }
        let mut ids: Vec<ExprId> = numbers.iter().map(|n| n.id).collect();
        match param.kind {
            ExpectedKind::Row(A::Radius | A::Length | A::Size3 | A::Size2 | A::Radii3) => {
                for (index, &id) in ids.iter().enumerate() {
                    self.check_above(&what, id, true, span_at(index))?;
                }
            }
            ExpectedKind::Row(A::RadiusOrZero | A::LengthOrZero | A::Lengths3) => {
                for (index, &id) in ids.iter().enumerate() {
                    self.check_above(&what, id, false, span_at(index))?;
                }
            }
            ExpectedKind::Row(A::Count | A::Counts3) => {
                for (index, id) in ids.iter_mut().enumerate() {
                    *id = self.positive_count(&what, *id, span_at(index))?;
                }
            }
            ExpectedKind::Row(A::Direction) => ids = self.unit_vector(&what, &ids, span)?,
            ExpectedKind::Factors => {
                for (index, &id) in ids.iter().enumerate() {
                    self.check_factor(&what, id, span_at(index))?;
                }
            }
            ExpectedKind::Row(A::Offset | A::Vec3 | A::Vec2 | A::Angle | A::Number)
            | ExpectedKind::Shape
            | ExpectedKind::Shape2
            | ExpectedKind::Shape3
            | ExpectedKind::Function
            | ExpectedKind::Material
            | ExpectedKind::List
            | ExpectedKind::Any => {}
        }
        let full = param.kind.width(false);
        if is_2d && ids.len() < full {
            let neutral = match param.kind {
                ExpectedKind::Row(A::Counts3 | A::Size3 | A::Radii3) | ExpectedKind::Factors => 1.0,
                _ => 0.0,
            };
            ids.resize(full, self.expressions.constant(neutral));
        }
        Some(ids)
    }

    /// Reports a number of the wrong quantity, such as a length in place of an angle.
    fn check_quantity(
        &mut self,
        call: &Invocation<'a>,
        param: &ParamSpec,
        number: ScalarValue,
        span: Span,
    ) -> Option<()> {
        let fits = match param.kind {
            ExpectedKind::Row(A::Angle) => number.quantity == Quantity::Angle,
            ExpectedKind::Row(A::Count | A::Counts3) | ExpectedKind::Factors => {
                matches!(number.quantity, Quantity::Plain | Quantity::Time)
            }
            ExpectedKind::Row(A::Direction | A::Number) => number.quantity != Quantity::Angle,
            _ => matches!(number.quantity, Quantity::Plain | Quantity::Length(1)),
        };
        if fits {
            return Some(());
        }
        let signature = format!(
            "{}: {}",
            param.name,
            without_article(kind_noun(param.kind, false))
        );
        if param.kind == ExpectedKind::Row(A::Angle)
            && matches!(number.quantity, Quantity::Plain | Quantity::Time)
        {
            let diagnostic = self
                .missing_unit(call.name, span)
                .label(call.name_span, signature);
            self.report(diagnostic);
            return None;
        }
        let noun = kind_noun(param.kind, false);
        let got = number.quantity.noun();
        let message = format!(
            "`{}` takes {noun} for `{}`, and this is {got}",
            call.name, param.name
        );
        let diagnostic =
            Diagnostic::error(codes::E0303, span, message).label(call.name_span, signature);
        let text = self.sources.slice(span);
        self.report(angles::advise(diagnostic, number.quantity, text, span));
        None
    }

    /// Describes an angle without a unit, with the fix `90deg` for `90`.
    pub(crate) fn missing_unit(&self, name: &str, span: Span) -> Diagnostic {
        let diagnostic = Diagnostic::error(codes::E0312, span, "this angle has no unit")
            .primary(format!("`{name}` needs an angle"));
        let text = self.sources.slice(span);
        match text.parse::<f64>() {
            Ok(_) => diagnostic.fix(
                span.at_end(),
                "deg",
                format!("{text} degrees, as in OpenSCAD"),
            ),
            Err(_) => diagnostic
                .help("an angle is a number with `deg`, `rad` or `turn`; `x * 1deg` is one too"),
        }
    }

    fn check_magnitude(&mut self, what: &str, id: ExprId, span: Span) -> Option<()> {
        let value = self.current_value(id);
        let message = if value.is_nan() {
            format!("{what} is not a number")
        } else if value.is_infinite() {
            format!("{what} is infinite")
        } else if value.abs() > MAX_MAGNITUDE {
            format!("{what} is {value:e}, and at most {MAX_MAGNITUDE:e} is allowed")
        } else {
            return Some(());
        };
        self.report(Diagnostic::error(codes::E0403, span, message));
        None
    }

    /// Reports a number that is not positive, or, unless `strict`, a negative one.
    pub(crate) fn check_above(
        &mut self,
        what: &str,
        id: ExprId,
        strict: bool,
        span: Span,
    ) -> Option<()> {
        let requirement = if strict {
            "larger than 0"
        } else {
            "0 or larger"
        };
        let violation = format!("{what} must be {requirement}");
        let message = |value: f64| {
            let message = format!(
                "{what} must be {requirement}, and this is {}",
                format_short(value)
            );
            Diagnostic::error(codes::E0401, span, message)
        };
        self.check(id, strict, span, message, &violation)
            .then_some(())
    }

    fn check_factor(&mut self, what: &str, id: ExprId, span: Span) -> Option<()> {
        let square = self.op(sdfc_vm::table::Op::Mul, &[id, id]);
        let violation = format!("{what} must not be 0");
        let message = |_| Diagnostic::error(codes::E0401, span, format!("{what} must not be 0"));
        self.check(square, true, span, message, &violation)
            .then_some(())
    }

    /// Requires a compile-time integer from 1 to 1,000,000.
    fn positive_count(&mut self, what: &str, id: ExprId, span: Span) -> Option<ExprId> {
        let value = self.demand(id, &Demand::new(what, span))?;
        if value < 1.0 || value.fract() != 0.0 || value > 1e6 {
            let value = format_short(value);
            let message =
                format!("{what} must be a whole number from 1 to 1000000, and this is {value}");
            self.report(Diagnostic::error(codes::E0401, span, message));
            return None;
        }
        Some(self.expressions.constant(value))
    }

    /// Normalizes a direction to length 1.
    pub(crate) fn unit_vector(
        &mut self,
        what: &str,
        ids: &[ExprId],
        span: Span,
    ) -> Option<Vec<ExprId>> {
        let squared = with_expressions(&mut self.expressions, || {
            ids.iter()
                .fold(lit::<Symbolic>(0.0), |sum, &id| sum + Symbolic(id).square())
                .0
        });
        let violation = format!("{what} must not be the zero vector");
        let message = |_| {
            let message = format!("{what} is the zero vector, which has no direction");
            Diagnostic::error(codes::E0405, span, message)
        };
        if !self.check(squared, true, span, message, &violation) {
            return None;
        }
        if self.expressions.as_constant(squared) == Some(1.0) {
            return Some(ids.to_vec());
        }
        Some(with_expressions(&mut self.expressions, || {
            let length = Symbolic(squared).sqrt();
            ids.iter().map(|&id| (Symbolic(id) / length).0).collect()
        }))
    }

    /// Converts a colour, a 3-vector or a list of three numbers to a colour.
    pub(crate) fn as_color(&mut self, value: &Value<'a>) -> Option<[ExprId; 3]> {
        match components(value)? {
            (Form::Color | Form::Vector(3), [r, g, b, _]) => Some([r.id, g.id, b.id]),
            _ => None,
        }
    }

    /// Returns the elements of a list argument; reports any value that is none.
    pub(crate) fn argument_elements(
        &mut self,
        bound: &BoundArgs<'a>,
        index: usize,
    ) -> Option<List<'a>> {
        self.elements(bound.value(index).clone(), bound.span_at(index))
    }
}
