//! Branching intervals look at both sides of what jumps, and at no more.

use sdfc_vm::branching::{Branching, explore, hulled};
use sdfc_vm::interval::Interval;
use sdfc_vm::real::{Real, Vector3, lit};
use sdfc_vm::vector::V3;

fn along_x(lo: f64, hi: f64) -> V3<Branching> {
    let x = Interval { lo, hi };
    Branching::point([x, Interval::point(0.25), Interval::point(0.0)])
}

/// Far from the middle of its cell, in a row of cells.
fn sawtooth(p: V3<Branching>) -> Branching {
    p.x - (p.x + lit(0.5)).floor()
}

#[test]
fn both_sides_of_a_seam_are_seen() {
    // Near the seam at one half the place in the cell is nearly ±0.5, and never nearly 0.
    let near = |p| sawtooth(p).abs();
    let (hull, whole) = hulled(|| near(along_x(0.49, 0.51)));
    assert!(!whole && hull.lo <= 0.0, "{hull:?}");
    let both = explore(|| near(along_x(0.49, 0.51)));
    assert!(both.lo > 0.48 && both.hi < 0.52, "{both:?}");
    // Where there is no seam nothing is open.
    let (inside, whole) = hulled(|| near(along_x(0.1, 0.2)));
    assert!(whole && inside.lo > 0.09 && inside.hi < 0.21);
}

#[test]
fn equal_questions_have_equal_answers_and_others_do_not() {
    // The same floor twice: the difference is zero whatever the answer.
    let same = explore(|| {
        let p = along_x(0.9, 1.1);
        p.x.floor() - p.x.floor() + lit(3.0)
    });
    assert!(same.lo > 2.9 && same.hi < 3.1, "{same:?}");
    // The floors of `x` and of `2 − x` have the same bounds, but are never both 0.
    let other = explore(|| {
        let p = along_x(0.9, 1.1);
        p.x.floor() + (lit::<Branching>(2.0) - p.x).floor() + lit(3.0)
    });
    assert!(other.contains(4.0) && other.contains(3.0), "{other:?}");
}

#[test]
fn selections_take_both_sides_and_angles_both_sides_of_their_cut() {
    let step = explore(|| along_x(-0.1, 0.1).x.side() + lit(3.0));
    assert!(
        step.lo > 1.9 && step.contains(2.0) && step.contains(4.0),
        "{step:?}"
    );
    let jump = explore(|| along_x(-0.1, 0.1).x.side().square());
    assert!(jump.lo > 0.9, "{jump:?}");
    // Cosines of angles next to the cut are nearly −1 on both sides.
    let cosine = explore(|| {
        let y = along_x(-0.01, 0.01).x;
        y.atan2(lit(-1.0)).cos() - lit(5.0)
    });
    assert!(cosine.lo > -6.1 && cosine.hi < -5.9, "{cosine:?}");
}

#[test]
fn what_is_made_of_an_answer_agrees_with_it() {
    type Condition = <Branching as Real>::Bool;
    let never = |p: V3<Branching>| -> Condition {
        let below = || p.x.less(lit(0.0));
        Branching::and(Branching::not(below()), below())
    };
    let value = explore(|| Branching::select(never(along_x(-0.1, 0.1)), lit(-1.0), lit(1.0)));
    assert_eq!((value.lo, value.hi), (1.0, 1.0));
    // A comparison that decides nothing leaves a formula whole.
    let (_, whole) = hulled(|| {
        let p = along_x(-0.1, 0.1);
        let both = Branching::and(p.x.less(lit(0.0)), p.y.less(lit(0.0)));
        Branching::select(both, lit(-1.0), lit(1.0))
    });
    assert!(whole);
}

#[test]
fn more_questions_than_are_answered_are_left_to_hulls() {
    let many = |p: V3<Branching>| {
        (0..20)
            .map(|i| (p.x + lit(f64::from(i) * 1e-3)).floor())
            .fold(lit(0.5), |sum: Branching, v| sum + v)
    };
    let all = explore(|| many(along_x(0.97, 1.03)));
    assert!(all.contains(0.5) && all.contains(20.5), "{all:?}");
    // Every run of a cell's own point is one of these.
    let own = |p: V3<Branching>| p.floor().x() + lit(0.5);
    assert!(!explore(|| own(along_x(0.97, 1.03))).contains(0.0));
}
