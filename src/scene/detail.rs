//! `--lod`: a scene with no more detail than its picture shows.
//!
//! What a pixel covers is known once the scene's settings are: it is compiled a first time for these
//! alone, and then for the eye that they give.

use super::{Build, Opened};
use crate::failure::Failure;
use crate::terminal::Terminal;
use sdfc_compiler::open::Content;
use sdfc_compiler::passes::lod::{Pixel, Sight};
use sdfc_runtime::frame::{Lens, RenderSettings};
use sdfc_runtime::settings::{Overrides, resolve};
use std::path::Path;

/// How much detail a scene keeps.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct Detail {
    /// Make simpler what is too small to be seen, with errors of at most so many pixels, such as 0.5;
    /// without it everything stays, as a final picture wants it.
    #[arg(long, value_name = "PIXELS", value_parser = pixels)]
    lod: Option<f64>,
}

fn pixels(text: &str) -> Result<f64, String> {
    let number = text.trim().parse::<f64>().ok();
    let number = number.filter(|number| *number > 0.0 && number.is_finite());
    number.ok_or_else(|| "write a number of pixels above 0, such as 0.5".to_owned())
}

impl Detail {
    /// Reads and compiles a file, as [`super::open()`] does, with so much detail.
    pub(crate) fn open(
        &self,
        path: &Path,
        build: &Build,
        look: &Overrides,
        terminal: &Terminal,
    ) -> Result<Opened, Failure> {
        let opened = super::open(path, build, terminal)?;
        let Some(tolerance) = self.lod else {
            return Ok(opened);
        };
        if build.level == 0 || build.no_pass.iter().any(|pass| pass == "lod") {
            return Err(Failure::Input(
                "`--lod` asks for a pass that `-O0` or `--no-pass` leaves out".to_owned(),
            ));
        }
        let settings = resolve(opened.module(), &opened.outputs, look)
            .map_err(|error| Failure::Input(format!("{}: {error}", path.display())))?;
        seen(path, build, &settings, tolerance)
    }

    /// What came of it, for the summary of a picture; nothing where nothing was asked for.
    pub(crate) fn told(&self, opened: &Opened) -> String {
        let Some(tolerance) = self.lod else {
            return String::new();
        };
        let loss = opened.compiled.passes.iter().find_map(|pass| pass.loss);
        match loss.filter(|loss| loss.replaced > 0) {
            Some(loss) => format!(
                "; lod {tolerance} px: {} replaced, error at most {:.2} px",
                grouped(loss.replaced),
                loss.pixels
            ),
            None => format!("; lod {tolerance} px: nothing replaced"),
        }
    }
}

/// Whether a file can be compiled with less detail: bytecode is compiled already, and `-O0` and
/// `--no-pass` leave the pass out that does it.
pub(crate) fn is_possible(path: &Path, build: &Build) -> Result<bool, Failure> {
    let left_out = build.level == 0 || build.no_pass.iter().any(|pass| pass == "lod");
    Ok(!left_out && !matches!(super::read(path)?, Content::Bytecode(_)))
}

/// Compiles a file for a picture of these settings, with errors of at most `tolerance` pixels. What
/// there is to say about the scene has been said.
pub(crate) fn seen(
    path: &Path,
    build: &Build,
    settings: &RenderSettings,
    tolerance: f64,
) -> Result<Opened, Failure> {
    let build = Build {
        sight: Some(sight(settings, tolerance)),
        ..build.clone()
    };
    super::made(super::compile(path, super::read(path)?, &build)?)
}

/// Who looks.
fn sight(settings: &RenderSettings, tolerance: f64) -> Sight {
    Sight {
        eye: settings.view.from,
        pixel: match settings.view.lens {
            Lens::Perspective(angle) => Pixel::of_perspective(angle, settings.size),
            Lens::Orthographic(shown) => Pixel::of_parallel(shown, settings.size),
        },
        tolerance,
    }
}

/// A number with a comma between thousands.
fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::{grouped, pixels};

    #[test]
    fn thousands_are_told_apart() {
        assert_eq!(
            [7, 999, 1204, 1_000_000].map(grouped),
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
