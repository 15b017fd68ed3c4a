//! What is seen besides the picture, and looking at one pixel.

use crate::play::{Asked, Pixels, Play};
use sdfc_playground::painter::{Show, SliceAt};
use sdfc_playground::seeing::slice::Front;
use sdfc_playground::session::{Event, Stage};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::frame::Mode;
use std::time::Duration;

const SCENE: &str = "camera { from: [0, 0, 8], look: [0, 0, 0] }
let left = sphere(1).translate(-1.5, 0, 0);
let right = box(0.8).translate(1.5, 0, 0);
left | right
";
const LEFT: [f64; 2] = [-0.4, 0.0];
const RIGHT: [f64; 2] = [0.4, 0.0];

fn at(place: f64) -> SliceAt {
    SliceAt {
        axis: 2,
        at: place,
        front: Front::Ghost,
    }
}

#[test]
fn everything_that_can_be_shown_is_another_picture() {
    let mut play = Play::of(SCENE);
    play.rest();
    let mut seen: Vec<(Show, Pixels)> = vec![(Show::default(), play.seen())];
    for show in [
        Show::Mode(Mode::Albedo),
        Show::Mode(Mode::Normal),
        Show::Mode(Mode::Depth),
        Show::Mode(Mode::Steps),
        Show::Slice(at(0.0)),
        Show::Slice(at(0.9)),
        Show::Slopes,
        Show::Cells,
        Show::Objects,
        Show::Difference(EngineKind::Cpu),
    ] {
        play.handle(Event::Show(show));
        play.rest();
        assert_eq!(play.session.facts().unwrap().show, show);
        let pixels = play.seen();
        let same = seen.iter().find(|(_, other)| *other == pixels);
        assert!(same.is_none(), "{show:?} is {:?}", same.unwrap().0);
        seen.push((show, pixels));
    }
}

#[test]
fn only_a_plane_that_is_moved_is_a_movement() {
    let mut play = Play::of(SCENE);
    play.takes(EngineKind::Cpu, Duration::from_secs(1));
    play.rest();
    // No time passes: what is at rest is refined at once.
    play.handle(Event::Show(Show::Mode(Mode::Normal)));
    play.run();
    assert_eq!(play.session.facts().unwrap().stage, Stage::Fine);
    play.handle(Event::Show(Show::Slice(at(0.0))));
    play.run();
    assert_eq!(play.session.facts().unwrap().stage, Stage::Full);
    play.handle(Event::Show(Show::Slice(at(0.5))));
    play.run();
    let stage = play.session.facts().unwrap().stage;
    assert!(matches!(stage, Stage::Coarse(_)), "{stage:?}");
    play.rest();
    assert_eq!(play.session.facts().unwrap().stage, Stage::Full);
}

#[test]
fn a_pixel_tells_the_line_that_made_it() {
    let mut play = Play::of(SCENE);
    play.rest();
    for (place, line, text) in [(LEFT, 2, "sphere(1)"), (RIGHT, 3, "box(0.8)")] {
        play.handle(Event::Pick(place));
        assert_eq!(play.rest(), [Asked::Pick]);
        let picked = play.session.picked().unwrap();
        let found = picked.found.as_ref().unwrap().as_ref().unwrap();
        assert_eq!(found.origins[0].place.line, line);
        assert_eq!(found.origins[0].text, text);
        assert!(found.field.abs() < 1e-3);
    }
    play.handle(Event::Pick([0.9, 0.9]));
    play.rest();
    let picked = play.session.picked().unwrap();
    assert!(picked.found.as_ref().unwrap().is_none(), "the sky");
    play.handle(Event::Unpick);
    assert!(play.session.picked().is_none());
}

#[test]
fn the_object_that_was_picked_stands_out() {
    let mut play = Play::of(SCENE);
    play.handle(Event::Show(Show::Objects));
    play.rest();
    let plain = play.seen();
    play.handle(Event::Pick(LEFT));
    play.rest();
    let left = play.seen();
    play.handle(Event::Pick(RIGHT));
    play.rest();
    let right = play.seen();
    assert_ne!(left, plain);
    assert_ne!(right, plain);
    assert_ne!(left, right);
    play.handle(Event::Unpick);
    play.rest();
    assert_eq!(play.seen(), plain);
}

#[test]
fn an_edit_ends_what_was_picked() {
    let mut play = Play::of(SCENE);
    play.rest();
    play.handle(Event::Pick(LEFT));
    play.rest();
    play.save("box(1)\n");
    play.rest();
    assert!(play.session.picked().is_none());
}
