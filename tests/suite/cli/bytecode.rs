//! Bytecode files: compiled scenes draw the same picture, and damaged files are rejected.

use super::sandbox::Sandbox;
use insta::assert_snapshot;

const SCENE: &str = "\
param goo = 0.3 in 0.0..1.0;
param count = 3 in 1..=5;
camera { from: [0, 1, 5], look: [0, 0, 0] }
render { far: 40, reach: 0.4 }
let balls = for i in 0..count { sphere(0.5).translate(0.8 * i - 0.8, 0, 0) };
union(balls, smooth: goo).color(#c05030) | plane(Y, at: -0.5)
";

fn compiled() -> Sandbox {
    let sandbox = Sandbox::with_scene(SCENE);
    sandbox
        .run("compile scene.sdf --emit bytecode -o scene.sdfb")
        .ok();
    sandbox
}

#[test]
fn a_compiled_scene_is_the_scene() {
    let sandbox = compiled();
    let draw = |scene: &str, picture: &str, more: &str| {
        let command = format!("render {scene} -o {picture} --size 48x32 --engine cpu {more}");
        sandbox.run(&command).ok();
        sandbox.read(picture)
    };
    assert!(draw("scene.sdf", "a.png", "") == draw("scene.sdfb", "b.png", ""));
    // A live param can still be changed and changes the picture.
    let changed = draw("scene.sdf", "c.png", "-p goo=0.9");
    assert!(changed == draw("scene.sdfb", "d.png", "-p goo=0.9"));
    assert!(changed != sandbox.read("a.png"));
    // The file compiles to itself and to the same source.
    sandbox
        .run("compile scene.sdfb --emit bytecode -o again.sdfb")
        .ok();
    assert!(sandbox.read("scene.sdfb") == sandbox.read("again.sdfb"));
    let asm = |scene: &str| {
        sandbox
            .run(&format!("compile {scene} --emit asm"))
            .ok()
            .text()
    };
    assert_eq!(asm("scene.sdf"), asm("scene.sdfb"));
    let wgsl = sandbox.run("compile scene.sdfb --emit wgsl").ok().text();
    assert!(wgsl.contains("fn sceneSDF"), "{wgsl}");
    // The file name does not matter.
    std::fs::rename(sandbox.path("scene.sdfb"), sandbox.path("renamed.bin")).expect("a file");
    sandbox.run("info renamed.bin").ok();
}

#[test]
fn commands_that_need_the_text() {
    let sandbox = compiled();
    let mut message = String::new();
    for command in [
        "compile scene.sdfb --emit ast",
        "compile scene.sdfb --emit scene",
        "info scene.sdfb --part ball",
        "info scene.sdfb -O0",
        "info scene.sdfb --no-pass fold",
        "compile scene.sdfb --lod 1",
        "info scene.sdfb -p count=2",
        "info scene.sdfb -p coont=2",
        "info scene.sdfb -p goo=7",
        "info scene.sdfb -p goo=nan",
    ] {
        let run = sandbox.run(command);
        assert_eq!(run.code, 1, "{}", run.transcript());
        message.push_str(&run.transcript());
        message.push('\n');
    }
    assert_snapshot!(message);
}

#[test]
fn damaged_files_are_refused() {
    let sandbox = compiled();
    let bytes = sandbox.read("scene.sdfb");
    let refused = |bytes: &[u8]| {
        sandbox.write("damaged.sdfb", bytes);
        let run = sandbox.run("render damaged.sdfb -o out.png --size 8x8 --engine cpu");
        assert_eq!(run.code, 1, "{}", run.transcript());
        assert!(
            run.stderr.starts_with("error: damaged.sdfb: "),
            "{}",
            run.stderr
        );
    };
    for length in [0, 3, 4, 19, 20, 21, bytes.len() / 2, bytes.len() - 1] {
        refused(&bytes[..length]);
    }
    let mut longer = bytes.clone();
    longer.extend([0; 4]);
    refused(&longer);
    // Single bits are flipped across the file, and in every byte of its header.
    let positions = (0..20).chain((20..bytes.len()).step_by(bytes.len() / 24));
    for (round, at) in positions.enumerate() {
        let mut flipped = bytes.clone();
        flipped[at] ^= 1 << (round % 8);
        refused(&flipped);
    }
    assert!(!sandbox.path("out.png").exists());
}

#[test]
fn bytes_go_into_pipes() {
    let sandbox = Sandbox::with_scene("sphere(1)");
    let run = sandbox.run("compile scene.sdf --emit bytecode").ok();
    assert!(run.stdout.starts_with(b"SDFB"));
    let run = sandbox.run("compile scene.sdf --emit spirv").ok();
    assert!(run.stdout.starts_with(&0x0723_0203_u32.to_le_bytes()));
}
