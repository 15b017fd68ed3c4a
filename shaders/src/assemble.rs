//! Kernels, put together from what a picture needs.
//!
//! A picture is made in [`stages`], each a kernel over the rays of a tile with one place where the
//! scene is evaluated. [`kernel`] gives a stage's text: the declarations, constants and recorded
//! functions that the stage's file mentions, the scene's functions, and the file itself, whose
//! `#if` lines choose what the [`Features`] ask for. What is not mentioned is not in the text.
//!
//! # How a driver runs them
//!
//! All buffers are in group 0; a scene may bind what it needs in group 0 from slot
//! [`FIRST_SCENE_SLOT`] on, or in a group of its own. For each tile and each pass over subpixels
//! the stages run in order. All kernels have workgroups of 64 in a row and want a line of
//! [`invocations`]; a line too long for one axis goes on along y.
//!
//! The stages `beam`, `march`, `shadow` and `occlusion` are resumable ([`Stage::is_resumable`]): one
//! dispatch evaluates the scene a bounded number of times per ray and lists the rays that are not
//! done in the queue. Before each of their dispatches four words are written to its front
//! ([`queue_front`]). While its first word then says that rays are left, the stage runs again over a
//! line of so many, the other half of the queue being read.
//!
//! The picture is then in [`Slot::Colors`], as light; making bytes of it for a screen is the
//! driver's, by the functions of [`crate::tone`].
//!
//! Kernels of features that are *general* ([`Features::general`]) draw any picture of a mode. They read
//! the numbers that the last fields of the [`Frame`] hold, and how many lights there are from the lights
//! themselves, which one of them binds as storage: what a loop's end depends on is never a uniform,
//! or software Vulkan would compile the kernel again for each of its values.
//!
//! The `edges` stage compares neighbours within a tile: tiles for it overlap by one pixel.

use crate::features::{Features, MOST_LIGHTS, Mode, Normals, Occlusion, Shadow};
use crate::layout::{self, Beam, Frame, Light, OcclusionRay, Ray, ShadowRay, Surface};
use crate::{beam, claim, functions, marching, normals, shadow};
use sdfc_vm::prelude;
use std::collections::BTreeSet;
use std::fmt::Write;

/// The first slot of group 0 that is free for the scene's own buffers.
pub const FIRST_SCENE_SLOT: u32 = 16;

/// A step on the way to a picture; each has a file in `kernels`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Stage {
    /// Finds how far the rays of a block of pixels can go together.
    Beam,
    /// Finds where rays end.
    March,
    /// Makes that exact.
    Polish,
    /// Finds the direction of surfaces.
    Normal,
    /// Asks what they are made of.
    Surface,
    /// Finds what lies between them and the lights.
    Shadow,
    /// Finds what hides the sky.
    Occlusion,
    /// Adds up the light.
    Shade,
    /// Shows something other than light.
    View,
    /// Draws lines where neighbours do not belong together.
    Edges,
    /// Shows the field on a plane; takes the place of all the above.
    Plane,
}

/// A function of the scene that a stage calls.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum SceneFunction {
    /// `fn scene_distance(p: vec3f) -> f32`
    Distance,
    /// `fn scene_gradient(p: vec3f) -> vec4f`: the gradient, and the distance in `w`.
    Gradient,
    /// `fn scene_surface(p: vec3f, n: vec3f) -> Surface`
    Surface,
}

impl SceneFunction {
    /// Its name in WGSL.
    pub fn name(self) -> &'static str {
        match self {
            Self::Distance => "scene_distance",
            Self::Gradient => "scene_gradient",
            Self::Surface => "scene_surface",
        }
    }
}

/// The scene as WGSL.
#[derive(Clone, Copy, Debug, Default)]
pub struct SceneSource<'a> {
    /// Its functions, at least those of [`Stage::scene_functions`], with all that they need except
    /// the prelude and the struct `Surface`.
    pub text: &'a str,
    /// The functions of [`sdfc_vm::prelude`] that it calls.
    pub calls: &'a [&'static str],
}

/// A buffer of the picture; its number is its slot in group 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u32)]
pub enum Slot {
    /// The uniform [`Frame`].
    Frame = 0,
    /// The uniform array of [`Light`]s.
    Lights = 1,
    /// A [`Ray`] per pixel.
    Rays = 2,
    /// What is left to do: the words of [`queue_front`], and two lists of indices.
    Queue = 3,
    /// Four numbers per pixel: the normal, and the length of the gradient.
    Normals = 4,
    /// A [`Surface`] per pixel.
    Surfaces = 5,
    /// A [`ShadowRay`] per light and pixel, the pixels of one light together.
    Shadows = 6,
    /// An [`OcclusionRay`] per pixel.
    Occlusion = 7,
    /// Four numbers per pixel: the sum of all samples.
    Colors = 8,
    /// A [`Beam`] per block of pixels.
    Beams = 9,
}

impl Slot {
    /// All buffers.
    pub const ALL: [Self; 10] = [
        Self::Frame,
        Self::Lights,
        Self::Rays,
        Self::Queue,
        Self::Normals,
        Self::Surfaces,
        Self::Shadows,
        Self::Occlusion,
        Self::Colors,
        Self::Beams,
    ];

    /// How many bytes it takes for a tile of so many pixels.
    pub fn bytes(self, pixels: u64, lights: u64) -> u64 {
        match self {
            Self::Frame => size_of::<Frame>() as u64,
            Self::Lights => size_of::<Light>() as u64 * lights.max(1),
            Self::Rays => size_of::<Ray>() as u64 * pixels,
            Self::Queue => 16 + 8 * queue_capacity(pixels, lights),
            Self::Normals | Self::Colors => 16 * pixels,
            Self::Surfaces => size_of::<Surface>() as u64 * pixels,
            Self::Shadows => size_of::<ShadowRay>() as u64 * pixels * lights,
            Self::Occlusion => size_of::<OcclusionRay>() as u64 * pixels,
            // A strip one pixel wide has a block for each eight of them.
            Self::Beams => size_of::<Beam>() as u64 * (pixels / 8 + 1),
        }
    }
}

/// How many entries a half of the queue holds: the number to put into [`Frame::capacity`].
pub fn queue_capacity(pixels: u64, lights: u64) -> u64 {
    pixels * lights.max(1)
}

/// The front of the queue before a dispatch that evaluates the scene at most `budget` times in each
/// invocation, and reads the first `listed` entries of a half, 0 or 1; with none it takes all rays.
pub fn queue_front(budget: u32, listed: u32, half: u32) -> [u32; 4] {
    [0, budget, listed, half]
}

/// How a kernel uses a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Access {
    /// `var<uniform>`
    Uniform,
    /// `var<storage, read>`
    Read,
    /// `var<storage, read_write>`
    ReadWrite,
}

/// A stage's kernel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kernel {
    /// The stage's name.
    pub label: &'static str,
    /// The whole module; its entry point is `main`.
    pub text: String,
    /// The picture's buffers that it uses; the scene's own come on top.
    pub bindings: Vec<(Slot, Access)>,
}

/// The stages of a picture, in the order in which they run.
pub fn stages(features: &Features) -> Vec<Stage> {
    if features.plane || features.mode == Mode::Distance {
        return vec![Stage::Plane];
    }
    let mode = features.mode;
    let colored = matches!(mode, Mode::Shaded | Mode::Albedo | Mode::Id | Mode::Edges);
    let surfaces = features.materials && colored;
    let faces = matches!(mode, Mode::Shaded | Mode::Normal | Mode::Edges);
    let lit = mode == Mode::Shaded;
    let wanted = |stage: Stage| match stage {
        Stage::Beam | Stage::March => true,
        Stage::Polish => !matches!(mode, Mode::Steps | Mode::Mask),
        Stage::Normal => faces || surfaces,
        Stage::Surface => surfaces,
        Stage::Shadow => lit && casts_shadows(features),
        Stage::Occlusion => lit && features.occlusion != Occlusion::Off,
        Stage::Shade => lit,
        Stage::View => !lit && mode != Mode::Edges,
        Stage::Edges => mode == Mode::Edges,
        Stage::Plane => false,
    };
    Stage::ALL
        .into_iter()
        .filter(|&stage| wanted(stage))
        .collect()
}

/// How long the line of invocations is that covers a tile: for `beam` one for each block of its
/// pixels, for `shadow` one for each pixel and light.
pub fn invocations(stage: Stage, tile: [u32; 2], lights: u64) -> u64 {
    let blocks = u64::from(tile[0].div_ceil(8)) * u64::from(tile[1].div_ceil(8));
    match stage {
        Stage::Beam => blocks,
        Stage::Shadow => blocks * 64 * lights,
        _ => blocks * 64,
    }
}

fn casts_shadows(features: &Features) -> bool {
    features.lights.iter().any(|&form| form != Shadow::None)
}

impl Stage {
    /// All stages, in the order in which they run.
    pub const ALL: [Self; 11] = [
        Self::Beam,
        Self::March,
        Self::Polish,
        Self::Normal,
        Self::Surface,
        Self::Shadow,
        Self::Occlusion,
        Self::Shade,
        Self::View,
        Self::Edges,
        Self::Plane,
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        self.source().0
    }

    /// Whether a dispatch may leave rays for another one.
    pub fn is_resumable(self) -> bool {
        matches!(
            self,
            Self::Beam | Self::March | Self::Shadow | Self::Occlusion
        )
    }

    /// The most evaluations of the scene in one invocation of a stage that is not resumable.
    pub fn evaluations(self, features: &Features) -> u32 {
        match self {
            Self::Polish => marching::SECANT_STEPS,
            // Just outside, just inside, and across a jump.
            Self::Normal if features.normals == Normals::Exact => 2 + jump_taps(),
            Self::Normal => normals::taps(features.normals).len() as u32,
            Self::Surface => 1,
            Self::Plane => 2,
            Self::Beam | Self::March | Self::Shadow | Self::Occlusion => 0,
            Self::Shade | Self::View | Self::Edges => 0,
        }
    }

    /// The scene's functions that the stage calls.
    pub fn scene_functions(self, features: &Features) -> Vec<SceneFunction> {
        match self {
            Self::Beam | Self::March | Self::Polish | Self::Shadow | Self::Occlusion => {
                vec![SceneFunction::Distance]
            }
            Self::Normal if features.normals == Normals::Exact => vec![SceneFunction::Gradient],
            Self::Normal => vec![SceneFunction::Distance],
            Self::Surface => vec![SceneFunction::Surface],
            Self::Plane if features.materials && is_painted(features) => {
                vec![SceneFunction::Distance, SceneFunction::Surface]
            }
            Self::Plane => vec![SceneFunction::Distance],
            Self::Shade | Self::View | Self::Edges => vec![],
        }
    }

    /// Its name and its file.
    fn source(self) -> (&'static str, &'static str) {
        macro_rules! file {
            ($name:literal) => {
                ($name, include_str!(concat!("kernels/", $name, ".wgsl")))
            };
        }
        match self {
            Self::Beam => file!("beam"),
            Self::March => file!("march"),
            Self::Polish => file!("polish"),
            Self::Normal => file!("normal"),
            Self::Surface => file!("surface"),
            Self::Shadow => file!("shadow"),
            Self::Occlusion => file!("occlusion"),
            Self::Shade => file!("shade"),
            Self::View => file!("view"),
            Self::Edges => file!("edges"),
            Self::Plane => file!("plane"),
        }
    }
}

/// Whether a plane figure is drawn in its own colours.
fn is_painted(features: &Features) -> bool {
    features.plane && matches!(features.mode, Mode::Shaded | Mode::Albedo)
}

/// Whether the colours of a mode are light, to be encoded for a screen; the others are shown as
/// they are.
pub fn shows_light(mode: Mode) -> bool {
    matches!(mode, Mode::Shaded | Mode::Albedo | Mode::Edges)
}

/// The words that `#if` lines of the kernels can ask for and that hold.
fn conditions(features: &Features) -> BTreeSet<&'static str> {
    let general = features.general;
    let has = |form| general || features.lights.contains(&form);
    let mode = features.mode;
    let all = [
        ("general", general),
        ("exact", features.normals == Normals::Exact),
        ("hard", has(Shadow::Hard)),
        ("plain", has(Shadow::Plain)),
        ("improved", has(Shadow::Improved)),
        ("sized", has(Shadow::Sized)),
        ("short", has(Shadow::Plain) || has(Shadow::Sized)),
        ("shadows", general || casts_shadows(features)),
        ("lit", general || !features.lights.is_empty()),
        ("many", matches!(features.occlusion, Occlusion::Multi(_))),
        ("occlusion", general || features.occlusion != Occlusion::Off),
        ("materials", features.materials),
        ("fog", features.fog),
        ("steps", mode == Mode::Steps),
        ("albedo", mode == Mode::Albedo),
        ("normal", mode == Mode::Normal),
        ("depth", mode == Mode::Depth),
        ("id", mode == Mode::Id),
        ("mask", mode == Mode::Mask),
        ("distance", mode == Mode::Distance),
        ("painted", is_painted(features)),
    ];
    all.into_iter()
        .filter_map(|(name, holds)| holds.then_some(name))
        .collect()
}

/// The lines of `text` that hold under the conditions: those outside `#if WORD … #else … #end`, and
/// the right side of each.
fn chosen(text: &str, conditions: &BTreeSet<&'static str>) -> String {
    let mut open: Vec<bool> = Vec::new();
    let mut result = String::new();
    for line in text.lines() {
        match line.strip_prefix('#') {
            Some("else") => {
                if let Some(last) = open.last_mut() {
                    *last = !*last;
                }
            }
            Some("end") => {
                open.pop();
            }
            Some(directive) => {
                let word = directive.strip_prefix("if ").unwrap_or_default();
                open.push(conditions.contains(word));
            }
            None if open.iter().all(|&holds| holds) => {
                result.push_str(line);
                result.push('\n');
            }
            None => {}
        }
    }
    result
}

/// Every word of a WGSL text that could be a name, comments left out.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.lines()
        .map(|line| line.split("//").next().unwrap_or_default())
        .flat_map(|line| line.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_')))
        .filter(|word| !word.is_empty())
}

/// The kernel of a stage.
pub fn kernel(stage: Stage, features: &Features, scene: &SceneSource<'_>) -> Kernel {
    let (label, file) = stage.source();
    let own = chosen(file, &conditions(features));
    let scene_text = if stage.scene_functions(features).is_empty() {
        ""
    } else {
        scene.text
    };
    let body = format!("{}{own}", shared_parts(&own));
    let mut named: BTreeSet<&str> = words(&body).collect();
    let mut prelude_calls: BTreeSet<&'static str> = BTreeSet::new();
    if !scene_text.is_empty() {
        named.extend(words(scene_text).filter(|&word| word == "Surface"));
        prelude_calls.extend(scene.calls);
    }
    let recorded: Vec<_> = functions::ALL
        .iter()
        .filter(|entry| named.contains(entry.name))
        .map(functions::Entry::function)
        .collect();
    prelude_calls.extend(recorded.iter().flat_map(|function| &function.calls));
    prelude_calls.extend(prelude::NAMES.iter().filter(|name| named.contains(*name)));

    let mut text = format!("// The kernel `{label}`.\n\n");
    for (name, declaration) in STRUCTS {
        if named.contains(name) || *name == "Frame" {
            let _ = writeln!(text, "{declaration}");
        }
    }
    for (name, value) in constants(features) {
        if named.contains(name) {
            let _ = writeln!(text, "const {name} = {value};");
        }
    }
    text.push_str("\n@group(0) @binding(0) var<uniform> frame: Frame;\n\n");
    for function in prelude::functions(prelude_calls) {
        let _ = writeln!(text, "{}", function.text);
    }
    for function in recorded {
        let _ = writeln!(text, "{}", function.text);
    }
    for part in [scene_text, &body]
        .into_iter()
        .filter(|part| !part.is_empty())
    {
        text.push_str(part);
        text.push('\n');
    }
    text.truncate(text.trim_end().len());
    text.push('\n');
    Kernel {
        label,
        bindings: bindings(&own),
        text,
    }
}

/// The parts that several kernels share, those of them that this one mentions.
fn shared_parts(own: &str) -> String {
    let parts = [
        ("is_nan", include_str!("kernels/nan.wgsl")),
        ("line_index", include_str!("kernels/work.wgsl")),
        ("camera_ray", include_str!("kernels/camera.wgsl")),
        ("enqueue", include_str!("kernels/queue.wgsl")),
    ];
    let named: BTreeSet<&str> = words(own).collect();
    let used = parts.iter().filter(|(name, _)| named.contains(name));
    used.map(|(_, text)| format!("{text}\n")).collect()
}

const STRUCTS: &[(&str, &str)] = &[
    ("Frame", Frame::WGSL),
    ("Light", Light::WGSL),
    ("Beam", Beam::WGSL),
    ("Ray", Ray::WGSL),
    ("ShadowRay", ShadowRay::WGSL),
    ("OcclusionRay", OcclusionRay::WGSL),
    ("Surface", Surface::WGSL),
];

/// The number of taps across a jump.
fn jump_taps() -> u32 {
    normals::taps(normals::ACROSS_JUMPS).len() as u32
}

/// The constants of the kernels.
fn constants(features: &Features) -> Vec<(&'static str, String)> {
    let (taps, first_jump_tap) = if features.general {
        let first = normals::first_in_table(normals::ACROSS_JUMPS);
        (normals::table(), first as u32)
    } else {
        let way = match features.normals {
            Normals::Exact => normals::ACROSS_JUMPS,
            other => other,
        };
        (normals::taps(way).to_vec(), 0)
    };
    let taps_of_normals = normals::taps(features.normals).len();
    let lights = if features.general {
        MOST_LIGHTS
    } else {
        features.lights.len()
    };
    let table = |pick: fn(&normals::Tap) -> [f32; 3]| {
        let rows = taps
            .iter()
            .map(pick)
            .map(|[x, y, z]| format!("vec3f({x:?}, {y:?}, {z:?})"));
        format!(
            "array<vec3f, {}>({})",
            taps.len(),
            rows.collect::<Vec<_>>().join(", ")
        )
    };
    let word = |value: u32| format!("{value}u");
    let taps_of_stage = match features.occlusion {
        Occlusion::Off => 0,
        other => other.taps(),
    };
    vec![
        ("ACTIVE", word(marching::Status::Active as u32)),
        ("HIT", word(marching::Status::Hit as u32)),
        ("MISS", word(marching::Status::Miss as u32)),
        ("STEP_CAP", word(marching::Status::StepCap as u32)),
        ("NOT_A_NUMBER", word(marching::Status::NotANumber as u32)),
        ("ENDING", word(marching::ENDING)),
        ("FROM_INSIDE", word(marching::FROM_INSIDE)),
        ("SHOWN", word(marching::SHOWN)),
        ("BLOCK", word(beam::SIDE)),
        ("BEAM_STEPS", word(beam::STEPS)),
        ("SECANT_STEPS", word(marching::SECANT_STEPS)),
        ("SPREAD", format!("{:?}", normals::spread(features.normals))),
        ("NORMAL_TAPS", word(taps_of_normals as u32)),
        ("JUMP_TAPS", word(jump_taps())),
        ("FIRST_JUMP_TAP", word(first_jump_tap)),
        ("TAP_OFFSETS", table(|tap| tap.0)),
        ("TAP_WEIGHTS", table(|tap| tap.1)),
        ("LIGHTS", word(lights as u32)),
        ("FOG", word(layout::FOG)),
        ("HEMISPHERE", word(layout::HEMISPHERE)),
        ("DONE", word(shadow::DONE)),
        ("MOVED", format!("{:?}", claim::MOVED)),
        ("NOTHING", format!("{:?}", claim::NOTHING)),
        ("TOO_FAR", format!("{:?}", claim::TOO_FAR)),
        ("NO_CLAIM", format!("{:?}", shadow::NO_CLAIM)),
        ("NO_LAST", format!("{:?}", shadow::NO_LAST)),
        ("RIM_RAYS", format!("{:?}", shadow::RIM_RAYS)),
        ("FIRST_RIM_RAYS", format!("{:?}", shadow::FIRST_RIM_RAYS)),
        ("INSIDE", format!("{:?}", shadow::INSIDE)),
        ("HIDDEN", format!("{:?}", shadow::HIDDEN)),
        ("SHADOW_NONE", word(Shadow::None as u32)),
        ("SHADOW_HARD", word(Shadow::Hard as u32)),
        ("SHADOW_PLAIN", word(Shadow::Plain as u32)),
        ("SHADOW_IMPROVED", word(Shadow::Improved as u32)),
        ("SHADOW_SIZED", word(Shadow::Sized as u32)),
        ("TAPS", format!("{taps_of_stage}.0")),
    ]
}

/// The picture's buffers that a kernel declares, read from its text.
fn bindings(own: &str) -> Vec<(Slot, Access)> {
    let mut found = vec![(Slot::Frame, Access::Uniform)];
    for line in own.lines() {
        let Some(rest) = line.strip_prefix("@group(0) @binding(") else {
            continue;
        };
        let Some((number, declaration)) = rest.split_once(')') else {
            continue;
        };
        let access = match declaration.split_once('>').map(|(kind, _)| kind.trim()) {
            Some("var<uniform") => Access::Uniform,
            Some("var<storage, read") => Access::Read,
            _ => Access::ReadWrite,
        };
        let slot = Slot::ALL
            .into_iter()
            .find(|&slot| number.parse() == Ok(slot as u32));
        found.extend(slot.map(|slot| (slot, access)));
    }
    found
}
