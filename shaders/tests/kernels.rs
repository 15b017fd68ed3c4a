//! Every kernel validates, contains only the code of its features, and has the data layout of Rust.

use naga::valid::{Capabilities, ValidationFlags, Validator};
use sdfc_shaders::assemble::{
    BufferAccess, RenderStage, SceneFunction, SceneSource, StageKernel, kernel, stages,
};
use sdfc_shaders::features::{Features, Mode, Normals, Occlusion, ShadowForm};
use sdfc_shaders::interpreter::split_cells::PruneMethod;
use sdfc_shaders::interpreter::tape::KernelRegisters;
use sdfc_shaders::interpreter::{ConstantLayout, ProgramStorage, split_cells};
use sdfc_shaders::layout::{
    CellJob, FrameUniforms, LightRecord, OcclusionState, RayState, ShadowRayState, SplitParams,
    Surface,
};
use sdfc_vm::blend::BlendKernel as Blend;
use sdfc_vm::program::{KernelRequirements, Opcode};
use std::collections::BTreeSet;

const SCENE: &str = "
fn scene_distance(p: vec3f) -> f32 { return length3(p) - 1.0; }
fn scene_gradient(p: vec3f) -> vec4f { return vec4f(p, length3(p) - 1.0); }
";
const MATERIALS: &str = "
fn scene_surface(p: vec3f, n: vec3f) -> Surface {
    return Surface(abs(n), 0.5, vec3f(0.0), 0.0, vec3f(0.0), 1.0);
}
";

fn trivial(stage: RenderStage, features: &Features) -> StageKernel {
    let mut text = SCENE.to_owned();
    if stage
        .scene_functions(features)
        .contains(&SceneFunction::Surface)
    {
        text.push_str(MATERIALS);
    }
    kernel(
        stage,
        features,
        &SceneSource {
            text: &text,
            calls: &["length3"],
        },
    )
}

fn validated(kernel: &StageKernel) -> naga::Module {
    validated_text(kernel.label, &kernel.text)
}

fn validated_text(label: &str, text: &str) -> naga::Module {
    let module = naga::front::wgsl::parse_str(text)
        .unwrap_or_else(|error| panic!("{}\n{text}", error.emit_to_string_with_path(text, label)));
    Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(&module)
        .unwrap_or_else(|error| panic!("{}", error.emit_to_string(text)));
    module
}

const MODES: [Mode; 9] = [
    Mode::Shaded,
    Mode::Albedo,
    Mode::Normal,
    Mode::Depth,
    Mode::Steps,
    Mode::Distance,
    Mode::Id,
    Mode::Mask,
    Mode::Edges,
];
const NORMALS: [Normals; 6] = [
    Normals::Exact,
    Normals::Forward,
    Normals::Central,
    Normals::Reverse,
    Normals::Tetrahedron,
    Normals::Wide,
];
const SHADOWS: [ShadowForm; 5] = [
    ShadowForm::None,
    ShadowForm::Hard,
    ShadowForm::Plain,
    ShadowForm::Soft,
    ShadowForm::Sized,
];

/// Returns features that together use every line of every kernel.
fn variants() -> Vec<Features> {
    let everything = Features {
        mode: Mode::Shaded,
        lights: SHADOWS.to_vec(),
        occlusion: Occlusion::Multi(16),
        normals: Normals::Exact,
        materials: true,
        fog: true,
        has_half_spaces: true,
        proves_steps: true,
        is_2d: false,
        generic: false,
    };
    let mut variants = vec![Features::default(), everything.clone()];
    for mode in MODES {
        for is_2d in [false, true] {
            for materials in [false, true] {
                variants.push(Features {
                    mode,
                    is_2d,
                    materials,
                    ..everything.clone()
                });
            }
        }
    }
    variants.extend(NORMALS.map(|normals| Features {
        normals,
        ..everything.clone()
    }));
    variants.extend(SHADOWS.map(|form| Features {
        lights: vec![form],
        ..Features::default()
    }));
    for occlusion in [Occlusion::Off, Occlusion::FiveTap, Occlusion::Multi(4)] {
        variants.push(Features {
            occlusion,
            ..Features::default()
        });
    }
    variants
}

/// Returns each variant with the features of its kernels: its own, and the generic ones.
fn variants_and_forms() -> impl Iterator<Item = (Features, Features)> {
    variants().into_iter().flat_map(|features| {
        let specialized = Features {
            materials: true,
            generic: true,
            ..features.clone()
        };
        let generic = features.for_generic_kernels();
        [(features.clone(), features), (specialized, generic)]
    })
}

#[test]
fn all_kernels_validate() {
    for (specialized, features) in variants_and_forms() {
        for stage in stages(&specialized) {
            let kernel = trivial(stage, &features);
            let module = validated(&kernel);
            let declared: BTreeSet<u32> = module
                .global_variables
                .iter()
                .filter_map(|(_, variable)| variable.binding.map(|binding| binding.binding))
                .collect();
            let listed: BTreeSet<u32> = kernel
                .bindings
                .iter()
                .map(|&(slot, _)| slot as u32)
                .collect();
            assert_eq!(declared, listed, "{features:?} {}", kernel.label);
            let storage = kernel
                .bindings
                .iter()
                .filter(|(_, access)| *access != BufferAccess::Uniform)
                .count();
            // The scene has four more.
            let max_storage = if stage.scene_functions(&features).is_empty() {
                8
            } else {
                4
            };
            assert!(
                storage <= max_storage,
                "{} binds {storage} storage buffers",
                kernel.label
            );
            assert_eq!(module.entry_points.len(), 1);
            assert_eq!(module.entry_points[0].workgroup_size, [64, 1, 1]);
        }
    }
}

#[test]
fn layouts_are_those_of_rust() {
    let features = Features {
        lights: vec![ShadowForm::Hard],
        materials: true,
        ..Features::default()
    };
    let mut seen = BTreeSet::new();
    for stage in stages(&features) {
        let module = validated(&trivial(stage, &features));
        for (_, ty) in module.types.iter() {
            let (Some(name), naga::TypeInner::Struct { members, span }) = (&ty.name, &ty.inner)
            else {
                continue;
            };
            let (size, offsets) = match name.as_str() {
                "FrameUniforms" => (size_of::<FrameUniforms>(), FrameUniforms::OFFSETS),
                "LightRecord" => (size_of::<LightRecord>(), LightRecord::OFFSETS),
                "RayState" => (size_of::<RayState>(), RayState::OFFSETS),
                "OcclusionState" => (size_of::<OcclusionState>(), OcclusionState::OFFSETS),
                "ShadowRayState" => (size_of::<ShadowRayState>(), ShadowRayState::OFFSETS),
                "Surface" => (size_of::<Surface>(), Surface::OFFSETS),
                _ => continue,
            };
            assert_eq!(*span as usize, size, "the size of {name}");
            let in_wgsl: Vec<(&str, usize)> = members
                .iter()
                .map(|member| (member.name.as_deref().unwrap_or(""), member.offset as usize))
                .collect();
            assert_eq!(in_wgsl, offsets, "the fields of {name}");
            seen.insert(name.clone());
        }
    }
    assert_eq!(seen.len(), 5, "{seen:?}");
}

/// Returns requirements of programs, from the least to all.
fn requirements() -> [KernelRequirements; 3] {
    let sphere = Opcode::from_name("sphere").expect("there is a sphere");
    let least = KernelRequirements {
        codes: vec![sphere],
        ..KernelRequirements::default()
    };
    let blended = KernelRequirements {
        blend_kernels: vec![Blend::Quadratic],
        ..least.clone()
    };
    [least, blended, KernelRequirements::all()]
}

#[test]
fn kernels_that_cut_cells_validate() {
    let storage = |module: &naga::Module| {
        let variables = module.global_variables.iter();
        let is_storage = |space| matches!(space, naga::AddressSpace::Storage { .. });
        variables.filter(|(_, v)| is_storage(v.space)).count()
    };
    let memories = [
        ProgramStorage::Uniform {
            code: 64,
            pool: 256,
        },
        ProgramStorage::Storage,
    ];
    let small = KernelRegisters {
        values: 4,
        points: 2,
    };
    let large = KernelRegisters {
        values: 128,
        points: 32,
    };
    let combinations = memories.map(|memory| [small, large].map(|registers| (memory, registers)));
    for requirements in requirements() {
        for (memory, registers) in combinations.into_iter().flatten() {
            for method in [PruneMethod::Lipschitz, PruneMethod::Interval] {
                let text = split_cells::kernel(
                    &requirements,
                    registers,
                    ConstantLayout::for_requirements(&requirements),
                    memory,
                    method,
                );
                let module = validated_text("split_cells", &text);
                assert!(storage(&module) <= split_cells::MAX_STORAGE_BUFFERS as usize);
                assert_eq!(module.entry_points[0].workgroup_size, [64, 1, 1]);
                check_layout(
                    &module,
                    "SplitParams",
                    size_of::<SplitParams>(),
                    SplitParams::OFFSETS,
                );
                check_layout(&module, "CellJob", size_of::<CellJob>(), CellJob::OFFSETS);
            }
        }
    }
    assert_eq!(
        storage(&validated_text("plan_dispatch", &split_cells::plan())),
        3
    );
}

/// Compares a struct of a kernel with that of Rust.
fn check_layout(module: &naga::Module, name: &str, size: usize, offsets: &[(&str, usize)]) {
    let structure = module.types.iter().find_map(|(_, ty)| match &ty.inner {
        naga::TypeInner::Struct { members, span } if ty.name.as_deref() == Some(name) => {
            Some((members, *span))
        }
        _ => None,
    });
    let (members, span) = structure.unwrap_or_else(|| panic!("there is no {name}"));
    let in_wgsl: Vec<(&str, usize)> = members
        .iter()
        .map(|member| (member.name.as_deref().unwrap_or(""), member.offset as usize))
        .collect();
    assert_eq!((span as usize, &*in_wgsl), (size, offsets), "{name}");
}

/// Returns the names of a kernel's functions, without those of the scene.
fn functions(kernel: &StageKernel) -> String {
    let names = kernel
        .text
        .lines()
        .filter_map(|line| line.strip_prefix("fn ")?.split('(').next());
    names
        .filter(|name| !name.starts_with("scene_"))
        .collect::<Vec<_>>()
        .join(" ")
}

#[test]
fn kernels_contain_what_is_used() {
    let plain = Features::default();
    let rich = Features {
        lights: vec![ShadowForm::Soft, ShadowForm::Sized],
        occlusion: Occlusion::Multi(16),
        normals: Normals::Tetrahedron,
        materials: true,
        fog: true,
        has_half_spaces: true,
        ..Features::default()
    };
    let mut text = String::new();
    for (title, features) in [("plain", plain), ("rich", rich)] {
        for stage in stages(&features) {
            let kernel = trivial(stage, &features);
            text.push_str(&format!(
                "{title} {}: {}\n",
                kernel.label,
                functions(&kernel)
            ));
        }
    }
    insta::assert_snapshot!(text);
}

#[test]
fn the_march_reads_well() {
    insta::assert_snapshot!(trivial(RenderStage::March, &Features::default()).text);
}

#[test]
fn the_plainest_shading_reads_well() {
    insta::assert_snapshot!(trivial(RenderStage::Shade, &Features::default()).text);
}
