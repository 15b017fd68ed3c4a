//! Images rendered in two parts: the first sample of each pixel, then all others.

use crate::scenes::{EVERYTHING, PAINTED, cpu, drawn_as, gpu, loaded, module};
use sdfc_runtime::engine::{Engine, EngineKind, open, open_on};
use sdfc_runtime::render::{CellStats, Image, Mode, Samples, Stats};
use sdfc_runtime::settings::Overrides;

/// The engines that need no generated source.
fn engines() -> Vec<Box<dyn Engine>> {
    let reference = open(EngineKind::Reference).expect("it needs no device");
    let mut engines = vec![cpu(), reference];
    engines.extend(gpu().map(|gpu| open_on(EngineKind::Interp, gpu)));
    engines
}

#[test]
fn two_parts_are_the_picture_that_is_made_at_once() {
    let scene = module(EVERYTHING, Some(PAINTED));
    for mut engine in engines() {
        let kind = engine.kind();
        engine.load(&loaded(&scene, &[])).expect("it loads");
        for (mode, aa) in [
            (Mode::Shaded, 2),
            (Mode::Shaded, 3),
            (Mode::Shaded, 1),
            (Mode::Edges, 2),
            (Mode::Distance, 2),
        ] {
            let overrides = Overrides {
                // More than a tile of the CPU engine.
                size: Some([70, 40]),
                aa: Some(aa),
                mode,
                ..Overrides::default()
            };
            let settings = drawn_as(&scene, &[], &overrides);
            let mut draw = |samples| {
                let image = engine.render_samples(&settings, samples, &|_| {});
                image.expect("it draws")
            };
            let full = draw(Samples::All);
            let first = draw(Samples::First);
            assert_eq!(first.stats.rays(), 70 * 40);
            let in_two_parts = draw(Samples::Remaining(&first));
            let what = format!("{kind}, {mode:?}, {aa}");
            assert!(in_two_parts.color == full.color, "{what}: colours");
            assert!(in_two_parts.depth == full.depth, "{what}: depths");
            assert!(in_two_parts.normal == full.normal, "{what}: normals");
            // The second part reuses the cells of the first.
            let counted = |image: &Image| Stats {
                cells: CellStats::default(),
                ..image.stats
            };
            assert_eq!(counted(&in_two_parts), counted(&full), "{what}");
            assert_eq!(
                first.color == full.color,
                aa == 1,
                "{what}: it adds nothing"
            );
        }
    }
}

#[test]
fn neighbours_that_tiles_share_count_once() {
    let Some(gpu) = gpu() else { return };
    let scene = module(EVERYTHING, None);
    let mut engine = open_on(EngineKind::Interp, gpu);
    let mut evaluations = |mode| {
        let overrides = Overrides {
            // More than a device's first tile.
            size: Some([140, 90]),
            mode,
            ..Overrides::default()
        };
        let settings = drawn_as(&scene, &[], &overrides);
        engine.load(&loaded(&scene, &[])).expect("it loads");
        let image = engine.render_samples(&settings, Samples::All, &|_| {});
        image.expect("it draws").stats.evaluations
    };
    // Edge lines follow from the normals of pixels and of their neighbours.
    assert_eq!(evaluations(Mode::Edges), evaluations(Mode::Normal));
}

#[test]
fn a_first_part_of_another_size_is_none() {
    let scene = module(EVERYTHING, None);
    let settings = |size| {
        let overrides = Overrides {
            size: Some(size),
            aa: Some(2),
            ..Overrides::default()
        };
        drawn_as(&scene, &[], &overrides)
    };
    let mut engine = cpu();
    engine.load(&loaded(&scene, &[])).expect("it loads");
    let mut draw = |size, samples| {
        let image = engine.render_samples(&settings(size), samples, &|_| {});
        image.expect("it draws")
    };
    let small = draw([24, 16], Samples::First);
    let full = draw([40, 30], Samples::All);
    assert!(draw([40, 30], Samples::Remaining(&small)).color == full.color);
}
