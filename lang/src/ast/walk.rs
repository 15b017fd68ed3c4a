//! Traversal of the direct children of items and expressions.

use super::*;

impl Expr {
    /// Visits the direct child expressions in source order. Those in statements of a body count as direct
    /// children.
    pub fn for_each_child<'a>(&'a self, visit: &mut dyn FnMut(&'a Expr)) {
        match &self.kind {
            ExprKind::Number(_)
            | ExprKind::Color(_)
            | ExprKind::Text(_)
            | ExprKind::Bool(_)
            | ExprKind::Path(_) => {}
            ExprKind::List(items) => items.iter().for_each(visit),
            ExprKind::Paren(inner) => visit(inner),
            ExprKind::Call(call) => in_args(&call.args, visit),
            ExprKind::Postfix(postfix) => {
                visit(&postfix.base);
                for args in postfix.suffixes.iter().flat_map(|s| &s.args) {
                    in_args(&args.args, visit);
                }
            }
            ExprKind::Unary(unary) => visit(&unary.operand),
            ExprKind::Chain(chain) => {
                visit(&chain.first);
                for link in &chain.links {
                    if let Some(blend) = &link.blend {
                        in_args(&blend.args, visit);
                    }
                    visit(&link.operand);
                }
            }
            ExprKind::Range(range) => {
                visit(&range.start);
                visit(&range.end);
            }
            ExprKind::If(branch) => {
                for arm in &branch.arms {
                    visit(&arm.condition);
                    arm.body.for_each_child(visit);
                }
                branch.else_body.for_each_child(visit);
            }
            ExprKind::For(each) => {
                visit(&each.range);
                each.body.for_each_child(visit);
            }
            ExprKind::BlendScope(scope) => {
                in_args(&scope.blend.args, visit);
                scope.body.for_each_child(visit);
            }
            ExprKind::Lambda(lambda) => {
                in_params(&lambda.params, visit);
                lambda.body.for_each_child(visit);
            }
        }
    }
}

impl Body {
    /// Visits the direct child expressions: those of the statements, then the value.
    pub fn for_each_child<'a>(&'a self, visit: &mut dyn FnMut(&'a Expr)) {
        for statement in &self.statements {
            match &statement.kind {
                StatementKind::Let(binding) => visit(&binding.value),
                StatementKind::Expr(value) => visit(value),
            }
        }
        visit(&self.result);
    }
}

impl Item {
    /// Visits the direct child expressions in source order.
    pub fn for_each_child<'a>(&'a self, visit: &mut dyn FnMut(&'a Expr)) {
        match &self.kind {
            ItemKind::Param(param) => {
                visit(&param.value);
                if let Some(range) = &param.range {
                    visit(&range.start);
                    visit(&range.end);
                    range.step.iter().for_each(visit);
                }
            }
            ItemKind::Let(binding) => visit(&binding.value),
            ItemKind::Fn(function) => {
                in_params(&function.params, visit);
                function.body.for_each_child(visit);
            }
            ItemKind::Part(part) => visit(&part.value),
            ItemKind::Import(_) => {}
            ItemKind::Block(block) => block.fields.iter().for_each(|field| visit(&field.value)),
            ItemKind::Expr(value) => visit(value),
        }
    }
}

impl File {
    /// Visits the outermost expressions in source order.
    pub fn for_each_child<'a>(&'a self, visit: &mut dyn FnMut(&'a Expr)) {
        for item in &self.items {
            item.for_each_child(visit);
        }
        self.result.iter().for_each(visit);
    }
}

fn in_args<'a>(args: &'a [Arg], visit: &mut dyn FnMut(&'a Expr)) {
    args.iter().for_each(|arg| visit(&arg.value));
}

fn in_params<'a>(params: &'a [FnParam], visit: &mut dyn FnMut(&'a Expr)) {
    params
        .iter()
        .flat_map(|param| &param.default)
        .for_each(visit);
}
