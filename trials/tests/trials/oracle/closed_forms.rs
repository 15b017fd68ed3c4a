//! Rays with known ends.

use super::{Point, oracle, oracle_of, scene};
use sdfc_trials::oracle::{Oracle, Trace};

fn near(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-11, "{a} is not {b}");
}

/// Demands a hit at a parameter, from outside or inside.
fn demand(
    oracle: &Oracle,
    origin: Point,
    direction: Point,
    t: f64,
    from_inside: bool,
) -> Option<Point> {
    match oracle.trace(origin, direction, [0.0, 20.0]) {
        Trace::Hit {
            t: found,
            normal,
            inside,
        } => {
            near(found, t);
            assert_eq!(inside, from_inside);
            normal
        }
        other => panic!("{other:?} from {origin:?} along {direction:?}"),
    }
}

fn demand_miss(oracle: &Oracle, origin: Point, direction: Point) {
    let trace = oracle.trace(origin, direction, [0.0, 20.0]);
    assert_eq!(trace, Trace::Miss, "from {origin:?} along {direction:?}");
}

fn is_undecided(oracle: &Oracle, origin: Point, direction: Point) -> bool {
    matches!(
        oracle.trace(origin, direction, [0.0, 20.0]),
        Trace::Undecided { .. }
    )
}

const AHEAD: Point = [0.0, 0.0, -1.0];

#[test]
fn a_ball_is_hit_where_the_quadratic_formula_says() {
    let ball = oracle_of("sphere(1)");
    for x in [0.0, 0.3, 0.9, 0.999, 0.999_99] {
        let depth = f64::sqrt(1.0 - x * x);
        let normal = demand(&ball, [x, 0.0, 5.0], AHEAD, 5.0 - depth, false);
        let normal = normal.expect("a ball has no edge");
        assert!((normal[0] - x).abs() < 1e-4 && (normal[2] - depth).abs() < 1e-4);
        // The same ray with another parameter, and one that starts inside.
        demand(
            &ball,
            [x, 0.0, 5.0],
            [0.0, 0.0, -4.0],
            (5.0 - depth) / 4.0,
            false,
        );
        demand(&ball, [x, 0.0, 0.0], AHEAD, depth, true);
    }
    demand_miss(&ball, [1.000_01, 0.0, 5.0], AHEAD);
    demand_miss(&ball, [0.0, 0.0, 5.0], [0.0, 0.0, 1.0]);
    assert!(is_undecided(&ball, [1.0, 0.0, 5.0], AHEAD));
    assert!(is_undecided(&ball, [1.000_000_5, 0.0, 5.0], AHEAD));
    assert!(is_undecided(&ball, [0.999_999_999_999, 0.0, 5.0], AHEAD));
    let range = ball.trace([0.0, 0.0, 5.0], AHEAD, [0.0, 3.9]);
    assert_eq!(range, Trace::Miss);
}

#[test]
fn a_box_has_normals_on_faces_and_none_on_edges() {
    let block = oracle_of("box(2, 4, 6)");
    let direction = [-1.0, 0.2, 0.1];
    let normal = demand(&block, [5.0, 0.3, 0.2], direction, 4.0, false);
    let normal = normal.expect("a face has a normal");
    assert!((normal[0] - 1.0).abs() < 1e-9);
    let edge = demand(&block, [5.0, 0.0, 7.0], [-1.0, 0.0, -1.0], 4.0, false);
    assert_eq!(edge, None);
}

#[test]
fn a_cut_that_ends_on_a_face_is_open() {
    let drilled = oracle_of("box(2, 2, 2) - cylinder(r: 0.5, h: 2)");
    for x in [0.0, 0.1, 0.49, 0.4999] {
        demand_miss(&drilled, [x, 5.0, 0.1 * (0.5 - x)], [0.0, -1.0, 0.0]);
    }
    demand(&drilled, [0.51, 5.0, 0.0], [0.0, -1.0, 0.0], 4.0, false);
    // Askew, through the open end and onto the wall.
    let t = (0.5 + 0.1) / 0.2;
    demand(&drilled, [-0.1, 2.0, 0.0], [0.2, -0.5, 0.0], t, false);
}

#[test]
fn shared_faces_are_no_surface() {
    let halves = oracle_of("box(1).translate(-0.5, 0, 0) | box(1).translate(0.5, 0, 0)");
    demand(&halves, [5.0, 0.1, 0.2], [-1.0, 0.0, 0.0], 4.0, false);
    demand(&halves, [0.7, 0.1, 0.2], [-1.0, 0.0, 0.0], 1.7, true);
    demand(&halves, [-0.7, 0.1, 0.2], [1.0, 0.3, 0.0], 0.4 / 0.3, true);
    demand_miss(&oracle_of("sphere(1) - sphere(1)"), [0.2, 0.1, 5.0], AHEAD);
    demand_miss(&oracle_of("box(1) - box(1, 2, 2)"), [0.2, 0.1, 5.0], AHEAD);
    let same = oracle_of("box(1) | box(1).translate(0, 0, 0) | box(1).rotate(90deg, X)");
    demand(&same, [0.2, 0.1, 5.0], AHEAD, 4.5, false);
}

#[test]
fn sheets_of_no_thickness_are_not_there_and_thin_ones_are() {
    let sheet = oracle_of("field(fn(p) => abs(p.y), within: 4)");
    demand_miss(&sheet, [0.3, 5.0, 0.1], [0.1, -1.0, 0.2]);
    for thickness in [1e-3, 1e-5, 1e-7] {
        let text = format!("field(fn(p) => abs(p.y) - {}, within: 4)", thickness / 2.0);
        let t = 5.0 - thickness / 2.0;
        demand(
            &oracle_of(&text),
            [0.3, 5.0, 0.1],
            [0.1, -1.0, 0.2],
            t,
            false,
        );
        let text = format!("plane(Y).shell({thickness})");
        demand(
            &oracle_of(&text),
            [0.3, 5.0, 0.1],
            [0.1, -1.0, 0.2],
            t,
            false,
        );
    }
}

#[test]
fn wires_of_a_thousandth_are_hit() {
    let solid = oracle_of("cylinder(r: 0.001, h: 10)");
    let field = oracle_of("field(fn(p) => length(p.xz) - 0.001, within: 10)");
    let steep = oracle_of("field(fn(p) => 50 * (dot(p.xz, p.xz) - 0.000001), within: 10)");
    for wire in [solid, field, steep] {
        for x in [0.0, 0.0004, 0.0009] {
            let depth = f64::sqrt(1e-6 - x * x);
            demand(&wire, [x, 0.3, 5.0], AHEAD, 5.0 - depth, false);
        }
        demand_miss(&wire, [0.0011, 0.3, 5.0], AHEAD);
    }
}

#[test]
fn touching_copies_touch_in_points_only() {
    let row = oracle_of("sphere(0.5).repeat([1, 0, 0])");
    near(row.value([17.3, 0.0, 0.0]), 0.3 - 0.5);
    near(row.value([17.5, 0.4, 0.3]), 0.5_f64.sqrt() - 0.5);
    demand_miss(&row, [0.5, 0.01, 5.0], AHEAD);
    assert!(is_undecided(&row, [0.5, 0.0, 5.0], AHEAD));
    // Around the points where they touch, they are nearer than any number can tell.
    demand_miss(&row, [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
    let x = 9.0 - 0.3_f64;
    demand(
        &row,
        [x, 0.0, 5.0],
        AHEAD,
        5.0 - (0.25 - 0.09_f64).sqrt(),
        false,
    );
    // A ray along the row enters one copy, whichever it is.
    demand(&row, [0.5, 0.4, 0.0], [1.0, 0.0, 0.0], 0.5 - 0.3, false);
}

#[test]
fn copies_in_a_grid_and_around_an_axis_are_all_there() {
    let grid =
        oracle_of("sphere(0.1).translate(0.05, 0, 0).repeat([0.4, 0, 0.4], count: [3, 1, 2])");
    for (x, z) in [(-0.4, -0.2), (0.0, -0.2), (0.4, 0.2), (0.4, -0.2)] {
        demand(&grid, [x + 0.05, 5.0, z], [0.0, -1.0, 0.0], 4.9, false);
    }
    demand_miss(&grid, [0.85, 5.0, 0.2], [0.0, -1.0, 0.0]);
    demand_miss(&grid, [0.05, 5.0, 0.6], [0.0, -1.0, 0.0]);
    let ring = oracle_of("sphere(0.1).translate(1, 0, 0).polar(5)");
    for at in 0..5 {
        let (sine, cosine) = (std::f64::consts::TAU * f64::from(at) / 5.0).sin_cos();
        demand(&ring, [cosine, 5.0, sine], [0.0, -1.0, 0.0], 4.9, false);
        demand_miss(&ring, [-cosine, 5.0, -sine], [0.0, -1.0, 0.0]);
    }
}

#[test]
fn an_eye_inside_sees_surfaces_from_behind() {
    let room = oracle_of("box(4) - sphere(1)");
    demand(&room, [1.5, 0.2, 0.1], [1.0, 0.0, 0.0], 0.5, true);
    let depth = (1.0 - 0.05_f64).sqrt();
    let normal = demand(&room, [1.5, 0.2, 0.1], [-1.0, 0.0, 0.0], 1.5 - depth, true);
    let normal = normal.expect("a ball has no edge");
    assert!(
        (normal[0] + depth).abs() < 1e-6,
        "out of the solid, into the hollow"
    );
    demand(&room, [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], 1.0, false);
}

#[test]
fn a_plane_is_hit_at_grazing_angles() {
    let plane = oracle_of("plane(Y)");
    for degrees in [0.05, 0.5, 5.0_f64] {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        match plane.trace([0.0, 0.01, 0.0], [cosine, -sine, 0.0], [0.0, 100.0]) {
            Trace::Hit { t, .. } => assert!((t * sine / 0.01 - 1.0).abs() < 1e-9),
            other => panic!("{other:?}"),
        }
    }
    demand_miss(&plane, [0.0, 0.01, 0.0], [1.0, 0.0, 0.0]);
    assert!(is_undecided(&plane, [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]));
}

#[test]
fn a_jump_across_zero_is_a_surface_and_any_other_jump_is_none() {
    let stairs = oracle_of("field(fn(p) => p.y - floor(p.x), within: 20, lipschitz: 9)");
    demand(&stairs, [0.5, 1.5, 0.0], [1.0, 0.0, 0.0], 1.5, false);
    demand(&stairs, [0.5, 1.5, 0.0], [1.0, -0.4, 0.0], 0.5 / 0.4, false);
    demand(&stairs, [0.5, 3.25, 0.0], [0.0, -1.0, 0.0], 3.25, false);
}

#[test]
fn stretched_and_turned_frames_keep_lengths_of_rays() {
    let egg = oracle_of("sphere(1).scale([2, 1, 0.5]).rotate(90deg, Y).translate(0, 0, 1)");
    demand(&egg, [0.0, 0.0, 9.0], AHEAD, 6.0, false);
    demand(&egg, [9.0, 0.0, 1.0], [-1.0, 0.0, 0.0], 8.5, false);
    // Turned a quarter per unit of height: x has become −z.
    let twisted = oracle_of("sphere(0.2).translate(1, 0, 0).elongate([0, 4, 0]).twist(90deg)");
    demand(&twisted, [0.0, 1.0, -5.0], [0.0, 0.0, 1.0], 3.8, false);
    let bent = oracle_of("box(8, 0.2, 0.2).bend(10deg)");
    near(bent.value([0.0, 0.3, 0.0]), 0.2);
}

#[test]
fn time_and_parameters_have_their_present_values() {
    let scene =
        scene("param r = 0.5 in 0.0..2.0;\nanimate { duration: 4s }\nsphere(r + time * 0.25 / 1s)");
    let root = scene.root.expect("a shape");
    for time in [0.0, 1.0, 2.0] {
        near(
            Oracle::new(&scene, root, time).value([2.0, 0.0, 0.0]),
            1.5 - 0.25 * time,
        );
    }
}

#[test]
fn no_shape_at_all_is_missed() {
    let scene = scene("sphere(1) & union([])");
    demand_miss(&oracle(&scene), [0.0, 0.0, 5.0], AHEAD);
}

#[test]
fn oracles_are_shared_by_threads() {
    fn shared<T: Sync + Send>() {}
    shared::<Oracle>();
}
