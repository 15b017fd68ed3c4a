//! Draws texts on an engine.

use super::compare::Picture;
use sdfc_compiler::compile::{self, Compiled};
use sdfc_compiler::elaborate::{self, elaborate};
use sdfc_compiler::passes::PassOptions;
use sdfc_lang::{Diagnostics, Sources, Style};
use sdfc_runtime::engine::{Engine, SceneInput};
use sdfc_runtime::render::{CellMode, Image};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;

/// Options for drawing a text.
#[derive(Clone, Debug)]
pub(crate) struct DrawOptions {
    pub(crate) size: [u32; 2],
    pub(crate) passes: PassOptions,
    pub(crate) cells: CellMode,
    /// Scale of the scene, relative to the scenes it is compared with.
    pub(crate) scale: f64,
}

/// Draws a text and prepares the picture for comparison; fails with the diagnostics of an invalid scene.
pub(super) fn draw(
    engine: &mut dyn Engine,
    text: &str,
    options: &DrawOptions,
) -> Result<Picture, String> {
    let image = image(engine, text, options)?;
    Ok(Picture::new(&image, options.scale))
}

/// Draws a text; fails with the diagnostics of an invalid scene.
pub(crate) fn image(
    engine: &mut dyn Engine,
    text: &str,
    options: &DrawOptions,
) -> Result<Image, String> {
    let mut compiled = compiled(text, options.passes.clone())?;
    let uniform_values = compiled.module.update(0.0);
    let overrides = Overrides {
        size: Some(options.size),
        aa: Some(1),
        cells: options.cells,
        ..Overrides::default()
    };
    let settings = resolve(&compiled.module, &uniform_values, &overrides);
    let settings = settings.map_err(|error| error.to_string())?;
    let source = compiled.generated();
    let generated = SceneSource {
        text: &source.text,
        calls: &source.calls,
    };
    let loaded = SceneInput {
        module: &compiled.module,
        uniform_values: &uniform_values,
        generated,
    };
    engine.load(&loaded).expect("it loads");
    Ok(engine.render(&settings, &|_| {}).expect("it draws"))
}

/// Compiles a text without imports, with the given passes.
pub(crate) fn compiled(text: &str, passes: PassOptions) -> Result<Compiled, String> {
    let mut sources = Sources::new();
    let file = sources.add("text", text.to_owned());
    let (scene, diagnostics) = elaborate(&mut sources, file, &elaborate::Options::default());
    let rendered = |diagnostics: Diagnostics| diagnostics.render(&sources, Style::Plain);
    let scene = scene.ok_or_else(|| rendered(diagnostics.into_iter().collect()))?;
    let options = compile::Options {
        passes,
        ..compile::Options::default()
    };
    let (compiled, diagnostics) = compile::compile(scene, &options);
    compiled.ok_or_else(|| rendered(diagnostics.into_iter().collect()))
}
