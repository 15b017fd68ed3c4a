//! `sdfc gen`: a scene of many primitives.

use crate::failure::Failure;
use crate::generate::{self, Family, Options};
use crate::output;
use sdfc_lang::{Sources, parse, print};
use std::path::PathBuf;

/// Write a scene of many primitives, to see how cost grows with their number.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// What it is made of.
    #[arg(value_enum)]
    family: Family,
    /// How many primitives, besides the ground; they are smaller where they are more.
    #[arg(long, value_name = "N", default_value_t = 1000,
        value_parser = clap::value_parser!(u32).range(1..=MOST))]
    count: u32,
    /// Another number is another scene.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// How thick the smooth union of neighbours is, as a share of their size; 0 is a hard union.
    #[arg(long, value_name = "K", default_value_t = 0.0, value_parser = share)]
    blend: f64,
    /// Where to; without it, to standard output.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// The most primitives that are written.
const MOST: i64 = 10_000_000;

/// A blend that is at most as thick as the primitives.
fn share(text: &str) -> Result<f64, String> {
    let share = text
        .parse()
        .ok()
        .filter(|share| (0.0..=1.0).contains(share));
    share.ok_or_else(|| "write a number from 0 to 1".to_owned())
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    if let Some(path) = &arguments.output {
        output::check(path)?;
    }
    let options = Options {
        count: arguments.count,
        seed: arguments.seed,
        blend: arguments.blend,
    };
    let text = laid_out(generate::scene(arguments.family, &options));
    output::deliver(arguments.output.as_deref(), text.as_bytes(), true)
}

/// The canonical layout, where the text is not too long to be parsed.
fn laid_out(text: String) -> String {
    let mut sources = Sources::new();
    let file = sources.add("generated".to_owned(), text);
    match parse(&sources, file) {
        (Some(tree), _) => print(&tree),
        (None, _) => sources.text(file).to_owned(),
    }
}
