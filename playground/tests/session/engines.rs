//! Engines that take over, fall back and fail.

use crate::play::{Asked, Play};
use sdfc_playground::painter::{Problem, Show};
use sdfc_playground::session::{Choice, Devices, Done, Event, Task, Tier};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::frame::Mode;
use std::time::Duration;

const HARDWARE: Devices = Devices {
    gpu: true,
    hardware: true,
};
const SOFTWARE: Devices = Devices {
    gpu: true,
    hardware: false,
};
const SCENE: &str = "sphere(1)\n";

fn drawers(asked: &[Asked]) -> Vec<EngineKind> {
    let draws = asked.iter().filter_map(|asked| match asked {
        Asked::Draw(_, engine, _) => Some(*engine),
        _ => None,
    });
    draws.collect()
}

/// A session in which a ray takes so many microseconds on either tier.
fn with_rays_of(first: u64, second: u64, devices: Devices) -> Play {
    let mut play = Play::on(SCENE, devices);
    play.pretend = [first, second].map(|us| Some(Duration::from_micros(us)));
    play
}

#[test]
fn the_interpreter_draws_until_generated_code_is_ready_and_again_after_an_edit() {
    let mut play = with_rays_of(20, 5, HARDWARE);
    let asked = play.rest();
    assert_eq!(drawers(&asked)[0], EngineKind::Interp);
    assert!(asked.contains(&Asked::Prepare));
    assert!(play.session.compared().is_some());
    play.handle(Event::Resized([40, 30]));
    assert_eq!(drawers(&play.rest())[0], EngineKind::Wgsl);
    play.save("box(1)\n");
    let asked = play.run();
    assert!(drawers(&asked).iter().all(|by| *by == EngineKind::Interp));
    assert!(!asked.contains(&Asked::Prepare), "not in a hurry");
    assert!(play.rest().contains(&Asked::Prepare));
    play.handle(Event::Resized([41, 30]));
    assert_eq!(drawers(&play.rest())[0], EngineKind::Wgsl);
}

#[test]
fn generated_code_that_is_slower_does_not_take_over_unless_it_is_asked_for() {
    let mut play = with_rays_of(5, 20, HARDWARE);
    play.rest();
    play.handle(Event::Resized([40, 30]));
    assert_eq!(drawers(&play.rest())[0], EngineKind::Interp);
    play.handle(Event::Engine(Choice::Only(EngineKind::Wgsl)));
    let asked = play.rest();
    assert_eq!(drawers(&asked)[0], EngineKind::Interp, "until it is ready");
    assert!(asked.contains(&Asked::Prepare));
    play.handle(Event::Resized([41, 30]));
    assert_eq!(drawers(&play.rest())[0], EngineKind::Wgsl);
}

#[test]
fn another_mode_is_prepared_too() {
    let mut play = with_rays_of(20, 5, HARDWARE);
    play.rest();
    play.handle(Event::Show(Show::Mode(Mode::Normal)));
    let asked = play.rest();
    assert_eq!(drawers(&asked)[0], EngineKind::Interp);
    assert!(asked.contains(&Asked::Prepare));
}

#[test]
fn without_hardware_the_cpu_draws_and_others_when_asked() {
    let mut play = with_rays_of(5, 5, SOFTWARE);
    let asked = play.rest();
    assert_eq!(drawers(&asked)[0], EngineKind::Cpu);
    assert!(!asked.contains(&Asked::Prepare));
    play.handle(Event::Engine(Choice::Only(EngineKind::Interp)));
    assert_eq!(drawers(&play.rest())[0], EngineKind::Interp);
}

#[test]
fn the_cpu_takes_over_from_an_engine_that_fails() {
    let mut play = with_rays_of(5, 5, HARDWARE);
    let mut failed = 0;
    for _ in 0..20 {
        for task in play.tasks() {
            let engine = match &task {
                Task::Draw(_, task) => Some(task.engine),
                _ => None,
            };
            let Some(mut done) = play.perform(task) else {
                continue;
            };
            if let (Some(EngineKind::Interp), Done::Drawn(_, drawn)) = (engine, &mut done) {
                drawn.picture = Err(Problem::Engine("the device is lost".to_owned()));
                failed += 1;
            }
            play.session.done(done, play.now);
        }
    }
    assert_eq!(failed, 1);
    assert!(play.session.seen().is_some());
    assert_eq!(play.session.facts().unwrap().engine, EngineKind::Cpu);
    let failures = play.session.failures();
    assert_eq!(failures, [(EngineKind::Interp, "the device is lost")]);
    assert!(play.session.said().unwrap().is_err());
}

#[test]
fn what_fails_on_the_cpu_is_told_and_not_tried_for_ever() {
    let mut play = Play::of(SCENE);
    for _ in 0..20 {
        for task in play.tasks() {
            let Some(mut done) = play.perform(task) else {
                continue;
            };
            if let Done::Drawn(_, drawn) = &mut done {
                drawn.picture = Err(Problem::Engine("a bug".to_owned()));
            }
            play.session.done(done, play.now);
        }
    }
    let draws = play
        .log
        .iter()
        .filter(|asked| matches!(asked, Asked::Draw(Tier::Instant, ..)));
    assert!(draws.count() <= 2, "{:?}", play.log);
    assert!(play.session.is_broken());
    assert!(play.session.report().contains("a bug"));
}
