//! A lit plane has no self-shadowing at any position: shadow rays and occlusion taps start far enough
//! from it.

use super::SIZE;
use super::measure::{changed, drawn, shot_of};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::render::{CellMode, Image, Occlusion, RenderSettings, ResolvedShadow};

#[test]
fn a_lit_plane_has_no_specks_at_any_offset() {
    for away in [1.0, 1e1, 1e2, 1e3, 9370.0, 1e4, 11035.0, 1e5, 1e6] {
        let text = changed("lit_plane", "let away = 0;", &format!("let away = {away};"));
        let shot = shot_of("lit_plane", &text, SIZE);
        // At larger offsets, rounding is as large as cells.
        let cell_modes = match away > 2e4 {
            true => &[CellMode::Never][..],
            false => &[CellMode::Never, CellMode::Always],
        };
        for &cells in cell_modes {
            let lit = RenderSettings {
                cells,
                ..shot.settings.clone()
            };
            let mut unshadowed = RenderSettings {
                occlusion: Occlusion::Off,
                ..lit.clone()
            };
            for light in &mut unshadowed.lighting.lights {
                light.shadow = ResolvedShadow::None;
            }
            let [with, without] =
                [&lit, &unshadowed].map(|settings| drawn(&shot, EngineKind::Cpu, settings));
            let hits = |image: &Image| image.depth.iter().filter(|t| t.is_finite()).count();
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
