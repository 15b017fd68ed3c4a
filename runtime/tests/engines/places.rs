//! What is known of single points: the part of space that cells have them in, and how far off rounding
//! may be.

use crate::scenes::{EVERYTHING, cpu, drawn, loaded, module};
use sdfc_runtime::cells::{Part, Region};
use sdfc_runtime::engine::{Engine, EngineKind, with_fallback};
use sdfc_runtime::frame::{CellUse, Mode, RenderSettings};
use sdfc_runtime::rounding::here;
use sdfc_vm::evaluate::evaluate_f64;

/// Points of a grid in the bounds.
fn grid(steps: usize) -> Vec<[f32; 3]> {
    let at = |i: usize| -1.97 + 3.94 * i as f32 / (steps - 1) as f32;
    let numbers = 0..steps * steps * steps;
    let point = |n: usize| [n % steps, n / steps % steps, n / steps / steps].map(at);
    numbers.map(point).collect()
}

fn parts(
    engine: &mut dyn Engine,
    settings: &RenderSettings,
    points: &[[f32; 3]],
) -> Vec<Option<Part>> {
    let parts = engine.cells_at(settings, points);
    parts.expect("the CPU answers").expect("it has cells")
}

/// Places inside a part, near its corners and in its middle.
fn within(region: &Region) -> [[f32; 3]; 9] {
    let at = |shares: [f32; 3]| {
        std::array::from_fn(|i| region.low[i] + (region.high[i] - region.low[i]) * shares[i])
    };
    std::array::from_fn(|corner| match corner {
        8 => at([0.5; 3]),
        _ => at([0, 1, 2].map(|i| if corner >> i & 1 == 1 { 0.99 } else { 0.01 })),
    })
}

#[test]
fn parts_of_space_are_whole_and_apart() {
    let module = module(EVERYTHING, None);
    let settings = RenderSettings {
        cells: CellUse::Always,
        ..drawn(&module, &[])
    };
    let mut engine = with_fallback(cpu());
    engine.load(&loaded(&module, &[])).expect("loads");
    let points = grid(24);
    let found = parts(&mut *engine, &settings, &points);
    let mut distinct: Vec<Part> = Vec::new();
    for (part, p) in found.iter().zip(&points) {
        let part = part.unwrap_or_else(|| panic!("{p:?} is within the bounds"));
        assert!(part.region.holds(*p), "{part:?} {p:?}");
        if !distinct.contains(&part) {
            distinct.push(part);
        }
    }
    for part in &distinct {
        let same = parts(&mut *engine, &settings, &within(&part.region));
        assert!(same.iter().all(|other| *other == Some(*part)), "{part:?}");
    }
    let lengths: Vec<usize> = distinct.iter().filter_map(|part| part.clauses).collect();
    let (most, least) = (lengths.iter().max(), lengths.iter().min());
    assert!(lengths.len() < distinct.len(), "nothing is run in some");
    assert!(least < most, "{least:?} to {most:?} clauses");
    // Where nothing is run, the field has one sign.
    for part in distinct.iter().filter(|part| part.clauses.is_none()) {
        let samples = engine
            .query(&within(&part.region))
            .expect("the CPU answers");
        let inside = samples
            .iter()
            .filter(|sample| sample.distance < 0.0)
            .count();
        assert!(inside == 0 || inside == samples.len(), "{part:?}");
    }
    let outside = parts(&mut *engine, &settings, &[[50.0, 0.0, 0.0]]);
    assert_eq!(outside, [None]);
}

#[test]
fn a_picture_without_cells_has_no_parts() {
    let module = module(EVERYTHING, None);
    let mut engine = cpu();
    let with = |cells, mode| RenderSettings {
        cells,
        mode,
        ..drawn(&module, &[])
    };
    let never = with(CellUse::Never, Mode::Shaded);
    assert!(
        engine.cells_at(&never, &[[0.0; 3]]).is_err(),
        "nothing is loaded"
    );
    engine.load(&loaded(&module, &[])).expect("loads");
    assert_eq!(engine.kind(), EngineKind::Cpu);
    assert_eq!(engine.cells_at(&never, &[[0.0; 3]]), Ok(None));
    let flat = with(CellUse::Always, Mode::Distance);
    assert_eq!(engine.cells_at(&flat, &[[0.0; 3]]), Ok(None));
}

#[test]
fn rounding_at_a_point_is_bounded_and_told_in_pixels() {
    let module = module(EVERYTHING, None);
    let settings = drawn(&module, &[]);
    let mut engine = cpu();
    engine.load(&loaded(&module, &[])).expect("loads");
    let points = grid(9);
    let samples = engine.query(&points).expect("the CPU answers");
    for (&p, sample) in points.iter().zip(&samples) {
        let point = p.map(f64::from);
        let here = here(&module, &[], &settings, point);
        let off = (f64::from(sample.distance) - evaluate_f64(&module.distance, point)).abs();
        assert!(
            off <= here.field && here.field < 1e-4,
            "{p:?}: {off} {here:?}"
        );
        // The camera is at (2.5, 2, 5), sees 0.7 radians, and the picture has 32 rows.
        let from = [point[0] - 2.5, point[1] - 2.0, point[2] - 5.0];
        let way = from.iter().map(|v| v * v).sum::<f64>().sqrt();
        let pixel = 2.0 * way * 0.35_f64.tan() / 32.0;
        let share = here.pixels * pixel / here.field;
        assert!((0.999..1.5).contains(&share), "{p:?}: {share} {here:?}");
    }
}
