//! sdfc and other renderers of implicit surfaces, side by side: the same models and pictures, in
//! alternation in one process.
//!
//! See `benches/README.md` for how to run it and for its output.

mod chart;
mod clock;
mod contestant;
mod duel;
mod machine;
mod model;
mod picture;
mod report;
mod solo;
mod view;

use clap::Parser;
use contestant::Peer;
use contestant::sdfc::RaySettings;
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::render::{CellMode, RenderSettings};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// Measure sdfc against other renderers, or by itself.
#[derive(Debug, Parser)]
#[command(version)]
struct Cli {
    /// Folders of models, or single files: clauses (.vm) and scenes (.sdf).
    #[arg(long, value_name = "PATH", value_delimiter = ',')]
    models: Vec<PathBuf>,
    /// Only this model; may be given several times.
    #[arg(long, value_name = "NAME")]
    model: Vec<String>,
    /// Pixels along each side of the pictures.
    #[arg(long, value_name = "PIXELS", value_delimiter = ',', default_value = "512,1024", value_parser = clap::value_parser!(u32).range(16..=4096))]
    size: Vec<u32>,
    /// Numbers of threads.
    #[arg(long, value_name = "N", value_delimiter = ',', default_value = "1,2",
        value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Vec<u16>,
    /// sdfc's engines.
    #[arg(
        long,
        value_name = "ENGINES",
        value_delimiter = ',',
        default_value = "cpu"
    )]
    engines: Vec<EngineKind>,
    /// Whom to compare with.
    #[arg(
        long,
        value_enum,
        value_name = "PEERS",
        value_delimiter = ',',
        default_value = "fidget-vm,fidget-jit,fidget-wgpu"
    )]
    peers: Vec<Peer>,
    /// Distance to a surface at which sdfc's rays estimate the root, in halves of a pixel.
    #[arg(long, value_name = "SHARE", default_value_t = RenderSettings::DEFAULT_THRESHOLD_FRACTION)]
    cone: f64,
    /// sdfc's engines split space into no cells, also where they would.
    #[arg(long)]
    no_cells: bool,
    /// Number of pictures of each side, besides a first one that does not count.
    #[arg(long, value_name = "N", default_value_t = 9)]
    rounds: usize,
    /// After how many seconds no more rounds are begun.
    #[arg(long, value_name = "SECONDS", default_value_t = 30.0)]
    patience: f64,
    /// Measure sdfc alone: cost against primitives and pixels, engines, edits, passes.
    #[arg(long = "self")]
    alone: bool,
    /// With `--self`: only this part; may be given several times.
    #[arg(long, value_enum, value_name = "PART", value_delimiter = ',')]
    part: Vec<solo::SoloPart>,
    /// With `--self`: the most primitives.
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    most: u32,
    /// With `--self`: the folder for the charts, as SVG.
    #[arg(long, value_name = "DIR")]
    charts: Option<PathBuf>,
    /// Print one JSON object per line.
    #[arg(long)]
    json: bool,
    /// Print tables as Markdown, under a line about the machine.
    #[arg(long, conflicts_with = "json")]
    markdown: bool,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    match run(&cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            let _ = writeln!(std::io::stderr(), "error: {problem}");
            ExitCode::FAILURE
        }
    }
}

fn run(cli: &Cli) -> Result<(), String> {
    let format = match (cli.json, cli.markdown) {
        (true, _) => report::OutputFormat::Json,
        (_, true) => report::OutputFormat::Markdown,
        _ => report::OutputFormat::Text,
    };
    if format == report::OutputFormat::Markdown {
        report::print(&format!("{}\n", machine::description()))?;
    }
    if cli.alone {
        return solo::run(
            &solo::SoloOptions {
                parts: cli.part.clone(),
                rounds: cli.rounds,
                patience: cli.patience,
                most: cli.most,
                threads: cli.threads.iter().copied().max().unwrap_or(1).into(),
                engines: cli.engines.clone(),
                charts: cli.charts.clone(),
            },
            format,
        );
    }
    let models = model::Model::open_all(&cli.models, &cli.model, report::note)?;
    let options = duel::DuelOptions {
        sizes: cli.size.clone(),
        threads: cli.threads.iter().copied().map(usize::from).collect(),
        engines: cli.engines.clone(),
        peers: cli.peers.clone(),
        rays: RaySettings {
            cone: cli.cone,
            cells: if cli.no_cells {
                CellMode::Never
            } else {
                CellMode::Auto
            },
        },
        rounds: cli.rounds,
        patience: cli.patience,
    };
    duel::run(&models, &options, format)
}
