//! Every limit of the language is hit, said with its place, and stands in `docs/limits.md`.

use sdfc_compiler::clauses::parse_clauses;
use sdfc_compiler::elaborate::{Loader, Options, elaborate};
use sdfc_compiler::export::{ExportError, Target, translate};
use sdfc_lang::{Diagnostics, Sources, Style};
use sdfc_trials::checks::compiled_text;

const PAGE: &str = include_str!("../../../docs/limits.md");

/// Files that each import the next.
struct Endless;

impl Loader for Endless {
    fn load(&self, path: &str) -> Result<String, String> {
        let number: u32 = path.trim_end_matches(".sdf").parse().unwrap_or(0);
        Ok(format!(
            "import \"{}.sdf\" as next;\nlet a = 1;\n",
            number + 1
        ))
    }
}

/// What is said about a scene that is refused.
fn refused(text: String) -> String {
    let mut sources = Sources::new();
    let file = sources.add("scene.sdf", text);
    let options = Options {
        loader: &Endless,
        ..Options::default()
    };
    let (scene, found) = elaborate(&mut sources, file, &options);
    let found: Diagnostics = found.into_iter().collect();
    let said = found.render(&sources, Style::Plain);
    assert!(scene.is_none(), "{said}");
    said
}

#[test]
fn each_is_hit_and_said() {
    let nested = |open: &str, middle: &str, close: &str, depth| {
        format!("{}{middle}{}", open.repeat(depth), close.repeat(depth))
    };
    let cases: Vec<(&str, &str, String)> = vec![
        ("9961472", "9961472 are allowed", "a|".repeat(4_980_737)),
        ("200", "more than 200 levels", nested("(", "1", ")", 201)),
        (
            "256",
            "at most 256 files",
            "import \"1.sdf\" as a;\nsphere(1)".to_owned(),
        ),
        (
            "256",
            "calls go more than 256 deep",
            "fn f(n) = f(n + 1);\nsphere(f(0))".to_owned(),
        ),
        (
            "6000",
            "more than 6000 levels",
            format!(
                "fn f(n) = {};\nsphere(f(0))",
                nested("abs(", "f(n + 1)", ")", 60)
            ),
        ),
        (
            "1000",
            "more than 1000 deep",
            format!("let a = [1];\n{}sphere(1)", "let a = [a];\n".repeat(1001)),
        ),
        (
            "5000000",
            "more than 5000000 steps",
            "fn f(n) = if n > 0 { f(n - 1) + f(n - 1) } else { 1 };\nsphere(f(60))".to_owned(),
        ),
        (
            "100000",
            "100000 are the most",
            "for i in 0..100001 { sphere(1) }".to_owned(),
        ),
        (
            "100000",
            "at most 100000 elements",
            "let a = for i in 0..60000 { i };\nlet b = concat(a, a);\nsphere(1)".to_owned(),
        ),
        (
            "400000",
            "more than 400000 shapes",
            "for i in 0..500 { for j in 0..500 { sphere(0.1).translate(i, j, 0) } }".to_owned(),
        ),
        (
            "1000000",
            "more than 1000000 shapes, each counted",
            format!(
                "let a = sphere(1);\n{}a",
                "let a = a | a.translate(1, 0, 0);\n".repeat(60)
            ),
        ),
        (
            "500",
            "more than 500 deep",
            format!("sphere(1){}", ".offset(0.1)".repeat(501)),
        ),
        (
            "16",
            "from 1 to 16",
            "field(fn(p) => fbm(p, octaves: 17))".to_owned(),
        ),
        ("1e18", "1e18 is the most", "sphere(1.1e18)".to_owned()),
    ];
    for (number, wanted, text) in cases {
        let said = refused(text);
        assert!(said.contains(wanted), "{wanted}: {said}");
        assert!(said.contains(".sdf:"), "without a place: {said}");
        assert!(
            PAGE.contains(&format!("| {number}")),
            "{number} is not on the page"
        );
    }
}

#[test]
fn different_numbers() {
    // Too many to build them here for each run of the tests; that they are counted is seen in
    // `evaluate.rs`, and the page must not lag behind.
    assert!(PAGE.contains("| 8000000 |"));
}

#[test]
fn clauses() {
    let mut text = "_0 var-x\n".to_owned();
    for _ in 0..200_000 {
        text.push_str("_1 neg _0\n");
    }
    let mut sources = Sources::new();
    let file = sources.add("scene.vm", text);
    let (scene, found) = parse_clauses(&sources, file);
    let found: Diagnostics = found.into_iter().collect();
    let said = found.render(&sources, Style::Plain);
    assert!(
        scene.is_none() && said.contains("more than the 200000 clauses"),
        "{said}"
    );
    assert!(said.contains("scene.vm:200001:1"), "{said}");
    assert!(PAGE.contains("| 200000 |"));
}

#[test]
fn exports() {
    let balls = "union(for i in 0..16001 { sphere(0.1 + i / 1000) })";
    let compiled = compiled_text(balls).expect("it compiles");
    let error = translate(&compiled, Target::Wgsl).expect_err("it is too long");
    assert!(matches!(
        error,
        ExportError::TooLarge {
            allowed: 16_000,
            ..
        }
    ));
    assert!(PAGE.contains("| 16000 |"));
}

#[test]
fn slopes() {
    let numbers = [
        sdfc_compiler::slope::MAX_OPERATIONS,
        sdfc_compiler::slope::MAX_BOXES,
    ];
    let page = PAGE.replace('\n', " ");
    assert!(
        numbers
            .iter()
            .all(|number| page.contains(&format!(" {number} ")))
    );
}
