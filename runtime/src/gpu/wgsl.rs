//! Generated source on a GPU: the scene as straight-line WGSL, with the results of the uniform program in a
//! buffer.

use super::driver::{BindingAccess, Buffer, BufferBinding, BufferUsage, Gpu};
use super::kernel_cache::SceneWgsl;
use super::scene::{GpuScene, KernelMode, default_material_wgsl};
use crate::engine::{EngineError, EngineKind, SceneInput};
use sdfc_shaders::assemble::{FIRST_SCENE_SLOT, SceneFunction};
use sdfc_vm::program::Module;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// Maximum size, in vectors, of a uniform buffer that every device supports.
const MAX_UNIFORM_VECTORS: usize = 4096;

/// A scene's generated source and its buffers.
pub(super) struct GeneratedScene {
    text: String,
    calls: Vec<&'static str>,
    uniform_value_count: usize,
    buffers: Vec<(BufferBinding, Buffer)>,
}

impl GpuScene for GeneratedScene {
    const KIND: EngineKind = EngineKind::Wgsl;

    fn load(
        gpu: &Gpu,
        scene: &SceneInput<'_>,
        _: KernelMode,
        _: Option<Self>,
    ) -> Result<Self, EngineError> {
        let packed = pack_uniform_values(scene.uniform_values);
        let (usage, access) = if packed.len() <= MAX_UNIFORM_VECTORS {
            (BufferUsage::Uniform, BindingAccess::Uniform)
        } else {
            (BufferUsage::Storage, BindingAccess::StorageRead)
        };
        let buffer = gpu.buffer_with("uniforms", usage, &packed)?;
        Ok(Self {
            text: scene.generated.text.to_owned(),
            calls: scene.generated.calls.to_vec(),
            uniform_value_count: scene.uniform_values.len(),
            buffers: vec![(
                BufferBinding {
                    slot: FIRST_SCENE_SLOT,
                    access,
                },
                buffer,
            )],
        })
    }

    fn update(&mut self, gpu: &Gpu, _: &Module, uniform_values: &[f64]) -> Result<(), EngineError> {
        if uniform_values.len() != self.uniform_value_count {
            return Err(EngineError::SceneMismatch);
        }
        Ok(gpu.write(&self.buffers[0].1, &pack_uniform_values(uniform_values))?)
    }

    fn source(&self, functions: &[SceneFunction]) -> SceneWgsl {
        let roots: Vec<&str> = functions.iter().map(|function| function.name()).collect();
        let used_text = reachable(&self.text, &roots);
        let names: BTreeSet<&str> = identifiers(&used_text).collect();
        let calls = self
            .calls
            .iter()
            .copied()
            .filter(|name| names.contains(name))
            .collect();
        let count = self.uniform_value_count.div_ceil(4).max(1);
        let uniforms = if count <= MAX_UNIFORM_VECTORS {
            format!("var<uniform> uniforms: array<vec4f, {count}>;")
        } else {
            "var<storage, read> uniforms: array<vec4f>;".to_owned()
        };
        let default_material = default_material_wgsl(functions);
        let text = format!(
            "@group(0) @binding({FIRST_SCENE_SLOT}) {uniforms}\n\n{default_material}{used_text}"
        );
        SceneWgsl { text, calls }
    }

    fn buffers(&self) -> &[(BufferBinding, Buffer)] {
        &self.buffers
    }

    fn iterations(&self, _: SceneFunction) -> usize {
        0
    }
}

/// Packs the results of the uniform program into vectors of four.
fn pack_uniform_values(values: &[f64]) -> Vec<[f32; 4]> {
    let vectors = values
        .chunks(4)
        .map(|chunk| std::array::from_fn(|i| chunk.get(i).map_or(0.0, |&number| number as f32)));
    let mut packed: Vec<[f32; 4]> = vectors.collect();
    packed.resize(packed.len().max(1), [0.0; 4]);
    packed
}

/// Returns the declarations of a text that `roots` reach, in their order. In generated text, a declaration
/// begins in the first column and ends with a brace in the first column.
fn reachable(text: &str, roots: &[&str]) -> String {
    let mut declarations: Vec<(&str, String)> = Vec::new();
    for line in text.lines() {
        let declared = ["fn ", "struct ", "const "]
            .iter()
            .find_map(|kind| line.strip_prefix(kind));
        if let Some(remainder) = declared {
            declarations.push((
                identifiers(remainder).next().unwrap_or_default(),
                String::new(),
            ));
        }
        if let Some((_, declaration)) = declarations.last_mut() {
            let _ = writeln!(declaration, "{line}");
        }
    }
    let by_name: BTreeMap<&str, usize> = declarations
        .iter()
        .enumerate()
        .map(|(index, (name, _))| (*name, index))
        .collect();
    let mut reached = vec![false; declarations.len()];
    let mut open: Vec<usize> = roots
        .iter()
        .filter_map(|name| by_name.get(name).copied())
        .collect();
    while let Some(index) = open.pop() {
        if !std::mem::replace(&mut reached[index], true) {
            open.extend(
                identifiers(&declarations[index].1).filter_map(|word| by_name.get(word).copied()),
            );
        }
    }
    let kept = declarations
        .iter()
        .zip(&reached)
        .filter(|(_, reached)| **reached);
    kept.map(|((_, declaration), _)| declaration.as_str())
        .collect()
}

fn identifiers(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'))
        .filter(|word| !word.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_called_is_kept() {
        let text = "// A scene.\nstruct Pair {\n    a: f32,\n}\n\nfn low(x: f32) -> f32 {\n    \
                    return x;\n}\nfn unused(p: Pair) -> f32 {\n    return p.a;\n}\n\
                    fn scene_distance(p: vec3f) -> f32 {\n    return low(p.x);\n}\n\
                    fn scene_gradient(p: vec3f) -> vec4f {\n    return vec4f(unused(Pair(1.0)));\n}\n";
        assert_eq!(
            reachable(text, &["scene_distance"]),
            "fn low(x: f32) -> f32 {\n    return x;\n}\n\
             fn scene_distance(p: vec3f) -> f32 {\n    return low(p.x);\n}\n"
        );
        assert!(reachable(text, &["scene_gradient"]).starts_with("struct Pair {"));
    }

    #[test]
    fn numbers_are_padded_to_fours() {
        assert_eq!(pack_uniform_values(&[]), [[0.0; 4]]);
        assert_eq!(
            pack_uniform_values(&[1.0, 2.0, 3.0, 4.0, 5.0]),
            [[1.0, 2.0, 3.0, 4.0], [5.0, 0.0, 0.0, 0.0]]
        );
    }
}
