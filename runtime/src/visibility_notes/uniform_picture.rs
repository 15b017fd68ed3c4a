//! Notes on pictures in which fog, darkness or a single color hides what is in view.

use super::{MIN_VISIBLE_LIGHT, format_number};
use crate::render::{Image, Mode, RenderSettings, ResolvedLight};
use sdfc_shaders::sky;

/// Fraction of the light that fog leaves of a surface that it hides: half a step of grey of a white one.
const MAX_HIDDEN_LIGHT: f64 = 1.0 / 512.0;
/// Maximum difference of the bytes of one color.
const MAX_BYTE_DIFFERENCE: u8 = 1;
/// Minimum cosine between normals of one flat face.
const MIN_FLAT_COSINE: f32 = 0.999;

/// Returns a note on a picture with surfaces in view of which nothing can be seen.
pub(super) fn note(settings: &RenderSettings, image: &Image) -> Option<String> {
    if settings.mode != Mode::Shaded || image.depth.iter().all(|depth| depth.is_infinite()) {
        return None;
    }
    fog_note(settings, image).or_else(|| match bytes_of_one_color(image) {
        Some([r, g, b]) if r.max(g).max(b) <= MAX_BYTE_DIFFERENCE => {
            let reason = missing_light(settings).unwrap_or_else(|| lost_light(settings));
            Some(format!("all of the picture is black: {reason}"))
        }
        Some(_) => Some(one_color_note(image)),
        None => {
            let reason = missing_light(settings).filter(|_| are_surfaces_black(image))?;
            Some(format!("all surfaces are black: {reason}"))
        }
    })
}

fn fog_note(settings: &RenderSettings, image: &Image) -> Option<String> {
    let density = settings.lighting.fog?;
    let nearest = f64::from(image.depth.iter().copied().fold(f32::INFINITY, f32::min));
    let remaining = 1.0 - sky::fog_opacity::<f64>(nearest, density);
    (remaining < MAX_HIDDEN_LIGHT).then(|| {
        format!(
            "the fog hides all surfaces: the nearest is {} away, and `fog: {}` leaves {} of its light. `fog: {}` leaves \
             half",
            format_number(nearest),
            format_number(density),
            format_number(remaining),
            format_number(std::f64::consts::LN_2 / nearest)
        )
    })
}

/// Returns the bytes of the first pixel if all others are the same but for rounding.
fn bytes_of_one_color(image: &Image) -> Option<[u8; 3]> {
    let mut colors = image.color.iter();
    let rgb = |&color: &[f32; 4]| {
        let [r, g, b, _] = image.display.bytes(color);
        [r, g, b]
    };
    let first = rgb(colors.next()?);
    let is_same = |color: &[f32; 4]| {
        let pairs = rgb(color).into_iter().zip(first);
        pairs
            .into_iter()
            .all(|(a, b)| a.abs_diff(b) <= MAX_BYTE_DIFFERENCE)
    };
    colors.all(is_same).then_some(first)
}

/// Reports whether all pixels that show surfaces alone are black, and there are some.
fn are_surfaces_black(image: &Image) -> bool {
    let is_surface = |pixel: usize| {
        image
            .depth
            .get(pixel)
            .is_some_and(|depth| depth.is_finite())
    };
    let is_inner = |&pixel: &usize| {
        let neighbors = [
            pixel.wrapping_sub(image.width),
            pixel.wrapping_sub(1),
            pixel,
            pixel + 1,
            pixel + image.width,
        ];
        neighbors.into_iter().all(is_surface)
    };
    let mut inner = (0..image.depth.len()).filter(is_inner).peekable();
    let is_black = |pixel: usize| {
        let bytes = image.display.bytes(image.color[pixel]);
        bytes[..3].iter().all(|&byte| byte <= MAX_BYTE_DIFFERENCE)
    };
    inner.peek().is_some() && inner.all(is_black)
}

/// Returns why there is no light, if there is none.
fn missing_light(settings: &RenderSettings) -> Option<String> {
    let brightness = |light: &ResolvedLight| light.color.into_iter().fold(0.0, f64::max);
    let lights = &settings.lighting.lights;
    let brightest = lights.iter().map(brightness).fold(0.0, f64::max);
    if settings.exposure < MIN_VISIBLE_LIGHT {
        return Some(format!(
            "its `exposure` is {}",
            format_number(settings.exposure)
        ));
    }
    (brightest * settings.exposure < MIN_VISIBLE_LIGHT).then(|| {
        format!(
            "the brightest of {} lights has {} as color times `intensity`, and `ambient` is {}",
            lights.len(),
            format_number(brightest),
            format_number(settings.lighting.ambient)
        )
    })
}

fn lost_light(settings: &RenderSettings) -> String {
    format!(
        "none of {} lights reaches what is in view, or its materials are black, and `ambient` is {}",
        settings.lighting.lights.len(),
        format_number(settings.lighting.ambient)
    )
}

fn one_color_note(image: &Image) -> String {
    let is_filled = image.depth.iter().all(|depth| depth.is_finite());
    let first = image.normal.first().copied().unwrap_or_default();
    let is_flat = is_filled && image.normal.iter().all(|&normal| is_along(normal, first));
    let reason = match is_flat {
        true => "a flat face fills it. Move the camera farther away, or turn it",
        false => {
            "surfaces and what is behind them look the same. Give them another color, or light from a side"
        }
    };
    format!("all of the picture has one color: {reason}")
}

fn is_along([a, b, c]: [f32; 3], [x, y, z]: [f32; 3]) -> bool {
    a * x + b * y + c * z >= MIN_FLAT_COSINE
}
