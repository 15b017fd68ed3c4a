//! `sdfc render`: a scene's picture.

use crate::engine::{self, Choice, Tier};
use crate::failure::Failure;
use crate::output;
use crate::progress::Progress;
use crate::rounding;
use crate::scene::{Build, Detail};
use crate::terminal::Terminal;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use sdfc_playground::picture::png;
use sdfc_runtime::engine::Engine;
use sdfc_runtime::frame::{CellUse, Frame, Mode, Normals, Occlusion, Tonemap};
use sdfc_runtime::settings::{LARGEST_SIDE, Overrides, resolve};
use sdfc_runtime::unseen;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Draw a scene.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The scene: .sdf, .sdfb or .vm.
    pub(super) scene: PathBuf,
    /// Where the picture goes, a PNG; without it, the scene's name with `.png`, in this folder.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    pub(super) build: Build,
    #[command(flatten)]
    look: Look,
    #[command(flatten)]
    detail: Detail,
    /// What draws.
    #[arg(long, value_enum, value_name = "ENGINE", default_value_t)]
    pub(super) engine: Choice,
    #[command(flatten)]
    pub(super) tier: Tier,
    /// Show progress even where stderr is no terminal.
    #[arg(long)]
    progress: bool,
}

/// What replaces the scene's own settings of its picture.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Look {
    /// Width and height in pixels, up to 16384 each: 1280x720.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(crate) size: Option<[u32; 2]>,
    /// Samples per pixel along each side, up to 16.
    #[arg(long, value_name = "N")]
    aa: Option<u32>,
    /// The camera's name.
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// What is shown.
    #[arg(long, value_name = "MODE", default_value = "shaded", value_parser = one_of(MODES))]
    mode: Mode,
    /// The most steps of a ray.
    #[arg(long, value_name = "N")]
    steps: Option<u32>,
    /// How far a ray goes, in the scene's units.
    #[arg(long, value_name = "DISTANCE")]
    far: Option<f64>,
    /// How normals are found.
    #[arg(long, value_name = "METHOD", value_parser = one_of(NORMALS))]
    normals: Option<Normals>,
    /// How crevices are darkened: off, five-tap, or so many samples.
    #[arg(long, value_name = "FORM", value_parser = occlusion)]
    occlusion: Option<Occlusion>,
    /// How light becomes a colour.
    #[arg(long, value_name = "CURVE", value_parser = one_of(TONEMAPS))]
    tonemap: Option<Tonemap>,
    /// A factor on all light.
    #[arg(long, value_name = "FACTOR")]
    exposure: Option<f64>,
    /// Whether the engines cpu and interp cut space into cells, each with what of the program matters
    /// there; the picture is the same, but on cpu for pixels at edges, and where fields jump. With gpu, interp
    /// cuts them on the device, which auto and always do on graphics cards only; with cpu, on the processor.
    #[arg(long, value_name = "WHEN", default_value = "auto", value_parser = one_of(CELLS))]
    cells: CellUse,
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

const CELLS: &[(&str, CellUse)] = &[
    ("auto", CellUse::Auto),
    ("never", CellUse::Never),
    ("always", CellUse::Always),
    ("cpu", CellUse::Processor),
    ("gpu", CellUse::Device),
];

const TONEMAPS: &[(&str, Tonemap)] = &[
    ("none", Tonemap::None),
    ("reinhard", Tonemap::Reinhard),
    ("aces", Tonemap::Aces),
];

/// A parser of the names in a list.
fn one_of<T: Copy + Send + Sync + 'static>(
    list: &'static [(&'static str, T)],
) -> impl TypedValueParser<Value = T> {
    let names = list.iter().map(|(name, _)| *name);
    PossibleValuesParser::new(names).try_map(|given| {
        let found = list.iter().find(|(name, _)| *name == given);
        found.map(|(_, value)| *value).ok_or("an unknown name")
    })
}

pub(super) fn size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once(['x', 'X', '×']);
    let sides = sides.and_then(|(w, h)| Some([w.trim().parse().ok()?, h.trim().parse().ok()?]));
    sides.ok_or_else(|| {
        format!("write width and height such as 1280x720, each from 1 to {LARGEST_SIDE}")
    })
}

fn occlusion(text: &str) -> Result<Occlusion, String> {
    match (text, text.parse()) {
        ("off", _) => Ok(Occlusion::Off),
        ("five-tap", _) => Ok(Occlusion::FiveTap),
        (_, Ok(count @ 1..=256)) => Ok(Occlusion::Multi(count)),
        _ => Err("write off, five-tap, or a number of samples from 1 to 256".to_owned()),
    }
}

impl Look {
    /// What the runtime is to use in place of what the scene says.
    pub(crate) fn overrides(&self) -> Overrides {
        Overrides {
            size: self.size,
            aa: self.aa,
            camera: self.camera.clone(),
            view: None,
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
    let mut engine = engine::chosen(arguments.engine, arguments.tier)?;
    draw(arguments, &to, &mut *engine, terminal)
}

/// Draws the scene as it is now.
pub(super) fn draw(
    arguments: &Arguments,
    to: &Path,
    engine: &mut dyn Engine,
    terminal: &Terminal,
) -> Result<(), Failure> {
    let build = arguments.build.for_engine(engine);
    let (detail, look) = (&arguments.detail, arguments.look.overrides());
    let scene = detail.open(&arguments.scene, &build, &look, terminal)?;
    let settings = resolve(scene.module(), &scene.outputs, &look)
        .map_err(|error| Failure::Input(format!("{}: {error}", arguments.scene.display())))?;
    let started = Instant::now();
    engine::load(engine, &scene)?;
    let what = arguments.scene.display().to_string();
    let progress = Progress::new(terminal, what, arguments.progress);
    let frame = engine.render(&settings, &|share| progress.is_at(share));
    drop(progress);
    let frame = frame.map_err(engine::failed)?;
    let took = started.elapsed();
    let bytes = png([frame.width, frame.height], &frame.rgba8()).map_err(Failure::Input)?;
    output::deliver(Some(to), &bytes, false)?;
    let detail = detail.told(&scene);
    terminal.write(&summary(to, &frame, engine, took, &detail));
    let rounding = rounding::warning_in(&scene, &settings);
    let unseen = unseen::notes(scene.module(), &settings, &frame.stats);
    for warning in troubles(&frame, settings.steps)
        .into_iter()
        .chain(unseen)
        .chain(rounding)
    {
        terminal.warning(&warning);
    }
    Ok(())
}

/// Where the picture goes; told before the work begins if it cannot go there.
pub(super) fn destination(arguments: &Arguments) -> Result<PathBuf, Failure> {
    let to = match &arguments.output {
        Some(path) => path.clone(),
        None => {
            let stem = arguments.scene.file_stem().unwrap_or("picture".as_ref());
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

/// What was drawn, by what, how fast.
fn summary(to: &Path, frame: &Frame, engine: &dyn Engine, took: Duration, detail: &str) -> String {
    let short = out_of_memory(frame.stats.cells.short);
    format!(
        "{}: {}x{}, {} on {}, {} ms{short}{detail}\n",
        to.display(),
        frame.width,
        frame.height,
        engine.kind(),
        engine.device(),
        took.as_millis()
    )
}

/// That so many cells found no room for a program of their own, if any.
fn out_of_memory(cells: u64) -> String {
    match cells {
        0 => String::new(),
        1 => ", 1 cell kept its parent's program: out of memory".to_owned(),
        cells => format!(", {cells} cells kept their parent's program: out of memory"),
    }
}

/// Rays and pixels of which the picture does not show the truth.
fn troubles(frame: &Frame, steps: u32) -> Vec<String> {
    let stats = &frame.stats;
    let share = |count: u64| {
        let all = stats.rays().max(1);
        format!(
            "{count} of {all} rays ({:.2} %)",
            100.0 * count as f64 / all as f64
        )
    };
    let mut troubles = Vec::new();
    if stats.undecided > 0 {
        troubles.push(format!(
            "{} could not be proved to hit or to miss: the picture shows what they most likely do",
            share(stats.undecided)
        ));
    }
    if stats.step_caps > 0 {
        troubles.push(format!(
            "{} ended before they hit or missed: give them more than {steps} `--steps`",
            share(stats.step_caps)
        ));
    }
    if stats.nans > 0 {
        troubles.push(format!(
            "{} met a distance that is not a number: a field has values beyond all \
             numbers, as high powers have far away. Stop its iterations sooner, or say with \
             `within` where it ends",
            share(stats.nans)
        ));
    }
    let (colorless, pixels) = (frame.colorless(), frame.color.len());
    if colorless > 0 {
        troubles.push(format!(
            "{colorless} of {pixels} pixels are black, since their colour is not a number: beside a surface \
             there, a field has values beyond all numbers. Stop its iterations sooner, or say with `within` \
             where it ends"
        ));
    }
    troubles
}

#[cfg(test)]
mod tests {
    use super::out_of_memory;

    #[test]
    fn the_summary_says_when_cells_ran_out_of_memory() {
        assert_eq!(out_of_memory(0), "");
        assert_eq!(
            out_of_memory(1),
            ", 1 cell kept its parent's program: out of memory"
        );
        assert_eq!(
            out_of_memory(607),
            ", 607 cells kept their parent's program: out of memory"
        );
    }
}
