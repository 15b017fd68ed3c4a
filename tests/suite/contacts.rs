//! Parts that touch without overlap, compared with the one solid that they make, from cameras with rays in
//! the planes of contact.

use crate::metamorphic::draw::{DrawOptions, image};
use glam::Vec3;
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{Engine, EngineKind, open};
use sdfc_runtime::render::CellMode;
use sdfc_trials::skip::is_gpu_skipped;

/// Parts, and the solid that they make.
const SOLIDS: [(&str, &str); 5] = [
    (
        "box(30, 20, 8).translate(0, -4, 0) | box(30, 12, 8).translate(0, 12, 0)",
        "box(30, 32, 8).translate(0, 2, 0)",
    ),
    (
        "box(20, 20, 8).translate(-10, 0, 0).color(#c03020) | box(20, 20, 8).translate(10, 0, 0).color(#2040c0)",
        "box(40, 20, 8)",
    ),
    (
        "box(8, 8, 8).repeat([8, 8, 0], [4, 3, 1])",
        "box(32, 24, 8)",
    ),
    (
        "union(for x in [-10, 10] { union(for y in [-10, 10] { box(20, 20, 8).translate(x, y, 0) }) })",
        "box(40, 40, 8)",
    ),
    (
        "(box(40, 40, 8) - box(20, 50, 10)) | box(20, 40, 8)",
        "box(40, 40, 8)",
    ),
];

/// Views along the planes of contact: parallel rays with one unit per pixel, and perspective.
const CAMERAS: [&str; 4] = [
    "camera { from: [0, 0, 90], look: [0, 0, 0], height: 73 }",
    "camera { from: [0.5, 0.5, 90], look: [0.5, 0.5, 0], height: 72 }",
    "camera { from: [0, 0, 90], look: [0, 0, 0], fov: 45deg }",
    "camera { from: [0, 30, 90], look: [0, 0, 0], fov: 40deg }",
];

/// Sizes of pictures: with a pixel in the middle, and without.
const SIZES: [[u32; 2]; 2] = [[97, 73], [96, 72]];

#[test]
fn nobody_sees_through_the_plane_of_a_contact() {
    let mut cpu = open(EngineKind::Cpu).expect("there is always a CPU");
    let mut failures = String::new();
    for solid in SOLIDS {
        for camera in CAMERAS {
            for size in SIZES {
                failures += &differing_pixels(&mut *cpu, solid, camera, size, CellMode::Auto);
            }
        }
    }
    assert!(failures.is_empty(), "\n{failures}");
}

/// A plug in its hole, seen along its axis: some of its rays are as close to the contact as rounding.
#[test]
fn curved_contacts_have_no_specks() {
    let plug = (
        "(box(20, 20, 5) - cylinder([0, 0, -9], [0, 0, 9], 6)) | cylinder([0, 0, -2.5], [0, 0, 2.5], 6)",
        "box(20, 20, 5)",
    );
    let cameras = [
        "camera { from: [0, 0, 95], look: [0, 0, 2.5], up: Y, height: 24 }",
        "camera { from: [0, 0, 95], look: [0, 0, 2.5], up: Y, fov: 15deg }",
        "camera { from: [0, 0, 900], look: [0, 0, 2.5], up: [1, 3, 0], fov: 2deg }",
    ];
    let size = [480, 480];
    let mut cpu = open(EngineKind::Cpu).expect("there is always a CPU");
    let mut failures = String::new();
    for camera in cameras {
        for cells in [CellMode::Never, CellMode::Always] {
            failures += &differing_pixels(&mut *cpu, plug, camera, size, cells);
        }
    }
    if !is_gpu_skipped() {
        let mut gpu = open(EngineKind::Wgsl).expect("a GPU");
        failures += &differing_pixels(&mut *gpu, plug, cameras[0], size, CellMode::Never);
    }
    assert!(failures.is_empty(), "\n{failures}");
}

/// Two walls on each other, as fields whose steps are short. A row of rays lies exactly in the plane of contact, where
/// bounds along the rays alone exclude a value below zero.
#[test]
fn walls_of_steep_fields_have_no_gap() {
    let walls = |solid: &str| {
        format!(
            "fn wall(p, low, high) = max(max((abs(p.x - 0.1) - 0.05) * (2 + sin(100 * p.x)), abs(p.y) - 1), \
             max(low - p.z, p.z - high));\n{solid}"
        )
    };
    let [parts, whole] = [
        "field(fn(p) => wall(p, 8, 9)) | field(fn(p) => wall(p, 7, 8))",
        "field(fn(p) => wall(p, 7, 9))",
    ]
    .map(walls);
    let camera =
        "scene { up: z }\ncamera { from: [5, 0, 8], look: [0, 0, 8.021287075], fov: 30deg }";
    let mut cpu = open(EngineKind::Cpu).expect("there is always a CPU");
    let options = DrawOptions {
        size: SIZES[1],
        passes: PassOptions::default(),
        cells: CellMode::Always,
        scale: 1.0,
    };
    let [a, b] = [parts, whole].map(|solid| {
        image(&mut *cpu, &format!("{camera}\n{solid}\n"), &options).expect("a picture")
    });
    let gaps = a.status.iter().zip(&b.status).filter(|(a, b)| a != b);
    assert_eq!(gaps.count(), 0);
}

/// Compares a picture of parts with that of their solid; returns a line if pixels differ, else nothing.
fn differing_pixels(
    engine: &mut dyn Engine,
    (parts, whole): (&str, &str),
    camera: &str,
    size: [u32; 2],
    cells: CellMode,
) -> String {
    let options = DrawOptions {
        size,
        passes: PassOptions::default(),
        cells,
        scale: 1.0,
    };
    let [a, b] = [parts, whole].map(|shape| {
        image(engine, &format!("{camera}\n{shape}\n"), &options)
            .unwrap_or_else(|errors| panic!("{shape}: {errors}"))
    });
    let differs = |&pixel: &usize| {
        let [n, m] = [&a, &b].map(|image| Vec3::from(image.normal[pixel]));
        a.status[pixel] != b.status[pixel] || n.dot(m) < 0.99 * m.length_squared()
    };
    match (0..a.status.len()).filter(differs).count() {
        0 => String::new(),
        differing => format!("{parts}, {camera}, {size:?}, {cells:?}: {differing} pixels\n"),
    }
}
