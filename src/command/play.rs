//! `sdfc play`: a window that shows a scene and follows its file.

use crate::engine;
use crate::failure::Failure;
use crate::terminal::Terminal;
use sdfc_playground::build::Source;
use sdfc_playground::files::Disk;
use sdfc_playground::painter::engines;
use sdfc_playground::session::{Choice, Devices, Event, Session};
use sdfc_playground::window::{Example, Tools, open};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::gpu::{DeviceKind, devices};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Open a window that shows a scene and follows its file.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The scene: .sdf, .sdfb or .vm; without it, one that comes with the program.
    scene: Option<PathBuf>,
    /// What draws. With auto, hardware runs the program at once and generated code once that is
    /// compiled, and the CPU draws where there is none.
    #[arg(long, value_enum, value_name = "ENGINE", default_value_t)]
    engine: engine::Choice,
}

/// The scenes that come with the program, by their names; the first one is shown where none is asked
/// for.
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
        Some(path) => Source::File(path.clone()),
        None => Source::Text {
            name: format!("{}.sdf", EXAMPLES[0].name),
            text: EXAMPLES[0].text.to_owned(),
        },
    };
    let found = devices();
    let here = Devices {
        gpu: !found.is_empty(),
        hardware: found.iter().any(|gpu| gpu.kind != DeviceKind::Software),
    };
    let mut session = Session::new(source, here);
    let choice = match arguments.engine {
        engine::Choice::Auto => Choice::Auto,
        engine::Choice::Cpu => Choice::Only(EngineKind::Cpu),
        engine::Choice::Interp => Choice::Only(EngineKind::Interp),
        engine::Choice::Wgsl => Choice::Only(EngineKind::Wgsl),
        engine::Choice::Reference => Choice::Only(EngineKind::Reference),
    };
    session.handle(Event::Engine(choice), Duration::ZERO);
    let tools = Tools {
        files: Arc::new(Disk),
        opener: Box::new(engines),
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
        let there: BTreeSet<String> = std::fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .filter(|path| path.extension().is_some_and(|found| found == "sdf"))
            .map(|path| path.file_stem().unwrap().to_string_lossy().into_owned())
            .collect();
        let listed = EXAMPLES.iter().map(|example| example.name.to_owned());
        assert_eq!(listed.collect::<BTreeSet<_>>(), there);
    }
}
