//! Bad input: meaningless scenes, oversized scenes, and files that are not scenes. Each ends with a
//! message and the exit code 1, and leaves no file behind.

use super::sandbox::Sandbox;
use insta::assert_snapshot;

/// Tries to draw an invalid scene and returns the message.
#[track_caller]
fn refused(text: impl AsRef<[u8]>) -> String {
    let sandbox = Sandbox::new();
    sandbox.write("scene.sdf", text);
    let run = sandbox.run("render scene.sdf -o out.png --size 8x8 --engine cpu");
    assert_eq!(run.code, 1, "{}", run.transcript());
    assert!(run.stdout.is_empty(), "{}", run.transcript());
    assert_eq!(sandbox.files(), ["scene.sdf"], "{}", run.transcript());
    run.stderr
}

#[test]
fn an_empty_file() {
    assert_snapshot!(refused(""));
    assert_snapshot!(refused("// nothing but this\n"));
}

#[test]
fn names_types_and_units() {
    assert_snapshot!(refused("spehre(1)"));
    assert_snapshot!(refused("sphere(X)"));
    assert_snapshot!(refused("box(1).rotate(90, X)"));
    assert_snapshot!(refused("sphere(20deg)"));
}

#[test]
fn numbers_that_make_no_shape() {
    assert_snapshot!(refused("let n = 0;\nsphere(1 / n)"));
    assert_snapshot!(refused("sphere(0) | sphere(-1)"));
    assert_snapshot!(refused("cylinder(from: [1, 2, 3], to: [1, 2, 3], r: 1)"));
    assert_snapshot!(refused(
        "param h = 1 in 0.5..=2;\nsphere(1 / (h - 1)) | box(1)"
    ));
}

#[test]
fn work_without_end() {
    assert_snapshot!(refused("fn f(n) = f(n + 1);\nf(0)"));
    assert_snapshot!(refused("union(for i in 0..1000000000 { sphere(1) })"));
    assert_snapshot!(refused(
        "union(for i in 0..100000 { for j in 0..100000 { sphere(1).translate(i, j, 0) } })"
    ));
}

#[test]
fn ten_thousand_parentheses() {
    let nested = format!("{}sphere(1){}", "(".repeat(10_000), ")".repeat(10_000));
    let message = refused(nested);
    assert!(
        message.len() < 20_000,
        "a message is for people: {} bytes",
        message.len()
    );
    assert!(message.starts_with("error[E0109]"), "{message}");
    // The same input, unterminated.
    let message = refused("(".repeat(10_000));
    assert!(message.starts_with("error[E0109]"), "{message}");
}

#[test]
fn ten_megabytes() {
    let line = "let a = 1;\n";
    assert_snapshot!(refused(line.repeat(10_000_000 / line.len())));
    // Inputs of the maximum size take negligible time.
    let lines = line.repeat((1 << 20) / line.len() - 2);
    let message = refused(lines);
    assert!(message.contains("no shape"), "{message}");
}

#[test]
fn bytes_that_are_no_text() {
    assert_snapshot!(refused(b"sphere(1)\n// caf\xe9\n"));
    assert_snapshot!(refused(b"\0\0\0\0"));
}

#[test]
fn several_errors_are_reported_at_once() {
    let sandbox = Sandbox::with_scene("let a = sphere(ra: 1);\nlet b = bxo(1);\na | b | c\n");
    let run = sandbox.run("check scene.sdf");
    assert_eq!(run.code, 1);
    assert_snapshot!(run.stderr);
}

#[test]
fn imports() {
    let sandbox = Sandbox::new();
    sandbox.write("a.sdf", "import \"b.sdf\" as b;\nsphere(b::r)");
    sandbox.write("b.sdf", "import \"a.sdf\" as a;\nlet r = 1;");
    sandbox.write(
        "missing.sdf",
        "import \"parts/nut.sdf\" as nut;\nnut::whole",
    );
    sandbox.write(
        "outside.sdf",
        "import \"../secret.sdf\" as secret;\nsecret::x",
    );
    let run = sandbox.run("check a.sdf missing.sdf outside.sdf");
    assert_eq!(run.code, 1);
    assert_snapshot!(run.transcript());
}

#[test]
#[cfg(unix)]
fn links_do_not_lead_out_of_the_folder() {
    let sandbox = Sandbox::new();
    sandbox.write("elsewhere/secret.sdf", "let r = 1;");
    sandbox.write(
        "here/scene.sdf",
        "import \"link.sdf\" as link;\nsphere(link::r)",
    );
    std::os::unix::fs::symlink(
        sandbox.path("elsewhere/secret.sdf"),
        sandbox.path("here/link.sdf"),
    )
    .expect("a link");
    let run = sandbox.run("check here/scene.sdf");
    assert_eq!(run.code, 1);
    assert_snapshot!(run.stderr);
}
