//! `camera { from: …, look: …, fov: … }`

use crate::elaborate::Elaborator;
use crate::elaborate::display::format_short;
use crate::elaborate::value::{Abort, Env};
use crate::expression::Stage;
use crate::scene::{ExprTriple, SceneCamera, SceneLens};
use glam::DVec3;
use sdfc_lang::ast::Block;
use sdfc_lang::{Diagnostic, codes};
use sdfc_vm::settings;

impl<'a> Elaborator<'a> {
    pub(super) fn camera(&mut self, env: &Env<'a>, block: &'a Block) -> Result<(), Abort> {
        let name = self.block_name(block);
        if !name.is_empty() && !self.camera_names.insert(name.clone()) {
            let message = format!("there are two cameras `{name}`");
            let span = block
                .name
                .as_ref()
                .map_or(block.kind.span, |name| name.span);
            self.report(Diagnostic::error(codes::E0214, span, message));
            return Ok(());
        }
        let from = self.vector_field(env, block, "from")?;
        let look = self.vector_field(env, block, "look")?;
        let up = self.vector_field(env, block, "up")?;
        let fov = self.angle_field(env, block, "fov")?;
        let height = self.scalar_field(env, block, "height", Stage::Uniform)?;
        let mut camera = self.automatic_camera();
        camera.name = name;
        camera.auto_framed = from.is_none();
        camera.from = from.unwrap_or(camera.from);
        camera.look = look.unwrap_or(camera.look);
        let (lens, lens_field) = match (fov, height) {
            (Some(_), Some(_)) => {
                let message = "a camera has `fov` (perspective) or `height` (parallel), not both";
                self.report(Diagnostic::error(codes::E0208, block.kind.span, message));
                return Ok(());
            }
            (None, Some(height)) => (SceneLens::Orthographic(height), "height"),
            (Some(fov), None) => (SceneLens::Perspective(fov), "fov"),
            (None, None) => (camera.lens, ""),
        };
        camera.lens = lens;
        if let Some(field) = self.find_field(block, lens_field) {
            let (id, upper_limit) = match lens {
                SceneLens::Perspective(fov) => (fov, std::f64::consts::PI),
                SceneLens::Orthographic(height) => (height, f64::INFINITY),
            };
            let value = self.current_value(id);
            if !(value > 0.0 && value < upper_limit) {
                let message = match lens {
                    SceneLens::Perspective(_) => {
                        let value = format_short(value.to_degrees());
                        format!(
                            "a field of view lies between 0 and 180 degrees, and this is {value}"
                        )
                    }
                    SceneLens::Orthographic(_) => {
                        format!(
                            "`height` of a camera is larger than 0, and this is {}",
                            format_short(value)
                        )
                    }
                };
                self.report(Diagnostic::error(codes::E0401, field.value.span, message));
            }
        }
        self.aim(&mut camera, up, block);
        if look.is_some() && height.is_some() {
            self.plane_cameras.push(self.cameras.len());
        }
        self.cameras.push(camera);
        Ok(())
    }

    /// Checks that the camera has a direction, and chooses an up vector if it points straight down
    /// or up.
    fn aim(&mut self, camera: &mut SceneCamera, up: Option<ExprTriple>, block: &Block) {
        let current = |e: &mut Self, v: ExprTriple| DVec3::from(v.map(|id| e.current_value(id)));
        let (from, look) = (current(self, camera.from), current(self, camera.look));
        let direction = look - from;
        if !camera.auto_framed && direction.length() == 0.0 {
            let message = "the camera is at the very point that it looks at";
            self.report(Diagnostic::error(codes::E0405, block.kind.span, message));
            return;
        }
        let chosen_up = up.unwrap_or(camera.up);
        let up_direction = current(self, chosen_up);
        let right = direction.cross(up_direction);
        let is_parallel = right.length() <= 1e-6 * direction.length() * up_direction.length();
        camera.up = chosen_up;
        if !camera.auto_framed && is_parallel {
            if up.is_some() {
                let message = "the camera looks along its own `up`";
                self.report(Diagnostic::error(codes::E0405, block.kind.span, message));
                return;
            }
            // A view from above has north at the top, as on a map.
            let north = if self.z_up {
                [0.0, 1.0, 0.0]
            } else {
                [0.0, 0.0, -1.0]
            };
            camera.up = north.map(|v| self.expressions.constant(v));
        }
    }

    /// Returns the camera of a scene without a `camera` block.
    pub(crate) fn automatic_camera(&mut self) -> SceneCamera {
        settings::Camera::open(self.z_up).map(|v| self.expressions.constant(v))
    }
}
