//! `camera { from: …, look: …, fov: … }`

use crate::elaborate::Elaborator;
use crate::elaborate::bound::short;
use crate::elaborate::evaluate::{Halt, Here};
use crate::expression::Stage;
use crate::scene::{Camera, Lens, Triple};
use sdfc_lang::ast::Block;
use sdfc_lang::{Diagnostic, codes};
use sdfc_vm::settings;

impl<'a> Elaborator<'a> {
    pub(super) fn camera(&mut self, here: &Here<'a>, block: &'a Block) -> Result<(), Halt> {
        let name = self.block_name(block);
        if !name.is_empty() && self.cameras.iter().any(|camera| camera.name == name) {
            let message = format!("there are two cameras `{name}`");
            let span = block
                .name
                .as_ref()
                .map_or(block.kind.span, |name| name.span);
            self.report(Diagnostic::error(codes::E0214, span, message));
            return Ok(());
        }
        let from = self.vector_field(here, block, "from")?;
        let look = self.vector_field(here, block, "look")?;
        let up = self.vector_field(here, block, "up")?;
        let fov = self.angle_field(here, block, "fov")?;
        let height = self.number_field(here, block, "height", Stage::Uniform, f64::INFINITY)?;
        let mut camera = self.automatic_camera();
        camera.name = name;
        camera.automatic = from.is_none();
        camera.from = from.unwrap_or(camera.from);
        camera.look = look.unwrap_or(camera.look);
        let (lens, place) = match (fov, height) {
            (Some(_), Some(_)) => {
                let message = "a camera has `fov` (perspective) or `height` (parallel), not both";
                self.report(Diagnostic::error(codes::E0208, block.kind.span, message));
                return Ok(());
            }
            (None, Some(height)) => (Lens::Orthographic(height), "height"),
            (Some(fov), None) => (Lens::Perspective(fov), "fov"),
            (None, None) => (camera.lens, ""),
        };
        camera.lens = lens;
        if let Some(field) = self.given(block, place) {
            let (id, most) = match lens {
                Lens::Perspective(fov) => (fov, std::f64::consts::PI),
                Lens::Orthographic(height) => (height, f64::INFINITY),
            };
            let now = self.present(id);
            if !(now > 0.0 && now < most) {
                let message = match lens {
                    Lens::Perspective(_) => {
                        let now = short(now.to_degrees());
                        format!("a field of view lies between 0 and 180 degrees, and this is {now}")
                    }
                    Lens::Orthographic(_) => {
                        format!(
                            "the height of a view is larger than 0, and this is {}",
                            short(now)
                        )
                    }
                };
                self.report(Diagnostic::error(codes::E0401, field.value.span, message));
            }
        }
        self.aim(&mut camera, up, block);
        self.cameras.push(camera);
        Ok(())
    }

    /// Checks that a camera looks somewhere, and chooses what is up if it looks straight down.
    fn aim(&mut self, camera: &mut Camera, up: Option<Triple>, block: &Block) {
        let at = |e: &mut Self, v: Triple| v.map(|id| e.present(id));
        let (from, look) = (at(self, camera.from), at(self, camera.look));
        let way: [f64; 3] = std::array::from_fn(|i| look[i] - from[i]);
        let length = |v: [f64; 3]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
        if !camera.automatic && length(way) == 0.0 {
            let message = "the camera is at the very point that it looks at";
            self.report(Diagnostic::error(codes::E0405, block.kind.span, message));
            return;
        }
        let upright = up.unwrap_or(camera.up);
        let upwards = at(self, upright);
        let across = [
            way[1] * upwards[2] - way[2] * upwards[1],
            way[2] * upwards[0] - way[0] * upwards[2],
            way[0] * upwards[1] - way[1] * upwards[0],
        ];
        let is_along = length(across) <= 1e-6 * length(way) * length(upwards);
        camera.up = upright;
        if !camera.automatic && is_along {
            if up.is_some() {
                let message = "the camera looks along its own `up`";
                self.report(Diagnostic::error(codes::E0405, block.kind.span, message));
                return;
            }
            // Seen from above, as on a map.
            let north = if self.z_up {
                [0.0, 1.0, 0.0]
            } else {
                [0.0, 0.0, -1.0]
            };
            camera.up = north.map(|v| self.graph.constant(v));
        }
    }

    /// The camera of a scene without one.
    pub(crate) fn automatic_camera(&mut self) -> Camera {
        settings::Camera::open(self.z_up).map(|v| self.graph.constant(v))
    }
}
