//! What there is to say about how far single precision is off in a scene.

use crate::scene::Opened;
use sdfc_runtime::frame::RenderSettings;
use sdfc_runtime::rounding::{AFAR, Rounding, Worst, rounding, seen};
use sdfc_runtime::settings::{Overrides, resolve};
use serde_json::{Value, json};

/// From how many pixels on an error is worth a warning.
const VISIBLE: f64 = 1.0;
/// The number of pixels from which on an error says nothing about its size.
const SENSELESS: f64 = 1e6;

/// How far off a scene is by rounding; `None` where its settings make no picture.
pub(crate) fn of(opened: &Opened) -> Option<Rounding> {
    let settings = resolve(opened.module(), &opened.outputs, &Overrides::default()).ok()?;
    Some(rounding(opened.module(), &opened.outputs, &settings))
}

/// The facts for people, a line each.
pub(crate) fn lines(rounding: &Rounding) -> Vec<String> {
    let within = rounding.within.map(|worst| {
        let error = largest(&worst, |error| format!("{error:.1e}"));
        format!("{error} within the bounds")
    });
    let afar = rounding.afar.is_finite().then_some(rounding.afar);
    let afar = afar.map(|error| format!("{error:.1e} at {AFAR:e} from the origin"));
    let field: Vec<_> = within.into_iter().chain(afar).collect();
    let field = (!field.is_empty()).then(|| field.join(", "));
    let seen = rounding.seen.map(|worst| {
        let error = largest(&worst, |error| format!("{} pixels", pixels(error)));
        format!("{error} in the picture")
    });
    field.into_iter().chain(seen).collect()
}

/// The largest error as it is known: `at most` where the bound over boxes is settled, and `about` what was
/// found at points where it is not, as beside seams, on whose two sides a box has different fields. Of long
/// programs too few boxes are looked at for a point to be found.
fn largest(worst: &Worst, text: impl Fn(f64) -> String) -> String {
    if !worst.at_most.is_finite() && worst.found == 0.0 {
        "not known".to_owned()
    } else if worst.is_settled() || worst.found == 0.0 {
        format!("at most {}", text(worst.at_most))
    } else {
        format!("about {}", text(worst.found))
    }
}

/// A number of pixels with two digits.
fn pixels(number: f64) -> String {
    match number {
        number if number < 0.01 => format!("{number:.1e}"),
        number if number < 10.0 => format!("{number:.2}"),
        number if number < 1e4 => format!("{number:.0}"),
        number => format!("{number:.1e}"),
    }
}

/// That rounding can be seen, and what to do about it.
pub(crate) fn warning(rounding: &Rounding) -> Option<String> {
    told(rounding.seen)
}

/// The same for a picture of these settings.
pub(crate) fn warning_in(opened: &Opened, settings: &RenderSettings) -> Option<String> {
    told(seen(opened.module(), &opened.outputs, settings))
}

fn told(seen: Option<Worst>) -> Option<String> {
    let worst = seen.filter(|worst| worst.found > VISIBLE)?;
    if worst.is_beyond {
        return Some(
            "the field has values beyond all numbers of f32, as high powers have, and surfaces may be \
             drawn where there are none: stop its iterations sooner, or take a logarithm of what they \
             give"
                .to_owned(),
        );
    }
    if worst.found > SENSELESS {
        return Some(
            "rounding decides what is seen: the camera touches a surface. Move the camera away from \
             there"
                .to_owned(),
        );
    }
    Some(format!(
        "rounding may move what is seen by {} pixels: f32 has 7 digits, so move the scene and the \
         camera nearer to the origin, or make all of it larger but for its distance from there",
        pixels(worst.found)
    ))
}

/// The facts as JSON, which has no infinity: what is not known is null.
pub(crate) fn as_json(rounding: &Rounding) -> Value {
    let number = |v: f64| if v.is_finite() { json!(v) } else { Value::Null };
    let worst = |worst: Option<Worst>| match worst {
        Some(worst) => json!({ "at_most": number(worst.at_most), "found": number(worst.found) }),
        None => Value::Null,
    };
    json!({
        "within": worst(rounding.within),
        "afar": { "distance": AFAR, "error": number(rounding.afar) },
        "pixels": worst(rounding.seen),
    })
}
