//! What is wrong with a tree that the grammar accepts: nesting that counts nodes rather than words,
//! a scene whose last expression is dropped by a `;`, values that nobody uses, and operators whose
//! precedence readers get wrong.

use crate::ast::*;
use crate::brackets;
use crate::codes;
use crate::diagnostic::Diagnostic;
use crate::span::Span;

/// The functions that are called for their effect.
const EFFECTS: [&str; 2] = ["assert", "print"];

/// Checks a tree.
pub(crate) fn check(file: &File) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    unused_items(file, &mut found);
    file.for_each_child(&mut |expr| expression(expr, 1, &mut found));
    found
}

/// Recursion is safe: the parser bounds the words that open a level, and a node is at most a dozen
/// nodes below such a word.
fn expression(expr: &Expr, depth: u32, found: &mut Vec<Diagnostic>) {
    if depth > MAX_DEPTH {
        let is_said = |d: &Diagnostic| d.code == codes::E0109;
        if !found.iter().any(is_said) {
            found.push(brackets::too_deep(expr.span.at_start()));
        }
        return;
    }
    if let ExprKind::Chain(chain) = &expr.kind {
        mixed_precedence(chain, found);
    }
    for body in bodies(expr) {
        unused_statements(body, found);
    }
    expr.for_each_child(&mut |child| expression(child, depth + 1, found));
}

fn bodies(expr: &Expr) -> Vec<&Body> {
    match &expr.kind {
        ExprKind::If(branch) => {
            let arms = branch.arms.iter().map(|arm| &arm.body);
            arms.chain([&branch.otherwise]).collect()
        }
        ExprKind::For(each) => vec![&each.body],
        ExprKind::BlendScope(scope) => vec![&scope.body],
        ExprKind::Lambda(lambda) => vec![&lambda.body],
        _ => Vec::new(),
    }
}

fn unused_items(file: &File, found: &mut Vec<Diagnostic>) {
    for (at, item) in file.items.iter().enumerate() {
        match &item.kind {
            ItemKind::Expr(value) if !has_effect(value) => {
                let is_last = at + 1 == file.items.len() && file.result.is_none();
                found.push(match is_last {
                    true => dropped_shape(value, item.span),
                    false => unused(value),
                });
            }
            ItemKind::Fn(function) => unused_statements(&function.body, found),
            _ => {}
        }
    }
}

fn unused_statements(body: &Body, found: &mut Vec<Diagnostic>) {
    for statement in &body.statements {
        match &statement.kind {
            StatementKind::Expr(value) if !has_effect(value) => found.push(unused(value)),
            StatementKind::Expr(_) | StatementKind::Let(_) => {}
        }
    }
}

fn has_effect(value: &Expr) -> bool {
    let is_effect = |name: &Ident| EFFECTS.contains(&name.name.as_str());
    match &value.kind {
        ExprKind::Call(call) => call.callee.as_ident().is_some_and(is_effect),
        ExprKind::Postfix(postfix) => postfix.suffixes.iter().any(|s| is_effect(&s.name)),
        _ => false,
    }
}

fn unused(value: &Expr) -> Diagnostic {
    Diagnostic::warning(codes::W0102, value.span, "this value is not used")
        .primary("thrown away by the `;`")
        .help("give it a name with `let`, or join it to the file's last expression")
}

fn dropped_shape(value: &Expr, item: Span) -> Diagnostic {
    let semicolon = Span {
        start: item.end.max(item.start + 1) - 1,
        ..item
    };
    Diagnostic::error(codes::E0121, semicolon, "the scene ends with a `;`")
        .primary("the `;` drops the shape")
        .label(value.span, "this would be the shape")
        .fix(semicolon, "", "remove the `;`")
}

/// `a | b - c`: a difference directly under a union or intersection.
fn mixed_precedence(chain: &Chain, found: &mut Vec<Diagnostic>) {
    let outer = chain.rest[0].op;
    if !matches!(outer, BinaryOp::Or | BinaryOp::And) {
        return;
    }
    // The first operand stands beside the first operator, every other one behind its own.
    let first = (&chain.first, chain.rest[0].op_span);
    let others = chain.rest.iter().map(|link| (&link.operand, link.op_span));
    for (operand, beside) in std::iter::once(first).chain(others) {
        let ExprKind::Chain(inner) = &operand.kind else {
            continue;
        };
        let Some(minus) = inner.rest.iter().find(|link| link.op == BinaryOp::Sub) else {
            continue;
        };
        let symbol = outer.symbol();
        let is_first = std::ptr::eq(operand, &chain.first);
        let warning = Diagnostic::warning(
            codes::W0101,
            minus.op_span,
            format!("`-` and `{symbol}` are mixed without parentheses"),
        )
        .primary("this binds tighter")
        .label(beside, "than this")
        .fix_all(
            [
                (operand.span.at_start(), "(".to_owned()),
                (operand.span.at_end(), ")".to_owned()),
            ],
            "parentheses show what it means",
        );
        found.push(match is_first {
            true => warning,
            false => warning.help(format!(
                "put them around the `{symbol}` instead to subtract from all of it"
            )),
        });
    }
}
