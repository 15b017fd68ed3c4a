//! Expressions: what each kind of expression means.
//!
//! Evaluation is plain recursion over the tree. It is bounded by a budget of steps, by the depth of
//! calls and by the depth of nested expressions; passing one of these ends the run with a message
//! and a [`Halt`]. Any other mistake is reported and gives a [`Value::Poison`], which is silent in
//! all that follows.

use super::blend::Blend;
use super::diagnose::unknown_name;
use super::scope::Scope;
use super::stage::Demand;
use super::value::{Closure, List, Number, Quantity, Range, Value, Vector};
use super::{Elaborator, vocabulary};
use crate::expression::Stage;
use crate::scene::Shape;
use sdfc_lang::ast::{
    BinaryOp, Body, Chain, Expr, ExprKind, For, If, Lambda, NumberValue, Path, Postfix, Precedence,
    StatementKind, Suffix, Unary, UnaryOp, Unit,
};
use sdfc_lang::{Diagnostic, Span, codes};
use std::rc::Rc;

/// The most steps of a run; a step is an expression evaluated.
pub(crate) const MAX_STEPS: u64 = 5_000_000;
/// The most different numbers of a run.
const MAX_NUMBERS: usize = 8_000_000;
/// The most expressions within each other, calls included.
const MAX_NESTING: u32 = 6_000;
/// The most lists within lists, and functions that remember functions.
const MAX_VALUE_DEPTH: u32 = 1_000;
/// The most elements that a loop may have.
pub(crate) const MAX_LOOP: f64 = 100_000.0;

/// The run cannot go on; why has been reported.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Halt;

/// What evaluation gives.
pub(crate) type Outcome<'a> = Result<Value<'a>, Halt>;

/// Where an expression stands: the names it sees, and the blend of the operators written in it.
#[derive(Clone, Debug)]
pub(crate) struct Here<'a> {
    /// The local names.
    pub(crate) scope: Scope<'a>,
    /// The module.
    pub(crate) module: usize,
    /// How many of the module's definitions stand before it.
    pub(crate) horizon: u32,
    /// The blend of plain operators.
    pub(crate) blend: Option<Rc<Blend>>,
}

impl<'a> Here<'a> {
    /// The same place with one more name.
    pub(crate) fn with(&self, name: &'a str, value: Value<'a>) -> Self {
        Self {
            scope: self.scope.with(name, value),
            ..self.clone()
        }
    }
}

impl<'a> Elaborator<'a> {
    /// The meaning of an expression.
    pub(crate) fn eval(&mut self, here: &Here<'a>, expr: &'a Expr) -> Outcome<'a> {
        self.tick(expr.span)?;
        self.nesting += 1;
        if self.nesting > MAX_NESTING {
            let message = format!("this nests more than {MAX_NESTING} levels deep, calls included");
            self.report(Diagnostic::error(codes::E0408, expr.span, message));
            return Err(Halt);
        }
        let result = self.eval_kind(here, expr)?;
        self.nesting -= 1;
        self.check_value_depth(&result, expr.span)?;
        Ok(result)
    }

    /// Ends the run where values are too deep within each other to be let go of again.
    pub(crate) fn check_value_depth(&mut self, value: &Value<'a>, span: Span) -> Result<(), Halt> {
        if value.depth() <= MAX_VALUE_DEPTH {
            return Ok(());
        }
        let message = format!("values are more than {MAX_VALUE_DEPTH} deep within each other");
        let help = "put lists one after the other by `concat`";
        self.report(Diagnostic::error(codes::E0408, span, message).help(help));
        Err(Halt)
    }

    fn eval_kind(&mut self, here: &Here<'a>, expr: &'a Expr) -> Outcome<'a> {
        match &expr.kind {
            ExprKind::Number(number) => Ok(Value::Number(self.literal(number.value, number.unit))),
            ExprKind::Color(bytes) => Ok(Value::Color(self.srgb(*bytes))),
            ExprKind::Text(text) => Ok(Value::Text(text.as_str().into())),
            ExprKind::Bool(truth) => Ok(Value::Bool(self.truth(*truth))),
            ExprKind::Path(path) => Ok(self.path(here, path)),
            ExprKind::List(items) => self.list(here, items),
            ExprKind::Paren(inner) => self.eval(here, inner),
            ExprKind::Call(call) => self.call(here, call, expr.span),
            ExprKind::Postfix(postfix) => self.postfix(here, postfix),
            ExprKind::Unary(unary) => self.unary(here, unary, expr.span),
            ExprKind::Chain(chain) => self.chain(here, chain, expr.span),
            ExprKind::Range(range) => {
                let start = self.eval(here, &range.start)?;
                let end = self.eval(here, &range.end)?;
                Ok(self.range(
                    start,
                    end,
                    range.inclusive,
                    range.start.span,
                    range.end.span,
                ))
            }
            ExprKind::If(branch) => self.branch(here, branch, expr.span),
            ExprKind::For(each) => self.each(here, each),
            ExprKind::BlendScope(scope) => {
                let Some(blend) = self.blend(here, &scope.blend, None)? else {
                    return Ok(Value::Poison);
                };
                let here = Here {
                    blend: Some(Rc::new(blend)),
                    ..here.clone()
                };
                self.body(&here, &scope.body)
            }
            ExprKind::Lambda(lambda) => Ok(self.lambda(here, lambda, expr.span)),
        }
    }

    /// One step of the budget.
    pub(crate) fn tick(&mut self, span: Span) -> Result<(), Halt> {
        self.steps += 1;
        if self.steps > MAX_STEPS || self.graph.len() > MAX_NUMBERS {
            let message = match self.steps > MAX_STEPS {
                true => format!("the scene takes more than {MAX_STEPS} steps to build"),
                false => format!("the scene computes more than {MAX_NUMBERS} different numbers"),
            };
            let help = "use fewer repetitions, or `repeat` and `polar`, which cost nothing";
            self.report(Diagnostic::error(codes::E0409, span, message).help(help));
            return Err(Halt);
        }
        if self.reports.is_full() {
            Err(Halt)
        } else {
            Ok(())
        }
    }

    /// The meaning of a body: its statements in order, then its value.
    pub(crate) fn body(&mut self, here: &Here<'a>, body: &'a Body) -> Outcome<'a> {
        if body.statements.is_empty() {
            return self.eval(here, &body.result);
        }
        let mut here = here.clone();
        for statement in &body.statements {
            match &statement.kind {
                StatementKind::Let(binding) => {
                    let value = self.binding(&here, binding)?;
                    here = here.with(&binding.name.name, value);
                }
                StatementKind::Expr(expr) => {
                    self.eval(&here, expr)?;
                }
            }
        }
        self.eval(&here, &body.result)
    }

    /// The value of a `let`, which takes its type and, if it is a shape, gives it its name.
    pub(crate) fn binding(
        &mut self,
        here: &Here<'a>,
        binding: &'a sdfc_lang::ast::Let,
    ) -> Outcome<'a> {
        let value = self.eval(here, &binding.value)?;
        let value = match &binding.annotation {
            Some(wanted) => self.annotated(value, wanted, binding.value.span),
            None => value,
        };
        self.name_shape(&value, &binding.name.name);
        Ok(value)
    }

    /// Gives a shape a name for listings, if it has none.
    pub(crate) fn name_shape(&mut self, value: &Value<'a>, name: &str) {
        if let Value::Shape(id) = value {
            let shape: &mut Shape = &mut self.shapes[id.0 as usize];
            if shape.name.is_empty() {
                name.clone_into(&mut shape.name);
            }
        }
    }

    fn literal(&mut self, value: NumberValue, unit: Unit) -> Number {
        let amount = value.to_f64();
        let length = |millimetres: f64| (amount * millimetres / self.unit, Quantity::Length(1));
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
        let whole = matches!(value, NumberValue::Int(_)) && unit == Unit::None;
        Number {
            id: self.graph.constant(amount),
            quantity,
            whole,
        }
    }

    fn path(&mut self, here: &Here<'a>, path: &'a Path) -> Value<'a> {
        match self.lookup(here, path) {
            Some(value) => value,
            None => {
                self.report_unknown(here, path, "name");
                Value::Poison
            }
        }
    }

    /// What a name stands for: the scene's own names first, then the language's.
    pub(crate) fn lookup(&mut self, here: &Here<'a>, path: &'a Path) -> Option<Value<'a>> {
        match path.segments.as_slice() {
            [only] => self.lookup_name(here, &only.name),
            [library, name] => {
                let module = self.modules.get(here.module)?.import(&library.name)?;
                let Some(module) = module else {
                    // The file could not be read, which has been said.
                    return Some(Value::Poison);
                };
                if name.name.starts_with('_') {
                    return None;
                }
                self.globals[module].get(&name.name, u32::MAX).cloned()
            }
            _ => None,
        }
    }

    /// What a name without a library stands for.
    pub(crate) fn lookup_name(&mut self, here: &Here<'a>, name: &str) -> Option<Value<'a>> {
        if let Some(value) = here.scope.get(name) {
            return Some(value.clone());
        }
        if let Some(value) = self.globals[here.module].get(name, here.horizon) {
            return Some(value.clone());
        }
        self.constant_of_language(name)
            .or_else(|| vocabulary::function(name).map(Value::Builtin))
    }

    /// The constants of the language.
    fn constant_of_language(&mut self, name: &str) -> Option<Value<'a>> {
        use std::f64::consts;
        let axis = |graph: &mut crate::expression::Expressions, along: usize| {
            let part = |i| Number::int(graph.constant(if i == along { 1.0 } else { 0.0 }));
            Value::Vector(Vector::three([0, 1, 2].map(part)))
        };
        Some(match name {
            "X" => axis(&mut self.graph, 0),
            "Y" => axis(&mut self.graph, 1),
            "Z" => axis(&mut self.graph, 2),
            "pi" => Value::Number(Number::plain(self.graph.constant(consts::PI))),
            "tau" => Value::Number(Number::plain(self.graph.constant(consts::TAU))),
            "time" => Value::Number(Number::of(self.graph.time(), Quantity::Time)),
            _ => return None,
        })
    }

    /// Says that a name is unknown, or not there yet.
    pub(crate) fn report_unknown(&mut self, here: &Here<'a>, path: &Path, what: &str) {
        let Some(last) = path.segments.last() else {
            return;
        };
        let modules = self.modules;
        let diagnostic = match path.segments.as_slice() {
            [only] if self.is_defined_later(here, &only.name) => {
                let message = format!("`{}` is not defined yet here", only.name);
                Diagnostic::error(codes::E0213, only.span, message)
                    .help("names hold from their definition on: move the definition up")
            }
            [only] => {
                let known = self.globals[here.module].names().chain(vocabulary::names());
                unknown_name(codes::E0201, what, &only.name, only.span, known)
            }
            [library, name] => match modules[here.module].import(&library.name) {
                None => {
                    let known = modules[here.module].import_names();
                    unknown_name(codes::E0201, "import", &library.name, library.span, known)
                }
                Some(_) if name.name.starts_with('_') => {
                    let message = format!("`{}` is private to its file", name.name);
                    Diagnostic::error(codes::E0209, name.span, message)
                }
                Some(None) => return,
                Some(Some(module)) => {
                    let known = self.globals[module].names().filter(|n| !n.starts_with('_'));
                    let what = format!("{what} in `{}`:", library.name);
                    unknown_name(codes::E0201, &what, &name.name, name.span, known)
                }
            },
            _ => {
                let message = "a name has at most one library before it";
                Diagnostic::error(codes::E0201, last.span, message)
            }
        };
        self.report(diagnostic);
    }

    fn is_defined_later(&self, here: &Here<'a>, name: &str) -> bool {
        here.horizon != u32::MAX && self.modules[here.module].defines(name)
    }

    fn list(&mut self, here: &Here<'a>, items: &'a [Expr]) -> Outcome<'a> {
        let mut values = Vec::with_capacity(items.len());
        for item in items {
            values.push(self.eval(here, item)?);
        }
        if values.iter().any(Value::is_poison) {
            return Ok(Value::Poison);
        }
        let numbers: Option<Vec<Number>> = match values.len() {
            2..=4 => values.iter().map(as_number).collect(),
            _ => None,
        };
        Ok(
            match numbers.and_then(|numbers| Vector::from_slice(&numbers)) {
                Some(vector) => Value::Vector(vector),
                None => Value::List(values.into()),
            },
        )
    }

    fn postfix(&mut self, here: &Here<'a>, postfix: &'a Postfix) -> Outcome<'a> {
        let mut value = self.eval(here, &postfix.base)?;
        let mut span = postfix.base.span;
        for suffix in &postfix.suffixes {
            self.tick(suffix.span)?;
            value = match &suffix.args {
                Some(args) => self.method(here, value, span, suffix, args)?,
                None => self.field(here, value, span, suffix),
            };
            span = span.to(suffix.span);
        }
        Ok(value)
    }

    fn field(
        &mut self,
        here: &Here<'a>,
        value: Value<'a>,
        span: Span,
        suffix: &'a Suffix,
    ) -> Value<'a> {
        let name = suffix.name.name.as_str();
        let found = match &value {
            Value::Poison => return Value::Poison,
            Value::Vector(vector) => swizzle(vector.parts(), name, &["xyzw", "rgba"]),
            Value::Color(parts) => swizzle(&parts.map(Number::plain), name, &["rgb", "xyz"]),
            Value::Record(record) => {
                let field = record.fields.iter().find(|(field, _)| *field == name);
                field.map(|(_, value)| value.clone())
            }
            Value::Range(range) if name == "start" => Some(Value::Number(range.start)),
            Value::Range(range) if name == "end" => Some(Value::Number(range.end)),
            _ => None,
        };
        if let Some(value) = found {
            return value;
        }
        let what = self.describe(&value);
        let message = format!("{what} has no field `{name}`");
        let diagnostic =
            Diagnostic::error(codes::E0306, suffix.name.span, message).label(span, what);
        let diagnostic = match &value {
            Value::Record(record) => {
                let fields = record.fields.iter().map(|(field, _)| *field);
                let near = super::diagnose::nearest(name, fields);
                super::diagnose::suggest(diagnostic, suffix.name.span, near)
            }
            Value::Vector(vector) => {
                let letters = &"xyzw"[..vector.len()];
                diagnostic.help(format!("its components are `{letters}`, in any order"))
            }
            _ if matches!(
                self.lookup_name(here, name),
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

    fn unary(&mut self, here: &Here<'a>, unary: &'a Unary, span: Span) -> Outcome<'a> {
        let value = self.eval(here, &unary.operand)?;
        Ok(match unary.op {
            UnaryOp::Neg => self.negated(value, unary, span),
            UnaryOp::Not => self.inverted(value, unary, span),
        })
    }

    fn chain(&mut self, here: &Here<'a>, chain: &'a Chain, span: Span) -> Outcome<'a> {
        let precedence = chain.rest.first().map(|link| link.op.precedence());
        match precedence {
            Some(Precedence::Both | Precedence::Either) => return self.logic(here, chain),
            Some(Precedence::Union | Precedence::Intersection) => {
                return self.csg_chain(here, chain, span);
            }
            _ => {}
        }
        let mut value = self.eval(here, &chain.first)?;
        let mut before = chain.first.span;
        for (at, link) in chain.rest.iter().enumerate() {
            let is_shape = self.is_shape(&value);
            if link.op == BinaryOp::Sub && (is_shape || link.blend.is_some()) {
                return self.csg_links(here, value, before, &chain.rest[at..], span);
            }
            let operand = self.eval(here, &link.operand)?;
            value = self.binary(
                link.op,
                value,
                operand,
                (before, link.op_span, link.operand.span),
            );
            before = before.to(link.operand.span);
        }
        Ok(value)
    }

    /// `a && b || c`: what need not be known is not evaluated.
    fn logic(&mut self, here: &Here<'a>, chain: &'a Chain) -> Outcome<'a> {
        let first = self.eval(here, &chain.first)?;
        let Some(mut value) = self.condition(first, chain.first.span) else {
            return Ok(Value::Poison);
        };
        for link in &chain.rest {
            let decides = if link.op == BinaryOp::Both { 0.0 } else { 1.0 };
            if self.graph.as_constant(value) == Some(decides) {
                return Ok(Value::Bool(value));
            }
            let operand = self.eval(here, &link.operand)?;
            let Some(operand) = self.condition(operand, link.operand.span) else {
                return Ok(Value::Poison);
            };
            let is_known = self.graph.stage(value) == Stage::Constant;
            value = match link.op {
                _ if is_known => operand,
                BinaryOp::Both => self.graph.call(sdfc_vm::table::Op::And, &[value, operand]),
                _ => self.graph.call(sdfc_vm::table::Op::Or, &[value, operand]),
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
            (Value::Number(_), other) => self.wrong(&other, "a range ends with a number", end_span),
            (other, _) => self.wrong(&other, "a range starts with a number", start_span),
        }
    }

    fn branch(&mut self, here: &Here<'a>, branch: &'a If, span: Span) -> Outcome<'a> {
        self.arms(here, branch, 0, span)
    }

    fn arms(&mut self, here: &Here<'a>, branch: &'a If, at: usize, span: Span) -> Outcome<'a> {
        // Constant conditions are passed over without recursion: a ladder may be long.
        for at in at..branch.arms.len() {
            let arm = &branch.arms[at];
            let condition = self.eval(here, &arm.condition)?;
            let Some(condition) = self.condition(condition, arm.condition.span) else {
                return Ok(Value::Poison);
            };
            // A function that calls itself until a parameter says so must know its value.
            let recursive = self.is_recursive() && self.graph.stage(condition) == Stage::Uniform;
            let known = match recursive {
                true => {
                    let demand = Demand::new("the condition of a recursion", arm.condition.span);
                    match self.demand(condition, &demand) {
                        Some(value) => Some(value),
                        None => return Ok(Value::Poison),
                    }
                }
                false => self.graph.as_constant(condition),
            };
            match known {
                Some(value) if value != 0.0 => return self.body(here, &arm.body),
                Some(_) => {}
                None => return self.select(here, branch, at, condition, span),
            }
        }
        self.body(here, &branch.otherwise)
    }

    /// An `if` whose condition is not known while compiling: both values, and a choice between
    /// them if they are numbers. A choice between shapes needs the condition's value.
    fn select(
        &mut self,
        here: &Here<'a>,
        branch: &'a If,
        at: usize,
        condition: crate::expression::ExprId,
        span: Span,
    ) -> Outcome<'a> {
        let arm = &branch.arms[at];
        self.nesting += 1;
        self.guards.push(condition);
        let then = self.body(here, &arm.body)?;
        self.guards.pop();
        let inverse = self.graph.call(sdfc_vm::table::Op::Not, &[condition]);
        self.guards.push(inverse);
        let otherwise = self.arms(here, branch, at + 1, span)?;
        self.guards.pop();
        self.nesting -= 1;
        if then.is_poison() || otherwise.is_poison() {
            return Ok(Value::Poison);
        }
        if let Some(value) = self.choice(condition, &then, &otherwise) {
            return Ok(value);
        }
        let what = format!(
            "which of {} and {} it is",
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

    fn each(&mut self, here: &Here<'a>, each: &'a For) -> Outcome<'a> {
        let range = self.eval(here, &each.range)?;
        let Some(values) = self.elements(range, each.range.span) else {
            return Ok(Value::Poison);
        };
        let mut results = Vec::with_capacity(values.len());
        for value in values.iter() {
            let here = here.with(&each.name.name, value.clone());
            let result = self.body(&here, &each.body)?;
            if !matches!(result, Value::Nothing) {
                results.push(result);
            }
        }
        if results.iter().any(Value::is_poison) {
            return Ok(Value::Poison);
        }
        Ok(Value::List(results.into()))
    }

    /// The values that a loop goes through.
    pub(crate) fn elements(&mut self, value: Value<'a>, span: Span) -> Option<List<'a>> {
        let list = self.elements_free(value, span)?;
        // Going through a list is work, whatever is done with its elements.
        self.steps += list.len() as u64;
        Some(list)
    }

    fn elements_free(&mut self, value: Value<'a>, span: Span) -> Option<List<'a>> {
        match value {
            Value::Poison => None,
            Value::List(list) => Some(list),
            Value::Vector(vector) => {
                Some(vector.parts().iter().map(|n| Value::Number(*n)).collect())
            }
            Value::Range(range) => self.counted(range, span),
            other => {
                self.wrong(&other, "a loop goes through a range or a list", span);
                None
            }
        }
    }

    fn counted(&mut self, range: Range, span: Span) -> Option<List<'a>> {
        let demand = Demand::new("a loop count", span);
        let start = self.demand(range.start.id, &demand);
        let end = self.demand(range.end.id, &demand);
        let (start, end) = (start?, end?);
        let last = if range.inclusive {
            end.floor()
        } else {
            end.ceil() - 1.0
        };
        if start.fract() != 0.0 {
            let message = format!("a loop counts from a whole number, and this is {start}");
            self.report(Diagnostic::error(codes::E0401, span, message));
            return None;
        }
        let count = (last - start + 1.0).max(0.0);
        if count.is_nan() || count > MAX_LOOP {
            let message = format!("this loop has {count} rounds, and {MAX_LOOP} are the most");
            let help = "use `repeat` or `polar` for many copies: they cost nothing";
            self.report(Diagnostic::error(codes::E0412, span, message).help(help));
            return None;
        }
        let one = |i: u32| {
            let id = self.graph.constant(start + f64::from(i));
            Value::Number(Number {
                id,
                quantity: range.start.quantity,
                whole: true,
            })
        };
        Some((0..count as u32).map(one).collect())
    }

    fn lambda(&mut self, here: &Here<'a>, lambda: &'a Lambda, span: Span) -> Value<'a> {
        Value::Function(Rc::new(Closure {
            name: "",
            params: &lambda.params,
            result: None,
            body: &lambda.body,
            here: here.clone(),
            span,
        }))
    }
}

/// The number that a value is, if it is one.
pub(crate) fn as_number(value: &Value<'_>) -> Option<Number> {
    match value {
        Value::Number(number) => Some(*number),
        _ => None,
    }
}

/// Components picked by letters, `xy` or `zyx`.
fn swizzle<'a>(parts: &[Number], name: &str, alphabets: &[&str]) -> Option<Value<'a>> {
    let pick = |alphabet: &&str| -> Option<Vec<Number>> {
        name.chars()
            .map(|letter| parts.get(alphabet.find(letter)?).copied())
            .collect()
    };
    let picked = alphabets.iter().find_map(pick)?;
    match picked.as_slice() {
        [one] => Some(Value::Number(*one)),
        several => Vector::from_slice(several).map(Value::Vector),
    }
}
