//! What must hold of an input, whatever it is. A check panics where it does not.

use crate::campaign::Verdict;
use crate::programs::points;
use sdfc_compiler::clauses::parse_clauses;
use sdfc_compiler::compile::{Compiled, Options, compile};
use sdfc_compiler::elaborate::{self, elaborate};
use sdfc_compiler::raise::raise;
use sdfc_compiler::scene::Scene;
use sdfc_lang::{Diagnostics, Sources, Style, parse, print};
use sdfc_vm::dual::Dual;
use sdfc_vm::encode::{decode, encode};
use sdfc_vm::evaluate::{evaluate, evaluate_f64, gradient};
use sdfc_vm::file::{decode_file, encode_file};
use sdfc_vm::interval::Interval;
use sdfc_vm::lanes::{Column, LANES, seeded};
use sdfc_vm::listing;
use sdfc_vm::program::{Code, Module, Program};
use sdfc_vm::surface::Surfaces;
use sdfc_vm::tape::choose::Chooser;
use sdfc_vm::tape::machine::Machine;
use sdfc_vm::tape::prune::Pruner;
use sdfc_vm::tape::{Clause, Tape};
use sdfc_vm::vector::V3;
use sdfc_vm::verify::verify;

/// Equal bits, or both not a number: raw arithmetic on random numbers may well have none.
pub fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

/// A scene's text: it is refused with messages, or compiled to a file that reads back. What can be
/// parsed is printed in a form that prints as itself and means the same.
pub fn text(text: &str) -> Verdict {
    let mut sources = Sources::new();
    let file = sources.add("trial", text);
    let (tree, found) = parse(&sources, file);
    let refused = found.iter().any(|found| found.is_error());
    assert_eq!(tree.is_none(), refused, "a tree, or errors");
    let printed = tree.map(|tree| print(&tree));
    if let Some(printed) = &printed {
        assert_eq!(
            &canonical(printed),
            printed,
            "printing is not a fixed point"
        );
    }
    let (scene, found) = elaborate(&mut sources, file, &elaborate::Options::default());
    let Some(compiled) = built(&sources, scene, found) else {
        return Verdict::Refused;
    };
    let printed = printed.expect("what compiles was parsed");
    if text.len() < 20_000 {
        let again = compiled_text(&printed).expect("what is printed compiles");
        assert!(
            encode_file(&again.module) == encode_file(&compiled.module),
            "what is printed means something else:\n{printed}"
        );
    }
    scene_holds(&compiled);
    Verdict::Accepted
}

/// The text as it is printed.
fn canonical(text: &str) -> String {
    let mut sources = Sources::new();
    let file = sources.add("printed", text);
    let (tree, found) = parse(&sources, file);
    let tree = tree.unwrap_or_else(|| panic!("what is printed is no scene: {found:?}\n{text}"));
    print(&tree)
}

/// The scene of a text, compiled with all passes, if nothing is wrong with it.
pub fn compiled_text(text: &str) -> Option<Compiled> {
    let mut sources = Sources::new();
    let file = sources.add("trial", text);
    let (scene, found) = elaborate(&mut sources, file, &elaborate::Options::default());
    built(&sources, scene, found)
}

/// What it takes to compile a text to bytes, or to say why not.
pub fn compile_text(text: &str) -> Option<Vec<u8>> {
    compiled_text(text).map(|compiled| encode_file(&compiled.module))
}

/// What it takes to compile clauses to bytes, or to say why not.
pub fn compile_clauses(text: &str) -> Option<Vec<u8>> {
    let mut sources = Sources::new();
    let file = sources.add("trial", text);
    let (scene, found) = parse_clauses(&sources, file);
    built(&sources, scene, found).map(|compiled| encode_file(&compiled.module))
}

/// Compiles a scene that nothing is wrong with. What there is to say can be shown.
fn built(
    sources: &Sources,
    scene: Option<Scene>,
    mut found: Vec<sdfc_lang::Diagnostic>,
) -> Option<Compiled> {
    let refused = found.iter().any(|found| found.is_error());
    assert_eq!(scene.is_none(), refused, "a scene, or errors");
    let compiled = scene.and_then(|scene| {
        let (compiled, more) = compile(scene, &Options::default());
        let refused = more.iter().any(|found| found.is_error());
        assert_eq!(compiled.is_none(), refused, "a program, or errors");
        found.extend(more);
        compiled
    });
    let found: Diagnostics = found.into_iter().collect();
    let said = found.render(sources, Style::Plain);
    assert_eq!(compiled.is_none(), said.contains("error["), "{said}");
    compiled
}

/// What holds of every scene that was compiled.
fn scene_holds(compiled: &Compiled) {
    module_holds(&compiled.module);
    forms(&compiled.module.distance);
    if let Some(surface) = &compiled.module.surface {
        forms(surface);
    }
    let mut moved = compiled.clone();
    moved.update(0.7);
    run(&moved.module.distance);
    compiled.generated();
}

/// Clauses of a `.vm` file: refused with messages, or compiled to a file that reads back.
pub fn clauses(text: &str) -> Verdict {
    let mut sources = Sources::new();
    let file = sources.add("trial", text);
    let (scene, found) = parse_clauses(&sources, file);
    match built(&sources, scene, found) {
        Some(compiled) => {
            scene_holds(&compiled);
            Verdict::Accepted
        }
        None => Verdict::Refused,
    }
}

/// The bytes of a `.sdfb` file: refused, or a verified module that encodes to the same bytes and runs
/// on every number type.
pub fn file(bytes: &[u8]) -> Verdict {
    let mut module = match decode_file(bytes) {
        Ok(module) => module,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            return Verdict::Refused;
        }
    };
    assert!(encode_file(&module) == bytes, "its module has other bytes");
    module_holds(&module);
    for time in [1e30, 0.7, 0.0] {
        module.update(time);
    }
    if verify(&module.distance, module.uniforms.outputs.len(), false).is_ok() {
        forms(&module.distance);
    }
    run(&module.distance);
    raise(module).generated();
    Verdict::Accepted
}

/// What holds of every module: its forms read back, its programs run.
fn module_holds(module: &Module) {
    let bytes = encode_file(module);
    let back = decode_file(&bytes).unwrap_or_else(|error| panic!("its file is refused: {error}"));
    assert!(
        encode_file(&back) == bytes,
        "its file reads back as another"
    );
    for program in [Some(&module.distance), module.surface.as_ref()] {
        let Some(program) = program else { continue };
        run(program);
    }
}

/// The forms of a verified program read back: words, and the listing. Numbers that follow the same
/// result of the uniform program must have its value.
pub fn forms(program: &Program) {
    assert_eq!(decode(&encode(&program.code)).as_ref(), Ok(&program.code));
    let text = listing::print(program);
    let parsed = listing::parse(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert_eq!(parsed.code.len(), program.code.len());
    // Pool indices may differ where constants happen to be shared otherwise; text does not.
    assert_eq!(listing::print(&parsed), text);
}

/// A verified program's tape on 64 points.
pub fn values_at(
    program: &Program,
    tape: &Tape,
    clauses: &[Clause],
    points: &[Column; 3],
) -> Column {
    let mut machine = Machine::<f32>::new(tape.values, tape.points);
    *machine.seed() = *points;
    *machine.run(program, clauses, LANES)
}

/// Whether a number on the way to the value or the gradient at a point is not finite: what raw
/// arithmetic makes of that later is not promised. (A smaller operand that is none is lost in a minimum,
/// but not without it.)
pub fn meets_none(program: &Program, point: V3<f32>) -> bool {
    let code = program.code.iter().filter(|i| i.code != Code::Guard);
    let code: Vec<_> = code.copied().collect();
    (1..=code.len()).any(|length| {
        let beginning = Program {
            code: code[..length].to_vec(),
            ..program.clone()
        };
        let found = gradient::<f32>(&beginning, point);
        let g = found.gradient;
        ![found.value, g.x, g.y, g.z].iter().all(|v| v.is_finite())
    })
}

/// Runs a verified program on every number type and as a tape, whole and pruned. Tapes give the bits
/// of single points where no guard says what may not be true, and where no normal is asked for, which
/// only surfaces have.
pub fn run(program: &Program) {
    let points = points(1);
    let tape = Tape::of(program);
    let values = values_at(program, &tape, &tape.clauses, &points);
    let mut codes = program.code.iter().map(|i| i.code);
    let tells = codes.all(|code| code != Code::Guard && code != Code::Normal);
    for lane in [0, 31, 63] {
        let [x, y, z] = [0, 1, 2].map(|axis| points[axis].0[lane]);
        let alone = evaluate::<f32>(program, V3::of(x, y, z));
        assert!(
            !tells || same(values.0[lane], alone),
            "{} in a batch, {alone} alone at {x}, {y}, {z}\n{}",
            values.0[lane],
            listing::print(program)
        );
        gradient::<f32>(program, V3::of(x, y, z));
        evaluate_f64(program, [x, y, z].map(f64::from));
        let side = |v: f32| Interval::between(f64::from(v), f64::from(v) + 0.5);
        evaluate::<Interval>(program, V3::of(side(x), side(y), side(z)));
    }
    let mut duals = Machine::<Dual<f32>>::new(tape.values, tape.points);
    *duals.seed() = seeded(&points);
    duals.run(program, &tape.clauses, LANES);
    let mut surfaces = Machine::<Dual<f32>, Surfaces>::new(tape.values, tape.points);
    *surfaces.seed() = seeded(&points);
    surfaces.run(program, &tape.clauses, LANES);
    surfaces.attachment().surface();

    let (mut chooser, mut pruner) = (Chooser::new(&tape), Pruner::default());
    pruner.reserve(tape.values, tape.points);
    let boxes = chooser.boxes();
    for axis in 0..3 {
        boxes[axis] = points[axis];
        boxes[axis + 3] = Column(points[axis].0.map(|v| v + 0.1));
    }
    chooser.run(program, &tape.clauses, LANES);
    let mut pruned = Vec::new();
    pruner.prune(
        &tape.clauses,
        |place| chooser.decided().choice(place, 31),
        &mut pruned,
    );
    values_at(program, &tape, &pruned, &points);
}
