//! The files of a scene: the one that was asked for and what it imports, parsed, each once.
//!
//! A path in `import` is relative to the file it stands in; `std/…` is the library that comes with
//! the language. Nothing outside the folder of the scene is read, and files do not import each
//! other in a circle.

use super::diagnose::{nearest, suggest};
use sdfc_lang::ast::{self, ItemKind};
use sdfc_lang::{Diagnostic, FileId, Sources, Span, codes, parse};
use std::collections::HashMap;

/// The most files that a scene is made of.
const MAX_FILES: usize = 256;

/// The library: its paths and texts.
const STANDARD: [(&str, &str); 2] = [
    ("std/fasteners", include_str!("../../std/fasteners.sdf")),
    ("std/colors", include_str!("../../std/colors.sdf")),
];

/// Gives the texts of imported files.
pub trait Loader: Sync {
    /// The text of a file, by its path relative to the folder of the scene, with `/` between
    /// folders; or why it cannot be read, in a few words.
    fn load(&self, path: &str) -> Result<String, String>;
}

/// A loader for scenes that import nothing but the library.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoFiles;

impl Loader for NoFiles {
    fn load(&self, _path: &str) -> Result<String, String> {
        Err("there are no files here".to_owned())
    }
}

/// A file with what its imports are.
#[derive(Debug)]
pub(crate) struct Module {
    /// Its tree.
    pub(crate) file: ast::File,
    /// What its imports are called, where they stand, and their modules, if they could be read.
    imports: Vec<(String, Span, Option<usize>)>,
    /// The names that its items define.
    defined: Vec<String>,
}

impl Module {
    /// The module behind an alias: none if there is no such import, `Some(None)` if its file could
    /// not be read.
    pub(crate) fn import(&self, alias: &str) -> Option<Option<usize>> {
        // The latest of a name holds.
        self.imports
            .iter()
            .rev()
            .find(|(name, ..)| name == alias)
            .map(|(.., module)| *module)
    }
    /// The names of its imports.
    pub(crate) fn import_names(&self) -> impl Iterator<Item = &str> {
        self.imports.iter().map(|(name, ..)| name.as_str())
    }
    /// Whether an item of it defines a name.
    pub(crate) fn defines(&self, name: &str) -> bool {
        self.defined.iter().any(|defined| defined == name)
    }
    /// The names that its items define, in order.
    pub(crate) fn definitions(&self) -> impl Iterator<Item = &str> {
        self.defined.iter().map(String::as_str)
    }
}

/// All files of a scene.
#[derive(Debug)]
pub(crate) struct Modules {
    /// The files that could be parsed, each after those that it imports; the scene itself is last.
    pub(crate) all: Vec<Module>,
}

/// Parses a file and all that it imports. There is nothing if the file itself does not parse.
pub(crate) fn load(
    sources: &mut Sources,
    file: FileId,
    loader: &dyn Loader,
    found: &mut Vec<Diagnostic>,
) -> Option<Modules> {
    let mut loading = Loading {
        sources,
        root: file,
        loader,
        found,
        modules: Vec::new(),
        known: HashMap::new(),
        open: Vec::new(),
        files: 1,
    };
    loading.module(file, "")?;
    Some(Modules {
        all: loading.modules,
    })
}

struct Loading<'l> {
    sources: &'l mut Sources,
    root: FileId,
    loader: &'l dyn Loader,
    found: &'l mut Vec<Diagnostic>,
    modules: Vec<Module>,
    /// The files that were read, by path.
    known: HashMap<String, Option<usize>>,
    /// The paths of the files that are being read, outermost first.
    open: Vec<String>,
    files: usize,
}

impl Loading<'_> {
    /// Recursion over imports within imports: at most as deep as there may be files.
    fn module(&mut self, id: FileId, path: &str) -> Option<usize> {
        let (file, messages) = parse(self.sources, id);
        // Warnings are for the file that the user works on.
        let is_own = path.is_empty();
        self.found
            .extend(messages.into_iter().filter(|m| is_own || m.is_error()));
        let file = file?;
        let mut imports = Vec::new();
        let mut defined = Vec::new();
        for item in &file.items {
            match &item.kind {
                ItemKind::Import(import) => {
                    let module = self.import(path, import);
                    imports.push((import.alias.name.clone(), import.alias.span, module));
                }
                ItemKind::Param(param) => defined.push(param.name.name.clone()),
                ItemKind::Let(binding) => defined.push(binding.name.name.clone()),
                ItemKind::Fn(function) => defined.push(function.name.name.clone()),
                ItemKind::Part(part) => defined.push(part.name.name.clone()),
                ItemKind::Block(block) => {
                    defined.extend(block.name.iter().map(|name| name.name.clone()));
                }
                ItemKind::Expr(_) => {}
            }
        }
        self.modules.push(Module {
            file,
            imports,
            defined,
        });
        Some(self.modules.len() - 1)
    }

    fn import(&mut self, from: &str, import: &ast::Import) -> Option<usize> {
        let path = match self.resolve(from, import) {
            Ok(path) => path,
            Err(diagnostic) => {
                self.found.push(*diagnostic);
                return None;
            }
        };
        if self.open.contains(&path) || path == self.root_path() {
            let root = self.root_path();
            let all = [&root].into_iter().chain(&self.open);
            let circle = all.skip_while(|open| **open != path).chain([&path]);
            let circle: Vec<&str> = circle.map(String::as_str).collect();
            let message = format!("`{}` imports itself in the end", import.path);
            self.found.push(
                Diagnostic::error(codes::E0211, import.path_span, message)
                    .note(format!("the circle is {}", circle.join(" → "))),
            );
            return None;
        }
        if let Some(known) = self.known.get(&path) {
            return *known;
        }
        self.known.insert(path.clone(), None);
        if self.files == MAX_FILES {
            let message = format!("a scene is made of at most {MAX_FILES} files");
            self.found
                .push(Diagnostic::error(codes::E0210, import.path_span, message));
            return None;
        }
        let text = match self.text(&path, import) {
            Ok(text) => text,
            Err(diagnostic) => {
                self.found.push(*diagnostic);
                return None;
            }
        };
        self.files += 1;
        let id = self.sources.add(self.shown_name(&path), text);
        self.open.push(path.clone());
        let module = self.module(id, &path);
        self.open.pop();
        self.known.insert(path, module);
        module
    }

    /// The path of the scene itself as imports of files in its folder would write it.
    fn root_path(&self) -> String {
        let name = self.sources.name(self.root);
        name.rsplit(['/', '\\']).next().unwrap_or(name).to_owned()
    }

    /// How messages call a file: beside the scene, by the scene's own folder.
    fn shown_name(&self, path: &str) -> String {
        if path.starts_with("std/") {
            return format!("{path}.sdf");
        }
        let name = self.sources.name(self.root);
        match name.rfind(['/', '\\']) {
            Some(at) => format!("{}{path}", &name[..=at]),
            None => path.to_owned(),
        }
    }

    /// The path relative to the scene's folder.
    fn resolve(&self, from: &str, import: &ast::Import) -> Result<String, Box<Diagnostic>> {
        let written = import.path.as_str();
        if written.starts_with("std/") {
            return Ok(written.trim_end_matches(".sdf").to_owned());
        }
        let outside = |help: &str| {
            let message = "an import cannot leave the folder of the scene";
            let diagnostic = Diagnostic::error(codes::E0212, import.path_span, message);
            Err(Box::new(diagnostic.help(help)))
        };
        let is_absolute = written.starts_with(['/', '\\', '~']) || written.contains(':');
        if is_absolute {
            return outside("write a path relative to the file, such as \"parts/bolt.sdf\"");
        }
        if from.starts_with("std/") {
            return outside("the library imports only `std/…`");
        }
        let mut folders: Vec<&str> = from.split('/').collect();
        folders.pop();
        for part in written.split(['/', '\\']) {
            match part {
                "" | "." => {}
                ".." => {
                    if folders.pop().is_none() {
                        return outside("put the file beside the scene, or in a folder below it");
                    }
                }
                part => folders.push(part),
            }
        }
        Ok(folders.join("/"))
    }

    fn text(&self, path: &str, import: &ast::Import) -> Result<String, Box<Diagnostic>> {
        if path.starts_with("std/") {
            let found = STANDARD.iter().find(|(name, _)| *name == path);
            return found.map(|(_, text)| (*text).to_owned()).ok_or_else(|| {
                let names = STANDARD.iter().map(|(name, _)| *name);
                let message = format!("the library has no `{path}`");
                let diagnostic = Diagnostic::error(codes::E0210, import.path_span, message);
                let near = nearest(path, names.clone()).map(|name| format!("\"{name}\""));
                let all = names.collect::<Vec<_>>().join(", ");
                let diagnostic = diagnostic.help(format!("there are {all}"));
                Box::new(suggest(diagnostic, import.path_span, near.as_deref()))
            });
        }
        self.loader.load(path).map_err(|why| {
            let message = format!("`{}` cannot be read: {why}", import.path);
            let mut diagnostic = Diagnostic::error(codes::E0210, import.path_span, message);
            if !path.ends_with(".sdf") {
                let text = format!("\"{}.sdf\"", import.path);
                diagnostic = diagnostic.fix(import.path_span, text, "a scene file ends in `.sdf`");
            }
            Box::new(diagnostic)
        })
    }
}
