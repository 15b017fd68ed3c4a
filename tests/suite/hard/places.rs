//! Scenes far from the origin: coordinates take all digits that `f32` has, and what is left of the
//! scene is what is left of them, no less.

use super::measure::{changed, measured, shot_of};
use super::{GATE, SIZE};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::frame::CellUse;

/// Units in the last place of the coordinates that 99 of 100 depths may be off by: a ray's origin,
/// its direction times the way, and their sum are rounded, and the shape's own distance from the
/// point takes as much again.
const ULPS: f64 = 6.0;
/// From this share of a scene's size on, a unit in the last place hides its shape: nothing is asked
/// of its normals and silhouettes.
const HIDDEN: f64 = 1e-3;

#[test]
fn a_scene_far_from_the_origin_keeps_what_its_coordinates_keep() {
    for away in [0.0, 1e2, 1e3, 1e4, 1e5, 1e6] {
        let text = changed("away", "let away = 0;", &format!("let away = {away};"));
        let shot = shot_of(&format!("away at {away:e}"), &text, SIZE);
        let last_place = f64::from((away as f32).next_up()) - f64::from(away as f32);
        for cells in [CellUse::Never, CellUse::Always] {
            let measured = measured(&shot, EngineKind::Cpu, cells);
            measured.print();
            let e = &measured.errors;
            assert_eq!((e.nans, e.step_caps), (0, 0), "{measured}");
            // The scene is about three units away from the camera.
            let possible = ULPS * last_place / 3.0;
            assert!(e.depth_smooth.p99 <= GATE.depth.max(possible), "{measured}");
            if last_place < HIDDEN {
                assert_eq!(e.mismatches_inside, 0, "{measured}");
            }
            if last_place < 1e-4 {
                // A point that is off by so much lies elsewhere on an edge rounded by 0.05.
                let turned = (ULPS * last_place / 0.05).to_degrees();
                assert!(e.normals.p99 <= GATE.normals.max(turned), "{measured}");
            }
        }
    }
}
