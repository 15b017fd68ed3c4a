//! Where shapes may come to be: their boxes at the ends of the ranges of the parameters that they
//! follow, and in the course of time. These are samples and no proof.

use super::Elaborator;
use super::measure::numbers;
use crate::bounds::Boxes;
use crate::expression::{ExprId, Expression, ParamId};
use crate::scene::ShapeId;
use crate::scene::children;
use sdfc_vm::bounds::Bounds;
use std::collections::{BTreeSet, HashSet};

/// The most parameters whose ends are tried.
const MAX_PARAMS: usize = 12;
/// How many times are tried, and until when if the scene does not say how long it lasts.
const TIMES: u32 = 12;
const SECONDS: f64 = 8.0;

/// A shape's box at some values of the parameters and the time.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    /// The box.
    pub(crate) bounds: Bounds,
    /// The numbers that were asked for with it.
    pub(crate) numbers: Vec<f64>,
}

/// Other values to look at a shape for: those of parameters, and the time.
type Instead = (Vec<(ParamId, f64)>, f64);

/// Values of parameters instead of their present ones, and a time, as a key: the bits of each.
pub(crate) type Moment = (Vec<(ParamId, u64)>, u64);

impl<'a> Elaborator<'a> {
    /// The boxes of a shape and the values of some numbers: first at the present values of the
    /// parameters, then at others.
    pub(crate) fn places(&mut self, shape: ShapeId, wanted: &[ExprId]) -> Vec<Place> {
        let present = Place {
            bounds: self.bounds_of(shape),
            numbers: wanted.iter().map(|&id| self.present(id)).collect(),
        };
        let mut places = vec![present];
        let (params, follows_time) = self.followed(shape, wanted);
        let mut moments: Vec<Instead> = Vec::new();
        let now = self.options.time;
        let mut ends = [Vec::new(), Vec::new()];
        for &id in params.iter().take(MAX_PARAMS) {
            let param = &self.params[id.0 as usize];
            let Some((low, high)) = param.range.filter(|_| param.value.len() == 1) else {
                continue;
            };
            for (ends, value) in ends.iter_mut().zip([low, high]) {
                moments.push((vec![(id, value)], now));
                ends.push((id, value));
            }
        }
        if ends[0].len() > 1 {
            moments.extend(ends.map(|values| (values, now)));
        }
        if follows_time {
            let seconds = self.animation.map_or(SECONDS, |a| a.duration);
            for at in 1..=TIMES {
                let time = seconds * f64::from(at) / f64::from(TIMES);
                moments.push((Vec::new(), time));
            }
        }
        for (values, time) in moments {
            let bits = values.iter().map(|&(id, v)| (id, v.to_bits())).collect();
            let key: Moment = (bits, time.to_bits());
            let mut boxes = self.moments.remove(&key).unwrap_or_else(|| {
                let values = values.iter().map(|&(id, v)| (id, vec![v]));
                Boxes::at(time, values.collect())
            });
            let world = self.world();
            places.push(Place {
                bounds: boxes.of(world, shape),
                numbers: wanted.iter().map(|&id| boxes.number(world, id)).collect(),
            });
            self.moments.insert(key, boxes);
        }
        places
    }

    /// The live parameters that a shape or one of the numbers follows, and whether the time is
    /// followed too.
    fn followed(&self, shape: ShapeId, wanted: &[ExprId]) -> (BTreeSet<ParamId>, bool) {
        let mut pending = wanted.to_vec();
        let mut shapes = vec![shape];
        let mut known = HashSet::new();
        while let Some(id) = shapes.pop() {
            if known.insert(id) {
                let kind = &self.shapes[id.0 as usize].kind;
                pending.extend(numbers(kind));
                shapes.extend(children(kind));
            }
        }
        let mut seen = HashSet::new();
        let (mut params, mut time) = (BTreeSet::new(), false);
        while let Some(id) = pending.pop() {
            if !seen.insert(id) {
                continue;
            }
            match self.graph.get(id) {
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
