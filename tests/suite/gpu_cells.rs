//! Cells built on the GPU, by Lipschitz bounds and by intervals. Pictures equal those without cells in every
//! bit, and the number of cells equals that of the CPU. Pictures stay correct when memory runs out.

use crate::corpus::{compiled, on_large_stack, scenes_on_gpu};
use sdfc_compiler::compile::{self, Compiled, compile};
use sdfc_compiler::elaborate::{self, elaborate};
use sdfc_compiler::fidget_text::parse_fidget_text;
use sdfc_compiler::passes::PassOptions;
use sdfc_compiler::scene::Scene;
use sdfc_lang::Sources;
use sdfc_runtime::engine::{Engine, EngineKind, SceneInput, open_generic, open_on};
use sdfc_runtime::gpu::{AdapterPreference, DeviceLimits, Gpu};
use sdfc_runtime::render::{CellMode, CellStats, Image, Mode};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use sdfc_trials::skip::is_gpu_skipped;
use sdfc_vm::program::Module;
use sdfc_vm::tape::Tape;
use std::fmt::Write;

/// Opens an engine on a device with reduced limits; `None` if GPU tests are skipped.
fn interp(limited: impl Fn(DeviceLimits) -> DeviceLimits) -> Option<Box<dyn Engine>> {
    if is_gpu_skipped() {
        return None;
    }
    let gpu = Gpu::open_with_limits(AdapterPreference::Any, limited).expect("there is an adapter");
    Some(open_on(EngineKind::Interp, gpu))
}

fn loaded<'a>(module: &'a Module, uniform_values: &'a [f64]) -> SceneInput<'a> {
    SceneInput {
        module,
        uniform_values,
        generated: SceneSource::default(),
    }
}

/// Draws the loaded scene.
fn drawn(
    engine: &mut dyn Engine,
    module: &Module,
    uniform_values: &[f64],
    overrides: &Overrides,
) -> Result<Image, String> {
    let settings = resolve(module, uniform_values, overrides).expect("the scene has settings");
    let image = engine.render(&settings, &|_| {});
    image.map_err(|error| error.to_string())
}

fn small(cells: CellMode) -> Overrides {
    Overrides {
        size: Some([72, 48]),
        aa: Some(1),
        cells,
        ..Overrides::default()
    }
}

/// Counts the pixels in which colours, depths, normals, materials and steps differ. Colours have a
/// tolerance, because a driver may simplify the arithmetic of two kernels differently.
fn differing(a: &Image, b: &Image) -> [usize; 5] {
    let count = |same: &dyn Fn(usize) -> bool| (0..a.depth.len()).filter(|&i| !same(i)).count();
    let is_close = |i: usize| {
        let channels = a.color[i].iter().zip(b.color[i]);
        channels.fold(true, |is_close, (a, b)| is_close && (a - b).abs() <= 1e-4)
    };
    [
        count(&is_close),
        count(&|i| a.depth[i].to_bits() == b.depth[i].to_bits()),
        count(&|i| a.normal[i].map(f32::to_bits) == b.normal[i].map(f32::to_bits)),
        count(&|i| a.id[i] == b.id[i]),
        count(&|i| a.steps[i] == b.steps[i]),
    ]
}

#[test]
fn cells_of_the_device_keep_every_bit() {
    let Some(mut engine) = interp(|limits| limits) else {
        return;
    };
    let mut failures = Vec::new();
    // Number of cells, and of scenes with many cells, by Lipschitz bounds and by intervals.
    let (mut cell_counts, mut deep_counts) = ([0; 2], [0; 2]);
    for path in scenes_on_gpu(0) {
        let mut compiled: Compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        let uniform_values = compiled.module.update(0.0);
        let module = &compiled.module;
        let method = usize::from(!Tape::new(&module.distance).lipschitz.is_bounded());
        engine
            .load(&loaded(module, &uniform_values))
            .expect("it loads");
        let draw = |cells| {
            drawn(&mut *engine, module, &uniform_values, &small(cells)).expect("it is drawn")
        };
        let [without, with] = [CellMode::Never, CellMode::Gpu].map(draw);
        let found = differing(&without, &with);
        if found != [0; 5] {
            failures.push(format!(
                "{}: colours, depths, normals, materials and steps differ in {found:?} pixels",
                path.display()
            ));
        }
        let cells = with.stats.cells;
        // With intervals, tapes may stay too long for the buffers: the GPU stores equal tapes more than
        // once.
        assert!(
            cells.out_of_memory == 0 || method == 1,
            "{}: {cells:?}",
            path.display()
        );
        // The CPU builds the root and the first level of both programs.
        cell_counts[method] += cells.count;
        deep_counts[method] += usize::from(cells.count > 2 * 65);
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    let many = |method: usize| cell_counts[method] > 5_000 && deep_counts[method] > 5;
    assert!(
        many(0) && many(1),
        "{cell_counts:?} cells, {deep_counts:?} scenes"
    );
}

/// Returns `count` rotated boxes in a smooth union, and the results of the uniform program. A param sets
/// the width of the first box.
fn boxes(count: usize) -> (Module, Vec<f64>) {
    module(format!("{} & box([8, 8, 8])\n", rotated_boxes(count)))
}

/// Returns the same boxes on unbounded ground: a small part of the region that rays can reach.
fn grounded(count: usize) -> (Module, Vec<f64>) {
    module(format!("{} | plane(Y, at: -3)\n", rotated_boxes(count)))
}

/// Returns the text of `count` boxes.
fn rotated_boxes(count: usize) -> String {
    let mut text = String::from("param size = 0.3 in 0.1..=2;\nunion([\n");
    for n in 0..count {
        let coordinate = |step: usize| ((n * step) % 997) as f64 / 997.0 * 6.0 - 3.0;
        let (x, y, z) = (coordinate(389), coordinate(577), coordinate(757));
        let side = if n == 0 { "size" } else { "0.3" };
        let _ = writeln!(
            text,
            "box([{side}, 0.2, 0.25]).rotate({}deg, [0.3, 1, {}]).translate({x}, {y}, {z}),",
            n * 37 % 360,
            n % 7
        );
    }
    text + "], smooth: 0.05)"
}

/// Returns a 2-D shape of `count` circles.
fn circles(count: usize) -> (Module, Vec<f64>) {
    let mut text = String::from("union([\n");
    for n in 0..count {
        let coordinate = |step: usize| ((n * step) % 997) as f64 / 997.0 * 6.0 - 3.0;
        let _ = writeln!(
            text,
            "circle(0.2).translate({}, {}),",
            coordinate(389),
            coordinate(577)
        );
    }
    text.push_str("], smooth: 0.05)\n");
    module(text)
}

/// Returns a solid in Fidget's text form: `count` hollow spheres, one clause after the other.
fn clauses(count: usize) -> (Module, Vec<f64>) {
    let mut text = String::from("x var-x\ny var-y\nz var-z\nr const 0.4\nh const 0.1\n");
    for n in 0..count {
        let coordinate = |step: usize| ((n * step) % 997) as f64 / 997.0 * 6.0 - 3.0;
        for (axis, step) in [("x", 389), ("y", 577), ("z", 757)] {
            let _ = write!(
                text,
                "c{axis}{n} const {}\nd{axis}{n} sub {axis} c{axis}{n}\ns{axis}{n} square d{axis}{n}\n",
                coordinate(step)
            );
        }
        let _ = write!(
            text,
            "p{n} add sx{n} sy{n}\nq{n} add p{n} sz{n}\nl{n} sqrt q{n}\nb{n} sub l{n} r\n\
             m{n} sub h l{n}\nk{n} max b{n} m{n}\n"
        );
        let previous = n.saturating_sub(1);
        let _ = match n {
            0 => writeln!(text, "u0 min k0 k0"),
            _ => writeln!(text, "u{n} min u{previous} k{n}"),
        };
    }
    let mut sources = Sources::new();
    let file = sources.add("solid.vm".to_owned(), text);
    let (scene, found) = parse_fidget_text(&sources, file);
    built(scene.unwrap_or_else(|| panic!("{found:?}")))
}

/// Returns `count` posts of different heights in repeated space. A param sets the width of the first one.
fn repeated(count: usize) -> (Module, Vec<f64>) {
    let mut text = String::from("param size = 0.05 in 0.01..=2;\nunion([\n");
    for n in 0..count {
        let coordinate = |step: usize| ((n * step) % 97) as f64 / 97.0 * 1.6 - 0.8;
        let side = if n == 0 { "size" } else { "0.05" };
        let _ = writeln!(
            text,
            "box([{side}, {}, 0.05]).translate({}, 0, {}),",
            0.1 + coordinate(37).abs(),
            coordinate(41),
            coordinate(59)
        );
    }
    text.push_str("]).repeat(spacing: [2, 0, 2]) & box([8, 8, 8])\n");
    module(text)
}

/// Compiles a text and returns the module with the results of its uniform program.
fn module(text: String) -> (Module, Vec<f64>) {
    let mut sources = Sources::new();
    let file = sources.add("scene".to_owned(), text);
    let (scene, found) = elaborate(&mut sources, file, &elaborate::Options::default());
    built(scene.unwrap_or_else(|| panic!("{found:?}")))
}

/// Compiles a scene and returns the module with the results of its uniform program.
fn built(scene: Scene) -> (Module, Vec<f64>) {
    let (compiled, found) = compile(scene, &compile::Options::default());
    let mut module = compiled.unwrap_or_else(|| panic!("{found:?}")).module;
    let uniform_values = module.update(0.0);
    (module, uniform_values)
}

fn wide(cells: CellMode) -> Overrides {
    Overrides {
        size: Some([192, 144]),
        mode: Mode::Depth,
        ..small(cells)
    }
}

/// Reports whether the numbers of cells agree within a tenth and those of clauses roughly. The CPU stores
/// equal neighbouring tapes once; most of them occur `repeat_factor` times.
fn are_equally_many(processor: CellStats, device: CellStats, repeat_factor: u64) -> bool {
    let within = |a: u64, b: u64| a * 10 <= b * 11;
    within(processor.count, device.count)
        && within(device.count, processor.count)
        && within(processor.clauses, device.clauses)
        && within(device.clauses, repeat_factor * processor.clauses)
        && processor.out_of_memory == device.out_of_memory
}

#[test]
fn the_device_makes_as_many_cells_as_the_processor() {
    let Some(mut engine) = interp(|limits| limits) else {
        return;
    };
    for (name, scene) in [
        ("alone", on_large_stack(|| boxes(300))),
        ("on an endless ground", on_large_stack(|| grounded(300))),
    ] {
        let (module, uniform_values) = scene;
        engine
            .load(&loaded(&module, &uniform_values))
            .expect("it loads");
        let mut draw = |cells| {
            let image =
                drawn(&mut *engine, &module, &uniform_values, &wide(cells)).expect("it is drawn");
            image.stats.cells
        };
        let [processor, device] = [CellMode::Cpu, CellMode::Gpu].map(&mut draw);
        assert!(processor.count > 1000, "{name}: {processor:?}");
        assert!(
            are_equally_many(processor, device, 3),
            "{name}: {processor:?} by the processor, {device:?} by the device"
        );
    }
}

#[test]
fn by_intervals_the_device_leaves_out_as_much_as_the_processor() {
    let Some(mut engine) = interp(|limits| limits) else {
        return;
    };
    type SceneBuilder = fn(usize) -> (Module, Vec<f64>);
    // In repeated space, a post is the same in many cells.
    for (name, scene, repeat_factor) in [
        ("clauses", clauses as SceneBuilder, 3),
        ("repeated", repeated, 6),
    ] {
        let (module, uniform_values) = on_large_stack(|| scene(40));
        assert!(
            !Tape::new(&module.distance).lipschitz.is_bounded(),
            "{name}"
        );
        engine
            .load(&loaded(&module, &uniform_values))
            .expect("it loads");
        let mut draw = |cells| {
            let overrides = Overrides {
                mode: Mode::Normal,
                ..wide(cells)
            };
            drawn(&mut *engine, &module, &uniform_values, &overrides).expect("it is drawn")
        };
        let cell_modes = [CellMode::Never, CellMode::Cpu, CellMode::Gpu];
        let [without, processor, device] = cell_modes.map(&mut draw);
        assert_eq!(differing(&without, &device), [0; 5], "{name}");
        let [processor, device] = [processor, device].map(|image| image.stats.cells);
        assert!(processor.count > 1000, "{name}: {processor:?}");
        assert!(
            are_equally_many(processor, device, repeat_factor),
            "{name}: {processor:?} by the processor, {device:?} by the device"
        );
    }
}

#[test]
fn cells_of_2d_shapes_are_split_too() {
    let Some(mut engine) = interp(|limits| limits) else {
        return;
    };
    let (module, uniform_values) = on_large_stack(|| circles(100));
    assert!(module.settings.is_2d);
    engine
        .load(&loaded(&module, &uniform_values))
        .expect("it loads");
    for mode in [Mode::Shaded, Mode::Mask, Mode::Distance] {
        let mut draw = |cells| {
            let overrides = Overrides {
                size: Some([192, 144]),
                mode,
                ..small(cells)
            };
            drawn(&mut *engine, &module, &uniform_values, &overrides).expect("it is drawn")
        };
        let cell_modes = [CellMode::Never, CellMode::Cpu, CellMode::Gpu];
        let [without, processor, device] = cell_modes.map(&mut draw);
        assert_eq!(differing(&without, &device), [0; 5], "{mode:?}");
        let [processor, device] = [processor, device].map(|image| image.stats.cells);
        assert!(processor.count > 1000, "{mode:?}: {processor:?}");
        assert!(
            are_equally_many(processor, device, 3),
            "{mode:?}: {processor:?}, {device:?}"
        );
    }
}

/// Returns plates across the diagonal of a cube. Between them the field changes at the rate of its slope
/// bound, along the diagonals of cells.
fn plates(count: usize) -> (Module, Vec<f64>) {
    let mut text = String::from("union([\n");
    for n in 0..count {
        let coordinate = 0.3 * (n as f64 - count as f64 / 2.0 + 0.3 * ((n * n) as f64).sin());
        let _ = writeln!(
            text,
            "box([1, 0.05, 1.2]).rotate(54.73561deg, [1, 0, -1]).translate({coordinate}, {coordinate}, {coordinate}),"
        );
    }
    text.push_str("])\n");
    module(text)
}

/// Returns strips far from the origin, narrow enough that rounding decides which of them is nearer.
fn narrow_strips(count: usize) -> (Module, Vec<f64>) {
    let mut text = String::from("union([\n");
    for n in 0..count {
        let coordinate = 1000.0 + 1e-4 * (n as f64 - count as f64 / 2.0);
        let angle = 45.0 + 0.01 * n as f64;
        let _ = writeln!(
            text,
            "rect([2e-5, 0.01]).rotate({angle}deg).translate({coordinate}, {}),",
            2000.0 - coordinate
        );
    }
    text.push_str("]) & rect([0.0024, 0.0024]).translate(1000, 1000)\n");
    module(text)
}

/// The CPU, whose choices are verified bit by bit, sets the limit for pruning. Where the GPU prunes more,
/// possibly no ray reaches the incorrect region.
#[test]
fn the_device_leaves_out_no_more_than_the_processor() {
    let Some(mut engine) = interp(|limits| limits) else {
        return;
    };
    for ((module, uniform_values), mode) in [
        (on_large_stack(|| plates(16)), Mode::Depth),
        (on_large_stack(|| narrow_strips(24)), Mode::Distance),
    ] {
        engine
            .load(&loaded(&module, &uniform_values))
            .expect("it loads");
        let mut draw = |cells| {
            let overrides = Overrides {
                mode,
                ..wide(cells)
            };
            drawn(&mut *engine, &module, &uniform_values, &overrides).expect("it is drawn")
        };
        let cell_modes = [CellMode::Never, CellMode::Cpu, CellMode::Gpu];
        let [without, processor, device] = cell_modes.map(&mut draw);
        assert_eq!(differing(&without, &device), [0; 5], "{mode:?}");
        let [processor, device] = [processor, device].map(|image| image.stats.cells);
        assert!(
            device.count * 100 >= processor.count * 99,
            "{mode:?}: {processor:?}, {device:?}"
        );
    }
}

#[test]
fn without_room_cells_keep_their_parents_tapes_and_the_picture() {
    // Memory for some cells, for few, and for less than the first level.
    for (count, buffer_sizes, expects_deferred) in [
        (150, &[256 << 10, 96 << 10][..], true),
        (600, &[68 << 10], false),
    ] {
        let (module, uniform_values) = on_large_stack(|| boxes(count));
        let draw = |max: u64, cells| {
            let mut engine = interp(|limits| DeviceLimits {
                buffer: max.min(limits.buffer),
                storage_binding: max.min(limits.storage_binding),
                ..limits
            })?;
            engine
                .load(&loaded(&module, &uniform_values))
                .expect("it loads");
            Some(drawn(&mut *engine, &module, &uniform_values, &wide(cells)).expect("it is drawn"))
        };
        let Some(without) = draw(u64::MAX, CellMode::Never) else {
            return;
        };
        let Some(unlimited) = draw(u64::MAX, CellMode::Gpu) else {
            return;
        };
        assert_eq!(unlimited.stats.cells.out_of_memory, 0);
        for &max in buffer_sizes {
            let Some(with) = draw(max, CellMode::Gpu) else {
                return;
            };
            assert_eq!(differing(&without, &with), [0; 5], "{max} bytes");
            let cells = with.stats.cells;
            assert_eq!(
                cells.out_of_memory > 0,
                expects_deferred,
                "{cells:?} in {max} bytes"
            );
            assert!(cells.clauses < unlimited.stats.cells.clauses, "{cells:?}");
        }
    }
}

#[test]
fn devices_with_few_buffers_draw_or_report_why_not() {
    let (module, uniform_values) = on_large_stack(|| boxes(100));
    for max in [8, 6, 4] {
        let Some(mut engine) = interp(|limits| DeviceLimits {
            storage_buffers: max,
            // Limits that WebGPU guarantees everywhere.
            buffer: limits.buffer.min(256 << 20),
            storage_binding: limits.storage_binding.min(128 << 20),
            workgroup_memory: limits.workgroup_memory.min(16 << 10),
            workgroup_invocations: limits.workgroup_invocations.min(256),
            ..limits
        }) else {
            return;
        };
        engine
            .load(&loaded(&module, &uniform_values))
            .expect("it loads");
        let mut draw = |cells| drawn(&mut *engine, &module, &uniform_values, &small(cells));
        match (draw(CellMode::Never), draw(CellMode::Gpu)) {
            (Ok(without), Ok(with)) => {
                assert_eq!(differing(&without, &with), [0; 5], "{max} buffers");
                assert!(with.stats.cells.count > 65);
            }
            (_, Err(error)) if max < 8 => {
                assert!(error.contains("the GPU refused a call"), "{error}");
            }
            (a, b) => panic!("{max} buffers: {:?}, {:?}", a.err(), b.err()),
        }
    }
}

#[test]
fn an_edit_splits_cells_again_and_makes_no_pipeline() {
    let Some(mut engine) = interp(|limits| limits) else {
        return;
    };
    let (mut module, uniform_values) = on_large_stack(|| boxes(100));
    engine
        .load(&loaded(&module, &uniform_values))
        .expect("it loads");
    let draw = |engine: &mut dyn Engine, module: &Module, uniform_values: &[f64], cells| {
        drawn(engine, module, uniform_values, &small(cells)).expect("it is drawn")
    };
    let previous = draw(&mut *engine, &module, &uniform_values, CellMode::Gpu);
    let pipelines = engine.pipelines_created();
    // An unchanged scene is not built again.
    let again = draw(&mut *engine, &module, &uniform_values, CellMode::Gpu);
    assert_eq!(previous.stats.cells, again.stats.cells);

    module.settings.params[0].value = vec![1.5];
    let uniform_values = module.update(0.0);
    engine
        .update(&module, &uniform_values)
        .expect("it takes the parameter");
    let after = draw(&mut *engine, &module, &uniform_values, CellMode::Gpu);
    assert_eq!(engine.pipelines_created(), pipelines);
    assert_ne!(after.depth, previous.depth);
    assert_ne!(after.stats.cells, previous.stats.cells);
    let without = draw(&mut *engine, &module, &uniform_values, CellMode::Never);
    assert_eq!(differing(&without, &after), [0; 5]);
}

/// Returns `count` spheres in red and blue. A param moves the first one.
fn colored_spheres(count: usize) -> (Module, Vec<f64>) {
    let mut text = String::from(
        "material red { color: #c04030 }\nmaterial blue { color: #3040c0 }\n\
         param size = 0.3 in 0.1..=2;\nunion([\n",
    );
    for n in 0..count {
        let coordinate = |step: usize| ((n * step) % 997) as f64 / 997.0 * 6.0 - 3.0;
        let x = if n == 0 {
            "size".to_owned()
        } else {
            coordinate(389).to_string()
        };
        let material = ["red", "blue"][n % 2];
        let _ = writeln!(
            text,
            "sphere(0.4).translate({x}, {}, {}).material({material}),",
            coordinate(577),
            coordinate(757)
        );
    }
    text.push_str("], smooth: 0.05) & box([8, 8, 8])\n");
    module(text)
}

#[test]
fn after_an_edit_the_device_cuts_what_it_touches() {
    edit("boxes", on_large_stack(|| boxes(300)), Mode::Depth, 4);
    edit(
        "coloured",
        on_large_stack(|| colored_spheres(60)),
        Mode::Shaded,
        2,
    );
    edit("repeated", on_large_stack(|| repeated(20)), Mode::Depth, 1);
}

/// Number of edits of a scene.
const EDITS: usize = 8;
/// Values of its param, in turn.
const SIZES: [f64; 3] = [0.35, 0.4, 0.45];

/// Edits a scene's param repeatedly and compares its pictures with those without cells. Fewer than one in
/// `divisor` cells is rebuilt.
fn edit(scene: &str, (mut module, uniform_values): (Module, Vec<f64>), mode: Mode, divisor: u64) {
    // Memory for the replaced cells of some edits, until a full rebuild.
    let max = 3 << 20;
    let unlimited = interp(|limits| limits);
    let tight = interp(|limits| DeviceLimits {
        buffer: max.min(limits.buffer),
        storage_binding: max.min(limits.storage_binding),
        ..limits
    });
    let (Some(mut unlimited), Some(mut tight)) = (unlimited, tight) else {
        return;
    };
    let settings = |module: &Module, uniform_values: &[f64], cells| {
        let overrides = Overrides {
            mode,
            ..wide(cells)
        };
        resolve(module, uniform_values, &overrides).expect("it has settings")
    };
    // The camera stays fixed during edits.
    let view = settings(&module, &uniform_values, CellMode::Gpu).view;
    let draw = |engine: &mut dyn Engine, module: &Module, uniform_values: &[f64], cells| {
        let mut settings = settings(module, uniform_values, cells);
        settings.view = view;
        engine.render(&settings, &|_| {}).expect("it is drawn")
    };
    for engine in [&mut unlimited, &mut tight] {
        engine
            .load(&loaded(&module, &uniform_values))
            .expect("it loads");
    }
    let mut processor = interp(|limits| limits).expect("there is one");
    let (mut rebuild_count, mut previous) = (0, 0);
    // Without cells, edits with the same value have the same picture.
    let mut pictures = [const { None }; SIZES.len()];
    for edit in 0..EDITS {
        let label = format!("{scene}, edit {edit}");
        // Differs from the text's value, for which bounds are tighter.
        module.settings.params[0].value = vec![SIZES[edit % SIZES.len()]];
        let uniform_values = module.update(0.0);
        processor
            .load(&loaded(&module, &uniform_values))
            .expect("it loads");
        let mut draw_here = |cells| draw(&mut *processor, &module, &uniform_values, cells);
        let picture = &mut pictures[edit % SIZES.len()];
        let without_cells = &*picture.get_or_insert_with(|| draw_here(CellMode::Never));
        let cpu_cells = draw_here(CellMode::Cpu);
        let [with_room, without] = [&mut unlimited, &mut tight].map(|engine| {
            let updated = engine.update(&module, &uniform_values);
            updated.expect("it takes the parameter");
            draw(&mut **engine, &module, &uniform_values, CellMode::Gpu)
        });
        assert_eq!(differing(without_cells, &with_room), [0; 5], "{label}");
        assert_eq!(differing(without_cells, &without), [0; 5], "{label}");
        let [device, tight, cpu_cells] =
            [with_room, without, cpu_cells].map(|image| image.stats.cells);
        assert_eq!(device.out_of_memory, 0);
        if edit == 0 {
            assert_eq!(device.fresh, device.count);
            continue;
        }
        assert!(
            device.fresh * divisor < cpu_cells.count,
            "{label}: {device:?}"
        );
        // Equal to the CPU's number, except for the root and rounding, until the CPU itself rebuilds
        // everything.
        if edit < 3 {
            let is_close = device.fresh.abs_diff(cpu_cells.fresh) * 50 <= cpu_cells.fresh;
            assert!(is_close, "{label}: {device:?} and {cpu_cells:?}");
        }
        // Replaced cells are counted until a full rebuild.
        rebuild_count += usize::from(tight.count < previous);
        previous = tight.count;
    }
    // If an edit may replace all cells, there is memory for them.
    let min_rebuilds = usize::from(divisor > 1);
    assert!(
        (min_rebuilds..EDITS * 2 / 3).contains(&rebuild_count),
        "{scene}: all was split anew {rebuild_count} times of {}",
        EDITS - 1
    );
}

#[test]
fn general_kernels_cut_every_scene() {
    let Some(mut specialized) = interp(|limits| limits) else {
        return;
    };
    let mut generic = open_generic(Gpu::open(AdapterPreference::Any).expect("there is an adapter"));
    generic.warm_up(&[Mode::Depth]).expect("it warms up");
    let pipelines = generic.pipelines_created();
    let scenes = on_large_stack(|| [boxes(40), clauses(20), repeated(20), clauses(30)]);
    for (number, (module, uniform_values)) in scenes.iter().enumerate() {
        for engine in [&mut specialized, &mut generic] {
            engine
                .load(&loaded(module, uniform_values))
                .expect("it loads");
        }
        let draw = |engine: &mut dyn Engine, cells| {
            let overrides = Overrides {
                mode: Mode::Depth,
                ..small(cells)
            };
            drawn(engine, module, uniform_values, &overrides).expect("it is drawn")
        };
        let without = draw(&mut *specialized, CellMode::Never);
        let with = draw(&mut *generic, CellMode::Gpu);
        assert_eq!(differing(&without, &with), [0; 5], "scene {number}");
        let made = with.stats.cells.count;
        assert!(made > 500, "scene {number}: {made} cells");
    }
    // At most the interval kernel is created, on devices where it is not part of the warm-up.
    let made = generic.pipelines_created() - pipelines;
    assert!(made <= 1, "{made} pipelines");
}
