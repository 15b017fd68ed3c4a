//! Outlines: support functions of boxes and spheres.

use glam::DVec3;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::outline::{Outline, directions};

/// The supports of a tetrahedron differ in each direction, so an exchange of two of them shows.
#[test]
fn supports_are_found_by_direction() {
    let corners = [
        [3.0, 0.1, 0.7],
        [-1.0, 5.0, -0.3],
        [0.4, -2.0, 9.0],
        [-7.0, -0.6, -4.0],
    ];
    let exact = |d: [f64; 3]| {
        let along = corners.map(|c| DVec3::from(c).dot(d.into()));
        along.into_iter().fold(f64::NEG_INFINITY, f64::max)
    };
    let outline = Outline::from_support(exact);
    for direction in directions() {
        assert_eq!(
            outline.support(direction),
            exact(direction),
            "{direction:?}"
        );
    }
}

#[test]
fn the_outline_of_a_box_is_exact_and_that_of_a_sphere_is_close() {
    let bounds = Bounds {
        min: [-1.0, 0.5, 2.0],
        max: [3.0, 0.75, 9.0],
    };
    let outline = Outline::from_bounds(&bounds);
    assert_eq!(outline.bounds(), bounds);
    let ball = Outline::from_support(|d| DVec3::from(d).length());
    for n in [
        [0.3, -0.7, 0.2],
        [1.0, 0.0, 0.0],
        [-0.5, 0.4, 0.45],
        [0.0, 2.0, 1.0],
    ] {
        let corners = bounds.corners();
        let along = corners.map(|c| DVec3::from(c).dot(n.into()));
        let most = along.into_iter().fold(f64::NEG_INFINITY, f64::max);
        assert!((outline.support(n) - most).abs() < 1e-12, "{n:?}");
        let reach = ball.support(n) / DVec3::from(n).length();
        assert!((1.0 - 1e-12..1.13).contains(&reach), "{n:?}: {reach}");
    }
}
