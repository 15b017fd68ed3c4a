//! Which argument of a call is which parameter of a function of the language.
//!
//! Positional arguments come first. A vector may be given as a vector or as that many numbers in a
//! row; a size also as one number for all sides; a radius also as a diameter, under the name with
//! `d` for `r`. A function may have variants: the first one that fits takes the call.

use super::diagnose::{self, nearest};
use super::value::Value;
use sdfc_lang::{Diagnostic, Span, ast, codes};
use sdfc_vm::row::ArgumentKind;

/// What a parameter of a function of the language takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Numbers, with the rules of the table.
    Row(ArgumentKind),
    /// Three factors that are not zero, or one for all sides.
    Factors,
    /// A shape, or a list of them.
    Shape,
    /// A figure in the plane.
    Figure,
    /// A solid.
    Solid,
    /// A function.
    Function,
    /// A material, or a colour.
    Material,
    /// A list or a range.
    List,
    /// Anything.
    Any,
}

impl Kind {
    /// How many numbers it is made of, if it is made of numbers; a figure has no third one.
    pub(crate) fn width(self, flat: bool) -> usize {
        match self {
            Kind::Row(kind) if kind.width() == 3 && flat => 2,
            Kind::Row(kind) => kind.width(),
            Kind::Factors if flat => 2,
            Kind::Factors => 3,
            Kind::Shape
            | Kind::Figure
            | Kind::Solid
            | Kind::Function
            | Kind::Material
            | Kind::List
            | Kind::Any => 0,
        }
    }
    /// Whether one number stands for all of them.
    pub(crate) fn spreads(self) -> bool {
        use ArgumentKind as A;
        matches!(
            self,
            Kind::Factors | Kind::Row(A::Size3 | A::Size2 | A::Radii3 | A::Lengths3 | A::Counts3)
        )
    }
    fn is_radius(self) -> bool {
        matches!(
            self,
            Kind::Row(ArgumentKind::Radius | ArgumentKind::RadiusOrZero)
        )
    }
    fn is_shape(self) -> bool {
        matches!(self, Kind::Shape | Kind::Figure | Kind::Solid)
    }
}

/// A parameter of a function of the language.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Formal {
    /// Its name in a call.
    pub(crate) name: &'static str,
    /// What it takes.
    pub(crate) kind: Kind,
    /// Whether a call may leave it out, and the numbers it has then; none if the function decides.
    pub(crate) default: Option<&'static [f64]>,
}

/// A parameter that every call must give.
pub(crate) const fn needed(name: &'static str, kind: Kind) -> Formal {
    Formal {
        name,
        kind,
        default: None,
    }
}

/// A parameter that a call may leave out.
pub(crate) const fn left(name: &'static str, kind: Kind, default: &'static [f64]) -> Formal {
    Formal {
        name,
        kind,
        default: Some(default),
    }
}

/// An argument as it was given.
#[derive(Clone, Debug)]
pub(crate) struct Given<'a> {
    /// Its name, if one was written.
    pub(crate) name: Option<&'a ast::Ident>,
    /// Its value.
    pub(crate) value: Value<'a>,
    /// Where it stands.
    pub(crate) span: Span,
}

/// A call with its arguments evaluated.
#[derive(Clone, Debug)]
pub(crate) struct Invocation<'a> {
    /// What is called.
    pub(crate) name: &'a str,
    /// Where the name stands.
    pub(crate) name_span: Span,
    /// The whole call.
    pub(crate) span: Span,
    /// The arguments, the object of a method first.
    pub(crate) given: Vec<Given<'a>>,
}

/// How a parameter gets its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Slot {
    /// It was left out.
    Default,
    /// From this argument.
    One(usize),
    /// From this argument, which gives the diameter.
    Diameter(usize),
    /// From as many arguments as it has numbers, from this one on.
    Spread(usize),
}

/// Why a call does not fit a list of parameters; positions are those of arguments and parameters.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Misfit {
    UnknownName {
        given: usize,
    },
    Twice {
        given: usize,
    },
    TooMany {
        given: usize,
    },
    WrongShape {
        given: usize,
        formal: usize,
    },
    PartOfVector {
        given: usize,
        formal: usize,
        count: usize,
    },
    Missing {
        formal: usize,
    },
}

impl Misfit {
    /// How near the call came to fitting.
    fn rank(self) -> u32 {
        match self {
            Misfit::UnknownName { .. } => 0,
            Misfit::Twice { .. } => 1,
            Misfit::TooMany { .. } => 2,
            Misfit::WrongShape { .. } => 3,
            Misfit::PartOfVector { .. } => 4,
            Misfit::Missing { .. } => 5,
        }
    }
}

/// How a call fits a list of parameters, if it does.
pub(crate) fn fit(
    formals: &[Formal],
    given: &[Given<'_>],
    flat: bool,
) -> Result<Vec<Slot>, Misfit> {
    let mut slots = vec![Slot::Default; formals.len()];
    let mut next = 0;
    let mut at = 0;
    while at < given.len() && given[at].name.is_none() {
        let Some(formal) = formals.get(next) else {
            return Err(Misfit::TooMany { given: at });
        };
        let width = formal.kind.width(flat);
        let mut taken = 1;
        slots[next] = Slot::One(at);
        if width > 1 && is_number(&given[at].value) {
            let run = given[at..]
                .iter()
                .take_while(|g| g.name.is_none() && is_number(&g.value));
            let count = run.count();
            if count >= width {
                taken = width;
                slots[next] = Slot::Spread(at);
            } else if count > 1 || !formal.kind.spreads() {
                return Err(Misfit::PartOfVector {
                    given: at,
                    formal: next,
                    count,
                });
            }
        } else if !has_form_of(formal.kind, &given[at].value) {
            return Err(Misfit::WrongShape {
                given: at,
                formal: next,
            });
        }
        at += taken;
        next += 1;
    }
    for (at, argument) in given.iter().enumerate().skip(at) {
        let Some(name) = argument.name else { continue };
        let Some((formal, slot)) = named(formals, &name.name, at) else {
            return Err(Misfit::UnknownName { given: at });
        };
        if slots[formal] != Slot::Default {
            return Err(Misfit::Twice { given: at });
        }
        if !has_form_of(formals[formal].kind, &argument.value) {
            return Err(Misfit::WrongShape { given: at, formal });
        }
        slots[formal] = slot;
    }
    match (0..formals.len()).find(|&i| slots[i] == Slot::Default && formals[i].default.is_none()) {
        Some(formal) => Err(Misfit::Missing { formal }),
        None => Ok(slots),
    }
}

fn is_number(value: &Value<'_>) -> bool {
    matches!(value, Value::Number(_))
}

/// Whether the value could be meant for a parameter of this kind, as far as that tells variants of a
/// function apart.
fn has_form_of(kind: Kind, value: &Value<'_>) -> bool {
    let is_vector = matches!(value, Value::Vector(_) | Value::List(_));
    let is_shape = matches!(value, Value::Shape(_));
    match kind {
        Kind::Row(kind) if kind.width() == 1 => !is_vector && !is_shape,
        Kind::Row(_) | Kind::Factors => !is_shape,
        _ if kind.is_shape() => !is_number(value),
        _ => true,
    }
}

fn named(formals: &[Formal], name: &str, at: usize) -> Option<(usize, Slot)> {
    if let Some(formal) = formals.iter().position(|formal| formal.name == name) {
        return Some((formal, Slot::One(at)));
    }
    let radius = diameter_of(name)?;
    let known = |formal: &Formal| formal.kind.is_radius() && formal.name == radius;
    Some((formals.iter().position(known)?, Slot::Diameter(at)))
}

/// The radius that a name is the diameter of: `d1` is that of `r1`.
fn diameter_of(name: &str) -> Option<String> {
    name.strip_prefix('d').map(|rest| format!("r{rest}"))
}

/// The first variant that fits, or the misfit of the one that came nearest.
pub(crate) fn choose<'v>(
    variants: impl Iterator<Item = &'v [Formal]>,
    given: &[Given<'_>],
    flat: bool,
) -> Result<(usize, Vec<Slot>), (usize, Misfit)> {
    let mut nearest: Option<(usize, Misfit)> = None;
    for (at, formals) in variants.enumerate() {
        match fit(formals, given, flat) {
            Ok(slots) => return Ok((at, slots)),
            Err(misfit) if nearest.is_none_or(|(_, best)| best.rank() < misfit.rank()) => {
                nearest = Some((at, misfit));
            }
            Err(_) => {}
        }
    }
    Err(nearest.unwrap_or((0, Misfit::TooMany { given: 0 })))
}

/// The message about a call that fits no variant of a function; the one at `at` came nearest.
pub(crate) fn explain(
    call: &Invocation<'_>,
    lists: &[&[Formal]],
    at: usize,
    misfit: Misfit,
    flat: bool,
    describe: impl Fn(&Value<'_>) -> String,
) -> Diagnostic {
    let name = call.name;
    let formals = lists.get(at).copied().unwrap_or_default();
    let wanted = signature(formals);
    let mut all: Vec<&str> = lists
        .iter()
        .flat_map(|list| list.iter().map(|f| f.name))
        .collect();
    all.dedup();
    let known = lists
        .iter()
        .max_by_key(|list| list.len())
        .map_or("".into(), |l| signature(l));
    match misfit {
        Misfit::UnknownName { given } => {
            let argument = &call.given[given];
            let (written, span) = match argument.name {
                Some(ident) => (ident.name.as_str(), ident.span),
                None => ("", argument.span),
            };
            let message = format!("`{name}` has no argument `{written}`");
            let diagnostic =
                Diagnostic::error(codes::E0203, span, message).label(call.name_span, known);
            diagnose::suggest(diagnostic, span, nearest(written, all))
        }
        Misfit::Twice { given } => {
            let argument = &call.given[given];
            let written = argument.name.map_or("", |ident| ident.name.as_str());
            let message = match formals.iter().any(|formal| formal.name == written) {
                true => format!("`{written}` is given twice"),
                false => {
                    let radius = diameter_of(written).unwrap_or_default();
                    format!("`{radius}` is given twice, as a radius and as a diameter")
                }
            };
            Diagnostic::error(codes::E0206, argument.span, message).label(call.name_span, wanted)
        }
        Misfit::TooMany { given } => {
            let message = format!(
                "`{name}` takes no more than {}",
                count(formals.len(), "argument")
            );
            Diagnostic::error(codes::E0205, call.given[given].span, message)
                .primary("one too many")
                .label(call.name_span, wanted)
        }
        Misfit::WrongShape { given, formal } => {
            let formal = &formals[formal];
            let diagnostic = diagnose::wrong_type(
                call,
                formal.name,
                kind_noun(formal.kind, flat),
                &describe(&call.given[given].value),
                call.given[given].span,
            );
            match formal.kind.is_shape() {
                true => diagnostic.help(format!("write `shape.{name}(..)`")),
                false => diagnostic,
            }
        }
        Misfit::PartOfVector {
            given,
            formal,
            count: numbers,
        } => {
            let next = formals.get(formal + 1);
            let formal = &formals[formal];
            let width = formal.kind.width(flat);
            let second = call.given[given + numbers - 1].span;
            let span = call.given[given].span.to(second);
            let one = if formal.kind.spreads() {
                "one number, "
            } else {
                ""
            };
            let message = format!(
                "`{}` of `{name}` is {one}{width} numbers or a vector, and this is {}",
                formal.name,
                count(numbers, "number"),
            );
            let diagnostic =
                Diagnostic::error(codes::E0311, span, message).label(call.name_span, wanted);
            // Of two numbers, the second was meant for what comes next.
            match next.filter(|next| next.default.is_none()) {
                Some(next) if numbers == 2 && formal.kind.spreads() => diagnostic.fix(
                    second.at_start(),
                    format!("{}: ", next.name),
                    format!(
                        "one number is the {} on all sides; what follows it needs its name",
                        formal.name
                    ),
                ),
                _ => diagnostic,
            }
        }
        Misfit::Missing { formal } => {
            let formal = &formals[formal];
            let or = match formal.kind.is_radius() && formal.name.starts_with('r') {
                true => format!(" (or `d{}`)", &formal.name[1..]),
                false => String::new(),
            };
            let message = format!("`{name}` needs `{}`{or}", formal.name);
            let diagnostic =
                Diagnostic::error(codes::E0204, call.name_span, message).primary(wanted);
            match formal.kind.is_shape() {
                true => diagnostic.help(format!("write `shape.{name}(..)`")),
                false => diagnostic,
            }
        }
    }
}

/// Parameters as they are listed in messages, `angle: angle, axis: direction`.
pub(crate) fn signature(formals: &[Formal]) -> String {
    let one = |formal: &Formal| {
        let noun = match formal.kind {
            Kind::Row(ArgumentKind::Size3) => "number or vec3",
            Kind::Row(ArgumentKind::Size2) => "number or vec2",
            Kind::Any if formal.name == "angle" => "angle",
            kind => super::bound::bare(kind_noun(kind, false)),
        };
        let mark = if formal.default.is_some() { "?" } else { "" };
        format!("{}{mark}: {noun}", formal.name)
    };
    formals.iter().map(one).collect::<Vec<_>>().join(", ")
}

/// What a parameter takes, in words.
pub(crate) fn kind_noun(kind: Kind, flat: bool) -> &'static str {
    use ArgumentKind as A;
    match kind {
        Kind::Row(A::Radius | A::RadiusOrZero) => "a radius",
        Kind::Row(A::Length | A::LengthOrZero | A::Offset) => "a length",
        Kind::Row(A::Size3 | A::Size2) => "a size",
        Kind::Row(A::Radii3) => "a number or a vector of radii",
        Kind::Row(A::Lengths3) => "a number or a vector of lengths",
        Kind::Row(A::Counts3) => "a count or a vector of counts",
        Kind::Row(A::Vec2) => "a vec2",
        Kind::Row(A::Vec3) if flat => "a vec2",
        Kind::Row(A::Vec3) => "a vec3",
        Kind::Row(A::Direction) => "a direction",
        Kind::Row(A::Angle) => "an angle",
        Kind::Row(A::Number) => "a number",
        Kind::Row(A::Count) => "a whole number",
        Kind::Factors => "a factor or a vector of factors",
        Kind::Shape => "a shape",
        Kind::Figure => "a 2D shape",
        Kind::Solid => "a 3D shape",
        Kind::Function => "a function",
        Kind::Material => "a material",
        Kind::List => "a list",
        Kind::Any => "a value",
    }
}

/// A count with its noun.
pub(crate) fn count(number: usize, noun: &str) -> String {
    match number {
        0 => format!("no {noun}s"),
        1 => format!("1 {noun}"),
        _ => format!("{number} {noun}s"),
    }
}
