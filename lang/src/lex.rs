//! Text to words: drives the lexer, keeps comments and blank lines aside, and reports what is wrong
//! with single words. A word that was reported is replaced by a good one of its kind, so that it is
//! reported once.

use crate::ast::{Comment, CommentKind, Trivia, Unit};
use crate::codes;
use crate::diagnostic::{Diagnostic, MAX_SHOWN};
use crate::literal::{self, NumberError};
use crate::span::{FileId, Span};
use crate::token::Token;
use logos::Logos;

/// A word between its first byte and the byte after its last, as the parser wants it.
pub(crate) type Word<'s> = (u32, Token<'s>, u32);

/// What a text consists of.
pub(crate) struct Lexed<'s> {
    pub(crate) words: Vec<Word<'s>>,
    pub(crate) trivia: Trivia,
    pub(crate) errors: Vec<Diagnostic>,
}

/// Splits a text into words. The text is shorter than 4 GiB.
pub(crate) fn lex(file: FileId, text: &str) -> Lexed<'_> {
    let mut lexed = Lexed {
        words: Vec::with_capacity(text.len() / 3),
        trivia: lines(text),
        errors: Vec::new(),
    };
    let mut lexer = Token::lexer(text);
    while let Some(result) = lexer.next() {
        let slice = lexer.slice();
        let token = result.unwrap_or(Token::Unknown(slice));
        let range = lexer.span();
        let (start, end) = (range.start as u32, range.end as u32);
        let span = Span::new(file, start, end);
        match token {
            Token::LineComment(comment) | Token::BlockComment(comment) => {
                lexed.comment(text, comment, span);
            }
            Token::SubBlend if !lexed.after_operand() => {
                // A sign before a list: `-[1, 2, 3]`.
                lexed.words.push((start, Token::Minus, start + 1));
                lexed.words.push((start + 1, Token::OpenBracket, end));
            }
            Token::Unknown(_) => lexed.unknown(text, span),
            _ => {
                let token = lexed.checked(token, span);
                lexed.words.push((start, token, end));
            }
        }
    }
    lexed
}

fn lines(text: &str) -> Trivia {
    let mut trivia = Trivia::default();
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        trivia.lines.push(start);
        if line.trim().is_empty() {
            trivia.blank_lines.push(start);
        }
        start += line.len() as u32;
    }
    trivia
}

impl<'s> Lexed<'s> {
    fn after_operand(&self) -> bool {
        self.words
            .last()
            .is_some_and(|(_, token, _)| token.ends_operand())
    }

    /// Nobody reads more messages than these.
    fn report(&mut self, error: Diagnostic) {
        if self.errors.len() < 2 * MAX_SHOWN {
            self.errors.push(error);
        }
    }

    fn comment(&mut self, text: &str, comment: &str, span: Span) {
        let lines = &self.trivia.lines;
        let line = lines[lines.partition_point(|line| *line <= span.start) - 1];
        let before = &text[line as usize..span.start as usize];
        let kind = if comment.starts_with("/*") {
            CommentKind::Block
        } else if comment.starts_with("///") && !comment.starts_with("////") {
            CommentKind::Doc
        } else {
            CommentKind::Line
        };
        if kind == CommentKind::Block && (comment.len() < 4 || !comment.ends_with("*/")) {
            let opener = Span::new(span.file, span.start, span.start + 2);
            self.report(
                Diagnostic::error(codes::E0104, opener, "this comment never ends")
                    .primary("opened here")
                    .help("end it with `*/`"),
            );
        }
        self.trivia.comments.push(Comment {
            kind,
            text: comment.to_owned(),
            own_line: before.chars().all(char::is_whitespace),
            span: Span {
                end: span.start + comment.len() as u32,
                ..span
            },
        });
    }

    /// The word itself if it is good, else a report and a good word of the same kind.
    fn checked(&mut self, token: Token<'s>, span: Span) -> Token<'s> {
        match token {
            Token::Number(word) => match literal::number(word) {
                Ok(_) => token,
                Err(error) => {
                    self.report(wrong_number(word, error, span));
                    Token::Number("0")
                }
            },
            Token::Color(word) => match literal::color(word) {
                Some(_) => token,
                None => {
                    self.report(
                        Diagnostic::error(codes::E0107, span, format!("`{word}` is no colour"))
                            .primary(wrong_color(word))
                            .help("a colour is `#rgb`, `#rrggbb` or `#rrggbbaa`"),
                    );
                    Token::Color("#000")
                }
            },
            Token::Text(word) => {
                self.check_text(word, span);
                token
            }
            Token::SingleQuoted(word) => {
                let inner = &word[1..word.len() - 1];
                self.report(
                    Diagnostic::error(codes::E0103, span, "a string stands in double quotes").fix(
                        span,
                        format!("\"{inner}\""),
                        "use double quotes",
                    ),
                );
                Token::Text("\"\"")
            }
            _ => token,
        }
    }

    fn check_text(&mut self, word: &str, span: Span) {
        let closed = word.len() > 1 && word.ends_with('"') && !escapes_last(word);
        if !closed {
            self.report(
                Diagnostic::error(codes::E0103, span, "this string never ends")
                    .primary("a `\"` is missing before the end of the line")
                    .help("a line break in a string is written `\\n`"),
            );
            return;
        }
        for place in literal::text(word).1 {
            let escape = Span::new(
                span.file,
                span.start + place.start as u32,
                span.start + place.end as u32,
            );
            let shown = &word[place];
            self.report(
                Diagnostic::error(codes::E0108, escape, format!("`{shown}` means nothing"))
                    .help("a string knows `\\n`, `\\t`, `\\\\` and `\\\"`"),
            );
        }
    }

    /// One report for a run of characters that belong to no word.
    fn unknown(&mut self, text: &'s str, span: Span) {
        // Logos may stop inside a character, or give the bytes of one in pieces.
        let start = text.floor_char_boundary(span.start as usize);
        let end = text.ceil_char_boundary(span.end as usize);
        let span = Span::new(span.file, start as u32, end as u32);
        match self.words.last_mut() {
            Some((first, token @ Token::Unknown(_), last)) if *last >= span.start => {
                *last = span.end.max(*last);
                *token = Token::Unknown(&text[*first as usize..*last as usize]);
            }
            _ => self
                .words
                .push((span.start, Token::Unknown(&text[start..end]), span.end)),
        }
    }
}

/// Whether the closing quote is escaped: an odd number of backslashes before it.
fn escapes_last(word: &str) -> bool {
    let inner = &word[1..word.len() - 1];
    let backslashes = inner.bytes().rev().take_while(|b| *b == b'\\').count();
    backslashes % 2 == 1
}

fn wrong_color(word: &str) -> String {
    let digits = &word[1..];
    match digits.chars().find(|c| !c.is_ascii_hexdigit()) {
        Some(c) => format!("`{c}` is not a hexadecimal digit"),
        None => match digits.len() {
            1 => "1 digit".to_owned(),
            count => format!("{count} digits"),
        },
    }
}

fn wrong_number(word: &str, error: NumberError, span: Span) -> Diagnostic {
    match error {
        NumberError::Unit { at } => {
            let suffix = &word[at..];
            let place = Span {
                start: span.start + at as u32,
                ..span
            };
            let found = Diagnostic::error(codes::E0106, place, format!("`{suffix}` is no unit"));
            match meant(suffix) {
                Some(unit) => found.primary(format!("did you mean `{unit}`?")).fix(
                    place,
                    unit,
                    format!("write `{}{unit}`", &word[..at]),
                ),
                None => {
                    let units: Vec<_> = Unit::ALL.iter().map(|unit| unit.suffix()).collect();
                    found
                        .primary("not known")
                        .help(format!("the units are {}", units.join(", ")))
                        .help(format!("a product is written `{} * {suffix}`", &word[..at]))
                }
            }
        }
        NumberError::IntTooLarge => {
            Diagnostic::error(codes::E0105, span, "this integer is too large")
                .primary(format!("the largest is {}", i64::MAX))
                .help("a number with a dot or an exponent may be larger: `1e20`")
        }
        NumberError::FloatTooLarge => {
            Diagnostic::error(codes::E0105, span, "this number is too large")
                .primary("the largest is about 1.8e308")
        }
    }
}

/// The unit that a wrong suffix most likely stands for.
fn meant(suffix: &str) -> Option<&'static str> {
    let lower = suffix.to_ascii_lowercase();
    let known = match lower.as_str() {
        "degree" | "degrees" => Some("deg"),
        "turns" | "rev" | "tau" => Some("turn"),
        "radian" | "radians" | "rads" => Some("rad"),
        "millimeter" | "millimeters" | "millimetre" | "millimetres" => Some("mm"),
        "inch" | "inches" => Some("in"),
        "meter" | "meters" | "metre" | "metres" => Some("m"),
        "sec" | "secs" | "second" | "seconds" => Some("s"),
        "msec" | "millis" | "milliseconds" => Some("ms"),
        _ => None,
    };
    let by_spelling = || {
        Unit::ALL
            .iter()
            .map(|unit| unit.suffix())
            .map(|unit| (strsim::damerau_levenshtein(&lower, unit), unit))
            .filter(|(distance, unit)| *distance == 0 || *distance == 1 && unit.len() > 2)
            .min_by_key(|(distance, _)| *distance)
            .map(|(_, unit)| unit)
    };
    known.or_else(by_spelling)
}
