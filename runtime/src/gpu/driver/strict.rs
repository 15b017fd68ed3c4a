//! Strict kernels: SPIR-V in which no float operation may be fused with another, reordered or simplified.
//! Every device that rounds correctly then produces the bits of Rust's `f32`.
//!
//! WGSL allows a driver to contract `a * b + c` and to reassociate sums, and drivers do. SPIR-V's decoration
//! `NoContraction` forbids both for the decorated instruction; WGSL has no equivalent. Therefore naga writes
//! the module here, with the options that wgpu would use. [`decorate`] adds the decoration to the result of
//! every arithmetic instruction on floats, and the words go to the driver unchanged.
//!
//! wgpu does not check words that are passed through, so this module performs all checks. naga validated the
//! text. The bindings are those the module declares, with the access and at least the size it declares
//! ([`binding_sizes`]). Workgroups keep the device's limits ([`check_workgroup`]). naga's writer adds what
//! wgpu requires: clamped indices, loops that end, no division of integers by zero, zeroed workgroup memory.
//!
//! [`conformance`] tests the rounding of single operations before anything else runs. On devices that round
//! quotients and roots by rules of their own, kernels call the functions of [`rounding`] instead. Backends
//! without SPIR-V use the portable form of [`rewriter`]. Both forms are limited to the operations that
//! [`exact`] allows.

pub(super) mod conformance;
pub(super) mod exact;
pub(super) mod rewriter;
pub(super) mod rounding;

use std::num::NonZeroU64;

use naga::back::spv;
use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
use naga::valid::ModuleInfo;
use naga::{AddressSpace, ResourceBinding, StorageAccess};

use super::device::DeviceLimits;
use super::error::within;
use super::{BindingAccess, BufferBinding, GpuError};

/// The group of all buffers.
const GROUP: u32 = 0;

/// Number of words in front of a module's first instruction.
const HEADER_WORDS: usize = 5;
const OP_TYPE_VOID: u16 = 19;
const OP_TYPE_FORWARD_POINTER: u16 = 39;
const OP_DECORATE: u32 = 71;
const NO_CONTRACTION: u32 = 42;

/// The arithmetic instructions on floats of the SPIR-V specification, section 3.42.13, to which
/// `NoContraction` applies. Square roots, minima and roundings belong to an extended instruction set; they
/// are exact or nothing that a driver may combine.
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

/// Writes the SPIR-V of a kernel whose float arithmetic is done as written.
pub(super) fn spirv_words(
    module: &naga::Module,
    info: &ModuleInfo,
    bindings: &[BufferBinding],
) -> Result<Vec<u32>, GpuError> {
    let internal = |text: String| GpuError::Internal(format!("strict kernels: {text}"));
    let options = spv::Options {
        // Every Vulkan driver supports the first version.
        lang_version: (1, 0),
        flags: spv::WriterFlags::empty(),
        fake_missing_bindings: false,
        binding_map: binding_map(bindings),
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

/// Returns the binding numbers of the buffers in Vulkan: wgpu numbers them in the order of their slots.
fn binding_map(bindings: &[BufferBinding]) -> spv::BindingMap {
    let mut slots: Vec<u32> = bindings.iter().map(|binding| binding.slot).collect();
    slots.sort_unstable();
    (0..)
        .zip(slots)
        .map(|(index, slot)| {
            let declared = ResourceBinding {
                group: GROUP,
                binding: slot,
            };
            let info = spv::BindingInfo {
                descriptor_set: GROUP,
                binding: index,
                binding_array_size: None,
            };
            (declared, info)
        })
        .collect()
}

/// Adds `OpDecorate … NoContraction` for the result of every arithmetic instruction on floats. Returns `None`
/// if the words are not a sequence of instructions with a type among them.
fn decorate(words: &[u32]) -> Option<Vec<u32>> {
    let mut decorations = Vec::new();
    // Decorations must precede all types.
    let mut first_type = None;
    let mut position = HEADER_WORDS;
    while position < words.len() {
        let (length, opcode) = ((words[position] >> 16) as usize, words[position] as u16);
        let instruction = words
            .get(position..position + length)
            .filter(|_| length > 0)?;
        if (OP_TYPE_VOID..=OP_TYPE_FORWARD_POINTER).contains(&opcode) {
            first_type.get_or_insert(position);
        }
        if ARITHMETIC.contains(&opcode) {
            // The words are the opcode, the result's type, the result.
            decorations.extend([3 << 16 | OP_DECORATE, *instruction.get(2)?, NO_CONTRACTION]);
        }
        position += length;
    }
    let first_type = first_type?;
    let mut decorated = Vec::with_capacity(words.len() + decorations.len());
    decorated.extend_from_slice(&words[..first_type]);
    decorated.extend(decorations);
    decorated.extend_from_slice(&words[first_type..]);
    Some(decorated)
}

/// Returns the minimum size of each binding's buffer in bytes; `None` for bindings that the module does not
/// declare. A module whose buffers are not among the bindings, or have another access there, is
/// [`GpuError::Validation`].
pub(super) fn binding_sizes(
    module: &naga::Module,
    label: &str,
    bindings: &[BufferBinding],
) -> Result<Vec<Option<NonZeroU64>>, GpuError> {
    let mut sizes = vec![None; bindings.len()];
    for (_, variable) in module.global_variables.iter() {
        let Some(declared) = &variable.binding else {
            continue;
        };
        let name = variable.name.as_deref().unwrap_or_default();
        let validation_error = |text: &str| {
            let slot = declared.binding;
            GpuError::Validation(format!("kernel `{label}`: `{name}` in slot {slot} {text}"))
        };
        let position = bindings
            .iter()
            .position(|binding| declared.group == GROUP && binding.slot == declared.binding);
        let index = position.ok_or_else(|| validation_error("is not among the bindings"))?;
        let access = match variable.space {
            AddressSpace::Uniform => BindingAccess::Uniform,
            AddressSpace::Storage { access } if access.contains(StorageAccess::STORE) => {
                BindingAccess::StorageReadWrite
            }
            AddressSpace::Storage { .. } => BindingAccess::StorageRead,
            _ => return Err(validation_error("is no buffer")),
        };
        if access != bindings[index].access {
            return Err(validation_error("has another access than its binding"));
        }
        let size = module.types[variable.ty]
            .inner
            .try_size(module.to_ctx())
            .ok_or_else(|| validation_error("is too large"))?;
        sizes[index] = NonZeroU64::new(size.into());
    }
    Ok(sizes)
}

/// Fails if a workgroup has more invocations or memory than the device allows.
pub(super) fn check_workgroup(
    module: &naga::Module,
    label: &str,
    size: [u32; 3],
    limits: &DeviceLimits,
    sides: [u32; 3],
) -> Result<(), GpuError> {
    for (side, max) in size.into_iter().zip(sides) {
        let what = format!("a side of a workgroup of kernel `{label}`");
        within(what, side.into(), max.into())?;
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
            // Each variable begins at a multiple of 16 at worst.
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

    const BINDINGS: [BufferBinding; 3] = [
        BufferBinding {
            slot: 3,
            access: BindingAccess::StorageRead,
        },
        BufferBinding {
            slot: 5,
            access: BindingAccess::StorageReadWrite,
        },
        BufferBinding {
            slot: 7,
            access: BindingAccess::Uniform,
        },
    ];

    fn module() -> (naga::Module, ModuleInfo) {
        let module = naga::front::wgsl::parse_str(TEXT).expect("it parses");
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
        let info = validator.validate(&module).expect("it is valid");
        (module, info)
    }

    /// Splits a module into its instructions: opcode and operands.
    fn instructions(words: &[u32]) -> Vec<(u16, Vec<u32>)> {
        let (mut instructions, mut position) = (Vec::new(), HEADER_WORDS);
        while position < words.len() {
            let length = (words[position] >> 16) as usize;
            instructions.push((
                words[position] as u16,
                words[position + 1..position + length].to_vec(),
            ));
            position += length;
        }
        instructions
    }

    #[test]
    fn every_arithmetic_result_is_decorated_in_front_of_the_types() {
        let (module, info) = module();
        let words = spirv_words(&module, &info, &BINDINGS).expect("it is written");
        let instructions = instructions(&words);
        let decorated: Vec<u32> = instructions
            .iter()
            .filter(|(opcode, operands)| {
                u32::from(*opcode) == OP_DECORATE && operands[1..] == [NO_CONTRACTION]
            })
            .map(|(_, operands)| operands[0])
            .collect();
        // Negation, sum, difference, two products, a quotient (by a vector made of one number), an inner
        // product, and two more sums. The integer product is not decorated.
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
        let map = binding_map(&[BINDINGS[2], BINDINGS[0], BINDINGS[1]]);
        let numbers: Vec<[u32; 2]> = map
            .iter()
            .map(|(declared, info)| [declared.binding, info.binding])
            .collect();
        assert_eq!(numbers, [[3, 0], [5, 1], [7, 2]]);
    }

    #[test]
    fn words_that_are_no_instructions_are_refused() {
        assert_eq!(decorate(&[0; HEADER_WORDS]), None);
        assert_eq!(decorate(&[0, 0, 0, 0, 0, 0]), None);
        assert_eq!(decorate(&[0, 0, 0, 0, 0, 9 << 16 | 19, 1]), None);
        assert_eq!(decorate(&[0, 0, 0, 0, 0, 1 << 16 | 129]), None);
    }

    #[test]
    fn buffers_are_checked() {
        let (module, _) = module();
        let sizes = binding_sizes(&module, "k", &BINDINGS).expect("they fit");
        assert_eq!(sizes, [NonZeroU64::new(16); 3]);
        let refused = |bindings: &[BufferBinding]| {
            binding_sizes(&module, "k", bindings)
                .expect_err("they do not")
                .to_string()
        };
        assert_eq!(
            refused(&BINDINGS[..2]),
            "the GPU refused a call: kernel `k`: `factor` in slot 7 is not among the bindings"
        );
        let other = BufferBinding {
            slot: 5,
            access: BindingAccess::StorageRead,
        };
        assert_eq!(
            refused(&[BINDINGS[0], other, BINDINGS[2]]),
            "the GPU refused a call: kernel `k`: `made` in slot 5 has another access than its binding"
        );
    }

    #[test]
    fn workgroups_are_checked() {
        let (module, _) = module();
        let limits = DeviceLimits {
            buffer: 0,
            storage_binding: 0,
            uniform_binding: 0,
            storage_buffers: 0,
            workgroup_memory: 256,
            workgroup_invocations: 64,
            workgroups_per_axis: 0,
        };
        let check =
            |limits: &DeviceLimits, sides| check_workgroup(&module, "k", [64, 1, 1], limits, sides);
        assert_eq!(check(&limits, [64, 64, 64]), Ok(()));
        assert!(check(&limits, [32, 64, 64]).is_err());
        let fewer = DeviceLimits {
            workgroup_invocations: 63,
            ..limits
        };
        assert!(check(&fewer, [64, 64, 64]).is_err());
        let smaller = DeviceLimits {
            workgroup_memory: 255,
            ..limits
        };
        assert!(check(&smaller, [64, 64, 64]).is_err());
    }
}
