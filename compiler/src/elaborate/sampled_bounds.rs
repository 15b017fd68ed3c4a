//! Sampled bounds of live shapes: boxes at the ends of the ranges of their parameters, and at
//! sampled times. These are samples, not proofs.

use super::Elaborator;
use super::shape_info::numbers;
use crate::analysis::bounds::ShapeBounds;
use crate::expression::{ExprId, Expression, ParamId};
use crate::scene::ShapeId;
use crate::scene::children;
use sdfc_vm::bounds::Bounds;
use std::collections::{BTreeSet, HashSet};

/// Maximum number of parameters whose ends are sampled.
const MAX_SAMPLED_PARAMS: usize = 12;
/// Number of sampled times, and the sampled duration if the scene has no `animate` block.
const TIME_SAMPLES: u32 = 12;
const DEFAULT_DURATION_SECONDS: f64 = 8.0;

/// Bounding box of a shape at one assignment of the parameters and the time.
#[derive(Clone, Debug)]
pub(crate) struct BoundsSample {
    /// Bounding box of the shape there.
    pub(crate) bounds: Bounds,
    /// Values of the requested numbers.
    pub(crate) numbers: Vec<f64>,
}

/// An assignment: values of parameters, and the time.
type ParamAssignment = (Vec<(ParamId, f64)>, f64);

/// An assignment as a key: the bits of each value.
pub(crate) type AssignmentKey = (Vec<(ParamId, u64)>, u64);

impl<'a> Elaborator<'a> {
    /// Bounds a shape and evaluates numbers: first at the current values of the parameters, then at the samples.
    pub(crate) fn sample_bounds(
        &mut self,
        shape: ShapeId,
        number_ids: &[ExprId],
    ) -> Vec<BoundsSample> {
        let present = BoundsSample {
            bounds: self.bounds_of(shape),
            numbers: number_ids
                .iter()
                .map(|&id| self.current_value(id))
                .collect(),
        };
        let mut samples = vec![present];
        let (params, follows_time) = self.dependencies(shape, number_ids);
        let mut assignments: Vec<ParamAssignment> = Vec::new();
        let current_time = self.options.time;
        let mut range_ends = [Vec::new(), Vec::new()];
        for &id in params.iter().take(MAX_SAMPLED_PARAMS) {
            let param = &self.params[id.0 as usize];
            let Some((low, high)) = param.range.filter(|_| param.value.len() == 1) else {
                continue;
            };
            for (range_ends, value) in range_ends.iter_mut().zip([low, high]) {
                assignments.push((vec![(id, value)], current_time));
                range_ends.push((id, value));
            }
        }
        if range_ends[0].len() > 1 {
            assignments.extend(range_ends.map(|values| (values, current_time)));
        }
        if follows_time {
            let seconds = self
                .animation
                .map_or(DEFAULT_DURATION_SECONDS, |a| a.duration);
            for step in 1..=TIME_SAMPLES {
                let time = seconds * f64::from(step) / f64::from(TIME_SAMPLES);
                assignments.push((Vec::new(), time));
            }
        }
        for (values, time) in assignments {
            let bits = values.iter().map(|&(id, v)| (id, v.to_bits())).collect();
            let key: AssignmentKey = (bits, time.to_bits());
            let mut boxes = self.sampled_bounds_caches.remove(&key).unwrap_or_else(|| {
                let values = values.iter().map(|&(id, v)| (id, vec![v]));
                ShapeBounds::at_time_and_values(time, values.collect())
            });
            let world = self.scene_ref();
            samples.push(BoundsSample {
                bounds: boxes.get(world, shape),
                numbers: number_ids
                    .iter()
                    .map(|&id| boxes.number(world, id))
                    .collect(),
            });
            self.sampled_bounds_caches.insert(key, boxes);
        }
        samples
    }

    /// Returns the live parameters that a shape or one of the numbers depends on. The second result is true if
    /// they depend on the time.
    fn dependencies(&self, shape: ShapeId, number_ids: &[ExprId]) -> (BTreeSet<ParamId>, bool) {
        let mut pending = number_ids.to_vec();
        let mut shapes = vec![shape];
        let mut visited_shapes = HashSet::new();
        while let Some(id) = shapes.pop() {
            if visited_shapes.insert(id) {
                let kind = &self.shapes[id.0 as usize].kind;
                pending.extend(numbers(kind));
                shapes.extend(children(kind));
            }
        }
        let mut visited = HashSet::new();
        let (mut params, mut time) = (BTreeSet::new(), false);
        while let Some(id) = pending.pop() {
            if !visited.insert(id) {
                continue;
            }
            match self.expressions.get(id) {
                Expression::Param(param, _) => _ = params.insert(*param),
                Expression::Time => time = true,
                Expression::Constant(_)
                | Expression::Coordinate(_)
                | Expression::NormalComponent(_) => {}
                Expression::Apply {
                    point,
                    values,
                    parameters,
                    ..
                } => pending.extend(point.iter().flatten().chain(values).chain(parameters)),
            }
        }
        (params, time)
    }
}
