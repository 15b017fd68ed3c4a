//! Metamorphic tests: a picture depends on what a scene means, and on nothing else.
//!
//! Random scenes are drawn with cells and without, with each pass left out, and from texts that mean the same
//! ([`scene::Rewrite`]). Pairs of texts that people wrote stand in `tests/pairs`. All must be the same picture, with
//! lights, shadows and occlusion.
//!
//! `SDFC_FUZZ=1000000` draws 1,000 random scenes; `SDFC_FUZZ=1000 SDFC_FUZZ_FROM=seed` draws the one of a seed.

mod compare;
pub(crate) mod draw;
mod grow;
mod pairs;
mod scene;
mod shrink;

use compare::{Picture, compare};
use draw::{Way, draw};
use scene::{Body, Head, Rewrite};
use sdfc_compiler::passes::{PASSES, PassOptions};
use sdfc_runtime::engine::{Engine, EngineKind, open};
use sdfc_runtime::frame::CellUse;
use sdfc_trials::campaign::{self, Shown, Verdict};
use std::fmt::Write as _;

/// The size of pictures.
const SIZE: [u32; 2] = [64, 48];
/// The number of random scenes in an ordinary run, and how much dearer one is than a damaged text.
const SCENES: u64 = 60;
const COST: u64 = 1000;
/// The number of random scenes that devices draw in software, and how much dearer one is.
const DEVICE_SCENES: u64 = 3;
const DEVICE_COST: u64 = 20_000;
/// One of this many variants is drawn of each scene.
const VARIANT_STRIDE: u64 = 5;

/// A random scene.
struct Grown {
    head: Head,
    body: Body,
}

impl Shown for Grown {
    fn shown(&self) -> String {
        scene::text(&self.head, &self.body, Rewrite::Plain)
    }
}

fn grown(seed: u64) -> Grown {
    let (head, body) = grow::grow(seed);
    Grown { head, body }
}

/// A way to draw a text without cells, with all passes.
fn plain_way() -> Way {
    Way {
        size: SIZE,
        passes: PassOptions::default(),
        cells: CellUse::Never,
        scale: 1.0,
    }
}

/// A way to draw a scene that must give its picture.
struct Variant {
    name: String,
    rewrite: Rewrite,
    way: Way,
}

/// The variants of a scene.
fn variants(head: &Head) -> Vec<Variant> {
    let mut variants = Vec::new();
    let mut drawn = |name: &str, without: &[&str], none, cells| {
        let without = without.iter().map(|pass| (*pass).to_owned()).collect();
        let way = Way {
            passes: PassOptions { none, without },
            cells,
            ..plain_way()
        };
        variants.push(Variant {
            name: name.to_owned(),
            rewrite: Rewrite::Plain,
            way,
        });
    };
    for pass in PASSES.iter().filter(|pass| !pass.needs_sight) {
        let name = format!("without the pass {}", pass.name);
        drawn(&name, &[pass.name], false, CellUse::Never);
    }
    drawn("with cells", &[], false, CellUse::Always);
    drawn("-O0", &[], true, CellUse::Never);
    drawn("-O0 with cells", &[], true, CellUse::Always);
    for rewrite in rewrites(head) {
        for cells in [CellUse::Never, CellUse::Always] {
            let scale = rewrite.scale();
            let way = Way {
                scale,
                cells,
                ..plain_way()
            };
            let name = format!("{rewrite:?}, cells {cells:?}");
            variants.push(Variant { name, rewrite, way });
        }
    }
    variants
}

/// The rewrites that hold for a scene.
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
    // The default light does not turn with the scene, nor do the directions of many taps and the points on the rims
    // of lamps.
    if !head.lamps.is_empty() && head.occlusion != "6" && !head.has_rims() {
        rewrites.push(Rewrite::Rotated);
    }
    rewrites
}

/// The difference between a scene's picture and that of a variant, if there is one.
fn difference(
    engine: &mut dyn Engine,
    base: &Picture,
    (head, body): (&Head, &Body),
    variant: &Variant,
) -> Option<String> {
    let text = scene::text(head, body, variant.rewrite);
    let other = match draw(engine, &text, &variant.way) {
        Ok(picture) => picture,
        Err(errors) => return Some(errors),
    };
    let found = compare(base, &other);
    (found.count() > 0 || other.lost > base.lost)
        .then(|| format!("{found:?}, {} rays lost, {} before", other.lost, base.lost))
}

/// Tells what a scene shows in another way than it is written, reduced to what matters for it.
fn faults(engine: &mut dyn Engine, grown: &Grown, variants: &[Variant]) -> String {
    let Grown { head, body } = grown;
    let text = scene::text(head, body, Rewrite::Plain);
    let base = draw(engine, &text, &plain_way()).unwrap_or_else(|errors| panic!("{errors}"));
    let mut report = String::new();
    for variant in variants {
        let Some(found) = difference(engine, &base, (head, body), variant) else {
            continue;
        };
        _ = writeln!(report, "{}: {found}", variant.name);
        if report.lines().count() > 1 {
            continue;
        }
        let (head, body) = shrink::shrink(head, body, |head, body| {
            let text = scene::text(head, body, Rewrite::Plain);
            draw(engine, &text, &plain_way())
                .is_ok_and(|base| difference(engine, &base, (head, body), variant).is_some())
        });
        report += &scene::text(&head, &body, variant.rewrite);
    }
    report
}

#[test]
fn a_picture_depends_on_nothing_but_the_scene() {
    let check = |grown: &Grown| {
        let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
        let mut variants = variants(&grown.head);
        // Each scene has its own few of them.
        let mut index = grown.body.seed;
        variants.retain(|_| {
            index += 1;
            index.is_multiple_of(VARIANT_STRIDE)
        });
        let report = faults(&mut *engine, grown, &variants);
        assert!(report.is_empty(), "\n{report}");
        Verdict::Accepted
    };
    campaign::run("metamorphic", campaign::count(SCENES, COST), grown, check);
}

#[test]
fn a_picture_does_not_depend_on_the_engine() {
    if let Ok(reason) = std::env::var("SDFC_SKIP_GPU") {
        eprintln!("skipped: random scenes are not drawn on devices ({reason})");
        return;
    }
    let check = |Grown { head, body }: &Grown| {
        let text = scene::text(head, body, Rewrite::Plain);
        let pictures = EngineKind::FAST.map(|kind| {
            let mut engine = open(kind).unwrap_or_else(|error| panic!("{kind}: {error}"));
            let picture = draw(&mut *engine, &text, &plain_way());
            (kind, picture.unwrap_or_else(|errors| panic!("{errors}")))
        });
        let mut report = String::new();
        for (kind, picture) in &pictures[1..] {
            let found = compare(&pictures[0].1, picture);
            if found.count() > 0 || picture.lost > pictures[0].1.lost {
                _ = writeln!(report, "{kind}: {found:?}, {} rays lost", picture.lost);
            }
        }
        assert!(report.is_empty(), "\n{report}");
        Verdict::Accepted
    };
    let count = campaign::count(DEVICE_SCENES, DEVICE_COST);
    campaign::run("engines", count, grown, check);
}
