//! Pictures as PNG files.

use crate::failure::Failure;

/// Rows of red, green, blue and alpha bytes as a PNG in sRGB; without alpha if nothing shines
/// through.
pub(crate) fn png(width: usize, height: usize, rgba: &[u8]) -> Result<Vec<u8>, Failure> {
    let is_opaque = rgba.chunks_exact(4).all(|pixel| pixel[3] == 255);
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width as u32, height as u32);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let written = if is_opaque {
        let rgb: Vec<u8> = rgba
            .chunks_exact(4)
            .flat_map(|pixel| &pixel[..3])
            .copied()
            .collect();
        encoder.set_color(png::ColorType::Rgb);
        encoder
            .write_header()
            .and_then(|mut writer| writer.write_image_data(&rgb))
    } else {
        encoder.set_color(png::ColorType::Rgba);
        encoder
            .write_header()
            .and_then(|mut writer| writer.write_image_data(rgba))
    };
    written.map_err(|error| Failure::Input(format!("the picture is no PNG: {error}")))?;
    Ok(file)
}
