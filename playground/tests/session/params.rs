//! Tests of params: set by hand, live and structural, and written back.

use crate::harness::{Harness, TaskKind};
use sdfc_playground::session::Event;

const SCENE: &str = "camera { from: [0, 3, 12], look: [2, 0, 0] }
/// The radius.
param r = 1.0 in 0.5..=2.0; // in metres
param n = 2 in 1..=5;
param tint: color = #3aa6ff;
for i in 0..n { sphere(r).translate(2 * i, 0, 0).color(tint) }
";

fn builds(requested: &[TaskKind]) -> usize {
    requested
        .iter()
        .filter(|requested| **requested == TaskKind::Build)
        .count()
}

#[test]
fn a_live_param_is_the_next_picture_and_no_build() {
    let mut harness = Harness::new(SCENE);
    harness.run_to_rest();
    let previous = harness.picture_bytes();
    harness.handle(Event::Set(0, vec![0.6]));
    let requested = harness.run();
    assert!(matches!(requested[0], TaskKind::Draw(..)), "{requested:?}");
    assert_eq!(builds(&requested), 0);
    assert_ne!(harness.picture_bytes(), previous);
    harness.run_to_rest();
    harness.handle(Event::Reset(0));
    assert_eq!(builds(&harness.run_to_rest()), 0);
    assert_eq!(
        harness.picture_bytes(),
        previous,
        "the very picture of before"
    );
}

#[test]
fn a_structural_param_is_a_build_with_its_value() {
    let mut harness = Harness::new(SCENE);
    harness.run_to_rest();
    let previous = harness.picture_bytes();
    assert!(harness.session.params()[1].spec.structural);
    harness.handle(Event::Set(1, vec![4.0]));
    assert_eq!(builds(&harness.run_to_rest()), 1);
    assert_ne!(harness.picture_bytes(), previous);
    let mut other = Harness::new(&SCENE.replace("n = 2", "n = 4"));
    other.run_to_rest();
    assert_eq!(harness.picture_bytes(), other.picture_bytes());
    harness.handle(Event::ResetAll);
    harness.run_to_rest();
    assert_eq!(harness.picture_bytes(), previous);
}

#[test]
fn values_stay_in_their_range_and_kind() {
    let mut harness = Harness::new(SCENE);
    harness.run_to_rest();
    harness.handle(Event::Set(0, vec![17.0]));
    assert_eq!(harness.session.params()[0].value, [2.0]);
    harness.handle(Event::Set(1, vec![2.7]));
    assert_eq!(harness.session.params()[1].value, [3.0]);
    for nonsense in [vec![], vec![f64::NAN], vec![1.0, 2.0]] {
        harness.handle(Event::Set(0, nonsense));
        assert_eq!(harness.session.params()[0].value, [2.0]);
    }
    harness.handle(Event::Set(99, vec![1.0]));
}

#[test]
fn values_set_by_hand_survive_an_edit_where_they_fit() {
    let mut harness = Harness::new(SCENE);
    harness.run_to_rest();
    harness.handle(Event::Set(0, vec![0.75]));
    harness.handle(Event::Set(1, vec![5.0]));
    harness.run_to_rest();
    harness.save(&SCENE.replace("n = 2 in 1..=5", "n = 2 in 1..=3"));
    harness.run_to_rest();
    let values: Vec<_> = harness
        .session
        .params()
        .iter()
        .map(|k| k.value[0])
        .collect();
    assert_eq!(values[..2], [0.75, 3.0]);
    let mut other = Harness::new(&SCENE.replace("n = 2", "n = 3"));
    other.run_to_rest();
    other.handle(Event::Set(0, vec![0.75]));
    other.run_to_rest();
    assert_eq!(harness.picture_bytes(), other.picture_bytes());
}

#[test]
fn a_value_is_written_into_the_text_and_nothing_else_changes() {
    let mut harness = Harness::new(SCENE);
    harness.run_to_rest();
    harness.handle(Event::Set(0, vec![0.75]));
    harness.handle(Event::Set(2, vec![1.0, 0.0, 0.0]));
    let picture = {
        harness.run_to_rest();
        harness.picture_bytes()
    };
    harness.handle(Event::WriteBack(vec![0, 1, 2]));
    harness.run_to_rest();
    let expected = SCENE
        .replace("r = 1.0", "r = 0.75")
        .replace("#3aa6ff", "#ff0000");
    assert_eq!(harness.files.text("a.sdf"), expected);
    let message = harness.session.message().unwrap().unwrap();
    assert_eq!(message, "a.sdf: r = 0.75, tint = #ff0000");
    // After the watcher's event the written values are those of the text.
    harness.handle(Event::FilesChanged);
    harness.advance(50);
    harness.run_to_rest();
    assert!(
        harness
            .session
            .params()
            .iter()
            .all(|param| !param.is_changed())
    );
    assert_eq!(harness.picture_bytes(), picture);
}

#[test]
fn a_colour_that_was_written_follows_the_text_again() {
    let mut harness = Harness::new(SCENE);
    harness.run_to_rest();
    // A picker's channels are no multiples of 1/255 on screen.
    harness.handle(Event::Set(2, vec![0.512_345, 0.123_456, 0.700_001]));
    harness.handle(Event::WriteBack(vec![2]));
    harness.run_to_rest();
    let text = harness.files.text("a.sdf");
    assert_ne!(text, SCENE);
    harness.save(&text);
    harness.run_to_rest();
    let param = &harness.session.params()[2];
    assert!(!param.is_changed(), "{:?} is written", param.value);
    harness.save(&SCENE.replace("#3aa6ff", "#00ff00"));
    harness.run_to_rest();
    let value = &harness.session.params()[2].value;
    assert_eq!(value, &[0.0, 1.0, 0.0], "the edit counts");
}

#[test]
fn a_value_dragged_back_is_the_texts_own() {
    let text = "param turn = 30deg in 0deg..=90deg;\nbox(1).rotate(turn, Y)\n";
    let mut harness = Harness::new(text);
    harness.run_to_rest();
    let degree = 1_f64.to_radians();
    harness.handle(Event::Set(0, vec![40.0 * degree]));
    assert!(harness.session.params()[0].is_changed());
    harness.handle(Event::Set(0, vec![30.0 * degree * (1.0 + 1e-15)]));
    assert!(!harness.session.params()[0].is_changed());
}

#[test]
fn a_text_that_changed_meanwhile_is_not_written_over() {
    let mut harness = Harness::new(SCENE);
    harness.run_to_rest();
    harness.handle(Event::Set(0, vec![0.75]));
    let edited = SCENE.replace("// in metres", "// as an editor left it");
    harness.files.put("a.sdf", &edited);
    harness.handle(Event::WriteBack(vec![0]));
    harness.run_to_rest();
    assert_eq!(harness.files.text("a.sdf"), edited);
    assert!(harness.session.message().unwrap().is_err());
}

#[test]
fn a_condition_that_fails_is_a_report_until_it_holds() {
    let text = "param r = 1.0 in 0.5..=2.0;\nassert(r < 1.5, \"too large\");\nsphere(r)\n";
    let mut harness = Harness::new(text);
    harness.run_to_rest();
    let previous = harness.picture_bytes();
    harness.handle(Event::Set(0, vec![1.9]));
    harness.run_to_rest();
    assert!(harness.session.is_broken());
    assert!(harness.session.report().contains("too large"));
    assert_eq!(harness.picture_bytes(), previous);
    harness.handle(Event::Set(0, vec![1.0]));
    harness.run_to_rest();
    assert!(!harness.session.is_broken());
    assert_eq!(harness.session.report(), "");
}

#[test]
fn units_are_the_authors() {
    let mut harness = Harness::new("param w = 60mm in 30mm..=120mm by 1mm;\nsphere(w)\n");
    harness.run_to_rest();
    let param = &harness.session.params()[0];
    let (unit, size) = param.unit();
    assert_eq!(unit, "mm");
    assert!((param.value[0] / size - 60.0).abs() < 1e-9);
    let value = 72.0 * size;
    harness.handle(Event::Set(0, vec![value]));
    harness.handle(Event::WriteBack(vec![0]));
    harness.run_to_rest();
    assert!(
        harness
            .files
            .text("a.sdf")
            .starts_with("param w = 72mm in 30mm")
    );
}
