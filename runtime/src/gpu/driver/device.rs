//! The adapters of this machine, best first.

/// An adapter, as listed by `sdfc devices`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceInfo {
    /// The adapter's name.
    pub name: String,
    /// The backend in lower case: `vulkan`.
    pub backend: String,
    /// The driver's name and version, if reported.
    pub driver: String,
    /// The kind of device.
    pub kind: DeviceKind,
    /// The limits that sdfc depends on.
    pub limits: DeviceLimits,
}

/// Kinds of adapters, in the order of preference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum DeviceKind {
    /// A graphics card.
    Discrete,
    /// Graphics within the processor.
    Integrated,
    /// A part of a graphics card, assigned to a virtual machine.
    Virtual,
    /// Hardware of unknown kind.
    Other,
    /// The CPU, running a software driver.
    Software,
}

/// The limits of a device. Sizes are in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeviceLimits {
    /// Maximum size of a buffer.
    pub buffer: u64,
    /// Maximum part of a storage buffer that a kernel can access.
    pub storage_binding: u64,
    /// Maximum part of a uniform buffer that a kernel can access.
    pub uniform_binding: u64,
    /// Maximum number of storage buffers per kernel.
    pub storage_buffers: u32,
    /// Maximum memory shared by a workgroup.
    pub workgroup_memory: u32,
    /// Maximum number of invocations in a workgroup.
    pub workgroup_invocations: u32,
    /// Maximum number of workgroups of a dispatch along each axis.
    pub workgroups_per_axis: u32,
}

impl DeviceKind {
    /// Returns the kind in one word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Discrete => "discrete",
            Self::Integrated => "integrated",
            Self::Virtual => "virtual",
            Self::Other => "other",
            Self::Software => "software",
        }
    }
}

impl From<wgpu::DeviceType> for DeviceKind {
    fn from(kind: wgpu::DeviceType) -> Self {
        match kind {
            wgpu::DeviceType::DiscreteGpu => Self::Discrete,
            wgpu::DeviceType::IntegratedGpu => Self::Integrated,
            wgpu::DeviceType::VirtualGpu => Self::Virtual,
            wgpu::DeviceType::Other => Self::Other,
            wgpu::DeviceType::Cpu => Self::Software,
        }
    }
}

/// Returns all adapters, hardware first. The list is empty if there is no driver; that is not an error.
pub fn devices() -> Vec<DeviceInfo> {
    adapters().into_iter().map(|(info, _)| info).collect()
}

/// Returns the adapters, in the order of preference.
pub(super) fn adapters() -> Vec<(DeviceInfo, wgpu::Adapter)> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        // Identical in debug and release builds: without validation layers, which a machine may lack.
        flags: wgpu::InstanceFlags::empty(),
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let available = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    let mut adapters: Vec<_> = available
        .into_iter()
        .map(|adapter| (describe(&adapter), adapter))
        .collect();
    // The sort is stable: among equals the driver's order holds.
    adapters.sort_by_key(|(info, _)| info.kind);
    adapters
}

fn describe(adapter: &wgpu::Adapter) -> DeviceInfo {
    let info = adapter.get_info();
    let limits = adapter.limits();
    DeviceInfo {
        name: info.name,
        backend: info.backend.to_string(),
        driver: format!("{} {}", info.driver, info.driver_info)
            .trim()
            .to_owned(),
        kind: info.device_type.into(),
        limits: DeviceLimits::from_wgpu(&limits),
    }
}

impl DeviceLimits {
    fn from_wgpu(limits: &wgpu::Limits) -> Self {
        Self {
            buffer: limits.max_buffer_size,
            storage_binding: limits.max_storage_buffer_binding_size,
            uniform_binding: limits.max_uniform_buffer_binding_size,
            storage_buffers: limits.max_storage_buffers_per_shader_stage,
            workgroup_memory: limits.max_compute_workgroup_storage_size,
            workgroup_invocations: limits.max_compute_invocations_per_workgroup,
            workgroups_per_axis: limits.max_compute_workgroups_per_dimension,
        }
    }

    /// Returns the limits of an adapter with these limits in their place.
    pub(super) fn apply_to(&self, adapter: wgpu::Limits) -> wgpu::Limits {
        wgpu::Limits {
            max_buffer_size: self.buffer,
            max_storage_buffer_binding_size: self.storage_binding,
            max_uniform_buffer_binding_size: self.uniform_binding,
            max_storage_buffers_per_shader_stage: self.storage_buffers,
            max_compute_workgroup_storage_size: self.workgroup_memory,
            max_compute_invocations_per_workgroup: self.workgroup_invocations,
            max_compute_workgroups_per_dimension: self.workgroups_per_axis,
            ..adapter
        }
    }
}
