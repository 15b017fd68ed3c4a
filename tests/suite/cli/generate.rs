//! Tests of `gen`: scenes with any number of primitives.

use super::pictures::decoded;
use super::sandbox::Sandbox;
use insta::assert_snapshot;

const FAMILIES: [&str; 4] = ["spheres", "boxes", "city", "molecule"];

/// Primitives of the families; all other operations in a program combine or transform them.
const PRIMITIVES: [&str; 7] = [
    "sphere",
    "cuboid",
    "rounded_cuboid",
    "cylinder",
    "cone",
    "capsule",
    "capsule_between",
];

/// Scenes have the requested number of primitives, plus the ground. They are canonical and give no
/// warnings.
#[test]
fn scenes_of_every_family_and_number() {
    let sandbox = Sandbox::new();
    for family in FAMILIES {
        for (count, blend) in [(1, "0"), (2, "0.1"), (9, "0"), (64, "0.25"), (301, "0.05")] {
            let run = sandbox.run(&format!(
                "gen {family} --count {count} --seed 5 --blend {blend} -o scene.sdf"
            ));
            assert_eq!(run.ok().stderr, "");
            let run = sandbox.run("check scene.sdf").ok();
            assert_eq!(run.stderr, "", "{family} of {count}");
            sandbox.run("fmt --check scene.sdf").ok();
            let info = sandbox.run("info scene.sdf --json").ok().json();
            let operations = PRIMITIVES.map(|name| info["operations"][name].as_u64());
            let found: u64 = operations.into_iter().flatten().sum();
            assert_eq!(found, count + 1, "{family}: {}", info["operations"]);
        }
    }
    assert_eq!(sandbox.files(), ["scene.sdf"]);
}

#[test]
fn a_small_scene_in_full() {
    let sandbox = Sandbox::new();
    let run = sandbox.run("gen molecule --count 6 --seed 2 --blend 0.1");
    assert_snapshot!(run.ok().text());
}

/// Equal options give equal texts, on standard output and in files; another seed gives another text.
#[test]
fn only_the_options_decide() {
    let sandbox = Sandbox::new();
    for family in FAMILIES {
        let text = |more: &str| {
            let command = format!("gen {family} --count 50 {more}");
            sandbox.run(&command).ok().text()
        };
        let plain = text("");
        assert!(plain == text("-o -"));
        assert!(plain == text("--seed 1 --blend 0"));
        assert!(plain != text("--seed 2"));
        assert!(text("-o file.sdf").is_empty());
        assert!(plain.as_bytes() == sandbox.read("file.sdf"));
    }
}

/// The covered fraction of the picture does not depend on the number of primitives.
#[test]
fn coverage_stays() {
    let sandbox = Sandbox::new();
    for family in FAMILIES {
        let covered = [40, 200, 1000].map(|count| {
            let text = sandbox
                .run(&format!("gen {family} --count {count} --blend 0.05"))
                .ok()
                .text();
            let (shapes, _ground) = text.rsplit_once(" | ").expect("the ground comes last");
            sandbox.write("scene.sdf", shapes);
            let draw = "render scene.sdf -o out.png --mode mask --engine cpu --aa 1 --size 64x36";
            sandbox.run(draw).ok();
            let (width, height, pixels) = decoded(&sandbox.read("out.png"));
            let channels = pixels.len() / (width * height) as usize;
            let white = pixels.chunks(channels).filter(|pixel| pixel[0] > 127);
            white.count()
        });
        let [least, most] = [covered.iter().min(), covered.iter().max()];
        let (least, most) = least.zip(most).expect("three numbers");
        assert!(*least > 200 && *most < 2 * least, "{family}: {covered:?}");
    }
}

#[test]
fn invalid_options() {
    let sandbox = Sandbox::new();
    for arguments in [
        "spheres --count 0",
        "spheres --count many",
        "city --blend 2",
        "city --blend nan",
        "trees",
        "",
    ] {
        let run = sandbox.run(&format!("gen {arguments}"));
        assert_eq!(run.code, 2, "{}", run.transcript());
    }
    let run = sandbox.run("gen city --count 5 -o no/such/scene.sdf");
    assert_eq!(run.code, 3, "{}", run.transcript());
    assert_snapshot!(run.transcript());
    assert!(sandbox.files().is_empty());
}
