//! `sdfc fmt`: scenes in their canonical layout.

use crate::failure::{Failure, on_each};
use crate::input;
use crate::output;
use crate::terminal::Terminal;
use sdfc_lang::{Diagnostics, Sources, parse, print};
use std::path::{Path, PathBuf};

/// Rewrite scenes in their canonical layout, in place.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The scenes.
    #[arg(required = true, value_name = "SCENE")]
    files: Vec<PathBuf>,
    /// Change nothing; fail if a file is not in its canonical layout.
    #[arg(long)]
    check: bool,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<(), Failure> {
    on_each(&arguments.files, terminal, |file| {
        format_file(file, arguments.check, terminal)
    })
}

fn format_file(path: &Path, check: bool, terminal: &Terminal) -> Result<(), Failure> {
    let original = input::text(path)?;
    let mut sources = Sources::new();
    let file = sources.add(path.display().to_string(), original);
    let (tree, diagnostics) = parse(&sources, file);
    let Some(tree) = tree else {
        terminal.diagnostics(&Diagnostics::from_iter(diagnostics), &sources);
        return Err(Failure::AlreadyReported(crate::failure::INPUT));
    };
    let formatted = print(&tree);
    if formatted == sources.text(file) {
        return Ok(());
    }
    if check {
        let problem = format!(
            "{} is not laid out canonically: `sdfc fmt` does it",
            path.display()
        );
        return Err(Failure::Input(problem));
    }
    output::write(path, formatted.as_bytes())
}
