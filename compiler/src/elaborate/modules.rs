//! Files of a scene: the scene's own file and its imports, each parsed once.
//!
//! A path in `import` is relative to the importing file; `std/…` is the standard library. Files
//! outside the folder of the scene cannot be imported, and imports cannot form a cycle.

use super::diagnose::{nearest, suggest};
use sdfc_lang::ast::{self, ItemKind};
use sdfc_lang::{Diagnostic, FileId, Sources, Span, codes, parse};
use std::collections::{HashMap, HashSet};

/// Maximum number of files of a scene.
const MAX_FILES: usize = 256;

/// The standard library: paths and texts.
const STANDARD_LIBRARY: [(&str, &str); 2] = [
    ("std/fasteners", include_str!("../../std/fasteners.sdf")),
    ("std/colors", include_str!("../../std/colors.sdf")),
];

/// Source of the texts of imported files.
pub trait Loader: Sync {
    /// Returns the text of a file, or a short reason for which it cannot be read. The path is relative to the
    /// folder of the scene, with `/` between folders.
    fn load(&self, path: &str) -> Result<String, String>;
}

/// A loader for scenes that import only the standard library.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoFiles;

impl Loader for NoFiles {
    fn load(&self, _path: &str) -> Result<String, String> {
        Err("there are no files here".to_owned())
    }
}

/// Target of an import.
#[derive(Clone, Copy, Debug)]
pub(crate) enum ImportTarget {
    /// A file that could not be read, which has been reported.
    Unreadable,
    /// A file of the language, by the index of its module.
    Module(usize),
    /// A `.vm` file, which is a shape.
    FidgetText(FileId),
}

/// A file with its resolved imports.
#[derive(Debug)]
pub(crate) struct ImportedModule {
    /// Syntax tree of the file.
    pub(crate) file: ast::File,
    /// Imports: alias, span of the alias, and what was found.
    imports: Vec<(String, Span, ImportTarget)>,
    /// Names that the items define, without duplicates.
    defined: HashSet<String>,
}

impl ImportedModule {
    /// Returns what an alias refers to; `None` if there is no such import.
    pub(crate) fn import(&self, alias: &str) -> Option<ImportTarget> {
        // Of equal aliases, the latest takes effect.
        self.imports
            .iter()
            .rev()
            .find(|(name, ..)| name == alias)
            .map(|(.., target)| *target)
    }
    /// Returns what an import of this file refers to.
    pub(crate) fn target(&self, import: &ast::Import) -> ImportTarget {
        self.imports
            .iter()
            .find(|(_, span, _)| *span == import.alias.span)
            .map_or(ImportTarget::Unreadable, |(.., target)| *target)
    }
    /// Returns the aliases of the imports, in the order of the text.
    pub(crate) fn import_names(&self) -> impl Iterator<Item = &str> {
        self.imports.iter().map(|(name, ..)| name.as_str())
    }
    /// Reports whether an item defines a name.
    pub(crate) fn defines(&self, name: &str) -> bool {
        self.defined.contains(name)
    }
    /// Returns the names that the items define, in no order.
    pub(crate) fn definitions(&self) -> impl Iterator<Item = &str> {
        self.defined.iter().map(String::as_str)
    }
}

/// All files of a scene.
#[derive(Debug)]
pub(crate) struct Modules {
    /// The files that were parsed, each after its imports; the scene itself is last.
    pub(crate) all: Vec<ImportedModule>,
}

/// Parses a file and all its imports. Returns `None` if the file itself does not parse.
pub(crate) fn load(
    sources: &mut Sources,
    file: FileId,
    loader: &dyn Loader,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Modules> {
    let mut loading = ModuleLoader {
        sources,
        root: file,
        loader,
        diagnostics,
        modules: Vec::new(),
        loaded: HashMap::new(),
        loading_paths: Vec::new(),
        files: 1,
    };
    loading.module(file, "")?;
    Some(Modules {
        all: loading.modules,
    })
}

struct ModuleLoader<'l> {
    sources: &'l mut Sources,
    root: FileId,
    loader: &'l dyn Loader,
    diagnostics: &'l mut Vec<Diagnostic>,
    modules: Vec<ImportedModule>,
    /// Imported files by path.
    loaded: HashMap<String, ImportTarget>,
    /// Paths of the files that are being loaded, outermost first.
    loading_paths: Vec<String>,
    files: usize,
}

impl ModuleLoader<'_> {
    /// Loads a module and its imports, and returns its index. It recurses over nested imports, at most `MAX_FILES`
    /// deep.
    fn module(&mut self, id: FileId, path: &str) -> Option<usize> {
        let (file, messages) = parse(self.sources, id);
        // Warnings are shown only for the scene's own file.
        let is_own = path.is_empty();
        self.diagnostics
            .extend(messages.into_iter().filter(|m| is_own || m.is_error()));
        let file = file?;
        let mut imports = Vec::new();
        let mut defined = HashSet::new();
        let mut define = |name: &str| defined.insert(name.to_owned());
        for item in &file.items {
            match &item.kind {
                ItemKind::Import(import) => {
                    let target = self.import(path, import);
                    if matches!(target, ImportTarget::FidgetText(_)) {
                        define(&import.alias.name);
                    }
                    imports.push((import.alias.name.clone(), import.alias.span, target));
                }
                ItemKind::Param(param) => {
                    define(&param.name.name);
                }
                ItemKind::Let(binding) => {
                    define(&binding.name.name);
                }
                ItemKind::Fn(function) => {
                    define(&function.name.name);
                }
                ItemKind::Part(part) => {
                    define(&part.name.name);
                }
                ItemKind::Block(block) => {
                    block.name.iter().for_each(|name| {
                        define(&name.name);
                    });
                }
                ItemKind::Expr(_) => {}
            }
        }
        self.modules.push(ImportedModule {
            file,
            imports,
            defined,
        });
        Some(self.modules.len() - 1)
    }

    fn import(&mut self, from: &str, import: &ast::Import) -> ImportTarget {
        let path = match self.resolve(from, import) {
            Ok(path) => path,
            Err(diagnostic) => {
                self.diagnostics.push(*diagnostic);
                return ImportTarget::Unreadable;
            }
        };
        if self.loading_paths.contains(&path) || path == self.scene_file_name() {
            let root = self.scene_file_name();
            let open_paths = [&root].into_iter().chain(&self.loading_paths);
            let cycle = open_paths.skip_while(|open| **open != path).chain([&path]);
            let cycle: Vec<&str> = cycle.map(String::as_str).collect();
            let message = format!("`{}` imports itself in the end", import.path);
            self.diagnostics.push(
                Diagnostic::error(codes::E0211, import.path_span, message)
                    .note(format!("the circle is {}", cycle.join(" → "))),
            );
            return ImportTarget::Unreadable;
        }
        if let Some(target) = self.loaded.get(&path) {
            return *target;
        }
        self.loaded.insert(path.clone(), ImportTarget::Unreadable);
        if self.files == MAX_FILES {
            let message = format!("a scene is made of at most {MAX_FILES} files");
            self.diagnostics
                .push(Diagnostic::error(codes::E0210, import.path_span, message));
            return ImportTarget::Unreadable;
        }
        let text = match self.load_text(&path, import) {
            Ok(text) => text,
            Err(diagnostic) => {
                self.diagnostics.push(*diagnostic);
                return ImportTarget::Unreadable;
            }
        };
        self.files += 1;
        let id = self.sources.add(self.display_name(&path), text);
        let target = if is_fidget_text(&path) {
            ImportTarget::FidgetText(id)
        } else {
            self.loading_paths.push(path.clone());
            let module = self.module(id, &path);
            self.loading_paths.pop();
            module.map_or(ImportTarget::Unreadable, ImportTarget::Module)
        };
        self.loaded.insert(path, target);
        target
    }

    /// Returns the scene's own path, as imports within its folder would write it.
    fn scene_file_name(&self) -> String {
        let name = self.sources.name(self.root);
        name.rsplit(['/', '\\']).next().unwrap_or(name).to_owned()
    }

    /// Returns the path of a file for messages: relative to the same folder as the scene's path.
    fn display_name(&self, path: &str) -> String {
        if path.starts_with("std/") {
            return format!("{path}.sdf");
        }
        let name = self.sources.name(self.root);
        match name.rfind(['/', '\\']) {
            Some(last_separator) => format!("{}{path}", &name[..=last_separator]),
            None => path.to_owned(),
        }
    }

    /// Returns the path of an import relative to the scene's folder. A path outside of that folder is an error.
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
        for component in written.split(['/', '\\']) {
            match component {
                "" | "." => {}
                ".." => {
                    if folders.pop().is_none() {
                        return outside("put the file beside the scene, or in a folder below it");
                    }
                }
                component => folders.push(component),
            }
        }
        Ok(folders.join("/"))
    }

    fn load_text(&self, path: &str, import: &ast::Import) -> Result<String, Box<Diagnostic>> {
        if path.starts_with("std/") {
            let text = STANDARD_LIBRARY.iter().find(|(name, _)| *name == path);
            return text.map(|(_, text)| (*text).to_owned()).ok_or_else(|| {
                let names = STANDARD_LIBRARY.iter().map(|(name, _)| *name);
                let message = format!("the library has no `{path}`");
                let diagnostic = Diagnostic::error(codes::E0210, import.path_span, message);
                let suggestion = nearest(path, names.clone()).map(|name| format!("\"{name}\""));
                let list = names.collect::<Vec<_>>().join(", ");
                let diagnostic = diagnostic.help(format!("there are {list}"));
                Box::new(suggest(diagnostic, import.path_span, suggestion.as_deref()))
            });
        }
        self.loader.load(path).map_err(|error| {
            let message = format!("`{}` cannot be read: {error}", import.path);
            let mut diagnostic = Diagnostic::error(codes::E0210, import.path_span, message);
            if !path.ends_with(".sdf") && !is_fidget_text(path) {
                let text = format!("\"{}.sdf\"", import.path);
                diagnostic = diagnostic.fix(import.path_span, text, "a scene file ends in `.sdf`");
            }
            Box::new(diagnostic)
        })
    }
}

/// Reports whether a path is that of a `.vm` file.
fn is_fidget_text(path: &str) -> bool {
    path.ends_with(".vm")
}
