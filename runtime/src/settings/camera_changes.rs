//! Changes of a scene's camera: a named side, another position, target or lens, or the frame around the scene.

use super::{Reader, SettingsError, named, positive};
use crate::render::ResolvedLens;
use glam::DVec3;
use sdfc_vm::settings as scene;

/// Sine of the least angle between a view's direction and its upward direction.
const MIN_SINE_TO_UP: f64 = 1e-6;

/// Side from which a scene is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewSide {
    /// From +Z, or from −Y where z is up.
    Front,
    /// From −Z, or from +Y where z is up.
    Back,
    /// From −X.
    Left,
    /// From +X.
    Right,
    /// From above, with the front at the lower edge.
    Top,
    /// From below, with the front at the upper edge.
    Bottom,
    /// From the front, the right and above, with equal foreshortening of the three axes.
    Corner,
}

/// Changes of a scene's camera.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraChanges {
    /// Side from which the scene is seen and framed.
    pub side: Option<ViewSide>,
    /// The position, in scene units.
    pub from: Option<[f64; 3]>,
    /// The point at the centre of the image.
    pub look: Option<[f64; 3]>,
    /// The upward direction.
    pub up: Option<[f64; 3]>,
    /// The projection. The height of an orthographic one is not framed.
    pub lens: Option<ResolvedLens>,
    /// Set if the camera is moved along and across its direction, so that the scene fills the image.
    pub is_fitted: bool,
}

impl CameraChanges {
    /// Reports whether the camera frames the scene, so that the outline of its finite parts is needed.
    pub fn frames_scene(&self) -> bool {
        self.side.is_some() || self.is_fitted
    }

    /// Returns the projection, if its number is in its range.
    pub(super) fn checked_lens(&self) -> Result<Option<ResolvedLens>, SettingsError> {
        Ok(match self.lens {
            Some(ResolvedLens::Perspective(fov)) => {
                let fov = field_of_view("the field of view", fov)?;
                Some(ResolvedLens::Perspective(fov))
            }
            Some(ResolvedLens::Orthographic(height)) => {
                let height = positive("the height of the view", height)?;
                Some(ResolvedLens::Orthographic(height))
            }
            None => None,
        })
    }

    /// Reports whether the direction of the view is changed. Such a view is not rotated to look past obstructions.
    pub(super) fn fixes_direction(&self) -> bool {
        self.frames_scene() || self.from.is_some()
    }

    /// Reports whether there are changes that a plane figure, seen face on, has no use for.
    pub(super) fn leaves_plane(&self) -> bool {
        let is_perspective = matches!(self.lens, Some(ResolvedLens::Perspective(_)));
        self.side.is_some() || self.from.is_some() || self.up.is_some() || is_perspective
    }
}

/// Numbers of a camera before it is framed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CameraPose {
    pub(super) from: [f64; 3],
    pub(super) look: [f64; 3],
    pub(super) up: [f64; 3],
    pub(super) lens: ResolvedLens,
    /// Set if only the direction counts, and the position follows from the scene.
    pub(super) is_framed: bool,
}

impl CameraPose {
    /// Reads the numbers of a scene's camera.
    pub(super) fn read(camera: &scene::Camera, read: &Reader<'_>) -> Result<Self, SettingsError> {
        let describe = |what: &str| format!("{what} of the camera{}", named(&camera.name));
        let lens = match camera.lens {
            scene::Lens::Perspective(fov) => {
                let what = describe("the field of view");
                ResolvedLens::Perspective(field_of_view(&what, read.number(&what, fov)?)?)
            }
            scene::Lens::Orthographic(height) => {
                let what = describe("the height");
                ResolvedLens::Orthographic(positive(&what, read.number(&what, height)?)?)
            }
        };
        Ok(Self {
            from: read.triple(&describe("the place"), camera.from)?,
            look: read.triple(&describe("the target"), camera.look)?,
            up: read.triple(&describe("the upward direction"), camera.up)?,
            lens,
            is_framed: camera.auto_framed,
        })
    }

    /// Returns the pose after the changes. A camera without a target looks at `centre`. `world_up` is the
    /// scene's upward direction, Y or Z.
    pub(super) fn changed(
        &self,
        changes: &CameraChanges,
        centre: [f64; 3],
        world_up: DVec3,
    ) -> Result<Self, SettingsError> {
        let mut pose = *self;
        // The upward direction of views from above, as on a map.
        let north = world_up.cross(DVec3::X);
        if let Some(side) = changes.side {
            let up = world_up;
            let (from, up) = match side {
                ViewSide::Front => (-north, up),
                ViewSide::Back => (north, up),
                ViewSide::Left => (DVec3::NEG_X, up),
                ViewSide::Right => (DVec3::X, up),
                ViewSide::Top => (up, north),
                ViewSide::Bottom => (-up, -north),
                ViewSide::Corner => (DVec3::X + up - north, up),
            };
            pose.from = from.into();
            pose.look = [0.0; 3];
            pose.up = up.into();
            pose.is_framed = true;
        }
        if let Some(from) = changes.from {
            if pose.is_framed {
                pose.look = centre;
            }
            pose.from = from;
            pose.is_framed = false;
        }
        if let Some(look) = changes.look {
            if pose.is_framed {
                return Err(SettingsError::NoPosition);
            }
            pose.look = look;
        }
        pose.up = changes.up.unwrap_or(pose.up);
        pose.lens = changes.checked_lens()?.unwrap_or(pose.lens);
        let direction = DVec3::from(pose.look) - DVec3::from(pose.from);
        let up = DVec3::from(pose.up);
        let sine = direction.cross(up).length();
        let is_parallel = sine <= MIN_SINE_TO_UP * direction.length() * up.length();
        let is_aimed = changes.from.is_some() || changes.look.is_some() || changes.up.is_some();
        if is_aimed && is_parallel && direction.length() > 0.0 {
            if changes.up.is_some() {
                return Err(SettingsError::LooksAlongUp);
            }
            pose.up = north.into();
        }
        pose.is_framed |= changes.is_fitted;
        Ok(pose)
    }
}

/// Checks a field of view, in radians.
fn field_of_view(what: &str, fov: f64) -> Result<f64, SettingsError> {
    let fov = positive(what, fov)?;
    if fov < std::f64::consts::PI {
        return Ok(fov);
    }
    Err(SettingsError::OutOfRange {
        what: what.to_owned(),
        value: fov,
        allowed: "less than a half turn (3.14 radians)".to_owned(),
    })
}
