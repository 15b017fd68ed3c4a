//! Reports of the error of single precision in a scene.

use crate::scene::OpenedScene;
use sdfc_runtime::render::RenderSettings;
use sdfc_runtime::rounding::{ErrorBound, FAR_SAMPLE_DISTANCE, Rounding, rounding, visible_error};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_vm::bounds::Bounds;
use serde_json::{Value, json};

/// Error in pixels above which there is a warning.
const MIN_VISIBLE_PIXELS: f64 = 1.0;
/// Error in pixels above which its size is meaningless.
const MAX_MEANINGFUL_PIXELS: f64 = 1e6;

/// Returns the rounding error of a scene; `None` where its settings make no picture.
pub(crate) fn for_scene(opened: &OpenedScene) -> Option<Rounding> {
    let settings = resolve(
        opened.module(),
        &opened.uniform_values,
        &Overrides::default(),
    )
    .ok()?;
    Some(rounding(opened.module(), &opened.uniform_values, &settings))
}

/// Returns the facts for people, a line each.
pub(crate) fn report_lines(rounding: &Rounding) -> Vec<String> {
    let in_bounds = rounding.in_bounds.map(|worst| {
        let error = largest(&worst, |error| format!("{error:.1e}"));
        format!("{error} within the bounds")
    });
    let far_error = rounding.far.is_finite().then_some(rounding.far);
    let far_error =
        far_error.map(|error| format!("{error:.1e} at {FAR_SAMPLE_DISTANCE:e} from the origin"));
    let field_errors: Vec<_> = in_bounds.into_iter().chain(far_error).collect();
    let field_errors = (!field_errors.is_empty()).then(|| field_errors.join(", "));
    let in_picture = rounding.visible.map(|worst| {
        let error = largest(&worst, |error| format!("{} pixels", pixels(error)));
        format!("{error} in the picture")
    });
    field_errors.into_iter().chain(in_picture).collect()
}

/// Formats the largest error.
///
/// It is `at most` a bound over boxes where that is settled. Elsewhere it is `about` the error found at
/// points, as beside discontinuities, on whose two sides a box has different fields. Few boxes of long
/// programs are evaluated, so that no point may be found.
fn largest(worst: &ErrorBound, format_error: impl Fn(f64) -> String) -> String {
    if !worst.upper_bound.is_finite() && worst.largest_found == 0.0 {
        "not known".to_owned()
    } else if worst.is_settled() || worst.largest_found == 0.0 {
        format!("at most {}", format_error(worst.upper_bound))
    } else {
        format!("about {}", format_error(worst.largest_found))
    }
}

/// Formats a number of pixels with two digits.
fn pixels(number: f64) -> String {
    match number {
        number if number < 0.01 => format!("{number:.1e}"),
        number if number < 10.0 => format!("{number:.2}"),
        number if number < 1e4 => format!("{number:.0}"),
        number => format!("{number:.1e}"),
    }
}

/// Returns a warning that rounding is visible, with advice.
pub(crate) fn warning(opened: &OpenedScene, rounding: &Rounding) -> Option<String> {
    visible_error_warning(opened, rounding.visible)
}

/// Returns that warning for a picture with these settings.
pub(crate) fn warning_in(opened: &OpenedScene, settings: &RenderSettings) -> Option<String> {
    let error = visible_error(opened.module(), &opened.uniform_values, settings);
    visible_error_warning(opened, error)
}

fn visible_error_warning(opened: &OpenedScene, error: Option<ErrorBound>) -> Option<String> {
    let worst = error.filter(|worst| worst.largest_found > MIN_VISIBLE_PIXELS)?;
    if let Some(size) = tiny_size(&opened.module().settings.bounds) {
        return Some(format!(
            "the scene is {size:.0e} large: f32 cannot represent the squares of such lengths, so surfaces move or \
             vanish. Measure its lengths in a smaller unit, so that the scene is about 1 large"
        ));
    }
    if worst.is_unbounded {
        return Some(
            "the field overflows f32, as high powers do, and the picture may show surfaces that do not exist: \
             stop its iterations earlier, or take a logarithm of their results"
                .to_owned(),
        );
    }
    if worst.largest_found > MAX_MEANINGFUL_PIXELS {
        return Some(
            "rounding decides which surface is visible: the field is nearly zero at the camera. Move the camera \
             away from the surface, or keep the field from fading to zero"
                .to_owned(),
        );
    }
    Some(format!(
        "rounding may move surfaces by {} pixels: f32 has 7 digits, so move the scene and the \
         camera nearer to the origin, or enlarge the scene without moving it farther away",
        pixels(worst.largest_found)
    ))
}

/// Returns the size of a scene that is too small for `f32`: the squares of its lengths are not normal numbers,
/// or have fewer digits.
fn tiny_size(bounds: &Bounds) -> Option<f64> {
    let size = 2.0 * bounds.half_diagonal();
    let min_size = f64::from(f32::MIN_POSITIVE / f32::EPSILON).sqrt();
    (bounds.is_finite() && !bounds.is_empty() && size < min_size).then_some(size)
}

/// Returns the facts as JSON, which has no infinity: unknown numbers are null.
pub(crate) fn as_json(rounding: &Rounding) -> Value {
    let number = |v: f64| if v.is_finite() { json!(v) } else { Value::Null };
    let worst = |worst: Option<ErrorBound>| match worst {
        Some(worst) => {
            json!({ "at_most": number(worst.upper_bound), "found": number(worst.largest_found) })
        }
        None => Value::Null,
    };
    json!({
        "within": worst(rounding.in_bounds),
        "afar": { "distance": FAR_SAMPLE_DISTANCE, "error": number(rounding.far) },
        "pixels": worst(rounding.visible),
    })
}
