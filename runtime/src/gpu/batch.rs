//! Dispatches, recorded one after another and submitted at once.

use super::error::within;
use super::{BoundKernel, Buffer, Gpu, GpuError};

/// How much work a dispatch does. The first two count invocations and are divided by the kernel's
/// workgroup size, rounding up: the kernel must check its index against the true count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// So many invocations in a row, for a kernel whose workgroups extend along x only. Where
    /// there are more workgroups than one axis may have, they are spread over y; the index of an
    /// invocation is then, in any case,
    /// `id.y * (num_workgroups.x * workgroup_size_x) + id.x` with `id` the global invocation id.
    Line(u64),
    /// So many invocations along x and y.
    Image {
        /// Along x.
        width: u32,
        /// Along y.
        height: u32,
    },
    /// So many workgroups along each axis.
    Workgroups([u32; 3]),
}

/// Dispatches that are submitted together.
///
/// Each sees all that the ones before it wrote. They share a single compute pass: WebGPU makes
/// each dispatch a usage scope of its own, and wgpu puts a memory barrier between two dispatches
/// when a buffer that one of them writes is used by both.
#[derive(Debug)]
#[must_use = "a batch does nothing until it is submitted"]
pub struct Batch<'gpu> {
    gpu: &'gpu Gpu,
    steps: Vec<(BoundKernel, Groups)>,
}

/// How many workgroups there are.
#[derive(Clone, Debug)]
enum Groups {
    Known([u32; 3]),
    /// As many as the buffer says when the dispatch begins.
    In(Buffer),
}

/// Work that was handed to the device.
#[derive(Clone, Debug)]
#[must_use = "wait for it with `Gpu::wait`"]
pub struct Submission {
    what: String,
    index: wgpu::SubmissionIndex,
}

impl Gpu {
    /// An empty batch.
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
        let most = self.gpu.info.limits.workgroups_per_axis;
        let groups = workgroups(label, extent, call.kernel.workgroup_size(), most)?;
        if !groups.contains(&0) {
            self.steps.push((call.clone(), Groups::Known(groups)));
        }
        Ok(())
    }

    /// Adds a dispatch of as many workgroups along each axis as the first three words of a buffer
    /// with [`super::Usage::Arguments`] say when it begins; they may not pass the device's limit.
    pub fn dispatch_indirect(&mut self, call: &BoundKernel, arguments: &Buffer) {
        self.steps
            .push((call.clone(), Groups::In(arguments.clone())));
    }

    /// Hands the dispatches to the device and does not wait.
    pub fn submit(self) -> Result<Submission, GpuError> {
        let gpu = self.gpu;
        let index = gpu.faults.scoped(&gpu.device, || {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                for (call, groups) in &self.steps {
                    pass.set_pipeline(call.kernel.pipeline());
                    pass.set_bind_group(0, &call.group, &[]);
                    match groups {
                        Groups::Known([x, y, z]) => pass.dispatch_workgroups(*x, *y, *z),
                        Groups::In(buffer) => pass.dispatch_workgroups_indirect(&buffer.raw, 0),
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

    /// Hands the dispatches to the device and waits until they are done.
    pub fn submit_and_wait(self) -> Result<(), GpuError> {
        let gpu = self.gpu;
        let submission = self.submit()?;
        gpu.wait(submission)
    }
}

/// The workgroups that cover `extent`; `most` along each axis are allowed.
fn workgroups(
    label: &str,
    extent: Extent,
    size: [u32; 3],
    most: u32,
) -> Result<[u32; 3], GpuError> {
    let most = u64::from(most);
    let size = size.map(u64::from);
    let groups = match extent {
        Extent::Line(count) => {
            let groups = count.div_ceil(size[0]);
            // As few rows as will do, and each only as long as it must be.
            let rows = groups.div_ceil(most);
            [groups.div_ceil(rows.max(1)), rows, 1]
        }
        Extent::Image { width, height } => [
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
        within(what, group, most)?;
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
    fn images_round_up_to_whole_workgroups() {
        let image = Extent::Image {
            width: 17,
            height: 8,
        };
        assert_eq!(workgroups("k", image, [8, 8, 1], 65_535), Ok([3, 1, 1]));
    }
}
