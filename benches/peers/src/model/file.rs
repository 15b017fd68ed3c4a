//! Models in files: clauses (`.vm`) and scenes (`.sdf`), from any source.

use super::{DEFAULT_ANGLES, Model, ModelSource};
use crate::contestant::sdfc::EngineScene;
use crate::view::CubeView;
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::EngineKind;
use sdfc_vm::bounds::Bounds;
use std::path::{Path, PathBuf};

/// Margin around a model in its view, as a fraction of its size.
const VIEW_MARGIN: f64 = 0.05;

/// Returns the files of models in these files and folders, in the order of their names.
pub(super) fn model_files(paths: &[impl AsRef<Path>]) -> Result<Vec<PathBuf>, String> {
    let mut files = Vec::new();
    for path in paths.iter().map(AsRef::as_ref) {
        if !path.is_dir() {
            files.push(path.to_owned());
            continue;
        }
        let unreadable = |error| format!("{} cannot be read: {error}", path.display());
        let entries = std::fs::read_dir(path).map_err(unreadable)?;
        let mut in_folder = Vec::new();
        for entry in entries {
            let file = entry.map_err(unreadable)?.path();
            let extension = file.extension().and_then(|extension| extension.to_str());
            if matches!(extension, Some("vm" | "sdf")) {
                in_folder.push(file);
            }
        }
        in_folder.sort();
        files.extend(in_folder);
    }
    Ok(files)
}

/// Returns the name of the model in a file.
pub(super) fn model_name(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or(path.as_os_str());
    stem.to_string_lossy().into_owned()
}

/// Opens the model in a file.
pub(super) fn open(path: &Path) -> Result<Model, String> {
    let text = std::fs::read_to_string(path).map_err(|error| format!("it cannot be read: {error}"))?;
    let is_scene = path.extension().is_some_and(|extension| extension == "sdf");
    let compiled = match is_scene {
        true => EngineScene::from_text(&text, &PassOptions::default(), EngineKind::Cpu)?,
        false => EngineScene::from_clauses(&text, EngineKind::Cpu)?,
    };
    let settings = &compiled.module().settings;
    let is_2d = settings.is_2d;
    let view = stated_view(&text).unwrap_or_else(|| view_of(&settings.bounds, is_2d));
    let source = match is_scene {
        true => ModelSource::Scene { clauses: compiled.clauses()?, text },
        false => ModelSource::Clauses(text),
    };
    Ok(Model { name: model_name(path), source, is_2d, view })
}

/// Returns the view that a comment recommends, as Fidget's examples do: `--scale`, `--pitch` and `--yaw`.
fn stated_view(text: &str) -> Option<CubeView> {
    let mut comments = text.lines().filter_map(|line| line.trim_start().strip_prefix('#'));
    comments.find_map(|comment| {
        let option = |name: &str| {
            let mut words = comment.split_whitespace().skip_while(|word| *word != name);
            words.nth(1)?.parse::<f64>().ok()
        };
        let scale = option("--scale").filter(|scale| *scale > 0.0)?;
        let [pitch, yaw] = DEFAULT_ANGLES;
        let (pitch, yaw) = (option("--pitch").unwrap_or(pitch), option("--yaw").unwrap_or(yaw));
        Some(CubeView::new(1.0 / scale, pitch, yaw))
    })
}

/// Returns the view of a model with these bounds, in which it fits from any side.
fn view_of(bounds: &Bounds, is_2d: bool) -> CubeView {
    let (min, max) = (bounds.min, bounds.max);
    let [center_x, center_y, center_z] = [0, 1, 2].map(|axis| (min[axis] + max[axis]) / 2.0);
    if is_2d {
        // The square that Fidget shows keeps its place.
        let is_unit = (0..2).all(|axis| min[axis] >= -1.0 && max[axis] <= 1.0);
        let half = (0..2).map(|axis| (max[axis] - min[axis]) / 2.0).fold(0.0, f64::max);
        return match is_unit {
            true => CubeView::new(1.0, 0.0, 0.0),
            false => CubeView::new(half * (1.0 + VIEW_MARGIN), 0.0, 0.0).around([center_x, center_y, 0.0]),
        };
    }
    let [pitch, yaw] = DEFAULT_ANGLES;
    let half = bounds.half_diagonal() * (1.0 + VIEW_MARGIN);
    CubeView::new(half, pitch, yaw).around([center_x, center_y, center_z])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_view_in_a_comment_is_taken() {
        let view = stated_view("# Recommended settings: --scale 0.25 --pitch -25 --yaw 30\n_x var-x\n");
        assert_eq!(view.map(|view| view.half()), Some(4.0));
        assert!(stated_view("# a disc\n_x var-x\n").is_none());
        assert!(stated_view("# --scale 0\n").is_none());
    }

    #[test]
    fn solids_fit_into_their_view() {
        let bounds = Bounds { min: [1.0, 0.0, 0.0], max: [3.0, 2.0, 1.0] };
        let view = view_of(&bounds, false);
        assert!(view.half() > 1.5 && view.half() < 1.6, "{}", view.half());
        assert_eq!(view.camera().look, [2.0, 1.0, 0.5]);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let error = model_files(&["no/folder/x.vm"]).map(|files| open(&files[0]));
        assert!(matches!(error, Ok(Err(problem)) if problem.starts_with("it cannot be read")));
    }
}
