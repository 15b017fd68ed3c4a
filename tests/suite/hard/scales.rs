//! One scene at many scales is one picture: no threshold, no lift of shadow rays and no tap of normals
//! has a size of its own.

use super::measure::{changed, measured, shot_of};
use super::{GATE, SIZE};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::frame::CellUse;

/// Rounding differs between scales that are no powers of two; so much a colour may.
const COLOR: f32 = 1.5 / 255.0;

#[test]
fn a_scene_is_the_same_picture_at_all_scales() {
    let at = |scale: &str| {
        let text = changed("scales", "let scale = 1;", &format!("let scale = {scale};"));
        shot_of(&format!("scales at {scale}"), &text, SIZE)
    };
    let one = at("1");
    for cells in [CellUse::Never, CellUse::Always] {
        let original = measured(&one, EngineKind::Cpu, cells).frame;
        for scale in ["0.0001", "0.01", "128", "10000", "1000000"] {
            let shot = at(scale);
            let measured = measured(&shot, EngineKind::Cpu, cells);
            measured.print();
            let e = &measured.errors;
            assert_eq!(
                (e.mismatches_inside, e.nans, e.step_caps),
                (0, 0, 0),
                "{measured}"
            );
            assert!(e.depth_smooth.p99 <= GATE.depth, "{measured}");
            assert!(e.normals.p99 <= GATE.normals, "{measured}");
            let (mut hits, mut colors) = (0, 0);
            for (i, place) in one.truth().places.iter().enumerate() {
                let (a, b) = (original.color[i], measured.frame.color[i]);
                let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs());
                hits += usize::from(original.status[i] != measured.frame.status[i]);
                let smooth = *place == sdfc_runtime::reference::Place::Smooth;
                colors += usize::from(smooth && apart.fold(0.0, f32::max) > COLOR);
            }
            // Rays at silhouettes may round to either side.
            assert!(hits <= 4, "{measured}: {hits} rays end in another way");
            assert_eq!(colors, 0, "{measured}: colours differ");
        }
    }
}
