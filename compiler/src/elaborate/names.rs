//! Static check of the names of all files: reports undefined names, even in functions that are
//! never called, and unused names.

use super::arguments::{WORD_ARGUMENTS, word};
use super::blocks::WORD_FIELDS;
use super::diagnose::{Reports, remainder_edits, unknown_name};
use super::modules::{ImportTarget, ImportedModule};
use super::vocabulary;
use sdfc_lang::ast::{
    Arg, Args, Body, Call, Expr, ExprKind, File, FnParam, Import, ItemKind, Path, Postfix,
    StatementKind,
};
use sdfc_lang::diagnostic::MAX_SHOWN_DIAGNOSTICS;
use sdfc_lang::{Diagnostic, Span, codes};
use std::collections::HashMap;

/// Functions and methods whose first argument is a function of the point `p`.
const POINT_FUNCTIONS: [&str; 4] = ["field", "displace", "warp", "heightfield"];

/// Checks the names of all files. Unused names are reported only for the scene's own file.
pub(crate) fn check_names(modules: &[ImportedModule], reports: &mut Reports) {
    for (index, module) in modules.iter().enumerate() {
        let is_root = index + 1 == modules.len();
        let mut names = NameChecker {
            module,
            globals: Vec::new(),
            indices_by_name: HashMap::new(),
            locals: Vec::new(),
            visible_items: 0,
            aliases: HashMap::new(),
            formula: None,
            reports,
            reports_unused: is_root,
            suggestions_left: MAX_SHOWN_DIAGNOSTICS,
        };
        names.file(&module.file);
    }
}

/// A definition of a name.
struct Definition<'a> {
    name: &'a str,
    span: Span,
    what: &'static str,
    is_used: bool,
}

struct NameChecker<'a, 'r> {
    module: &'a ImportedModule,
    globals: Vec<(u32, Definition<'a>)>,
    /// Indices in `globals` of the definitions of a name.
    indices_by_name: HashMap<&'a str, Vec<usize>>,
    locals: Vec<Definition<'a>>,
    /// Number of items up to the current one, inclusive.
    visible_items: u32,
    aliases: HashMap<&'a str, (Span, bool)>,
    /// Formula that is no function, where one of the point is expected, and whether that is reported.
    formula: Option<(Span, bool)>,
    reports: &'r mut Reports,
    reports_unused: bool,
    /// Number of unknown names that still get a suggestion: those that are shown.
    suggestions_left: usize,
}

impl<'a> NameChecker<'a, '_> {
    fn file(&mut self, file: &'a File) {
        for item in &file.items {
            if let ItemKind::Fn(function) = &item.kind {
                self.define(&function.name.name, function.name.span, "function", 0);
            }
        }
        for (position, item) in file.items.iter().enumerate() {
            self.visible_items = position as u32 + 1;
            match &item.kind {
                ItemKind::Param(param) => {
                    self.expr(&param.value);
                    if let Some(range) = &param.range {
                        self.expr(&range.start);
                        self.expr(&range.end);
                        range.step.iter().for_each(|step| self.expr(step));
                    }
                    self.define(
                        &param.name.name,
                        param.name.span,
                        "param",
                        self.visible_items,
                    );
                }
                ItemKind::Let(binding) => {
                    self.expr(&binding.value);
                    self.define(
                        &binding.name.name,
                        binding.name.span,
                        "name",
                        self.visible_items,
                    );
                }
                ItemKind::Fn(function) => {
                    self.check_function(&function.params, &function.body, self.reports_unused);
                }
                ItemKind::Part(part) => {
                    self.expr(&part.value);
                    // A part is an output, and therefore used.
                    self.define(&part.name.name, part.name.span, "", self.visible_items);
                }
                ItemKind::Import(import) => self.import(import),
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
                        self.define(&name.name, name.span, what, self.visible_items);
                    }
                }
                ItemKind::Expr(expr) => self.expr(expr),
            }
        }
        self.visible_items = u32::MAX;
        if let Some(result) = &file.result {
            self.expr(result);
        }
        // Names of a library are meant for other files. In a file without a result, the parts are
        // the outputs.
        if self.reports_unused && file.result.is_some() {
            for (_, defined) in std::mem::take(&mut self.globals) {
                self.warn_unused(&defined);
            }
        }
        if self.reports_unused {
            let mut unused: Vec<(&str, Span)> = self
                .aliases
                .iter()
                .filter(|(_, (_, is_used))| !is_used)
                .map(|(alias, (span, _))| (*alias, *span))
                .collect();
            unused.sort_unstable_by_key(|(_, span)| *span);
            for (alias, span) in unused {
                let defined = Definition {
                    name: alias,
                    span,
                    what: "import",
                    is_used: false,
                };
                self.warn_unused(&defined);
            }
        }
    }

    fn import(&mut self, import: &'a Import) {
        let (alias, span) = (import.alias.name.as_str(), import.alias.span);
        match self.module.target(import) {
            ImportTarget::FidgetText(_) => self.define(alias, span, "import", self.visible_items),
            ImportTarget::Module(_) | ImportTarget::Unreadable => {
                self.aliases.insert(alias, (span, false));
            }
        }
    }

    fn define(&mut self, name: &'a str, span: Span, what: &'static str, position: u32) {
        self.indices_by_name
            .entry(name)
            .or_default()
            .push(self.globals.len());
        self.globals.push((
            position,
            Definition {
                name,
                span,
                what,
                is_used: what.is_empty(),
            },
        ));
    }

    fn warn_unused(&mut self, defined: &Definition<'_>) {
        if defined.is_used || defined.name.starts_with('_') {
            return;
        }
        let message = format!("the {} `{}` is not used", defined.what, defined.name);
        let help = format!("remove it, or call it `_{}` if that is meant", defined.name);
        self.reports
            .push(Diagnostic::warning(codes::W0201, defined.span, message).help(help));
    }

    fn check_function(&mut self, params: &'a [FnParam], body: &'a Body, reports_unused: bool) {
        let outer = self.locals.len();
        for param in params {
            param.default.iter().for_each(|default| self.expr(default));
            self.local(
                &param.name.name,
                param.name.span,
                if reports_unused { "argument" } else { "" },
            );
        }
        self.body(body);
        self.leave(outer);
    }

    fn local(&mut self, name: &'a str, span: Span, what: &'static str) {
        self.locals.push(Definition {
            name,
            span,
            what,
            is_used: what.is_empty(),
        });
    }

    fn leave(&mut self, outer: usize) {
        for defined in self.locals.split_off(outer) {
            self.warn_unused(&defined);
        }
    }

    fn body(&mut self, body: &'a Body) {
        let outer = self.locals.len();
        for statement in &body.statements {
            match &statement.kind {
                StatementKind::Let(binding) => {
                    self.expr(&binding.value);
                    let what = if self.reports_unused { "name" } else { "" };
                    self.local(&binding.name.name, binding.name.span, what);
                }
                StatementKind::Expr(expr) => self.expr(expr),
            }
        }
        self.expr(&body.result);
        self.leave(outer);
    }

    /// Checks the names in an expression. It recurses over the tree, whose depth the parser bounds.
    fn expr(&mut self, expr: &'a Expr) {
        match &expr.kind {
            ExprKind::Number(_) | ExprKind::Color(_) | ExprKind::Text(_) | ExprKind::Bool(_) => {}
            ExprKind::Path(path) => self.path(path, "name"),
            ExprKind::List(items) => items.iter().for_each(|item| self.expr(item)),
            ExprKind::Paren(inner) => self.expr(inner),
            ExprKind::Call(call) => {
                self.callee(call, expr.span);
                let name = call.callee.as_ident().map_or("", |name| &name.name);
                self.args_of(name, &call.args);
            }
            ExprKind::Postfix(postfix) => {
                if !self.reports_dot_after_import(postfix) {
                    self.expr(&postfix.base);
                }
                for suffix in &postfix.suffixes {
                    if let Some(args) = &suffix.args {
                        // A field of a record may be a function: an unknown name is reported when
                        // it is called.
                        self.mark(&suffix.name.name);
                        self.args_of(&suffix.name.name, &args.args);
                    }
                }
            }
            ExprKind::Unary(unary) => self.expr(&unary.operand),
            ExprKind::Chain(chain) => {
                self.expr(&chain.first);
                for link in &chain.links {
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
                self.body(&branch.else_body);
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
            ExprKind::Lambda(lambda) => self.check_function(&lambda.params, &lambda.body, false),
        }
    }

    /// Checks the names in the arguments of a function or method.
    fn args_of(&mut self, callee: &str, args: &'a [Arg]) {
        let outer = self.formula;
        if let (true, [first, ..]) = (POINT_FUNCTIONS.contains(&callee), args) {
            let is_function = matches!(first.value.kind, ExprKind::Lambda(_));
            self.formula = (!is_function).then_some((first.value.span, false));
        }
        self.args(args);
        self.formula = outer;
    }

    fn args(&mut self, args: &'a [Arg]) {
        for arg in args {
            let name = arg.name.as_ref().map_or("", |name| name.name.as_str());
            if !(WORD_ARGUMENTS.contains(&name) && word(&arg.value).is_some()) {
                self.expr(&arg.value);
            }
        }
    }

    /// Checks the names in a blend. Of several arguments, the first is its kind.
    fn blend(&mut self, blend: &'a Args) {
        let names_kind = blend.args.len() > 1
            && blend
                .args
                .first()
                .is_some_and(|arg| arg.name.is_none() && word(&arg.value).is_some());
        self.args(&blend.args[usize::from(names_kind)..]);
    }

    /// Marks a name as used. Returns whether it exists.
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
        let indices = self.indices_by_name.get(name).into_iter().flatten().rev();
        let visible_items = self.visible_items;
        for &index in indices {
            let (position, defined) = &mut self.globals[index];
            if *position < visible_items {
                defined.is_used = true;
                return true;
            }
        }
        vocabulary::static_name(name).is_some() || vocabulary::CONSTANTS.contains(&name)
    }

    fn callee(&mut self, call: &'a Call, span: Span) {
        let name = call.callee.as_ident().map_or("", |name| &name.name);
        let edits = remainder_edits(call, span);
        match edits.filter(|_| !self.mark(name) && !self.module.defines(name)) {
            Some(edits) => {
                let message = format!("there is no function `{name}`");
                let diagnostic = Diagnostic::error(codes::E0201, call.callee.span, message);
                self.reports
                    .push(diagnostic.fix_all(edits, "the remainder is written `a % b`"));
            }
            None => self.path(&call.callee, "function"),
        }
    }

    /// Reports a dot between an import and one of its names, as in `parts.knob()`. Returns true if it did.
    fn reports_dot_after_import(&mut self, postfix: &'a Postfix) -> bool {
        let (ExprKind::Path(path), Some(suffix)) = (&postfix.base.kind, postfix.suffixes.first())
        else {
            return false;
        };
        let Some(import) = path.as_ident() else {
            return false;
        };
        let alias = import.name.as_str();
        if !self.aliases.contains_key(alias) || self.mark(alias) || self.module.defines(alias) {
            return false;
        }
        if let Some((_, is_used)) = self.aliases.get_mut(alias) {
            *is_used = true;
        }
        let message = format!("`{alias}` is an import, and no value");
        let dot = Span::new(import.span.file, import.span.end, suffix.name.span.start);
        let help = format!(
            "names of an import follow `::`: `{alias}::{}`",
            suffix.name.name
        );
        let diagnostic = Diagnostic::error(codes::E0201, import.span, message);
        self.reports.push(diagnostic.fix(dot, "::", help));
        true
    }

    /// Reports a formula of `p` that is no function of it, at its first `p` alone.
    fn report_missing_function(&mut self, span: Span, formula: Span, is_reported: bool) {
        let diagnostic = Diagnostic::error(codes::E0201, span, "there is no name `p`");
        match is_reported {
            true => self.reports.suppress(&diagnostic),
            false => self.reports.push(diagnostic.fix(
                formula.at_start(),
                "fn(p) => ",
                "write a function of the point",
            )),
        }
    }

    /// Returns the names among which one similar to an unknown name is searched; none once as many unknown names are
    /// reported as are shown.
    fn names_for_suggestions(&mut self) -> Vec<&str> {
        if self.suggestions_left == 0 {
            return Vec::new();
        }
        self.suggestions_left -= 1;
        let locals = self.locals.iter().map(|local| local.name);
        let definitions = self.module.definitions();
        locals
            .chain(definitions)
            .chain(vocabulary::names())
            .collect()
    }

    fn path(&mut self, path: &'a Path, what: &str) {
        match path.segments.as_slice() {
            [only] => {
                // A name that is defined later is reported during evaluation.
                if !self.mark(&only.name) && !self.module.defines(&only.name) {
                    if let (Some((formula, is_reported)), "p") = (self.formula, only.name.as_str())
                    {
                        self.formula = Some((formula, true));
                        return self.report_missing_function(only.span, formula, is_reported);
                    }
                    if let Some((_, is_used)) = self.aliases.get_mut(only.name.as_str()) {
                        *is_used = true;
                        let name = &only.name;
                        let message = format!("`{name}` is an imported file, not a value");
                        let help = format!("its names are written `{name}::NAME`");
                        let diagnostic = Diagnostic::error(codes::E0201, only.span, message);
                        return self.reports.push(diagnostic.help(help));
                    }
                    let names = self.names_for_suggestions();
                    let diagnostic = unknown_name(codes::E0201, what, &only.name, only.span, names);
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
