//! The camera and time.

use crate::play::{Asked, Play, SIZE};
use sdfc_playground::camera::Side;
use sdfc_playground::session::{CameraEvent, Event, TimeEvent};
use sdfc_runtime::engine::EngineKind;
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
    play.takes(EngineKind::Cpu, Duration::from_millis(50));
    play.rest();
    let full = play.seen();
    let sizes = |asked: &[Asked]| -> Vec<[u32; 2]> {
        let draws = asked.iter().filter_map(|asked| match asked {
            Asked::Draw(_, size) => Some(*size),
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
    let told = play.session.facts().unwrap().drawing;
    let all = Duration::from_millis(4 * 50);
    assert!(
        told.abs_diff(all) < Duration::from_millis(1),
        "both parts: {told:?}"
    );
    assert_ne!(play.seen(), full);
    assert!(!play.session.is_busy());
}

#[test]
fn a_fine_picture_of_the_past_is_stopped() {
    let mut play = Play::of(SCENE);
    play.takes(EngineKind::Cpu, Duration::from_secs(2));
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

/// A ball before a wall that is far away: what is beside it on the screen is not beside it in space.
const DEEP: &str = "camera { from: [0, 0, 8], look: [0, 0, 0] }
sphere(1.2) | box(90, 90, 0.1).translate(0, 0, -8)
";
/// A place on the ball, seen from in front.
const ON_BALL: [f64; 2] = [0.1, 0.2];

/// Where a point is seen by the camera as it is now.
fn seen_at(play: &Play, point: [f64; 3]) -> [f64; 2] {
    let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
    let camera = play.session.camera().unwrap();
    camera.place_of(point, aspect).unwrap()
}

/// The point of the ball that is seen at the place from where the camera is, in closed form.
fn on_ball(play: &Play) -> [f64; 3] {
    let camera = play.session.camera().unwrap();
    let from = camera.view().from;
    let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
    let through = camera.point_under(ON_BALL, Some(1.0), aspect);
    let way: [f64; 3] = std::array::from_fn(|i| through[i] - from[i]);
    let along: f64 = (0..3).map(|i| from[i] * way[i]).sum();
    let far: f64 = from.iter().map(|v| v * v).sum();
    let t = -along - (along * along - far + 1.2 * 1.2).sqrt();
    std::array::from_fn(|i| from[i] + t * way[i])
}

fn assert_near(a: [f64; 2], b: [f64; 2]) {
    // Depths are those of pixels' middles.
    assert!(
        (a[0] - b[0]).hypot(a[1] - b[1]) < 0.02,
        "{a:?} is not {b:?}"
    );
}

#[test]
fn what_is_dragged_stays_under_the_cursor_while_no_picture_comes() {
    let mut play = Play::of(DEEP);
    play.rest();
    let point = on_ball(&play);
    let mut at = ON_BALL;
    for step in 1..=12 {
        let to = [ON_BALL[0] + 0.06 * f64::from(step), ON_BALL[1]];
        play.handle(Event::Camera(CameraEvent::Pan(at, to)));
        at = to;
    }
    assert_near(seen_at(&play, point), at);
    // Another place is another point: far away, the same way is longer.
    play.rest();
    let from = play.session.camera().unwrap().view().from[0];
    play.handle(Event::Camera(CameraEvent::Pan([-0.9, 0.9], [-0.8, 0.9])));
    let far = from - play.session.camera().unwrap().view().from[0];
    play.handle(Event::Camera(CameraEvent::Pan(at, [at[0] + 0.1, at[1]])));
    let now = play.session.camera().unwrap().view().from[0];
    assert!(far > 1.5 * (from - far - now), "{from} {far} {now}");
}

#[test]
fn what_is_zoomed_to_stays_under_the_cursor_while_no_picture_comes() {
    let mut play = Play::of(DEEP);
    play.rest();
    let point = on_ball(&play);
    for _ in 0..20 {
        play.handle(Event::Camera(CameraEvent::Zoom(0.9, ON_BALL)));
    }
    let seen = seen_at(&play, point);
    let from = play.session.camera().unwrap().view().from;
    assert_near(seen, ON_BALL);
    let way = (0..3).map(|i| (from[i] - point[i]).powi(2)).sum::<f64>();
    let expected = 0.9_f64.powi(20);
    let before = (0..3).map(|i| ([0.0, 0.0, 8.0][i] - point[i]).powi(2));
    let share = (way / before.sum::<f64>()).sqrt();
    assert!(
        (share - expected).abs() < 0.02,
        "{share} of the way, not {expected}"
    );
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
fn time_stands_still_while_nothing_can_be_drawn() {
    let structural = "param n = 1 in 1..=3;\nassert(n < 3, \"too many\");\n";
    let scene = "animate { duration: 2s, loop: true }
for i in 0..n { sphere(0.5).translate(sin(time * 3), i, 0) }
";
    let mut play = Play::of(&format!("{structural}{scene}"));
    play.rest();
    play.handle(Event::Time(TimeEvent::Toggle));
    play.handle(Event::Set(0, vec![3.0]));
    play.run_for(20);
    assert!(play.session.is_broken(), "{}", play.session.report());
    assert!(play.session.report().contains("too many"));
    let time = play.session.timeline().unwrap().time();
    assert_eq!(play.session.wakes(play.now), None, "for nothing");
    assert!(play.tasks().is_empty());
    assert_eq!(play.session.timeline().unwrap().time(), time);
    play.handle(Event::Set(0, vec![2.0]));
    play.run_for(10);
    assert!(!play.session.is_broken());
    assert!(play.session.wakes(play.now).is_some(), "it goes on");
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
