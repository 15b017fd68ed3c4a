//! The interpreter on a GPU: both programs of a scene as words and constants in buffers, and a
//! kernel with only the operations they need. Another scene that needs no more runs in the same
//! kernel, so an edit is a write to a buffer.

use super::driver::{OnDevice, SceneText, unpainted_surface};
use super::{EngineError, EngineKind, Loaded};
use crate::gpu::{Access, Binding, Buffer, Gpu, Usage};
use sdfc_shaders::assemble::SceneFunction;
use sdfc_shaders::interpreter::{
    CODE_SLOT, Function, LENGTH_SLOT, Memory, POOL_SLOT, bindings, interpreter,
};
use sdfc_vm::encode::encode;
use sdfc_vm::library::Library;
use sdfc_vm::program::{Instruction, Module, Needs};

/// Constants that may be read behind the last one: an instruction's are loaded before it is known
/// how many it has.
const PADDING: usize = 4;

/// A scene's programs in an interpreter's buffers.
pub(super) struct Interpreter {
    /// What the kernels are made for.
    distance: Needs,
    surface: Option<Needs>,
    memory: Memory,
    /// The programs as they were loaded.
    loaded: [Vec<Instruction>; 2],
    buffers: Vec<(Binding, Buffer)>,
}

impl OnDevice for Interpreter {
    const KIND: EngineKind = EngineKind::Interp;

    fn load(gpu: &Gpu, scene: &Loaded<'_>, before: Option<Self>) -> Result<Self, EngineError> {
        let module = scene.module;
        let surface = module.surface.as_ref();
        let distance_needs = module.distance.needs();
        let surface_needs = surface.map(|program| program.needs());
        let loaded = [
            module.distance.code.clone(),
            surface.map(|p| p.code.clone()).unwrap_or_default(),
        ];
        let code = loaded.iter().map(Vec::len).sum();
        let pool = pool(module);
        let memory = Memory::for_program(code, pool.len());

        // Kernels that do for this scene are kept, whatever else they can do.
        let kept = before.filter(|before| {
            before.distance.cover(&distance_needs)
                && match (&before.surface, &surface_needs) {
                    (Some(have), Some(need)) => have.cover(need),
                    (None, None) => true,
                    _ => false,
                }
                && holds(before.memory, code, pool.len())
        });
        let (distance_needs, surface_needs, memory) = match kept {
            Some(before) => (before.distance, before.surface, before.memory),
            None => (distance_needs, surface_needs, memory),
        };

        let words = words(module);
        let (usage, access, code_size, pool_size) = match memory {
            Memory::Uniform { code, pool } => (
                Usage::Uniform,
                Access::Uniform,
                code as usize,
                pool as usize,
            ),
            Memory::Storage => (Usage::Storage, Access::StorageRead, code, pool.len()),
        };
        let [first, second] = loaded.each_ref().map(|code| code.len() as u32);
        let lengths = [first, first, first + second, 0];
        let buffer = |slot, label, usage, access, size: usize| {
            let buffer = gpu.buffer(label, usage, 16 * size as u64)?;
            Ok::<_, EngineError>((Binding { slot, access }, buffer))
        };
        let buffers = vec![
            buffer(CODE_SLOT, "code", usage, access, code_size)?,
            buffer(POOL_SLOT, "pool", usage, access, pool_size)?,
            buffer(
                LENGTH_SLOT,
                "program length",
                Usage::Uniform,
                Access::Uniform,
                1,
            )?,
        ];
        gpu.write(&buffers[0].1, &words)?;
        gpu.write(&buffers[1].1, &pool)?;
        gpu.write(&buffers[2].1, &lengths)?;
        Ok(Self {
            distance: distance_needs,
            surface: surface_needs,
            memory,
            loaded,
            buffers,
        })
    }

    fn update(&mut self, gpu: &Gpu, module: &Module, _: &[f64]) -> Result<(), EngineError> {
        let surface = module.surface.as_ref().map(|program| &program.code);
        let [distance_code, surface_code] = &self.loaded;
        let same = module.distance.code == *distance_code
            && surface.map_or(surface_code.is_empty(), |code| code == surface_code);
        if !same {
            return Err(EngineError::AnotherScene);
        }
        Ok(gpu.write(&self.buffers[1].1, &pool(module))?)
    }

    fn source(&self, functions: &[SceneFunction]) -> SceneText {
        let mut library = Library::default();
        let mut text = String::new();
        for function in functions {
            let (needs, function) = match function {
                SceneFunction::Distance => (&self.distance, Function::Distance),
                SceneFunction::Gradient => (&self.distance, Function::Gradient),
                SceneFunction::Surface => (
                    self.surface.as_ref().unwrap_or(&self.distance),
                    Function::Surface,
                ),
            };
            text.push_str(&interpreter(needs, function, &mut library));
            text.push('\n');
        }
        let (called, calls) = library.text();
        let unpainted = unpainted_surface(functions);
        SceneText {
            text: format!("{}\n{unpainted}{called}{text}", bindings(self.memory)),
            calls,
        }
    }

    fn buffers(&self) -> &[(Binding, Buffer)] {
        &self.buffers
    }

    fn iterations(&self, function: SceneFunction) -> usize {
        match function {
            SceneFunction::Distance | SceneFunction::Gradient => self.loaded[0].len(),
            SceneFunction::Surface => self.loaded[1].len(),
        }
    }
}

fn holds(memory: Memory, code: usize, pool: usize) -> bool {
    match memory {
        Memory::Uniform {
            code: most,
            pool: most_pool,
        } => code <= most as usize && pool <= most_pool as usize,
        Memory::Storage => true,
    }
}

/// The instructions of both programs, the second one's constants behind the first one's.
fn words(module: &Module) -> Vec<u32> {
    let mut words = encode(&module.distance.code);
    if let Some(surface) = &module.surface {
        let base = module.distance.pool.len() as u32;
        for (i, word) in encode(&surface.code).into_iter().enumerate() {
            // The first word of four is the instruction, the others are places in the pool.
            words.push(if i % 4 == 0 { word } else { word + base });
        }
    }
    words
}

/// The constants of both programs.
fn pool(module: &Module) -> Vec<[f32; 4]> {
    let mut pool = module.distance.pool.clone();
    pool.extend(module.surface.iter().flat_map(|program| &program.pool));
    pool.resize(pool.len() + PADDING, [0.0; 4]);
    pool
}
