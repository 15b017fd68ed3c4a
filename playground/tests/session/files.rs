//! Tests of scenes that are edited, broken, repaired, removed and restored.

use crate::harness::{Harness, TaskKind};
use sdfc_lang::Sources;
use sdfc_playground::build::SceneOrigin;
use sdfc_playground::session::Event;
use std::path::PathBuf;

const SPHERE: &str = "sphere(1)\n";
const BOX: &str = "box(1)\n";
const BROKEN: &str = "sphere(1\n";

#[test]
fn a_session_opens_draws_and_rests() {
    let mut harness = Harness::new(SPHERE);
    let requested = harness.run_to_rest();
    assert_eq!(requested[0], TaskKind::Build);
    assert_eq!(harness.session.report(), "");
    assert!(harness.session.picture().is_some());
    let facts = harness.session.facts().unwrap();
    assert_eq!(facts.size, [48, 32]);
    assert!(!harness.session.is_busy());
    // The session stays at rest.
    harness.advance(60_000);
    assert_eq!(harness.run_to_rest(), []);
}

#[test]
fn an_edit_is_one_build_and_another_picture() {
    let mut harness = Harness::new(SPHERE);
    harness.run_to_rest();
    let previous = harness.picture_bytes();
    // Like an editor that saves in several steps.
    for text in ["", "bo", BOX] {
        harness.files.put("a.sdf", text);
        harness.handle(Event::FilesChanged);
        harness.advance(3);
        assert_eq!(harness.run(), [], "the files have not settled");
    }
    harness.advance(50);
    let requested = harness.run_to_rest();
    let builds = requested
        .iter()
        .filter(|requested| **requested == TaskKind::Build);
    assert_eq!(builds.count(), 1);
    assert_ne!(harness.picture_bytes(), previous);
}

#[test]
fn saving_the_same_text_changes_nothing_that_is_seen() {
    let mut harness = Harness::new(SPHERE);
    harness.run_to_rest();
    let previous = harness.picture_bytes();
    harness.save(SPHERE);
    harness.run_to_rest();
    assert_eq!(harness.picture_bytes(), previous);
}

#[test]
fn edits_while_one_is_built_end_in_the_last_one() {
    let mut harness = Harness::new(SPHERE);
    let building = harness.tasks();
    // Two saves before the first build is done.
    harness.save(BROKEN);
    assert!(harness.tasks().is_empty(), "one build at a time");
    harness.save(BOX);
    for task in building {
        let result = harness.perform(task).unwrap();
        harness.session.finish_task(result, harness.now);
    }
    harness.run_to_rest();
    assert!(!harness.session.is_broken());
    let mut other = Harness::new(BOX);
    other.run_to_rest();
    assert_eq!(harness.picture_bytes(), other.picture_bytes());
}

#[test]
fn a_broken_scene_leaves_the_picture_and_reports_as_check_does() {
    let mut harness = Harness::new(SPHERE);
    harness.run_to_rest();
    let previous = harness.picture_bytes();
    harness.save(BROKEN);
    harness.run_to_rest();
    assert!(harness.session.is_broken());
    assert_eq!(harness.picture_bytes(), previous);
    let mut sources = Sources::new();
    let file = sources.add("a.sdf", BROKEN);
    let (_, diagnostics) = sdfc_lang::parse(&sources, file);
    let diagnostics = sdfc_lang::Diagnostics::from_iter(diagnostics);
    let message = diagnostics.render(&sources, sdfc_lang::Style::Plain);
    assert_eq!(harness.session.report(), message);
    harness.save(BOX);
    harness.run_to_rest();
    assert!(!harness.session.is_broken());
    assert_eq!(harness.session.report(), "");
    assert_ne!(harness.picture_bytes(), previous);
}

#[test]
fn a_scene_that_is_broken_from_the_start_can_be_mended() {
    let mut harness = Harness::new(BROKEN);
    harness.run_to_rest();
    assert!(harness.session.is_broken());
    assert!(harness.session.picture().is_none());
    harness.save(SPHERE);
    harness.run_to_rest();
    assert!(harness.session.picture().is_some() && !harness.session.is_broken());
}

#[test]
fn warnings_stay_beside_the_picture() {
    let mut harness = Harness::new("let unused = 1;\nsphere(1)\n");
    harness.run_to_rest();
    assert!(!harness.session.is_broken());
    assert!(harness.session.report().contains("unused"));
    assert!(harness.session.picture().is_some());
}

#[test]
fn a_file_that_vanishes_is_followed_until_it_is_back() {
    let mut harness = Harness::new(SPHERE);
    harness.run_to_rest();
    let previous = harness.picture_bytes();
    harness.files.remove("a.sdf");
    harness.handle(Event::FilesChanged);
    harness.advance(50);
    harness.run_to_rest();
    assert!(harness.session.is_broken());
    let report = harness.session.report();
    assert_eq!(
        report,
        "error: a.sdf cannot be read: there is no such file\n"
    );
    assert_eq!(harness.picture_bytes(), previous);
    harness.save(BOX);
    harness.run_to_rest();
    assert!(!harness.session.is_broken());
    assert_ne!(harness.picture_bytes(), previous);
}

#[test]
fn imported_files_are_watched_also_those_that_are_not_there() {
    let mut harness = Harness::new("import \"part.sdf\" as lib;\nlib::knob(1)\n");
    let watched_files = TaskKind::Watch(["a.sdf", "part.sdf"].map(PathBuf::from).to_vec());
    assert!(
        harness.run_to_rest().contains(&watched_files),
        "{:?}",
        harness.log
    );
    assert!(harness.session.is_broken());
    harness.files.put("part.sdf", "fn knob(r) = sphere(r);\n");
    harness.handle(Event::FilesChanged);
    harness.advance(50);
    harness.run_to_rest();
    assert!(!harness.session.is_broken(), "{}", harness.session.report());
    let previous = harness.picture_bytes();
    harness.files.put("part.sdf", "fn knob(r) = box(r);\n");
    harness.handle(Event::FilesChanged);
    harness.advance(50);
    harness.run_to_rest();
    assert_ne!(harness.picture_bytes(), previous);
}

#[test]
fn another_scene_is_opened_in_its_place() {
    let mut harness = Harness::new("param r = 1.0 in 0.5..2.0;\nsphere(r)\n");
    harness.run_to_rest();
    let previous = harness.picture_bytes();
    harness.handle(Event::Open(SceneOrigin::Text {
        name: "built-in".to_owned(),
        text: BOX.to_owned(),
    }));
    let requested = harness.run_to_rest();
    assert!(requested.contains(&TaskKind::Watch(Vec::new())));
    assert_ne!(harness.picture_bytes(), previous);
    assert!(harness.session.params().is_empty());
}

#[test]
fn a_file_that_cannot_be_opened_leaves_the_working_scene() {
    let mut harness = Harness::new("param r = 1.0 in 0.5..2.0;\nsphere(r)\n");
    harness.files.put("broken.sdf", BROKEN);
    harness.run_to_rest();
    harness.handle(Event::Set(0, vec![1.5]));
    harness.run_to_rest();
    let previous = harness.picture_bytes();
    for (path, reason) in [
        (
            "missing.sdf",
            "missing.sdf was not opened: missing.sdf cannot be read",
        ),
        ("broken.sdf", "(broken.sdf:1:7)"),
    ] {
        harness.handle(Event::Open(SceneOrigin::File(PathBuf::from(path))));
        harness.run_to_rest();
        let message = harness.session.message().unwrap().unwrap_err();
        assert!(message.contains(reason), "{message}");
        assert_eq!(harness.session.source().path(), "a.sdf");
        assert!(!harness.session.is_broken() && !harness.session.is_busy());
        assert_eq!(harness.session.params()[0].value, [1.5]);
        assert_eq!(harness.picture_bytes(), previous);
    }
    // The working scene is still followed, even if it was edited meanwhile.
    harness.handle(Event::Open(SceneOrigin::File(PathBuf::from("broken.sdf"))));
    harness.tasks();
    harness.save(BOX);
    harness.handle(Event::Open(SceneOrigin::File(PathBuf::from("missing.sdf"))));
    harness.run_to_rest();
    assert!(harness.session.params().is_empty());
    assert_ne!(harness.picture_bytes(), previous);
}

#[test]
fn a_build_of_the_scene_before_is_not_taken_for_that_of_another() {
    let mut harness = Harness::new("param r = 1.0 in 0.5..2.0;\nsphere(r)\n");
    let mut previous = harness.tasks();
    harness.handle(Event::Open(SceneOrigin::Text {
        name: "built-in".to_owned(),
        text: BOX.to_owned(),
    }));
    let current_tasks = harness.tasks();
    let late = harness.perform(previous.remove(0)).unwrap();
    harness.session.finish_task(late, harness.now);
    assert!(
        harness.session.params().is_empty(),
        "they are of the old scene"
    );
    for task in current_tasks {
        if let Some(result) = harness.perform(task) {
            harness.session.finish_task(result, harness.now);
        }
    }
    harness.run_to_rest();
    let mut other = Harness::new(BOX);
    other.run_to_rest();
    assert_eq!(harness.picture_bytes(), other.picture_bytes());
    assert!(
        !harness
            .log
            .contains(&TaskKind::Watch(vec![PathBuf::from("a.sdf")]))
    );
}

#[test]
fn pictures_are_saved_and_scenes_exported() {
    let mut harness = Harness::new(SPHERE);
    harness.run_to_rest();
    harness.handle(Event::Save(PathBuf::from("a.png")));
    assert_eq!(harness.run_to_rest(), [TaskKind::Save]);
    assert_eq!(harness.session.message(), Some(Ok("saved a.png")));
    harness.handle(Event::Dismiss);
    assert_eq!(harness.session.message(), None);
    harness.handle(Event::Export(sdfc_compiler::export::Target::Wgsl));
    assert_eq!(harness.run_to_rest(), [TaskKind::Export]);
    assert_eq!(harness.session.take_exported().as_deref(), Some("text"));
    assert_eq!(harness.session.take_exported(), None);
}
