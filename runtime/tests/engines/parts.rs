//! Pictures that are made in two parts: the first sample of each pixel, then all others.

use crate::scenes::{EVERYTHING, PAINTED, cpu, drawn_as, gpu, loaded, module};
use sdfc_runtime::engine::{Engine, EngineKind, on, open};
use sdfc_runtime::frame::{CellStats, Frame, Mode, Samples, Stats};
use sdfc_runtime::settings::Overrides;

/// The engines that need no generated source.
fn engines() -> Vec<Box<dyn Engine>> {
    let reference = open(EngineKind::Reference).expect("it needs no device");
    let mut engines = vec![cpu(), reference];
    engines.extend(gpu().map(|gpu| on(EngineKind::Interp, gpu)));
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
                // More than a tile of the CPU's.
                size: Some([70, 40]),
                aa: Some(aa),
                mode,
                ..Overrides::default()
            };
            let settings = drawn_as(&scene, &[], &overrides);
            let mut draw = |samples| {
                let frame = engine.render_samples(&settings, samples, &|_| {});
                frame.expect("it draws")
            };
            let whole = draw(Samples::All);
            let first = draw(Samples::First);
            assert_eq!(first.stats.rays(), 70 * 40);
            let both = draw(Samples::Rest(&first));
            let what = format!("{kind}, {mode:?}, {aa}");
            assert!(both.color == whole.color, "{what}: colours");
            assert!(both.depth == whole.depth, "{what}: depths");
            assert!(both.normal == whole.normal, "{what}: normals");
            // The cells of the first part are there for the second.
            let counted = |frame: &Frame| Stats {
                cells: CellStats::default(),
                ..frame.stats
            };
            assert_eq!(counted(&both), counted(&whole), "{what}");
            assert_eq!(
                first.color == whole.color,
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
    let mut engine = on(EngineKind::Interp, gpu);
    let mut evaluations = |mode| {
        let overrides = Overrides {
            // More than a device's first tile.
            size: Some([140, 90]),
            mode,
            ..Overrides::default()
        };
        let settings = drawn_as(&scene, &[], &overrides);
        engine.load(&loaded(&scene, &[])).expect("it loads");
        let frame = engine.render_samples(&settings, Samples::All, &|_| {});
        frame.expect("it draws").stats.evaluations
    };
    // Lines are drawn by the normals of pixels and of their neighbours.
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
        let frame = engine.render_samples(&settings(size), samples, &|_| {});
        frame.expect("it draws")
    };
    let small = draw([24, 16], Samples::First);
    let whole = draw([40, 30], Samples::All);
    assert!(draw([40, 30], Samples::Rest(&small)).color == whole.color);
}
