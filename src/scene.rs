//! Scenes from their files, compiled: `.sdf` text, `.sdfb` bytecode, or the clauses of a `.vm` file.
//!
//! This module converts a path and flags to input of the engines, the same for all subcommands. [`read`]
//! distinguishes the kinds of files. [`compile()`] compiles programs and collects diagnostics. [`open()`] does
//! both and reports the diagnostics.

pub(crate) mod lod;

use crate::failure::{Failure, INPUT};
use crate::input;
use crate::terminal::Terminal;
use clap::builder::PossibleValuesParser;
pub(crate) use lod::LodArgs;
use sdfc_compiler::compile::GeneratedSource;
use sdfc_compiler::open::{self, OpenResult, Request, SceneFile};
use sdfc_compiler::passes::lod::LodTarget;
use sdfc_compiler::passes::{PASSES, PassOptions};
use sdfc_compiler::scene::Scene;
use sdfc_io::files::{Disk, Folder};
use sdfc_lang::codes;
use sdfc_runtime::engine::{Engine, SceneInput};
use sdfc_runtime::settings::CameraChanges;
use sdfc_shaders::assemble::SceneSource;
use sdfc_vm::program::Module;
use std::cell::OnceCell;
use std::collections::BTreeSet;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Flags for compiling a scene: shared by all subcommands that take one.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct BuildArgs {
    /// Give a param another value, written as in a scene: -p goo=0.4 -p 'tint=#ff8800'.
    #[arg(short, value_name = "NAME=VALUE")]
    pub(crate) params: Vec<String>,
    /// The time of the animation, in seconds: 1.5s.
    #[arg(long, value_name = "TIME", value_parser = seconds, default_value = "0s", allow_hyphen_values = true)]
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
    /// True if the engine does not benefit from guards.
    #[arg(skip)]
    without_guards: bool,
    /// Camera and tolerance, where invisible detail is omitted; see [`LodArgs`].
    #[arg(skip)]
    lod_target: Option<LodTarget>,
    /// True if a view that frames the scene is needed.
    #[arg(skip)]
    needs_subject: bool,
    /// Files that scenes imported, or tried to.
    #[arg(skip)]
    imported: Arc<Mutex<BTreeSet<PathBuf>>>,
}

impl BuildArgs {
    /// Returns the params' names and values.
    fn overrides(&self) -> Result<Vec<(String, String)>, Failure> {
        let split = |argument: &String| match argument.split_once('=') {
            Some((name, value)) => Ok((name.trim().to_owned(), value.trim().to_owned())),
            None => Err(Failure::Input(format!(
                "`-p {argument}` has no value: write `-p {argument}=VALUE`"
            ))),
        };
        self.params.iter().map(split).collect()
    }

    /// Returns these flags for an engine.
    pub(crate) fn for_engine(&self, engine: &dyn Engine) -> Self {
        Self {
            without_guards: !engine.benefits_from_guards(),
            ..self.clone()
        }
    }

    /// Returns these flags for a camera with changes.
    pub(crate) fn for_camera(&self, changes: &CameraChanges) -> Self {
        Self {
            needs_subject: changes.frames_scene(),
            ..self.clone()
        }
    }

    /// Returns the files that scenes imported, or tried to.
    pub(crate) fn imported(&self) -> MutexGuard<'_, BTreeSet<PathBuf>> {
        self.imported.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Runs `work` with the request of these flags.
    fn request<T>(
        &self,
        path: &Path,
        work: impl FnOnce(&Request<'_>) -> Result<T, String>,
    ) -> Result<T, Failure> {
        let folder = Folder::new(&Disk, path);
        let request = Request {
            path,
            overrides: self.overrides()?,
            time: self.at,
            part: self.part.clone(),
            passes: PassOptions {
                disable_all: self.level == 0,
                disabled: self.no_pass.clone(),
            },
            emit_guards: !self.without_guards,
            lod_target: self.lod_target,
            needs_subject: self.needs_subject,
            loader: &folder,
        };
        let result = work(&request).map_err(Failure::Input);
        self.imported().append(&mut folder.requested_files());
        result
    }
}

/// Parses a time with or without its unit.
pub(crate) fn seconds(text: &str) -> Result<f64, String> {
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

/// Reads a file and detects its kind.
pub(crate) fn read(path: &Path) -> Result<SceneFile, Failure> {
    SceneFile::from_bytes(path, input::bytes(path)?).map_err(Failure::Input)
}

/// A compiled scene file, with its generated source once that is used.
pub(crate) struct OpenedScene {
    scene: open::CompiledScene,
    generated: OnceCell<GeneratedSource>,
}

impl Deref for OpenedScene {
    type Target = open::CompiledScene;
    fn deref(&self) -> &open::CompiledScene {
        &self.scene
    }
}

impl OpenedScene {
    /// Returns the programs.
    pub(crate) fn module(&self) -> &Module {
        &self.scene.compiled.module
    }

    /// Returns the scene as input of all engines.
    pub(crate) fn loaded(&self) -> SceneInput<'_> {
        let generated = self
            .generated
            .get_or_init(|| self.scene.compiled.generated());
        SceneInput {
            generated: SceneSource {
                text: &generated.text,
                calls: &generated.calls,
            },
            ..self.loaded_scene_without_source()
        }
    }

    /// Returns the scene as input of an engine that reads no generated source.
    pub(crate) fn loaded_scene_without_source(&self) -> SceneInput<'_> {
        SceneInput {
            module: self.module(),
            uniform_values: &self.scene.uniform_values,
            generated: SceneSource::default(),
        }
    }
}

/// Reports the diagnostics to the user, and returns the result if there is one.
pub(crate) fn report_and_unwrap<T>(
    outcome: OpenResult<T>,
    terminal: &Terminal,
) -> Result<T, Failure> {
    let no_memory = outcome
        .diagnostics
        .iter()
        .find(|it| it.code == codes::E0415);
    if let Some(diagnostic) = no_memory {
        return Err(Failure::Environment(diagnostic.message.clone()));
    }
    terminal.diagnostics(&outcome.diagnostics, &outcome.sources);
    unwrap_reported(outcome)
}

/// Returns the result if there is one, after its diagnostics were reported.
pub(crate) fn unwrap_reported<T>(outcome: OpenResult<T>) -> Result<T, Failure> {
    outcome.value.ok_or(Failure::AlreadyReported(INPUT))
}

/// Returns the scene that a text defines.
pub(crate) fn elaborated(
    path: &Path,
    text: String,
    build: &BuildArgs,
) -> Result<OpenResult<Scene>, Failure> {
    build.request(path, |request| Ok(open::elaborate_text(text, request)))
}

/// Returns the scene that a text of Fidget defines.
pub(crate) fn fidget_text(
    path: &Path,
    text: String,
    build: &BuildArgs,
) -> Result<OpenResult<Scene>, Failure> {
    build.request(path, |request| open::elaborate_fidget_text(text, request))
}

/// Compiles the content of a file.
pub(crate) fn compile(
    path: &Path,
    content: SceneFile,
    build: &BuildArgs,
) -> Result<OpenResult<OpenedScene>, Failure> {
    let outcome = build.request(path, |request| open::open(content, request))?;
    Ok(OpenResult {
        sources: outcome.sources,
        diagnostics: outcome.diagnostics,
        value: outcome.value.map(|scene| OpenedScene {
            scene,
            generated: OnceCell::new(),
        }),
    })
}

/// Reads and compiles a file, and reports its diagnostics to the user.
pub(crate) fn open(
    path: &Path,
    build: &BuildArgs,
    terminal: &Terminal,
) -> Result<OpenedScene, Failure> {
    let opened = report_and_unwrap(compile(path, read(path)?, build)?, terminal)?;
    for line in &opened.printed {
        terminal.note(line);
    }
    Ok(opened)
}
