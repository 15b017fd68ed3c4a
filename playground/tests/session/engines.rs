//! Tests of engines that take over, fall back and fail.

use crate::harness::{Harness, TaskKind};
use sdfc_playground::renderer::{DrawError, DrawResult, DrawTask, ViewMode};
use sdfc_playground::session::{
    Devices, EngineChoice, Event, RefinementStage, Task, TaskResult, TimeEvent,
};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::render::Mode;
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

fn drawers(requested: &[TaskKind]) -> Vec<EngineKind> {
    let draws = requested.iter().filter_map(|requested| match requested {
        TaskKind::Draw(engine, _) => Some(*engine),
        _ => None,
    });
    draws.collect()
}

/// Creates a session in which a ray takes `first` µs on the interpreter and `second` µs as generated
/// code.
fn with_ray_times(first: u64, second: u64, devices: Devices) -> Harness {
    let mut harness = Harness::with_devices(SCENE, devices);
    for (engine, us) in [(EngineKind::Interp, first), (EngineKind::Wgsl, second)] {
        harness.ray_times.insert(engine, Duration::from_micros(us));
    }
    harness
}

/// Runs 20 turns. `other` may take tasks; all remaining ones are performed.
fn run_except(harness: &mut Harness, mut other: impl FnMut(&mut Harness, Task) -> Option<Task>) {
    for _ in 0..20 {
        for task in harness.tasks() {
            let Some(task) = other(harness, task) else {
                continue;
            };
            if let Some(done) = harness.perform(task) {
                harness.session.finish_task(done, harness.now);
            }
        }
        harness.advance(100);
    }
}

#[test]
fn the_interpreter_draws_until_generated_code_is_ready_and_again_after_an_edit() {
    let mut harness = with_ray_times(20, 5, HARDWARE);
    let requested = harness.run_to_rest();
    assert_eq!(drawers(&requested)[0], EngineKind::Interp);
    assert!(requested.contains(&TaskKind::Prepare));
    assert!(harness.session.compared_times().is_some());
    harness.handle(Event::Resized([40, 30]));
    assert_eq!(drawers(&harness.run_to_rest())[0], EngineKind::Wgsl);
    harness.save("box(1)\n");
    let requested = harness.run();
    assert!(
        drawers(&requested)
            .iter()
            .all(|by| *by == EngineKind::Interp)
    );
    assert!(!requested.contains(&TaskKind::Prepare), "not in a hurry");
    assert!(harness.run_to_rest().contains(&TaskKind::Prepare));
    harness.handle(Event::Resized([41, 30]));
    assert_eq!(drawers(&harness.run_to_rest())[0], EngineKind::Wgsl);
}

#[test]
fn slower_generated_code_takes_over_only_if_requested() {
    let mut harness = with_ray_times(5, 20, HARDWARE);
    harness.run_to_rest();
    harness.handle(Event::Resized([40, 30]));
    assert_eq!(drawers(&harness.run_to_rest())[0], EngineKind::Interp);
    harness.handle(Event::Engine(EngineChoice::Only(EngineKind::Wgsl)));
    let requested = harness.run_to_rest();
    assert_eq!(
        drawers(&requested)[0],
        EngineKind::Interp,
        "until it is ready"
    );
    assert!(requested.contains(&TaskKind::Prepare));
    harness.handle(Event::Resized([41, 30]));
    assert_eq!(drawers(&harness.run_to_rest())[0], EngineKind::Wgsl);
}

#[test]
fn another_mode_is_prepared_too() {
    let mut harness = with_ray_times(20, 5, HARDWARE);
    harness.run_to_rest();
    harness.handle(Event::Show(ViewMode::Mode(Mode::Normal)));
    let requested = harness.run_to_rest();
    assert_eq!(drawers(&requested)[0], EngineKind::Interp);
    assert!(requested.contains(&TaskKind::Prepare));
}

#[test]
fn without_hardware_the_cpu_draws_and_others_if_requested() {
    let mut harness = with_ray_times(5, 5, SOFTWARE);
    let requested = harness.run_to_rest();
    assert_eq!(drawers(&requested)[0], EngineKind::Cpu);
    assert!(!requested.contains(&TaskKind::Prepare));
    harness.handle(Event::Engine(EngineChoice::Only(EngineKind::Interp)));
    assert_eq!(drawers(&harness.run_to_rest())[0], EngineKind::Interp);
}

#[test]
fn the_picture_at_rest_is_that_of_the_chosen_engine() {
    for devices in [SOFTWARE, HARDWARE] {
        let mut harness = with_ray_times(5, 20, devices);
        harness.run_to_rest();
        for kind in [EngineKind::Wgsl, EngineKind::Interp, EngineKind::Cpu] {
            harness.handle(Event::Engine(EngineChoice::Only(kind)));
            harness.run_to_rest();
            let facts = harness.session.facts().unwrap();
            assert_eq!((facts.engine, facts.stage), (kind, RefinementStage::Fine));
        }
        harness.handle(Event::Engine(EngineChoice::Only(EngineKind::Wgsl)));
        harness.run_to_rest();
        harness.save("box(1)\n");
        harness.run_to_rest();
        let facts = harness.session.facts().unwrap();
        assert_eq!(facts.engine, EngineKind::Wgsl, "of another scene");
    }
}

/// Returns the result of a picture that failed with an error.
fn failed(harness: &mut Harness, task: DrawTask, problem: DrawError) -> DrawResult {
    let Some(TaskResult::Drawn(drawn)) = harness.perform(Task::Draw(task)) else {
        panic!("it is a picture");
    };
    DrawResult {
        picture: Err(problem),
        ..drawn
    }
}

#[test]
fn the_cpu_takes_over_from_an_engine_that_fails() {
    let mut harness = with_ray_times(5, 5, HARDWARE);
    let mut failures = 0;
    run_except(&mut harness, |harness, task| match task {
        Task::Draw(task) if task.engine == EngineKind::Interp => {
            failures += 1;
            let lost = DrawError::Engine("the device is lost".to_owned());
            let drawn = failed(harness, task, lost);
            harness
                .session
                .finish_task(TaskResult::Drawn(drawn), harness.now);
            None
        }
        task => Some(task),
    });
    assert_eq!(failures, 1);
    assert!(harness.session.picture().is_some());
    assert_eq!(harness.session.facts().unwrap().engine, EngineKind::Cpu);
    let failures = harness.session.failures();
    assert_eq!(failures, [(EngineKind::Interp, "the device is lost")]);
    assert!(harness.session.message().unwrap().is_err());
}

#[test]
fn a_scene_that_is_too_long_for_an_engine_is_drawn_by_the_cpu_until_the_next_build() {
    let mut harness = with_ray_times(5, 5, HARDWARE);
    let mut tried = 0;
    let refuse = |harness: &mut Harness, task, tried: &mut u32| match task {
        Task::Draw(task) if task.engine == EngineKind::Interp => {
            *tried += 1;
            let drawn = failed(harness, task, DrawError::TooLong("too long".to_owned()));
            harness
                .session
                .finish_task(TaskResult::Drawn(drawn), harness.now);
            None
        }
        task => Some(task),
    };
    run_except(&mut harness, |harness, task| {
        refuse(harness, task, &mut tried)
    });
    assert_eq!(tried, 1);
    assert!(!harness.session.is_broken(), "{}", harness.session.report());
    assert_eq!(harness.session.facts().unwrap().engine, EngineKind::Cpu);
    assert_eq!(
        harness.session.failures(),
        [(EngineKind::Interp, "too long")]
    );
    harness.handle(Event::Resized([40, 30]));
    run_except(&mut harness, |harness, task| {
        refuse(harness, task, &mut tried)
    });
    assert_eq!(tried, 1, "of the same build");
    harness.save("box(1)\n");
    harness.run_to_rest();
    assert_eq!(harness.session.failures(), []);
    assert_ne!(harness.session.facts().unwrap().engine, EngineKind::Cpu);
}

#[test]
fn generated_code_that_cannot_be_is_not_tried_for_ever_but_after_an_edit() {
    for problem in [
        DrawError::TooLong("no".into()),
        DrawError::Scene("no".into()),
    ] {
        let mut harness = with_ray_times(20, 5, HARDWARE);
        let mut tried = 0;
        run_except(&mut harness, |harness, task| match task {
            Task::Prepare(task) => {
                tried += 1;
                let drawn = failed(harness, task, problem.clone());
                harness
                    .session
                    .finish_task(TaskResult::Prepared(drawn), harness.now);
                None
            }
            task => Some(task),
        });
        assert_eq!(tried, 1);
        assert_eq!(harness.session.failures(), [(EngineKind::Wgsl, "no")]);
        assert!(!harness.session.is_broken());
        harness.save("box(1)\n");
        assert!(
            harness.run_to_rest().contains(&TaskKind::Prepare),
            "{problem:?}"
        );
        harness.handle(Event::Resized([41, 30]));
        assert_eq!(drawers(&harness.run_to_rest())[0], EngineKind::Wgsl);
    }
}

#[test]
fn the_cpu_draws_until_the_interpreter_is_warm() {
    let mut harness = with_ray_times(20, 5, HARDWARE);
    let mut cold = Vec::new();
    run_except(&mut harness, |_, task| match task {
        Task::WarmUp(_) => {
            cold.push(task);
            None
        }
        task => Some(task),
    });
    let facts = harness.session.facts().unwrap();
    assert_eq!(
        (facts.engine, facts.stage),
        (EngineKind::Cpu, RefinementStage::Fine)
    );
    assert_eq!(harness.session.preparing(), Some(EngineKind::Interp));
    assert!(
        !harness.log.contains(&TaskKind::Prepare),
        "with nothing to compare"
    );
    assert_eq!(cold.len(), 1);
    let warm = harness.perform(cold.remove(0)).unwrap();
    harness.session.finish_task(warm, harness.now);
    harness.handle(Event::Resized([40, 30]));
    assert_eq!(drawers(&harness.run_to_rest())[0], EngineKind::Interp);
    assert!(harness.log.contains(&TaskKind::Prepare));
}

#[test]
fn an_interpreter_that_does_not_get_warm_is_done_without() {
    let mut harness = with_ray_times(20, 5, HARDWARE);
    run_except(&mut harness, |harness, task| match task {
        Task::WarmUp(engine) => {
            let lost = DrawError::Engine("no memory".to_owned());
            harness
                .session
                .finish_task(TaskResult::Warm(engine, Err(lost)), harness.now);
            None
        }
        task => Some(task),
    });
    assert!(!drawers(&harness.log).contains(&EngineKind::Interp));
    let warmed = harness
        .log
        .iter()
        .filter(|a| matches!(a, TaskKind::WarmUp(_)));
    assert_eq!(warmed.count(), 1);
    assert_eq!(
        harness.session.failures(),
        [(EngineKind::Interp, "no memory")]
    );
}

#[test]
fn generated_code_is_made_ready_while_an_animation_plays() {
    let mut harness = with_ray_times(20, 5, HARDWARE);
    harness.save("animate { duration: 2s, loop: true }\nsphere(1 + 0.1 * sin(time * 3))\n");
    harness.run();
    harness.handle(Event::Time(TimeEvent::Toggle));
    let requested = harness.run_for(60);
    assert!(requested.contains(&TaskKind::Prepare));
    assert_eq!(drawers(&requested).last(), Some(&EngineKind::Wgsl));
}

#[test]
fn failures_of_the_cpu_are_reported_and_not_retried_for_ever() {
    let mut harness = Harness::new(SCENE);
    run_except(&mut harness, |harness, task| match task {
        Task::Draw(task) => {
            let drawn = failed(harness, task, DrawError::Engine("a bug".to_owned()));
            harness
                .session
                .finish_task(TaskResult::Drawn(drawn), harness.now);
            None
        }
        task => Some(task),
    });
    assert!(drawers(&harness.log).len() <= 2, "{:?}", harness.log);
    assert!(harness.session.is_broken());
    assert!(harness.session.report().contains("a bug"));
}
