//! Bind groups: the buffers of a kernel.

use super::{Buffer, Gpu, GpuError, Kernel};

/// A kernel with a buffer in each of its slots. Cheap to clone; it keeps the buffers alive.
#[derive(Clone, Debug)]
pub struct BoundKernel {
    pub(super) kernel: Kernel,
    pub(super) group: wgpu::BindGroup,
}

impl Gpu {
    /// Binds buffers to a kernel's slots. A slot without a buffer, or a buffer of the wrong usage, is
    /// [`GpuError::Validation`].
    pub fn bind(
        &self,
        kernel: &Kernel,
        buffers: &[(u32, &Buffer)],
    ) -> Result<BoundKernel, GpuError> {
        let entries: Vec<_> = buffers
            .iter()
            .map(|(slot, buffer)| wgpu::BindGroupEntry {
                binding: *slot,
                resource: buffer.raw.as_entire_binding(),
            })
            .collect();
        let group = self.error_tracker.scoped(&self.device, || {
            self.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(kernel.label()),
                layout: &kernel.layout,
                entries: &entries,
            })
        })?;
        Ok(BoundKernel {
            kernel: kernel.clone(),
            group,
        })
    }
}
