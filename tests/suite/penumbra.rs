//! Penumbras against their definition: the smallest angle between the ray to a light and a solid, as a fraction of
//! the light's angular radius. Dense evaluation in `f64` finds it, without code of the engines.

use crate::metamorphic::draw::{DrawOptions, image};
use glam::DVec3;
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{EngineKind, open};
use sdfc_runtime::render::CellMode;
use sdfc_shaders::camera::SAMPLE_SHIFT;
use sdfc_trials::skip::is_gpu_skipped;
use std::f64::consts::TAU;

const WIDTH: usize = 80;
const HEIGHT: usize = 60;
/// Tangents of the angular radii of a wide and a narrow light.
const SIZES: [f64; 2] = [0.3, 0.09];
/// Height of the floor.
const FLOOR: f64 = -1.3;
/// Numbers of circles around the ray to the light, and of rays on each.
const CIRCLES: u32 = 24;
const SPOKES: u32 = 64;
/// Minimum step of the oracle.
const MIN_STEP: f64 = 1e-3;
/// Minimum linear brightness of a pixel without a shadow at which the fraction of light is read.
const MIN_BRIGHTNESS: f64 = 0.05;

/// A body above a floor.
struct Case {
    /// The body, as a field of `p`.
    text: &'static str,
    /// Value of that field in `f64`.
    field: fn(DVec3) -> f64,
    /// A bound of its slope in the cube to which it is cut.
    slope: f64,
    /// Maximum root mean square of the errors of the light's fraction, for both lights.
    max_errors: [f64; 2],
}

/// Half side of the cube to which bodies are cut.
const HALF_SIDE: f64 = 1.1;

const CASES: [Case; 8] = [
    Case {
        text: "length(p) - 0.7",
        field: |p| p.length() - 0.7,
        slope: 1.0,
        max_errors: [0.006, 0.0045],
    },
    Case {
        text: "max(max(abs(p.x), abs(p.z)) - 0.6, 0.3 - length(p.xy))",
        field: |p| (p.x.abs().max(p.z.abs()) - 0.6).max(0.3 - p.truncate().length()),
        slope: 1.0,
        max_errors: [0.0065, 0.0037],
    },
    Case {
        text: "length(p) - 0.6 - 0.15*cos(5*pow(abs(p.z), 1.3 + abs(p.x)))*cos(5*p.y)",
        field: |p| {
            let bend = (5.0 * p.z.abs().powf(1.3 + p.x.abs())).cos();
            p.length() - 0.6 - 0.15 * bend * (5.0 * p.y).cos()
        },
        slope: 3.5,
        max_errors: [0.006, 0.0048],
    },
    // The field is zero at both ends of the bore, where no surface is.
    Case {
        text: "max(max(length(p.xz) - 0.8, abs(p.y) - 0.4), -max(length(p.xz) - 0.5, abs(p.y) - 0.4))",
        field: |p| {
            let (radius, height) = (p.x.hypot(p.z), p.y.abs());
            let bore = (radius - 0.5).max(height - 0.4);
            (radius - 0.8).max(height - 0.4).max(-bore)
        },
        slope: 1.0,
        max_errors: [0.012, 0.0245],
    },
    // No slope bound is found of the following two.
    Case {
        text: "length(p) - 0.7 - 0.4*p.x*p.y/length(p.xy)",
        field: |p| p.length() - 0.7 - 0.4 * p.x * p.y / p.x.hypot(p.y),
        slope: 1.3,
        max_errors: [0.0068, 0.0053],
    },
    Case {
        text: "max(length(p) - 0.9, 0.15 - abs(p.x*p.z/length(p.xz)))",
        field: |p| (p.length() - 0.9).max(0.15 - (p.x * p.z / p.x.hypot(p.z)).abs()),
        slope: 1.1,
        max_errors: [0.0074, 0.0062],
    },
    Case {
        text: "length(p) - 0.9 + 0.12*sin(8*p.x)*sin(8*p.y)*cos(8*p.z)",
        field: |p| {
            let waves = (8.0 * p.x).sin() * (8.0 * p.y).sin() * (8.0 * p.z).cos();
            p.length() - 0.9 + 0.12 * waves
        },
        slope: 2.0,
        max_errors: [0.0115, 0.0165],
    },
    // Between columns the gradient leads to any of them, so some are missed.
    Case {
        text: "0.4 - cos(5*p.x)*cos(5*p.z)",
        field: |p| 0.4 - (5.0 * p.x).cos() * (5.0 * p.z).cos(),
        slope: 5.1,
        max_errors: [0.0185, 0.011],
    },
];

impl Case {
    /// Returns the scene with a form of shadows.
    fn text(&self, shadow: &str) -> String {
        format!(
            "camera {{ from: [3, 2.5, 4], look: [0, 0, 0], fov: 38deg }}\n\
             light {{ dir: [-1, 2, 1], intensity: 1, shadow: {shadow} }}\n\
             sky {{ ambient: 0 }}\n\
             render {{ occlusion: off, tonemap: none }}\n\
             (field(fn(p) => {}) & box({})) | plane(Y, at: {FLOOR})",
            self.text,
            2.0 * HALF_SIDE
        )
    }

    /// Returns a lower bound of the distance to the body.
    fn body(&self, p: DVec3) -> f64 {
        ((self.field)(p) / self.slope).max(p.abs().max_element() - HALF_SIDE)
    }

    /// Returns the same for the scene.
    fn scene(&self, p: DVec3) -> f64 {
        self.body(p).min(p.y - FLOOR)
    }

    /// Reports whether a ray meets the scene. Below its start there is the floor.
    fn is_blocked(&self, start: DVec3, direction: DVec3) -> bool {
        if direction.y < 0.0 {
            return true;
        }
        let inverse = direction.recip();
        let ends = [-1.0, 1.0].map(|side| (DVec3::splat(side * HALF_SIDE) - start) * inverse);
        let mut t = ends[0].min(ends[1]).max_element().max(MIN_STEP);
        let last = ends[0].max(ends[1]).min_element();
        while t < last {
            let distance = self.body(start + direction * t);
            if distance < -1e-9 {
                return true;
            }
            t += distance.max(MIN_STEP);
        }
        false
    }

    /// Returns the uncovered fraction of the light's radius beside the ray to its centre.
    fn visibility(&self, start: DVec3, light: DVec3, size: f64) -> f64 {
        if self.is_blocked(start, light) {
            return 0.0;
        }
        let (tangent, bitangent) = light.any_orthonormal_pair();
        for circle in 1..=CIRCLES {
            let radius = f64::from(circle) / f64::from(CIRCLES);
            for spoke in 0..SPOKES {
                let (sin, cos) = (TAU * f64::from(spoke) / f64::from(SPOKES)).sin_cos();
                let to_rim = (tangent * cos + bitangent * sin) * size;
                let is_blocked =
                    |radius: f64| self.is_blocked(start, (light + to_rim * radius).normalize());
                if is_blocked(radius) {
                    let mut free = radius - 1.0 / f64::from(CIRCLES);
                    let mut blocked = radius;
                    for _ in 0..6 {
                        let middle = 0.5 * (free + blocked);
                        *(if is_blocked(middle) {
                            &mut blocked
                        } else {
                            &mut free
                        }) = middle;
                    }
                    return blocked;
                }
            }
        }
        1.0
    }

    /// Returns the fraction of the light at a pixel; `None` beside the scene.
    fn expected_fraction(&self, x: usize, y: usize, size: f64) -> Option<f64> {
        let from = DVec3::new(3.0, 2.5, 4.0);
        let light = DVec3::new(-1.0, 2.0, 1.0).normalize();
        let forward = -from.normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let up = right.cross(forward);
        let tangent = 19_f64.to_radians().tan();
        let at = |k: usize, count: usize, shift: f64| {
            (k as f64 + 0.5 + shift) / count as f64 * 2.0 - 1.0
        };
        let [shift_x, shift_y] = SAMPLE_SHIFT.map(f64::from);
        let u = at(x, WIDTH, shift_x) * tangent * WIDTH as f64 / HEIGHT as f64;
        let v = -at(y, HEIGHT, shift_y) * tangent;
        let direction = (forward + right * u + up * v).normalize();
        let mut t = 0.0;
        loop {
            let distance = self.scene(from + direction * t);
            if distance < -1e-10 {
                break;
            }
            t += distance.max(5e-4);
            if t > 40.0 {
                return None;
            }
        }
        let (mut outside, mut inside) = (t - 6e-4, t);
        for _ in 0..50 {
            let middle = 0.5 * (outside + inside);
            let is_inside = self.scene(from + direction * middle) < 0.0;
            *(if is_inside { &mut inside } else { &mut outside }) = middle;
        }
        let p = from + direction * outside;
        let change = |axis: DVec3| self.scene(p + axis * 1e-6) - self.scene(p - axis * 1e-6);
        let normal = DVec3::new(change(DVec3::X), change(DVec3::Y), change(DVec3::Z)).normalize();
        let visibility = match normal.dot(light) > 0.0 {
            true => self.visibility(p + normal * 2e-3, light, size),
            false => 0.0,
        };
        Some(visibility * visibility * (3.0 - 2.0 * visibility))
    }
}

/// Returns the linear brightness of a text's pixels.
fn brightness(kind: EngineKind, text: &str) -> Vec<f64> {
    let mut engine = open(kind).unwrap_or_else(|error| panic!("{kind}: {error}"));
    let options = DrawOptions {
        size: [WIDTH as u32, HEIGHT as u32],
        passes: PassOptions::default(),
        cells: CellMode::Auto,
        scale: 1.0,
    };
    let picture = image(&mut *engine, text, &options).expect("it compiles");
    let linear = |byte: u8| match f64::from(byte) / 255.0 {
        low if low <= 0.04045 => low / 12.92,
        high => ((high + 0.055) / 1.055).powf(2.4),
    };
    let bytes = picture.rgba8();
    let pixels = bytes.chunks(4);
    pixels
        .map(|pixel| pixel[..3].iter().map(|&byte| linear(byte)).sum::<f64>() / 3.0)
        .collect()
}

/// Soft shadows are as dark as the angles between rays and solids say.
#[test]
fn soft_shadows_follow_their_definition() {
    let lights = |case: &'static Case| [0, 1].map(|k| (case, SIZES[k], case.max_errors[k]));
    for (case, size, max_error) in CASES.iter().flat_map(lights) {
        let expected: Vec<Option<f64>> = (0..WIDTH * HEIGHT)
            .map(|index| case.expected_fraction(index % WIDTH, index / WIDTH, size))
            .collect();
        for kind in [EngineKind::Cpu, EngineKind::Wgsl] {
            if kind != EngineKind::Cpu && is_gpu_skipped() {
                continue;
            }
            let lit = brightness(kind, &case.text("none"));
            let shaded = brightness(kind, &case.text(&format!("soft({size})")));
            let pixels = lit.iter().zip(&shaded).zip(&expected);
            let errors: Vec<f64> = pixels
                .filter(|((lit, _), _)| **lit > MIN_BRIGHTNESS)
                .filter_map(|((lit, shaded), expected)| Some(shaded / lit - (*expected)?))
                .collect();
            let squares: f64 = errors.iter().map(|error| error * error).sum();
            let error = (squares / errors.len() as f64).sqrt();
            assert!(
                error < max_error,
                "{}, {size}, on {kind}: {error}",
                case.text
            );
        }
    }
}

/// Lights with a size that hang close above a floor. They are larger than their distance from it.
const LOW_LAMPS: [&str; 3] = [
    "at: [2, -0.7, 1.3], shadow: soft(0.4)",
    "at: [2, -0.9, 1.3], shadow: plain(0.1)",
    "at: [2, -0.7, 1.3], shadow: plain(0.4)",
];
/// Solids that are lit by them.
const LIT_SOLIDS: [&str; 3] = [
    "box(1.8).translate(1, 0.2, -1)",
    "sphere(0.8).translate(0, 0.2, -1)",
    "cylinder(r: 0.2, h: 400)",
];

/// A raw field far away changes no light, though all candidates of shadow rays are checked then.
#[test]
fn raw_fields_elsewhere_change_no_light_close_above_a_floor() {
    for kind in [EngineKind::Cpu, EngineKind::Wgsl] {
        if kind != EngineKind::Cpu && is_gpu_skipped() {
            continue;
        }
        let lamps = &LOW_LAMPS[..if kind == EngineKind::Cpu {
            LOW_LAMPS.len()
        } else {
            1
        }];
        for (lamp, solid) in lamps
            .iter()
            .flat_map(|lamp| LIT_SOLIDS.map(|solid| (lamp, solid)))
        {
            let text = |other: &str| {
                format!(
                    "render {{ occlusion: off }}\n\
                     camera {{ from: [4, 0.6, 6], look: [0, -0.5, 0], fov: 40deg }}\n\
                     light {{ {lamp}, intensity: 20 }}\n\
                     plane(Y, at: -1) | {solid}{other}"
                )
            };
            let far = " | field(fn(p) => length(p - [-30, 0, 0]) - 0.2)";
            let [alone, beside] = ["", far].map(|other| brightness(kind, &text(other)));
            let pairs = alone.iter().zip(&beside);
            let largest = pairs.fold(0.0, |largest: f64, (a, b)| largest.max((a - b).abs()));
            assert!(largest < 0.02, "{lamp}, {solid}, on {kind}: {largest}");
        }
    }
}
