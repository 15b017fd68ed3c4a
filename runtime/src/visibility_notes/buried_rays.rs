//! A note on parallel rays that begin inside of a solid without an end, such as a floor seen from the front.

use super::{field_at, format_number};
use crate::render::{Image, RenderSettings, ResolvedLens};
use crate::settings::ViewAxes;
use glam::DVec3;
use sdfc_vm::program::Module;

/// Numbers of columns and rows of pixels that are examined.
const SAMPLES: [usize; 2] = [24, 18];
/// Minimum fraction of such pixels that is worth a note.
const MIN_FRACTION: f64 = 0.02;

/// Returns a note if parallel rays begin inside of a solid, never leave it, and so show the background.
pub(super) fn note(module: &Module, settings: &RenderSettings, image: &Image) -> Option<String> {
    let ResolvedLens::Orthographic(height) = settings.view.lens else {
        return None;
    };
    let ViewAxes { right, up, .. } = ViewAxes::from_view(&settings.view);
    let from = DVec3::from(settings.view.from);
    let [width, rows] = [image.width, image.height];
    let unit = height / rows as f64;
    let shows_inside = |column: usize, row: usize| {
        let x = (column * 2 + 1) * width / (SAMPLES[0] * 2);
        let y = (row * 2 + 1) * rows / (SAMPLES[1] * 2);
        let to_right = x as f64 + 0.5 - width as f64 / 2.0;
        let to_top = rows as f64 / 2.0 - y as f64 - 0.5;
        let start = from + (right * to_right + up * to_top) * unit;
        let is_background = image.depth[y * width + x].is_infinite();
        is_background && field_at(module, start.to_array()) < 0.0
    };
    let pixels = (0..SAMPLES[1]).flat_map(|row| (0..SAMPLES[0]).map(move |column| (column, row)));
    let count = pixels
        .filter(|&(column, row)| shows_inside(column, row))
        .count();
    let fraction = count as f64 / (SAMPLES[0] * SAMPLES[1]) as f64;
    (fraction >= MIN_FRACTION).then(|| {
        format!(
            "about {} % of the rays begin inside of a solid and never leave it, so the background is shown there. A \
             floor without an end is seen from inside, below its surface: move the camera (`from`) higher and look \
             down, or use a floor with an end, such as `box([20, 1, 20])`",
            format_number((fraction * 100.0).round())
        )
    })
}
