//! The pictures that between them run every kernel a mode has in the general form. They are small, and
//! there is nothing to be seen on them.

use crate::frame::{
    CellUse, Lens, Light, Lighting, Mode, Normals, Occlusion, RenderSettings, Shadow, Source,
    Tonemap, View,
};

/// A side in pixels: one block of rays.
const SIDE: u32 = 8;

/// The pictures of a mode: of a scene in space with both kinds of normals, and of a plane figure.
pub(super) fn pictures(mode: Mode) -> Vec<RenderSettings> {
    let solid = solid(mode);
    let differences = RenderSettings {
        normals: Normals::Central,
        ..solid.clone()
    };
    let plane = RenderSettings {
        plane: true,
        view: View::plane([0.0; 2], 2.0),
        ..solid.clone()
    };
    vec![solid, differences, plane]
}

fn solid(mode: Mode) -> RenderSettings {
    RenderSettings {
        size: [SIDE; 2],
        aa: 1,
        steps: 4,
        far: 10.0,
        cone: RenderSettings::CONE,
        relaxation: RenderSettings::RELAXATION,
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
            lens: Lens::Perspective(0.7),
        },
        lighting: Lighting {
            lights: vec![Light {
                source: Source::Directional([0.0, 1.0, 1.0]),
                color: [1.0; 3],
                shadow: Shadow::Hard,
            }],
            sky_top: [1.0; 3],
            sky_horizon: [1.0; 3],
            sky_ground: [1.0; 3],
            up: [0.0, 1.0, 0.0],
            ambient: 1.0,
            fog: None,
        },
        plane: false,
        cells: CellUse::Never,
    }
}
