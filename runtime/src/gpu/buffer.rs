//! Buffers on the device, written and read as slices of plain data.

use std::borrow::Cow;

use bytemuck::{NoUninit, Pod};

use super::error::within;
use super::{Gpu, GpuError};

/// What a buffer is bound as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Usage {
    /// Small and read-only in kernels; at least 64 KiB are allowed everywhere.
    Uniform,
    /// The same, where some kernels declare it as storage.
    UniformOrStorage,
    /// Anything else.
    Storage,
    /// The arguments of an indirect dispatch, which a kernel writes as storage.
    Arguments,
}

/// Memory on the device. It can be bound, written and read; its content starts as zeros.
/// Cheap to clone: a clone is the same memory.
#[derive(Clone, Debug)]
pub struct Buffer {
    label: String,
    size: u64,
    pub(super) raw: wgpu::Buffer,
}

impl Buffer {
    /// Its size in bytes.
    pub fn size(&self) -> u64 {
        self.size
    }
}

impl Gpu {
    /// Makes a buffer of `size` bytes, rounded up to whole words and to one word at least.
    pub fn buffer(&self, label: &str, usage: Usage, size: u64) -> Result<Buffer, GpuError> {
        let limits = self.info.limits;
        let (binding, raw_usage) = match usage {
            Usage::Uniform => (limits.uniform_binding, wgpu::BufferUsages::UNIFORM),
            Usage::UniformOrStorage => (
                limits.uniform_binding.min(limits.storage_binding),
                wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::STORAGE,
            ),
            Usage::Storage => (limits.storage_binding, wgpu::BufferUsages::STORAGE),
            Usage::Arguments => (
                limits.storage_binding,
                wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDIRECT,
            ),
        };
        let what = format!("the size of buffer `{label}` in bytes");
        within(what, size, binding.min(limits.buffer))?;
        let size = size.max(1).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT);
        let raw = self.raw_buffer(
            label,
            size,
            raw_usage | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
        )?;
        Ok(Buffer {
            label: label.to_owned(),
            size,
            raw,
        })
    }

    /// Makes a buffer that holds `data`.
    pub fn buffer_with<T: NoUninit>(
        &self,
        label: &str,
        usage: Usage,
        data: &[T],
    ) -> Result<Buffer, GpuError> {
        let buffer = self.buffer(label, usage, size_of_val(data) as u64)?;
        self.write(&buffer, data)?;
        Ok(buffer)
    }

    /// Writes `data` to the start of a buffer.
    ///
    /// The write happens before the next submission and after all earlier ones. Two writes to one
    /// buffer before a submission are therefore both done before its first dispatch: values that
    /// differ from dispatch to dispatch need a submission, or a buffer, each.
    pub fn write<T: NoUninit>(&self, buffer: &Buffer, data: &[T]) -> Result<(), GpuError> {
        self.write_at(buffer, 0, data)
    }

    /// Writes `data` at a byte offset, a multiple of 4; see [`Gpu::write`].
    pub fn write_at<T: NoUninit>(
        &self,
        buffer: &Buffer,
        offset: u64,
        data: &[T],
    ) -> Result<(), GpuError> {
        let mut bytes = Cow::Borrowed(bytemuck::cast_slice::<T, u8>(data));
        let end = offset.saturating_add(bytes.len() as u64);
        let what = format!("the end of a write to buffer `{}` in bytes", buffer.label);
        within(what, end, buffer.size)?;
        if bytes.is_empty() {
            return self.faults.check();
        }
        let whole = bytes.len().next_multiple_of(4);
        if whole != bytes.len() {
            bytes.to_mut().resize(whole, 0);
        }
        self.faults.scoped(&self.device, || {
            self.queue.write_buffer(&buffer.raw, offset, &bytes);
        })
    }

    /// Reads a whole buffer, after all that was submitted before. Bytes at its end that make no
    /// whole `T` are left out.
    pub fn read<T: Pod>(&self, buffer: &Buffer) -> Result<Vec<T>, GpuError> {
        let count = (buffer.size as usize).checked_div(size_of::<T>());
        self.read_first(buffer, count.unwrap_or(0))
    }

    /// Reads the first `count` values of a buffer; see [`Gpu::read`].
    pub fn read_first<T: Pod>(&self, buffer: &Buffer, count: usize) -> Result<Vec<T>, GpuError> {
        let bytes = (count as u64).saturating_mul(size_of::<T>() as u64);
        let what = format!("the length of a read of buffer `{}` in bytes", buffer.label);
        within(what, bytes, buffer.size)?;
        if bytes == 0 {
            self.faults.check()?;
            return Ok(Vec::new());
        }
        let copied = bytes.next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT);
        let staging = self.raw_buffer(
            "readback",
            copied,
            wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        )?;
        let submission = self.faults.scoped(&self.device, || {
            let mut encoder = self.device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(&buffer.raw, 0, &staging, 0, copied);
            let submission = self.queue.submit([encoder.finish()]);
            // Whether it worked shows when the range is asked for.
            staging.map_async(wgpu::MapMode::Read, .., |_| {});
            submission
        })?;
        self.wait_for(&format!("reading buffer `{}`", buffer.label), submission)?;
        let view = self
            .faults
            .scoped(&self.device, || staging.get_mapped_range(..))?
            .map_err(|error| GpuError::Internal(error.to_string()))?;
        Ok(bytemuck::pod_collect_to_vec(&view[..bytes as usize]))
    }

    fn raw_buffer(
        &self,
        label: &str,
        size: u64,
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer, GpuError> {
        self.faults.scoped(&self.device, || {
            self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage,
                mapped_at_creation: false,
            })
        })
    }
}
