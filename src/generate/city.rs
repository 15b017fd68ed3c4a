//! Towers of several forms on a grid of streets, higher towards the middle.

use super::random::SplitMix;
use super::{Draft, GenerateOptions, Primitive, number};

const SETTINGS: &str = "\
camera { from: [5.2, 4.4, 8.2], look: [0, 0.35, 0.2], fov: 38deg }
light sun { dir: [-0.7, 0.62, 0.25], color: #ffdfb0, intensity: 3.2, shadow: soft(0.03) }
light back { dir: [0.7, 0.4, 0.6], color: #8aa6e8, intensity: 0.5, shadow: none }
sky { top: #3b62a8, horizon: #dbe4ee, ground: #99a3b0, ambient: 0.85 }
render { size: [1280, 720] }
material floor { color: #5d6168, roughness: 0.9 }
";

const FUNCTIONS: &[&str] = &[
    "fn tower(x, y, z, w, h, d) -> shape3 = box([w, h, d]).translate(x, y + h / 2, z);",
    "fn drum(x, y, z, r, h) -> shape3 = cylinder(r: r, h: h).translate(x, y + h / 2, z);",
    "fn spire(x, y, z, r, h) -> shape3 = cone(r1: r, r2: 0.1 * r, h: h).translate(x, y + h / 2, z);",
];

const PALETTE: &[(&str, &str)] = &[
    ("stone", "#cfc7b8"),
    ("brick", "#b0654a"),
    ("glass", "#7f9fb8"),
    ("steel", "#59616e"),
    ("copper", "#6fa38c"),
];
/// The material of roofs.
const COPPER: usize = 4;

/// Half a side of the city.
const HALF: f64 = 3.4;
/// Mean number of primitives per lot.
const PER_LOT: f64 = 1.55;
/// Number of lots from one street to the next.
const BLOCK: i32 = 5;

pub(super) fn draft(options: &GenerateOptions) -> Draft {
    let mut random = SplitMix::new(options.seed);
    let count = options.count as usize;
    let built = f64::from(BLOCK * BLOCK) / f64::from((BLOCK - 1) * (BLOCK - 1));
    let lot = 2.0 * HALF / (f64::from(options.count) / PER_LOT * built).sqrt().max(1.0);
    let mut primitives = Vec::with_capacity(count + 2);
    for site in lots() {
        if primitives.len() >= count {
            break;
        }
        build(site, lot, &mut random, &mut primitives);
    }
    primitives.truncate(count);
    Draft {
        settings: SETTINGS,
        functions: FUNCTIONS,
        palette: PALETTE,
        primitives,
        size: 0.7 * lot,
        ground: "box([9, 0.1, 9]).translate(0, -0.05, 0)".to_owned(),
    }
}

/// Returns the lots without the streets, ring by ring from the middle outwards.
fn lots() -> impl Iterator<Item = [i32; 2]> {
    (0_i32..).flat_map(|ring| {
        let side = -ring..=ring;
        side.flat_map(move |x| {
            let step = if x.abs() == ring { 1 } else { 2 * ring };
            (-ring..=ring)
                .step_by(step.max(1) as usize)
                .map(move |z| [x, z])
        })
        .filter(|site| site.iter().all(|c| c.rem_euclid(BLOCK) != 2))
    })
}

/// Builds on a lot: one or two primitives.
fn build([x, z]: [i32; 2], lot: f64, random: &mut SplitMix, primitives: &mut Vec<Primitive>) {
    let position = [x, z].map(|c| f64::from(c) * lot);
    let distance_from_centre = position[0].hypot(position[1]) / HALF;
    let skyline = 1.7 * (-5.0 * distance_from_centre * distance_from_centre).exp();
    let height = lot * random.between(0.4, 1.4) + skyline * random.unit().powi(2) + 0.04;
    let [w, d] = [0; 2].map(|_| lot * random.between(0.62, 0.88));
    let write = |n: f64| number(n, lot);
    let [x, z] = position.map(write);
    let material = (random.unit() * COPPER as f64) as usize;
    let mut add = |material, text| primitives.push(Primitive { material, text });
    let tower = |y: f64, w: f64, h: f64, d: f64| {
        let [y, w, h, d] = [y, w, h, d].map(write);
        format!("tower({x}, {y}, {z}, {w}, {h}, {d})")
    };
    let round = |form: &str, y: f64, r: f64, h: f64| {
        let [y, r, h] = [y, r, h].map(write);
        format!("{form}({x}, {y}, {z}, {r}, {h})")
    };
    let kind = random.unit();
    if kind < 0.45 {
        add(material, tower(0.0, w, height, d));
    } else if kind < 0.75 {
        let base = height * random.between(0.4, 0.7);
        add(material, tower(0.0, w, base, d));
        add(material, tower(base, 0.65 * w, height - base, 0.65 * d));
    } else if kind < 0.87 {
        add(material, round("drum", 0.0, w / 2.0, height));
        add(COPPER, round("spire", height, w / 2.0, 0.5 * lot));
    } else {
        let side = w.min(d);
        add(material, tower(0.0, side, height, side));
        add(COPPER, round("spire", height, 0.4 * side, 0.9 * lot));
    }
}
