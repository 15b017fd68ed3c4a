//! Mistakes with operators: those of other languages, confusion of `=` and `==`, and missing operands.

use super::{ErrorContext, Mistake, PLACEHOLDER_VALUE, Repair};
use crate::codes;
use crate::diagnostic::Diagnostic;
use crate::lex::SpannedToken;
use crate::token::Token;

/// Explains the conditional operator of C: `c ? a : b`.
pub(super) fn conditional(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    (context.token_at(0) == Some(Token::Question)).then(|| Mistake {
        diagnostic: Diagnostic::error(codes::E0119, context.span(0), "there is no `?:`")
            .help("write `if c { a } else { b }`, which is an expression"),
        index: context.index,
        repair: Repair::RemoveStatement,
    })
}

/// Explains operators of other languages: `^`, `**`, `===`, `!==`, `<>`, `++`.
pub(super) fn foreign_operator(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let span = context.span(0);
    let error = |message: &str| Diagnostic::error(codes::E0119, span, message);
    let (diagnostic, repair) = match context.token_at(0)? {
        Token::Caret => (
            error("there is no `^`")
                .help("a power is `pow(a, b)`; the symmetric difference of shapes is `xor(a, b)`"),
            Repair::Replace(Token::Star),
        ),
        Token::StarStar => (
            error("there is no `**`").help("a power is `pow(a, b)`"),
            Repair::Replace(Token::Star),
        ),
        Token::TripleEqual => (
            error("there is no `===`").fix(span, "==", "write `==`"),
            Repair::Replace(Token::Equal),
        ),
        Token::NotDoubleEqual => (
            error("there is no `!==`").fix(span, "!=", "write `!=`"),
            Repair::Replace(Token::NotEqual),
        ),
        Token::LessGreater => (
            error("there is no `<>`").fix(span, "!=", "write `!=`"),
            Repair::Replace(Token::NotEqual),
        ),
        Token::PlusPlus => (
            error("there is no `++`").help("names never change; a sum is `a + b`"),
            Repair::RemoveStatement,
        ),
        _ => return None,
    };
    Some(Mistake {
        diagnostic,
        index: context.index,
        repair,
    })
}

/// Explains operators written as words: `a and b`, `a or b`, `a mod b`, `not a`.
pub(super) fn word_operator(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    if !context.expects_operator() {
        return None;
    }
    let (back, token, symbol) = match (context.token_at(-1), context.token_at(0)?) {
        (_, Token::Name("and")) => (0, Token::Both, "&&"),
        (_, Token::Name("or")) => (0, Token::Either, "||"),
        (_, Token::Name("mod")) => (0, Token::Percent, "%"),
        (Some(Token::Name("not")), next) if next.starts_operand() => (-1, Token::Not, "!"),
        _ => return None,
    };
    let index = context.relative_index(back)?;
    let span = context.token_span(index);
    let word = context.slice(span);
    Some(Mistake {
        diagnostic: Diagnostic::error(
            codes::E0119,
            span,
            format!("`{word}` is written `{symbol}`"),
        )
        .fix(span, symbol, format!("write `{symbol}`")),
        index,
        repair: Repair::Replace(token),
    })
}

/// Explains `=` in place of `:` or `==` within arguments and settings: `cylinder(r = 1)`,
/// `camera { fov = 35deg }`.
pub(super) fn assignment_in_call(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    if context.token_at(0)? != Token::Assign {
        return None;
    }
    let Some(Token::Name(_)) = context.token_at(-1) else {
        return None;
    };
    let opener = context.opener(context.index)?;
    let is_in_settings = context.is_in_settings();
    let is_call = match context.tokens[opener].1 {
        Token::OpenParen | Token::OrBlend | Token::AndBlend | Token::SubBlend => true,
        Token::OpenBrace => is_in_settings,
        _ => false,
    };
    let is_first = context.relative_index(-2)? == opener || context.token_at(-2)? == Token::Comma;
    if !is_call || !is_first {
        return None;
    }
    let called = opener.checked_sub(1).map(|index| context.tokens[index].1);
    if called == Some(Token::Name("assert")) {
        return Some(comparison_mistake(context));
    }
    let message = match is_in_settings {
        true => "settings use `:`",
        false => "named arguments use `:`",
    };
    let signs = named_arguments(&context.tokens[..context.end], context.index);
    let mut edits: Vec<_> = signs
        .iter()
        .map(|sign| {
            let (name, value) = (sign - 1, sign + 1);
            let gap = context.token_span(name).at_end();
            let end = match value < context.end {
                true => context.token_span(value).at_start(),
                false => context.token_span(*sign).at_end(),
            };
            (gap.to(end), ": ".to_owned())
        })
        .collect();
    let mut text = format!("write `{}: …`", context.slice(context.span(-1)));
    let has = |names: [&str; 2]| {
        signs
            .iter()
            .any(|sign| names.contains(&context.slice(context.token_span(sign - 1))))
    };
    let has_two_radii = has(["r1", "d1"]) && has(["r2", "d2"]);
    if called == Some(Token::Name("cylinder")) && has_two_radii {
        edits.insert(0, (context.token_span(opener - 1), "cone".to_owned()));
        text += "; with two radii, it is a `cone`";
    }
    Some(Mistake {
        diagnostic: Diagnostic::error(codes::E0117, context.span(0), message)
            .primary("`=` introduces names")
            .fix_all(edits, text),
        index: context.index,
        repair: Repair::NameArguments,
    })
}

/// Returns the indices of the `=` after names of arguments, from a first one to the end of its brackets.
pub(crate) fn named_arguments(tokens: &[SpannedToken<'_>], first: usize) -> Vec<usize> {
    let mut signs = vec![first];
    let mut depth = 0;
    for index in first + 1..tokens.len() {
        match tokens[index].1 {
            token if token.closer().is_some() => depth += 1,
            token if token.is_closer() => depth -= 1,
            Token::Assign if depth == 0 => {
                let before = [tokens[index - 2].1, tokens[index - 1].1];
                if let [Token::Comma, Token::Name(_)] = before {
                    signs.push(index);
                }
            }
            _ => {}
        }
        if depth < 0 {
            break;
        }
    }
    signs
}

/// Explains `=` in the condition of an `if`: `if a = 1 { … }`.
pub(super) fn assignment_in_condition(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    if context.token_at(0)? != Token::Assign {
        return None;
    }
    let mut back = (context.start..context.index).rev();
    let in_condition = back
        .find(|index| {
            let token = context.tokens[*index].1;
            matches!(
                token,
                Token::If | Token::OpenBrace | Token::CloseBrace | Token::Semicolon | Token::Let
            )
        })
        .is_some_and(|index| context.tokens[index].1 == Token::If);
    in_condition.then(|| comparison_mistake(context))
}

fn comparison_mistake(context: &ErrorContext<'_, '_>) -> Mistake {
    let span = context.span(0);
    Mistake {
        diagnostic: Diagnostic::error(codes::E0120, span, "`=` does not compare").fix(
            span,
            "==",
            "write `==`",
        ),
        index: context.index,
        repair: Repair::Replace(Token::Equal),
    }
}

/// Explains another operator in place of the `=` of a definition: `let a == 1;`, `let a := 1;`.
pub(super) fn comparison_for_assignment(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let is_other = matches!(
        context.token_at(0)?,
        Token::Equal | Token::ColonAssign | Token::FatArrow | Token::TripleEqual
    );
    (is_other && context.expects("=")).then(|| {
        let span = context.span(0);
        let message = match context.token_at(0) {
            Some(Token::Equal) => "`==` compares; a value is given with `=`".to_owned(),
            _ => format!("a value is given with `=`, not {}", context.found_text()),
        };
        Mistake {
            diagnostic: Diagnostic::error(codes::E0120, span, message).fix(span, "=", "write `=`"),
            index: context.index,
            repair: Repair::Replace(Token::Assign),
        }
    })
}

/// Explains assignments to a name or a component that exists: `a += 1`, `a.b = 1`.
pub(super) fn mutation(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let changes = match context.token_at(0)? {
        Token::PlusAssign | Token::MinusAssign | Token::StarAssign | Token::SlashAssign => true,
        Token::Assign => context.expects_operator(),
        _ => false,
    };
    changes.then(|| Mistake {
        diagnostic: Diagnostic::error(codes::E0119, context.span(0), "names never change")
            .primary(format!("so there is no {} here", context.found_text()))
            .help("a new value gets a name with `let`; it may be the same name"),
        index: context.index,
        repair: Repair::RemoveStatement,
    })
}

/// Explains brackets for an index: `p[0]`.
pub(super) fn indexing(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let applies = context.token_at(0)? == Token::OpenBracket
        && context.expects_operator()
        && context.span(-1).end == context.span(0).start;
    applies.then(|| Mistake {
        diagnostic: Diagnostic::error(codes::E0130, context.span(0), "nothing is indexed").help(
            "a vector's components are `.x`, `.y`, `.z`; lists go through `for`, `map`, `fold`",
        ),
        index: context.index,
        repair: Repair::RemoveStatement,
    })
}

/// Explains several values in parentheses: a list, `(1, 2, 3)`, or a lambda without `fn`, `(p, n) => …`.
pub(super) fn tuple(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let open = context.opener(context.index)?;
    let follows_element = !matches!(context.token_at(-1)?, Token::Comma | Token::OpenParen);
    let is_tuple = context.token_at(0)? == Token::Comma
        && follows_element
        && context.tokens[open].1 == Token::OpenParen
        && context.expects(")");
    if !is_tuple {
        return None;
    }
    let close = (context.index..context.end).find(|index| {
        context.tokens[*index].1 == Token::CloseParen && context.opener(*index) == Some(open)
    })?;
    let arrow = close + 1;
    let is_lambda = matches!(
        context.tokens.get(arrow).map(|word| word.1),
        Some(Token::FatArrow | Token::ThinArrow)
    );
    let insertion = super::lambdas::insertion_of_fn(context, open);
    let (open, close) = (context.token_span(open), context.token_span(close));
    let diagnostic = match (is_lambda, insertion) {
        (true, Some(insertion)) => super::lambdas::missing_fn_error(open).fix_all(
            [insertion, (context.token_span(arrow), "=>".to_owned())],
            "write `fn(…) => …`",
        ),
        (true, None) => super::lambdas::missing_fn_error(open),
        (false, _) => Diagnostic::error(codes::E0132, open.to(close), "a list stands in `[ ]`")
            .fix_all(
                [(open, "[".to_owned()), (close, "]".to_owned())],
                "write brackets",
            ),
    };
    Some(Mistake {
        diagnostic,
        index: context.index,
        repair: Repair::RemoveStatement,
    })
}

/// Explains `+` as a sign: `+1`.
pub(super) fn plus_sign(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let applies = context.token_at(0)? == Token::Plus
        && context.expects_operand()
        && context.token_at(1).is_some_and(Token::starts_operand);
    applies.then(|| {
        let span = context.span(0);
        Mistake {
            diagnostic: Diagnostic::error(codes::E0119, span, "`+` is not a sign").fix(
                span,
                "",
                "leave it out",
            ),
            index: context.index,
            repair: Repair::Remove,
        }
    })
}

/// Explains a missing operand: `a + ;`, `let r = ;`, `a | | b`.
pub(super) fn missing_operand(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    if !context.expects_operand() || context.expects("}") {
        return None;
    }
    let token = context.token_at(0);
    let is_missing = match token {
        None => true,
        Some(Token::Not | Token::Minus) => false,
        Some(Token::CloseParen | Token::CloseBracket | Token::CloseBrace) => true,
        Some(Token::Semicolon | Token::Comma | Token::OpenBrace) => true,
        Some(_) => is_operator(token),
    };
    let found_text = context.found_text();
    is_missing.then(|| {
        let gap = context.span(0);
        let message = format!("expected an expression, found {found_text}");
        let mut diagnostic = Diagnostic::error(codes::E0101, gap, message);
        if is_operator(context.token_at(-1)) || context.token_at(-1) == Some(Token::Assign) {
            let operator = context.span(-1);
            let symbol = context.slice(operator);
            diagnostic = diagnostic.label(operator, format!("`{symbol}` has no right side"));
        }
        Mistake {
            diagnostic,
            index: context.index,
            repair: Repair::Insert(PLACEHOLDER_VALUE),
        }
    })
}

fn is_operator(token: Option<Token<'_>>) -> bool {
    matches!(
        token,
        Some(
            Token::Plus
                | Token::Minus
                | Token::Star
                | Token::Slash
                | Token::Percent
                | Token::Or
                | Token::And
                | Token::Either
                | Token::Both
                | Token::Not
                | Token::Equal
                | Token::NotEqual
                | Token::Less
                | Token::LessEqual
                | Token::Greater
                | Token::GreaterEqual
                | Token::DotDot
                | Token::DotDotEqual
                | Token::OrBlend
                | Token::AndBlend
                | Token::SubBlend
        )
    )
}
