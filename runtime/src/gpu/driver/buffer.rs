//! Buffers on the device, written and read as slices of plain data.

use std::borrow::Cow;
use std::sync::{MutexGuard, PoisonError};

use bytemuck::{NoUninit, Pod};

use super::error::within;
use super::{Gpu, GpuError};

/// Sizes of the buffer for copies from the device that is kept between reads, in bytes.
const MIN_STAGING_BYTES: u64 = 1 << 16;
const MAX_STAGING_BYTES: u64 = 128 << 20;

/// The ways in which a buffer can be bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BufferUsage {
    /// Small and read-only in kernels; every device supports at least 64 KiB.
    Uniform,
    /// A uniform buffer that some kernels declare as storage.
    UniformOrStorage,
    /// Any other data.
    Storage,
    /// The arguments of an indirect dispatch, which a kernel writes as storage.
    Arguments,
}

/// Memory on the device. It can be bound, written and read; initially it contains zeros. Cheap to clone: a
/// clone refers to the same memory.
#[derive(Clone, Debug)]
pub struct Buffer {
    label: String,
    size: u64,
    pub(super) raw: wgpu::Buffer,
}

impl Buffer {
    /// Returns the size in bytes.
    pub fn size(&self) -> u64 {
        self.size
    }
}

impl Gpu {
    /// Creates a buffer of `size` bytes, rounded up to whole words and to at least one word.
    pub fn buffer(&self, label: &str, usage: BufferUsage, size: u64) -> Result<Buffer, GpuError> {
        let limits = self.info.limits;
        let (binding, raw_usage) = match usage {
            BufferUsage::Uniform => (limits.uniform_binding, wgpu::BufferUsages::UNIFORM),
            BufferUsage::UniformOrStorage => (
                limits.uniform_binding.min(limits.storage_binding),
                wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::STORAGE,
            ),
            BufferUsage::Storage => (limits.storage_binding, wgpu::BufferUsages::STORAGE),
            BufferUsage::Arguments => (
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

    /// Creates a buffer that contains `data`.
    pub fn buffer_with<T: NoUninit>(
        &self,
        label: &str,
        usage: BufferUsage,
        data: &[T],
    ) -> Result<Buffer, GpuError> {
        let buffer = self.buffer(label, usage, size_of_val(data) as u64)?;
        self.write(&buffer, data)?;
        Ok(buffer)
    }

    /// Writes `data` to the start of a buffer.
    ///
    /// The write happens before the next submission and after all earlier ones. Two writes to one buffer
    /// before a submission are therefore both done before its first dispatch. Values that differ between
    /// dispatches require a submission, or a buffer, each.
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
            return self.error_tracker.check();
        }
        let padded_length = bytes.len().next_multiple_of(4);
        if padded_length != bytes.len() {
            bytes.to_mut().resize(padded_length, 0);
        }
        self.error_tracker.scoped(&self.device, || {
            self.queue.write_buffer(&buffer.raw, offset, &bytes);
        })
    }

    /// Reads a whole buffer, after all previous submissions. Trailing bytes that do not form a whole `T` are
    /// omitted.
    pub fn read<T: Pod>(&self, buffer: &Buffer) -> Result<Vec<T>, GpuError> {
        let count = (buffer.size as usize).checked_div(size_of::<T>());
        self.read_first(buffer, count.unwrap_or(0))
    }

    /// Reads the first `count` values of a buffer; see [`Gpu::read`].
    pub fn read_first<T: Pod>(&self, buffer: &Buffer, count: usize) -> Result<Vec<T>, GpuError> {
        self.with_bytes::<T, _>(buffer, count, bytemuck::pod_collect_to_vec)
    }

    /// Calls `act` with the first `count` values of a buffer, where the device wrote them: nothing is copied.
    /// See [`Gpu::read`]. The values are numbers of 32 bits, or consist of them.
    pub fn with_values<T: Pod, R>(
        &self,
        buffer: &Buffer,
        count: usize,
        act: impl FnOnce(&[T]) -> R,
    ) -> Result<R, GpuError> {
        const { assert!(align_of::<T>() <= wgpu::MAP_ALIGNMENT as usize) }
        self.with_bytes::<T, R>(buffer, count, |bytes| act(bytemuck::cast_slice(bytes)))
    }

    /// Calls `act` with the bytes of the first `count` values of a buffer.
    fn with_bytes<T: Pod, R>(
        &self,
        buffer: &Buffer,
        count: usize,
        act: impl FnOnce(&[u8]) -> R,
    ) -> Result<R, GpuError> {
        let bytes = (count as u64).saturating_mul(size_of::<T>() as u64);
        let what = format!("the length of a read of buffer `{}` in bytes", buffer.label);
        within(what, bytes, buffer.size)?;
        if bytes == 0 {
            self.error_tracker.check()?;
            return Ok(act(&[]));
        }
        let copy_bytes = bytes.next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT);
        let staging = self.staging_buffer(copy_bytes)?;
        let submission = self.error_tracker.scoped(&self.device, || {
            let mut encoder = self.device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(&buffer.raw, 0, &staging, 0, copy_bytes);
            let submission = self.queue.submit([encoder.finish()]);
            // A failure shows when the mapped range is requested.
            staging.map_async(wgpu::MapMode::Read, ..copy_bytes, |_| {});
            submission
        })?;
        self.wait_for(&format!("reading buffer `{}`", buffer.label), submission)?;
        let view = self
            .error_tracker
            .scoped(&self.device, || staging.get_mapped_range(..copy_bytes))?
            .map_err(|error| GpuError::Internal(error.to_string()))?;
        let result = act(&view[..bytes as usize]);
        drop(view);
        self.error_tracker
            .scoped(&self.device, || staging.unmap())?;
        self.keep_staging_buffer(staging);
        Ok(result)
    }

    /// Returns a buffer for copies from the device, of at least this size. The pages of a new one cost more
    /// time than the copy, so the largest of moderate size is kept.
    fn staging_buffer(&self, size: u64) -> Result<wgpu::Buffer, GpuError> {
        let kept = self.staging().take();
        if let Some(buffer) = kept.filter(|buffer| buffer.size() >= size) {
            return Ok(buffer);
        }
        let size = size.max(MIN_STAGING_BYTES.min(self.info.limits.buffer));
        self.raw_buffer(
            "readback",
            size,
            wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        )
    }

    fn keep_staging_buffer(&self, buffer: wgpu::Buffer) {
        let mut kept = self.staging();
        let kept_size = kept.as_ref().map_or(0, wgpu::Buffer::size);
        if (kept_size..=MAX_STAGING_BYTES).contains(&buffer.size()) {
            *kept = Some(buffer);
        }
    }

    fn staging(&self) -> MutexGuard<'_, Option<wgpu::Buffer>> {
        self.staging.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn raw_buffer(
        &self,
        label: &str,
        size: u64,
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer, GpuError> {
        self.error_tracker.scoped(&self.device, || {
            self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage,
                mapped_at_creation: false,
            })
        })
    }
}
