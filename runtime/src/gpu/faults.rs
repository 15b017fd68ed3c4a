//! How wgpu's errors are caught: scopes around every call, a handler for what no scope saw, and
//! the memory of a lost device.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::GpuError;

/// What has gone wrong with a device outside of any call.
#[derive(Debug, Default)]
pub(super) struct Faults(Mutex<State>);

#[derive(Debug, Default)]
struct State {
    /// Why the device is gone, once it is.
    lost: Option<String>,
    /// The first error that no scope caught, until a call reports it.
    stray: Option<GpuError>,
}

impl Faults {
    /// Starts to listen to `device`. Without the handlers set here, wgpu would panic.
    pub(super) fn watch(device: &wgpu::Device) -> Arc<Self> {
        let faults = Arc::new(Self::default());
        let listener = Arc::clone(&faults);
        device.set_device_lost_callback(move |reason, text| {
            let text = text.trim();
            if text.is_empty() {
                listener.lose(&format!("{reason:?}").to_lowercase());
            } else {
                listener.lose(text);
            }
        });
        let listener = Arc::clone(&faults);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            listener.state().stray.get_or_insert(error.into());
        }));
        faults
    }

    /// Remembers that the device is gone; the first reason stays.
    pub(super) fn lose(&self, why: &str) {
        self.state().lost.get_or_insert_with(|| why.to_owned());
    }

    /// Fails if the device is lost, or if an error happened since the last check that no scope
    /// caught.
    pub(super) fn check(&self) -> Result<(), GpuError> {
        let mut state = self.state();
        if let Some(why) = &state.lost {
            return Err(GpuError::DeviceLost(why.clone()));
        }
        state.stray.take().map_or(Ok(()), Err)
    }

    /// Runs `call` and reports what went wrong in it. Scopes belong to a thread, so `call` must
    /// talk to the device on this one.
    pub(super) fn scoped<R>(
        &self,
        device: &wgpu::Device,
        call: impl FnOnce() -> R,
    ) -> Result<R, GpuError> {
        self.check()?;
        let internal = device.push_error_scope(wgpu::ErrorFilter::Internal);
        let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let result = call();
        // Off the web these futures are ready when they are made. Of several errors the one that
        // caused the others is reported: want of memory leaves invalid objects behind.
        let validation = pollster::block_on(validation.pop());
        let memory = pollster::block_on(memory.pop());
        let internal = pollster::block_on(internal.pop());
        self.check()?;
        match memory.or(internal).or(validation) {
            Some(error) => Err(error.into()),
            None => Ok(result),
        }
    }

    /// The state, also after a panic elsewhere: each field is set in one step.
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
