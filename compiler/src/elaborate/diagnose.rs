//! Telling the user: what was meant by a misspelt name, what other dialects call things, and the
//! collection that keeps one message per place.

use super::arguments::Invocation;
use sdfc_lang::{Code, Diagnostic, Span, codes};
use std::collections::HashSet;

/// The most errors that are collected before elaboration gives up.
const MAX_ERRORS: usize = 100;

/// The messages of a run: one per code and place, for a body may run many times.
#[derive(Debug, Default)]
pub(crate) struct Reports {
    found: Vec<Diagnostic>,
    seen: HashSet<(Code, Span)>,
    errors: usize,
}

impl Reports {
    /// Adds one, unless it has been said.
    pub(crate) fn push(&mut self, diagnostic: Diagnostic) {
        if self.seen.insert((diagnostic.code, diagnostic.span)) {
            self.errors += usize::from(diagnostic.is_error());
            self.found.push(diagnostic);
        }
    }
    /// Whether there is an error.
    pub(crate) fn has_errors(&self) -> bool {
        self.errors > 0
    }
    /// Whether so many errors were found that more would help nobody.
    pub(crate) fn is_full(&self) -> bool {
        self.errors >= MAX_ERRORS
    }
    /// How many errors there are.
    pub(crate) fn error_count(&self) -> usize {
        self.errors
    }
    /// Counts as full from now on.
    pub(crate) fn fill(&mut self) {
        self.errors = self.errors.max(MAX_ERRORS);
    }
    /// All of them.
    pub(crate) fn into_vec(self) -> Vec<Diagnostic> {
        self.found
    }
}

/// The name that was probably meant, if one is near enough.
pub(crate) fn nearest<'n>(
    written: &str,
    names: impl IntoIterator<Item = &'n str>,
) -> Option<&'n str> {
    let lower = written.to_lowercase();
    // A letter swapped, missing or too much in a short name, two in a longer one.
    let allowed = match written.chars().count() {
        0 | 1 => return None,
        2..=5 => 1,
        _ => 2,
    };
    names
        .into_iter()
        .filter(|name| !name.is_empty() && *name != written)
        .map(|name| (strsim::osa_distance(&lower, &name.to_lowercase()), name))
        .filter(|(distance, _)| *distance <= allowed)
        .min()
        .map(|(_, name)| name)
}

/// Adds "did you mean" with its fix, if there is something to suggest.
pub(crate) fn suggest(diagnostic: Diagnostic, span: Span, name: Option<&str>) -> Diagnostic {
    match name {
        Some(name) => diagnostic.fix(span, name, format!("did you mean `{name}`?")),
        None => diagnostic,
    }
}

/// What another dialect's name is called here: a name to put in its place, or advice.
pub(crate) fn dialect(name: &str) -> Option<(Option<&'static str>, &'static str)> {
    let replaced = |name: &'static str, text: &'static str| Some((Some(name), text));
    let advice = |text: &'static str| Some((None, text));
    match name {
        "cube" | "cuboid" | "sdBox" => replaced("box", "a box is called `box` here"),
        "square" | "rectangle" | "sdBox2d" => replaced("rect", "a rectangle is called `rect` here"),
        "ball" | "sdSphere" => replaced("sphere", "a ball is called `sphere` here"),
        "disc" | "disk" | "sdCircle" => replaced("circle", "a disk is called `circle` here"),
        "sdTorus" | "donut" => replaced("torus", "a ring is called `torus` here"),
        "sdCapsule" | "pill" => replaced("capsule", "it is called `capsule` here"),
        "move" | "moved" | "at" | "opTranslate" | "shift" => {
            replaced("translate", "moving is called `translate` here")
        }
        "turn" | "rotated" | "opRotate" => replaced("rotate", "turning is called `rotate` here"),
        "rotateX" | "rotate_x" => advice("write `.rotate(angle, X)`"),
        "rotateY" | "rotate_y" => advice("write `.rotate(angle, Y)`"),
        "rotateZ" | "rotate_z" => advice("write `.rotate(angle, Z)`"),
        "opScale" | "resize" => replaced("scale", "it is called `scale` here"),
        "linear_extrude" | "opExtrusion" => replaced("extrude", "it is called `extrude` here"),
        "rotate_extrude" | "lathe" | "opRevolution" => {
            replaced("revolve", "it is called `revolve` here")
        }
        "opTwist" => replaced("twist", "it is called `twist` here"),
        "opCheapBend" => replaced("bend", "it is called `bend` here"),
        "opOnion" | "onion" | "hollow" => replaced("shell", "it is called `shell` here"),
        "opRound" | "inflate" => replaced("offset", "it is called `offset` here"),
        "opRepetition" | "opRep" | "tile" => replaced("repeat", "it is called `repeat` here"),
        "opElongate" => replaced("elongate", "it is called `elongate` here"),
        "opDisplace" => replaced("displace", "it is called `displace` here"),
        "difference" | "opSubtraction" | "cut" => replaced(
            "subtract",
            "it is called `subtract` here, or written `a - b`",
        ),
        "intersection" | "opIntersection" => replaced(
            "intersect",
            "it is called `intersect` here, or written `a & b`",
        ),
        "opUnion" | "group" => replaced("union", "it is called `union` here, or written `a | b`"),
        "smin" | "smooth_union" | "opSmoothUnion" | "smoothUnion" => {
            advice("a smooth union is written `union(a, b, smooth: 0.2)`, or `a |[0.2] b`")
        }
        "smax" | "smooth_intersection" | "opSmoothIntersection" => {
            advice("a smooth intersection is written `a &[0.2] b`")
        }
        "smooth_subtraction" | "opSmoothSubtraction" => {
            advice("a smooth difference is written `a -[0.2] b`")
        }
        "hull" | "minkowski" => advice("there is no such operation; `union(.., smooth:)` blends"),
        "vec" => advice("write `[x, y, z]`"),
        "float3" => replaced("vec3", "three numbers are a `vec3` here"),
        "float2" => replaced("vec2", "two numbers are a `vec2` here"),
        "modulo" | "fmod" => advice("the remainder is written `a % b`"),
        "PI" => replaced("pi", "it is called `pi` here"),
        "TAU" | "two_pi" => replaced("tau", "it is called `tau` here"),
        "t" | "iTime" | "u_time" | "Time" => replaced("time", "the time is called `time` here"),
        "echo" => replaced("print", "it is called `print` here"),
        "lerp3" => replaced("mix", "it is called `mix` here"),
        "scatter" | "taper" | "text" | "image" | "path" | "bezier" | "polyline" | "mesh"
        | "helix" | "columns" | "pipe" | "engrave" | "groove" | "tongue" | "everything"
        | "tube" | "ellipse" | "trapezoid" | "parallelogram" | "arc" | "ring" | "pie"
        | "horseshoe" | "moon" | "egg" | "heart" | "cross" | "solid_angle" | "cut_sphere"
        | "death_star" | "vesica" | "quad" | "superellipsoid" | "dodecahedron" | "icosahedron"
        | "rhombus" | "stairs" => advice("it is planned, and not part of the language yet"),
        "None" | "null" | "nil" => advice("an empty shape is `nothing()`"),
        _ => None,
    }
}

/// An unknown name: with the name that was meant, or what other dialects call it.
pub(crate) fn unknown_name<'n>(
    code: Code,
    what: &str,
    name: &str,
    span: Span,
    known: impl IntoIterator<Item = &'n str>,
) -> Diagnostic {
    let diagnostic = Diagnostic::error(code, span, format!("there is no {what} `{name}`"));
    let known: Vec<&str> = known.into_iter().collect();
    match (dialect(name), nearest(name, known.iter().copied())) {
        (Some((Some(replacement), text)), _) => diagnostic.fix(span, replacement, text),
        (Some((None, text)), _) => diagnostic.help(text),
        (None, near) => suggest(diagnostic, span, near),
    }
}

/// An argument of the wrong type.
pub(crate) fn wrong_type(
    call: &Invocation<'_>,
    formal: &str,
    wanted: &str,
    got: &str,
    span: Span,
) -> Diagnostic {
    let message = format!(
        "`{}` wants {wanted} for `{formal}`, and this is {got}",
        call.name
    );
    Diagnostic::error(codes::E0301, span, message).label(call.name_span, "")
}
