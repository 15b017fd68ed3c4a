//! The matrices: each maps a point of the transformed shape back to its origin.

use crate::fixture::{Point, Random, distance, dot};
use sdfc_vm::ops::affine::{
    Affine, compose, identity, least_scale, reflect, rotate, rotate_euler, rotate_quaternion,
    scale, shear, translate,
};
use std::f64::consts::FRAC_PI_2;

fn through(m: &Affine<f64>, p: Point) -> Point {
    [0, 1, 2].map(|row| dot([m[4 * row], m[4 * row + 1], m[4 * row + 2]], p) + m[4 * row + 3])
}

fn goes(m: &Affine<f64>, from: Point, to: Point) {
    let back = through(m, to);
    assert!(
        distance(back, from) < 1e-12,
        "{to:?} comes from {back:?}, not {from:?}"
    );
}

#[test]
fn each_matrix_moves_points_by_its_name() {
    let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    goes(&identity(), [1.0, 2.0, 3.0], [1.0, 2.0, 3.0]);
    goes(
        &translate([1.0, -2.0, 0.5]),
        [1.0, 1.0, 1.0],
        [2.0, -1.0, 1.5],
    );
    // Right-handed rotations: x to y about z, y to z about x, z to x about y.
    goes(&rotate([0.0, 0.0, 2.0], FRAC_PI_2), x, y);
    goes(&rotate([3.0, 0.0, 0.0], FRAC_PI_2), y, z);
    goes(&rotate([0.0, 0.5, 0.0], FRAC_PI_2), z, x);
    goes(&rotate([1.0, 1.0, 1.0], FRAC_PI_2 * 4.0 / 3.0), x, y);
    // About x first (y to z), then about y (z to x).
    goes(&rotate_euler([FRAC_PI_2, FRAC_PI_2, 0.0]), y, x);
    goes(&rotate_euler([0.0, FRAC_PI_2, FRAC_PI_2]), z, y);
    goes(&scale([2.0, 0.5, -1.0]), [1.0, 1.0, 1.0], [2.0, 0.5, -1.0]);
    assert_eq!(least_scale([2.0, 0.5, -1.0]), 0.5);
    goes(
        &shear(0.5, 0.25, 2.0),
        [1.0, 2.0, 3.0],
        [1.0 + 0.5 * 2.0 + 0.25 * 3.0, 8.0, 3.0],
    );
    goes(
        &reflect([0.0, 2.0, 0.0], 0.5),
        [1.0, 2.0, 3.0],
        [1.0, -1.0, 3.0],
    );
}

#[test]
fn a_quaternion_turns_as_its_axis_and_angle_do() {
    let mut random = Random::new(50);
    for _ in 0..100 {
        let (axis, angle) = (random.direction(), random.range(-6.0, 6.0));
        let (s, c) = (angle / 2.0).sin_cos();
        let q = [
            axis[0] * s * 3.0,
            axis[1] * s * 3.0,
            axis[2] * s * 3.0,
            c * 3.0,
        ];
        let (a, b) = (rotate(axis, angle), rotate_quaternion(q));
        assert!(
            a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12),
            "{axis:?}, {angle}"
        );
    }
}

#[test]
fn composed_matrices_are_one_after_the_other() {
    let mut random = Random::new(51);
    for _ in 0..100 {
        let inner = compose(
            &rotate(random.direction(), 1.0),
            &translate(random.point(1.0)),
        );
        let outer = compose(&scale([2.0, 3.0, 0.5]), &translate(random.point(1.0)));
        let p = random.point(2.0);
        let both = through(&compose(&inner, &outer), p);
        assert!(distance(both, through(&inner, through(&outer, p))) < 1e-12);
    }
}

/// Zeros never produce a number that is not finite.
#[test]
fn degenerate_arguments_give_finite_matrices() {
    let zero = [0.0_f64; 3];
    let all = [
        rotate(zero, 1.0),
        rotate_quaternion([0.0; 4]),
        scale(zero),
        reflect(zero, 1.0),
        rotate_euler(zero),
    ];
    assert!(all.iter().flatten().all(|v| v.is_finite()));
}
