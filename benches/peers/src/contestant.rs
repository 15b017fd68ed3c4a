//! The compared renderers: sdfc's engines and the peers, behind one trait.

mod fidget_cpu;
#[cfg(feature = "gpu")]
mod fidget_gpu;
pub(crate) mod sdfc;

use crate::model::Model;
use crate::picture::ComparedImage;
use sdfc_runtime::engine::EngineKind;
use std::fmt;

pub(crate) use sdfc::SdfcEngine;

/// A renderer that draws one model at one size.
///
/// Times are measured from outside. [`prepare`](Contestant::prepare) and [`frame`](Contestant::frame) only
/// do work that any program that draws the model requires.
pub(crate) trait Contestant {
    /// Returns the device that it runs on.
    fn device(&self) -> String;

    /// Compiles the model from its source to the input of frames.
    fn prepare(&mut self) -> Result<(), String>;

    /// Draws a picture, including everything that is built from the model for one picture.
    fn frame(&mut self) -> Result<(), String>;

    /// Draws another picture of the same model with data kept from the first. Returns `None` if frames keep
    /// no data.
    fn redraw(&mut self) -> Option<Result<(), String>> {
        None
    }

    /// Returns the last picture for comparison.
    fn picture(&self) -> Result<ComparedImage, String>;
}

/// A renderer to compare with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Peer {
    /// Fidget's interpreter, on the CPU.
    #[value(name = "fidget-vm")]
    Vm,
    /// Fidget's just-in-time compiler, on the CPU.
    #[value(name = "fidget-jit")]
    Jit,
    /// Fidget on a GPU.
    #[value(name = "fidget-wgpu")]
    Wgpu,
}

impl Peer {
    /// Returns its name.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Vm => "fidget-vm",
            Self::Jit => "fidget-jit",
            Self::Wgpu => "fidget-wgpu",
        }
    }

    /// Reports whether it runs on the same kind of device as the engine.
    pub(crate) fn matches(self, engine: EngineKind) -> bool {
        (self == Self::Wgpu) == matches!(engine, EngineKind::Interp | EngineKind::Wgsl)
    }

    /// Opens the peer for a model at a size, with this number of threads.
    pub(crate) fn open<'a>(
        self,
        model: &'a Model,
        size: u32,
        threads: usize,
    ) -> Result<Box<dyn Contestant + 'a>, String> {
        match self {
            Self::Vm => fidget_cpu::open::<fidget::vm::VmFunction>(model, size, threads),
            Self::Jit => fidget_cpu::open::<fidget::jit::JitFunction>(model, size, threads),
            #[cfg(feature = "gpu")]
            Self::Wgpu => fidget_gpu::open(model, size),
            #[cfg(not(feature = "gpu"))]
            Self::Wgpu => {
                Err("fidget-wgpu is left out of this build: build with `--features gpu`".to_owned())
            }
        }
    }
}

impl fmt::Display for Peer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Returns the message for a picture that was not drawn yet.
fn not_drawn() -> String {
    "nothing was drawn yet".to_owned()
}
