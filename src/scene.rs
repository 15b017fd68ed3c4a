//! Scenes from their files, compiled: `.sdf` text, `.sdfb` bytecode, or the clauses of a `.vm` file.
//!
//! What stands here is the way from a path and flags to what engines run, the same for all
//! subcommands: [`read`] tells the kinds of files apart, [`compile()`] has the compiler make programs
//! of them and collect what there is to say, and [`open()`] is both, told to the user.

pub(crate) mod detail;

use crate::failure::{Failure, INPUT};
use crate::input;
use crate::terminal::Terminal;
use clap::builder::PossibleValuesParser;
pub(crate) use detail::Detail;
use sdfc_compiler::compile::GeneratedSource;
use sdfc_compiler::open::{self, Content, Outcome, Request};
use sdfc_compiler::passes::lod::Sight;
use sdfc_compiler::passes::{PASSES, PassOptions};
use sdfc_compiler::scene::Scene;
use sdfc_playground::files::{Disk, Folder};
use sdfc_runtime::engine::{Engine, Loaded};
use sdfc_shaders::assemble::SceneSource;
use sdfc_vm::program::Module;
use std::cell::OnceCell;
use std::collections::BTreeSet;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// How a scene becomes a program: the flags that all subcommands share that take one.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct Build {
    /// Give a param another value, written as in a scene: -p goo=0.4 -p 'tint=#ff8800'.
    #[arg(short, value_name = "NAME=VALUE")]
    pub(crate) params: Vec<String>,
    /// The time of the animation, in seconds: 1.5s.
    #[arg(long, value_name = "TIME", value_parser = seconds, default_value = "0s")]
    pub(crate) at: f64,
    /// The named output, instead of the scene's result.
    #[arg(long, value_name = "NAME")]
    pub(crate) part: Option<String>,
    /// Run no optimizing pass (0), or all of them (1).
    #[arg(short = 'O', value_name = "LEVEL", default_value = "1",
        value_parser = clap::value_parser!(u8).range(0..=1))]
    pub(crate) level: u8,
    /// Leave an optimizing pass out.
    #[arg(long, value_name = "PASS",
        value_parser = PossibleValuesParser::new(PASSES.map(|pass| pass.name)))]
    pub(crate) no_pass: Vec<String>,
    /// Whether what is to run it gains nothing from guards.
    #[arg(skip)]
    unguarded: bool,
    /// Who looks, where detail that is too small to be seen is left out; see [`Detail`].
    #[arg(skip)]
    sight: Option<Sight>,
    /// The files that scenes imported, or wanted to.
    #[arg(skip)]
    imported: Arc<Mutex<BTreeSet<PathBuf>>>,
}

impl Build {
    /// The params' names and values.
    fn overrides(&self) -> Result<Vec<(String, String)>, Failure> {
        let split = |given: &String| match given.split_once('=') {
            Some((name, value)) => Ok((name.trim().to_owned(), value.trim().to_owned())),
            None => Err(Failure::Input(format!(
                "`-p {given}` has no value: write `-p {given}=VALUE`"
            ))),
        };
        self.params.iter().map(split).collect()
    }

    /// The same for an engine.
    pub(crate) fn for_engine(&self, engine: &dyn Engine) -> Self {
        Self {
            unguarded: !engine.heeds_guards(),
            ..self.clone()
        }
    }

    /// The files that scenes imported, or wanted to.
    pub(crate) fn imported(&self) -> MutexGuard<'_, BTreeSet<PathBuf>> {
        self.imported.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Has `work` done with what it asks for.
    fn request<T>(
        &self,
        path: &Path,
        work: impl FnOnce(&Request<'_>) -> Result<T, String>,
    ) -> Result<T, Failure> {
        let folder = Folder::of(&Disk, path);
        let request = Request {
            path,
            overrides: self.overrides()?,
            time: self.at,
            part: self.part.clone(),
            passes: PassOptions {
                none: self.level == 0,
                without: self.no_pass.clone(),
            },
            guards: !self.unguarded,
            sight: self.sight,
            loader: &folder,
        };
        let made = work(&request).map_err(Failure::Input);
        self.imported().append(&mut folder.asked());
        made
    }
}

/// A time with or without its unit.
fn seconds(text: &str) -> Result<f64, String> {
    let (number, unit) = match (text.strip_suffix("ms"), text.strip_suffix('s')) {
        (Some(number), _) => (number, 1e-3),
        (None, Some(number)) => (number, 1.0),
        (None, None) => (text, 1.0),
    };
    let time = number
        .trim()
        .parse::<f64>()
        .ok()
        .map(|number| number * unit);
    time.filter(|time| time.is_finite())
        .ok_or_else(|| "write a time such as 1.5s or 200ms".into())
}

/// Reads a file and tells what it holds.
pub(crate) fn read(path: &Path) -> Result<Content, Failure> {
    Content::of(path, input::bytes(path)?).map_err(Failure::Input)
}

/// What came of a scene's file, with its generated source once something has asked for it.
pub(crate) struct Opened {
    scene: open::Opened,
    generated: OnceCell<GeneratedSource>,
}

impl Deref for Opened {
    type Target = open::Opened;
    fn deref(&self) -> &open::Opened {
        &self.scene
    }
}

impl Opened {
    /// The programs.
    pub(crate) fn module(&self) -> &Module {
        &self.scene.compiled.module
    }

    /// The scene as all engines take it.
    pub(crate) fn loaded(&self) -> Loaded<'_> {
        let generated = self
            .generated
            .get_or_init(|| self.scene.compiled.generated());
        Loaded {
            generated: SceneSource {
                text: &generated.text,
                calls: &generated.calls,
            },
            ..self.loaded_without_source()
        }
    }

    /// The scene as an engine takes it that reads no generated source.
    pub(crate) fn loaded_without_source(&self) -> Loaded<'_> {
        Loaded {
            module: self.module(),
            outputs: &self.scene.outputs,
            generated: SceneSource::default(),
        }
    }
}

/// Tells the user what was found, and gives the result if there is one.
pub(crate) fn told<T>(outcome: Outcome<T>, terminal: &Terminal) -> Result<T, Failure> {
    terminal.diagnostics(&outcome.found, &outcome.sources);
    made(outcome)
}

/// The result if there is one, where the user has been told already.
pub(crate) fn made<T>(outcome: Outcome<T>) -> Result<T, Failure> {
    outcome.made.ok_or(Failure::Told(INPUT))
}

/// The scene that a text means.
pub(crate) fn elaborated(
    path: &Path,
    text: String,
    build: &Build,
) -> Result<Outcome<Scene>, Failure> {
    build.request(path, |request| Ok(open::elaborated(text, request)))
}

/// The scene that clauses mean.
pub(crate) fn clauses(path: &Path, text: String, build: &Build) -> Result<Outcome<Scene>, Failure> {
    build.request(path, |request| open::clauses(text, request))
}

/// Compiles what a file holds.
pub(crate) fn compile(
    path: &Path,
    content: Content,
    build: &Build,
) -> Result<Outcome<Opened>, Failure> {
    let outcome = build.request(path, |request| open::open(content, request))?;
    Ok(Outcome {
        sources: outcome.sources,
        found: outcome.found,
        made: outcome.made.map(|scene| Opened {
            scene,
            generated: OnceCell::new(),
        }),
    })
}

/// Reads and compiles a file, and tells the user what there is to say about it.
pub(crate) fn open(path: &Path, build: &Build, terminal: &Terminal) -> Result<Opened, Failure> {
    let opened = told(compile(path, read(path)?, build)?, terminal)?;
    for line in &opened.printed {
        terminal.note(line);
    }
    Ok(opened)
}
