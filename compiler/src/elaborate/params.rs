//! Parameters: their kinds and ranges, the values given from outside, and what they are in
//! expressions: a constant if the parameter is structural, else a number that is live.

use super::Elaborator;
use super::annotation::Type;
use super::bound::short;
use super::diagnose::unknown_name;
use super::evaluate::{Halt, Here};
use super::numbers::{Form, parts};
use super::stage::Demand;
use super::value::{Number, Quantity, Value, Vector};
use crate::expression::{ExprId, ParamId};
use crate::scene::{Param, ParamKind};
use sdfc_lang::ast::{self, Expr, ExprKind};
use sdfc_lang::{Diagnostic, FileId, Sources, Span, codes, parse};

/// The value of a parameter as it was given from outside.
#[derive(Debug)]
pub(crate) struct Override {
    name: String,
    text: String,
    /// The text as a file of its own, so that messages can point at it.
    file: FileId,
    /// Its expression, if it is nothing but a value.
    value: Option<ast::File>,
}

impl Override {
    /// Reads `name=text`.
    pub(crate) fn read(sources: &mut Sources, name: &str, text: &str) -> Self {
        let file = sources.add("-p", format!("{name}={text}"));
        let literal = sources.add(format!("-p {name}"), text.trim());
        let (value, _) = parse(sources, literal);
        let value = value
            .filter(|file| file.items.is_empty() && file.result.as_ref().is_some_and(is_literal));
        Self {
            name: name.to_owned(),
            text: text.to_owned(),
            file,
            value,
        }
    }

    fn span(&self) -> Span {
        Span::new(self.file, 0, (self.name.len() + 1 + self.text.len()) as u32)
    }

    /// Reports a parameter that does not exist.
    pub(crate) fn unknown(&self, params: &[Param]) -> Diagnostic {
        let span = Span::new(self.file, 0, self.name.len() as u32);
        let known = params.iter().map(|param| param.name.as_str());
        let diagnostic = unknown_name(codes::E0215, "param", &self.name, span, known.clone());
        let all: Vec<&str> = known.take(20).collect();
        match all.as_slice() {
            [] => diagnostic.help("this scene has no params"),
            all if diagnostic.fixes.is_empty() => {
                diagnostic.help(format!("there are {}", all.join(", ")))
            }
            _ => diagnostic,
        }
    }

    /// Whether this is for a parameter of this name.
    pub(crate) fn is_for(&self, name: &str) -> bool {
        self.name == name
    }
}

/// Whether an expression is a value and nothing to be computed.
fn is_literal(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Number(_) | ExprKind::Color(_) | ExprKind::Bool(_) => true,
        ExprKind::Unary(unary) => matches!(unary.operand.kind, ExprKind::Number(_)),
        ExprKind::List(items) => items.len() <= 4 && items.iter().all(is_literal),
        _ => false,
    }
}

impl<'a> Elaborator<'a> {
    /// `param name: type = value in a..b by step;`
    pub(crate) fn param(
        &mut self,
        here: &Here<'a>,
        param: &'a ast::Param,
        docs: Option<&str>,
        prefix: &str,
    ) -> Result<Value<'a>, Halt> {
        let name = format!("{prefix}{}", param.name.name);
        let span = param.name.span;
        let default = self.eval(here, &param.value)?;
        let range = match &param.range {
            Some(range) => match self.param_range(here, range)? {
                Some(range) => Some(range),
                None => return Ok(Value::Poison),
            },
            None => None,
        };
        let Some(kind) = self.param_kind(param, &default, range.as_ref()) else {
            return Ok(Value::Poison);
        };
        let Some(default) = self.param_value(kind, &default, param.value.span) else {
            return Ok(Value::Poison);
        };
        if let Some(other) = self.params.iter().find(|other| other.name == name) {
            let message = format!("there are two params `{name}`");
            let diagnostic =
                Diagnostic::error(codes::E0214, span, message).label(other.span, "the first one");
            self.report(diagnostic);
            return Ok(Value::Poison);
        }
        let mut declared = Param {
            name,
            doc: docs.unwrap_or_default().to_owned(),
            kind,
            value: default.clone(),
            default,
            range: range.as_ref().map(|range| (range.start, range.end)),
            inclusive: range.as_ref().is_none_or(|range| range.inclusive),
            step: range.as_ref().and_then(|range| range.step),
            structural: false,
            span,
        };
        if let Some(value) = declared
            .default
            .iter()
            .find(|value| !declared.allows(**value))
        {
            let message = format!(
                "the value of `{}` is {}, outside its range {}",
                declared.name,
                short(*value),
                declared.allowed()
            );
            let diagnostic = Diagnostic::error(codes::E0407, param.value.span, message);
            let written = param.range.as_ref().map_or(span, |range| range.span);
            let mut diagnostic = diagnostic.label(written, "the range");
            // A range with two dots ends before its last number.
            let is_end = range.is_some_and(|range| !range.inclusive && range.end == *value);
            if is_end && let Some(at) = self.sources.slice(written).find("..") {
                let at = written.start + at as u32 + 2;
                let behind = Span::new(written.file, at, at);
                diagnostic = diagnostic.fix(behind, "=", "with `..=` the range includes its end");
            }
            self.report(diagnostic);
            // What else is wrong is looked for with a number that is allowed: one far outside may ask for
            // a hundred thousand shapes.
            if let Some((lo, hi)) = declared.range {
                for value in &mut declared.value {
                    *value = value.max(lo).min(hi);
                }
            }
        }
        if let Some(value) = self.overridden(&declared)? {
            declared.value = value;
        }
        let at = self.params.len() as u32;
        declared.structural = self.structural.contains(&at);
        let value = self.param_number(&declared, ParamId(at));
        self.params.push(declared);
        Ok(value)
    }

    /// The numbers that a parameter is given from outside.
    fn overridden(&mut self, param: &Param) -> Result<Option<Vec<f64>>, Halt> {
        let overrides = self.overrides;
        // The last one counts, as on a command line.
        let Some(given) = overrides.iter().rev().find(|o| o.is_for(&param.name)) else {
            return Ok(None);
        };
        let wrong = |message: String| {
            Diagnostic::error(codes::E0407, param.span, message).label(given.span(), "given here")
        };
        let Some(expr) = given.value.as_ref().and_then(|file| file.result.as_ref()) else {
            let message = format!("`{}` is no value for `{}`", given.text, param.name);
            let help = format!("give {}", kind_example(param.kind));
            self.report(wrong(message).help(help));
            return Ok(None);
        };
        let here = Here {
            scope: Default::default(),
            module: self.root(),
            horizon: 0,
            blend: None,
        };
        let value = self.eval(&here, expr)?;
        let Some(numbers) = self.kind_numbers(param.kind, &value) else {
            let got = self.describe(&value);
            let noun = kind_noun(param.kind);
            let message = format!("`{}` is {noun}, and `{}` is {got}", param.name, given.text);
            let help = format!("give {}", kind_example(param.kind));
            self.report(wrong(message).help(help));
            return Ok(None);
        };
        if param.kind == ParamKind::Int && numbers.iter().any(|n| n.fract() != 0.0) {
            let message = format!(
                "`{}` is a whole number, and `{}` is not",
                param.name, given.text
            );
            self.report(wrong(message));
            return Ok(None);
        }
        if numbers.iter().any(|&n| !param.allows(n)) {
            let message = format!(
                "`{}` is outside the range of `{}`, {}",
                given.text,
                param.name,
                param.allowed()
            );
            self.report(wrong(message));
            return Ok(None);
        }
        Ok(Some(numbers))
    }

    fn param_kind(
        &mut self,
        param: &ast::Param,
        default: &Value<'a>,
        range: Option<&RangeOf>,
    ) -> Option<ParamKind> {
        if let Some(annotation) = &param.annotation {
            let kind = match self.type_of(annotation)? {
                Type::Float => ParamKind::Float,
                Type::Int => ParamKind::Int,
                Type::Bool => ParamKind::Bool,
                Type::Length => ParamKind::Length,
                Type::Angle => ParamKind::Angle,
                Type::Time => ParamKind::Time,
                Type::Color => ParamKind::Color,
                Type::Vec2 => ParamKind::Vec2,
                Type::Vec3 => ParamKind::Vec3,
                Type::Text
                | Type::Vec4
                | Type::Shape2
                | Type::Shape3
                | Type::Shape
                | Type::Material
                | Type::List
                | Type::Function => {
                    let message = format!("a param cannot be of the type `{}`", annotation.name);
                    let help = "a param is a number, a vec2 or vec3, a bool or a color";
                    let diagnostic = Diagnostic::error(codes::E0301, annotation.span, message);
                    self.report(diagnostic.help(help));
                    return None;
                }
            };
            return Some(kind);
        }
        let kind = match default {
            Value::Number(number) => match number.quantity {
                // Without a range, `2` may become 2.5; a range of whole numbers says that it may not.
                Quantity::Plain if number.whole && range.is_some_and(|r| r.whole) => ParamKind::Int,
                Quantity::Plain => range
                    .and_then(|r| quantity_kind(r.quantity))
                    .unwrap_or(ParamKind::Float),
                quantity => quantity_kind(quantity)?,
            },
            Value::Bool(_) => ParamKind::Bool,
            Value::Color(_) => ParamKind::Color,
            Value::Vector(vector) if vector.len() == 2 => ParamKind::Vec2,
            Value::Vector(vector) if vector.len() == 3 => ParamKind::Vec3,
            other => {
                let wanted = "a param is a number, a vec2 or vec3, a bool or a color";
                self.wrong(other, wanted, param.value.span);
                return None;
            }
        };
        Some(kind)
    }

    /// The numbers of a parameter's default; reports one that does not fit.
    fn param_value(&mut self, kind: ParamKind, value: &Value<'a>, span: Span) -> Option<Vec<f64>> {
        if value.is_poison() {
            return None;
        }
        let Some(numbers) = self.kind_numbers(kind, value) else {
            let got = self.describe(value);
            let message = format!("this param is {}, and this is {got}", kind_noun(kind));
            let diagnostic = Diagnostic::error(codes::E0301, span, message);
            self.report(diagnostic);
            return None;
        };
        if kind == ParamKind::Int
            && let Some(value) = numbers.iter().find(|n| n.fract() != 0.0)
        {
            self.not_whole("this param", *value, span);
            return None;
        }
        Some(numbers)
    }

    /// The numbers of a value of a kind; they must be known while compiling.
    fn kind_numbers(&mut self, kind: ParamKind, value: &Value<'a>) -> Option<Vec<f64>> {
        let ids: Vec<ExprId> = match (kind, value) {
            (ParamKind::Bool, Value::Bool(id)) => vec![*id],
            (ParamKind::Color, value) => self.as_color(value)?.to_vec(),
            (ParamKind::Vec2 | ParamKind::Vec3, value) => {
                let width = if kind == ParamKind::Vec2 { 2 } else { 3 };
                match parts(value)? {
                    (Form::Vector(len), numbers) if len == width => {
                        numbers[..len].iter().map(|number| number.id).collect()
                    }
                    _ => return None,
                }
            }
            (_, Value::Number(number)) => {
                let fits = match kind {
                    ParamKind::Angle => number.quantity == Quantity::Angle,
                    ParamKind::Length => {
                        matches!(number.quantity, Quantity::Plain | Quantity::Length(1))
                    }
                    ParamKind::Time => matches!(number.quantity, Quantity::Plain | Quantity::Time),
                    ParamKind::Bool => false,
                    _ => number.quantity == Quantity::Plain,
                };
                if !fits {
                    return None;
                }
                vec![number.id]
            }
            _ => return None,
        };
        let what = Demand::new("the value of a param", Span::default());
        ids.into_iter().map(|id| self.demand(id, &what)).collect()
    }

    fn param_range(
        &mut self,
        here: &Here<'a>,
        range: &'a ast::ParamRange,
    ) -> Result<Option<RangeOf>, Halt> {
        let mut bounds = Vec::new();
        for expr in [Some(&range.start), Some(&range.end), range.step.as_ref()]
            .into_iter()
            .flatten()
        {
            let Value::Number(number) = self.eval(here, expr)? else {
                let message = "the range of a param is made of numbers";
                self.report(Diagnostic::error(codes::E0301, expr.span, message));
                return Ok(None);
            };
            let Some(value) =
                self.demand(number.id, &Demand::new("the range of a param", expr.span))
            else {
                return Ok(None);
            };
            bounds.push((number, value, expr.span));
        }
        let quantity = bounds
            .iter()
            .try_fold(Quantity::Plain, |q, (n, ..)| q.sum(n.quantity));
        let Some(quantity) = quantity else {
            let message = "the ends of this range are of different kinds";
            self.report(Diagnostic::error(codes::E0303, range.span, message));
            return Ok(None);
        };
        let (start, end) = (bounds[0].1, bounds[1].1);
        let step = bounds.get(2).map(|(_, step, _)| *step);
        if start > end || start == end && !range.inclusive {
            let message = format!("the range from {} to {} is empty", short(start), short(end));
            self.report(Diagnostic::error(codes::E0407, range.span, message));
            return Ok(None);
        }
        if let Some((_, step, span)) = bounds.get(2)
            && *step <= 0.0
        {
            let message = format!("a step is larger than 0, and this is {}", short(*step));
            self.report(Diagnostic::error(codes::E0401, *span, message));
            return Ok(None);
        }
        let whole = bounds.iter().all(|(number, ..)| number.whole);
        Ok(Some(RangeOf {
            start,
            end,
            inclusive: range.inclusive,
            step,
            quantity,
            whole,
        }))
    }

    /// What a parameter is in expressions.
    fn param_number(&mut self, param: &Param, id: ParamId) -> Value<'a> {
        let component = |e: &mut Self, at: usize| match param.structural {
            true => e.graph.constant(param.value[at]),
            false => e.graph.param(id, at as u8),
        };
        let quantity = match param.kind {
            ParamKind::Length => Quantity::Length(1),
            ParamKind::Angle => Quantity::Angle,
            ParamKind::Time => Quantity::Time,
            _ => Quantity::Plain,
        };
        match param.kind {
            ParamKind::Bool => Value::Bool(component(self, 0)),
            ParamKind::Color => Value::Color([0, 1, 2].map(|at| component(self, at))),
            ParamKind::Vec2 | ParamKind::Vec3 => {
                let numbers: Vec<Number> = (0..param.value.len())
                    .map(|at| Number::plain(component(self, at)))
                    .collect();
                Vector::from_slice(&numbers).map_or(Value::Poison, Value::Vector)
            }
            _ => {
                let whole = param.kind == ParamKind::Int;
                Value::Number(Number {
                    id: component(self, 0),
                    quantity,
                    whole,
                })
            }
        }
    }
}

/// The range of a parameter, evaluated.
struct RangeOf {
    start: f64,
    end: f64,
    inclusive: bool,
    step: Option<f64>,
    quantity: Quantity,
    whole: bool,
}

impl Param {
    /// Whether a value lies in the range.
    pub fn allows(&self, value: f64) -> bool {
        let Some((low, high)) = self.range else {
            return value.is_finite();
        };
        value >= low
            && if self.inclusive {
                value <= high
            } else {
                value < high || value == low
            }
    }

    /// The range in words, in the units that are written in a scene.
    pub fn allowed(&self) -> String {
        let Some((low, high)) = self.range else {
            return "any number".to_owned();
        };
        let (low, high) = match self.kind {
            ParamKind::Angle => (low.to_degrees(), high.to_degrees()),
            _ => (low, high),
        };
        let unit = if self.kind == ParamKind::Angle {
            "deg"
        } else {
            ""
        };
        let dots = if self.inclusive { "..=" } else { ".." };
        format!("{}{unit}{dots}{}{unit}", short(low), short(high))
    }
}

fn quantity_kind(quantity: Quantity) -> Option<ParamKind> {
    match quantity {
        Quantity::Plain => None,
        Quantity::Length(_) => Some(ParamKind::Length),
        Quantity::Angle => Some(ParamKind::Angle),
        Quantity::Time => Some(ParamKind::Time),
    }
}

fn kind_noun(kind: ParamKind) -> &'static str {
    match kind {
        ParamKind::Float => "a number",
        ParamKind::Int => "a whole number",
        ParamKind::Bool => "true or false",
        ParamKind::Length => "a length",
        ParamKind::Angle => "an angle",
        ParamKind::Time => "a time",
        ParamKind::Color => "a color",
        ParamKind::Vec2 => "a vec2",
        ParamKind::Vec3 => "a vec3",
    }
}

fn kind_example(kind: ParamKind) -> &'static str {
    match kind {
        ParamKind::Float => "a number such as `0.4`",
        ParamKind::Int => "a whole number such as `7`",
        ParamKind::Bool => "`true` or `false`",
        ParamKind::Length => "a length such as `0.4` or `12mm`",
        ParamKind::Angle => "an angle such as `30deg`",
        ParamKind::Time => "a time such as `1.5s`",
        ParamKind::Color => "a color such as `#3aa6ff`",
        ParamKind::Vec2 => "a vec2 such as `[1, 2]`",
        ParamKind::Vec3 => "a vec3 such as `[1, 2, 3]`",
    }
}
