//! Difference between two engines: pictures of the same view, compared as `sdfc verify` does.

use super::legend::Legend;
use sdfc_runtime::comparison::{
    MISMATCH_COLOR, PictureDifferences, SILHOUETTE_COLOR, compare, difference_image,
};
use sdfc_runtime::render::Image;
use std::fmt;

/// Comparison of two pictures.
#[derive(Clone, Debug)]
pub struct EngineDifference {
    /// The first picture in dark grey, overlaid with each channel's difference times 16. Red marks pixels
    /// that only one engine hits, amber those of them at a silhouette.
    pub picture: Vec<u8>,
    /// Counts and percentiles of the differences.
    pub numbers: PictureDifferences,
    /// Differences that exceed the tolerances; empty if the engines agree.
    pub failures: Vec<String>,
}

/// Compares two pictures of the same settings; the first one is the reference. Returns `None` if their
/// sizes differ.
pub fn difference(reference: &Image, image: &Image) -> Option<EngineDifference> {
    if (reference.width, reference.height) != (image.width, image.height) {
        return None;
    }
    let (numbers, failures) = compare(reference, image);
    Some(EngineDifference {
        picture: difference_image(reference, image),
        numbers,
        failures,
    })
}

/// Returns the legend of a difference.
pub fn legend() -> Legend {
    let entries = [
        (
            [0x40, 0x40, 0x40, 255],
            "equal: the first picture, darkened",
        ),
        (
            [255; 4],
            "colours differ; each channel's difference times 16",
        ),
        (MISMATCH_COLOR, "a hit of one engine only"),
        (SILHOUETTE_COLOR, "the same at a silhouette"),
    ];
    entries.map(|(color, text)| (color, text.to_owned())).into()
}

impl fmt::Display for EngineDifference {
    /// Formats the numbers in one line.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n = &self.numbers;
        write!(
            f,
            "{} of {} pixels differ by more than 1/255 ({} away from edges), worst {}/255; {} rays hit \
             in one picture only ({} away from silhouettes); depths differ by {:.1e} of the depth at most",
            n.differing,
            n.pixels,
            n.differing_inside,
            n.worst,
            n.hit_mismatches,
            n.hit_mismatches_inside,
            n.depth.max,
        )
    }
}
