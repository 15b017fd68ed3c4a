//! A camera as the block of the language that gives its view.

use super::{Basis, Camera, array, unit, vector};
use sdfc_runtime::frame::{Lens, View};
use sdfc_vm::real::Vector3;

/// How much of the picture's height a coordinate may be off: a twentieth of a pixel of a thousand.
const TOLERANCE: f64 = 5e-5;
/// How many radians a view may lean more than it should: as much at the edge of the picture.
const LEAN: f64 = 1e-4;

impl Camera {
    /// The camera as a block of a scene: `camera { from: …, look: …, fov: … }`, perhaps with a name.
    /// The numbers have as many digits as show in a picture; `up` is said where it is not what the
    /// language takes for it.
    pub fn text(&self, name: Option<&str>) -> String {
        let view = &self.view;
        let (height, lens) = match view.lens {
            Lens::Perspective(fov) => (
                2.0 * self.distance() * (fov / 2.0).tan(),
                format!("fov: {}deg", significant(fov.to_degrees())),
            ),
            Lens::Orthographic(height) => (height, format!("height: {}", significant(height))),
        };
        // Halves of the last digit are lost.
        let digits = decimals(2.0 * TOLERANCE * height);
        let from = view.from.map(|v| rounded(v, digits));
        let look = view.look.map(|v| rounded(v, digits));
        let [from_text, look_text] = [&from, &look].map(|triple| list(triple, digits));
        let meant = View {
            from,
            look,
            up: self.upward(from, look),
            lens: view.lens,
        };
        let right = Basis::of(view).right;
        let leans = (Basis::of(&meant).right - right).length() > LEAN;
        let up = if leans && !self.plane {
            format!(", up: {}", list(&array(Basis::of(view).up), 5))
        } else {
            String::new()
        };
        let name = name.map(|name| format!("{name} ")).unwrap_or_default();
        format!("camera {name}{{ from: {from_text}, look: {look_text}{up}, {lens} }}")
    }

    /// What the language takes for up where a camera does not say it: the scene's upward direction,
    /// or north for one that looks along it.
    fn upward(&self, from: [f64; 3], look: [f64; 3]) -> [f64; 3] {
        let upright = array(self.upright);
        let way = unit(vector(look) - vector(from));
        let is_along = way.is_none_or(|way| way.cross(self.upright).length() <= 1e-6);
        match (is_along, upright == [0.0, 0.0, 1.0]) {
            (false, _) => upright,
            (true, true) => [0.0, 1.0, 0.0],
            (true, false) => [0.0, 0.0, -1.0],
        }
    }
}

/// How many decimals a number needs so that its last digit counts no more than this.
fn decimals(unit: f64) -> usize {
    (-unit.log10()).ceil().clamp(0.0, 15.0) as usize
}

/// A number above zero with five digits.
fn significant(v: f64) -> String {
    digits(v, decimals(v * 1e-4))
}

fn list(triple: &[f64; 3], decimals: usize) -> String {
    let [x, y, z] = triple.map(|v| digits(v, decimals));
    format!("[{x}, {y}, {z}]")
}

/// A number with at most so many decimals.
fn digits(v: f64, decimals: usize) -> String {
    let text = format!("{v:.decimals$}");
    let text = if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        &text
    };
    if text == "-0" { "0" } else { text }.to_owned()
}

/// The number that its text says.
fn rounded(v: f64, decimals: usize) -> f64 {
    digits(v, decimals).parse().unwrap_or(v)
}
