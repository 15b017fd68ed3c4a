//! Dispatches, recorded one after another and submitted together.

use super::error::within;
use super::{BoundKernel, Buffer, Gpu, GpuError};

/// The amount of work of a dispatch. The first two variants count invocations and are divided by the kernel's
/// workgroup size, rounding up. The kernel must check its index against the true count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// A line of invocations, for a kernel whose workgroups extend along x only. If there are more workgroups
    /// than one axis allows, they are spread over y. The index of an invocation is always `id.y *
    /// (num_workgroups.x * workgroup_size_x) + id.x`, with `id` the global invocation id.
    Line(u64),
    /// A grid of invocations along x and y.
    Grid {
        /// Number of invocations along x.
        width: u32,
        /// Number of invocations along y.
        height: u32,
    },
    /// Numbers of workgroups along each axis.
    Workgroups([u32; 3]),
}

/// Dispatches that are submitted together.
///
/// Each dispatch sees all writes of the ones before it. They share a single compute pass: WebGPU makes each
/// dispatch a separate usage scope. Where one of two dispatches writes a buffer that the other one uses, wgpu
/// inserts a memory barrier between them.
#[derive(Debug)]
#[must_use = "a batch does nothing until it is submitted"]
pub struct Batch<'gpu> {
    gpu: &'gpu Gpu,
    steps: Vec<(BoundKernel, WorkgroupCount)>,
}

/// The number of workgroups of a dispatch.
#[derive(Clone, Debug)]
enum WorkgroupCount {
    Direct([u32; 3]),
    /// Read from the buffer when the dispatch begins.
    Indirect(Buffer),
}

/// Work that was submitted to the device.
#[derive(Clone, Debug)]
#[must_use = "wait for it with `Gpu::wait`"]
pub struct Submission {
    what: String,
    index: wgpu::SubmissionIndex,
}

impl Gpu {
    /// Returns an empty batch.
    pub fn batch(&self) -> Batch<'_> {
        Batch {
            gpu: self,
            steps: Vec::new(),
        }
    }

    /// Waits until `submission` is done.
    pub fn wait(&self, submission: Submission) -> Result<(), GpuError> {
        self.wait_for(&submission.what, submission.index)
    }
}

impl Batch<'_> {
    /// Adds a dispatch. An extent of zero adds nothing.
    pub fn dispatch(&mut self, call: &BoundKernel, extent: Extent) -> Result<(), GpuError> {
        let label = call.kernel.label();
        let max_per_axis = self.gpu.info.limits.workgroups_per_axis;
        let groups = workgroups(label, extent, call.kernel.workgroup_size(), max_per_axis)?;
        if !groups.contains(&0) {
            self.steps
                .push((call.clone(), WorkgroupCount::Direct(groups)));
        }
        Ok(())
    }

    /// Adds a dispatch whose numbers of workgroups along each axis are the first three words of a buffer with
    /// [`super::BufferUsage::Arguments`], read when it begins. They may not exceed the device's limit.
    pub fn dispatch_indirect(&mut self, call: &BoundKernel, arguments: &Buffer) {
        self.steps
            .push((call.clone(), WorkgroupCount::Indirect(arguments.clone())));
    }

    /// Submits the dispatches without waiting.
    pub fn submit(self) -> Result<Submission, GpuError> {
        let gpu = self.gpu;
        let index = gpu.error_tracker.scoped(&gpu.device, || {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                for (call, groups) in &self.steps {
                    pass.set_pipeline(call.kernel.pipeline());
                    pass.set_bind_group(0, &call.group, &[]);
                    match groups {
                        WorkgroupCount::Direct([x, y, z]) => pass.dispatch_workgroups(*x, *y, *z),
                        WorkgroupCount::Indirect(buffer) => {
                            pass.dispatch_workgroups_indirect(&buffer.raw, 0)
                        }
                    }
                }
            }
            gpu.queue.submit([encoder.finish()])
        })?;
        let last = self.steps.last().map(|(call, _)| call.kernel.label());
        Ok(Submission {
            what: format!("running kernel `{}`", last.unwrap_or("none")),
            index,
        })
    }

    /// Submits the dispatches and waits until they are done.
    pub fn submit_and_wait(self) -> Result<(), GpuError> {
        let gpu = self.gpu;
        let submission = self.submit()?;
        gpu.wait(submission)
    }
}

/// Returns the workgroups that cover `extent`, with at most `max_per_axis` along each axis.
fn workgroups(
    label: &str,
    extent: Extent,
    size: [u32; 3],
    max_per_axis: u32,
) -> Result<[u32; 3], GpuError> {
    let max_per_axis = u64::from(max_per_axis);
    let size = size.map(u64::from);
    let groups = match extent {
        Extent::Line(count) => {
            let groups = count.div_ceil(size[0]);
            // As few rows as possible, each only as long as necessary.
            let rows = groups.div_ceil(max_per_axis);
            [groups.div_ceil(rows.max(1)), rows, 1]
        }
        Extent::Grid { width, height } => [
            u64::from(width).div_ceil(size[0]),
            u64::from(height).div_ceil(size[1]),
            1,
        ],
        Extent::Workgroups(groups) => groups.map(u64::from),
    };
    let mut counts = [0; 3];
    for (count, (group, axis)) in counts
        .iter_mut()
        .zip(groups.into_iter().zip(["x", "y", "z"]))
    {
        let what = format!("the number of workgroups of kernel `{label}` along {axis}");
        within(what, group, max_per_axis)?;
        *count = u32::try_from(group).unwrap_or(u32::MAX);
    }
    Ok(counts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_covered_by_as_few_workgroups_as_fit_the_axes() {
        let line = |count| workgroups("k", Extent::Line(count), [64, 1, 1], 65_535);
        assert_eq!(line(0), Ok([0, 0, 1]));
        assert_eq!(line(1), Ok([1, 1, 1]));
        assert_eq!(line(64 * 65_535), Ok([65_535, 1, 1]));
        assert_eq!(line(64 * 65_535 + 1), Ok([32_768, 2, 1]));
        assert_eq!(line(64 * 65_535 * 65_535), Ok([65_535, 65_535, 1]));
        assert_eq!(
            line(u64::MAX),
            Err(GpuError::LimitExceeded {
                what: "the number of workgroups of kernel `k` along y".into(),
                need: (1u64 << 58).div_ceil(65_535),
                have: 65_535
            })
        );
    }

    #[test]
    fn images_round_up_to_full_workgroups() {
        let image = Extent::Grid {
            width: 17,
            height: 8,
        };
        assert_eq!(workgroups("k", image, [8, 8, 1], 65_535), Ok([3, 1, 1]));
    }
}
