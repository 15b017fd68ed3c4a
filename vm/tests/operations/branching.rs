//! Branch intervals evaluate both sides of a discontinuity, and nothing else.

use sdfc_vm::branching::{BranchInterval, eval_all_branches, eval_hull};
use sdfc_vm::interval::Interval;
use sdfc_vm::real::{Real, Vector3, lit};
use sdfc_vm::vector::V3;

fn along_x(lo: f64, hi: f64) -> V3<BranchInterval> {
    let x = Interval { lo, hi };
    BranchInterval::point([x, Interval::point(0.25), Interval::point(0.0)])
}

/// Returns the position in the cell of a row of cells, relative to its centre.
fn sawtooth(p: V3<BranchInterval>) -> BranchInterval {
    p.x - (p.x + lit(0.5)).floor()
}

#[test]
fn both_sides_of_a_discontinuity_are_evaluated() {
    // Near the cell boundary at one half, the position in the cell is nearly ±0.5, and never nearly 0.
    let near = |p| sawtooth(p).abs();
    let (hull, is_decided) = eval_hull(|| near(along_x(0.49, 0.51)));
    assert!(!is_decided && hull.lo <= 0.0, "{hull:?}");
    let both = eval_all_branches(|| near(along_x(0.49, 0.51)));
    assert!(both.lo > 0.48 && both.hi < 0.52, "{both:?}");
    // Away from the boundary, nothing is undecided.
    let (inside, is_decided) = eval_hull(|| near(along_x(0.1, 0.2)));
    assert!(is_decided && inside.lo > 0.09 && inside.hi < 0.21);
}

#[test]
fn equal_decisions_have_equal_results_and_others_do_not() {
    // The same floor twice: the difference is zero for any decision.
    let same = eval_all_branches(|| {
        let p = along_x(0.9, 1.1);
        p.x.floor() - p.x.floor() + lit(3.0)
    });
    assert!(same.lo > 2.9 && same.hi < 3.1, "{same:?}");
    // The floors of `x` and of `2 − x` have the same bounds, but are never both 0.
    let other = eval_all_branches(|| {
        let p = along_x(0.9, 1.1);
        p.x.floor() + (lit::<BranchInterval>(2.0) - p.x).floor() + lit(3.0)
    });
    assert!(other.contains(4.0) && other.contains(3.0), "{other:?}");
}

#[test]
fn selections_take_both_sides_and_angles_both_sides_of_their_cut() {
    let step = eval_all_branches(|| along_x(-0.1, 0.1).x.sign_nonzero() + lit(3.0));
    assert!(
        step.lo > 1.9 && step.contains(2.0) && step.contains(4.0),
        "{step:?}"
    );
    let jump = eval_all_branches(|| along_x(-0.1, 0.1).x.sign_nonzero().square());
    assert!(jump.lo > 0.9, "{jump:?}");
    // Cosines of angles next to the cut are nearly −1 on both sides.
    let cosine = eval_all_branches(|| {
        let y = along_x(-0.01, 0.01).x;
        y.atan2(lit(-1.0)).cos() - lit(5.0)
    });
    assert!(cosine.lo > -6.1 && cosine.hi < -5.9, "{cosine:?}");
}

#[test]
fn conditions_derived_from_a_decision_agree_with_it() {
    type Condition = <BranchInterval as Real>::Bool;
    let never = |p: V3<BranchInterval>| -> Condition {
        let below = || p.x.less(lit(0.0));
        BranchInterval::and(BranchInterval::not(below()), below())
    };
    let value = eval_all_branches(|| {
        BranchInterval::select(never(along_x(-0.1, 0.1)), lit(-1.0), lit(1.0))
    });
    assert_eq!((value.lo, value.hi), (1.0, 1.0));
    // A comparison without effect on the result leaves the computation fully decided.
    let (_, is_decided) = eval_hull(|| {
        let p = along_x(-0.1, 0.1);
        let both = BranchInterval::and(p.x.less(lit(0.0)), p.y.less(lit(0.0)));
        BranchInterval::select(both, lit(-1.0), lit(1.0))
    });
    assert!(is_decided);
}

#[test]
fn decisions_beyond_the_limit_are_left_to_hulls() {
    let many = |p: V3<BranchInterval>| {
        (0..20)
            .map(|i| (p.x + lit(f64::from(i) * 1e-3)).floor())
            .fold(lit(0.5), |sum: BranchInterval, v| sum + v)
    };
    let all = eval_all_branches(|| many(along_x(0.97, 1.03)));
    assert!(all.contains(0.5) && all.contains(20.5), "{all:?}");
    // Every position within the point's own cell is one of these.
    let own = |p: V3<BranchInterval>| p.floor().x() + lit(0.5);
    assert!(!eval_all_branches(|| own(along_x(0.97, 1.03))).contains(0.0));
}
