//! When numbers are known: what they are now, and which parameters become structural because a
//! number must be known while compiling.

use super::Elaborator;
use crate::expression::{ExprId, Expression, Stage};
use crate::scene::Check;
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::table::Op;

/// Why a number must be known while compiling.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Demand<'d> {
    what: &'d str,
    span: Span,
}

impl<'d> Demand<'d> {
    /// `what` as the subject of a sentence, "a loop count".
    pub(crate) fn new(what: &'d str, span: Span) -> Self {
        Self { what, span }
    }
}

impl<'a> Elaborator<'a> {
    /// What a number is at the present parameters and time.
    pub(crate) fn present(&mut self, id: ExprId) -> f64 {
        match self.graph.as_constant(id) {
            Some(value) => value,
            None => self
                .present
                .value(&self.graph, &self.params, self.options.time, id),
        }
    }

    /// The value of a number that must be known while compiling. Parameters that it depends on
    /// become structural; it cannot depend on the time or on a point.
    pub(crate) fn demand(&mut self, id: ExprId, demand: &Demand<'_>) -> Option<f64> {
        if let Some(value) = self.graph.as_constant(id) {
            return Some(value);
        }
        let sources = self.sources_of(id);
        let blamed = sources.iter().find_map(|source| match source {
            Expression::Time => Some("`time`"),
            Expression::Coordinate(_) => Some("the point"),
            Expression::NormalComponent(_) => Some("the normal"),
            Expression::Constant(_) | Expression::Param(..) | Expression::Apply { .. } => None,
        });
        if let Some(blamed) = blamed {
            let message = format!("{} cannot depend on {blamed}", demand.what);
            let note = match blamed {
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
        Some(self.present(id))
    }

    /// Everything that a number depends on in the end.
    fn sources_of(&self, id: ExprId) -> Vec<Expression> {
        let mut seen = std::collections::HashSet::new();
        let mut pending = vec![id];
        let mut sources = Vec::new();
        while let Some(id) = pending.pop() {
            if !seen.insert(id) {
                continue;
            }
            match self.graph.get(id) {
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

    /// Asks that a uniform number stay above zero (or at it), now and whenever a parameter changes.
    /// Says whether it does now; where it does not, that is reported.
    pub(crate) fn check(
        &mut self,
        value: ExprId,
        strict: bool,
        span: Span,
        message: impl FnOnce(f64) -> Diagnostic,
        later: &str,
    ) -> bool {
        let now = self.present(value);
        let holds = if strict { now > 0.0 } else { now >= 0.0 };
        if self.guards.is_empty() && !holds {
            self.report(message(now));
            return false;
        }
        if self.graph.stage(value) == Stage::Constant {
            if !holds {
                self.report(message(now));
            }
            return holds;
        }
        // Where a condition on parameters decides whether this is used, it counts only then.
        let mut value = value;
        for guard in self.guards.clone() {
            let one = self.graph.constant(1.0);
            value = self.graph.call(Op::Select, &[guard, value, one]);
        }
        if self.graph.stage(value) == Stage::Uniform && self.checked.insert((value, strict)) {
            let message = later.to_owned();
            self.checks.push(Check {
                value,
                strict,
                message,
                span,
            });
        }
        true
    }
}
