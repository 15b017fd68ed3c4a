//! A look over the names of all files, without running anything: names that do not exist, even in
//! functions that nobody calls, and names that nobody uses.

use super::blocks::WORD_FIELDS;
use super::calls::{WORD_ARGUMENTS, word};
use super::diagnose::{Reports, unknown_name};
use super::modules::Module;
use super::vocabulary;
use sdfc_lang::ast::{
    Arg, Args, Body, Expr, ExprKind, File, FnParam, ItemKind, Path, StatementKind,
};
use sdfc_lang::{Diagnostic, Span, codes};
use std::collections::HashMap;

/// Reports what is wrong with the names of all files; only the scene's own file is told about names
/// that it does not use.
pub(crate) fn look_over(modules: &[Module], reports: &mut Reports) {
    for (at, module) in modules.iter().enumerate() {
        let is_root = at + 1 == modules.len();
        let mut names = Names {
            module,
            globals: Vec::new(),
            latest: HashMap::new(),
            locals: Vec::new(),
            horizon: 0,
            aliases: HashMap::new(),
            reports,
            tells_unused: is_root,
        };
        names.file(&module.file);
    }
}

/// A name that was introduced.
struct Defined<'a> {
    name: &'a str,
    span: Span,
    what: &'static str,
    is_used: bool,
}

struct Names<'a, 'r> {
    module: &'a Module,
    globals: Vec<(u32, Defined<'a>)>,
    /// The places of a name in `globals`.
    latest: HashMap<&'a str, Vec<usize>>,
    locals: Vec<Defined<'a>>,
    /// How many items stand before what is looked at, itself included.
    horizon: u32,
    aliases: HashMap<&'a str, (Span, bool)>,
    reports: &'r mut Reports,
    tells_unused: bool,
}

impl<'a> Names<'a, '_> {
    fn file(&mut self, file: &'a File) {
        for item in &file.items {
            if let ItemKind::Fn(function) = &item.kind {
                self.define(&function.name.name, function.name.span, "function", 0);
            }
        }
        for (position, item) in file.items.iter().enumerate() {
            self.horizon = position as u32 + 1;
            match &item.kind {
                ItemKind::Param(param) => {
                    self.expr(&param.value);
                    if let Some(range) = &param.range {
                        self.expr(&range.start);
                        self.expr(&range.end);
                        range.step.iter().for_each(|step| self.expr(step));
                    }
                    self.define(&param.name.name, param.name.span, "param", self.horizon);
                }
                ItemKind::Let(binding) => {
                    self.expr(&binding.value);
                    self.define(&binding.name.name, binding.name.span, "name", self.horizon);
                }
                ItemKind::Fn(function) => {
                    self.function(&function.params, &function.body, self.tells_unused);
                }
                ItemKind::Part(part) => {
                    self.expr(&part.value);
                    // A part is an output: it is used by being there.
                    self.define(&part.name.name, part.name.span, "", self.horizon);
                }
                ItemKind::Import(import) => {
                    let alias = import.alias.name.as_str();
                    self.aliases.insert(alias, (import.alias.span, false));
                }
                ItemKind::Block(block) => {
                    let kind = block.kind.name.as_str();
                    for field in &block.fields {
                        let is_word = WORD_FIELDS.contains(&(kind, field.name.name.as_str()));
                        match &field.value.kind {
                            ExprKind::Path(_) if is_word => {}
                            ExprKind::Call(call) if is_word => self.args(&call.args),
                            _ => self.expr(&field.value),
                        }
                    }
                    if let (Some(name), "material" | "record") = (&block.name, kind) {
                        let what = if kind == "material" {
                            "material"
                        } else {
                            "record"
                        };
                        self.define(&name.name, name.span, what, self.horizon);
                    }
                }
                ItemKind::Expr(expr) => self.expr(expr),
            }
        }
        self.horizon = u32::MAX;
        if let Some(result) = &file.result {
            self.expr(result);
        }
        // A library's names are for others, and so is a file's whose parts are its outputs.
        if self.tells_unused && file.result.is_some() {
            for (_, defined) in std::mem::take(&mut self.globals) {
                self.tell_unused(&defined);
            }
        }
        if self.tells_unused {
            let mut unused: Vec<(&str, Span)> = self
                .aliases
                .iter()
                .filter(|(_, (_, is_used))| !is_used)
                .map(|(alias, (span, _))| (*alias, *span))
                .collect();
            unused.sort_unstable_by_key(|(_, span)| *span);
            for (alias, span) in unused {
                let defined = Defined {
                    name: alias,
                    span,
                    what: "import",
                    is_used: false,
                };
                self.tell_unused(&defined);
            }
        }
    }

    fn define(&mut self, name: &'a str, span: Span, what: &'static str, position: u32) {
        self.latest
            .entry(name)
            .or_default()
            .push(self.globals.len());
        self.globals.push((
            position,
            Defined {
                name,
                span,
                what,
                is_used: what.is_empty(),
            },
        ));
    }

    fn tell_unused(&mut self, defined: &Defined<'_>) {
        if defined.is_used || defined.name.starts_with('_') {
            return;
        }
        let message = format!("the {} `{}` is not used", defined.what, defined.name);
        let help = format!("remove it, or call it `_{}` if that is meant", defined.name);
        self.reports
            .push(Diagnostic::warning(codes::W0201, defined.span, message).help(help));
    }

    fn function(&mut self, params: &'a [FnParam], body: &'a Body, tells_unused: bool) {
        let outer = self.locals.len();
        for param in params {
            param.default.iter().for_each(|default| self.expr(default));
            self.local(
                &param.name.name,
                param.name.span,
                if tells_unused { "argument" } else { "" },
            );
        }
        self.body(body);
        self.leave(outer);
    }

    fn local(&mut self, name: &'a str, span: Span, what: &'static str) {
        self.locals.push(Defined {
            name,
            span,
            what,
            is_used: what.is_empty(),
        });
    }

    fn leave(&mut self, outer: usize) {
        for defined in self.locals.split_off(outer) {
            self.tell_unused(&defined);
        }
    }

    fn body(&mut self, body: &'a Body) {
        let outer = self.locals.len();
        for statement in &body.statements {
            match &statement.kind {
                StatementKind::Let(binding) => {
                    self.expr(&binding.value);
                    let what = if self.tells_unused { "name" } else { "" };
                    self.local(&binding.name.name, binding.name.span, what);
                }
                StatementKind::Expr(expr) => self.expr(expr),
            }
        }
        self.expr(&body.result);
        self.leave(outer);
    }

    /// Recursion over the tree, whose depth the parser bounds.
    fn expr(&mut self, expr: &'a Expr) {
        match &expr.kind {
            ExprKind::Number(_) | ExprKind::Color(_) | ExprKind::Text(_) | ExprKind::Bool(_) => {}
            ExprKind::Path(path) => self.path(path, "name"),
            ExprKind::List(items) => items.iter().for_each(|item| self.expr(item)),
            ExprKind::Paren(inner) => self.expr(inner),
            ExprKind::Call(call) => {
                self.path(&call.callee, "function");
                self.args(&call.args);
            }
            ExprKind::Postfix(postfix) => {
                self.expr(&postfix.base);
                for suffix in &postfix.suffixes {
                    if let Some(args) = &suffix.args {
                        // A record's field may be a function: whether the name exists is told when
                        // it is called.
                        self.mark(&suffix.name.name);
                        self.args(&args.args);
                    }
                }
            }
            ExprKind::Unary(unary) => self.expr(&unary.operand),
            ExprKind::Chain(chain) => {
                self.expr(&chain.first);
                for link in &chain.rest {
                    link.blend.iter().for_each(|blend| self.blend(blend));
                    self.expr(&link.operand);
                }
            }
            ExprKind::Range(range) => {
                self.expr(&range.start);
                self.expr(&range.end);
            }
            ExprKind::If(branch) => {
                for arm in &branch.arms {
                    self.expr(&arm.condition);
                    self.body(&arm.body);
                }
                self.body(&branch.otherwise);
            }
            ExprKind::For(each) => {
                self.expr(&each.range);
                let outer = self.locals.len();
                self.local(&each.name.name, each.name.span, "");
                self.body(&each.body);
                self.leave(outer);
            }
            ExprKind::BlendScope(scope) => {
                self.blend(&scope.blend);
                self.body(&scope.body);
            }
            ExprKind::Lambda(lambda) => self.function(&lambda.params, &lambda.body, false),
        }
    }

    fn args(&mut self, args: &'a [Arg]) {
        for arg in args {
            let name = arg.name.as_ref().map_or("", |name| name.name.as_str());
            if !(WORD_ARGUMENTS.contains(&name) && word(&arg.value).is_some()) {
                self.expr(&arg.value);
            }
        }
    }

    /// The first of several arguments of a blend is its kind.
    fn blend(&mut self, blend: &'a Args) {
        let names_kind = blend.args.len() > 1
            && blend
                .args
                .first()
                .is_some_and(|arg| arg.name.is_none() && word(&arg.value).is_some());
        self.args(&blend.args[usize::from(names_kind)..]);
    }

    /// Marks a name as used; says whether it exists.
    fn mark(&mut self, name: &str) -> bool {
        if let Some(local) = self
            .locals
            .iter_mut()
            .rev()
            .find(|local| local.name == name)
        {
            local.is_used = true;
            return true;
        }
        let places = self.latest.get(name).into_iter().flatten().rev();
        let horizon = self.horizon;
        for &place in places {
            let (position, defined) = &mut self.globals[place];
            if *position < horizon {
                defined.is_used = true;
                return true;
            }
        }
        vocabulary::function(name).is_some() || vocabulary::CONSTANTS.contains(&name)
    }

    fn path(&mut self, path: &'a Path, what: &str) {
        match path.segments.as_slice() {
            [only] => {
                // One that is defined further down is told when it is evaluated.
                if !self.mark(&only.name) && !self.module.defines(&only.name) {
                    let known: Vec<&str> = self
                        .locals
                        .iter()
                        .map(|local| local.name)
                        .chain(self.module.definitions())
                        .chain(vocabulary::names())
                        .collect();
                    let diagnostic = unknown_name(codes::E0201, what, &only.name, only.span, known);
                    self.reports.push(diagnostic);
                }
            }
            [library, ..] => {
                if let Some((_, is_used)) = self.aliases.get_mut(library.name.as_str()) {
                    *is_used = true;
                }
            }
            [] => {}
        }
    }
}
