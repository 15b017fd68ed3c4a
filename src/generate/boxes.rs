//! Rounded, rotated boxes that fill a ring.

use super::random::{EvenPoints, SplitMix};
use super::{Draft, GenerateOptions, Primitive, number, spacing};
use std::f64::consts::{PI, TAU};

const SETTINGS: &str = "\
camera { from: [1.2, 3.4, 5], look: [0, -0.25, 0.1], fov: 37deg }
light sun { dir: [-0.6, 1, 0.35], color: #fff0d6, intensity: 3, shadow: soft(0.04) }
light back { dir: [0.9, 0.3, -0.5], color: #8fb4ff, intensity: 0.7, shadow: none }
sky { top: #2f4d66, horizon: #d3dfe2, ground: #9aa094, ambient: 0.8 }
render { size: [1280, 720] }
material floor { color: #c2bcb0, roughness: 0.85 }
";

const FUNCTIONS: &[&str] = &[
    "fn brick(x, y, z, a, b, c, round, turn: angle, u, v, w) -> shape3 = box([a, b, c], round: round).rotate(turn, [u, v, w]).translate(x, y, z);",
];

/// Colours around the ring.
const PALETTE: &[(&str, &str)] = &[
    ("teal", "#1f7a78"),
    ("leaf", "#6aa84f"),
    ("straw", "#e3c65b"),
    ("clay", "#d4703c"),
    ("rose", "#b8405e"),
    ("slate", "#4a5a8a"),
];

/// Distance from the ring's centre to the middle of its tube, and the radius of the tube.
const RING: f64 = 1.55;
const TUBE: f64 = 0.55;

pub(super) fn draft(options: &GenerateOptions) -> Draft {
    let mut random = SplitMix::new(options.seed);
    let volume = TAU * RING * PI * TUBE * TUBE;
    let spacing = spacing(volume, options.count);
    let parameters: Vec<_> = EvenPoints::new(&mut random)
        .take(options.count as usize)
        .collect();
    let primitives = parameters
        .into_iter()
        .map(|[u, v, w]| {
            let (ring_angle, tube_angle) = (u * TAU, v * TAU);
            let tube_distance = (TUBE - 0.3 * spacing).max(0.0) * w.sqrt();
            let ring_distance = RING + tube_distance * tube_angle.cos();
            let centre = [
                ring_distance * ring_angle.cos(),
                tube_distance * tube_angle.sin(),
                ring_distance * ring_angle.sin(),
            ];
            let sides: [f64; 3] = std::array::from_fn(|_| spacing * random.between(0.5, 1.2));
            let round = 0.2 * sides.into_iter().fold(f64::INFINITY, f64::min);
            let axis: [f64; 3] = std::array::from_fn(|_| random.between(-1.0, 1.0));
            // The second component keeps the axis from vanishing when rounded.
            let axis = [axis[0], axis[1].abs() + 0.2, axis[2]];
            let list = |numbers: [f64; 3], size| numbers.map(|n| number(n, size)).join(", ");
            let palette_fraction = u + random.between(-0.04, 0.04);
            Primitive {
                material: (palette_fraction.rem_euclid(1.0) * PALETTE.len() as f64) as usize
                    % PALETTE.len(),
                text: format!(
                    "brick({}, {}, {}, {}deg, {})",
                    list(centre, spacing),
                    list(sides, spacing),
                    number(round, spacing),
                    random.between(0.0, 360.0) as u32,
                    list(axis, 1.0),
                ),
            }
        })
        .collect();
    Draft {
        settings: SETTINGS,
        functions: FUNCTIONS,
        palette: PALETTE,
        primitives,
        size: 0.85 * spacing,
        ground: "cylinder(r: 3.4, h: 0.1).translate(0, -0.95, 0)".to_owned(),
    }
}
