//! Checks of a tree that the grammar accepts.
//!
//! They report excessive nesting by nodes, a final expression dropped by a `;`, unused values, and
//! operators with a commonly misread precedence.

use crate::ast::*;
use crate::brackets;
use crate::codes;
use crate::diagnostic::Diagnostic;
use crate::span::Span;

/// Functions that are called for their effect.
const EFFECT_FUNCTIONS: [&str; 2] = ["assert", "print"];

/// Checks a tree, and returns the diagnostics.
pub(crate) fn check(file: &File) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    check_items(file, &mut diagnostics);
    file.for_each_child(&mut |expr| check_expression(expr, 1, &mut diagnostics));
    diagnostics
}

/// Checks an expression and its children.
///
/// Recursion is safe: the parser bounds the tokens that open a level, and a node is at most a dozen nodes
/// below such a token.
fn check_expression(expr: &Expr, depth: u32, diagnostics: &mut Vec<Diagnostic>) {
    if depth > MAX_DEPTH {
        let is_nesting_error = |d: &Diagnostic| d.code == codes::E0109;
        if !diagnostics.iter().any(is_nesting_error) {
            diagnostics.push(brackets::too_deep(expr.span.at_start()));
        }
        return;
    }
    if let ExprKind::Chain(chain) = &expr.kind {
        check_precedence(chain, diagnostics);
    }
    for body in bodies(expr) {
        check_statements(body, diagnostics);
    }
    expr.for_each_child(&mut |child| check_expression(child, depth + 1, diagnostics));
}

fn bodies(expr: &Expr) -> Vec<&Body> {
    match &expr.kind {
        ExprKind::If(branch) => {
            let arms = branch.arms.iter().map(|arm| &arm.body);
            arms.chain([&branch.else_body]).collect()
        }
        ExprKind::For(each) => vec![&each.body],
        ExprKind::BlendScope(scope) => vec![&scope.body],
        ExprKind::Lambda(lambda) => vec![&lambda.body],
        _ => Vec::new(),
    }
}

fn check_items(file: &File, diagnostics: &mut Vec<Diagnostic>) {
    for (index, item) in file.items.iter().enumerate() {
        match &item.kind {
            ItemKind::Expr(value) if !has_effect(value) => {
                let is_last = index + 1 == file.items.len() && file.result.is_none();
                diagnostics.push(match is_last {
                    true => dropped_shape(value, item.span),
                    false => unused_value(value),
                });
            }
            ItemKind::Fn(function) => check_statements(&function.body, diagnostics),
            _ => {}
        }
    }
}

fn check_statements(body: &Body, diagnostics: &mut Vec<Diagnostic>) {
    for statement in &body.statements {
        match &statement.kind {
            StatementKind::Expr(value) if !has_effect(value) => {
                diagnostics.push(unused_value(value))
            }
            StatementKind::Expr(_) | StatementKind::Let(_) => {}
        }
    }
}

fn has_effect(value: &Expr) -> bool {
    let is_effect = |name: &Ident| EFFECT_FUNCTIONS.contains(&name.name.as_str());
    match &value.kind {
        ExprKind::Call(call) => call.callee.as_ident().is_some_and(is_effect),
        ExprKind::Postfix(postfix) => postfix.suffixes.iter().any(|s| is_effect(&s.name)),
        _ => false,
    }
}

fn unused_value(value: &Expr) -> Diagnostic {
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

/// Warns about `a | b - c`: a difference directly under a union or intersection.
fn check_precedence(chain: &Chain, diagnostics: &mut Vec<Diagnostic>) {
    let outer_op = chain.links[0].op;
    if !matches!(outer_op, BinaryOp::Union | BinaryOp::Intersection) {
        return;
    }
    // The first operand is next to the first operator, and every other one follows its own.
    let first = (&chain.first, chain.links[0].op_span);
    let others = chain.links.iter().map(|link| (&link.operand, link.op_span));
    for (operand, adjacent_op) in std::iter::once(first).chain(others) {
        let ExprKind::Chain(inner) = &operand.kind else {
            continue;
        };
        let Some(subtraction) = inner.links.iter().find(|link| link.op == BinaryOp::Sub) else {
            continue;
        };
        let symbol = outer_op.symbol();
        let is_first = std::ptr::eq(operand, &chain.first);
        let warning = Diagnostic::warning(
            codes::W0101,
            subtraction.op_span,
            format!("`-` and `{symbol}` are mixed without parentheses"),
        )
        .primary("this binds tighter")
        .label(adjacent_op, "than this")
        .fix_all(
            [
                (operand.span.at_start(), "(".to_owned()),
                (operand.span.at_end(), ")".to_owned()),
            ],
            "parentheses show what it means",
        );
        diagnostics.push(match is_first {
            true => warning,
            false => warning.help(format!(
                "put them around the `{symbol}` instead to subtract from all of it"
            )),
        });
    }
}
