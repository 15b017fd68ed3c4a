//! Output of each stage for each test scene, as snapshots: `tests/suite/snapshots/STAGE__SCENE`.

use crate::corpus::{compiled, name, on_large_stack, scene, scenes};
use sdfc_compiler::dump::dump;
use sdfc_compiler::export::{Target, module_text, translate};
use sdfc_compiler::passes::PassOptions;
use sdfc_compiler::raise::raise;
use sdfc_vm::file::{decode_file, encode_file};
use sdfc_vm::listing;
use sdfc_vm::program::{Opcode, Program};
use sdfc_vm::row::Category;
use sdfc_vm::table::{Op, ROWS};
use std::collections::BTreeSet;
use std::path::Path;

/// Reports whether the text of a scene is too long to be read.
fn is_long(path: &Path) -> bool {
    name(path) == "spheres_many"
}

fn check(stage: &str, path: &Path, text: &str) {
    insta::with_settings!({ prepend_module_to_snapshot => false, omit_expression => true }, {
        insta::assert_snapshot!(format!("{stage}__{}", name(path)), text);
    });
}

#[test]
fn scenes_graphs_listings_and_wgsl_are_as_they_were() {
    for path in scenes("tests/scenes").iter().filter(|path| !is_long(path)) {
        on_large_stack(|| {
            let compiled = compiled(path, PassOptions::default());
            check("scene", path, &dump(&scene(path)));
            check("graph", path, &compiled.graph.dump());
            check("optimized", path, &compiled.optimized.dump());
            check("asm", path, &listing::print(&compiled.module.distance));
            if let Some(surface) = &compiled.module.surface {
                check("asm_surface", path, &listing::print(surface));
            }
            check("wgsl", path, &module_text(&compiled));
        });
    }
}

#[test]
fn compiling_twice_gives_the_same_bytes() {
    for path in scenes("tests/scenes").iter().chain(&scenes("examples")) {
        on_large_stack(|| {
            let bytes = || encode_file(&compiled(path, PassOptions::default()).module);
            assert!(bytes() == bytes(), "{}", path.display());
        });
    }
}

#[test]
fn bytecode_files_hold_the_complete_module() {
    for path in scenes("tests/scenes").iter().chain(&scenes("examples")) {
        on_large_stack(|| {
            let compiled = compiled(path, PassOptions::default());
            let bytes = encode_file(&compiled.module);
            let decoded = decode_file(&bytes).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            assert!(decoded == compiled.module, "{}", path.display());
            // Raised to a graph and scheduled again: the same operations, possibly in another order that
            // keeps other values.
            let raised = raise(decoded);
            let again = sdfc_compiler::schedule::schedule(&raised.optimized);
            let operations = |program: &Program| -> Vec<Op> {
                let codes = program.code.iter().filter_map(|i| match i.code {
                    Opcode::Op(op) => Some(op),
                    _ => None,
                });
                let mut codes: Vec<Op> = codes.collect();
                codes.sort_by_key(|&op| op as usize);
                codes
            };
            let (was, is) = (operations(&compiled.module.distance), operations(&again));
            assert_eq!(was, is, "{}", path.display());
        });
    }
}

#[test]
fn every_example_can_be_written_in_every_shading_language() {
    let targets = [
        Target::Wgsl,
        Target::Glsl,
        Target::Hlsl,
        Target::Msl,
        Target::Spirv,
        Target::Shadertoy,
    ];
    for path in scenes("tests/scenes").iter().chain(&scenes("examples")) {
        let compiled = on_large_stack(|| compiled(path, PassOptions::default()));
        for target in targets {
            let text = translate(&compiled, target);
            let text = text.unwrap_or_else(|e| panic!("{} as {target:?}: {e}", path.display()));
            assert!(text.len() > 200, "{} as {target:?}", path.display());
        }
    }
}

#[test]
fn every_word_of_the_table_but_shapes_is_in_a_test_scene() {
    let mut seen = BTreeSet::new();
    for path in scenes("tests/scenes") {
        let compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        for (name, _) in sdfc_compiler::compile::operation_counts(&compiled.graph) {
            seen.insert(name);
        }
    }
    // `shapes::` draws every shape.
    let is_word = |category| {
        !matches!(
            category,
            Category::Internal | Category::Shape3 | Category::Shape2
        )
    };
    let words = ROWS.iter().filter(|row| is_word(row.facts.category));
    let missing: Vec<&str> = words
        .map(|row| row.name)
        .filter(|name| !seen.contains(name))
        .collect();
    // A constant is not an operation of a graph.
    assert_eq!(missing, ["constant"], "rows without a test scene");
}
