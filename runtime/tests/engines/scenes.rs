//! Hand-made modules: a listing for the distance, optionally one for surfaces, and plain settings.

use sdfc_runtime::engine::{Engine, EngineKind, SceneInput, open, open_on};
use sdfc_runtime::gpu::{AdapterPreference, Arithmetic, Gpu};
use sdfc_runtime::render::RenderSettings;
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use sdfc_trials::skip::is_gpu_skipped;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::listing::parse;
use sdfc_vm::program::{Module, Program};
use sdfc_vm::settings::{
    Camera, CurrentBounds, Extents, Lens, Light, LightSource, Normals, Occlusion, Render,
    SettingValue, Settings, Shadow, Sky, Tonemap, Triple,
};
use sdfc_vm::uniform::{UniformProgram, UniformStep};
use sdfc_vm::verify::verify;

/// The device for GPU tests. Only a stated reason excuses a missing one.
pub(crate) fn gpu() -> Option<Gpu> {
    gpu_with(Arithmetic::Default)
}

fn gpu_with(arithmetic: Arithmetic) -> Option<Gpu> {
    if is_gpu_skipped() {
        return None;
    }
    match Gpu::open_with(AdapterPreference::Any, arithmetic) {
        Ok(gpu) => Some(gpu),
        Err(error) => panic!("{error}; ./test.sh installs a software driver"),
    }
}

/// The interpreter, if there is a device.
pub(crate) fn interp() -> Option<Box<dyn Engine>> {
    gpu().map(|gpu| open_on(EngineKind::Interp, gpu))
}

/// The interpreter with strict arithmetic, whose bits are the same on every device.
pub(crate) fn strict_interp() -> Option<Box<dyn Engine>> {
    gpu_with(Arithmetic::Strict).map(|gpu| open_on(EngineKind::Interp, gpu))
}

pub(crate) fn cpu() -> Box<dyn Engine> {
    open(EngineKind::Cpu).expect("there is always a CPU")
}

pub(crate) fn constants<const N: usize>(numbers: [f64; N]) -> [SettingValue; N] {
    numbers.map(SettingValue::Constant)
}

fn triple(numbers: [f64; 3]) -> Triple {
    constants(numbers)
}

/// A module with these programs in a sphere of radius 2.
pub(crate) fn module(distance: &str, surface: Option<&str>) -> Module {
    module_of(
        program(distance, false),
        surface.map(|text| program(text, true)),
    )
}

pub(crate) fn module_of(distance: Program, surface: Option<Program>) -> Module {
    Module {
        distance,
        surface,
        uniforms: UniformProgram::default(),
        settings: settings(),
    }
}

/// Makes the parameters results of the uniform program, in order.
pub(crate) fn with_params(module: &mut Module, count: u32) {
    module.uniforms = UniformProgram {
        inputs: count,
        steps: (0..count).map(UniformStep::Param).collect(),
        outputs: (0..count).collect(),
    };
}

pub(crate) fn program(text: &str, surface: bool) -> Program {
    // Lines are numbered here, so that listings can omit the numbers.
    let lines = text
        .lines()
        .filter(|line| !line.trim().is_empty())
        .enumerate();
    let numbered: Vec<String> = lines
        .map(|(index, line)| format!("{index:04} {}", line.trim()))
        .collect();
    let program = parse(&numbered.join("\n")).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let output_count = program
        .patches
        .iter()
        .map(|patch| patch.output as usize + 1)
        .max();
    verify(&program, output_count.unwrap_or(0), surface)
        .unwrap_or_else(|error| panic!("{error}\n{text}"));
    program
}

fn settings() -> Settings {
    Settings {
        params: vec![],
        checks: vec![],
        cameras: vec![Camera {
            name: "front".to_owned(),
            from: triple([2.5, 2.0, 5.0]),
            look: triple([0.0; 3]),
            up: triple([0.0, 1.0, 0.0]),
            lens: Lens::Perspective(SettingValue::Constant(0.7)),
            auto_framed: false,
        }],
        lights: vec![Light {
            name: String::new(),
            source: LightSource::Directional(triple([0.6, 1.0, 0.5])),
            color: triple([1.0, 0.95, 0.9]),
            intensity: SettingValue::Constant(2.5),
            shadow: Shadow::Soft(SettingValue::Constant(0.05)),
        }],
        sky: Sky {
            top: triple([0.3, 0.5, 0.9]),
            horizon: triple([0.8, 0.85, 0.9]),
            ground: triple([0.2, 0.18, 0.15]),
            ambient: SettingValue::Constant(0.6),
            fog: None,
        },
        render: Render {
            size: [48, 32],
            aa: 1,
            steps: 256,
            far: None,
            occlusion: Occlusion::FiveTap,
            occlusion_reach: None,
            normals: Normals::Exact,
            tonemap: Tonemap::Aces,
            exposure: SettingValue::Constant(1.0),
        },
        animation: None,
        is_2d: false,
        z_up: false,
        subject: None,
        bounds: Bounds::centred([2.0; 3]),
        bounds_for_all_params: Bounds::centred([2.0; 3]),
        current_bounds: CurrentBounds {
            bounds: Bounds::centred([2.0; 3]),
            extents: Extents::default(),
            params: vec![],
            time: 0.0,
        },
        slope_over_estimate: None,
        has_loose_slopes: false,
        time: 0.0,
        material: constants([0.7, 0.4, 0.3, 0.5, 0.0, 0.0, 0.0, 0.0]),
        material_id: 3,
        materials: vec![],
        parts: vec![],
    }
}

/// The settings of a module's image, without overrides.
pub(crate) fn drawn(module: &Module, uniform_values: &[f64]) -> RenderSettings {
    drawn_as(module, uniform_values, &Overrides::default())
}

pub(crate) fn drawn_as(
    module: &Module,
    uniform_values: &[f64],
    overrides: &Overrides,
) -> RenderSettings {
    resolve(module, uniform_values, overrides).expect("the settings are well")
}

/// A scene input for engines that need no generated source.
pub(crate) fn loaded<'a>(module: &'a Module, uniform_values: &'a [f64]) -> SceneInput<'a> {
    SceneInput {
        module,
        uniform_values,
        generated: SceneSource::default(),
    }
}

/// Moved, rotated, rounded, stored and blended shapes: all features of programs.
pub(crate) const EVERYTHING: &str = "
    sphere [0.8]
    cuboid [0.5, 0.4, 0.3]  moved [-0.9, 0.2, 0.0]  blend quadratic [1.0, 1.0, 0.4, 0.625]
    torus [0.6, 0.2]  mapped [0.8, 0.6, 0.0, 0.3, -0.6, 0.8, 0.0, -0.5, 0.0, 0.0, 1.0, 0.1]  blend cubic [1.0, 1.0, 0.3, 1.851852]
    sphere [0.35]  moved [-0.5, -0.6, -0.4]
    cylinder [0.5, 0.2]  moved [-0.5, -0.7, -0.4]  blend circular [1.0, 1.0, 0.2, 5.0]
    take  blend exponential [1.0, 1.0, 0.1, 10.0]
    store #0
    mirror [1.0, 0.0, 0.0]  keep
    sphere [0.3]  moved [-1.0, -0.9, 0.5]
    take  blend hard [1.0, 1.0, 0.0, 0.0]
    cuboid [0.15, 2.0, 0.15]  back 1  moved [0.2, 0.0, -0.6]  blend hard [-1.0, -1.0, 0.0, 0.0]
    load #0
    offset [-0.35]
    take  blend quadratic [-1.0, -1.0, 0.2, 1.25]
    abs
    sub  right [0.04]
    cuboid [1.6, 0.05, 1.6]  moved [0.0, 1.1, 0.0]  blend hard [1.0, 1.0, 0.0, 0.0]
";

/// Blended shapes with materials, one of which varies from point to point.
pub(crate) const PAINTED: &str = "
    sphere [0.8]
    paint #0 [0.9, 0.1, 0.1, 0.3, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    cuboid [0.5, 0.5, 0.5]  moved [-0.9, 0.1, 0.0]
    normal #1
    abs
    channel #0
    x
    mul  right [3.0]
    fract
    channel #1
    y
    mul  right [9.0]
    sin
    mul  right [0.02]
    channel #8
    paint #3 [0.0, 0.0, 0.6, 0.8, 0.0, 0.02, 0.0, 1.0, 2.0, 1.0, 0.0, 0.0]
    take  blend quadratic [1.0, 1.0, 0.4, 0.625]
    store #0
    torus [0.7, 0.15]  moved [0.0, 0.6, 0.0]
    take  blend hard [1.0, 1.0, 0.0, 0.0]
    sphere [0.5]  moved [0.2, -0.6, -0.6]
    paint #0 [0.1, 0.8, 0.2, 0.6, 0.3, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0]
    smooth_union [0.3, 0.8333333]
    load #0
    take  blend hard [1.0, 1.0, 0.0, 0.0]
    cuboid [1.6, 0.05, 1.6]  moved [0.0, 1.1, 0.0]  blend hard [1.0, 1.0, 0.0, 0.0]
";
