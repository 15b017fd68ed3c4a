//! The engine `reference` on the command line.

use super::sandbox::Sandbox;

#[test]
fn the_reference_draws_and_returns_distances() {
    let sandbox = Sandbox::with_scene("sphere(1) |[0.3] box(1).translate(0.8, 0, 0)");
    let run = sandbox.run("render scene.sdf -o out.png --size 24x16 --engine reference");
    let run = run.ok();
    assert!(
        run.stderr.starts_with("out.png: 24x16, reference on "),
        "{}",
        run.stderr
    );
    assert_eq!(run.stderr.lines().count(), 1, "{}", run.stderr);
    assert_eq!(sandbox.files(), ["out.png", "scene.sdf"]);
    let run = sandbox.run("verify scene.sdf --size 40x24 --engines reference,cpu");
    assert!(
        run.ok().text().contains("reference and cpu agree"),
        "another verdict"
    );
}

#[test]
fn unproved_rays_are_reported() {
    // The field is zero in the whole sphere and negative nowhere.
    let sandbox = Sandbox::with_scene(
        "camera { from: [0, 0, 3], look: [0, 0, 0] }\nfield(fn(p) => max(sin(p.x) * sin(p.x) + cos(p.x) * cos(p.x) - 1, length(p) - 1))\n",
    );
    let run = sandbox.run("render scene.sdf -o out.png --size 8x8 --engine reference");
    let run = run.ok();
    let message = "warning: 232 of 256 rays (90.62 %) could not be proved to hit or to miss";
    assert!(run.stderr.contains(message), "{}", run.stderr);
}
