//! Cells cut on the device, by slopes and by intervals: the same picture in every bit as without cells, as
//! many cells as the processor cuts, and a right picture where there is no room for them.

use crate::corpus::{compiled, on_large_stack, scenes};
use sdfc_compiler::clauses::parse_clauses;
use sdfc_compiler::compile::{self, Compiled, compile};
use sdfc_compiler::elaborate::{self, elaborate};
use sdfc_compiler::passes::PassOptions;
use sdfc_compiler::scene::Scene;
use sdfc_lang::Sources;
use sdfc_runtime::engine::{Engine, EngineKind, Loaded, general, on};
use sdfc_runtime::frame::{CellStats, CellUse, Frame, Mode};
use sdfc_runtime::gpu::{Gpu, Limits, Preference};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use sdfc_vm::program::Module;
use sdfc_vm::tape::Tape;
use std::fmt::Write;

/// An engine on a device with limits made lower; `None` where GPU tests are to be skipped.
fn interp(limited: impl Fn(Limits) -> Limits) -> Option<Box<dyn Engine>> {
    if let Ok(reason) = std::env::var("SDFC_SKIP_GPU") {
        eprintln!("skipped: {reason}");
        return None;
    }
    let gpu = Gpu::open_within(Preference::Any, limited).expect("there is an adapter");
    Some(on(EngineKind::Interp, gpu))
}

fn loaded<'a>(module: &'a Module, outputs: &'a [f64]) -> Loaded<'a> {
    Loaded {
        module,
        outputs,
        generated: SceneSource::default(),
    }
}

/// The picture of what is loaded.
fn drawn(
    engine: &mut dyn Engine,
    module: &Module,
    outputs: &[f64],
    overrides: &Overrides,
) -> Result<Frame, String> {
    let settings = resolve(module, outputs, overrides).expect("the scene has settings");
    let frame = engine.render(&settings, &|_| {});
    frame.map_err(|error| error.to_string())
}

fn small(cells: CellUse) -> Overrides {
    Overrides {
        size: Some([72, 48]),
        aa: Some(1),
        cells,
        ..Overrides::default()
    }
}

/// In how many pixels colours, depths, normals, materials and steps differ. Colours may a little: a
/// driver may simplify the arithmetic of two kernels differently.
fn differing(a: &Frame, b: &Frame) -> [usize; 5] {
    let count = |same: &dyn Fn(usize) -> bool| (0..a.depth.len()).filter(|&i| !same(i)).count();
    let near = |i: usize| {
        let channels = a.color[i].iter().zip(b.color[i]);
        channels.fold(true, |near, (a, b)| near && (a - b).abs() <= 1e-4)
    };
    [
        count(&near),
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
    let mut paths = scenes("tests/scenes");
    paths.extend(scenes("examples"));
    let mut failures = Vec::new();
    // Cells, and scenes with many of them, where slopes decide and where intervals do.
    let (mut made, mut deep) = ([0; 2], [0; 2]);
    for path in paths {
        let mut compiled: Compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        let outputs = compiled.module.update(0.0);
        let module = &compiled.module;
        let by = usize::from(!Tape::of(&module.distance).slopes.known());
        engine.load(&loaded(module, &outputs)).expect("it loads");
        let draw =
            |cells| drawn(&mut *engine, module, &outputs, &small(cells)).expect("it is drawn");
        let [without, with] = [CellUse::Never, CellUse::Device].map(draw);
        let found = differing(&without, &with);
        if found != [0; 5] {
            failures.push(format!(
                "{}: colours, depths, normals, materials and steps differ in {found:?} pixels",
                path.display()
            ));
        }
        let cells = with.stats.cells;
        // By intervals, tapes may stay so long that there is no room for them: a device keeps those that
        // are the same more than once.
        assert!(cells.short == 0 || by == 1, "{}: {cells:?}", path.display());
        // The processor makes two programs' first cells and their wholes.
        made[by] += cells.made;
        deep[by] += usize::from(cells.made > 2 * 65);
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    let many = |by: usize| made[by] > 10_000 && deep[by] > 10;
    assert!(many(0) && many(1), "{made:?} cells, {deep:?} scenes");
}

/// So many boxes, each turned another way, in a smooth union, and the results of the uniform program.
/// A parameter gives the width of the first one.
fn boxes(count: usize) -> (Module, Vec<f64>) {
    module(format!("{} & box([8, 8, 8])\n", turned(count)))
}

/// The same on an endless ground: a small part of what rays can reach.
fn grounded(count: usize) -> (Module, Vec<f64>) {
    module(format!("{} | plane(Y, at: -3)\n", turned(count)))
}

/// The text of so many boxes.
fn turned(count: usize) -> String {
    let mut text = String::from("param size = 0.3 in 0.1..=2;\nunion([\n");
    for n in 0..count {
        let at = |step: usize| ((n * step) % 997) as f64 / 997.0 * 6.0 - 3.0;
        let (x, y, z) = (at(389), at(577), at(757));
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

/// A figure of so many circles.
fn circles(count: usize) -> (Module, Vec<f64>) {
    let mut text = String::from("union([\n");
    for n in 0..count {
        let at = |step: usize| ((n * step) % 997) as f64 / 997.0 * 6.0 - 3.0;
        let _ = writeln!(text, "circle(0.2).translate({}, {}),", at(389), at(577));
    }
    text.push_str("], smooth: 0.05)\n");
    module(text)
}

/// A solid in Fidget's text form: so many balls, each with a hollow, one clause after the other.
fn clauses(count: usize) -> (Module, Vec<f64>) {
    let mut text = String::from("x var-x\ny var-y\nz var-z\nr const 0.4\nh const 0.1\n");
    for n in 0..count {
        let at = |step: usize| ((n * step) % 997) as f64 / 997.0 * 6.0 - 3.0;
        for (axis, step) in [("x", 389), ("y", 577), ("z", 757)] {
            let _ = write!(
                text,
                "c{axis}{n} const {}\nd{axis}{n} sub {axis} c{axis}{n}\ns{axis}{n} square d{axis}{n}\n",
                at(step)
            );
        }
        let _ = write!(
            text,
            "p{n} add sx{n} sy{n}\nq{n} add p{n} sz{n}\nl{n} sqrt q{n}\nb{n} sub l{n} r\n\
             m{n} sub h l{n}\nk{n} max b{n} m{n}\n"
        );
        let before = n.saturating_sub(1);
        let _ = match n {
            0 => writeln!(text, "u0 min k0 k0"),
            _ => writeln!(text, "u{n} min u{before} k{n}"),
        };
    }
    let mut sources = Sources::new();
    let file = sources.add("solid.vm".to_owned(), text);
    let (scene, found) = parse_clauses(&sources, file);
    built(scene.unwrap_or_else(|| panic!("{found:?}")))
}

/// So many posts of different heights in space that is repeated. A parameter says how wide the first one
/// is.
fn repeated(count: usize) -> (Module, Vec<f64>) {
    let mut text = String::from("param size = 0.05 in 0.01..=2;\nunion([\n");
    for n in 0..count {
        let at = |step: usize| ((n * step) % 97) as f64 / 97.0 * 1.6 - 0.8;
        let side = if n == 0 { "size" } else { "0.05" };
        let _ = writeln!(
            text,
            "box([{side}, {}, 0.05]).translate({}, 0, {}),",
            0.1 + at(37).abs(),
            at(41),
            at(59)
        );
    }
    text.push_str("]).repeat(spacing: [2, 0, 2]) & box([8, 8, 8])\n");
    module(text)
}

/// What a text is compiled to, and the results of its uniform program.
fn module(text: String) -> (Module, Vec<f64>) {
    let mut sources = Sources::new();
    let file = sources.add("scene".to_owned(), text);
    let (scene, found) = elaborate(&mut sources, file, &elaborate::Options::default());
    built(scene.unwrap_or_else(|| panic!("{found:?}")))
}

/// What a scene is compiled to, and the results of its uniform program.
fn built(scene: Scene) -> (Module, Vec<f64>) {
    let (compiled, found) = compile(scene, &compile::Options::default());
    let mut module = compiled.unwrap_or_else(|| panic!("{found:?}")).module;
    let outputs = module.update(0.0);
    (module, outputs)
}

fn wide(cells: CellUse) -> Overrides {
    Overrides {
        size: Some([192, 144]),
        mode: Mode::Depth,
        ..small(cells)
    }
}

/// Whether there are as many cells, to a tenth, and about as many clauses: the processor keeps tapes that
/// are the same side by side once, as most of them are `alike` times.
fn as_many(processor: CellStats, device: CellStats, alike: u64) -> bool {
    let within = |a: u64, b: u64| a * 10 <= b * 11;
    within(processor.made, device.made)
        && within(device.made, processor.made)
        && within(processor.clauses, device.clauses)
        && within(device.clauses, alike * processor.clauses)
        && processor.short == device.short
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
        let (module, outputs) = scene;
        engine.load(&loaded(&module, &outputs)).expect("it loads");
        let mut draw = |cells| {
            let frame = drawn(&mut *engine, &module, &outputs, &wide(cells)).expect("it is drawn");
            frame.stats.cells
        };
        let [processor, device] = [CellUse::Processor, CellUse::Device].map(&mut draw);
        assert!(processor.made > 1000, "{name}: {processor:?}");
        assert!(
            as_many(processor, device, 3),
            "{name}: {processor:?} by the processor, {device:?} by the device"
        );
    }
}

#[test]
fn by_intervals_the_device_leaves_out_as_much_as_the_processor() {
    let Some(mut engine) = interp(|limits| limits) else {
        return;
    };
    type Made = fn(usize) -> (Module, Vec<f64>);
    // Repeated, a post is the same in many cells.
    for (name, scene, alike) in [("clauses", clauses as Made, 3), ("repeated", repeated, 6)] {
        let (module, outputs) = on_large_stack(|| scene(40));
        assert!(!Tape::of(&module.distance).slopes.known(), "{name}");
        engine.load(&loaded(&module, &outputs)).expect("it loads");
        let mut draw = |cells| {
            let overrides = Overrides {
                mode: Mode::Normal,
                ..wide(cells)
            };
            drawn(&mut *engine, &module, &outputs, &overrides).expect("it is drawn")
        };
        let uses = [CellUse::Never, CellUse::Processor, CellUse::Device];
        let [without, processor, device] = uses.map(&mut draw);
        assert_eq!(differing(&without, &device), [0; 5], "{name}");
        let [processor, device] = [processor, device].map(|frame| frame.stats.cells);
        assert!(processor.made > 1000, "{name}: {processor:?}");
        assert!(
            as_many(processor, device, alike),
            "{name}: {processor:?} by the processor, {device:?} by the device"
        );
    }
}

#[test]
fn squares_of_figures_are_cut_too() {
    let Some(mut engine) = interp(|limits| limits) else {
        return;
    };
    let (module, outputs) = on_large_stack(|| circles(100));
    assert!(module.settings.plane);
    engine.load(&loaded(&module, &outputs)).expect("it loads");
    for mode in [Mode::Shaded, Mode::Mask, Mode::Distance] {
        let mut draw = |cells| {
            let overrides = Overrides {
                size: Some([192, 144]),
                mode,
                ..small(cells)
            };
            drawn(&mut *engine, &module, &outputs, &overrides).expect("it is drawn")
        };
        let uses = [CellUse::Never, CellUse::Processor, CellUse::Device];
        let [without, processor, device] = uses.map(&mut draw);
        assert_eq!(differing(&without, &device), [0; 5], "{mode:?}");
        let [processor, device] = [processor, device].map(|frame| frame.stats.cells);
        assert!(processor.made > 1000, "{mode:?}: {processor:?}");
        assert!(
            as_many(processor, device, 3),
            "{mode:?}: {processor:?}, {device:?}"
        );
    }
}

/// Plates across the diagonal of a cube: from one to the next the field changes as fast as its slopes say, along
/// the diagonals of cells.
fn plates(count: usize) -> (Module, Vec<f64>) {
    let mut text = String::from("union([\n");
    for n in 0..count {
        let at = 0.3 * (n as f64 - count as f64 / 2.0 + 0.3 * ((n * n) as f64).sin());
        let _ = writeln!(
            text,
            "box([1, 0.05, 1.2]).rotate(54.73561deg, [1, 0, -1]).translate({at}, {at}, {at}),"
        );
    }
    text.push_str("])\n");
    module(text)
}

/// Strips far from the origin, so narrow that rounding decides which of them is nearer.
fn narrow_strips(count: usize) -> (Module, Vec<f64>) {
    let mut text = String::from("union([\n");
    for n in 0..count {
        let at = 1000.0 + 1e-4 * (n as f64 - count as f64 / 2.0);
        let angle = 45.0 + 0.01 * n as f64;
        let _ = writeln!(
            text,
            "rect([2e-5, 0.01]).rotate({angle}deg).translate({at}, {}),",
            2000.0 - at
        );
    }
    text.push_str("]) & rect([0.0024, 0.0024]).translate(1000, 1000)\n");
    module(text)
}

/// The processor, whose choices are tried in every bit, says how much may be left out. Where a device leaves out
/// more, no ray may ever come to the place where that is wrong.
#[test]
fn the_device_leaves_out_no_more_than_the_processor() {
    let Some(mut engine) = interp(|limits| limits) else {
        return;
    };
    for ((module, outputs), mode) in [
        (on_large_stack(|| plates(16)), Mode::Depth),
        (on_large_stack(|| narrow_strips(24)), Mode::Distance),
    ] {
        engine.load(&loaded(&module, &outputs)).expect("it loads");
        let mut draw = |cells| {
            let overrides = Overrides {
                mode,
                ..wide(cells)
            };
            drawn(&mut *engine, &module, &outputs, &overrides).expect("it is drawn")
        };
        let uses = [CellUse::Never, CellUse::Processor, CellUse::Device];
        let [without, processor, device] = uses.map(&mut draw);
        assert_eq!(differing(&without, &device), [0; 5], "{mode:?}");
        let [processor, device] = [processor, device].map(|frame| frame.stats.cells);
        assert!(
            device.made * 100 >= processor.made * 99,
            "{mode:?}: {processor:?}, {device:?}"
        );
    }
}

#[test]
fn without_room_cells_keep_their_parents_tapes_and_the_picture() {
    // Room for some cells, for few, and for less than the first ones.
    for (count, rooms, some) in [
        (150, &[256 << 10, 96 << 10][..], true),
        (600, &[68 << 10], false),
    ] {
        let (module, outputs) = on_large_stack(|| boxes(count));
        let draw = |most: u64, cells| {
            let mut engine = interp(|limits| Limits {
                buffer: most.min(limits.buffer),
                storage_binding: most.min(limits.storage_binding),
                ..limits
            })?;
            engine.load(&loaded(&module, &outputs)).expect("it loads");
            Some(drawn(&mut *engine, &module, &outputs, &wide(cells)).expect("it is drawn"))
        };
        let Some(without) = draw(u64::MAX, CellUse::Never) else {
            return;
        };
        let Some(ample) = draw(u64::MAX, CellUse::Device) else {
            return;
        };
        assert_eq!(ample.stats.cells.short, 0);
        for &most in rooms {
            let Some(with) = draw(most, CellUse::Device) else {
                return;
            };
            assert_eq!(differing(&without, &with), [0; 5], "{most} bytes");
            let cells = with.stats.cells;
            assert_eq!(cells.short > 0, some, "{cells:?} in {most} bytes");
            assert!(cells.clauses < ample.stats.cells.clauses, "{cells:?}");
        }
    }
}

#[test]
fn devices_with_few_buffers_draw_or_say_why_not() {
    let (module, outputs) = on_large_stack(|| boxes(100));
    for most in [8, 6, 4] {
        let Some(mut engine) = interp(|limits| Limits {
            storage_buffers: most,
            // What WebGPU promises everywhere.
            buffer: limits.buffer.min(256 << 20),
            storage_binding: limits.storage_binding.min(128 << 20),
            workgroup_memory: limits.workgroup_memory.min(16 << 10),
            workgroup_invocations: limits.workgroup_invocations.min(256),
            ..limits
        }) else {
            return;
        };
        engine.load(&loaded(&module, &outputs)).expect("it loads");
        let mut draw = |cells| drawn(&mut *engine, &module, &outputs, &small(cells));
        match (draw(CellUse::Never), draw(CellUse::Device)) {
            (Ok(without), Ok(with)) => {
                assert_eq!(differing(&without, &with), [0; 5], "{most} buffers");
                assert!(with.stats.cells.made > 65);
            }
            (_, Err(error)) if most < 8 => {
                assert!(error.contains("the GPU refused a call"), "{error}");
            }
            (a, b) => panic!("{most} buffers: {:?}, {:?}", a.err(), b.err()),
        }
    }
}

#[test]
fn an_edit_cuts_anew_and_makes_no_pipeline() {
    let Some(mut engine) = interp(|limits| limits) else {
        return;
    };
    let (mut module, outputs) = on_large_stack(|| boxes(100));
    engine.load(&loaded(&module, &outputs)).expect("it loads");
    let draw = |engine: &mut dyn Engine, module: &Module, outputs: &[f64], cells| {
        drawn(engine, module, outputs, &small(cells)).expect("it is drawn")
    };
    let before = draw(&mut *engine, &module, &outputs, CellUse::Device);
    let pipelines = engine.pipelines_created();
    // The same again is cut no second time.
    let again = draw(&mut *engine, &module, &outputs, CellUse::Device);
    assert_eq!(before.stats.cells, again.stats.cells);

    module.settings.params[0].value = vec![1.5];
    let outputs = module.update(0.0);
    engine
        .update(&module, &outputs)
        .expect("it takes the parameter");
    let after = draw(&mut *engine, &module, &outputs, CellUse::Device);
    assert_eq!(engine.pipelines_created(), pipelines);
    assert_ne!(after.depth, before.depth);
    assert_ne!(after.stats.cells, before.stats.cells);
    let without = draw(&mut *engine, &module, &outputs, CellUse::Never);
    assert_eq!(differing(&without, &after), [0; 5]);
}

/// So many balls, red and blue, of which a parameter moves the first.
fn coloured(count: usize) -> (Module, Vec<f64>) {
    let mut text = String::from(
        "material red { color: #c04030 }\nmaterial blue { color: #3040c0 }\n\
         param size = 0.3 in 0.1..=2;\nunion([\n",
    );
    for n in 0..count {
        let at = |step: usize| ((n * step) % 997) as f64 / 997.0 * 6.0 - 3.0;
        let x = if n == 0 {
            "size".to_owned()
        } else {
            at(389).to_string()
        };
        let paint = ["red", "blue"][n % 2];
        let _ = writeln!(
            text,
            "sphere(0.4).translate({x}, {}, {}).material({paint}),",
            at(577),
            at(757)
        );
    }
    text.push_str("], smooth: 0.05) & box([8, 8, 8])\n");
    module(text)
}

#[test]
fn after_an_edit_the_device_cuts_what_it_touches() {
    edit("boxes", on_large_stack(|| boxes(300)), Mode::Depth, 4);
    edit("coloured", on_large_stack(|| coloured(60)), Mode::Shaded, 2);
    edit("repeated", on_large_stack(|| repeated(20)), Mode::Depth, 1);
}

/// The edits of a scene.
const EDITS: usize = 8;

/// Edits a scene's parameter again and again, and compares its pictures with those without cells. Fewer than
/// one in `share` cells is made anew.
fn edit(scene: &str, (mut module, outputs): (Module, Vec<f64>), mode: Mode, share: u64) {
    // Room for what some edits leave behind, until all is cut anew.
    let most = 3 << 20;
    let ample = interp(|limits| limits);
    let tight = interp(|limits| Limits {
        buffer: most.min(limits.buffer),
        storage_binding: most.min(limits.storage_binding),
        ..limits
    });
    let (Some(mut ample), Some(mut tight)) = (ample, tight) else {
        return;
    };
    let settings = |module: &Module, outputs: &[f64], cells| {
        let overrides = Overrides {
            mode,
            ..wide(cells)
        };
        resolve(module, outputs, &overrides).expect("it has settings")
    };
    // Whoever edits does not let go of the camera.
    let view = settings(&module, &outputs, CellUse::Device).view;
    let draw = |engine: &mut dyn Engine, module: &Module, outputs: &[f64], cells| {
        let mut settings = settings(module, outputs, cells);
        settings.view = view;
        engine.render(&settings, &|_| {}).expect("it is drawn")
    };
    for engine in [&mut ample, &mut tight] {
        engine.load(&loaded(&module, &outputs)).expect("it loads");
    }
    let mut processor = interp(|limits| limits).expect("there is one");
    let (mut anew, mut before) = (0, 0);
    for edit in 0..EDITS {
        let what = format!("{scene}, edit {edit}");
        // Not what the text says, for which bounds are closer.
        let size = 0.35 + 0.05 * [0.0, 1.0, 2.0][edit % 3];
        module.settings.params[0].value = vec![size];
        let outputs = module.update(0.0);
        processor
            .load(&loaded(&module, &outputs))
            .expect("it loads");
        let uses = [CellUse::Never, CellUse::Processor];
        let [whole, kept] = uses.map(|cells| draw(&mut *processor, &module, &outputs, cells));
        let [with_room, without] = [&mut ample, &mut tight].map(|engine| {
            let done = engine.update(&module, &outputs);
            done.expect("it takes the parameter");
            draw(&mut **engine, &module, &outputs, CellUse::Device)
        });
        assert_eq!(differing(&whole, &with_room), [0; 5], "{what}");
        assert_eq!(differing(&whole, &without), [0; 5], "{what}");
        let [device, tight, kept] = [with_room, without, kept].map(|frame| frame.stats.cells);
        assert_eq!(device.short, 0);
        if edit == 0 {
            assert_eq!(device.fresh, device.made);
            continue;
        }
        assert!(device.fresh * share < kept.made, "{what}: {device:?}");
        // As many as the processor makes, but for the whole and rounding, as long as it does not make all
        // anew itself.
        if edit < 3 {
            let near = device.fresh.abs_diff(kept.fresh) * 50 <= kept.fresh;
            assert!(near, "{what}: {device:?} and {kept:?}");
        }
        // What edits replaced is counted until then.
        anew += usize::from(tight.made < before);
        before = tight.made;
    }
    // Where an edit may replace all cells, there is room for them.
    let least = usize::from(share > 1);
    assert!(
        (least..EDITS * 2 / 3).contains(&anew),
        "{scene}: all was cut anew {anew} times of {}",
        EDITS - 1
    );
}

#[test]
fn general_kernels_cut_every_scene() {
    let Some(mut special) = interp(|limits| limits) else {
        return;
    };
    let mut general = general(Gpu::open(Preference::Any).expect("there is an adapter"));
    general.warm_up(&[Mode::Depth]).expect("it warms up");
    let pipelines = general.pipelines_created();
    let scenes = on_large_stack(|| [boxes(40), clauses(20), repeated(20), clauses(30)]);
    for (number, (module, outputs)) in scenes.iter().enumerate() {
        for engine in [&mut special, &mut general] {
            engine.load(&loaded(module, outputs)).expect("it loads");
        }
        let draw = |engine: &mut dyn Engine, cells| {
            let overrides = Overrides {
                mode: Mode::Depth,
                ..small(cells)
            };
            drawn(engine, module, outputs, &overrides).expect("it is drawn")
        };
        let without = draw(&mut *special, CellUse::Never);
        let with = draw(&mut *general, CellUse::Device);
        assert_eq!(differing(&without, &with), [0; 5], "scene {number}");
        let made = with.stats.cells.made;
        assert!(made > 500, "scene {number}: {made} cells");
    }
    // The one by intervals, where devices do not cut by themselves and it is not made beforehand.
    let made = general.pipelines_created() - pipelines;
    assert!(made <= 1, "{made} pipelines");
}
