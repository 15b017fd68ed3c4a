//! The standpoint of an open camera: outside of all solids, with nothing in between.

use super::framing::{ahead, framed, turned, way_to};
use crate::frame::View;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::evaluate;
use sdfc_vm::outline::Outline;
use sdfc_vm::program::Program;
use sdfc_vm::vector::V3;

/// The angles by which the direction is raised, in the order in which they are tried, in degrees.
const RAISED: [f64; 4] = [0.0, 15.0, 30.0, 50.0];
/// The angles by which it is turned about the axis that points up.
const TURNED: [f64; 8] = [0.0, -45.0, 45.0, -90.0, 90.0, -135.0, 135.0, 180.0];
/// The factors by which the box that stands for an endless scene is made larger, in the order of trying.
const SIZES: [f64; 7] = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0];
/// The number of points of the way that are looked at.
const POINTS: u32 = 64;

/// The facts that decide where a camera stands.
pub(super) struct Standpoint<'a> {
    /// The distance at the present values.
    pub(super) field: &'a Program,
    /// The outline of all that has an end.
    pub(super) subject: Option<&'a Outline>,
    /// Tells if that is all there is, so that nothing can be in between.
    pub(super) is_whole: bool,
    /// The box that stands for it elsewhere.
    pub(super) shown: &'a Bounds,
    /// The picture's width over its height.
    pub(super) aspect: f64,
}

impl Standpoint<'_> {
    /// The view in the direction of the one given, or the nearest one from which the subject is seen.
    pub(super) fn find(&self, given: &View) -> View {
        let size = |factor: &f64| {
            let grown = self.shown.half_diagonal() * (factor - 1.0);
            Outline::of_box(&self.shown.grown(grown))
        };
        let outlines = match self.subject {
            Some(subject) if self.is_whole => return framed(given, subject, self.aspect),
            Some(subject) => vec![subject.clone()],
            None => SIZES.iter().map(size).collect(),
        };
        let mut best: Option<(u32, View)> = None;
        for outline in &outlines {
            for raised in RAISED {
                for turn in TURNED {
                    let direction = turned(given, turn.to_radians(), f64::to_radians(raised));
                    let mut view = framed(&direction, outline, self.aspect);
                    let way = way_to(&view, outline);
                    let clear = self.clear(&view, way);
                    if clear == POINTS {
                        return view;
                    }
                    if best.as_ref().is_none_or(|(most, _)| clear > *most) {
                        // In front of what is in between.
                        let share = 1.0 - f64::from(clear) / f64::from(POINTS);
                        view.from = ahead(&view, way * share);
                        best = Some((clear, view));
                    }
                }
            }
        }
        best.map_or(*given, |(_, view)| view)
    }

    /// Counts the points of the way to the subject that are outside of solids, from the subject on.
    fn clear(&self, view: &View, way: f64) -> u32 {
        let is_outside = |&number: &u32| {
            let share = f64::from(number) / f64::from(POINTS);
            let [x, y, z] = ahead(view, way * (1.0 - share)).map(|v| v as f32);
            // What is not a number hides nothing.
            let value = evaluate::<f32>(self.field, V3 { x, y, z });
            value.is_nan() || value > 0.0
        };
        (1..=POINTS).take_while(is_outside).count() as u32
    }
}
