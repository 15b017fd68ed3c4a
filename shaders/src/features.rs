//! The features of a picture that decide the code of a kernel.
//!
//! Numbers are not features: they are uniforms, so that moving a light or the camera compiles nothing.

pub use sdfc_vm::settings::{Normals, Occlusion};

/// Content of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Mode {
    /// The lit scene.
    #[default]
    Shaded,
    /// The fraction of light that surfaces reflect.
    Albedo,
    /// Surface normals: red, green and blue for x, y and z.
    Normal,
    /// The distance along the ray, white near and black far.
    Depth,
    /// The number of evaluations along the ray, as a heat map.
    Steps,
    /// The field on a plane through the view's centre, with lines of equal distance.
    Distance,
    /// A colour for each material.
    Id,
    /// White where there is a surface, black elsewhere.
    Mask,
    /// Dark lines where depth, normal or material are discontinuous.
    Edges,
}

/// Form of a light's shadow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ShadowForm {
    /// No shadow.
    #[default]
    None = 0,
    /// A sharp edge.
    Hard = 1,
    /// A penumbra, found by short strides: at most about 0.4 of the distance along the ray.
    Plain = 2,
    /// A penumbra, found by full sphere-tracing strides.
    Soft = 3,
    /// A penumbra that also darkens from inside the shape.
    Sized = 4,
}

/// The features of a picture.
///
/// A kernel is either made for these alone, or *generic* ([`Features::generic`]). A generic kernel reads lights,
/// shadows, occlusion, fog, materials, half spaces and the scheme of differences from buffers. There are so few generic
/// kernels that all of them can be compiled in advance.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct Features {
    /// Content of the picture.
    pub mode: Mode,
    /// The shadow of each light, in the order of the lights' buffer.
    pub lights: Vec<ShadowForm>,
    /// Method for ambient occlusion.
    pub occlusion: Occlusion,
    /// Method for normals.
    pub normals: Normals,
    /// True if the material is evaluated at each point; otherwise the only one is in the uniform.
    pub materials: bool,
    /// True with fog.
    pub fog: bool,
    /// True if half spaces contain an endless scene.
    pub has_half_spaces: bool,
    /// True if samples on each step prove that there is no surface.
    pub proves_steps: bool,
    /// True if the scene is a 2-D shape, seen face on.
    pub is_2d: bool,
    /// True for kernels that handle any lights, occlusion, fog, materials, half spaces and differences.
    pub generic: bool,
}

/// Maximum number of lights of generic kernels.
pub const MAX_GENERIC_LIGHTS: usize = 256;

impl Features {
    /// Returns the features of the generic kernels that draw such a picture. Numbers that these read from
    /// buffers are the same here for all pictures.
    pub fn for_generic_kernels(&self) -> Self {
        let normals = match self.normals {
            Normals::Exact => Normals::Exact,
            _ => Normals::Central,
        };
        Self {
            mode: self.mode,
            lights: Vec::new(),
            occlusion: Occlusion::Off,
            normals,
            materials: true,
            fog: false,
            has_half_spaces: false,
            proves_steps: false,
            is_2d: self.is_2d,
            generic: true,
        }
    }
}
