//! Formats a camera as a `camera` block of the language.

use super::{Basis, OrbitCamera};
use glam::DVec3;
use sdfc_runtime::render::{ResolvedLens, View};

/// Maximum error of a coordinate as a fraction of the picture height: a twentieth of a pixel at 1000
/// pixels.
const MAX_COORDINATE_ERROR: f64 = 5e-5;
/// Maximum roll error of the view in radians, which gives the same error at the edge of the picture.
const MAX_LEAN_ERROR: f64 = 1e-4;

impl OrbitCamera {
    /// Formats the camera as a block of a scene: `camera { from: …, look: …, fov: … }`, optionally with a
    /// name. The numbers have as many digits as are visible in a picture. `up` is included only where it
    /// differs from the language's default.
    pub fn text(&self, name: Option<&str>) -> String {
        let view = &self.view;
        let (height, lens) = match view.lens {
            ResolvedLens::Perspective(fov) => (
                2.0 * self.distance() * (fov / 2.0).tan(),
                format!("fov: {}deg", significant(fov.to_degrees())),
            ),
            ResolvedLens::Orthographic(height) => {
                (height, format!("height: {}", significant(height)))
            }
        };
        // Rounding loses at most half a unit of the last digit.
        let format_digits = decimals(2.0 * MAX_COORDINATE_ERROR * height);
        let from = view.from.map(|v| rounded(v, format_digits));
        let look = view.look.map(|v| rounded(v, format_digits));
        let [from_text, look_text] =
            [&from, &look].map(|triple| format_list(triple, format_digits));
        let written_view = View {
            from,
            look,
            up: self.default_up(from, look),
            lens: view.lens,
        };
        let right = Basis::from_view(view).right;
        let is_leaning = (Basis::from_view(&written_view).right - right).length() > MAX_LEAN_ERROR;
        let up = if is_leaning && !self.is_2d {
            format!(
                ", up: {}",
                format_list(&Basis::from_view(view).up.into(), 5)
            )
        } else {
            String::new()
        };
        let name = name.map(|name| format!("{name} ")).unwrap_or_default();
        format!("camera {name}{{ from: {from_text}, look: {look_text}{up}, {lens} }}")
    }

    /// Returns the language's default up direction: the scene's up direction, or north for a camera that
    /// looks along it.
    fn default_up(&self, from: [f64; 3], look: [f64; 3]) -> [f64; 3] {
        let direction = (DVec3::from(look) - DVec3::from(from)).try_normalize();
        let is_along =
            direction.is_none_or(|direction| direction.cross(self.world_up).length() <= 1e-6);
        let up = match (is_along, self.world_up == DVec3::Z) {
            (false, _) => self.world_up,
            (true, true) => DVec3::Y,
            (true, false) => DVec3::NEG_Z,
        };
        up.into()
    }
}

/// Returns the number of decimals at which the last digit is at most `unit`.
fn decimals(unit: f64) -> usize {
    (-unit.log10()).ceil().clamp(0.0, 15.0) as usize
}

/// Formats a positive number with five significant digits.
fn significant(v: f64) -> String {
    format_digits(v, decimals(v * 1e-4))
}

fn format_list(triple: &[f64; 3], decimals: usize) -> String {
    let [x, y, z] = triple.map(|v| format_digits(v, decimals));
    format!("[{x}, {y}, {z}]")
}

/// Formats a number with at most `decimals` decimals.
fn format_digits(v: f64, decimals: usize) -> String {
    let text = format!("{v:.decimals$}");
    let text = if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        &text
    };
    if text == "-0" { "0" } else { text }.to_owned()
}

/// Rounds a number to its formatted value.
fn rounded(v: f64, decimals: usize) -> f64 {
    format_digits(v, decimals).parse().unwrap_or(v)
}
