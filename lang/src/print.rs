//! The canonical text of a tree: one layout for one tree, whatever the author's was.
//!
//! What fits on a line stands on one; what does not is broken at its outermost brackets, operators
//! or dots. Parentheses stay where they were written, and so does one blank line between statements.
//! Comments go back to where they stood between the elements of a list, block, chain or body; one in
//! any other place moves in front of the element around it ([`comments`]). Printing what was printed
//! changes nothing.

mod comments;
mod flat;

use crate::ast::*;
use crate::literal;
use crate::span::Span;
use comments::{Comments, Placed};
use flat::Flat;

/// The most characters of a line, where there is a choice.
const WIDTH: usize = 100;

/// Writes a tree as text that parses to the same tree.
pub fn print(file: &File) -> String {
    let mut printer = Printer {
        comments: Comments::place(file),
        trivia: &file.trivia,
        text: String::new(),
        indent: 0,
    };
    printer.file(file);
    printer.text
}

struct Printer<'a> {
    comments: Comments<'a>,
    trivia: &'a Trivia,
    text: String,
    indent: usize,
}

/// What stands between two elements that have a line of their own.
#[derive(Clone, Copy, PartialEq)]
enum Blanks {
    /// One blank line where the author left some.
    Keep,
    /// None.
    Drop,
}

impl<'a> Printer<'a> {
    fn push(&mut self, text: &str) {
        self.text.push_str(text);
    }

    fn newline(&mut self) {
        if !self.text.is_empty() {
            self.text.push('\n');
        }
        self.text.extend(std::iter::repeat_n("    ", self.indent));
    }

    fn indented(&mut self, write: impl FnOnce(&mut Self)) {
        self.indent += 1;
        write(self);
        self.indent -= 1;
    }

    /// How many characters the current line has room for.
    fn room(&self) -> usize {
        let line = self.text.rfind('\n').map_or(0, |at| at + 1);
        // Only the last part of a very long line is looked at: there is no room either way.
        let far = self.text.len() - line > 4 * WIDTH;
        let used = match far {
            true => WIDTH,
            false => self.text[line..].chars().count(),
        };
        WIDTH.saturating_sub(used)
    }

    /// Writes something on the current line if it fits there with `after` characters behind it.
    fn fits(
        &mut self,
        span: Span,
        after: usize,
        write: impl FnOnce(&mut Flat) -> Option<()>,
    ) -> bool {
        if self.comments.any_inside(span) {
            return false;
        }
        let mut flat = Flat::new(self.room().saturating_sub(after));
        let fits = write(&mut flat).is_some();
        if fits {
            self.text.push_str(flat.text());
        }
        fits
    }

    // Elements with a line of their own.

    fn file(&mut self, file: &'a File) {
        let mut last = None;
        for item in &file.items {
            self.element(item.span, &mut last, Blanks::Keep, |printer| {
                printer.item(item);
            });
        }
        if let Some(result) = &file.result {
            self.element(result.span, &mut last, Blanks::Keep, |printer| {
                printer.expr(result, 0);
            });
        }
        self.dangling(file.span.end, &mut last, Blanks::Keep);
        if !self.text.is_empty() {
            self.text.push('\n');
        }
    }

    /// Comments, the element, comments behind it. `last` is where the element before ended.
    fn element(
        &mut self,
        span: Span,
        last: &mut Option<u32>,
        blanks: Blanks,
        write: impl FnOnce(&mut Self),
    ) {
        self.element_alone(span, last, blanks, write);
        self.trailing(span.end, last);
    }

    /// Comments, then the element. The last link of a chain ends where the chain ends, so what is
    /// behind it belongs to whoever writes the chain.
    fn element_alone(
        &mut self,
        span: Span,
        last: &mut Option<u32>,
        blanks: Blanks,
        write: impl FnOnce(&mut Self),
    ) {
        for comment in self.comments.leading(span.start) {
            self.own_line(comment, last, blanks);
        }
        self.gap(span.start, *last, blanks);
        self.newline();
        write(self);
        *last = Some(span.end);
    }

    fn own_line(&mut self, comment: Placed<'a>, last: &mut Option<u32>, blanks: Blanks) {
        self.gap(comment.start, *last, blanks);
        self.newline();
        self.push(&comment.text());
        *last = Some(comment.end);
    }

    fn trailing(&mut self, end: u32, last: &mut Option<u32>) {
        for comment in self.comments.trailing(end) {
            self.push(" ");
            self.push(&comment.text());
            *last = Some(comment.end);
        }
    }

    /// Comments between the last element and the closing bracket.
    fn dangling(&mut self, closer: u32, last: &mut Option<u32>, blanks: Blanks) {
        for comment in self.comments.dangling(closer) {
            self.own_line(comment, last, blanks);
        }
    }

    fn gap(&mut self, start: u32, last: Option<u32>, blanks: Blanks) {
        let Some(last) = last else { return };
        let lines = &self.trivia.blank_lines;
        let first = lines.partition_point(|line| *line < last);
        let is_blank = lines.get(first).is_some_and(|line| *line < start);
        if blanks == Blanks::Keep && is_blank {
            self.text.push('\n');
        }
    }

    /// `open`, each element on its line with a comma, `close`.
    fn broken<T>(
        &mut self,
        open: &str,
        elements: &'a [T],
        span_of: impl Fn(&T) -> Span,
        closer: u32,
        close: &str,
        mut write: impl FnMut(&mut Self, &'a T),
    ) {
        self.push(open);
        self.indented(|printer| {
            let mut last = None;
            for element in elements {
                printer.element(span_of(element), &mut last, Blanks::Drop, |printer| {
                    write(printer, element);
                    printer.push(",");
                });
            }
            printer.dangling(closer, &mut last, Blanks::Drop);
        });
        self.newline();
        self.push(close);
    }

    // Items.

    fn item(&mut self, item: &'a Item) {
        match &item.kind {
            ItemKind::Param(param) => {
                self.push("param ");
                self.push(&typed(&param.name, &param.annotation));
                self.push(" = ");
                self.expr(&param.value, 1);
                if let Some(range) = &param.range {
                    self.push(" in ");
                    self.expr(&range.start, 1);
                    self.push(range_symbol(range.inclusive));
                    self.expr(&range.end, 1);
                    if let Some(step) = &range.step {
                        self.push(" by ");
                        self.expr(step, 1);
                    }
                }
                self.push(";");
            }
            ItemKind::Let(binding) => self.binding(binding),
            ItemKind::Fn(function) => {
                self.push("fn ");
                self.push(&function.name.name);
                self.params(&function.params);
                if let Some(result) = &function.result {
                    self.push(" -> ");
                    self.push(&result.name);
                }
                if function.body.braced {
                    self.push(" ");
                    self.body(&function.body, 0);
                } else {
                    self.push(" = ");
                    self.expr(&function.body.result, 1);
                    self.push(";");
                }
            }
            ItemKind::Part(part) => {
                self.push("part ");
                self.push(&part.name.name);
                self.push(" = ");
                self.expr(&part.value, 1);
                self.push(";");
            }
            ItemKind::Import(import) => {
                self.push("import ");
                self.push(&literal::quoted(&import.path));
                self.push(" as ");
                self.push(&import.alias.name);
                self.push(";");
            }
            ItemKind::Block(block) => self.block(block, item.span),
            ItemKind::Expr(value) => {
                self.expr(value, 1);
                self.push(";");
            }
        }
    }

    fn block(&mut self, block: &'a Block, span: Span) {
        self.push(&block.kind.name);
        self.push(" ");
        if let Some(name) = &block.name {
            self.push(&name.name);
            self.push(" ");
        }
        if self.fits(span, 0, |flat| flat.fields(&block.fields)) {
            return;
        }
        self.broken(
            "{",
            &block.fields,
            |field| field.span,
            span.end - 1,
            "}",
            |printer, field| {
                printer.push(&field.name.name);
                printer.push(": ");
                printer.expr(&field.value, 1);
            },
        );
    }

    fn binding(&mut self, binding: &'a Let) {
        self.push("let ");
        self.push(&typed(&binding.name, &binding.annotation));
        self.push(" = ");
        self.expr(&binding.value, 1);
        self.push(";");
    }

    fn params(&mut self, params: &'a [FnParam]) {
        self.push("(");
        for (at, param) in params.iter().enumerate() {
            self.push(if at == 0 { "" } else { ", " });
            self.push(&typed(&param.name, &param.annotation));
            if let Some(default) = &param.default {
                self.push(" = ");
                self.expr(default, 1);
            }
        }
        self.push(")");
    }

    // Bodies.

    fn body(&mut self, body: &'a Body, after: usize) {
        if !body.braced {
            return self.expr(&body.result, after);
        }
        if !self.fits(body.span, after, |flat| flat.body(body)) {
            self.broken_body(body);
        }
    }

    fn broken_body(&mut self, body: &'a Body) {
        self.push("{");
        self.indented(|printer| {
            let mut last = None;
            for statement in &body.statements {
                printer.element(
                    statement.span,
                    &mut last,
                    Blanks::Keep,
                    |printer| match &statement.kind {
                        StatementKind::Let(binding) => printer.binding(binding),
                        StatementKind::Expr(value) => {
                            printer.expr(value, 1);
                            printer.push(";");
                        }
                    },
                );
            }
            printer.element(body.result.span, &mut last, Blanks::Keep, |printer| {
                printer.expr(&body.result, 0);
            });
            printer.dangling(body.span.end - 1, &mut last, Blanks::Keep);
        });
        self.newline();
        self.push("}");
    }

    // Expressions.

    fn expr(&mut self, expr: &'a Expr, after: usize) {
        if self.fits(expr.span, after, |flat| flat.expr(expr)) {
            return;
        }
        match &expr.kind {
            ExprKind::Number(_)
            | ExprKind::Color(_)
            | ExprKind::Text(_)
            | ExprKind::Bool(_)
            | ExprKind::Path(_) => {
                let mut flat = Flat::new(usize::MAX);
                flat.expr(expr);
                self.push(flat.text());
            }
            ExprKind::List(items) => self.broken(
                "[",
                items,
                |item| item.span,
                expr.span.end - 1,
                "]",
                |printer, item| printer.expr(item, 1),
            ),
            ExprKind::Paren(inner) => {
                self.push("(");
                self.expr(inner, after + 1);
                self.push(")");
            }
            ExprKind::Call(call) => {
                self.push(&call.callee.to_string());
                self.args(&call.args, call.args_span, after);
            }
            ExprKind::Postfix(postfix) => self.postfix(postfix, after),
            ExprKind::Unary(unary) => {
                self.push(unary.op.symbol());
                self.expr(&unary.operand, after);
            }
            ExprKind::Chain(chain) => self.chain(chain, after),
            ExprKind::Range(range) => {
                self.expr(&range.start, 3);
                self.push(range_symbol(range.inclusive));
                self.expr(&range.end, after);
            }
            ExprKind::If(branch) => {
                for (at, arm) in branch.arms.iter().enumerate() {
                    self.push(if at == 0 { "if " } else { " else if " });
                    self.expr(&arm.condition, 2);
                    self.push(" ");
                    self.broken_body(&arm.body);
                }
                self.push(" else ");
                self.broken_body(&branch.otherwise);
            }
            ExprKind::For(each) => {
                self.push("for ");
                self.push(&each.name.name);
                self.push(" in ");
                self.expr(&each.range, 2);
                self.push(" ");
                self.broken_body(&each.body);
            }
            ExprKind::BlendScope(scope) => {
                self.push("blend");
                self.args_in_line(&scope.blend.args, "(", ")");
                self.push(" ");
                self.broken_body(&scope.body);
            }
            ExprKind::Lambda(lambda) => {
                self.push("fn");
                self.params(&lambda.params);
                self.push(" => ");
                self.body(&lambda.body, after);
            }
        }
    }

    fn args(&mut self, args: &'a [Arg], span: Span, after: usize) {
        if self.fits(span, after, |flat| flat.args("(", args, ")")) {
            return;
        }
        self.broken("(", args, |arg| arg.span, span.end - 1, ")", Self::arg);
    }

    /// Arguments that are never spread over lines: those of a blend.
    fn args_in_line(&mut self, args: &'a [Arg], open: &str, close: &str) {
        self.push(open);
        for (at, arg) in args.iter().enumerate() {
            self.push(if at == 0 { "" } else { ", " });
            self.arg(arg);
        }
        self.push(close);
    }

    fn arg(&mut self, arg: &'a Arg) {
        if let Some(name) = &arg.name {
            self.push(&name.name);
            self.push(": ");
        }
        self.expr(&arg.value, 1);
    }

    fn chain(&mut self, chain: &'a Chain, after: usize) {
        self.expr(&chain.first, 0);
        let mut last = None;
        self.indented(|printer| {
            let mut end = chain.first.span.end;
            for (at, link) in chain.rest.iter().enumerate() {
                printer.trailing(end, &mut last);
                let after = if at + 1 == chain.rest.len() { after } else { 0 };
                let span = link.op_span.to(link.operand.span);
                printer.element_alone(span, &mut last, Blanks::Drop, |printer| {
                    printer.push(link.op.symbol());
                    if let Some(blend) = &link.blend {
                        printer.args_in_line(&blend.args, "[", "]");
                    }
                    printer.push(" ");
                    printer.expr(&link.operand, after);
                });
                end = span.end;
            }
        });
    }

    /// One method stays on its line; of several, each has its own.
    fn postfix(&mut self, postfix: &'a Postfix, after: usize) {
        let methods = postfix.suffixes.iter().filter(|s| s.args.is_some());
        let in_line = methods.count() < 2;
        self.expr(&postfix.base, 0);
        let mut last = None;
        self.indented(|printer| {
            let mut end = postfix.base.span.end;
            for suffix in &postfix.suffixes {
                let stays = in_line || suffix.args.is_none();
                let write = |printer: &mut Self| {
                    printer.push(".");
                    printer.push(&suffix.name.name);
                    if let Some(args) = &suffix.args {
                        printer.args(&args.args, args.span, after);
                    }
                };
                let commented = printer.comments.any_between(end, suffix.span.start);
                printer.trailing(end, &mut last);
                if stays && !commented {
                    if in_line {
                        printer.indent -= 1;
                        write(printer);
                        printer.indent += 1;
                    } else {
                        write(printer);
                    }
                } else {
                    printer.element_alone(suffix.span, &mut last, Blanks::Drop, write);
                }
                end = suffix.span.end;
            }
        });
    }
}

fn typed(name: &Ident, annotation: &Option<TypeName>) -> String {
    match annotation {
        Some(annotation) => format!("{}: {}", name.name, annotation.name),
        None => name.name.clone(),
    }
}
