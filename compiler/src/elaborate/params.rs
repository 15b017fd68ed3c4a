//! Parameters: kinds, ranges and overrides. In expressions, a structural parameter is a constant;
//! any other is a live number.

use super::Elaborator;
use super::annotation::AnnotatedType;
use super::constness::Demand;
use super::diagnose::unknown_name;
use super::display::format_short;
use super::numbers::{Form, components};
use super::value::{Abort, Env, Quantity, ScalarValue, Value, Vector};
use crate::expression::{ExprId, ParamId};
use crate::scene::{ParamKind, SceneParam};
use sdfc_lang::ast::{self, Expr, ExprKind};
use sdfc_lang::{Diagnostic, FileId, Sources, Span, codes, parse};

/// Value of a parameter passed from outside.
#[derive(Debug)]
pub(crate) struct Override {
    name: String,
    text: String,
    /// The text as a file of its own, as a target for messages.
    file: FileId,
    /// The parsed value, if the text is a literal.
    value: Option<ast::File>,
}

impl Override {
    /// Parses `name=text`.
    pub(crate) fn parse(sources: &mut Sources, name: &str, text: &str) -> Self {
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

    /// Describes an override of a parameter that does not exist.
    pub(crate) fn unknown_param(&self, params: &[SceneParam]) -> Diagnostic {
        let span = Span::new(self.file, 0, self.name.len() as u32);
        let names = params.iter().map(|param| param.name.as_str());
        let diagnostic = unknown_name(codes::E0215, "param", &self.name, span, names.clone());
        let listed: Vec<&str> = names.take(20).collect();
        match listed.as_slice() {
            [] => diagnostic.help("this scene has no params"),
            listed if diagnostic.fixes.is_empty() => {
                diagnostic.help(format!("there are {}", listed.join(", ")))
            }
            _ => diagnostic,
        }
    }

    /// Reports whether this overrides the parameter of this name.
    pub(crate) fn is_for(&self, name: &str) -> bool {
        self.name == name
    }
}

/// Reports whether an expression is a literal.
fn is_literal(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Number(_) | ExprKind::Color(_) | ExprKind::Bool(_) => true,
        ExprKind::Unary(unary) => matches!(unary.operand.kind, ExprKind::Number(_)),
        ExprKind::List(items) => items.len() <= 4 && items.iter().all(is_literal),
        _ => false,
    }
}

impl<'a> Elaborator<'a> {
    /// Evaluates the definition `param name: type = value in a..b by step;`.
    pub(crate) fn param(
        &mut self,
        env: &Env<'a>,
        param: &'a ast::ParamDefinition,
        docs: Option<&str>,
        prefix: &str,
    ) -> Result<Value<'a>, Abort> {
        let name = format!("{prefix}{}", param.name.name);
        let span = param.name.span;
        let default = self.eval(env, &param.value)?;
        let range = match &param.range {
            Some(range) => match self.param_range(env, range)? {
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
        if let Some(&first) = self.param_indices.get(&name) {
            let message = format!("there are two params `{name}`");
            let diagnostic = Diagnostic::error(codes::E0214, span, message)
                .label(self.params[first].span, "the first one");
            self.report(diagnostic);
            return Ok(Value::Poison);
        }
        let mut declared = SceneParam {
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
                format_short(*value),
                declared.allowed()
            );
            let diagnostic = Diagnostic::error(codes::E0407, param.value.span, message);
            let range_span = param.range.as_ref().map_or(span, |range| range.span);
            let mut diagnostic = diagnostic.label(range_span, "the range");
            // A range with two dots excludes its last number.
            let is_end = range.is_some_and(|range| !range.inclusive && range.end == *value);
            if is_end && let Some(dots) = self.sources.slice(range_span).find("..") {
                let dots = range_span.start + dots as u32 + 2;
                let after_dots = Span::new(range_span.file, dots, dots);
                diagnostic =
                    diagnostic.fix(after_dots, "=", "with `..=` the range includes its end");
            }
            self.report(diagnostic);
            // Evaluation continues with an allowed value: a value far outside the range may result
            // in a hundred thousand shapes.
            if let Some((lo, hi)) = declared.range {
                for value in &mut declared.value {
                    *value = value.max(lo).min(hi);
                }
            }
        }
        if let Some(value) = self.override_value(&declared, param)? {
            declared.value = value;
        }
        let param_index = self.params.len() as u32;
        declared.structural = self.structural.contains(&param_index);
        let value = self.param_as_value(&declared, ParamId(param_index));
        self.param_indices
            .insert(declared.name.clone(), self.params.len());
        self.params.push(declared);
        Ok(value)
    }

    /// Returns the numbers of a parameter that is overridden from outside; `None` if it is not.
    fn override_value(
        &mut self,
        param: &SceneParam,
        definition: &ast::ParamDefinition,
    ) -> Result<Option<Vec<f64>>, Abort> {
        let overrides = self.overrides;
        // The last override takes effect, as on a command line.
        let Some(override_) = overrides.iter().rev().find(|o| o.is_for(&param.name)) else {
            return Ok(None);
        };
        let range_error = |message: String| {
            Diagnostic::error(codes::E0407, param.span, message)
                .label(override_.span(), "given here")
        };
        let Some(expr) = override_
            .value
            .as_ref()
            .and_then(|file| file.result.as_ref())
        else {
            let message = format!("`{}` is not a value for `{}`", override_.text, param.name);
            let help = format!("give {}", kind_example(param.kind));
            self.report(range_error(message).help(help));
            return Ok(None);
        };
        let env = Env {
            scope: Default::default(),
            module: self.root(),
            visible_items: 0,
            blend: None,
        };
        let value = self.eval(&env, expr)?;
        let Some(numbers) = self.kind_numbers(param.kind, &value) else {
            let description = self.describe(&value);
            let noun = kind_noun(param.kind);
            let message = format!(
                "`{}` is {noun}, and `{}` is {description}",
                param.name, override_.text
            );
            let help = format!("give {}", kind_example(param.kind));
            self.report(range_error(message).help(help));
            return Ok(None);
        };
        if param.kind == ParamKind::Int && numbers.iter().any(|n| n.fract() != 0.0) {
            let message = format!(
                "`{}` is a whole number, and `{}` is not",
                param.name, override_.text
            );
            let (low, high) = param.range.unwrap_or((f64::MIN, f64::MAX));
            let example = numbers[0].round().max(low).min(high);
            let candidates = [example, numbers[0].floor(), numbers[0].ceil()];
            let allowed = candidates.into_iter().find(|&v| param.allows(v));
            let help = match allowed {
                Some(example) => format!("give a whole number such as `{}`", format_short(example)),
                None => "give a whole number".to_owned(),
            };
            let diagnostic = range_error(message).help(help);
            self.report(allow_fractions(diagnostic, definition));
            return Ok(None);
        }
        if numbers.iter().any(|&n| !param.allows(n)) {
            let message = format!(
                "`{}` is outside the range of `{}`, {}",
                override_.text,
                param.name,
                param.allowed()
            );
            self.report(range_error(message));
            return Ok(None);
        }
        Ok(Some(numbers))
    }

    fn param_kind(
        &mut self,
        param: &ast::ParamDefinition,
        default: &Value<'a>,
        range: Option<&EvaluatedRange>,
    ) -> Option<ParamKind> {
        if let Some(annotation) = &param.annotation {
            let kind = match self.resolve_type(annotation)? {
                AnnotatedType::Float => ParamKind::Float,
                AnnotatedType::Int => ParamKind::Int,
                AnnotatedType::Bool => ParamKind::Bool,
                AnnotatedType::Length => ParamKind::Length,
                AnnotatedType::Angle => ParamKind::Angle,
                AnnotatedType::Time => ParamKind::Time,
                AnnotatedType::Color => ParamKind::Color,
                AnnotatedType::Vec2 => ParamKind::Vec2,
                AnnotatedType::Vec3 => ParamKind::Vec3,
                AnnotatedType::Text
                | AnnotatedType::Vec4
                | AnnotatedType::Shape2
                | AnnotatedType::Shape3
                | AnnotatedType::Shape
                | AnnotatedType::Material
                | AnnotatedType::List
                | AnnotatedType::Function => {
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
                // Without a range, `2` may become 2.5; a range of integers excludes that.
                Quantity::Plain if number.is_integer && range.is_some_and(|r| r.is_integer) => {
                    ParamKind::Int
                }
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
                let message = "a param is a number, a vec2 or vec3, a bool or a color";
                self.report_wrong(other, message, param.value.span);
                return None;
            }
        };
        Some(kind)
    }

    /// Returns the numbers of a parameter's default; reports a value that does not fit.
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
            self.report_not_integer("this param", *value, span);
            return None;
        }
        Some(numbers)
    }

    /// Returns the numbers of a value of a kind, at compile time; `None` if the value is of another kind.
    fn kind_numbers(&mut self, kind: ParamKind, value: &Value<'a>) -> Option<Vec<f64>> {
        let ids: Vec<ExprId> = match (kind, value) {
            (ParamKind::Bool, Value::Bool(id)) => vec![*id],
            (ParamKind::Color, value) => self.as_color(value)?.to_vec(),
            (ParamKind::Vec2 | ParamKind::Vec3, value) => {
                let width = if kind == ParamKind::Vec2 { 2 } else { 3 };
                match components(value)? {
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
        env: &Env<'a>,
        range: &'a ast::ParamRange,
    ) -> Result<Option<EvaluatedRange>, Abort> {
        let mut bounds = Vec::new();
        for expr in [Some(&range.start), Some(&range.end), range.step.as_ref()]
            .into_iter()
            .flatten()
        {
            let Value::Number(number) = self.eval(env, expr)? else {
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
            let message = format!(
                "the range from {} to {} is empty",
                format_short(start),
                format_short(end)
            );
            self.report(Diagnostic::error(codes::E0407, range.span, message));
            return Ok(None);
        }
        if let Some((_, step, span)) = bounds.get(2)
            && *step <= 0.0
        {
            let message = format!(
                "a step is larger than 0, and this is {}",
                format_short(*step)
            );
            self.report(Diagnostic::error(codes::E0401, *span, message));
            return Ok(None);
        }
        let is_integer = bounds.iter().all(|(number, ..)| number.is_integer);
        Ok(Some(EvaluatedRange {
            start,
            end,
            inclusive: range.inclusive,
            step,
            quantity,
            is_integer,
        }))
    }

    /// Returns the value that represents a parameter in expressions: constants if it is structural, live numbers
    /// otherwise.
    fn param_as_value(&mut self, param: &SceneParam, id: ParamId) -> Value<'a> {
        let component = |e: &mut Self, index: usize| match param.structural {
            true => e.expressions.constant(param.value[index]),
            false => e.expressions.param(id, index as u8),
        };
        let quantity = match param.kind {
            ParamKind::Length => Quantity::Length(1),
            ParamKind::Angle => Quantity::Angle,
            ParamKind::Time => Quantity::Time,
            _ => Quantity::Plain,
        };
        match param.kind {
            ParamKind::Bool => Value::Bool(component(self, 0)),
            ParamKind::Color => Value::Color([0, 1, 2].map(|index| component(self, index))),
            ParamKind::Vec2 | ParamKind::Vec3 => {
                let numbers: Vec<ScalarValue> = (0..param.value.len())
                    .map(|index| ScalarValue::plain(component(self, index)))
                    .collect();
                Vector::from_slice(&numbers).map_or(Value::Poison, Value::Vector)
            }
            _ => {
                let is_integer = param.kind == ParamKind::Int;
                Value::Number(ScalarValue {
                    id: component(self, 0),
                    quantity,
                    is_integer,
                })
            }
        }
    }
}

/// Evaluated range of a parameter.
struct EvaluatedRange {
    start: f64,
    end: f64,
    inclusive: bool,
    step: Option<f64>,
    quantity: Quantity,
    is_integer: bool,
}

impl SceneParam {
    /// Reports whether a value lies in the range.
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

    /// Formats the range in the units of the scene language, such as `0deg..90deg`, or `any number`.
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
        format!(
            "{}{unit}{dots}{}{unit}",
            format_short(low),
            format_short(high)
        )
    }
}

/// Adds the change of a definition after which a parameter of whole numbers accepts fractions.
fn allow_fractions(diagnostic: Diagnostic, definition: &ast::ParamDefinition) -> Diagnostic {
    let text = "or let the param have fractions";
    match &definition.annotation {
        Some(annotation) => diagnostic.fix(annotation.span, "float", text),
        None if matches!(definition.value.kind, ExprKind::Number(_)) => {
            diagnostic.fix(definition.value.span.at_end(), ".0", text)
        }
        None => {
            diagnostic.help("a param without fractions has a value and a range of whole numbers")
        }
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
