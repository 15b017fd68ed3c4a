//! What to say where the grammar cannot go on, and how to mend it for the rest of the file.
//!
//! The parser gives the word at which it stopped and the kinds of words it would have taken. The
//! rules below are tried in order; each knows one mistake that people make and looks at a few words
//! around the place. The last one says in general words what was expected.

mod names;
mod operators;
mod separators;

use crate::brackets::settings_brace;
use crate::codes;
use crate::diagnostic::Diagnostic;
use crate::lex::Word;
use crate::span::{FileId, Span};
use crate::token::Token;

/// Where the parser stopped.
pub(crate) struct Context<'c, 's> {
    pub(crate) file: FileId,
    pub(crate) text: &'s str,
    /// The words of the file.
    pub(crate) words: &'c [Word<'s>],
    /// The first word of the item.
    pub(crate) start: usize,
    /// The word that does not fit; `end` if the item ends too early.
    pub(crate) at: usize,
    /// The word after the item.
    pub(crate) end: usize,
    /// What would have fitted, in the grammar's spelling.
    pub(crate) expected: Vec<String>,
}

/// A mistake that was made, and how to go on.
pub(crate) struct Mistake {
    pub(crate) diagnostic: Diagnostic,
    /// The word that the repair is about.
    pub(crate) at: usize,
    pub(crate) repair: Repair,
}

/// A change to the words, so that the rest can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Repair {
    /// Put a word in before the one at the place.
    Insert(Token<'static>),
    /// Put another in its place.
    Replace(Token<'static>),
    /// Take it out.
    Remove,
    /// Take out the statement, setting or item that it belongs to.
    LeaveOut,
}

/// A name or value that is put in where one is missing.
const SOME_NAME: Token<'static> = Token::Name("_");
const SOME_VALUE: Token<'static> = Token::False;

type Rule = fn(&Context<'_, '_>) -> Option<Mistake>;

const RULES: &[Rule] = &[
    stray_character,
    separators::unneeded_semicolon,
    separators::semicolon_between_settings,
    operators::conditional,
    operators::not_ours,
    operators::word,
    operators::assignment_in_call,
    operators::assignment_in_condition,
    operators::comparison_for_assignment,
    operators::fat_arrow,
    names::other_language,
    names::missing_let,
    operators::changing,
    names::item_in_block,
    names::named_lambda,
    names::reserved,
    names::missing,
    names::import_without,
    operators::index,
    operators::tuple,
    separators::missing_operator,
    separators::missing_semicolon,
    separators::missing_colon,
    separators::missing_comma,
    operators::plus_sign,
    operators::missing_operand,
];

/// Finds out what the mistake is.
pub(crate) fn explain(context: &Context<'_, '_>) -> Mistake {
    RULES
        .iter()
        .find_map(|rule| rule(context))
        .unwrap_or_else(|| unexpected(context))
}

impl<'s> Context<'_, 's> {
    /// The word `steps` after the one that does not fit, within the item.
    fn token(&self, steps: isize) -> Option<Token<'s>> {
        self.index(steps).map(|at| self.words[at].1)
    }

    fn index(&self, steps: isize) -> Option<usize> {
        let at = self.at.checked_add_signed(steps)?;
        (self.start..self.end).contains(&at).then_some(at)
    }

    /// The place of the word `steps` after the one that does not fit; the end of the item's last
    /// word if there is none.
    fn span(&self, steps: isize) -> Span {
        match self.index(steps) {
            Some(at) => self.span_of(at),
            None => self.end_before(self.end),
        }
    }

    fn span_of(&self, at: usize) -> Span {
        let (start, _, end) = self.words[at];
        Span::new(self.file, start, end)
    }

    /// The place right after the word before `at`.
    fn end_before(&self, at: usize) -> Span {
        let end = match at.checked_sub(1) {
            Some(before) => self.words[before].2,
            None => 0,
        };
        Span::new(self.file, end, end)
    }

    /// Whether the grammar would have taken a word that is always written the same.
    fn expects(&self, word: &str) -> bool {
        self.expected
            .iter()
            .any(|expected| expected.trim_matches('"') == word)
    }

    /// Whether an expression can start here.
    fn expects_operand(&self) -> bool {
        self.expects("number")
    }

    /// Whether an expression has ended here and an operator could follow.
    fn expects_operator(&self) -> bool {
        self.expects("*")
    }

    /// Whether a name is wanted and nothing else will do.
    fn expects_name(&self) -> bool {
        self.expects("name") && !self.expects_operand() && !self.expects_operator()
    }

    /// Whether the word that does not fit is on a later line than the one before.
    fn on_new_line(&self) -> bool {
        let (Some(before), Some(at)) = (self.index(-1), self.index(0)) else {
            return false;
        };
        let between = self.words[before].2 as usize..self.words[at].0 as usize;
        self.text
            .get(between)
            .is_some_and(|between| between.contains('\n'))
    }

    /// The innermost bracket that is open at a word.
    fn opener(&self, at: usize) -> Option<usize> {
        let mut depth = 0;
        for index in (self.start..at).rev() {
            let token = self.words[index].1;
            if token.is_closer() {
                depth += 1;
            } else if token.closer().is_some() {
                if depth == 0 {
                    return Some(index);
                }
                depth -= 1;
            }
        }
        None
    }

    /// Whether the innermost open bracket is the brace of `camera { … }`.
    fn in_settings(&self) -> bool {
        let item = self.words[self.start..].iter().map(|word| word.1);
        let brace = settings_brace(item).map(|brace| self.start + brace);
        brace.is_some() && brace == self.opener(self.at)
    }

    /// Whether a statement or item begins with a word.
    fn begins_statement(&self, at: usize) -> bool {
        let after_end = || {
            matches!(
                self.words[at - 1].1,
                Token::Semicolon | Token::OpenBrace | Token::CloseBrace
            )
        };
        at == self.start || at > self.start && after_end() && !self.in_settings()
    }

    /// The first word of the statement or item that a word belongs to.
    fn statement_start(&self, at: usize) -> usize {
        let mut depth = 0;
        for index in (self.start..at).rev() {
            let token = self.words[index].1;
            if token.is_closer() {
                depth += 1;
            } else if token.closer().is_some() {
                if depth == 0 && token == Token::OpenBrace {
                    return index + 1;
                }
                depth = (depth - 1).max(0);
            } else if depth == 0 && token == Token::Semicolon {
                return index + 1;
            }
        }
        self.start
    }

    /// The word that does not fit, for a message.
    fn found(&self) -> String {
        match self.token(0) {
            None => "the end of the file".to_owned(),
            Some(Token::Text(_)) => "a string".to_owned(),
            Some(_) => match self.slice(self.span(0)) {
                "" => "the end of the statement".to_owned(),
                word => format!("`{}`", shortened(word)),
            },
        }
    }

    fn slice(&self, span: Span) -> &'s str {
        self.text
            .get(span.start as usize..span.end as usize)
            .unwrap_or_default()
    }
}

/// A word for a message: not longer than a line allows.
fn shortened(word: &str) -> String {
    const LONGEST: usize = 40;
    match word.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &word[..end]),
        None => word.to_owned(),
    }
}

fn stray_character(context: &Context<'_, '_>) -> Option<Mistake> {
    let Some(Token::Unknown(text)) = context.token(0) else {
        return None;
    };
    let span = context.span(0);
    let first = text.chars().next()?;
    let meant = match first {
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
    let message = format!("`{}` means nothing here", shortened(text));
    let found = Diagnostic::error(codes::E0102, span, message);
    let one_character = text.chars().count() == 1;
    let (diagnostic, repair) = match (meant, first) {
        (Some((token, symbol)), _) if one_character => (
            found.fix(span, symbol, format!("write `{symbol}`")),
            Repair::Replace(token),
        ),
        (_, '“' | '”' | '„' | '‘' | '’') => (
            found.help("a string stands between straight quotes: `\"`"),
            Repair::LeaveOut,
        ),
        (_, '\u{a0}' | '\u{200b}' | '\u{2003}' | '\u{3000}') => (
            found
                .primary("an unusual space")
                .fix(span, " ", "write an ordinary space"),
            Repair::Remove,
        ),
        (_, c) if c.is_alphabetic() => (
            found.help("names are written with the letters a to z and A to Z, digits and `_`"),
            Repair::LeaveOut,
        ),
        _ => (found, Repair::LeaveOut),
    };
    Some(Mistake {
        diagnostic,
        at: context.at,
        repair,
    })
}

/// What is said when no rule knows better: the kinds of words that would have fitted.
fn unexpected(context: &Context<'_, '_>) -> Mistake {
    let mut wanted = Vec::new();
    if context.expects_operand() {
        wanted.push("an expression".to_owned());
    } else if context.expects_name() {
        wanted.push("a name".to_owned());
    }
    if context.expects_operator() {
        wanted.push("an operator".to_owned());
    }
    if context.expects("text") && !context.expects_operand() {
        wanted.push("a string".to_owned());
    }
    let rest: &[&str] = match context.expects_operand() {
        true => &["}"],
        false if context.expects_operator() => &[";", ",", ")", "]", "}", "in"],
        false => &[";", ",", ")", "]", "}", "{", "=", ":", "in", "as"],
    };
    let words = rest.iter().filter(|word| context.expects(word));
    wanted.extend(words.map(|word| format!("`{word}`")));
    if !context.expects_operand() && !context.expects_operator() && context.expects("(") {
        wanted.push("`(`".to_owned());
    }
    let found = context.found();
    let message = match wanted.as_slice() {
        [] => format!("{found} does not belong here"),
        [one] => format!("expected {one}, found {found}"),
        [first @ .., last] => {
            let first = &first[..first.len().min(3)];
            format!("expected {} or {last}, found {found}", first.join(", "))
        }
    };
    let mut diagnostic = Diagnostic::error(codes::E0101, context.span(0), message);
    let before = context.token(-1);
    let is_argument = context.token(0).is_some_and(Token::starts_operand);
    if let (Some(Token::Name(name)), true, true) = (before, is_argument, context.expects_operator())
    {
        diagnostic = diagnostic.help(format!("a call has parentheses: `{}(…)`", shortened(name)));
    }
    Mistake {
        diagnostic,
        at: context.at,
        repair: Repair::LeaveOut,
    }
}
