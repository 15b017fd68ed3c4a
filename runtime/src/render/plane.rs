//! Pictures of a plane seen face on, along parallel rays.

use super::ray::{PixelRay, camera_ray, vector};
use super::{FieldFacts, Mode, RenderJob, RenderSettings, prepare};
use sdfc_shaders::{camera, layout};
use sdfc_vm::bounds::Bounds;

/// The plane of a picture, with the positions of its pixels.
#[derive(Clone, Copy, Debug)]
pub struct PixelPlane {
    /// Centre of the upper left pixel.
    pub first: [f32; 3],
    /// Offset from a pixel to the one on its right.
    pub right: [f32; 3],
    /// Offset from a pixel to the one below.
    pub down: [f32; 3],
    /// Number of pixels along each side.
    pub size: [usize; 2],
}

impl PixelPlane {
    #[inline(always)]
    pub(crate) fn coordinate(&self, axis: usize, x: f32, y: f32) -> f32 {
        self.first[axis] + self.right[axis] * x + self.down[axis] * y
    }

    /// Returns the centres of all pixels, row after row.
    pub fn points(&self) -> Vec<[f32; 3]> {
        let [width, height] = self.size;
        let rows = (0..height).flat_map(|y| (0..width).map(move |x| (x as f32, y as f32)));
        rows.map(|(x, y)| std::array::from_fn(|axis| self.coordinate(axis, x, y)))
            .collect()
    }
}

/// Returns the plane that the settings show face on, if any.
pub(crate) fn plane_of(settings: &RenderSettings) -> Option<PixelPlane> {
    let no_facts = FieldFacts {
        is_raw: false,
        has_estimated_slopes: false,
        bounds: Bounds::ALL_SPACE,
        material: None,
    };
    let settings = RenderSettings {
        aa: 1,
        ..settings.clone()
    };
    face_on_plane(&prepare(&settings, &no_facts)).map(|(plane, _)| plane)
}

/// Returns the plane that a picture sees face on, and the distance from zero beyond which only the field's sign
/// matters.
pub(crate) fn face_on_plane(job: &RenderJob) -> Option<(PixelPlane, f32)> {
    face_on(&job.uniforms, job)
}

/// Returns the plane that a sample sees face on along parallel rays, and the distance from zero beyond which
/// only the field's sign matters.
pub(crate) fn face_on(frame: &layout::FrameUniforms, job: &RenderJob) -> Option<(PixelPlane, f32)> {
    if frame.half_pixel_growth != 0.0 {
        return None;
    }
    let point_at = |x: f32, y: f32| {
        let PixelRay {
            origin, direction, ..
        } = camera_ray(frame, [x, y]);
        let (centre, forward) = (vector(frame.centre), vector(frame.forward));
        let t = camera::intersect_plane::<f32>(origin, direction, centre, forward);
        camera::point_along::<f32>(origin, direction, t)
    };
    // The steps are taken from one edge to the other, so that the rounding of one pixel is not multiplied.
    let [width, height] = job.size.map(|n| n as f32);
    let upper_left = point_at(0.0, 0.0);
    let plane = PixelPlane {
        first: upper_left.to_array(),
        right: ((point_at(width, 0.0) - upper_left) * (1.0 / width)).to_array(),
        down: ((point_at(0.0, height) - upper_left) * (1.0 / height)).to_array(),
        size: job.size.map(|n| n as usize),
    };
    let band = job.exact_band.unwrap_or(match job.features.mode {
        Mode::Distance => f32::INFINITY,
        // A pixel is entirely inside or outside if the surface is more than the pixel's size away.
        _ => 4.0 * frame.half_pixel_size * (frame.samples as f32).sqrt(),
    });
    Some((plane, band))
}
