//! Invariants that must hold for any input. A check panics where one is violated.

use crate::campaign::CheckOutcome;
use crate::programs::points;
use sdfc_compiler::compile::{Compiled, Options, compile};
use sdfc_compiler::elaborate::{self, elaborate};
use sdfc_compiler::fidget_text::parse_fidget_text;
use sdfc_compiler::raise::raise;
use sdfc_compiler::scene::Scene;
use sdfc_lang::{Diagnostics, Sources, Style, parse, print};
use sdfc_vm::dual::Dual;
use sdfc_vm::encode::{decode, encode};
use sdfc_vm::evaluate::{evaluate, evaluate_f64, gradient};
use sdfc_vm::file::{decode_file, encode_file};
use sdfc_vm::interval::Interval;
use sdfc_vm::lanes::{F32x64, LANES, with_identity_jacobian};
use sdfc_vm::listing;
use sdfc_vm::program::{Module, Opcode, Program};
use sdfc_vm::surface::SurfaceHook;
use sdfc_vm::tape::evaluator::TapeEvaluator;
use sdfc_vm::tape::prune::Pruner;
use sdfc_vm::tape::trace::Tracer;
use sdfc_vm::tape::{Clause, Tape};
use sdfc_vm::vector::V3;
use sdfc_vm::verify::verify;

/// Reports whether two values have equal bits, or are both NaN. Raw arithmetic on random numbers may yield
/// NaN.
pub fn equal_or_both_nan(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

/// Checks a scene's text: it is refused with messages, or compiled to a file that reads back.
///
/// A text that parses is printed in a form that is a fixed point and compiles to the same module.
pub fn text(text: &str) -> CheckOutcome {
    let mut sources = Sources::new();
    let file = sources.add("trial", text);
    let (tree, diagnostics) = parse(&sources, file);
    let has_errors = diagnostics.iter().any(|diagnostic| diagnostic.is_error());
    assert_eq!(tree.is_none(), has_errors, "a tree, or errors");
    let printed = tree.map(|tree| print(&tree));
    if let Some(printed) = &printed {
        assert_eq!(&reprint(printed), printed, "printing is not a fixed point");
    }
    let (scene, diagnostics) = elaborate(&mut sources, file, &elaborate::Options::default());
    let Some(compiled) = compile_elaborated(&sources, scene, diagnostics) else {
        return CheckOutcome::Refused;
    };
    let printed = printed.expect("what compiles was parsed");
    if text.len() < 20_000 {
        let recompiled = compiled_text(&printed).expect("what is printed compiles");
        assert!(
            encode_file(&recompiled.module) == encode_file(&compiled.module),
            "what is printed means something else:\n{printed}"
        );
    }
    check_scene(&compiled);
    CheckOutcome::Accepted
}

/// Parses and prints a printed text.
fn reprint(text: &str) -> String {
    let mut sources = Sources::new();
    let file = sources.add("printed", text);
    let (tree, diagnostics) = parse(&sources, file);
    let tree =
        tree.unwrap_or_else(|| panic!("what is printed is no scene: {diagnostics:?}\n{text}"));
    print(&tree)
}

/// Compiles a text with all passes, or returns `None` if it has errors.
pub fn compiled_text(text: &str) -> Option<Compiled> {
    let mut sources = Sources::new();
    let file = sources.add("trial", text);
    let (scene, diagnostics) = elaborate(&mut sources, file, &elaborate::Options::default());
    compile_elaborated(&sources, scene, diagnostics)
}

/// Compiles a text to bytes, or returns `None` if it is refused.
pub fn compile_text(text: &str) -> Option<Vec<u8>> {
    compiled_text(text).map(|compiled| encode_file(&compiled.module))
}

/// Compiles clauses to bytes, or returns `None` if they are refused.
pub fn compile_clauses(text: &str) -> Option<Vec<u8>> {
    let mut sources = Sources::new();
    let file = sources.add("trial", text);
    let (scene, diagnostics) = parse_fidget_text(&sources, file);
    compile_elaborated(&sources, scene, diagnostics).map(|compiled| encode_file(&compiled.module))
}

/// Compiles an elaborated scene without errors, and checks that all diagnostics can be rendered.
fn compile_elaborated(
    sources: &Sources,
    scene: Option<Scene>,
    mut diagnostics: Vec<sdfc_lang::Diagnostic>,
) -> Option<Compiled> {
    let has_errors = diagnostics.iter().any(|diagnostic| diagnostic.is_error());
    assert_eq!(scene.is_none(), has_errors, "a scene, or errors");
    let compiled = scene.and_then(|scene| {
        let (compiled, compile_diagnostics) = compile(scene, &Options::default());
        let has_errors = compile_diagnostics
            .iter()
            .any(|diagnostic| diagnostic.is_error());
        assert_eq!(compiled.is_none(), has_errors, "a program, or errors");
        diagnostics.extend(compile_diagnostics);
        compiled
    });
    let diagnostics: Diagnostics = diagnostics.into_iter().collect();
    let message = diagnostics.render(sources, Style::Plain);
    assert_eq!(compiled.is_none(), message.contains("error["), "{message}");
    compiled
}

/// Checks the invariants of a compiled scene.
fn check_scene(compiled: &Compiled) {
    check_module(&compiled.module);
    check_round_trips(&compiled.module.distance);
    if let Some(surface) = &compiled.module.surface {
        check_round_trips(surface);
    }
    let mut updated = compiled.clone();
    updated.update(0.7);
    run_all(&updated.module.distance);
    compiled.generated();
}

/// Checks the clauses of a `.vm` file: refused with messages, or compiled to a file that reads back.
pub fn clauses(text: &str) -> CheckOutcome {
    let mut sources = Sources::new();
    let file = sources.add("trial", text);
    let (scene, diagnostics) = parse_fidget_text(&sources, file);
    match compile_elaborated(&sources, scene, diagnostics) {
        Some(compiled) => {
            check_scene(&compiled);
            CheckOutcome::Accepted
        }
        None => CheckOutcome::Refused,
    }
}

/// Checks the bytes of a `.sdfb` file: refused, or a verified module.
///
/// The module encodes to the same bytes and runs on every number type.
pub fn file(bytes: &[u8]) -> CheckOutcome {
    let mut module = match decode_file(bytes) {
        Ok(module) => module,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            return CheckOutcome::Refused;
        }
    };
    assert!(encode_file(&module) == bytes, "its module has other bytes");
    check_module(&module);
    for time in [1e30, 0.7, 0.0] {
        module.update(time);
    }
    if verify(&module.distance, module.uniforms.outputs.len(), false).is_ok() {
        check_round_trips(&module.distance);
    }
    run_all(&module.distance);
    raise(module).generated();
    CheckOutcome::Accepted
}

/// Checks the invariants of a module: its file reads back, and its programs run.
fn check_module(module: &Module) {
    let bytes = encode_file(module);
    let decoded =
        decode_file(&bytes).unwrap_or_else(|error| panic!("its file is refused: {error}"));
    assert!(
        encode_file(&decoded) == bytes,
        "its file reads back as another"
    );
    for program in [Some(&module.distance), module.surface.as_ref()] {
        let Some(program) = program else { continue };
        run_all(program);
    }
}

/// Checks that a verified program's words and listing read back.
///
/// Constants patched from the same result of the uniform program must have its value.
pub fn check_round_trips(program: &Program) {
    assert_eq!(decode(&encode(&program.code)).as_ref(), Ok(&program.code));
    let text = listing::print(program);
    let parsed = listing::parse(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert_eq!(parsed.code.len(), program.code.len());
    // Pool indices may differ where equal constants are shared differently. The text does not differ.
    assert_eq!(listing::print(&parsed), text);
}

/// Evaluates a verified program's tape on 64 points.
pub fn tape_values(
    program: &Program,
    tape: &Tape,
    clauses: &[Clause],
    points: &[F32x64; 3],
) -> F32x64 {
    let mut machine = TapeEvaluator::<f32>::new(tape.values, tape.points);
    *machine.inputs_mut() = *points;
    *machine.run(program, clauses, LANES)
}

/// Reports whether an intermediate value or gradient at a point is not finite.
///
/// The later results of raw arithmetic are then unspecified. For example, a minimum discards a NaN operand,
/// but a tape pruned to that operand does not.
pub fn has_nonfinite_intermediate(program: &Program, point: V3<f32>) -> bool {
    let code = program.code.iter().filter(|i| i.code != Opcode::Guard);
    let code: Vec<_> = code.copied().collect();
    (1..=code.len()).any(|length| {
        let prefix = Program {
            code: code[..length].to_vec(),
            ..program.clone()
        };
        let dual = gradient::<f32>(&prefix, point);
        let g = dual.gradient;
        ![dual.value, g.x, g.y, g.z].iter().all(|v| v.is_finite())
    })
}

/// Runs a verified program on every number type and as a tape, full and pruned.
///
/// Tapes yield the bits of single points in programs without guards and normals. Guards may state bounds
/// that do not hold, and only surfaces have normals.
pub fn run_all(program: &Program) {
    let points = points(1);
    let tape = Tape::new(program);
    let values = tape_values(program, &tape, &tape.clauses, &points);
    let mut codes = program.code.iter().map(|i| i.code);
    let is_comparable = codes.all(|code| code != Opcode::Guard && code != Opcode::Normal);
    for lane in [0, 31, 63] {
        let [x, y, z] = [0, 1, 2].map(|axis| points[axis].0[lane]);
        let single = evaluate::<f32>(program, V3::new(x, y, z));
        assert!(
            !is_comparable || equal_or_both_nan(values.0[lane], single),
            "{} in a batch, {single} alone at {x}, {y}, {z}\n{}",
            values.0[lane],
            listing::print(program)
        );
        gradient::<f32>(program, V3::new(x, y, z));
        evaluate_f64(program, [x, y, z].map(f64::from));
        let interval = |v: f32| Interval::between(f64::from(v), f64::from(v) + 0.5);
        evaluate::<Interval>(program, V3::new(interval(x), interval(y), interval(z)));
    }
    let mut duals = TapeEvaluator::<Dual<f32>>::new(tape.values, tape.points);
    *duals.inputs_mut() = with_identity_jacobian(&points);
    duals.run(program, &tape.clauses, LANES);
    let mut surfaces = TapeEvaluator::<Dual<f32>, SurfaceHook>::new(tape.values, tape.points);
    *surfaces.inputs_mut() = with_identity_jacobian(&points);
    surfaces.run(program, &tape.clauses, LANES);
    surfaces.hook().surface();

    let (mut chooser, mut pruner) = (Tracer::new(&tape), Pruner::default());
    pruner.reserve(tape.values, tape.points);
    let boxes = chooser.boxes();
    for axis in 0..3 {
        boxes[axis] = points[axis];
        boxes[axis + 3] = F32x64(points[axis].0.map(|v| v + 0.1));
    }
    chooser.run(program, &tape.clauses, LANES);
    let mut pruned = Vec::new();
    pruner.prune(
        &tape.clauses,
        |index| chooser.trace().choice(index, 31),
        &mut pruned,
    );
    tape_values(program, &tape, &pruned, &points);
}
