//! Values from the command line: `-p`, picture flags, and invalid command lines.

use super::sandbox::Sandbox;
use insta::assert_snapshot;

const SCENE: &str = "\
/// The size.
param size = 1 in 0.5..2;
param count = 2 in 1..=4;
param turn = 45deg in 0deg..90deg;
param paint: color = #ff8800;
param open = true;
param at = [1, 2, 3];
camera hero { from: [0, 1, 5], look: [0, 0, 0] }
part ball = sphere(size).color(paint);
part rest = union(for i in 0..count { box(if open { 1 } else { 2 }).rotate(turn, Y).translate(at * i) });
ball | rest
";

#[test]
fn every_kind_of_value() {
    let sandbox = Sandbox::with_scene(SCENE);
    let values =
        "-p size=1.5 -p count=3 -p turn=30deg -p paint=#204060 -p open=false -p at=[4,5,6]";
    let run = sandbox.run(&format!("info scene.sdf --json {values}")).ok();
    let value = |name: &str| {
        let info = run.json();
        let params = info["params"].as_array().expect("a list").clone();
        let param = params.into_iter().find(|param| param["name"] == name);
        param.unwrap_or_else(|| panic!("no {name}"))["value"].clone()
    };
    assert_eq!(value("size"), serde_json::json!([1.5]));
    assert_eq!(value("count"), serde_json::json!([3.0]));
    assert_eq!(value("open"), serde_json::json!([0.0]));
    assert_eq!(value("at"), serde_json::json!([4.0, 5.0, 6.0]));
    let turn = value("turn")[0].as_f64().expect("a number");
    assert!((turn - 30_f64.to_radians()).abs() < 1e-12, "{turn}");
    // sRGB 0x20 is 0.0144 in linear light.
    let red = value("paint")[0].as_f64().expect("a number");
    assert!((red - 0.014_444).abs() < 1e-5, "{red}");
}

#[test]
fn values_that_do_not_fit() {
    let sandbox = Sandbox::with_scene(SCENE);
    let wrong = [
        "sise=1",
        "size=7",
        "size=nan",
        "size=NaN",
        "size=inf",
        "size=1e999",
        "size=",
        "size",
        "size=big",
        "count=2.5",
        "count=9",
        "turn=30",
        "turn=180deg",
        "paint=#12",
        "open=1",
        "at=[1,2]",
        "=1",
        "",
    ];
    let mut message = String::new();
    for value in wrong {
        let run = sandbox.run(&format!(
            "render scene.sdf -o out.png --size 8x8 --engine cpu -p{value}"
        ));
        assert_eq!(
            run.code,
            if value.is_empty() { 2 } else { 1 },
            "{}",
            run.transcript()
        );
        message.push_str(&run.transcript());
        message.push('\n');
    }
    assert_snapshot!(message);
    assert_eq!(sandbox.files(), ["scene.sdf"]);
}

#[test]
fn parts_cameras_and_sizes() {
    let sandbox = Sandbox::with_scene(SCENE);
    let draw = |more: &str| {
        sandbox.run(&format!(
            "render scene.sdf -o out.png --size 8x8 --engine cpu {more}"
        ))
    };
    draw("--part ball --camera hero").ok();
    std::fs::remove_file(sandbox.path("out.png")).expect("the picture");
    let mut message = String::new();
    // The last value of a repeated flag counts, so that scripts can have defaults.
    for (more, code) in [
        ("--part bal", 1),
        ("--camera heros", 1),
        ("--size 0x8", 2),
        ("--size 99999x8", 2),
        ("--size 16384x16384", 1),
        ("--aa 99", 2),
        ("--far 0", 2),
    ] {
        let run = draw(more);
        assert_eq!(run.code, code, "{}", run.transcript());
        message.push_str(&run.transcript());
        message.push('\n');
    }
    let run = sandbox.run("render scene.sdf -o out.jpg --size 8x8 --engine cpu");
    assert_eq!(run.code, 1, "{}", run.transcript());
    message.push_str(&run.transcript());
    assert_snapshot!(message);
    assert_eq!(sandbox.files(), ["scene.sdf"]);
}

/// Arguments that are rejected before any file is read give the exit code 2.
#[test]
fn a_wrong_command_line() {
    let sandbox = Sandbox::new();
    let mut message = String::new();
    for arguments in [
        "",
        "rendr scene.sdf",
        "render",
        "render scene.sdf --frobnicate",
        "render scene.sdf --mode shadey",
        "render scene.sdf --engine gpu",
        "render scene.sdf --size large",
        "render scene.sdf --at noon",
        "render scene.sdf --no-pass foldd",
        "render scene.sdf --lod 0",
        "compile scene.sdf --lod half",
        "render scene.sdf -O7",
        "compile scene.sdf --emit ams",
        "verify scene.sdf --engines cpu,vulkan",
    ] {
        let run = sandbox.run(arguments);
        assert_eq!(run.code, 2, "{}", run.transcript());
        if !arguments.is_empty() {
            message.push_str(&run.transcript());
            message.push('\n');
        }
    }
    assert_snapshot!(message);
}
