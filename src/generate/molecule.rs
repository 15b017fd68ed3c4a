//! Atoms and the bonds between them: a tree that grows from the centre of a sphere, along the edges of a
//! randomly displaced cubic lattice.

use super::random::SplitMix;
use super::{Draft, GenerateOptions, Primitive, number, spacing, sphere_volume};
use std::collections::HashMap;

const SETTINGS: &str = "\
camera { from: [2.4, 1.9, 5.6], look: [0, -0.1, 0], fov: 37deg }
light sun { dir: [-0.6, 1, 0.6], color: #fff3e0, intensity: 3, shadow: soft(0.04) }
light back { dir: [0.8, 0.2, -0.7], color: #9fc0ff, intensity: 0.9, shadow: none }
sky { top: #3a4a5e, horizon: #e3e7ea, ground: #9a9ea3, ambient: 0.8 }
render { size: [1280, 720] }
material floor { color: #aab0b5, roughness: 0.8 }
";

const FUNCTIONS: &[&str] = &[
    "fn atom(x, y, z, r) -> shape3 = sphere(r).translate(x, y, z);",
    "fn bond(x, y, z, u, v, w, r) -> shape3 = capsule(from: [x, y, z], to: [u, v, w], r: r);",
];

const PALETTE: &[(&str, &str)] = &[
    ("carbon", "#3b3f46"),
    ("hydrogen", "#f2f2ee"),
    ("oxygen", "#d6402e"),
    ("nitrogen", "#3a5fd0"),
    ("sticks", "#b9b6a8"),
];
const BOND: usize = 4;
/// Frequency of each element, and its radius in distances between neighbours.
const ELEMENTS: [(f64, f64); 4] = [(0.5, 0.33), (0.25, 0.24), (0.15, 0.31), (0.1, 0.32)];

/// Radius of the filled sphere.
const RADIUS: f64 = 1.5;

pub(super) fn draft(options: &GenerateOptions) -> Draft {
    let mut random = SplitMix::new(options.seed);
    // Every atom but the first has a bond.
    let atoms = options.count / 2 + 1;
    let spacing = spacing(sphere_volume(RADIUS), atoms);
    let size = 0.5 * spacing;
    let mut positions: HashMap<[i32; 3], [f64; 3]> = HashMap::new();
    let mut primitives = Vec::new();
    for site in sites(atoms as usize) {
        let position = site.map(|c| spacing * (f64::from(c) + random.between(-0.2, 0.2)));
        let [x, y, z] = position.map(|c| number(c, size));
        if let Some([u, v, w]) = inner_neighbour(site, &positions, &mut random) {
            let [u, v, w] = [u, v, w].map(|c| number(c, size));
            let radius = number(0.11 * spacing, size);
            primitives.push(Primitive {
                material: BOND,
                text: format!("bond({u}, {v}, {w}, {x}, {y}, {z}, {radius})"),
            });
        }
        let element = element(random.unit());
        let radius = number(ELEMENTS[element].1 * spacing, size);
        primitives.push(Primitive {
            material: element,
            text: format!("atom({x}, {y}, {z}, {radius})"),
        });
        positions.insert(site, position);
    }
    // With an even number, the last bond has no atom.
    primitives.truncate(options.count as usize);
    Draft {
        settings: SETTINGS,
        functions: FUNCTIONS,
        palette: PALETTE,
        primitives,
        size,
        ground: "cylinder(r: 3.2, h: 0.1).translate(0, -1.85, 0)".to_owned(),
    }
}

/// Returns the sites of the lattice that are nearest to its centre, from there outwards.
fn sites(count: usize) -> Vec<[i32; 3]> {
    let radius = (1..).find(|&r: &i32| sphere_volume(f64::from(r)) > 1.5 * count as f64 + 8.0);
    let radius = radius.unwrap_or(1);
    let range = || -radius..=radius;
    let mut sites: Vec<[i32; 3]> = range()
        .flat_map(|x| range().flat_map(move |y| range().map(move |z| [x, y, z])))
        .collect();
    sites.sort_by_key(|site| (site.iter().map(|c| c * c).sum::<i32>(), *site));
    sites.truncate(count);
    sites
}

/// Returns the position of a random neighbour that is nearer to the centre; the centre has none.
fn inner_neighbour(
    site: [i32; 3],
    positions: &HashMap<[i32; 3], [f64; 3]>,
    random: &mut SplitMix,
) -> Option<[f64; 3]> {
    let axes: Vec<usize> = (0..3).filter(|&axis| site[axis] != 0).collect();
    let axis = *axes.get((random.unit() * axes.len() as f64) as usize)?;
    let mut neighbour = site;
    neighbour[axis] -= site[axis].signum();
    positions.get(&neighbour).copied()
}

fn element(chance: f64) -> usize {
    let mut sum = 0.0;
    let index = ELEMENTS.iter().position(|(fraction, _)| {
        sum += fraction;
        chance < sum
    });
    index.unwrap_or(0)
}
