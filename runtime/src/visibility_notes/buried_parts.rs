//! A note on scenes whose finite parts all lie inside of a solid without an end, such as a part below a floor.

use super::format_point;
use crate::render::RenderSettings;
use glam::DVec3;

/// Returns a note if the finite part of a scene lies in a half space that is solid from its plane on.
pub(super) fn note(settings: &RenderSettings) -> Option<String> {
    let enclosure = settings.enclosure.as_ref()?;
    let finite = enclosure.bounds;
    if !finite.is_finite() || finite.is_empty() {
        return None;
    }
    let half_spaces = &enclosure.half_spaces[..enclosure.exact_half_spaces];
    let is_buried = half_spaces.iter().any(|&[x, y, z, offset]| {
        let height = |corner| DVec3::from(corner).dot(DVec3::new(x, y, z)) + offset;
        finite
            .corners()
            .into_iter()
            .all(|corner| height(corner) <= 0.0)
    });
    is_buried.then(|| {
        format!(
            "all parts but floors and walls without an end lie between {} and {}, inside of one of these, which hides \
             them: move them out of it",
            format_point(finite.min),
            format_point(finite.max)
        )
    })
}
