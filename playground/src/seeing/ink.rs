//! Ink: colours laid over the bytes of a picture.

use sdfc_vm::vector::V3;

/// A colour as the screen shows it, each channel from 0 to 1.
pub(super) type Color = V3<f32>;

/// A colour from its bytes.
pub(super) const fn hex(color: u32) -> Color {
    let [_, r, g, b] = color.to_be_bytes();
    V3::of(r as f32 / 255.0, g as f32 / 255.0, b as f32 / 255.0)
}

/// The bytes of a colour.
pub(super) fn bytes(color: Color) -> [u8; 4] {
    let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    [byte(color.x), byte(color.y), byte(color.z), 255]
}

/// Between two colours.
pub(super) fn mixed(from: Color, to: Color, share: f32) -> Color {
    from + (to - from) * share
}

/// The bytes of a pixel, if there is one.
pub(super) fn pixel(picture: &mut [u8], number: usize) -> Option<&mut [u8; 4]> {
    picture.as_chunks_mut().0.get_mut(number)
}

/// The colour of a pixel.
pub(super) fn color([r, g, b, _]: [u8; 4]) -> Color {
    V3::of(f32::from(r), f32::from(g), f32::from(b)) * (1.0 / 255.0)
}

/// Lays a colour over a pixel: a share of 1 hides what was there.
pub(super) fn lay(picture: &mut [u8], number: usize, ink: Color, share: f32) {
    if let Some(pixel) = pixel(picture, number) {
        *pixel = bytes(mixed(color(*pixel), ink, share));
    }
}

/// How light a colour looks, from 0 to 1.
pub(super) fn lightness(color: Color) -> f32 {
    0.3 * color.x + 0.59 * color.y + 0.11 * color.z
}

/// Draws all of a picture back: with so much less colour, towards so much of a dark grey.
pub(super) fn draw_back(picture: &mut [u8], grey: f32, dark: f32) {
    for pixel in picture.as_chunks_mut().0 {
        let before = color(*pixel);
        let light = lightness(before);
        let faded = mixed(before, V3::of(light, light, light), grey);
        *pixel = bytes(mixed(faded, hex(0x2a2d33), dark));
    }
}
