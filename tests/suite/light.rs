//! Light in scenes that were once lit wrongly, on the CPU.

use crate::metamorphic::draw::{Way, frame};
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{EngineKind, open};
use sdfc_runtime::frame::{CellUse, Frame};

/// The picture of a text, with one sample for each pixel.
fn picture(text: &str, size: [u32; 2]) -> Frame {
    let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
    let way = Way {
        size,
        passes: PassOptions::default(),
        cells: CellUse::Auto,
        scale: 1.0,
    };
    frame(&mut *engine, text, &way).expect("it compiles")
}

/// The brightness of a pixel, from 0 to 765.
fn brightness(frame: &Frame, bytes: &[u8], x: usize, y: usize) -> i32 {
    let at = 4 * (y * frame.width + x);
    bytes[at..at + 3]
        .iter()
        .map(|&channel| i32::from(channel))
        .sum()
}

/// The pixels that are brighter than all eight around them by more than `most` of 765.
fn bright_dots(frame: &Frame, most: i32) -> Vec<[usize; 2]> {
    let bytes = frame.rgba8();
    let pixels = (1..frame.height - 1).flat_map(|y| (1..frame.width - 1).map(move |x| [x, y]));
    pixels
        .filter(|&[x, y]| {
            let own = brightness(frame, &bytes, x, y);
            let around = (y - 1..=y + 1).flat_map(|v| (x - 1..=x + 1).map(move |u| [u, v]));
            let mut others = around.filter(|&other| other != [x, y]);
            others.all(|[u, v]| brightness(frame, &bytes, u, v) + most < own)
        })
        .collect()
}

/// Rays that pass an edge nearby are darkened by it, however far away the eye is.
#[test]
fn shadows_of_inner_rims_have_no_bright_dots() {
    let text = "scene { units: mm, up: z }\n\
        camera { from: [0, -20, 140], look: [0, 0, 5], fov: 40deg }\n\
        box(80, 60, 20) - box(76, 56, 18).translate(0, 0, 1)\n";
    let found = bright_dots(&picture(text, [800, 600]), 30);
    assert!(found.is_empty(), "{found:?}");
}
