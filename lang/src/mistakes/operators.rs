//! Mistakes with operators: those of other languages, `=` and `==` taken for each other, operators
//! without an operand.

use super::{Context, Mistake, Repair, SOME_VALUE};
use crate::codes;
use crate::diagnostic::Diagnostic;
use crate::token::Token;

/// `c ? a : b`
pub(super) fn conditional(context: &Context<'_, '_>) -> Option<Mistake> {
    (context.token(0) == Some(Token::Question)).then(|| Mistake {
        diagnostic: Diagnostic::error(codes::E0119, context.span(0), "there is no `?:`")
            .help("write `if c { a } else { b }`, which is an expression"),
        at: context.at,
        repair: Repair::LeaveOut,
    })
}

/// `^`, `**`, `===`, `<>`, `++`
pub(super) fn not_ours(context: &Context<'_, '_>) -> Option<Mistake> {
    let span = context.span(0);
    let error = |message: &str| Diagnostic::error(codes::E0119, span, message);
    let (diagnostic, repair) = match context.token(0)? {
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
            Repair::LeaveOut,
        ),
        _ => return None,
    };
    Some(Mistake {
        diagnostic,
        at: context.at,
        repair,
    })
}

/// `a and b`, `not a`
pub(super) fn word(context: &Context<'_, '_>) -> Option<Mistake> {
    if !context.expects_operator() {
        return None;
    }
    let (back, token, symbol) = match (context.token(-1), context.token(0)?) {
        (_, Token::Name("and")) => (0, Token::Both, "&&"),
        (_, Token::Name("or")) => (0, Token::Either, "||"),
        (_, Token::Name("mod")) => (0, Token::Percent, "%"),
        (Some(Token::Name("not")), after) if after.starts_operand() => (-1, Token::Not, "!"),
        _ => return None,
    };
    let at = context.index(back)?;
    let span = context.span_of(at);
    let word = context.slice(span);
    Some(Mistake {
        diagnostic: Diagnostic::error(
            codes::E0119,
            span,
            format!("`{word}` is written `{symbol}`"),
        )
        .fix(span, symbol, format!("write `{symbol}`")),
        at,
        repair: Repair::Replace(token),
    })
}

/// `cylinder(r = 1)`, `camera { fov = 35deg }`
pub(super) fn assignment_in_call(context: &Context<'_, '_>) -> Option<Mistake> {
    if context.token(0)? != Token::Assign {
        return None;
    }
    let Some(Token::Name(_)) = context.token(-1) else {
        return None;
    };
    let opener = context.opener(context.at)?;
    let in_settings = context.in_settings();
    let is_call = match context.words[opener].1 {
        Token::OpenParen | Token::OrBlend | Token::AndBlend | Token::SubBlend => true,
        Token::OpenBrace => in_settings,
        _ => false,
    };
    let is_first = context.index(-2)? == opener || context.token(-2)? == Token::Comma;
    if !is_call || !is_first {
        return None;
    }
    let called = opener.checked_sub(1).map(|at| context.words[at].1);
    if called == Some(Token::Name("assert")) {
        return Some(compared(context));
    }
    let what = match in_settings {
        true => "settings use `:`",
        false => "named arguments use `:`",
    };
    let (name, value) = (context.span(-1), context.span(1));
    let whole = context.span(0);
    let between = crate::span::Span::new(name.file, name.end, value.start.max(whole.end));
    Some(Mistake {
        diagnostic: Diagnostic::error(codes::E0117, whole, what)
            .primary("`=` introduces names")
            .fix(between, ": ", format!("write `{}: …`", context.slice(name))),
        at: context.at,
        repair: Repair::Replace(Token::Colon),
    })
}

/// `if a = 1 { … }`
pub(super) fn assignment_in_condition(context: &Context<'_, '_>) -> Option<Mistake> {
    if context.token(0)? != Token::Assign {
        return None;
    }
    let mut back = (context.start..context.at).rev();
    let in_condition = back
        .find(|at| {
            let token = context.words[*at].1;
            matches!(
                token,
                Token::If | Token::OpenBrace | Token::CloseBrace | Token::Semicolon | Token::Let
            )
        })
        .is_some_and(|at| context.words[at].1 == Token::If);
    in_condition.then(|| compared(context))
}

fn compared(context: &Context<'_, '_>) -> Mistake {
    let span = context.span(0);
    Mistake {
        diagnostic: Diagnostic::error(codes::E0120, span, "`=` does not compare").fix(
            span,
            "==",
            "write `==`",
        ),
        at: context.at,
        repair: Repair::Replace(Token::Equal),
    }
}

/// `let a == 1;`, `let a := 1;`
pub(super) fn comparison_for_assignment(context: &Context<'_, '_>) -> Option<Mistake> {
    let is_other = matches!(
        context.token(0)?,
        Token::Equal | Token::ColonAssign | Token::FatArrow | Token::TripleEqual
    );
    (is_other && context.expects("=")).then(|| {
        let span = context.span(0);
        let message = match context.token(0) {
            Some(Token::Equal) => "`==` compares; a value is given with `=`".to_owned(),
            _ => format!("a value is given with `=`, not {}", context.found()),
        };
        Mistake {
            diagnostic: Diagnostic::error(codes::E0120, span, message).fix(span, "=", "write `=`"),
            at: context.at,
            repair: Repair::Replace(Token::Assign),
        }
    })
}

const NO_FN: &str = "a lambda begins with `fn`";

/// `p => …`, `(p) => …`
pub(super) fn fat_arrow(context: &Context<'_, '_>) -> Option<Mistake> {
    if context.token(0)? != Token::FatArrow {
        return None;
    }
    let found = Diagnostic::error(codes::E0131, context.span(0), NO_FN);
    let diagnostic = match (context.token(-1), context.index(-1)) {
        (Some(Token::Name(name)), _) => {
            found.fix(context.span(-1), format!("fn({name})"), "write `fn`")
        }
        (Some(Token::CloseParen), Some(close)) => match context.opener(close) {
            Some(open) => found.fix(context.span_of(open).at_start(), "fn", "write `fn`"),
            None => found,
        },
        _ => found,
    };
    Some(Mistake {
        diagnostic,
        at: context.at,
        repair: Repair::LeaveOut,
    })
}

/// `a += 1`, `a.b = 1`
pub(super) fn changing(context: &Context<'_, '_>) -> Option<Mistake> {
    let changes = match context.token(0)? {
        Token::PlusAssign | Token::MinusAssign | Token::StarAssign | Token::SlashAssign => true,
        Token::Assign => context.expects_operator(),
        _ => false,
    };
    changes.then(|| Mistake {
        diagnostic: Diagnostic::error(codes::E0119, context.span(0), "names never change")
            .primary(format!("so there is no {} here", context.found()))
            .help("a new value gets a name with `let`; it may be the same name"),
        at: context.at,
        repair: Repair::LeaveOut,
    })
}

/// `p[0]`
pub(super) fn index(context: &Context<'_, '_>) -> Option<Mistake> {
    let found = context.token(0)? == Token::OpenBracket
        && context.expects_operator()
        && context.span(-1).end == context.span(0).start;
    found.then(|| Mistake {
        diagnostic: Diagnostic::error(codes::E0130, context.span(0), "nothing is indexed").help(
            "a vector's components are `.x`, `.y`, `.z`; lists go through `for`, `map`, `fold`",
        ),
        at: context.at,
        repair: Repair::LeaveOut,
    })
}

/// `(1, 2, 3)`, `(p, n) => …`
pub(super) fn tuple(context: &Context<'_, '_>) -> Option<Mistake> {
    let open = context.opener(context.at)?;
    let is_tuple = context.token(0)? == Token::Comma
        && context.words[open].1 == Token::OpenParen
        && context.expects(")");
    if !is_tuple {
        return None;
    }
    let close = (context.at..context.end).find(|at| {
        context.words[*at].1 == Token::CloseParen && context.opener(*at) == Some(open)
    })?;
    let is_lambda = context.words.get(close + 1).map(|word| word.1) == Some(Token::FatArrow);
    let (open, close) = (context.span_of(open), context.span_of(close));
    let diagnostic = match is_lambda {
        true => {
            Diagnostic::error(codes::E0131, open, NO_FN).fix(open.at_start(), "fn", "write `fn`")
        }
        false => Diagnostic::error(codes::E0132, open.to(close), "a list stands in `[ ]`").fix_all(
            [(open, "[".to_owned()), (close, "]".to_owned())],
            "write brackets",
        ),
    };
    Some(Mistake {
        diagnostic,
        at: context.at,
        repair: Repair::LeaveOut,
    })
}

/// `+1`
pub(super) fn plus_sign(context: &Context<'_, '_>) -> Option<Mistake> {
    let found = context.token(0)? == Token::Plus
        && context.expects_operand()
        && context.token(1).is_some_and(Token::starts_operand);
    found.then(|| {
        let span = context.span(0);
        Mistake {
            diagnostic: Diagnostic::error(codes::E0119, span, "`+` is not a sign").fix(
                span,
                "",
                "leave it out",
            ),
            at: context.at,
            repair: Repair::Remove,
        }
    })
}

/// `a + ;`, `let r = ;`, `a | | b`
pub(super) fn missing_operand(context: &Context<'_, '_>) -> Option<Mistake> {
    if !context.expects_operand() || context.expects("}") {
        return None;
    }
    let token = context.token(0);
    let is_missing = match token {
        None => true,
        Some(Token::Not | Token::Minus) => false,
        Some(Token::CloseParen | Token::CloseBracket | Token::CloseBrace) => true,
        Some(Token::Semicolon | Token::Comma | Token::OpenBrace) => true,
        Some(_) => is_operator(token),
    };
    let found = context.found();
    is_missing.then(|| {
        let place = context.span(0);
        let message = format!("expected an expression, found {found}");
        let mut diagnostic = Diagnostic::error(codes::E0101, place, message);
        if is_operator(context.token(-1)) || context.token(-1) == Some(Token::Assign) {
            let operator = context.span(-1);
            let symbol = context.slice(operator);
            diagnostic = diagnostic.label(operator, format!("`{symbol}` wants a right side"));
        }
        Mistake {
            diagnostic,
            at: context.at,
            repair: Repair::Insert(SOME_VALUE),
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
