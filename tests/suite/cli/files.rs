//! Unreadable files, unwritable targets, machines without a GPU: exit code 3.

use super::sandbox::Sandbox;
use insta::assert_snapshot;
use std::process::Stdio;

#[test]
fn unreadable_files() {
    let sandbox = Sandbox::new();
    sandbox.write("folder/scene.sdf", "sphere(1)");
    for command in [
        "render missing.sdf",
        "check folder",
        "info missing/scene.sdf",
    ] {
        let run = sandbox.run(command);
        assert_eq!(run.code, 3, "{}", run.transcript());
        assert_snapshot!(run.transcript());
    }
}

/// All files are processed, and the most severe failure determines the exit code.
#[test]
fn one_bad_file_among_several() {
    let sandbox = Sandbox::new();
    sandbox.write("good.sdf", "sphere(1)");
    sandbox.write("bad.sdf", "sphere(");
    let run = sandbox.run("check bad.sdf missing.sdf good.sdf");
    assert_eq!(run.code, 3, "{}", run.transcript());
    assert_snapshot!(run.stderr);
}

#[test]
fn unwritable_files() {
    let sandbox = Sandbox::with_scene("sphere(1)");
    sandbox.write("file", "");
    std::fs::create_dir(sandbox.path("folder.png")).expect("a folder");
    for to in ["no/such/out.png", "file/out.png", "folder.png"] {
        let run = sandbox.run(&format!("render scene.sdf -o {to} --size 8x8 --engine cpu"));
        assert_eq!(run.code, 3, "{}", run.transcript());
        assert_snapshot!(run.transcript());
    }
    let run = sandbox.run("compile scene.sdf -o no/such/scene.sdfb --emit bytecode");
    assert_eq!(run.code, 3, "{}", run.transcript());
    assert_eq!(sandbox.files(), ["file", "folder.png", "scene.sdf"]);
}

/// Pictures are written atomically, and a failed one leaves the old file unchanged.
#[test]
fn an_old_picture_survives_a_failure() {
    let sandbox = Sandbox::with_scene("sphere(");
    sandbox.write("out.png", "old");
    let run = sandbox.run("render scene.sdf -o out.png");
    assert_eq!(run.code, 1, "{}", run.transcript());
    assert_eq!(sandbox.read("out.png"), b"old");
    assert_eq!(sandbox.files(), ["out.png", "scene.sdf"]);
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk() {
    let sandbox = Sandbox::with_scene("sphere(1)");
    let full = || {
        std::fs::File::options()
            .write(true)
            .open("/dev/full")
            .expect("a device")
    };
    let output = sandbox
        .command("compile scene.sdf")
        .stdout(full())
        .output()
        .expect("a run");
    assert_eq!(output.status.code(), Some(3));
    assert_snapshot!(String::from_utf8_lossy(&output.stderr));
    let run = sandbox.run("compile scene.sdf -o /dev/full");
    assert_eq!(run.code, 3, "{}", run.transcript());
}

/// `sdfc ops | head -1`
#[test]
fn a_reader_that_goes_away_is_no_failure() {
    let sandbox = Sandbox::new();
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let output = sandbox
        .command("ops")
        .stdout(writer)
        .output()
        .expect("a run");
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
}

/// If standard error is closed, the exit code is still correct.
#[test]
fn stderr_may_be_closed() {
    let sandbox = Sandbox::with_scene("sphere(");
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let mut command = sandbox.command("check scene.sdf");
    let status = command
        .stderr(writer)
        .stdout(Stdio::null())
        .status()
        .expect("a run");
    assert_eq!(status.code(), Some(1));
}

#[test]
fn no_gpu_where_one_is_needed() {
    let sandbox = Sandbox::with_scene("sphere(1)");
    for engine in ["interp", "wgsl"] {
        let command = format!("render scene.sdf -o out.png --size 8x8 --engine {engine}");
        let run = sandbox.run_without_gpu(&command);
        assert_eq!(run.code, 3, "{}", run.transcript());
        assert_snapshot!(run.transcript());
    }
    let run = sandbox.run_without_gpu("verify scene.sdf");
    assert_eq!(run.code, 3, "{}", run.transcript());
    assert_eq!(sandbox.files(), ["scene.sdf"]);

    // Without an explicit engine, the CPU is used.
    let run = sandbox
        .run_without_gpu("render scene.sdf -o out.png --size 8x8")
        .ok();
    assert!(
        run.stderr.starts_with("out.png: 8x8, cpu"),
        "{}",
        run.stderr
    );
    let run = sandbox.run_without_gpu("devices").ok();
    assert!(
        run.text().contains("there is no GPU adapter"),
        "{}",
        run.text()
    );
}
