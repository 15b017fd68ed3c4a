//! A small typed layer over wgpu for compute: open a device, compile a kernel, fill buffers,
//! dispatch, read back.
//!
//! What it promises:
//! - **Nothing panics.** Every call runs inside error scopes, a lost device is remembered, and
//!   whatever wgpu reports becomes a [`GpuError`]. After a refused call the [`Gpu`] stays usable;
//!   after [`GpuError::DeviceLost`] and [`GpuError::Timeout`] it does not.
//! - **No wait is endless.** Waits end after [`Gpu::timeout`] with [`GpuError::Timeout`].
//!   (Compiling a pipeline is a call into the driver and cannot be interrupted.)
//! - **Limits are the device's own**, not WebGPU's defaults, and passing one is reported with both
//!   numbers before wgpu is asked.
//! - **Arithmetic may be strict** ([`Arithmetic::Strict`]): every kernel then gives the bits that
//!   `f32` gives in Rust, or the device is not opened.
//! - **Pipelines are counted** ([`Gpu::pipelines_created`]), so that a test can hold that an edit
//!   of a scene makes none.
//!
//! ```no_run
//! use sdfc_runtime::gpu::{Access, Binding, Extent, Gpu, GpuError, KernelSource, Preference, Usage};
//! # fn main() -> Result<(), GpuError> {
//! let gpu = Gpu::open(Preference::Any)?;
//! let double = gpu.kernel(&KernelSource {
//!     label: "double",
//!     wgsl: "@group(0) @binding(0) var<storage, read_write> v: array<f32>;
//!            @compute @workgroup_size(64)
//!            fn main(@builtin(global_invocation_id) id: vec3u) {
//!                if id.x < arrayLength(&v) { v[id.x] = 2.0 * v[id.x]; }
//!            }",
//!     entry: "main",
//!     bindings: &[Binding { slot: 0, access: Access::StorageReadWrite }],
//! })?;
//! let values = gpu.buffer_with("values", Usage::Storage, &[1.0f32, 2.0, 3.0])?;
//! let call = gpu.bind(&double, &[(0, &values)])?;
//! let mut batch = gpu.batch();
//! batch.dispatch(&call, Extent::Line(3))?;
//! batch.submit_and_wait()?;
//! assert_eq!(gpu.read::<f32>(&values)?, [2.0, 4.0, 6.0]);
//! # Ok(())
//! # }
//! ```
//!
//! One line can appear on stderr that no library may prevent: Mesa's device-selection layer
//! complains when `XDG_RUNTIME_DIR` is not set. A program silences it by setting that variable, or
//! `NODEVICE_SELECT=1`, at the start of `main` before any thread exists; `test.sh` sets the first.

mod batch;
mod buffer;
mod device;
mod error;
mod faults;
mod kernel;
mod strict;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

pub use batch::{Batch, Extent, Submission};
pub use buffer::{Buffer, Usage};
pub use device::{DeviceInfo, DeviceKind, Limits, devices};
pub use error::GpuError;
pub use kernel::{Access, Binding, BoundKernel, Kernel, KernelSource};

use faults::Faults;

/// Which adapters [`Gpu::open`] may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preference {
    /// Hardware if there is any, else software Vulkan.
    Any,
    /// Hardware only.
    Hardware,
}

/// What kernels may do to arithmetic on floats.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Arithmetic {
    /// What WGSL allows: drivers may fuse a product with a sum, reorder sums, and divide by
    /// multiplying. Results differ by roundings from device to device and from kernel to kernel.
    #[default]
    Default,
    /// Every operation as it is written, rounded to the nearest number: the same bits on every
    /// device and in every kernel, which are those of `f32` in Rust, as long as no number is
    /// denormal. Takes a device that rounds so. Vulkan is told by decorations, which cost nothing;
    /// what is reached otherwise is opened as [`Arithmetic::Portable`].
    Strict,
    /// The same promise, kept by hiding from the driver what it could rewrite: on every interface, and
    /// slower.
    Portable,
}

impl Arithmetic {
    /// Whether the bits are the same on every device.
    pub fn is_strict(self) -> bool {
        match self {
            Self::Default => false,
            Self::Strict | Self::Portable => true,
        }
    }
}

/// An open device and its queue. Shared by reference; it may be used from several threads.
pub struct Gpu {
    /// The longest that one wait may take before it ends in [`GpuError::Timeout`].
    pub timeout: Duration,
    device: wgpu::Device,
    queue: wgpu::Queue,
    info: DeviceInfo,
    arithmetic: Arithmetic,
    faults: Arc<Faults>,
    pipelines: AtomicU64,
    /// Set when a wait ran out: the queue may never answer, see `Drop`.
    stuck: AtomicBool,
}

impl Gpu {
    /// The timeout a device is opened with. A software driver compiles a kernel at its first
    /// dispatch, inside the wait; a thousand primitives take it some four seconds.
    pub const DEFAULT_TIMEOUT: Duration = Duration::from_secs(10);

    /// Opens the first adapter that `preference` allows and that gives a device, in the order of
    /// [`devices`].
    pub fn open(preference: Preference) -> Result<Self, GpuError> {
        Self::open_with(preference, Arithmetic::Default)
    }

    /// The same with arithmetic that is strict or not. An adapter that rounds by rules of its own
    /// cannot be strict and is passed over; if there is no other, the error is [`GpuError::Inexact`].
    pub fn open_with(preference: Preference, arithmetic: Arithmetic) -> Result<Self, GpuError> {
        Self::open_first(preference, arithmetic, |limits| limits)
    }

    /// The same, as a device with lower limits: `limited` gets those of the adapter and gives those
    /// that are kept, of which none may be higher. This is how a test rehearses a small device.
    pub fn open_within(
        preference: Preference,
        limited: impl Fn(Limits) -> Limits,
    ) -> Result<Self, GpuError> {
        Self::open_first(preference, Arithmetic::Default, limited)
    }

    fn open_first(
        preference: Preference,
        arithmetic: Arithmetic,
        limited: impl Fn(Limits) -> Limits,
    ) -> Result<Self, GpuError> {
        let adapters = device::adapters();
        let software = adapters.first().map(|(info, _)| info.name.clone());
        let mut refused = match (preference, software) {
            (_, None) => GpuError::NoAdapter,
            (_, Some(name)) => GpuError::OnlySoftware { name },
        };
        for (mut info, adapter) in adapters {
            info.limits = limited(info.limits);
            let wanted = match preference {
                Preference::Any => true,
                Preference::Hardware => info.kind != DeviceKind::Software,
            };
            if !wanted {
                continue;
            }
            match Self::request(info, &adapter, arithmetic) {
                Ok(gpu) => return Ok(gpu),
                Err(error) => refused = error,
            }
        }
        Err(refused)
    }

    fn request(
        info: DeviceInfo,
        adapter: &wgpu::Adapter,
        arithmetic: Arithmetic,
    ) -> Result<Self, GpuError> {
        // Other interfaces pass shaders on too, but in languages that cannot say what SPIR-V can.
        let passes_on = adapter.get_info().backend == wgpu::Backend::Vulkan
            && adapter
                .features()
                .contains(wgpu::Features::PASSTHROUGH_SHADERS);
        let arithmetic = match arithmetic {
            Arithmetic::Strict if !passes_on => Arithmetic::Portable,
            other => other,
        };
        let required_features = match arithmetic {
            Arithmetic::Default | Arithmetic::Portable => wgpu::Features::empty(),
            Arithmetic::Strict => wgpu::Features::PASSTHROUGH_SHADERS,
        };
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("sdfc"),
            required_features,
            required_limits: info.limits.lowering(adapter.limits()),
            ..Default::default()
        };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&descriptor)).map_err(|error| {
                GpuError::DeviceRequest {
                    name: info.name.clone(),
                    text: error.to_string(),
                }
            })?;
        let faults = Faults::watch(&device);
        let gpu = Self {
            timeout: Self::DEFAULT_TIMEOUT,
            device,
            queue,
            info,
            arithmetic,
            faults,
            pipelines: AtomicU64::new(0),
            stuck: AtomicBool::new(false),
        };
        if arithmetic.is_strict() {
            strict::conformance::check(&gpu)?;
            // What tries a device is no kernel of anybody's.
            gpu.pipelines.store(0, Ordering::Relaxed);
        }
        Ok(gpu)
    }

    /// The adapter behind this device.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// What kernels may do to arithmetic on floats, and of the two strict forms the one that they
    /// have.
    pub fn arithmetic(&self) -> Arithmetic {
        self.arithmetic
    }

    /// How many pipelines were compiled so far.
    pub fn pipelines_created(&self) -> u64 {
        self.pipelines.load(Ordering::Relaxed)
    }

    /// Gives the device up: every later call is [`GpuError::DeviceLost`]. This is how a test
    /// rehearses the loss of a device.
    pub fn destroy(&self) {
        self.destroyer()();
    }

    /// What does the same from anywhere, also while the device is at work.
    pub fn destroyer(&self) -> impl Fn() + Send + Sync + use<> {
        let (device, faults) = (self.device.clone(), Arc::clone(&self.faults));
        move || {
            faults.lose("it was destroyed");
            device.destroy();
        }
    }

    /// Waits until `submission` is done; `what` names the wait in the errors.
    fn wait_for(&self, what: &str, submission: wgpu::SubmissionIndex) -> Result<(), GpuError> {
        self.faults.check()?;
        let poll = || {
            self.device.poll(wgpu::PollType::Wait {
                submission_index: Some(submission),
                timeout: Some(self.timeout),
            })
        };
        // `Device::poll` is the one call that panics when the driver reports a loss. wgpu has
        // released its locks and told the lost callback by then, so unwinding to here is sound.
        let polled = std::panic::catch_unwind(std::panic::AssertUnwindSafe(poll));
        self.faults.check()?;
        match polled {
            Ok(Ok(_)) => Ok(()),
            Ok(Err(wgpu::PollError::Timeout)) => {
                self.stuck.store(true, Ordering::Relaxed);
                Err(GpuError::Timeout {
                    what: what.to_owned(),
                    after: self.timeout,
                })
            }
            Ok(Err(error @ wgpu::PollError::WrongSubmissionIndex(..))) => {
                Err(GpuError::Internal(format!("{what}: {error}")))
            }
            Err(panic) => {
                let text = error::panic_text(panic.as_ref());
                self.faults.lose(&text);
                Err(GpuError::DeviceLost(text))
            }
        }
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        // Dropping the last handle of a queue waits, without a limit, until it is idle. A queue
        // that did not answer in time is leaked instead.
        if *self.stuck.get_mut() {
            std::mem::forget(self.queue.clone());
        }
    }
}

impl std::fmt::Debug for Gpu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Gpu")
            .field("info", &self.info)
            .field("timeout", &self.timeout)
            .finish_non_exhaustive()
    }
}
