//! Metamorphic tests: a picture depends only on the meaning of a scene.
//!
//! Random scenes are drawn with cells and without, with each pass left out, and from equivalent texts
//! ([`scene::Rewrite`]). Hand-written pairs of equivalent texts are in `tests/pairs`. All must give the
//! same picture, with lights, shadows and occlusion.
//!
//! `SDFC_FUZZ=1000000` draws 1,000 random scenes; `SDFC_FUZZ=1000 SDFC_FUZZ_FROM=seed` draws the one of a
//! seed.

pub(crate) mod compare;
pub(crate) mod draw;
mod grow;
mod pairs;
mod scene;
mod shrink;

use compare::{Differences, Picture, compare, compare_finely};
use draw::{DrawOptions, draw};
use scene::{Body, Head, Rewrite};
use sdfc_compiler::passes::{PASSES, PassOptions};
use sdfc_runtime::engine::{Engine, EngineKind, open};
use sdfc_runtime::render::CellMode;
use sdfc_trials::campaign::{self, CheckOutcome, Describe};
use sdfc_trials::skip::is_gpu_skipped;
use std::fmt::Write as _;

/// Size of the pictures.
const SIZE: [u32; 2] = [64, 48];
/// Factor of the size of finer pictures, which show what is narrower than a pixel.
const FINE_SCALE: u32 = 8;
/// Number of random scenes in an ordinary run, and their cost relative to a damaged text.
const SCENES: u64 = 60;
const COST: u64 = 1000;
/// Number of random scenes drawn on software devices, and their relative cost.
const DEVICE_SCENES: u64 = 3;
const DEVICE_COST: u64 = 20_000;
/// One in this number of variants is drawn of each scene.
const VARIANT_STRIDE: u64 = 5;

/// A random scene.
struct RandomScene {
    head: Head,
    body: Body,
}

impl Describe for RandomScene {
    fn describe(&self) -> String {
        scene::text(&self.head, &self.body, Rewrite::Plain)
    }
}

fn random_scene(seed: u64) -> RandomScene {
    let (head, body) = grow::grow(seed);
    RandomScene { head, body }
}

/// Returns the options for drawing without cells, with all passes.
fn plain_options() -> DrawOptions {
    DrawOptions {
        size: SIZE,
        passes: PassOptions::default(),
        cells: CellMode::Never,
        scale: 1.0,
    }
}

/// A variant of a scene that must give the same picture.
struct Variant {
    name: String,
    rewrite: Rewrite,
    options: DrawOptions,
}

/// Returns the variants of a scene.
fn variants(head: &Head) -> Vec<Variant> {
    let mut variants = Vec::new();
    let mut drawn = |name: &str, without: &[&str], none, cells| {
        let without = without.iter().map(|pass| (*pass).to_owned()).collect();
        let options = DrawOptions {
            passes: PassOptions {
                disable_all: none,
                disabled: without,
            },
            cells,
            ..plain_options()
        };
        variants.push(Variant {
            name: name.to_owned(),
            rewrite: Rewrite::Plain,
            options,
        });
    };
    for pass in PASSES.iter().filter(|pass| !pass.needs_lod_target) {
        let name = format!("without the pass {}", pass.name);
        drawn(&name, &[pass.name], false, CellMode::Never);
    }
    drawn("with cells", &[], false, CellMode::Always);
    drawn("-O0", &[], true, CellMode::Never);
    drawn("-O0 with cells", &[], true, CellMode::Always);
    for rewrite in rewrites(head) {
        for cells in [CellMode::Never, CellMode::Always] {
            let scale = rewrite.scale();
            let options = DrawOptions {
                scale,
                cells,
                ..plain_options()
            };
            let name = format!("{rewrite:?}, cells {cells:?}");
            variants.push(Variant {
                name,
                rewrite,
                options,
            });
        }
    }
    variants
}

/// Returns the rewrites that preserve the picture of a scene.
fn rewrites(head: &Head) -> Vec<Rewrite> {
    let mut rewrites = vec![
        Rewrite::Multiplied(0.01),
        Rewrite::Multiplied(100.0),
        Rewrite::Stated(1.0),
        Rewrite::Stated(5.0),
        Rewrite::Stated(50.0),
        Rewrite::Bracketed,
        Rewrite::Moved,
        Rewrite::Turned,
        Rewrite::Resized,
        Rewrite::Complemented,
        Rewrite::World(10.0),
        Rewrite::World(0.125),
        Rewrite::Shifted,
    ];
    // The default light, the directions of many occlusion taps and the points on the rims of lights do
    // not rotate with the scene.
    if !head.lights.is_empty() && head.occlusion != "6" && !head.has_rims() {
        rewrites.push(Rewrite::Rotated);
    }
    rewrites
}

/// Returns the difference between the picture of a scene and that of a variant, if there is one.
fn difference(
    engine: &mut dyn Engine,
    base: &Picture,
    (head, body): (&Head, &Body),
    variant: &Variant,
) -> Option<String> {
    let text = scene::text(head, body, variant.rewrite);
    let other = match draw(engine, &text, &variant.options) {
        Ok(picture) => picture,
        Err(errors) => return Some(errors),
    };
    let mut mismatch = compare(base, &other);
    if mismatch.count() > 0 {
        let plain = scene::text(head, body, Rewrite::Plain);
        let fine_base = draw_finely(engine, &plain, &plain_options());
        let fine_other = draw_finely(engine, &text, &variant.options);
        mismatch = compare_finely([base, &other], [&fine_base, &fine_other]);
    }
    described(&mismatch, base, &other)
}

/// Draws a text in the size of finer pictures.
fn draw_finely(engine: &mut dyn Engine, text: &str, options: &DrawOptions) -> Picture {
    let options = DrawOptions {
        size: options.size.map(|pixels| pixels * FINE_SCALE),
        ..options.clone()
    };
    draw(engine, text, &options).unwrap_or_else(|errors| panic!("{errors}"))
}

/// Describes the differences of a picture from the first one, if there are any.
fn described(mismatch: &Differences, base: &Picture, other: &Picture) -> Option<String> {
    (mismatch.count() > 0 || other.lost > base.lost).then(|| {
        format!(
            "{mismatch:?}, {} rays lost, {} before",
            other.lost, base.lost
        )
    })
}

/// Reports the variants whose pictures differ, each with a minimal failing scene.
fn faults(engine: &mut dyn Engine, random_scene: &RandomScene, variants: &[Variant]) -> String {
    let RandomScene { head, body } = random_scene;
    let text = scene::text(head, body, Rewrite::Plain);
    let base = draw(engine, &text, &plain_options()).unwrap_or_else(|errors| panic!("{errors}"));
    let mut report = String::new();
    for variant in variants {
        let Some(mismatch) = difference(engine, &base, (head, body), variant) else {
            continue;
        };
        _ = writeln!(report, "{}: {mismatch}", variant.name);
        if report.lines().count() > 1 {
            continue;
        }
        let (head, body) = shrink::shrink(head, body, |head, body| {
            if variant.rewrite != Rewrite::Plain && !rewrites(head).contains(&variant.rewrite) {
                return false;
            }
            let text = scene::text(head, body, Rewrite::Plain);
            draw(engine, &text, &plain_options())
                .is_ok_and(|base| difference(engine, &base, (head, body), variant).is_some())
        });
        report += &scene::text(&head, &body, variant.rewrite);
    }
    report
}

#[test]
fn a_picture_depends_on_nothing_but_the_scene() {
    let check = |random_scene: &RandomScene| {
        let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
        let mut variants = variants(&random_scene.head);
        // Each scene selects a different subset.
        let mut index = random_scene.body.seed;
        variants.retain(|_| {
            index += 1;
            index.is_multiple_of(VARIANT_STRIDE)
        });
        let report = faults(&mut *engine, random_scene, &variants);
        assert!(report.is_empty(), "\n{report}");
        CheckOutcome::Accepted
    };
    campaign::run(
        "metamorphic",
        campaign::input_count(SCENES, COST),
        random_scene,
        check,
    );
}

#[test]
fn a_picture_does_not_depend_on_the_engine() {
    if is_gpu_skipped() {
        return;
    }
    let check = |RandomScene { head, body }: &RandomScene| {
        let text = scene::text(head, body, Rewrite::Plain);
        let pictures = EngineKind::FAST.map(|kind| {
            let mut engine = open(kind).unwrap_or_else(|error| panic!("{kind}: {error}"));
            let picture = draw(&mut *engine, &text, &plain_options());
            (kind, picture.unwrap_or_else(|errors| panic!("{errors}")))
        });
        let mut report = String::new();
        for (kind, picture) in &pictures[1..] {
            let mismatch = compare(&pictures[0].1, picture);
            if let Some(description) = described(&mismatch, &pictures[0].1, picture) {
                _ = writeln!(report, "{kind}: {description}");
            }
        }
        assert!(report.is_empty(), "\n{report}");
        CheckOutcome::Accepted
    };
    let count = campaign::input_count(DEVICE_SCENES, DEVICE_COST);
    campaign::run("engines", count, random_scene, check);
}
