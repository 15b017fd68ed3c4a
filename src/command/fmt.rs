//! `sdfc fmt`: scenes in their canonical layout.

use crate::failure::{Failure, on_each};
use crate::input;
use crate::output;
use crate::terminal::Terminal;
use sdfc_lang::{Diagnostics, Sources, parse, print};
use std::path::{Path, PathBuf};

/// Lay out scenes in the canonical way, in place.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The scenes.
    #[arg(required = true, value_name = "SCENE")]
    files: Vec<PathBuf>,
    /// Change nothing; fail if a file is not laid out so.
    #[arg(long)]
    check: bool,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<(), Failure> {
    on_each(&arguments.files, terminal, |file| {
        format(file, arguments.check, terminal)
    })
}

fn format(path: &Path, check: bool, terminal: &Terminal) -> Result<(), Failure> {
    let before = input::text(path)?;
    let mut sources = Sources::new();
    let file = sources.add(path.display().to_string(), before);
    let (tree, found) = parse(&sources, file);
    let Some(tree) = tree else {
        terminal.diagnostics(&Diagnostics::from_iter(found), &sources);
        return Err(Failure::Told(crate::failure::INPUT));
    };
    let after = print(&tree);
    if after == sources.text(file) {
        return Ok(());
    }
    if check {
        let problem = format!(
            "{} is not laid out canonically: `sdfc fmt` does it",
            path.display()
        );
        return Err(Failure::Input(problem));
    }
    output::write(path, after.as_bytes())
}
