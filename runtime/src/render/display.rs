//! The conversion of colours to bytes.

use super::Tonemap;
use sdfc_shaders::tone;
use sdfc_vm::multiversion;
use sdfc_vm::vector::V3;

/// The conversion of colours to bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    /// Factor on all light.
    pub exposure: f32,
    /// The tone curve.
    pub tonemap: Tonemap,
    /// Set if the colours are light; otherwise (normals, depths, …) they are shown as they are.
    pub is_light: bool,
    /// Set if that is the light of a lit scene, which is exposed and tone mapped.
    pub is_lit_scene: bool,
}

impl Display {
    /// Converts a colour to the bytes of a pixel, exposed, tone mapped and encoded where it shows light.
    #[inline(always)]
    pub fn bytes(&self, [r, g, b, _]: [f32; 4]) -> [u8; 4] {
        let mut color = V3::new(r, g, b);
        if self.is_lit_scene {
            color = color * self.exposure;
            color = match self.tonemap {
                Tonemap::None => color,
                Tonemap::Reinhard => tone::reinhard::<f32>(color),
                Tonemap::Aces => tone::filmic::<f32>(color),
            };
        }
        if self.is_light {
            color = tone::encode::<f32>(color);
        }
        let byte = |channel: f32| tone::to_byte(channel) as u8;
        [byte(color.x), byte(color.y), byte(color.z), 255]
    }

    /// Converts the colours of many pixels; returns four bytes of each.
    pub(super) fn all_bytes(self, colors: &[[f32; 4]]) -> Vec<u8> {
        let mut bytes = vec![[0; 4]; colors.len()];
        write_bytes(self, colors, &mut bytes);
        bytes.into_flattened()
    }
}

multiversion! {
    /// Converts colours to the bytes of as many pixels.
    fn write_bytes(display: Display, colors: &[[f32; 4]], bytes: &mut [[u8; 4]]) = write_each;
}

#[inline(always)]
fn write_each(display: Display, colors: &[[f32; 4]], bytes: &mut [[u8; 4]]) {
    for (bytes, &color) in bytes.iter_mut().zip(colors) {
        *bytes = display.bytes(color);
    }
}
