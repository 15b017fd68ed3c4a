//! Claims of cells hold inside them.

use super::samples::{Field, LEVELS, fields, is_long, point_at, points_of, set_point, zeros};
use crate::corpus::compiled_text;
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::cells::{Aabb, Cell, Occupancy};
use sdfc_trials::random::Random;
use sdfc_vm::evaluate::{evaluate_f64, gradient};
use sdfc_vm::lanes::{F32x64, LANES, Points};
use sdfc_vm::real::Vector3;
use sdfc_vm::tape::Clause;
use sdfc_vm::tape::evaluator::TapeEvaluator;
use sdfc_vm::tape::scalar::{Registers, eval};
use sdfc_vm::tape::trace::Tracer;
use sdfc_vm::vector::V3;

/// Number of leaves sampled per field.
const LEAVES_PER_FIELD: usize = 40;

fn leaf_sample_count() -> usize {
    if is_long() {
        LEAVES_PER_FIELD * 20
    } else {
        LEAVES_PER_FIELD
    }
}

/// Returns the largest absolute coordinate of a box.
fn largest(region: &Aabb) -> f32 {
    let ends = region.low.iter().chain(&region.high);
    ends.fold(0.0, |max, v| max.max(v.abs()))
}

fn is_same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || a == b || (a.is_nan() && b.is_nan())
}

/// Samples points of leaves. `check` receives a leaf, its points and the values of the full program
/// there.
fn in_leaves(
    field: &Field,
    band: f32,
    mut check: impl FnMut(&Cell, &[Clause], &Points, &F32x64, &mut TapeEvaluator<f32>),
) -> usize {
    let cells = field.cells(band);
    let leaves: Vec<u32> = cells.leaves().collect();
    let mut machine = field.machine();
    let mut random = Random::new(leaves.len() as u64);
    let step = leaves.len().div_ceil(leaf_sample_count()).max(1);
    let mut sampled = 0;
    for &leaf in leaves.iter().skip(random.below(step)).step_by(step) {
        let (cell, tape) = (cells.cell(leaf), cells.tape(leaf));
        let points = points_of(&cell.region, &mut random);
        let values = field.values(&mut machine, &field.tape.clauses, &points);
        check(cell, tape, &points, &values, &mut machine);
        if let Some(points) = zeros(field, &mut machine, &points, &values, &mut random) {
            let values = field.values(&mut machine, &field.tape.clauses, &points);
            check(cell, tape, &points, &values, &mut machine);
        }
        sampled += 1;
    }
    sampled
}

#[test]
fn tapes_of_cells_give_the_values_of_the_full_tape() {
    let (mut leaves, mut shorter, mut failures) = (0, 0, Vec::new());
    for field in fields() {
        for band in [0.0, f32::INFINITY] {
            let origin = V3::new(0.0, 0.0, 0.0);
            let mut registers = Registers::<f64>::new(field.tape.values, field.tape.points, origin);
            let sampled = in_leaves(&field, band, |cell, tape, points, values, machine| {
                shorter += usize::from(tape.len() < field.tape.clauses.len());
                let cell_value = field.values(machine, tape, points);
                let size = f64::from(largest(&cell.region));
                for lane in 0..LANES {
                    let (a, b) = (values.0[lane], cell_value.0[lane]);
                    let p = point_at(points, lane);
                    if !is_same(a, b) {
                        failures.push(format!(
                            "{} at {p:?}: {a} by all, {b} in the cell",
                            field.name
                        ));
                    }
                    // Decisions in `f32` also hold for real numbers, except for rounding.
                    let [x, y, z] = p.map(f64::from);
                    let mut eval_wide = |tape| {
                        eval::<f64>(
                            &field.program,
                            tape,
                            &mut registers,
                            V3::new(x, y, z),
                            |_, _, _, _| {},
                        )
                    };
                    let (a, b) = (eval_wide(&field.tape.clauses), eval_wide(tape));
                    let rounding = (f64::from(values.0[lane]) - a).abs() + 1e-6 * size;
                    if (a - b).abs() > 2.0 * rounding {
                        failures.push(format!(
                            "{} at {p:?}: {a} by all, {b} in the cell, in f64",
                            field.name
                        ));
                    }
                }
            });
            leaves += sampled;
        }
    }
    report(&failures);
    assert!(
        shorter > 1000,
        "only {shorter} of {leaves} tapes were shorter"
    );
}

#[test]
fn bounds_of_boxes_hold_the_values_in_them() {
    let (mut bounded, mut failures) = (0, Vec::new());
    for field in fields() {
        let mut tracer = Tracer::new(&field.tape);
        in_leaves(&field, 0.0, |cell, tape, points, values, _| {
            cell.region.write_lane(tracer.boxes(), 0);
            let [low, high] = *tracer.run(&field.program, tape, 1);
            let (low, high) = (low.0[0], high.0[0]);
            bounded += usize::from(low > f32::NEG_INFINITY && high < f32::INFINITY);
            for lane in 0..LANES {
                let value = values.0[lane];
                // Comparisons with NaN are false, so NaN has no bounds.
                if value < low || value > high {
                    let p = point_at(points, lane);
                    failures.push(format!(
                        "{} at {p:?}: {value} outside of {low} to {high}",
                        field.name
                    ));
                }
            }
        });
    }
    report(&failures);
    assert!(bounded > 1000, "only {bounded} boxes had bounds");
}

#[test]
fn slopes_and_gradients_of_cells_bound_those_in_them() {
    let (mut gradients, mut slopes, mut failures) = (0, 0, Vec::new());
    for field in fields() {
        in_leaves(&field, 0.0, |cell, _, points, values, _| {
            let Some(bounds) = cell.gradient else { return };
            gradients += 1;
            slopes += usize::from(cell.slope < 1.0);
            for lane in 0..LANES {
                let p = point_at(points, lane);
                let [x, y, z] = p;
                let drawn_gradient = gradient::<f32>(&field.program, V3::new(x, y, z)).gradient;
                if drawn_gradient.length().is_nan() {
                    // Beyond the range of `f32`, the exact field is not the one that is drawn.
                    continue;
                }
                let [x, y, z] = p.map(f64::from);
                let exact_gradient = gradient::<f64>(&field.program, V3::new(x, y, z)).gradient;
                let is_within = [exact_gradient.x, exact_gradient.y, exact_gradient.z]
                    .into_iter()
                    .zip(bounds)
                    .all(|(v, [low, high])| f64::from(low) <= v && v <= f64::from(high));
                let is_flat = cell.slope == 1.0 || exact_gradient.length() <= f64::from(cell.slope);
                if !(is_within && is_flat) {
                    failures.push(format!(
                        "{} at {p:?}: {exact_gradient:?} outside of {bounds:?}, {}",
                        field.name, cell.slope
                    ));
                }
                // Between two points the field changes at most by the gradient bounds, including
                // discontinuities.
                let other = (lane + 1) % LANES;
                let q = point_at(points, other);
                let change = f64::from(values.0[other]) - f64::from(values.0[lane]);
                let max: f64 = (0..3)
                    .map(|axis| {
                        let [low, high] = bounds[axis].map(f64::from);
                        let offset = f64::from(q[axis]) - f64::from(p[axis]);
                        (low * offset).max(high * offset)
                    })
                    .sum();
                if change > max + 2e-6 * f64::from(largest(&cell.region)) {
                    failures.push(format!(
                        "{} from {p:?} to {q:?}: {change} is more than {max}",
                        field.name
                    ));
                }
            }
        });
    }
    report(&failures);
    assert!(
        gradients > 300 && slopes > 100,
        "{gradients} gradients, {slopes} slopes"
    );
}

/// No cell is empty or full at a zero of the field.
#[test]
fn no_surface_lies_where_nothing_is_kept() {
    let (mut count, mut failures) = (0, Vec::new());
    for field in fields() {
        let cells = field.cells(0.0);
        let mut machine = field.machine();
        let mut random = Random::new(7);
        for _ in 0..if is_long() { 400 } else { 24 } {
            let points = points_of(&field.region, &mut random);
            let values = field.values(&mut machine, &field.tape.clauses, &points);
            let Some(points) = zeros(&field, &mut machine, &points, &values, &mut random) else {
                continue;
            };
            for lane in 0..LANES {
                let p = point_at(&points, lane);
                let value = evaluate_f64(&field.program, p.map(f64::from));
                let noise = 1e-6 * f64::from(largest(&field.region));
                let is_wrong = match cells.occupancy_at(p) {
                    Occupancy::Empty => value < -noise,
                    Occupancy::Full => value > noise,
                    Occupancy::Leaf(_) => false,
                };
                count += 1;
                if is_wrong {
                    failures.push(format!(
                        "{} at {p:?}: {value}, {:?}",
                        field.name,
                        cells.occupancy_at(p)
                    ));
                }
            }
        }
    }
    report(&failures);
    assert!(count > 10_000, "only {count} points near zeros");
}

/// Planes as raw fields, and the corner of the cube that is split. Gradient bounds are exact for
/// planes.
const PLANES: [(&str, f32); 6] = [
    ("2 * p.x + 3 * p.y + p.z - 0.31", 0.0),
    ("2 * p.x - 2 * p.y + 2 * p.z + 0.2", 0.0),
    ("p.x - p.y - 0.17", 0.0),
    ("0.3 * p.x + 2 * p.y + 4 * p.z - 1.1", 0.0),
    ("3 * p.x - 3 * p.y - 3 * p.z + 0.05", 0.0),
    // Large numbers far away, with a small difference.
    ("200 * p.x - 198 * p.x - 2 * p.y - 0.1372", 1000.0),
];

/// Cells are kept where a plane cuts off a corner, exactly as the centre value and the gradient predict.
#[test]
fn cells_are_kept_of_which_a_corner_is_cut_off() {
    let (mut kept, mut failures) = (0, Vec::new());
    for (text, first) in PLANES {
        let scene = format!("field(fn(p) => {text}, within: 4000)\n");
        let program = compiled_text(&scene, PassOptions::default())
            .module
            .distance;
        let low = [first; 3].map(f64::from);
        let field = Field::new(text.to_owned(), program, low, low.map(|v| v + 1.0));
        let cells = field.cells(0.0);
        let mut machine = field.machine();
        let mut random = Random::new(5);
        let count = 4_usize.pow(LEVELS as u32 - 1);
        let side = field.region.longest_side() / count as f32;
        for position in 0..count.pow(3) {
            let position = [
                position % count,
                position / count % count,
                position / count / count,
            ];
            let [low, high] = [0, 1].map(|end| {
                [0, 1, 2].map(|axis| field.region.low[axis] + side * (position[axis] + end) as f32)
            });
            let middle = [0, 1, 2].map(|axis| (low[axis] + high[axis]) * 0.5);
            let occupancy = cells.occupancy_at(middle);
            kept += usize::from(matches!(occupancy, Occupancy::Leaf(_)));
            if matches!(occupancy, Occupancy::Leaf(_)) {
                continue;
            }
            let points = points_of(&Aabb { low, high }, &mut random);
            let values = field.values(&mut machine, &field.tape.clauses, &points);
            let is_wrong = |lane: &usize| match occupancy {
                Occupancy::Empty => values.0[*lane] < 0.0,
                _ => values.0[*lane] > 0.0,
            };
            if let Some(lane) = (0..LANES).find(is_wrong) {
                failures.push(format!(
                    "{text} at {:?}: {}, {occupancy:?}",
                    point_at(&points, lane),
                    values.0[lane]
                ));
            }
        }
    }
    report(&failures);
    assert!(kept > 2_000, "only {kept} cells are kept");
}

/// Points that rounding moves beyond a face find a tape that is valid there.
#[test]
fn points_beside_faces_find_tapes_that_hold() {
    let (mut count, mut failures) = (0, Vec::new());
    for field in fields() {
        let cells = field.cells(f32::INFINITY);
        let leaves: Vec<u32> = cells.leaves().collect();
        let mut machine = field.machine();
        let mut random = Random::new(11);
        for _ in 0..leaf_sample_count() {
            let leaf = random.pick(&leaves);
            let Aabb { low, high } = cells.cell(leaf).region;
            let mut points = points_of(&cells.cell(leaf).region, &mut random);
            for lane in 0..32 {
                let mut p = point_at(&points, lane);
                for axis in 0..3 {
                    if p[axis] == low[axis] || p[axis] == high[axis] {
                        p[axis] = step_floats(p[axis], random.below(9) as i32 - 4);
                    }
                }
                set_point(&mut points, lane, p);
            }
            let full_values = field.values(&mut machine, &field.tape.clauses, &points);
            for lane in 0..32 {
                let p = point_at(&points, lane);
                let Occupancy::Leaf(leaf) = cells.occupancy_at(p) else {
                    continue;
                };
                if !cells.region().contains(p) {
                    continue;
                }
                let cell_value = field.values(&mut machine, cells.tape(leaf), &points).0[lane];
                count += 1;
                if !is_same(full_values.0[lane], cell_value) {
                    failures.push(format!(
                        "{} at {p:?}: {} by all, {cell_value} in the cell",
                        field.name, full_values.0[lane]
                    ));
                }
            }
        }
    }
    report(&failures);
    assert!(count > 10_000, "only {count} points were looked up");
}

/// Returns the `f32` that is `steps` steps above `v`.
pub(super) fn step_floats(v: f32, steps: i32) -> f32 {
    (0..steps.abs()).fold(v, |v, _| {
        if steps > 0 {
            v.next_up()
        } else {
            v.next_down()
        }
    })
}

fn report(failures: &[String]) {
    let first = failures
        .iter()
        .take(20)
        .cloned()
        .collect::<Vec<_>>()
        .join("\n");
    assert!(failures.is_empty(), "{} failures\n{first}", failures.len());
}
