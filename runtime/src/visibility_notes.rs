//! Notes on pictures that show less than their scene. Nothing may be in view, a camera or a light inside a
//! solid, or a light too faint.

mod buried_parts;
mod buried_rays;
mod deepest_point;
mod thin_parts;
mod uniform_picture;

use crate::render::{
    Image, LightEmitter, Mode, RenderSettings, ResolvedLens, ResolvedLight, ResolvedShadow,
};
use crate::settings::finite_bounds;
use deepest_point::deepest_point;
use glam::DVec3;
use sdfc_shaders::marching;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::{evaluate, evaluate_f64};
use sdfc_vm::program::Module;
use sdfc_vm::vector::V3;

/// Number of sample points of a scene.
const SAMPLE_POINTS: u32 = 8192;
/// Value from which on a point is one at which the field is not defined, or there is no shape.
const MIN_UNDEFINED_VALUE: f32 = 1e8;

/// Brightness that gives less than the first step of grey on a white surface.
const MIN_VISIBLE_LIGHT: f64 = 1.5e-4;

/// Returns notes on what a rendered picture does not show, and why; none for most pictures.
pub fn notes(module: &Module, settings: &RenderSettings, image: &Image) -> Vec<String> {
    let stats = &image.stats;
    if settings.mode == Mode::Distance {
        return Vec::new();
    }
    let mut notes = Vec::new();
    let from = settings.view.from;
    let camera_field = field_at(module, from);
    let is_inside = !settings.is_2d
        && match settings.view.lens {
            // A negative value that is due to rounding is no solid.
            ResolvedLens::Perspective(_) => {
                camera_field < 0.0 && evaluate_f64(&module.distance, from) < 0.0
            }
            ResolvedLens::Orthographic(_) => stats.inside > 0 && stats.hits == 0,
        };
    if is_inside && is_everywhere_inside(module, settings.is_2d) {
        notes.push(format!(
            "all of space is inside: the field is below zero at all of {SAMPLE_POINTS} sampled points. Negate it, or \
             cut a piece with `& box(…)`"
        ));
    } else if is_inside {
        let advice = match is_in_half_space(settings, from) {
            true => {
                "A floor, a wall or a ceiling without an end is there: move the camera to its other side, or leave it \
                 out of this view"
            }
            false => {
                "Move it out; of a solid without an end, such as `!shape`, cut a piece with `& box(…)`; negate a field \
                 that is positive inside"
            }
        };
        notes.push(format!(
            "the camera is inside a solid: at {} the field is {}. {advice}",
            format_point(from),
            format_number(f64::from(camera_field))
        ));
    }
    let drawn_pixels = stats.hits + stats.inside + stats.step_caps + stats.nans;
    // Lines thinner than a pixel are seen, though the middle of no pixel lies in them.
    let covers_nothing = drawn_pixels == 0 && image.color.iter().all(|color| color[3] == 0.0);
    if settings.is_2d && image.color.iter().all(|color| color[3] == 1.0) {
        notes.push(format!(
            "all of the picture is inside of the shape, and no edge is in view: it shows {} by {} around {}. Another \
             `height` of the camera or `--ortho HEIGHT` shows more, or less",
            format_number(height_of(settings) * f64::from(settings.size[0]) / f64::from(settings.size[1])),
            format_number(height_of(settings)),
            format_point(settings.view.look)
        ));
    }
    if covers_nothing && !is_inside && stats.misses > 0 {
        notes.push(format!(
            "nothing is seen: {}",
            nothing_visible_reason(module, settings)
        ));
    }
    if !settings.is_2d {
        let lights = settings.lighting.lights.iter();
        notes.extend(lights.filter_map(|light| dark_light_note(module, settings, light)));
        if !is_inside {
            notes.extend(buried_rays::note(module, settings, image));
            let buried_parts = buried_parts::note(settings);
            notes.extend(buried_parts.or_else(|| uniform_picture::note(settings, image)));
        }
        if !covers_nothing {
            notes.extend(thin_parts::note(settings, &module.settings.bounds));
        }
    }
    notes
}

/// Reports whether a point is deep in one of the solid half spaces of an endless scene.
fn is_in_half_space(settings: &RenderSettings, point: [f64; 3]) -> bool {
    settings.enclosure.iter().any(|enclosure| {
        let mut solid = enclosure.half_spaces[..enclosure.solid_half_spaces].iter();
        solid.any(|&[x, y, z, offset]| {
            let height = DVec3::from(point).dot(DVec3::new(x, y, z)) + offset;
            height < -enclosure.solid_depth
        })
    })
}

/// Powers of ten by which sample points are scaled, where nothing says how large a solid is.
const SAMPLE_SCALES: std::ops::Range<i32> = -2..16;

/// Reports whether no point outside of the solid is known. Beyond a side of its box, all points are outside.
fn is_everywhere_inside(module: &Module, is_2d: bool) -> bool {
    let bounds = &module.settings.bounds;
    let mut sides = bounds.min.into_iter().chain(bounds.max);
    let mut values = samples(module, bounds, is_2d).flat_map(|(_, p)| {
        SAMPLE_SCALES.map(move |power| field_at(module, p.map(|v| v * 10_f64.powi(power))))
    });
    sides.all(f64::is_infinite) && values.all(|value| value < 0.0)
}

/// Returns the height of an orthographic view.
fn height_of(settings: &RenderSettings) -> f64 {
    match settings.view.lens {
        ResolvedLens::Orthographic(height) => height,
        ResolvedLens::Perspective(_) => f64::NAN,
    }
}

/// Explains why a light has no visible effect, if it has none.
fn dark_light_note(
    module: &Module,
    settings: &RenderSettings,
    light: &ResolvedLight,
) -> Option<String> {
    let position = match light.source {
        LightEmitter::Point(position) => position,
        LightEmitter::Directional(direction) => {
            return buried_light_note(settings, light, direction);
        }
    };
    let surface_distance = f64::from(field_at(module, position));
    if surface_distance < 0.0 {
        return (light.shadow != ResolvedShadow::None).then(|| {
            format!(
                "the light at {} is inside a solid, which blocks all of its light: move it out, or give it \
                 `shadow: none`",
                format_point(position)
            )
        });
    }
    let max_component = light.color.into_iter().fold(0.0, f64::max);
    let arriving = max_component * settings.exposure / (surface_distance * surface_distance);
    let is_faint =
        settings.mode == Mode::Shaded && max_component > 0.0 && arriving < MIN_VISIBLE_LIGHT;
    is_faint.then(|| {
        format!(
            "the light at {} is too faint to be visible: it falls off with the square of the distance, and the nearest \
             surface is {} away. {} times its `intensity` makes it as bright there as it is one unit away",
            format_point(position),
            format_number(surface_distance),
            format_number((surface_distance * surface_distance).round())
        )
    })
}

/// Sine of the angle below a floor from which on light counts as coming from below.
const MIN_BURIED_SINE: f64 = 1e-3;

/// Explains why a light at infinity has no visible effect: it shines through an endless solid, such as a floor.
fn buried_light_note(
    settings: &RenderSettings,
    light: &ResolvedLight,
    direction: [f64; 3],
) -> Option<String> {
    let solids = settings.enclosure.iter().flat_map(|enclosure| {
        let solid = &enclosure.half_spaces[..enclosure.solid_half_spaces];
        solid.iter().map(|&[x, y, z, _]| DVec3::new(x, y, z))
    });
    let solids: Vec<DVec3> = solids.collect();
    let is_blocked = |to_light: DVec3| {
        let mut normals = solids.iter();
        normals.any(|normal| normal.dot(to_light) < -MIN_BURIED_SINE)
    };
    let to_light = DVec3::from(direction).normalize_or_zero();
    if !is_blocked(to_light) || light.shadow == ResolvedShadow::None {
        return None;
    }
    let outwards = solids.iter().fold(to_light, |to_light, normal| {
        to_light - *normal * (2.0 * normal.dot(to_light).min(0.0))
    });
    let meant = [-to_light, outwards]
        .into_iter()
        .find(|&it| !is_blocked(it));
    let advice = meant.map_or(String::new(), |meant| {
        // Without negative zeros.
        let meant = (meant + DVec3::ZERO).to_array();
        format!("perhaps `dir: {}` was meant; or ", format_point(meant))
    });
    Some(format!(
        "the light from {} shines through a floor, a wall or a ceiling without an end, which blocks all of it. `dir` points \
         from the scene towards the light: {advice}give it `shadow: none`",
        format_point(direction)
    ))
}

/// Returns the field at a point in `f32`, as engines evaluate it.
fn field_at(module: &Module, p: [f64; 3]) -> f32 {
    let [x, y, z] = p.map(|v| v as f32);
    evaluate::<f32>(&module.distance, V3 { x, y, z })
}

fn nothing_visible_reason(module: &Module, settings: &RenderSettings) -> String {
    let bounds = &module.settings.bounds;
    if bounds.is_empty() {
        return "the scene has no solid, its field is nowhere below zero. Perhaps all of it is cut away, or \
                a list is empty"
            .to_owned();
    }
    let (min_value, min_point) = deepest_point(module, &finite_bounds(bounds), settings.is_2d);
    if min_value > MIN_UNDEFINED_VALUE {
        return format!(
            "the field is not defined at any of {SAMPLE_POINTS} sampled points, where it takes a root or a logarithm of \
             a negative number, for example. Such points are outside"
        );
    }
    if min_value >= 0.0 {
        return format!(
            "the field is nowhere below zero at {SAMPLE_POINTS} sampled points and along descents from the lowest of them. \
             It is {} at least, near {}. \
             Perhaps all of it is cut away; or the field has no sign, and a surface is where the sign changes: \
             give it a thickness, such as `.offset(0.01)`",
            format_number(f64::from(min_value)),
            format_point(min_point)
        );
    }
    let extent_text = format!(
        "the scene lies between {} and {}",
        format_point(bounds.min),
        format_point(bounds.max)
    );
    let view = &settings.view;
    let from = DVec3::from(view.from);
    let view_direction = DVec3::from(view.look) - from;
    let is_ahead = |p: [f64; 3]| (DVec3::from(p) - from).dot(view_direction) > 0.0;
    let looks_away = !bounds.corners().into_iter().any(is_ahead);
    if !settings.is_2d && bounds.is_finite() && looks_away {
        return format!(
            "the camera at {} looks away, towards {}, and {extent_text}",
            format_point(view.from),
            format_point(view.look)
        );
    }
    let depth = min_visible_depth(min_point, view.from);
    if !settings.is_2d && f64::from(min_value) > -depth {
        return format!(
            "the deepest of {SAMPLE_POINTS} sampled points is {} inside of a surface, and coordinates as large as \
             these are rounded by more: at least {} are required. Draw the scene nearer to the origin and to the \
             camera, or make thin parts thicker",
            format_number(f64::from(-min_value)),
            format_number(depth)
        );
    }
    if settings.is_2d || !bounds.is_finite() {
        return format!(
            "no ray from {} towards {} meets a surface, and the field is below zero near {}",
            format_point(view.from),
            format_point(view.look),
            format_point(min_point)
        );
    }
    let size = bounds.half_diagonal();
    let centre = bounds.centre();
    let distance = from.distance(centre.into());
    if distance - size > settings.far {
        return format!(
            "{extent_text}, and rays go no farther than {} (`far`)",
            format_number(settings.far)
        );
    }
    let half = match view.lens {
        ResolvedLens::Perspective(fov) => distance * (fov / 2.0).tan(),
        ResolvedLens::Orthographic(height) => height / 2.0,
    };
    let pixels = size / half * f64::from(settings.size[1]);
    if pixels < 2.0 {
        return format!(
            "the scene is {} pixels high from {}, and {extent_text}",
            format_number(pixels),
            format_point(view.from)
        );
    }
    let axis = view_direction.normalize_or_zero();
    let to_centre = DVec3::from(centre) - from;
    if (to_centre - axis * to_centre.dot(axis)).length() < half {
        let thickness = f64::from(-min_value) / half * f64::from(settings.size[1]);
        return format!(
            "no ray meets the scene, which is in view. Its thickest part is about {} pixels wide, by \
             {SAMPLE_POINTS} sampled points and descents from them. Go nearer, or draw a larger picture",
            format_number(thickness)
        );
    }
    format!(
        "the camera at {} looks past it, towards {}, and {extent_text}: `look: {}` shows it",
        format_point(view.from),
        format_point(view.look),
        format_point(centre)
    )
}

/// Returns the depth that a solid at a point needs to exceed rounding, seen from another point.
fn min_visible_depth(point: [f64; 3], camera: [f64; 3]) -> f64 {
    let max_coordinate = point.into_iter().chain(camera);
    let max_coordinate = max_coordinate.map(f64::abs).fold(0.0, f64::max);
    let along = marching::rounding_at(
        DVec3::from(point).distance(camera.into()),
        marching::ROUNDING_PER_UNIT * max_coordinate,
    );
    let [x, y, z] = point;
    let rounding = marching::rounding_near::<f64>(V3 { x, y, z }, along, 0.0);
    marching::sign_margin(rounding, 1.0, 0.0)
}

/// Returns the values of the field at points spread over the shown region, with the points.
fn samples(module: &Module, bounds: &Bounds, is_2d: bool) -> impl Iterator<Item = (f32, [f64; 3])> {
    let shown = finite_bounds(bounds);
    let points = (1..=SAMPLE_POINTS).map(move |number| {
        let [x, y, z] = shown.quasi_random_point(number);
        [x, y, if is_2d { 0.0 } else { z }]
    });
    points.map(|p| (field_at(module, p), p))
}

/// Formats a point with three digits per coordinate.
fn format_point(p: [f64; 3]) -> String {
    let [x, y, z] = p.map(format_number);
    format!("[{x}, {y}, {z}]")
}

/// Formats a number with three digits.
fn format_number(v: f64) -> String {
    if v == 0.0 || !v.is_finite() {
        // Without the sign of a negative zero.
        return (v + 0.0).to_string();
    }
    let digits = 2 - v.abs().log10().floor() as i32;
    match digits {
        -4..=6 => {
            let unit = 10.0_f64.powi(digits);
            ((v * unit).round() / unit).to_string()
        }
        _ => format!("{v:.2e}"),
    }
}
