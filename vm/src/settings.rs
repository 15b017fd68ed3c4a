//! The data of a compiled scene besides its programs: parameters, cameras, lights, sky, and render
//! settings. Numbers that depend on the parameters refer to results of the uniform program.
//!
//! Cameras, lights and the like have the same structure while a scene is compiled, when their numbers are
//! expressions. So they are generic over the number type, and `map` converts between number types.

use crate::bounds::Bounds;
use crate::outline::Outline;
use serde::{Deserialize, Serialize};

/// A number of the settings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum SettingValue {
    /// A constant, equal for all values of the parameters.
    Constant(f64),
    /// The result of the uniform program with this index.
    Uniform(u32),
}

impl SettingValue {
    /// Returns the value, given the results of the uniform program.
    pub fn value(self, uniform_values: &[f64]) -> f64 {
        match self {
            SettingValue::Constant(v) => v,
            SettingValue::Uniform(output) => uniform_values[output as usize],
        }
    }
}

/// Three numbers: a point, a vector or a linear colour.
pub type Triple = [SettingValue; 3];

/// All settings of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The parameters, in the order of the uniform program's inputs.
    pub params: Vec<Param>,
    /// Conditions on the numbers.
    pub checks: Vec<Check>,
    /// The cameras; at least one.
    pub cameras: Vec<Camera>,
    /// The lights, in the order of the text.
    pub lights: Vec<Light>,
    /// The background, which also lights surfaces.
    pub sky: Sky,
    /// The render settings.
    pub render: Render,
    /// The animation, if there is one.
    pub animation: Option<Animation>,
    /// Set if the scene is a 2-D shape.
    pub is_2d: bool,
    /// Set if the z axis points up.
    pub z_up: bool,
    /// Bounding box of the solid for the parameters at compile time, at time 0.
    pub bounds: Bounds,
    /// The subject of automatically framed cameras, for the parameters at compile time: the bounded parts
    /// of the solid. `None` if no camera needs it, or if nothing is bounded.
    pub subject: Option<Outline>,
    /// Bounding box of the solid for all parameters and times.
    pub bounds_for_all_params: Bounds,
    /// Bounding box of the solid for one assignment of the parameters.
    pub current_bounds: CurrentBounds,
    /// Largest ratio of a field's stated slope to the estimate that it is divided by, since no bound is found. Infinite without
    /// a statement; `None` if nothing is divided by an estimate.
    pub slope_over_estimate: Option<f64>,
    /// Set if no close bound of a field's slope is found. Bounds that the scene states have no influence.
    pub has_loose_slopes: bool,
    /// The time of the current values.
    pub time: f64,
    /// The default material: albedo, roughness, emission, metallic. It applies if there is no surface
    /// program, and to shapes without a material assignment.
    pub material: [SettingValue; 8],
    /// Index of the default material.
    pub material_id: u32,
    /// The names of the materials, by index.
    pub materials: Vec<String>,
    /// The names of the outputs.
    pub parts: Vec<String>,
}

impl Settings {
    /// Returns the bound of the slope of the distance program: 1, or more where a stated slope exceeds an estimate. Infinite
    /// if no bound is known.
    pub fn max_slope(&self) -> f64 {
        self.slope_over_estimate.unwrap_or(1.0).max(1.0)
    }
}

/// Places of the parts of a solid.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Extents {
    /// Box of the solid without its endless parts; `None` if nothing is left, or if no finite box is known.
    pub finite: Option<Bounds>,
    /// Boxes of its finite parts: of the largest ones each, and around the others.
    pub finite_parts: Vec<Bounds>,
    /// The endless parts.
    pub endless: Vec<EndlessPart>,
    /// Region that contains an endless solid, if one is known.
    pub enclosure: Option<Enclosure>,
}

/// Maximum number of half spaces of an enclosure.
pub const MAX_HALF_SPACES: usize = 6;

/// A region that contains a solid: the union of a box and of half spaces.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Enclosure {
    /// The box, perhaps empty, or endless along one axis.
    pub bounds: Bounds,
    /// Planes of the half spaces: the normal of length one, which points out of it, and the distance of the origin.
    pub half_spaces: Vec<[f64; 4]>,
    /// Number of the first half spaces that are solid from their planes on.
    pub exact_half_spaces: usize,
    /// Number of the first half spaces that are solid, but for the part near their planes.
    pub solid_half_spaces: usize,
    /// Depth from which on these are solid.
    pub solid_depth: f64,
}

/// An endless part of a solid, such as a floor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EndlessPart {
    /// Bounding box, infinite on at least one side.
    pub bounds: Bounds,
    /// Plane that its distance is near the origin: the normal, and the distance of the origin.
    pub plane: Option<[f64; 4]>,
}

/// A bounding box for one assignment of the parameters and one time. Where a parameter changes the shape of
/// the solid, no finite box may hold for all its values, but there is one for each value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurrentBounds {
    /// Box of the solid, in scene units; infinite where none is known.
    pub bounds: Bounds,
    /// Places of its parts.
    pub extents: Extents,
    /// The numbers of all parameters, in their order.
    pub params: Vec<f64>,
    /// Time of the picture, in seconds.
    pub time: f64,
}

impl Settings {
    /// Returns the numbers of all parameters, in the order of the uniform program's inputs.
    pub fn param_numbers(&self) -> Vec<f64> {
        let numbers = self.params.iter().flat_map(|param| &param.value);
        numbers.copied().collect()
    }
    /// Returns a bounding box of the solid at the current values, to which rays may be clipped.
    pub fn clip_bounds(&self) -> &Bounds {
        match self.has_current_bounds() {
            true => &self.current_bounds.bounds,
            false => &self.bounds_for_all_params,
        }
    }
    /// Returns the enclosure of the solid at the current values, if it is known.
    pub fn enclosure(&self) -> Option<&Enclosure> {
        let enclosure = self.current_bounds.extents.enclosure.as_ref();
        enclosure.filter(|_| self.has_current_bounds())
    }
    fn has_current_bounds(&self) -> bool {
        let current = &self.current_bounds;
        current.time == self.time && current.params == self.param_numbers()
    }
}

/// A parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Param {
    /// Its name in the text and on the command line.
    pub name: String,
    /// The description of its purpose.
    pub doc: String,
    /// The type of its value.
    pub kind: ParamKind,
    /// The current value: one number, or as many as the type has.
    pub value: Vec<f64>,
    /// The value in the text.
    pub default: Vec<f64>,
    /// The smallest and the largest allowed value.
    pub range: Option<(f64, f64)>,
    /// Set if the largest value itself is allowed.
    pub inclusive: bool,
    /// The distance between two positions of a slider.
    pub step: Option<f64>,
    /// Set if it affects the structure of the scene: a change then requires compiling the text again.
    pub structural: bool,
}

/// The type of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ParamKind {
    /// A number.
    Float,
    /// A whole number.
    Int,
    /// A Boolean, as 1 or 0.
    Bool,
    /// A length in scene units.
    Length,
    /// An angle in radians.
    Angle,
    /// A time in seconds.
    Time,
    /// A linear colour.
    Color,
    /// A vector of two numbers.
    Vec2,
    /// A vector of three numbers.
    Vec3,
}

/// Maximum magnitude of a number of a shape, for which squares stay finite in `f32`. Quotients by zero have it.
pub const MAX_MAGNITUDE: f64 = 1e18;

/// A condition on a number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// The number; it must not be negative.
    pub value: SettingValue,
    /// Set if zero is forbidden too.
    pub strict: bool,
    /// The error message if the condition fails.
    pub message: String,
}

impl Check {
    /// Returns the error message if the condition fails for these values of the uniform program. NaN fails, and so
    /// do numbers as large as a quotient by zero.
    pub fn failure(&self, uniform_values: &[f64]) -> Option<String> {
        let value = self.value.value(uniform_values);
        let holds = if self.strict {
            value > 0.0
        } else {
            value >= 0.0
        };
        if !holds {
            return Some(self.message.clone());
        }
        // Divisors near zero are rounded to `f32`.
        let is_quotient_by_zero = value > MAX_MAGNITUDE * (1.0 - 1e-6);
        is_quotient_by_zero.then(|| format!("{}, and less than {MAX_MAGNITUDE:e}", self.message))
    }
}

/// A camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera<N = SettingValue> {
    /// Its name; empty if it has none.
    pub name: String,
    /// Its position, in world coordinates and scene units.
    pub from: [N; 3],
    /// The point at the centre of its view.
    pub look: [N; 3],
    /// The up direction.
    pub up: [N; 3],
    /// Its field of view.
    pub lens: Lens<N>,
    /// Set if the scene does not specify its position: it is then moved so that it frames the bounds.
    pub auto_framed: bool,
}

impl Camera<f64> {
    /// Returns the camera of a scene that does not define one, before it is moved.
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
            auto_framed: true,
        }
    }
}

impl<N: Copy> Camera<N> {
    /// Returns the camera with converted numbers.
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
            auto_framed: self.auto_framed,
        }
    }
}

/// The field of view of a camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Lens<N = SettingValue> {
    /// The vertical field of view in radians.
    Perspective(N),
    /// Parallel rays, with this height of the view in scene units.
    Orthographic(N),
}

/// A light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light<N = SettingValue> {
    /// Its name; empty if it has none.
    pub name: String,
    /// Its position or direction.
    pub source: LightSource<N>,
    /// Linear red, green, blue.
    pub color: [N; 3],
    /// A factor on the colour.
    pub intensity: N,
    /// Form of its shadow, with the light's size.
    pub shadow: Shadow<N>,
}

impl<N: Copy> Light<N> {
    /// Returns the light with converted numbers.
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

/// The position or direction of a light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum LightSource<N = SettingValue> {
    /// A distant light in this direction (towards the light).
    Directional([N; 3]),
    /// A point light; the intensity is that at a distance of one unit.
    Point([N; 3]),
}

/// The shadow of a light. The number is the angular radius of the light as a ratio (0.03 is wide), or the
/// size of a sized light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Shadow<N = SettingValue> {
    /// No shadow.
    None,
    /// A sharp edge.
    Hard,
    /// A penumbra, found by short strides (the plain form).
    Plain(N),
    /// A penumbra, found by full sphere-tracing strides (the improved form).
    Soft(N),
    /// A penumbra on both sides of the edge: points hidden from the light's centre may still see its rim.
    Sized(N),
}

/// The sky.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sky<N = SettingValue> {
    /// The colour straight up.
    pub top: [N; 3],
    /// The colour at the horizon.
    pub horizon: [N; 3],
    /// The colour straight down.
    pub ground: [N; 3],
    /// A factor on the light that comes from the sky.
    pub ambient: N,
    /// The density of fog per unit of distance.
    pub fog: Option<N>,
}

impl<N: Copy> Sky<N> {
    /// Returns the sky with converted numbers.
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

/// The render settings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Render<N = SettingValue> {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Samples per pixel along each axis.
    pub aa: u32,
    /// Maximum number of steps of a ray.
    pub steps: u32,
    /// Maximum length of a ray, in scene units; `None` derives it from the bounds.
    pub far: Option<f64>,
    /// The method of ambient occlusion.
    pub occlusion: Occlusion,
    /// The radius of occlusion, in scene units; `None` derives it from the bounds.
    pub occlusion_reach: Option<f64>,
    /// The method of computing normals.
    pub normals: Normals,
    /// The mapping from light to screen colours.
    pub tonemap: Tonemap,
    /// A factor on all light, before tone mapping.
    pub exposure: N,
}

impl<N: Copy> Render<N> {
    /// Returns the render settings with converted numbers.
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

/// The method of ambient occlusion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Occlusion {
    /// No occlusion.
    #[default]
    Off,
    /// Five samples along the normal.
    FiveTap,
    /// This many samples over the hemisphere.
    Multi(u32),
}

impl Occlusion {
    /// Returns the number of samples.
    pub fn taps(self) -> u32 {
        match self {
            Self::Off => 0,
            Self::FiveTap => 5,
            Self::Multi(count) => count,
        }
    }
}

/// The method of computing normals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Normals {
    /// The gradient of the formula, by dual numbers.
    #[default]
    Exact,
    /// Differences between the point and one in the positive direction along each axis.
    Forward,
    /// Differences between two points on both sides, along each axis.
    Central,
    /// Differences between the point and one in the negative direction along each axis.
    Reverse,
    /// Differences between the corners of a tetrahedron.
    Tetrahedron,
    /// Central differences over the width of a pixel.
    Wide,
}

/// The mapping from light to screen colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Tonemap {
    /// No mapping; values are clipped at 1.
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
    /// Set if it repeats at its end.
    pub repeats: bool,
}
