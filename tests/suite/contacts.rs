//! Parts that touch without overlap, compared with the one solid that they make, from cameras whose pixels have
//! their centres in the planes of contact.

use crate::metamorphic::draw::{DrawOptions, image};
use glam::Vec3;
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{EngineKind, open};
use sdfc_runtime::render::CellMode;

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
    let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
    let mut failures = String::new();
    for (parts, whole) in SOLIDS {
        for camera in CAMERAS {
            for size in SIZES {
                let options = DrawOptions {
                    size,
                    passes: PassOptions::default(),
                    cells: CellMode::Auto,
                    scale: 1.0,
                };
                let [a, b] = [parts, whole].map(|shape| {
                    image(&mut *engine, &format!("{camera}\n{shape}\n"), &options)
                        .unwrap_or_else(|errors| panic!("{shape}: {errors}"))
                });
                let differs = |&pixel: &usize| {
                    let [n, m] = [&a, &b].map(|image| Vec3::from(image.normal[pixel]));
                    a.status[pixel] != b.status[pixel] || n.dot(m) < 0.99 * m.length_squared()
                };
                let differing = (0..a.status.len()).filter(differs).count();
                if differing > 0 {
                    failures += &format!("{parts}, {camera}, {size:?}: {differing} pixels\n");
                }
            }
        }
    }
    assert!(failures.is_empty(), "\n{failures}");
}
