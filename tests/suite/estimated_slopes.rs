//! Hits of fields whose slope has no bound, compared with the same set by a field that has one, on the CPU.

use crate::metamorphic::draw::{DrawOptions, image};
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{EngineKind, open};
use sdfc_runtime::render::CellMode;

/// Change of a channel from which on pixels differ.
const MIN_DIFFERENCE: u8 = 16;
/// Maximum number of pixels that differ, at silhouettes.
const MAX_PIXELS: usize = 40;

/// Sets, each by a field without a bound and by another one.
const SETS: &[[&str; 2]] = &[
    [
        "field(fn(p) => max(dot(julia(p.xy, 6), julia(p.xy, 6)) - 4, abs(p.z) - 0.3))",
        "field(fn(p) => max(ln(dot(julia(p.xy, 6), julia(p.xy, 6))) - ln(4), abs(p.z) - 0.3))",
    ],
    [
        "field(fn(p) => max(dot(julia(p.xy, 10), julia(p.xy, 10)) - 4, abs(p.z) - 0.3))",
        "field(fn(p) => max(ln(dot(julia(p.xy, 10), julia(p.xy, 10))) - ln(4), abs(p.z) - 0.3))",
    ],
    // Rays begin in space where nothing is known, at a camera where pixels have no size.
    ["field(bulb)", "field(bulb, within: 3)"],
];

/// Draws a set on a floor, without shadows.
fn picture(set: &str, cells: CellMode) -> Vec<u8> {
    let text = format!(
        "camera {{ from: [2.2, 1.8, 3.2], look: [0, 0, 0], fov: 40deg }}\n\
         light {{ dir: [-0.6, 1, 0.5], intensity: 3, shadow: none }}\n\
         render {{ occlusion: off, far: 1e6 }}\n\
         fn julia(c: vec2, rounds) = fold(0..rounds, c, fn(z, i) =>\n\
             [z.x*z.x - z.y*z.y - 0.7269, 2*z.x*z.y + 0.1889]);\n\
         fn bulb(p) = ln(length(bulb_round(bulb_round(p, p), p)) / 1.2);\n\
         fn bulb_round(z: vec3, p: vec3) -> vec3 {{ let r = length(z); let a = 8 * acos(z.y / r); let b = 8 * atan2(z.x, z.z);\n\
             pow(r, 8) * vec3(sin(a) * sin(b), cos(a), sin(a) * cos(b)) + p }}\n\
         {set} | box(6, 0.2, 6).translate(0, -1.6, 0)"
    );
    let mut engine = open(EngineKind::Cpu).unwrap_or_else(|error| panic!("{error}"));
    let options = DrawOptions {
        size: [160, 120],
        passes: PassOptions::default(),
        cells,
        scale: 1.0,
    };
    let picture = image(&mut *engine, &text, &options);
    picture
        .unwrap_or_else(|errors| panic!("{set}: {errors}"))
        .rgba8()
}

/// Rays of the camera step over no part.
#[test]
fn fields_without_a_bound_hide_no_part_of_their_set() {
    for ([unbounded, bounded], cells) in SETS
        .iter()
        .flat_map(|sets| [CellMode::Auto, CellMode::Never].map(|cells| (sets, cells)))
    {
        let [a, b] = [unbounded, bounded].map(|set| picture(set, cells));
        let pixels = a.chunks(4).zip(b.chunks(4));
        let differs = |(a, b): &(&[u8], &[u8])| {
            let mut channels = a.iter().zip(*b);
            channels.any(|(a, b)| a.abs_diff(*b) >= MIN_DIFFERENCE)
        };
        let count = pixels.filter(differs).count();
        assert!(
            count <= MAX_PIXELS,
            "{unbounded}, {cells:?}: {count} pixels"
        );
    }
}
