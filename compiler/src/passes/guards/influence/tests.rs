//! Checks influence boxes: values keep their distance from them at random points.

use super::InfluenceBoxes;
use crate::analysis::bounds::ShapeBounds;
use crate::analysis::slope::ShapeSlopes;
use crate::elaborate::{Loader, Options, elaborate};
use crate::graph::Purpose;
use crate::graph::{Graph, GraphNode};
use crate::lower::lower;
use crate::scene::SceneRef;
use crate::schedule::schedule;
use crate::uniforms::Uniforms;
use sdfc_lang::Sources;
use sdfc_vm::evaluate::evaluate_f64;
use std::path::{Path, PathBuf};

struct SceneFolder(PathBuf);

impl Loader for SceneFolder {
    fn load(&self, path: &str) -> Result<String, String> {
        std::fs::read_to_string(self.0.join(path)).map_err(|error| error.to_string())
    }
}

/// Returns the graph of a scene.
fn graph(path: &Path) -> Graph {
    let mut sources = Sources::new();
    let text = std::fs::read_to_string(path).expect("the scene can be read");
    let file = sources.add("test", text);
    let options = Options {
        loader: &SceneFolder(path.parent().expect("it lies in a folder").to_owned()),
        ..Options::default()
    };
    let (scene, found) = elaborate(&mut sources, file, &options);
    let mut scene = scene.unwrap_or_else(|| panic!("{}: {found:?}", path.display()));
    let root = scene.root.expect("the text ends with a shape");
    let mut uniforms = Uniforms::new(scene.params.iter().map(|param| param.value.len()));
    let mut boxes = ShapeBounds::for_all_params();
    let purpose = Purpose::Distance;
    let mut slopes = ShapeSlopes::new(SceneRef::from(&scene), 1.0, Vec::new());
    lower(
        &mut scene,
        root,
        purpose,
        &mut slopes,
        &mut uniforms,
        &mut boxes,
    )
    .0
}

/// Checks all boxes in the world's space, and returns their number.
fn check(path: &Path) -> usize {
    let graph = graph(path);
    // The cost grows with the square of the number of nodes.
    if graph.len() > 500 {
        return 0;
    }
    let influence_boxes = InfluenceBoxes::new(&graph);
    // `sdfc-trials` depends on this crate, so its generator cannot be used here.
    let mut state = 0x1234_5678_u64;
    let mut number = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1 << 30) - 1.0
    };
    let points: Vec<[f64; 3]> = (0..100)
        .map(|index| [0.7, 2.0, 6.0, 40.0][index % 4])
        .map(|size| [number() * size, number() * size, number() * size])
        .collect();
    let mut count = 0;
    for (id, _) in graph.nodes() {
        let Some(influence_box) = influence_boxes.outermost(id) else {
            continue;
        };
        if *graph.get(influence_box.space) != GraphNode::World {
            continue;
        }
        count += 1;
        let mut part = graph.clone();
        part.root = id;
        let program = schedule(&part);
        for &p in &points {
            let (value, distance_to_box) =
                (evaluate_f64(&program, p), influence_box.bounds.distance(p));
            assert!(
                distance_to_box == 0.0
                    || value
                        >= (influence_box.distance_ratio * distance_to_box - 1e-5) * (1.0 - 1e-5),
                "{}: %{} is {value} at {p:?}, {distance_to_box} from {influence_box:?}\n{}",
                path.display(),
                id.0,
                graph.dump()
            );
        }
    }
    count
}

#[test]
fn values_keep_their_distance_from_their_boxes() {
    let mut boxes = 0;
    for folder in ["../tests/scenes", "../examples"] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
        let entries = std::fs::read_dir(&folder).expect("the folder can be read");
        for entry in entries {
            let path = entry.expect("its entries too").path();
            if path.extension().is_some_and(|extension| extension == "sdf") {
                // Scenes nest as deep as the command line's stack allows.
                let tried = std::thread::Builder::new()
                    .stack_size(64 << 20)
                    .spawn(move || check(&path))
                    .expect("a thread can be started")
                    .join();
                boxes += tried.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            }
        }
    }
    assert!(boxes > 1000, "only {boxes} boxes in all scenes");
}
