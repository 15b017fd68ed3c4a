//! Modules made by hand: a listing for the distance, perhaps one for the surfaces, and plain
//! settings.

use sdfc_runtime::engine::{Engine, EngineKind, Loaded, on, open};
use sdfc_runtime::frame::RenderSettings;
use sdfc_runtime::gpu::{Gpu, Preference};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::listing::parse;
use sdfc_vm::program::{Module, Program};
use sdfc_vm::settings::{
    Camera, FoundBounds, Lens, Light, LightSource, Normals, Occlusion, Render, Setting, Settings,
    Shadow, Sky, Tonemap, Triple,
};
use sdfc_vm::uniform::{Step, UniformProgram};
use sdfc_vm::verify::verify;

/// The device that GPU tests run on. Only a stated reason excuses the want of one.
pub(crate) fn gpu() -> Option<Gpu> {
    if let Ok(reason) = std::env::var("SDFC_SKIP_GPU") {
        eprintln!("skipped: {reason}");
        return None;
    }
    match Gpu::open(Preference::Any) {
        Ok(gpu) => Some(gpu),
        Err(error) => panic!("{error}; ./test.sh installs a software driver"),
    }
}

/// The interpreter, where there is a device.
pub(crate) fn interp() -> Option<Box<dyn Engine>> {
    gpu().map(|gpu| on(EngineKind::Interp, gpu))
}

pub(crate) fn cpu() -> Box<dyn Engine> {
    open(EngineKind::Cpu).expect("there is always a CPU")
}

pub(crate) fn constants<const N: usize>(numbers: [f64; N]) -> [Setting; N] {
    numbers.map(Setting::Constant)
}

fn triple(numbers: [f64; 3]) -> Triple {
    constants(numbers)
}

/// A module with these programs in a ball of radius 2.
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

/// Lets the parameters be results of the uniform program, in order.
pub(crate) fn with_params(module: &mut Module, count: u32) {
    module.uniforms = UniformProgram {
        inputs: count,
        steps: (0..count).map(Step::Param).collect(),
        outputs: (0..count).collect(),
    };
}

pub(crate) fn program(text: &str, surface: bool) -> Program {
    // Lines are numbered here, so that they can be written without.
    let lines = text
        .lines()
        .filter(|line| !line.trim().is_empty())
        .enumerate();
    let numbered: Vec<String> = lines
        .map(|(at, line)| format!("{at:04} {}", line.trim()))
        .collect();
    let program = parse(&numbered.join("\n")).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let outputs = program
        .patches
        .iter()
        .map(|patch| patch.output as usize + 1)
        .max();
    verify(&program, outputs.unwrap_or(0), surface)
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
            lens: Lens::Perspective(Setting::Constant(0.7)),
            automatic: false,
        }],
        lights: vec![Light {
            name: String::new(),
            source: LightSource::Directional(triple([0.6, 1.0, 0.5])),
            color: triple([1.0, 0.95, 0.9]),
            intensity: Setting::Constant(2.5),
            shadow: Shadow::Soft(Setting::Constant(0.05)),
        }],
        sky: Sky {
            top: triple([0.3, 0.5, 0.9]),
            horizon: triple([0.8, 0.85, 0.9]),
            ground: triple([0.2, 0.18, 0.15]),
            ambient: Setting::Constant(0.6),
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
            exposure: Setting::Constant(1.0),
        },
        animation: None,
        plane: false,
        z_up: false,
        subject: None,
        bounds: Bounds::centred([2.0; 3]),
        reach: Bounds::centred([2.0; 3]),
        found: FoundBounds {
            bounds: Bounds::centred([2.0; 3]),
            params: vec![],
            time: 0.0,
        },
        time: 0.0,
        material: constants([0.7, 0.4, 0.3, 0.5, 0.0, 0.0, 0.0, 0.0]),
        material_id: 3,
        materials: vec![],
        parts: vec![],
    }
}

/// The settings of a module's picture, as its scene has them.
pub(crate) fn drawn(module: &Module, outputs: &[f64]) -> RenderSettings {
    drawn_as(module, outputs, &Overrides::default())
}

pub(crate) fn drawn_as(module: &Module, outputs: &[f64], overrides: &Overrides) -> RenderSettings {
    resolve(module, outputs, overrides).expect("the settings are well")
}

/// A module for engines that need no generated source.
pub(crate) fn loaded<'a>(module: &'a Module, outputs: &'a [f64]) -> Loaded<'a> {
    Loaded {
        module,
        outputs,
        generated: SceneSource::default(),
    }
}

/// Moved, turned, rounded, kept and blended shapes: everything that a program can do.
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

/// Painted shapes that blend, one with numbers of its own at each point.
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
