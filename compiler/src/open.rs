//! From what a file holds to programs: the language's text, bytecode, or the clauses of a `.vm`
//! file. What stands here is the same for whoever opens scenes: a command line, a window.
//!
//! Nothing is read here: bytes come from the caller, imported files from its
//! [`Loader`].

mod bytecode;

use crate::clauses::parse_clauses;
use crate::compile::{self, Compiled};
use crate::elaborate::{self, Loader, elaborate};
use crate::passes::PassOptions;
use crate::passes::lod::Sight;
use crate::scene::Scene;
use sdfc_lang::{Diagnostics, Sources};
use sdfc_vm::program::Module;
use std::path::Path;

/// What a file holds.
#[derive(Clone, Debug)]
pub enum Content {
    /// The language.
    Text(String),
    /// Bytecode that has been verified.
    Bytecode(Box<Module>),
    /// One operation a line, as Fidget and libfive write them.
    Clauses(String),
}

impl Content {
    /// Tells by its first bytes, else by its name, what a file holds.
    ///
    /// # Errors
    ///
    /// Says, with the file's name, that bytecode is damaged or text is none.
    pub fn of(path: &Path, bytes: Vec<u8>) -> Result<Self, String> {
        let is_named = |extension| path.extension().is_some_and(|found| found == extension);
        if bytes.starts_with(b"SDFB") || is_named("sdfb") {
            let module = sdfc_vm::file::decode_file(&bytes)
                .map_err(|error| format!("{}: {error}", path.display()))?;
            return Ok(Self::Bytecode(Box::new(module)));
        }
        let text = decoded(path, bytes)?;
        Ok(if is_named("vm") {
            Self::Clauses(text)
        } else {
            Self::Text(text)
        })
    }
}

/// Bytes as text.
///
/// # Errors
///
/// Says, with the file's name, which byte in which line is no text.
pub fn decoded(path: &Path, bytes: Vec<u8>) -> Result<String, String> {
    String::from_utf8(bytes).map_err(|error| {
        let good = error.utf8_error().valid_up_to();
        let bytes = error.as_bytes();
        let line = 1 + bytes[..good].iter().filter(|byte| **byte == b'\n').count();
        format!(
            "{} is not UTF-8 text: there is the byte 0x{:02x} in line {line}",
            path.display(),
            bytes[good],
        )
    })
}

/// How a scene is opened.
#[derive(Clone)]
pub struct Request<'r> {
    /// What the file is called in messages.
    pub path: &'r Path,
    /// Values of parameters, as `name` and the text of the value.
    pub overrides: Vec<(String, String)>,
    /// The time of its animation, in seconds.
    pub time: f64,
    /// The named output, instead of the scene's result.
    pub part: Option<String>,
    /// Which passes run.
    pub passes: PassOptions,
    /// Whether what is to run it gains from guards that skip parts of it.
    pub guards: bool,
    /// Who looks, where detail that is too small to be seen is left out.
    pub sight: Option<Sight>,
    /// Where imported files come from.
    pub loader: &'r dyn Loader,
}

/// A scene's sources, what was found in them, and what came of it.
#[derive(Debug)]
pub struct Outcome<T> {
    /// The texts.
    pub sources: Sources,
    /// What there is to say.
    pub found: Diagnostics,
    /// The result, if nothing is wrong.
    pub made: Option<T>,
}

/// A scene that is ready to run.
#[derive(Clone, Debug)]
pub struct Opened {
    /// Programs and graphs, with the params and the time that were asked for.
    pub compiled: Compiled,
    /// The results of the uniform program.
    pub outputs: Vec<f64>,
    /// What `print` said.
    pub printed: Vec<String>,
}

impl Opened {
    fn new(mut compiled: Compiled, printed: Vec<String>, time: f64) -> Self {
        let outputs = compiled.update(time);
        Self {
            compiled,
            outputs,
            printed,
        }
    }
}

/// The scene that a text means.
pub fn elaborated(text: String, request: &Request<'_>) -> Outcome<Scene> {
    let mut sources = Sources::new();
    let file = sources.add(request.path.display().to_string(), text);
    let options = elaborate::Options {
        overrides: request.overrides.clone(),
        time: request.time,
        loader: request.loader,
    };
    let (made, found) = elaborate(&mut sources, file, &options);
    Outcome {
        sources,
        found: found.into_iter().collect(),
        made,
    }
}

/// The scene that clauses mean.
///
/// # Errors
///
/// Says that there are no parameters where some were given.
pub fn clauses(text: String, request: &Request<'_>) -> Result<Outcome<Scene>, String> {
    if let Some((name, _)) = request.overrides.first() {
        let path = request.path.display();
        return Err(format!("{path} has no params, so no `{name}`"));
    }
    let mut sources = Sources::new();
    let file = sources.add(request.path.display().to_string(), text);
    let (made, found) = parse_clauses(&sources, file);
    Ok(Outcome {
        sources,
        found: found.into_iter().collect(),
        made,
    })
}

/// Compiles what a file holds.
///
/// # Errors
///
/// Says what the request asks for that this kind of file cannot give.
pub fn open(content: Content, request: &Request<'_>) -> Result<Outcome<Opened>, String> {
    let outcome = match content {
        Content::Text(text) => elaborated(text, request),
        Content::Clauses(text) => clauses(text, request)?,
        Content::Bytecode(module) => return bytecode::opened(*module, request),
    };
    let Outcome {
        sources,
        mut found,
        made,
    } = outcome;
    let mut passes = request.passes.clone();
    if !request.guards {
        passes.without.push("bounding".to_owned());
    }
    let options = compile::Options {
        part: request.part.clone(),
        passes,
        time: request.time,
        sight: request.sight,
    };
    let made = made.and_then(|scene| {
        let printed = scene.printed.clone();
        let (compiled, more) = compile::compile(scene, &options);
        found.extend(more);
        compiled.map(|compiled| Opened::new(compiled, printed, request.time))
    });
    Ok(Outcome {
        sources,
        found,
        made,
    })
}
