//! Steps: how often the field was evaluated along each ray.
//!
//! The mode `steps` shows the share of the most steps that a ray may take, which compares scenes, and is
//! nearly black for most. Here the same colours ([`views::heat`]) are spread over what the rays of this
//! picture took, so that it is seen where the work is.

use super::ink::bytes;
use sdfc_runtime::frame::Frame;
use sdfc_shaders::views;

/// What the colours of a picture of steps stand for.
#[derive(Clone, Debug, PartialEq)]
pub struct Legend {
    /// Numbers of steps, rising, with their colours. The last is white, and so is what is above it.
    pub entries: Vec<(u32, [u8; 4])>,
    /// The most steps of any ray.
    pub most: u32,
    /// The mean of all rays.
    pub mean: f64,
}

/// One ray in so many may take more steps than the scale has.
const BEYOND: usize = 200;
/// How many colours the legend names.
const ENTRIES: u32 = 5;

/// The steps of a picture's rays, and the legend. The scale ends at a round number that all but one ray
/// in 200 stay below.
pub fn draw(frame: &Frame) -> (Vec<u8>, Legend) {
    let mut sorted = frame.steps.clone();
    sorted.sort_unstable();
    let count = sorted.len();
    let most = sorted.last().copied().unwrap_or(0);
    let high = sorted.get(count - count.div_ceil(BEYOND).min(count));
    let top = round_up(high.copied().unwrap_or(0));
    let color = |steps: u32| bytes(views::heat(steps as f32 / top as f32));
    let sum: u64 = sorted.iter().map(|&steps| u64::from(steps)).sum();
    let picture = frame.steps.iter().flat_map(|&steps| color(steps));
    let entries = (0..ENTRIES).map(|i| top * i / (ENTRIES - 1));
    let legend = Legend {
        entries: entries.map(|steps| (steps, color(steps))).collect(),
        most,
        mean: sum as f64 / count.max(1) as f64,
    };
    (picture.collect(), legend)
}

/// The next larger of 8, 12, 16, 24, 32 and so on, which four divides.
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
