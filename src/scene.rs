//! Scenes from their files, compiled: `.sdf` text, `.sdfb` bytecode, or the clauses of a `.vm` file.
//!
//! What stands here is the way from a path to what engines run, the same for all subcommands:
//! [`read`] tells the kinds of files apart, [`compile()`] makes a [`Compiled`] of them and collects
//! what there is to say, and [`open`] is both, told to the user.

mod bytecode;
pub(crate) mod detail;
mod files;

use crate::failure::{Failure, INPUT};
use crate::input;
use crate::terminal::Terminal;
use clap::builder::PossibleValuesParser;
pub(crate) use detail::Detail;
use files::Folder;
use sdfc_compiler::clauses::parse_clauses;
use sdfc_compiler::compile;
use sdfc_compiler::compile::{Compiled, GeneratedSource};
use sdfc_compiler::elaborate::{self, elaborate};
use sdfc_compiler::passes::lod::Sight;
use sdfc_compiler::passes::{PASSES, PassOptions};
use sdfc_compiler::scene::Scene;
use sdfc_lang::{Diagnostics, Sources};
use sdfc_runtime::engine::{Engine, Loaded};
use sdfc_shaders::assemble::SceneSource;
use sdfc_vm::program::Module;
use std::cell::OnceCell;
use std::path::Path;

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

    fn passes(&self) -> PassOptions {
        let mut without = self.no_pass.clone();
        if self.unguarded {
            without.push("bounding".to_owned());
        }
        PassOptions {
            none: self.level == 0,
            without,
        }
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

/// What a file holds.
pub(crate) enum Content {
    /// The language.
    Text(String),
    /// Bytecode that has been verified.
    Bytecode(Box<Module>),
    /// One operation a line, as Fidget and libfive write them.
    Clauses(String),
}

/// Reads a file and tells by its first bytes, else by its name, what it holds.
pub(crate) fn read(path: &Path) -> Result<Content, Failure> {
    let bytes = input::bytes(path)?;
    let is_named = |extension| path.extension().is_some_and(|found| found == extension);
    if bytes.starts_with(b"SDFB") || is_named("sdfb") {
        let module = sdfc_vm::file::decode_file(&bytes)
            .map_err(|error| Failure::Input(format!("{}: {error}", path.display())))?;
        return Ok(Content::Bytecode(Box::new(module)));
    }
    let text = input::decoded(path, bytes)?;
    Ok(if is_named("vm") {
        Content::Clauses(text)
    } else {
        Content::Text(text)
    })
}

/// A scene's sources, what was found in them, and what came of it.
pub(crate) struct Outcome<T> {
    /// The texts.
    pub(crate) sources: Sources,
    /// What there is to say.
    pub(crate) found: Diagnostics,
    /// The result, if nothing is wrong.
    pub(crate) made: Option<T>,
}

impl<T> Outcome<T> {
    /// Tells the user, and gives the result if there is one.
    pub(crate) fn told(self, terminal: &Terminal) -> Result<T, Failure> {
        terminal.diagnostics(&self.found, &self.sources);
        self.told_before()
    }

    /// The result if there is one, where the user has been told already.
    pub(crate) fn told_before(self) -> Result<T, Failure> {
        self.made.ok_or(Failure::Told(INPUT))
    }
}

/// The scene that a text means.
pub(crate) fn elaborated(
    path: &Path,
    text: String,
    build: &Build,
) -> Result<Outcome<Scene>, Failure> {
    let mut sources = Sources::new();
    let file = sources.add(path.display().to_string(), text);
    let folder = Folder::of(path);
    let options = elaborate::Options {
        overrides: build.overrides()?,
        time: build.at,
        loader: &folder,
    };
    let (made, found) = elaborate(&mut sources, file, &options);
    Ok(Outcome {
        sources,
        found: found.into_iter().collect(),
        made,
    })
}

/// The scene that clauses mean.
pub(crate) fn clauses(path: &Path, text: String, build: &Build) -> Result<Outcome<Scene>, Failure> {
    if let Some((name, _)) = build.overrides()?.first() {
        let problem = format!("{} has no params, so no `{name}`", path.display());
        return Err(Failure::Input(problem));
    }
    let mut sources = Sources::new();
    let file = sources.add(path.display().to_string(), text);
    let (made, found) = parse_clauses(&sources, file);
    Ok(Outcome {
        sources,
        found: found.into_iter().collect(),
        made,
    })
}

/// A scene that is ready to run.
pub(crate) struct Opened {
    /// Programs and graphs, with the params and the time that were asked for.
    pub(crate) compiled: Compiled,
    /// The results of the uniform program.
    pub(crate) outputs: Vec<f64>,
    /// The scene's functions as WGSL, once something has asked for them.
    generated: OnceCell<GeneratedSource>,
    /// What `print` said.
    pub(crate) printed: Vec<String>,
}

impl Opened {
    fn new(mut compiled: Compiled, printed: Vec<String>, time: f64) -> Self {
        let outputs = compiled.update(time);
        Self {
            compiled,
            outputs,
            generated: OnceCell::new(),
            printed,
        }
    }

    /// The programs.
    pub(crate) fn module(&self) -> &Module {
        &self.compiled.module
    }

    /// The scene as all engines take it.
    pub(crate) fn loaded(&self) -> Loaded<'_> {
        let generated = self.generated.get_or_init(|| self.compiled.generated());
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
            module: &self.compiled.module,
            outputs: &self.outputs,
            generated: SceneSource::default(),
        }
    }
}

/// Compiles what a file holds.
pub(crate) fn compile(
    path: &Path,
    content: Content,
    build: &Build,
) -> Result<Outcome<Opened>, Failure> {
    let outcome = match content {
        Content::Text(text) => elaborated(path, text, build)?,
        Content::Clauses(text) => clauses(path, text, build)?,
        Content::Bytecode(module) => return bytecode::compiled(path, *module, build),
    };
    let Outcome {
        sources,
        mut found,
        made,
    } = outcome;
    let options = compile::Options {
        part: build.part.clone(),
        passes: build.passes(),
        time: build.at,
        sight: build.sight,
    };
    let made = made.and_then(|scene| {
        let printed = scene.printed.clone();
        let (compiled, more) = compile::compile(scene, &options);
        found.extend(more);
        compiled.map(|compiled| Opened::new(compiled, printed, build.at))
    });
    Ok(Outcome {
        sources,
        found,
        made,
    })
}

/// Reads and compiles a file, and tells the user what there is to say about it.
pub(crate) fn open(path: &Path, build: &Build, terminal: &Terminal) -> Result<Opened, Failure> {
    let opened = compile(path, read(path)?, build)?.told(terminal)?;
    for line in &opened.printed {
        terminal.note(line);
    }
    Ok(opened)
}
