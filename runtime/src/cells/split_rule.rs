//! Decision whether a cell is split again. A [`SplitRule`] compares its size and its tape with the screen and the
//! scene. [`SiblingTapes`] stops where splits shorten tapes no more.
//!
//! A device applies [`PrunedLeafLimit`] and the stop itself, in `split_rule.wgsl`.

use super::Aabb;
use glam::Vec3;
use sdfc_shaders::interpreter::split_cells::{
    MAX_FIELD_SIDES, MAX_STALLED_LEVELS, MAX_TAPE_CLAUSES, MIN_CAMERA_DISTANCE_SIDES,
    PRUNED_DIVISOR, STALLED_LENGTH_TENTHS,
};
use sdfc_shaders::layout::{FrameUniforms, SplitParams};

/// Maximum side of a leaf, in pixels.
const MAX_LEAF_PIXELS: f32 = 16.0;
/// Maximum side in pixels of a leaf whose tape has at most [`MAX_TRIVIAL_TAPE_CLAUSES`] clauses.
const MAX_TRIVIAL_LEAF_PIXELS: f32 = 256.0;
/// Maximum number of clauses of a tape that further splits can hardly shorten.
const MAX_TRIVIAL_TAPE_CLAUSES: usize = 2;
/// Maximum number of clauses of a tape that is not pruned further, for engines that look up each point.
const MAX_LEAF_CLAUSES: usize = 6;

/// Decides which cells are split.
pub trait SplitRule: Sync {
    /// Reports whether to split a cell whose tape has `clauses` clauses. In all of it the absolute value
    /// of the field is at least `min_abs_field`.
    fn should_split(&self, region: &Aabb, clauses: usize, min_abs_field: f32) -> bool;

    /// Reports whether the splits of a cell with this number of clauses are left to a device.
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

    /// The limit of cells that are never split.
    pub(crate) const WHOLE: Self = Self {
        camera: [0.0; 3],
        pixel_size: f32::INFINITY,
        pixel_growth: 0.0,
        max_leaf_pixels: f32::INFINITY,
        max_side: f32::INFINITY,
    };

    /// Multiplies these limits by `times`.
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
        let distance = gap.length().max(side * MIN_CAMERA_DISTANCE_SIDES);
        let pixel = self.pixel_size + self.pixel_growth * distance;
        let max_pixels = if clauses <= MAX_TRIVIAL_TAPE_CLAUSES {
            MAX_TRIVIAL_LEAF_PIXELS
        } else {
            self.max_leaf_pixels
        };
        side > max_pixels * pixel || side > self.max_side
    }
}

/// Limits of leaves for engines that look up the cell of every point.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PrunedLeafLimit(pub(super) ScreenSpaceLeafLimit);

impl PrunedLeafLimit {
    /// Returns the parameters with which a device applies these limits. All others have their defaults.
    pub(super) fn gpu_params(&self) -> SplitParams {
        let Self(pixels) = self;
        SplitParams {
            camera: pixels.camera,
            pixel_size: pixels.pixel_size,
            pixel_growth: pixels.pixel_growth,
            max_leaf_pixels: pixels.max_leaf_pixels,
            max_leaf_clauses: MAX_LEAF_CLAUSES as u32,
            ..SplitParams::default()
        }
    }
}

impl SplitRule for PrunedLeafLimit {
    fn should_split(&self, region: &Aabb, clauses: usize, min_abs_field: f32) -> bool {
        clauses > MAX_LEAF_CLAUSES
            && min_abs_field < MAX_FIELD_SIDES * region.longest_side()
            && self.0.should_split(region, clauses, min_abs_field)
    }
}

/// Limits of the cells that the CPU splits before a device continues. Their tapes are short enough for an
/// invocation to walk through.
pub(crate) struct CpuLevels<'a>(pub(super) &'a PrunedLeafLimit);

impl SplitRule for CpuLevels<'_> {
    fn should_split(&self, region: &Aabb, clauses: usize, min_abs_field: f32) -> bool {
        self.0.should_split(region, clauses, min_abs_field)
    }
    fn defers(&self, clauses: usize) -> bool {
        clauses <= MAX_TAPE_CLAUSES
    }
}

/// Next step for a new cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum SplitDecision {
    /// It stays a leaf.
    Leaf,
    /// The next level splits it.
    Split,
    /// A device splits it ([`SplitRule::defers`]).
    Defer,
}

/// Reports whether a number of clauses is hardly less than another.
fn is_hardly_shorter(clauses: usize, others: usize) -> bool {
    clauses * 10 > others * STALLED_LENGTH_TENTHS as usize
}

/// Lengths of the tapes of the children of one cell, compared with the cell's own.
pub(super) struct SiblingTapes {
    parent_clauses: usize,
    parent_stalled_levels: u32,
    root_clauses: usize,
    /// Set if the children together keep almost all clauses.
    is_stalled: bool,
}

impl SiblingTapes {
    /// Compares the lengths of the children's tapes with the parent's.
    pub(super) fn new(
        parent_clauses: usize,
        parent_stalled_levels: u32,
        root_clauses: usize,
        lengths: impl ExactSizeIterator<Item = usize>,
    ) -> Self {
        let count = lengths.len();
        Self {
            parent_clauses,
            parent_stalled_levels,
            root_clauses,
            is_stalled: is_hardly_shorter(lengths.sum(), count * parent_clauses),
        }
    }

    /// Counts the successive levels, down to a child with this number of clauses, that shortened no tapes. A
    /// child that keeps its parent's tape counts only if the other children do not lose most of it. Where these
    /// do, the child contains a small solid, and splits pay off.
    pub(super) fn stalled_levels(&self, clauses: usize) -> u32 {
        if self.is_stalled && is_hardly_shorter(clauses, self.parent_clauses) {
            self.parent_stalled_levels + 1
        } else {
            0
        }
    }

    /// Decides about a child. `has_slope_gain` reports whether its bound of slopes gets tighter with its size,
    /// so that splits pay off without shorter tapes.
    pub(super) fn decide_split(
        &self,
        rule: &dyn SplitRule,
        (region, clauses, min_abs_field): (&Aabb, usize, f32),
        has_slope_gain: impl FnOnce() -> bool,
    ) -> SplitDecision {
        let is_pruned = clauses * PRUNED_DIVISOR as usize <= self.root_clauses;
        let max_stalled_levels = MAX_STALLED_LEVELS[usize::from(is_pruned)];
        let is_profitable = self.stalled_levels(clauses) < max_stalled_levels || has_slope_gain();
        if !is_profitable || !rule.should_split(region, clauses, min_abs_field) {
            SplitDecision::Leaf
        } else if rule.defers(clauses) {
            SplitDecision::Defer
        } else {
            SplitDecision::Split
        }
    }
}
