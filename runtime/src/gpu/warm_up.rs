//! Settings of small dummy renders that together run every kernel of a mode in its generic form. Nothing is
//! visible in them.

use crate::render::{
    CellMode, LightEmitter, Lighting, Mode, Normals, Occlusion, RenderSettings, ResolvedLens,
    ResolvedLight, ResolvedShadow, Tonemap, View,
};

/// Side in pixels: one block of rays.
const SIDE_PIXELS: u32 = 8;

/// Returns the settings for a mode: a scene in space with both kinds of normals, and a 2-D shape.
pub(super) fn warm_up_settings(mode: Mode) -> Vec<RenderSettings> {
    let solid = solid_settings(mode);
    let differences = RenderSettings {
        normals: Normals::Central,
        ..solid.clone()
    };
    let plane = RenderSettings {
        is_2d: true,
        view: View::plane([0.0; 2], 2.0),
        ..solid.clone()
    };
    vec![solid, differences, plane]
}

fn solid_settings(mode: Mode) -> RenderSettings {
    RenderSettings {
        size: [SIDE_PIXELS; 2],
        aa: 1,
        steps: 4,
        far: 10.0,
        extended_far: 10.0,
        threshold_fraction: RenderSettings::DEFAULT_THRESHOLD_FRACTION,
        relaxation: RenderSettings::DEFAULT_RELAXATION,
        mode,
        normals: Normals::Exact,
        occlusion: Occlusion::FiveTap,
        occlusion_reach: 1.0,
        tonemap: Tonemap::None,
        exposure: 1.0,
        view: View {
            from: [0.0, 0.0, 4.0],
            look: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            lens: ResolvedLens::Perspective(0.7),
        },
        parts: Vec::new(),
        enclosure: None,
        lighting: Lighting {
            lights: vec![ResolvedLight {
                source: LightEmitter::Directional([0.0, 1.0, 1.0]),
                color: [1.0; 3],
                shadow: ResolvedShadow::Hard,
            }],
            sky_top: [1.0; 3],
            sky_horizon: [1.0; 3],
            sky_ground: [1.0; 3],
            up: [0.0, 1.0, 0.0],
            ambient: 1.0,
            fog: None,
        },
        is_2d: false,
        cells: CellMode::Never,
    }
}
