//! Equal images and equal values on every engine.

use crate::scenes::{
    EVERYTHING, PAINTED, constants, cpu, drawn, drawn_as, gpu, interp, loaded, module, module_of,
    program, with_params,
};
use sdfc_runtime::comparison::compare_engines;
use sdfc_runtime::engine::{Engine, EngineKind, SceneInput, open_on};
use sdfc_runtime::render::{
    CellMode, Mode, Normals, Occlusion, RenderSettings, ResolvedLens, View,
};
use sdfc_runtime::settings::Overrides;
use sdfc_shaders::assemble::SceneSource;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::evaluate_f64;
use sdfc_vm::program::Module;
use sdfc_vm::settings::{Light, LightSource, SettingValue, Shadow};
use sdfc_vm::table::Op;
use sdfc_vm::wgsl_library::WgslLibrary;

/// Verifies a module on the CPU and the interpreter, and that the image is not empty.
fn agree(module: &mut Module, overrides: &Overrides) {
    let Some(interp) = interp() else { return };
    let uniform_values = module.update(0.0);
    let settings = drawn_as(module, &uniform_values, overrides);
    let mut engines = [cpu(), interp];
    let report = compare_engines(&loaded(module, &uniform_values), &mut engines, &settings)
        .expect("both engines run");
    assert!(report.passed(), "{report}");
    let [a, b] = [&report.images[0], &report.images[1]];
    assert!(a.stats.hits > 100 && a.stats.misses > 100, "{:?}", a.stats);
    let close = |a: u64, b: u64| a.abs_diff(b) <= 2 + a / 500;
    assert!(
        close(a.stats.evaluations, b.stats.evaluations),
        "{:?} {:?}",
        a.stats,
        b.stats
    );
    assert_eq!(a.stats.rays(), b.stats.rays());
    assert!(
        close(a.stats.at_far, b.stats.at_far),
        "{:?} {:?}",
        a.stats,
        b.stats
    );
    let ids = a.id.iter().zip(&b.id).filter(|(a, b)| a != b).count();
    assert!(ids <= 4, "{ids} pixels have another material");
}

#[test]
fn everything_a_program_can_do() {
    agree(&mut module(EVERYTHING, None), &Overrides::default());
}

/// Compares the renders of a module by the CPU and the interpreter. Returns the number of pixels that show a
/// surface.
fn compare_renders(module: &Module, view: View, occlusion: Occlusion) -> u64 {
    let Some(interp) = interp() else { return 0 };
    let overrides = Overrides {
        view: Some(view),
        occlusion: Some(occlusion),
        ..Overrides::default()
    };
    let settings = drawn_as(module, &[], &overrides);
    let mut engines = [cpu(), interp];
    let report =
        compare_engines(&loaded(module, &[]), &mut engines, &settings).expect("both engines run");
    assert!(report.passed(), "{report}");
    let [a, b] = [&report.images[0], &report.images[1]];
    assert_eq!(a.stats.hits, b.stats.hits, "{report}");
    a.stats.hits + a.stats.inside
}

fn view(from: [f64; 3], look: [f64; 3], lens: ResolvedLens) -> View {
    View {
        from,
        look,
        up: [0.0, 1.0, 0.0],
        lens,
    }
}

/// Cameras inside a sphere, inside a box, and inside the wall of a hollow solid.
#[test]
fn from_inside_of_solids() {
    for (listing, from) in [
        ("sphere [0.8]", [0.1, 0.2, -0.1]),
        ("cuboid [0.5, 0.4, 0.3]", [0.3, -0.1, 0.1]),
        ("sphere [0.8]\nabs\nsub  right [0.2]", [0.75, 0.1, 0.0]),
    ] {
        let module = module(listing, None);
        let from_inside = view(from, [0.0; 3], ResolvedLens::Perspective(1.2));
        let hits = compare_renders(&module, from_inside, Occlusion::Off);
        assert!(hits > 1000 || interp().is_none(), "{listing}: {hits} hits");
    }
}

/// Point lights between a surface and a wall behind them, one close to the wall: shadow rays end at the light.
#[test]
fn walls_behind_lights_cast_no_shadow() {
    let mut scene = module(
        "cuboid [1.5, 0.1, 1.5]  moved [0.0, 1.0, 0.0]
        cuboid [1.5, 1.5, 0.1]  moved [0.0, 0.0, 1.0]  blend hard [1.0, 1.0, 0.0, 0.0]",
        None,
    );
    let size = SettingValue::Constant(0.3);
    for shadow in [
        Shadow::Plain(size),
        Shadow::Soft(size),
        Shadow::Sized(size),
        Shadow::Hard,
    ] {
        for z in [-0.8, -0.89] {
            scene.settings.lights[0].source = LightSource::Point(constants([0.1, 0.2, z]));
            scene.settings.lights[0].shadow = shadow;
            let front = view(
                [0.5, 1.5, 4.0],
                [0.0, -0.5, 0.0],
                ResolvedLens::Perspective(0.7),
            );
            compare_renders(&scene, front, Occlusion::Off);
        }
    }
}

/// A plane so far away that rounding is as large as the radius of occlusion.
#[test]
fn far_planes_are_open_on_every_engine() {
    let mut scene = module("plane [0.0, 1.0, 0.0, 0.0]", None);
    let endless = Bounds::centred([f64::INFINITY; 3]);
    (scene.settings.bounds, scene.settings.bounds_for_all_params) = (endless, endless);
    scene.settings.current_bounds.bounds = endless;
    scene.settings.render.occlusion_reach = Some(0.05);
    scene.settings.lights.clear();
    let far = view([0.0, 3e4, 3e4], [0.0; 3], ResolvedLens::Perspective(1e-4));
    for occlusion in [Occlusion::FiveTap, Occlusion::Multi(9)] {
        compare_renders(&scene, far, occlusion);
    }
}

#[test]
fn plain_steps_are_the_same_on_every_engine() {
    let module = module(EVERYTHING, None);
    let relaxed = drawn(&module, &[]);
    let plain = RenderSettings {
        relaxation: 0.0,
        cells: CellMode::Never,
        ..relaxed.clone()
    };
    let mut engine = cpu();
    engine.load(&loaded(&module, &[])).expect("it loads");
    let mut draw = |settings| engine.render(settings, &|_| {}).expect("it draws");
    let total = |steps: &[u32]| steps.iter().sum::<u32>();
    let (image, with_relaxation) = (draw(&plain), draw(&relaxed));
    assert!(
        total(&image.steps) > total(&with_relaxation.steps),
        "plain steps are more"
    );
    let Some(interp) = interp() else { return };
    let mut engines = [cpu(), interp];
    let report =
        compare_engines(&loaded(&module, &[]), &mut engines, &plain).expect("both engines run");
    assert!(report.passed(), "{report}");
    let [cpu, interp] = [&report.images[0], &report.images[1]];
    assert_eq!(cpu.steps, image.steps);
    let differ = cpu.steps.iter().zip(&interp.steps).filter(|(a, b)| a != b);
    assert!(differ.count() <= cpu.steps.len() / 100, "{report}");
}

#[test]
fn materials_that_mix_and_follow_the_point() {
    let mut painted = module(&distance_listing(PAINTED), Some(PAINTED));
    agree(&mut painted, &Overrides::default());
}

/// A surface listing without the instructions for surfaces.
fn distance_listing(listing: &str) -> String {
    // Channels are computed from `point` on; the instructions that prepare them are removed too.
    let mut kept: Vec<&str> = Vec::new();
    for line in listing.lines() {
        let name = line.trim().split(' ').next().unwrap_or_default();
        match name {
            "paint" | "normal" | "x" | "y" | "mul" | "fract" | "sin" | "abs" | "channel" => {}
            _ => kept.push(line),
        }
    }
    kept.join("\n")
}

#[test]
fn lights_of_every_kind() {
    let mut scene = module(EVERYTHING, None);
    let light = scene.settings.lights[0].clone();
    let with = |source, shadow| Light {
        name: String::new(),
        source,
        shadow,
        intensity: SettingValue::Constant(0.8),
        ..light.clone()
    };
    let nearby_light = LightSource::Point(constants([1.5, 2.5, 1.0]));
    let far = LightSource::Directional(constants([-1.0, 1.0, 0.2]));
    let size = SettingValue::Constant(0.1);
    scene.settings.lights = vec![
        with(nearby_light, Shadow::Hard),
        with(far, Shadow::Plain(size)),
        with(nearby_light, Shadow::Soft(size)),
        with(far, Shadow::Sized(size)),
        with(nearby_light, Shadow::None),
    ];
    scene.settings.sky.fog = Some(SettingValue::Constant(0.05));
    let overrides = Overrides {
        occlusion: Some(Occlusion::Multi(9)),
        aa: Some(2),
        ..Overrides::default()
    };
    agree(&mut scene, &overrides);
}

#[test]
fn every_mode_and_every_way_to_find_normals() {
    let Some(mut interp) = interp() else { return };
    let mut cpu = cpu();
    let mut scene = module(&distance_listing(PAINTED), Some(PAINTED));
    let uniform_values = scene.update(0.0);
    for engine in [&mut cpu, &mut interp] {
        engine
            .load(&loaded(&scene, &uniform_values))
            .expect("it loads");
    }
    let modes = [
        Mode::Albedo,
        Mode::Normal,
        Mode::Depth,
        Mode::Steps,
        Mode::Distance,
        Mode::Id,
        Mode::Mask,
        Mode::Edges,
    ];
    let variants = [
        Normals::Forward,
        Normals::Central,
        Normals::Reverse,
        Normals::Tetrahedron,
        Normals::Wide,
    ];
    let modes = modes.map(|mode| Overrides {
        mode,
        ..Overrides::default()
    });
    let variants = variants.map(|variant| Overrides {
        mode: Mode::Normal,
        normals: Some(variant),
        ..Overrides::default()
    });
    for overrides in modes.iter().chain(&variants) {
        let settings = drawn_as(&scene, &uniform_values, overrides);
        let [a, b] = [&mut cpu, &mut interp].map(|engine| {
            engine
                .render(&settings, &|_| {})
                .expect("it renders")
                .rgba8()
        });
        let differs = |(a, b): (&u8, &u8)| a.abs_diff(*b) > 4;
        let differing = a.iter().zip(&b).filter(|pair| differs(*pair)).count();
        assert!(differing <= 24, "{overrides:?}: {differing} bytes differ");
        assert!(
            a.chunks(4).any(|pixel| pixel != &a[..4]),
            "{overrides:?} shows something"
        );
    }
}

#[test]
fn shapes_in_the_plane() {
    let mut scene = module(
        "circle [0.8]
         rect [0.5, 0.3]  moved [-0.7, -0.4, 0.0]  blend quadratic [1.0, 1.0, 0.3, 0.8333333]",
        Some(
            "circle [0.8]
             paint #0 [0.9, 0.1, 0.1, 0.3, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
             rect [0.5, 0.3]  moved [-0.7, -0.4, 0.0]
             paint #0 [0.1, 0.8, 0.1, 0.3, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0]
             take  blend quadratic [1.0, 1.0, 0.3, 0.8333333]",
        ),
    );
    scene.settings.is_2d = true;
    scene.settings.bounds = Bounds {
        min: [-0.8, -0.8, 0.0],
        max: [1.2, 0.8, 0.0],
    };
    agree(&mut scene, &Overrides::default());
    agree(
        &mut scene,
        &Overrides {
            mode: Mode::Distance,
            ..Overrides::default()
        },
    );
}

#[test]
fn generated_source_with_parameters_and_materials() {
    let Some(gpu) = gpu() else { return };
    let mut scene = module(
        "sphere [0.8@u0]
         cuboid [0.5, 0.4, 0.3]  moved [-0.9, 0.2@u1, 0.0]  blend hard [1.0, 1.0, 0.0, 0.0]",
        Some(
            "sphere [0.8@u0]
             cuboid [0.5, 0.4, 0.3]  moved [-0.9, 0.2@u1, 0.0]
             paint #0 [0.9, 0.1@u4, 0.1, 0.3, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
             take  blend hard [1.0, 1.0, 0.0, 0.0]",
        ),
    );
    with_params(&mut scene, 5);
    let numbers = [0.9, 0.4, 0.0, 0.0, 0.5];
    let uniform_values = scene.uniforms.run(&numbers, 0.0);
    let narrow: Vec<f32> = uniform_values.iter().map(|&v| v as f32).collect();
    scene.distance.patch(&narrow);
    scene
        .surface
        .as_mut()
        .expect("it is painted")
        .patch(&narrow);

    let mut library = WgslLibrary::default();
    for op in [Op::Sphere, Op::Cuboid] {
        library.use_value(op);
        library.use_gradient(op);
    }
    let (called, calls) = library.text();
    let text = format!(
        "{called}
fn scene_distance(p: vec3f) -> f32 {{
    let a = sdf_sphere(p, uniforms[0][0]);
    let b = sdf_cuboid(p + vec3f(-0.9, uniforms[0][1], 0.0), vec3f(0.5, 0.4, 0.3));
    return min(a, b);
}}
fn scene_gradient(p: vec3f) -> vec4f {{
    let x = vec3f(1.0, 0.0, 0.0);
    let y = vec3f(0.0, 1.0, 0.0);
    let z = vec3f(0.0, 0.0, 1.0);
    let a = sdf_sphere_gradient(DualPoint(p, x, y, z), uniforms[0][0]);
    let q = p + vec3f(-0.9, uniforms[0][1], 0.0);
    let b = sdf_cuboid_gradient(DualPoint(q, x, y, z), vec3f(0.5, 0.4, 0.3));
    return select(b, a, a.w < b.w);
}}
fn scene_surface(p: vec3f, n: vec3f) -> Surface {{
    let a = sdf_sphere(p, uniforms[0][0]);
    let b = sdf_cuboid(p + vec3f(-0.9, uniforms[0][1], 0.0), vec3f(0.5, 0.4, 0.3));
    if a < b {{ return unpainted_surface(); }}
    return Surface(vec3f(0.9, uniforms[1][0], 0.1), 0.3, vec3f(0.0), 0.0, vec3f(0.0), 1.0);
}}
"
    );
    let loaded = SceneInput {
        module: &scene,
        uniform_values: &uniform_values,
        generated: SceneSource {
            text: &text,
            calls: &calls,
        },
    };
    let mut engines = [cpu(), open_on(EngineKind::Wgsl, gpu)];
    let settings = drawn(&scene, &uniform_values);
    let report = compare_engines(&loaded, &mut engines, &settings).expect("both engines run");
    assert!(report.passed(), "{report}");
    assert!(report.images[0].id.contains(&1) && report.images[0].id.contains(&3));
}

/// A row of spheres that rays nearly graze, so that they take many steps.
fn long_program(count: usize) -> String {
    let ball = |i: usize| {
        let (x, y, z) = (i % 10, i / 10 % 10, i / 100);
        let position = |n: usize, count: usize| 1.8 - 3.6 * (n as f64 + 0.5) / count as f64;
        let rows = count.div_ceil(100);
        let blend = if i > 0 {
            "  blend hard [1.0, 1.0, 0.0, 0.0]"
        } else {
            ""
        };
        format!(
            "sphere [0.06]  moved [{}, {}, {}]{blend}",
            position(x, 10) as f32,
            position(y, 10) as f32,
            position(z, rows) as f32
        )
    };
    (0..count).map(ball).collect::<Vec<_>>().join("\n")
}

#[test]
fn a_march_longer_than_any_loop_may_be() {
    // 1,500 instructions and rays of up to a hundred steps or more. A single loop over all steps would exceed
    // the 65,535 iterations after which software devices end it. Steps are half as long as they could be.
    let halved = format!("{}\nscale_distance [0.5]", long_program(1500));
    let mut scene = module(&halved, None);
    scene.settings.lights.truncate(0);
    scene.settings.render.occlusion = sdfc_vm::settings::Occlusion::Off;
    scene.settings.render.size = [24, 16];
    let Some(interp) = interp() else { return };
    let settings = drawn(&scene, &[]);
    let mut engines = [cpu(), interp];
    let report =
        compare_engines(&loaded(&scene, &[]), &mut engines, &settings).expect("both engines run");
    assert!(report.passed(), "{report}");
    let longest = report.images[1].steps.iter().max().copied().unwrap_or(0);
    assert!(
        longest as usize * 1500 > 65_535,
        "{longest} steps are too few to show anything"
    );
    assert!(report.images[1].stats.hits > 20);
}

#[test]
fn points_on_every_engine_follow_the_program_in_double_precision() {
    let distance = program(EVERYTHING, false);
    let scene = module_of(distance.clone(), None);
    let coordinate = |i: usize, k: usize| ((i * k) % 101) as f32 / 25.0 - 2.0;
    // Not a multiple of 64.
    let points: Vec<[f32; 3]> = (0..333)
        .map(|i| [coordinate(i, 7), coordinate(i, 31), coordinate(i, 53)])
        .collect();
    for engine in [Some(cpu()), interp()].into_iter().flatten() {
        let mut engine: Box<dyn Engine> = engine;
        engine.load(&loaded(&scene, &[])).expect("it loads");
        let samples = engine.query(&points).expect("it answers");
        assert_eq!(samples.len(), points.len());
        for (p, sample) in points.iter().zip(samples) {
            let exact = evaluate_f64(&distance, p.map(f64::from));
            assert!(
                (f64::from(sample.distance) - exact).abs() < 4e-6,
                "{p:?}: {sample:?}, {exact}"
            );
            assert_eq!(sample.surface.id, 3.0);
            assert_eq!(sample.surface.albedo, [0.7, 0.4, 0.3]);
        }
        assert_eq!(engine.query(&[]).expect("it answers"), []);
    }
}
