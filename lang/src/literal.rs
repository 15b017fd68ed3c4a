//! Literals: conversion of numbers with units, colours and strings from text to values and back.
//!
//! Parsing takes the text of one token and returns the value or an error. The lexer reports each error
//! once, so every literal is valid when the tree is built. Formatting returns the canonical text, which
//! parses to the same value.

use crate::ast::{Number, NumberValue, Unit};
use std::ops::Range;

/// Error in a number.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum NumberError {
    /// The letters after the digits are not a unit. The offset is their start in the token.
    Unit { offset: usize },
    /// An integer of more than 64 bits.
    IntTooLarge,
    /// A float above the largest finite one.
    FloatTooLarge,
}

/// Parses a number such as `1_000`, `.5`, `1e-3` or `90deg`.
pub(crate) fn parse_number(word: &str) -> Result<Number, NumberError> {
    let bytes = word.as_bytes();
    let digits = |start: usize| {
        let remaining = bytes[start..].iter();
        start
            + remaining
                .take_while(|b| b.is_ascii_digit() || **b == b'_')
                .count()
    };
    let mut end = digits(0);
    let mut is_float = false;
    if bytes.get(end) == Some(&b'.') {
        is_float = true;
        end = digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        if bytes.get(end + 1 + sign).is_some_and(u8::is_ascii_digit) {
            is_float = true;
            end = digits(end + 1 + sign);
        }
    }
    let suffix = &word[end..];
    let unit = match suffix {
        "" => Unit::None,
        _ => Unit::ALL
            .into_iter()
            .find(|unit| unit.suffix() == suffix)
            .ok_or(NumberError::Unit { offset: end })?,
    };
    let digits: String = word[..end].chars().filter(|c| *c != '_').collect();
    let value = if is_float {
        let value: f64 = digits.parse().unwrap_or(f64::INFINITY);
        if !value.is_finite() {
            return Err(NumberError::FloatTooLarge);
        }
        NumberValue::Float(value)
    } else {
        NumberValue::Int(digits.parse().map_err(|_| NumberError::IntTooLarge)?)
    };
    Ok(Number { value, unit })
}

/// Parses `#rgb`, `#rrggbb` or `#rrggbbaa` to red, green, blue and opacity, or returns `None`.
pub(crate) fn parse_color(word: &str) -> Option<[u8; 4]> {
    let digits = word.strip_prefix('#')?;
    let digits: Vec<u8> = digits
        .chars()
        .map(|c| c.to_digit(16).map(|digit| digit as u8))
        .collect::<Option<_>>()?;
    match *digits.as_slice() {
        [r, g, b] => Some([r * 17, g * 17, b * 17, 255]),
        [r1, r0, g1, g0, b1, b0] => Some([r1 * 16 + r0, g1 * 16 + g0, b1 * 16 + b0, 255]),
        [r1, r0, g1, g0, b1, b0, a1, a0] => {
            Some([r1 * 16 + r0, g1 * 16 + g0, b1 * 16 + b0, a1 * 16 + a0])
        }
        _ => None,
    }
}

/// Parses a string: returns the text between the quotes with `\n`, `\t`, `\\` and `\"` resolved, and the
/// ranges of unknown escapes.
pub(crate) fn parse_text(word: &str) -> (String, Vec<Range<usize>>) {
    let inner = word.strip_prefix('"').unwrap_or(word);
    let inner = inner.strip_suffix('"').unwrap_or(inner);
    let mut value = String::with_capacity(inner.len());
    let mut unknown = Vec::new();
    let mut chars = inner.char_indices();
    while let Some((offset, c)) = chars.next() {
        if c != '\\' {
            value.push(c);
            continue;
        }
        match chars.next() {
            Some((_, 'n')) => value.push('\n'),
            Some((_, 't')) => value.push('\t'),
            Some((_, c @ ('\\' | '"'))) => value.push(c),
            Some((_, c)) => unknown.push(offset + 1..offset + 2 + c.len_utf8()),
            None => {}
        }
    }
    (value, unknown)
}

/// Formats a number with its unit: an integer without a dot, a float with a dot or an exponent.
pub(crate) fn format_number(number: &Number) -> String {
    let unit = number.unit.suffix();
    match number.value {
        NumberValue::Int(value) => format!("{value}{unit}"),
        NumberValue::Float(value) => format!("{value:?}{unit}"),
    }
}

/// Formats a colour as `#rrggbb`, or as `#rrggbbaa` unless it is opaque.
pub(crate) fn format_color([r, g, b, a]: [u8; 4]) -> String {
    match a {
        255 => format!("#{r:02x}{g:02x}{b:02x}"),
        _ => format!("#{r:02x}{g:02x}{b:02x}{a:02x}"),
    }
}

/// Formats a text in quotes, with escapes.
pub(crate) fn quote(text: &str) -> String {
    let mut quoted = String::with_capacity(text.len() + 2);
    quoted.push('"');
    for c in text.chars() {
        match c {
            '\n' => quoted.push_str("\\n"),
            '\t' => quoted.push_str("\\t"),
            '\\' | '"' => quoted.extend(['\\', c]),
            _ => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;
    use NumberValue::{Float, Int};

    #[test]
    fn numbers_keep_their_unit_and_whether_they_are_integers() {
        let read = |word| parse_number(word).map(|n| (n.value, n.unit));
        assert_eq!(read("1_000"), Ok((Int(1000), Unit::None)));
        assert_eq!(read(".5"), Ok((Float(0.5), Unit::None)));
        assert_eq!(read("1e-3"), Ok((Float(0.001), Unit::None)));
        assert_eq!(read("1e3m"), Ok((Float(1000.0), Unit::M)));
        assert_eq!(read("90deg"), Ok((Int(90), Unit::Deg)));
        assert_eq!(read("0.25turn"), Ok((Float(0.25), Unit::Turn)));
        assert_eq!(read("1in"), Ok((Int(1), Unit::In)));
        assert_eq!(read("200ms"), Ok((Int(200), Unit::Ms)));
        assert_eq!(read("1em"), Err(NumberError::Unit { offset: 1 }));
        assert_eq!(read("2_mm"), Ok((Int(2), Unit::Mm)));
        assert_eq!(read("99999999999999999999"), Err(NumberError::IntTooLarge));
        assert_eq!(read("1e999"), Err(NumberError::FloatTooLarge));
    }

    #[test]
    fn colours_have_three_six_or_eight_digits() {
        assert_eq!(parse_color("#f80"), Some([255, 136, 0, 255]));
        assert_eq!(parse_color("#3aA6ff"), Some([0x3a, 0xa6, 0xff, 255]));
        assert_eq!(parse_color("#3aa6ff80"), Some([0x3a, 0xa6, 0xff, 0x80]));
        assert_eq!(parse_color("#3aa6f"), None);
        assert_eq!(parse_color("#3aa6fg"), None);
        assert_eq!(parse_color("#"), None);
    }

    #[test]
    fn escapes_are_resolved_or_located() {
        assert_eq!(parse_text(r#""a\"b\n""#), ("a\"b\n".to_owned(), vec![]));
        let (value, unknown) = parse_text(r#""a\qb""#);
        assert_eq!(value, "ab");
        assert_eq!(unknown.first(), Some(&(2..4)));
    }
}
