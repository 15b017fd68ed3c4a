//! Blending of colours over the bytes of a picture.

use sdfc_vm::vector::V3;

/// An sRGB colour with channels from 0 to 1.
pub(super) type Color = V3<f32>;

/// Converts `0xrrggbb` to a colour.
pub(super) const fn hex(color: u32) -> Color {
    let [_, r, g, b] = color.to_be_bytes();
    V3::new(r as f32 / 255.0, g as f32 / 255.0, b as f32 / 255.0)
}

/// Returns the bytes of a colour.
pub(super) fn bytes(color: Color) -> [u8; 4] {
    let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    [byte(color.x), byte(color.y), byte(color.z), 255]
}

/// Interpolates between two colours.
pub(super) fn mix(from: Color, to: Color, fraction: f32) -> Color {
    from + (to - from) * fraction
}

/// Returns the bytes of a pixel, if it exists.
pub(super) fn pixel(picture: &mut [u8], number: usize) -> Option<&mut [u8; 4]> {
    picture.as_chunks_mut().0.get_mut(number)
}

/// Returns the colour of a pixel.
pub(super) fn color([r, g, b, _]: [u8; 4]) -> Color {
    V3::new(f32::from(r), f32::from(g), f32::from(b)) * (1.0 / 255.0)
}

/// Blends a colour over a pixel; a fraction of 1 replaces it.
pub(super) fn blend_over(picture: &mut [u8], number: usize, ink: Color, fraction: f32) {
    if let Some(pixel) = pixel(picture, number) {
        *pixel = bytes(mix(color(*pixel), ink, fraction));
    }
}

/// Returns the luma of a colour, from 0 to 1.
pub(super) fn lightness(color: Color) -> f32 {
    0.3 * color.x + 0.59 * color.y + 0.11 * color.z
}

/// Desaturates a picture by the fraction `grey`, then blends it with a dark grey by the fraction `dark`.
pub(super) fn mute(picture: &mut [u8], grey: f32, dark: f32) {
    for pixel in picture.as_chunks_mut().0 {
        let original = color(*pixel);
        let light = lightness(original);
        let faded = mix(original, V3::new(light, light, light), grey);
        *pixel = bytes(mix(faded, hex(0x2a2d33), dark));
    }
}
