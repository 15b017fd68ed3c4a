//! Tests of view modes and of picking.

use crate::harness::{Harness, PixelBytes, SIZE, TaskKind};
use sdfc_playground::inspect::slice::FrontSurfaces;
use sdfc_playground::renderer::{SlicePlane, ViewMode};
use sdfc_playground::session::{Event, RefinementStage};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::render::Mode;
use std::time::Duration;

const SCENE: &str = "camera { from: [0, 0, 8], look: [0, 0, 0] }
let left = sphere(1).translate(-1.5, 0, 0);
let right = box(0.8).translate(1.5, 0, 0);
left | right
";
const LEFT: [f64; 2] = [-0.4, 0.0];
const RIGHT: [f64; 2] = [0.4, 0.0];

fn slice_at(coordinate: f64) -> SlicePlane {
    SlicePlane {
        axis: 2,
        coordinate,
        front: FrontSurfaces::Ghost,
    }
}

#[test]
fn everything_that_can_be_shown_is_another_picture() {
    let mut harness = Harness::new(SCENE);
    harness.run_to_rest();
    let mut shown_modes: Vec<(ViewMode, PixelBytes)> =
        vec![(ViewMode::default(), harness.picture_bytes())];
    for show in [
        ViewMode::Mode(Mode::Albedo),
        ViewMode::Mode(Mode::Normal),
        ViewMode::Mode(Mode::Depth),
        ViewMode::Mode(Mode::Steps),
        ViewMode::Slice(slice_at(0.0)),
        ViewMode::Slice(slice_at(0.9)),
        ViewMode::Slopes,
        ViewMode::Cells,
        ViewMode::Objects,
        ViewMode::Difference(EngineKind::Cpu),
    ] {
        harness.handle(Event::Show(show));
        harness.run_to_rest();
        assert_eq!(harness.session.facts().unwrap().show, show);
        let pixels = harness.picture_bytes();
        let equal = shown_modes.iter().find(|(_, other)| *other == pixels);
        assert!(equal.is_none(), "{show:?} is {:?}", equal.unwrap().0);
        shown_modes.push((show, pixels));
    }
}

/// Returns the legend's texts of a view.
fn legend_of(harness: &mut Harness, show: ViewMode) -> Vec<String> {
    harness.handle(Event::Show(show));
    harness.run_to_rest();
    let legend = &harness.session.picture().unwrap().0.legend;
    legend.iter().map(|(_, text)| text.clone()).collect()
}

#[test]
fn views_explain_their_colours_with_units() {
    let scene = format!("material red {{ color: #ff0000 }}\n{SCENE}.material(red)\n");
    let scene = scene.replace("left | right\n", "(left | right)");
    let mut harness = Harness::new(&scene);
    let depths = legend_of(&mut harness, ViewMode::Mode(Mode::Depth));
    assert!(depths[0].starts_with("7."), "{depths:?}");
    assert!(
        depths
            .iter()
            .all(|text| text.ends_with("units from the camera"))
    );
    let normals = legend_of(&mut harness, ViewMode::Mode(Mode::Normal));
    assert_eq!(normals[..2], ["faces +x", "faces -x"]);
    assert_eq!(legend_of(&mut harness, ViewMode::Mode(Mode::Id)), ["red"]);
    let signs = ["negative: inside", "positive: outside"];
    assert_eq!(
        legend_of(&mut harness, ViewMode::Slice(slice_at(0.0))),
        signs
    );
    let difference = legend_of(&mut harness, ViewMode::Difference(EngineKind::Cpu));
    assert!(difference[1].ends_with("times 16"), "{difference:?}");
}

#[test]
fn the_number_under_the_cursor_is_that_of_the_view() {
    let mut harness = Harness::new(SCENE);
    legend_of(&mut harness, ViewMode::Slice(slice_at(0.0)));
    let left = [(1.0 + LEFT[0] as f32) / 2.0, 0.5];
    let value_at =
        |harness: &Harness, position| harness.session.picture().unwrap().0.value_at(position);
    let (field, unit) = value_at(&harness, left).unwrap();
    assert!(field < -0.5 && unit == "units", "{field} {unit}");
    assert_eq!(
        value_at(&harness, [1.0, 0.5]),
        None,
        "outside of the picture"
    );
    legend_of(&mut harness, ViewMode::Slopes);
    let (slope, unit) = value_at(&harness, left).unwrap();
    assert!(
        (slope - 1.0).abs() < 1e-3 && unit == "per unit",
        "{slope} {unit}"
    );
    assert_eq!(
        value_at(&harness, [0.01, 0.01]),
        None,
        "there is no surface"
    );
    legend_of(&mut harness, ViewMode::default());
    assert_eq!(value_at(&harness, left), None, "its colours are light");
}

#[test]
fn the_field_view_shows_thin_walls_of_flat_fields() {
    // The field is a hundredth of the distance: a slope of 100 is stated.
    let wall = "camera { from: [0, 0, 8], look: [0, 0, 0], height: 4 }
field(fn(p) => abs(p.x) - 0.5, within: 1.5, lipschitz: 100)\n";
    let mut harness = Harness::new(wall);
    harness.handle(Event::Show(ViewMode::Mode(Mode::Distance)));
    harness.run_to_rest();
    assert!(!harness.session.is_broken(), "{}", harness.session.report());
    let picture = harness.session.picture().unwrap().0;
    let pixels = picture.rgba.as_chunks::<4>().0;
    // Inside of the wall, four pixels from its faces, the colour is that of the inside.
    let middle = pixels[SIZE[0] as usize * (SIZE[1] as usize / 2) + SIZE[0] as usize / 2];
    assert!(middle[2] > 150 && middle[2] > middle[0], "{middle:?}");
}

#[test]
fn only_a_plane_that_is_moved_is_a_movement() {
    let mut harness = Harness::new(SCENE);
    harness.set_frame_time(EngineKind::Cpu, Duration::from_secs(1));
    harness.run_to_rest();
    // The clock stands still: a view at rest is refined at once.
    harness.handle(Event::Show(ViewMode::Mode(Mode::Normal)));
    harness.run();
    assert_eq!(
        harness.session.facts().unwrap().stage,
        RefinementStage::Fine
    );
    harness.handle(Event::Show(ViewMode::Slice(slice_at(0.0))));
    harness.run();
    assert_eq!(
        harness.session.facts().unwrap().stage,
        RefinementStage::Full
    );
    harness.handle(Event::Show(ViewMode::Slice(slice_at(0.5))));
    harness.run();
    let stage = harness.session.facts().unwrap().stage;
    assert!(matches!(stage, RefinementStage::Coarse(_)), "{stage:?}");
    harness.run_to_rest();
    assert_eq!(
        harness.session.facts().unwrap().stage,
        RefinementStage::Full
    );
}

#[test]
fn a_pixel_reports_the_line_that_made_it() {
    let mut harness = Harness::new(SCENE);
    harness.run_to_rest();
    for (place, line, text) in [(LEFT, 2, "sphere(1)"), (RIGHT, 3, "box(0.8)")] {
        harness.handle(Event::Pick(place));
        assert_eq!(harness.run_to_rest(), [TaskKind::Pick]);
        let picked = harness.session.picked().unwrap();
        let pick = picked.result.as_ref().unwrap().as_ref().unwrap();
        assert_eq!(pick.origins[0].position.line, line);
        assert_eq!(pick.origins[0].text, text);
        assert!(pick.field.abs() < 1e-3);
    }
    harness.handle(Event::Pick([0.9, 0.9]));
    harness.run_to_rest();
    let picked = harness.session.picked().unwrap();
    assert!(picked.result.as_ref().unwrap().is_none(), "the sky");
    harness.handle(Event::Unpick);
    assert!(harness.session.picked().is_none());
}

#[test]
fn a_shape_of_an_import_reports_both_places() {
    let scene = "import \"parts.sdf\" as parts;
camera { from: [0, 0, 8], look: [0, 0, 0] }
let handle = parts::knob(1);
handle.translate(-1.5, 0, 0) | box(0.8).translate(1.5, 0, 0)
";
    let mut harness = Harness::new(scene);
    let parts = "\n/// A knob.\nfn knob(r) = sphere(r);\n";
    harness.files.put("parts.sdf", parts);
    harness.save(scene);
    harness.run_to_rest();
    harness.handle(Event::Pick(LEFT));
    harness.run_to_rest();
    let picked = harness.session.picked().unwrap();
    let pick = picked.result.as_ref().unwrap().as_ref().unwrap();
    let text = pick.to_string();
    let lines: Vec<&str> = text.lines().take(2).collect();
    assert!(lines[0].starts_with("parts.sdf:3:14"), "{text}");
    assert!(lines[1].starts_with("used in    a.sdf:4:1"), "{text}");
}

#[test]
fn the_object_that_was_picked_stands_out() {
    let mut harness = Harness::new(SCENE);
    harness.handle(Event::Show(ViewMode::Objects));
    harness.run_to_rest();
    let unpicked = harness.picture_bytes();
    harness.handle(Event::Pick(LEFT));
    harness.run_to_rest();
    let left = harness.picture_bytes();
    harness.handle(Event::Pick(RIGHT));
    harness.run_to_rest();
    let right = harness.picture_bytes();
    assert_ne!(left, unpicked);
    assert_ne!(right, unpicked);
    assert_ne!(left, right);
    harness.handle(Event::Unpick);
    harness.run_to_rest();
    assert_eq!(harness.picture_bytes(), unpicked);
}

#[test]
fn an_edit_ends_what_was_picked() {
    let mut harness = Harness::new(SCENE);
    harness.run_to_rest();
    harness.handle(Event::Pick(LEFT));
    harness.run_to_rest();
    harness.save("box(1)\n");
    harness.run_to_rest();
    assert!(harness.session.picked().is_none());
}
