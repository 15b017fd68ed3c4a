//! Prints a tree on one line, up to a maximum length. A body with statements never fits.

use super::typed;
use crate::ast::*;
use crate::literal;

/// Writer of a line. Every step returns `None` once the line is full.
pub(super) struct FlatPrinter {
    text: String,
    remaining_chars: usize,
}

impl FlatPrinter {
    /// Creates an empty line of at most `remaining_chars` characters.
    pub(super) fn new(remaining_chars: usize) -> Self {
        Self {
            text: String::new(),
            remaining_chars,
        }
    }

    pub(super) fn text(&self) -> &str {
        &self.text
    }

    fn push(&mut self, text: &str) -> Option<()> {
        self.remaining_chars = self.remaining_chars.checked_sub(text.chars().count())?;
        self.text.push_str(text);
        Some(())
    }

    fn separated<T>(
        &mut self,
        elements: &[T],
        mut write: impl FnMut(&mut Self, &T) -> Option<()>,
    ) -> Option<()> {
        for (index, element) in elements.iter().enumerate() {
            self.push(if index == 0 { "" } else { ", " })?;
            write(self, element)?;
        }
        Some(())
    }

    /// Writes `{ name: value, … }`.
    pub(super) fn fields(&mut self, fields: &[Field]) -> Option<()> {
        if fields.is_empty() {
            return self.push("{}");
        }
        self.push("{ ")?;
        self.separated(fields, |flat, field| {
            flat.push(&field.name.name)?;
            flat.push(": ")?;
            flat.expr(&field.value)
        })?;
        self.push(" }")
    }

    /// Writes `(a, name: b)` or `[…]`.
    pub(super) fn args(&mut self, open: &str, args: &[Arg], close: &str) -> Option<()> {
        self.push(open)?;
        self.separated(args, |flat, arg| {
            if let Some(name) = &arg.name {
                flat.push(&name.name)?;
                flat.push(": ")?;
            }
            flat.expr(&arg.value)
        })?;
        self.push(close)
    }

    /// Writes `{ value }`, or only the value if it was written without braces.
    pub(super) fn body(&mut self, body: &Body) -> Option<()> {
        if !body.statements.is_empty() {
            return None;
        }
        if !body.braced {
            return self.expr(&body.result);
        }
        self.push("{ ")?;
        self.expr(&body.result)?;
        self.push(" }")
    }

    pub(super) fn expr(&mut self, expr: &Expr) -> Option<()> {
        match &expr.kind {
            ExprKind::Number(number) => self.push(&literal::format_number(number)),
            ExprKind::Color(rgba) => self.push(&literal::format_color(*rgba)),
            ExprKind::Text(text) => self.push(&literal::quote(text)),
            ExprKind::Bool(true) => self.push("true"),
            ExprKind::Bool(false) => self.push("false"),
            ExprKind::Path(path) => self.push(&path.to_string()),
            ExprKind::List(items) => {
                self.push("[")?;
                self.separated(items, Self::expr)?;
                self.push("]")
            }
            ExprKind::Paren(inner) => {
                self.push("(")?;
                self.expr(inner)?;
                self.push(")")
            }
            ExprKind::Call(call) => {
                self.push(&call.callee.to_string())?;
                self.args("(", &call.args, ")")
            }
            ExprKind::Postfix(postfix) => {
                self.expr(&postfix.base)?;
                for suffix in &postfix.suffixes {
                    self.push(".")?;
                    self.push(&suffix.name.name)?;
                    if let Some(args) = &suffix.args {
                        self.args("(", &args.args, ")")?;
                    }
                }
                Some(())
            }
            ExprKind::Unary(unary) => {
                self.push(unary.op.symbol())?;
                self.expr(&unary.operand)
            }
            ExprKind::Chain(chain) => {
                self.expr(&chain.first)?;
                for link in &chain.links {
                    self.push(" ")?;
                    self.push(link.op.symbol())?;
                    if let Some(blend) = &link.blend {
                        self.args("[", &blend.args, "]")?;
                    }
                    self.push(" ")?;
                    self.expr(&link.operand)?;
                }
                Some(())
            }
            ExprKind::Range(range) => {
                self.expr(&range.start)?;
                self.push(range_symbol(range.inclusive))?;
                self.expr(&range.end)
            }
            ExprKind::If(branch) => {
                for (index, arm) in branch.arms.iter().enumerate() {
                    self.push(if index == 0 { "if " } else { " else if " })?;
                    self.expr(&arm.condition)?;
                    self.push(" ")?;
                    self.body(&arm.body)?;
                }
                self.push(" else ")?;
                self.body(&branch.else_body)
            }
            ExprKind::For(each) => {
                self.push("for ")?;
                self.push(&each.name.name)?;
                self.push(" in ")?;
                self.expr(&each.range)?;
                self.push(" ")?;
                self.body(&each.body)
            }
            ExprKind::BlendScope(scope) => {
                self.push("blend")?;
                self.args("(", &scope.blend.args, ")")?;
                self.push(" ")?;
                self.body(&scope.body)
            }
            ExprKind::Lambda(lambda) => {
                self.push("fn(")?;
                self.separated(&lambda.params, |flat, param| {
                    flat.push(&typed(&param.name, &param.annotation))?;
                    if let Some(default) = &param.default {
                        flat.push(" = ")?;
                        flat.expr(default)?;
                    }
                    Some(())
                })?;
                self.push(") => ")?;
                self.body(&lambda.body)
            }
        }
    }
}
