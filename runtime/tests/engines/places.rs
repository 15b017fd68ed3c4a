//! Data of single points: the cell that contains them, and the bound of their rounding error.

use crate::scenes::{EVERYTHING, cpu, drawn, loaded, module};
use glam::DVec3;
use sdfc_runtime::cells::{Aabb, CellInfo};
use sdfc_runtime::engine::{Engine, EngineKind, with_fallback};
use sdfc_runtime::render::{CellMode, Mode, RenderSettings};
use sdfc_runtime::rounding::error_at;
use sdfc_vm::evaluate::evaluate_f64;

/// Points of a grid in the bounds.
fn grid(steps: usize) -> Vec<[f32; 3]> {
    let coordinate = |i: usize| -1.97 + 3.94 * i as f32 / (steps - 1) as f32;
    let numbers = 0..steps * steps * steps;
    let point = |n: usize| [n % steps, n / steps % steps, n / steps / steps].map(coordinate);
    numbers.map(point).collect()
}

fn parts(
    engine: &mut dyn Engine,
    settings: &RenderSettings,
    points: &[[f32; 3]],
) -> Vec<Option<CellInfo>> {
    let parts = engine.cells_at(settings, points);
    parts.expect("the CPU answers").expect("it has cells")
}

/// Points inside a cell, near its corners and at its centre.
fn within(region: &Aabb) -> [[f32; 3]; 9] {
    let position = |fractions: [f32; 3]| {
        std::array::from_fn(|i| region.low[i] + (region.high[i] - region.low[i]) * fractions[i])
    };
    std::array::from_fn(|corner| match corner {
        8 => position([0.5; 3]),
        _ => position([0, 1, 2].map(|i| if corner >> i & 1 == 1 { 0.99 } else { 0.01 })),
    })
}

#[test]
fn parts_contain_their_points_and_do_not_overlap() {
    let module = module(EVERYTHING, None);
    let settings = RenderSettings {
        cells: CellMode::Always,
        ..drawn(&module, &[])
    };
    let mut engine = with_fallback(cpu());
    engine.load(&loaded(&module, &[])).expect("loads");
    let points = grid(24);
    let cells = parts(&mut *engine, &settings, &points);
    let mut distinct: Vec<CellInfo> = Vec::new();
    for (part, p) in cells.iter().zip(&points) {
        let part = part.unwrap_or_else(|| panic!("{p:?} is within the bounds"));
        assert!(part.region.contains(*p), "{part:?} {p:?}");
        if !distinct.contains(&part) {
            distinct.push(part);
        }
    }
    for part in &distinct {
        let probed = parts(&mut *engine, &settings, &within(&part.region));
        assert!(probed.iter().all(|other| *other == Some(*part)), "{part:?}");
    }
    let lengths: Vec<usize> = distinct.iter().filter_map(|part| part.clauses).collect();
    let (max, min) = (lengths.iter().max(), lengths.iter().min());
    assert!(lengths.len() < distinct.len(), "nothing is run in some");
    assert!(min < max, "{min:?} to {max:?} clauses");
    // In a cell without a program, the field has one sign.
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
    let never = with(CellMode::Never, Mode::Shaded);
    assert!(
        engine.cells_at(&never, &[[0.0; 3]]).is_err(),
        "nothing is loaded"
    );
    engine.load(&loaded(&module, &[])).expect("loads");
    assert_eq!(engine.kind(), EngineKind::Cpu);
    assert_eq!(engine.cells_at(&never, &[[0.0; 3]]), Ok(None));
    let flat = with(CellMode::Always, Mode::Distance);
    assert_eq!(engine.cells_at(&flat, &[[0.0; 3]]), Ok(None));
}

#[test]
fn rounding_at_a_point_is_bounded_and_reported_in_pixels() {
    let module = module(EVERYTHING, None);
    let settings = drawn(&module, &[]);
    let mut engine = cpu();
    engine.load(&loaded(&module, &[])).expect("loads");
    let points = grid(9);
    let samples = engine.query(&points).expect("the CPU answers");
    for (&p, sample) in points.iter().zip(&samples) {
        let point = p.map(f64::from);
        let point_error = error_at(&module, &[], &settings, point);
        let error = (f64::from(sample.distance) - evaluate_f64(&module.distance, point)).abs();
        assert!(
            error <= point_error.field && point_error.field < 1e-4,
            "{p:?}: {error} {point_error:?}"
        );
        // The camera is at (2.5, 2, 5) with a field of view of 0.7 radians; the image has 32 rows.
        let distance = DVec3::from(point).distance(DVec3::new(2.5, 2.0, 5.0));
        let pixel = 2.0 * distance * 0.35_f64.tan() / 32.0;
        let fraction = point_error.pixels * pixel / point_error.field;
        assert!(
            (0.999..1.5).contains(&fraction),
            "{p:?}: {fraction} {point_error:?}"
        );
    }
}
