use super::*;
use sdfc_compiler::elaborate::NoFiles;
use sdfc_compiler::open::{Content, Request, open};
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::settings::{Overrides, resolve};
use std::path::Path;

const ASPECT: f64 = 1.6;
const PLACES: [Place; 4] = [[0.0, 0.0], [0.7, -0.4], [-0.95, 0.9], [0.1, 0.6]];

fn view(from: [f64; 3], lens: Lens) -> View {
    View {
        from,
        look: [0.5, 0.25, -1.0],
        up: [0.0, 1.0, 0.0],
        lens,
    }
}

/// Cameras of both lenses: one that stands upright, one that leans, and one that looks straight down.
fn cameras() -> Vec<Camera> {
    let lenses = [Lens::Perspective(0.7), Lens::Orthographic(3.0)];
    let both = lenses.into_iter().flat_map(|lens| {
        let leaning = View {
            up: [0.3, 1.0, 0.1],
            ..view([2.0, 3.0, 6.0], lens)
        };
        let down = View {
            up: [0.0, 0.0, -1.0],
            ..view([0.5, 7.0, -1.0], lens)
        };
        [view([4.0, 1.0, 3.0], lens), leaning, down]
    });
    both.map(|view| Camera::new(view, false, false)).collect()
}

fn plane() -> Camera {
    Camera::new(View::plane([3.0, -2.0], 5.0), false, true)
}

fn assert_near(a: [f64; 3], b: [f64; 3], within: f64, what: &str) {
    let far = (vector(a) - vector(b)).length();
    assert!(far <= within, "{what}: {a:?} and {b:?} are {far:e} apart");
}

/// The directions and the lens of two views are the same, and so are their places.
fn assert_same(a: &View, b: &View, within: f64, what: &str) {
    assert_near(a.from, b.from, within, what);
    assert_near(a.look, b.look, within, what);
    let ([a_basis, b_basis], size) = ([a, b].map(Basis::of), within.max(1e-12));
    assert_near(array(a_basis.right), array(b_basis.right), size, what);
    assert_near(array(a_basis.up), array(b_basis.up), size, what);
    match (a.lens, b.lens) {
        (Lens::Perspective(a), Lens::Perspective(b))
        | (Lens::Orthographic(a), Lens::Orthographic(b)) => {
            assert!((a - b).abs() <= 1e-4 * a, "{what}: {a} and {b}");
        }
        (a, b) => panic!("{what}: {a:?} and {b:?}"),
    }
}

#[test]
fn a_view_stays_the_very_same_until_it_is_moved() {
    for camera in cameras() {
        assert_eq!(
            Camera::new(camera.view(), true, false).view(),
            camera.view()
        );
    }
}

#[test]
fn what_is_under_a_place_is_seen_there() {
    for camera in cameras().into_iter().chain([plane()]) {
        for place in PLACES {
            for depth in [None, Some(0.3), Some(20.0), Some(f64::INFINITY)] {
                let point = camera.point_under(place, depth, ASPECT);
                let seen = camera.place_of(point, ASPECT).expect("it is in front");
                assert!((seen[0] - place[0]).abs() + (seen[1] - place[1]).abs() < 1e-9);
            }
        }
    }
    let camera = &cameras()[0];
    let behind = camera.point_under([0.0, 0.0], Some(-1.0), ASPECT);
    assert_eq!(camera.place_of(behind, ASPECT), None);
    // A way along a slanted ray is longer than the way straight ahead.
    let point = camera.point_under([1.0, 1.0], Some(2.0), ASPECT);
    let way = vector(point) - vector(camera.view().from);
    assert!((way.length() - 2.0).abs() < 1e-12);
}

#[test]
fn orbits_keep_the_distance_and_what_is_looked_at() {
    for mut camera in cameras() {
        let (distance, look) = (camera.distance(), camera.view().look);
        for i in 0..500 {
            camera.orbit(0.3, 0.2 * f64::from(i).sin());
            assert!((camera.distance() - distance).abs() < 1e-9);
            assert_eq!(camera.view().look, look);
        }
    }
}

#[test]
fn an_orbit_all_around_ends_where_it_began() {
    for mut camera in cameras() {
        let before = camera.view();
        for _ in 0..36 {
            camera.orbit(PI / 18.0, 0.0);
        }
        assert_same(&camera.view(), &before, 1e-9, "once around");
    }
}

#[test]
fn orbits_go_where_they_should() {
    let mut camera = Camera::new(view([0.5, 0.25, 4.0], Lens::Perspective(0.7)), false, false);
    camera.orbit(FRAC_PI_2, 0.0);
    assert_near(camera.view().from, [5.5, 0.25, -1.0], 1e-9, "to the right");
    camera.orbit(0.0, 0.5);
    let height = 0.25 + 5.0 * 0.5_f64.sin();
    let beside = 0.5 + 5.0 * 0.5_f64.cos();
    assert_near(camera.view().from, [beside, height, -1.0], 1e-9, "up");
}

#[test]
fn nothing_flips_at_the_poles() {
    for mut camera in cameras() {
        camera.orbit(0.2, 0.0);
        let right = Basis::of(&camera.view()).right;
        for step in [0.1, -0.1] {
            for _ in 0..60 {
                camera.orbit(0.0, step);
                let now = Basis::of(&camera.view());
                assert_near(array(now.right), array(right), 1e-9, "the right");
                assert!(now.up.dot(camera.axis) >= -1e-9, "it stands on its head");
            }
            let back = Basis::of(&camera.view()).back;
            assert!((back.dot(camera.axis) - step.signum()).abs() < 1e-9);
        }
        // At the pole it still turns, by as much as it is told.
        camera.orbit(0.5, 0.0);
        let now = Basis::of(&camera.view()).right;
        assert!((now.dot(right) - 0.5_f64.cos()).abs() < 1e-9);
    }
}

#[test]
fn an_upside_down_view_stays_upside_down() {
    let given = View {
        up: [0.0, -1.0, 0.0],
        ..view([4.0, 1.0, 3.0], Lens::Perspective(0.7))
    };
    let mut camera = Camera::new(given, false, false);
    camera.orbit(1e-9, 0.0);
    assert_same(&camera.view(), &given, 1e-6, "hardly moved");
}

#[test]
fn the_point_under_the_cursor_stays_there_when_zooming() {
    for camera in cameras().into_iter().chain([plane()]) {
        for place in PLACES {
            for depth in [None, Some(2.0), Some(30.0)] {
                for factor in [0.5, 0.9, 1.1, 3.0] {
                    let mut camera = camera.clone();
                    let before = camera.view();
                    let point = camera.point_under(place, depth, ASPECT);
                    camera.zoom(factor, point);
                    let seen = camera.place_of(point, ASPECT).expect("it is in front");
                    let off = (seen[0] - place[0]).hypot(seen[1] - place[1]);
                    assert!(
                        off < 1e-9,
                        "{before:?} {place:?} {depth:?} {factor}: {off:e}"
                    );
                    let grown = match (before.lens, camera.view().lens) {
                        (Lens::Orthographic(a), Lens::Orthographic(b)) => b / a,
                        _ => {
                            let way = |from| (vector(point) - vector(from)).length();
                            way(camera.view().from) / way(before.from)
                        }
                    };
                    assert!((grown - factor).abs() < 1e-9, "{grown} for {factor}");
                }
            }
        }
    }
}

/// Zooms to what is under a place, as far away as what the camera looks at.
fn zoom_at(camera: &mut Camera, factor: f64, place: Place) {
    let point = camera.point_under(place, None, ASPECT);
    camera.zoom(factor, point);
}

#[test]
fn zooming_has_an_end_and_comes_back() {
    for camera in cameras().into_iter().chain([plane()]) {
        for factor in [0.1, 10.0] {
            let mut camera = camera.clone();
            for _ in 0..100 {
                zoom_at(&mut camera, factor, [0.5, 0.5]);
            }
            let end = camera.view();
            assert!(end.from.iter().chain(&end.look).all(|v| v.is_finite()));
            assert!(camera.distance() > 0.0);
            zoom_at(&mut camera, 1.0 / factor, [0.0, 0.0]);
            assert_ne!(camera.view(), end, "it is stuck");
        }
    }
    for factor in [f64::NAN, f64::INFINITY, -1.0, 0.0] {
        let mut camera = cameras().remove(0);
        zoom_at(&mut camera, factor, [0.0, 0.0]);
        assert!(camera.distance() > 0.0 && camera.distance().is_finite());
    }
}

#[test]
fn panning_carries_the_held_point_along() {
    for camera in cameras().into_iter().chain([plane()]) {
        for depth in [None, Some(3.0)] {
            let mut camera = camera.clone();
            let held = camera.point_under([0.3, 0.2], depth, ASPECT);
            let distance = camera.distance();
            camera.pan([-0.5, 0.25], depth.map(|_| held), ASPECT);
            let seen = camera.place_of(held, ASPECT).expect("it is in front");
            let off = (seen[0] + 0.2).hypot(seen[1] - 0.45);
            assert!(off < 1e-9, "{seen:?}");
            assert!((camera.distance() - distance).abs() < 1e-9);
        }
    }
}

#[test]
fn a_point_in_focus_comes_to_the_middle() {
    for mut camera in cameras() {
        let back = Basis::of(&camera.view()).back;
        camera.focus([3.0, -1.0, 2.0]);
        let [x, y] = camera.place_of([3.0, -1.0, 2.0], ASPECT).expect("seen");
        assert!(x.hypot(y) < 1e-12, "{x} {y}");
        assert_near(
            array(Basis::of(&camera.view()).back),
            array(back),
            1e-9,
            "it turned",
        );
    }
    let mut camera = plane();
    camera.focus([1.0, 2.0, 9.0]);
    assert_eq!(camera.view(), View::plane([1.0, 2.0], 5.0));
}

#[test]
fn fitting_contains_the_corners_and_touches_an_edge() {
    let bounds = Bounds {
        min: [-1.0, 0.0, 2.0],
        max: [3.0, 0.5, 9.0],
    };
    for mut camera in cameras() {
        let back = Basis::of(&camera.view()).back;
        for aspect in [0.4, 1.0, 2.5] {
            camera.fit(&bounds, aspect);
            let mut edge = 0.0_f64;
            for corner in bounds.corners() {
                let [x, y] = camera.place_of(corner, aspect).expect("it is in front");
                edge = edge.max(x.abs()).max(y.abs());
            }
            assert!((0.6..=1.0).contains(&edge), "{edge}");
            assert_near(
                array(Basis::of(&camera.view()).back),
                array(back),
                1e-9,
                "it turned",
            );
        }
    }
    let mut camera = plane();
    camera.fit(&bounds, 0.5);
    let width = 4.0 / camera.place_of([3.0, 0.25, 0.0], 0.5).expect("seen")[0];
    assert!((4.0..4.5).contains(&width), "{width}");
}

#[test]
fn view_keys_look_along_the_axes_of_both_kinds_of_scene() {
    let sides = [
        (Side::Front, [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]),
        (Side::Back, [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]),
        (Side::Left, [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        (Side::Right, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        (Side::Top, [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]),
        (Side::Bottom, [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]),
        (
            Side::Isometric,
            [1.0; 3].map(|v: f64| v / 3.0_f64.sqrt()),
            [-1.0, 2.0, -1.0].map(|v: f64| v / 6.0_f64.sqrt()),
        ),
    ];
    for mut camera in cameras() {
        let (distance, look) = (camera.distance(), camera.view().look);
        for (side, back, up) in sides {
            camera.face(side);
            let basis = Basis::of(&camera.view());
            assert_near(array(basis.back), back, 1e-9, &format!("{side:?}"));
            assert_near(array(basis.up), up, 1e-9, &format!("{side:?}"));
            assert!((camera.distance() - distance).abs() < 1e-9);
            assert_eq!(camera.view().look, look);
            // Where z points up, all is turned by a right angle around x.
            let mut other = Camera::new(camera.view(), true, false);
            other.face(side);
            let basis = Basis::of(&other.view());
            let lying = |[x, y, z]: [f64; 3]| [x, -z, y];
            assert_near(
                array(basis.back),
                lying(back),
                1e-9,
                &format!("{side:?}, z up"),
            );
            assert_near(array(basis.up), lying(up), 1e-9, &format!("{side:?}, z up"));
        }
    }
}

#[test]
fn the_other_lens_keeps_the_size_of_what_is_in_focus() {
    let bounds = Bounds::ball(10.0);
    for mut camera in cameras() {
        let look = vector(camera.view().look);
        let beside = array(look + Basis::of(&camera.view()).right * 0.4);
        let before = camera.place_of(beside, ASPECT).expect("seen");
        let (lens, distance) = (camera.is_orthographic(), camera.distance());
        camera.toggle_lens(&bounds);
        assert_ne!(camera.is_orthographic(), lens);
        let after = camera.place_of(beside, ASPECT).expect("seen");
        assert!((before[0] - after[0]).abs() < 1e-9, "{before:?} {after:?}");
        if !lens {
            for corner in bounds.corners() {
                let ahead = (vector(corner) - vector(camera.view().from))
                    .dot(-Basis::of(&camera.view()).back);
                assert!(ahead > 0.0, "a corner is behind the camera");
            }
            camera.toggle_lens(&bounds);
            assert!(
                (camera.distance() - distance).abs() < 1e-9,
                "there and back"
            );
        }
    }
    let mut camera = cameras().remove(0);
    camera.toggle_lens(&Bounds::EVERYTHING);
    assert!(camera.distance().is_finite());
}

#[test]
fn plane_figures_only_pan_and_zoom() {
    let mut camera = plane();
    let before = camera.view();
    camera.orbit(0.5, 0.5);
    camera.face(Side::Isometric);
    camera.toggle_lens(&Bounds::ball(1.0));
    assert_eq!(camera.view(), before);
    camera.pan([0.5, 0.5], None, ASPECT);
    zoom_at(&mut camera, 0.5, [0.2, 0.1]);
    assert_ne!(camera.view(), before);
    assert_eq!(camera.view().from[..2], camera.view().look[..2]);
}

/// The view of a scene's only camera.
fn view_in(scene: &str) -> View {
    let request = Request {
        path: Path::new("scene.sdf"),
        overrides: Vec::new(),
        time: 0.0,
        part: None,
        passes: PassOptions::default(),
        guards: false,
        sight: None,
        loader: &NoFiles,
    };
    let outcome = open(Content::Text(scene.to_owned()), &request).expect("a scene");
    let opened = outcome
        .made
        .unwrap_or_else(|| panic!("{scene}\n{:?}", outcome.found));
    let overrides = Overrides::default();
    let settings = resolve(&opened.compiled.module, &opened.outputs, &overrides);
    settings.expect("settings").view
}

#[test]
fn a_camera_pasted_into_a_scene_gives_its_view() {
    let mut cases = Vec::new();
    for z_up in [false, true] {
        for camera in cameras() {
            let mut camera = Camera::new(camera.view(), z_up, false);
            cases.push((z_up, camera.clone()));
            for (right, up) in [(0.3, 0.2), (2.0, -0.4), (0.1, 3.0), (0.0, -7.0)] {
                camera.orbit(right, up);
                cases.push((z_up, camera.clone()));
            }
            for side in [Side::Front, Side::Top, Side::Bottom, Side::Isometric] {
                camera.face(side);
                cases.push((z_up, camera.clone()));
                let mut near = camera.clone();
                near.orbit(0.4, 0.0);
                zoom_at(&mut near, 1e-3, [0.3, 0.2]);
                cases.push((z_up, near));
                let mut far = camera.clone();
                zoom_at(&mut far, 700.0, [0.3, 0.2]);
                cases.push((z_up, far));
            }
        }
    }
    for (z_up, camera) in cases {
        let text = camera.text(None);
        let scene = format!(
            "scene {{ up: {} }}\n{text}\nsphere(1)",
            if z_up { "z" } else { "y" }
        );
        let view = camera.view();
        let height = match view.lens {
            Lens::Perspective(fov) => 2.0 * camera.distance() * (fov / 2.0).tan(),
            Lens::Orthographic(height) => height,
        };
        let pasted = view_in(&scene);
        let off = (vector(pasted.look) - vector(view.look)).length();
        assert!(off < 1e-4 * height, "{text}: {off}");
        let within = 1e-4 * height.max(1.0);
        assert_same(&pasted, &view, within, &text);
    }
}

#[test]
fn plane_figures_are_copied_too() {
    let mut camera = plane();
    camera.pan([0.123, 0.456], None, ASPECT);
    zoom_at(&mut camera, 0.0321, [0.2, 0.7]);
    let text = camera.text(None);
    let pasted = view_in(&format!("{text}\ncircle(1)"));
    assert_near(pasted.look, camera.view().look, 1e-4 * 0.16, &text);
    assert_eq!(pasted.up, camera.view().up);
}

#[test]
fn copied_numbers_are_short() {
    let given = View {
        from: [3.4, 2.6, 4.2],
        look: [0.1, -0.2, 0.0],
        up: [0.0, 1.0, 0.0],
        lens: Lens::Perspective(36_f64.to_radians()),
    };
    let camera = Camera::new(given, false, false);
    assert_eq!(
        camera.text(Some("hero")),
        "camera hero { from: [3.4, 2.6, 4.2], look: [0.1, -0.2, 0], fov: 36deg }"
    );
    let mut camera = Camera::new(
        view([92.0, -118.0, 96.0], Lens::Orthographic(1.0 / 3.0)),
        true,
        false,
    );
    camera.face(Side::Top);
    camera.focus([-1e-9, 2.0 / 3.0, 1000.0]);
    assert_eq!(
        camera.text(None),
        "camera { from: [0, 0.66667, 1178.22545], look: [0, 0.66667, 1000], height: 0.33333 }"
    );
    camera.face(Side::Bottom);
    assert!(
        camera.text(None).contains("up: [0, -1, 0]"),
        "{}",
        camera.text(None)
    );
}
