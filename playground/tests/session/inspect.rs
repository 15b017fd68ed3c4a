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
