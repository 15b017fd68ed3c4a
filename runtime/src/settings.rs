//! From what a scene says about its picture to plain numbers: [`resolve`] takes the settings of a
//! module and the results of its uniform program, lets a command line or a window override some of
//! them, and gives [`RenderSettings`].
//!
//! Here cameras are found by name, automatic ones are placed so that they frame the bounds, what
//! the scene left open (how far rays go, how far occlusion reaches) follows from the bounds, and
//! the scene's own conditions on its numbers are checked.

mod framing;
mod standpoint;

use crate::frame::{
    CellUse, FieldFacts, Lens, Light, Lighting, Mode, Normals, Occlusion, RenderSettings, Shadow,
    Source, Surface, Tonemap, View,
};
use framing::{Target, face_on, framed};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::outline::Outline;
use sdfc_vm::program::Module;
use sdfc_vm::settings::{self as scene, Setting, Settings, Triple};
use standpoint::Standpoint;

/// The largest width or height of a picture.
pub const LARGEST_SIDE: u32 = 16_384;
/// The most pixels of a picture.
pub const MOST_PIXELS: u64 = 1 << 26;
/// The most samples per pixel along each side.
pub const MOST_SAMPLES: u32 = 16;

/// What is asked for in place of what the scene says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overrides {
    /// Width and height in pixels.
    pub size: Option<[u32; 2]>,
    /// Samples per pixel along each side.
    pub aa: Option<u32>,
    /// The name of the camera; the scene's first one otherwise.
    pub camera: Option<String>,
    /// Where the picture is taken from, whatever cameras the scene has.
    pub view: Option<View>,
    /// What is shown; no scene says this.
    pub mode: Mode,
    /// The most steps of a ray.
    pub steps: Option<u32>,
    /// How far a ray goes.
    pub far: Option<f64>,
    /// How normals are found.
    pub normals: Option<Normals>,
    /// Ambient occlusion.
    pub occlusion: Option<Occlusion>,
    /// How light becomes a colour.
    pub tonemap: Option<Tonemap>,
    /// A factor on all light.
    pub exposure: Option<f64>,
    /// Whether space is cut into cells.
    pub cells: CellUse,
}

/// Why there can be no picture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// The scene's own condition on its numbers is violated.
    #[error("{0}")]
    Check(String),
    /// There is no camera of that name.
    #[error("{}", no_camera(name, known, near.as_deref()))]
    NoCamera {
        /// The name that was asked for.
        name: String,
        /// The names there are.
        known: Vec<String>,
        /// The one that was probably meant.
        near: Option<String>,
    },
    /// A number of the settings is not finite.
    #[error("{what} is {value}, a finite number is needed")]
    NotFinite {
        /// Which number.
        what: String,
        /// What it is.
        value: f64,
    },
    /// A number of the settings is out of its range.
    #[error("{what} is {value}, {allowed} is allowed")]
    OutOfRange {
        /// Which number.
        what: String,
        /// What it is.
        value: f64,
        /// What it may be.
        allowed: String,
    },
    /// A camera looks at the place where it is.
    #[error("the camera{} is at the point it looks at", named(.0))]
    NoDirection(String),
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

/// The settings of a module's picture, with the numbers that follow from the present parameters
/// and time.
pub fn resolve(
    module: &Module,
    outputs: &[f64],
    overrides: &Overrides,
) -> Result<RenderSettings, SettingsError> {
    let settings = &module.settings;
    check(settings, outputs)?;
    let read = Reader { outputs };
    let render = &settings.render;
    let size = size(overrides.size.unwrap_or(render.size))?;
    let aa = within(
        "the samples per side of a pixel",
        overrides.aa.unwrap_or(render.aa),
        MOST_SAMPLES,
    )?;
    let steps = within(
        "the most steps of a ray",
        overrides.steps.unwrap_or(render.steps),
        u32::MAX,
    )?;
    let camera = camera(settings, overrides.camera.as_deref())?;
    let way = camera.and_then(|camera| way_of(camera, outputs));
    let target = Target::of(&settings.bounds).sized(settings.subject.as_ref(), way);
    let view = match overrides.view {
        Some(view) => view,
        None => view(module, camera, &read, &target, size)?,
    };
    let far = overrides
        .far
        .or(render.far)
        .unwrap_or_else(|| target.lasting(&settings.reach).far(&view));
    let exposure = match overrides.exposure {
        Some(exposure) => exposure,
        None => read.number("the exposure", render.exposure)?,
    };
    Ok(RenderSettings {
        size,
        aa,
        steps,
        far: positive("how far a ray goes", far)?,
        cone: RenderSettings::CONE,
        relaxation: RenderSettings::RELAXATION,
        cells: overrides.cells,
        mode: overrides.mode,
        normals: overrides.normals.unwrap_or_else(|| normals(render.normals)),
        occlusion: overrides
            .occlusion
            .unwrap_or_else(|| occlusion(render.occlusion)),
        occlusion_reach: render
            .occlusion_reach
            .unwrap_or_else(|| target.occlusion_reach()),
        tonemap: overrides.tonemap.unwrap_or_else(|| tonemap(render.tonemap)),
        exposure,
        view,
        lighting: lighting(settings, &read)?,
        plane: settings.plane,
    })
}

/// What is known of a module's field besides its values.
pub fn facts(module: &Module, outputs: &[f64]) -> FieldFacts {
    FieldFacts {
        raw: module.distance.is_raw(),
        checked: module.distance.is_scaled(),
        bounds: *module.settings.space(),
        material: module.surface.is_none().then(|| unpainted(module, outputs)),
    }
}

/// The material of what nothing painted: of everything, where a module has no program of surfaces.
pub fn unpainted(module: &Module, outputs: &[f64]) -> Surface {
    let m = module
        .settings
        .material
        .map(|setting| setting.value(outputs) as f32);
    Surface {
        albedo: [m[0], m[1], m[2]],
        roughness: m[3],
        emission: [m[4], m[5], m[6]],
        metallic: m[7],
        bump: [0.0; 3],
        id: module.settings.material_id as f32,
    }
}

/// The box that a picture of these bounds is about: they themselves where they are finite.
pub(crate) fn shown(bounds: &Bounds) -> Bounds {
    Target::of(bounds).shown
}

/// A view that has all of a box in the picture, which is so many times as wide as it is high
/// (`aspect`): in the direction and with the lens of the one given. Of endless boxes, what is finite
/// is shown. A plane figure is seen face on.
pub fn fit(view: View, bounds: &Bounds, aspect: f64, plane: bool) -> View {
    let target = Target::of(bounds);
    if plane {
        face_on(&target, aspect)
    } else {
        framed(&view, &Outline::of_box(&target.shown), aspect)
    }
}

/// Whether all conditions of the scene hold.
pub fn check(settings: &Settings, outputs: &[f64]) -> Result<(), SettingsError> {
    for check in &settings.checks {
        let value = check.value.value(outputs);
        // Written so that what is not a number does not hold.
        let holds = if check.strict {
            value > 0.0
        } else {
            value >= 0.0
        };
        if !holds {
            return Err(SettingsError::Check(check.message.clone()));
        }
    }
    Ok(())
}

fn camera<'a>(
    settings: &'a Settings,
    name: Option<&str>,
) -> Result<Option<&'a scene::Camera>, SettingsError> {
    let Some(name) = name else {
        return Ok(settings.cameras.first());
    };
    if let Some(found) = settings.cameras.iter().find(|camera| camera.name == name) {
        return Ok(Some(found));
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

/// The distance of a camera from what it looks at; none for an open one.
fn way_of(camera: &scene::Camera, outputs: &[f64]) -> Option<f64> {
    let [from, look] = [camera.from, camera.look].map(|p| p.map(|v| v.value(outputs)));
    let squares = (0..3).map(|axis| (from[axis] - look[axis]).powi(2));
    let way = squares.sum::<f64>().sqrt();
    (!camera.automatic && way.is_finite()).then_some(way)
}

fn view(
    module: &Module,
    camera: Option<&scene::Camera>,
    read: &Reader<'_>,
    target: &Target,
    size: [u32; 2],
) -> Result<View, SettingsError> {
    let settings = &module.settings;
    let aspect = f64::from(size[0]) / f64::from(size[1]);
    let standpoint = Standpoint {
        field: &module.distance,
        subject: settings.subject.as_ref(),
        is_whole: settings.bounds.is_finite(),
        shown: &target.shown,
        aspect,
    };
    let open;
    let camera = match camera {
        Some(camera) => camera,
        None => {
            open = scene::Camera::open(settings.z_up).map(Setting::Constant);
            &open
        }
    };
    let of = |what: &str| format!("{what} of the camera{}", named(&camera.name));
    let from = read.triple(&of("the place"), camera.from)?;
    let look = read.triple(&of("the target"), camera.look)?;
    let up = read.triple(&of("the upward direction"), camera.up)?;
    let lens = match camera.lens {
        scene::Lens::Perspective(fov) => {
            let what = of("the field of view");
            let fov = positive(&what, read.number(&what, fov)?)?;
            if fov >= std::f64::consts::PI {
                let allowed = "less than a half turn (3.14 radians)".to_owned();
                return Err(SettingsError::OutOfRange {
                    what,
                    value: fov,
                    allowed,
                });
            }
            Lens::Perspective(fov)
        }
        scene::Lens::Orthographic(height) => {
            let what = of("the height");
            Lens::Orthographic(positive(&what, read.number(&what, height)?)?)
        }
    };
    if settings.plane {
        // A figure in the plane is seen face on; a camera can only choose the part of it.
        return Ok(match lens {
            Lens::Orthographic(height) if !camera.automatic => {
                View::plane([look[0], look[1]], height)
            }
            _ => face_on(target, aspect),
        });
    }
    let view = View {
        from,
        look,
        up,
        lens,
    };
    if camera.automatic {
        return Ok(standpoint.find(&view));
    }
    if from == look {
        return Err(SettingsError::NoDirection(camera.name.clone()));
    }
    Ok(view)
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
        .map(|given| light(given, read))
        .collect::<Result<_, _>>()?;
    Ok(Lighting {
        lights,
        sky_top: read.triple("the sky's colour", sky.top)?,
        sky_horizon: read.triple("the sky's colour at the horizon", sky.horizon)?,
        sky_ground: read.triple("the sky's colour below", sky.ground)?,
        up: if settings.z_up {
            [0.0, 0.0, 1.0]
        } else {
            [0.0, 1.0, 0.0]
        },
        ambient: read.number("the ambient light", sky.ambient)?,
        fog: fog.filter(|&density| density > 0.0),
    })
}

fn light(given: &scene::Light, read: &Reader<'_>) -> Result<Light, SettingsError> {
    let source = match given.source {
        scene::LightSource::Directional(direction) => {
            Source::Directional(read.triple("the direction of a light", direction)?)
        }
        scene::LightSource::Point(place) => {
            Source::Point(read.triple("the place of a light", place)?)
        }
    };
    let intensity = read.number("the intensity of a light", given.intensity)?;
    let size = |size: Setting| read.number("the size of a light", size);
    let shadow = match given.shadow {
        scene::Shadow::None => Shadow::None,
        scene::Shadow::Hard => Shadow::Hard,
        scene::Shadow::Plain(setting) => Shadow::Plain(size(setting)?),
        scene::Shadow::Soft(setting) => Shadow::Improved(size(setting)?),
        scene::Shadow::Sized(setting) => Shadow::Sized(size(setting)?),
    };
    let color = read.triple("the colour of a light", given.color)?;
    Ok(Light {
        source,
        color: color.map(|channel| channel * intensity),
        shadow,
    })
}

/// Reads numbers that may follow the parameters, and refuses those that are none.
struct Reader<'a> {
    outputs: &'a [f64],
}

impl Reader<'_> {
    fn number(&self, what: &str, setting: Setting) -> Result<f64, SettingsError> {
        let value = setting.value(self.outputs);
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
        within("the width of the picture", width, LARGEST_SIDE)?,
        within("the height of the picture", height, LARGEST_SIDE)?,
    ];
    let pixels = u64::from(width) * u64::from(height);
    if pixels > MOST_PIXELS {
        return Err(SettingsError::OutOfRange {
            what: "the number of pixels".to_owned(),
            value: pixels as f64,
            allowed: format!("at most {MOST_PIXELS}"),
        });
    }
    Ok(size)
}

fn within(what: &str, value: u32, most: u32) -> Result<u32, SettingsError> {
    if (1..=most).contains(&value) {
        return Ok(value);
    }
    let allowed = format!("1 to {most}");
    Err(SettingsError::OutOfRange {
        what: what.to_owned(),
        value: value.into(),
        allowed,
    })
}

fn positive(what: &str, value: f64) -> Result<f64, SettingsError> {
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    let allowed = "more than 0".to_owned();
    Err(SettingsError::OutOfRange {
        what: what.to_owned(),
        value,
        allowed,
    })
}

fn normals(normals: scene::Normals) -> Normals {
    match normals {
        scene::Normals::Exact => Normals::Exact,
        scene::Normals::Forward => Normals::Forward,
        scene::Normals::Central => Normals::Central,
        scene::Normals::Reverse => Normals::Reverse,
        scene::Normals::Tetrahedron => Normals::Tetrahedron,
        scene::Normals::Wide => Normals::Wide,
    }
}

fn occlusion(occlusion: scene::Occlusion) -> Occlusion {
    match occlusion {
        scene::Occlusion::Off => Occlusion::Off,
        scene::Occlusion::FiveTap => Occlusion::FiveTap,
        scene::Occlusion::Multi(taps) => Occlusion::Multi(taps),
    }
}

fn tonemap(tonemap: scene::Tonemap) -> Tonemap {
    match tonemap {
        scene::Tonemap::None => Tonemap::None,
        scene::Tonemap::Reinhard => Tonemap::Reinhard,
        scene::Tonemap::Aces => Tonemap::Aces,
    }
}
