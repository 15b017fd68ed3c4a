//! Conversion of render settings to the numbers that CPU and GPU use.

use super::{
    CellMode, Display, FieldFacts, Image, LightEmitter, RenderSettings, ResolvedLens,
    ResolvedLight, ResolvedShadow, Stats, Status, View,
};
use glam::DVec3;
use sdfc_shaders::assemble::shows_light;
use sdfc_shaders::features::{self, Features, Mode, Occlusion};
use sdfc_shaders::{layout, marching, normals, occlusion, shadow};
use sdfc_vm::bounds::Bounds;

/// A render with all inputs prepared.
#[derive(Clone, Debug)]
pub struct RenderJob {
    /// The features that its kernels contain.
    pub features: Features,
    /// Its uniforms, for the whole image as one tile and the first pass over subpixels.
    pub uniforms: layout::FrameUniforms,
    /// Its lights, in the layout of the kernels' buffer.
    pub lights: Vec<layout::LightRecord>,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// The conversion of its colours to bytes.
    pub display: Display,
    /// Use of cells.
    pub cells: CellMode,
    /// Absolute value from which a 2-D shape's field only needs a correct sign; `None` for the default of the
    /// mode.
    pub exact_band: Option<f32>,
}

impl RenderJob {
    /// Returns the number of passes over subpixels: one per sample of a pixel.
    pub fn pass_count(&self) -> u32 {
        self.uniforms.samples
    }

    /// Returns the uniforms of a pass over subpixels, with the position of the ray in its pixel.
    pub fn pass_uniforms(&self, sample: u32) -> layout::FrameUniforms {
        let side = f64::from(self.uniforms.samples).sqrt().round() as u32;
        let subpixel = |i: u32| (i as f32 + 0.5) / side as f32 - 0.5;
        layout::FrameUniforms {
            sample,
            offset: [subpixel(sample % side), subpixel(sample / side)],
            ..self.uniforms
        }
    }

    /// Reports whether the image shows the field on a plane instead of surfaces in space.
    pub fn shows_plane(&self) -> bool {
        self.features.is_2d || self.features.mode == Mode::Distance
    }

    /// Returns an image of this size in which nothing was hit.
    pub fn blank_image(&self) -> Image {
        let [width, height] = self.size.map(|n| n as usize);
        let count = width * height;
        Image {
            width,
            height,
            color: vec![[0.0; 4]; count],
            depth: vec![f32::INFINITY; count],
            normal: vec![[0.0; 3]; count],
            id: vec![0; count],
            steps: vec![0; count],
            status: vec![Status::Miss; count],
            display: self.display,
            stats: Stats::default(),
        }
    }
}

/// Origins and directions of the rays of an image, in full precision. The pixel at (x, y) in the view, from
/// (-1, -1) to (1, 1), has a ray that starts at `origin + x origin_right + y origin_up` with the direction
/// `forward + x forward_right + y forward_up`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes {
    /// Origin of the central ray.
    pub origin: [f64; 3],
    /// Offset from there to the origin of the ray at the middle of the right edge.
    pub origin_right: [f64; 3],
    /// Offset for the upper edge.
    pub origin_up: [f64; 3],
    /// Unit direction of the central ray.
    pub forward: [f64; 3],
    /// Change of the direction towards the right edge.
    pub forward_right: [f64; 3],
    /// Change towards the upper edge.
    pub forward_up: [f64; 3],
}

impl Axes {
    /// Returns the axes for an image with these settings.
    pub fn from_settings(settings: &RenderSettings) -> Self {
        let [width, height] = settings.size.map(|n| f64::from(n.max(1)));
        Self::from_view(&settings.view, width / height)
    }

    /// Returns the axes for a view, with `aspect` = width / height.
    pub fn from_view(view: &View, aspect: f64) -> Self {
        let view_up = DVec3::from(view.up);
        let forward = (DVec3::from(view.look) - DVec3::from(view.from)).normalize_or(DVec3::NEG_Z);
        // An `up` parallel to the view is undefined; any perpendicular direction is then valid.
        let across = forward.cross(view_up);
        let across = if across.length() > 1e-9 * view_up.length() {
            across
        } else if forward.y.abs() < 0.9 {
            forward.cross(DVec3::Y)
        } else {
            forward.cross(DVec3::NEG_Z)
        };
        let right = across.normalize_or(DVec3::X);
        let up = right.cross(forward);
        let (start, growth) = half_heights(view.lens);
        Self {
            origin: view.from,
            origin_right: (right * (start * aspect)).into(),
            origin_up: (up * start).into(),
            forward: forward.into(),
            forward_right: (right * (growth * aspect)).into(),
            forward_up: (up * growth).into(),
        }
    }

    /// Moves the starts of the rays to the plane at this distance ahead.
    fn ahead(self, distance: f64) -> Self {
        let moved = |point: [f64; 3], direction: [f64; 3]| {
            (DVec3::from(point) + DVec3::from(direction) * distance).into()
        };
        Self {
            origin: moved(self.origin, self.forward),
            origin_right: moved(self.origin_right, self.forward_right),
            origin_up: moved(self.origin_up, self.forward_up),
            ..self
        }
    }
}

/// Returns half the height of the view at the start of the rays, and its growth per unit of distance.
fn half_heights(lens: ResolvedLens) -> (f64, f64) {
    match lens {
        ResolvedLens::Perspective(fov) => (0.0, (fov.clamp(1e-6, 3.1) / 2.0).tan()),
        ResolvedLens::Orthographic(height) => (height / 2.0, 0.0),
    }
}

/// Stand-in for an infinite bound: far outside of any scene, with a square that is finite in `f32`.
const INFINITE_BOUND: f64 = 1e18;

/// Margin of boxes around what rays may meet, as a fraction of their size.
const BOX_MARGIN: f64 = 1e-3;

/// Least coordinate of the camera from which rounding is counted, as a fraction of the scene's size.
const MIN_COORDINATE_FRACTION: f64 = 1e-3;

/// Converts settings and field facts to a render job.
pub fn prepare(settings: &RenderSettings, facts: &FieldFacts) -> RenderJob {
    let view = &settings.view;
    let axes = Axes::from_settings(settings);
    let [width, height] = settings.size.map(|n| f64::from(n.max(1)));
    let aa = settings.aa.max(1);
    let distance = view.target_distance();
    let (start, growth) = half_heights(view.lens);
    let approach = approach(settings, facts, axes.forward);
    let axes = axes.ahead(approach);
    let start = start + growth * approach;
    let lighting = &settings.lighting;
    let (largest, least) = rounded_coordinates(axes.origin, start, settings, facts);
    let bounds = facts.bounds.grown(BOX_MARGIN * finite_size(&facts.bounds));
    let material = facts.material.unwrap_or_default();
    let count = lighting.lights.len() as u32;
    let to_record = |scene_light| layout::LightRecord {
        light_count: count,
        ..light(scene_light, facts)
    };
    let lights: Vec<layout::LightRecord> = lighting.lights.iter().map(to_record).collect();
    let foggy = lighting.fog.is_some_and(|density| density > 0.0);
    let hemisphere = matches!(settings.occlusion, Occlusion::Multi(_));
    let uniforms = layout::FrameUniforms {
        origin: single(axes.origin),
        far: (settings.far - approach) as f32,
        origin_right: single(axes.origin_right),
        is_raw: if facts.is_raw { 1.0 } else { 0.0 },
        step_factor: facts.step_factor(),
        origin_up: single(axes.origin_up),
        rounding: (marching::ROUNDING_PER_UNIT * (largest + start)) as f32,
        forward: single(axes.forward),
        half_pixel_size: (start / height / f64::from(aa)) as f32,
        forward_right: single(axes.forward_right),
        half_pixel_growth: (growth / height / f64::from(aa)) as f32,
        forward_up: single(axes.forward_up),
        threshold_fraction: settings.threshold_fraction as f32,
        bounds_min: corner(bounds.min),
        occlusion_reach: settings.occlusion_reach as f32,
        bounds_max: corner(bounds.max),
        occlusion_weight: occlusion_weight(settings.occlusion),
        sky_top: single(lighting.sky_top),
        ambient: lighting.ambient as f32,
        sky_horizon: single(lighting.sky_horizon),
        fog: lighting.fog.unwrap_or(0.0) as f32,
        sky_ground: single(lighting.sky_ground),
        exposure: settings.exposure as f32,
        sky_up: unit(lighting.up),
        id: material.id,
        albedo: material.albedo,
        roughness: material.roughness,
        emission: material.emission,
        metallic: material.metallic,
        centre: single(view.look),
        spacing: spacing(start + growth * (distance - approach)) as f32,
        size: [width as f32, height as f32],
        offset: [0.0, 0.0],
        tile: [0, 0, settings.size[0], settings.size[1]],
        depth_range: depth_range(settings, facts, axes.forward)
            .map(|depth| (depth - approach) as f32),
        sample: 0,
        samples: aa * aa,
        max_steps: settings.steps.max(1),
        max_shadow_steps: shadow::MAX_STEPS,
        queue_capacity: (settings.size[0] * settings.size[1]).saturating_mul(count.max(1)),
        light_count: count,
        approach: approach as f32,
        relaxation: settings.relaxation as f32,
        occlusion_taps: settings.occlusion.taps() as f32,
        normal_spread: normals::tap_spread(settings.normals),
        normal_taps: normals::first_tap(settings.normals) as u32,
        flags: flags([foggy, hemisphere, facts.has_estimated_slopes]),
        least_rounding: (marching::ROUNDING_PER_UNIT * least) as f32,
        ..extent_uniforms(settings, light_far(settings, facts, approach))
    };
    let features = Features {
        mode: settings.mode,
        lights: lighting
            .lights
            .iter()
            .map(|light| shadow_form(light.shadow).0)
            .collect(),
        occlusion: settings.occlusion,
        normals: settings.normals,
        materials: facts.material.is_none(),
        fog: foggy,
        has_half_spaces: settings.enclosure.is_some(),
        proves_steps: marching::proves_steps(facts.step_factor()),
        is_2d: settings.is_2d,
        generic: false,
    };
    let display = Display {
        exposure: settings.exposure as f32,
        tonemap: settings.tonemap,
        is_light: shows_light(settings.mode),
        is_lit_scene: settings.mode == Mode::Shaded && !settings.is_2d,
    };
    let job = RenderJob {
        features,
        uniforms,
        lights,
        size: settings.size,
        display,
        cells: settings.cells,
        exact_band: None,
    };
    RenderJob {
        uniforms: job.pass_uniforms(0),
        ..job
    }
}

fn corner(v: [f64; 3]) -> [f32; 3] {
    v.map(|x| x.clamp(-INFINITE_BOUND, INFINITE_BOUND) as f32)
}

/// Returns uniforms with the enclosure of an endless scene and the length of shadow rays, and zeros elsewhere.
fn extent_uniforms(settings: &RenderSettings, light_far: f64) -> layout::FrameUniforms {
    let mut uniforms = layout::FrameUniforms {
        light_far: light_far as f32,
        extended_far: settings.extended_far.min(INFINITE_BOUND) as f32,
        ..layout::FrameUniforms::default()
    };
    let Some(enclosure) = &settings.enclosure else {
        return uniforms;
    };
    let bounds = enclosure.bounds;
    if !bounds.is_empty() {
        let bounds = bounds.grown(BOX_MARGIN * finite_size(&bounds));
        uniforms.box_min = corner(bounds.min);
        uniforms.box_max = corner(bounds.max);
    }
    uniforms.exact_half_space_count = enclosure.exact_half_spaces as u32;
    uniforms.solid_half_space_count = enclosure.solid_half_spaces as u32;
    uniforms.solid_depth = enclosure.solid_depth as f32;
    uniforms.half_space_count = enclosure.half_spaces.len() as u32;
    for (plane, half_space) in uniforms.half_spaces.iter_mut().zip(&enclosure.half_spaces) {
        *plane = half_space.map(|v| v as f32);
    }
    uniforms
}

/// Returns the distance from the camera at which rays start. Outside of a finite scene they start on a plane one
/// radius before it. So `f32` keeps its full precision there. Otherwise they start at the camera.
fn approach(settings: &RenderSettings, facts: &FieldFacts, forward: [f64; 3]) -> f64 {
    let is_face_on = settings.is_2d || settings.mode == Mode::Distance;
    if is_face_on || !facts.bounds.is_finite() {
        return 0.0;
    }
    let radius = facts.bounds.half_diagonal() * 1.01;
    let distance = centre_depth(settings, facts, forward) - 2.0 * radius;
    // If rays end inside the scene, the start is not moved.
    let reaches_past_scene = settings.far > distance + 4.0 * radius;
    if radius > 0.0 && distance > 0.0 && reaches_past_scene {
        distance
    } else {
        0.0
    }
}

/// Returns the maximum length of shadow rays. From any point of the finite part of a scene they reach beyond that part,
/// wherever the camera is and its rays end.
fn light_far(settings: &RenderSettings, facts: &FieldFacts, approach: f64) -> f64 {
    let enclosed = settings
        .enclosure
        .as_ref()
        .map(|enclosure| enclosure.bounds);
    let mut parts = [Some(facts.bounds), enclosed].into_iter().flatten();
    let finite = parts.find(|bounds| bounds.is_finite() && !bounds.is_empty());
    let diameter = finite.map_or(0.0, |bounds| 2.0 * bounds.half_diagonal());
    // Twice the diameter: penumbras end beyond the box.
    (settings.far - approach).max(2.0 * diameter)
}

/// Returns the coordinates from which rounding is counted: along rays from `origin`, and at the origin of the scene.
///
/// They are above zero at the origin, too, where a camera may stand on a surface. Near a part, its size counts. Rays that
/// reach a part have its distance as a coordinate. They start up to `start` beside `origin`.
fn rounded_coordinates(
    origin: [f64; 3],
    start: f64,
    settings: &RenderSettings,
    facts: &FieldFacts,
) -> (f64, f64) {
    let parts: &[Bounds] = match settings.parts.is_empty() {
        true => &[facts.bounds],
        false => &settings.parts,
    };
    let min_coordinate_near = |point: [f64; 3], slack: f64| {
        let min_coordinates = parts.iter().map(|part| {
            let distance = (part.distance(point) - slack).max(0.0);
            MIN_COORDINATE_FRACTION * finite_size(part) - distance
        });
        min_coordinates.fold(0.0, f64::max)
    };
    let coordinates = origin.iter().map(|v| v.abs());
    let largest = coordinates.fold(min_coordinate_near(origin, start), f64::max);
    (largest, min_coordinate_near([0.0; 3], 0.0))
}

/// Returns the depth of the scene's centre along the view.
fn centre_depth(settings: &RenderSettings, facts: &FieldFacts, forward: [f64; 3]) -> f64 {
    let to = DVec3::from(facts.bounds.centre()) - DVec3::from(settings.view.from);
    to.dot(forward.into())
}

/// Returns the largest finite side of a box, else the largest finite coordinate, else 1.
fn finite_size(bounds: &Bounds) -> f64 {
    let &Bounds { min, max } = bounds;
    let largest = |lengths: &mut dyn Iterator<Item = f64>| {
        let finite = lengths.filter(|length| length.is_finite() && *length > 0.0);
        finite.reduce(f64::max)
    };
    largest(&mut (0..3).map(|i| max[i] - min[i]))
        .or_else(|| largest(&mut min.into_iter().chain(max).map(f64::abs)))
        .unwrap_or(1.0)
}

/// Returns the nearest and farthest depth of the scene, for greys.
fn depth_range(settings: &RenderSettings, facts: &FieldFacts, forward: [f64; 3]) -> [f64; 2] {
    let distance = settings.view.target_distance();
    if !facts.bounds.is_finite() {
        return [0.0, (2.0 * distance).min(settings.far)];
    }
    let from = settings.view.from;
    if facts.bounds.distance(from) == 0.0 {
        // From inside, a ray ends at the farthest corner.
        let corners = facts.bounds.corners().into_iter();
        let lengths = corners.map(|corner| DVec3::from(corner).distance(from.into()));
        return [0.0, lengths.fold(0.0, f64::max).min(settings.far)];
    }
    let middle = centre_depth(settings, facts, forward);
    let radius = facts.bounds.half_diagonal();
    [
        (middle - radius).max(0.0),
        (middle + radius).min(settings.far),
    ]
}

/// Returns a round number near a tenth of half the view's height: 1, 2 or 5 times a power of ten.
fn spacing(half_height: f64) -> f64 {
    let target = (half_height / 10.0).max(1e-30);
    let power = 10_f64.powf(target.log10().floor());
    let digit = [5.0, 2.0, 1.0]
        .into_iter()
        .find(|digit| target >= digit * power);
    digit.unwrap_or(1.0) * power
}

/// Returns the sum of the weights of all taps.
fn occlusion_weight(kind: Occlusion) -> f32 {
    let taps = 0..kind.taps();
    match kind {
        Occlusion::Off => 0.0,
        Occlusion::FiveTap => {
            taps.map(|i| occlusion::five_tap_weight(i as f32))
                .sum::<f32>()
                / occlusion::MAX_FIVE_TAP_OCCLUSION
        }
        Occlusion::Multi(n) => taps
            .map(|i| occlusion::hemisphere_cosine(i as f32, n as f32))
            .sum(),
    }
}

fn shadow_form(shadow: ResolvedShadow) -> (features::ShadowForm, f64) {
    match shadow {
        ResolvedShadow::None => (features::ShadowForm::None, 0.0),
        ResolvedShadow::Hard => (features::ShadowForm::Hard, 0.0),
        ResolvedShadow::Plain(size) => (features::ShadowForm::Plain, size),
        ResolvedShadow::Soft(size) => (features::ShadowForm::Soft, size),
        ResolvedShadow::Sized(size) => (features::ShadowForm::Sized, size),
    }
}

fn light(light: &ResolvedLight, facts: &FieldFacts) -> layout::LightRecord {
    let (kind, size) = shadow_form(light.shadow);
    let checks = shadow::Checks::new(size, facts.is_raw, facts.has_loose_slopes);
    let (position, is_point) = match light.source {
        LightEmitter::Directional(direction) => (unit(direction), 0.0),
        LightEmitter::Point(position) => (single(position), 1.0),
    };
    layout::LightRecord {
        position,
        is_positional: is_point,
        color: single(light.color),
        size: size.max(1e-5) as f32,
        shadow_form: kind as u32,
        checks: f32::from(checks as u8),
        ..layout::LightRecord::default()
    }
}

fn single(v: [f64; 3]) -> [f32; 3] {
    v.map(|x| x as f32)
}

/// Returns the unit vector, or the y axis for a vector without a direction.
fn unit(v: [f64; 3]) -> [f32; 3] {
    single(DVec3::from(v).normalize_or(DVec3::Y).into())
}

/// Returns the flags of a frame: those for fog, for occlusion over the hemisphere, and for estimated slopes.
fn flags(are_set: [bool; 3]) -> u32 {
    let bits = [
        layout::FOG_FLAG,
        layout::HEMISPHERE_FLAG,
        layout::ESTIMATE_FLAG,
    ];
    let set = are_set.into_iter().zip(bits).filter(|(is_set, _)| *is_set);
    set.fold(0, |flags, (_, bit)| flags | bit)
}
