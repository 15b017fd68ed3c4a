//! Nothing on a lit plane casts a shadow on it, wherever it lies: rays to lights, and taps of
//! occlusion, start far enough from it.

use super::SIZE;
use super::measure::{changed, drawn, shot_of};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::frame::{CellUse, Frame, Occlusion, RenderSettings, Shadow};

#[test]
fn a_lit_plane_has_no_specks_at_any_offset() {
    for away in [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6] {
        let text = changed("lit_plane", "let away = 0;", &format!("let away = {away};"));
        let shot = shot_of("lit_plane", &text, SIZE);
        // Farther away, rounding is as large as cells are.
        let uses = match away > 1e4 {
            true => &[CellUse::Never][..],
            false => &[CellUse::Never, CellUse::Always],
        };
        for &cells in uses {
            let lit = RenderSettings {
                cells,
                ..shot.settings.clone()
            };
            let mut open = RenderSettings {
                occlusion: Occlusion::Off,
                ..lit.clone()
            };
            for light in &mut open.lighting.lights {
                light.shadow = Shadow::None;
            }
            let [with, without] =
                [&lit, &open].map(|settings| drawn(&shot, EngineKind::Cpu, settings));
            let hits = |frame: &Frame| frame.depth.iter().filter(|t| t.is_finite()).count();
            assert!(hits(&with) > 1000, "the plane is in the picture");
            let specks = (0..with.color.len()).filter(|&i| {
                let channels = with.color[i].iter().zip(without.color[i]);
                channels.fold(false, |dark, (a, b)| dark | ((a - b).abs() > 1e-3))
            });
            let specks = specks.count();
            assert_eq!(specks, 0, "pixels in shadow at {away:e}, cells {cells:?}");
        }
    }
}
