//! Tests of the GPU layer, on any adapter of the machine. Without an adapter these tests fail, unless
//! `SDFC_SKIP_GPU` states the reason why there is none.

use std::process::Command;
use std::time::Duration;

use sdfc_runtime::gpu::{
    AdapterPreference, Arithmetic, Batch, BindingAccess, BufferBinding, BufferUsage, Extent, Gpu,
    GpuError, Kernel, KernelSource, devices,
};
use sdfc_trials::skip::is_gpu_skipped;

const READ: BindingAccess = BindingAccess::StorageRead;
const WRITE: BindingAccess = BindingAccess::StorageReadWrite;
const UNIFORM: BindingAccess = BindingAccess::Uniform;

/// Runs `test` on the best adapter, with default and with strict kernels, which have the same guarantees.
/// Only a stated reason excuses a missing adapter.
fn on_gpu(test: impl Fn(Gpu)) {
    if is_gpu_skipped() {
        return;
    }
    for arithmetic in [
        Arithmetic::Default,
        Arithmetic::Strict,
        Arithmetic::Portable,
    ] {
        match Gpu::open_with(AdapterPreference::Any, arithmetic) {
            Ok(gpu) => {
                assert_eq!(gpu.arithmetic(), arithmetic);
                test(gpu);
            }
            Err(error) => panic!("{error}; ./test.sh installs a software driver"),
        }
    }
}

/// A kernel with entry point `main` whose slots are numbered from 0.
fn kernel(
    gpu: &Gpu,
    label: &str,
    wgsl: &str,
    access: &[BindingAccess],
) -> Result<Kernel, GpuError> {
    let bindings = BufferBinding::numbered(access);
    gpu.kernel(&KernelSource {
        label,
        wgsl,
        entry: "main",
        bindings: &bindings,
        as_written: false,
    })
}

fn finish(batch: Batch<'_>) {
    batch.submit_and_wait().expect("the batch runs");
}

/// `out[i] = a[i] + b[i]`.
const ADD: &str = "
@group(0) @binding(0) var<storage, read> a: array<f32>;
@group(0) @binding(1) var<storage, read> b: array<f32>;
@group(0) @binding(2) var<storage, read_write> out: array<f32>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&out) { out[id.x] = a[id.x] + b[id.x]; }
}";

/// `out[i] = out[i] * factor + i`, for all elements of `out`, over both axes.
const SCALE_ADD: &str = "
@group(0) @binding(0) var<uniform> factor: vec4u;
@group(0) @binding(1) var<storage, read_write> out: array<u32>;
@compute @workgroup_size(8)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = id.y * groups.x * 8u + id.x;
    if i < arrayLength(&out) { out[i] = out[i] * factor.x + i; }
}";

/// Takes a while: 65,000 dependent steps per invocation.
const SLOW: &str = "
@group(0) @binding(0) var<storage, read_write> out: array<u32>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    var x = id.x;
    for (var i = 0u; i < 65000u; i++) { x = x * 1664525u + 1013904223u; }
    out[id.x % arrayLength(&out)] = x;
}";

#[test]
fn vectors_are_added() {
    on_gpu(|gpu| {
        let count = 1000;
        let a: Vec<f32> = (0..count).map(|i| i as f32).collect();
        let b: Vec<f32> = (0..count).map(|i| 0.25 * i as f32).collect();
        let add = kernel(&gpu, "add", ADD, &[READ, READ, WRITE]).expect("it compiles");
        assert_eq!(add.workgroup_size(), [64, 1, 1]);
        assert_eq!(gpu.pipelines_created(), 1);

        let a_buffer = gpu
            .buffer_with("a", BufferUsage::Storage, &a)
            .expect("room");
        let b_buffer = gpu
            .buffer_with("b", BufferUsage::Storage, &b)
            .expect("room");
        let out = gpu.buffer("out", BufferUsage::Storage, 4000).expect("room");
        let call = gpu
            .bind(&add, &[(0, &a_buffer), (1, &b_buffer), (2, &out)])
            .expect("it fits");
        let mut batch = gpu.batch();
        batch.dispatch(&call, Extent::Line(count)).expect("in size");
        finish(batch);

        let sums: Vec<f32> = a.iter().zip(&b).map(|(a, b)| a + b).collect();
        assert_eq!(gpu.read::<f32>(&out), Ok(sums.clone()));
        assert_eq!(gpu.read_first::<f32>(&out, 3), Ok(sums[..3].to_vec()));
        assert_eq!(gpu.pipelines_created(), 1, "running makes no pipeline");
    });
}

#[test]
fn a_uniform_changes_between_submissions_and_dispatches_follow_each_other() {
    on_gpu(|gpu| {
        let scale = kernel(&gpu, "scale", SCALE_ADD, &[UNIFORM, WRITE]).expect("it compiles");
        let factor = gpu
            .buffer("factor", BufferUsage::Uniform, 16)
            .expect("room");
        let out = gpu
            .buffer("out", BufferUsage::Storage, 4 * 100)
            .expect("room");
        let call = gpu
            .bind(&scale, &[(0, &factor), (1, &out)])
            .expect("it fits");

        let mut expected = [0u32; 100];
        for f in [3u32, 5] {
            gpu.write(&factor, &[f, 0, 0, 0]).expect("it fits");
            let mut batch = gpu.batch();
            for _ in 0..4 {
                batch.dispatch(&call, Extent::Line(100)).expect("in size");
                for (i, value) in (0..).zip(&mut expected) {
                    *value = value.wrapping_mul(f).wrapping_add(i);
                }
            }
            finish(batch);
        }
        assert_eq!(gpu.read::<u32>(&out), Ok(expected.to_vec()));
    });
}

#[test]
fn a_million_words_come_back_from_more_workgroups_than_one_axis_holds() {
    on_gpu(|gpu| {
        let count = 1 << 20;
        assert!(count / 8 > u64::from(gpu.info().limits.workgroups_per_axis.min(65_535)));
        let scale = kernel(&gpu, "scale", SCALE_ADD, &[UNIFORM, WRITE]).expect("it compiles");
        let factor = gpu
            .buffer_with("factor", BufferUsage::Uniform, &[0u32; 4])
            .expect("room");
        let out = gpu
            .buffer("out", BufferUsage::Storage, 4 * count)
            .expect("room");
        let call = gpu
            .bind(&scale, &[(0, &factor), (1, &out)])
            .expect("it fits");
        let mut batch = gpu.batch();
        batch.dispatch(&call, Extent::Line(count)).expect("in size");
        finish(batch);
        let words = gpu.read::<u32>(&out).expect("it reads");
        assert!(words.iter().copied().eq(0..1 << 20));
    });
}

#[test]
fn bytes_that_fill_no_word_are_written_and_read() {
    on_gpu(|gpu| {
        let bytes = [1u8, 2, 3, 4, 5, 6, 7];
        let buffer = gpu
            .buffer_with("bytes", BufferUsage::Storage, &bytes)
            .expect("room");
        assert_eq!(buffer.size(), 8);
        assert_eq!(gpu.read_first::<u8>(&buffer, 7), Ok(bytes.to_vec()));
        assert_eq!(gpu.read::<[u8; 3]>(&buffer), Ok(vec![[1, 2, 3], [4, 5, 6]]));
        assert_eq!(gpu.read_first::<u32>(&buffer, 0), Ok(vec![]));
        assert_eq!(gpu.write::<u32>(&buffer, &[]), Ok(()));
        gpu.write_at(&buffer, 4, &[9u8]).expect("it fits");
        assert_eq!(
            gpu.read::<u8>(&buffer),
            Ok(vec![1, 2, 3, 4, 9, 0, 0, 0]),
            "a write pads its last word with zeros"
        );
    });
}

#[test]
fn a_shader_error_shows_its_line() {
    on_gpu(|gpu| {
        let shader = |wgsl: &str| match kernel(&gpu, "broken", wgsl, &[WRITE]) {
            Err(GpuError::Shader { label, text }) if label == "broken" => text,
            other => panic!("not a shader error: {other:?}"),
        };
        let text = shader("@compute @workgroup_size(1)\nfn main() {\n    let x = nonsense;\n}");
        assert!(text.contains("broken:3:13"), "{text}");
        assert!(text.contains("let x = nonsense;"), "{text}");
        // This one parses; the validator refuses it.
        let text = shader(
            "@compute @workgroup_size(1)\nfn main() {\n    var x: array<u32, 4>;\n    x[9] = 1;\n}",
        );
        assert!(text.contains("broken:4:"), "{text}");
        let text = shader("@compute @workgroup_size(1) fn other() {}");
        assert!(text.contains("no compute entry point `main`"), "{text}");
        assert_eq!(gpu.pipelines_created(), 0);
    });
}

#[test]
fn deep_and_long_expressions_are_compiled_or_refused() {
    on_gpu(|gpu| {
        for count in [100, 20_000, 500_000] {
            for expression in [
                format!("{}i{}", "(".repeat(count), ")".repeat(count)),
                format!("{}i", "~".repeat(count)),
            ] {
                let wgsl = format!(
                    "@group(0) @binding(0) var<storage, read_write> out: array<u32>;
                     @compute @workgroup_size(1)
                     fn main(@builtin(local_invocation_index) i: u32) {{ out[0] = {expression}; }}"
                );
                match kernel(&gpu, "deep", &wgsl, &[WRITE]) {
                    Ok(_) | Err(GpuError::Shader { .. }) => {}
                    Err(other) => panic!("{count}: {other}"),
                }
            }
        }
        let endless = kernel(&gpu, "endless", &" ".repeat(5 << 20), &[]);
        assert!(matches!(endless, Err(GpuError::LimitExceeded { .. })));
    });
}

#[test]
fn exceeded_limits_are_reported_with_both_numbers() {
    on_gpu(|gpu| {
        let limits = gpu.info().limits;
        let limit = |result: Result<_, GpuError>| match result {
            Err(GpuError::LimitExceeded { need, have, .. }) => (need, have),
            other => panic!("no limit error: {other:?}"),
        };
        let max_bytes = limits.storage_binding.min(limits.buffer);
        let large = gpu
            .buffer("large", BufferUsage::Storage, max_bytes + 4)
            .map(drop);
        assert_eq!(limit(large), (max_bytes + 4, max_bytes));
        let max_bytes = limits.uniform_binding.min(limits.buffer);
        let large = gpu
            .buffer("large", BufferUsage::Uniform, max_bytes + 4)
            .map(drop);
        assert_eq!(limit(large), (max_bytes + 4, max_bytes));
        let endless = gpu
            .buffer("endless", BufferUsage::Storage, u64::MAX)
            .map(drop);
        assert_eq!(limit(endless).0, u64::MAX);

        let small = gpu.buffer("small", BufferUsage::Storage, 8).expect("room");
        assert_eq!(limit(gpu.write(&small, &[0u32; 3])), (12, 8));
        assert_eq!(limit(gpu.write_at(&small, 8, &[0u32])), (12, 8));
        let read = gpu.read_first::<u32>(&small, usize::MAX).map(drop);
        assert_eq!(limit(read), (u64::MAX, 8));
    });
}

#[test]
fn a_mistake_is_an_error_and_the_device_stays_usable() {
    on_gpu(|gpu| {
        let add = kernel(&gpu, "add", ADD, &[READ, READ, WRITE]).expect("it compiles");
        let buffer = gpu
            .buffer_with("b", BufferUsage::Storage, &[1.0f32; 4])
            .expect("room");
        let out = gpu.buffer("out", BufferUsage::Storage, 16).expect("room");
        let uniform = gpu.buffer("u", BufferUsage::Uniform, 16).expect("room");
        let validation = |result: Result<_, GpuError>| match result {
            Err(GpuError::Validation(text)) => text,
            other => panic!("no validation error: {other:?}"),
        };

        let missing = gpu.bind(&add, &[(0, &buffer), (1, &buffer)]).map(drop);
        assert!(validation(missing).contains("add"));
        let wrong = gpu.bind(&add, &[(0, &uniform), (1, &buffer), (2, &out)]);
        validation(wrong.map(drop));
        // A slot that the module uses but the description lacks.
        validation(kernel(&gpu, "add", ADD, &[READ, READ]).map(drop));
        // One buffer read and written by the same dispatch.
        let alias = gpu
            .bind(&add, &[(0, &buffer), (1, &buffer), (2, &buffer)])
            .expect("each slot alone is well");
        let mut batch = gpu.batch();
        batch.dispatch(&alias, Extent::Line(4)).expect("in size");
        validation(batch.submit_and_wait());
        // An offset within a word.
        validation(gpu.write_at(&buffer, 2, &[0u8]));

        let call = gpu
            .bind(&add, &[(0, &buffer), (1, &buffer), (2, &out)])
            .expect("it fits");
        let mut batch = gpu.batch();
        batch.dispatch(&call, Extent::Line(4)).expect("in size");
        finish(batch);
        assert_eq!(gpu.read::<f32>(&out), Ok(vec![2.0; 4]));
        assert_eq!(gpu.pipelines_created(), 1);
    });
}

/// Kernels with an index far outside of every buffer, and with memory that was never written.
#[test]
fn indices_stay_inside_and_workgroup_memory_begins_as_zeros() {
    on_gpu(|gpu| {
        let reach = "
@group(0) @binding(6) var<storage, read> given: array<u32>;
@group(0) @binding(2) var<storage, read_write> made: array<u32>;
var<workgroup> shared_words: array<u32, 64>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    var own = array<u32, 4>(1u, 2u, 3u, 4u);
    let far = id.x + 0x00ffff00u;
    own[far] = 0u;
    made[far] = 7u + given[far] + own[far] + shared_words[63u - id.x % 64u];
    made[id.x % 2u] = shared_words[id.x % 64u];
}";
        let bindings = [(6, READ), (2, WRITE)].map(|(slot, access)| BufferBinding { slot, access });
        let reach = gpu
            .kernel(&KernelSource {
                label: "reach",
                wgsl: reach,
                entry: "main",
                bindings: &bindings,
                as_written: false,
            })
            .expect("it compiles");
        let buffer = |value: u32| {
            let words = [value; 8];
            gpu.buffer_with("words", BufferUsage::Storage, &words)
                .expect("room")
        };
        let (input, output, neighbour) = (buffer(5), buffer(9), buffer(3));
        let call = gpu
            .bind(&reach, &[(6, &input), (2, &output)])
            .expect("it fits");
        let mut batch = gpu.batch();
        batch.dispatch(&call, Extent::Line(256)).expect("in size");
        finish(batch);
        assert_eq!(gpu.read::<u32>(&input), Ok(vec![5; 8]));
        assert_eq!(gpu.read::<u32>(&neighbour), Ok(vec![3; 8]));
        // Out-of-bounds accesses may be dropped or go to the last word.
        let written = gpu.read::<u32>(&output).expect("it reads");
        assert_eq!(written[..7], [0, 0, 9, 9, 9, 9, 9]);
    });
}

#[test]
fn a_workgroup_that_is_too_large_is_refused() {
    on_gpu(|gpu| {
        let limits = gpu.info().limits;
        let mut large = vec![(limits.workgroup_invocations + 1, 1)];
        // wgpu leaves memory to the driver.
        if gpu.arithmetic() == Arithmetic::Strict {
            large.push((1, limits.workgroup_memory / 4 + 1));
        }
        for (size, words) in large {
            let wgsl = format!(
                "@group(0) @binding(0) var<storage, read_write> out: array<u32>;
                 var<workgroup> shared_words: array<u32, {words}>;
                 @compute @workgroup_size({size})
                 fn main(@builtin(local_invocation_index) i: u32) {{
                     shared_words[i] = i;
                     out[0] = shared_words[0];
                 }}"
            );
            let refused = kernel(&gpu, "large", &wgsl, &[WRITE]).map(drop);
            assert!(
                matches!(
                    refused,
                    Err(GpuError::Validation(_) | GpuError::LimitExceeded { .. })
                ),
                "{refused:?}"
            );
        }
    });
}

#[test]
fn buffers_that_are_smaller_than_declared_are_refused() {
    on_gpu(|gpu| {
        let scale = kernel(&gpu, "scale", SCALE_ADD, &[UNIFORM, WRITE]).expect("it compiles");
        let factor = gpu
            .buffer("factor", BufferUsage::Uniform, 12)
            .expect("room");
        let out = gpu.buffer("out", BufferUsage::Storage, 16).expect("room");
        let refused = gpu
            .bind(&scale, &[(0, &factor), (1, &out)])
            .and_then(|call| {
                let mut batch = gpu.batch();
                batch.dispatch(&call, Extent::Line(4))?;
                batch.submit_and_wait()
            });
        assert!(
            matches!(refused, Err(GpuError::Validation(_))),
            "{refused:?}"
        );
    });
}

#[test]
fn a_wait_ends_when_its_time_is_up() {
    on_gpu(|mut gpu| {
        let slow = kernel(&gpu, "slow", SLOW, &[WRITE]).expect("it compiles");
        let out = gpu.buffer("out", BufferUsage::Storage, 4096).expect("room");
        let call = gpu.bind(&slow, &[(0, &out)]).expect("it fits");
        gpu.timeout = Duration::from_millis(1);
        let mut batch = gpu.batch();
        for _ in 0..20 {
            batch
                .dispatch(&call, Extent::Line(1 << 14))
                .expect("in size");
        }
        assert_eq!(
            batch.submit_and_wait(),
            Err(GpuError::Timeout {
                what: "running kernel `slow`".into(),
                after: Duration::from_millis(1),
            })
        );
    });
}

#[test]
fn a_lost_device_is_an_error_everywhere() {
    on_gpu(|gpu| {
        let add = kernel(&gpu, "add", ADD, &[READ, READ, WRITE]).expect("it compiles");
        let buffer = gpu.buffer("b", BufferUsage::Storage, 16).expect("room");
        gpu.destroy();
        let lost = |result: Result<(), GpuError>| {
            assert!(matches!(result, Err(GpuError::DeviceLost(_))), "{result:?}");
        };
        lost(gpu.buffer("c", BufferUsage::Storage, 16).map(drop));
        lost(gpu.write(&buffer, &[0u32]));
        lost(gpu.read::<u32>(&buffer).map(drop));
        lost(gpu.bind(&add, &[(0, &buffer)]).map(drop));
        lost(kernel(&gpu, "add", ADD, &[READ, READ, WRITE]).map(drop));
        lost(gpu.batch().submit_and_wait());
    });
}

#[test]
fn hardware_is_listed_first_and_can_be_requested_alone() {
    on_gpu(|gpu| {
        let available = devices();
        assert!(available.is_sorted_by_key(|device| device.kind));
        assert_eq!(available.first(), Some(gpu.info()));
        let hardware = available
            .iter()
            .any(|device| device.kind.name() != "software");
        match Gpu::open(AdapterPreference::Hardware) {
            Ok(gpu) => assert!(hardware && gpu.info().kind.name() != "software"),
            Err(GpuError::OnlySoftware { name }) => assert!(!hardware && name == available[0].name),
            Err(other) => panic!("{other}"),
        }
    });
}

/// The loader reads its environment once, so a machine without adapters is simulated by a separate process:
/// this test, run again with an environment variable.
#[test]
fn without_an_adapter_opening_is_an_error_and_the_list_is_empty() {
    const CHILD: &str = "SDFC_TEST_WITHOUT_ADAPTER";
    if std::env::var_os(CHILD).is_some() {
        assert_eq!(devices(), []);
        for preference in [AdapterPreference::Any, AdapterPreference::Hardware] {
            assert_eq!(Gpu::open(preference).map(drop), Err(GpuError::NoAdapter));
        }
        return;
    }
    let this = std::env::current_exe().expect("a test has a path");
    let output = Command::new(this)
        .args(["--exact", "--nocapture"])
        .arg("without_an_adapter_opening_is_an_error_and_the_list_is_empty")
        .env(CHILD, "1")
        .env("VK_DRIVER_FILES", "/dev/null")
        .env("VK_ICD_FILENAMES", "/dev/null")
        .output()
        .expect("a test can be started");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    assert!(
        String::from_utf8_lossy(&output.stdout).contains("1 passed"),
        "the child ran another test"
    );
    assert_eq!(stderr, "", "nothing is printed");
}
