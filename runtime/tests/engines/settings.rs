//! Resolution of a scene's settings to numbers, and errors in settings.

use crate::scenes::{constants, module};
use sdfc_runtime::render::{LightEmitter, Mode, ResolvedLens, ResolvedShadow};
use sdfc_runtime::settings::{Overrides, SettingsError, field_facts, resolve};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::program::Module;
use sdfc_vm::settings::{self as scene, Check, SettingValue};

fn sphere_module() -> Module {
    module("sphere [0.8]", None)
}

fn refused(module: &Module, uniform_values: &[f64], overrides: &Overrides) -> String {
    match resolve(module, uniform_values, overrides) {
        Ok(settings) => panic!("nothing is wrong with {settings:?}"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn numbers_come_from_the_scene_unless_they_are_overridden() {
    let mut module = sphere_module();
    module.settings.lights[0].intensity = SettingValue::Uniform(1);
    module.settings.cameras[0].from[2] = SettingValue::Uniform(0);
    let settings = resolve(&module, &[7.0, 3.0], &Overrides::default()).expect("all is well");
    assert_eq!(settings.view.from, [2.5, 2.0, 7.0]);
    assert_eq!(settings.view.lens, ResolvedLens::Perspective(0.7));
    assert_eq!(settings.size, [48, 32]);
    let light = settings.lighting.lights[0];
    assert_eq!(light.color, [3.0, 3.0 * 0.95, 3.0 * 0.9]);
    assert_eq!(light.source, LightEmitter::Directional([0.6, 1.0, 0.5]));
    assert_eq!(light.shadow, ResolvedShadow::Soft(0.05));
    assert!(
        settings.far > 8.0 && settings.far < 20.0,
        "past the bounds: {}",
        settings.far
    );
    assert!(
        field_facts(&module, &[7.0, 3.0])
            .material
            .is_some_and(|m| m.id == 3.0)
    );

    let overrides = Overrides {
        size: Some([10, 20]),
        aa: Some(3),
        mode: Mode::Depth,
        steps: Some(9),
        far: Some(5.0),
        exposure: Some(2.0),
        ..Overrides::default()
    };
    let settings = resolve(&module, &[7.0, 3.0], &overrides).expect("all is well");
    assert_eq!(
        (settings.size, settings.aa, settings.mode),
        ([10, 20], 3, Mode::Depth)
    );
    assert_eq!(
        (settings.steps, settings.far, settings.exposure),
        (9, 5.0, 2.0)
    );
}

#[test]
fn cameras_are_found_by_name() {
    let mut module = sphere_module();
    let mut hero = module.settings.cameras[0].clone();
    hero.name = "hero".to_owned();
    hero.look = constants([0.0, 0.5, 0.0]);
    module.settings.cameras.push(hero);
    let named = |name: &str| Overrides {
        camera: Some(name.to_owned()),
        ..Overrides::default()
    };
    let settings = resolve(&module, &[], &named("hero")).expect("it is there");
    assert_eq!(settings.view.look, [0.0, 0.5, 0.0]);
    assert_eq!(
        refused(&module, &[], &named("heroo")),
        "there is no camera `heroo`, only `front`, `hero`; did you mean `hero`?"
    );
    assert_eq!(
        refused(&module, &[], &named("bird")),
        "there is no camera `bird`, only `front`, `hero`"
    );
    module.settings.cameras.truncate(1);
    module.settings.cameras[0].name.clear();
    assert_eq!(
        refused(&module, &[], &named("hero")),
        "there is no camera `hero`, the scene's only camera has no name"
    );
}

#[test]
fn impossible_settings_are_reported_with_their_limits() {
    let module = sphere_module();
    let size = |size| Overrides {
        size: Some(size),
        ..Overrides::default()
    };
    assert_eq!(
        refused(&module, &[], &size([0, 5])),
        "the width of the picture is 0, 1 to 16384 is allowed"
    );
    assert_eq!(
        refused(&module, &[], &size([16_384, 16_384])),
        "the number of pixels is 268435456, at most 67108864 is allowed"
    );
    let aa = Overrides {
        aa: Some(17),
        ..Overrides::default()
    };
    assert_eq!(
        refused(&module, &[], &aa),
        "the samples per side of a pixel is 17, 1 to 16 is allowed"
    );
    let far = Overrides {
        far: Some(-1.0),
        ..Overrides::default()
    };
    assert_eq!(
        refused(&module, &[], &far),
        "the range of a ray is -1, more than 0 is allowed"
    );
    for (exposure, written) in [(-1.0, "-1"), (f64::NAN, "NaN"), (f64::INFINITY, "inf")] {
        let overrides = Overrides {
            exposure: Some(exposure),
            ..Overrides::default()
        };
        assert_eq!(
            refused(&module, &[], &overrides),
            format!("the exposure is {written}, 0 or more is allowed")
        );
    }

    let mut module = sphere_module();
    module.settings.cameras[0].from[0] = SettingValue::Uniform(0);
    assert_eq!(
        refused(&module, &[f64::NAN], &Overrides::default()),
        "the place of the camera `front` is NaN, a finite number is needed"
    );
    module.settings.cameras[0].from = module.settings.cameras[0].look;
    assert_eq!(
        refused(&module, &[], &Overrides::default()),
        "the camera `front` is at the point it looks at"
    );
    module.settings.cameras[0].lens = scene::Lens::Perspective(SettingValue::Constant(4.0));
    assert_eq!(
        refused(&module, &[], &Overrides::default()),
        "the field of view of the camera `front` is 4, less than a half turn (3.14 radians) is allowed"
    );
}

#[test]
fn conditions_of_the_scene_are_held() {
    let mut module = sphere_module();
    let check = |strict| Check {
        value: SettingValue::Uniform(0),
        strict,
        message: "the radius must be more than 0".to_owned(),
    };
    module.settings.checks = vec![check(true)];
    let resolve_with =
        |module: &Module, value: f64| resolve(module, &[value], &Overrides::default());
    let failed = SettingsError::Check("the radius must be more than 0".to_owned());
    assert!(resolve_with(&module, 0.1).is_ok());
    assert_eq!(resolve_with(&module, 0.0), Err(failed.clone()));
    assert_eq!(resolve_with(&module, f64::NAN), Err(failed.clone()));
    module.settings.checks = vec![check(false)];
    assert!(resolve_with(&module, 0.0).is_ok());
    assert_eq!(resolve_with(&module, -0.1), Err(failed));
}

#[test]
fn a_2d_shape_is_framed_face_on_and_completely() {
    let mut module = module("circle [0.8]", None);
    module.settings.is_2d = true;
    module.settings.bounds = Bounds {
        min: [1.0, -1.0, 0.0],
        max: [7.0, 1.0, 0.0],
    };
    let settings = resolve(&module, &[], &Overrides::default()).expect("all is well");
    assert_eq!(settings.view.look, [4.0, 0.0, 0.0]);
    let ResolvedLens::Orthographic(height) = settings.view.lens else {
        panic!("it is seen flat")
    };
    // 48 × 32 pixels: the width of 6 decides, plus a margin.
    assert!((4.0..4.5).contains(&height), "{height}");
    assert_eq!(settings.view.from[..2], [4.0, 0.0]);

    module.settings.cameras[0].lens = scene::Lens::Orthographic(SettingValue::Constant(2.0));
    module.settings.cameras[0].look = constants([3.0, 0.5, 0.0]);
    let settings = resolve(&module, &[], &Overrides::default()).expect("all is well");
    assert_eq!(settings.view.look, [3.0, 0.5, 0.0]);
    assert_eq!(settings.view.lens, ResolvedLens::Orthographic(2.0));
}
