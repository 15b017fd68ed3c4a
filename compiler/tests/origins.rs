//! Provenance of leaves: their numbers, their text and the expressions around them.

use sdfc_compiler::compile::{Options, compile};
use sdfc_compiler::elaborate::{self, NoFiles, elaborate};
use sdfc_compiler::provenance::{Provenance, compile_provenance};
use sdfc_compiler::scene::Scene;
use sdfc_lang::{Sources, Span};

fn scene(text: &str) -> (Scene, Sources) {
    let mut sources = Sources::new();
    let file = sources.add("scene.sdf", text);
    let options = elaborate::Options {
        overrides: Vec::new(),
        time: 0.0,
        loader: &NoFiles,
    };
    let (scene, diagnostics) = elaborate(&mut sources, file, &options);
    (
        scene.unwrap_or_else(|| panic!("{text}: {diagnostics:?}")),
        sources,
    )
}

fn leaves(text: &str) -> (Provenance, Sources) {
    let (scene, sources) = scene(text);
    let (origins, diagnostics) = compile_provenance(scene, &Options::default());
    (
        origins.unwrap_or_else(|| panic!("{text}: {diagnostics:?}")),
        sources,
    )
}

fn texts(sources: &Sources, spans: impl IntoIterator<Item = Span>) -> Vec<String> {
    let slices = spans.into_iter().map(|span| sources.slice(span).to_owned());
    slices.collect()
}

#[test]
fn leaves_are_numbered_in_the_order_of_the_text() {
    let (origins, sources) = leaves("sphere(1) | box(2).translate(3, 0, 0) | torus(2, 0.5)");
    let spans = (0..5).filter_map(|number| origins.leaf(number).map(|leaf| leaf.span));
    assert_eq!(
        texts(&sources, spans),
        ["sphere(1)", "box(2)", "torus(2, 0.5)"]
    );
    assert_eq!(origins.leaf(0), None);
    assert_eq!(origins.leaf(u32::MAX), None);
}

#[test]
fn each_copy_is_a_leaf_of_its_own_with_the_same_text() {
    let (origins, sources) = leaves(
        "let ball = sphere(0.4);\n\
         ball | ball.translate(2, 0, 0) | union(for i in 0..3 { box(0.5).translate(0, i + 1, 0) })",
    );
    let spans = origins.leaves.iter().map(|leaf| leaf.span);
    assert_eq!(
        texts(&sources, spans),
        [
            "sphere(0.4)",
            "sphere(0.4)",
            "box(0.5)",
            "box(0.5)",
            "box(0.5)"
        ]
    );
    assert_eq!(origins.name(&origins.leaves[1]), "ball");
}

#[test]
fn a_chain_leads_from_the_inside_out() {
    let (origins, sources) = leaves(
        "let arm = box(2).translate(1, 0, 0);\n\
         (arm |[0.1] sphere(1)).rotate(30deg, Y)",
    );
    let chain = origins.chain(&origins.leaves[0]);
    assert_eq!(
        texts(&sources, chain.map(|shape| shape.span)),
        [
            "box(2)",
            "box(2).translate(1, 0, 0)",
            "arm |[0.1] sphere(1)",
            "(arm |[0.1] sphere(1)).rotate(30deg, Y)",
        ]
    );
    assert_eq!(origins.name(&origins.leaves[0]), "arm");
    assert_eq!(origins.name(&origins.leaves[1]), "");
}

#[test]
fn the_distance_is_that_of_the_scene() {
    let text = "material red { color: #ff0000 }\n\
                param r = 1 in 0.5..=2;\n\
                (sphere(r).material(red) -[0.1] box(1).translate(1, 0, 0)) | plane(Y, at: -1)";
    let (origins, _) = leaves(text);
    let (plain, _) = compile(scene(text).0, &Options::default());
    let plain = plain.expect("compiles");
    let module = &origins.compiled.module;
    assert_eq!(module.distance, plain.module.distance);
    assert_eq!(module.settings.params, plain.module.settings.params);
}

#[test]
fn a_single_leaf_has_its_number_too() {
    let (origins, _) = leaves("sphere(1)");
    assert!(origins.compiled.module.surface.is_some());
    assert_eq!(origins.compiled.module.settings.materials, ["", ""]);
    let (nothing, diagnostics) = scene_of_nothing();
    assert!(
        nothing.is_none_or(|origins| origins.leaves.is_empty()),
        "{diagnostics}"
    );
}

fn scene_of_nothing() -> (Option<Provenance>, String) {
    let (origins, diagnostics) = compile_provenance(scene("union([])").0, &Options::default());
    (origins, format!("{diagnostics:?}"))
}

#[test]
fn a_hundred_thousand_leaves_are_distinguished() {
    let text =
        "union(for i in 0..500 { union(for j in 0..200 { sphere(0.4).translate(i, j, 0) }) })";
    let mut options = Options::default();
    options.passes.disable_all = true;
    let (origins, diagnostics) = compile_provenance(scene(text).0, &options);
    let origins = origins.unwrap_or_else(|| panic!("{diagnostics:?}"));
    assert_eq!(origins.leaves.len(), 100_000);
    let module = &origins.compiled.module;
    let last = module.surface.as_ref().is_some_and(|surface| {
        let numbers = surface.pool.iter().flatten();
        numbers.clone().any(|&number| number == 100_000.0)
    });
    assert!(last, "the last leaf has its number in the program");
}
