//! Strict kernels: SPIR-V in which no operation on floats may be fused with another, reordered or
//! simplified, so that every device that rounds correctly gives the bits that Rust's `f32` gives.
//!
//! WGSL lets a driver contract `a * b + c` and reassociate sums, and drivers do. SPIR-V's decoration
//! `NoContraction` forbids both for the instruction that it stands at; WGSL has no word for it. So
//! naga writes the module here, as wgpu would have it written, [`decorate`] adds the decoration to
//! the result of every arithmetic instruction on floats, and the words go to the driver as they are.
//!
//! Words that are passed on like that are seen by no check of wgpu's, so this file keeps them all:
//! the text has been validated by naga; the bindings are those the module declares, with the access
//! and at least the size that it declares ([`resources`]); workgroups keep the device's limits
//! ([`check_workgroup`]); and naga's writer puts into the module what wgpu asks it for: indices are
//! restricted to what is there, also in buffers, loops come to an end, integers are divided by no
//! zero, workgroup memory begins as zeros.
//!
//! What is left to the device is the rounding of single operations, which [`conformance`] tries
//! before anything else runs. Where there is no SPIR-V to decorate, kernels take the [`portable`] form;
//! in both they keep to what [`exact`] lets through.

pub(super) mod conformance;
pub(super) mod exact;
pub(super) mod portable;

use std::num::NonZeroU64;

use naga::back::spv;
use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
use naga::valid::ModuleInfo;
use naga::{AddressSpace, ResourceBinding, StorageAccess};

use super::device::Limits;
use super::error::within;
use super::{Access, Binding, GpuError};

/// The group that all buffers are in.
const GROUP: u32 = 0;

/// Words in front of a module's first instruction.
const HEADER: usize = 5;
const OP_TYPE_VOID: u16 = 19;
const OP_TYPE_FORWARD_POINTER: u16 = 39;
const OP_DECORATE: u32 = 71;
const NO_CONTRACTION: u32 = 42;

/// The arithmetic instructions on floats of the SPIR-V specification, section 3.42.13, to which
/// `NoContraction` applies. Square roots, minima and roundings are instructions of an extended set,
/// which are exact or nothing that a driver may combine.
const ARITHMETIC: [u16; 14] = [
    127, // OpFNegate
    129, // OpFAdd
    131, // OpFSub
    133, // OpFMul
    136, // OpFDiv
    140, // OpFRem
    141, // OpFMod
    142, // OpVectorTimesScalar
    143, // OpMatrixTimesScalar
    144, // OpVectorTimesMatrix
    145, // OpMatrixTimesVector
    146, // OpMatrixTimesMatrix
    147, // OpOuterProduct
    148, // OpDot
];

/// The words of a kernel whose arithmetic on floats is done as it is written.
pub(super) fn words(
    module: &naga::Module,
    info: &ModuleInfo,
    bindings: &[Binding],
) -> Result<Vec<u32>, GpuError> {
    let internal = |text: String| GpuError::Internal(format!("strict kernels: {text}"));
    let options = spv::Options {
        // Every Vulkan driver takes the first version.
        lang_version: (1, 0),
        flags: spv::WriterFlags::empty(),
        fake_missing_bindings: false,
        binding_map: places(bindings),
        capabilities: Some([spv::Capability::Shader].into_iter().collect()),
        bounds_check_policies: BoundsCheckPolicies {
            index: BoundsCheckPolicy::Restrict,
            buffer: BoundsCheckPolicy::Restrict,
            image_load: BoundsCheckPolicy::Restrict,
            binding_array: BoundsCheckPolicy::Restrict,
        },
        zero_initialize_workgroup_memory: spv::ZeroInitializeWorkgroupMemoryMode::Polyfill,
        force_loop_bounding: true,
        emit_int_div_checks: true,
        ..spv::Options::default()
    };
    let words = spv::write_vec(module, info, &options, None)
        .map_err(|error| internal(error.to_string()))?;
    decorate(&words).ok_or_else(|| internal("the module's words make no instructions".to_owned()))
}

/// Where the buffers of a bind group lie in Vulkan: wgpu numbers them in the order of their slots.
fn places(bindings: &[Binding]) -> spv::BindingMap {
    let mut slots: Vec<u32> = bindings.iter().map(|binding| binding.slot).collect();
    slots.sort_unstable();
    (0..)
        .zip(slots)
        .map(|(place, slot)| {
            let declared = ResourceBinding {
                group: GROUP,
                binding: slot,
            };
            let info = spv::BindingInfo {
                descriptor_set: GROUP,
                binding: place,
                binding_array_size: None,
            };
            (declared, info)
        })
        .collect()
}

/// The same module with `OpDecorate … NoContraction` for the result of every arithmetic instruction
/// on floats; `None` if the words are no sequence of instructions with a type among them.
fn decorate(words: &[u32]) -> Option<Vec<u32>> {
    let mut added = Vec::new();
    // Decorations stand in front of all types.
    let mut types = None;
    let mut at = HEADER;
    while at < words.len() {
        let (length, opcode) = ((words[at] >> 16) as usize, words[at] as u16);
        let instruction = words.get(at..at + length).filter(|_| length > 0)?;
        if (OP_TYPE_VOID..=OP_TYPE_FORWARD_POINTER).contains(&opcode) {
            types.get_or_insert(at);
        }
        if ARITHMETIC.contains(&opcode) {
            // The words are the opcode, the result's type, the result.
            added.extend([3 << 16 | OP_DECORATE, *instruction.get(2)?, NO_CONTRACTION]);
        }
        at += length;
    }
    let types = types?;
    let mut decorated = Vec::with_capacity(words.len() + added.len());
    decorated.extend_from_slice(&words[..types]);
    decorated.extend(added);
    decorated.extend_from_slice(&words[types..]);
    Some(decorated)
}

/// The smallest size of each binding's buffer in bytes, `None` for what the module does not declare.
/// A module whose buffers are not among the bindings, or are declared otherwise there, is
/// [`GpuError::Validation`].
pub(super) fn resources(
    module: &naga::Module,
    label: &str,
    bindings: &[Binding],
) -> Result<Vec<Option<NonZeroU64>>, GpuError> {
    let mut sizes = vec![None; bindings.len()];
    for (_, variable) in module.global_variables.iter() {
        let Some(declared) = &variable.binding else {
            continue;
        };
        let name = variable.name.as_deref().unwrap_or_default();
        let refuse = |text: &str| {
            let slot = declared.binding;
            GpuError::Validation(format!("kernel `{label}`: `{name}` in slot {slot} {text}"))
        };
        let found = bindings
            .iter()
            .position(|binding| declared.group == GROUP && binding.slot == declared.binding);
        let at = found.ok_or_else(|| refuse("is not among the bindings"))?;
        let access = match variable.space {
            AddressSpace::Uniform => Access::Uniform,
            AddressSpace::Storage { access } if access.contains(StorageAccess::STORE) => {
                Access::StorageReadWrite
            }
            AddressSpace::Storage { .. } => Access::StorageRead,
            _ => return Err(refuse("is no buffer")),
        };
        if access != bindings[at].access {
            return Err(refuse("has another access than its binding"));
        }
        let size = module.types[variable.ty]
            .inner
            .try_size(module.to_ctx())
            .ok_or_else(|| refuse("is too large"))?;
        sizes[at] = NonZeroU64::new(size.into());
    }
    Ok(sizes)
}

/// Fails if a workgroup has more invocations or memory than the device allows.
pub(super) fn check_workgroup(
    module: &naga::Module,
    label: &str,
    size: [u32; 3],
    limits: &Limits,
    sides: [u32; 3],
) -> Result<(), GpuError> {
    for (side, most) in size.into_iter().zip(sides) {
        let what = format!("a side of a workgroup of kernel `{label}`");
        within(what, side.into(), most.into())?;
    }
    let invocations: u64 = size.iter().map(|&side| u64::from(side)).product();
    let what = format!("the number of invocations in a workgroup of kernel `{label}`");
    within(what, invocations, limits.workgroup_invocations.into())?;
    let shared = module
        .global_variables
        .iter()
        .filter(|(_, variable)| variable.space == AddressSpace::WorkGroup);
    let bytes: u64 = shared
        .map(|(_, variable)| {
            let size = module.types[variable.ty].inner.try_size(module.to_ctx());
            // Each begins at a multiple of 16 at worst.
            size.map_or(u64::MAX >> 8, |size| u64::from(size).next_multiple_of(16))
        })
        .sum();
    let what = format!("the memory shared by a workgroup of kernel `{label}` in bytes");
    within(what, bytes, limits.workgroup_memory.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    const TEXT: &str = "
@group(0) @binding(7) var<uniform> factor: vec4f;
@group(0) @binding(3) var<storage, read> given: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> made: array<vec4f>;
var<workgroup> shared_numbers: array<f32, 64>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let v = given[id.x];
    shared_numbers[id.x % 64u] = -v.x;
    made[id.x] = (v + factor - v) * factor.x / factor.y + dot(v, v) + v.x * v.y + f32(id.x * 3u);
}";

    const BINDINGS: [Binding; 3] = [
        Binding {
            slot: 3,
            access: Access::StorageRead,
        },
        Binding {
            slot: 5,
            access: Access::StorageReadWrite,
        },
        Binding {
            slot: 7,
            access: Access::Uniform,
        },
    ];

    fn module() -> (naga::Module, ModuleInfo) {
        let module = naga::front::wgsl::parse_str(TEXT).expect("it parses");
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
        let info = validator.validate(&module).expect("it is valid");
        (module, info)
    }

    /// The instructions of a module: the opcode and the operands.
    fn instructions(words: &[u32]) -> Vec<(u16, Vec<u32>)> {
        let (mut found, mut at) = (Vec::new(), HEADER);
        while at < words.len() {
            let length = (words[at] >> 16) as usize;
            found.push((words[at] as u16, words[at + 1..at + length].to_vec()));
            at += length;
        }
        found
    }

    #[test]
    fn every_arithmetic_result_is_decorated_in_front_of_the_types() {
        let (module, info) = module();
        let words = words(&module, &info, &BINDINGS).expect("it is written");
        let instructions = instructions(&words);
        let decorated: Vec<u32> = instructions
            .iter()
            .filter(|(opcode, operands)| {
                u32::from(*opcode) == OP_DECORATE && operands[1..] == [NO_CONTRACTION]
            })
            .map(|(_, operands)| operands[0])
            .collect();
        // Negation, sum, difference, two products, a quotient (by a vector made of one number), an
        // inner product, and two sums more; the integers' product is none of them.
        let arithmetic: Vec<u32> = instructions
            .iter()
            .filter(|(opcode, _)| ARITHMETIC.contains(opcode))
            .map(|(_, operands)| operands[1])
            .collect();
        assert_eq!(decorated, arithmetic);
        assert!(arithmetic.len() >= 9, "{arithmetic:?}");
        let last = instructions
            .iter()
            .rposition(|(opcode, _)| u32::from(*opcode) == OP_DECORATE);
        let first_type = instructions
            .iter()
            .position(|(opcode, _)| *opcode == OP_TYPE_VOID);
        assert!(last < first_type, "{last:?} {first_type:?}");
    }

    #[test]
    fn buffers_are_numbered_as_wgpu_numbers_them() {
        let places = places(&[BINDINGS[2], BINDINGS[0], BINDINGS[1]]);
        let found: Vec<[u32; 2]> = places
            .iter()
            .map(|(declared, info)| [declared.binding, info.binding])
            .collect();
        assert_eq!(found, [[3, 0], [5, 1], [7, 2]]);
    }

    #[test]
    fn words_that_are_no_instructions_are_refused() {
        assert_eq!(decorate(&[0; HEADER]), None);
        assert_eq!(decorate(&[0, 0, 0, 0, 0, 0]), None);
        assert_eq!(decorate(&[0, 0, 0, 0, 0, 9 << 16 | 19, 1]), None);
        assert_eq!(decorate(&[0, 0, 0, 0, 0, 1 << 16 | 129]), None);
    }

    #[test]
    fn buffers_are_checked() {
        let (module, _) = module();
        let sizes = resources(&module, "k", &BINDINGS).expect("they fit");
        assert_eq!(sizes, [NonZeroU64::new(16); 3]);
        let refused = |bindings: &[Binding]| {
            resources(&module, "k", bindings)
                .expect_err("they do not")
                .to_string()
        };
        assert_eq!(
            refused(&BINDINGS[..2]),
            "the GPU refused a call: kernel `k`: `factor` in slot 7 is not among the bindings"
        );
        let other = Binding {
            slot: 5,
            access: Access::StorageRead,
        };
        assert_eq!(
            refused(&[BINDINGS[0], other, BINDINGS[2]]),
            "the GPU refused a call: kernel `k`: `made` in slot 5 has another access than its binding"
        );
    }

    #[test]
    fn workgroups_are_checked() {
        let (module, _) = module();
        let limits = Limits {
            buffer: 0,
            storage_binding: 0,
            uniform_binding: 0,
            storage_buffers: 0,
            workgroup_memory: 256,
            workgroup_invocations: 64,
            workgroups_per_axis: 0,
        };
        let check =
            |limits: &Limits, sides| check_workgroup(&module, "k", [64, 1, 1], limits, sides);
        assert_eq!(check(&limits, [64, 64, 64]), Ok(()));
        assert!(check(&limits, [32, 64, 64]).is_err());
        let fewer = Limits {
            workgroup_invocations: 63,
            ..limits
        };
        assert!(check(&fewer, [64, 64, 64]).is_err());
        let smaller = Limits {
            workgroup_memory: 255,
            ..limits
        };
        assert!(check(&smaller, [64, 64, 64]).is_err());
    }
}
