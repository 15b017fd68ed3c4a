//! Matching of a call's arguments to the parameters of a built-in function.
//!
//! Positional arguments come first. A vector is passed as a vector or as consecutive numbers; a
//! size also as one number for all sides. A radius is also accepted as a diameter, under the name
//! with `d` for `r`. Among the variants of a function, the first that fits takes the call.

use super::diagnose::{self, nearest};
use super::value::Value;
use sdfc_lang::ast::{Expr, ExprKind, Ident};
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::row::ArgumentKind;

/// Kind of value that a parameter of a built-in function takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ExpectedKind {
    /// Numbers, with the rules of the operation table.
    Row(ArgumentKind),
    /// Three factors other than zero, or one for all axes.
    Factors,
    /// A shape, or a list of shapes.
    Shape,
    /// A 2-D shape.
    Shape2,
    /// A 3-D shape.
    Shape3,
    /// A function.
    Function,
    /// A material, or a colour.
    Material,
    /// A list or a range.
    List,
    /// A value of any kind.
    Any,
}

impl ExpectedKind {
    /// Returns the number of components, 0 for kinds that are not numbers. For a 2-D shape, vectors have two.
    pub(crate) fn width(self, is_2d: bool) -> usize {
        match self {
            ExpectedKind::Row(kind) if kind.width() == 3 && is_2d => 2,
            ExpectedKind::Row(kind) => kind.width(),
            ExpectedKind::Factors if is_2d => 2,
            ExpectedKind::Factors => 3,
            ExpectedKind::Shape
            | ExpectedKind::Shape2
            | ExpectedKind::Shape3
            | ExpectedKind::Function
            | ExpectedKind::Material
            | ExpectedKind::List
            | ExpectedKind::Any => 0,
        }
    }
    /// Reports whether one number may stand for all components.
    pub(crate) fn accepts_scalar(self) -> bool {
        use ArgumentKind as A;
        matches!(
            self,
            ExpectedKind::Factors
                | ExpectedKind::Row(A::Size3 | A::Size2 | A::Radii3 | A::Lengths3 | A::Counts3)
        )
    }
    fn is_radius(self) -> bool {
        matches!(
            self,
            ExpectedKind::Row(ArgumentKind::Radius | ArgumentKind::RadiusOrZero)
        )
    }
    fn is_shape(self) -> bool {
        matches!(
            self,
            ExpectedKind::Shape | ExpectedKind::Shape2 | ExpectedKind::Shape3
        )
    }
}

/// A parameter of a built-in function.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ParamSpec {
    /// Name in a call.
    pub(crate) name: &'static str,
    /// Kind of value.
    pub(crate) kind: ExpectedKind,
    /// Numbers of an argument that is left out; `None` if the argument is required. Empty if the
    /// function itself decides.
    pub(crate) default: Option<&'static [f64]>,
}

/// Describes a required parameter.
pub(crate) const fn required(name: &'static str, kind: ExpectedKind) -> ParamSpec {
    ParamSpec {
        name,
        kind,
        default: None,
    }
}

/// Describes a parameter that a call may leave out.
pub(crate) const fn optional(
    name: &'static str,
    kind: ExpectedKind,
    default: &'static [f64],
) -> ParamSpec {
    ParamSpec {
        name,
        kind,
        default: Some(default),
    }
}

/// Arguments that accept a bare word, such as the name of a kernel.
pub(crate) const WORD_ARGUMENTS: [&str; 1] = ["kernel"];

/// Returns the identifier, if the expression consists of nothing else.
pub(crate) fn word(expr: &Expr) -> Option<&Ident> {
    match &expr.kind {
        ExprKind::Path(path) => path.as_ident(),
        _ => None,
    }
}

/// An argument as it was passed.
#[derive(Clone, Debug)]
pub(crate) struct PassedArg<'a> {
    /// Name, if one was written.
    pub(crate) name: Option<&'a Ident>,
    /// Value of the argument's expression.
    pub(crate) value: Value<'a>,
    /// Span of the argument, without its name.
    pub(crate) span: Span,
}

/// A call with its arguments evaluated.
#[derive(Clone, Debug)]
pub(crate) struct Invocation<'a> {
    /// Name of the callee.
    pub(crate) name: &'a str,
    /// Span of the name.
    pub(crate) name_span: Span,
    /// Span of the entire call.
    pub(crate) span: Span,
    /// The arguments, the object of a method first.
    pub(crate) args: Vec<PassedArg<'a>>,
}

/// Source of a parameter's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ArgSlot {
    /// The argument is left out.
    Default,
    /// One argument, by index.
    Single(usize),
    /// One argument, by index, which is the diameter.
    Diameter(usize),
    /// Consecutive arguments, one for each component, from this index on.
    Components(usize),
}

/// Returns the indices of the arguments that a parameter takes.
pub(crate) fn arg_indices(slot: ArgSlot, width: usize) -> std::ops::Range<usize> {
    match slot {
        ArgSlot::Default => 0..0,
        ArgSlot::Single(index) | ArgSlot::Diameter(index) => index..index + 1,
        ArgSlot::Components(index) => index..index + width,
    }
}

/// Mismatch between a call and a parameter list; fields are indices of arguments and parameters.
#[derive(Clone, Copy, Debug)]
pub(crate) enum ArgError {
    UnknownName {
        arg: usize,
    },
    Twice {
        arg: usize,
    },
    TooMany {
        arg: usize,
    },
    WrongShape {
        arg: usize,
        param: usize,
    },
    PartOfVector {
        arg: usize,
        param: usize,
        count: usize,
    },
    Missing {
        param: usize,
    },
}

impl ArgError {
    /// Returns the progress of the match before it failed: larger is closer to a match.
    fn match_rank(self) -> u32 {
        match self {
            ArgError::UnknownName { .. } => 0,
            ArgError::Twice { .. } => 1,
            ArgError::TooMany { .. } => 2,
            ArgError::WrongShape { .. } => 3,
            ArgError::PartOfVector { .. } => 4,
            ArgError::Missing { .. } => 5,
        }
    }
}

/// Matches a call to a parameter list.
pub(crate) fn match_args(
    params: &[ParamSpec],
    args: &[PassedArg<'_>],
    is_2d: bool,
) -> Result<Vec<ArgSlot>, ArgError> {
    let mut slots = vec![ArgSlot::Default; params.len()];
    let mut next = 0;
    let mut index = 0;
    while index < args.len() && args[index].name.is_none() {
        let Some(param) = params.get(next) else {
            return Err(ArgError::TooMany { arg: index });
        };
        let width = param.kind.width(is_2d);
        let mut used = 1;
        slots[next] = ArgSlot::Single(index);
        if width > 1 && is_number(&args[index].value) {
            let run = args[index..]
                .iter()
                .take_while(|g| g.name.is_none() && is_number(&g.value));
            let count = run.count();
            if count >= width {
                used = width;
                slots[next] = ArgSlot::Components(index);
            } else if count > 1 || !param.kind.accepts_scalar() {
                return Err(ArgError::PartOfVector {
                    arg: index,
                    param: next,
                    count,
                });
            }
        } else if !may_accept(param.kind, &args[index].value) {
            return Err(ArgError::WrongShape {
                arg: index,
                param: next,
            });
        }
        index += used;
        next += 1;
    }
    for (index, argument) in args.iter().enumerate().skip(index) {
        let Some(name) = argument.name else { continue };
        let Some((param, slot)) = named_slot(params, &name.name, index) else {
            return Err(ArgError::UnknownName { arg: index });
        };
        if slots[param] != ArgSlot::Default {
            return Err(ArgError::Twice { arg: index });
        }
        if !may_accept(params[param].kind, &argument.value) {
            return Err(ArgError::WrongShape { arg: index, param });
        }
        slots[param] = slot;
    }
    match (0..params.len()).find(|&i| slots[i] == ArgSlot::Default && params[i].default.is_none()) {
        Some(param) => Err(ArgError::Missing { param }),
        None => Ok(slots),
    }
}

fn is_number(value: &Value<'_>) -> bool {
    matches!(value, Value::Number(_))
}

/// Reports whether the value may be meant for a parameter of this kind. The test is only as exact
/// as the choice between variants requires.
fn may_accept(kind: ExpectedKind, value: &Value<'_>) -> bool {
    let is_vector = matches!(value, Value::Vector(_) | Value::List(_));
    let is_shape = matches!(value, Value::Shape(_));
    match kind {
        ExpectedKind::Row(kind) if kind.width() == 1 => !is_vector && !is_shape,
        ExpectedKind::Row(_) | ExpectedKind::Factors => !is_shape,
        _ if kind.is_shape() => !is_number(value),
        _ => true,
    }
}

fn named_slot(params: &[ParamSpec], name: &str, index: usize) -> Option<(usize, ArgSlot)> {
    if let Some(param) = params.iter().position(|param| param.name == name) {
        return Some((param, ArgSlot::Single(index)));
    }
    let radius = radius_name(name)?;
    let is_radius_param = |param: &ParamSpec| param.kind.is_radius() && param.name == radius;
    Some((
        params.iter().position(is_radius_param)?,
        ArgSlot::Diameter(index),
    ))
}

/// Returns the name of the radius for the name of a diameter: `r1` for `d1`.
fn radius_name(name: &str) -> Option<String> {
    name.strip_prefix('d').map(|suffix| format!("r{suffix}"))
}

/// Returns the first variant that fits, or the closest mismatch.
pub(crate) fn choose_variant<'v>(
    variants: impl Iterator<Item = &'v [ParamSpec]>,
    args: &[PassedArg<'_>],
    is_2d: bool,
) -> Result<(usize, Vec<ArgSlot>), (usize, ArgError)> {
    let mut nearest: Option<(usize, ArgError)> = None;
    for (index, params) in variants.enumerate() {
        match match_args(params, args, is_2d) {
            Ok(slots) => return Ok((index, slots)),
            Err(error)
                if nearest
                    .is_none_or(|(_, previous)| previous.match_rank() < error.match_rank()) =>
            {
                nearest = Some((index, error));
            }
            Err(_) => {}
        }
    }
    Err(nearest.unwrap_or((0, ArgError::TooMany { arg: 0 })))
}

/// Adds advice to a mismatch for calls that other tools take.
pub(crate) fn with_advice(call: &Invocation<'_>, diagnostic: Diagnostic) -> Diagnostic {
    let has = |is_kind: fn(&Value<'_>) -> bool| call.args.iter().any(|arg| is_kind(&arg.value));
    match call.name {
        "rotate" if has(|value| matches!(value, Value::Vector(_))) => {
            diagnostic.help("the angle comes first: `rotate(35deg, X)`")
        }
        "at" if has(|value| matches!(value, Value::Shape(_))) => diagnostic.fix(
            call.name_span,
            "translate",
            "`at` takes an element of a list; a shape is moved by `translate`",
        ),
        _ => diagnostic,
    }
}

/// Describes a call that fits no variant of a function; the variant at `best_variant` is the closest.
pub(crate) fn mismatch_diagnostic(
    call: &Invocation<'_>,
    lists: &[&[ParamSpec]],
    best_variant: usize,
    error: ArgError,
    is_2d: bool,
    describe: impl Fn(&Value<'_>) -> String,
) -> Diagnostic {
    let name = call.name;
    let params = lists.get(best_variant).copied().unwrap_or_default();
    let signature_text = signature(params);
    let mut names: Vec<&str> = lists
        .iter()
        .flat_map(|list| list.iter().map(|f| f.name))
        .collect();
    names.dedup();
    let written_names = || call.args.iter().filter_map(|arg| arg.name);
    // The variant that most of the written names fit; of several, the longest one.
    let matching_names = |list: &[ParamSpec]| {
        written_names()
            .filter(|ident| named_slot(list, &ident.name, 0).is_some())
            .count()
    };
    let most_similar_signature = lists
        .iter()
        .max_by_key(|list| (matching_names(list), list.len()))
        .map_or("".into(), |l| signature(l));
    match error {
        ArgError::UnknownName { arg } => {
            names.retain(|name| written_names().all(|ident| ident.name != *name));
            unknown_argument(call, arg, most_similar_signature, &names)
        }
        ArgError::Twice { arg } => {
            let argument = &call.args[arg];
            let written = argument.name.map_or("", |ident| ident.name.as_str());
            let message = match params.iter().any(|param| param.name == written) {
                true => format!("`{written}` is given twice"),
                false => {
                    let radius = radius_name(written).unwrap_or_default();
                    format!("`{radius}` is given twice, as a radius and as a diameter")
                }
            };
            Diagnostic::error(codes::E0206, argument.span, message)
                .label(call.name_span, signature_text)
        }
        ArgError::TooMany { arg } => {
            let message = format!(
                "`{name}` takes no more than {}",
                count_noun(params.len(), "argument")
            );
            Diagnostic::error(codes::E0205, call.args[arg].span, message)
                .primary("one too many")
                .label(call.name_span, signature_text)
        }
        ArgError::WrongShape { arg, param } => {
            let param = &params[param];
            let diagnostic = wrong_type(
                call,
                param.name,
                kind_noun(param.kind, is_2d),
                &describe(&call.args[arg].value),
                call.args[arg].span,
            );
            match param.kind.is_shape() {
                true => diagnostic.help(format!("write `shape.{name}(..)`")),
                false => diagnostic,
            }
        }
        ArgError::PartOfVector {
            arg,
            param,
            count: numbers,
        } => {
            let next = params.get(param + 1);
            let param = &params[param];
            let width = param.kind.width(is_2d);
            let second = call.args[arg + numbers - 1].span;
            let span = call.args[arg].span.to(second);
            let one_number = if param.kind.accepts_scalar() {
                "one number, "
            } else {
                ""
            };
            let message = format!(
                "`{}` of `{name}` is {one_number}{width} numbers or a vector, and this is {}",
                param.name,
                count_noun(numbers, "number"),
            );
            let diagnostic = Diagnostic::error(codes::E0311, span, message)
                .label(call.name_span, signature_text);
            // Of two numbers, the second was probably meant for the next parameter.
            match next.filter(|next| next.default.is_none_or(<[f64]>::is_empty)) {
                Some(next) if numbers == 2 && param.kind.accepts_scalar() => diagnostic.fix(
                    second.at_start(),
                    format!("{}: ", next.name),
                    format!(
                        "one number is the {} on all sides; the next argument needs its name",
                        param.name
                    ),
                ),
                _ => diagnostic,
            }
        }
        ArgError::Missing { param } => {
            let param = &params[param];
            let or = match param.kind.is_radius() && param.name.starts_with('r') {
                true => format!(" (or `d{}`)", &param.name[1..]),
                false => String::new(),
            };
            let message = format!("`{name}` needs `{}`{or}", param.name);
            let diagnostic =
                Diagnostic::error(codes::E0204, call.name_span, message).primary(signature_text);
            match param.kind.is_shape() {
                true => diagnostic.help(format!("write `shape.{name}(..)`")),
                false => diagnostic,
            }
        }
    }
}

/// Builds the diagnostic for an argument of an unknown name. `names` are those of the arguments that are left out.
fn unknown_argument(
    call: &Invocation<'_>,
    arg: usize,
    signature: String,
    names: &[&str],
) -> Diagnostic {
    let argument = &call.args[arg];
    let (written, span) = match argument.name {
        Some(ident) => (ident.name.as_str(), ident.span),
        None => ("", argument.span),
    };
    let message = format!("`{}` has no argument `{written}`", call.name);
    let diagnostic =
        Diagnostic::error(codes::E0203, span, message).label(call.name_span, signature);
    let has = |radius: &str, diameter: &str| {
        let names = call.args.iter().filter_map(|passed| passed.name);
        let mut names = names.map(|ident| ident.name.as_str());
        names.any(|name| name == radius || name == diameter)
    };
    if call.name == "cylinder" && has("r1", "d1") && has("r2", "d2") {
        let text = "with two radii, it is a `cone`";
        return diagnostic.fix(call.name_span, "cone", text);
    }
    if written == "center" && matches!(argument.value, Value::Bool(_)) {
        let text =
            "shapes are centred at the origin: leave it out, or move the shape by `translate`";
        return diagnostic.fix(removed_argument(call, arg, span), "", text);
    }
    let synonym = match written {
        "radius" => "r",
        "diameter" => "d",
        "height" => "h",
        "dimensions" | "dims" => "size",
        "slope" | "bound" => "lipschitz",
        "bounds" | "region" | "extent" => "within",
        _ => "",
    };
    let radius = radius_name(synonym).unwrap_or_default();
    let has_synonym = names.iter().any(|name| [synonym, &radius].contains(name));
    let suggestion = match has_synonym {
        true => Some(synonym),
        false => nearest(written, names.iter().copied()),
    };
    diagnose::suggest(diagnostic, span, suggestion)
}

/// Returns the span of a named argument with the comma before it, or after it if it is the first one.
fn removed_argument(call: &Invocation<'_>, arg: usize, name: Span) -> Span {
    let end = call.args[arg].span;
    let is_in_brackets = |passed: &&PassedArg<'_>| passed.span.start > call.name_span.start;
    let previous = arg.checked_sub(1).map(|index| &call.args[index]);
    match (previous.filter(is_in_brackets), call.args.get(arg + 1)) {
        (Some(previous), _) => previous.span.at_end().to(end),
        (None, Some(next)) => {
            let start = next.name.map_or(next.span, |ident| ident.span);
            name.to(start.at_start())
        }
        (None, None) => name.to(end),
    }
}

/// Describes an argument of the wrong type.
pub(crate) fn wrong_type(
    call: &Invocation<'_>,
    param_name: &str,
    expected: &str,
    got: &str,
    span: Span,
) -> Diagnostic {
    let message = format!(
        "`{}` takes {expected} for `{param_name}`, and this is {got}",
        call.name
    );
    Diagnostic::error(codes::E0301, span, message).label(call.name_span, "")
}

/// Lists parameters as messages show them: `angle: angle, axis: direction`.
pub(crate) fn signature(params: &[ParamSpec]) -> String {
    let describe_param = |param: &ParamSpec| {
        let noun = match param.kind {
            ExpectedKind::Row(ArgumentKind::Size3) => "number or vec3",
            ExpectedKind::Row(ArgumentKind::Size2) => "number or vec2",
            ExpectedKind::Any if param.name == "angle" => "angle",
            kind => without_article(kind_noun(kind, false)),
        };
        let mark = if param.default.is_some() { "?" } else { "" };
        format!("{}{mark}: {noun}", param.name)
    };
    params
        .iter()
        .map(describe_param)
        .collect::<Vec<_>>()
        .join(", ")
}

/// Returns the kind in words, with its article.
pub(crate) fn kind_noun(kind: ExpectedKind, is_2d: bool) -> &'static str {
    use ArgumentKind as A;
    match kind {
        ExpectedKind::Row(A::Radius | A::RadiusOrZero) => "a radius",
        ExpectedKind::Row(A::Length | A::LengthOrZero | A::Offset) => "a length",
        ExpectedKind::Row(A::Size3 | A::Size2) => "a size",
        ExpectedKind::Row(A::Radii3) => "a number or a vector of radii",
        ExpectedKind::Row(A::Lengths3) => "a number or a vector of lengths",
        ExpectedKind::Row(A::Counts3) => "a count or a vector of counts",
        ExpectedKind::Row(A::Vec2) => "a vec2",
        ExpectedKind::Row(A::Vec3) if is_2d => "a vec2",
        ExpectedKind::Row(A::Vec3) => "a vec3",
        ExpectedKind::Row(A::Direction) => "a direction",
        ExpectedKind::Row(A::Angle) => "an angle",
        ExpectedKind::Row(A::Number) => "a number",
        ExpectedKind::Row(A::Count) => "a whole number",
        ExpectedKind::Factors => "a factor or a vector of factors",
        ExpectedKind::Shape => "a shape",
        ExpectedKind::Shape2 => "a 2D shape",
        ExpectedKind::Shape3 => "a 3D shape",
        ExpectedKind::Function => "a function",
        ExpectedKind::Material => "a material",
        ExpectedKind::List => "a list",
        ExpectedKind::Any => "a value",
    }
}

/// Removes the article of a noun.
pub(crate) fn without_article(noun: &str) -> &str {
    noun.strip_prefix("a ")
        .or_else(|| noun.strip_prefix("an "))
        .unwrap_or(noun)
}

/// Returns a count with its noun: `no shapes`, `1 shape`, `2 shapes`.
pub(crate) fn count_noun(number: usize, noun: &str) -> String {
    match number {
        0 => format!("no {noun}s"),
        1 => format!("1 {noun}"),
        _ => format!("{number} {noun}s"),
    }
}
