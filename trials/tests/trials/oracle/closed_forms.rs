//! Rays with known outcomes.

use super::{Point, oracle, oracle_for_text, scene};
use sdfc_trials::oracle::{Oracle, TraceOutcome};

fn assert_near(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-11, "{a} is not {b}");
}

/// Asserts a hit at a parameter, from outside or inside.
fn assert_hit(
    oracle: &Oracle,
    origin: Point,
    direction: Point,
    t: f64,
    from_inside: bool,
) -> Option<Point> {
    match oracle.trace(origin, direction, [0.0, 20.0]) {
        TraceOutcome::Hit {
            t: hit_t,
            normal,
            inside,
        } => {
            assert_near(hit_t, t);
            assert_eq!(inside, from_inside);
            normal
        }
        other => panic!("{other:?} from {origin:?} along {direction:?}"),
    }
}

fn assert_miss(oracle: &Oracle, origin: Point, direction: Point) {
    let trace = oracle.trace(origin, direction, [0.0, 20.0]);
    assert_eq!(
        trace,
        TraceOutcome::Miss,
        "from {origin:?} along {direction:?}"
    );
}

fn is_undecided(oracle: &Oracle, origin: Point, direction: Point) -> bool {
    matches!(
        oracle.trace(origin, direction, [0.0, 20.0]),
        TraceOutcome::Undecided { .. }
    )
}

const FORWARD: Point = [0.0, 0.0, -1.0];

#[test]
fn a_sphere_is_hit_at_the_roots_of_the_quadratic_formula() {
    let ball = oracle_for_text("sphere(1)");
    for x in [0.0, 0.3, 0.9, 0.999, 0.999_99] {
        let depth = f64::sqrt(1.0 - x * x);
        let normal = assert_hit(&ball, [x, 0.0, 5.0], FORWARD, 5.0 - depth, false);
        let normal = normal.expect("a ball has no edge");
        assert!((normal[0] - x).abs() < 1e-4 && (normal[2] - depth).abs() < 1e-4);
        // The ray with another parameter scale, and one that starts inside.
        assert_hit(
            &ball,
            [x, 0.0, 5.0],
            [0.0, 0.0, -4.0],
            (5.0 - depth) / 4.0,
            false,
        );
        assert_hit(&ball, [x, 0.0, 0.0], FORWARD, depth, true);
    }
    assert_miss(&ball, [1.000_01, 0.0, 5.0], FORWARD);
    assert_miss(&ball, [0.0, 0.0, 5.0], [0.0, 0.0, 1.0]);
    assert!(is_undecided(&ball, [1.0, 0.0, 5.0], FORWARD));
    assert!(is_undecided(&ball, [1.000_000_5, 0.0, 5.0], FORWARD));
    assert!(is_undecided(&ball, [0.999_999_999_999, 0.0, 5.0], FORWARD));
    let range = ball.trace([0.0, 0.0, 5.0], FORWARD, [0.0, 3.9]);
    assert_eq!(range, TraceOutcome::Miss);
}

#[test]
fn a_box_has_normals_on_faces_and_none_on_edges() {
    let block = oracle_for_text("box(2, 4, 6)");
    let direction = [-1.0, 0.2, 0.1];
    let normal = assert_hit(&block, [5.0, 0.3, 0.2], direction, 4.0, false);
    let normal = normal.expect("a face has a normal");
    assert!((normal[0] - 1.0).abs() < 1e-9);
    let edge = assert_hit(&block, [5.0, 0.0, 7.0], [-1.0, 0.0, -1.0], 4.0, false);
    assert_eq!(edge, None);
}

#[test]
fn a_cut_that_ends_on_a_face_is_open() {
    let drilled = oracle_for_text("box(2, 2, 2) - cylinder(r: 0.5, h: 2)");
    for x in [0.0, 0.1, 0.49, 0.4999] {
        assert_miss(&drilled, [x, 5.0, 0.1 * (0.5 - x)], [0.0, -1.0, 0.0]);
    }
    assert_hit(&drilled, [0.51, 5.0, 0.0], [0.0, -1.0, 0.0], 4.0, false);
    // Obliquely, through the open end and onto the wall.
    let t = (0.5 + 0.1) / 0.2;
    assert_hit(&drilled, [-0.1, 2.0, 0.0], [0.2, -0.5, 0.0], t, false);
}

#[test]
fn shared_faces_are_no_surface() {
    let halves = oracle_for_text("box(1).translate(-0.5, 0, 0) | box(1).translate(0.5, 0, 0)");
    assert_hit(&halves, [5.0, 0.1, 0.2], [-1.0, 0.0, 0.0], 4.0, false);
    assert_hit(&halves, [0.7, 0.1, 0.2], [-1.0, 0.0, 0.0], 1.7, true);
    assert_hit(&halves, [-0.7, 0.1, 0.2], [1.0, 0.3, 0.0], 0.4 / 0.3, true);
    assert_miss(
        &oracle_for_text("sphere(1) - sphere(1)"),
        [0.2, 0.1, 5.0],
        FORWARD,
    );
    assert_miss(
        &oracle_for_text("box(1) - box(1, 2, 2)"),
        [0.2, 0.1, 5.0],
        FORWARD,
    );
    let other_speed =
        oracle_for_text("box(1) | box(1).translate(0, 0, 0) | box(1).rotate(90deg, X)");
    assert_hit(&other_speed, [0.2, 0.1, 5.0], FORWARD, 4.5, false);
}

#[test]
fn sheets_of_no_thickness_are_not_there_and_thin_ones_are() {
    let sheet = oracle_for_text("field(fn(p) => abs(p.y), within: 4)");
    assert_miss(&sheet, [0.3, 5.0, 0.1], [0.1, -1.0, 0.2]);
    for thickness in [1e-3, 1e-5, 1e-7] {
        let text = format!("field(fn(p) => abs(p.y) - {}, within: 4)", thickness / 2.0);
        let t = 5.0 - thickness / 2.0;
        assert_hit(
            &oracle_for_text(&text),
            [0.3, 5.0, 0.1],
            [0.1, -1.0, 0.2],
            t,
            false,
        );
        let text = format!("plane(Y).shell({thickness})");
        assert_hit(
            &oracle_for_text(&text),
            [0.3, 5.0, 0.1],
            [0.1, -1.0, 0.2],
            t,
            false,
        );
    }
}

#[test]
fn wires_of_a_thousandth_are_hit() {
    let solid = oracle_for_text("cylinder(r: 0.001, h: 10)");
    let field = oracle_for_text("field(fn(p) => length(p.xz) - 0.001, within: 10)");
    let steep = oracle_for_text("field(fn(p) => 50 * (dot(p.xz, p.xz) - 0.000001), within: 10)");
    for wire in [solid, field, steep] {
        for x in [0.0, 0.0004, 0.0009] {
            let depth = f64::sqrt(1e-6 - x * x);
            assert_hit(&wire, [x, 0.3, 5.0], FORWARD, 5.0 - depth, false);
        }
        assert_miss(&wire, [0.0011, 0.3, 5.0], FORWARD);
    }
}

#[test]
fn touching_copies_touch_in_points_only() {
    let row = oracle_for_text("sphere(0.5).repeat([1, 0, 0])");
    assert_near(row.value([17.3, 0.0, 0.0]), 0.3 - 0.5);
    assert_near(row.value([17.5, 0.4, 0.3]), 0.5_f64.sqrt() - 0.5);
    assert_miss(&row, [0.5, 0.01, 5.0], FORWARD);
    assert!(is_undecided(&row, [0.5, 0.0, 5.0], FORWARD));
    // Around the points where they touch, the gap is below the resolution of numbers.
    assert_miss(&row, [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
    let x = 9.0 - 0.3_f64;
    assert_hit(
        &row,
        [x, 0.0, 5.0],
        FORWARD,
        5.0 - (0.25 - 0.09_f64).sqrt(),
        false,
    );
    // A ray along the row enters one copy, whichever it is.
    assert_hit(&row, [0.5, 0.4, 0.0], [1.0, 0.0, 0.0], 0.5 - 0.3, false);
}

#[test]
fn copies_in_a_grid_and_around_an_axis_are_all_there() {
    let grid = oracle_for_text(
        "sphere(0.1).translate(0.05, 0, 0).repeat([0.4, 0, 0.4], count: [3, 1, 2])",
    );
    for (x, z) in [(-0.4, -0.2), (0.0, -0.2), (0.4, 0.2), (0.4, -0.2)] {
        assert_hit(&grid, [x + 0.05, 5.0, z], [0.0, -1.0, 0.0], 4.9, false);
    }
    assert_miss(&grid, [0.85, 5.0, 0.2], [0.0, -1.0, 0.0]);
    assert_miss(&grid, [0.05, 5.0, 0.6], [0.0, -1.0, 0.0]);
    let ring = oracle_for_text("sphere(0.1).translate(1, 0, 0).polar(5)");
    for index in 0..5 {
        let (sine, cosine) = (std::f64::consts::TAU * f64::from(index) / 5.0).sin_cos();
        assert_hit(&ring, [cosine, 5.0, sine], [0.0, -1.0, 0.0], 4.9, false);
        assert_miss(&ring, [-cosine, 5.0, -sine], [0.0, -1.0, 0.0]);
    }
}

#[test]
fn a_camera_inside_sees_surfaces_from_behind() {
    let room = oracle_for_text("box(4) - sphere(1)");
    assert_hit(&room, [1.5, 0.2, 0.1], [1.0, 0.0, 0.0], 0.5, true);
    let depth = (1.0 - 0.05_f64).sqrt();
    let normal = assert_hit(&room, [1.5, 0.2, 0.1], [-1.0, 0.0, 0.0], 1.5 - depth, true);
    let normal = normal.expect("a ball has no edge");
    assert!(
        (normal[0] + depth).abs() < 1e-6,
        "out of the solid, into the hollow"
    );
    assert_hit(&room, [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], 1.0, false);
}

#[test]
fn a_plane_is_hit_at_grazing_angles() {
    let plane = oracle_for_text("plane(Y)");
    for degrees in [0.05, 0.5, 5.0_f64] {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        match plane.trace([0.0, 0.01, 0.0], [cosine, -sine, 0.0], [0.0, 100.0]) {
            TraceOutcome::Hit { t, .. } => assert!((t * sine / 0.01 - 1.0).abs() < 1e-9),
            other => panic!("{other:?}"),
        }
    }
    assert_miss(&plane, [0.0, 0.01, 0.0], [1.0, 0.0, 0.0]);
    assert!(is_undecided(&plane, [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]));
}

#[test]
fn a_jump_across_zero_is_a_surface_and_any_other_jump_is_none() {
    let stairs = oracle_for_text("field(fn(p) => p.y - floor(p.x), within: 20, lipschitz: 9)");
    assert_hit(&stairs, [0.5, 1.5, 0.0], [1.0, 0.0, 0.0], 1.5, false);
    assert_hit(&stairs, [0.5, 1.5, 0.0], [1.0, -0.4, 0.0], 0.5 / 0.4, false);
    assert_hit(&stairs, [0.5, 3.25, 0.0], [0.0, -1.0, 0.0], 3.25, false);
}

#[test]
fn stretched_and_turned_frames_keep_lengths_of_rays() {
    let egg = oracle_for_text("sphere(1).scale([2, 1, 0.5]).rotate(90deg, Y).translate(0, 0, 1)");
    assert_hit(&egg, [0.0, 0.0, 9.0], FORWARD, 6.0, false);
    assert_hit(&egg, [9.0, 0.0, 1.0], [-1.0, 0.0, 0.0], 8.5, false);
    // Rotated by a quarter turn per unit of height: x has become −z.
    let twisted =
        oracle_for_text("sphere(0.2).translate(1, 0, 0).elongate([0, 4, 0]).twist(90deg)");
    assert_hit(&twisted, [0.0, 1.0, -5.0], [0.0, 0.0, 1.0], 3.8, false);
    let bent = oracle_for_text("box(8, 0.2, 0.2).bend(10deg)");
    assert_near(bent.value([0.0, 0.3, 0.0]), 0.2);
}

#[test]
fn time_and_parameters_have_their_present_values() {
    let scene =
        scene("param r = 0.5 in 0.0..2.0;\nanimate { duration: 4s }\nsphere(r + time * 0.25 / 1s)");
    let root = scene.root.expect("a shape");
    for time in [0.0, 1.0, 2.0] {
        assert_near(
            Oracle::new(&scene, root, time).value([2.0, 0.0, 0.0]),
            1.5 - 0.25 * time,
        );
    }
}

#[test]
fn no_shape_at_all_is_missed() {
    let scene = scene("sphere(1) & union([])");
    assert_miss(&oracle(&scene), [0.0, 0.0, 5.0], FORWARD);
}

#[test]
fn oracles_are_shared_by_threads() {
    fn shared<T: Sync + Send>() {}
    shared::<Oracle>();
}
