//! What a compiled scene says besides its programs: parameters, cameras, lights, sky, and how it is
//! drawn. Numbers that follow the parameters are named by the uniform program's results.
//!
//! Cameras, lights and the like are the same while a scene is being compiled, when their numbers are
//! expressions; so they are generic over what a number is, and `map` leads from one to the other.

use crate::bounds::Bounds;
use crate::outline::Outline;
use serde::{Deserialize, Serialize};

/// A number of the settings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Setting {
    /// It is always this.
    Constant(f64),
    /// It is this result of the uniform program.
    Uniform(u32),
}

impl Setting {
    /// Its value, given the results of the uniform program.
    pub fn value(self, outputs: &[f64]) -> f64 {
        match self {
            Setting::Constant(v) => v,
            Setting::Uniform(output) => outputs[output as usize],
        }
    }
}

/// Three numbers.
pub type Triple = [Setting; 3];

/// All settings of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The parameters, in the order of the uniform program's inputs.
    pub params: Vec<Param>,
    /// Conditions on the numbers.
    pub checks: Vec<Check>,
    /// The cameras; at least one.
    pub cameras: Vec<Camera>,
    /// The lights.
    pub lights: Vec<Light>,
    /// The sky.
    pub sky: Sky,
    /// How it is drawn.
    pub render: Render,
    /// How it moves.
    pub animation: Option<Animation>,
    /// Whether it is a figure in the plane.
    pub plane: bool,
    /// Whether z points up.
    pub z_up: bool,
    /// A box around the solid at the present parameters, at time 0.
    pub bounds: Bounds,
    /// The subject of open cameras, at the parameters that the scene was compiled with: all of the solid
    /// that has an end. None where no camera needs it, or nothing has an end.
    pub subject: Option<Outline>,
    /// A box around the solid for all parameters and times.
    pub reach: Bounds,
    /// A box around the solid that was found for some values of the parameters.
    pub found: FoundBounds,
    /// The time of the present values.
    pub time: f64,
    /// The material of everything: albedo, roughness, emission, metallic; used where there is no
    /// program of surfaces, and for what that program leaves unpainted.
    pub material: [Setting; 8],
    /// The number of that material.
    pub material_id: u32,
    /// The names of the materials, by number.
    pub materials: Vec<String>,
    /// The names of the outputs.
    pub parts: Vec<String>,
}

/// A box that holds for some values of the parameters and one time. A parameter that shapes the solid
/// leaves no box that holds for all its values, but there is one for each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundBounds {
    /// The box.
    pub bounds: Bounds,
    /// The numbers of all parameters, in their order.
    pub params: Vec<f64>,
    /// The time.
    pub time: f64,
}

impl Settings {
    /// The numbers of all parameters, in the order of the uniform program's inputs.
    pub fn param_numbers(&self) -> Vec<f64> {
        let numbers = self.params.iter().flat_map(|param| &param.value);
        numbers.copied().collect()
    }
    /// A box around the solid at the present values: what rays may be cut to.
    pub fn space(&self) -> &Bounds {
        let found = &self.found;
        if found.time == self.time && found.params == self.param_numbers() {
            &found.bounds
        } else {
            &self.reach
        }
    }
}

/// A parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Param {
    /// Its name.
    pub name: String,
    /// What it is for.
    pub doc: String,
    /// What kind of value it takes.
    pub kind: ParamKind,
    /// The value it has: one number, or as many as its kind says.
    pub value: Vec<f64>,
    /// The value in the text.
    pub default: Vec<f64>,
    /// The smallest and the largest value allowed.
    pub range: Option<(f64, f64)>,
    /// Whether the largest value itself is allowed.
    pub inclusive: bool,
    /// The distance between two values of a slider.
    pub step: Option<f64>,
    /// Whether it decides structure: then a change needs the text again.
    pub structural: bool,
}

/// What a parameter is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ParamKind {
    /// A number.
    Float,
    /// A whole number.
    Int,
    /// Yes or no, as 1 or 0.
    Bool,
    /// A length in scene units.
    Length,
    /// An angle in radians.
    Angle,
    /// Seconds.
    Time,
    /// A colour, linear.
    Color,
    /// Two numbers.
    Vec2,
    /// Three numbers.
    Vec3,
}

/// A condition on a number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// It must not be below zero.
    pub value: Setting,
    /// Whether zero is forbidden too.
    pub strict: bool,
    /// What is wrong otherwise.
    pub message: String,
}

/// A camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera<N = Setting> {
    /// Its name; empty if it has none.
    pub name: String,
    /// Where it is.
    pub from: [N; 3],
    /// What it looks at.
    pub look: [N; 3],
    /// Which way is up.
    pub up: [N; 3],
    /// How wide it sees.
    pub lens: Lens<N>,
    /// Whether the scene says no place for it: it is to be moved so that it frames the bounds.
    pub automatic: bool,
}

impl Camera<f64> {
    /// The camera of a scene that says nothing of it, before it is moved.
    pub fn open(z_up: bool) -> Self {
        let (from, up) = match z_up {
            true => ([3.0, -4.0, 2.5], [0.0, 0.0, 1.0]),
            false => ([3.0, 2.5, 4.0], [0.0, 1.0, 0.0]),
        };
        Self {
            name: String::new(),
            from,
            look: [0.0; 3],
            up,
            lens: Lens::Perspective(35.0_f64.to_radians()),
            automatic: true,
        }
    }
}

impl<N: Copy> Camera<N> {
    /// The same with other numbers.
    pub fn map<M>(&self, mut number: impl FnMut(N) -> M) -> Camera<M> {
        Camera {
            name: self.name.clone(),
            from: self.from.map(&mut number),
            look: self.look.map(&mut number),
            up: self.up.map(&mut number),
            lens: match self.lens {
                Lens::Perspective(fov) => Lens::Perspective(number(fov)),
                Lens::Orthographic(height) => Lens::Orthographic(number(height)),
            },
            automatic: self.automatic,
        }
    }
}

/// How wide a camera sees.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Lens<N = Setting> {
    /// With this vertical field of view in radians.
    Perspective(N),
    /// Along parallel rays, with this much of the scene from the lower to the upper edge.
    Orthographic(N),
}

/// A light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light<N = Setting> {
    /// Its name; empty if it has none.
    pub name: String,
    /// Where its light comes from.
    pub source: LightSource<N>,
    /// Linear red, green, blue.
    pub color: [N; 3],
    /// A factor on the colour.
    pub intensity: N,
    /// Its shadow.
    pub shadow: Shadow<N>,
}

impl<N: Copy> Light<N> {
    /// The same with other numbers.
    pub fn map<M>(&self, mut number: impl FnMut(N) -> M) -> Light<M> {
        Light {
            name: self.name.clone(),
            source: match self.source {
                LightSource::Directional(v) => LightSource::Directional(v.map(&mut number)),
                LightSource::Point(v) => LightSource::Point(v.map(&mut number)),
            },
            color: self.color.map(&mut number),
            intensity: number(self.intensity),
            shadow: match self.shadow {
                Shadow::None => Shadow::None,
                Shadow::Hard => Shadow::Hard,
                Shadow::Plain(size) => Shadow::Plain(number(size)),
                Shadow::Soft(size) => Shadow::Soft(number(size)),
                Shadow::Sized(size) => Shadow::Sized(number(size)),
            },
        }
    }
}

/// Where light comes from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum LightSource<N = Setting> {
    /// From far away, out of this direction (towards the light).
    Directional([N; 3]),
    /// From a point; the intensity is what arrives at a distance of one unit.
    Point([N; 3]),
}

/// How a light's shadow is drawn. The number is the angular radius of the light as a ratio (0.03 is
/// wide), or the size of a sized one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Shadow<N = Setting> {
    /// It casts none.
    None,
    /// With a sharp edge.
    Hard,
    /// A penumbra from the nearest of the points that the ray stepped on (the plain form).
    Plain(N),
    /// A penumbra from the nearest point of the ray, estimated between steps (the improved form).
    Soft(N),
    /// A penumbra on both sides of the edge: of what is hidden from the centre, a part sees the rim.
    Sized(N),
}

/// The sky.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sky<N = Setting> {
    /// The colour straight up.
    pub top: [N; 3],
    /// The colour at the horizon.
    pub horizon: [N; 3],
    /// The colour straight down.
    pub ground: [N; 3],
    /// A factor on the light that comes from the sky.
    pub ambient: N,
    /// How much of a surface the air hides per unit of distance.
    pub fog: Option<N>,
}

impl<N: Copy> Sky<N> {
    /// The same with other numbers.
    pub fn map<M>(&self, mut number: impl FnMut(N) -> M) -> Sky<M> {
        Sky {
            top: self.top.map(&mut number),
            horizon: self.horizon.map(&mut number),
            ground: self.ground.map(&mut number),
            ambient: number(self.ambient),
            fog: self.fog.map(&mut number),
        }
    }
}

/// How a scene is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Render<N = Setting> {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Samples per pixel along each side.
    pub aa: u32,
    /// The most steps of a ray.
    pub steps: u32,
    /// How far a ray goes, in scene units; `None` lets the bounds decide.
    pub far: Option<f64>,
    /// How occlusion darkens crevices.
    pub occlusion: Occlusion,
    /// How far occlusion reaches, in scene units; `None` lets the bounds decide.
    pub occlusion_reach: Option<f64>,
    /// How normals are found.
    pub normals: Normals,
    /// How light becomes a colour on the screen.
    pub tonemap: Tonemap,
    /// A factor on all light, before tone mapping.
    pub exposure: N,
}

impl<N: Copy> Render<N> {
    /// The same with other numbers.
    pub fn map<M>(&self, mut number: impl FnMut(N) -> M) -> Render<M> {
        Render {
            size: self.size,
            aa: self.aa,
            steps: self.steps,
            far: self.far,
            occlusion: self.occlusion,
            occlusion_reach: self.occlusion_reach,
            normals: self.normals,
            tonemap: self.tonemap,
            exposure: number(self.exposure),
        }
    }
}

/// Ambient occlusion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Occlusion {
    /// None.
    #[default]
    Off,
    /// Five samples along the normal.
    FiveTap,
    /// This many samples over the hemisphere.
    Multi(u32),
}

impl Occlusion {
    /// How many samples it takes.
    pub fn taps(self) -> u32 {
        match self {
            Self::Off => 0,
            Self::FiveTap => 5,
            Self::Multi(count) => count,
        }
    }
}

/// How normals are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Normals {
    /// The gradient of the formula, by dual numbers.
    #[default]
    Exact,
    /// Differences between the point and one ahead of it along each axis.
    Forward,
    /// Differences between two points on both sides, along each axis.
    Central,
    /// Differences between the point and one behind it along each axis.
    Reverse,
    /// Differences between the corners of a tetrahedron.
    Tetrahedron,
    /// Central differences as wide as a pixel.
    Wide,
}

/// Tone mapping.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Tonemap {
    /// Values are cut at 1.
    #[default]
    None,
    /// `x / (1 + x)` on the luminance.
    Reinhard,
    /// A filmic curve.
    Aces,
}

/// An animation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Animation {
    /// Its length in seconds.
    pub duration: f64,
    /// Frames per second.
    pub fps: f64,
    /// Whether it starts again at its end.
    pub repeats: bool,
}
