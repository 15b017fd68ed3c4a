//! Capture of wgpu's errors: scopes around every call, a handler for errors outside of scopes, and the record
//! of a lost device.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::GpuError;

/// Errors of a device that occurred outside of any call.
#[derive(Debug, Default)]
pub(super) struct ErrorTracker(Mutex<State>);

#[derive(Debug, Default)]
struct State {
    /// The reason, once the device is lost.
    lost: Option<String>,
    /// The first error outside of scopes, until a call reports it.
    uncaptured: Option<GpuError>,
}

impl ErrorTracker {
    /// Installs handlers on `device`. Without them, wgpu would panic.
    pub(super) fn watch(device: &wgpu::Device) -> Arc<Self> {
        let tracker = Arc::new(Self::default());
        let handler = Arc::clone(&tracker);
        device.set_device_lost_callback(move |reason, text| {
            let text = text.trim();
            if text.is_empty() {
                handler.mark_lost(&format!("{reason:?}").to_lowercase());
            } else {
                handler.mark_lost(text);
            }
        });
        let handler = Arc::clone(&tracker);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            handler.state().uncaptured.get_or_insert(error.into());
        }));
        tracker
    }

    /// Records that the device is lost; the first reason is kept.
    pub(super) fn mark_lost(&self, reason: &str) {
        self.state().lost.get_or_insert_with(|| reason.to_owned());
    }

    /// Fails if the device is lost, or if an error occurred outside of scopes since the last check.
    pub(super) fn check(&self) -> Result<(), GpuError> {
        let mut state = self.state();
        if let Some(reason) = &state.lost {
            return Err(GpuError::DeviceLost(reason.clone()));
        }
        state.uncaptured.take().map_or(Ok(()), Err)
    }

    /// Runs `call` and reports its errors. Scopes belong to a thread, so `call` must use the device on this
    /// one.
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
        // Outside of browsers these futures are ready immediately. Of several errors the one that caused the
        // others is reported: running out of memory leaves invalid objects behind.
        let validation = pollster::block_on(validation.pop());
        let memory = pollster::block_on(memory.pop());
        let internal = pollster::block_on(internal.pop());
        self.check()?;
        match memory.or(internal).or(validation) {
            Some(error) => Err(error.into()),
            None => Ok(result),
        }
    }

    /// Returns the state, also after a panic elsewhere: each field is set in one step.
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
