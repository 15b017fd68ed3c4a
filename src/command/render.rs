//! `sdfc render`: the picture of a scene.

use super::camera::CameraArgs;
use super::named_values::one_of;
use crate::engine::{self, ArithmeticArgs, EngineArg};
use crate::failure::Failure;
use crate::input;
use crate::output;
use crate::progress::Progress;
use crate::rounding;
use crate::scene::{BuildArgs, LodArgs};
use crate::terminal::Terminal;
use sdfc_io::png_encoding::encode_png;
use sdfc_runtime::engine::Engine;
use sdfc_runtime::render::{CellMode, Image, Mode, Normals, Occlusion, Tonemap};
use sdfc_runtime::settings::{MAX_SAMPLES_PER_SIDE, MAX_SIDE_PIXELS, Overrides, resolve};
use sdfc_runtime::visibility_notes;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Draw a scene.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The scene: .sdf, .sdfb or .vm; `-` is standard input.
    pub(super) scene: PathBuf,
    /// Output file, a PNG; by default the scene's name with `.png`, in the current folder.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    pub(super) build: BuildArgs,
    #[command(flatten)]
    picture: PictureArgs,
    #[command(flatten)]
    lod: LodArgs,
    /// Engine that draws.
    #[arg(long, value_enum, value_name = "ENGINE", default_value_t)]
    pub(super) engine: EngineArg,
    #[command(flatten)]
    pub(super) arithmetic: ArithmeticArgs,
    /// Show progress even where stderr is no terminal.
    #[arg(long)]
    progress: bool,
}

/// Flags that replace the scene's own settings of its picture.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct PictureArgs {
    /// Width and height in pixels, up to 16384 each and 67108864 pixels together: 1280x720.
    #[arg(long, value_name = "WxH", value_parser = size, allow_hyphen_values = true)]
    pub(crate) size: Option<[u32; 2]>,
    /// Samples per pixel along each side, up to 16.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SAMPLES_PER_SIDE)))]
    aa: Option<u32>,
    /// The camera's name.
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    #[command(flatten)]
    pub(crate) camera_changes: CameraArgs,
    /// Quantity that is shown. The greys of depth are linear in the length of the ray. Light is the nearest point of the
    /// sphere around the box of the scene, and dark the farthest. Endless scenes are dark at twice the distance of the target.
    #[arg(long, value_name = "MODE", default_value = "shaded", value_parser = one_of(MODES))]
    mode: Mode,
    /// Maximum number of steps of a ray.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    steps: Option<u32>,
    /// Maximum length of a ray, in the scene's units. Without it, rays end behind the scene, or at 200 times the distance
    /// of the camera. Rays that fall towards an endless floor or wall reach it. Parallel rays end at 4 times the distance
    /// and 64 heights of the picture.
    #[arg(long, value_name = "DISTANCE", value_parser = positive, allow_hyphen_values = true)]
    far: Option<f64>,
    /// Method for normals.
    #[arg(long, value_name = "METHOD", value_parser = one_of(NORMALS))]
    normals: Option<Normals>,
    /// Ambient occlusion: off, five-tap, or a number of samples.
    #[arg(long, value_name = "FORM", value_parser = occlusion)]
    occlusion: Option<Occlusion>,
    /// Tone curve, from light to color.
    #[arg(long, value_name = "CURVE", value_parser = one_of(TONEMAPS))]
    tonemap: Option<Tonemap>,
    /// A factor on all light.
    #[arg(long, value_name = "FACTOR", value_parser = not_negative, allow_hyphen_values = true)]
    exposure: Option<f64>,
    /// Use of cells on the engines cpu and interp: boxes of space, each with the operations that matter inside it.
    /// The picture stays the same, except on cpu for pixels at edges and at discontinuities of fields. With never,
    /// cpu has a single box for fields whose slope is only estimated (W0501), which proves its steps. With gpu,
    /// interp builds cells on the device; with cpu, on the CPU; auto and always use the device on graphics cards.
    #[arg(long, value_name = "WHEN", default_value = "auto", value_parser = one_of(CELLS))]
    cells: CellMode,
}

const MODES: &[(&str, Mode)] = &[
    ("shaded", Mode::Shaded),
    ("albedo", Mode::Albedo),
    ("normal", Mode::Normal),
    ("depth", Mode::Depth),
    ("steps", Mode::Steps),
    ("distance", Mode::Distance),
    ("id", Mode::Id),
    ("mask", Mode::Mask),
    ("edges", Mode::Edges),
];

const NORMALS: &[(&str, Normals)] = &[
    ("exact", Normals::Exact),
    ("forward", Normals::Forward),
    ("central", Normals::Central),
    ("reverse", Normals::Reverse),
    ("tetrahedron", Normals::Tetrahedron),
    ("wide", Normals::Wide),
];

const CELLS: &[(&str, CellMode)] = &[
    ("auto", CellMode::Auto),
    ("never", CellMode::Never),
    ("always", CellMode::Always),
    ("cpu", CellMode::Cpu),
    ("gpu", CellMode::Gpu),
];

const TONEMAPS: &[(&str, Tonemap)] = &[
    ("none", Tonemap::None),
    ("reinhard", Tonemap::Reinhard),
    ("aces", Tonemap::Aces),
];

pub(super) fn size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once(['x', 'X', '×']);
    let sides = sides.and_then(|(w, h)| Some([w.trim().parse().ok()?, h.trim().parse().ok()?]));
    let is_allowed = |side: &u32| (1..=MAX_SIDE_PIXELS).contains(side);
    let sides = sides.filter(|sides: &[u32; 2]| sides.iter().all(is_allowed));
    sides.ok_or_else(|| {
        format!("write width and height such as 1280x720, each from 1 to {MAX_SIDE_PIXELS}")
    })
}

/// Parses a number above zero.
fn positive(text: &str) -> Result<f64, String> {
    let number = text.trim().parse::<f64>().ok();
    let number = number.filter(|number| *number > 0.0 && number.is_finite());
    number.ok_or_else(|| "write a number above 0".to_owned())
}

/// Parses a number that is not below zero.
fn not_negative(text: &str) -> Result<f64, String> {
    let number = text.trim().parse::<f64>().ok();
    let number = number.filter(|number| *number >= 0.0 && number.is_finite());
    number.ok_or_else(|| "write 0 or a number above it".to_owned())
}

fn occlusion(text: &str) -> Result<Occlusion, String> {
    match (text, text.parse()) {
        ("off", _) => Ok(Occlusion::Off),
        ("five-tap", _) => Ok(Occlusion::FiveTap),
        (_, Ok(count @ 1..=256)) => Ok(Occlusion::Multi(count)),
        _ => Err("write off, five-tap, or a number of samples from 1 to 256".to_owned()),
    }
}

impl PictureArgs {
    /// Returns the settings that replace the scene's own.
    pub(crate) fn overrides(&self) -> Overrides {
        Overrides {
            size: self.size,
            aa: self.aa,
            camera: self.camera.clone(),
            view: None,
            camera_changes: self.camera_changes.changes(),
            mode: self.mode,
            steps: self.steps,
            far: self.far,
            normals: self.normals,
            occlusion: self.occlusion,
            tonemap: self.tonemap,
            exposure: self.exposure,
            cells: self.cells,
        }
    }
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<(), Failure> {
    let to = destination(arguments)?;
    let mut engine = engine::open_choice(arguments.engine, arguments.arithmetic)?;
    draw(arguments, &to, &mut *engine, terminal)
}

/// Draws the present scene.
pub(super) fn draw(
    arguments: &Arguments,
    to: &Path,
    engine: &mut dyn Engine,
    terminal: &Terminal,
) -> Result<(), Failure> {
    let (lod, overrides) = (&arguments.lod, arguments.picture.overrides());
    let build = arguments.build.for_engine(engine);
    let build = build.for_camera(&overrides.camera_changes);
    let scene = lod.open(&arguments.scene, &build, &overrides, terminal)?;
    let settings = resolve(scene.module(), &scene.uniform_values, &overrides)
        .map_err(|error| Failure::Input(format!("{}: {error}", arguments.scene.display())))?;
    let started = Instant::now();
    engine::load(engine, &scene)?;
    let label = arguments.scene.display().to_string();
    let progress = Progress::new(terminal, label, arguments.progress);
    let image = engine.render(&settings, &|fraction| progress.update(fraction));
    drop(progress);
    let image = image.map_err(engine::to_failure)?;
    let duration = started.elapsed();
    let bytes = encode_png([image.width, image.height], &image.rgba8()).map_err(Failure::Input)?;
    output::deliver(Some(to), &bytes, false)?;
    let lod_summary = lod.summary(&scene);
    terminal.write(&summary(to, &image, engine, duration, &lod_summary));
    let rounding = rounding::warning_in(&scene, &settings);
    let notes = visibility_notes::notes(scene.module(), &settings, &image);
    for warning in render_warnings(&image, settings.steps)
        .into_iter()
        .chain(notes)
        .chain(rounding)
    {
        terminal.warning(&warning);
    }
    Ok(())
}

/// Returns the path of the picture; fails before the work begins if it cannot be written.
pub(super) fn destination(arguments: &Arguments) -> Result<PathBuf, Failure> {
    let to = match &arguments.output {
        Some(path) => path.clone(),
        None => {
            let stem = arguments.scene.file_stem();
            let stem = stem.filter(|_| !input::is_standard(&arguments.scene));
            let stem = stem.unwrap_or("picture".as_ref());
            Path::new(stem).with_extension("png")
        }
    };
    let other = to
        .extension()
        .filter(|extension| !extension.eq_ignore_ascii_case("png"));
    if let Some(extension) = other {
        return Err(Failure::Input(format!(
            "pictures are written as PNG, not as {}: name it {}",
            extension.display(),
            to.with_extension("png").display()
        )));
    }
    output::check(&to)?;
    Ok(to)
}

/// Returns the summary: the picture, the engine and the time.
fn summary(
    to: &Path,
    image: &Image,
    engine: &dyn Engine,
    duration: Duration,
    lod_summary: &str,
) -> String {
    let memory_note = out_of_memory(image.stats.cells.out_of_memory);
    format!(
        "{}: {}x{}, {} on {}, {} ms{memory_note}{lod_summary}\n",
        to.display(),
        image.width,
        image.height,
        engine.kind(),
        engine.device(),
        duration.as_millis()
    )
}

/// Returns the note about cells without memory for a pruned program, if any.
fn out_of_memory(cells: u64) -> String {
    match cells {
        0 => String::new(),
        1 => ", 1 cell was not simplified, since memory ran out: slower, but the same picture"
            .to_owned(),
        cells => format!(
            ", {cells} cells were not simplified, since memory ran out: slower, but the same picture"
        ),
    }
}

/// Returns warnings about rays and pixels that may be wrong in the picture.
fn render_warnings(image: &Image, steps: u32) -> Vec<String> {
    let stats = &image.stats;
    let fraction = |count: u64| {
        let total = stats.rays().max(1);
        format!(
            "{count} of {total} rays ({:.2} %)",
            100.0 * count as f64 / total as f64
        )
    };
    let mut warnings = Vec::new();
    if stats.undecided > 0 {
        warnings.push(format!(
            "{} could not be proved to hit or to miss: the picture shows the most likely result",
            fraction(stats.undecided)
        ));
    }
    if stats.step_caps > 0 {
        warnings.push(format!(
            "{} ended before they hit or missed: allow more than {steps} `--steps`",
            fraction(stats.step_caps)
        ));
    }
    if stats.nans > 0 {
        warnings.push(format!(
            "{} met a distance that is not a number: a field overflows, as high powers do far away. Stop its \
             iterations earlier, or state its extent by `within`",
            fraction(stats.nans)
        ));
    }
    let (colorless, pixels) = (image.nan_pixels(), image.color.len());
    if colorless > 0 {
        warnings.push(format!(
            "{colorless} of {pixels} pixels are black, since their color is not a number: beside a surface \
             there, a field overflows. Stop its iterations earlier, or state its extent by `within`"
        ));
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::out_of_memory;

    #[test]
    fn the_summary_reports_cells_out_of_memory() {
        assert_eq!(out_of_memory(0), "");
        assert_eq!(
            out_of_memory(1),
            ", 1 cell was not simplified, since memory ran out: slower, but the same picture"
        );
        assert_eq!(
            out_of_memory(607),
            ", 607 cells were not simplified, since memory ran out: slower, but the same picture"
        );
    }
}
