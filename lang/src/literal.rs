//! Literals: numbers with their units, colours, strings, from the text to the value and back.
//!
//! Reading takes the text of one word and gives the value or what is wrong with it. The lexer
//! reports what is wrong once; by the time the tree is built every literal is good. Writing gives
//! the canonical text, which reads as the same value.

use crate::ast::{Number, NumberValue, Unit};
use std::ops::Range;

/// What is wrong with a number.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum NumberError {
    /// The letters after the digits are no unit; where they start in the word.
    Unit { at: usize },
    /// An integer of more than 64 bits.
    IntTooLarge,
    /// A float beyond the largest one.
    FloatTooLarge,
}

/// The value of `1_000`, `.5`, `1e-3`, `90deg`.
pub(crate) fn number(word: &str) -> Result<Number, NumberError> {
    let bytes = word.as_bytes();
    let digits = |from: usize| {
        let more = bytes[from..].iter();
        from + more
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
            .ok_or(NumberError::Unit { at: end })?,
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

/// Red, green, blue and opacity of `#rgb`, `#rrggbb` or `#rrggbbaa`; nothing if it is none of these.
pub(crate) fn color(word: &str) -> Option<[u8; 4]> {
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

/// The text between the quotes with `\n`, `\t`, `\\` and `\"` resolved, and the places of escapes
/// that are not known.
pub(crate) fn text(word: &str) -> (String, Vec<Range<usize>>) {
    let inner = word.strip_prefix('"').unwrap_or(word);
    let inner = inner.strip_suffix('"').unwrap_or(inner);
    let mut value = String::with_capacity(inner.len());
    let mut unknown = Vec::new();
    let mut chars = inner.char_indices();
    while let Some((at, c)) = chars.next() {
        if c != '\\' {
            value.push(c);
            continue;
        }
        match chars.next() {
            Some((_, 'n')) => value.push('\n'),
            Some((_, 't')) => value.push('\t'),
            Some((_, c @ ('\\' | '"'))) => value.push(c),
            Some((_, c)) => unknown.push(at + 1..at + 2 + c.len_utf8()),
            None => {}
        }
    }
    (value, unknown)
}

/// An integer without, a float with a dot or an exponent; then the unit.
pub(crate) fn number_text(number: &Number) -> String {
    let unit = number.unit.suffix();
    match number.value {
        NumberValue::Int(value) => format!("{value}{unit}"),
        NumberValue::Float(value) => format!("{value:?}{unit}"),
    }
}

/// `#rrggbb`, or `#rrggbbaa` unless it is opaque.
pub(crate) fn color_text([r, g, b, a]: [u8; 4]) -> String {
    match a {
        255 => format!("#{r:02x}{g:02x}{b:02x}"),
        _ => format!("#{r:02x}{g:02x}{b:02x}{a:02x}"),
    }
}

/// The text in quotes, with escapes.
pub(crate) fn quoted(text: &str) -> String {
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
        let read = |word| number(word).map(|n| (n.value, n.unit));
        assert_eq!(read("1_000"), Ok((Int(1000), Unit::None)));
        assert_eq!(read(".5"), Ok((Float(0.5), Unit::None)));
        assert_eq!(read("1e-3"), Ok((Float(0.001), Unit::None)));
        assert_eq!(read("1e3m"), Ok((Float(1000.0), Unit::M)));
        assert_eq!(read("90deg"), Ok((Int(90), Unit::Deg)));
        assert_eq!(read("0.25turn"), Ok((Float(0.25), Unit::Turn)));
        assert_eq!(read("1in"), Ok((Int(1), Unit::In)));
        assert_eq!(read("200ms"), Ok((Int(200), Unit::Ms)));
        assert_eq!(read("1em"), Err(NumberError::Unit { at: 1 }));
        assert_eq!(read("2_mm"), Ok((Int(2), Unit::Mm)));
        assert_eq!(read("99999999999999999999"), Err(NumberError::IntTooLarge));
        assert_eq!(read("1e999"), Err(NumberError::FloatTooLarge));
    }

    #[test]
    fn colours_have_three_six_or_eight_digits() {
        assert_eq!(color("#f80"), Some([255, 136, 0, 255]));
        assert_eq!(color("#3aA6ff"), Some([0x3a, 0xa6, 0xff, 255]));
        assert_eq!(color("#3aa6ff80"), Some([0x3a, 0xa6, 0xff, 0x80]));
        assert_eq!(color("#3aa6f"), None);
        assert_eq!(color("#3aa6fg"), None);
        assert_eq!(color("#"), None);
    }

    #[test]
    fn escapes_are_resolved_or_located() {
        assert_eq!(text(r#""a\"b\n""#), ("a\"b\n".to_owned(), vec![]));
        let (value, unknown) = text(r#""a\qb""#);
        assert_eq!(value, "ab");
        assert_eq!(unknown.first(), Some(&(2..4)));
    }
}
