//! Spheres that fill a sphere, in bands of larger and smaller ones.

use super::random::{EvenPoints, SplitMix};
use super::{Draft, GenerateOptions, Primitive, number, spacing, sphere_volume};
use std::f64::consts::TAU;

const SETTINGS: &str = "\
camera { from: [2.6, 2.2, 5.4], look: [0, -0.12, 0], fov: 37deg }
light sun { dir: [-0.7, 1, 0.5], color: #ffeacc, intensity: 3, shadow: soft(0.04) }
light back { dir: [0.8, 0.3, -0.6], color: #86a8ff, intensity: 0.8, shadow: none }
sky { top: #31456f, horizon: #cfd9e6, ground: #9c9488, ambient: 0.8 }
render { size: [1280, 720] }
material floor { color: #b9b4ab, roughness: 0.8 }
";

const FUNCTIONS: &[&str] = &["fn ball(x, y, z, r) -> shape3 = sphere(r).translate(x, y, z);"];

/// Colours from the lowest sphere to the highest.
const PALETTE: &[(&str, &str)] = &[
    ("plum", "#5b2a57"),
    ("wine", "#a0304f"),
    ("coral", "#e0573f"),
    ("amber", "#f29a3c"),
    ("sand", "#f3d287"),
    ("ivory", "#f6f0dc"),
];

/// Radius of the filled sphere.
const RADIUS: f64 = 1.5;

pub(super) fn draft(options: &GenerateOptions) -> Draft {
    let mut random = SplitMix::new(options.seed);
    let spacing = spacing(sphere_volume(RADIUS), options.count);
    let tilt = random.between(0.0, TAU);
    let size = 0.8 * spacing;
    let primitives = EvenPoints::new(&mut random).take(options.count as usize);
    let primitives: Vec<_> = primitives.collect();
    let primitives = primitives
        .into_iter()
        .map(|[u, v, w]| {
            // A uniform distribution in the sphere: the height, the angle around it, and the depth.
            let (height, angle) = (2.0 * u - 1.0, v * TAU);
            let circle_radius = (1.0 - height * height).sqrt();
            let distance = (RADIUS - 0.4 * spacing) * w.cbrt();
            let centre = [
                circle_radius * angle.cos(),
                height,
                circle_radius * angle.sin(),
            ]
            .map(|c| c * distance);
            let band = (6.0 * height + 2.0 * (angle + tilt).sin()).sin();
            let radius = spacing * (0.38 + 0.12 * band) * random.between(0.85, 1.15);
            let [x, y, z] = centre.map(|c| number(c, size));
            let level = (centre[1] / RADIUS + 1.0) / 2.0 + random.between(-0.08, 0.08);
            Primitive {
                material: (level.clamp(0.0, 0.999) * PALETTE.len() as f64) as usize,
                text: format!("ball({x}, {y}, {z}, {})", number(radius, size)),
            }
        })
        .collect();
    Draft {
        settings: SETTINGS,
        functions: FUNCTIONS,
        palette: PALETTE,
        primitives,
        size,
        ground: "cylinder(r: 3.2, h: 0.1).translate(0, -1.75, 0)".to_owned(),
    }
}
