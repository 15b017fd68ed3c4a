//! Software rounding: functions that round quotients and square roots to the nearest float, for devices that
//! round them by rules of their own. Vulkan lets a quotient be 2.5 units in the last place off, and NVIDIA's
//! drivers make use of it. [`super::rewriter`] inserts calls of these functions.
//!
//! The device's own result may be at most six units in the last place off. Two's complement differences of
//! products of significands correct it exactly; IEEE 754 defines the result.

use naga::{Function, Handle, Module};

/// The functions, in WGSL.
const TEXT: &str = include_str!("rounding.wgsl");

/// The rounding functions of a module.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct RoundingFunctions {
    /// Maps two numbers to their quotient.
    pub(super) quotient: Handle<Function>,
    /// Maps a number to its square root.
    pub(super) root: Handle<Function>,
}

impl RoundingFunctions {
    /// Returns the functions of a module whose text came from [`with_functions`].
    pub(in super::super) fn find(module: &Module) -> Option<Self> {
        let named = |name: &str| {
            let mut functions = module.functions.iter();
            functions
                .find(|(_, function)| function.name.as_deref() == Some(name))
                .map(|(handle, _)| handle)
        };
        Some(Self {
            quotient: named("sdfc_nearest_quotient")?,
            root: named("sdfc_nearest_root")?,
        })
    }

    /// Reports whether a function is one of them.
    pub(super) fn contains(self, function: Handle<Function>) -> bool {
        [self.quotient, self.root].contains(&function)
    }
}

/// Returns a kernel's text with the rounding functions. They come first, since a module lists functions before
/// those that call them.
pub(in super::super) fn with_functions(wgsl: &str) -> String {
    format!("{TEXT}{wgsl}")
}

#[cfg(test)]
mod tests;
