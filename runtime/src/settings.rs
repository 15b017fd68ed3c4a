//! Resolution of a scene's render settings to plain numbers. [`resolve`] takes the settings of a module and
//! the results of its uniform program, and returns [`RenderSettings`]. It applies the overrides of a
//! command line or a window.
//!
//! It finds cameras by name and places automatic cameras so that they frame the bounds. Values that the scene
//! left open (length of rays, radius of occlusion) follow from the bounds. It also checks the scene's own
//! conditions on its numbers.

mod camera_changes;
mod camera_placement;
mod framing;
mod plane_scale;
mod space_scale;

use crate::render::{
    CellMode, FieldFacts, LightEmitter, Lighting, Mode, Normals, Occlusion, RenderSettings,
    ResolvedLens, ResolvedLight, ResolvedShadow, Surface, Tonemap, View,
};
use camera_changes::CameraPose;
pub use camera_changes::{CameraChanges, ViewSide};
use camera_placement::CameraPlacement;
pub(crate) use framing::ViewAxes;
use framing::{FramingTarget, framed_view, plane_view};
use glam::DVec3;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::outline::Outline;
use sdfc_vm::program::Module;
use sdfc_vm::settings::{self as scene, Extents, SettingValue, Settings, Triple};

/// Maximum width or height of an image.
pub const MAX_SIDE_PIXELS: u32 = 16_384;
/// Maximum number of pixels of an image.
pub const MAX_PIXELS: u64 = 1 << 26;
/// Maximum number of samples per pixel along each side.
pub const MAX_SAMPLES_PER_SIDE: u32 = 16;

/// Values that override those of the scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overrides {
    /// Width and height in pixels.
    pub size: Option<[u32; 2]>,
    /// Samples per pixel along each side.
    pub aa: Option<u32>,
    /// Name of the camera; by default the scene's first one.
    pub camera: Option<String>,
    /// The view, replacing all cameras of the scene.
    pub view: Option<View>,
    /// Changes of the camera.
    pub camera_changes: CameraChanges,
    /// The mode; scenes cannot set it.
    pub mode: Mode,
    /// Maximum number of steps of a ray.
    pub steps: Option<u32>,
    /// Maximum length of a ray.
    pub far: Option<f64>,
    /// The method for normals.
    pub normals: Option<Normals>,
    /// Method for ambient occlusion.
    pub occlusion: Option<Occlusion>,
    /// The tone curve.
    pub tonemap: Option<Tonemap>,
    /// A factor on all light.
    pub exposure: Option<f64>,
    /// Use of cells.
    pub cells: CellMode,
}

/// Reasons why settings cannot be resolved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// The scene's own condition on its numbers is violated.
    #[error("{0}")]
    Check(String),
    /// There is no camera with that name.
    #[error("{}", no_camera(name, known, near.as_deref()))]
    NoCamera {
        /// The requested name.
        name: String,
        /// The existing names.
        known: Vec<String>,
        /// The existing name that was probably meant.
        near: Option<String>,
    },
    /// A number of the settings is not finite.
    #[error("{what} is {value}, a finite number is needed")]
    NotFinite {
        /// Description of the number.
        what: String,
        /// Its value.
        value: f64,
    },
    /// A number of the settings is out of its range.
    #[error("{what} is {value}, {allowed} is allowed")]
    OutOfRange {
        /// Description of the number.
        what: String,
        /// Its value.
        value: f64,
        /// The allowed range.
        allowed: String,
    },
    /// A camera is at the point it looks at.
    #[error("the camera{} is at the point it looks at", named(.0))]
    NoDirection(String),
    /// A camera without a position has a new target.
    #[error(
        "the scene's camera has no position, and a new target needs one: give `--from X,Y,Z`, too"
    )]
    NoPosition,
    /// A camera looks along its own upward direction.
    #[error("the camera looks along its own upward direction")]
    LooksAlongUp,
    /// The view of a plane figure is to be turned.
    #[error(
        "a 2-D shape is seen face on, so its view has a target and a height, and nothing else: `--look X,Y,0`, \
         `--ortho HEIGHT`, `--fit`"
    )]
    LeavesPlane,
}

fn no_camera(name: &str, known: &[String], near: Option<&str>) -> String {
    if known.is_empty() {
        return format!("there is no camera `{name}`, the scene's only camera has no name");
    }
    let list: Vec<String> = known.iter().map(|name| format!("`{name}`")).collect();
    let hint = near
        .map(|near| format!("; did you mean `{near}`?"))
        .unwrap_or_default();
    format!(
        "there is no camera `{name}`, only {}{hint}",
        list.join(", ")
    )
}

fn named(name: &str) -> String {
    if name.is_empty() {
        String::new()
    } else {
        format!(" `{name}`")
    }
}

/// Resolves the settings of a module's image, for the current parameters and time.
pub fn resolve(
    module: &Module,
    uniform_values: &[f64],
    overrides: &Overrides,
) -> Result<RenderSettings, SettingsError> {
    let settings = &module.settings;
    check(settings, uniform_values)?;
    let read = Reader { uniform_values };
    let render = &settings.render;
    let size = size(overrides.size.unwrap_or(render.size))?;
    let aa = within(
        "the samples per side of a pixel",
        overrides.aa.unwrap_or(render.aa),
        MAX_SAMPLES_PER_SIDE,
    )?;
    let steps = within(
        "the maximum number of steps of a ray",
        overrides.steps.unwrap_or(render.steps),
        u32::MAX,
    )?;
    let camera = camera(settings, overrides.camera.as_deref())?;
    let camera_distance = camera.and_then(|camera| camera_target_distance(camera, uniform_values));
    let mut target = FramingTarget::from_bounds(&settings.bounds)
        .with_known_size(settings.subject.as_ref(), camera_distance);
    if !settings.is_2d && settings.subject.is_none() && camera_distance.is_none() {
        target = target.with_features(&module.distance);
    }
    let view = match overrides.view {
        Some(view) => view,
        None => view(
            module,
            (camera, &overrides.camera_changes),
            &read,
            &target,
            size,
        )?,
    };
    let stated_far = overrides.far.or(render.far);
    let far = stated_far.unwrap_or_else(|| {
        target
            .with_bounds(&settings.bounds_for_all_params)
            .far(&settings.current_bounds.extents, &view)
    });
    let exposure = match overrides.exposure {
        Some(exposure) => exposure,
        None => read.number("the exposure", render.exposure)?,
    };
    Ok(RenderSettings {
        size,
        aa,
        steps,
        far: positive("the range of a ray", far)?,
        extended_far: stated_far.unwrap_or(f64::INFINITY),
        threshold_fraction: RenderSettings::DEFAULT_THRESHOLD_FRACTION,
        relaxation: RenderSettings::DEFAULT_RELAXATION,
        cells: overrides.cells,
        mode: overrides.mode,
        normals: overrides.normals.unwrap_or(render.normals),
        occlusion: overrides.occlusion.unwrap_or(render.occlusion),
        occlusion_reach: render
            .occlusion_reach
            .unwrap_or_else(|| target.occlusion_reach()),
        tonemap: overrides.tonemap.unwrap_or(render.tonemap),
        exposure: not_negative("the exposure", exposure)?,
        view,
        parts: part_boxes(&settings.current_bounds.extents),
        enclosure: settings.enclosure().cloned(),
        lighting: lighting(settings, &read)?,
        is_2d: settings.is_2d,
    })
}

/// Returns the boxes of all parts of a scene.
fn part_boxes(extents: &Extents) -> Vec<Bounds> {
    let endless = extents.endless.iter().map(|part| part.bounds);
    extents
        .finite_parts
        .iter()
        .copied()
        .chain(endless)
        .collect()
}

/// Returns facts about a module's field besides its values.
pub fn field_facts(module: &Module, uniform_values: &[f64]) -> FieldFacts {
    FieldFacts {
        is_raw: module.distance.has_raw_fields(),
        has_estimated_slopes: module.settings.slope_over_estimate.is_some(),
        max_slope: module.settings.max_slope() as f32,
        has_loose_slopes: module.settings.has_loose_slopes,
        bounds: *module.settings.clip_bounds(),
        material: module
            .surface
            .is_none()
            .then(|| default_material(module, uniform_values)),
    }
}

/// Returns the default material. It applies to everything if a module has no surface program.
pub fn default_material(module: &Module, uniform_values: &[f64]) -> Surface {
    let m = module
        .settings
        .material
        .map(|setting| setting.value(uniform_values) as f32);
    Surface {
        albedo: [m[0], m[1], m[2]],
        roughness: m[3],
        emission: [m[4], m[5], m[6]],
        metallic: m[7],
        bump: [0.0; 3],
        id: module.settings.material_id as f32,
    }
}

/// Returns a finite box for bounds that may be infinite or empty; finite bounds themselves.
pub(crate) fn finite_bounds(bounds: &Bounds) -> Bounds {
    FramingTarget::from_bounds(bounds).shown
}

/// Fits a view to a box: the whole box is in the image, seen in the direction and with the lens of the given
/// view. `aspect` is width / height. Of infinite boxes the finite part is shown. A 2-D shape is seen face on.
pub fn fit(view: View, bounds: &Bounds, aspect: f64, is_2d: bool) -> View {
    let target = FramingTarget::from_bounds(bounds);
    if is_2d {
        plane_view(&target, aspect)
    } else {
        framed_view(&view, &Outline::from_bounds(&target.shown), aspect)
    }
}

/// Checks all conditions of the scene.
pub fn check(settings: &Settings, uniform_values: &[f64]) -> Result<(), SettingsError> {
    let mut failures = settings.checks.iter();
    match failures.find_map(|check| check.failure(uniform_values)) {
        Some(message) => Err(SettingsError::Check(message)),
        None => Ok(()),
    }
}

fn camera<'a>(
    settings: &'a Settings,
    name: Option<&str>,
) -> Result<Option<&'a scene::Camera>, SettingsError> {
    let Some(name) = name else {
        return Ok(settings.cameras.first());
    };
    if let Some(camera) = settings.cameras.iter().find(|camera| camera.name == name) {
        return Ok(Some(camera));
    }
    let known: Vec<String> = settings
        .cameras
        .iter()
        .filter(|camera| !camera.name.is_empty())
        .map(|camera| camera.name.clone())
        .collect();
    let near = known
        .iter()
        .map(|other| (strsim::damerau_levenshtein(name, other), other))
        .filter(|(distance, other)| *distance <= 1 + other.chars().count() / 3)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, other)| other.clone());
    Err(SettingsError::NoCamera {
        name: name.to_owned(),
        known,
        near,
    })
}

/// Returns the distance of a camera from its target; `None` for an automatic camera.
fn camera_target_distance(camera: &scene::Camera, uniform_values: &[f64]) -> Option<f64> {
    let [from, look] = [camera.from, camera.look].map(|p| p.map(|v| v.value(uniform_values)));
    let distance = DVec3::from(from).distance(look.into());
    (!camera.auto_framed && distance.is_finite()).then_some(distance)
}

fn view(
    module: &Module,
    (camera, changes): (Option<&scene::Camera>, &CameraChanges),
    read: &Reader<'_>,
    target: &FramingTarget,
    size: [u32; 2],
) -> Result<View, SettingsError> {
    let settings = &module.settings;
    let aspect = f64::from(size[0]) / f64::from(size[1]);
    let placement = CameraPlacement {
        field: &module.distance,
        subject: settings.subject.as_ref(),
        is_complete: settings.bounds.is_finite(),
        shown: &target.shown,
        aspect,
    };
    let default_camera;
    let camera = match camera {
        Some(camera) => camera,
        None => {
            default_camera = scene::Camera::open(settings.z_up).map(SettingValue::Constant);
            &default_camera
        }
    };
    let pose = CameraPose::read(camera, read)?;
    if settings.is_2d {
        if changes.leaves_plane() {
            return Err(SettingsError::LeavesPlane);
        }
        // A 2-D shape is seen face on; a camera only selects the visible part.
        let own = match pose.lens {
            ResolvedLens::Orthographic(height) if !pose.is_framed && !changes.is_fitted => {
                View::plane([pose.look[0], pose.look[1]], height)
            }
            _ => plane_view(&target.with_edges(&module.distance), aspect),
        };
        if changes.is_fitted {
            return Ok(own);
        }
        let [x, y, _] = changes.look.unwrap_or(own.look);
        return Ok(match changes.checked_lens()?.unwrap_or(own.lens) {
            ResolvedLens::Orthographic(height) => View::plane([x, y], height),
            ResolvedLens::Perspective(_) => own,
        });
    }
    let world_up = if settings.z_up { DVec3::Z } else { DVec3::Y };
    let pose = pose.changed(changes, target.shown.centre(), world_up)?;
    let requested = View {
        from: pose.from,
        look: pose.look,
        up: pose.up,
        lens: pose.lens,
    };
    if !pose.is_framed && pose.from == pose.look {
        return Err(SettingsError::NoDirection(camera.name.clone()));
    }
    if !pose.is_framed {
        return Ok(requested);
    }
    let framed = if changes.fixes_direction() {
        placement.framed(&requested)
    } else {
        placement.find(&requested)
    };
    Ok(match changes.lens {
        Some(lens @ ResolvedLens::Orthographic(_)) if !changes.is_fitted => View { lens, ..framed },
        _ => framed,
    })
}

fn lighting(settings: &Settings, read: &Reader<'_>) -> Result<Lighting, SettingsError> {
    let sky = &settings.sky;
    let fog = sky
        .fog
        .map(|density| read.number("the fog", density))
        .transpose()?;
    let lights = settings
        .lights
        .iter()
        .map(|scene_light| light(scene_light, read))
        .collect::<Result<_, _>>()?;
    Ok(Lighting {
        lights,
        sky_top: read.triple("the sky's color", sky.top)?,
        sky_horizon: read.triple("the sky's color at the horizon", sky.horizon)?,
        sky_ground: read.triple("the sky's color below", sky.ground)?,
        up: if settings.z_up {
            [0.0, 0.0, 1.0]
        } else {
            [0.0, 1.0, 0.0]
        },
        ambient: read.number("the ambient light", sky.ambient)?,
        fog: fog.filter(|&density| density > 0.0),
    })
}

fn light(scene_light: &scene::Light, read: &Reader<'_>) -> Result<ResolvedLight, SettingsError> {
    let source = match scene_light.source {
        scene::LightSource::Directional(direction) => {
            LightEmitter::Directional(read.triple("the direction of a light", direction)?)
        }
        scene::LightSource::Point(place) => {
            LightEmitter::Point(read.triple("the place of a light", place)?)
        }
    };
    let intensity = read.number("the intensity of a light", scene_light.intensity)?;
    let size = |size: SettingValue| read.number("the size of a light", size);
    let shadow = match scene_light.shadow {
        scene::Shadow::None => ResolvedShadow::None,
        scene::Shadow::Hard => ResolvedShadow::Hard,
        scene::Shadow::Plain(setting) => ResolvedShadow::Plain(size(setting)?),
        scene::Shadow::Soft(setting) => ResolvedShadow::Soft(size(setting)?),
        scene::Shadow::Sized(setting) => ResolvedShadow::Sized(size(setting)?),
    };
    let color = read.triple("the color of a light", scene_light.color)?;
    Ok(ResolvedLight {
        source,
        color: color.map(|channel| channel * intensity),
        shadow,
    })
}

/// Reads numbers that may depend on parameters, and refuses those that are not finite.
struct Reader<'a> {
    uniform_values: &'a [f64],
}

impl Reader<'_> {
    fn number(&self, what: &str, setting: SettingValue) -> Result<f64, SettingsError> {
        let value = setting.value(self.uniform_values);
        if value.is_finite() {
            return Ok(value);
        }
        Err(SettingsError::NotFinite {
            what: what.to_owned(),
            value,
        })
    }
    fn triple(&self, what: &str, triple: Triple) -> Result<[f64; 3], SettingsError> {
        let [x, y, z] = triple;
        Ok([
            self.number(what, x)?,
            self.number(what, y)?,
            self.number(what, z)?,
        ])
    }
}

fn size([width, height]: [u32; 2]) -> Result<[u32; 2], SettingsError> {
    let size = [
        within("the width of the picture", width, MAX_SIDE_PIXELS)?,
        within("the height of the picture", height, MAX_SIDE_PIXELS)?,
    ];
    let pixels = u64::from(width) * u64::from(height);
    if pixels > MAX_PIXELS {
        return Err(SettingsError::OutOfRange {
            what: "the number of pixels".to_owned(),
            value: pixels as f64,
            allowed: format!("at most {MAX_PIXELS}"),
        });
    }
    Ok(size)
}

fn within(what: &str, value: u32, max: u32) -> Result<u32, SettingsError> {
    if (1..=max).contains(&value) {
        return Ok(value);
    }
    let allowed = format!("1 to {max}");
    Err(SettingsError::OutOfRange {
        what: what.to_owned(),
        value: value.into(),
        allowed,
    })
}

fn positive(what: &str, value: f64) -> Result<f64, SettingsError> {
    finite_if(value > 0.0, what, value, "more than 0")
}

fn not_negative(what: &str, value: f64) -> Result<f64, SettingsError> {
    finite_if(value >= 0.0, what, value, "0 or more")
}

/// Returns a number that is finite and allowed; `allowed` describes the range.
fn finite_if(
    is_allowed: bool,
    what: &str,
    value: f64,
    allowed: &str,
) -> Result<f64, SettingsError> {
    if is_allowed && value.is_finite() {
        return Ok(value);
    }
    Err(SettingsError::OutOfRange {
        what: what.to_owned(),
        value,
        allowed: allowed.to_owned(),
    })
}
