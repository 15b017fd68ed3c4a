//! Tests of the camera and the animation time.

use crate::harness::{Harness, SIZE, TaskKind};
use glam::DVec3;
use sdfc_playground::session::{CameraEvent, Event, TimeEvent};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::settings::ViewSide;
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
fn a_camera_turns_stays_turned_over_an_edit_and_goes_back() {
    let mut harness = Harness::new(SCENE);
    harness.run_to_rest();
    let previous = harness.picture_bytes();
    harness.handle(orbit());
    harness.run_to_rest();
    let turned_picture = harness.picture_bytes();
    assert_ne!(turned_picture, previous);
    assert!(harness.session.is_camera_moved());
    harness.save(&format!("{SCENE}// edited\n"));
    harness.run_to_rest();
    assert_eq!(harness.picture_bytes(), turned_picture);
    harness.handle(Event::Camera(CameraEvent::Scene(None)));
    harness.run_to_rest();
    assert_eq!(harness.picture_bytes(), previous);
}

#[test]
fn the_scenes_cameras_are_chosen_by_name() {
    let mut harness = Harness::new(SCENE);
    harness.run_to_rest();
    let (names, chosen) = harness.session.cameras();
    assert_eq!((names, chosen), (vec!["front", "above"], Some("front")));
    let front = harness.picture_bytes();
    harness.handle(Event::Camera(CameraEvent::Scene(Some("above".to_owned()))));
    harness.run_to_rest();
    assert_ne!(harness.picture_bytes(), front);
    assert_eq!(harness.session.cameras().1, Some("above"));
    // A camera removed by an edit is deselected.
    let without = SCENE.lines().filter(|line| !line.contains("above"));
    harness.save(&without.collect::<Vec<_>>().join("\n"));
    harness.run_to_rest();
    assert_eq!(harness.session.cameras().1, Some("front"));
    assert_eq!(harness.picture_bytes(), front);
}

#[test]
fn every_way_to_move_it_is_a_new_picture() {
    for event in [
        CameraEvent::Pan([0.0, 0.0], [0.3, 0.1]),
        CameraEvent::Zoom(0.5, [0.1, 0.1]),
        CameraEvent::Fit,
        CameraEvent::Focus([0.2, 0.0]),
        CameraEvent::Face(ViewSide::Top),
        CameraEvent::ToggleLens,
    ] {
        let mut harness = Harness::new(SCENE);
        harness.run_to_rest();
        let previous = harness.picture_bytes();
        harness.handle(Event::Camera(event.clone()));
        harness.run_to_rest();
        assert_ne!(harness.picture_bytes(), previous, "{event:?}");
    }
}

#[test]
fn slow_scenes_are_coarse_while_turning_and_refined_at_rest() {
    let mut harness = Harness::new(SCENE);
    // A picture at full resolution takes 50 ms.
    harness.set_frame_time(EngineKind::Cpu, Duration::from_millis(50));
    harness.run_to_rest();
    let full = harness.picture_bytes();
    let sizes = |requested: &[TaskKind]| -> Vec<[u32; 2]> {
        let draws = requested.iter().filter_map(|requested| match requested {
            TaskKind::Draw(_, size) => Some(*size),
            _ => None,
        });
        draws.collect()
    };
    for _ in 0..5 {
        harness.handle(orbit());
        let drawn = sizes(&harness.run());
        assert_eq!(drawn, [[24, 16]], "one coarse picture for each move");
        harness.advance(16);
    }
    let drawn = sizes(&harness.run_to_rest());
    assert_eq!(drawn, [SIZE, SIZE], "in full, and with all samples");
    let drawing_time = harness.session.facts().unwrap().drawing;
    let expected_time = Duration::from_millis(4 * 50);
    assert!(
        drawing_time.abs_diff(expected_time) < Duration::from_millis(1),
        "both parts: {drawing_time:?}"
    );
    assert_ne!(harness.picture_bytes(), full);
    assert!(!harness.session.is_busy());
}

#[test]
fn a_camera_in_motion_is_not_at_rest_between_two_pictures() {
    let mut harness = Harness::new(SCENE);
    harness.run_to_rest();
    harness.handle(orbit());
    harness.run();
    let is_moving = |harness: &Harness| harness.session.is_moving(harness.now);
    assert!(!harness.session.is_busy() && is_moving(&harness));
    harness.run_to_rest();
    assert!(!is_moving(&harness));
}

#[test]
fn a_fine_picture_of_the_past_is_stopped() {
    let mut harness = Harness::new(SCENE);
    harness.set_frame_time(EngineKind::Cpu, Duration::from_secs(2));
    harness.run_to_rest();
    harness.handle(orbit());
    harness.run();
    harness.advance(500);
    let mut fine_tasks = harness.tasks();
    assert_eq!(fine_tasks.len(), 1);
    harness.handle(orbit());
    assert!(harness.tasks().is_empty(), "one picture at a time");
    let version = harness.session.picture().unwrap().1;
    let result = harness.perform(fine_tasks.remove(0)).unwrap();
    harness.session.finish_task(result, harness.now);
    assert_eq!(
        harness.session.picture().unwrap().1,
        version,
        "it gave none"
    );
    harness.run_to_rest();
    assert!(!harness.session.is_busy());
}

/// A sphere in front of a distant wall: points adjacent on screen are far apart in space.
const DEEP_SCENE: &str = "camera { from: [0, 0, 8], look: [0, 0, 0] }
sphere(1.2) | box(90, 90, 0.1).translate(0, 0, -8)
";
/// A picture point on the sphere, seen from the front.
const ON_SPHERE: [f64; 2] = [0.1, 0.2];

/// Projects a point with the current camera.
fn project(harness: &Harness, point: [f64; 3]) -> [f64; 2] {
    let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
    let camera = harness.session.camera().unwrap();
    camera.project(point, aspect).unwrap()
}

/// Returns the point of the sphere under [`ON_SPHERE`] for the current camera, in closed form.
fn point_on_sphere(harness: &Harness) -> [f64; 3] {
    let camera = harness.session.camera().unwrap();
    let from = DVec3::from(camera.view().from);
    let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
    let direction = DVec3::from(camera.point_under(ON_SPHERE, Some(1.0), aspect)) - from;
    let along = from.dot(direction);
    let t = -along - (along * along - from.length_squared() + 1.2 * 1.2).sqrt();
    (from + t * direction).into()
}

fn assert_near(a: [f64; 2], b: [f64; 2]) {
    // Depths are those of pixel centres.
    assert!(
        (a[0] - b[0]).hypot(a[1] - b[1]) < 0.02,
        "{a:?} is not {b:?}"
    );
}

#[test]
fn a_dragged_point_stays_under_the_cursor_until_the_next_picture() {
    let mut harness = Harness::new(DEEP_SCENE);
    harness.run_to_rest();
    let point = point_on_sphere(&harness);
    let mut cursor = ON_SPHERE;
    for step in 1..=12 {
        let to = [ON_SPHERE[0] + 0.06 * f64::from(step), ON_SPHERE[1]];
        harness.handle(Event::Camera(CameraEvent::Pan(cursor, to)));
        cursor = to;
    }
    assert_near(project(&harness, point), cursor);
    // A pan at another point moves by that point's depth: the same delta is longer on the distant wall.
    harness.run_to_rest();
    let from = harness.session.camera().unwrap().view().from[0];
    harness.handle(Event::Camera(CameraEvent::Pan([-0.9, 0.9], [-0.8, 0.9])));
    let far_delta = from - harness.session.camera().unwrap().view().from[0];
    harness.handle(Event::Camera(CameraEvent::Pan(
        cursor,
        [cursor[0] + 0.1, cursor[1]],
    )));
    let current = harness.session.camera().unwrap().view().from[0];
    assert!(
        far_delta > 1.5 * (from - far_delta - current),
        "{from} {far_delta} {current}"
    );
}

#[test]
fn a_point_zoomed_to_stays_under_the_cursor_until_the_next_picture() {
    let mut harness = Harness::new(DEEP_SCENE);
    harness.run_to_rest();
    let point = point_on_sphere(&harness);
    for _ in 0..20 {
        harness.handle(Event::Camera(CameraEvent::Zoom(0.9, ON_SPHERE)));
    }
    let projected = project(&harness, point);
    let from = harness.session.camera().unwrap().view().from;
    assert_near(projected, ON_SPHERE);
    let distance_sq = |from: DVec3| from.distance_squared(point.into());
    let expected = 0.9_f64.powi(20);
    let previous = DVec3::new(0.0, 0.0, 8.0);
    let fraction = (distance_sq(from.into()) / distance_sq(previous)).sqrt();
    assert!(
        (fraction - expected).abs() < 0.02,
        "{fraction} of the way, not {expected}"
    );
}

#[test]
fn time_passes_while_it_plays_and_only_then() {
    let mut harness = Harness::new(MOVING);
    harness.run_to_rest();
    let start = harness.picture_bytes();
    harness.advance(1000);
    assert_eq!(harness.run_to_rest(), []);
    harness.handle(Event::Time(TimeEvent::Toggle));
    let mut pictures = vec![start.clone()];
    for _ in 0..5 {
        harness.advance(100);
        for task in harness.tasks() {
            let result = harness.perform(task).unwrap();
            harness.session.finish_task(result, harness.now);
        }
        assert!(harness.session.next_wakeup(harness.now).is_some());
        pictures.push(harness.picture_bytes());
    }
    pictures.dedup();
    assert_eq!(pictures.len(), 6);
    let time = harness.session.timeline().unwrap().time();
    assert!((time - 0.5).abs() < 1e-9, "{time}");
    harness.handle(Event::Time(TimeEvent::Toggle));
    harness.run_to_rest();
    harness.handle(Event::Time(TimeEvent::Scrub(0.0)));
    harness.run_to_rest();
    assert_eq!(harness.picture_bytes(), start);
    harness.handle(Event::Time(TimeEvent::Step(1)));
    harness.run_to_rest();
    assert_ne!(harness.picture_bytes(), start);
}

#[test]
fn time_stands_still_while_nothing_can_be_drawn() {
    let structural = "param n = 1 in 1..=3;\nassert(n < 3, \"too many\");\n";
    let scene = "animate { duration: 2s, loop: true }
for i in 0..n { sphere(0.5).translate(sin(time * 3), i, 0) }
";
    let mut harness = Harness::new(&format!("{structural}{scene}"));
    harness.run_to_rest();
    harness.handle(Event::Time(TimeEvent::Toggle));
    harness.handle(Event::Set(0, vec![3.0]));
    harness.run_for(20);
    assert!(harness.session.is_broken(), "{}", harness.session.report());
    assert!(harness.session.report().contains("too many"));
    let time = harness.session.timeline().unwrap().time();
    assert_eq!(
        harness.session.next_wakeup(harness.now),
        None,
        "for nothing"
    );
    assert!(harness.tasks().is_empty());
    assert_eq!(harness.session.timeline().unwrap().time(), time);
    harness.handle(Event::Set(0, vec![2.0]));
    harness.run_for(10);
    assert!(!harness.session.is_broken());
    assert!(
        harness.session.next_wakeup(harness.now).is_some(),
        "it goes on"
    );
}

#[test]
fn an_edit_keeps_the_time() {
    let mut harness = Harness::new(MOVING);
    harness.run_to_rest();
    harness.handle(Event::Time(TimeEvent::Scrub(1.25)));
    harness.run_to_rest();
    harness.save(&MOVING.replace("0.5", "0.7"));
    harness.run_to_rest();
    assert_eq!(harness.session.timeline().unwrap().time(), 1.25);
    harness.save("sphere(1)\n");
    harness.run_to_rest();
    assert!(harness.session.timeline().is_none());
}
