//! Reasons for a picture that shows less than its scene: nothing in view, a camera or a light within a solid, a lamp that
//! is too faint.

use crate::frame::{Lens, Light, Mode, RenderSettings, Shadow, Source, Stats};
use crate::settings::shown;
use sdfc_shaders::marching;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::evaluate;
use sdfc_vm::program::Module;
use sdfc_vm::vector::V3;

/// The number of points of a scene that are asked.
const POINTS: u32 = 8192;

/// The light that makes less than the first step of grey, on a white surface.
const FAINT: f64 = 1.5e-4;

/// Tells what a picture that was drawn does not show, and why; nothing of most.
pub fn notes(module: &Module, settings: &RenderSettings, stats: &Stats) -> Vec<String> {
    if settings.mode == Mode::Distance {
        return Vec::new();
    }
    let mut notes = Vec::new();
    let from = settings.view.from;
    let here = field(module, from);
    let is_within = !settings.plane
        && match settings.view.lens {
            Lens::Perspective(_) => here < 0.0,
            Lens::Orthographic(_) => stats.inside > 0 && stats.hits == 0,
        };
    if is_within {
        notes.push(format!(
            "the camera is inside a solid: at {} the field is {}. Move it out; of a solid without an end, \
             such as `!shape`, cut a piece with `& box(…)`",
            place(from),
            short(f64::from(here))
        ));
    }
    let seen = stats.hits + stats.inside + stats.step_caps + stats.nans;
    if seen == 0 && !is_within && stats.misses > 0 {
        notes.push(format!("nothing is seen: {}", reason(module, settings)));
    }
    if !settings.plane {
        let lights = settings.lighting.lights.iter();
        notes.extend(lights.filter_map(|light| lost(module, settings, light)));
    }
    notes
}

/// Tells why a lamp lights nothing, if that is so.
fn lost(module: &Module, settings: &RenderSettings, light: &Light) -> Option<String> {
    let Source::Point(at) = light.source else {
        return None;
    };
    let apart = f64::from(field(module, at));
    if apart < 0.0 {
        return (light.shadow != Shadow::None).then(|| {
            format!(
                "the light at {} is inside a solid, which keeps all of its light: move it out, or give it \
                 `shadow: none`",
                place(at)
            )
        });
    }
    let brightest = light.color.into_iter().fold(0.0, f64::max);
    let arriving = brightest * settings.exposure / (apart * apart);
    let is_faint = settings.mode == Mode::Shaded && brightest > 0.0 && arriving < FAINT;
    is_faint.then(|| {
        format!(
            "the light at {} is too faint to be seen: it falls off with the square of the distance, and the nearest \
             surface is {} away. {} times its `intensity` is there what this is one unit away",
            place(at),
            short(apart),
            short((apart * apart).round())
        )
    })
}

/// The field at a point, as engines find it.
fn field(module: &Module, p: [f64; 3]) -> f32 {
    let [x, y, z] = p.map(|v| v as f32);
    evaluate::<f32>(&module.distance, V3 { x, y, z })
}

fn reason(module: &Module, settings: &RenderSettings) -> String {
    let bounds = &module.settings.bounds;
    if bounds.is_empty() {
        return "the scene has no solid, its field is nowhere below zero. Perhaps all of it is cut away, or \
                a list is empty"
            .to_owned();
    }
    let (least, at) = least_of(module, bounds, settings.plane);
    if least >= 0.0 {
        return format!(
            "the field is nowhere below zero at {POINTS} points that were tried, and {} at least, near {}. \
             Perhaps all of it is cut away; or the field has no sign, and a surface is where the sign changes: \
             give it a thickness, such as `.offset(0.01)`",
            short(f64::from(least)),
            place(at)
        );
    }
    let view = &settings.view;
    let depth = rounded_off(at, view.from);
    if !settings.plane && f64::from(least) > -depth {
        return format!(
            "the deepest of {POINTS} points that were tried is {} inside of a surface, and coordinates as large as \
             these are rounded by more: at least {} are wanted. Draw the scene nearer to the origin and to the \
             camera, or make what is thin thicker",
            short(f64::from(-least)),
            short(depth)
        );
    }
    if settings.plane || !bounds.is_finite() {
        return format!(
            "no ray from {} towards {} meets a surface, and the field is below zero near {}",
            place(view.from),
            place(view.look),
            place(at)
        );
    }
    let lies = format!(
        "the scene lies between {} and {}",
        place(bounds.min),
        place(bounds.max)
    );
    let way: [f64; 3] = std::array::from_fn(|i| view.look[i] - view.from[i]);
    let ahead = |p: &[f64; 3]| (0..3).map(|i| (p[i] - view.from[i]) * way[i]).sum::<f64>() > 0.0;
    if !bounds.corners().iter().any(ahead) {
        return format!(
            "the camera at {} looks away, towards {}, and {lies}",
            place(view.from),
            place(view.look)
        );
    }
    let size = bounds.half_diagonal();
    let centre = bounds.centre();
    let apart = (0..3).map(|i| (centre[i] - view.from[i]).powi(2));
    let distance = apart.sum::<f64>().sqrt();
    if distance - size > settings.far {
        return format!(
            "{lies}, and rays go no farther than {} (`far`)",
            short(settings.far)
        );
    }
    let half = match view.lens {
        Lens::Perspective(fov) => distance * (fov / 2.0).tan(),
        Lens::Orthographic(height) => height / 2.0,
    };
    let pixels = size / half * f64::from(settings.size[1]);
    if pixels < 2.0 {
        return format!(
            "the scene is {} pixels high from {}, and {lies}",
            short(pixels),
            place(view.from)
        );
    }
    format!(
        "the camera at {} looks past it, towards {}, and {lies}: `look: {}` shows it",
        place(view.from),
        place(view.look),
        place(centre)
    )
}

/// The depth that a solid at a place needs to be told from rounding, seen from another one.
fn rounded_off(at: [f64; 3], from: [f64; 3]) -> f64 {
    let largest = at.into_iter().chain(from);
    let largest = largest.map(f64::abs).fold(0.0, f64::max);
    let apart: f64 = (0..3).map(|i| (at[i] - from[i]).powi(2)).sum();
    let rounding = marching::rounding_at(apart.sqrt(), marching::ROUNDING * largest);
    marching::noise(rounding, 1.0, 0.0)
}

/// The least value of the field at points spread over what is seen, and where it is.
fn least_of(module: &Module, bounds: &Bounds, plane: bool) -> (f32, [f64; 3]) {
    let shown = shown(bounds);
    let points = (1..=POINTS).map(|number| {
        let [x, y, z] = shown.spread(number);
        [x, y, if plane { 0.0 } else { z }]
    });
    let values = points.map(|p| (field(module, p), p));
    values
        .filter(|(value, _)| !value.is_nan())
        .min_by(|(a, _), (b, _)| a.total_cmp(b))
        .unwrap_or((f32::INFINITY, shown.centre()))
}

/// A point with three digits of each coordinate.
fn place(p: [f64; 3]) -> String {
    let [x, y, z] = p.map(short);
    format!("[{x}, {y}, {z}]")
}

/// A number with three digits.
fn short(v: f64) -> String {
    if v == 0.0 || !v.is_finite() {
        return v.to_string();
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
