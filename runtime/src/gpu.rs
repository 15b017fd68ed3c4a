//! Pictures on a GPU: a small typed layer over wgpu for compute, and the engines on it.
//!
//! The layer (`driver`) opens a device, compiles kernels, fills buffers, dispatches and reads back. Both
//! engines (`engine`) share the stages of a render and of a query. They differ in the form of the scene:
//! programs in buffers (`interp`) or generated source (`wgsl`).
//!
//! Guarantees of the layer:
//! - **Nothing panics.** Every call runs inside error scopes, a lost device is recorded, and every wgpu error
//!   becomes a [`GpuError`]. After a refused call the [`Gpu`] stays usable; after [`GpuError::DeviceLost`]
//!   and [`GpuError::Timeout`] it does not.
//! - **No wait is endless.** Waits end after [`Gpu::timeout`] with [`GpuError::Timeout`]. (Compiling a
//!   pipeline is a call into the driver and cannot be interrupted.)
//! - **Limits are the device's own**, not WebGPU's defaults. Exceeding one is reported with both numbers
//!   before wgpu is called.
//! - **Arithmetic may be strict** ([`Arithmetic::Strict`]): every kernel then produces the bits that `f32`
//!   produces in Rust, or the device is not opened.
//! - **Pipelines are counted** ([`Gpu::pipelines_created`]), so that a test can check that an edit of a scene
//!   creates none.
//!
//! ```no_run
//! use sdfc_runtime::gpu::{
//!     AdapterPreference, BindingAccess, BufferBinding, BufferUsage, Extent, Gpu, GpuError, KernelSource,
//! };
//! # fn main() -> Result<(), GpuError> {
//! let gpu = Gpu::open(AdapterPreference::Any)?;
//! let double = gpu.kernel(&KernelSource {
//!     label: "double",
//!     wgsl: "@group(0) @binding(0) var<storage, read_write> v: array<f32>;
//!            @compute @workgroup_size(64)
//!            fn main(@builtin(global_invocation_id) id: vec3u) {
//!                if id.x < arrayLength(&v) { v[id.x] = 2.0 * v[id.x]; }
//!            }",
//!     entry: "main",
//!     bindings: &[BufferBinding { slot: 0, access: BindingAccess::StorageReadWrite }],
//!     as_written: false,
//! })?;
//! let values = gpu.buffer_with("values", BufferUsage::Storage, &[1.0f32, 2.0, 3.0])?;
//! let call = gpu.bind(&double, &[(0, &values)])?;
//! let mut batch = gpu.batch();
//! batch.dispatch(&call, Extent::Line(3))?;
//! batch.submit_and_wait()?;
//! assert_eq!(gpu.read::<f32>(&values)?, [2.0, 4.0, 6.0]);
//! # Ok(())
//! # }
//! ```
//!
//! One line can appear on stderr that a library cannot prevent: Mesa's device-selection layer complains when
//! `XDG_RUNTIME_DIR` is not set. A program silences it by setting that variable, or `NODEVICE_SELECT=1`, at
//! the start of `main` before any thread exists; `test.sh` sets the first.

mod cell_builder;
mod driver;
pub(crate) mod engine;
mod interp;
mod kernel_cache;
mod query;
mod render;
mod runner;
mod scene;
mod tiles;
mod warm_up;
mod wgsl;
mod work_budget;

pub use driver::{
    AdapterPreference, Arithmetic, Batch, BindingAccess, BoundKernel, Buffer, BufferBinding,
    BufferUsage, DeviceInfo, DeviceKind, DeviceLimits, Extent, Gpu, GpuError, Kernel, KernelSource,
    Submission, devices,
};
