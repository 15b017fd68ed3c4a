//! Objects: a colour for each leaf of the scene, and the one under the cursor picked out.
//!
//! The picture comes from an engine that has [`Origins`](sdfc_compiler::origins::Origins) loaded: its
//! [`Frame::id`](sdfc_runtime::frame::Frame::id) is the number of a leaf at each pixel, in any mode.
//! Colours are those of the mode `id` ([`views::id_color`]), a little softer: a leaf keeps its colour
//! from picture to picture, and leaves that stand beside each other in the text are far apart in hue.

use super::ink::{Color, bytes, hex, lay, mixed};
use super::rays::{Rays, double};
use sdfc_runtime::frame::{Frame, RenderSettings};
use sdfc_shaders::views;
use sdfc_vm::real::Vector3;

/// What colours are softened by.
const SOFT: Color = hex(0xb9bec6);
/// What is seen where nothing is.
const NOTHING: Color = hex(0x1c1e23);
/// The lines between leaves.
const LINE: Color = hex(0x15171b);
/// The line around the leaf that is picked out.
const AROUND: Color = hex(0xffffff);

/// The colour of a leaf.
pub fn color(leaf: u32) -> [u8; 4] {
    bytes(ink(leaf))
}

fn ink(leaf: u32) -> Color {
    match leaf {
        0 => NOTHING,
        leaf => mixed(views::id_color(leaf as f32), SOFT, 0.24),
    }
}

/// The leaf at a pixel (column and row); 0 where there is none.
pub fn leaf_at(frame: &Frame, [column, row]: [u32; 2]) -> u32 {
    let [column, row] = [column, row].map(|n| n as usize);
    if column >= frame.width {
        return 0;
    }
    let leaf = frame.id.get(row * frame.width + column);
    leaf.copied().unwrap_or(0)
}

/// The objects of a picture, in light shades of their colours; with the one that is picked out bright,
/// the others drawn back and a line around it.
pub fn draw(frame: &Frame, settings: &RenderSettings, picked: Option<u32>) -> Vec<u8> {
    let rays = Rays::of(settings);
    let picked = picked.filter(|&leaf| leaf > 0);
    let mut picture = Vec::with_capacity(4 * frame.id.len());
    for (pixel, &leaf) in frame.id.iter().enumerate() {
        let shade = match frame.normal.get(pixel) {
            Some(&normal) if normal != [0.0; 3] && !settings.plane => {
                let facing = -double(normal).dot(rays.of_pixel(pixel).direction);
                0.62 + 0.38 * facing.clamp(0.0, 1.0) as f32
            }
            _ => 1.0,
        };
        let own = ink(leaf);
        let shown = if leaf == 0 { own } else { own * shade };
        picture.extend(bytes(match picked {
            Some(picked) if picked != leaf => mixed(shown, NOTHING, 0.55),
            _ => shown,
        }));
    }
    for pixel in 0..frame.id.len() {
        let here = frame.id[pixel];
        let [right, below] = neighbours(frame, pixel);
        let meets = |there: Option<usize>| there.is_some_and(|there| frame.id[there] != here);
        if meets(right) || meets(below) {
            lay(&mut picture, pixel, LINE, 0.6);
        }
    }
    if let Some(picked) = picked {
        outline(&mut picture, frame, picked);
    }
    picture
}

/// Draws a light line, two pixels wide, around a leaf, over any picture of the same view. Pixels that
/// have no other of the leaf around them are left out: they are slivers at an edge.
pub fn outline(picture: &mut [u8], frame: &Frame, leaf: u32) {
    let is_own = |pixel: usize| frame.id.get(pixel) == Some(&leaf);
    let counts: Vec<bool> = (0..frame.id.len())
        .map(|pixel| is_own(pixel) && around(frame, pixel).any(is_own))
        .collect();
    for pixel in 0..frame.id.len() {
        for there in neighbours(frame, pixel).into_iter().flatten() {
            if counts[pixel] != counts[there] {
                lay(picture, pixel, AROUND, 0.9);
                lay(picture, there, AROUND, 0.9);
            }
        }
    }
}

/// The pixels beside, above and below.
fn around(frame: &Frame, pixel: usize) -> impl Iterator<Item = usize> {
    let is_first = frame.width == 0 || pixel.is_multiple_of(frame.width);
    let left = (!is_first).then(|| pixel - 1);
    let above = pixel.checked_sub(frame.width);
    let [right, below] = neighbours(frame, pixel);
    [left, above, right, below].into_iter().flatten()
}

/// The pixels on the right and below, where there are any.
fn neighbours(frame: &Frame, pixel: usize) -> [Option<usize>; 2] {
    let is_last = frame.width == 0 || pixel % frame.width == frame.width - 1;
    let below = pixel + frame.width;
    [
        (!is_last && pixel + 1 < frame.id.len()).then_some(pixel + 1),
        (below < frame.id.len()).then_some(below),
    ]
}
