//! Intervals and their duals against values that were computed to 60 digits: `precise.csv`, which
//! `precise.py` generates from the definitions of the shapes.

use sdfc_vm::apply::{OpResult, apply, pack_parameters};
use sdfc_vm::branching::{BranchInterval, eval_hull};
use sdfc_vm::dual::{Dual, DualVec3};
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;

/// A line of the table.
struct Line {
    text: &'static str,
    op: Op,
    constants: Vec<f32>,
    inputs: Vec<f64>,
    value: f64,
    derivatives: Vec<f64>,
}

fn lines() -> Vec<Line> {
    let table = include_str!("precise.csv");
    let numbers = |field: &str| -> Vec<f64> {
        let words = field.split_whitespace();
        words.map(|word| word.parse().expect("a number")).collect()
    };
    let line = |text: &'static str| {
        let fields: Vec<&str> = text.split(',').collect();
        let op = Op::from_name(fields[0]).expect("a row of the table");
        Line {
            text,
            op,
            constants: pack_parameters(op, &numbers(fields[1])),
            inputs: numbers(fields[2]),
            value: numbers(fields[3])[0],
            derivatives: numbers(fields[4]),
        }
    };
    table.lines().skip(1).map(line).collect()
}

/// Reports whether an interval contains the number whose nearest `f64` is `v`.
fn holds(i: Interval, v: f64) -> bool {
    i.lo <= v.next_up() && v.next_down() <= i.hi
}

/// Returns the result of an operation for exact inputs: the value and its derivative with respect to each
/// of them.
fn dual(line: &Line) -> Dual<Interval> {
    let input = |i: usize| Interval::point(line.inputs.get(i).copied().unwrap_or(0.0));
    let p = V3::new(input(0), input(1), input(2));
    let values = [0, 1, 2].map(|i| Dual {
        value: input(i),
        gradient: DualVec3::<Interval>::seed(p).gradients[i],
    });
    match apply::<Dual<Interval>>(line.op, DualVec3::seed(p), values, &line.constants) {
        OpResult::Value(v) => v,
        OpResult::Point(_) => panic!("{}: gives a point", line.text),
    }
}

#[test]
fn intervals_hold_values_of_many_digits() {
    let lines = lines();
    assert!(lines.len() > 150);
    for line in &lines {
        let result = dual(line);
        let message = format!("{}\n  {result:?}", line.text);
        assert!(holds(result.value, line.value), "{message}");
        let gradient = [result.gradient.x, result.gradient.y, result.gradient.z];
        for (bounds, &derivative) in gradient.into_iter().zip(&line.derivatives) {
            assert!(holds(bounds, derivative), "{message}");
        }
        // The intervals are no wider than their roundings require.
        let size = line
            .inputs
            .iter()
            .fold(1.0_f64, |most, v| most.max(v.abs()));
        if line.value.abs() < 1e7 {
            let width = result.value.hi - result.value.lo;
            assert!(width <= 1e-12 * size.max(line.value.abs()), "{message}");
        }
    }
}

#[test]
fn branching_intervals_are_the_same_where_nothing_is_open() {
    for line in &lines() {
        let input = |i: usize| Interval::point(line.inputs.get(i).copied().unwrap_or(0.0));
        let p = BranchInterval::point([0, 1, 2].map(input));
        let values = [p.x, p.y, p.z];
        let (range, is_decided) =
            eval_hull(
                || match apply::<BranchInterval>(line.op, p, values, &line.constants) {
                    OpResult::Value(v) => v,
                    OpResult::Point(_) => panic!("{}: gives a point", line.text),
                },
            );
        let Dual { value, .. } = dual(line);
        if is_decided {
            assert_eq!((range.lo, range.hi), (value.lo, value.hi), "{}", line.text);
        } else {
            assert!(holds(range, line.value), "{}", line.text);
        }
    }
}
