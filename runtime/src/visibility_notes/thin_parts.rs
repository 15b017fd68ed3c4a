//! A note on parts that are thinner than rounding allows at their place.

use super::{format_number, format_point, min_visible_depth};
use crate::render::RenderSettings;
use glam::DVec3;
use sdfc_vm::bounds::Bounds;

/// Thickness below which a part may have holes, in units of the depth that it needs.
const MIN_DEPTHS: f64 = 6.0;

/// Returns the note on the thinnest part, by the boxes of the parts; `None` if all are thick enough.
pub(super) fn note(settings: &RenderSettings, scene: &Bounds) -> Option<String> {
    let from = DVec3::from(settings.view.from);
    let excess = |part: &Bounds| {
        let thickness = thickness(part);
        let centre = part.centre();
        let to_camera = from - DVec3::from(centre);
        // Rays of a finite scene start near it.
        let camera = match scene.is_finite() {
            true => to_camera.clamp_length_max(2.0 * scene.half_diagonal()),
            false => to_camera,
        };
        let camera = DVec3::from(centre) + camera;
        let farthest = DVec3::from(part.min).abs().max(DVec3::from(part.max).abs());
        let needed = MIN_DEPTHS * min_visible_depth(farthest.into(), camera.into());
        (thickness > 0.0 && thickness < needed).then_some((needed / thickness, needed, *part))
    };
    let finite = settings.parts.iter().filter(|part| part.is_finite());
    let (_, needed, part) = finite
        .filter_map(excess)
        .max_by(|(a, ..), (b, ..)| a.total_cmp(b))?;
    let is_wide = part.half_diagonal() > DVec3::from(part.centre()).length();
    let advice = match is_wide {
        true => "Make it thicker or less wide",
        false => "Make it thicker, or draw the scene nearer to the origin and to the camera",
    };
    Some(format!(
        "a part near {} is {} thin, and rounding requires {} at its ends: it may be missing, or have holes. {advice}",
        format_point(part.centre()),
        format_number(thickness(&part)),
        format_number(needed)
    ))
}

/// Returns the shortest side of a box.
fn thickness(part: &Bounds) -> f64 {
    let sides = DVec3::from(part.max) - DVec3::from(part.min);
    sides.min_element()
}
