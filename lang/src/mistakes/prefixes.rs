//! Transforms and set operations before their shapes, as in OpenSCAD.

use super::{ErrorContext, Mistake, Repair, shorten};
use crate::codes;
use crate::diagnostic::Diagnostic;
use crate::span::Span;
use crate::token::Token;

/// Words that stand before a shape in OpenSCAD, and the functions that correspond to them.
const PREFIXES: [(&str, Meaning); 15] = [
    ("translate", Meaning::Method("translate")),
    ("rotate", Meaning::Method("rotate")),
    ("scale", Meaning::Method("scale")),
    ("mirror", Meaning::Method("reflect")),
    ("reflect", Meaning::Method("reflect")),
    ("color", Meaning::Method("color")),
    ("linear_extrude", Meaning::Method("extrude")),
    ("extrude", Meaning::Method("extrude")),
    ("rotate_extrude", Meaning::Method("revolve")),
    ("revolve", Meaning::Method("revolve")),
    ("union", Meaning::Operator(" |")),
    ("group", Meaning::Operator(" |")),
    ("difference", Meaning::Operator(" -")),
    ("subtract", Meaning::Operator(" -")),
    ("intersection", Meaning::Operator(" &")),
];

/// Equivalent of a word before a shape.
#[derive(Clone, Copy)]
enum Meaning {
    /// A function that is called after a dot.
    Method(&'static str),
    /// An operator between the shapes of the block.
    Operator(&'static str),
}

impl Meaning {
    /// Returns its use with other shapes.
    fn example(self) -> &'static str {
        match self {
            Self::Method("rotate") => "(a | b - c).rotate(30deg, Z)",
            Self::Method("scale") => "(a | b - c).scale(2)",
            Self::Method("reflect") => "(a | b - c).reflect(X)",
            Self::Method("color") => "(a | b - c).color(#c03020)",
            Self::Method("extrude") => "(a | b - c).extrude(10)",
            Self::Method("revolve") => "(a | b - c).revolve()",
            Self::Method(_) => "(a | b - c).translate(1, 2, 3)",
            Self::Operator(" -") => "a - b - c",
            Self::Operator(" &") => "a & b & c",
            Self::Operator(_) => "a | b | c",
        }
    }
}

/// A word with its arguments, before a shape.
struct Prefix {
    meaning: Meaning,
    open: usize,
    close: usize,
}

/// Explains transforms before shapes: `translate([1, 2, 3]) box(1);`, `difference() { box(2); sphere(1); }`.
pub(super) fn transform_first(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let close = context.relative_index(-1)?;
    if context.tokens[close].1 != Token::CloseParen {
        return None;
    }
    let start = context.opener(close)?.checked_sub(1)?;
    let first = prefix(context, start)?;
    let follows_dot = start > context.start && context.tokens[start - 1].1 == Token::Dot;
    // On a new line, an operator may be missing after `translate(shape, 1, 2, 3)`.
    let first_argument = context.tokens[first.open + 1].1;
    let takes_shape = match first.meaning {
        Meaning::Method(_) => matches!(first_argument, Token::Name(_)) && context.is_on_new_line(),
        Meaning::Operator(_) => first_argument != Token::CloseParen,
    };
    if follows_dot || takes_shape {
        return None;
    }
    let mut prefixes = vec![first];
    let mut operand = close + 1;
    while let Some(next) = prefix(context, operand)
        && starts_shape(context, next.close + 1)
    {
        operand = next.close + 1;
        prefixes.push(next);
    }
    if !starts_shape(context, operand) {
        return None;
    }
    let word = context.token_span(start);
    let name = shorten(context.slice(word));
    let message = match prefixes[0].meaning {
        Meaning::Method(_) => format!("`{name}` stands after its shape"),
        Meaning::Operator(_) => format!("`{name}` takes no block"),
    };
    let diagnostic = Diagnostic::error(codes::E0133, word, message);
    let (edits, last) = match context.tokens[operand].1 {
        Token::OpenBrace => (
            block_edits(context, start, &prefixes, operand),
            context.closer(operand).unwrap_or(operand),
        ),
        _ => (
            shape_edits(context, start, &prefixes, operand),
            context.index,
        ),
    };
    // Names of arguments differ, and so do the arguments of an extrusion after its height.
    let has_plain_arguments = prefixes.iter().all(|prefix| {
        let words = &context.tokens[prefix.open + 1..prefix.close];
        let is_extrusion = matches!(prefix.meaning, Meaning::Method("extrude" | "revolve"));
        words.iter().all(|word| match word.1 {
            Token::Assign | Token::Colon => false,
            Token::Comma => !is_extrusion,
            _ => true,
        })
    });
    let edits = edits.filter(|_| has_plain_arguments);
    let diagnostic = match (edits, prefixes[0].meaning) {
        (Some(edits), Meaning::Method(_)) => {
            diagnostic.fix_all(edits, "write the transform after the shape")
        }
        (Some(edits), Meaning::Operator(operator)) => {
            let text = format!("write `{}` between the shapes", operator.trim());
            diagnostic.fix_all(edits, text)
        }
        (None, meaning) => diagnostic.help(format!("write `{}`", meaning.example())),
    };
    Some(Mistake {
        diagnostic,
        index: last,
        repair: Repair::RemoveStatement,
    })
}

/// Returns the closest equivalent of an operation of OpenSCAD that this language lacks.
pub fn missing_operation(name: &str) -> Option<&'static str> {
    match name {
        "minkowski" => Some(
            "there is no such operation; the sum of a shape and a ball is `shape.offset(radius)`",
        ),
        "hull" => Some(
            "there is no such operation; the hull of two equal balls is `capsule(from, to, r)`, and `a |[0.2] b` blends",
        ),
        _ => None,
    }
}

/// Explains other calls with a block: `hull() { sphere(1); box(1); }`.
pub(super) fn block_after_call(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let close = context.relative_index(-1)?;
    let is_block = context.token_at(0) == Some(Token::OpenBrace);
    if !is_block || context.tokens[close].1 != Token::CloseParen {
        return None;
    }
    let start = context.opener(close)?.checked_sub(1)?;
    let Token::Name(name) = context.tokens[start].1 else {
        return None;
    };
    let name = shorten(name);
    let message = format!("`{name}` takes no block");
    let diagnostic = Diagnostic::error(codes::E0133, context.token_span(start), message);
    let other = "shapes stand between the brackets, `f(a, b)`, and are joined by `|`, `-` and `&`";
    let help = missing_operation(&name).unwrap_or(other);
    Some(Mistake {
        diagnostic: diagnostic.help(help),
        index: context.closer(context.index).unwrap_or(context.index),
        repair: Repair::RemoveStatement,
    })
}

/// Returns the prefix that starts at a token.
fn prefix(context: &ErrorContext<'_, '_>, index: usize) -> Option<Prefix> {
    let word = |index: usize| (index < context.end).then(|| context.tokens[index].1);
    let (Token::Name(name), Token::OpenParen) = (word(index)?, word(index + 1)?) else {
        return None;
    };
    let (_, meaning) = PREFIXES.into_iter().find(|(prefix, _)| *prefix == name)?;
    Some(Prefix {
        meaning,
        open: index + 1,
        close: context.closer(index + 1)?,
    })
}

/// Reports whether a call or a block starts at a token.
fn starts_shape(context: &ErrorContext<'_, '_>, index: usize) -> bool {
    let word = |index: usize| (index < context.end).then(|| context.tokens[index].1);
    match word(index) {
        Some(Token::OpenBrace) => true,
        Some(Token::Name(_)) => matches!(
            word(index + 1),
            Some(Token::OpenParen | Token::PathSeparator)
        ),
        _ => false,
    }
}

/// Returns the edits that move transforms behind one shape.
fn shape_edits(
    context: &ErrorContext<'_, '_>,
    start: usize,
    prefixes: &[Prefix],
    operand: usize,
) -> Option<Vec<(Span, String)>> {
    let mut end = operand;
    // A name, its arguments, and calls after dots.
    loop {
        let word = |index: usize| (index < context.end).then(|| context.tokens[index].1);
        end = match (word(end), word(end + 1)) {
            (Some(Token::Name(_)), Some(Token::OpenParen)) => context.closer(end + 1)?,
            (Some(Token::Name(_)), _) => end,
            _ => return None,
        };
        match word(end + 1) {
            Some(Token::Dot | Token::PathSeparator) => end += 2,
            _ => break,
        }
    }
    let opening = context.token_span(start).at_start();
    let opening = opening.to(context.token_span(operand).at_start());
    let gap = context.token_span(end).at_end();
    let closing = match last_semicolon(context, start, end + 1) {
        Some((semicolon, _)) => gap.to(semicolon),
        None => gap,
    };
    Some(vec![
        (opening, String::new()),
        (closing, suffixes(context, prefixes)),
    ])
}

/// Returns the edits that join the shapes of a block by an operator and move transforms behind them.
fn block_edits(
    context: &ErrorContext<'_, '_>,
    start: usize,
    prefixes: &[Prefix],
    brace: usize,
) -> Option<Vec<(Span, String)>> {
    let close = context.closer(brace)?;
    let mut semicolons = Vec::new();
    let mut depth = 0;
    for index in brace + 1..close {
        let token = context.tokens[index].1;
        if token.closer().is_some() {
            depth += 1;
        } else if token.is_closer() {
            depth -= 1;
        }
        // Nested blocks keep their own separators; without one behind them, their operators are not known.
        let ends_block = token == Token::CloseBrace && depth == 0;
        let is_separated = context.tokens[index + 1].1 == Token::Semicolon;
        let is_statement = token == Token::Assign && depth == 0 || token.starts_item();
        if is_statement || ends_block && !is_separated {
            return None;
        }
        if token == Token::Semicolon && depth == 0 {
            semicolons.push(index);
        }
    }
    let (last, others) = semicolons.split_last()?;
    if last + 1 != close {
        return None;
    }
    let operator = match prefixes.last()?.meaning {
        Meaning::Operator(operator) => operator,
        Meaning::Method(_) => " |",
    };
    let opening = context.token_span(start).at_start();
    let opening = opening.to(context.token_span(brace + 1).at_start());
    let closing = context.token_span(*last).to(context.token_span(close));
    let mut edits = vec![(opening, "(".to_owned())];
    edits.extend(
        others
            .iter()
            .map(|index| (context.token_span(*index), operator.to_owned())),
    );
    edits.push((closing, format!("){}", suffixes(context, prefixes))));
    edits.extend(last_semicolon(context, start, close + 1));
    Some(edits)
}

/// Returns the calls that correspond to prefixes, from the innermost one.
fn suffixes(context: &ErrorContext<'_, '_>, prefixes: &[Prefix]) -> String {
    let calls = prefixes
        .iter()
        .rev()
        .filter_map(|prefix| match prefix.meaning {
            Meaning::Method(name) => Some(format!(".{name}({})", arguments(context, name, prefix))),
            Meaning::Operator(_) => None,
        });
    calls.collect()
}

/// Returns the arguments of a prefix. The angles of a rotation get their unit, degrees.
fn arguments(context: &ErrorContext<'_, '_>, name: &str, prefix: &Prefix) -> String {
    let between = context.token_span(prefix.open).at_end();
    let between = between.to(context.token_span(prefix.close).at_start());
    let words = prefix.open + 1..prefix.close;
    let is_number = |index: usize| {
        matches!(
            context.tokens[index].1,
            Token::Number(_)
                | Token::Minus
                | Token::Comma
                | Token::OpenBracket
                | Token::CloseBracket
        )
    };
    if name != "rotate" || !words.clone().all(is_number) {
        return context.slice(between).to_owned();
    }
    // A list of angles, or an angle and an axis.
    let is_list = context.tokens[prefix.open + 1].1 == Token::OpenBracket;
    let mut is_axis = false;
    let mut text = String::new();
    for index in words {
        text += context.slice(context.token_span(index));
        is_axis |= !is_list && context.tokens[index].1 == Token::Comma;
        match context.tokens[index].1 {
            Token::Number(digits)
                if !is_axis && digits.parse::<f64>().is_ok_and(|angle| angle != 0.0) =>
            {
                text += "deg";
            }
            Token::Comma => text += " ",
            _ => {}
        }
    }
    text
}

/// Returns the edit that removes a `;` at the end of the file, after which the file would have no value.
fn last_semicolon(
    context: &ErrorContext<'_, '_>,
    start: usize,
    index: usize,
) -> Option<(Span, String)> {
    let is_last = start == context.start
        && index + 1 == context.tokens.len()
        && context.tokens[index].1 == Token::Semicolon;
    is_last.then(|| (context.token_span(index), String::new()))
}
