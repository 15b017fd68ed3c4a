//! Tests of picking against closed forms and source texts.

use super::*;
use crate::inspect::pick::{Pick, PickContext, PixelHit, describe};

fn pick(fixture: &mut Fixture, image: &Image, pixel: [u32; 2]) -> Option<Pick> {
    let hit = PixelHit::from_image(image, &fixture.settings, pixel)?;
    let point = [hit.point()?];
    let sample = fixture.engine.query(&point).expect("the CPU answers")[0];
    let leaf = fixture.leaves.query(&point).expect("the CPU answers")[0];
    let scene = PickContext {
        module: &fixture.compiled.module,
        uniform_values: &fixture.uniform_values,
        settings: &fixture.settings,
        sources: &fixture.sources,
        origins: Some(&fixture.origins),
    };
    describe(&hit, &scene, &sample, leaf.surface.id as u32)
}

const SPHERES: &str = "\
camera { from: [0, 0, 10], look: [0, 0, 0], fov: 40deg }
material red { color: #ff0000, roughness: 0.25 }
let left = sphere(1).translate(-3, 0, 0).material(red);
left
    | sphere(1.1)
    | sphere(1).translate(3, 0, 0)";

/// Returns the pixel that shows a point of the plane z = 0 in a picture of [`SPHERES`] with 160 × 90
/// pixels.
fn showing(x: f64, y: f64) -> [u32; 2] {
    let scale = 45.0 / (10.0 * 20_f64.to_radians().tan());
    [80.0 + x * scale, 45.0 - y * scale].map(|v| v as u32)
}

#[test]
fn each_sphere_is_picked_as_its_line_of_the_text() {
    let mut fixture = Fixture::new(SPHERES, [160, 90]);
    let image = fixture.image();
    let picks: Vec<Pick> = [-3.0, 0.0, 3.0]
        .into_iter()
        .filter_map(|x| pick(&mut fixture, &image, showing(x, 0.0)))
        .collect();
    let lines: Vec<String> = picks.iter().map(|p| p.origins[0].to_string()).collect();
    assert_eq!(
        lines,
        [
            "scene.sdf:3:12  sphere(1)",
            "scene.sdf:5:7  sphere(1.1)",
            "scene.sdf:6:7  sphere(1)"
        ]
    );
    assert_eq!([1, 2, 3], [0, 1, 2].map(|i| picks[i].leaf));
    let names: Vec<&str> = picks[0].origins.iter().map(|o| o.name.as_str()).collect();
    assert!(names.contains(&"left"), "{names:?}");
    assert_eq!(picks[0].material, "red");
    assert_eq!(picks[0].surface.roughness, 0.25);
    assert_eq!(picks[1].material, "");
    let middle = &picks[1];
    assert!((middle.distance - 8.9).abs() < 1e-2, "{middle}");
    assert!((middle.normal[2] - 1.0).abs() < 1e-2, "{middle}");
    assert!((middle.slope - 1.0).abs() < 1e-5);
    let rounding = middle.rounding;
    assert!(f64::from(middle.field).abs() <= rounding.field && rounding.field < 1e-4);
    assert!(
        rounding.pixels > 0.0 && rounding.pixels < 1e-2,
        "{rounding:?}"
    );
}

#[test]
fn the_sky_is_no_pick() {
    let mut fixture = Fixture::new(SPHERES, [160, 90]);
    let image = fixture.image();
    assert_eq!(pick(&mut fixture, &image, [2, 2]), None);
    let hit =
        PixelHit::from_image(&image, &fixture.settings, [2, 2]).expect("a pixel of the picture");
    assert_eq!((hit.distance, hit.point()), (None, None));
    assert_eq!(
        PixelHit::from_image(&image, &fixture.settings, [160, 0]),
        None
    );
}

#[test]
fn a_pixel_is_what_its_ray_ended_on() {
    // With several samples per pixel, an image describes the first one, which is off-centre.
    let mut fixture = Fixture::new(SPHERES, [160, 90]);
    fixture.settings.aa = 3;
    let image = fixture.image();
    let mut hits = 0;
    for row in (0..90).step_by(7) {
        for column in (0..160).step_by(7) {
            let Some(picks) = pick(&mut fixture, &image, [column, row]) else {
                continue;
            };
            hits += 1;
            assert!(picks.field.abs() < 1e-4, "{column} {row}: {picks}");
        }
    }
    assert!(hits > 20, "{hits}");
}

#[test]
fn in_a_blend_the_nearer_one_made_it() {
    let mut fixture = Fixture::new(
        "camera { from: [0, 0, 10], look: [0, 0, 0], fov: 40deg }\n\
         sphere(1).translate(-0.8, 0, 0) |[0.5] sphere(1).translate(0.8, 0, 0)",
        [160, 90],
    );
    let image = fixture.image();
    let [y, mut sides] = [45, 0];
    for x in 0..160 {
        let Some(picks) = pick(&mut fixture, &image, [x, y]) else {
            continue;
        };
        if picks.point[0].abs() > 0.01 {
            let nearer = if picks.point[0] < 0.0 { 1 } else { 2 };
            assert_eq!(picks.leaf, nearer, "{picks}");
            sides |= nearer;
        }
    }
    assert_eq!(sides, 3, "both were seen");
}

#[test]
fn a_hole_was_made_by_what_cut_it() {
    let mut fixture = Fixture::new(
        "camera { from: [0, 0, 10], look: [0, 0, 0], fov: 40deg }\n\
         box(3) - sphere(1).translate(0, 0, 1.5)",
        [160, 90],
    );
    let image = fixture.image();
    let hole = pick(&mut fixture, &image, [80, 45]).expect("hits");
    assert_eq!(hole.origins[0].text, "sphere(1)");
    assert!((hole.point[2] - 0.5).abs() < 1e-2, "{hole}");
    let face = pick(&mut fixture, &image, showing(1.2, 1.2)).expect("hits");
    assert_eq!(face.origins[0].text, "box(3)");
}

#[test]
fn a_2d_shape_is_picked_beside_it_too() {
    let mut fixture = Fixture::new("circle(1) | rect(1).translate(2, 0)", [64, 64]);
    let image = fixture.image();
    let corner = pick(&mut fixture, &image, [0, 0]).expect("the plane");
    assert!(corner.field > 0.0 && corner.point[2] == 0.0, "{corner}");
    assert!(!corner.origins.is_empty());
}
