//! Output files and messages of `render`.

use super::sandbox::{Run, Sandbox};

const SCENE: &str = "sphere(1).color(#ff0000) | box(1).translate(0, 1.2, 0)";

/// Decodes a PNG to width, height, and pixels of three or four channels.
pub(super) fn decoded(bytes: &[u8]) -> (u32, u32, Vec<u8>) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes))
        .read_info()
        .expect("a PNG");
    assert!(
        reader.info().srgb.is_some(),
        "it says which colours it means"
    );
    let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
    let info = reader.next_frame(&mut pixels).expect("pixels");
    pixels.truncate(info.buffer_size());
    (info.width, info.height, pixels)
}

fn draw(sandbox: &Sandbox, more: &str) -> Run {
    sandbox
        .run(&format!(
            "render scene.sdf -o out.png --size 24x16 --engine cpu {more}"
        ))
        .ok()
}

#[test]
fn a_picture_of_the_requested_size() {
    let sandbox = Sandbox::with_scene(SCENE);
    let run = draw(&sandbox, "");
    let (width, height, pixels) = decoded(&sandbox.read("out.png"));
    assert_eq!((width, height), (24, 16));
    assert_eq!(pixels.len() % (24 * 16), 0);
    // One line; no progress into a pipe; empty standard output.
    assert!(run.stdout.is_empty());
    assert_eq!(run.stderr.lines().count(), 1, "{}", run.stderr);
    assert!(
        run.stderr.starts_with("out.png: 24x16, cpu on "),
        "{}",
        run.stderr
    );
    assert!(run.stderr.ends_with(" ms\n"), "{}", run.stderr);
    assert_eq!(sandbox.files(), ["out.png", "scene.sdf"]);
}

#[test]
fn the_summary_reports_omitted_detail() {
    let small = "sphere(1) | (sphere(0.001) | box(0.001)).translate(0, 1.2, 0)";
    let sandbox = Sandbox::with_scene(small);
    let run = draw(&sandbox, "--lod 0.5");
    let message = "; lod 0.5 px: 2 replaced, error at most 0.";
    assert!(run.stderr.contains(message), "{}", run.stderr);
    assert!(run.stderr.ends_with(" px\n"), "{}", run.stderr);
    let sandbox = Sandbox::with_scene(SCENE);
    let run = draw(&sandbox, "--lod 0.5");
    let message = "; lod 0.5 px: nothing replaced\n";
    assert!(run.stderr.ends_with(message), "{}", run.stderr);
    let run = sandbox.run("render scene.sdf --lod 0.5 -O0");
    assert_eq!(run.code, 1, "{}", run.stderr);
}

#[test]
fn every_mode_and_method() {
    let sandbox = Sandbox::with_scene(SCENE);
    let mut pictures = Vec::new();
    for mode in [
        "shaded", "albedo", "normal", "depth", "steps", "distance", "id", "mask", "edges",
    ] {
        draw(&sandbox, &format!("--mode {mode}"));
        pictures.push((mode, decoded(&sandbox.read("out.png")).2));
    }
    for (at, (mode, picture)) in pictures.iter().enumerate() {
        for (other, different) in &pictures[..at] {
            assert!(picture != different, "{mode} shows what {other} shows");
        }
    }
    for more in [
        "--aa 2",
        "--steps 64",
        "--far 50",
        "--normals central",
        "--tonemap aces",
        "--tonemap reinhard --exposure 2",
        "--occlusion five-tap",
        "--occlusion 8",
        "-O0",
        "--no-pass fold",
        "--at 1.5s",
        "--at 200ms",
        "--cells never",
        "--cells always",
        "--cells cpu",
        "--cells gpu",
        "--progress",
    ] {
        draw(&sandbox, more);
    }
}

/// The centre of an unlit red sphere is the same red, so colours are preserved in the file.
#[test]
fn colours_are_those_of_the_scene() {
    let sandbox = Sandbox::with_scene("sphere(1).color(#c08040)");
    draw(&sandbox, "--mode albedo");
    let (width, height, pixels) = decoded(&sandbox.read("out.png"));
    let channels = pixels.len() / (width * height) as usize;
    let middle = (height / 2 * width + width / 2) as usize * channels;
    for (found, wanted) in pixels[middle..].iter().zip([0xc0, 0x80, 0x40]) {
        assert!(
            found.abs_diff(wanted) <= 1,
            "{found:#x} where {wanted:#x} was asked for"
        );
    }
}

/// Animated shapes are drawn completely, at their position at the given time.
#[test]
fn time_moves_the_complete_shape() {
    let settings = "camera { from: [0, 1, 9], look: [0, 0, 0] }\nrender { far: 40 }\n";
    let mask = |shape: &str, more: &str| {
        let sandbox = Sandbox::with_scene(&format!("{settings}{shape}"));
        draw(&sandbox, &format!("--mode mask {more}"));
        decoded(&sandbox.read("out.png")).2
    };
    let moved = mask("sphere(1).translate(2 * sin(time), 0, 0)", "--at 1.5s");
    let there = mask("sphere(1).translate(2 * sin(1.5), 0, 0)", "");
    assert!(moved == there);
}

#[test]
fn the_name_and_the_pipe() {
    let sandbox = Sandbox::with_scene(SCENE);
    sandbox.run("render scene.sdf --size 8x8 --engine cpu").ok();
    assert_eq!(sandbox.files(), ["scene.png", "scene.sdf"]);
    let run = sandbox
        .run("render scene.sdf --size 8x8 --engine cpu -o -")
        .ok();
    assert_eq!(decoded(&run.stdout), decoded(&sandbox.read("scene.png")));
}

/// Rays that run out of steps are counted and reported, not treated as misses.
#[test]
fn rays_out_of_steps_are_reported() {
    let sandbox = Sandbox::with_scene("plane(Y, at: -1)\n| sphere(1)");
    let run = draw(&sandbox, "--steps 2");
    assert!(run.stderr.contains("warning: "), "{}", run.stderr);
    assert!(run.stderr.contains("--steps"), "{}", run.stderr);
}

/// Clauses of a .vm file: a disc of radius one in the plane, a sphere in space.
#[test]
fn the_text_form_of_fidget() {
    let sandbox = Sandbox::new();
    let disc = "# a disc\n_0 var-x\n_1 var-y\n_2 square _0\n_3 square _1\n_4 add _2 _3\n\
                _5 sqrt _4\n_6 const 1\n_7 sub _5 _6\n";
    sandbox.write("disc.vm", disc);
    let info = sandbox.run("info disc.vm --json").ok().json();
    assert_eq!(info["plane"], true);
    let run = sandbox
        .run_on("query disc.vm --engine cpu", "2 0\n0 0\n")
        .ok();
    let distances: Vec<f32> = run
        .text()
        .lines()
        .map(|line| {
            line.split(' ')
                .next()
                .and_then(|word| word.parse().ok())
                .expect("a number")
        })
        .collect();
    assert_eq!(distances, [1.0, -1.0]);
    let ball = disc.replace(
        "_4 add _2 _3",
        "_z var-z\n_zz square _z\n_a add _2 _3\n_4 add _a _zz",
    );
    sandbox.write("ball.vm", ball);
    assert_eq!(
        sandbox.run("info ball.vm --json").ok().json()["plane"],
        false
    );
    sandbox
        .run("render ball.vm -o ball.png --size 16x16 --engine cpu")
        .ok();
    sandbox.write("wrong.vm", "_0 var-x\n_1 squar _0\n_2 add _0 _9\n");
    let run = sandbox.run("check wrong.vm");
    assert_eq!(run.code, 1, "{}", run.transcript());
    insta::assert_snapshot!(run.stderr);
}
