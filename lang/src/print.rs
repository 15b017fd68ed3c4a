//! Canonical text of a tree, independent of the original layout.
//!
//! Constructs that fit on a line are on one line. Others are broken at their outermost brackets, operators
//! or dots. Parentheses are kept, and so is one blank line between statements.
//!
//! A comment between the elements of a list, block, chain or body keeps its position. Any other comment
//! moves in front of the element around it ([`comments`]). Printing is idempotent.

mod comments;
mod flat;

use crate::ast::*;
use crate::literal;
use crate::span::Span;
use comments::{Comments, PlacedComment};
use flat::FlatPrinter;

/// Maximum number of characters in a line that can be broken.
const MAX_LINE_CHARS: usize = 100;

/// Formats a tree as text that parses to the same tree.
pub fn print(file: &File) -> String {
    let mut printer = Printer {
        comments: Comments::new(file),
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

/// Treatment of blank lines between elements on separate lines.
#[derive(Clone, Copy, PartialEq)]
enum BlankLines {
    /// Keeps one blank line where the source has at least one.
    Keep,
    /// Removes blank lines.
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

    /// Returns the number of characters that fit on the current line.
    fn room(&self) -> usize {
        let line = self.text.rfind('\n').map_or(0, |index| index + 1);
        // In a very long line, only its length in bytes is checked, since no room remains either way.
        let is_far = self.text.len() - line > 4 * MAX_LINE_CHARS;
        let used_chars = match is_far {
            true => MAX_LINE_CHARS,
            false => self.text[line..].chars().count(),
        };
        MAX_LINE_CHARS.saturating_sub(used_chars)
    }

    /// Writes on the current line if the text fits there, with `trailing_chars` characters reserved after
    /// it. Returns whether it fits.
    fn try_flat(
        &mut self,
        span: Span,
        trailing_chars: usize,
        write: impl FnOnce(&mut FlatPrinter) -> Option<()>,
    ) -> bool {
        if self.comments.has_inside(span) {
            return false;
        }
        let mut flat = FlatPrinter::new(self.room().saturating_sub(trailing_chars));
        let fits = write(&mut flat).is_some();
        if fits {
            self.text.push_str(flat.text());
        }
        fits
    }

    // Elements on separate lines.

    fn file(&mut self, file: &'a File) {
        let mut last_end = None;
        for item in &file.items {
            self.element(item.span, &mut last_end, BlankLines::Keep, |printer| {
                printer.item(item);
            });
        }
        if let Some(result) = &file.result {
            self.element(result.span, &mut last_end, BlankLines::Keep, |printer| {
                printer.expr(result, 0);
            });
        }
        self.dangling(file.span.end, &mut last_end, BlankLines::Keep);
        if !self.text.is_empty() {
            self.text.push('\n');
        }
    }

    /// Writes the comments before an element, the element, and the comments after it.
    ///
    /// `last_end` is the end of the previous element.
    fn element(
        &mut self,
        span: Span,
        last_end: &mut Option<u32>,
        blanks: BlankLines,
        write: impl FnOnce(&mut Self),
    ) {
        self.element_without_trailing(span, last_end, blanks, write);
        self.trailing(span.end, last_end);
    }

    /// Writes the comments before an element, then the element.
    ///
    /// The last link of a chain ends where the chain ends, so the comments after it are written with the
    /// chain.
    fn element_without_trailing(
        &mut self,
        span: Span,
        last_end: &mut Option<u32>,
        blanks: BlankLines,
        write: impl FnOnce(&mut Self),
    ) {
        for comment in self.comments.leading(span.start) {
            self.comment_line(comment, last_end, blanks);
        }
        self.blank_line(span.start, *last_end, blanks);
        self.newline();
        write(self);
        *last_end = Some(span.end);
    }

    fn comment_line(
        &mut self,
        comment: PlacedComment<'a>,
        last_end: &mut Option<u32>,
        blanks: BlankLines,
    ) {
        self.blank_line(comment.start, *last_end, blanks);
        self.newline();
        self.push(&comment.text());
        *last_end = Some(comment.end);
    }

    fn trailing(&mut self, end: u32, last_end: &mut Option<u32>) {
        for comment in self.comments.trailing(end) {
            self.push(" ");
            self.push(&comment.text());
            *last_end = Some(comment.end);
        }
    }

    /// Writes the comments between the last element and the closing bracket.
    fn dangling(&mut self, closer: u32, last_end: &mut Option<u32>, blanks: BlankLines) {
        for comment in self.comments.dangling(closer) {
            self.comment_line(comment, last_end, blanks);
        }
    }

    fn blank_line(&mut self, start: u32, last_end: Option<u32>, blanks: BlankLines) {
        let Some(last_end) = last_end else { return };
        let lines = &self.trivia.blank_lines;
        let first_line = lines.partition_point(|line| *line < last_end);
        let is_blank = lines.get(first_line).is_some_and(|line| *line < start);
        if blanks == BlankLines::Keep && is_blank {
            self.text.push('\n');
        }
    }

    /// Writes `open`, each element on its line with a comma, and `close`.
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
            let mut last_end = None;
            for element in elements {
                printer.element(
                    span_of(element),
                    &mut last_end,
                    BlankLines::Drop,
                    |printer| {
                        write(printer, element);
                        printer.push(",");
                    },
                );
            }
            printer.dangling(closer, &mut last_end, BlankLines::Drop);
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
                self.params(&function.params, function.params_span);
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
                self.push(&literal::quote(&import.path));
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
        if self.try_flat(span, 0, |flat| flat.fields(&block.fields)) {
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

    /// Writes parameters, on one line unless there are comments among them.
    fn params(&mut self, params: &'a [FnParam], span: Span) {
        if self.comments.has_inside(span) {
            let closer = span.end - 1;
            return self.broken("(", params, |param| param.span, closer, ")", Self::param);
        }
        self.push("(");
        for (index, param) in params.iter().enumerate() {
            self.push(if index == 0 { "" } else { ", " });
            self.param(param);
        }
        self.push(")");
    }

    fn param(&mut self, param: &'a FnParam) {
        self.push(&typed(&param.name, &param.annotation));
        if let Some(default) = &param.default {
            self.push(" = ");
            self.expr(default, 1);
        }
    }

    // Bodies.

    fn body(&mut self, body: &'a Body, trailing_chars: usize) {
        if !body.braced {
            return self.expr(&body.result, trailing_chars);
        }
        if !self.try_flat(body.span, trailing_chars, |flat| flat.body(body)) {
            self.broken_body(body);
        }
    }

    fn broken_body(&mut self, body: &'a Body) {
        self.push("{");
        self.indented(|printer| {
            let mut last_end = None;
            for statement in &body.statements {
                printer.element(statement.span, &mut last_end, BlankLines::Keep, |printer| {
                    match &statement.kind {
                        StatementKind::Let(binding) => printer.binding(binding),
                        StatementKind::Expr(value) => {
                            printer.expr(value, 1);
                            printer.push(";");
                        }
                    }
                });
            }
            printer.element(
                body.result.span,
                &mut last_end,
                BlankLines::Keep,
                |printer| {
                    printer.expr(&body.result, 0);
                },
            );
            printer.dangling(body.span.end - 1, &mut last_end, BlankLines::Keep);
        });
        self.newline();
        self.push("}");
    }

    // Expressions.

    fn expr(&mut self, expr: &'a Expr, trailing_chars: usize) {
        if self.try_flat(expr.span, trailing_chars, |flat| flat.expr(expr)) {
            return;
        }
        match &expr.kind {
            ExprKind::Number(_)
            | ExprKind::Color(_)
            | ExprKind::Text(_)
            | ExprKind::Bool(_)
            | ExprKind::Path(_) => {
                let mut flat = FlatPrinter::new(usize::MAX);
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
                self.expr(inner, trailing_chars + 1);
                self.push(")");
            }
            ExprKind::Call(call) => {
                self.push(&call.callee.to_string());
                self.args(&call.args, call.args_span, trailing_chars);
            }
            ExprKind::Postfix(postfix) => self.postfix(postfix, trailing_chars),
            ExprKind::Unary(unary) => {
                self.push(unary.op.symbol());
                self.expr(&unary.operand, trailing_chars);
            }
            ExprKind::Chain(chain) => self.chain(chain, trailing_chars),
            ExprKind::Range(range) => {
                self.expr(&range.start, 3);
                self.push(range_symbol(range.inclusive));
                self.expr(&range.end, trailing_chars);
            }
            ExprKind::If(branch) => {
                for (index, arm) in branch.arms.iter().enumerate() {
                    self.push(if index == 0 { "if " } else { " else if " });
                    self.expr(&arm.condition, 2);
                    self.push(" ");
                    self.broken_body(&arm.body);
                }
                self.push(" else ");
                self.broken_body(&branch.else_body);
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
                self.params(&lambda.params, lambda.params_span);
                self.push(" => ");
                self.body(&lambda.body, trailing_chars);
            }
        }
    }

    fn args(&mut self, args: &'a [Arg], span: Span, trailing_chars: usize) {
        if self.try_flat(span, trailing_chars, |flat| flat.args("(", args, ")")) {
            return;
        }
        self.broken("(", args, |arg| arg.span, span.end - 1, ")", Self::arg);
    }

    /// Writes arguments on one line, as for a blend.
    fn args_in_line(&mut self, args: &'a [Arg], open: &str, close: &str) {
        self.push(open);
        for (index, arg) in args.iter().enumerate() {
            self.push(if index == 0 { "" } else { ", " });
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

    fn chain(&mut self, chain: &'a Chain, trailing_chars: usize) {
        self.expr(&chain.first, 0);
        let mut last_end = None;
        self.indented(|printer| {
            let mut end = chain.first.span.end;
            for (index, link) in chain.links.iter().enumerate() {
                printer.trailing(end, &mut last_end);
                let trailing_chars = if index + 1 == chain.links.len() {
                    trailing_chars
                } else {
                    0
                };
                let span = link.op_span.to(link.operand.span);
                printer.element_without_trailing(
                    span,
                    &mut last_end,
                    BlankLines::Drop,
                    |printer| {
                        printer.push(link.op.symbol());
                        if let Some(blend) = &link.blend {
                            printer.args_in_line(&blend.args, "[", "]");
                        }
                        printer.push(" ");
                        printer.expr(&link.operand, trailing_chars);
                    },
                );
                end = span.end;
            }
        });
    }

    /// Writes suffixes. A single method stays on the line, and several have a line each.
    fn postfix(&mut self, postfix: &'a Postfix, trailing_chars: usize) {
        let methods = postfix.suffixes.iter().filter(|s| s.args.is_some());
        let in_line = methods.count() < 2;
        self.expr(&postfix.base, 0);
        let mut last_end = None;
        self.indented(|printer| {
            let mut end = postfix.base.span.end;
            for suffix in &postfix.suffixes {
                let stays_on_line = in_line || suffix.args.is_none();
                let write = |printer: &mut Self| {
                    printer.push(".");
                    printer.push(&suffix.name.name);
                    if let Some(args) = &suffix.args {
                        printer.args(&args.args, args.span, trailing_chars);
                    }
                };
                let has_comment = printer.comments.has_between(end, suffix.span.start);
                printer.trailing(end, &mut last_end);
                if stays_on_line && !has_comment {
                    if in_line {
                        printer.indent -= 1;
                        write(printer);
                        printer.indent += 1;
                    } else {
                        write(printer);
                    }
                } else {
                    printer.element_without_trailing(
                        suffix.span,
                        &mut last_end,
                        BlankLines::Drop,
                        write,
                    );
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
