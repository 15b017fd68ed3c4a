//! Opens scenes: from the content of a file (the language's text, bytecode, or the clauses of a `.vm`
//! file) to programs. The command line and the window share this module.
//!
//! It reads no files: bytes come from the caller, imported files from its [`Loader`].

mod bytecode;

use crate::compile::{self, Compiled};
use crate::elaborate::{self, Loader, elaborate};
use crate::fidget_text::parse_fidget_text;
use crate::passes::PassOptions;
use crate::passes::lod::LodTarget;
use crate::scene::Scene;
use sdfc_lang::{Diagnostics, Sources};
use sdfc_vm::program::Module;
use std::path::Path;

/// Content of a scene file.
#[derive(Clone, Debug)]
pub enum SceneFile {
    /// Text in the language.
    Text(String),
    /// A module of bytecode, already verified.
    Bytecode(Box<Module>),
    /// One operation per line, as Fidget and libfive write them.
    FidgetText(String),
}

impl SceneFile {
    /// Determines the kind of a file by its first bytes, otherwise by its name.
    ///
    /// # Errors
    ///
    /// Reports, with the file's name, damaged bytecode or bytes that are not UTF-8.
    pub fn from_bytes(path: &Path, bytes: Vec<u8>) -> Result<Self, String> {
        let is_named = |extension| path.extension().is_some_and(|actual| actual == extension);
        if bytes.starts_with(b"SDFB") || is_named("sdfb") {
            let module = sdfc_vm::file::decode_file(&bytes)
                .map_err(|error| format!("{}: {error}", path.display()))?;
            return Ok(Self::Bytecode(Box::new(module)));
        }
        let text = decode_text(path, bytes)?;
        Ok(if is_named("vm") {
            Self::FidgetText(text)
        } else {
            Self::Text(text)
        })
    }
}

/// Decodes bytes as text.
///
/// # Errors
///
/// Reports, with the file's name, the first byte that is not UTF-8 and its line.
pub fn decode_text(path: &Path, bytes: Vec<u8>) -> Result<String, String> {
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

/// Options for opening a scene.
#[derive(Clone)]
pub struct Request<'r> {
    /// Name of the file in messages.
    pub path: &'r Path,
    /// Values of parameters, as `name` and the text of the value.
    pub overrides: Vec<(String, String)>,
    /// Time of its animation, in seconds.
    pub time: f64,
    /// Named output to compile instead of the scene's result.
    pub part: Option<String>,
    /// Passes to run.
    pub passes: PassOptions,
    /// Set if the engine benefits from guards that skip parts of the program.
    pub emit_guards: bool,
    /// View for which detail that is too small to be visible is removed.
    pub lod_target: Option<LodTarget>,
    /// Set if a view that frames the scene is needed even if all of its cameras have positions.
    pub needs_subject: bool,
    /// Source of imported files.
    pub loader: &'r dyn Loader,
}

/// Sources of a scene, diagnostics, and the result.
#[derive(Debug)]
pub struct OpenResult<T> {
    /// Texts of the scene and of its imports.
    pub sources: Sources,
    /// Errors, warnings and notes of all stages.
    pub diagnostics: Diagnostics,
    /// Result, unless there were errors.
    pub value: Option<T>,
}

/// Scene that is ready to run.
#[derive(Clone, Debug)]
pub struct CompiledScene {
    /// Programs and graphs, with the requested params and time.
    pub compiled: Compiled,
    /// Results of the uniform program.
    pub uniform_values: Vec<f64>,
    /// Output of `print`.
    pub printed: Vec<String>,
}

impl CompiledScene {
    fn new(mut compiled: Compiled, printed: Vec<String>, time: f64) -> Self {
        let uniform_values = compiled.update(time);
        Self {
            compiled,
            uniform_values,
            printed,
        }
    }
}

/// Elaborates a text to a scene.
pub fn elaborate_text(text: String, request: &Request<'_>) -> OpenResult<Scene> {
    let mut sources = Sources::new();
    let file = sources.add(request.path.display().to_string(), text);
    let options = elaborate::Options {
        overrides: request.overrides.clone(),
        time: request.time,
        loader: request.loader,
    };
    let (value, diagnostics) = elaborate(&mut sources, file, &options);
    OpenResult {
        sources,
        diagnostics: diagnostics.into_iter().collect(),
        value,
    }
}

/// Parses the text of Fidget to a scene.
///
/// # Errors
///
/// Reports parameters that were passed: such a text has none.
pub fn elaborate_fidget_text(
    text: String,
    request: &Request<'_>,
) -> Result<OpenResult<Scene>, String> {
    if let Some((name, _)) = request.overrides.first() {
        let path = request.path.display();
        return Err(format!("{path} has no params, so no `{name}`"));
    }
    let mut sources = Sources::new();
    let file = sources.add(request.path.display().to_string(), text);
    let (value, diagnostics) = parse_fidget_text(&sources, file);
    Ok(OpenResult {
        sources,
        diagnostics: diagnostics.into_iter().collect(),
        value,
    })
}

/// Compiles the content of a file.
///
/// # Errors
///
/// Reports options of the request that this kind of file does not support.
pub fn open(
    content: SceneFile,
    request: &Request<'_>,
) -> Result<OpenResult<CompiledScene>, String> {
    let outcome = match content {
        SceneFile::Text(text) => elaborate_text(text, request),
        SceneFile::FidgetText(text) => elaborate_fidget_text(text, request)?,
        SceneFile::Bytecode(module) => return bytecode::open_module(*module, request),
    };
    let OpenResult {
        sources,
        mut diagnostics,
        value,
    } = outcome;
    let mut passes = request.passes.clone();
    if !request.emit_guards {
        passes.disabled.push("guards".to_owned());
    }
    let options = compile::Options {
        part: request.part.clone(),
        passes,
        time: request.time,
        lod_target: request.lod_target,
        needs_subject: request.needs_subject,
    };
    let value = value.and_then(|scene| {
        let printed = scene.printed.clone();
        let (compiled, compile_diagnostics) = compile::compile(scene, &options);
        diagnostics.extend(compile_diagnostics);
        compiled.map(|compiled| CompiledScene::new(compiled, printed, request.time))
    });
    Ok(OpenResult {
        sources,
        diagnostics,
        value,
    })
}
