//! What a picture needs, as far as it decides which code a kernel has.
//!
//! Numbers are not features: they live in uniforms, so that moving a light or the camera compiles
//! nothing.

pub use sdfc_vm::settings::{Normals, Occlusion};

/// What a picture shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Mode {
    /// The lit scene.
    #[default]
    Shaded,
    /// The share of light that surfaces reflect.
    Albedo,
    /// The direction surfaces face: red, green and blue for x, y and z.
    Normal,
    /// The distance along the ray, near white, far black.
    Depth,
    /// How often the field was evaluated along the ray, as a heat map.
    Steps,
    /// The field on a plane through the view's centre, with lines of equal distance.
    Distance,
    /// A colour for each material.
    Id,
    /// White where there is a surface, black elsewhere.
    Mask,
    /// Dark lines where depth, direction or material jump.
    Edges,
}

/// The form of a light's shadow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Shadow {
    /// It casts none.
    #[default]
    None = 0,
    /// With a sharp edge.
    Hard = 1,
    /// A penumbra from the nearest of the points that the ray stepped on.
    Plain = 2,
    /// A penumbra from the nearest point of the ray, estimated between steps.
    Improved = 3,
    /// A penumbra that also darkens from inside the shape.
    Sized = 4,
}

/// What a picture needs.
///
/// A kernel is made for features and has nothing else, or it is a *general* one
/// ([`Features::general`]): then lights and the forms of their shadows, occlusion, fog, materials and
/// the way of taking differences are no features, but read from buffers when it runs. There are so few
/// of these that all of them can be made beforehand.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct Features {
    /// What it shows.
    pub mode: Mode,
    /// The shadow of each light, in the order of the lights' buffer.
    pub lights: Vec<Shadow>,
    /// Ambient occlusion.
    pub occlusion: Occlusion,
    /// How normals are found.
    pub normals: Normals,
    /// Whether the scene has materials that have to be asked for at each point; otherwise the
    /// only one is in the uniform.
    pub materials: bool,
    /// Whether the air hides what is far.
    pub fog: bool,
    /// Whether the scene is a plane figure, seen face on.
    pub plane: bool,
    /// Whether kernels are made for any lights, occlusion, fog, materials and differences.
    pub general: bool,
}

/// The most lights that general kernels have room for.
pub const MOST_LIGHTS: usize = 256;

impl Features {
    /// Those of the general kernels that draw such a picture: what they read from buffers is the same
    /// for all pictures here.
    pub fn generally(&self) -> Self {
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
            plane: self.plane,
            general: true,
        }
    }
}
