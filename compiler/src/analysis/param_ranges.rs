//! Ranges of the numbers that change without another compilation: live parameters and the time.

use crate::analysis::box_eval::{BoxNumber, UniformInput};
use crate::expression::{ExprId, Expression, Expressions};
use crate::scene::SceneRef;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;

/// Ranges of the components of all parameters, and of the time.
#[derive(Clone, Debug)]
pub(crate) struct ParamRanges {
    /// By parameter and component.
    params: Vec<Vec<Interval>>,
    time: Interval,
}

impl ParamRanges {
    /// Returns the ranges that the scene declares; a parameter without a range keeps its value.
    pub(crate) fn for_scene(scene: SceneRef<'_>) -> Self {
        let params = scene.params.iter().map(|param| {
            let components = param.value.iter().map(|&value| match param.range {
                Some((lo, hi)) => Interval::between(lo, hi),
                None => Interval::point(value),
            });
            components.collect()
        });
        let params = params.collect();
        let time = match scene.animation {
            Some(animation) => Interval::between(0.0, animation.duration),
            None => Interval::ALL,
        };
        Self { params, time }
    }

    /// Returns the range of a constant, a parameter or the time.
    pub(crate) fn leaf(&self, expressions: &Expressions, id: ExprId) -> Interval {
        match expressions.get(id) {
            Expression::Constant(v) => Interval::point(*v),
            Expression::Param(param, component) => {
                self.params[param.0 as usize][usize::from(*component)]
            }
            Expression::Time => self.time,
            _ => Interval::ALL,
        }
    }

    /// Returns the range of a uniform number.
    pub(crate) fn number(&self, expressions: &Expressions, id: ExprId) -> Interval {
        if let Some(value) = expressions.as_constant(id) {
            return Interval::point(value);
        }
        let mut leaf = |id| UniformInput::Known(self.leaf(expressions, id));
        let mut number = BoxNumber::<Interval>::new(expressions, id, &mut leaf);
        number.eval(&Bounds::ALL_SPACE, &[])
    }
}
