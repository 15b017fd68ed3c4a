//! `sdfc gen`: a scene of many primitives.

use crate::failure::Failure;
use crate::generate::{self, Family, GenerateOptions};
use crate::output;
use sdfc_lang::{Sources, parse, print};
use std::path::PathBuf;

/// Write a scene of many primitives, to measure the growth of cost with their number.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Kind of the scene.
    #[arg(value_enum)]
    family: Family,
    /// Number of primitives, besides the ground; the more, the smaller.
    #[arg(long, value_name = "N", default_value_t = 1000,
        value_parser = clap::value_parser!(u32).range(1..=MAX_COUNT))]
    count: u32,
    /// Seed of the random numbers; each seed results in another scene.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Width of the smooth union of neighbors, as a fraction of their size; 0 is a hard union.
    #[arg(long, value_name = "K", default_value_t = 0.0, value_parser = blend_fraction)]
    blend: f64,
    /// Output file; by default standard output.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Maximum number of primitives.
const MAX_COUNT: i64 = 10_000_000;

/// Parses a blend that is at most as thick as the primitives.
fn blend_fraction(text: &str) -> Result<f64, String> {
    let fraction = text
        .parse()
        .ok()
        .filter(|fraction| (0.0..=1.0).contains(fraction));
    fraction.ok_or_else(|| "write a number from 0 to 1".to_owned())
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    if let Some(path) = &arguments.output {
        output::check(path)?;
    }
    let options = GenerateOptions {
        count: arguments.count,
        seed: arguments.seed,
        blend: arguments.blend,
    };
    let text = canonical_layout(generate::scene(arguments.family, &options));
    output::deliver(arguments.output.as_deref(), text.as_bytes(), true)
}

/// Returns the canonical layout, where the text is short enough to be parsed.
fn canonical_layout(text: String) -> String {
    let mut sources = Sources::new();
    let file = sources.add("generated".to_owned(), text);
    match parse(&sources, file) {
        (Some(tree), _) => print(&tree),
        (None, _) => sources.text(file).to_owned(),
    }
}
