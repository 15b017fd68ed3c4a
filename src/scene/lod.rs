//! `--lod`: a scene reduced to the detail that its picture shows.
//!
//! The size of a pixel follows from the scene's settings. The scene is compiled once for these alone, and
//! then for the camera that they give.

use super::{BuildArgs, OpenedScene};
use crate::failure::Failure;
use crate::terminal::Terminal;
use sdfc_compiler::open::SceneFile;
use sdfc_compiler::passes::lod::{LodTarget, PixelSize};
use sdfc_runtime::render::{RenderSettings, ResolvedLens};
use sdfc_runtime::settings::{Overrides, resolve};
use std::path::Path;

/// Flags for the level of detail of a scene.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct LodArgs {
    /// Maximum error in pixels, such as 0.5, to which details are simplified; by default all details
    /// stay.
    #[arg(long, value_name = "PIXELS", value_parser = pixels)]
    lod: Option<f64>,
}

fn pixels(text: &str) -> Result<f64, String> {
    let number = text.trim().parse::<f64>().ok();
    let number = number.filter(|number| *number > 0.0 && number.is_finite());
    number.ok_or_else(|| "write a number of pixels above 0, such as 0.5".to_owned())
}

impl LodArgs {
    /// Reads and compiles a file, as [`super::open()`] does, with that detail.
    pub(crate) fn open(
        &self,
        path: &Path,
        build: &BuildArgs,
        overrides: &Overrides,
        terminal: &Terminal,
    ) -> Result<OpenedScene, Failure> {
        let opened = super::open(path, build, terminal)?;
        let Some(tolerance) = self.lod else {
            return Ok(opened);
        };
        if build.level == 0 || build.no_pass.iter().any(|pass| pass == "lod") {
            return Err(Failure::Input(
                "`--lod` requires a pass that `-O0` or `--no-pass` leaves out".to_owned(),
            ));
        }
        let settings = resolve(opened.module(), &opened.uniform_values, overrides)
            .map_err(|error| Failure::Input(format!("{}: {error}", path.display())))?;
        recompile_for_view(path, build, &settings, tolerance)
    }

    /// Returns the result for the summary of a picture; empty without `--lod`.
    pub(crate) fn summary(&self, opened: &OpenedScene) -> String {
        let Some(tolerance) = self.lod else {
            return String::new();
        };
        let loss = opened.compiled.passes.iter().find_map(|pass| pass.loss);
        match loss.filter(|loss| loss.replaced > 0) {
            Some(loss) => format!(
                "; lod {tolerance} px: {} replaced, error at most {:.2} px",
                with_thousands_separators(loss.replaced),
                loss.max_error_pixels
            ),
            None => format!("; lod {tolerance} px: nothing replaced"),
        }
    }
}

/// Reports whether a file can be compiled with less detail: bytecode is compiled already, and `-O0` and
/// `--no-pass` omit the pass.
pub(crate) fn can_reduce_detail(path: &Path, build: &BuildArgs) -> Result<bool, Failure> {
    let is_pass_off = build.level == 0 || build.no_pass.iter().any(|pass| pass == "lod");
    Ok(!is_pass_off && !matches!(super::read(path)?, SceneFile::Bytecode(_)))
}

/// Compiles a file for a picture with these settings, with errors of at most `tolerance` pixels. Its
/// diagnostics were reported before.
pub(crate) fn recompile_for_view(
    path: &Path,
    build: &BuildArgs,
    settings: &RenderSettings,
    tolerance: f64,
) -> Result<OpenedScene, Failure> {
    let build = BuildArgs {
        lod_target: Some(lod_target(settings, tolerance)),
        ..build.clone()
    };
    super::unwrap_reported(super::compile(path, super::read(path)?, &build)?)
}

/// Returns the camera and the tolerance.
fn lod_target(settings: &RenderSettings, tolerance: f64) -> LodTarget {
    LodTarget {
        camera_position: settings.view.from,
        pixel: match settings.view.lens {
            ResolvedLens::Perspective(angle) => PixelSize::from_perspective(angle, settings.size),
            ResolvedLens::Orthographic(shown) => PixelSize::from_parallel(shown, settings.size),
        },
        tolerance,
    }
}

/// Formats a number with a comma between thousands.
fn with_thousands_separators(number: usize) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::{pixels, with_thousands_separators};

    #[test]
    fn thousands_have_separators() {
        assert_eq!(
            [7, 999, 1204, 1_000_000].map(with_thousands_separators),
            ["7", "999", "1,204", "1,000,000"]
        );
    }

    #[test]
    fn only_a_number_above_zero_is_a_tolerance() {
        assert_eq!(pixels("0.5"), Ok(0.5));
        for text in ["0", "-1", "inf", "nan", "", "half"] {
            assert!(pixels(text).is_err(), "{text}");
        }
    }
}
