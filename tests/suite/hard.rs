//! Hard cases: each scene of `tests/hard` covers one feature that breaks pictures of distance fields. It
//! is compared with the ground truth proved by the engine `reference`, from all of its cameras.
//!
//! Requirements of every picture: no ray is wrong away from silhouettes, and none is lost to NaN or to
//! the step cap. 99 % of depths are within 1e-5 of the truth, and 99 % of normals within 0.1°. Where
//! `f32` cannot achieve that, [`LIMITS`] states the achievable limits and the reason. `SDFC_MEASURE=1
//! cargo test --test suite hard:: -- --nocapture` prints all numbers; `SDFC_CASE=tips` selects one case.

mod acne;
mod chains;
mod measure;
mod places;
mod scales;
mod steps;

use crate::corpus::{name, scenes};
use measure::{Measured, Shot, measured, shots};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::render::CellMode;
use sdfc_trials::skip::is_gpu_skipped;
use std::path::Path;

/// Limits of the errors of a picture.
#[derive(Clone, Copy, Debug)]
struct Limit {
    /// Maximum number of wrong rays away from silhouettes.
    mismatches: usize,
    /// Maximum 99th percentile of the depth errors, relative to the depth.
    depth: f64,
    /// Maximum 99th percentile of the normal errors, in degrees.
    normals: f64,
    /// Maximum number of rays that run out of steps.
    step_caps: usize,
    /// Maximum fraction of rays with undecided truth.
    undecided: f64,
}

/// Default limits.
const DEFAULT_LIMIT: Limit = Limit {
    mismatches: 0,
    depth: 1e-5,
    normals: 0.1,
    step_caps: 0,
    undecided: 0.01,
};

/// Exceptions from the default limits, with reasons.
const LIMITS: [(&str, Limit); 2] = [
    // A shape is subtracted from itself, so all rays only graze the rest.
    (
        "coincident",
        Limit {
            undecided: 0.05,
            ..DEFAULT_LIMIT
        },
    ),
    // The rays of one row of pixels stay within rounding of the plane.
    (
        "grazing_plane/horizon",
        Limit {
            undecided: 0.02,
            ..DEFAULT_LIMIT
        },
    ),
];

/// Picture sizes on the CPU, and on software devices.
const SIZE: [u32; 2] = [96, 64];
const DEVICE_SIZE: [u32; 2] = [48, 32];

fn limit(shot: &Shot) -> Limit {
    let exception = LIMITS
        .iter()
        .find(|(limit_name, _)| *limit_name == shot.name);
    exception.map_or(DEFAULT_LIMIT, |&(_, limit)| limit)
}

/// Returns a description of the violated limits of a picture.
fn violations(shot: &Shot, measured: &Measured) -> Option<String> {
    let (limit, e) = (limit(shot), &measured.errors);
    let undecided = e.undecided as f64 / e.pixels as f64;
    let is_within = e.mismatches_inside <= limit.mismatches
        && e.nans == 0
        && e.step_caps <= limit.step_caps
        && e.depth_smooth.p99 <= limit.depth
        && e.normals.p99 <= limit.normals
        && undecided <= limit.undecided;
    (!is_within).then(|| format!("{measured}, but {limit:?} is asked for"))
}

#[test]
fn pictures_of_the_cpu_are_near_the_truth() {
    let mut failures = Vec::new();
    let filter = std::env::var("SDFC_CASE").unwrap_or_default();
    let paths = scenes("tests/hard");
    for path in paths.iter().filter(|path| name(path).contains(&filter)) {
        for shot in shots(path, SIZE) {
            for cells in [CellMode::Never, CellMode::Always] {
                let measured = measured(&shot, EngineKind::Cpu, cells);
                measured.print();
                failures.extend(violations(&shot, &measured));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Subset of scenes for devices, which are slow in software.
const DEVICE_SCENES: [&str; 9] = [
    "foils_afar",
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
    if is_gpu_skipped() {
        return;
    }
    let mut failures = Vec::new();
    for scene in DEVICE_SCENES {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/hard/{scene}.sdf"));
        let shot = shots(&path, DEVICE_SIZE).swap_remove(0);
        for kind in [EngineKind::Interp, EngineKind::Wgsl] {
            let measured = measured(&shot, kind, CellMode::Auto);
            measured.print();
            failures.extend(violations(&shot, &measured));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn every_case_states_its_subject_and_every_limit_has_a_case() {
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
    for (limit_name, _) in LIMITS {
        let scene = limit_name.split('/').next().unwrap_or_default();
        assert!(
            names.iter().any(|name| name == scene),
            "{limit_name} is no case"
        );
    }
}
