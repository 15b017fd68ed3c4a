//! A tree on one line, given up as soon as it does not fit. A body with statements never fits.

use super::typed;
use crate::ast::*;
use crate::literal;

/// A line that is being written; every step gives nothing once there is no room left.
pub(super) struct Flat {
    text: String,
    room: usize,
}

impl Flat {
    /// An empty line with room for some characters.
    pub(super) fn new(room: usize) -> Self {
        Self {
            text: String::new(),
            room,
        }
    }

    pub(super) fn text(&self) -> &str {
        &self.text
    }

    fn push(&mut self, text: &str) -> Option<()> {
        self.room = self.room.checked_sub(text.chars().count())?;
        self.text.push_str(text);
        Some(())
    }

    fn separated<T>(
        &mut self,
        elements: &[T],
        mut write: impl FnMut(&mut Self, &T) -> Option<()>,
    ) -> Option<()> {
        for (at, element) in elements.iter().enumerate() {
            self.push(if at == 0 { "" } else { ", " })?;
            write(self, element)?;
        }
        Some(())
    }

    /// `{ name: value, … }`
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

    /// `(a, name: b)` or `[…]`
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

    /// `{ value }`, or the value alone if it was written without braces.
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
            ExprKind::Number(number) => self.push(&literal::number_text(number)),
            ExprKind::Color(rgba) => self.push(&literal::color_text(*rgba)),
            ExprKind::Text(text) => self.push(&literal::quoted(text)),
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
                for link in &chain.rest {
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
                for (at, arm) in branch.arms.iter().enumerate() {
                    self.push(if at == 0 { "if " } else { " else if " })?;
                    self.expr(&arm.condition)?;
                    self.push(" ")?;
                    self.body(&arm.body)?;
                }
                self.push(" else ")?;
                self.body(&branch.otherwise)
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
