//! Indented listing of the tree, for `--emit ast` and for tests: one node per line, its children below it.
//!
//! It omits positions and comments, so texts that differ only in layout have equal listings.

use crate::ast::*;
use crate::literal;
use std::fmt::Write;

/// Returns the listing of a tree.
pub fn dump(file: &File) -> String {
    let mut listing = Listing {
        text: String::new(),
        indent: 0,
    };
    for item in &file.items {
        listing.item(item);
    }
    if let Some(result) = &file.result {
        listing.part("result", result);
    }
    listing.text
}

struct Listing {
    text: String,
    indent: usize,
}

impl Listing {
    fn line(&mut self, text: impl AsRef<str>) {
        let indent = 2 * self.indent;
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "{:indent$}{}", "", text.as_ref());
    }

    fn inside(&mut self, write: impl FnOnce(&mut Self)) {
        self.indent += 1;
        write(self);
        self.indent -= 1;
    }

    /// Lists an expression under a label.
    fn part(&mut self, label: &str, expr: &Expr) {
        self.line(label);
        self.inside(|listing| listing.expr(expr));
    }

    fn item(&mut self, item: &Item) {
        for line in item.docs.iter().flat_map(|docs| docs.lines()) {
            self.line(format!("doc {line:?}"));
        }
        match &item.kind {
            ItemKind::Param(param) => {
                self.line(format!("param {}", typed(&param.name, &param.annotation)));
                self.inside(|listing| {
                    listing.expr(&param.value);
                    if let Some(range) = &param.range {
                        listing.line(format!("in {}", range_symbol(range.inclusive)));
                        listing.inside(|listing| {
                            listing.expr(&range.start);
                            listing.expr(&range.end);
                        });
                        if let Some(step) = &range.step {
                            listing.part("by", step);
                        }
                    }
                });
            }
            ItemKind::Let(binding) => self.binding(binding),
            ItemKind::Fn(function) => {
                let result = match &function.result {
                    Some(result) => format!(" -> {}", result.name),
                    None => String::new(),
                };
                self.line(format!("fn {}{result}", function.name.name));
                self.inside(|listing| {
                    listing.params(&function.params);
                    listing.body(&function.body);
                });
            }
            ItemKind::Part(part) => self.part(&format!("part {}", part.name.name), &part.value),
            ItemKind::Import(import) => {
                self.line(format!("import {:?} as {}", import.path, import.alias.name));
            }
            ItemKind::Block(block) => {
                self.line(match &block.name {
                    Some(name) => format!("block {} {}", block.kind.name, name.name),
                    None => format!("block {}", block.kind.name),
                });
                self.inside(|listing| {
                    for field in &block.fields {
                        listing.part(&format!("{}:", field.name.name), &field.value);
                    }
                });
            }
            ItemKind::Expr(value) => self.part("do", value),
        }
    }

    fn binding(&mut self, binding: &Let) {
        let label = format!("let {}", typed(&binding.name, &binding.annotation));
        self.part(&label, &binding.value);
    }

    fn params(&mut self, params: &[FnParam]) {
        for param in params {
            let label = format!("takes {}", typed(&param.name, &param.annotation));
            match &param.default {
                Some(default) => self.part(&label, default),
                None => self.line(label),
            }
        }
    }

    fn body(&mut self, body: &Body) {
        if !body.braced {
            return self.expr(&body.result);
        }
        self.line("{}");
        self.inside(|listing| {
            for statement in &body.statements {
                match &statement.kind {
                    StatementKind::Let(binding) => listing.binding(binding),
                    StatementKind::Expr(value) => listing.part("do", value),
                }
            }
            listing.expr(&body.result);
        });
    }

    fn args(&mut self, args: &[Arg]) {
        for arg in args {
            match &arg.name {
                Some(name) => self.part(&format!("{}:", name.name), &arg.value),
                None => self.expr(&arg.value),
            }
        }
    }

    fn expr(&mut self, expr: &Expr) {
        match &expr.kind {
            ExprKind::Number(number) => self.line(literal::format_number(number)),
            ExprKind::Color(rgba) => self.line(literal::format_color(*rgba)),
            ExprKind::Text(text) => self.line(format!("{text:?}")),
            ExprKind::Bool(value) => self.line(value.to_string()),
            ExprKind::Path(path) => self.line(path.to_string()),
            ExprKind::List(items) => {
                self.line("[]");
                self.inside(|listing| items.iter().for_each(|item| listing.expr(item)));
            }
            ExprKind::Paren(inner) => self.part("()", inner),
            ExprKind::Call(call) => {
                self.line(format!("call {}", call.callee));
                self.inside(|listing| listing.args(&call.args));
            }
            ExprKind::Postfix(postfix) => {
                self.line("chain of .");
                self.inside(|listing| {
                    listing.expr(&postfix.base);
                    for suffix in &postfix.suffixes {
                        let name = &suffix.name.name;
                        match &suffix.args {
                            None => listing.line(format!(".{name}")),
                            Some(args) => {
                                listing.line(format!(".{name}()"));
                                listing.inside(|listing| listing.args(&args.args));
                            }
                        }
                    }
                });
            }
            ExprKind::Unary(unary) => self.part(unary.op.symbol(), &unary.operand),
            ExprKind::Chain(chain) => {
                self.line(format!("chain of {}", chain.links[0].op.symbol()));
                self.inside(|listing| {
                    listing.expr(&chain.first);
                    for link in &chain.links {
                        listing.line(link.op.symbol());
                        listing.inside(|listing| {
                            if let Some(blend) = &link.blend {
                                listing.line("blend");
                                listing.inside(|listing| listing.args(&blend.args));
                            }
                            listing.expr(&link.operand);
                        });
                    }
                });
            }
            ExprKind::Range(range) => {
                self.line(range_symbol(range.inclusive));
                self.inside(|listing| {
                    listing.expr(&range.start);
                    listing.expr(&range.end);
                });
            }
            ExprKind::If(branch) => {
                for (index, arm) in branch.arms.iter().enumerate() {
                    self.part(if index == 0 { "if" } else { "else if" }, &arm.condition);
                    self.line("then");
                    self.inside(|listing| listing.body(&arm.body));
                }
                self.line("else");
                self.inside(|listing| listing.body(&branch.else_body));
            }
            ExprKind::For(each) => {
                self.part(&format!("for {}", each.name.name), &each.range);
                self.inside(|listing| listing.body(&each.body));
            }
            ExprKind::BlendScope(scope) => {
                self.line("blend");
                self.inside(|listing| {
                    listing.args(&scope.blend.args);
                    listing.body(&scope.body);
                });
            }
            ExprKind::Lambda(lambda) => {
                self.line("fn");
                self.inside(|listing| {
                    listing.params(&lambda.params);
                    listing.body(&lambda.body);
                });
            }
        }
    }
}

fn typed(name: &Ident, annotation: &Option<TypeName>) -> String {
    match annotation {
        Some(annotation) => format!("{}: {}", name.name, annotation.name),
        None => name.name.clone(),
    }
}
