//! The hard cases: each scene of `tests/hard` holds one idea that pictures of distance fields fail at,
//! and is measured against the truth that the engine `reference` proves, from all of its cameras.
//!
//! What every picture must keep: no ray is wrong away from silhouettes, none is lost to a value that
//! is not a number or to the cap of steps, 99 of 100 depths are within 1e-5 of the truth and normals
//! within 0.1°. Where `f32` cannot do that, [`LIMITS`] says what it can do instead, and why.
//! `SDFC_MEASURE=1 cargo test --test suite hard:: -- --nocapture` prints all numbers, `SDFC_CASE=tips`
//! looks at one case only.

mod acne;
mod chains;
mod measure;
mod places;
mod scales;
mod steps;

use crate::corpus::{name, scenes};
use measure::{Measured, Shot, measured, shots};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::frame::CellUse;
use std::path::Path;

/// What a picture may be off by.
#[derive(Clone, Copy, Debug)]
struct Limit {
    /// Rays that are wrong away from silhouettes.
    mismatches: usize,
    /// The error of 99 of 100 depths, as a share of the depth.
    depth: f64,
    /// The error of 99 of 100 normals in degrees.
    normals: f64,
    /// Rays that run out of steps.
    step_caps: usize,
    /// The share of rays of which the truth is not known.
    undecided: f64,
}

/// What is asked of every picture.
const GATE: Limit = Limit {
    mismatches: 0,
    depth: 1e-5,
    normals: 0.1,
    step_caps: 0,
    undecided: 0.01,
};

/// What is asked of pictures that cannot be better, and why they cannot.
const LIMITS: [(&str, Limit); 2] = [
    // Where a shape is taken away from itself, all rays only touch what is left.
    (
        "coincident",
        Limit {
            undecided: 0.05,
            ..GATE
        },
    ),
    // The rays of one line of pixels never leave the plane by more than rounding.
    (
        "grazing_plane/horizon",
        Limit {
            undecided: 0.02,
            ..GATE
        },
    ),
];

/// The size of the CPU's pictures, and of those that devices draw in software.
const SIZE: [u32; 2] = [96, 64];
const SMALL: [u32; 2] = [48, 32];

fn limit(shot: &Shot) -> Limit {
    let found = LIMITS.iter().find(|(of, _)| *of == shot.name);
    found.map_or(GATE, |&(_, limit)| limit)
}

/// What of a picture is beyond its limit.
fn faults(shot: &Shot, measured: &Measured) -> Option<String> {
    let (limit, e) = (limit(shot), &measured.errors);
    let undecided = e.undecided as f64 / e.pixels as f64;
    let kept = e.mismatches_inside <= limit.mismatches
        && e.nans == 0
        && e.step_caps <= limit.step_caps
        && e.depth_smooth.p99 <= limit.depth
        && e.normals.p99 <= limit.normals
        && undecided <= limit.undecided;
    (!kept).then(|| format!("{measured}, but {limit:?} is asked for"))
}

#[test]
fn pictures_of_the_cpu_are_near_the_truth() {
    let mut failures = Vec::new();
    let only = std::env::var("SDFC_CASE").unwrap_or_default();
    let paths = scenes("tests/hard");
    for path in paths.iter().filter(|path| name(path).contains(&only)) {
        for shot in shots(path, SIZE) {
            for cells in [CellUse::Never, CellUse::Always] {
                let measured = measured(&shot, EngineKind::Cpu, cells);
                measured.print();
                failures.extend(faults(&shot, &measured));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Scenes for devices that software stands in for, which take their time.
const ON_DEVICES: [&str; 8] = [
    "grazing_plane",
    "thin_shells",
    "displacement",
    "seams",
    "silhouettes",
    "axes",
    "flat_field",
    "inside",
];

#[test]
fn pictures_of_devices_are_near_the_truth() {
    if let Ok(reason) = std::env::var("SDFC_SKIP_GPU") {
        eprintln!("skipped: no hard case is drawn on a device ({reason})");
        return;
    }
    let mut failures = Vec::new();
    for scene in ON_DEVICES {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/hard/{scene}.sdf"));
        let shot = shots(&path, SMALL).swap_remove(0);
        for kind in [EngineKind::Interp, EngineKind::Wgsl] {
            let measured = measured(&shot, kind, CellUse::Auto);
            measured.print();
            failures.extend(faults(&shot, &measured));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn every_case_says_what_it_holds_and_every_limit_has_a_case() {
    let paths = scenes("tests/hard");
    for path in &paths {
        let text = std::fs::read_to_string(path).expect("it can be read");
        let first = text.lines().next().unwrap_or_default();
        assert!(
            first.starts_with("// ") && first.contains(':') && first.ends_with('.'),
            "{}: {first}",
            path.display()
        );
    }
    let names: Vec<String> = paths.iter().map(|path| name(path)).collect();
    for (of, _) in LIMITS {
        let scene = of.split('/').next().unwrap_or_default();
        assert!(names.iter().any(|name| name == scene), "{of} is no case");
    }
}
