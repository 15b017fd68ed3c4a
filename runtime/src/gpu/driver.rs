//! Devices, their buffers and kernels: the layer over wgpu. [`crate::gpu`] states its guarantees.

mod batch;
mod bind_group;
mod buffer;
mod device;
mod error;
mod error_tracker;
mod kernel;
mod strict;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

pub use batch::{Batch, Extent, Submission};
pub use bind_group::BoundKernel;
pub use buffer::{Buffer, BufferUsage};
pub use device::{DeviceInfo, DeviceKind, DeviceLimits, devices};
pub use error::GpuError;
pub use kernel::{BindingAccess, BufferBinding, Kernel, KernelSource};

use error_tracker::ErrorTracker;

/// The adapters that [`Gpu::open`] may select.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AdapterPreference {
    /// Hardware if there is any, else software Vulkan.
    Any,
    /// Hardware only; software Vulkan is an error.
    Hardware,
}

/// Rules for float arithmetic in kernels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Arithmetic {
    /// WGSL's rules: drivers may fuse a product with a sum, reorder sums, and divide by multiplying. Results
    /// differ by roundings between devices and between kernels.
    #[default]
    Default,
    /// Every operation as written, rounded to the nearest number. As long as no number is denormal, the bits
    /// are the same on every device and in every kernel. They equal those of `f32` in Rust. Requires a device
    /// that rounds sums and products this way. Where it rounds quotients and roots otherwise, kernels compute
    /// them with integers. Vulkan gets decorations; other backends are opened as [`Arithmetic::Portable`].
    Strict,
    /// [`Arithmetic::Strict`] on every backend, by hiding from the driver what it could rewrite. Slower.
    Portable,
}

impl Arithmetic {
    /// Reports whether the bits are the same on every device.
    pub fn is_strict(self) -> bool {
        match self {
            Self::Default => false,
            Self::Strict | Self::Portable => true,
        }
    }
}

/// The place where strict kernels round quotients and square roots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rounding {
    /// The device rounds them to the nearest float.
    Device,
    /// Integers do; the device comes only near.
    Software,
}

/// An open device and its queue. Shared by reference; may be used from several threads.
pub struct Gpu {
    /// Maximum duration of a wait before it ends in [`GpuError::Timeout`].
    pub timeout: Duration,
    device: wgpu::Device,
    queue: wgpu::Queue,
    info: DeviceInfo,
    arithmetic: Arithmetic,
    /// Set if kernels may be SPIR-V.
    has_passthrough: bool,
    rounding: Rounding,
    error_tracker: Arc<ErrorTracker>,
    pipelines: AtomicU64,
    /// A buffer for copies from the device, kept between reads.
    staging: Mutex<Option<wgpu::Buffer>>,
    /// Set when a wait timed out: the queue may never respond, see `Drop`.
    is_unresponsive: AtomicBool,
}

impl Gpu {
    /// The initial timeout. A software driver compiles a kernel at its first dispatch, inside the wait; a
    /// thousand primitives take about four seconds.
    pub const DEFAULT_TIMEOUT: Duration = Duration::from_secs(10);

    /// Opens the first adapter that `preference` allows and that provides a device, in the order of
    /// [`devices`].
    pub fn open(preference: AdapterPreference) -> Result<Self, GpuError> {
        Self::open_with(preference, Arithmetic::Default)
    }

    /// Opens a device like [`Gpu::open`], with strict or default arithmetic. An adapter that rounds differently
    /// cannot be strict and is skipped; if there is no other, the error is [`GpuError::Inexact`].
    pub fn open_with(
        preference: AdapterPreference,
        arithmetic: Arithmetic,
    ) -> Result<Self, GpuError> {
        Self::open_first(preference, arithmetic, |limits| limits)
    }

    /// Opens a device with lower limits. `adjust_limits` maps the adapter's limits to those of the device,
    /// none of which may be higher. Tests use it to simulate a small device.
    pub fn open_with_limits(
        preference: AdapterPreference,
        adjust_limits: impl Fn(DeviceLimits) -> DeviceLimits,
    ) -> Result<Self, GpuError> {
        Self::open_first(preference, Arithmetic::Default, adjust_limits)
    }

    fn open_first(
        preference: AdapterPreference,
        arithmetic: Arithmetic,
        adjust_limits: impl Fn(DeviceLimits) -> DeviceLimits,
    ) -> Result<Self, GpuError> {
        let adapters = device::adapters();
        let software = adapters.first().map(|(info, _)| info.name.clone());
        let mut last_error = match (preference, software) {
            (_, None) => GpuError::NoAdapter,
            (_, Some(name)) => GpuError::OnlySoftware { name },
        };
        for (mut info, adapter) in adapters {
            info.limits = adjust_limits(info.limits);
            let is_allowed = match preference {
                AdapterPreference::Any => true,
                AdapterPreference::Hardware => info.kind != DeviceKind::Software,
            };
            if !is_allowed {
                continue;
            }
            match Self::request(info, &adapter, arithmetic) {
                Ok(gpu) => return Ok(gpu),
                Err(error) => last_error = error,
            }
        }
        Err(last_error)
    }

    fn request(
        info: DeviceInfo,
        adapter: &wgpu::Adapter,
        arithmetic: Arithmetic,
    ) -> Result<Self, GpuError> {
        // Other backends also support passthrough, but in languages without decorations.
        let has_passthrough = adapter.get_info().backend == wgpu::Backend::Vulkan
            && adapter
                .features()
                .contains(wgpu::Features::PASSTHROUGH_SHADERS);
        let arithmetic = match arithmetic {
            Arithmetic::Strict if !has_passthrough => Arithmetic::Portable,
            requested => requested,
        };
        // With default arithmetic, some kernels need it ([`KernelSource::as_written`]).
        let required_features = match arithmetic {
            Arithmetic::Default | Arithmetic::Strict if has_passthrough => {
                wgpu::Features::PASSTHROUGH_SHADERS
            }
            _ => wgpu::Features::empty(),
        };
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("sdfc"),
            required_features,
            required_limits: info.limits.apply_to(adapter.limits()),
            ..Default::default()
        };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&descriptor)).map_err(|error| {
                GpuError::DeviceRequest {
                    name: info.name.clone(),
                    text: error.to_string(),
                }
            })?;
        let error_tracker = ErrorTracker::watch(&device);
        let mut gpu = Self {
            timeout: Self::DEFAULT_TIMEOUT,
            device,
            queue,
            info,
            arithmetic,
            has_passthrough,
            rounding: Rounding::Device,
            error_tracker,
            pipelines: AtomicU64::new(0),
            staging: Mutex::new(None),
            is_unresponsive: AtomicBool::new(false),
        };
        if arithmetic.is_strict() {
            match strict::conformance::check(&gpu) {
                Err(GpuError::Inexact { .. }) => {
                    gpu.rounding = Rounding::Software;
                    strict::conformance::check(&gpu)?;
                }
                result => result?,
            }
            // The kernels of the conformance check are not counted.
            gpu.pipelines.store(0, Ordering::Relaxed);
        }
        Ok(gpu)
    }

    /// Returns the adapter of this device.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// Returns the rules for float arithmetic in kernels, with the form of strict arithmetic in use.
    pub fn arithmetic(&self) -> Arithmetic {
        self.arithmetic
    }

    /// Returns the number of pipelines compiled so far.
    pub fn pipelines_created(&self) -> u64 {
        self.pipelines.load(Ordering::Relaxed)
    }

    /// Destroys the device: every later call returns [`GpuError::DeviceLost`]. Tests use it to simulate the
    /// loss of a device.
    pub fn destroy(&self) {
        self.destroyer()();
    }

    /// Returns a function that destroys the device from any thread, also while the device is working.
    pub fn destroyer(&self) -> impl Fn() + Send + Sync + use<> {
        let (device, error_tracker) = (self.device.clone(), Arc::clone(&self.error_tracker));
        move || {
            error_tracker.mark_lost("it was destroyed");
            device.destroy();
        }
    }

    /// Waits until `submission` is done; `what` names the wait in errors.
    fn wait_for(&self, what: &str, submission: wgpu::SubmissionIndex) -> Result<(), GpuError> {
        self.error_tracker.check()?;
        let poll = || {
            self.device.poll(wgpu::PollType::Wait {
                submission_index: Some(submission),
                timeout: Some(self.timeout),
            })
        };
        // `Device::poll` is the one call that panics when the driver reports a loss. By then wgpu has
        // released its locks and called the lost callback, so unwinding to here is sound.
        let polled = std::panic::catch_unwind(std::panic::AssertUnwindSafe(poll));
        self.error_tracker.check()?;
        match polled {
            Ok(Ok(_)) => Ok(()),
            Ok(Err(wgpu::PollError::Timeout)) => {
                self.is_unresponsive.store(true, Ordering::Relaxed);
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
                self.error_tracker.mark_lost(&text);
                Err(GpuError::DeviceLost(text))
            }
        }
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        // Dropping the last handle of a queue waits until it is idle, without a limit. A queue that did not
        // respond in time is leaked instead.
        if *self.is_unresponsive.get_mut() {
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
