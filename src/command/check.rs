//! `sdfc check`: what is wrong with scenes, without drawing them.

use crate::failure::{Failure, INPUT, on_each};
use crate::output;
use crate::rounding;
use crate::scene::{self, Build};
use crate::terminal::Terminal;
use sdfc_compiler::open::{Content, Outcome};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Say what is wrong with scenes, without drawing them.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The scenes.
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<PathBuf>,
    #[command(flatten)]
    build: Build,
    /// Print what was found as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<(), Failure> {
    if !arguments.json {
        return on_each(&arguments.scenes, terminal, |path| {
            for warning in scene::told(check(path, &arguments.build)?, terminal)? {
                terminal.warning(&format!("{}: {warning}", path.display()));
            }
            Ok(())
        });
    }
    let mut all = Vec::new();
    let checked = on_each(&arguments.scenes, terminal, |path| {
        let outcome = check(path, &arguments.build);
        all.push(as_json(path, &outcome));
        match outcome?.made {
            Some(_) => Ok(()),
            None => Err(Failure::Told(INPUT)),
        }
    });
    output::print_json(&all)?;
    checked
}

/// What there is to say about a file, and about its picture. A library, which has nothing to draw, is
/// fine as it is.
fn check(path: &Path, build: &Build) -> Result<Outcome<Vec<String>>, Failure> {
    let content = scene::read(path)?;
    if let (Content::Text(text), None) = (&content, &build.part) {
        let outcome = scene::elaborated(path, text.clone(), build)?;
        if outcome
            .made
            .as_ref()
            .is_some_and(|scene| scene.root.is_none())
        {
            let Outcome { sources, found, .. } = outcome;
            return Ok(Outcome {
                sources,
                found,
                made: Some(Vec::new()),
            });
        }
    }
    let Outcome {
        sources,
        found,
        made,
    } = scene::compile(path, content, build)?;
    Ok(Outcome {
        sources,
        found,
        made: made.map(|opened| {
            let off = rounding::of(&opened);
            off.as_ref()
                .and_then(rounding::warning)
                .into_iter()
                .collect()
        }),
    })
}

fn as_json(path: &Path, outcome: &Result<Outcome<Vec<String>>, Failure>) -> Value {
    let file = path.display().to_string();
    match outcome {
        Ok(outcome) => json!({
            "file": file,
            "ok": outcome.made.is_some(),
            "diagnostics": outcome.found.to_json(&outcome.sources),
            "warnings": outcome.made.as_deref().unwrap_or_default(),
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
