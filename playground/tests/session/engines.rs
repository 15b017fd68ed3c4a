//! Engines that take over, fall back and fail.

use crate::play::{Asked, Play};
use sdfc_playground::painter::{DrawTask, Drawn, Problem, Show};
use sdfc_playground::session::{Choice, Devices, Done, Event, Stage, Task, TimeEvent};
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
        Asked::Draw(engine, _) => Some(*engine),
        _ => None,
    });
    draws.collect()
}

/// A session in which a ray takes so many microseconds on the interpreter and as generated code.
fn with_rays_of(first: u64, second: u64, devices: Devices) -> Play {
    let mut play = Play::on(SCENE, devices);
    for (engine, us) in [(EngineKind::Interp, first), (EngineKind::Wgsl, second)] {
        play.pretend.insert(engine, Duration::from_micros(us));
    }
    play
}

/// Has all done but what `other` takes, in some turns.
fn run_but(play: &mut Play, mut other: impl FnMut(&mut Play, Task) -> Option<Task>) {
    for _ in 0..20 {
        for task in play.tasks() {
            let Some(task) = other(play, task) else {
                continue;
            };
            if let Some(done) = play.perform(task) {
                play.session.done(done, play.now);
            }
        }
        play.pass(100);
    }
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

/// What became of a picture that could not be drawn.
fn failed(play: &mut Play, task: DrawTask, problem: Problem) -> Drawn {
    let Some(Done::Drawn(drawn)) = play.perform(Task::Draw(task)) else {
        panic!("it is a picture");
    };
    Drawn {
        picture: Err(problem),
        ..drawn
    }
}

#[test]
fn the_cpu_takes_over_from_an_engine_that_fails() {
    let mut play = with_rays_of(5, 5, HARDWARE);
    let mut failures = 0;
    run_but(&mut play, |play, task| match task {
        Task::Draw(task) if task.engine == EngineKind::Interp => {
            failures += 1;
            let lost = Problem::Engine("the device is lost".to_owned());
            let drawn = failed(play, task, lost);
            play.session.done(Done::Drawn(drawn), play.now);
            None
        }
        task => Some(task),
    });
    assert_eq!(failures, 1);
    assert!(play.session.seen().is_some());
    assert_eq!(play.session.facts().unwrap().engine, EngineKind::Cpu);
    let failures = play.session.failures();
    assert_eq!(failures, [(EngineKind::Interp, "the device is lost")]);
    assert!(play.session.said().unwrap().is_err());
}

#[test]
fn a_scene_that_is_too_long_for_an_engine_is_drawn_by_the_cpu_until_the_next_build() {
    let mut play = with_rays_of(5, 5, HARDWARE);
    let mut tried = 0;
    let refuse = |play: &mut Play, task, tried: &mut u32| match task {
        Task::Draw(task) if task.engine == EngineKind::Interp => {
            *tried += 1;
            let drawn = failed(play, task, Problem::TooLong("too long".to_owned()));
            play.session.done(Done::Drawn(drawn), play.now);
            None
        }
        task => Some(task),
    };
    run_but(&mut play, |play, task| refuse(play, task, &mut tried));
    assert_eq!(tried, 1);
    assert!(!play.session.is_broken(), "{}", play.session.report());
    assert_eq!(play.session.facts().unwrap().engine, EngineKind::Cpu);
    assert_eq!(play.session.failures(), [(EngineKind::Interp, "too long")]);
    play.handle(Event::Resized([40, 30]));
    run_but(&mut play, |play, task| refuse(play, task, &mut tried));
    assert_eq!(tried, 1, "of the same build");
    play.save("box(1)\n");
    play.rest();
    assert_eq!(play.session.failures(), []);
    assert_ne!(play.session.facts().unwrap().engine, EngineKind::Cpu);
}

#[test]
fn generated_code_that_cannot_be_is_not_tried_for_ever_but_after_an_edit() {
    for problem in [Problem::TooLong("no".into()), Problem::Scene("no".into())] {
        let mut play = with_rays_of(20, 5, HARDWARE);
        let mut tried = 0;
        run_but(&mut play, |play, task| match task {
            Task::Prepare(task) => {
                tried += 1;
                let drawn = failed(play, task, problem.clone());
                play.session.done(Done::Prepared(drawn), play.now);
                None
            }
            task => Some(task),
        });
        assert_eq!(tried, 1);
        assert_eq!(play.session.failures(), [(EngineKind::Wgsl, "no")]);
        assert!(!play.session.is_broken());
        play.save("box(1)\n");
        assert!(play.rest().contains(&Asked::Prepare), "{problem:?}");
        play.handle(Event::Resized([41, 30]));
        assert_eq!(drawers(&play.rest())[0], EngineKind::Wgsl);
    }
}

#[test]
fn the_cpu_draws_until_the_interpreter_is_warm() {
    let mut play = with_rays_of(20, 5, HARDWARE);
    let mut cold = Vec::new();
    run_but(&mut play, |_, task| match task {
        Task::WarmUp(_) => {
            cold.push(task);
            None
        }
        task => Some(task),
    });
    let facts = play.session.facts().unwrap();
    assert_eq!((facts.engine, facts.stage), (EngineKind::Cpu, Stage::Fine));
    assert_eq!(play.session.preparing(), Some(EngineKind::Interp));
    assert!(
        !play.log.contains(&Asked::Prepare),
        "with nothing to compare"
    );
    assert_eq!(cold.len(), 1);
    let warm = play.perform(cold.remove(0)).unwrap();
    play.session.done(warm, play.now);
    play.handle(Event::Resized([40, 30]));
    assert_eq!(drawers(&play.rest())[0], EngineKind::Interp);
    assert!(play.log.contains(&Asked::Prepare));
}

#[test]
fn an_interpreter_that_does_not_get_warm_is_done_without() {
    let mut play = with_rays_of(20, 5, HARDWARE);
    run_but(&mut play, |play, task| match task {
        Task::WarmUp(engine) => {
            let lost = Problem::Engine("no memory".to_owned());
            play.session.done(Done::Warm(engine, Err(lost)), play.now);
            None
        }
        task => Some(task),
    });
    assert!(!drawers(&play.log).contains(&EngineKind::Interp));
    let warmed = play.log.iter().filter(|a| matches!(a, Asked::WarmUp(_)));
    assert_eq!(warmed.count(), 1);
    assert_eq!(play.session.failures(), [(EngineKind::Interp, "no memory")]);
}

#[test]
fn generated_code_is_made_ready_while_an_animation_plays() {
    let mut play = with_rays_of(20, 5, HARDWARE);
    play.save("animate { duration: 2s, loop: true }\nsphere(1 + 0.1 * sin(time * 3))\n");
    play.run();
    play.handle(Event::Time(TimeEvent::Toggle));
    let asked = play.run_for(60);
    assert!(asked.contains(&Asked::Prepare));
    assert_eq!(drawers(&asked).last(), Some(&EngineKind::Wgsl));
}

#[test]
fn what_fails_on_the_cpu_is_told_and_not_tried_for_ever() {
    let mut play = Play::of(SCENE);
    run_but(&mut play, |play, task| match task {
        Task::Draw(task) => {
            let drawn = failed(play, task, Problem::Engine("a bug".to_owned()));
            play.session.done(Done::Drawn(drawn), play.now);
            None
        }
        task => Some(task),
    });
    assert!(drawers(&play.log).len() <= 2, "{:?}", play.log);
    assert!(play.session.is_broken());
    assert!(play.session.report().contains("a bug"));
}
