//! Definitions of functions in the notation of shading languages.

use super::{ErrorContext, Mistake, Repair};
use crate::codes;
use crate::diagnostic::Diagnostic;
use crate::span::Span;
use crate::token::Token;
use std::ops::Range;

/// Words before the type of a parameter in shading languages.
const QUALIFIERS: [Token<'static>; 4] = [
    Token::In,
    Token::Name("out"),
    Token::Name("inout"),
    Token::Name("const"),
];

/// Explains functions of shading languages: `float sphere(vec3 p, float r) { return length(p) - r; }`.
pub(super) fn typed_function(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let start = context.relative_index(-2)?;
    let open = context.relative_index(0)?;
    let is_header = matches!(context.token_at(-2), Some(Token::Name(_)))
        && matches!(context.token_at(-1), Some(Token::Name(_)))
        && context.tokens[open].1 == Token::OpenParen
        && context.starts_statement(start);
    let close = context.closer(open)?;
    let brace = close + 1;
    let has_body = brace < context.end && context.tokens[brace].1 == Token::OpenBrace;
    if !is_header || !has_body || context.opener(start).is_some() {
        return None;
    }
    let word = context.token_span(start);
    let message = format!(
        "a function is introduced by `fn`, not by `{}`",
        context.slice(word)
    );
    let diagnostic = Diagnostic::error(codes::E0126, word, message);
    let edits = parameter_edits(context, open + 1..close).map(|parameters| {
        let keyword = (word, "fn".to_owned());
        let result = returned_value(context, brace).unwrap_or_default();
        std::iter::once(keyword).chain(parameters).chain(result)
    });
    let diagnostic = match edits {
        Some(edits) => diagnostic.fix_all(edits, "write `fn`, and the type after each name"),
        None => diagnostic.help("write `fn f(p: vec3, r: float) { … }`"),
    };
    Some(Mistake {
        diagnostic,
        index: context.closer(brace).unwrap_or(context.index),
        repair: Repair::RemoveStatement,
    })
}

/// Returns the edits that write `vec3 p` as `p: vec3`, if all parameters have that form.
fn parameter_edits(
    context: &ErrorContext<'_, '_>,
    parameters: Range<usize>,
) -> Option<Vec<(Span, String)>> {
    let is_comma = |word: &(u32, Token<'_>, u32)| word.1 == Token::Comma;
    let mut edits = Vec::new();
    let mut start = parameters.start;
    for words in context.tokens[parameters].split(is_comma) {
        let end = start + words.len();
        let mut ty = start;
        while ty < end && QUALIFIERS.contains(&context.tokens[ty].1) {
            ty += 1;
        }
        match &context.tokens[ty..end] {
            [] if start == end => {}
            [(_, Token::Name("void"), _)] => edits.push((context.token_span(start), String::new())),
            [(_, Token::Name(_), _)] => {}
            [(_, Token::Name(ty), _), (_, Token::Name(name), _)] => {
                let span = context.token_span(start).to(context.token_span(end - 1));
                edits.push((span, format!("{name}: {ty}")));
            }
            _ => return None,
        }
        start = end + 1;
    }
    Some(edits)
}

/// Returns the edits that leave out the only `return` of a body, if it is the last statement.
fn returned_value(context: &ErrorContext<'_, '_>, brace: usize) -> Option<Vec<(Span, String)>> {
    let end = context.closer(brace)?;
    let mut returns =
        (brace..end).filter(|index| context.tokens[*index].1 == Token::Name("return"));
    let (word, None) = (returns.next()?, returns.next()) else {
        return None;
    };
    let semicolon = end - 1;
    let is_last = context.tokens[semicolon].1 == Token::Semicolon
        && context.opener(word) == Some(brace)
        && !context.tokens[word..semicolon]
            .iter()
            .any(|token| token.1 == Token::Semicolon);
    let value = context
        .token_span(word)
        .to(context.token_span(word + 1).at_start());
    is_last.then(|| {
        vec![
            (value, String::new()),
            (context.token_span(semicolon), String::new()),
        ]
    })
}
