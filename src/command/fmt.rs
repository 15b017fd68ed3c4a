//! `sdfc fmt`: scenes in their canonical layout.

use crate::failure::{Failure, on_each};
use crate::input;
use crate::output;
use crate::terminal::Terminal;
use sdfc_lang::{Diagnostics, Sources, parse, print};
use std::path::{Path, PathBuf};

/// Rewrite scenes in their canonical layout, in place. Line ends stay as they are. `-` is standard input, and its
/// layout is printed.
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
    let original = sources.text(file);
    let formatted = with_line_ends_of(original, print(&tree));
    if input::is_standard(path) && !check {
        return output::print(formatted);
    }
    if formatted == original {
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

/// Returns a text with the line ends of another one, as its first line has them.
fn with_line_ends_of(original: &str, text: String) -> String {
    let first_line = original.split_inclusive('\n').next().unwrap_or_default();
    match first_line.ends_with("\r\n") {
        true => text.replace('\n', "\r\n"),
        false => text,
    }
}
