//! Every limit of the language is reached, reported with its position, and listed in `docs/limits.md`.

use sdfc_compiler::elaborate::{Loader, Options, elaborate};
use sdfc_compiler::export::{ExportError, Target, translate};
use sdfc_compiler::fidget_text::parse_fidget_text;
use sdfc_lang::{Diagnostics, Sources, Style};
use sdfc_trials::checks::compiled_text;

const LIMITS_PAGE: &str = include_str!("../../../docs/limits.md");

/// Loader of files that each import the next.
struct EndlessImports;

impl Loader for EndlessImports {
    fn load(&self, path: &str) -> Result<String, String> {
        let number: u32 = path.trim_end_matches(".sdf").parse().unwrap_or(0);
        Ok(format!(
            "import \"{}.sdf\" as next;\nlet a = 1;\n",
            number + 1
        ))
    }
}

/// Returns the rendered messages about a refused scene.
fn refusal_message(text: String) -> String {
    let mut sources = Sources::new();
    let file = sources.add("scene.sdf", text);
    let options = Options {
        loader: &EndlessImports,
        ..Options::default()
    };
    let (scene, diagnostics) = elaborate(&mut sources, file, &options);
    let diagnostics: Diagnostics = diagnostics.into_iter().collect();
    let message = diagnostics.render(&sources, Style::Plain);
    assert!(scene.is_none(), "{message}");
    message
}

#[test]
fn each_limit_is_reached_and_reported() {
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
            "calls nest more than 256 levels deep",
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
            "more than 1000 levels deep",
            format!("let a = [1];\n{}sphere(1)", "let a = [a];\n".repeat(1001)),
        ),
        (
            "5000000",
            "more than 5000000 steps",
            "fn f(n) = if n > 0 { f(n - 1) + f(n - 1) } else { 1 };\nsphere(f(60))".to_owned(),
        ),
        (
            "100000",
            "at most 100000 are allowed",
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
        (
            "1e18",
            "at most 1e18 is allowed",
            "sphere(1.1e18)".to_owned(),
        ),
    ];
    for (number, expected, text) in cases {
        let message = refusal_message(text);
        assert!(message.contains(expected), "{expected}: {message}");
        assert!(message.contains(".sdf:"), "without a place: {message}");
        assert!(
            LIMITS_PAGE.contains(&format!("| {number}")),
            "{number} is not on the page"
        );
    }
}

#[test]
fn different_numbers() {
    // Too many to build here in each test run. `evaluate.rs` tests that they are counted, and this checks
    // the page.
    assert!(LIMITS_PAGE.contains("| 8000000 |"));
}

#[test]
fn clauses() {
    let mut text = "_0 var-x\n".to_owned();
    for _ in 0..200_000 {
        text.push_str("_1 neg _0\n");
    }
    let mut sources = Sources::new();
    let file = sources.add("scene.vm", text);
    let (scene, diagnostics) = parse_fidget_text(&sources, file);
    let diagnostics: Diagnostics = diagnostics.into_iter().collect();
    let message = diagnostics.render(&sources, Style::Plain);
    assert!(
        scene.is_none() && message.contains("more than the 200000 clauses"),
        "{message}"
    );
    assert!(message.contains("scene.vm:200001:1"), "{message}");
    assert!(LIMITS_PAGE.contains("| 200000 |"));
}

#[test]
fn exports() {
    let spheres = "union(for i in 0..16001 { sphere(0.1 + i / 1000) })";
    let compiled = compiled_text(spheres).expect("it compiles");
    let error = translate(&compiled, Target::Wgsl).expect_err("it is too long");
    assert!(matches!(
        error,
        ExportError::TooLarge {
            allowed: 16_000,
            ..
        }
    ));
    assert!(LIMITS_PAGE.contains("| 16000 |"));
}

#[test]
fn slopes() {
    let numbers = [
        sdfc_compiler::analysis::slope::MAX_OPERATIONS,
        sdfc_compiler::analysis::slope::MAX_BOXES,
    ];
    let page = LIMITS_PAGE.replace('\n', " ");
    assert!(
        numbers
            .iter()
            .all(|number| page.contains(&format!(" {number} ")))
    );
}
