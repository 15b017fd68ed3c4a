//! Evaluation of numbers at compile time. A parameter becomes structural if the value of a number
//! that depends on it is required then.

use super::Elaborator;
use crate::expression::{ExprId, Expression, Stage};
use crate::scene::SceneCheck;
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::table::Op;

/// Reason for which a number is required at compile time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Demand<'d> {
    subject: &'d str,
    span: Span,
}

impl<'d> Demand<'d> {
    /// Creates a reason from a subject of a sentence, such as "a loop count".
    pub(crate) fn new(what: &'d str, span: Span) -> Self {
        Self {
            subject: what,
            span,
        }
    }
}

impl<'a> Elaborator<'a> {
    /// Returns the value of a number at the current parameters and time.
    pub(crate) fn current_value(&mut self, id: ExprId) -> f64 {
        match self.expressions.as_constant(id) {
            Some(value) => value,
            None => {
                self.uniform_values
                    .value(&self.expressions, &self.params, self.options.time, id)
            }
        }
    }

    /// Returns the value of a number that is required at compile time. Parameters that it depends
    /// on become structural. Dependence on the time, the point or the normal is an error.
    pub(crate) fn demand(&mut self, id: ExprId, demand: &Demand<'_>) -> Option<f64> {
        if let Some(value) = self.expressions.as_constant(id) {
            return Some(value);
        }
        let sources = self.leaf_dependencies(id);
        let dependency = sources.iter().find_map(|source| match source {
            Expression::Time => Some("`time`"),
            Expression::Coordinate(_) => Some("the point"),
            Expression::NormalComponent(_) => Some("the normal"),
            Expression::Constant(_) | Expression::Param(..) | Expression::Apply { .. } => None,
        });
        if let Some(dependency) = dependency {
            let message = format!("{} cannot depend on {dependency}", demand.subject);
            let note = match dependency {
                "`time`" => "it decides the structure of the scene, which is compiled once",
                _ => "it is needed to build the scene, before there is a point",
            };
            let diagnostic = Diagnostic::error(codes::E0308, demand.span, message).note(note);
            self.report(diagnostic);
            return None;
        }
        for source in sources {
            if let Expression::Param(param, _) = source {
                self.demanded.insert(param.0);
            }
        }
        Some(self.current_value(id))
    }

    /// Returns the parameters, coordinates and constants that a number depends on, directly or not.
    fn leaf_dependencies(&self, id: ExprId) -> Vec<Expression> {
        let mut visited = std::collections::HashSet::new();
        let mut pending = vec![id];
        let mut sources = Vec::new();
        while let Some(id) = pending.pop() {
            if !visited.insert(id) {
                continue;
            }
            match self.expressions.get(id) {
                Expression::Apply {
                    point,
                    values,
                    parameters,
                    ..
                } => {
                    pending.extend(point.iter().flatten().chain(values).chain(parameters));
                }
                source => sources.push(source.clone()),
            }
        }
        sources
    }

    /// Requires a uniform number to be positive (or, unless `strict`, not negative), now and after
    /// each change of a parameter. Returns whether it is now; reports an error if not.
    pub(crate) fn check(
        &mut self,
        value: ExprId,
        strict: bool,
        span: Span,
        message: impl FnOnce(f64) -> Diagnostic,
        violation: &str,
    ) -> bool {
        let current = self.current_value(value);
        let holds = if strict {
            current > 0.0
        } else {
            current >= 0.0
        };
        if self.path_conditions.is_empty() && !holds {
            self.report(message(current));
            return false;
        }
        if self.expressions.stage(value) == Stage::Constant {
            if !holds {
                self.report(message(current));
            }
            return holds;
        }
        // Inside a branch on parameters, the check applies only while the branch is taken.
        let mut value = value;
        for guard in self.path_conditions.clone() {
            let one = self.expressions.constant(1.0);
            value = self.expressions.call(Op::Select, &[guard, value, one]);
        }
        if self.expressions.stage(value) == Stage::Uniform
            && self.emitted_checks.insert((value, strict))
        {
            let message = violation.to_owned();
            self.checks.push(SceneCheck {
                value,
                strict,
                message,
                span,
            });
        }
        true
    }
}
