//! Scenes that are edited, broken, mended, gone and back.

use crate::play::{Asked, Play};
use sdfc_lang::Sources;
use sdfc_playground::build::Source;
use sdfc_playground::session::Event;
use std::path::PathBuf;

const BALL: &str = "sphere(1)\n";
const BOX: &str = "box(1)\n";
const BROKEN: &str = "sphere(1\n";

#[test]
fn it_opens_draws_and_rests() {
    let mut play = Play::of(BALL);
    let asked = play.rest();
    assert_eq!(asked[0], Asked::Build);
    assert_eq!(play.session.report(), "");
    assert!(play.session.seen().is_some());
    let facts = play.session.facts().unwrap();
    assert_eq!(facts.size, [48, 32]);
    assert!(!play.session.is_busy());
    // For ever.
    play.pass(60_000);
    assert_eq!(play.rest(), []);
}

#[test]
fn an_edit_is_one_build_and_another_picture() {
    let mut play = Play::of(BALL);
    play.rest();
    let before = play.seen();
    // An editor that saves in several steps.
    for text in ["", "bo", BOX] {
        play.files.put("a.sdf", text);
        play.handle(Event::FilesChanged);
        play.pass(3);
        assert_eq!(play.run(), [], "the files have not settled");
    }
    play.pass(50);
    let asked = play.rest();
    let builds = asked.iter().filter(|asked| **asked == Asked::Build);
    assert_eq!(builds.count(), 1);
    assert_ne!(play.seen(), before);
}

#[test]
fn saving_the_same_text_changes_nothing_that_is_seen() {
    let mut play = Play::of(BALL);
    play.rest();
    let before = play.seen();
    play.save(BALL);
    play.rest();
    assert_eq!(play.seen(), before);
}

#[test]
fn edits_while_one_is_built_end_in_the_last_one() {
    let mut play = Play::of(BALL);
    let building = play.tasks();
    // Two saves before the first build is done.
    play.save(BROKEN);
    assert!(play.tasks().is_empty(), "one build at a time");
    play.save(BOX);
    for task in building {
        let done = play.perform(task).unwrap();
        play.session.done(done, play.now);
    }
    play.rest();
    assert!(!play.session.is_broken());
    let mut other = Play::of(BOX);
    other.rest();
    assert_eq!(play.seen(), other.seen());
}

#[test]
fn a_broken_scene_leaves_the_picture_and_says_what_check_says() {
    let mut play = Play::of(BALL);
    play.rest();
    let before = play.seen();
    play.save(BROKEN);
    play.rest();
    assert!(play.session.is_broken());
    assert_eq!(play.seen(), before);
    let mut sources = Sources::new();
    let file = sources.add("a.sdf", BROKEN);
    let (_, found) = sdfc_lang::parse(&sources, file);
    let found = sdfc_lang::Diagnostics::from_iter(found);
    let said = found.render(&sources, sdfc_lang::Style::Plain);
    assert_eq!(play.session.report(), said);
    play.save(BOX);
    play.rest();
    assert!(!play.session.is_broken());
    assert_eq!(play.session.report(), "");
    assert_ne!(play.seen(), before);
}

#[test]
fn a_scene_that_is_broken_from_the_start_can_be_mended() {
    let mut play = Play::of(BROKEN);
    play.rest();
    assert!(play.session.is_broken());
    assert!(play.session.seen().is_none());
    play.save(BALL);
    play.rest();
    assert!(play.session.seen().is_some() && !play.session.is_broken());
}

#[test]
fn warnings_stay_beside_the_picture() {
    let mut play = Play::of("let unused = 1;\nsphere(1)\n");
    play.rest();
    assert!(!play.session.is_broken());
    assert!(play.session.report().contains("unused"));
    assert!(play.session.seen().is_some());
}

#[test]
fn a_file_that_vanishes_is_followed_until_it_is_back() {
    let mut play = Play::of(BALL);
    play.rest();
    let before = play.seen();
    play.files.remove("a.sdf");
    play.handle(Event::FilesChanged);
    play.pass(50);
    play.rest();
    assert!(play.session.is_broken());
    let report = play.session.report();
    assert_eq!(
        report,
        "error: a.sdf cannot be read: there is no such file\n"
    );
    assert_eq!(play.seen(), before);
    play.save(BOX);
    play.rest();
    assert!(!play.session.is_broken());
    assert_ne!(play.seen(), before);
}

#[test]
fn imported_files_are_watched_also_those_that_are_not_there() {
    let mut play = Play::of("import \"part.sdf\" as lib;\nlib::knob(1)\n");
    let both = Asked::Watch(["a.sdf", "part.sdf"].map(PathBuf::from).to_vec());
    assert!(play.rest().contains(&both), "{:?}", play.log);
    assert!(play.session.is_broken());
    play.files.put("part.sdf", "fn knob(r) = sphere(r);\n");
    play.handle(Event::FilesChanged);
    play.pass(50);
    play.rest();
    assert!(!play.session.is_broken(), "{}", play.session.report());
    let before = play.seen();
    play.files.put("part.sdf", "fn knob(r) = box(r);\n");
    play.handle(Event::FilesChanged);
    play.pass(50);
    play.rest();
    assert_ne!(play.seen(), before);
}

#[test]
fn another_scene_is_opened_in_its_place() {
    let mut play = Play::of("param r = 1.0 in 0.5..2.0;\nsphere(r)\n");
    play.rest();
    let before = play.seen();
    play.handle(Event::Open(Source::Text {
        name: "built-in".to_owned(),
        text: BOX.to_owned(),
    }));
    let asked = play.rest();
    assert!(asked.contains(&Asked::Watch(Vec::new())));
    assert_ne!(play.seen(), before);
    assert!(play.session.knobs().is_empty());
}

#[test]
fn a_build_of_the_scene_before_is_not_taken_for_that_of_another() {
    let mut play = Play::of("param r = 1.0 in 0.5..2.0;\nsphere(r)\n");
    let mut before = play.tasks();
    play.handle(Event::Open(Source::Text {
        name: "built-in".to_owned(),
        text: BOX.to_owned(),
    }));
    let now = play.tasks();
    let late = play.perform(before.remove(0)).unwrap();
    play.session.done(late, play.now);
    assert!(play.session.knobs().is_empty(), "they are of the old scene");
    for task in now {
        if let Some(done) = play.perform(task) {
            play.session.done(done, play.now);
        }
    }
    play.rest();
    let mut other = Play::of(BOX);
    other.rest();
    assert_eq!(play.seen(), other.seen());
    assert!(
        !play
            .log
            .contains(&Asked::Watch(vec![PathBuf::from("a.sdf")]))
    );
}

#[test]
fn pictures_are_saved_and_scenes_exported() {
    let mut play = Play::of(BALL);
    play.rest();
    play.handle(Event::Save(PathBuf::from("a.png")));
    assert_eq!(play.rest(), [Asked::Save]);
    assert_eq!(play.session.said(), Some(Ok("saved a.png")));
    play.handle(Event::Dismiss);
    assert_eq!(play.session.said(), None);
    play.handle(Event::Export(sdfc_compiler::export::Target::Wgsl));
    assert_eq!(play.rest(), [Asked::Export]);
    assert_eq!(play.session.take_exported().as_deref(), Some("text"));
    assert_eq!(play.session.take_exported(), None);
}
