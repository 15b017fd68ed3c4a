//! `sdfc check`: problems of scenes, without drawing them.

use crate::failure::{Failure, INPUT, on_each};
use crate::output;
use crate::rounding;
use crate::scene::{self, BuildArgs};
use crate::terminal::Terminal;
use sdfc_compiler::open::{OpenResult, SceneFile};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Report problems of scenes, without drawing them.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The scenes; `-` is standard input.
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<PathBuf>,
    #[command(flatten)]
    build: BuildArgs,
    /// Print the problems as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<(), Failure> {
    if !arguments.json {
        return on_each(&arguments.scenes, terminal, |path| {
            for warning in scene::report_and_unwrap(check(path, &arguments.build)?, terminal)? {
                terminal.warning(&format!("{}: {warning}", path.display()));
            }
            Ok(())
        });
    }
    let mut reports = Vec::new();
    let checked = on_each(&arguments.scenes, terminal, |path| {
        let outcome = check(path, &arguments.build);
        reports.push(as_json(path, &outcome));
        match outcome?.value {
            Some(_) => Ok(()),
            None => Err(Failure::AlreadyReported(INPUT)),
        }
    });
    output::print_json(&reports)?;
    checked
}

/// Returns the diagnostics of a file, and the warnings about its picture. A library, which has nothing to
/// draw, is valid.
fn check(path: &Path, build: &BuildArgs) -> Result<OpenResult<Vec<String>>, Failure> {
    let content = scene::read(path)?;
    if let (SceneFile::Text(text), None) = (&content, &build.part) {
        let outcome = scene::elaborated(path, text.clone(), build)?;
        if outcome
            .value
            .as_ref()
            .is_some_and(|scene| scene.root.is_none())
        {
            let OpenResult {
                sources,
                diagnostics,
                ..
            } = outcome;
            return Ok(OpenResult {
                sources,
                diagnostics,
                value: Some(Vec::new()),
            });
        }
    }
    let OpenResult {
        sources,
        diagnostics,
        value,
    } = scene::compile(path, content, build)?;
    Ok(OpenResult {
        sources,
        diagnostics,
        value: value.map(|opened| {
            let error = rounding::for_scene(&opened);
            error
                .as_ref()
                .and_then(|error| rounding::warning(&opened, error))
                .into_iter()
                .collect()
        }),
    })
}

fn as_json(path: &Path, outcome: &Result<OpenResult<Vec<String>>, Failure>) -> Value {
    let file = path.display().to_string();
    match outcome {
        Ok(outcome) => json!({
            "file": file,
            "ok": outcome.value.is_some(),
            "diagnostics": outcome.diagnostics.to_json(&outcome.sources),
            "warnings": outcome.value.as_deref().unwrap_or_default(),
        }),
        Err(failure) => json!({
            "file": file,
            "ok": false,
            "error": failure.to_string(),
            "diagnostics": [],
            "warnings": [],
        }),
    }
}
