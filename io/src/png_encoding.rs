//! Encodes pictures as PNG files.

/// Encodes rows of red, green, blue and alpha bytes as an sRGB PNG. The alpha channel is omitted if all
/// pixels are opaque.
///
/// # Errors
///
/// A message if the PNG cannot be encoded: a side of zero, or a byte count that does not match the size.
pub fn encode_png(size: [usize; 2], rgba: &[u8]) -> Result<Vec<u8>, String> {
    let failed = |error: &dyn std::fmt::Display| format!("the picture is not a PNG: {error}");
    let [width, height] = size.map(u32::try_from);
    let width = width.map_err(|error| failed(&error))?;
    let height = height.map_err(|error| failed(&error))?;
    let is_opaque = rgba
        .as_chunks()
        .0
        .iter()
        .all(|[_, _, _, alpha]| *alpha == 255);
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let rgb: Vec<u8>;
    let bytes = if is_opaque {
        encoder.set_color(png::ColorType::Rgb);
        let pixels = rgba.as_chunks().0.iter();
        rgb = pixels.flat_map(|&[r, g, b, _]| [r, g, b]).collect();
        &rgb
    } else {
        encoder.set_color(png::ColorType::Rgba);
        rgba
    };
    let written = encoder
        .write_header()
        .and_then(|mut writer| writer.write_image_data(bytes));
    written.map_err(|error| failed(&error))?;
    Ok(file)
}
