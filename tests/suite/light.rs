//! Lighting of scenes that were once lit wrongly, on the CPU.

use crate::metamorphic::draw::{DrawOptions, image};
use glam::DVec3;
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{EngineKind, open};
use sdfc_runtime::render::{CellMode, Image};
use sdfc_shaders::camera::SAMPLE_SHIFT;
use sdfc_trials::skip::is_gpu_skipped;

/// Maximum number of channels of edge pixels that rounding changes in a picture.
const MAX_EDGE_CHANNELS: usize = 12;
/// Maximum number where leaves without a bounded gradient may hide a part of a field.
const MAX_UNPROVED_CHANNELS: usize = 120;
/// Maximum number where the slope bound of one field is a third greater: wide penumbras of turned bars follow it.
const MAX_LOOSE_CHANNELS: usize = 12;
/// Maximum number of channels that may differ beside sharp edges.
const MAX_SHARP_CHANNELS: usize = 40;
/// Maximum number of channels that may differ in the penumbra of a funnel.
const MAX_FUNNEL_CHANNELS: usize = 60;

/// Draws a text with one sample per pixel.
fn picture(text: &str, size: [u32; 2]) -> Image {
    picture_on(EngineKind::Cpu, text, size)
}

/// Draws a text with one sample per pixel on an engine.
fn picture_on(kind: EngineKind, text: &str, size: [u32; 2]) -> Image {
    let mut engine = open(kind).unwrap_or_else(|error| panic!("{kind}: {error}"));
    let offset = DrawOptions {
        size,
        passes: PassOptions::default(),
        cells: CellMode::Auto,
        scale: 1.0,
    };
    image(&mut *engine, text, &offset).expect("it compiles")
}

/// Returns the brightness of a pixel, from 0 to 765.
fn brightness(image: &Image, bytes: &[u8], x: usize, y: usize) -> i32 {
    let pixel_start = 4 * (y * image.width + x);
    bytes[pixel_start..pixel_start + 3]
        .iter()
        .map(|&channel| i32::from(channel))
        .sum()
}

/// Returns the pixels that are brighter than all eight neighbours by more than `max`, of 765.
fn bright_dots(image: &Image, max: i32) -> Vec<[usize; 2]> {
    let bytes = image.rgba8();
    let pixels = (1..image.height - 1).flat_map(|y| (1..image.width - 1).map(move |x| [x, y]));
    pixels
        .filter(|&[x, y]| {
            let centre = brightness(image, &bytes, x, y);
            let around = (y - 1..=y + 1).flat_map(|v| (x - 1..=x + 1).map(move |u| [u, v]));
            let mut others = around.filter(|&other| other != [x, y]);
            others.all(|[u, v]| brightness(image, &bytes, u, v) + max < centre)
        })
        .collect()
}

/// An edge darkens rays that pass it closely, at any distance from the camera.
#[test]
fn shadows_of_inner_rims_have_no_bright_dots() {
    let text = "scene { units: mm, up: z }\n\
        camera { from: [0, -20, 140], look: [0, 0, 5], fov: 40deg }\n\
        box(80, 60, 20) - box(76, 56, 18).translate(0, 0, 1)\n";
    let dots = bright_dots(&picture(text, [800, 600]), 30);
    assert!(dots.is_empty(), "{dots:?}");
}

/// Returns a hinge on a floor under grazing light and another shape, scaled by `scale` and centred at
/// `position`.
fn hinge(other: &str, scale: f64, position: [f64; 3]) -> String {
    let placed = |p: [f64; 3]| [0, 1, 2].map(|axis| p[axis] * scale + position[axis]);
    let (from, look) = (placed([0.482, 1.541, -2.175]), placed([0.0, 0.2, 0.0]));
    format!(
        "camera {{ from: {from:?}, look: {look:?}, fov: 40deg }}\n\
         light {{ dir: [0.44, 0.19, 0.46], intensity: 2.5, shadow: plain(0.1) }}\n\
         ((box(1.6, 0.2, 2).translate(0.9, 0.3, 0) - cylinder(r: 0.16, h: 0.6).translate(1.1, 0.3, 0)).mirror(X)\n\
         | cylinder(r: 0.3, h: 0.38).rotate(90deg, X).repeat([0, 0, 0.8], [1, 1, 3]).translate(0, 0.3, 0)\n\
         | plane(Y, at: 0){other}).scale({scale}).translate({position:?})\n"
    )
}

/// Counts the channels that differ visibly between two pictures.
fn differing_channels(first: &str, other: &str) -> usize {
    let [first, other] = [first, other].map(|text| picture(text, [160, 120]).rgba8());
    let pairs = first.iter().zip(&other);
    pairs.filter(|&(&a, &b)| a.abs_diff(b) > 2).count()
}

/// Shadows and default occlusion of a scene on an unbounded floor depend neither on its position nor on
/// its unit.
#[test]
fn things_on_an_endless_floor_are_lit_alike_in_any_place_and_unit() {
    let original = hinge("", 1.0, [0.0; 3]);
    for (scale, position) in [
        (0.125, [0.0; 3]),
        (0.01, [0.0; 3]),
        (64.0, [0.0; 3]),
        (1.0, [6.0, 2.5, -4.0]),
        (0.125, [-2.0, -3.5, 1.0]),
    ] {
        let count = differing_channels(&original, &hinge("", scale, position));
        assert!(
            count <= MAX_EDGE_CHANNELS,
            "{scale} at {position:?}: {count} channels"
        );
    }
}

/// Returns a closed hall with the sun outside, seen by a lens of this field of view. The walls have this thickness.
fn hall(fov: u32, thickness: f64) -> String {
    let outer = 24.0 + thickness;
    format!(
        "camera {{ from: [-7.2, 1.6, 6], look: [12, 1, -3.6], fov: {fov}deg }}\n\
         sky {{ ambient: 0 }}\n\
         light {{ dir: [0.5, 1, 0.7], intensity: 4, shadow: hard }}\n\
         box(24, 3, {thickness}).translate(0, 1.5, -12) | box(24, 3, {thickness}).translate(0, 1.5, 12) \
         | box({thickness}, 3, 24).translate(12, 1.5, 0) | box({thickness}, 3, 24).translate(-12, 1.5, 0) \
         | box({outer}, 0.2, {outer}).translate(0, 3.1, 0) | plane(Y, at: 0)"
    )
}

/// Closed room of bricks.
const BRICKS: &str = "camera { from: [1.9, 0.59, 2.95], look: [0.2, 0.36, -0.62], fov: 80deg }\n\
    sky { ambient: 0 }\n\
    light { dir: [0, 1, 0], intensity: 5, shadow: hard }\n\
    box(0.6, 0.3, 0.2).repeat([0.6, 0.3, 8], [10, 10, 2]).translate(0, 1.5, 0) \
    | box(0.2, 0.3, 0.6).repeat([5.8, 0.3, 0.6], [2, 10, 13]).translate(0, 1.5, 0) \
    | box(6, 0.1, 8.2).translate(0, 3.05, 0) | plane(Y, at: 0)";

/// Halls around the camera. What shades their walls is farther away than all that is in view.
const AROUND: [&str; 2] = [
    "camera { from: [0, 1.5, 0], look: [-6, 1.2, 0], fov: 70deg }\n\
     sky { ambient: 0 }\n\
     light { dir: [1, 0.1, 0], intensity: 3, shadow: hard }\n\
     box(12.4, 3.4, 4.4).translate(0, 1.5, 0) - box(12, 3, 4).translate(0, 1.5, 0)",
    "camera { from: [3.325, 1.21, 1.763], look: [0.92, 0.44, 1.48], fov: 50deg }\n\
     sky { ambient: 0 }\n\
     light { at: [4.619, 1.51, 2.51], intensity: 3, shadow: soft(0.01) }\n\
     (box(6.4, 2.9, 4.4).translate(3.09, 1.25, 1.2) - box(6, 2.5, 4).translate(3.09, 1.25, 1.2)) \
     | box(0.08, 2.5, 4).translate(4.12, 1.25, 1.2)",
];

/// Without ambient light, nothing is seen in a closed room. The foot of a wall shows no floor behind it.
#[test]
fn no_light_enters_closed_rooms() {
    for text in [
        hall(75, 0.3),
        hall(40, 0.1),
        hall(75, 0.1),
        BRICKS.to_owned(),
        AROUND[0].to_owned(),
        AROUND[1].to_owned(),
    ] {
        let bytes = picture(&text, [160, 120]).rgba8();
        let lit = bytes
            .chunks(4)
            .filter(|pixel| pixel[..3].iter().any(|&v| v > 20));
        assert_eq!(lit.count(), 0, "{text}");
    }
}

/// Lights hang from the ceiling, touch it, or are in its plane. A ball at a ceiling lights most of a room, and evenly.
#[test]
fn lights_at_a_ceiling_reach_the_room() {
    let room = |height: f64, shadow: &str| {
        format!(
            "camera {{ from: [0, 1.2, 1.8], look: [0, 0.6, -1], fov: 80deg }}\n\
             light {{ at: [0, {height}, 0], intensity: 10, shadow: {shadow} }}\n\
             sky {{ ambient: 0 }}\n\
             render {{ occlusion: off }}\n\
             box(4.4, 2.9, 4.4).translate(0, 1.25, 0) - box(4, 2.5, 4).translate(0, 1.25, 0)"
        )
    };
    for height in [2.5, 2.4999, 2.499, 2.45] {
        let sum = |shadow: &str| {
            let image = picture(&room(height, shadow), [80, 60]);
            assert_eq!(bright_dots(&image, 24), [[0; 2]; 0], "{height}, {shadow}");
            image.rgba8().iter().map(|&v| f64::from(v)).sum::<f64>()
        };
        let sharp = sum("hard");
        for shadow in ["soft(0.1)", "plain(0.1)", "sized(0.1)"] {
            let fraction = sum(shadow) / sharp;
            assert!(
                (0.75..1.0).contains(&fraction),
                "{height}, {shadow}: {fraction}"
            );
        }
    }
}

/// A ray just above the highest solid is darkened by it, although the ray leaves the bounding box of all
/// solids before that.
#[test]
fn a_tall_post_far_away_changes_no_penumbra() {
    let off = "render { occlusion: off }\n";
    let post = "| cylinder(r: 0.1, h: 40).translate(-80, 0, 80)";
    let texts = ["", post].map(|other| format!("{off}{}", hinge(other, 1.0, [0.0; 3])));
    assert_eq!(differing_channels(&texts[0], &texts[1]), 0);
}

/// Stated slopes that are below those that are found change no penumbra of a wide light.
#[test]
fn stated_slopes_change_no_penumbra() {
    let scene = |field: &str, slope: &str| {
        format!(
            "camera {{ from: [3, 2.5, 4], look: [0, 0, 0], fov: 38deg }}\n\
             light {{ dir: [-1, 2, 1], intensity: 3, shadow: soft(0.3) }}\n\
             render {{ occlusion: off }}\n\
             (field(fn(p) => {field}{slope}) & box(2)) | plane(Y, at: -1.3)"
        )
    };
    for (field, slope) in [
        ("0.4 - cos(5 * p.x) * cos(5 * p.z)", ", lipschitz: 5.02"),
        (
            "sin(5 * p.x) * cos(5 * p.y) + sin(5 * p.y) * cos(5 * p.z) + sin(5 * p.z) * cos(5 * p.x)",
            ", lipschitz: 8.7",
        ),
        ("length(p) - 1 + 0.35 * noise(p * 4)", ", lipschitz: 3.5"),
    ] {
        let channels = differing_channels(&scene(field, ""), &scene(field, slope));
        assert_eq!(channels, 0, "{field}");
    }
}

/// A factor on a field changes no penumbra of a narrow light, where the slope bound that is found is loose. Along rays to
/// the light the factor falls, and values are not lowest beside the surface.
#[test]
fn factors_on_fields_with_loose_bounds_change_no_penumbra() {
    let scene = |factor: &str| {
        format!(
            "camera {{ from: [3, 2.5, 4], look: [0, 0, 0], fov: 38deg }}\n\
             light {{ dir: [-1, 2, 1], intensity: 1, shadow: soft(0.09) }}\n\
             sky {{ ambient: 0 }}\n\
             render {{ occlusion: off, tonemap: none }}\n\
             fn ball(p: vec3) -> float {{ length(p) - 0.7 + 0.4 * p.x * p.y / (length(p.xy) + 0.001) }}\n\
             (field(fn(p) => ball(p){factor}) & box(2.2)) | plane(Y, at: -1.3)"
        )
    };
    for factor in [" * exp(-2 * p.y)", " * (1.3 - p.y)"] {
        let channels = differing_channels(&scene(""), &scene(factor));
        assert_eq!(channels, 0, "{factor}");
    }
}

/// A stated slope of a field for which no bound is found adds samples on steps. Beside a bound that is found, it is not used.
/// Neither the statement nor its size changes a pixel.
#[test]
fn loose_statements_change_no_pixel() {
    for (field, slope) in [
        ("length(p) - 0.7 - 0.4 * p.x * p.y / length(p.xy)", 1.3),
        (
            "max(length(p) - 0.9, 0.15 - abs(p.x * p.z / length(p.xz)))",
            1.1,
        ),
        (
            "length(p) - 0.7 + 0.5 * dot(p.xz, p.xz) * sin(1 / length(p.xz))",
            1.8,
        ),
        (
            "0.5 - abs(sin(4 * p.x) * cos(4 * p.y)) - 0.3 * p.z * p.y / length(p.yz)",
            4.4,
        ),
        // A bound of 46 is found.
        (
            "length(p) - 0.8 + 0.3 * pow(1 - abs(noise(p * 4)) * 2, 2)",
            25.0,
        ),
    ] {
        for shadow in ["hard", "soft(0.08)", "soft(0.3)", "plain", "sized(0.1)"] {
            let scene = |statement: &str| {
                format!(
                    "camera {{ from: [3, 2.5, 4], look: [0, 0, 0], fov: 38deg }}\n\
                     light {{ dir: [-1, 2, 1], intensity: 3, shadow: {shadow} }}\n\
                     render {{ occlusion: off }}\n\
                     (field(fn(p) => {field}{statement}) & box(2.2)) | plane(Y, at: -1.3)"
                )
            };
            for factor in [1.0, 5.0, 50.0] {
                let stated = scene(&format!(", lipschitz: {}", slope * factor));
                let channels = differing_channels(&scene(""), &stated);
                assert_eq!(channels, 0, "{field}, {shadow}, {factor}");
            }
        }
    }
}

/// A thin and steep part of a field is far steeper than the estimate that the field is divided by. With a stated slope no
/// ray passes it, neither from the camera nor towards a light.
#[test]
fn thin_parts_of_fields_with_stated_slopes_are_drawn() {
    let scene = |shape: &str| {
        format!(
            "camera {{ from: [3, 2.5, 4], look: [0, -0.3, 0], fov: 38deg }}\n\
             light {{ dir: [-1, 2, 1], shadow: hard }}\n\
             render {{ occlusion: off }}\n\
             ({shape} & box(2.2)) | plane(Y, at: -1.3)"
        )
    };
    let ball = "0.1 * (length(p - vec3(0, 0.4, 0)) - 0.4 + 0.2 * p.x * p.z / length(p.xz))";
    let shelf =
        "0.1 * (80 + p.x * p.x) * max(abs(p.y + 0.6) - 0.01, max(abs(p.x), abs(p.z)) - 0.9)";
    let stated = |slope: f64| {
        scene(&format!(
            "field(fn(p) => min({ball}, {shelf}), lipschitz: {slope})"
        ))
    };
    let parts = format!("(field(fn(p) => {ball}) | box(1.8, 0.02, 1.8).translate(0, -0.6, 0))");
    let expected = picture(&scene(&parts), [96, 72]).rgba8();
    let kinds = match is_gpu_skipped() {
        true => vec![EngineKind::Cpu],
        false => vec![EngineKind::Cpu, EngineKind::Wgsl, EngineKind::Interp],
    };
    for (kind, cells, slope) in kinds.into_iter().flat_map(|kind| {
        [CellMode::Auto, CellMode::Never]
            .into_iter()
            .flat_map(move |cells| [(kind, cells, 8.6), (kind, cells, 40.0)])
    }) {
        let mut engine = open(kind).unwrap_or_else(|error| panic!("{kind}: {error}"));
        let options = DrawOptions {
            size: [96, 72],
            passes: PassOptions::default(),
            cells,
            scale: 1.0,
        };
        let drawn = image(&mut *engine, &stated(slope), &options).expect("it compiles");
        let differing = far_channels(&drawn.rgba8(), &expected);
        assert_eq!(differing, 0, "{kind}, {cells:?}, {slope}");
    }
    // Without a statement, rays from the camera pass it in a few leaves without a bounded gradient.
    let unstated = scene(&format!("field(fn(p) => min({ball}, {shelf}))"));
    let [drawn, expected] = [unstated, scene(&parts)]
        .map(|text| picture(&text.replace("hard", "none"), [96, 72]).rgba8());
    let differing = far_channels(&drawn, &expected);
    assert!(differing <= MAX_UNPROVED_CHANNELS, "{differing} channels");
}

/// Counts the channels that differ as much as two materials do.
fn far_channels(drawn: &[u8], expected: &[u8]) -> usize {
    let pairs = drawn.iter().zip(expected);
    pairs.filter(|&(&a, &b)| a.abs_diff(b) > 40).count()
}

/// Candidates of wide lights move into the solids of a lattice in the same way on a GPU.
#[test]
fn engines_light_lattices_alike() {
    if is_gpu_skipped() {
        return;
    }
    let text = "camera { from: [3, 2.5, 4], look: [0, 0, 0], fov: 38deg }\n\
                light { dir: [-1, 2, 1], intensity: 3, shadow: soft(0.3) }\n\
                render { occlusion: off }\n\
                (field(fn(p) => 0.4 - cos(5 * p.x) * cos(5 * p.z)) & box(2.2)) | plane(Y, at: -1.3)";
    let [cpu, gpu] =
        [EngineKind::Cpu, EngineKind::Wgsl].map(|kind| picture_on(kind, text, [160, 120]).rgba8());
    let differing = cpu.iter().zip(&gpu).filter(|(a, b)| a != b).count();
    assert!(differing <= 3 * MAX_EDGE_CHANNELS, "{differing} channels");
}

/// Penumbras of wide lights depend only on surfaces, not on the fields that define them, alone or in a
/// point map.
#[test]
fn wide_lights_depend_only_on_surfaces() {
    let scene = |light: &str, shape: &str| {
        format!(
            "camera {{ from: [2, 2.4, 3], look: [0, 0, 0], fov: 40deg }}\n\
             light {{ {light} }}\n\
             render {{ occlusion: off, far: 60 }}\n\
             {shape} | plane(Y, at: -0.6)\n"
        )
    };
    let wavy = "warp(fn(p) => [p.x, p.y + 0.2 * sin(3 * p.x), p.z])";
    let two = |ball: &str, map: &str| format!("({ball} | sphere(0.3).translate(0.9, 0, 0)).{map}");
    let ball = "sphere(0.5)";
    let mut pairs: Vec<([String; 2], usize)> = [
        "field(fn(p) => dot(p, p) - 0.25)",
        "field(fn(p) => pow(length(p), 3) - 0.125)",
        "field(fn(p) => exp(length(p)) - exp(0.5))",
        "field(fn(p) => (length(p) - 0.5) * (1 + 0.2 * length(p)))",
        "field(fn(p) => pow(dot(p, p), 6) - pow(0.25, 6))",
        "field(fn(p) => exp(10 * length(p)) - exp(5))",
        "field(fn(p) => 2 - 1 / length(p))",
        "field(fn(p) => 4 - 1 / dot(p, p))",
    ]
    .map(|field| ([field.to_owned(), ball.to_owned()], MAX_EDGE_CHANNELS))
    .to_vec();
    for field in [
        "field(fn(p) => 50 * (length(p) - 0.5))",
        "field(fn(p) => 0.02 * (length(p) - 0.5))",
        "field(fn(p) => pow(dot(p, p), 6) - pow(0.25, 6))",
    ] {
        for map in [wavy, "twist(20deg)"] {
            pairs.push(([two(field, map), two(ball, map)], MAX_EDGE_CHANNELS));
        }
    }
    let turned = "fn turned(p: vec3) -> vec3 { let c = cos(1.2 * p.y); let s = sin(1.2 * p.y); \
        [c * p.x - s * p.z, p.y, s * p.x + c * p.z] }\n";
    let bar = "field(fn(p) => { let q = abs(turned(p)) - [0.2, 0.5, 0.2]; \
        length(max(q, vec3(0))) + min(max(q.x, max(q.y, q.z)), 0) })";
    pairs.push((
        [
            format!("{turned}box(0.4, 1, 0.4).warp(turned)"),
            format!("{turned}{bar}"),
        ],
        MAX_LOOSE_CHANNELS,
    ));
    // Half of a slot that ends at its mirror plane.
    let slotted = |slot: &str| format!("(box(1.2, 0.6, 1.2) - {slot})");
    pairs.push((
        [
            slotted("box(0.2, 0.6, 2).translate(0.1, 0.2, 0).mirror(X)"),
            slotted("box(0.4, 0.6, 2).translate(0, 0.2, 0)"),
        ],
        MAX_EDGE_CHANNELS,
    ));
    // Sharp edges of cuts, beside the same solid without a cut.
    for [cut, other] in [
        [
            "(cone(r1: 0.5, r2: 0, h: 1) - cylinder(r: 0.3, h: 1))",
            "polygon([[0.3, -0.5], [0.5, -0.5], [0.3, -0.1]]).revolve()",
        ],
        [
            "(plane([-1, -1, -1], at: 0.2) & plane([-1, 1, 1], at: 0.2) \
             & plane([1, -1, 1], at: 0.2) & plane([1, 1, -1], at: 0.2))",
            "tetrahedron(0.6)",
        ],
        [
            "(plane([0.92, 0.58, 0], at: 0.16) & plane([-0.92, 0.18, 0], at: 0.16) & plane(-Y, at: 0.5) & slab(Z, 1.6))",
            "polygon([[0.5043593, -0.5000000], [-0.0796236, 0.4263178], [-0.2608597, -0.5000000]]).extrude(1.6)",
        ],
    ] {
        pairs.push(([cut.to_owned(), other.to_owned()], MAX_SHARP_CHANNELS));
    }
    // A dent, whose cutter ends in the surface of the ball.
    let dent = "sphere(0.2).translate(0, 0.35, -0.3)";
    pairs.push((
        [
            format!("({ball} - ({dent} & {ball}))"),
            format!("({ball} - {dent})"),
        ],
        MAX_EDGE_CHANNELS,
    ));
    let mut failures = Vec::new();
    for light in [
        "dir: [0.5, 0.8, 0.3], shadow: soft(0.4)",
        "dir: [-0.6, 0.8, 0.2], shadow: plain(0.3)",
    ] {
        for ([first, other], max_count) in &pairs {
            let count = differing_channels(&scene(light, first), &scene(light, other));
            if count > *max_count {
                failures.push(format!("{light}, {first}: {count} channels"));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// A solid with a closed-form ray intersection.
#[derive(Clone, Copy)]
enum Solid {
    /// A box with this centre and these half sides.
    Cuboid(DVec3, DVec3),
    /// A sphere with this centre and radius.
    Ball(DVec3, f64),
}

impl Solid {
    /// Returns its text in a scene.
    fn text(self) -> String {
        match self {
            Self::Cuboid(DVec3 { x, y, z }, half) => {
                let sides = 2.0 * half;
                format!(
                    "box({}, {}, {}).translate({x}, {y}, {z})",
                    sides.x, sides.y, sides.z
                )
            }
            Self::Ball(DVec3 { x, y, z }, radius) => {
                format!("sphere({radius}).translate({x}, {y}, {z})")
            }
        }
    }

    /// Reports whether the segment from `p` to `p + d` intersects the solid.
    fn blocks(self, p: DVec3, d: DVec3) -> bool {
        match self {
            Self::Cuboid(middle, half) => {
                let (mut first, mut last) = (0.0_f64, 1.0_f64);
                for axis in 0..3 {
                    let ends = [-half[axis], half[axis]]
                        .map(|side| (middle[axis] + side - p[axis]) / d[axis]);
                    first = first.max(ends[0].min(ends[1]));
                    last = last.min(ends[0].max(ends[1]));
                }
                first < last
            }
            Self::Ball(middle, radius) => {
                let to = middle - p;
                let nearest = (to.dot(d) / d.length_squared()).clamp(0.0, 1.0);
                (to - nearest * d).length_squared() < radius * radius
            }
        }
    }
}

/// Returns the vector from a point to a light, given by its direction or its position.
fn vector_to_light(light: (DVec3, bool), p: DVec3) -> DVec3 {
    match light {
        (position, true) => position - p,
        (direction, false) => 100.0 * direction,
    }
}

/// Returns the number of hidden points of a light's disc, seen from `p`, and their total number. The
/// points lie on rings up to `radius` times the disc's radius.
fn hidden_points(
    solids: &[Solid],
    light: (DVec3, bool),
    size: f64,
    p: DVec3,
    radius: f64,
) -> (usize, usize) {
    let axis = vector_to_light(light, p);
    let length = axis.length();
    let unit = axis / length;
    let aside = unit.cross(DVec3::new(0.3, 0.1, 0.9));
    let right = aside / aside.length();
    let up = unit.cross(right);
    let mut hidden = 0;
    let mut count = 0;
    for ring in 0..=8_u32 {
        for turn in 0..24_u32 {
            let angle = f64::from(turn) * std::f64::consts::TAU / 24.0;
            let out = size * length * radius * f64::from(ring) / 8.0;
            let (sin, cos) = angle.sin_cos();
            let offset = axis + out * (cos * right + sin * up);
            let is_hidden = offset.y <= 0.0 || solids.iter().any(|solid| solid.blocks(p, offset));
            hidden += usize::from(is_hidden);
            count += 1;
        }
    }
    (hidden, count)
}

/// Converts an sRGB byte to linear light. It duplicates the renderer's function on purpose, so that the
/// check shares no code with it.
fn linear(byte: u8) -> f64 {
    let v = f64::from(byte) / 255.0;
    if v <= 0.04045 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}

/// Returns the pixels of the ground whose lighting contradicts the visibility of the light's disc. Pixels
/// are dark where the disc is hidden, fully lit where it is visible, and at most half lit where its
/// centre is hidden.
fn wrongly_lit(solids: &[Solid], light: (DVec3, bool), size: f64, form: &str) -> Vec<String> {
    const SIDE: usize = 96;
    let (position, is_near) = light;
    let key = if is_near { "at" } else { "dir" };
    let scene = |shadow: &str| {
        let shapes: Vec<String> = solids.iter().map(|solid| solid.text()).collect();
        format!(
            "camera {{ from: [0, 20, 0], look: [0, 0, 0], up: [0, 0, -1], height: 6 }}\n\
             light {{ {key}: [{}, {}, {}], intensity: 3, shadow: {shadow} }}\n\
             sky {{ top: #000000, horizon: #000000, ground: #000000, ambient: 0 }}\n\
             render {{ occlusion: off, far: 60 }}\n\
             {} | plane(Y)\n",
            position[0],
            position[1],
            position[2],
            shapes.join(" | ")
        )
    };
    let shaded = picture(&scene(&format!("{form}({size})")), [SIDE as u32; 2]);
    let full = picture(&scene("none"), [SIDE as u32; 2]);
    let (shaded, full) = (shaded.rgba8(), full.rgba8());
    let mut failures = Vec::new();
    for y in 0..SIDE {
        for x in 0..SIDE {
            let to_scene =
                |pixel: usize, shift: f64| ((pixel as f64 + 0.5 + shift) / SIDE as f64 - 0.5) * 6.0;
            let [right, down] = SAMPLE_SHIFT;
            let p = DVec3::new(to_scene(x, right), 1e-6, to_scene(y, down));
            // Pixels covered by a solid are skipped.
            let above = DVec3::new(1e-9, 20.0, 1e-9);
            let near = DVec3::new(p.x, 0.0, p.z);
            if solids.iter().any(|solid| solid.blocks(near, above)) {
                continue;
            }
            let pixel_start = 4 * (y * SIDE + x);
            let (brightness, max) = (linear(shaded[pixel_start]), linear(full[pixel_start]));
            let (wide, count) = hidden_points(solids, light, size, p, 1.2);
            let (middle, _) = hidden_points(solids, light, size, p, 0.15);
            let fault = match wide {
                all if all == count => brightness > 0.002,
                0 => brightness < 0.97 * max,
                _ => middle == count && brightness > 0.55 * max,
            };
            if fault {
                failures.push(format!(
                    "{x}, {y}: {brightness:.3} of {max:.3}, {wide} of {count} hidden"
                ));
            }
        }
    }
    failures
}

/// Plates, beams and spheres of any thickness and at any distance from the ground that they shade.
#[test]
fn points_are_lit_only_where_a_light_is_visible() {
    let sheet =
        |thickness: f64| Solid::Cuboid(DVec3::new(0.3, 1.0, -0.2), DVec3::new(0.9, thickness, 0.7));
    let post = Solid::Cuboid(DVec3::new(-1.2, 0.8, 0.9), DVec3::new(0.1, 0.8, 0.1));
    let ball = Solid::Ball(DVec3::new(-1.0, 0.7, -1.0), 0.4);
    let sun = (DVec3::new(0.3, 1.0, 0.2), false);
    let bulb = (DVec3::new(0.1, 3.0, -0.1), true);
    for light in [sun, bulb] {
        for thickness in [0.002, 0.02, 0.2] {
            let solids = [sheet(thickness), post, ball];
            for (form, size) in [("sized", 0.08), ("sized", 0.02)] {
                let failures = wrongly_lit(&solids, light, size, form);
                assert!(
                    failures.is_empty(),
                    "{form}, {thickness}, {light:?}: {failures:#?}"
                );
            }
        }
    }
}

/// The penumbra of a light with a size on a polynomial is that on the shape itself. The field is divided by a large
/// bound, so rays to the rim of the light need many steps.
#[test]
fn polynomials_receive_the_penumbras_of_their_shapes() {
    let quartic = "field(fn(p) => { let s = dot(p, p) + 0.6; s * s - 2.56 * dot(p.xz, p.xz) })";
    // Its bound is a million times the slope at the surface, so steps are short.
    let slow = "field(fn(p) => { let s = dot(p, p) + 0.6; let f = s * s - 2.56 * dot(p.xz, p.xz); \
        f + 40 * f * f * f })";
    let near = "camera { from: [3, 0.6, 1.5], look: [1.2, -0.4, 0], fov: 24deg }\nlight { dir: [-0.6, 1, 0.5], ";
    let low = "camera { from: [3, 1.6, 2.5], look: [0.6, -0.4, 0], fov: 40deg }\nlight { dir: [-0.6, 0.5, 0.5], ";
    for (view, size) in [(near, 0.02), (near, 0.08), (low, 0.02), (low, 0.04)] {
        let scene = |ring: &str| {
            format!("{view}shadow: sized({size}) }}\nsphere(1) | {ring}.translate(2, -0.5, 0)\n")
        };
        let rings = ["torus(r1: 0.8, r2: 0.2)", quartic, slow];
        let [first, others @ ..] = rings.map(|ring| picture(&scene(ring), [120, 90]).rgba8());
        for (ring, other) in rings[1..].iter().zip(others) {
            let differing = first.iter().zip(&other);
            let differing = differing.filter(|&(&a, &b)| a.abs_diff(b) > 8).count();
            assert!(
                differing <= MAX_EDGE_CHANNELS,
                "{view}, {size}, {ring}: {differing} channels"
            );
        }
    }
}

/// A light in a closed case does not leak through its walls, however thin.
#[test]
fn closed_cases_keep_their_light() {
    for thickness in [0.002, 0.02, 0.1] {
        for form in [
            "hard",
            "plain(0.05)",
            "soft(0.05)",
            "sized(0.08)",
            "sized(0.02)",
        ] {
            let text = format!(
                "camera {{ from: [2.5, 2, 3], look: [0, 0.4, 0], fov: 50deg }}\n\
                 light {{ at: [0.02, 0.5, 0.03], intensity: 4, shadow: {form} }}\n\
                 sky {{ top: #000000, horizon: #000000, ground: #000000, ambient: 0 }}\n\
                 box(0.4, 0.3, 0.4).shell({thickness}).translate(0, 0.5, 0) | plane(Y) | plane(Z, at: -2)\n"
            );
            let image = picture(&text, [96, 72]);
            let bytes = image.rgba8();
            let lit = (0..72).flat_map(|y| (0..96).map(move |x| (x, y)));
            let lit = lit
                .filter(|&(x, y)| brightness(&image, &bytes, x, y) > 3)
                .count();
            assert_eq!(lit, 0, "{form}, {thickness}");
        }
    }
}

/// A shadow depends on the sign changes of a field, not on its slope there or elsewhere.
#[test]
fn hard_shadows_of_steep_and_flat_fields_are_those_of_a_sphere() {
    let scene = |shape: &str| {
        format!(
            "camera {{ from: [2.6, 2.2, 3.6], look: [0, -0.1, 0], fov: 42deg }}\n\
             light {{ dir: [-1, 2, 1.5], shadow: hard }}\n\
             render {{ occlusion: off, far: 60 }}\n\
             {shape} | plane(Y, at: -1.3)\n"
        )
    };
    let ball = picture(&scene("sphere(1)"), [96, 72]).rgba8();
    for body in [
        "(length(p) - 1) * 0.000000000001",
        "(length(p) - 1) * 1000000",
        "pow(length(p), 20) - 1",
        "(pow(length(p), 40) - 1) * 0.000000000000001",
    ] {
        let other = picture(
            &scene(&format!("field(fn(p) => {body}, within: 3)")),
            [96, 72],
        )
        .rgba8();
        let worst = ball.iter().zip(&other).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(worst <= Some(1), "{body}: {worst:?}");
    }
}

/// A light 2.6 mm from a bar of 30 mm, 3 m above a floor. The near part of the floor lies entirely behind the
/// bar.
#[test]
fn a_light_beside_its_holder_lights_no_floor_behind_it() {
    let text = |intensity: f64| {
        format!(
            "camera {{ from: [2.5, 1.2, 5.5], look: [0.5, 1.5, 0], fov: 45deg }}\n\
             light bulb {{ at: [0, 3.05, 0.8], intensity: {intensity}, shadow: hard }}\n\
             capsule(from: [0, 3.0776457, 0.7333333], to: [0, 3, 0.8], r: 0.03) | plane(Y).color(#808080)"
        )
    };
    let size = [320, 240];
    let [lit, dark] = [12.0, 0.0].map(|intensity| picture(&text(intensity), size).rgba8());
    let floor = 4 * 200 * 320;
    let failures = lit[floor..].chunks(4).zip(dark[floor..].chunks(4));
    let failures = failures.filter(|(lit, dark)| lit != dark).count();
    assert_eq!(failures, 0, "pixels are lit through the bar");
}

/// Penumbras are wider than sheets are thick, and show no holes.
#[test]
fn thin_sheets_cast_shadows_of_thick_ones() {
    let scene = |sheet: &str, form: &str| {
        format!(
            "camera {{ from: [6, 7, 12], look: [-1, 0, -1], fov: 30deg }}\n\
             light {{ dir: [1, 3, 1], shadow: {form} }}\n\
             render {{ occlusion: off }}\n\
             plane(Y) | sphere(0.5).translate(0, 0.5, 0) | {sheet}.translate(0, 8, 0)\n"
        )
    };
    for form in ["hard", "plain(0.1)", "soft(0.1)", "sized(0.1)"] {
        for (thick, thin) in [
            ("box(5, 0.01, 5)", "box(5, 0.0001, 5)"),
            (
                "box(5, 0.01, 5).rotate(35deg, X)",
                "box(5, 0.001, 5).rotate(35deg, X)",
            ),
            ("sphere(2).shell(0.01)", "sphere(2).shell(0.0002)"),
            (
                "field(fn(p) => max(abs(length(p) - 1.5) - 0.01, p.y), within: 5)",
                "field(fn(p) => max(abs(length(p) - 1.5) - 0.0001, p.y), within: 5)",
            ),
        ] {
            let sheet = thin;
            let [thick, thin] =
                [thick, thin].map(|sheet| picture(&scene(sheet, form), [96, 72]).rgba8());
            let differing = thick.iter().zip(&thin);
            let differing = differing.filter(|&(&a, &b)| a.abs_diff(b) > 6).count();
            assert!(
                differing <= MAX_EDGE_CHANNELS,
                "{form}, {sheet}: {differing} channels"
            );
        }
    }
}

/// The rim of a funnel is as sharp as a knife: a cut gives the penumbra of the profile without one.
#[test]
fn penumbras_of_a_funnel_are_those_of_its_profile() {
    let scene = |funnel: &str| {
        format!(
            "scene {{ units: mm, up: z }}\n\
             camera {{ from: [-41, 66, 150], look: [-13, 28, -30], height: 24 }}\n\
             light {{ dir: [1, -2, 3], shadow: soft(0.1) }}\n\
             {funnel} | plane(Z, at: -30)\n"
        )
    };
    let cut = picture(
        &scene("(cone(d1: 40, d2: 0, h: 40) - cylinder(d: 8, h: 40))"),
        [160, 120],
    );
    let profile = picture(
        &scene("polygon([[4, -20], [20, -20], [4, 12]]).revolve()"),
        [160, 120],
    );
    let (cut, profile) = (cut.rgba8(), profile.rgba8());
    let channels = cut.iter().zip(&profile);
    let count = channels.filter(|&(&a, &b)| a.abs_diff(b) > 2).count();
    assert!(count <= MAX_FUNNEL_CHANNELS, "{count} channels");
}
