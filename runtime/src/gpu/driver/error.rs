//! Errors of a GPU, as one enum.

use std::time::Duration;

/// Reasons why a call on a [`Gpu`](super::Gpu) failed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GpuError {
    /// There is no adapter.
    #[error("no GPU was found, nor a software Vulkan driver (such as mesa-vulkan-drivers)")]
    NoAdapter,
    /// Hardware is required, but there is none.
    #[error("no hardware GPU was found, only the software driver {name}")]
    OnlySoftware {
        /// The available software adapter.
        name: String,
    },
    /// The adapter exists but provides no device.
    #[error("the GPU {name} could not be opened: {text}")]
    DeviceRequest {
        /// The adapter's name.
        name: String,
        /// The driver's reason.
        text: String,
    },
    /// Strict arithmetic is required, but the device does not round to the nearest number.
    #[error("the GPU {name} rounds by rules of its own, so nothing is strict on it: {found}")]
    Inexact {
        /// The adapter's name.
        name: String,
        /// The operations that are wrong, with an example each.
        found: String,
    },
    /// The device has no memory left for the call.
    #[error("the GPU is out of memory: {0}")]
    OutOfMemory(String),
    /// The call broke one of WebGPU's rules: a bug in the calling code.
    #[error("the GPU refused a call: {0}")]
    Validation(String),
    /// The driver or wgpu failed internally.
    #[error("the GPU driver failed: {0}")]
    Internal(String),
    /// The device is lost with all its contents.
    #[error("the GPU was lost: {0}")]
    DeviceLost(String),
    /// The device did not respond in time.
    #[error("the GPU did not finish within {after:?}: {what}")]
    Timeout {
        /// The operation that was waited for.
        what: String,
        /// The time limit that was exceeded.
        after: Duration,
    },
    /// A request exceeds a limit of the device.
    #[error("{what} is {need}, at most {have} is allowed")]
    LimitExceeded {
        /// The limited quantity, with its unit.
        what: String,
        /// The requested value.
        need: u64,
        /// The device's maximum, in the same unit.
        have: u64,
    },
    /// The WGSL does not compile. The text contains the position.
    #[error("the kernel {label} does not compile:\n{text}")]
    Shader {
        /// The kernel's label.
        label: String,
        /// The compiler's message with an excerpt of the source.
        text: String,
    },
}

impl From<wgpu::Error> for GpuError {
    fn from(error: wgpu::Error) -> Self {
        match error {
            wgpu::Error::OutOfMemory { source } => Self::OutOfMemory(source.to_string()),
            wgpu::Error::Validation { description, .. } => Self::Validation(one_line(&description)),
            wgpu::Error::Internal { description, .. } => Self::Internal(one_line(&description)),
        }
    }
}

/// Fails unless `need <= have`.
pub(super) fn within(what: impl Into<String>, need: u64, have: u64) -> Result<(), GpuError> {
    if need <= have {
        return Ok(());
    }
    Err(GpuError::LimitExceeded {
        what: what.into(),
        need,
        have,
    })
}

/// Returns the message of a caught panic.
pub(super) fn panic_text(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| panic.downcast_ref::<&str>().copied());
    one_line(text.unwrap_or("the driver layer panicked"))
}

/// Joins the chain of causes that wgpu prints as an indented list under a heading into one line.
fn one_line(text: &str) -> String {
    let causes = text
        .split_once("Caused by:")
        .map_or(text, |(_, remainder)| remainder);
    let lines = causes.lines().map(str::trim).filter(|l| !l.is_empty());
    lines.collect::<Vec<_>>().join(": ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_the_layer_below_keep_their_kind() {
        let source = || Box::new(std::io::Error::other("it is full")) as _;
        let full = wgpu::Error::OutOfMemory { source: source() };
        let expected = GpuError::OutOfMemory("it is full".to_owned());
        assert_eq!(GpuError::from(full), expected);
        let description = "In a call\n\nCaused by:\n  one thing\n    another".to_owned();
        let refused = wgpu::Error::Validation {
            source: source(),
            description: description.clone(),
        };
        let expected = GpuError::Validation("one thing: another".to_owned());
        assert_eq!(GpuError::from(refused), expected);
        let failed = wgpu::Error::Internal {
            source: source(),
            description,
        };
        let expected = GpuError::Internal("one thing: another".to_owned());
        assert_eq!(GpuError::from(failed), expected);
    }
}
