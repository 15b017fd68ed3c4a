//! Diagnostics: suggestions for misspelt names and names of other dialects, and a collection
//! without duplicates.

use sdfc_lang::ast::{Arg, Call, ExprKind};
use sdfc_lang::{Diagnostic, DiagnosticCode, Span};
use std::collections::HashSet;

/// Maximum number of errors before elaboration is aborted.
const MAX_ERRORS: usize = 100;

/// Diagnostics of a run: at most one per code and span, since a body may be evaluated many times.
#[derive(Debug, Default)]
pub(crate) struct Reports {
    diagnostics: Vec<Diagnostic>,
    reported: HashSet<(DiagnosticCode, Span)>,
    errors: usize,
}

impl Reports {
    /// Adds a diagnostic, unless one with its code and span exists.
    pub(crate) fn push(&mut self, diagnostic: Diagnostic) {
        if self.reported.insert((diagnostic.code, diagnostic.span)) {
            self.errors += usize::from(diagnostic.is_error());
            self.diagnostics.push(diagnostic);
        }
    }
    /// Omits diagnostics with the code and span of this one, which follow from another.
    pub(crate) fn suppress(&mut self, diagnostic: &Diagnostic) {
        self.reported.insert((diagnostic.code, diagnostic.span));
    }
    /// Reports whether there is an error.
    pub(crate) fn has_errors(&self) -> bool {
        self.errors > 0
    }
    /// Reports whether the maximum number of errors is reached.
    pub(crate) fn is_full(&self) -> bool {
        self.errors >= MAX_ERRORS
    }
    /// Returns the number of errors reported so far, without warnings.
    pub(crate) fn error_count(&self) -> usize {
        self.errors
    }
    /// Marks the collection as full.
    pub(crate) fn mark_full(&mut self) {
        self.errors = self.errors.max(MAX_ERRORS);
    }
    /// Returns all diagnostics, in the order of the reports and without duplicates.
    pub(crate) fn into_vec(self) -> Vec<Diagnostic> {
        self.diagnostics
    }
}

/// Returns the closest name by edit distance, if one is close enough.
pub(crate) fn nearest<'n>(
    written: &str,
    names: impl IntoIterator<Item = &'n str>,
) -> Option<&'n str> {
    let lowercase = written.to_lowercase();
    // Allows one edit (a letter swapped, missing or extra) in a short name, two in a longer one.
    let max_distance = match written.chars().count() {
        0 | 1 => return None,
        2..=5 => 1,
        _ => 2,
    };
    names
        .into_iter()
        .filter(|name| !name.is_empty() && *name != written)
        .map(|name| (strsim::osa_distance(&lowercase, &name.to_lowercase()), name))
        .filter(|(distance, _)| *distance <= max_distance)
        .min()
        .map(|(_, name)| name)
}

/// Adds a "did you mean" fix, if there is a suggestion.
pub(crate) fn suggest(diagnostic: Diagnostic, span: Span, name: Option<&str>) -> Diagnostic {
    match name {
        Some(name) => diagnostic.fix(span, name, format!("did you mean `{name}`?")),
        None => diagnostic,
    }
}

/// Returns the equivalent of another dialect's name, if there is one, and a text that explains it.
pub(crate) fn dialect_advice(name: &str) -> Option<(Option<&'static str>, &'static str)> {
    let replacement = |name: &'static str, text: &'static str| Some((Some(name), text));
    let advice = |text: &'static str| Some((None, text));
    match name {
        "cube" | "cuboid" | "sdBox" => replacement("box", "a box is called `box` here"),
        "square" | "rectangle" | "sdBox2d" => {
            replacement("rect", "a rectangle is called `rect` here")
        }
        "ball" | "sdSphere" => replacement("sphere", "a ball is called `sphere` here"),
        "disc" | "disk" | "sdCircle" => replacement("circle", "a disk is called `circle` here"),
        "sdTorus" | "donut" => replacement("torus", "a ring is called `torus` here"),
        "sdCapsule" | "pill" => replacement("capsule", "it is called `capsule` here"),
        "move" | "moved" | "at" | "opTranslate" | "shift" => {
            replacement("translate", "moving is called `translate` here")
        }
        "turn" | "rotated" | "opRotate" => replacement("rotate", "turning is called `rotate` here"),
        "rotateX" | "rotate_x" => advice("write `.rotate(angle, X)`"),
        "rotateY" | "rotate_y" => advice("write `.rotate(angle, Y)`"),
        "rotateZ" | "rotate_z" => advice("write `.rotate(angle, Z)`"),
        "opScale" | "resize" => replacement("scale", "it is called `scale` here"),
        "linear_extrude" | "opExtrusion" => replacement("extrude", "it is called `extrude` here"),
        "rotate_extrude" | "lathe" | "opRevolution" => {
            replacement("revolve", "it is called `revolve` here")
        }
        "opTwist" => replacement("twist", "it is called `twist` here"),
        "opCheapBend" => replacement("bend", "it is called `bend` here"),
        "opOnion" | "onion" | "hollow" => replacement("shell", "it is called `shell` here"),
        "opRound" | "inflate" => replacement("offset", "it is called `offset` here"),
        "opRepetition" | "opRep" | "tile" => replacement("repeat", "it is called `repeat` here"),
        "opElongate" => replacement("elongate", "it is called `elongate` here"),
        "opDisplace" => replacement("displace", "it is called `displace` here"),
        "difference" | "opSubtraction" | "cut" => replacement(
            "subtract",
            "it is called `subtract` here, or written `a - b`",
        ),
        "intersection" | "opIntersection" => replacement(
            "intersect",
            "it is called `intersect` here, or written `a & b`",
        ),
        "opUnion" | "group" => {
            replacement("union", "it is called `union` here, or written `a | b`")
        }
        "smin" | "smooth_union" | "opSmoothUnion" | "smoothUnion" => {
            advice("a smooth union is written `union(a, b, smooth: 0.2)`, or `a |[0.2] b`")
        }
        "smax" | "smooth_intersection" | "opSmoothIntersection" => {
            advice("a smooth intersection is written `a &[0.2] b`")
        }
        "smooth_subtraction" | "opSmoothSubtraction" => {
            advice("a smooth difference is written `a -[0.2] b`")
        }
        "minkowski" => advice(
            "there is no such operation; the sum of a shape and a ball is `shape.offset(radius)`",
        ),
        "hull" => advice(
            "there is no such operation; the hull of two equal balls is `capsule(from, to, r)`, and `union(.., smooth:)` blends",
        ),
        "vec" => advice("write `[x, y, z]`"),
        "float3" => replacement("vec3", "three numbers are a `vec3` here"),
        "float2" => replacement("vec2", "two numbers are a `vec2` here"),
        "mod" | "modulo" | "fmod" => advice("the remainder is written `a % b`"),
        "mat2" | "mat3" | "mat4" => advice(
            "there are no matrices: `shape.rotate(30deg, Y)` turns a shape, and `[dot(a, p), dot(b, p), dot(c, p)]` is \
             the product of the rows `a`, `b`, `c` and `p`",
        ),
        "float" => advice("every number is a float: leave the call out"),
        "int" => replacement("trunc", "the integer part is called `trunc` here"),
        "fillet" | "rounded" | "roundover" => advice(
            "a shape rounds its own edges, `box(1, round: 0.1)`; a fillet between two shapes is `a |[fillet, 0.1] b`",
        ),
        "chamfer" | "bevel" => advice(
            "the edge between two shapes is chamfered by `a |[chamfer, 0.1] b`, `a -[chamfer, 0.1] b` or \
             `a &[chamfer, 0.1] b`",
        ),
        "PI" => replacement("pi", "it is called `pi` here"),
        "TAU" | "two_pi" => replacement("tau", "it is called `tau` here"),
        "t" | "iTime" | "u_time" | "Time" => replacement("time", "the time is called `time` here"),
        "echo" => replacement("print", "it is called `print` here"),
        "lerp3" => replacement("mix", "it is called `mix` here"),
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

/// Returns the edits that write a call of `mod` or `fmod` at a span as the operator `%`.
pub(crate) fn remainder_edits(call: &Call, span: Span) -> Option<Vec<(Span, String)>> {
    let name = call.callee.as_ident()?;
    let [a, b] = call.args.as_slice() else {
        return None;
    };
    let has_names = a.name.is_some() || b.name.is_some();
    if !matches!(name.name.as_str(), "mod" | "modulo" | "fmod") || has_names {
        return None;
    }
    let brackets = |arg: &Arg| match arg.value.kind {
        ExprKind::Chain(_) | ExprKind::Range(_) | ExprKind::Lambda(_) => ("(", ")"),
        _ => ("", ""),
    };
    let ((open_a, close_a), (open_b, close_b)) = (brackets(a), brackets(b));
    let (first, second) = (a.value.span, b.value.span);
    Some(vec![
        (name.span.to(first.at_start()), format!("({open_a}")),
        (
            first.at_end().to(second.at_start()),
            format!("{close_a} % {open_b}"),
        ),
        (second.at_end().to(span.at_end()), format!("{close_b})")),
    ])
}

/// Describes an unknown name, with a suggestion or the equivalent of another dialect's name.
pub(crate) fn unknown_name<'n>(
    code: DiagnosticCode,
    what: &str,
    name: &str,
    span: Span,
    names: impl IntoIterator<Item = &'n str>,
) -> Diagnostic {
    let diagnostic = Diagnostic::error(code, span, format!("there is no {what} `{name}`"));
    let names: Vec<&str> = names.into_iter().collect();
    match (dialect_advice(name), nearest(name, names.iter().copied())) {
        (Some((Some(replacement), text)), _) => diagnostic.fix(span, replacement, text),
        (Some((None, text)), _) => diagnostic.help(text),
        (None, suggestion) => suggest(diagnostic, span, suggestion),
    }
}
