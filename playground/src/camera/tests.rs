use super::*;
use sdfc_compiler::elaborate::NoFiles;
use sdfc_compiler::open::{Request, SceneFile, open};
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::settings::{Overrides, resolve};
use std::path::Path;

const ASPECT: f64 = 1.6;
const NDC_POINTS: [Ndc; 4] = [[0.0, 0.0], [0.7, -0.4], [-0.95, 0.9], [0.1, 0.6]];

fn view(from: [f64; 3], lens: ResolvedLens) -> View {
    View {
        from,
        look: [0.5, 0.25, -1.0],
        up: [0.0, 1.0, 0.0],
        lens,
    }
}

/// Returns cameras of both lenses: one upright, one tilted, and one that looks straight down.
fn cameras() -> Vec<OrbitCamera> {
    let lenses = [
        ResolvedLens::Perspective(0.7),
        ResolvedLens::Orthographic(3.0),
    ];
    let views = lenses.into_iter().flat_map(|lens| {
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
    views
        .map(|view| OrbitCamera::new(view, false, false))
        .collect()
}

fn plane() -> OrbitCamera {
    OrbitCamera::new(View::plane([3.0, -2.0], 5.0), false, true)
}

fn assert_near(a: [f64; 3], b: [f64; 3], tolerance: f64, label: &str) {
    let distance = DVec3::from(a).distance(b.into());
    assert!(
        distance <= tolerance,
        "{label}: {a:?} and {b:?} are {distance:e} apart"
    );
}

/// Asserts that two views have the same directions, lens and positions.
fn assert_same(a: &View, b: &View, tolerance: f64, label: &str) {
    assert_near(a.from, b.from, tolerance, label);
    assert_near(a.look, b.look, tolerance, label);
    let ([a_basis, b_basis], size) = ([a, b].map(Basis::from_view), tolerance.max(1e-12));
    assert_near(a_basis.right.into(), b_basis.right.into(), size, label);
    assert_near(a_basis.up.into(), b_basis.up.into(), size, label);
    match (a.lens, b.lens) {
        (ResolvedLens::Perspective(a), ResolvedLens::Perspective(b))
        | (ResolvedLens::Orthographic(a), ResolvedLens::Orthographic(b)) => {
            assert!((a - b).abs() <= 1e-4 * a, "{label}: {a} and {b}");
        }
        (a, b) => panic!("{label}: {a:?} and {b:?}"),
    }
}

#[test]
fn a_view_stays_the_very_same_until_it_is_moved() {
    for camera in cameras() {
        assert_eq!(
            OrbitCamera::new(camera.view(), true, false).view(),
            camera.view()
        );
    }
}

#[test]
fn the_point_under_a_pixel_is_visible_there() {
    for camera in cameras().into_iter().chain([plane()]) {
        for ndc in NDC_POINTS {
            for depth in [None, Some(0.3), Some(20.0), Some(f64::INFINITY)] {
                let point = camera.point_under(ndc, depth, ASPECT);
                let projected = camera.project(point, ASPECT).expect("it is in front");
                assert!((projected[0] - ndc[0]).abs() + (projected[1] - ndc[1]).abs() < 1e-9);
            }
        }
    }
    let camera = &cameras()[0];
    let behind = camera.point_under([0.0, 0.0], Some(-1.0), ASPECT);
    assert_eq!(camera.project(behind, ASPECT), None);
    // A depth along a slanted ray is larger than the depth along the view axis.
    let point = camera.point_under([1.0, 1.0], Some(2.0), ASPECT);
    let offset = DVec3::from(point) - DVec3::from(camera.view().from);
    assert!((offset.length() - 2.0).abs() < 1e-12);
}

#[test]
fn orbits_keep_the_distance_and_the_target() {
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
        let previous = camera.view();
        for _ in 0..36 {
            camera.orbit(PI / 18.0, 0.0);
        }
        assert_same(&camera.view(), &previous, 1e-9, "once around");
    }
}

#[test]
fn orbits_place_the_camera_by_their_angles() {
    let mut camera = OrbitCamera::new(
        view([0.5, 0.25, 4.0], ResolvedLens::Perspective(0.7)),
        false,
        false,
    );
    camera.orbit(FRAC_PI_2, 0.0);
    assert_near(camera.view().from, [5.5, 0.25, -1.0], 1e-9, "to the right");
    camera.orbit(0.0, 0.5);
    let height = 0.25 + 5.0 * 0.5_f64.sin();
    let expected_depth = 0.5 + 5.0 * 0.5_f64.cos();
    assert_near(
        camera.view().from,
        [expected_depth, height, -1.0],
        1e-9,
        "up",
    );
}

#[test]
fn nothing_flips_at_the_poles() {
    for mut camera in cameras() {
        camera.orbit(0.2, 0.0);
        let right = Basis::from_view(&camera.view()).right;
        for step in [0.1, -0.1] {
            for _ in 0..60 {
                camera.orbit(0.0, step);
                let now = Basis::from_view(&camera.view());
                assert_near(now.right.into(), right.into(), 1e-9, "the right");
                assert!(now.up.dot(camera.axis) >= -1e-9, "it stands on its head");
            }
            let back = Basis::from_view(&camera.view()).back;
            assert!((back.dot(camera.axis) - step.signum()).abs() < 1e-9);
        }
        // At the pole the azimuth still changes by the full angle.
        camera.orbit(0.5, 0.0);
        let now = Basis::from_view(&camera.view()).right;
        assert!((now.dot(right) - 0.5_f64.cos()).abs() < 1e-9);
    }
}

#[test]
fn an_upside_down_view_stays_upside_down() {
    let initial = View {
        up: [0.0, -1.0, 0.0],
        ..view([4.0, 1.0, 3.0], ResolvedLens::Perspective(0.7))
    };
    let mut camera = OrbitCamera::new(initial, false, false);
    camera.orbit(1e-9, 0.0);
    assert_same(&camera.view(), &initial, 1e-6, "hardly moved");
}

#[test]
fn the_point_under_the_cursor_stays_there_when_zooming() {
    for camera in cameras().into_iter().chain([plane()]) {
        for ndc in NDC_POINTS {
            for depth in [None, Some(2.0), Some(30.0)] {
                for factor in [0.5, 0.9, 1.1, 3.0] {
                    let mut camera = camera.clone();
                    let previous = camera.view();
                    let point = camera.point_under(ndc, depth, ASPECT);
                    camera.zoom(factor, point);
                    let projected = camera.project(point, ASPECT).expect("it is in front");
                    let error = (projected[0] - ndc[0]).hypot(projected[1] - ndc[1]);
                    assert!(
                        error < 1e-9,
                        "{previous:?} {ndc:?} {depth:?} {factor}: {error:e}"
                    );
                    let grown = match (previous.lens, camera.view().lens) {
                        (ResolvedLens::Orthographic(a), ResolvedLens::Orthographic(b)) => b / a,
                        _ => {
                            let distance_from =
                                |from: [f64; 3]| DVec3::from(point).distance(from.into());
                            distance_from(camera.view().from) / distance_from(previous.from)
                        }
                    };
                    assert!((grown - factor).abs() < 1e-9, "{grown} for {factor}");
                }
            }
        }
    }
}

/// Zooms to the point under an NDC position, at the depth of the look-at point.
fn zoom_at(camera: &mut OrbitCamera, factor: f64, ndc: Ndc) {
    let point = camera.point_under(ndc, None, ASPECT);
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
            let projected = camera.project(held, ASPECT).expect("it is in front");
            let error = (projected[0] + 0.2).hypot(projected[1] - 0.45);
            assert!(error < 1e-9, "{projected:?}");
            assert!((camera.distance() - distance).abs() < 1e-9);
        }
    }
}

#[test]
fn a_point_in_focus_comes_to_the_middle() {
    for mut camera in cameras() {
        let back = Basis::from_view(&camera.view()).back;
        camera.focus([3.0, -1.0, 2.0]);
        let [x, y] = camera.project([3.0, -1.0, 2.0], ASPECT).expect("seen");
        assert!(x.hypot(y) < 1e-12, "{x} {y}");
        assert_near(
            Basis::from_view(&camera.view()).back.into(),
            back.into(),
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
        let back = Basis::from_view(&camera.view()).back;
        for aspect in [0.4, 1.0, 2.5] {
            camera.fit(&bounds, aspect);
            let mut edge = 0.0_f64;
            for corner in bounds.corners() {
                let [x, y] = camera.project(corner, aspect).expect("it is in front");
                edge = edge.max(x.abs()).max(y.abs());
            }
            assert!((0.6..=1.0).contains(&edge), "{edge}");
            assert_near(
                Basis::from_view(&camera.view()).back.into(),
                back.into(),
                1e-9,
                "it turned",
            );
        }
    }
    let mut camera = plane();
    camera.fit(&bounds, 0.5);
    let width = 4.0 / camera.project([3.0, 0.25, 0.0], 0.5).expect("seen")[0];
    assert!((4.0..4.5).contains(&width), "{width}");
}

#[test]
fn view_keys_look_along_the_axes_of_both_kinds_of_scene() {
    let sides = [
        (ViewSide::Front, [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]),
        (ViewSide::Back, [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]),
        (ViewSide::Left, [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        (ViewSide::Right, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        (ViewSide::Top, [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]),
        (ViewSide::Bottom, [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]),
        (
            ViewSide::Corner,
            [1.0; 3].map(|v: f64| v / 3.0_f64.sqrt()),
            [-1.0, 2.0, -1.0].map(|v: f64| v / 6.0_f64.sqrt()),
        ),
    ];
    for mut camera in cameras() {
        let (distance, look) = (camera.distance(), camera.view().look);
        for (side, back, up) in sides {
            camera.view_from(side);
            let basis = Basis::from_view(&camera.view());
            assert_near(basis.back.into(), back, 1e-9, &format!("{side:?}"));
            assert_near(basis.up.into(), up, 1e-9, &format!("{side:?}"));
            assert!((camera.distance() - distance).abs() < 1e-9);
            assert_eq!(camera.view().look, look);
            // With z up, everything is rotated by a right angle around x.
            let mut other = OrbitCamera::new(camera.view(), true, false);
            other.view_from(side);
            let basis = Basis::from_view(&other.view());
            let lying = |[x, y, z]: [f64; 3]| [x, -z, y];
            assert_near(
                basis.back.into(),
                lying(back),
                1e-9,
                &format!("{side:?}, z up"),
            );
            assert_near(basis.up.into(), lying(up), 1e-9, &format!("{side:?}, z up"));
        }
    }
}

#[test]
fn the_other_lens_keeps_the_size_of_what_is_in_focus() {
    let bounds = Bounds::centred([10.0; 3]);
    for mut camera in cameras() {
        let look = DVec3::from(camera.view().look);
        let side_point = (look + Basis::from_view(&camera.view()).right * 0.4).to_array();
        let previous = camera.project(side_point, ASPECT).expect("seen");
        let (lens, distance) = (camera.is_orthographic(), camera.distance());
        camera.toggle_lens(&bounds);
        assert_ne!(camera.is_orthographic(), lens);
        let after = camera.project(side_point, ASPECT).expect("seen");
        assert!(
            (previous[0] - after[0]).abs() < 1e-9,
            "{previous:?} {after:?}"
        );
        if !lens {
            for corner in bounds.corners() {
                let ahead = (DVec3::from(corner) - DVec3::from(camera.view().from))
                    .dot(-Basis::from_view(&camera.view()).back);
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
    camera.toggle_lens(&Bounds::ALL_SPACE);
    assert!(camera.distance().is_finite());
}

#[test]
fn views_of_2d_shapes_only_pan_and_zoom() {
    let mut camera = plane();
    let previous = camera.view();
    camera.orbit(0.5, 0.5);
    camera.view_from(ViewSide::Corner);
    camera.toggle_lens(&Bounds::centred([1.0; 3]));
    assert_eq!(camera.view(), previous);
    camera.pan([0.5, 0.5], None, ASPECT);
    zoom_at(&mut camera, 0.5, [0.2, 0.1]);
    assert_ne!(camera.view(), previous);
    assert_eq!(camera.view().from[..2], camera.view().look[..2]);
}

/// Returns the view of a scene's only camera.
fn view_in(scene: &str) -> View {
    let request = Request {
        path: Path::new("scene.sdf"),
        overrides: Vec::new(),
        time: 0.0,
        part: None,
        passes: PassOptions::default(),
        emit_guards: false,
        lod_target: None,
        needs_subject: false,
        loader: &NoFiles,
    };
    let outcome = open(SceneFile::Text(scene.to_owned()), &request).expect("a scene");
    let opened = outcome
        .value
        .unwrap_or_else(|| panic!("{scene}\n{:?}", outcome.diagnostics));
    let overrides = Overrides::default();
    let settings = resolve(&opened.compiled.module, &opened.uniform_values, &overrides);
    settings.expect("settings").view
}

#[test]
fn a_camera_pasted_into_a_scene_gives_its_view() {
    let mut cases = Vec::new();
    for z_up in [false, true] {
        for camera in cameras() {
            let mut camera = OrbitCamera::new(camera.view(), z_up, false);
            cases.push((z_up, camera.clone()));
            for (right, up) in [(0.3, 0.2), (2.0, -0.4), (0.1, 3.0), (0.0, -7.0)] {
                camera.orbit(right, up);
                cases.push((z_up, camera.clone()));
            }
            for side in [
                ViewSide::Front,
                ViewSide::Top,
                ViewSide::Bottom,
                ViewSide::Corner,
            ] {
                camera.view_from(side);
                cases.push((z_up, camera.clone()));
                let mut near = camera.clone();
                near.orbit(0.4, 0.0);
                zoom_at(&mut near, 1e-3, [0.3, 0.2]);
                cases.push((z_up, near));
                let mut distance = camera.clone();
                zoom_at(&mut distance, 700.0, [0.3, 0.2]);
                cases.push((z_up, distance));
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
            ResolvedLens::Perspective(fov) => 2.0 * camera.distance() * (fov / 2.0).tan(),
            ResolvedLens::Orthographic(height) => height,
        };
        let pasted = view_in(&scene);
        let error = DVec3::from(pasted.look).distance(view.look.into());
        assert!(error < 1e-4 * height, "{text}: {error}");
        let tolerance = 1e-4 * height.max(1.0);
        assert_same(&pasted, &view, tolerance, &text);
    }
}

#[test]
fn cameras_of_2d_shapes_are_copied_too() {
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
    let initial = View {
        from: [3.4, 2.6, 4.2],
        look: [0.1, -0.2, 0.0],
        up: [0.0, 1.0, 0.0],
        lens: ResolvedLens::Perspective(36_f64.to_radians()),
    };
    let camera = OrbitCamera::new(initial, false, false);
    assert_eq!(
        camera.text(Some("hero")),
        "camera hero { from: [3.4, 2.6, 4.2], look: [0.1, -0.2, 0], fov: 36deg }"
    );
    let mut camera = OrbitCamera::new(
        view([92.0, -118.0, 96.0], ResolvedLens::Orthographic(1.0 / 3.0)),
        true,
        false,
    );
    camera.view_from(ViewSide::Top);
    camera.focus([-1e-9, 2.0 / 3.0, 1000.0]);
    assert_eq!(
        camera.text(None),
        "camera { from: [0, 0.66667, 1178.22545], look: [0, 0.66667, 1000], height: 0.33333 }"
    );
    camera.view_from(ViewSide::Bottom);
    assert!(
        camera.text(None).contains("up: [0, -1, 0]"),
        "{}",
        camera.text(None)
    );
}
