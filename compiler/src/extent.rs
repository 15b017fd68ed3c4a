//! The extent of a written field: a box outside of which interval arithmetic proves it positive.
//!
//! First each side is moved in from infinity as far as one evaluation over all that lies beyond it allows.
//! Sides that stay infinite are looked for within a large cube, by halving boxes that may hold what is
//! not positive: a solid of finite size then shows as boxes that stay clear of the cube's sides.

use crate::boxes::{Along, BoxNumber, UniformValue};
use crate::expression::{ExprId, Expressions};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;

/// Half the side of the cube in which solids are looked for, in units.
const MAX_REACH: f64 = 1e4;
/// The farthest from the origin that a side is moved to without a cube.
const MAX_SIDE: f64 = 1e9;
/// The most operations that are spent on one field.
const MAX_OPERATIONS: usize = 600_000;
/// The most boxes at once that may hold something.
const MAX_BOXES: usize = 1024;
/// Boxes are halved until they are no longer than this fraction of what all of them take up.
const FINEST: f64 = 1.0 / 48.0;
/// What lies beyond this fraction of the cube is endless.
const ENDLESS: f64 = 0.25;

/// A box outside of which a number of the point is positive, for all `uniform` numbers within their ranges;
/// infinite where it reaches farther than is looked.
pub(crate) fn extent(
    expressions: &Expressions,
    id: ExprId,
    uniform: &mut dyn FnMut(ExprId) -> Interval,
) -> Bounds {
    let mut number =
        BoxNumber::<Interval>::new(expressions, id, &mut |id| UniformValue::Known(uniform(id)));
    let unused = number.along().map(|along| along == Along::Nothing);
    let evaluations = MAX_OPERATIONS / number.cost();
    search(unused, evaluations, &mut |bounds| number.over(bounds, &[]))
}

/// A box outside of which a map of the point to three numbers leads out of `image`.
pub(crate) fn extent_of_preimage(
    expressions: &Expressions,
    map: [ExprId; 3],
    image: &Bounds,
    uniform: &mut dyn FnMut(ExprId) -> Interval,
) -> Bounds {
    if image.is_empty() {
        return Bounds::EMPTY;
    }
    let mut numbers = map.map(|id| {
        BoxNumber::<Interval>::new(expressions, id, &mut |id| UniformValue::Known(uniform(id)))
    });
    let unused = std::array::from_fn(|axis| {
        numbers
            .iter()
            .all(|number| number.along()[axis] == Along::Nothing)
    });
    let cost: usize = numbers.iter().map(BoxNumber::cost).sum();
    search(unused, MAX_OPERATIONS / cost, &mut |bounds| {
        let (mut apart, mut within) = (false, true);
        for (axis, number) in numbers.iter_mut().enumerate() {
            let range = number.over(bounds, &[]);
            apart |= range.hi < image.min[axis] || range.lo > image.max[axis];
            within &= range.lo >= image.min[axis] && range.hi <= image.max[axis];
        }
        Interval {
            lo: if apart { 1.0 } else { -1.0 },
            hi: if within { -1.0 } else { 1.0 },
        }
    })
}

/// The part of a finite box outside of which a value is positive there, by at most so many evaluations.
pub(crate) fn narrowed(
    bounds: &Bounds,
    evaluations: usize,
    over: &mut dyn FnMut(&Bounds) -> Interval,
) -> Bounds {
    let mut search = Search {
        over,
        unused: std::array::from_fn(|axis| !(bounds.max[axis] - bounds.min[axis]).is_finite()),
        left: evaluations,
    };
    let sides = (0..3).flat_map(|axis| [(axis, false), (axis, true)]);
    let open: Vec<(usize, bool)> = sides.filter(|&(axis, _)| !search.unused[axis]).collect();
    let boxes = search.halved(vec![*bounds], &[]);
    let hull = boxes.iter().fold(Bounds::EMPTY, |hull, b| hull.hull(b));
    let mut narrowed = *bounds;
    for (axis, _) in open {
        narrowed.min[axis] = hull.min[axis];
        narrowed.max[axis] = hull.max[axis];
    }
    narrowed
}

/// A box outside of which what `over` gives for boxes is positive.
pub(crate) fn search(
    unused: [bool; 3],
    evaluations: usize,
    over: &mut dyn FnMut(&Bounds) -> Interval,
) -> Bounds {
    let mut search = Search {
        over,
        unused,
        left: evaluations,
    };
    let mut found = Bounds::EVERYTHING;
    // What one side rules out helps with the others.
    for _ in 0..2 {
        for axis in (0..3).filter(|&axis| !unused[axis]) {
            for upper in [false, true] {
                search.move_in(&mut found, axis, upper);
            }
        }
    }
    search.enclose(&found)
}

struct Search<'f> {
    /// All values of the number in a box.
    over: &'f mut dyn FnMut(&Bounds) -> Interval,
    /// The axes along which the number does not change.
    unused: [bool; 3],
    /// The evaluations that may still be made.
    left: usize,
}

impl Search<'_> {
    /// All values in a box.
    fn over(&mut self, bounds: &Bounds) -> Interval {
        self.left = self.left.saturating_sub(1);
        let mut bounds = *bounds;
        for axis in (0..3).filter(|&axis| self.unused[axis]) {
            (bounds.min[axis], bounds.max[axis]) = (0.0, 0.0);
        }
        (self.over)(&bounds)
    }

    /// Moves a side in, as far as the number is proved positive in all that lies beyond.
    fn move_in(&mut self, found: &mut Bounds, axis: usize, upper: bool) {
        let beyond = |at: f64| {
            let mut beyond = *found;
            if upper {
                beyond.min[axis] = at;
            } else {
                beyond.max[axis] = -at;
            }
            beyond
        };
        // Whether all beyond a place is clear only turns from no to yes on the way out.
        let place = |share: f64| share.signum() * ((share.abs() * MAX_SIDE.ln_1p()).exp_m1());
        if self.left == 0 || !is_positive(self.over(&beyond(MAX_SIDE))) {
            return;
        }
        let (mut no, mut yes) = (-1.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = (no + yes) / 2.0;
            let beyond = beyond(place(middle));
            if beyond.is_empty() || is_positive(self.over(&beyond)) {
                yes = middle;
            } else {
                no = middle;
            }
        }
        let side = place(yes);
        if upper {
            found.max[axis] = found.max[axis].min(side);
        } else {
            found.min[axis] = found.min[axis].max(-side);
        }
    }

    /// The box around what is not proved positive in a cube, along the axes where it ends there.
    fn enclose(&mut self, found: &Bounds) -> Bounds {
        let open: Vec<(usize, bool)> = (0..3)
            .filter(|&axis| !self.unused[axis])
            .flat_map(|axis| [(axis, false), (axis, true)])
            .filter(|&(axis, upper)| {
                let side = if upper {
                    found.max[axis]
                } else {
                    found.min[axis]
                };
                side.is_infinite()
            })
            .collect();
        let cube = found.common(&Bounds::centred([MAX_REACH; 3]));
        if open.is_empty() || cube.is_empty() {
            return *found;
        }
        let boxes = self.halved(vec![cube], &open);
        if boxes.is_empty() {
            // Positive everywhere: nothing to be seen.
            return Bounds::EMPTY;
        }
        self.closed(found, &boxes, &open)
    }

    /// The box that was found, with the open sides closed that no box touches. Where boxes touch another side, the
    /// part beyond the cube there must be proved to end at the same place.
    fn closed(&mut self, found: &Bounds, boxes: &[Bounds], open: &[(usize, bool)]) -> Bounds {
        let hull = boxes.iter().fold(Bounds::EMPTY, |hull, b| hull.hull(b));
        let is_touched =
            |&side: &(usize, bool)| boxes.iter().any(|b| reaches(b, side, 1.0 - 1e-12));
        let (touched, free): (Vec<_>, Vec<_>) = open.iter().copied().partition(is_touched);
        let mut closed = *found;
        for side in free {
            let end = match side {
                (axis, true) => hull.max[axis],
                (axis, false) => hull.min[axis],
            };
            let holds = touched.iter().all(|&(other, upper)| {
                let far = if upper { MAX_REACH } else { -MAX_REACH };
                let outside = beyond(&beyond(found, side, end), (other, upper), far);
                is_positive(self.over(&outside))
            });
            match side {
                (axis, true) if holds => closed.max[axis] = end,
                (axis, false) if holds => closed.min[axis] = end,
                _ => {}
            }
        }
        closed
    }

    /// What of these boxes may hold something, halved until it is known well, or until something solid was
    /// found far out along all of the `open` sides, if there are any.
    fn halved(&mut self, mut boxes: Vec<Bounds>, open: &[(usize, bool)]) -> Vec<Bounds> {
        let mut endless = vec![false; open.len()];
        loop {
            let hull = boxes.iter().fold(Bounds::EMPTY, |hull, b| hull.hull(b));
            let size = self.longest(&hull).1;
            // Only what lies at a side of all of them moves that side.
            let is_coarse = |search: &Self, b: &Bounds| {
                search.longest(b).1 > size * FINEST && search.is_outermost(b, &hull)
            };
            let coarse = boxes.iter().filter(|b| is_coarse(self, b)).count();
            let has_room = boxes.len() + coarse <= MAX_BOXES && self.left > 4 * coarse;
            let all_endless = !open.is_empty() && endless.iter().all(|&endless| endless);
            if coarse == 0 || !has_room || all_endless {
                return boxes;
            }
            let mut next = Vec::with_capacity(boxes.len() + coarse);
            for b in &boxes {
                if !is_coarse(self, b) {
                    next.push(*b);
                    continue;
                }
                for half in halves(b, self.longest(b).0) {
                    if !is_positive(self.over(&half)) {
                        next.push(half);
                    }
                }
            }
            for (side, endless) in open.iter().zip(&mut endless) {
                let outermost = next.iter().find(|b| reaches(b, *side, ENDLESS));
                *endless =
                    *endless || outermost.is_some_and(|b| self.number_at(far_end(b, *side)) <= 0.0);
            }
            boxes = next;
        }
    }

    /// Whether a box touches a side of the hull of all.
    fn is_outermost(&self, b: &Bounds, hull: &Bounds) -> bool {
        (0..3)
            .filter(|&axis| !self.unused[axis])
            .any(|axis| b.min[axis] <= hull.min[axis] || b.max[axis] >= hull.max[axis])
    }

    /// The value at a point.
    fn number_at(&mut self, p: [f64; 3]) -> f64 {
        self.over(&Bounds { min: p, max: p }).hi
    }

    /// The longest side of a box, and how long it is.
    fn longest(&self, b: &Bounds) -> (usize, f64) {
        (0..3)
            .filter(|&axis| !self.unused[axis])
            .map(|axis| (axis, b.max[axis] - b.min[axis]))
            .fold(
                (0, 0.0),
                |best, next| if next.1 > best.1 { next } else { best },
            )
    }
}

/// How often a side's place is halved.
const HALVINGS: u32 = 40;

/// Whether all of a range is above zero; not if something in it is no number.
fn is_positive(range: Interval) -> bool {
    range.lo > 0.0
}

/// Whether a box reaches a fraction of the cube's half side.
fn reaches(b: &Bounds, (axis, upper): (usize, bool), fraction: f64) -> bool {
    if upper {
        b.max[axis] >= MAX_REACH * fraction
    } else {
        b.min[axis] <= -MAX_REACH * fraction
    }
}

/// The middle of a box's side that is the farthest out.
fn far_end(b: &Bounds, (axis, upper): (usize, bool)) -> [f64; 3] {
    let mut p = b.centre();
    p[axis] = if upper { b.max[axis] } else { b.min[axis] };
    p
}

/// The part of a box that lies beyond a place on one of its axes.
fn beyond(b: &Bounds, (axis, upper): (usize, bool), at: f64) -> Bounds {
    let mut part = *b;
    if upper {
        part.min[axis] = at;
    } else {
        part.max[axis] = at;
    }
    part
}

/// Both halves of a box across an axis.
fn halves(b: &Bounds, axis: usize) -> [Bounds; 2] {
    let (mut low, mut high) = (*b, *b);
    let middle = b.centre()[axis];
    low.max[axis] = middle;
    high.min[axis] = middle;
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdfc_vm::table::Op;

    /// The extent of a sum of powers of the coordinates and a constant.
    fn of(build: impl FnOnce(&mut Expressions, [ExprId; 3]) -> ExprId) -> Bounds {
        let mut e = Expressions::default();
        let p = [0, 1, 2].map(|axis| e.coordinate(axis));
        let id = build(&mut e, p);
        extent(&e, id, &mut |id| {
            Interval::point(e.as_constant(id).unwrap_or(f64::NAN))
        })
    }

    fn sum(e: &mut Expressions, terms: &[ExprId]) -> ExprId {
        let rest = &terms[1..];
        rest.iter()
            .fold(terms[0], |sum, &term| e.call(Op::Add, &[sum, term]))
    }

    #[test]
    fn a_power_in_several_products_ends_wherever_it_stands() {
        let found = of(|e, p| {
            let offset = e.constant(0.437);
            let mut terms = p.map(|v| {
                let moved = e.call(Op::Sub, &[v, offset]);
                let square = e.call(Op::Mul, &[moved, moved]);
                let cube = e.call(Op::Mul, &[square, moved]);
                e.call(Op::Mul, &[cube, moved])
            });
            let limit = e.constant(-0.5);
            let most = e.call(Op::Add, &[terms[0], terms[1]]);
            terms[2] = e.call(Op::Add, &[terms[2], limit]);
            sum(e, &[most, terms[2]])
        });
        assert!(found.is_finite(), "{found:?}");
    }

    #[test]
    fn a_ball_ends_at_its_radius() {
        let found = of(|e, p| {
            let squares = p.map(|c| e.call(Op::Square, &[c]));
            let radius = e.constant(-4.0);
            sum(e, &[squares[0], squares[1], squares[2], radius])
        });
        for axis in 0..3 {
            assert!((found.max[axis] - 2.0).abs() < 0.01, "{found:?}");
            assert!((found.min[axis] + 2.0).abs() < 0.01, "{found:?}");
        }
    }

    #[test]
    fn a_quartic_whose_terms_cancel_ends_too() {
        // x⁴ − 5x² + … + 11.8: one evaluation over half of space says nothing.
        let found = of(|e, p| {
            let mut terms = vec![e.constant(11.8)];
            let five = e.constant(-5.0);
            for c in p {
                let square = e.call(Op::Square, &[c]);
                terms.push(e.call(Op::Square, &[square]));
                terms.push(e.call(Op::Mul, &[square, five]));
            }
            sum(e, &terms)
        });
        for axis in 0..3 {
            assert!(found.max[axis] > 2.2 && found.max[axis] < 3.2, "{found:?}");
        }
    }

    #[test]
    fn what_has_no_end_is_said_to_have_none() {
        let ground = of(|_, p| p[1]);
        assert_eq!(ground.min, [f64::NEG_INFINITY; 3]);
        assert!(ground.max[1].abs() < 1e-3 && ground.max[0].is_infinite());
        let bowl = of(|e, p| {
            let squares = [p[0], p[2]].map(|c| e.call(Op::Square, &[c]));
            let sum = e.call(Op::Add, &squares);
            e.call(Op::Sub, &[p[1], sum])
        });
        assert!(bowl.max.iter().all(|v| v.is_infinite()), "{bowl:?}");
    }

    /// A hill that falls away for ever grows ever wider, beyond the cube that is searched.
    #[test]
    fn what_has_no_end_along_one_axis_grows_along_the_others() {
        let hill = of(|e, p| {
            let [x, _, z] = p.map(|c| e.call(Op::Square, &[c]));
            let factor = e.constant(0.02);
            let squares = e.call(Op::Add, &[x, z]);
            let fall = e.call(Op::Mul, &[squares, factor]);
            e.call(Op::Add, &[p[1], fall])
        });
        assert!(hill.min.iter().all(|v| v.is_infinite()), "{hill:?}");
        assert!(hill.max[0].is_infinite() && hill.max[1] < 0.01 && hill.max[2].is_infinite());
        // A column with a wavy wall is as wide at any height.
        let column = of(|e, p| {
            let [x, _, z] = p.map(|c| e.call(Op::Square, &[c]));
            let wave = e.call(Op::Sin, &p[1..2]);
            let squares = e.call(Op::Add, &[x, z]);
            let four = e.constant(4.0);
            let wide = e.call(Op::Sub, &[squares, four]);
            e.call(Op::Add, &[wide, wave])
        });
        assert!(column.min[1].is_infinite() && column.max[1].is_infinite());
        assert!(column.max[0] < 2.3 && column.min[2] > -2.3, "{column:?}");
    }

    #[test]
    fn what_is_positive_everywhere_has_no_extent() {
        let sheet = of(|e, p| {
            let away = e.call(Op::Abs, &[p[1]]);
            let one = e.constant(1.0);
            e.call(Op::Add, &[away, one])
        });
        assert!(sheet.is_empty(), "{sheet:?}");
    }
}
