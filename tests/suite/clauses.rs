//! Scenes written as clauses (`--emit vm`), evaluated by a separate interpreter, and clauses imported into scenes.

use crate::corpus::{compiled, compiled_scene, compiled_text, name, on_large_stack, scenes};
use sdfc_compiler::elaborate::{Loader, Options, elaborate};
use sdfc_compiler::export::fidget_clauses;
use sdfc_compiler::passes::PassOptions;
use sdfc_lang::Sources;
use sdfc_trials::random::Random;
use sdfc_vm::evaluate::evaluate_f64;
use sdfc_vm::program::Program;
use std::collections::HashMap;

/// Number of points of a scene.
const POINTS: usize = 2000;

/// Returns the value of the last clause, by the definitions of Fidget.
fn value(text: &str, [x, y, z]: [f64; 3]) -> f64 {
    let mut values: HashMap<&str, f64> = HashMap::new();
    let mut last = f64::NAN;
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let operand = |i: usize| values[words[i + 2]];
        let truth = |is_true: bool| if is_true { 1.0 } else { 0.0 };
        last = match words[1] {
            "const" => words[2].parse().expect("a number"),
            "var-x" => x,
            "var-y" => y,
            "var-z" => z,
            "neg" => -operand(0),
            "abs" => operand(0).abs(),
            "sqrt" => operand(0).sqrt(),
            "square" => operand(0).powi(2),
            "floor" => operand(0).floor(),
            "sin" => operand(0).sin(),
            "cos" => operand(0).cos(),
            "exp" => operand(0).exp(),
            "ln" => operand(0).ln(),
            "not" => truth(operand(0) == 0.0),
            "add" => operand(0) + operand(1),
            "sub" => operand(0) - operand(1),
            "mul" => operand(0) * operand(1),
            "div" => operand(0) / operand(1),
            "min" => operand(0).min(operand(1)),
            "max" => operand(0).max(operand(1)),
            "atan2" => operand(0).atan2(operand(1)),
            "compare" => truth(operand(0) > operand(1)) - truth(operand(0) < operand(1)),
            "and" if operand(0) == 0.0 => operand(0),
            "and" => operand(1),
            "or" if operand(0) == 0.0 => operand(1),
            "or" => operand(0),
            other => panic!("`{other}` is no operation of Fidget"),
        };
        values.insert(words[0], last);
    }
    last
}

/// Returns the number of points at which a program and clauses have different signs. Points near a surface are left
/// out.
fn different_signs(program: &Program, clauses: &str, scene: &str) -> usize {
    let mut random = Random::for_case(scene);
    let different = (0..POINTS).filter(|i| {
        let size = [0.4, 1.5, 5.0, 20.0][i % 4];
        let p = std::array::from_fn(|_| size * (2.0 * random.unit() - 1.0));
        let expected = evaluate_f64(program, p);
        expected.abs() > 1e-4 * size && (expected < 0.0) != (value(clauses, p) < 0.0)
    });
    different.count()
}

#[test]
fn clauses_have_the_signs_of_their_scene() {
    let mut written = 0;
    for path in ["examples", "tests/scenes"].into_iter().flat_map(scenes) {
        let mut compiled = on_large_stack(|| compiled(&path, PassOptions::default()));
        compiled.update(0.0);
        let text = std::fs::read_to_string(&path).expect("the scene can be read");
        let is_random = ["noise", "fbm", "hash"]
            .iter()
            .any(|word| text.contains(word));
        match on_large_stack(|| fidget_clauses(&compiled)) {
            Ok(clauses) => {
                let program = &compiled.module.distance;
                let different = different_signs(program, &clauses, &name(&path));
                assert_eq!(different, 0, "{}", path.display());
                written += 1;
            }
            Err(error) => assert!(is_random, "{}: {error}", path.display()),
        }
    }
    assert!(written >= 35, "{written} scenes were written");
}

/// Half spaces read one coordinate; the result is the last clause, and the file is no 2-D shape.
#[test]
fn half_spaces_are_written_as_solids() {
    for (text, outside) in [
        ("plane(X)", [1.0, -1.0, -1.0]),
        ("plane(Y, at: 0)", [-1.0, 1.0, -1.0]),
        ("plane(Z)", [-1.0, -1.0, 1.0]),
    ] {
        let clauses = fidget_clauses(&compiled_text(text, PassOptions::default()));
        let clauses = clauses.unwrap_or_else(|error| panic!("{text}: {error}"));
        assert!(clauses.contains("var-z"), "{clauses}");
        assert!(value(&clauses, outside) > 0.0, "{clauses}");
        assert!(value(&clauses, outside.map(|v: f64| -v)) < 0.0, "{clauses}");
    }
}

/// A folder with one file.
struct OneFile(&'static str);

impl Loader for OneFile {
    fn load(&self, _: &str) -> Result<String, String> {
        Ok(self.0.to_owned())
    }
}

/// Compiles a scene that imports `part.vm`.
fn program_with(part: &'static str, text: &str) -> Program {
    let mut sources = Sources::new();
    let file = sources.add("scene.sdf", text);
    let options = Options {
        loader: &OneFile(part),
        ..Options::default()
    };
    let (scene, diagnostics) = elaborate(&mut sources, file, &options);
    let scene = scene.unwrap_or_else(|| panic!("{diagnostics:?}"));
    compiled_scene(scene).module.distance
}

/// A ball of clauses is the ball of the language, wherever it is moved, blended and painted.
#[test]
fn imported_clauses_are_a_shape() {
    let ball = "x var-x\ny var-y\nz var-z\na square x\nb square y\nc square z\n\
                d add a b\ne add d c\nf sqrt e\nr const 0.5\ng sub f r\n";
    for rest in [
        "ball",
        "ball.translate(1, 2, 0).scale(2) |[0.2] plane(Y)",
        "(ball - box(1).translate(0.5, 0, 0)).color(#c04030) | ball.translate(3, 0, 0)",
        "ball.repeat(2, [3, 1, 1])",
    ] {
        let imported = program_with(ball, &format!("import \"part.vm\" as ball;\n{rest}\n"));
        let written = program_with(ball, &format!("let ball = sphere(0.5);\n{rest}\n"));
        let mut random = Random::for_case(rest);
        for _ in 0..POINTS {
            let p = std::array::from_fn(|_| 4.0 * (2.0 * random.unit() - 1.0));
            let [value, expected] = [&imported, &written].map(|program| evaluate_f64(program, p));
            let is_same = (value < 0.0) == (expected < 0.0);
            assert!(
                is_same || expected.abs() < 1e-4,
                "{rest} at {p:?}: {value}, not {expected}"
            );
        }
    }
}
