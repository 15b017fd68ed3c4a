//! Evaluation of the items of each file.

use super::Elaborator;
use super::modules::ImportTarget;
use super::scope::Scope;
use super::value::{Abort, Closure, Env, Value};
use sdfc_lang::ast::{ExprKind, Item, ItemKind};
use sdfc_lang::{Diagnostic, codes};
use std::collections::HashMap;
use std::rc::Rc;

/// Names defined by a file. A name is visible after its definition; functions are visible
/// everywhere.
#[derive(Debug, Default)]
pub(crate) struct Globals<'a> {
    names: HashMap<&'a str, Vec<(u32, Value<'a>)>>,
    /// Names in order of their definition, for suggestions.
    order: Vec<&'a str>,
}

impl<'a> Globals<'a> {
    fn define(&mut self, name: &'a str, position: u32, value: Value<'a>) {
        self.order.push(name);
        self.names.entry(name).or_default().push((position, value));
    }
    /// Returns the value of a name at a point that `horizon` definitions precede.
    pub(crate) fn get(&self, name: &str, horizon: u32) -> Option<&Value<'a>> {
        let definitions = self.names.get(name)?;
        let visible = definitions
            .iter()
            .rev()
            .find(|(position, _)| *position < horizon);
        visible.map(|(_, value)| value)
    }
    /// Returns all names, in order of their definition.
    pub(crate) fn names(&self) -> impl Iterator<Item = &'a str> {
        self.order.iter().copied()
    }
}

impl<'a> Elaborator<'a> {
    /// Evaluates all files.
    pub(crate) fn run(&mut self) -> Result<(), Abort> {
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
        for index in 0..modules.len() {
            self.globals.push(Globals::default());
            self.evaluate_module(index)?;
        }
        for override_ in self.overrides {
            if !self
                .params
                .iter()
                .any(|param| override_.is_for(&param.name))
            {
                let diagnostic = override_.unknown_param(&self.params);
                self.report(diagnostic);
            }
        }
        self.set_root()
    }

    fn evaluate_module(&mut self, index: usize) -> Result<(), Abort> {
        let module = &self.modules[index];
        let is_root = index == self.root();
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
                    env: self.module_env(index, position as u32 + 1),
                    span: function.name.span,
                }));
                self.globals[index].define(&function.name.name, 0, value);
            }
        }
        for (position, item) in module.file.items.iter().enumerate() {
            let position = position as u32 + 1;
            let env = self.module_env(index, position);
            if let Some((name, value)) = self.item(&env, item, &prefix)? {
                self.globals[index].define(name, position, value);
            }
        }
        Ok(())
    }

    fn module_env(&self, module: usize, horizon: u32) -> Env<'a> {
        Env {
            scope: Scope::default(),
            module,
            visible_items: horizon,
            blend: None,
        }
    }

    /// Evaluates an item and returns the name that it defines.
    fn item(
        &mut self,
        env: &Env<'a>,
        item: &'a Item,
        prefix: &str,
    ) -> Result<Option<(&'a str, Value<'a>)>, Abort> {
        match &item.kind {
            ItemKind::Param(param) => {
                let value = self.param(env, param, item.docs.as_deref(), prefix)?;
                Ok(Some((&param.name.name, value)))
            }
            ItemKind::Let(binding) => {
                let value = self.binding(env, binding)?;
                Ok(Some((&binding.name.name, value)))
            }
            ItemKind::Part(part) => {
                let value = self.eval(env, &part.value)?;
                let Some(id) = self.shape(&value, part.value.span) else {
                    return Ok(Some((&part.name.name, Value::Poison)));
                };
                let shape = Value::Shape(id);
                let name = part.name.name.as_str();
                self.name_shape(&shape, name);
                if env.module == self.root() {
                    if !self.part_names.insert(name) {
                        let message = format!("there are two parts `{name}`");
                        let span = part.name.span;
                        self.report(Diagnostic::error(codes::E0214, span, message));
                    }
                    self.parts.push((name.to_owned(), id));
                }
                Ok(Some((name, shape)))
            }
            ItemKind::Block(block) => {
                let value = self.block(env, block)?;
                let name = block.name.as_ref().map(|name| name.name.as_str());
                Ok(name.zip(value))
            }
            ItemKind::Expr(expr) => {
                self.eval(env, expr)?;
                Ok(None)
            }
            ItemKind::Import(import) => {
                let ImportTarget::FidgetText(file) = self.modules[env.module].target(import) else {
                    return Ok(None);
                };
                let shape = self.fidget_shape(file, import.alias.span);
                self.name_shape(&shape, &import.alias.name);
                Ok(Some((&import.alias.name, shape)))
            }
            ItemKind::Fn(_) => Ok(None),
        }
    }

    /// Sets the root: the final expression, or the union of all parts.
    fn set_root(&mut self) -> Result<(), Abort> {
        let root = self.root();
        let module = &self.modules[root];
        let env = self.module_env(root, u32::MAX);
        if let Some(result) = &module.file.result {
            let value = self.eval(&env, result)?;
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
            let is_2d = |id: crate::scene::ShapeId| self.shapes[id.0 as usize].is_2d;
            is_2d(pair[0]) == is_2d(pair[1])
        });
        if let (Some(&first), true) = (shapes.first(), one_kind) {
            let span = self.shapes[first.0 as usize].span;
            let op = sdfc_vm::table::Op::Union;
            self.root = self.combine(op, Vec::new(), shapes, span);
        }
        Ok(())
    }
}
