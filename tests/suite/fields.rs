//! Fields of eight families, in the language or as clauses, compared with the oracle of the strangers' scenes. Each is
//! seen through three cameras: the automatic one, one from below, and one inside the solid.
//!
//! Files are in `tests/fields`; the first line of each states its family. Excuses are those of strangers' scenes.

use crate::corpus::{compiled_scene, on_large_stack, scene};
use crate::strangers::{Case, errors_of};
use sdfc_runtime::settings::CameraChanges;
use sdfc_vm::evaluate::evaluate_f64;
use std::path::{Path, PathBuf};

/// Number of points of which the deepest is the position of the camera inside.
const POINTS: u32 = 2000;

fn files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fields");
    let entries = std::fs::read_dir(folder).expect("the folder can be read");
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.expect("its entries too").path())
        .collect();
    files.sort();
    files
}

/// Returns the cameras of a file.
fn cameras(path: &Path) -> [CameraChanges; 3] {
    let scene = scene(path);
    let mut compiled = on_large_stack(|| compiled_scene(scene));
    compiled.update(0.0);
    let region = compiled.module.settings.clip_bounds();
    let points = (1..=POINTS).map(|number| region.quasi_random_point(number));
    let depth = |p: &[f64; 3]| evaluate_f64(&compiled.module.distance, *p);
    let deepest = points
        .min_by(|a, b| depth(a).total_cmp(&depth(b)))
        .expect("there are points");
    assert!(
        depth(&deepest) < 0.0,
        "{}: nothing is inside",
        path.display()
    );
    let size = region.half_diagonal();
    let centre = region.centre();
    let below = [
        centre[0] - 1.1 * size,
        centre[1] - 1.7 * size,
        centre[2] + 1.4 * size,
    ];
    let from = |from, look| CameraChanges {
        from: Some(from),
        look: Some(look),
        ..CameraChanges::default()
    };
    let ahead = [deepest[0] - 0.3, deepest[1] + 0.2, deepest[2] - 1.0];
    [
        CameraChanges::default(),
        from(below, centre),
        from(deepest, ahead),
    ]
}

#[test]
fn fields_show_the_hits_of_the_oracle() {
    let mut files = files();
    if let Ok(wanted) = std::env::var("SDFC_ONLY") {
        files.retain(|path| path.to_string_lossy().contains(&wanted));
    }
    let cases: Vec<Case> = files
        .iter()
        .flat_map(|path| {
            let cameras = cameras(path);
            cameras.map(|camera| Case {
                path: path.clone(),
                camera,
            })
        })
        .collect();
    let report = errors_of(&cases);
    assert!(report.is_empty(), "\n{report}");
}
