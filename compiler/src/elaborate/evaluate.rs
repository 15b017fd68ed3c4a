//! Evaluation of expressions.
//!
//! Evaluation is plain recursion over the tree. It is bounded by a budget of steps, by the depth of calls and
//! by the depth of nested expressions. Exceeding a bound ends the run with a message and an [`Abort`]. Any
//! other mistake is reported and results in a [`Value::Poison`], which suppresses follow-up errors.

use super::constness::Demand;
use super::diagnose::unknown_name;
use super::modules::ImportTarget;
use super::value::{Abort, Closure, Env, EvalResult, Quantity, Range, ScalarValue, Value, Vector};
use super::{Elaborator, vocabulary};
use crate::expression::Stage;
use crate::scene::Shape;
use sdfc_lang::ast::{
    BinaryOp, Body, Chain, Expr, ExprKind, For, If, Lambda, NumberValue, Path, Postfix, Precedence,
    StatementKind, Suffix, Unary, UnaryOp, Unit,
};
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::table::Op;
use std::rc::Rc;

/// Maximum number of steps of a run; a step is one evaluated expression.
pub(crate) const MAX_STEPS: u64 = 5_000_000;
/// Maximum number of distinct numbers of a run.
const MAX_NUMBERS: usize = 8_000_000;
/// Maximum nesting depth of expressions, calls included.
const MAX_NESTING: u32 = 6_000;
/// Maximum nesting depth of values: lists in lists, and functions that capture functions.
const MAX_VALUE_DEPTH: u32 = 1_000;
impl<'a> Elaborator<'a> {
    /// Evaluates an expression.
    pub(crate) fn eval(&mut self, env: &Env<'a>, expr: &'a Expr) -> EvalResult<'a> {
        self.charge_step(expr.span)?;
        self.nesting += 1;
        if self.nesting > MAX_NESTING {
            let message = format!("this nests more than {MAX_NESTING} levels deep, calls included");
            self.report(Diagnostic::error(codes::E0408, expr.span, message));
            return Err(Abort);
        }
        let result = self.eval_kind(env, expr)?;
        self.nesting -= 1;
        self.check_value_depth(&result, expr.span)?;
        Ok(result)
    }

    /// Aborts the run if a value is nested too deep to be dropped by recursion.
    pub(crate) fn check_value_depth(&mut self, value: &Value<'a>, span: Span) -> Result<(), Abort> {
        if value.depth() <= MAX_VALUE_DEPTH {
            return Ok(());
        }
        let message = format!("values nest more than {MAX_VALUE_DEPTH} levels deep");
        let help = "put lists one after the other by `concat`";
        self.report(Diagnostic::error(codes::E0408, span, message).help(help));
        Err(Abort)
    }

    fn eval_kind(&mut self, env: &Env<'a>, expr: &'a Expr) -> EvalResult<'a> {
        match &expr.kind {
            ExprKind::Number(number) => Ok(Value::Number(self.literal(number.value, number.unit))),
            ExprKind::Color(bytes) => Ok(Value::Color(self.srgb(*bytes))),
            ExprKind::Text(text) => Ok(Value::Text(text.as_str().into())),
            ExprKind::Bool(truth) => Ok(Value::Bool(self.truth(*truth))),
            ExprKind::Path(path) => Ok(self.path(env, path)),
            ExprKind::List(items) => self.list(env, items),
            ExprKind::Paren(inner) => self.eval(env, inner),
            ExprKind::Call(call) => self.call(env, call, expr.span),
            ExprKind::Postfix(postfix) => self.postfix(env, postfix),
            ExprKind::Unary(unary) => self.unary(env, unary, expr.span),
            ExprKind::Chain(chain) => self.chain(env, chain, expr.span),
            ExprKind::Range(range) => {
                let start = self.eval(env, &range.start)?;
                let end = self.eval(env, &range.end)?;
                Ok(self.range(
                    start,
                    end,
                    range.inclusive,
                    range.start.span,
                    range.end.span,
                ))
            }
            ExprKind::If(branch) => self.if_expr(env, branch, expr.span),
            ExprKind::For(each) => self.for_loop(env, each),
            ExprKind::BlendScope(scope) => {
                let Some(blend) = self.blend(env, &scope.blend, None)? else {
                    return Ok(Value::Poison);
                };
                let env = Env {
                    blend: Some(Rc::new(blend)),
                    ..env.clone()
                };
                self.body(&env, &scope.body)
            }
            ExprKind::Lambda(lambda) => Ok(self.lambda(env, lambda, expr.span)),
        }
    }

    /// Charges one step to the budget.
    pub(crate) fn charge_step(&mut self, span: Span) -> Result<(), Abort> {
        self.steps += 1;
        if self.steps > MAX_STEPS || self.expressions.len() > MAX_NUMBERS {
            let message = match self.steps > MAX_STEPS {
                true => format!("the scene takes more than {MAX_STEPS} steps to build"),
                false => format!("the scene computes more than {MAX_NUMBERS} different numbers"),
            };
            let help = "use fewer repetitions, or `repeat` and `polar`, which cost nothing";
            self.report(Diagnostic::error(codes::E0409, span, message).help(help));
            return Err(Abort);
        }
        if self.reports.is_full() {
            Err(Abort)
        } else {
            Ok(())
        }
    }

    /// Evaluates a body: its statements in order, then its result.
    pub(crate) fn body(&mut self, env: &Env<'a>, body: &'a Body) -> EvalResult<'a> {
        if body.statements.is_empty() {
            return self.eval(env, &body.result);
        }
        let mut env = env.clone();
        for statement in &body.statements {
            match &statement.kind {
                StatementKind::Let(binding) => {
                    let value = self.binding(&env, binding)?;
                    env = env.with(&binding.name.name, value);
                }
                StatementKind::Expr(expr) => {
                    self.eval(&env, expr)?;
                }
            }
        }
        self.eval(&env, &body.result)
    }

    /// Evaluates a `let`, converts the value to the annotated type, and names a shape.
    pub(crate) fn binding(
        &mut self,
        env: &Env<'a>,
        binding: &'a sdfc_lang::ast::Let,
    ) -> EvalResult<'a> {
        let value = self.eval(env, &binding.value)?;
        let value = match &binding.annotation {
            Some(annotation) => self.convert_annotated(value, annotation, binding.value.span),
            None => value,
        };
        self.name_shape(&value, &binding.name.name);
        Ok(value)
    }

    /// Names a shape for listings, if it has no name.
    pub(crate) fn name_shape(&mut self, value: &Value<'a>, name: &str) {
        if let Value::Shape(id) = value {
            let shape: &mut Shape = &mut self.shapes[id.0 as usize];
            if shape.name.is_empty() {
                name.clone_into(&mut shape.name);
            }
        }
    }

    fn literal(&mut self, value: NumberValue, unit: Unit) -> ScalarValue {
        let amount = value.to_f64();
        let length = |millimetres: f64| (amount * millimetres / self.unit_mm, Quantity::Length(1));
        let (amount, quantity) = match unit {
            Unit::None => (amount, Quantity::Plain),
            Unit::Deg => (amount.to_radians(), Quantity::Angle),
            Unit::Turn => (amount * std::f64::consts::TAU, Quantity::Angle),
            Unit::Rad => (amount, Quantity::Angle),
            Unit::Mm => length(1.0),
            Unit::Cm => length(10.0),
            Unit::M => length(1000.0),
            Unit::In => length(25.4),
            Unit::S => (amount, Quantity::Time),
            Unit::Ms => (amount / 1000.0, Quantity::Time),
        };
        let is_integer = matches!(value, NumberValue::Int(_)) && unit == Unit::None;
        ScalarValue {
            id: self.expressions.constant(amount),
            quantity,
            is_integer,
        }
    }

    fn path(&mut self, env: &Env<'a>, path: &'a Path) -> Value<'a> {
        match self.lookup(env, path) {
            Some(value) => value,
            None => {
                self.report_unknown(env, path, "name");
                Value::Poison
            }
        }
    }

    /// Looks up a name: names of the scene first, then those of the language.
    pub(crate) fn lookup(&mut self, env: &Env<'a>, path: &'a Path) -> Option<Value<'a>> {
        match path.segments.as_slice() {
            [only] => self.lookup_name(env, &only.name),
            [library, name] => {
                let module = match self.modules.get(env.module)?.import(&library.name)? {
                    ImportTarget::Module(module) => module,
                    ImportTarget::FidgetText(_) => return None,
                    ImportTarget::Unreadable => return Some(Value::Poison),
                };
                if name.name.starts_with('_') {
                    return None;
                }
                self.globals[module].get(&name.name, u32::MAX).cloned()
            }
            _ => None,
        }
    }

    /// Looks up a name without a library.
    pub(crate) fn lookup_name(&mut self, env: &Env<'a>, name: &str) -> Option<Value<'a>> {
        if let Some(value) = env.scope.get(name) {
            return Some(value.clone());
        }
        if let Some(value) = self.globals[env.module].get(name, env.visible_items) {
            return Some(value.clone());
        }
        self.language_constant(name)
            .or_else(|| vocabulary::static_name(name).map(Value::Builtin))
    }

    /// Returns the constant of the language with this name, such as `pi`, `time` or the axis `X`.
    fn language_constant(&mut self, name: &str) -> Option<Value<'a>> {
        use std::f64::consts;
        let axis = |expressions: &mut crate::expression::Expressions, unit_axis: usize| {
            let component =
                |i| ScalarValue::int(expressions.constant(if i == unit_axis { 1.0 } else { 0.0 }));
            Value::Vector(Vector::from_array([0, 1, 2].map(component)))
        };
        Some(match name {
            "X" => axis(&mut self.expressions, 0),
            "Y" => axis(&mut self.expressions, 1),
            "Z" => axis(&mut self.expressions, 2),
            "pi" => Value::Number(ScalarValue::plain(self.expressions.constant(consts::PI))),
            "tau" => Value::Number(ScalarValue::plain(self.expressions.constant(consts::TAU))),
            "time" => Value::Number(ScalarValue::new(self.expressions.time(), Quantity::Time)),
            _ => return None,
        })
    }

    /// Reports a name that is unknown, or not defined yet.
    pub(crate) fn report_unknown(&mut self, env: &Env<'a>, path: &Path, what: &str) {
        let Some(last) = path.segments.last() else {
            return;
        };
        let modules = self.modules;
        let diagnostic = match path.segments.as_slice() {
            [only] if self.is_defined_later(env, &only.name) => {
                let message = format!("`{}` is not defined yet here", only.name);
                Diagnostic::error(codes::E0213, only.span, message)
                    .help("names hold from their definition on: move the definition up")
            }
            [only] => {
                let names = self.globals[env.module].names().chain(vocabulary::names());
                unknown_name(codes::E0201, what, &only.name, only.span, names)
            }
            [library, name] => match modules[env.module].import(&library.name) {
                None => {
                    let names = modules[env.module].import_names();
                    unknown_name(codes::E0201, "import", &library.name, library.span, names)
                }
                Some(_) if name.name.starts_with('_') => {
                    let message = format!("`{}` is private to its file", name.name);
                    Diagnostic::error(codes::E0209, name.span, message)
                }
                Some(ImportTarget::Unreadable) => return,
                Some(ImportTarget::FidgetText(_)) => {
                    let message = format!("`{}` is a shape, and has no names", library.name);
                    let diagnostic = Diagnostic::error(codes::E0201, name.span, message);
                    diagnostic
                        .help("a `.vm` file has one shape, which the import's name stands for")
                }
                Some(ImportTarget::Module(module)) => {
                    let names = self.globals[module].names().filter(|n| !n.starts_with('_'));
                    let what = format!("{what} in `{}`:", library.name);
                    unknown_name(codes::E0201, &what, &name.name, name.span, names)
                }
            },
            _ => {
                let message = "a name has at most one library before it";
                Diagnostic::error(codes::E0201, last.span, message)
            }
        };
        self.report(diagnostic);
    }

    fn is_defined_later(&self, env: &Env<'a>, name: &str) -> bool {
        env.visible_items != u32::MAX && self.modules[env.module].defines(name)
    }

    fn list(&mut self, env: &Env<'a>, items: &'a [Expr]) -> EvalResult<'a> {
        let mut values = Vec::with_capacity(items.len());
        for item in items {
            values.push(self.eval(env, item)?);
        }
        if values.iter().any(Value::is_poison) {
            return Ok(Value::Poison);
        }
        let numbers: Option<Vec<ScalarValue>> = match values.len() {
            2..=4 => values.iter().map(Value::as_number).collect(),
            _ => None,
        };
        Ok(
            match numbers.and_then(|numbers| Vector::from_slice(&numbers)) {
                Some(vector) => Value::Vector(vector),
                None => Value::List(values.into()),
            },
        )
    }

    fn postfix(&mut self, env: &Env<'a>, postfix: &'a Postfix) -> EvalResult<'a> {
        if let ExprKind::Path(path) = &postfix.base.kind
            && let Some(name) = path.as_ident()
            && self.modules[env.module].import(&name.name).is_some()
            && self.lookup(env, path).is_none()
        {
            // The check of names has reported the dot after an import.
            return Ok(Value::Poison);
        }
        let mut value = self.eval(env, &postfix.base)?;
        let mut span = postfix.base.span;
        for suffix in &postfix.suffixes {
            self.charge_step(suffix.span)?;
            value = match &suffix.args {
                Some(args) => self.method_call(env, value, span, suffix, args)?,
                None => self.field_access(env, value, span, suffix),
            };
            span = span.to(suffix.span);
        }
        Ok(value)
    }

    fn field_access(
        &mut self,
        env: &Env<'a>,
        value: Value<'a>,
        span: Span,
        suffix: &'a Suffix,
    ) -> Value<'a> {
        let name = suffix.name.name.as_str();
        let component = match &value {
            Value::Poison => return Value::Poison,
            Value::Vector(vector) => swizzle(vector.components(), name, &["xyzw", "rgba"]),
            Value::Color(parts) => swizzle(&parts.map(ScalarValue::plain), name, &["rgb", "xyz"]),
            Value::Record(record) => {
                let field = record.fields.iter().find(|(field, _)| *field == name);
                field.map(|(_, value)| value.clone())
            }
            Value::Range(range) if name == "start" => Some(Value::Number(range.start)),
            Value::Range(range) if name == "end" => Some(Value::Number(range.end)),
            _ => None,
        };
        if let Some(value) = component {
            return value;
        }
        let what = self.describe(&value);
        let message = format!("{what} has no field `{name}`");
        let diagnostic =
            Diagnostic::error(codes::E0306, suffix.name.span, message).label(span, what);
        let diagnostic = match &value {
            Value::Record(record) => {
                let fields = record.fields.iter().map(|(field, _)| *field);
                let suggestion = super::diagnose::nearest(name, fields);
                super::diagnose::suggest(diagnostic, suffix.name.span, suggestion)
            }
            Value::Vector(vector) => {
                let letters = &"xyzw"[..vector.len()];
                diagnostic.help(format!("its components are `{letters}`, in any order"))
            }
            Value::Number(_)
                if let Some(number) = mistyped_number(self.sources.slice(span), name) =>
            {
                let text = format!("write `{number}`");
                diagnostic.fix(span.to(suffix.name.span), number, text)
            }
            _ if matches!(
                self.lookup_name(env, name),
                Some(Value::Function(_) | Value::Builtin(_))
            ) =>
            {
                let end = suffix.name.span.at_end();
                diagnostic.fix(end, "()", format!("`{name}` is a function: call it"))
            }
            _ => diagnostic,
        };
        self.report(diagnostic);
        Value::Poison
    }

    fn unary(&mut self, env: &Env<'a>, unary: &'a Unary, span: Span) -> EvalResult<'a> {
        let value = self.eval(env, &unary.operand)?;
        Ok(match unary.op {
            UnaryOp::Neg => self.negate(value, unary, span),
            UnaryOp::Not => self.invert(value, unary, span),
        })
    }

    /// Evaluates `!value`: the complement of a shape, or the negation of a condition.
    fn invert(&mut self, value: Value<'a>, unary: &'a Unary, span: Span) -> Value<'a> {
        if value.is_shape() {
            return self.complement(&value, unary.operand.span, span);
        }
        match self.condition(value, unary.operand.span) {
            Some(condition) => Value::Bool(self.op(Op::Not, &[condition])),
            None => Value::Poison,
        }
    }

    fn chain(&mut self, env: &Env<'a>, chain: &'a Chain, span: Span) -> EvalResult<'a> {
        let precedence = chain.links.first().map(|link| link.op.precedence());
        match precedence {
            Some(Precedence::LogicalAnd | Precedence::LogicalOr) => return self.logic(env, chain),
            Some(Precedence::Union | Precedence::Intersection) => {
                return self.csg_chain(env, chain, span);
            }
            _ => {}
        }
        let mut value = self.eval(env, &chain.first)?;
        let mut left_span = chain.first.span;
        for (index, link) in chain.links.iter().enumerate() {
            let is_shape = value.is_shape();
            if link.op == BinaryOp::Sub && (is_shape || link.blend.is_some()) {
                return self.csg_links(env, value, left_span, &chain.links[index..], span);
            }
            let operand = self.eval(env, &link.operand)?;
            value = self.binary(
                link.op,
                value,
                operand,
                (left_span, link.op_span, link.operand.span),
            );
            left_span = left_span.to(link.operand.span);
        }
        Ok(value)
    }

    /// Evaluates `a && b || c`. An operand is evaluated only if the result depends on it.
    fn logic(&mut self, env: &Env<'a>, chain: &'a Chain) -> EvalResult<'a> {
        let first = self.eval(env, &chain.first)?;
        let Some(mut value) = self.condition(first, chain.first.span) else {
            return Ok(Value::Poison);
        };
        for link in &chain.links {
            let decides = if link.op == BinaryOp::LogicalAnd {
                0.0
            } else {
                1.0
            };
            if self.expressions.as_constant(value) == Some(decides) {
                return Ok(Value::Bool(value));
            }
            let operand = self.eval(env, &link.operand)?;
            let Some(operand) = self.condition(operand, link.operand.span) else {
                return Ok(Value::Poison);
            };
            let is_known = self.expressions.stage(value) == Stage::Constant;
            value = match link.op {
                _ if is_known => operand,
                BinaryOp::LogicalAnd => self.expressions.call(Op::And, &[value, operand]),
                _ => self.expressions.call(Op::Or, &[value, operand]),
            };
        }
        Ok(Value::Bool(value))
    }

    fn range(
        &mut self,
        start: Value<'a>,
        end: Value<'a>,
        inclusive: bool,
        start_span: Span,
        end_span: Span,
    ) -> Value<'a> {
        match (start, end) {
            (Value::Number(start), Value::Number(end)) => Value::Range(Range {
                start,
                end,
                inclusive,
            }),
            (Value::Poison, _) | (_, Value::Poison) => Value::Poison,
            (Value::Number(_), other) => {
                self.report_wrong(&other, "a range ends with a number", end_span)
            }
            (other, _) => self.report_wrong(&other, "a range starts with a number", start_span),
        }
    }

    fn if_expr(&mut self, env: &Env<'a>, branch: &'a If, span: Span) -> EvalResult<'a> {
        self.if_arms(env, branch, 0, span)
    }

    fn if_arms(
        &mut self,
        env: &Env<'a>,
        branch: &'a If,
        first: usize,
        span: Span,
    ) -> EvalResult<'a> {
        // Constant conditions are skipped without recursion, since a chain of `else if` may be
        // long.
        for first in first..branch.arms.len() {
            let arm = &branch.arms[first];
            let condition = self.eval(env, &arm.condition)?;
            let Some(condition) = self.condition(condition, arm.condition.span) else {
                return Ok(Value::Poison);
            };
            // A recursion whose end depends on a parameter requires the value of that parameter.
            let recursive =
                self.is_recursive() && self.expressions.stage(condition) == Stage::Uniform;
            let constant = match recursive {
                true => {
                    let demand = Demand::new("the condition of a recursion", arm.condition.span);
                    match self.demand(condition, &demand) {
                        Some(value) => Some(value),
                        None => return Ok(Value::Poison),
                    }
                }
                false => self.expressions.as_constant(condition),
            };
            match constant {
                Some(value) if value != 0.0 => return self.body(env, &arm.body),
                Some(_) => {}
                None => return self.select(env, branch, first, condition, span),
            }
        }
        self.body(env, &branch.else_body)
    }

    /// Evaluates an `if` whose condition is not constant: both values, and a selection between them
    /// if they are numbers. For other values, the condition is required at compile time.
    fn select(
        &mut self,
        env: &Env<'a>,
        branch: &'a If,
        arm_index: usize,
        condition: crate::expression::ExprId,
        span: Span,
    ) -> EvalResult<'a> {
        let arm = &branch.arms[arm_index];
        self.nesting += 1;
        self.path_conditions.push(condition);
        let then = self.body(env, &arm.body)?;
        self.path_conditions.pop();
        let inverse = self.expressions.call(Op::Not, &[condition]);
        self.path_conditions.push(inverse);
        let otherwise = self.if_arms(env, branch, arm_index + 1, span)?;
        self.path_conditions.pop();
        self.nesting -= 1;
        if then.is_poison() || otherwise.is_poison() {
            return Ok(Value::Poison);
        }
        if let Some(value) = self.select_value(condition, &then, &otherwise) {
            return Ok(value);
        }
        let what = format!(
            "the choice between {} and {}",
            self.describe(&then),
            self.describe(&otherwise)
        );
        let demand = Demand::new(&what, arm.condition.span);
        Ok(match self.demand(condition, &demand) {
            Some(value) if value != 0.0 => then,
            Some(_) => otherwise,
            None => Value::Poison,
        })
    }

    fn for_loop(&mut self, env: &Env<'a>, each: &'a For) -> EvalResult<'a> {
        let range = self.eval(env, &each.range)?;
        let Some(values) = self.elements(range, each.range.span) else {
            return Ok(Value::Poison);
        };
        let mut results = Vec::with_capacity(values.len());
        for value in values.iter() {
            let env = env.with(&each.name.name, value.clone());
            let result = self.body(&env, &each.body)?;
            if !matches!(result, Value::Nothing) {
                results.push(result);
            }
        }
        if results.iter().any(Value::is_poison) {
            return Ok(Value::Poison);
        }
        Ok(Value::List(results.into()))
    }

    fn lambda(&mut self, env: &Env<'a>, lambda: &'a Lambda, span: Span) -> Value<'a> {
        Value::Function(Rc::new(Closure {
            name: "",
            params: &lambda.params,
            result: None,
            body: &lambda.body,
            env: env.clone(),
            span,
        }))
    }
}

/// Selects components by letters, `xy` or `zyx`.
fn swizzle<'a>(components: &[ScalarValue], name: &str, alphabets: &[&str]) -> Option<Value<'a>> {
    let pick = |alphabet: &&str| -> Option<Vec<ScalarValue>> {
        name.chars()
            .map(|letter| components.get(alphabet.find(letter)?).copied())
            .collect()
    };
    let picked = alphabets.iter().find_map(pick)?;
    match picked.as_slice() {
        [single] => Some(Value::Number(*single)),
        several => Vector::from_slice(several).map(Value::Vector),
    }
}

/// Returns the number that `1.f` or `1.e3` stands for in other languages.
fn mistyped_number(digits: &str, field: &str) -> Option<String> {
    if !digits.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let number = match field {
        "f" | "F" => format!("{digits}.0"),
        _ => format!("{digits}{field}"),
    };
    number.parse::<f64>().is_ok().then_some(number)
}
