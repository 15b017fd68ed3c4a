//! An engine with its loaded scene.

use super::{DrawError, SceneInputs};
use crate::build::BuiltScene;
use sdfc_compiler::compile::{Compiled, GeneratedSource};
use sdfc_runtime::engine::{Engine, EngineError, EngineKind, SceneInput};
use sdfc_runtime::render::RenderSettings;
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use sdfc_vm::program::Module;

/// See [the module](self).
pub(super) struct LoadedEngine {
    pub(super) engine: Box<dyn Engine>,
    loaded: Option<LoadedScene>,
}

/// A scene with its current inputs.
pub(super) struct LoadedScene {
    /// Build number of the scene.
    number: u64,
    inputs: SceneInputs,
    pub(super) module: Module,
    pub(super) uniform_values: Vec<f64>,
}

/// Programs that an engine loads: those of the scene, or those that identify its leaves.
pub(super) struct ScenePrograms<'p> {
    /// Build number of the scene.
    pub(super) number: u64,
    pub(super) compiled: &'p Compiled,
    /// Generated source for engines that require it.
    pub(super) generated: &'p dyn Fn() -> &'p GeneratedSource,
}

impl LoadedEngine {
    pub(super) fn new(engine: Box<dyn Engine>) -> Self {
        Self {
            engine,
            loaded: None,
        }
    }

    /// Loads a scene and its inputs into the engine.
    pub(super) fn load_scene(
        &mut self,
        scene: &BuiltScene,
        inputs: &SceneInputs,
    ) -> Result<(), DrawError> {
        let programs = ScenePrograms {
            number: scene.number,
            compiled: &scene.opened.compiled,
            generated: &|| scene.generated(),
        };
        self.load_programs(&programs, inputs)
    }

    /// Loads programs and their inputs into the engine. Only changed inputs are uploaded if the programs
    /// are loaded already.
    pub(super) fn load_programs(
        &mut self,
        programs: &ScenePrograms<'_>,
        inputs: &SceneInputs,
    ) -> Result<(), DrawError> {
        if let Some(current) = self
            .loaded
            .as_mut()
            .filter(|current| current.number == programs.number)
        {
            if current.inputs == *inputs {
                return Ok(());
            }
            current.update(programs.compiled, inputs);
            let updated = self.engine.update(&current.module, &current.uniform_values);
            if updated.is_err() {
                self.loaded = None;
            }
            return Ok(updated?);
        }
        self.loaded = None;
        let mut current = LoadedScene {
            number: programs.number,
            inputs: inputs.clone(),
            module: programs.compiled.module.clone(),
            uniform_values: Vec::new(),
        };
        current.update(programs.compiled, inputs);
        let generated = match self.engine.kind() {
            EngineKind::Wgsl => {
                let source = (programs.generated)();
                SceneSource {
                    text: &source.text,
                    calls: &source.calls,
                }
            }
            _ => SceneSource::default(),
        };
        self.engine.load(&SceneInput {
            module: &current.module,
            uniform_values: &current.uniform_values,
            generated,
        })?;
        self.loaded = Some(current);
        Ok(())
    }

    /// Returns the loaded scene.
    pub(super) fn loaded_scene(&self) -> Result<&LoadedScene, DrawError> {
        let not_loaded = || DrawError::from(EngineError::NothingLoaded);
        self.loaded.as_ref().ok_or_else(not_loaded)
    }

    /// Resolves the settings of a picture with these overrides.
    pub(super) fn settings(&self, overrides: &Overrides) -> Result<RenderSettings, DrawError> {
        let current = self.loaded_scene()?;
        resolve(&current.module, &current.uniform_values, overrides)
            .map_err(|error| DrawError::Scene(error.to_string()))
    }
}

impl LoadedScene {
    fn update(&mut self, compiled: &Compiled, inputs: &SceneInputs) {
        for (param, value) in self.module.settings.params.iter_mut().zip(&*inputs.values) {
            param.value.clone_from(value);
        }
        self.uniform_values = compiled.update_module(&mut self.module, inputs.time);
        self.inputs = inputs.clone();
    }
}
