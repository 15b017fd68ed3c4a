//! Input from standard input, from pipes and devices, and of the largest size; wrong numbers of flags.

use super::sandbox::Sandbox;
use std::fmt::Write;
use std::process::Command;

#[test]
fn a_dash_is_standard_input_for_every_command() {
    let sandbox = Sandbox::new();
    let scene = "sphere(  0.5 ) // a ball\n";
    for command in [
        "check -",
        "info -",
        "compile - --emit asm -o -",
        "render - --size 8x8 --engine cpu",
        "render - --size 8x8 --engine cpu --lod 1 -o lod.png",
        "verify - --engines cpu --size 8x8",
    ] {
        let run = sandbox.run_on(command, scene);
        assert_eq!(run.code, 0, "{}", run.transcript());
    }
    assert_eq!(sandbox.files(), ["lod.png", "picture.png"]);
    let formatted = sandbox.run_on("fmt -", scene).ok();
    assert_eq!(formatted.stdout, b"sphere(0.5) // a ball\n");
    let unformatted = sandbox.run_on("fmt --check -", scene);
    assert_eq!(unformatted.code, 1, "{}", unformatted.transcript());
    // These need it for something else, or need a file that changes.
    for (command, reason) in [("query -", "points"), ("watch -", "does not change")] {
        let run = sandbox.run_on(command, scene);
        assert_eq!(run.code, 1, "{}", run.transcript());
        assert!(run.stderr.contains(reason), "{}", run.transcript());
    }
    let wrong = sandbox.run_on("check -", "sphere(");
    assert!(wrong.stderr.contains("--> -:1:"), "{}", wrong.transcript());
}

/// Reading a pipe without a writer would never end.
#[test]
#[cfg(unix)]
fn pipes_and_devices_are_refused() {
    let sandbox = Sandbox::new();
    let made = Command::new("mkfifo")
        .arg(sandbox.path("pipe.sdf"))
        .status();
    assert!(made.is_ok_and(|status| status.success()), "mkfifo");
    sandbox.write("scene.sdf", "import \"pipe.sdf\" as parts;\nsphere(1)");
    for (command, code) in [
        ("check pipe.sdf", 3),
        ("fmt pipe.sdf", 3),
        ("render /dev/zero -o out.png", 3),
        ("check scene.sdf", 1),
    ] {
        let run = sandbox.run(command);
        assert_eq!(run.code, code, "{}", run.transcript());
        assert!(
            run.stderr.contains("a pipe or a device"),
            "{}",
            run.transcript()
        );
    }
}

/// Returns a line by its number.
type Line = fn(usize) -> String;

/// A search through all names for each error would take minutes.
#[test]
fn texts_of_the_largest_size_are_answered() {
    let lines: [(&str, Line); 7] = [
        ("unknown names", |_| "let x = height;\n".to_owned()),
        ("many unknown names", |i| format!("let x{i} = height{i};\n")),
        ("functions", |i| format!("fn f{i}(x) = x + offset;\n")),
        ("params", |i| format!("param a{i} = 1 in 0..=5;\n")),
        ("parts", |i| format!("part p{i} = sphere(1);\n")),
        ("cameras", |i| format!("camera c{i} {{ fow: 30deg }}\n")),
        ("one line", |i| format!("x{i} + ")),
    ];
    let sandbox = Sandbox::new();
    for (name, line) in lines {
        let mut text = String::new();
        for i in 0.. {
            let _ = write!(text, "{}", line(i));
            if text.len() > 1_000_000 {
                break;
            }
        }
        sandbox.write("scene.sdf", text + "sphere(1)\n");
        // A run that hangs is stopped by the sandbox.
        let run = sandbox.run("check scene.sdf");
        assert!(run.code <= 1, "{name}: {}", run.code);
        assert!(
            run.stderr.len() < 40_000,
            "{name}: {} bytes",
            run.stderr.len()
        );
    }
}

#[test]
fn the_scene_is_not_replaced_by_a_result() {
    let sandbox = Sandbox::new();
    sandbox.write("parts.sdf", "fn ball() { sphere(1) }\n");
    sandbox.write(
        "scene.sdf",
        "import \"parts.sdf\" as parts;\nparts::ball()\n",
    );
    for command in [
        "compile scene.sdf -o scene.sdf",
        "compile scene.sdf --emit vm -o ./parts.sdf",
        "bench scene.sdf --engines cpu --width 16 --samples 16 --report scene.sdf",
        "bench scene.sdf --engines cpu --width 16 --samples 16 --markdown a.svg",
    ] {
        let run = sandbox.run(command);
        assert_eq!(run.code, 1, "{}", run.transcript());
    }
    assert!(sandbox.read("scene.sdf").starts_with(b"import"));
    assert_eq!(sandbox.files(), ["parts.sdf", "scene.sdf"]);
}

/// Line ends of old editors end comments: nothing is dropped.
#[test]
fn a_carriage_return_ends_a_comment() {
    let sandbox = Sandbox::new();
    let scene = "// a\rsphere(1) // b\r| box(1)\r";
    let formatted = sandbox.run_on("fmt -", scene).ok();
    assert_eq!(formatted.text(), "// a\nsphere(1) // b\n    | box(1)\n");
}

#[test]
fn long_names_and_imported_files_are_no_values() {
    let sandbox = Sandbox::new();
    let run = sandbox.run_on("check -", &format!("sphere({})", "a".repeat(900_000)));
    assert!(run.stderr.len() < 4_000, "{} bytes", run.stderr.len());
    sandbox.write("parts.sdf", "fn ball() { sphere(1) }\n");
    let run = sandbox.run_on("check -", "import \"parts.sdf\" as parts;\nparts\n");
    assert!(run.stderr.contains("parts::NAME"), "{}", run.transcript());
    assert!(!run.stderr.contains("W0201"), "{}", run.transcript());
}

#[test]
fn line_ends_stay_as_they_are() {
    let sandbox = Sandbox::new();
    sandbox.write("scene.sdf", "let a=1;\r\nsphere( a )\r\n");
    sandbox.run("fmt scene.sdf").ok();
    assert_eq!(sandbox.read("scene.sdf"), b"let a = 1;\r\nsphere(a)\r\n");
    sandbox.run("fmt --check scene.sdf").ok();
}

/// A wrong flag is a wrong command line, whatever is wrong with it.
#[test]
fn wrong_numbers_of_flags_end_with_the_same_code() {
    let sandbox = Sandbox::with_scene("sphere(1)");
    for flag in [
        "--size 640",
        "--size 0x10",
        "--size -3x4",
        "--size 20000x3",
        "--far -1",
        "--far 0",
        "--exposure -1",
        "--aa 0",
        "--aa 17",
        "--steps 0",
        "--far nan",
    ] {
        let run = sandbox.run(&format!("render scene.sdf -o out.png {flag}"));
        assert_eq!(run.code, 2, "{}", run.transcript());
    }
    assert_eq!(sandbox.files(), ["scene.sdf"]);
}

#[test]
fn a_comparison_ends_at_its_limit() {
    let sandbox = Sandbox::with_scene("box(1).twist(40deg) |[0.2] torus(1, 0.2)");
    let run = sandbox.run("verify scene.sdf --engines reference,cpu --size 400x300 --limit 1ms");
    assert_eq!(run.code, 1, "{}", run.transcript());
    assert!(run.stderr.contains("--limit"), "{}", run.transcript());
}
