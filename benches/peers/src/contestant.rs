//! Those that are compared: sdfc's engines and the peers, behind one trait.

mod fidget_cpu;
#[cfg(feature = "gpu")]
mod fidget_gpu;
pub(crate) mod ours;

use crate::model::Model;
use crate::picture::Picture;
use sdfc_runtime::engine::EngineKind;
use std::fmt;

pub(crate) use ours::Ours;

/// Draws one model at one size. Work is measured from outside: [`prepare`](Contestant::prepare) and
/// [`frame`](Contestant::frame) do nothing that a program that draws the model would not do.
pub(crate) trait Contestant {
    /// What it runs on.
    fn device(&self) -> String;

    /// From the model as a person writes it to whatever frames are made of.
    fn prepare(&mut self) -> Result<(), String>;

    /// From that to a picture, with everything that is built of the model for one picture.
    fn frame(&mut self) -> Result<(), String>;

    /// Another picture of the same model, with what the first one built if it keeps that; nothing
    /// where frames keep nothing.
    fn again(&mut self) -> Option<Result<(), String>> {
        None
    }

    /// The last picture, to be compared.
    fn picture(&self) -> Result<Picture, String>;
}

/// A peer.
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
    /// Its name.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Vm => "fidget-vm",
            Self::Jit => "fidget-jit",
            Self::Wgpu => "fidget-wgpu",
        }
    }

    /// Whether it runs on what this engine runs on.
    pub(crate) fn matches(self, engine: EngineKind) -> bool {
        (self == Self::Wgpu) == matches!(engine, EngineKind::Interp | EngineKind::Wgsl)
    }

    /// It, ready to draw a model at a size with so many threads.
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

/// What is said of a picture that was not drawn yet.
fn not_drawn() -> String {
    "nothing was drawn yet".to_owned()
}
