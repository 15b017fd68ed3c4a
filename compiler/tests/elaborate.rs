//! Scenes from text: meanings of texts, diagnostics of mistakes, and rules for all scenes.

#[path = "elaborate/boxes.rs"]
mod boxes;
#[path = "elaborate/cutters.rs"]
mod cutters;
#[path = "elaborate/cutters_sloping.rs"]
mod cutters_sloping;
#[path = "elaborate/definedness.rs"]
mod definedness;
#[path = "elaborate/errors.rs"]
mod errors;
#[path = "elaborate/limits.rs"]
mod limits;
#[path = "elaborate/meaning.rs"]
mod meaning;
#[path = "elaborate/overflow.rs"]
mod overflow;
#[path = "elaborate/rules.rs"]
mod rules;
#[path = "elaborate/seams.rs"]
mod seams;
#[path = "elaborate/slopes.rs"]
mod slopes;

use sdfc_compiler::elaborate::{Loader, Options, elaborate};
use sdfc_compiler::scene::Scene;
use sdfc_lang::{Diagnostic, Diagnostics, Sources, Style};

/// Files by path.
struct Files<'f>(&'f [(&'f str, &'f str)]);

impl Loader for Files<'_> {
    fn load(&self, path: &str) -> Result<String, String> {
        let file = self.0.iter().find(|(name, _)| *name == path);
        file.map(|(_, text)| (*text).to_owned())
            .ok_or_else(|| "no such file".to_owned())
    }
}

/// Elaborates a text that may import these files, with these overrides.
fn build(
    text: &str,
    files: &[(&str, &str)],
    overrides: &[(&str, &str)],
) -> (Option<Scene>, Vec<Diagnostic>, Sources) {
    let mut sources = Sources::new();
    let file = sources.add("scene.sdf", text);
    let overrides = overrides
        .iter()
        .map(|(name, text)| ((*name).into(), (*text).into()));
    let options = Options {
        overrides: overrides.collect(),
        time: 0.0,
        loader: &Files(files),
    };
    let (scene, diagnostics) = elaborate(&mut sources, file, &options);
    (scene, diagnostics, sources)
}

/// The messages as text for the terminal.
fn rendered(diagnostics: Vec<Diagnostic>, sources: &Sources) -> String {
    diagnostics
        .into_iter()
        .collect::<Diagnostics>()
        .render(sources, Style::Plain)
}

/// The scene of a text without errors.
fn scene(text: &str) -> Scene {
    scene_with(text, &[])
}

/// The scene of a text without errors, with overrides.
fn scene_with(text: &str, overrides: &[(&str, &str)]) -> Scene {
    let (scene, diagnostics, sources) = build(text, &[], overrides);
    scene.unwrap_or_else(|| panic!("{text}\n{}", rendered(diagnostics, &sources)))
}
