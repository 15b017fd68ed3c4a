//! The difference of two engines: pictures of the same view, compared as `sdfc verify` compares them.

use sdfc_runtime::frame::Frame;
use sdfc_runtime::verify::{PictureDifferences, compare, difference_picture};
use std::fmt;

/// How two pictures differ.
#[derive(Clone, Debug)]
pub struct Difference {
    /// The first picture in dark grey, and over it each channel's difference times 16; red where only
    /// one of the two hits, amber where that is at a silhouette.
    pub picture: Vec<u8>,
    /// The numbers.
    pub numbers: PictureDifferences,
    /// What is more than engines may differ by; empty if they agree.
    pub failures: Vec<String>,
}

/// Compares two pictures of the same settings, the first being the reference; `None` if they are of
/// different sizes.
pub fn difference(reference: &Frame, frame: &Frame) -> Option<Difference> {
    if (reference.width, reference.height) != (frame.width, frame.height) {
        return None;
    }
    let (numbers, failures) = compare(reference, frame);
    Some(Difference {
        picture: difference_picture(reference, frame),
        numbers,
        failures,
    })
}

impl fmt::Display for Difference {
    /// One line for people.
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
