//! Files, item by item.

use super::Elaborator;
use super::evaluate::{Halt, Here};
use super::scope::Scope;
use super::value::{Closure, Value};
use sdfc_lang::ast::{ExprKind, Item, ItemKind};
use sdfc_lang::{Diagnostic, codes};
use std::collections::HashMap;
use std::rc::Rc;

/// The names that a file defines. A name holds for what stands after it; functions hold everywhere.
#[derive(Debug, Default)]
pub(crate) struct Globals<'a> {
    names: HashMap<&'a str, Vec<(u32, Value<'a>)>>,
    /// The names in the order of their definition, for suggestions.
    order: Vec<&'a str>,
}

impl<'a> Globals<'a> {
    fn define(&mut self, name: &'a str, position: u32, value: Value<'a>) {
        self.order.push(name);
        self.names.entry(name).or_default().push((position, value));
    }
    /// What a name means where `horizon` definitions stand before.
    pub(crate) fn get(&self, name: &str, horizon: u32) -> Option<&Value<'a>> {
        let definitions = self.names.get(name)?;
        let before = definitions
            .iter()
            .rev()
            .find(|(position, _)| *position < horizon);
        before.map(|(_, value)| value)
    }
    /// All names, in the order of their definition.
    pub(crate) fn names(&self) -> impl Iterator<Item = &'a str> {
        self.order.iter().copied()
    }
}

impl<'a> Elaborator<'a> {
    /// Evaluates all files.
    pub(crate) fn run(&mut self) -> Result<(), Halt> {
        let modules = self.modules;
        for item in modules
            .last()
            .into_iter()
            .flat_map(|module| &module.file.items)
        {
            if let ItemKind::Block(block) = &item.kind
                && block.kind.name == "scene"
            {
                self.scene_block(block);
            }
        }
        for at in 0..modules.len() {
            self.globals.push(Globals::default());
            self.module(at)?;
        }
        for given in self.overrides {
            if !self.params.iter().any(|param| given.is_for(&param.name)) {
                let diagnostic = given.unknown(&self.params);
                self.report(diagnostic);
            }
        }
        self.result()
    }

    fn module(&mut self, at: usize) -> Result<(), Halt> {
        let module = &self.modules[at];
        let is_root = at == self.root();
        let prefix = if is_root {
            String::new()
        } else {
            let name = self.sources.name(module.file.id);
            let stem = name.rsplit(['/', '\\']).next().unwrap_or(name);
            format!("{}::", stem.trim_end_matches(".sdf"))
        };
        for (position, item) in module.file.items.iter().enumerate() {
            if let ItemKind::Fn(function) = &item.kind {
                let value = Value::Function(Rc::new(Closure {
                    name: &function.name.name,
                    params: &function.params,
                    result: function.result.as_ref(),
                    body: &function.body,
                    here: self.outermost(at, position as u32 + 1),
                    span: function.name.span,
                }));
                self.globals[at].define(&function.name.name, 0, value);
            }
        }
        for (position, item) in module.file.items.iter().enumerate() {
            let position = position as u32 + 1;
            let here = self.outermost(at, position);
            if let Some((name, value)) = self.item(&here, item, &prefix)? {
                self.globals[at].define(name, position, value);
            }
        }
        Ok(())
    }

    fn outermost(&self, module: usize, horizon: u32) -> Here<'a> {
        Here {
            scope: Scope::default(),
            module,
            horizon,
            blend: None,
        }
    }

    /// Evaluates an item; gives the name that it defines.
    fn item(
        &mut self,
        here: &Here<'a>,
        item: &'a Item,
        prefix: &str,
    ) -> Result<Option<(&'a str, Value<'a>)>, Halt> {
        match &item.kind {
            ItemKind::Param(param) => {
                let value = self.param(here, param, item.docs.as_deref(), prefix)?;
                Ok(Some((&param.name.name, value)))
            }
            ItemKind::Let(binding) => {
                let value = self.binding(here, binding)?;
                Ok(Some((&binding.name.name, value)))
            }
            ItemKind::Part(part) => {
                let value = self.eval(here, &part.value)?;
                let Some(id) = self.shape(&value, part.value.span) else {
                    return Ok(Some((&part.name.name, Value::Poison)));
                };
                let shape = Value::Shape(id);
                let name = part.name.name.as_str();
                self.name_shape(&shape, name);
                if here.module == self.root() {
                    if self.parts.iter().any(|(other, _)| other == name) {
                        let message = format!("there are two parts `{name}`");
                        let span = part.name.span;
                        self.report(Diagnostic::error(codes::E0214, span, message));
                    }
                    self.parts.push((name.to_owned(), id));
                }
                Ok(Some((name, shape)))
            }
            ItemKind::Block(block) => {
                let value = self.block(here, block)?;
                let name = block.name.as_ref().map(|name| name.name.as_str());
                Ok(name.zip(value))
            }
            ItemKind::Expr(expr) => {
                self.eval(here, expr)?;
                Ok(None)
            }
            ItemKind::Fn(_) | ItemKind::Import(_) => Ok(None),
        }
    }

    /// The final expression, or all parts together.
    fn result(&mut self) -> Result<(), Halt> {
        let at = self.root();
        let module = &self.modules[at];
        let here = self.outermost(at, u32::MAX);
        if let Some(result) = &module.file.result {
            let value = self.eval(&here, result)?;
            if matches!(value, Value::Nothing) && matches!(result.kind, ExprKind::Call(_)) {
                // A file that ends with `assert(..)` or `print(..)` and no `;`.
                self.root = None;
            } else {
                self.root = self.shape(&value, result.span);
            }
            return Ok(());
        }
        let shapes: Vec<_> = self.parts.iter().map(|(_, id)| *id).collect();
        let one_kind = shapes.windows(2).all(|pair| {
            let plane = |id: crate::scene::ShapeId| self.shapes[id.0 as usize].plane;
            plane(pair[0]) == plane(pair[1])
        });
        if let (Some(&first), true) = (shapes.first(), one_kind) {
            let span = self.shapes[first.0 as usize].span;
            let op = sdfc_vm::table::Op::Union;
            self.root = self.combined(op, Vec::new(), shapes, span);
        }
        Ok(())
    }
}
