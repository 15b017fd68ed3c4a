//! Rules that decide whether a cell is split again. A device applies the rule of the screen itself, in
//! `split_cells.wgsl`.

use super::Aabb;
use glam::Vec3;
use sdfc_shaders::layout::FrameUniforms;

/// Maximum side of a leaf, in pixels.
const MAX_LEAF_PIXELS: f32 = 16.0;
/// Maximum side in pixels of a leaf whose tape has at most [`MAX_TRIVIAL_TAPE_CLAUSES`] clauses.
const MAX_TRIVIAL_LEAF_PIXELS: f32 = 256.0;
/// Maximum number of clauses of a tape that further splits can hardly shorten.
const MAX_TRIVIAL_TAPE_CLAUSES: usize = 2;

/// Decides which cells are split.
pub trait SplitRule: Sync {
    /// Reports whether to split a cell whose tape has `clauses` clauses. In all of it the absolute value
    /// of the field is at least `min_abs_field`.
    fn should_split(&self, region: &Aabb, clauses: usize, min_abs_field: f32) -> bool;

    /// Reports whether another stage splits a cell with this number of clauses.
    fn defers(&self, _clauses: usize) -> bool {
        false
    }
}

/// Limits of the size of leaves on the screen and in the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ScreenSpaceLeafLimit {
    pub(super) camera: [f32; 3],
    /// Height of a pixel of the image at the start of its ray.
    pub(super) pixel_size: f32,
    /// Growth of that height per unit along the ray.
    pub(super) pixel_growth: f32,
    /// Maximum side of a leaf, in pixels.
    pub(super) max_leaf_pixels: f32,
    /// Maximum side of a leaf, in scene units.
    pub(super) max_side: f32,
}

impl ScreenSpaceLeafLimit {
    pub(crate) fn from_uniforms(frame: &FrameUniforms) -> Self {
        // A pixel of a pass over subpixels is smaller than a pixel of the image by this factor.
        let passes = (frame.samples.max(1) as f32).sqrt();
        Self {
            camera: frame.origin,
            pixel_size: 2.0 * frame.half_pixel_size * passes,
            pixel_growth: 2.0 * frame.half_pixel_growth * passes,
            max_leaf_pixels: MAX_LEAF_PIXELS,
            max_side: f32::INFINITY,
        }
    }
}

impl ScreenSpaceLeafLimit {
    /// These limits, multiplied by `times`.
    pub(crate) fn coarsened(&self, times: f32) -> Self {
        Self {
            max_leaf_pixels: self.max_leaf_pixels * times,
            max_side: self.max_side * times,
            ..*self
        }
    }
}

impl SplitRule for ScreenSpaceLeafLimit {
    fn should_split(&self, region: &Aabb, clauses: usize, _: f32) -> bool {
        let side = region.longest_side();
        let camera = Vec3::from(self.camera);
        let (below, above) = (
            Vec3::from(region.low) - camera,
            camera - Vec3::from(region.high),
        );
        let gap = below.max(above).max(Vec3::ZERO);
        // Measured from inside a cell, its far parts count.
        let distance = gap.length().max(side * 0.25);
        let pixel = self.pixel_size + self.pixel_growth * distance;
        let max_pixels = if clauses <= MAX_TRIVIAL_TAPE_CLAUSES {
            MAX_TRIVIAL_LEAF_PIXELS
        } else {
            self.max_leaf_pixels
        };
        side > max_pixels * pixel || side > self.max_side
    }
}
