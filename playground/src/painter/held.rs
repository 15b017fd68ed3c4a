//! An engine and what is loaded in it.

use super::{Moment, Problem};
use crate::build::Scene;
use sdfc_compiler::compile::{Compiled, GeneratedSource};
use sdfc_runtime::engine::{Engine, EngineError, EngineKind, Loaded};
use sdfc_runtime::frame::RenderSettings;
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use sdfc_vm::program::Module;

/// See [the module](self).
pub(super) struct Held {
    pub(super) engine: Box<dyn Engine>,
    loaded: Option<Now>,
}

/// A scene at a moment.
pub(super) struct Now {
    /// The scene's build.
    number: u64,
    moment: Moment,
    pub(super) module: Module,
    pub(super) outputs: Vec<f64>,
}

/// A scene as engines take it: its own programs, or those that tell what its leaves are.
pub(super) struct Programs<'p> {
    /// The scene's build.
    pub(super) number: u64,
    pub(super) compiled: &'p Compiled,
    /// The generated source, for engines that read it.
    pub(super) generated: &'p dyn Fn() -> &'p GeneratedSource,
}

impl Held {
    pub(super) fn new(engine: Box<dyn Engine>) -> Self {
        Self {
            engine,
            loaded: None,
        }
    }

    /// Brings a scene and its moment to the engine.
    pub(super) fn bring(&mut self, scene: &Scene, moment: &Moment) -> Result<(), Problem> {
        let programs = Programs {
            number: scene.number,
            compiled: &scene.opened.compiled,
            generated: &|| scene.generated(),
        };
        self.bring_programs(&programs, moment)
    }

    /// Brings programs and their moment to the engine: all of it, or only numbers, or nothing.
    pub(super) fn bring_programs(
        &mut self,
        programs: &Programs<'_>,
        moment: &Moment,
    ) -> Result<(), Problem> {
        if let Some(now) = self
            .loaded
            .as_mut()
            .filter(|now| now.number == programs.number)
        {
            if now.moment == *moment {
                return Ok(());
            }
            now.update(programs.compiled, moment);
            let done = self.engine.update(&now.module, &now.outputs);
            if done.is_err() {
                self.loaded = None;
            }
            return Ok(done?);
        }
        self.loaded = None;
        let mut now = Now {
            number: programs.number,
            moment: moment.clone(),
            module: programs.compiled.module.clone(),
            outputs: Vec::new(),
        };
        now.update(programs.compiled, moment);
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
        self.engine.load(&Loaded {
            module: &now.module,
            outputs: &now.outputs,
            generated,
        })?;
        self.loaded = Some(now);
        Ok(())
    }

    /// What is loaded.
    pub(super) fn now(&self) -> Result<&Now, Problem> {
        let nothing = || Problem::from(EngineError::NothingLoaded);
        self.loaded.as_ref().ok_or_else(nothing)
    }

    /// How a picture with such a look is drawn.
    pub(super) fn settings(&self, look: &Overrides) -> Result<RenderSettings, Problem> {
        let now = self.now()?;
        resolve(&now.module, &now.outputs, look).map_err(|error| Problem::Scene(error.to_string()))
    }
}

impl Now {
    fn update(&mut self, compiled: &Compiled, moment: &Moment) {
        for (param, value) in self.module.settings.params.iter_mut().zip(&*moment.values) {
            param.value.clone_from(value);
        }
        self.outputs = compiled.bring(&mut self.module, moment.time);
        self.moment = moment.clone();
    }
}
