//! Texts drawn on an engine.

use super::compare::Picture;
use sdfc_compiler::compile::{self, Compiled};
use sdfc_compiler::elaborate::{self, elaborate};
use sdfc_compiler::passes::PassOptions;
use sdfc_lang::{Diagnostics, Sources, Style};
use sdfc_runtime::engine::{Engine, Loaded};
use sdfc_runtime::frame::{CellUse, Frame};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;

/// The way in which a text is drawn.
#[derive(Clone, Debug)]
pub(crate) struct Way {
    pub(crate) size: [u32; 2],
    pub(crate) passes: PassOptions,
    pub(crate) cells: CellUse,
    /// The size of the scene, as a multiple of those that it is compared with.
    pub(crate) scale: f64,
}

/// Draws a text as a picture to compare; gives the errors of one that is no scene.
pub(super) fn draw(engine: &mut dyn Engine, text: &str, way: &Way) -> Result<Picture, String> {
    let frame = frame(engine, text, way)?;
    Ok(Picture::new(&frame, way.scale))
}

/// Draws a text; gives the errors of one that is no scene.
pub(crate) fn frame(engine: &mut dyn Engine, text: &str, way: &Way) -> Result<Frame, String> {
    let mut compiled = compiled(text, way.passes.clone())?;
    let outputs = compiled.module.update(0.0);
    let overrides = Overrides {
        size: Some(way.size),
        aa: Some(1),
        cells: way.cells,
        ..Overrides::default()
    };
    let settings = resolve(&compiled.module, &outputs, &overrides);
    let settings = settings.map_err(|error| error.to_string())?;
    let source = compiled.generated();
    let generated = SceneSource {
        text: &source.text,
        calls: &source.calls,
    };
    let loaded = Loaded {
        module: &compiled.module,
        outputs: &outputs,
        generated,
    };
    engine.load(&loaded).expect("it loads");
    Ok(engine.render(&settings, &|_| {}).expect("it draws"))
}

/// A text without other files, compiled with some passes.
pub(crate) fn compiled(text: &str, passes: PassOptions) -> Result<Compiled, String> {
    let mut sources = Sources::new();
    let file = sources.add("text", text.to_owned());
    let (scene, found) = elaborate(&mut sources, file, &elaborate::Options::default());
    let rendered = |found: Diagnostics| found.render(&sources, Style::Plain);
    let scene = scene.ok_or_else(|| rendered(found.into_iter().collect()))?;
    let options = compile::Options {
        passes,
        ..compile::Options::default()
    };
    let (compiled, found) = compile::compile(scene, &options);
    compiled.ok_or_else(|| rendered(found.into_iter().collect()))
}
