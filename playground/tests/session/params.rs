//! Params that are set by hand, live and structural ones, and written back.

use crate::play::{Asked, Play};
use sdfc_playground::session::Event;

const SCENE: &str = "camera { from: [0, 3, 12], look: [2, 0, 0] }
/// The radius.
param r = 1.0 in 0.5..=2.0; // in metres
param n = 2 in 1..=5;
param tint: color = #3aa6ff;
for i in 0..n { sphere(r).translate(2 * i, 0, 0).color(tint) }
";

fn builds(asked: &[Asked]) -> usize {
    asked.iter().filter(|asked| **asked == Asked::Build).count()
}

#[test]
fn a_live_param_is_the_next_picture_and_no_build() {
    let mut play = Play::of(SCENE);
    play.rest();
    let before = play.seen();
    play.handle(Event::Set(0, vec![0.6]));
    let asked = play.run();
    assert!(matches!(asked[0], Asked::Draw(..)), "{asked:?}");
    assert_eq!(builds(&asked), 0);
    assert_ne!(play.seen(), before);
    play.rest();
    play.handle(Event::Reset(0));
    assert_eq!(builds(&play.rest()), 0);
    assert_eq!(play.seen(), before, "the very picture of before");
}

#[test]
fn a_structural_param_is_a_build_with_its_value() {
    let mut play = Play::of(SCENE);
    play.rest();
    let before = play.seen();
    assert!(play.session.knobs()[1].spec.structural);
    play.handle(Event::Set(1, vec![4.0]));
    assert_eq!(builds(&play.rest()), 1);
    assert_ne!(play.seen(), before);
    let mut other = Play::of(&SCENE.replace("n = 2", "n = 4"));
    other.rest();
    assert_eq!(play.seen(), other.seen());
    play.handle(Event::ResetAll);
    play.rest();
    assert_eq!(play.seen(), before);
}

#[test]
fn values_stay_in_their_range_and_kind() {
    let mut play = Play::of(SCENE);
    play.rest();
    play.handle(Event::Set(0, vec![17.0]));
    assert_eq!(play.session.knobs()[0].value, [2.0]);
    play.handle(Event::Set(1, vec![2.7]));
    assert_eq!(play.session.knobs()[1].value, [3.0]);
    for nonsense in [vec![], vec![f64::NAN], vec![1.0, 2.0]] {
        play.handle(Event::Set(0, nonsense));
        assert_eq!(play.session.knobs()[0].value, [2.0]);
    }
    play.handle(Event::Set(99, vec![1.0]));
}

#[test]
fn values_set_by_hand_survive_an_edit_where_they_fit() {
    let mut play = Play::of(SCENE);
    play.rest();
    play.handle(Event::Set(0, vec![0.75]));
    play.handle(Event::Set(1, vec![5.0]));
    play.rest();
    play.save(&SCENE.replace("n = 2 in 1..=5", "n = 2 in 1..=3"));
    play.rest();
    let values: Vec<_> = play.session.knobs().iter().map(|k| k.value[0]).collect();
    assert_eq!(values[..2], [0.75, 3.0]);
    let mut other = Play::of(&SCENE.replace("n = 2", "n = 3"));
    other.rest();
    other.handle(Event::Set(0, vec![0.75]));
    other.rest();
    assert_eq!(play.seen(), other.seen());
}

#[test]
fn a_value_is_written_into_the_text_and_nothing_else_changes() {
    let mut play = Play::of(SCENE);
    play.rest();
    play.handle(Event::Set(0, vec![0.75]));
    play.handle(Event::Set(2, vec![1.0, 0.0, 0.0]));
    let seen = {
        play.rest();
        play.seen()
    };
    play.handle(Event::WriteBack(vec![0, 1, 2]));
    play.rest();
    let expected = SCENE
        .replace("r = 1.0", "r = 0.75")
        .replace("#3aa6ff", "#ff0000");
    assert_eq!(play.files.text("a.sdf"), expected);
    let said = play.session.said().unwrap().unwrap();
    assert_eq!(said, "a.sdf: r = 0.75, tint = #ff0000");
    // The watcher notices; what was changed is the text's now.
    play.handle(Event::FilesChanged);
    play.pass(50);
    play.rest();
    assert!(play.session.knobs().iter().all(|knob| !knob.is_changed()));
    assert_eq!(play.seen(), seen);
}

#[test]
fn a_text_that_changed_meanwhile_is_not_written_over() {
    let mut play = Play::of(SCENE);
    play.rest();
    play.handle(Event::Set(0, vec![0.75]));
    let edited = SCENE.replace("// in metres", "// as an editor left it");
    play.files.put("a.sdf", &edited);
    play.handle(Event::WriteBack(vec![0]));
    play.rest();
    assert_eq!(play.files.text("a.sdf"), edited);
    assert!(play.session.said().unwrap().is_err());
}

#[test]
fn a_condition_that_fails_is_a_report_until_it_holds() {
    let text = "param r = 1.0 in 0.5..=2.0;\nassert(r < 1.5, \"too large\");\nsphere(r)\n";
    let mut play = Play::of(text);
    play.rest();
    let before = play.seen();
    play.handle(Event::Set(0, vec![1.9]));
    play.rest();
    assert!(play.session.is_broken());
    assert!(play.session.report().contains("too large"));
    assert_eq!(play.seen(), before);
    play.handle(Event::Set(0, vec![1.0]));
    play.rest();
    assert!(!play.session.is_broken());
    assert_eq!(play.session.report(), "");
}

#[test]
fn units_are_the_authors() {
    let mut play = Play::of("param w = 60mm in 30mm..=120mm by 1mm;\nsphere(w)\n");
    play.rest();
    let knob = &play.session.knobs()[0];
    let (unit, size) = knob.unit();
    assert_eq!(unit, "mm");
    assert!((knob.value[0] / size - 60.0).abs() < 1e-9);
    let value = 72.0 * size;
    play.handle(Event::Set(0, vec![value]));
    play.handle(Event::WriteBack(vec![0]));
    play.rest();
    assert!(
        play.files
            .text("a.sdf")
            .starts_with("param w = 72mm in 30mm")
    );
}
