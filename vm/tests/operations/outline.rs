//! Outlines of solids, by closed forms of their support functions.

use glam::DVec3;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::outline::{Outline, directions};

#[test]
fn the_support_along_a_direction_is_the_stored_one() {
    let mut count = 0.0;
    let outline = Outline::from_support(|_| {
        count += 1.0;
        count
    });
    for (index, direction) in directions().into_iter().enumerate() {
        let expected = index as f64 + 1.0;
        assert_eq!(outline.support(direction), expected, "{direction:?}");
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
    let sphere = Outline::from_support(|d| DVec3::from(d).length());
    for n in [
        [0.3, -0.7, 0.2],
        [1.0, 0.0, 0.0],
        [-0.5, 0.4, 0.45],
        [0.0, 2.0, 1.0],
    ] {
        let along = bounds
            .corners()
            .map(|corner| DVec3::from(corner).dot(n.into()));
        let farthest = along.into_iter().fold(f64::NEG_INFINITY, f64::max);
        assert!((outline.support(n) - farthest).abs() < 1e-12, "{n:?}");
        let ratio = sphere.support(n) / DVec3::from(n).length();
        assert!((1.0 - 1e-12..1.13).contains(&ratio), "{n:?}: {ratio}");
    }
}
