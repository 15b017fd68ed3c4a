//! `sdfc play`: a window that shows a scene and follows its file.

use crate::engine;
use crate::failure::Failure;
use crate::input;
use crate::terminal::Terminal;
use sdfc_io::files::Disk;
use sdfc_playground::build::SceneOrigin;
use sdfc_playground::renderer::editing_engines;
use sdfc_playground::session::{Devices, EngineChoice, Event, Session};
use sdfc_playground::window::{Example, WindowServices, open};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::gpu::{DeviceKind, devices};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Open a window that shows a scene and follows its file.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The scene: .sdf, .sdfb or .vm; by default one that comes with the program.
    scene: Option<PathBuf>,
    /// Engine that draws. With auto, a GPU runs the program at once and generated code when compiled;
    /// without a GPU, the CPU draws.
    #[arg(long, value_enum, value_name = "ENGINE", default_value_t)]
    engine: engine::EngineArg,
}

/// Declares the scenes that come with the program, by their names; the first one is the default.
macro_rules! examples {
    ($($name:literal)*) => {
        &[$(Example {
            name: $name,
            text: include_str!(concat!("../../examples/", $name, ".sdf")),
        }),*]
    };
}

const EXAMPLES: &[Example] = examples! {
    "hello" "metaballs" "primitives" "blends" "materials" "shadows" "space" "figures" "lamp" "cog"
    "clock" "bracket" "chess" "character" "gyroid" "temple" "lighthouse" "landscape" "city"
};

pub(crate) fn run(arguments: &Arguments, _terminal: &Terminal) -> Result<(), Failure> {
    let source = match &arguments.scene {
        Some(path) if input::is_standard(path) => SceneOrigin::Text {
            name: "standard input".to_owned(),
            text: input::standard()?,
        },
        Some(path) => SceneOrigin::File(path.clone()),
        None => SceneOrigin::Text {
            name: format!("{}.sdf", EXAMPLES[0].name),
            text: EXAMPLES[0].text.to_owned(),
        },
    };
    let devices_found = devices();
    let available = Devices {
        gpu: !devices_found.is_empty(),
        hardware: devices_found
            .iter()
            .any(|gpu| gpu.kind != DeviceKind::Software),
    };
    let mut session = Session::new(source, available);
    let choice = match arguments.engine {
        engine::EngineArg::Auto => EngineChoice::Auto,
        engine::EngineArg::Cpu => EngineChoice::Only(EngineKind::Cpu),
        engine::EngineArg::Interp => EngineChoice::Only(EngineKind::Interp),
        engine::EngineArg::Wgsl => EngineChoice::Only(EngineKind::Wgsl),
        engine::EngineArg::Reference => EngineChoice::Only(EngineKind::Reference),
    };
    session.handle(Event::Engine(choice), Duration::ZERO);
    let tools = WindowServices {
        files: Arc::new(Disk),
        opener: Box::new(editing_engines),
        examples: EXAMPLES.to_vec(),
    };
    open(session, tools).map_err(|error| Failure::Environment(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::EXAMPLES;
    use std::collections::BTreeSet;

    #[test]
    fn all_examples_are_in_the_menu() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/examples");
        let on_disk: BTreeSet<String> = std::fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .filter(|path| path.extension().is_some_and(|extension| extension == "sdf"))
            .map(|path| path.file_stem().unwrap().to_string_lossy().into_owned())
            .collect();
        let listed = EXAMPLES.iter().map(|example| example.name.to_owned());
        assert_eq!(listed.collect::<BTreeSet<_>>(), on_disk);
    }
}
