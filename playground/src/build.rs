//! Builds a scene from its source, with all diagnostics and timings.

use crate::param_source::{ParamSource, param_sources};
use sdfc_compiler::compile::GeneratedSource;
use sdfc_compiler::elaborate::NoFiles;
use sdfc_compiler::open::{CompiledScene, Request, SceneFile, open};
use sdfc_compiler::passes::PassOptions;
use sdfc_io::files::{Files, Folder};
use sdfc_lang::{Sources, Style};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// Source of a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SceneOrigin {
    /// A file, by its path.
    File(PathBuf),
    /// A named text that is not stored in a file.
    Text {
        /// Name of the text, for messages.
        name: String,
        /// Text of the scene.
        text: String,
    },
}

impl SceneOrigin {
    /// Returns the path, or the name of a text without a file.
    pub fn path(&self) -> &Path {
        match self {
            Self::File(path) => path,
            Self::Text { name, .. } => Path::new(name),
        }
    }
}

/// A scene to be built.
#[derive(Clone, Debug)]
pub struct BuildTask {
    /// Build number; later builds have larger numbers.
    pub number: u64,
    /// Source of the scene.
    pub source: SceneOrigin,
    /// Values of structural params, as text.
    pub overrides: Vec<(String, String)>,
    /// Animation time in seconds.
    pub time: f64,
    /// Name of the output to build instead of the scene's result.
    pub part: Option<String>,
}

/// Result of a build.
#[derive(Debug)]
pub struct BuildResult {
    /// Number of the build.
    pub number: u64,
    /// Files that the scene consists of, including those that could not be read.
    pub files: Vec<PathBuf>,
    /// Diagnostics in the format of `sdfc check`; empty if there are none.
    pub report: String,
    /// The scene, if it has no errors.
    pub scene: Option<Arc<BuiltScene>>,
    /// The task's overrides and their diagnostics, if no scene can be built with them. Then `scene` is
    /// the scene without overrides.
    pub rejected: Option<RejectedOverrides>,
    /// Time for reading the source.
    pub reading: Duration,
    /// Time for compiling the text into programs.
    pub compiling: Duration,
}

/// Values of params that a scene cannot be built with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RejectedOverrides {
    /// The values, as in [`BuildTask::overrides`].
    pub overrides: Vec<(String, String)>,
    /// Diagnostics in the format of `sdfc check`.
    pub report: String,
}

/// A scene that engines can load.
#[derive(Debug)]
pub struct BuiltScene {
    /// Programs, params and settings with the values of the text.
    pub opened: CompiledScene,
    /// Texts of the scene and of its imports.
    pub sources: Sources,
    /// Notation of each param in the source text.
    pub param_sources: Vec<Option<ParamSource>>,
    /// Number of the build.
    pub number: u64,
    generated: OnceLock<GeneratedSource>,
}

impl BuiltScene {
    /// Returns the scene's functions as WGSL, generated on first use.
    pub fn generated(&self) -> &GeneratedSource {
        self.generated
            .get_or_init(|| self.opened.compiled.generated())
    }
}

/// Builds a scene. A panic of the compiler becomes the report.
pub fn build(task: &BuildTask, files: &dyn Files) -> BuildResult {
    let guarded_build = std::panic::AssertUnwindSafe(|| {
        let built = try_build(task, files);
        if built.scene.is_some() || task.overrides.is_empty() {
            return built;
        }
        // An edit may have made values set by hand invalid.
        let without_overrides = BuildTask {
            overrides: Vec::new(),
            ..task.clone()
        };
        BuildResult {
            rejected: Some(RejectedOverrides {
                overrides: task.overrides.clone(),
                report: built.report,
            }),
            ..self::try_build(&without_overrides, files)
        }
    });
    std::panic::catch_unwind(guarded_build).unwrap_or_else(|_| {
        let report = "error: this is a bug in sdfc: the compiler panicked on this scene\n";
        failed_build(task, report.to_owned())
    })
}

fn failed_build(task: &BuildTask, report: String) -> BuildResult {
    let files = match &task.source {
        SceneOrigin::File(path) => vec![path.clone()],
        SceneOrigin::Text { .. } => Vec::new(),
    };
    BuildResult {
        number: task.number,
        files,
        report,
        scene: None,
        rejected: None,
        reading: Duration::ZERO,
        compiling: Duration::ZERO,
    }
}

fn try_build(task: &BuildTask, files: &dyn Files) -> BuildResult {
    let path = task.source.path();
    let started = Instant::now();
    let content = match &task.source {
        SceneOrigin::File(path) => files
            .read(path)
            .map_err(|why| format!("{} cannot be read: {why}", path.display()))
            .and_then(|bytes| SceneFile::from_bytes(path, bytes)),
        SceneOrigin::Text { text, .. } => Ok(SceneFile::Text(text.clone())),
    };
    let content = match content {
        Ok(content) => content,
        Err(problem) => return failed_build(task, format!("error: {problem}\n")),
    };
    let reading = started.elapsed();
    let folder = Folder::new(files, path);
    let request = Request {
        path,
        overrides: task.overrides.clone(),
        time: task.time,
        part: task.part.clone(),
        passes: PassOptions::default(),
        // The engines that draw edits do not benefit from guards.
        emit_guards: false,
        lod_target: None,
        needs_subject: false,
        loader: match task.source {
            SceneOrigin::File(_) => &folder,
            SceneOrigin::Text { .. } => &NoFiles,
        },
    };
    let outcome = open(content, &request);
    let compiling = started.elapsed() - reading;
    let mut read_files = failed_build(task, String::new()).files;
    read_files.extend(folder.requested_files());
    let outcome = match outcome {
        Ok(outcome) => outcome,
        Err(problem) => {
            return BuildResult {
                files: read_files,
                ..failed_build(task, format!("error: {problem}\n"))
            };
        }
    };
    let report = if outcome.diagnostics.is_empty() {
        String::new()
    } else {
        outcome.diagnostics.render(&outcome.sources, Style::Plain)
    };
    BuildResult {
        number: task.number,
        files: read_files,
        report,
        scene: outcome.value.map(|opened| {
            Arc::new(BuiltScene {
                param_sources: match opened.compiled.scene() {
                    Some(scene) => param_sources(scene, &outcome.sources),
                    None => vec![None; opened.compiled.module.settings.params.len()],
                },
                opened,
                sources: outcome.sources,
                number: task.number,
                generated: OnceLock::new(),
            })
        }),
        rejected: None,
        reading,
        compiling,
    }
}
