//! Kernels, assembled from the features of a picture.
//!
//! A picture is made in [`stages`], each a kernel over the rays of a tile that evaluates the scene in one
//! place. [`kernel`] returns the text of a stage. It consists of the stage's file, the declarations,
//! constants and recorded functions that the file mentions, and the scene's functions. The file is
//! preprocessed by its `#if` lines for the [`Features`]. Declarations that are not mentioned are left out.
//!
//! # Running them
//!
//! All buffers are in group 0; a scene may bind its own in group 0 from slot [`FIRST_SCENE_SLOT`] on, or in
//! another group. For each tile and each pass over subpixels the stages run in order. All kernels have
//! workgroups of 64 × 1 × 1 and are dispatched over a line of invocations. A line too long for one axis
//! continues along y.
//!
//! The stages `beam`, `march`, `shadow` and `occlusion` are resumable. One dispatch evaluates the scene a
//! bounded number of times per ray and lists the unfinished rays in the queue. Before each of their
//! dispatches its header of four words is written. While the first word then counts unfinished rays, the
//! stage runs again over a line of that length. It then reads the other half of the queue.
//!
//! The picture is then in the buffer of colours, as light; the driver converts it to bytes for a screen, by
//! the functions of [`crate::tone`].
//!
//! *Generic* kernels ([`Features::generic`]) draw any picture of a mode. They read the numbers in the last
//! fields of [`FrameUniforms`]. The number of lights is read from the lights themselves, which the `shade`
//! stage binds as storage. No loop ends by a uniform alone: a count in storage ends it, too. Otherwise software
//! Vulkan would compile the kernel again for each value of the uniform.
//!
//! The `edges` stage compares neighbours within a tile: its tiles overlap by one pixel.

use crate::features::{Features, MAX_GENERIC_LIGHTS, Mode, Normals, Occlusion, ShadowForm};
use crate::layout::{
    self, Beam, FrameUniforms, LightRecord, OcclusionState, RayState, ShadowRayState, Surface,
};
use crate::{beam, camera, candidate, functions, marching, normals, shadow, views};
use sdfc_vm::prelude;
use std::collections::BTreeSet;
use std::fmt::Write;

/// First slot of group 0 that is free for the scene's own buffers.
pub const FIRST_SCENE_SLOT: u32 = 16;

/// A stage of a picture; each has a file in `kernels`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum RenderStage {
    /// Advances the rays of a block of pixels together.
    Beam,
    /// Marches rays to their ends.
    March,
    /// Refines the depths of hits.
    RefineRoots,
    /// Finds the normals of surfaces.
    Normal,
    /// Evaluates the material of surfaces.
    Surface,
    /// Traces rays towards the lights.
    Shadow,
    /// Samples the surroundings of surfaces for ambient occlusion.
    Occlusion,
    /// Sums the light towards the camera.
    Shade,
    /// Shows a debug view.
    View,
    /// Draws lines between neighbours that differ.
    Edges,
    /// Shows the field on a plane, without the other stages.
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
    /// Returns the function's name in WGSL.
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
    /// Its functions, at least those of the stage, with all that they call except the prelude and the struct
    /// `Surface`.
    pub text: &'a str,
    /// The functions of [`sdfc_vm::prelude`] that it calls.
    pub calls: &'a [&'static str],
}

/// A buffer of the picture; its number is its slot in group 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u32)]
pub enum BufferSlot {
    /// The uniform [`FrameUniforms`].
    Frame = 0,
    /// The uniform array of [`LightRecord`]s.
    Lights = 1,
    /// A [`RayState`] per pixel.
    Rays = 2,
    /// Unfinished items: the header of four words, and two lists of indices.
    Queue = 3,
    /// Four numbers per pixel: the normal, and the length of the gradient.
    Normals = 4,
    /// A [`Surface`] per pixel.
    Surfaces = 5,
    /// A [`ShadowRayState`] per light and pixel, the pixels of one light together.
    Shadows = 6,
    /// An [`OcclusionState`] per pixel.
    Occlusion = 7,
    /// Four numbers per pixel: the sum of all samples.
    Colors = 8,
    /// A [`Beam`] per block of pixels.
    Beams = 9,
}

impl BufferSlot {
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

    /// Returns the size in bytes for a tile of `pixels` pixels.
    pub fn bytes(self, pixels: u64, lights: u64) -> u64 {
        match self {
            Self::Frame => size_of::<FrameUniforms>() as u64,
            Self::Lights => size_of::<LightRecord>() as u64 * lights.max(1),
            Self::Rays => size_of::<RayState>() as u64 * pixels,
            Self::Queue => 16 + 8 * queue_capacity(pixels, lights),
            Self::Normals | Self::Colors => 16 * pixels,
            Self::Surfaces => size_of::<Surface>() as u64 * pixels,
            Self::Shadows => size_of::<ShadowRayState>() as u64 * pixels * lights,
            Self::Occlusion => size_of::<OcclusionState>() as u64 * pixels,
            // A strip one pixel wide has a block for every eight pixels.
            Self::Beams => size_of::<Beam>() as u64 * (pixels / 8 + 1),
        }
    }
}

/// Returns the number of entries in each half of the queue.
pub fn queue_capacity(pixels: u64, lights: u64) -> u64 {
    pixels * lights.max(1)
}

/// Returns the header of the queue before a dispatch that evaluates the scene at most `budget` times in each
/// invocation. The dispatch reads the first `listed` entries of a half, 0 or 1; with none it processes all
/// rays.
pub fn queue_header(budget: u32, listed: u32, half: u32) -> [u32; 4] {
    [0, budget, listed, half]
}

/// Access of a kernel to a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BufferAccess {
    /// `var<uniform>`
    Uniform,
    /// `var<storage, read>`
    Read,
    /// `var<storage, read_write>`
    ReadWrite,
}

/// The kernel of a stage.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StageKernel {
    /// Name of the stage.
    pub label: &'static str,
    /// The complete module; its entry point is `main`.
    pub text: String,
    /// Buffers of the picture that it uses, without the scene's own.
    pub bindings: Vec<(BufferSlot, BufferAccess)>,
}

/// Returns the stages of a picture, in the order in which they run.
pub fn stages(features: &Features) -> Vec<RenderStage> {
    if features.is_2d || features.mode == Mode::Distance {
        return vec![RenderStage::Plane];
    }
    let mode = features.mode;
    let colored = matches!(mode, Mode::Shaded | Mode::Albedo | Mode::Id | Mode::Edges);
    let surfaces = features.materials && colored;
    let has_normals = matches!(mode, Mode::Shaded | Mode::Normal | Mode::Edges);
    let is_lit = mode == Mode::Shaded;
    let is_needed = |stage: RenderStage| match stage {
        RenderStage::Beam | RenderStage::March => true,
        RenderStage::RefineRoots => !matches!(mode, Mode::Steps | Mode::Mask),
        RenderStage::Normal => has_normals || surfaces,
        RenderStage::Surface => surfaces,
        RenderStage::Shadow => is_lit && casts_shadows(features),
        RenderStage::Occlusion => is_lit && features.occlusion != Occlusion::Off,
        RenderStage::Shade => is_lit,
        RenderStage::View => !is_lit && mode != Mode::Edges,
        RenderStage::Edges => mode == Mode::Edges,
        RenderStage::Plane => false,
    };
    RenderStage::ALL
        .into_iter()
        .filter(|&stage| is_needed(stage))
        .collect()
}

/// Returns the length of the line of invocations for a tile. There is one per pixel, for `beam` one per block
/// of pixels, for `shadow` one per pixel and light.
pub fn invocation_count(stage: RenderStage, tile: [u32; 2], lights: u64) -> u64 {
    let blocks = u64::from(tile[0].div_ceil(8)) * u64::from(tile[1].div_ceil(8));
    match stage {
        RenderStage::Beam => blocks,
        RenderStage::Shadow => blocks * 64 * lights,
        _ => blocks * 64,
    }
}

fn casts_shadows(features: &Features) -> bool {
    features.lights.iter().any(|&form| form != ShadowForm::None)
}

impl RenderStage {
    /// All stages, in the order in which they run.
    pub const ALL: [Self; 11] = [
        Self::Beam,
        Self::March,
        Self::RefineRoots,
        Self::Normal,
        Self::Surface,
        Self::Shadow,
        Self::Occlusion,
        Self::Shade,
        Self::View,
        Self::Edges,
        Self::Plane,
    ];

    /// Returns the name of the stage's kernel.
    pub fn name(self) -> &'static str {
        self.source().0
    }

    /// Reports whether a dispatch may leave unfinished rays for another one.
    pub fn is_resumable(self) -> bool {
        matches!(
            self,
            Self::Beam | Self::March | Self::Shadow | Self::Occlusion
        )
    }

    /// Returns the maximum number of evaluations of the scene in one invocation of a stage that is not
    /// resumable.
    pub fn evaluations(self, features: &Features) -> u32 {
        match self {
            Self::RefineRoots => marching::MAX_SECANT_STEPS,
            // Just outside, just inside, and across a discontinuity.
            Self::Normal if features.normals == Normals::Exact => 2 + discontinuity_taps(),
            Self::Normal => normals::taps(features.normals).len() as u32,
            Self::Surface => 1,
            // The pixel, one around the block, a probe, and the surface.
            Self::Plane => 4,
            Self::Beam | Self::March | Self::Shadow | Self::Occlusion => 0,
            Self::Shade | Self::View | Self::Edges => 0,
        }
    }

    /// Returns the scene's functions that the stage calls.
    pub fn scene_functions(self, features: &Features) -> Vec<SceneFunction> {
        match self {
            Self::Beam | Self::March | Self::RefineRoots | Self::Shadow | Self::Occlusion => {
                vec![SceneFunction::Distance]
            }
            Self::Normal if features.normals == Normals::Exact => vec![SceneFunction::Gradient],
            Self::Normal => vec![SceneFunction::Distance],
            Self::Surface => vec![SceneFunction::Surface],
            Self::Plane if features.materials && shows_material_colors(features) => {
                vec![SceneFunction::Distance, SceneFunction::Surface]
            }
            Self::Plane => vec![SceneFunction::Distance],
            Self::Shade | Self::View | Self::Edges => vec![],
        }
    }

    /// Returns the name and the file of the stage.
    fn source(self) -> (&'static str, &'static str) {
        macro_rules! file {
            ($name:literal) => {
                ($name, include_str!(concat!("kernels/", $name, ".wgsl")))
            };
        }
        match self {
            Self::Beam => file!("beam"),
            Self::March => file!("march"),
            Self::RefineRoots => file!("refine_roots"),
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

/// Reports whether a 2-D shape is drawn in its own colours.
fn shows_material_colors(features: &Features) -> bool {
    features.is_2d && matches!(features.mode, Mode::Shaded | Mode::Albedo)
}

/// Reports whether the colours of a mode are light, to be encoded for a screen; others are shown unchanged.
pub fn shows_light(mode: Mode) -> bool {
    matches!(mode, Mode::Shaded | Mode::Albedo | Mode::Edges)
}

/// Returns the words that hold in `#if` lines of the kernels.
fn defines(features: &Features) -> BTreeSet<&'static str> {
    let generic = features.generic;
    let has = |form| generic || features.lights.contains(&form);
    let mode = features.mode;
    let list = [
        ("generic", generic),
        ("exact", features.normals == Normals::Exact),
        ("sized", has(ShadowForm::Sized)),
        (
            "short_stride",
            has(ShadowForm::Plain) || has(ShadowForm::Sized),
        ),
        ("shadows", generic || casts_shadows(features)),
        ("lights", generic || !features.lights.is_empty()),
        (
            "hemisphere",
            matches!(features.occlusion, Occlusion::Multi(_)),
        ),
        ("occlusion", generic || features.occlusion != Occlusion::Off),
        ("materials", features.materials),
        ("fog", features.fog),
        ("half_spaces", generic || features.has_half_spaces),
        ("proved_steps", generic || features.proves_steps),
        ("steps", mode == Mode::Steps),
        ("albedo", mode == Mode::Albedo),
        ("normal", mode == Mode::Normal),
        ("depth", mode == Mode::Depth),
        ("id", mode == Mode::Id),
        ("mask", mode == Mode::Mask),
        ("distance", mode == Mode::Distance),
        ("material_colors", shows_material_colors(features)),
    ];
    list.into_iter()
        .filter_map(|(name, holds)| holds.then_some(name))
        .collect()
}

/// Returns the lines of `text` that are active under the defines: those outside `#if WORD … #else … #end`,
/// and the active branch of each.
fn preprocess(text: &str, defines: &BTreeSet<&'static str>) -> String {
    let mut open: Vec<bool> = Vec::new();
    let mut result = String::new();
    for line in text.lines() {
        match line.strip_prefix('#') {
            Some("else") => {
                if let Some(block) = open.last_mut() {
                    *block = !*block;
                }
            }
            Some("end") => {
                open.pop();
            }
            Some(directive) => {
                let word = directive.strip_prefix("if ").unwrap_or_default();
                open.push(defines.contains(word));
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

/// Returns every potential identifier of a WGSL text, without comments.
fn identifiers(text: &str) -> impl Iterator<Item = &str> {
    text.lines()
        .map(|line| line.split("//").next().unwrap_or_default())
        .flat_map(|line| line.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_')))
        .filter(|word| !word.is_empty())
}

/// Returns the kernel of a stage.
pub fn kernel(stage: RenderStage, features: &Features, scene: &SceneSource<'_>) -> StageKernel {
    let (label, file) = stage.source();
    let defines = defines(features);
    let stage_text = preprocess(file, &defines);
    let scene_text = if stage.scene_functions(features).is_empty() {
        ""
    } else {
        scene.text
    };
    let shared_text = preprocess(&shared_text(&stage_text), &defines);
    let body = format!("{shared_text}{stage_text}");
    let mut mentioned: BTreeSet<&str> = identifiers(&body).collect();
    let mut prelude_calls: BTreeSet<&'static str> = BTreeSet::new();
    if !scene_text.is_empty() {
        mentioned.extend(identifiers(scene_text).filter(|&word| word == "Surface"));
        prelude_calls.extend(scene.calls);
    }
    let recorded: Vec<_> = functions::ALL
        .iter()
        .filter(|entry| mentioned.contains(entry.name))
        .map(functions::Entry::function)
        .collect();
    prelude_calls.extend(recorded.iter().flat_map(|function| &function.calls));
    prelude_calls.extend(
        prelude::NAMES
            .iter()
            .filter(|name| mentioned.contains(*name)),
    );

    let mut text = format!("// The kernel `{label}`.\n\n");
    for (name, declaration) in STRUCTS {
        if mentioned.contains(name) || *name == "FrameUniforms" {
            let _ = writeln!(text, "{declaration}");
        }
    }
    for (name, value) in constants(features) {
        if mentioned.contains(name) {
            let _ = writeln!(text, "const {name} = {value};");
        }
    }
    text.push_str("\n@group(0) @binding(0) var<uniform> frame: FrameUniforms;\n\n");
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
    StageKernel {
        label,
        bindings: declared_bindings(&stage_text),
        text,
    }
}

/// Returns the files shared by several kernels that this one mentions.
fn shared_text(stage_text: &str) -> String {
    let camera = include_str!("kernels/camera.wgsl");
    let parts = [
        (["is_nan"].as_slice(), include_str!("kernels/nan.wgsl")),
        (&["line_index"], include_str!("kernels/work.wgsl")),
        (&["camera_ray", "camera_ray_at"], camera),
        (&["camera_segment"], include_str!("kernels/segment.wgsl")),
        (&["shadow_end"], include_str!("kernels/shadow_end.wgsl")),
        (&["enqueue"], include_str!("kernels/queue.wgsl")),
    ];
    let mentioned: BTreeSet<&str> = identifiers(stage_text).collect();
    let is_used = |names: &[&str]| names.iter().any(|name| mentioned.contains(name));
    let used = parts.iter().filter(|(names, _)| is_used(names));
    used.map(|(_, text)| format!("{text}\n")).collect()
}

const STRUCTS: &[(&str, &str)] = &[
    ("FrameUniforms", FrameUniforms::WGSL),
    ("LightRecord", LightRecord::WGSL),
    ("Beam", Beam::WGSL),
    ("RayState", RayState::WGSL),
    ("ShadowRayState", ShadowRayState::WGSL),
    ("OcclusionState", OcclusionState::WGSL),
    ("Surface", Surface::WGSL),
];

/// Returns the number of taps across a discontinuity.
fn discontinuity_taps() -> u32 {
    normals::taps(normals::AT_DISCONTINUITIES).len() as u32
}

/// Returns the constants of the kernels.
fn constants(features: &Features) -> Vec<(&'static str, String)> {
    let (taps, first_discontinuity_tap) = if features.generic {
        let first = normals::first_tap(normals::AT_DISCONTINUITIES);
        (normals::tap_table(), first as u32)
    } else {
        let scheme = match features.normals {
            Normals::Exact => normals::AT_DISCONTINUITIES,
            other => other,
        };
        (normals::taps(scheme).to_vec(), 0)
    };
    let normal_tap_count = normals::taps(features.normals).len();
    let light_count = if features.generic {
        MAX_GENERIC_LIGHTS
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
    let occlusion_tap_count = match features.occlusion {
        Occlusion::Off => 0,
        other => other.taps(),
    };
    vec![
        ("ACTIVE", word(marching::Status::Active as u32)),
        ("HIT", word(marching::Status::Hit as u32)),
        ("MISS", word(marching::Status::Miss as u32)),
        ("STEP_CAP", word(marching::Status::StepCap as u32)),
        ("NOT_A_NUMBER", word(marching::Status::NotANumber as u32)),
        ("END_MASK", word(marching::END_MASK)),
        ("FROM_INSIDE", word(marching::FROM_INSIDE)),
        ("SHOWN", word(marching::SHOWN)),
        ("PROVED_SHIFT", word(marching::PROVED_SHIFT)),
        ("MAX_PROVED", format!("{:?}", marching::MAX_PROVED)),
        ("NEVER", format!("{:?}", camera::NEVER as f32)),
        ("BLOCK_SIDE", word(beam::BLOCK_SIDE)),
        ("COUNTS", word(views::COUNTS)),
        ("MAX_BEAM_STEPS", word(beam::MAX_STEPS)),
        ("MAX_SECANT_STEPS", word(marching::MAX_SECANT_STEPS)),
        (
            "TAP_SPREAD",
            format!("{:?}", normals::tap_spread(features.normals)),
        ),
        ("NORMAL_TAPS", word(normal_tap_count as u32)),
        ("DISCONTINUITY_TAPS", word(discontinuity_taps())),
        ("FIRST_DISCONTINUITY_TAP", word(first_discontinuity_tap)),
        ("TAP_OFFSETS", table(|tap| tap.0)),
        ("TAP_WEIGHTS", table(|tap| tap.1)),
        ("LIGHT_COUNT", word(light_count as u32)),
        ("FOG_FLAG", word(layout::FOG_FLAG)),
        ("HEMISPHERE_FLAG", word(layout::HEMISPHERE_FLAG)),
        ("ESTIMATE_FLAG", word(layout::ESTIMATE_FLAG)),
        ("DONE_FLAG", word(shadow::DONE_FLAG)),
        ("MOVED_PHASE", format!("{:?}", candidate::MOVED_PHASE)),
        ("NO_SURFACE", format!("{:?}", candidate::NO_SURFACE)),
        (
            "MIN_PHASE_OUTCOME",
            format!("{:?}", candidate::MIN_PHASE_OUTCOME),
        ),
        ("NO_CANDIDATE", format!("{:?}", shadow::NO_CANDIDATE)),
        ("NO_NEXT_CHECK", format!("{:?}", shadow::NO_NEXT_CHECK)),
        (
            "NO_LAST_VISIBILITY",
            format!("{:?}", shadow::NO_LAST_VISIBILITY),
        ),
        ("RIM_RAYS", format!("{:?}", shadow::RIM_RAYS)),
        ("FIRST_RIM_RAYS", format!("{:?}", shadow::FIRST_RIM_RAYS)),
        (
            "INSIDE_RAY_NUMBER",
            format!("{:?}", shadow::INSIDE_RAY_NUMBER),
        ),
        ("HALF_VISIBILITY", format!("{:?}", shadow::HALF_VISIBILITY)),
        (
            "MAX_HIDDEN_VISIBILITY",
            format!("{:?}", shadow::MAX_HIDDEN_VISIBILITY),
        ),
        ("SHADOW_NONE", word(ShadowForm::None as u32)),
        ("SHADOW_HARD", word(ShadowForm::Hard as u32)),
        ("SHADOW_PLAIN", word(ShadowForm::Plain as u32)),
        ("SHADOW_SIZED", word(ShadowForm::Sized as u32)),
        ("OCCLUSION_TAPS", format!("{occlusion_tap_count}.0")),
    ]
}

/// Returns the buffers of the picture that a kernel declares, read from its text.
fn declared_bindings(stage_text: &str) -> Vec<(BufferSlot, BufferAccess)> {
    let mut bindings = vec![(BufferSlot::Frame, BufferAccess::Uniform)];
    for line in stage_text.lines() {
        let Some(after_group) = line.strip_prefix("@group(0) @binding(") else {
            continue;
        };
        let Some((number, declaration)) = after_group.split_once(')') else {
            continue;
        };
        let access = match declaration.split_once('>').map(|(kind, _)| kind.trim()) {
            Some("var<uniform") => BufferAccess::Uniform,
            Some("var<storage, read") => BufferAccess::Read,
            _ => BufferAccess::ReadWrite,
        };
        let slot = BufferSlot::ALL
            .into_iter()
            .find(|&slot| number.parse() == Ok(slot as u32));
        bindings.extend(slot.map(|slot| (slot, access)));
    }
    bindings
}
