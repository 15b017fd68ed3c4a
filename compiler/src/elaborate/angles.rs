//! Corrections of angles where numbers are required.
//!
//! A quotient of two angles is a number. Other languages divide by a number instead, such as `tau`. The
//! corrections find such divisions in the text and write the unit that has the same value.

use super::value::Quantity;
use sdfc_lang::{Diagnostic, Span};
use std::f64::consts::{PI, TAU};
use std::ops::Range;

/// Largest difference of a written constant, such as 3.14, from its value.
const MAX_CONSTANT_ERROR: f64 = 0.01;

/// Adds the conversion of an angle to a number. `text` is the source at `span`.
pub(crate) fn advise(
    diagnostic: Diagnostic,
    quantity: Quantity,
    text: &str,
    span: Span,
) -> Diagnostic {
    if quantity != Quantity::Angle {
        return diagnostic;
    }
    let edits: Vec<(Span, String)> = divisions(text)
        .into_iter()
        .map(|(range, unit)| {
            let [start, end] = [range.start, range.end].map(|offset| span.start + offset as u32);
            (Span::new(span.file, start, end), format!("/ {unit}"))
        })
        .collect();
    match edits.is_empty() {
        true => diagnostic.help(
            "divide it by an angle: `a / 1rad` is the number of radians, `a / 1turn` that of turns, `a / 1deg` that of \
             degrees",
        ),
        false => diagnostic.fix_all(edits, "divide by an angle: the quotient is a number"),
    }
}

/// Returns the conversions of angles in a text, each with the unit to divide by.
fn divisions(text: &str) -> Vec<(Range<usize>, &'static str)> {
    let mut found: Vec<(Range<usize>, &'static str)> = Vec::new();
    for (start, sign) in text.match_indices(['/', '*']) {
        let is_inside = found.last().is_some_and(|(range, _)| start < range.end);
        if is_inside || is_in_comment(&text[..start]) || !ends_with_angle(&text[..start]) {
            continue;
        }
        if let Some((length, unit)) = unit_after(&text[start..], sign) {
            found.push((start..start + length, unit));
        }
    }
    found
}

/// Reports whether a comment is open at the end of a text.
fn is_in_comment(text: &str) -> bool {
    let line = &text[text.rfind('\n').map_or(0, |end| end + 1)..];
    line.contains("//") || text.rfind("/*") > text.rfind("*/")
}

/// Reports whether a value in a text begins with the inverse of an angle's function.
fn is_inverse_function(text: &str) -> bool {
    let functions = ["atan", "asin", "acos"];
    let text = text.trim_start();
    functions.iter().any(|function| text.starts_with(function))
}

/// Returns the text after `let name =`. `None` if the name has another meaning elsewhere: it is defined more than
/// once, or is also a parameter of a lambda.
fn only_definition<'t>(text: &'t str, name: &str) -> Option<&'t str> {
    let (_, definition) = text.split_once(&format!("let {name} ="))?;
    let mut lambdas = text.split("fn(").skip(1);
    let is_parameter = lambdas.any(|lambda| {
        let parameters = lambda.split(')').next().unwrap_or_default();
        parameters.split([',', ':']).any(|word| word.trim() == name)
    });
    let is_redefined = definition.contains(&format!("let {name} ="));
    (!is_redefined && !is_parameter).then_some(definition)
}

/// Reports whether a text ends with the name of an angle that it defines, or with an inverse function of an angle
/// in brackets.
fn ends_with_angle(text: &str) -> bool {
    let text = text.trim_end();
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let Some(inner) = text.strip_suffix(')') else {
        let before_name = text.trim_end_matches(is_name);
        let name = &text[before_name.len()..];
        return !before_name.ends_with('.')
            && only_definition(text, name).is_some_and(is_inverse_function);
    };
    let mut depth = 1;
    let open = inner.char_indices().rev().find(|(_, c)| {
        match c {
            ')' => depth += 1,
            '(' => depth -= 1,
            _ => {}
        }
        depth == 0
    });
    let Some((open, _)) = open else { return false };
    let name_start = inner[..open].trim_end_matches(is_name).len();
    ["atan", "asin", "acos"]
        .iter()
        .any(|function| inner[name_start..].contains(function))
}

/// Returns the length of an operator and its constants at the start of a text, and the unit that corresponds
/// to them.
fn unit_after(text: &str, sign: &str) -> Option<(usize, &'static str)> {
    let constants = |text: &str, pattern: &[Word]| {
        let mut rest = text;
        for word in pattern {
            rest = word.strip(rest.trim_start())?;
        }
        Some(text.len() - rest.len())
    };
    let forms = PATTERNS.iter().filter(|(first, ..)| *first == sign);
    let mut matches =
        forms.filter_map(|(_, pattern, unit)| Some((1 + constants(&text[1..], pattern)?, *unit)));
    matches.next()
}

/// Word of a pattern.
#[derive(Clone, Copy)]
enum Word {
    /// A name or an operator.
    Text(&'static str),
    /// A number close to this one.
    Near(f64),
}

impl Word {
    /// Removes the word from the start of a text.
    fn strip(self, text: &str) -> Option<&str> {
        match self {
            Word::Text(word) => {
                let rest = text.strip_prefix(word)?;
                let is_longer = word.ends_with(|c: char| c.is_ascii_alphabetic())
                    && rest.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_');
                (!is_longer).then_some(rest)
            }
            Word::Near(value) => {
                let is_digit = |c: char| c.is_ascii_digit() || c == '.';
                let rest = text.trim_start_matches(is_digit);
                let number: f64 = text[..text.len() - rest.len()].parse().ok()?;
                let has_unit = rest.starts_with(|c: char| c.is_ascii_alphabetic());
                ((number - value).abs() < MAX_CONSTANT_ERROR && !has_unit).then_some(rest)
            }
        }
    }
}

/// Conversions of angles to numbers, longer ones first.
const PATTERNS: &[(&str, &[Word], &str)] = {
    use Word::{Near, Text};
    &[
        ("*", &[Near(180.0), Text("/"), Text("pi")], "1deg"),
        ("*", &[Near(180.0), Text("/"), Near(PI)], "1deg"),
        (
            "*",
            &[Text("("), Near(180.0), Text("/"), Text("pi"), Text(")")],
            "1deg",
        ),
        (
            "*",
            &[Text("("), Near(180.0), Text("/"), Near(PI), Text(")")],
            "1deg",
        ),
        ("*", &[Near(180.0 / PI)], "1deg"),
        ("/", &[Text("pi"), Text("*"), Near(180.0)], "1deg"),
        ("/", &[Near(PI), Text("*"), Near(180.0)], "1deg"),
        (
            "/",
            &[Text("("), Near(2.0), Text("*"), Text("pi"), Text(")")],
            "1turn",
        ),
        (
            "/",
            &[Text("("), Near(2.0), Text("*"), Near(PI), Text(")")],
            "1turn",
        ),
        ("/", &[Text("tau")], "1turn"),
        ("/", &[Near(TAU)], "1turn"),
        ("/", &[Text("pi")], "180deg"),
        ("/", &[Near(PI)], "180deg"),
    ]
};

#[cfg(test)]
mod tests {
    use super::divisions;

    #[test]
    fn conversions_of_angles_are_found_in_a_text() {
        let corrected = |text: &str| {
            let mut corrected = text.to_owned();
            for (range, unit) in divisions(text).into_iter().rev() {
                corrected.replace_range(range, &format!("/ {unit}"));
            }
            corrected
        };
        for (text, expected) in [
            ("atan2(y, x) / tau", "atan2(y, x) / 1turn"),
            ("atan2(f(y), x) /6.28 + 1", "atan2(f(y), x) / 1turn + 1"),
            ("(atan(y) + 1)/(2.0*pi)", "(atan(y) + 1)/ 1turn"),
            ("let a = atan(y); a * 180 / pi", "let a = atan(y); a / 1deg"),
            (
                "let a = acos(y); a / pi * 180.0",
                "let a = acos(y); a / 1deg",
            ),
            ("let a = 3; a / tau", "let a = 3; a / tau"),
            (
                "let a = atan(y); /* a / tau */ 1",
                "let a = atan(y); /* a / tau */ 1",
            ),
            ("let a = atan(y); // a / tau", "let a = atan(y); // a / tau"),
            ("acos(x) * (180 / 3.14159)", "acos(x) / 1deg"),
            ("acos(x) * 57.2958", "acos(x) / 1deg"),
            ("acos(x) / 3.14", "acos(x) / 180deg"),
            ("p.x / tau", "p.x / tau"),
            ("length(p) / tau", "length(p) / tau"),
            ("acos(x) / tausend", "acos(x) / tausend"),
            ("3 / tau", "3 / tau"),
            ("acos(x) / 6.28rad", "acos(x) / 6.28rad"),
        ] {
            assert_eq!(corrected(text), expected, "{text}");
        }
    }
}
