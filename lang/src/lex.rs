//! Converts text to tokens: runs the lexer, separates comments and blank lines, and reports errors in
//! single tokens.
//!
//! A reported token is replaced by a valid one of its kind, so that it is reported once.

use crate::ast::{Comment, CommentKind, Trivia, Unit};
use crate::codes;
use crate::diagnostic::{Diagnostic, MAX_SHOWN_DIAGNOSTICS};
use crate::literal::{self, NumberError};
use crate::span::{FileId, Span};
use crate::token::Token;
use logos::Logos;
use std::collections::HashSet;

/// A token between the offset of its first byte and the offset after its last, as the parser requires.
pub(crate) type SpannedToken<'s> = (u32, Token<'s>, u32);

/// Directives of preprocessors.
const DIRECTIVES: [&str; 8] = [
    "#define", "#include", "#if", "#ifdef", "#ifndef", "#pragma", "#version", "#undef",
];

/// Result of lexing a text.
pub(crate) struct Lexed<'s> {
    pub(crate) tokens: Vec<SpannedToken<'s>>,
    pub(crate) trivia: Trivia,
    pub(crate) errors: Vec<Diagnostic>,
}

/// Splits a text into tokens. The text is shorter than 4 GiB.
pub(crate) fn lex(file: FileId, text: &str) -> Lexed<'_> {
    let mut lexed = Lexed {
        tokens: Vec::with_capacity(text.len() / 3),
        trivia: line_trivia(text),
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
            Token::SubBlend if !lexed.follows_operand() => {
                // A sign before a list: `-[1, 2, 3]`.
                lexed.tokens.push((start, Token::Minus, start + 1));
                lexed.tokens.push((start + 1, Token::OpenBracket, end));
            }
            Token::Unknown(_) => lexed.unknown(text, span),
            _ => {
                let token = lexed.validate_literal(text, token, span);
                lexed.tokens.push((start, token, end));
            }
        }
    }
    lexed.split_subtracted_lists();
    lexed
}

fn line_trivia(text: &str) -> Trivia {
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

/// An open bracket while lists that are subtracted are found.
struct OpenList {
    index: usize,
    has_comma: bool,
    has_name: bool,
}

impl<'s> Lexed<'s> {
    /// Splits `-[` where it subtracts a list, as in `p-[1, 0, 0]`. A blend has one number or names an argument, or an
    /// operand follows it.
    fn split_subtracted_lists(&mut self) {
        let mut open: Vec<OpenList> = Vec::new();
        let mut lists = HashSet::new();
        for (index, &(_, token, _)) in self.tokens.iter().enumerate() {
            match token {
                _ if token.closer().is_some() => open.push(OpenList {
                    index,
                    has_comma: false,
                    has_name: false,
                }),
                _ if token.is_closer() => {
                    let Some(list) = open.pop() else { continue };
                    let next = self.tokens.get(index + 1);
                    let has_operand = next.is_some_and(|&(_, token, _)| {
                        token.starts_operand() || token == Token::Not
                    });
                    let is_difference = self.tokens[list.index].1 == Token::SubBlend;
                    if is_difference && list.has_comma && !list.has_name && !has_operand {
                        lists.insert(list.index);
                    }
                }
                Token::Comma | Token::Colon => {
                    if let Some(list) = open.last_mut() {
                        list.has_comma |= token == Token::Comma;
                        list.has_name |= token == Token::Colon;
                    }
                }
                _ => {}
            }
        }
        if lists.is_empty() {
            return;
        }
        for (index, word) in std::mem::take(&mut self.tokens).into_iter().enumerate() {
            let (start, _, end) = word;
            if lists.contains(&index) {
                self.tokens.push((start, Token::Minus, start + 1));
                self.tokens.push((start + 1, Token::OpenBracket, end));
            } else {
                self.tokens.push(word);
            }
        }
    }

    fn follows_operand(&self) -> bool {
        self.tokens
            .last()
            .is_some_and(|(_, token, _)| token.ends_operand())
    }

    /// Adds an error, up to twice the number of shown diagnostics.
    fn report(&mut self, error: Diagnostic) {
        if self.errors.len() < 2 * MAX_SHOWN_DIAGNOSTICS {
            self.errors.push(error);
        }
    }

    fn comment(&mut self, text: &str, comment: &str, span: Span) {
        let lines = &self.trivia.lines;
        let line = lines[lines.partition_point(|line| *line <= span.start) - 1];
        let prefix = &text[line as usize..span.start as usize];
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
            own_line: prefix.chars().all(char::is_whitespace),
            span: Span {
                end: span.start + comment.len() as u32,
                ..span
            },
        });
    }

    /// Returns a token if it is valid. Otherwise reports it and returns a valid token of the same kind.
    fn validate_literal(&mut self, text: &str, token: Token<'s>, span: Span) -> Token<'s> {
        match token {
            Token::Number(word) => match literal::parse_number(word) {
                Ok(_) => token,
                Err(error) => {
                    self.report(number_error(word, error, span));
                    Token::Number("0")
                }
            },
            Token::Color(word) => match literal::parse_color(word) {
                Some(_) => token,
                None if DIRECTIVES.contains(&word) => {
                    self.report(directive_error(text, word, span));
                    Token::Color("#000")
                }
                None => {
                    self.report(
                        Diagnostic::error(codes::E0107, span, format!("`{word}` is not a color"))
                            .primary(color_error(word))
                            .help("a color is `#rgb`, `#rrggbb` or `#rrggbbaa`"),
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
        let is_closed = word.len() > 1 && word.ends_with('"') && !is_closing_quote_escaped(word);
        if !is_closed {
            self.report(
                Diagnostic::error(codes::E0103, span, "this string never ends")
                    .primary("a `\"` is missing before the end of the line")
                    .help("a line break in a string is written `\\n`"),
            );
            return;
        }
        for range in literal::parse_text(word).1 {
            let escape = Span::new(
                span.file,
                span.start + range.start as u32,
                span.start + range.end as u32,
            );
            let escape_text = &word[range];
            self.report(
                Diagnostic::error(
                    codes::E0108,
                    escape,
                    format!("`{escape_text}` is not an escape"),
                )
                .help("the escapes of a string are `\\n`, `\\t`, `\\\\` and `\\\"`"),
            );
        }
    }

    /// Adds characters outside of any token, merged with adjacent ones into one unknown token.
    fn unknown(&mut self, text: &'s str, span: Span) {
        // Logos may stop inside a character, or return the bytes of one in pieces.
        let start = text.floor_char_boundary(span.start as usize);
        let end = text.ceil_char_boundary(span.end as usize);
        let span = Span::new(span.file, start as u32, end as u32);
        match self.tokens.last_mut() {
            Some((first, token @ Token::Unknown(_), last)) if *last >= span.start => {
                *last = span.end.max(*last);
                *token = Token::Unknown(&text[*first as usize..*last as usize]);
            }
            _ => self
                .tokens
                .push((span.start, Token::Unknown(&text[start..end]), span.end)),
        }
    }
}

/// Reports whether the closing quote is escaped, by an odd number of backslashes before it.
fn is_closing_quote_escaped(word: &str) -> bool {
    let inner = &word[1..word.len() - 1];
    let backslashes = inner.bytes().rev().take_while(|b| *b == b'\\').count();
    backslashes % 2 == 1
}

/// Creates the error for a directive. A macro is rewritten as a definition.
fn directive_error(text: &str, word: &str, span: Span) -> Diagnostic {
    let error = Diagnostic::error(codes::E0126, span, format!("there is no `{word}`"));
    let rest = text[span.end as usize..].lines().next().unwrap_or_default();
    let code = rest.split("//").next().unwrap_or_default().trim_end();
    match definition(code.trim_start()).filter(|_| word == "#define") {
        Some(definition) => {
            let whole = Span::new(span.file, span.start, span.end + code.len() as u32);
            error.fix(whole, definition, "define it")
        }
        None => {
            error.help("write `let n = 3;`, `fn f(x) = 2 * x;` or `import \"parts.sdf\" as parts;`")
        }
    }
}

/// Returns the definition that corresponds to the macro `NAME value` or `NAME(x) value`.
fn definition(macro_text: &str) -> Option<String> {
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let name_end = macro_text.find(|c| !is_name(c))?;
    let (name, rest) = macro_text.split_at(name_end);
    let (keyword, parameters, value) = match rest.starts_with('(') {
        true => {
            let (parameters, value) = rest.split_at(rest.find(')')? + 1);
            ("fn", parameters, value)
        }
        false => ("let", "", rest),
    };
    let value = value.trim().trim_end_matches(';').trim_end();
    let is_definition = matches!(Token::lexer(name).next(), Some(Ok(Token::Name(_))))
        && !value.is_empty()
        && !value.ends_with('\\');
    is_definition.then(|| format!("{keyword} {name}{parameters} = {value};"))
}

fn color_error(word: &str) -> String {
    let digits = &word[1..];
    match digits.chars().find(|c| !c.is_ascii_hexdigit()) {
        Some(c) => format!("`{c}` is not a hexadecimal digit"),
        None => match digits.len() {
            1 => "1 digit".to_owned(),
            count => format!("{count} digits"),
        },
    }
}

fn number_error(word: &str, error: NumberError, span: Span) -> Diagnostic {
    match error {
        NumberError::Unit { offset } => {
            let suffix = &word[offset..];
            let range = Span {
                start: span.start + offset as u32,
                ..span
            };
            let diagnostic =
                Diagnostic::error(codes::E0106, range, format!("`{suffix}` is not a unit"));
            if matches!(suffix, "f" | "F") {
                return diagnostic
                    .primary("numbers need no mark of their type")
                    .fix(range, "", "leave it out");
            }
            match likely_unit(suffix) {
                Some(unit) => diagnostic.primary(format!("did you mean `{unit}`?")).fix(
                    range,
                    unit,
                    format!("write `{}{unit}`", &word[..offset]),
                ),
                None => {
                    let units: Vec<_> = Unit::ALL.iter().map(|unit| unit.suffix()).collect();
                    diagnostic
                        .primary("not known")
                        .help(format!("the units are {}", units.join(", ")))
                        .help(format!(
                            "a product is written `{} * {suffix}`",
                            &word[..offset]
                        ))
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

/// Returns the unit that an unknown suffix most likely stands for.
fn likely_unit(suffix: &str) -> Option<&'static str> {
    let lower = suffix.to_ascii_lowercase();
    let synonym = match lower.as_str() {
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
    synonym.or_else(by_spelling)
}
