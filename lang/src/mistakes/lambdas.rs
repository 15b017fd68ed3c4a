//! Mistakes in functions without a name: a missing `fn` or `=>`, and the notations of other languages.

use super::{ErrorContext, Mistake, Repair};
use crate::codes;
use crate::diagnostic::Diagnostic;
use crate::span::Span;
use crate::token::Token;

/// Explains lambdas without `fn`: `p => …`, `(p) => …`, `(p) -> …`.
pub(super) fn missing_fn(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let is_arrow = match context.token_at(0)? {
        Token::FatArrow => true,
        Token::ThinArrow => context.expects_operator(),
        _ => false,
    };
    if !is_arrow {
        return None;
    }
    let start = match (context.token_at(-1), context.relative_index(-1)) {
        (Some(Token::Name(name)), _) => Some((context.span(-1), format!("fn({name})"))),
        (Some(Token::CloseParen), Some(close)) => context
            .opener(close)
            .and_then(|open| insertion_of_fn(context, open)),
        _ => None,
    };
    let mut diagnostic = missing_fn_error(context.span(0));
    if let Some(start) = start {
        let arrow = (context.span(0), "=>".to_owned());
        let is_thin = context.token_at(0) == Some(Token::ThinArrow);
        let edits = std::iter::once(start).chain(is_thin.then_some(arrow));
        diagnostic = diagnostic.fix_all(edits, "write `fn`");
    }
    Some(Mistake {
        diagnostic,
        index: context.index,
        repair: Repair::RemoveStatement,
    })
}

/// Returns the edit that writes `fn` before the parameters of a lambda that open at a token. Other languages'
/// keywords are replaced; after other operands there is no such edit.
pub(super) fn insertion_of_fn(
    context: &ErrorContext<'_, '_>,
    open: usize,
) -> Option<(Span, String)> {
    let before = (open > context.start).then(|| open - 1);
    let span = match before.map(|index| (index, context.tokens[index].1)) {
        Some((index, Token::Name("function" | "func" | "lambda" | "def"))) => {
            context.token_span(index)
        }
        Some((_, token)) if token.ends_operand() => return None,
        _ => context.token_span(open).at_start(),
    };
    Some((span, "fn".to_owned()))
}

/// Creates the error for a lambda without `fn`.
pub(super) fn missing_fn_error(span: Span) -> Diagnostic {
    Diagnostic::error(codes::E0131, span, "a lambda begins with `fn`")
}

/// Explains lambdas without `=>`: `fn(p) { … }`, `fn(p) -> float { … }`, `fn(p) = …`, `fn(p): …`.
pub(super) fn missing_arrow(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    if !context.expects("=>") || context.token_at(-1) != Some(Token::CloseParen) {
        return None;
    }
    let token = context.token_at(0)?;
    let here = context.span(0);
    let message = "a function without a name is written `fn(…) => …`";
    let error = Diagnostic::error(codes::E0131, here, message);
    let is_item = context.tokens[context.start].1 == Token::Fn
        && context.opener(context.index - 1) == Some(context.start + 1);
    if token == Token::OpenBrace && is_item {
        let gap = context.token_span(context.start).at_end();
        return Some(Mistake {
            diagnostic: error.fix(gap, " name", "give it a name"),
            index: context.closer(context.index).unwrap_or(context.index),
            repair: Repair::RemoveStatement,
        });
    }
    let arrow = match context.gap_before(context.index).end == here.start {
        true => " =>",
        false => "=>",
    };
    let is_result = matches!(token, Token::ThinArrow | Token::Colon)
        && matches!(context.token_at(1), Some(Token::Name(_)));
    let (diagnostic, repair) = match (token, context.token_at(2)) {
        (_, Some(Token::OpenBrace)) if is_result => (
            error.fix(here.to(context.span(1)), arrow, "leave its type out"),
            Repair::RemoveStatement,
        ),
        (_, Some(Token::FatArrow)) if is_result => (
            error.fix(here.to(context.span(2)), arrow, "leave its type out"),
            Repair::RemoveStatement,
        ),
        (Token::ThinArrow | Token::Assign | Token::Colon, _) => (
            error.fix(here, arrow, "write `=>`"),
            Repair::Replace(Token::FatArrow),
        ),
        (token, _)
            if token.starts_operand() || matches!(token, Token::OpenBrace | Token::Minus) =>
        {
            (
                error.primary("`=>` belongs before the body").fix(
                    here.at_start(),
                    "=> ",
                    "write `=>`",
                ),
                Repair::Insert(Token::FatArrow),
            )
        }
        _ => return None,
    };
    Some(Mistake {
        diagnostic,
        index: context.index,
        repair,
    })
}

/// Explains the lambdas of Rust: `|p| …`.
pub(super) fn bars(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let is_position = matches!(
        context.token_at(-1)?,
        Token::Assign | Token::OpenParen | Token::Comma | Token::Colon
    );
    // At the start of a line or before a space, it joins shapes.
    let touches_name =
        context.token_at(1).is_some() && context.span(0).end == context.span(1).start;
    let starts_lambda = is_position && touches_name && !context.is_on_new_line();
    if context.token_at(0)? != Token::Or || !starts_lambda || !context.expects_operand() {
        return None;
    }
    let close = (context.index + 1..context.end).find(|index| {
        !matches!(
            context.tokens[*index].1,
            Token::Name(_) | Token::Comma | Token::Colon
        )
    })?;
    if context.tokens[close].1 != Token::Or || close == context.index + 1 {
        return None;
    }
    let edits = [
        (context.span(0), "fn(".to_owned()),
        (context.token_span(close), ") =>".to_owned()),
    ];
    Some(Mistake {
        diagnostic: missing_fn_error(context.span(0)).fix_all(edits, "write `fn(…) => …`"),
        index: context.index,
        repair: Repair::RemoveStatement,
    })
}

/// Explains the lambdas of Python: `lambda p: …`.
pub(super) fn python(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let applies = context.token_at(-1) == Some(Token::Name("lambda"))
        && matches!(context.token_at(0), Some(Token::Name(_)));
    if !applies {
        return None;
    }
    let is_param =
        |index: &usize| matches!(context.tokens[*index].1, Token::Name(_) | Token::Comma);
    let colon = (context.index..context.end).find(|index| !is_param(index))?;
    if context.tokens[colon].1 != Token::Colon {
        return None;
    }
    let word = context.span(-1);
    let edits = [
        (
            word.at_start().to(context.span(0).at_start()),
            "fn(".to_owned(),
        ),
        (context.token_span(colon), ") =>".to_owned()),
    ];
    Some(Mistake {
        diagnostic: missing_fn_error(word).fix_all(edits, "write `fn(…) => …`"),
        index: context.index,
        repair: Repair::RemoveStatement,
    })
}
