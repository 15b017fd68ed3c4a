//! Generated source on a GPU: the scene as straight-line WGSL, with the uniform program's results in
//! a buffer of their own.

use super::driver::{Form, OnDevice, SceneText, unpainted_surface};
use super::{EngineError, EngineKind, Loaded};
use crate::gpu::{Access, Binding, Buffer, Gpu, Usage};
use sdfc_shaders::assemble::{FIRST_SCENE_SLOT, SceneFunction};
use sdfc_vm::program::Module;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// The most vectors of a uniform buffer that every device allows.
const MOST_UNIFORM: usize = 4096;

/// A scene's generated source and what it reads.
pub(super) struct Generated {
    text: String,
    calls: Vec<&'static str>,
    outputs: usize,
    buffers: Vec<(Binding, Buffer)>,
}

impl OnDevice for Generated {
    const KIND: EngineKind = EngineKind::Wgsl;

    fn load(gpu: &Gpu, scene: &Loaded<'_>, _: Form, _: Option<Self>) -> Result<Self, EngineError> {
        let numbers = numbers(scene.outputs);
        let (usage, access) = if numbers.len() <= MOST_UNIFORM {
            (Usage::Uniform, Access::Uniform)
        } else {
            (Usage::Storage, Access::StorageRead)
        };
        let buffer = gpu.buffer_with("uniforms", usage, &numbers)?;
        Ok(Self {
            text: scene.generated.text.to_owned(),
            calls: scene.generated.calls.to_vec(),
            outputs: scene.outputs.len(),
            buffers: vec![(
                Binding {
                    slot: FIRST_SCENE_SLOT,
                    access,
                },
                buffer,
            )],
        })
    }

    fn update(&mut self, gpu: &Gpu, _: &Module, outputs: &[f64]) -> Result<(), EngineError> {
        if outputs.len() != self.outputs {
            return Err(EngineError::AnotherScene);
        }
        Ok(gpu.write(&self.buffers[0].1, &numbers(outputs))?)
    }

    fn source(&self, functions: &[SceneFunction]) -> SceneText {
        let wanted: Vec<&str> = functions.iter().map(|function| function.name()).collect();
        let called = reachable(&self.text, &wanted);
        let named: BTreeSet<&str> = words(&called).collect();
        let calls = self
            .calls
            .iter()
            .copied()
            .filter(|name| named.contains(name))
            .collect();
        let count = self.outputs.div_ceil(4).max(1);
        let uniforms = if count <= MOST_UNIFORM {
            format!("var<uniform> uniforms: array<vec4f, {count}>;")
        } else {
            "var<storage, read> uniforms: array<vec4f>;".to_owned()
        };
        let unpainted = unpainted_surface(functions);
        let text =
            format!("@group(0) @binding({FIRST_SCENE_SLOT}) {uniforms}\n\n{unpainted}{called}");
        SceneText { text, calls }
    }

    fn buffers(&self) -> &[(Binding, Buffer)] {
        &self.buffers
    }

    fn iterations(&self, _: SceneFunction) -> usize {
        0
    }
}

/// The results of the uniform program by fours.
fn numbers(outputs: &[f64]) -> Vec<[f32; 4]> {
    let fours = outputs
        .chunks(4)
        .map(|chunk| std::array::from_fn(|i| chunk.get(i).map_or(0.0, |&number| number as f32)));
    let mut numbers: Vec<[f32; 4]> = fours.collect();
    numbers.resize(numbers.len().max(1), [0.0; 4]);
    numbers
}

/// The declarations of a text that `wanted` reaches, in their order. A declaration of generated
/// text begins in the first column, and ends with a brace there.
fn reachable(text: &str, wanted: &[&str]) -> String {
    let mut declarations: Vec<(&str, String)> = Vec::new();
    for line in text.lines() {
        let declared = ["fn ", "struct ", "const "]
            .iter()
            .find_map(|kind| line.strip_prefix(kind));
        if let Some(rest) = declared {
            declarations.push((words(rest).next().unwrap_or_default(), String::new()));
        }
        if let Some((_, declaration)) = declarations.last_mut() {
            let _ = writeln!(declaration, "{line}");
        }
    }
    let by_name: BTreeMap<&str, usize> = declarations
        .iter()
        .enumerate()
        .map(|(at, (name, _))| (*name, at))
        .collect();
    let mut reached = vec![false; declarations.len()];
    let mut open: Vec<usize> = wanted
        .iter()
        .filter_map(|name| by_name.get(name).copied())
        .collect();
    while let Some(at) = open.pop() {
        if !std::mem::replace(&mut reached[at], true) {
            open.extend(words(&declarations[at].1).filter_map(|word| by_name.get(word).copied()));
        }
    }
    let kept = declarations
        .iter()
        .zip(&reached)
        .filter(|(_, reached)| **reached);
    kept.map(|((_, declaration), _)| declaration.as_str())
        .collect()
}

fn words(text: &str) -> impl Iterator<Item = &str> {
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
        assert_eq!(numbers(&[]), [[0.0; 4]]);
        assert_eq!(
            numbers(&[1.0, 2.0, 3.0, 4.0, 5.0]),
            [[1.0, 2.0, 3.0, 4.0], [5.0, 0.0, 0.0, 0.0]]
        );
    }
}
