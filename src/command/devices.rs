//! `sdfc devices`: the devices that can run scenes.

use crate::failure::Failure;
use crate::output;
use sdfc_runtime::gpu::{self, DeviceInfo, DeviceKind};
use serde_json::json;

/// List the devices that can run scenes: the processor, and the adapters of GPUs.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Print the list as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get());
    let devices = gpu::devices();
    if arguments.json {
        let devices: Vec<_> = devices.iter().map(as_json).collect();
        return output::print_json(&json!({ "cpu": { "cores": cores }, "devices": devices }));
    }
    let mut text = format!(
        "cpu  the processor, {cores} core{}: engine cpu\n",
        if cores == 1 { "" } else { "s" }
    );
    for (number, device) in devices.iter().enumerate() {
        text.push_str(&describe(number, device));
    }
    text.push_str(match devices.first().map(|device| device.kind) {
        None => {
            "\nthere is no GPU adapter, which the engines interp and wgsl need; \
             mesa-vulkan-drivers is one in software\nengine auto takes cpu\n"
        }
        Some(DeviceKind::Software) => "\nthere is no hardware GPU: engine auto takes cpu\n",
        Some(_) => "\nengine auto takes gpu0, and cpu for fields whose slope is only estimated\n",
    });
    output::print(text)
}

fn describe(number: usize, device: &DeviceInfo) -> String {
    format!(
        "gpu{number} {}, {}, {}: engines interp, wgsl\n     {}\n     buffers up to {} MiB, \
         {} MiB of one in a kernel; uniforms up to {} KiB\n",
        device.name,
        device.kind.name(),
        device.backend,
        device.driver,
        device.limits.buffer >> 20,
        device.limits.storage_binding >> 20,
        device.limits.uniform_binding >> 10,
    )
}

fn as_json(device: &DeviceInfo) -> serde_json::Value {
    json!({
        "name": device.name,
        "kind": device.kind.name(),
        "backend": device.backend,
        "driver": device.driver,
        "limits": {
            "buffer": device.limits.buffer,
            "storage_binding": device.limits.storage_binding,
            "uniform_binding": device.limits.uniform_binding,
            "storage_buffers": device.limits.storage_buffers,
            "workgroup_memory": device.limits.workgroup_memory,
            "workgroup_invocations": device.limits.workgroup_invocations,
            "workgroups_per_axis": device.limits.workgroups_per_axis,
        },
    })
}
