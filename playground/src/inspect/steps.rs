//! Step overlay: the number of field evaluations along each ray.
//!
//! The mode `steps` shows the fraction of the maximum number of steps, which makes scenes comparable but
//! is nearly black for most. Here the same colours ([`views::heat`]) span the step counts of this
//! picture.

use super::ink::bytes;
use sdfc_runtime::render::Image;
use sdfc_shaders::views;

/// Legend of a step overlay.
#[derive(Clone, Debug, PartialEq)]
pub struct StepLegend {
    /// Step counts in ascending order, with their colours. The last one is white, as are all larger
    /// counts.
    pub entries: Vec<(u32, [u8; 4])>,
    /// Maximum number of steps of a ray.
    pub max: u32,
    /// Mean number of steps of a ray.
    pub mean: f64,
}

/// One in this number of rays may exceed the scale.
const RAYS_PER_OUTLIER: usize = 200;
/// Number of entries of the legend.
const LEGEND_ENTRIES: u32 = 5;

/// Draws the step counts of an image and returns the legend. The scale ends at a round number that at
/// most one ray in 200 exceeds.
pub fn draw(image: &Image) -> (Vec<u8>, StepLegend) {
    let mut sorted = image.steps.clone();
    sorted.sort_unstable();
    let count = sorted.len();
    let max = sorted.last().copied().unwrap_or(0);
    let outlier_bound = sorted.get(count - count.div_ceil(RAYS_PER_OUTLIER).min(count));
    let top = round_up(outlier_bound.copied().unwrap_or(0));
    let color = |steps: u32| bytes(views::heat(steps as f32 / top as f32));
    let sum: u64 = sorted.iter().map(|&steps| u64::from(steps)).sum();
    let picture = image.steps.iter().flat_map(|&steps| color(steps));
    let entries = (0..LEGEND_ENTRIES).map(|i| top * i / (LEGEND_ENTRIES - 1));
    let legend = StepLegend {
        entries: entries.map(|steps| (steps, color(steps))).collect(),
        max,
        mean: sum as f64 / count.max(1) as f64,
    };
    (picture.collect(), legend)
}

/// Rounds up to the next of 8, 12, 16, 24, 32 and so on, all divisible by four.
fn round_up(steps: u32) -> u32 {
    let mut top = 8_u32;
    while top < steps && top < 1 << 30 {
        top = if top.is_power_of_two() {
            top / 2 * 3
        } else {
            top / 3 * 4
        };
    }
    top
}
