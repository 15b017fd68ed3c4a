//! The camera and time.

use crate::play::{Asked, Play, SIZE};
use sdfc_playground::camera::Side;
use sdfc_playground::session::{CameraEvent, Event, TimeEvent};
use std::time::Duration;

const SCENE: &str = "camera front { from: [0, 0, 5], look: [0, 0, 0] }
camera above { from: [0, 5, 0.1], look: [0, 0, 0] }
box(1) | sphere(0.6).translate(1, 1, 0)
";
const MOVING: &str = "animate { duration: 2s, loop: true }
sphere(0.5).translate(sin(time * 3), 0, 0)
";

fn orbit() -> Event {
    Event::Camera(CameraEvent::Orbit([0.3, 0.2]))
}

#[test]
fn it_turns_stays_turned_over_an_edit_and_goes_back() {
    let mut play = Play::of(SCENE);
    play.rest();
    let before = play.seen();
    play.handle(orbit());
    play.rest();
    let turned = play.seen();
    assert_ne!(turned, before);
    assert!(play.session.has_own_view());
    play.save(&format!("{SCENE}// edited\n"));
    play.rest();
    assert_eq!(play.seen(), turned);
    play.handle(Event::Camera(CameraEvent::Scene(None)));
    play.rest();
    assert_eq!(play.seen(), before);
}

#[test]
fn the_scenes_cameras_are_chosen_by_name() {
    let mut play = Play::of(SCENE);
    play.rest();
    let (names, chosen) = play.session.cameras();
    assert_eq!((names, chosen), (vec!["front", "above"], Some("front")));
    let front = play.seen();
    play.handle(Event::Camera(CameraEvent::Scene(Some("above".to_owned()))));
    play.rest();
    assert_ne!(play.seen(), front);
    assert_eq!(play.session.cameras().1, Some("above"));
    // A camera that an edit takes away is no longer chosen.
    let without = SCENE.lines().filter(|line| !line.contains("above"));
    play.save(&without.collect::<Vec<_>>().join("\n"));
    play.rest();
    assert_eq!(play.session.cameras().1, Some("front"));
    assert_eq!(play.seen(), front);
}

#[test]
fn every_way_to_move_it_is_a_new_picture() {
    for event in [
        CameraEvent::Pan([0.0, 0.0], [0.3, 0.1]),
        CameraEvent::Zoom(0.5, [0.1, 0.1]),
        CameraEvent::Fit,
        CameraEvent::Focus([0.2, 0.0]),
        CameraEvent::Face(Side::Top),
        CameraEvent::ToggleLens,
    ] {
        let mut play = Play::of(SCENE);
        play.rest();
        let before = play.seen();
        play.handle(Event::Camera(event.clone()));
        play.rest();
        assert_ne!(play.seen(), before, "{event:?}");
    }
}

#[test]
fn what_is_slow_is_coarse_while_it_turns_and_refined_when_it_rests() {
    let mut play = Play::of(SCENE);
    // 50 ms for a picture in full.
    play.pretend[0] = Some(Duration::from_millis(50) / (SIZE[0] * SIZE[1]));
    play.rest();
    let full = play.seen();
    let sizes = |asked: &[Asked]| -> Vec<[u32; 2]> {
        let draws = asked.iter().filter_map(|asked| match asked {
            Asked::Draw(_, _, size) => Some(*size),
            _ => None,
        });
        draws.collect()
    };
    for _ in 0..5 {
        play.handle(orbit());
        let drawn = sizes(&play.run());
        assert_eq!(drawn, [[24, 16]], "one coarse picture for each move");
        play.pass(16);
    }
    let drawn = sizes(&play.rest());
    assert_eq!(drawn, [SIZE, SIZE], "in full, and with all samples");
    assert_ne!(play.seen(), full);
    assert!(!play.session.is_busy());
}

#[test]
fn a_fine_picture_of_the_past_is_stopped() {
    let mut play = Play::of(SCENE);
    play.pretend[0] = Some(Duration::from_secs(2) / (SIZE[0] * SIZE[1]));
    play.rest();
    play.handle(orbit());
    play.run();
    play.pass(500);
    let mut fine = play.tasks();
    assert_eq!(fine.len(), 1);
    play.handle(orbit());
    assert!(play.tasks().is_empty(), "one picture at a time");
    let version = play.session.seen().unwrap().1;
    let done = play.perform(fine.remove(0)).unwrap();
    play.session.done(done, play.now);
    assert_eq!(play.session.seen().unwrap().1, version, "it gave none");
    play.rest();
    assert!(!play.session.is_busy());
}

#[test]
fn time_passes_while_it_plays_and_only_then() {
    let mut play = Play::of(MOVING);
    play.rest();
    let start = play.seen();
    play.pass(1000);
    assert_eq!(play.rest(), []);
    play.handle(Event::Time(TimeEvent::Toggle));
    let mut pictures = vec![start.clone()];
    for _ in 0..5 {
        play.pass(100);
        for task in play.tasks() {
            let done = play.perform(task).unwrap();
            play.session.done(done, play.now);
        }
        assert!(play.session.wakes(play.now).is_some());
        pictures.push(play.seen());
    }
    pictures.dedup();
    assert_eq!(pictures.len(), 6);
    let time = play.session.timeline().unwrap().time();
    assert!((time - 0.5).abs() < 1e-9, "{time}");
    play.handle(Event::Time(TimeEvent::Toggle));
    play.rest();
    play.handle(Event::Time(TimeEvent::Scrub(0.0)));
    play.rest();
    assert_eq!(play.seen(), start);
    play.handle(Event::Time(TimeEvent::Step(1)));
    play.rest();
    assert_ne!(play.seen(), start);
}

#[test]
fn an_edit_keeps_the_time() {
    let mut play = Play::of(MOVING);
    play.rest();
    play.handle(Event::Time(TimeEvent::Scrub(1.25)));
    play.rest();
    play.save(&MOVING.replace("0.5", "0.7"));
    play.rest();
    assert_eq!(play.session.timeline().unwrap().time(), 1.25);
    play.save("sphere(1)\n");
    play.rest();
    assert!(play.session.timeline().is_none());
}
