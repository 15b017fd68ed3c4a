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

    /// Returns the plane with one more pixel on each side.
    pub(crate) fn with_border(&self) -> Self {
        Self {
            first: std::array::from_fn(|axis| self.coordinate(axis, -1.0, -1.0)),
            size: self.size.map(|length| length + 2),
            ..*self
        }
    }

    /// Returns the length of a side of its pixels along the coordinate axes, at most.
    pub(crate) fn pixel_extent(&self) -> f32 {
        let extent = |axis: usize| self.right[axis].abs() + self.down[axis].abs();
        (0..3).map(extent).fold(0.0, f32::max)
    }

    /// Returns the centres of all pixels, row after row.
    pub fn points(&self) -> Vec<[f32; 3]> {
        let [width, height] = self.size;
        let rows = (0..height).flat_map(|y| (0..width).map(move |x| (x as f32, y as f32)));
        rows.map(|(x, y)| std::array::from_fn(|axis| self.coordinate(axis, x, y)))
            .collect()
    }
}

/// Values of a plane that must be exact. Others need only have the sign of the field, and be at least as far from
/// zero as `band`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExactValues {
    /// Those of a smaller magnitude.
    pub band: f32,
    /// Those near a change of sign, if coverage is computed: the number of samples of a pixel.
    pub edges: Option<u32>,
}

/// Number of pixels beside an edge whose values decide how much of a pixel it covers.
const EDGE_PIXELS: u32 = 2;

impl ExactValues {
    /// Returns the number of pixels around a change of sign in which values are exact.
    pub(crate) fn pixels_around_edges(&self) -> u32 {
        if self.edges.is_some() { EDGE_PIXELS } else { 0 }
    }
}

/// Returns the plane that the settings show face on, if any.
pub(crate) fn plane_of(settings: &RenderSettings) -> Option<PixelPlane> {
    let no_facts = FieldFacts {
        is_raw: false,
        has_estimated_slopes: false,
        max_slope: 1.0,
        has_loose_slopes: false,
        bounds: Bounds::ALL_SPACE,
        material: None,
    };
    let settings = RenderSettings {
        aa: 1,
        ..settings.clone()
    };
    face_on_plane(&prepare(&settings, &no_facts)).map(|(plane, _)| plane)
}

/// Returns the plane that a picture sees face on, and the values that must be exact.
pub(crate) fn face_on_plane(job: &RenderJob) -> Option<(PixelPlane, ExactValues)> {
    face_on(&job.uniforms, job)
}

/// Returns the plane that a sample sees face on along parallel rays, and the values that must be exact.
pub(crate) fn face_on(
    frame: &layout::FrameUniforms,
    job: &RenderJob,
) -> Option<(PixelPlane, ExactValues)> {
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
    let exact = match (job.exact_band, job.features.mode) {
        (Some(band), _) => ExactValues { band, edges: None },
        (None, Mode::Distance) => ExactValues {
            band: f32::INFINITY,
            edges: None,
        },
        (None, _) => ExactValues {
            band: 0.0,
            edges: Some(frame.samples),
        },
    };
    Some((plane, exact))
}
