//! Object overlay: one colour per leaf of the scene, with the picked leaf highlighted.
//!
//! The image comes from an engine that has [`Provenance`](sdfc_compiler::provenance::Provenance) loaded. The `id`
//! channel of the image then holds the leaf number of each pixel, in any mode. Colours are softened
//! versions of those of the mode `id` ([`views::id_color`]). A leaf keeps its colour in all pictures, and
//! leaves adjacent in the text differ strongly in hue.

use super::ink::{Color, blend_over, bytes, hex, mix};
use super::rays::PictureRays;
use glam::Vec3;
use sdfc_runtime::render::{Image, RenderSettings};
use sdfc_shaders::views;

/// Colour that leaf colours are blended with.
const SOFTENING_COLOR: Color = hex(0xb9bec6);
/// Colour of pixels without a hit.
const BACKGROUND_COLOR: Color = hex(0x1c1e23);
/// Colour of the borders between leaves.
const LINE_COLOR: Color = hex(0x15171b);
/// Colour of the outline of the picked leaf.
const OUTLINE_COLOR: Color = hex(0xffffff);

/// Returns the colour of a leaf.
pub fn color(leaf: u32) -> [u8; 4] {
    bytes(ink(leaf))
}

fn ink(leaf: u32) -> Color {
    match leaf {
        0 => BACKGROUND_COLOR,
        leaf => mix(views::id_color(leaf as f32), SOFTENING_COLOR, 0.24),
    }
}

/// Returns the leaf number at a pixel (column and row); 0 without a leaf.
pub fn leaf_at(image: &Image, [column, row]: [u32; 2]) -> u32 {
    let [column, row] = [column, row].map(|n| n as usize);
    if column >= image.width {
        return 0;
    }
    let leaf = image.id.get(row * image.width + column);
    leaf.copied().unwrap_or(0)
}

/// Draws the leaves of an image in light shades of their colours. If a leaf is picked, the others are
/// darkened and the picked one is outlined.
pub fn draw(image: &Image, settings: &RenderSettings, picked: Option<u32>) -> Vec<u8> {
    let rays = PictureRays::new(settings);
    let picked = picked.filter(|&leaf| leaf > 0);
    let mut picture = Vec::with_capacity(4 * image.id.len());
    for (pixel, &leaf) in image.id.iter().enumerate() {
        let shade = match image.normal.get(pixel) {
            Some(&normal) if normal != [0.0; 3] && !settings.is_2d => {
                let normal = Vec3::from(normal).as_dvec3();
                let facing = -normal.dot(rays.for_pixel(pixel).direction);
                0.62 + 0.38 * facing.clamp(0.0, 1.0) as f32
            }
            _ => 1.0,
        };
        let leaf_color = ink(leaf);
        let shown = if leaf == 0 {
            leaf_color
        } else {
            leaf_color * shade
        };
        picture.extend(bytes(match picked {
            Some(picked) if picked != leaf => mix(shown, BACKGROUND_COLOR, 0.55),
            _ => shown,
        }));
    }
    for pixel in 0..image.id.len() {
        let leaf = image.id[pixel];
        let [right, below] = neighbours(image, pixel);
        let differs = |neighbour: Option<usize>| {
            neighbour.is_some_and(|neighbour| image.id[neighbour] != leaf)
        };
        if differs(right) || differs(below) {
            blend_over(&mut picture, pixel, LINE_COLOR, 0.6);
        }
    }
    if let Some(picked) = picked {
        outline(&mut picture, image, picked);
    }
    picture
}

/// Outlines a leaf with a light line, two pixels wide, over any picture of the same view. Isolated pixels
/// of the leaf are skipped; they are slivers at an edge.
pub fn outline(picture: &mut [u8], image: &Image, leaf: u32) {
    let is_leaf = |pixel: usize| image.id.get(pixel) == Some(&leaf);
    let is_outlined: Vec<bool> = (0..image.id.len())
        .map(|pixel| is_leaf(pixel) && adjacent_pixels(image, pixel).any(is_leaf))
        .collect();
    for pixel in 0..image.id.len() {
        for neighbour in neighbours(image, pixel).into_iter().flatten() {
            if is_outlined[pixel] != is_outlined[neighbour] {
                blend_over(picture, pixel, OUTLINE_COLOR, 0.9);
                blend_over(picture, neighbour, OUTLINE_COLOR, 0.9);
            }
        }
    }
}

/// Returns the adjacent pixels to the left, above, to the right and below.
fn adjacent_pixels(image: &Image, pixel: usize) -> impl Iterator<Item = usize> {
    let is_first = image.width == 0 || pixel.is_multiple_of(image.width);
    let left = (!is_first).then(|| pixel - 1);
    let above = pixel.checked_sub(image.width);
    let [right, below] = neighbours(image, pixel);
    [left, above, right, below].into_iter().flatten()
}

/// Returns the adjacent pixels to the right and below, if they exist.
fn neighbours(image: &Image, pixel: usize) -> [Option<usize>; 2] {
    let is_last = image.width == 0 || pixel % image.width == image.width - 1;
    let below = pixel + image.width;
    [
        (!is_last && pixel + 1 < image.id.len()).then_some(pixel + 1),
        (below < image.id.len()).then_some(below),
    ]
}
