//! From what is asked for to the numbers that CPU and GPU compute with.

use super::{
    CellUse, Display, FieldFacts, Frame, Lens, Light, RenderSettings, Shadow, Source, Stats,
    Status, View,
};
use sdfc_shaders::assemble::shows_light;
use sdfc_shaders::features::{self, Features, Mode, Occlusion};
use sdfc_shaders::{layout, marching, normals, occlusion, shadow};

/// A picture ready to be computed.
#[derive(Clone, Debug)]
pub struct Picture {
    /// What its kernels contain.
    pub features: Features,
    /// Its numbers, for the whole picture as one tile and the first pass over subpixels.
    pub uniforms: layout::Frame,
    /// Its lights.
    pub lights: Vec<layout::Light>,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// How its colours become bytes.
    pub display: Display,
    /// Whether space is cut into cells.
    pub cells: CellUse,
    /// How far from zero a figure's field may be told by its sign alone, if that is not what its
    /// mode says.
    pub band: Option<f32>,
}

impl Picture {
    /// How many passes over subpixels it takes.
    pub fn passes(&self) -> u32 {
        self.uniforms.samples
    }

    /// The numbers of a pass over subpixels: where in its pixel the ray goes.
    pub fn pass(&self, sample: u32) -> layout::Frame {
        let side = f64::from(self.uniforms.samples).sqrt().round() as u32;
        let place = |i: u32| (i as f32 + 0.5) / side as f32 - 0.5;
        layout::Frame {
            sample,
            offset: [place(sample % side), place(sample / side)],
            ..self.uniforms
        }
    }

    /// Whether it shows the field on a plane instead of surfaces in space.
    pub fn shows_plane(&self) -> bool {
        self.features.plane || self.features.mode == Mode::Distance
    }

    /// A frame of its size in which nothing was hit.
    pub fn blank(&self) -> Frame {
        let [width, height] = self.size.map(|n| n as usize);
        let count = width * height;
        Frame {
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

/// Where the rays of a picture start and go, in full precision: a pixel at the place (x, y) in
/// the view, from (-1, -1) to (1, 1), has a ray that starts at `origin + x origin_right +
/// y origin_up` and goes along `forward + x forward_right + y forward_up`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes {
    /// Where the ray in the middle starts.
    pub origin: [f64; 3],
    /// From there to where the ray in the middle of the right edge starts.
    pub origin_right: [f64; 3],
    /// The same for the upper edge.
    pub origin_up: [f64; 3],
    /// Which way the ray in the middle goes, as a unit vector.
    pub forward: [f64; 3],
    /// How the direction changes towards the right edge.
    pub forward_right: [f64; 3],
    /// The same for the upper edge.
    pub forward_up: [f64; 3],
}

impl Axes {
    /// Those of a picture with these settings.
    pub fn of(settings: &RenderSettings) -> Self {
        let [width, height] = settings.size.map(|n| f64::from(n.max(1)));
        Self::of_view(&settings.view, width / height)
    }

    /// Those of a view in a picture so many times as wide as it is high.
    pub fn of_view(view: &View, aspect: f64) -> Self {
        let forward = unit(sub(view.look, view.from), [0.0, 0.0, -1.0]);
        // An up along the view says nothing; then any direction across it will do.
        let across = cross(forward, view.up);
        let right = if length(across) > 1e-9 * length(view.up) {
            unit(across, [1.0, 0.0, 0.0])
        } else {
            let other = if forward[1].abs() < 0.9 {
                [0.0, 1.0, 0.0]
            } else {
                [0.0, 0.0, -1.0]
            };
            unit(cross(forward, other), [1.0, 0.0, 0.0])
        };
        let up = cross(right, forward);
        let (start, growth) = spans(view.lens);
        Self {
            origin: view.from,
            origin_right: scaled(right, start * aspect),
            origin_up: scaled(up, start),
            forward,
            forward_right: scaled(right, growth * aspect),
            forward_up: scaled(up, growth),
        }
    }

    /// The same rays, which start on the plane so far ahead.
    fn ahead(self, way: f64) -> Self {
        let moved = |from: [f64; 3], along: [f64; 3]| {
            std::array::from_fn(|axis| from[axis] + along[axis] * way)
        };
        Self {
            origin: moved(self.origin, self.forward),
            origin_right: moved(self.origin_right, self.forward_right),
            origin_up: moved(self.origin_up, self.forward_up),
            ..self
        }
    }
}

/// Half the height of the view, at the start of the rays and per unit of the way.
fn spans(lens: Lens) -> (f64, f64) {
    match lens {
        Lens::Perspective(fov) => (0.0, (fov.clamp(1e-6, 3.1) / 2.0).tan()),
        Lens::Orthographic(height) => (height / 2.0, 0.0),
    }
}

/// What stands for an infinite bound: far beyond any scene, and its square is still a number.
const ENDLESS: f64 = 1e18;

/// Turns settings and what is known of the field into a picture's numbers.
pub fn prepare(settings: &RenderSettings, facts: &FieldFacts) -> Picture {
    let view = &settings.view;
    let axes = Axes::of(settings);
    let [width, height] = settings.size.map(|n| f64::from(n.max(1)));
    let aa = settings.aa.max(1);
    let distance = length(sub(view.look, view.from));
    let (start, growth) = spans(view.lens);
    let approach = approach(settings, facts, axes.forward);
    let axes = axes.ahead(approach);
    let start = start + growth * approach;
    let lighting = &settings.lighting;
    let largest = axes
        .origin
        .iter()
        .fold(0.0_f64, |most, v| most.max(v.abs()));
    let bounds = facts.bounds.grown(1e-3 * finite_size(facts));
    let corner = |v: [f64; 3]| v.map(|x| x.clamp(-ENDLESS, ENDLESS) as f32);
    let material = facts.material.unwrap_or_default();
    let count = lighting.lights.len() as u32;
    let lights: Vec<layout::Light> = lighting
        .lights
        .iter()
        .map(|lamp| layout::Light {
            count,
            ..light(lamp)
        })
        .collect();
    let foggy = lighting.fog.is_some_and(|density| density > 0.0);
    let hemisphere = matches!(settings.occlusion, Occlusion::Multi(_));
    let choice = |holds: bool, bit: u32| if holds { bit } else { 0 };
    let pixels = settings.size[0] * settings.size[1];
    let uniforms = layout::Frame {
        origin: single(axes.origin),
        far: (settings.far - approach) as f32,
        origin_right: single(axes.origin_right),
        raw: if facts.raw { 1.0 } else { 0.0 },
        origin_up: single(axes.origin_up),
        rounding: (marching::ROUNDING * (largest + start)) as f32,
        forward: single(axes.forward),
        footprint: (start / height / f64::from(aa)) as f32,
        forward_right: single(axes.forward_right),
        footprint_growth: (growth / height / f64::from(aa)) as f32,
        forward_up: single(axes.forward_up),
        cone: settings.cone as f32,
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
        sky_up: single(unit(lighting.up, [0.0, 1.0, 0.0])),
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
        steps: settings.steps.max(1),
        shadow_steps: shadow::STEPS,
        capacity: pixels.saturating_mul(count.max(1)),
        lights: count,
        approach: approach as f32,
        relaxation: settings.relaxation as f32,
        occlusion_taps: settings.occlusion.taps() as f32,
        normal_spread: normals::spread(settings.normals),
        normal_taps: normals::first_in_table(settings.normals) as u32,
        choices: choice(foggy, layout::FOG) | choice(hemisphere, layout::HEMISPHERE),
        ..layout::Frame::default()
    };
    let features = Features {
        mode: settings.mode,
        lights: lighting
            .lights
            .iter()
            .map(|light| form(light.shadow).0)
            .collect(),
        occlusion: settings.occlusion,
        normals: settings.normals,
        materials: facts.material.is_none(),
        fog: foggy,
        plane: settings.plane,
        general: false,
    };
    let display = Display {
        exposure: settings.exposure as f32,
        tonemap: settings.tonemap,
        light: shows_light(settings.mode),
        scene: settings.mode == Mode::Shaded && !settings.plane,
    };
    let picture = Picture {
        features,
        uniforms,
        lights,
        size: settings.size,
        display,
        cells: settings.cells,
        band: None,
    };
    Picture {
        uniforms: picture.pass(0),
        ..picture
    }
}

/// An eye is far away from what is this many times as near to it as it is large.
const FAR_AWAY: f64 = 32.0;

/// How far ahead of the eye rays start. From far away (a telescope's view, a camera at 1e6) nothing
/// is lost of what `f32` can say about places near the scene if rays start on a plane near it; else
/// they start at the eye.
fn approach(settings: &RenderSettings, facts: &FieldFacts, forward: [f64; 3]) -> f64 {
    let flat = settings.plane || settings.mode == Mode::Distance;
    if flat || !facts.bounds.is_finite() {
        return 0.0;
    }
    let reach = facts.bounds.half_diagonal() * 1.01;
    let to = sub(facts.bounds.centre(), settings.view.from);
    let way = dot(to, forward) - 2.0 * reach;
    // Where rays end in the midst of the scene, shadows reach no farther than they do.
    let whole = settings.far > way + 4.0 * reach;
    if reach > 0.0 && way > FAR_AWAY * reach && whole {
        way
    } else {
        0.0
    }
}

/// The largest side of the bounds that is not infinite, else the farthest of their ends from the origin, else 1.
fn finite_size(facts: &FieldFacts) -> f64 {
    let [min, max] = [facts.bounds.min, facts.bounds.max];
    let largest = |lengths: &mut dyn Iterator<Item = f64>| {
        let finite = lengths.filter(|length| length.is_finite() && *length > 0.0);
        finite.reduce(f64::max)
    };
    largest(&mut (0..3).map(|i| max[i] - min[i]))
        .or_else(|| largest(&mut min.into_iter().chain(max).map(f64::abs)))
        .unwrap_or(1.0)
}

/// The near and far end of the scene as seen from the camera, for greys.
fn depth_range(settings: &RenderSettings, facts: &FieldFacts, forward: [f64; 3]) -> [f64; 2] {
    let distance = length(sub(settings.view.look, settings.view.from));
    if !facts.bounds.is_finite() {
        return [0.0, (2.0 * distance).min(settings.far)];
    }
    let to = sub(facts.bounds.centre(), settings.view.from);
    let (middle, reach) = (dot(to, forward), facts.bounds.half_diagonal());
    [
        (middle - reach).max(0.0),
        (middle + reach).min(settings.far),
    ]
}

/// A round number near a tenth of half the view's height: 1, 2 or 5 times a power of ten.
fn spacing(half_height: f64) -> f64 {
    let wanted = (half_height / 10.0).max(1e-30);
    let power = 10_f64.powf(wanted.log10().floor());
    let digit = [5.0, 2.0, 1.0]
        .into_iter()
        .find(|digit| wanted >= digit * power);
    digit.unwrap_or(1.0) * power
}

/// What the weights of all taps sum to.
fn occlusion_weight(kind: Occlusion) -> f32 {
    let taps = 0..kind.taps();
    match kind {
        Occlusion::Off => 0.0,
        Occlusion::FiveTap => {
            taps.map(|i| occlusion::five_weight(i as f32)).sum::<f32>() / occlusion::FIVE_MOST
        }
        Occlusion::Multi(n) => taps
            .map(|i| occlusion::many_cosine(i as f32, n as f32))
            .sum(),
    }
}

fn form(shadow: Shadow) -> (features::Shadow, f64) {
    match shadow {
        Shadow::None => (features::Shadow::None, 0.0),
        Shadow::Hard => (features::Shadow::Hard, 0.0),
        Shadow::Plain(size) => (features::Shadow::Plain, size),
        Shadow::Improved(size) => (features::Shadow::Improved, size),
        Shadow::Sized(size) => (features::Shadow::Sized, size),
    }
}

fn light(light: &Light) -> layout::Light {
    let (form, size) = form(light.shadow);
    let (place, near) = match light.source {
        Source::Directional(direction) => (unit(direction, [0.0, 1.0, 0.0]), 0.0),
        Source::Point(place) => (place, 1.0),
    };
    layout::Light {
        place: single(place),
        near,
        color: single(light.color),
        size: size.max(1e-5) as f32,
        shadow: form as u32,
        ..layout::Light::default()
    }
}

fn single(v: [f64; 3]) -> [f32; 3] {
    v.map(|x| x as f32)
}
fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
fn scaled(a: [f64; 3], by: f64) -> [f64; 3] {
    a.map(|x| x * by)
}
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}
fn length(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}
/// The direction of length one, or `otherwise` for a vector that has none.
fn unit(a: [f64; 3], otherwise: [f64; 3]) -> [f64; 3] {
    let size = length(a);
    if size > 0.0 && size.is_finite() {
        scaled(a, 1.0 / size)
    } else {
        otherwise
    }
}
