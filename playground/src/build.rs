//! From a source to a scene that engines can load, with all there is to say about it and how long it
//! took.

use crate::files::{Files, Folder};
use crate::written::{Written, written};
use sdfc_compiler::compile::GeneratedSource;
use sdfc_compiler::elaborate::NoFiles;
use sdfc_compiler::open::{Content, Opened, Request, open};
use sdfc_compiler::passes::PassOptions;
use sdfc_lang::{Sources, Style};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// What is built.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// A file.
    File(PathBuf),
    /// A text with a name, in no file.
    Text {
        /// Its name.
        name: String,
        /// The language.
        text: String,
    },
}

impl Source {
    /// What it is called.
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
    /// Which build it is; later ones have larger numbers.
    pub number: u64,
    /// What of.
    pub source: Source,
    /// Values of parameters, as texts, that decide structure.
    pub overrides: Vec<(String, String)>,
    /// The time of the animation, in seconds.
    pub time: f64,
    /// The named output, instead of the scene's result.
    pub part: Option<String>,
}

/// What came of it.
#[derive(Debug)]
pub struct Built {
    /// Which build it was.
    pub number: u64,
    /// The files that it was made of, or would have been.
    pub files: Vec<PathBuf>,
    /// All that there is to say, as `sdfc check` says it; empty if nothing.
    pub report: String,
    /// The scene, if nothing is wrong.
    pub scene: Option<Arc<Scene>>,
    /// The task's values of parameters and what there is to say about the scene with them, where there
    /// is none with them: then `scene` is the one without.
    pub refused: Option<Refused>,
    /// How long reading took.
    pub reading: Duration,
    /// How long the way from text to programs took.
    pub compiling: Duration,
}

/// Values of parameters that a scene cannot be built with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refused {
    /// The values, as in [`BuildTask::overrides`].
    pub overrides: Vec<(String, String)>,
    /// Why, as `sdfc check` says it.
    pub report: String,
}

/// A scene that engines can load.
#[derive(Debug)]
pub struct Scene {
    /// Programs, params and settings, as the text has them.
    pub opened: Opened,
    /// The texts.
    pub sources: Sources,
    /// How its params are written in the text.
    pub written: Vec<Option<Written>>,
    /// The build that made it.
    pub number: u64,
    generated: OnceLock<GeneratedSource>,
}

impl Scene {
    /// Its functions as WGSL, made when they are first asked for.
    pub fn generated(&self) -> &GeneratedSource {
        self.generated
            .get_or_init(|| self.opened.compiled.generated())
    }
}

/// Builds a scene. It never panics: what the compiler panicked with becomes the report.
pub fn build(task: &BuildTask, files: &dyn Files) -> Built {
    let attempt = std::panic::AssertUnwindSafe(|| {
        let built = attempt(task, files);
        if built.scene.is_some() || task.overrides.is_empty() {
            return built;
        }
        // An edit may have left no place for what was set by hand.
        let without = BuildTask {
            overrides: Vec::new(),
            ..task.clone()
        };
        Built {
            refused: Some(Refused {
                overrides: task.overrides.clone(),
                report: built.report,
            }),
            ..self::attempt(&without, files)
        }
    });
    std::panic::catch_unwind(attempt).unwrap_or_else(|_| {
        let report = "error: this is a bug in sdfc: the compiler panicked on this scene\n";
        failed(task, report.to_owned())
    })
}

fn failed(task: &BuildTask, report: String) -> Built {
    let files = match &task.source {
        Source::File(path) => vec![path.clone()],
        Source::Text { .. } => Vec::new(),
    };
    Built {
        number: task.number,
        files,
        report,
        scene: None,
        refused: None,
        reading: Duration::ZERO,
        compiling: Duration::ZERO,
    }
}

fn attempt(task: &BuildTask, files: &dyn Files) -> Built {
    let path = task.source.path();
    let started = Instant::now();
    let content = match &task.source {
        Source::File(path) => files
            .read(path)
            .map_err(|why| format!("{} cannot be read: {why}", path.display()))
            .and_then(|bytes| Content::of(path, bytes)),
        Source::Text { text, .. } => Ok(Content::Text(text.clone())),
    };
    let content = match content {
        Ok(content) => content,
        Err(problem) => return failed(task, format!("error: {problem}\n")),
    };
    let reading = started.elapsed();
    let folder = Folder::of(files, path);
    let request = Request {
        path,
        overrides: task.overrides.clone(),
        time: task.time,
        part: task.part.clone(),
        passes: PassOptions::default(),
        // What draws edits gains nothing from them.
        guards: false,
        sight: None,
        loader: match task.source {
            Source::File(_) => &folder,
            Source::Text { .. } => &NoFiles,
        },
    };
    let outcome = open(content, &request);
    let compiling = started.elapsed() - reading;
    let mut read = failed(task, String::new()).files;
    read.extend(folder.asked());
    let outcome = match outcome {
        Ok(outcome) => outcome,
        Err(problem) => {
            return Built {
                files: read,
                ..failed(task, format!("error: {problem}\n"))
            };
        }
    };
    let report = if outcome.found.is_empty() {
        String::new()
    } else {
        outcome.found.render(&outcome.sources, Style::Plain)
    };
    Built {
        number: task.number,
        files: read,
        report,
        scene: outcome.made.map(|opened| {
            Arc::new(Scene {
                written: match opened.compiled.scene() {
                    Some(scene) => written(scene, &outcome.sources),
                    None => vec![None; opened.compiled.module.settings.params.len()],
                },
                opened,
                sources: outcome.sources,
                number: task.number,
                generated: OnceLock::new(),
            })
        }),
        refused: None,
        reading,
        compiling,
    }
}
