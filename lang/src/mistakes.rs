//! Diagnosis and repair of syntax errors.
//!
//! The parser supplies the token at which it stopped and the kinds of tokens that it accepts there. The
//! rules below are tried in order. Each detects one common mistake from a few tokens around the position.
//! The fallback lists the expected kinds of tokens.

mod foreign;
mod lambdas;
mod names;
mod numbers;
mod operators;
mod prefixes;
mod separators;

use crate::brackets::settings_brace;
use crate::codes;
use crate::diagnostic::Diagnostic;
use crate::lex::SpannedToken;
use crate::span::{FileId, Span};
use crate::token::Token;

pub(crate) use operators::named_arguments;
pub use prefixes::missing_operation;

/// State of the parser at an error.
pub(crate) struct ErrorContext<'c, 's> {
    pub(crate) file: FileId,
    pub(crate) text: &'s str,
    /// Tokens of the file.
    pub(crate) tokens: &'c [SpannedToken<'s>],
    /// Index of the first token of the item.
    pub(crate) start: usize,
    /// Index of the unexpected token, or `end` if the item ends too early.
    pub(crate) index: usize,
    /// Index of the token after the item.
    pub(crate) end: usize,
    /// Accepted tokens, in the grammar's spelling.
    pub(crate) expected: Vec<String>,
}

/// A detected mistake, with a repair.
pub(crate) struct Mistake {
    pub(crate) diagnostic: Diagnostic,
    /// Index of the token that the repair applies to.
    pub(crate) index: usize,
    pub(crate) repair: Repair,
}

/// Change to the tokens that allows parsing to continue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Repair {
    /// Insert a token before the one at the index.
    Insert(Token<'static>),
    /// Replace the token.
    Replace(Token<'static>),
    /// Replace each `=` after the name of an argument, from the token on, by `:`.
    NameArguments,
    /// Remove the token.
    Remove,
    /// Remove the statement, setting or item that contains the token.
    RemoveStatement,
}

/// Name and value that are inserted where one is missing.
const PLACEHOLDER_NAME: Token<'static> = Token::Name("_");
const PLACEHOLDER_VALUE: Token<'static> = Token::False;

type Rule = fn(&ErrorContext<'_, '_>) -> Option<Mistake>;

const RULES: &[Rule] = &[
    stray_character,
    numbers::trailing_dot,
    separators::extra_semicolon,
    separators::semicolon_between_settings,
    operators::conditional,
    operators::foreign_operator,
    operators::word_operator,
    operators::assignment_in_call,
    operators::assignment_in_condition,
    operators::comparison_for_assignment,
    lambdas::missing_fn,
    lambdas::missing_arrow,
    lambdas::bars,
    lambdas::python,
    prefixes::transform_first,
    names::other_language,
    foreign::typed_function,
    prefixes::block_after_call,
    names::missing_let,
    operators::mutation,
    names::item_in_block,
    names::named_lambda,
    names::reserved,
    names::missing,
    names::import_without,
    operators::indexing,
    operators::tuple,
    separators::missing_operator,
    separators::missing_semicolon,
    separators::missing_colon,
    separators::missing_comma,
    operators::plus_sign,
    operators::missing_operand,
];

/// Identifies the mistake.
pub(crate) fn identify(context: &ErrorContext<'_, '_>) -> Mistake {
    RULES
        .iter()
        .find_map(|rule| rule(context))
        .unwrap_or_else(|| unexpected(context))
}

impl<'s> ErrorContext<'_, 's> {
    /// Returns the token `steps` after the unexpected one, within the item.
    fn token_at(&self, steps: isize) -> Option<Token<'s>> {
        self.relative_index(steps).map(|index| self.tokens[index].1)
    }

    fn relative_index(&self, steps: isize) -> Option<usize> {
        let index = self.index.checked_add_signed(steps)?;
        (self.start..self.end).contains(&index).then_some(index)
    }

    /// Returns the span of the token `steps` after the unexpected one, or the end of the item's last token.
    fn span(&self, steps: isize) -> Span {
        match self.relative_index(steps) {
            Some(index) => self.token_span(index),
            None => self.gap_before(self.end),
        }
    }

    fn token_span(&self, index: usize) -> Span {
        let (start, _, end) = self.tokens[index];
        Span::new(self.file, start, end)
    }

    /// Returns the empty span after the token before `index`.
    fn gap_before(&self, index: usize) -> Span {
        let end = match index.checked_sub(1) {
            Some(previous) => self.tokens[previous].2,
            None => 0,
        };
        Span::new(self.file, end, end)
    }

    /// Reports whether the grammar accepts a fixed token here.
    fn expects(&self, word: &str) -> bool {
        self.expected
            .iter()
            .any(|expected| expected.trim_matches('"') == word)
    }

    /// Reports whether an expression can start here.
    fn expects_operand(&self) -> bool {
        self.expects("number")
    }

    /// Reports whether an expression has ended here and an operator may follow.
    fn expects_operator(&self) -> bool {
        self.expects("*")
    }

    /// Reports whether only a name is accepted here.
    fn expects_name(&self) -> bool {
        self.expects("name") && !self.expects_operand() && !self.expects_operator()
    }

    /// Reports whether the unexpected token is on a later line than the previous one.
    fn is_on_new_line(&self) -> bool {
        let (Some(previous), Some(current)) = (self.relative_index(-1), self.relative_index(0))
        else {
            return false;
        };
        let between = self.tokens[previous].2 as usize..self.tokens[current].0 as usize;
        self.text
            .get(between)
            .is_some_and(|between| between.contains('\n'))
    }

    /// Returns the index of the innermost bracket that is open at a token.
    fn opener(&self, index: usize) -> Option<usize> {
        let mut depth = 0;
        for position in (self.start..index).rev() {
            let token = self.tokens[position].1;
            if token.is_closer() {
                depth += 1;
            } else if token.closer().is_some() {
                if depth == 0 {
                    return Some(position);
                }
                depth -= 1;
            }
        }
        None
    }

    /// Returns the index of the bracket that closes the one at a token.
    fn closer(&self, open: usize) -> Option<usize> {
        let mut depth = 0;
        for position in open..self.end {
            let token = self.tokens[position].1;
            if token.closer().is_some() {
                depth += 1;
            } else if token.is_closer() {
                depth -= 1;
                if depth == 0 {
                    return Some(position);
                }
            }
        }
        None
    }

    /// Reports whether the innermost open bracket is the brace of `camera { … }`.
    fn is_in_settings(&self) -> bool {
        let item = self.tokens[self.start..].iter().map(|word| word.1);
        let brace = settings_brace(item).map(|brace| self.start + brace);
        brace.is_some() && brace == self.opener(self.index)
    }

    /// Reports whether a statement or item begins with a token.
    fn starts_statement(&self, index: usize) -> bool {
        let after_end = || {
            matches!(
                self.tokens[index - 1].1,
                Token::Semicolon | Token::OpenBrace | Token::CloseBrace
            )
        };
        index == self.start || index > self.start && after_end() && !self.is_in_settings()
    }

    /// Returns the index of the first token of the statement or item that contains a token.
    fn statement_start(&self, index: usize) -> usize {
        let mut depth = 0;
        for position in (self.start..index).rev() {
            let token = self.tokens[position].1;
            if token.is_closer() {
                depth += 1;
            } else if token.closer().is_some() {
                if depth == 0 && token == Token::OpenBrace {
                    return position + 1;
                }
                depth = (depth - 1).max(0);
            } else if depth == 0 && token == Token::Semicolon {
                return position + 1;
            }
        }
        self.start
    }

    /// Returns the unexpected token for a message.
    fn found_text(&self) -> String {
        match self.token_at(0) {
            None => "the end of the file".to_owned(),
            Some(Token::Text(_)) => "a string".to_owned(),
            Some(_) => match self.slice(self.span(0)) {
                "" => "the end of the statement".to_owned(),
                word => format!("`{}`", shorten(word)),
            },
        }
    }

    fn slice(&self, span: Span) -> &'s str {
        self.text
            .get(span.start as usize..span.end as usize)
            .unwrap_or_default()
    }
}

/// Shortens a token for a message.
fn shorten(word: &str) -> String {
    const MAX_WORD_CHARS: usize = 40;
    match word.char_indices().nth(MAX_WORD_CHARS) {
        Some((end, _)) => format!("{}…", &word[..end]),
        None => word.to_owned(),
    }
}

fn stray_character(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let Some(Token::Unknown(text)) = context.token_at(0) else {
        return None;
    };
    let span = context.span(0);
    let first_char = text.chars().next()?;
    let replacement = match first_char {
        '×' | '·' | '∙' => Some((Token::Star, "*")),
        '÷' => Some((Token::Slash, "/")),
        '−' | '–' | '—' => Some((Token::Minus, "-")),
        '≤' => Some((Token::LessEqual, "<=")),
        '≥' => Some((Token::GreaterEqual, ">=")),
        '≠' => Some((Token::NotEqual, "!=")),
        '∪' => Some((Token::Or, "|")),
        '∩' => Some((Token::And, "&")),
        _ => None,
    };
    let message = format!("`{}` means nothing here", shorten(text));
    let diagnostic = Diagnostic::error(codes::E0102, span, message);
    let one_character = text.chars().count() == 1;
    let (diagnostic, repair) = match (replacement, first_char) {
        (Some((token_at, symbol)), _) if one_character => (
            diagnostic.fix(span, symbol, format!("write `{symbol}`")),
            Repair::Replace(token_at),
        ),
        (_, '“' | '”' | '„' | '‘' | '’') => (
            diagnostic.help("a string stands between straight quotes: `\"`"),
            Repair::RemoveStatement,
        ),
        (_, '\u{a0}' | '\u{200b}' | '\u{2003}' | '\u{3000}') => (
            diagnostic
                .primary("an unusual space")
                .fix(span, " ", "write an ordinary space"),
            Repair::Remove,
        ),
        (_, '$') => (
            diagnostic.help("surfaces are smooth at any size: leave `$fn`, `$fa` and `$fs` out"),
            Repair::RemoveStatement,
        ),
        (_, c) if c.is_alphabetic() => (
            diagnostic.help("names are written with the letters a to z and A to Z, digits and `_`"),
            Repair::RemoveStatement,
        ),
        _ => (diagnostic, Repair::RemoveStatement),
    };
    Some(Mistake {
        diagnostic,
        index: context.index,
        repair,
    })
}

/// Creates the fallback message, which lists the accepted kinds of tokens.
fn unexpected(context: &ErrorContext<'_, '_>) -> Mistake {
    let mut expected = Vec::new();
    if context.expects_operand() {
        expected.push("an expression".to_owned());
    } else if context.expects_name() {
        expected.push("a name".to_owned());
    }
    if context.expects_operator() {
        expected.push("an operator".to_owned());
    }
    if context.expects("text") && !context.expects_operand() {
        expected.push("a string".to_owned());
    }
    let punctuation: &[&str] = match context.expects_operand() {
        true => &["}"],
        false if context.expects_operator() => &[";", ",", ")", "]", "}", "in"],
        false => &[";", ",", ")", "]", "}", "{", "=", ":", "in", "as"],
    };
    let tokens = punctuation.iter().filter(|word| context.expects(word));
    expected.extend(tokens.map(|word| format!("`{word}`")));
    if !context.expects_operand() && !context.expects_operator() && context.expects("(") {
        expected.push("`(`".to_owned());
    }
    let found_text = context.found_text();
    let message = match expected.as_slice() {
        [] => format!("{found_text} does not belong here"),
        [only] => format!("expected {only}, found {found_text}"),
        [first @ .., last] => {
            let first = &first[..first.len().min(3)];
            format!(
                "expected {} or {last}, found {found_text}",
                first.join(", ")
            )
        }
    };
    let mut diagnostic = Diagnostic::error(codes::E0101, context.span(0), message);
    let previous = context.token_at(-1);
    let is_argument = context.token_at(0).is_some_and(Token::starts_operand);
    if let (Some(Token::Name(name)), true, true) =
        (previous, is_argument, context.expects_operator())
    {
        diagnostic = diagnostic.help(format!("a call has parentheses: `{}(…)`", shorten(name)));
    }
    Mistake {
        diagnostic,
        index: context.index,
        repair: Repair::RemoveStatement,
    }
}
