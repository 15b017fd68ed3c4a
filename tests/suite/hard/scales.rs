//! One scene gives the same picture at all scales: no threshold, shadow-ray offset or normal tap has an
//! absolute size.

use super::measure::{changed, measured, shot_of};
use super::{DEFAULT_LIMIT, SIZE};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::render::CellMode;

/// Maximum difference of a colour channel. Rounding differs between scales that are not powers of two.
const MAX_COLOR_DIFFERENCE: f32 = 1.5 / 255.0;

#[test]
fn a_scene_is_the_same_picture_at_all_scales() {
    let shot_at_scale = |scale: &str| {
        let text = changed("scales", "let scale = 1;", &format!("let scale = {scale};"));
        shot_of(&format!("scales at {scale}"), &text, SIZE)
    };
    let unit_shot = shot_at_scale("1");
    for cells in [CellMode::Never, CellMode::Always] {
        let original = measured(&unit_shot, EngineKind::Cpu, cells).image;
        for scale in ["0.0001", "0.01", "128", "10000", "1000000"] {
            let shot = shot_at_scale(scale);
            let measured = measured(&shot, EngineKind::Cpu, cells);
            measured.print();
            let e = &measured.errors;
            assert_eq!(
                (e.mismatches_inside, e.nans, e.step_caps),
                (0, 0, 0),
                "{measured}"
            );
            assert!(e.depth_smooth.p99 <= DEFAULT_LIMIT.depth, "{measured}");
            assert!(e.normals.p99 <= DEFAULT_LIMIT.normals, "{measured}");
            let (mut differing_hits, mut differing_colors) = (0, 0);
            for (i, pixel) in unit_shot.truth().pixels.iter().enumerate() {
                let (a, b) = (original.color[i], measured.image.color[i]);
                let differences = a.iter().zip(b).map(|(a, b)| (a - b).abs());
                differing_hits += usize::from(original.status[i] != measured.image.status[i]);
                let is_smooth = pixel.class == sdfc_runtime::reference::PixelClass::Smooth;
                differing_colors += usize::from(
                    is_smooth && differences.fold(0.0, f32::max) > MAX_COLOR_DIFFERENCE,
                );
            }
            // Rays at silhouettes may round to either side.
            assert!(
                differing_hits <= 4,
                "{measured}: {differing_hits} rays end in another way"
            );
            assert_eq!(differing_colors, 0, "{measured}: colours differ");
        }
    }
}
