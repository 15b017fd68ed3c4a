//! Position of an automatic camera: outside of all solids, with an unobstructed view.

use super::framing::{distance_to, framed_view, point_ahead, rotated_view};
use crate::render::View;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::evaluate;
use sdfc_vm::outline::Outline;
use sdfc_vm::program::Program;
use sdfc_vm::vector::V3;

/// Elevations added to the direction, in degrees, in the order of the trials. Things that hang from a ceiling are seen
/// from lower ones.
const ELEVATIONS_DEGREES: [f64; 6] = [0.0, 15.0, 30.0, 50.0, -25.0, -45.0];
/// Rotations about the up axis, in degrees, in the order of the trials.
const AZIMUTHS_DEGREES: [f64; 8] = [0.0, -45.0, 45.0, -90.0, 90.0, -135.0, 135.0, 180.0];
/// Factors on the box that stands for an infinite scene, in the order of the trials.
const SIZE_FACTORS: [f64; 7] = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0];
/// Number of samples between the camera and the subject.
const SAMPLE_COUNT: u32 = 64;

/// The facts that determine the position of a camera.
pub(super) struct CameraPlacement<'a> {
    /// The distance program, with the current constants.
    pub(super) field: &'a Program,
    /// The outline of everything finite.
    pub(super) subject: Option<&'a Outline>,
    /// Set if that is the whole scene, so that nothing can be in front of it.
    pub(super) is_complete: bool,
    /// The box that is framed if there is no subject.
    pub(super) shown: &'a Bounds,
    /// Width of the image divided by its height.
    pub(super) aspect: f64,
}

impl CameraPlacement<'_> {
    /// Returns the requested view, moved so that the subject fills the image, whatever obstructs it.
    pub(super) fn framed(&self, requested: &View) -> View {
        match self.subject {
            Some(subject) => framed_view(requested, subject, self.aspect),
            None => framed_view(requested, &Outline::from_bounds(self.shown), self.aspect),
        }
    }

    /// Returns the view in the first tried direction from which the subject is visible; the requested one is
    /// tried first. If there is none, the camera with the clearest view is moved in front of the
    /// obstruction.
    pub(super) fn find(&self, requested: &View) -> View {
        let size = |factor: &f64| {
            let margin = self.shown.half_diagonal() * (factor - 1.0);
            Outline::from_bounds(&self.shown.grown(margin))
        };
        let outlines = match self.subject {
            Some(subject) if self.is_complete => {
                return framed_view(requested, subject, self.aspect);
            }
            Some(subject) => vec![subject.clone()],
            None => SIZE_FACTORS.iter().map(size).collect(),
        };
        let mut best: Option<(u32, View)> = None;
        for outline in &outlines {
            for elevation in ELEVATIONS_DEGREES {
                for azimuth in AZIMUTHS_DEGREES {
                    let direction =
                        rotated_view(requested, azimuth.to_radians(), f64::to_radians(elevation));
                    let mut view = framed_view(&direction, outline, self.aspect);
                    let distance = distance_to(&view, outline);
                    let clear = self.clear_samples(&view, distance);
                    if clear == SAMPLE_COUNT {
                        return view;
                    }
                    if best
                        .as_ref()
                        .is_none_or(|(best_clear, _)| clear > *best_clear)
                    {
                        // Moves the camera in front of the obstruction.
                        let blocked_fraction = 1.0 - f64::from(clear) / f64::from(SAMPLE_COUNT);
                        view.from = point_ahead(&view, distance * blocked_fraction);
                        best = Some((clear, view));
                    }
                }
            }
        }
        best.map_or(*requested, |(_, view)| view)
    }

    /// Counts the consecutive samples outside of solids, from the subject towards the camera.
    fn clear_samples(&self, view: &View, distance: f64) -> u32 {
        let is_outside = |&number: &u32| {
            let fraction = f64::from(number) / f64::from(SAMPLE_COUNT);
            let [x, y, z] = point_ahead(view, distance * (1.0 - fraction)).map(|v| v as f32);
            // NaN does not hide anything.
            let value = evaluate::<f32>(self.field, V3 { x, y, z });
            value.is_nan() || value > 0.0
        };
        (1..=SAMPLE_COUNT).take_while(is_outside).count() as u32
    }
}
