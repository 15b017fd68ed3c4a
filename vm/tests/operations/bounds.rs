//! No point of a shape lies outside its bounding volume.

use crate::fixture::{Case, Point, Random, cases, distance, is_math, is_shape, length, tries};
use sdfc_vm::blend::BlendKernel;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::row::{BoundsRule, Category, Exactness, Output};
use sdfc_vm::table::Op;

fn holds(b: &Bounds, p: Point) -> bool {
    (0..3).all(|i| b.min[i] - 1e-5 <= p[i] && p[i] <= b.max[i] + 1e-5)
}

#[test]
fn shapes_lie_within_their_bounds() {
    for case in cases(11, 12, |op| is_shape(op) && op != Op::PolygonEdge) {
        let mut random = Random::for_case(10, &case.name());
        let rule = case.op.row().facts.bounds;
        let Some(bounds) = rule.shape_bounds(&case.parameters()) else {
            let is_infinite = matches!(rule, BoundsRule::Infinite);
            assert!(is_infinite, "{} has no bounds of its own", case.name());
            continue;
        };
        let mut reached = Bounds::EMPTY;
        for i in 0..tries(20_000, 12) {
            let p = match i % 4 {
                0 => random.point_in(&bounds),
                _ => random.point(2.5),
            };
            if case.at(p) < 0.0 {
                assert!(
                    holds(&bounds, p),
                    "{} at {p:?}: outside {bounds:?}",
                    case.name()
                );
                reached = reached.including(p);
            }
        }
        // The volumes are not needlessly large.
        let flat = case.op.row().facts.category == Category::Shape2;
        let loose = matches!(
            case.op,
            Op::Star | Op::Ngon | Op::Prism | Op::Tetrahedron | Op::Pyramid
        );
        let axes = if flat { 2 } else { 3 };
        let mut ends = bounds.min[..axes].iter().chain(&bounds.max[..axes]);
        let is_infinite = ends.any(|end| end.is_infinite());
        if !loose && !is_infinite && !reached.is_empty() {
            for i in 0..axes {
                let gap = (bounds.max[i] - reached.max[i]).max(reached.min[i] - bounds.min[i]);
                assert!(gap < 0.35, "{}: {bounds:?} for {reached:?}", case.name());
            }
        }
    }
}

/// Outside its bounds, a shape's distance is at least that to the bounds, which blends rely on. That is the
/// Euclidean distance if it is exact, the one along the farthest axis otherwise.
#[test]
fn shapes_are_as_far_as_their_bounds_at_least() {
    for case in cases(17, 12, |op| is_shape(op) && op != Op::PolygonEdge) {
        let mut random = Random::for_case(16, &case.name());
        let rule = case.op.row().facts.bounds;
        let Some(bounds) = rule.shape_bounds(&case.parameters()) else {
            continue;
        };
        for _ in 0..tries(5_000, 12) {
            let p = random.point(4.0);
            let beyond: Point =
                std::array::from_fn(|i| (bounds.min[i] - p[i]).max(p[i] - bounds.max[i]).max(0.0));
            let lowest = match case.op.row().facts.exactness {
                Exactness::Exact | Exactness::ExactOutside => length(beyond),
                Exactness::Bound | Exactness::Unknown => beyond.into_iter().fold(0.0, f64::max),
            };
            let d = case.at(p);
            assert!(
                lowest == 0.0 || d >= lowest - 1e-5,
                "{} at {p:?}: {d}, and {lowest} from {bounds:?}",
                case.name()
            );
        }
    }
}

/// A map's bounds contain the image of a sphere inside the shape's bounds.
#[test]
fn moved_shapes_lie_within_their_bounds() {
    for case in cases(13, 8, |op| {
        // A partial turn's map alone continues beyond its ends.
        op.row().output == Output::Point && !is_math(op) && op != Op::RevolvePart
    }) {
        let mut random = Random::for_case(12, &case.name());
        let BoundsRule::Map(map) = case.op.row().facts.bounds else {
            panic!("{} maps no bounds", case.name());
        };
        let (centre, r) = ([0.25, 0.125, 0.0625], 0.1875);
        let ball = Case::new(Op::Sphere, &[r]);
        let shape = Bounds::EMPTY.including(centre).grown(r);
        let flat = matches!(case.op, Op::Revolve | Op::Slice);
        let bounds = map(&case.parameters(), &shape);
        for _ in 0..tries(20_000, 8) {
            let p = random.point(3.0);
            let q = case.map(p);
            let z = if flat { 0.0 } else { q[2] - centre[2] };
            if ball.at([q[0] - centre[0], q[1] - centre[1], z]) < 0.0 {
                assert!(
                    holds(&bounds, p),
                    "{} at {p:?}: outside {bounds:?}",
                    case.name()
                );
            }
        }
    }
}

/// A union is less than some distance only if one of its operands is less than that distance plus the
/// growth of the bounds.
#[test]
fn blends_add_no_more_than_their_bounds_grow_by() {
    for case in cases(19, 8, |op| op.row().facts.category == Category::Combine) {
        let mut random = Random::for_case(18, &case.name());
        let by = match case.op.row().facts.bounds {
            BoundsRule::Hull => 0.0,
            BoundsRule::HullGrown(by) => by(&case.parameters()),
            _ => continue,
        };
        for _ in 0..5_000 {
            let [a, b, _] = random.point(2.0);
            let result = case.with(random.point(2.0), [a, b, 0.0]);
            assert!(
                a.min(b) <= result.max(0.0) + by + 1e-6,
                "{} of {a} and {b}: {result}",
                case.name()
            );
        }
    }
}

/// The offset of a chain of blends of any length is within its bound.
#[test]
fn chains_add_no_more_than_their_bound() {
    for kernel in BlendKernel::ALL {
        let mut random = Random::for_case(20, &format!("{kernel:?}"));
        let width = 0.5;
        let coefficient = match kernel {
            BlendKernel::Hard => 0.0,
            BlendKernel::Quadratic => 0.25 / width,
            BlendKernel::Cubic => 1.0 / (6.0 * width * width),
            BlendKernel::Circular | BlendKernel::Exponential => 1.0 / width,
        };
        for _ in 0..2_000 {
            let count = random.range(2.0, 40.0) as usize;
            // The offset is largest where all operands are nearly equal.
            let spread = random.unit() * random.unit();
            let values: Vec<f64> = (0..count).map(|_| random.range(0.0, spread)).collect();
            let blend = |a, b| kernel.blend(a, b, 1.0, 1.0, width, coefficient);
            let lowest = values.iter().copied().fold(f64::INFINITY, f64::min);
            let chain = values.iter().copied().reduce(blend).unwrap_or(0.0);
            let bound = kernel.max_chain_offset(width, count);
            assert!(
                lowest - chain <= bound + 1e-9,
                "{kernel:?}: {} of {count}, not {bound}",
                lowest - chain
            );
        }
    }
}

/// Combinations of two spheres: every point inside lies within the volume that the rule derives from both
/// bounds.
#[test]
fn combined_shapes_lie_within_their_bounds() {
    let balls = [([-0.375, 0.0, 0.25], 0.5), ([0.5, 0.25, 0.0], 0.625)];
    let bounds = balls.map(|(c, r)| Bounds::EMPTY.including(c).grown(r));
    for case in cases(15, 6, |op| op.row().facts.category == Category::Combine) {
        let mut random = Random::for_case(14, &case.name());
        let a = case.parameters();
        let volume = match case.op.row().facts.bounds {
            BoundsRule::Hull => bounds[0].hull(&bounds[1]),
            BoundsRule::HullGrown(by) => bounds[0].hull(&bounds[1]).grown(by(&a)),
            BoundsRule::Intersection => bounds[0].intersection(&bounds[1]),
            BoundsRule::FirstOperand => bounds[0],
            _ => panic!("{} combines no bounds", case.name()),
        };
        for _ in 0..tries(20_000, 6) {
            let p = random.point(2.0);
            let d = balls.map(|(c, r)| distance(p, c) - r);
            if case.with(p, [d[0], d[1], 0.0]) < 0.0 {
                assert!(
                    holds(&volume, p),
                    "{} at {p:?}: outside {volume:?}",
                    case.name()
                );
            }
        }
    }
}
