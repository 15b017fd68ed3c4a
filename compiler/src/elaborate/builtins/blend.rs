//! Blends: kinds of transition between two surfaces, and their operations in the table.

use crate::elaborate::Elaborator;
use crate::elaborate::arguments::{PassedArg, word};
use crate::elaborate::blend_spec::{BlendKind, BlendSpec, SetOperator};
use crate::elaborate::constness::Demand;
use crate::elaborate::diagnose::{nearest, suggest, unknown_name};
use crate::elaborate::display::format_short;
use crate::elaborate::value::{Abort, Env, Quantity, Value};
use crate::expression::{ExprId, Stage};
use crate::scene::ShapeId;
use sdfc_lang::ast::{Arg, Args};
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::table::Op;

impl<'a> Elaborator<'a> {
    /// Returns the operation of a set operation with a blend, and its parameters.
    pub(crate) fn set_row(
        &mut self,
        operation: SetOperator,
        blend: Option<&BlendSpec>,
    ) -> Option<(Op, Vec<ExprId>)> {
        use BlendKind as K;
        use SetOperator as S;
        let Some(blend) = blend else {
            let row = match operation {
                S::Union => Op::Union,
                S::Intersection => Op::Intersection,
                S::Subtraction => Op::Subtraction,
            };
            return Some((row, Vec::new()));
        };
        let row = match (blend.kind, operation) {
            (K::Quadratic, S::Union) => Op::SmoothUnion,
            (K::Quadratic, S::Intersection) => Op::SmoothIntersection,
            (K::Quadratic, S::Subtraction) => Op::SmoothSubtraction,
            (K::Cubic, S::Union) => Op::CubicUnion,
            (K::Cubic, S::Intersection) => Op::CubicIntersection,
            (K::Cubic, S::Subtraction) => Op::CubicSubtraction,
            (K::Circular, S::Union) => Op::CircularUnion,
            (K::Circular, S::Intersection) => Op::CircularIntersection,
            (K::Circular, S::Subtraction) => Op::CircularSubtraction,
            (K::Exponential, S::Union) => Op::ExponentialUnion,
            (K::Exponential, S::Intersection) => Op::ExponentialIntersection,
            (K::Exponential, S::Subtraction) => Op::ExponentialSubtraction,
            (K::Chamfer, S::Union) => Op::ChamferUnion,
            (K::Chamfer, S::Intersection) => Op::ChamferIntersection,
            (K::Chamfer, S::Subtraction) => Op::ChamferSubtraction,
            (K::Fillet, S::Union) => Op::RoundUnion,
            (K::Fillet, S::Intersection) => Op::RoundIntersection,
            (K::Fillet, S::Subtraction) => Op::RoundSubtraction,
            (K::Stairs, S::Union) => Op::StairsUnion,
            (K::Stairs, S::Intersection) => Op::StairsIntersection,
            (K::Stairs, S::Subtraction) => Op::StairsSubtraction,
            (K::Distance, S::Union) => Op::DistanceUnion,
            (K::Distance, S::Intersection | S::Subtraction) => {
                let message = "the distance-aware blend goes with unions only";
                let help = "use `quadratic`, `cubic`, `circular` or `exponential` here";
                self.report(Diagnostic::error(codes::E0302, blend.span, message).help(help));
                return None;
            }
        };
        let mut arguments = vec![blend.amount];
        if blend.kind == K::Distance {
            // At the origin, the blend is as thick as the amount. It grows by 0.1 per unit of
            // distance, to at most 4 times the amount.
            let (zero, growth, times) = (
                self.expressions.constant(0.0),
                self.expressions.constant(0.1),
                self.expressions.constant(4.0),
            );
            let max_amount = self.op(Op::Mul, &[blend.amount, times]);
            arguments = vec![zero, zero, zero, blend.amount, growth, max_amount];
        }
        if blend.kind == K::Stairs {
            let steps = blend
                .steps
                .unwrap_or_else(|| self.expressions.constant(3.0));
            arguments.push(steps);
        }
        Some((row, self.prepare_parameters(row, &arguments)))
    }

    /// Evaluates a blend in brackets after an operator, or in a scope.
    pub(crate) fn blend(
        &mut self,
        env: &Env<'a>,
        args: &'a Args,
        operator: Option<Span>,
    ) -> Result<Option<BlendSpec>, Abort> {
        let positional = args
            .args
            .iter()
            .take_while(|arg| arg.name.is_none())
            .count();
        let mut kind = BlendKind::Quadratic;
        let mut remaining = args.args.as_slice();
        // A single argument is the radius, even if a parameter is called `fillet`. Of two, the
        // first is the kind.
        if positional > 1 || positional == 1 && args.args.len() > 1 && is_kind(&args.args[0]) {
            let Some(word) = word(&args.args[0].value) else {
                let message = "a blend is a radius, or a kind and a radius";
                let help = "write `[0.2]` or `[chamfer, 0.2]`";
                let span = args.args[0].span;
                self.report(Diagnostic::error(codes::E0301, span, message).help(help));
                return Ok(None);
            };
            let Some(named) = BlendKind::from_word(&word.name) else {
                let diagnostic = unknown_name(
                    codes::E0201,
                    "blend",
                    &word.name,
                    word.span,
                    BlendKind::names(),
                );
                let names = BlendKind::names().collect::<Vec<_>>().join(", ");
                self.report(diagnostic.help(format!("there are {names}")));
                return Ok(None);
            };
            kind = named;
            remaining = &args.args[1..];
        }
        let mut amount = None;
        let mut steps = None;
        for arg in remaining {
            let value = self.eval(env, &arg.value)?;
            match arg.name.as_ref().map(|name| name.name.as_str()) {
                None if amount.is_none() => {
                    let Some(id) = self.blend_amount(&value, arg.value.span) else {
                        return Ok(None);
                    };
                    amount = Some(id);
                }
                Some("n") if kind == BlendKind::Stairs => {
                    let Some(id) = self.stair_count(&value, arg.value.span) else {
                        return Ok(None);
                    };
                    steps = Some(id);
                }
                Some(name) => {
                    let message = format!("a blend has no argument `{name}`");
                    let allowed = if kind == BlendKind::Stairs {
                        vec!["n"]
                    } else {
                        vec![]
                    };
                    let diagnostic = Diagnostic::error(codes::E0203, arg.span, message);
                    self.report(suggest(diagnostic, arg.span, nearest(name, allowed)));
                    return Ok(None);
                }
                None => {
                    let message = "a blend has one radius";
                    self.report(Diagnostic::error(codes::E0205, arg.span, message));
                    return Ok(None);
                }
            }
        }
        let Some(amount) = amount else {
            let message = "this blend has no radius";
            self.report(Diagnostic::error(codes::E0204, args.span, message));
            return Ok(None);
        };
        let span = operator.map_or(args.span, |operator_span| operator_span.to(args.span));
        Ok(Some(BlendSpec {
            kind,
            amount,
            steps,
            span,
        }))
    }

    pub(crate) fn blend_amount(&mut self, value: &Value<'a>, span: Span) -> Option<ExprId> {
        let number = match value {
            Value::Number(number)
                if matches!(number.quantity, Quantity::Plain | Quantity::Length(1)) =>
            {
                *number
            }
            other => {
                self.report_wrong(other, "a blend needs a length", span);
                return None;
            }
        };
        let stage = self.expressions.stage(number.id);
        if stage > Stage::Uniform {
            self.report_too_late("the radius of a blend", stage, span);
            return None;
        }
        self.check_above("the radius of a blend", number.id, false, span)?;
        Some(number.id)
    }

    pub(crate) fn stair_count(&mut self, value: &Value<'a>, span: Span) -> Option<ExprId> {
        let Value::Number(number) = value else {
            self.report_wrong(value, "`n` is a whole number", span);
            return None;
        };
        let count = self.demand(number.id, &Demand::new("the number of stairs", span))?;
        if !(1.0..=1000.0).contains(&count) || count.fract() != 0.0 {
            let message = format!(
                "stairs are a whole number from 1 to 1000, and this is {}",
                format_short(count)
            );
            self.report(Diagnostic::error(codes::E0401, span, message));
            return None;
        }
        Some(self.expressions.constant(count))
    }

    pub(crate) fn warn_large_blend(
        &mut self,
        blend: &BlendSpec,
        shapes: &[ShapeId],
        _spans: [Span; 2],
    ) {
        let Some(amount) = self.expressions.as_constant(blend.amount) else {
            return;
        };
        for &id in shapes.iter().rev().take(2) {
            let bounds = self.bounds_of(id);
            let size = (0..3)
                .map(|i| bounds.max[i] - bounds.min[i])
                .filter(|s| s.is_finite());
            let Some(size) = size.reduce(f64::max) else {
                continue;
            };
            if !bounds.is_empty() && size > 0.0 && amount > size {
                let message = format!(
                    "this blend of {} is larger than a shape of {} that it joins",
                    format_short(amount),
                    format_short(size)
                );
                let shape = self.shapes[id.0 as usize].span;
                let mut warning = Diagnostic::warning(codes::W0401, blend.span, message);
                if shape.file == blend.span.file {
                    warning = warning.label(shape, "this shape");
                }
                self.report(warning);
                return;
            }
        }
    }

    pub(crate) fn blend_kernel(&mut self, arg: &PassedArg<'a>) -> Option<BlendKind> {
        let Value::Word(word) = arg.value else {
            self.report_wrong(
                &arg.value.clone(),
                "a kernel is a word, such as `cubic`",
                arg.span,
            );
            return None;
        };
        let kind = BlendKind::from_word(word);
        if kind.is_none() {
            let names = BlendKind::names();
            let diagnostic = unknown_name(codes::E0201, "kernel", word, arg.span, names);
            let list = BlendKind::names().collect::<Vec<_>>().join(", ");
            self.report(diagnostic.help(format!("there are {list}")));
        }
        kind
    }
}

fn is_kind(arg: &Arg) -> bool {
    word(&arg.value).is_some_and(|word| BlendKind::from_word(&word.name).is_some())
}
