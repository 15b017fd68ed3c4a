//! Scenes far from the origin: the error is limited by the precision of the coordinates in `f32`.

use super::measure::{changed, measured, shot_of};
use super::{DEFAULT_LIMIT, SIZE};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::render::CellMode;

/// Maximum 99th percentile of the depth errors in units in the last place of the coordinates. A ray's
/// origin, its direction times the distance, and their sum are rounded; the distance of the shape from
/// the point adds as much again.
const MAX_ERROR_ULPS: f64 = 6.0;
/// Unit in the last place, as a fraction of the scene's size, from which the shape is lost; normals and
/// silhouettes are then not checked.
const HIDDEN_FRACTION: f64 = 1e-3;

#[test]
fn a_scene_far_from_the_origin_keeps_what_its_coordinates_keep() {
    for away in [0.0, 1e2, 1e3, 1e4, 1e5, 1e6] {
        let text = changed("away", "let away = 0;", &format!("let away = {away};"));
        let shot = shot_of(&format!("away at {away:e}"), &text, SIZE);
        let last_place = f64::from((away as f32).next_up()) - f64::from(away as f32);
        for cells in [CellMode::Never, CellMode::Always] {
            let measured = measured(&shot, EngineKind::Cpu, cells);
            measured.print();
            let e = &measured.errors;
            assert_eq!((e.nans, e.step_caps), (0, 0), "{measured}");
            // The scene is about three units from the camera.
            let rounding_error = MAX_ERROR_ULPS * last_place / 3.0;
            assert!(
                e.depth_smooth.p99 <= DEFAULT_LIMIT.depth.max(rounding_error),
                "{measured}"
            );
            if last_place < HIDDEN_FRACTION {
                assert_eq!(e.mismatches_inside, 0, "{measured}");
            }
            if last_place < 1e-4 {
                // A point displaced by this error lies elsewhere on an edge rounded by 0.05.
                let edge_angle = (MAX_ERROR_ULPS * last_place / 0.05).to_degrees();
                assert!(
                    e.normals.p99 <= DEFAULT_LIMIT.normals.max(edge_angle),
                    "{measured}"
                );
            }
        }
    }
}
