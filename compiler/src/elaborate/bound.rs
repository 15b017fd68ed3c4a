//! Arguments as numbers, shapes and functions: converted to what each parameter takes, and checked.
//!
//! What is constant is checked now; what follows live parameters is checked now at their present
//! values, and becomes a check of the scene for later ones.

use super::Elaborator;
use super::arguments::{Formal, Invocation, Kind, Slot, kind_noun};
use super::calls::sources;
use super::diagnose::wrong_type;
use super::numbers::{Form, parts};
use super::stage::Demand;
use super::value::{List, Number, Quantity, Value};
use crate::expression::{ExprId, Stage};
use crate::scene::{MaterialId, ShapeId};
use crate::symbolic::{Symbolic, with_graph};
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::real::{Real, lit};
use sdfc_vm::row::ArgumentKind as A;

/// The largest magnitude of a number of a shape: squares stay finite in `f32`.
const MAX_MAGNITUDE: f64 = 1e18;

/// An argument in the form that its parameter takes.
#[derive(Clone, Debug)]
pub(crate) struct Argument<'a> {
    /// Whether the call gives it.
    pub(crate) given: bool,
    /// Where it stands; the function's name if it was left out.
    pub(crate) span: Span,
    /// Its numbers, for parameters that take numbers.
    pub(crate) numbers: Vec<ExprId>,
    /// Its value, for others.
    pub(crate) value: Value<'a>,
}

/// A call's arguments, one per parameter.
#[derive(Clone, Debug)]
pub(crate) struct Bound<'a> {
    /// What is called.
    pub(crate) name: &'a str,
    /// Where the name stands.
    pub(crate) name_span: Span,
    /// The whole call.
    pub(crate) span: Span,
    /// Whether the first argument is a figure.
    pub(crate) flat: bool,
    /// The arguments.
    pub(crate) arguments: Vec<Argument<'a>>,
}

impl<'a> Bound<'a> {
    /// The number of an argument of one.
    pub(crate) fn number(&self, at: usize) -> ExprId {
        self.arguments[at].numbers[0]
    }
    /// The three numbers of a vector.
    pub(crate) fn vector(&self, at: usize) -> [ExprId; 3] {
        let numbers = &self.arguments[at].numbers;
        [numbers[0], numbers[1], numbers[2]]
    }
    /// The value of an argument that is not made of numbers.
    pub(crate) fn value(&self, at: usize) -> &Value<'a> {
        &self.arguments[at].value
    }
    /// Whether the call gives the argument.
    pub(crate) fn given(&self, at: usize) -> bool {
        self.arguments[at].given
    }
    /// Where the argument stands.
    pub(crate) fn span_of(&self, at: usize) -> Span {
        self.arguments[at].span
    }
    /// The shape that an argument was converted to.
    pub(crate) fn shape(&self, at: usize) -> ShapeId {
        match self.arguments[at].value {
            Value::Shape(id) => id,
            _ => unreachable!("a parameter of kind shape holds a shape once it is converted"),
        }
    }
    /// The material that an argument was converted to.
    pub(crate) fn material(&self, at: usize) -> MaterialId {
        match self.arguments[at].value {
            Value::Material(id) => id,
            _ => unreachable!("a parameter of kind material holds one once it is converted"),
        }
    }
}

impl<'a> Elaborator<'a> {
    /// The arguments of a call in the form that the parameters take; mistakes are reported, all of
    /// them, and give nothing.
    pub(crate) fn converted(
        &mut self,
        call: &Invocation<'a>,
        formals: &[Formal],
        slots: &[Slot],
        flat: bool,
    ) -> Option<Bound<'a>> {
        let mut arguments = Vec::with_capacity(formals.len());
        let mut is_whole = true;
        for (formal, slot) in formals.iter().zip(slots) {
            match self.argument(call, formal, *slot, flat) {
                Some(argument) => arguments.push(argument),
                None => is_whole = false,
            }
        }
        is_whole.then(|| Bound {
            name: call.name,
            name_span: call.name_span,
            span: call.span,
            flat,
            arguments,
        })
    }

    fn argument(
        &mut self,
        call: &Invocation<'a>,
        formal: &Formal,
        slot: Slot,
        flat: bool,
    ) -> Option<Argument<'a>> {
        let given = &call.given[sources(slot, formal.kind.width(flat))];
        let span = match given {
            [] => call.name_span,
            [first, ..] => given.iter().fold(first.span, |span, g| span.to(g.span)),
        };
        let mut argument = Argument {
            given: !given.is_empty(),
            span,
            numbers: Vec::new(),
            value: Value::Nothing,
        };
        let Some(first) = given.first() else {
            let default = formal.default.unwrap_or_default();
            argument.numbers = default.iter().map(|v| self.graph.constant(*v)).collect();
            return Some(argument);
        };
        match formal.kind {
            Kind::Row(_) | Kind::Factors => {
                let numbers = self.numbers_given(call, formal, slot, flat)?;
                argument.numbers = self.checked(call, formal, numbers, slot, span, flat)?;
            }
            Kind::Shape => argument.value = Value::Shape(self.shape(&first.value, span)?),
            Kind::Figure | Kind::Solid => {
                let id = self.shape(&first.value, span)?;
                let plane = self.shapes[id.0 as usize].plane;
                if plane != (formal.kind == Kind::Figure) && !self.is_nothing(id) {
                    let got = if plane { "a 2D shape" } else { "a 3D shape" };
                    let noun = kind_noun(formal.kind, flat);
                    self.report(wrong_type(call, formal.name, noun, got, span));
                    return None;
                }
                argument.value = Value::Shape(id);
            }
            Kind::Function => match &first.value {
                function @ (Value::Function(_) | Value::Builtin(_)) => {
                    argument.value = function.clone();
                }
                other => return self.wrong_argument(call, formal, other, span, flat),
            },
            Kind::Material => match &first.value {
                Value::Material(_) => argument.value = first.value.clone(),
                other => match self.as_color(other) {
                    Some(color) => argument.value = Value::Material(self.plain_material(color)),
                    None => return self.wrong_argument(call, formal, other, span, flat),
                },
            },
            Kind::List => match &first.value {
                Value::List(_) | Value::Range(_) | Value::Vector(_) => {
                    argument.value = first.value.clone();
                }
                other => return self.wrong_argument(call, formal, other, span, flat),
            },
            Kind::Any => argument.value = first.value.clone(),
        }
        Some(argument)
    }

    fn wrong_argument(
        &mut self,
        call: &Invocation<'a>,
        formal: &Formal,
        value: &Value<'a>,
        span: Span,
        flat: bool,
    ) -> Option<Argument<'a>> {
        let got = self.describe(value);
        let noun = kind_noun(formal.kind, flat);
        self.report(wrong_type(call, formal.name, noun, &got, span));
        None
    }

    /// The numbers that the arguments of one parameter are made of.
    fn numbers_given(
        &mut self,
        call: &Invocation<'a>,
        formal: &Formal,
        slot: Slot,
        flat: bool,
    ) -> Option<Vec<Number>> {
        let width = formal.kind.width(flat);
        let given = &call.given[sources(slot, width)];
        if let Slot::Spread(_) = slot {
            return Some(
                given
                    .iter()
                    .filter_map(|g| super::evaluate::as_number(&g.value))
                    .collect(),
            );
        }
        let value = &given[0].value;
        let numbers = match parts(value) {
            Some((Form::Scalar, [one, ..])) if width == 1 => Some(vec![one]),
            Some((Form::Scalar, [one, ..])) if formal.kind.spreads() => Some(vec![one; width]),
            Some((Form::Vector(len), numbers)) if len == width => Some(numbers[..len].to_vec()),
            // A vector in space whose third number does not matter to a figure.
            Some((Form::Vector(3), numbers)) if flat && width == 2 => Some(numbers[..2].to_vec()),
            _ => None,
        };
        if numbers.is_none() {
            self.wrong_argument(call, formal, value, given[0].span, flat);
        }
        numbers
    }

    /// Numbers that fulfil what the parameter asks for, padded to its full width.
    fn checked(
        &mut self,
        call: &Invocation<'a>,
        formal: &Formal,
        mut numbers: Vec<Number>,
        slot: Slot,
        span: Span,
        flat: bool,
    ) -> Option<Vec<ExprId>> {
        let what = format!("`{}` of `{}`", formal.name, call.name);
        let whole = span;
        // Of numbers that stand one after the other, each is told about where it stands.
        let place = |at: usize| match slot {
            Slot::Spread(first) => call.given[first + at].span,
            Slot::Default | Slot::One(_) | Slot::Diameter(_) => whole,
        };
        for (at, number) in numbers.iter().enumerate() {
            let span = place(at);
            self.check_quantity(call, formal, *number, span)?;
            let stage = self.graph.stage(number.id);
            if stage > Stage::Uniform {
                self.report_late(&what, stage, span);
                return None;
            }
            self.check_magnitude(&what, number.id, span)?;
        }
        if let Slot::Diameter(_) = slot {
            let half = self.graph.constant(0.5);
            for number in &mut numbers {
                number.id = self.op(sdfc_vm::table::Op::Mul, &[number.id, half]);
            }
        }
        let mut ids: Vec<ExprId> = numbers.iter().map(|n| n.id).collect();
        match formal.kind {
            Kind::Row(A::Radius | A::Length | A::Size3 | A::Size2 | A::Radii3) => {
                for (at, &id) in ids.iter().enumerate() {
                    self.check_above(&what, id, true, place(at))?;
                }
            }
            Kind::Row(A::RadiusOrZero | A::LengthOrZero | A::Lengths3) => {
                for (at, &id) in ids.iter().enumerate() {
                    self.check_above(&what, id, false, place(at))?;
                }
            }
            Kind::Row(A::Count | A::Counts3) => {
                for (at, id) in ids.iter_mut().enumerate() {
                    *id = self.whole_count(&what, *id, place(at))?;
                }
            }
            Kind::Row(A::Direction) => ids = self.direction(&what, &ids, span)?,
            Kind::Factors => {
                for (at, &id) in ids.iter().enumerate() {
                    self.check_factor(&what, id, place(at))?;
                }
            }
            Kind::Row(A::Offset | A::Vec3 | A::Vec2 | A::Angle | A::Number)
            | Kind::Shape
            | Kind::Figure
            | Kind::Solid
            | Kind::Function
            | Kind::Material
            | Kind::List
            | Kind::Any => {}
        }
        let full = formal.kind.width(false);
        if flat && ids.len() < full {
            let neutral = match formal.kind {
                Kind::Row(A::Counts3 | A::Size3 | A::Radii3) | Kind::Factors => 1.0,
                _ => 0.0,
            };
            ids.resize(full, self.graph.constant(neutral));
        }
        Some(ids)
    }

    /// Reports a length where an angle is wanted, and the like.
    fn check_quantity(
        &mut self,
        call: &Invocation<'a>,
        formal: &Formal,
        number: Number,
        span: Span,
    ) -> Option<()> {
        let fits = match formal.kind {
            Kind::Row(A::Angle) => number.quantity == Quantity::Angle,
            Kind::Row(A::Count | A::Counts3) | Kind::Factors => {
                matches!(number.quantity, Quantity::Plain | Quantity::Time)
            }
            Kind::Row(A::Direction | A::Number) => number.quantity != Quantity::Angle,
            _ => matches!(number.quantity, Quantity::Plain | Quantity::Length(1)),
        };
        if fits {
            return Some(());
        }
        let signature = format!("{}: {}", formal.name, bare(kind_noun(formal.kind, false)));
        if formal.kind == Kind::Row(A::Angle)
            && matches!(number.quantity, Quantity::Plain | Quantity::Time)
        {
            let diagnostic = self
                .no_unit(call.name, span)
                .label(call.name_span, signature);
            self.report(diagnostic);
            return None;
        }
        let noun = kind_noun(formal.kind, false);
        let got = number.quantity.noun();
        let message = format!(
            "`{}` wants {noun} for `{}`, and this is {got}",
            call.name, formal.name
        );
        self.report(
            Diagnostic::error(codes::E0303, span, message).label(call.name_span, signature),
        );
        None
    }

    /// "90 what? write 90deg"
    pub(crate) fn no_unit(&self, name: &str, span: Span) -> Diagnostic {
        let diagnostic = Diagnostic::error(codes::E0312, span, "this angle has no unit")
            .primary(format!("`{name}` wants an angle"));
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
        let now = self.present(id);
        let message = if now.is_nan() {
            format!("{what} is not a number")
        } else if now.is_infinite() {
            format!("{what} is infinite")
        } else if now.abs() > MAX_MAGNITUDE {
            format!("{what} is {now:e}, and {MAX_MAGNITUDE:e} is the most")
        } else {
            return Some(());
        };
        self.report(Diagnostic::error(codes::E0403, span, message));
        None
    }

    /// Reports a number that is not above zero, or below it.
    pub(crate) fn check_above(
        &mut self,
        what: &str,
        id: ExprId,
        strict: bool,
        span: Span,
    ) -> Option<()> {
        let wanted = if strict {
            "larger than 0"
        } else {
            "0 or larger"
        };
        let later = format!("{what} must be {wanted}");
        let message = |now: f64| {
            let message = format!("{what} must be {wanted}, and this is {}", short(now));
            Diagnostic::error(codes::E0401, span, message)
        };
        self.check(id, strict, span, message, &later).then_some(())
    }

    fn check_factor(&mut self, what: &str, id: ExprId, span: Span) -> Option<()> {
        let square = self.op(sdfc_vm::table::Op::Mul, &[id, id]);
        let later = format!("{what} must not be 0");
        let message = |_| Diagnostic::error(codes::E0401, span, format!("{what} must not be 0"));
        self.check(square, true, span, message, &later)
            .then_some(())
    }

    /// A whole number of at least one, known while compiling.
    fn whole_count(&mut self, what: &str, id: ExprId, span: Span) -> Option<ExprId> {
        let value = self.demand(id, &Demand::new(what, span))?;
        if value < 1.0 || value.fract() != 0.0 || value > 1e6 {
            let value = short(value);
            let message =
                format!("{what} must be a whole number from 1 to 1000000, and this is {value}");
            self.report(Diagnostic::error(codes::E0401, span, message));
            return None;
        }
        Some(self.graph.constant(value))
    }

    /// A direction of length one.
    pub(crate) fn direction(
        &mut self,
        what: &str,
        ids: &[ExprId],
        span: Span,
    ) -> Option<Vec<ExprId>> {
        let squared = with_graph(&mut self.graph, || {
            ids.iter()
                .fold(lit::<Symbolic>(0.0), |sum, &id| sum + Symbolic(id).square())
                .0
        });
        let later = format!("{what} must not be the zero vector");
        let message = |_| {
            let message = format!("{what} is the zero vector, which has no direction");
            Diagnostic::error(codes::E0405, span, message)
        };
        if !self.check(squared, true, span, message, &later) {
            return None;
        }
        if self.graph.as_constant(squared) == Some(1.0) {
            return Some(ids.to_vec());
        }
        Some(with_graph(&mut self.graph, || {
            let length = Symbolic(squared).sqrt();
            ids.iter().map(|&id| (Symbolic(id) / length).0).collect()
        }))
    }

    /// A list of functions' results, a colour, a vector of three: what can be a colour.
    pub(crate) fn as_color(&mut self, value: &Value<'a>) -> Option<[ExprId; 3]> {
        match parts(value)? {
            (Form::Color | Form::Vector(3), [r, g, b, _]) => Some([r.id, g.id, b.id]),
            _ => None,
        }
    }

    /// Reports a value of the wrong type.
    pub(crate) fn wrong(&mut self, value: &Value<'a>, wanted: &str, span: Span) -> Value<'a> {
        if !value.is_poison() {
            let message = format!("{wanted}, and this is {}", self.describe(value));
            self.report(Diagnostic::error(codes::E0301, span, message));
        }
        Value::Poison
    }

    /// The elements of a list argument.
    pub(crate) fn elements_of(&mut self, bound: &Bound<'a>, at: usize) -> Option<List<'a>> {
        self.elements(bound.value(at).clone(), bound.span_of(at))
    }
}

/// A number as a person would write it.
pub(crate) fn short(value: f64) -> String {
    let rounded = (value * 1e6).round() / 1e6;
    if value.abs() < 1e9 && rounded != 0.0 {
        format!("{rounded}")
    } else {
        format!("{value}")
    }
}

/// A noun without its article.
pub(crate) fn bare(noun: &str) -> &str {
    noun.strip_prefix("a ")
        .or_else(|| noun.strip_prefix("an "))
        .unwrap_or(noun)
}
