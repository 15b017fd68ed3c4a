//! Tests of `bench`: contents of the report of speed against error, independent of the measured times.

use super::sandbox::{Run, Sandbox};
use serde_json::Value;

const SCENE: &str = "camera { from: [2, 2, 4], look: [0, 0, 0] }\n\
    sphere(1) |[0.2] box(1).translate(0.8, 0, 0) | box(6, 0.1, 6).translate(0, -1, 0)\n";

/// All knobs with each of their values, and the combinations.
const SETTINGS: [&str; 23] = [
    "default",
    "threshold 0.002",
    "threshold 0.01",
    "threshold 0.1",
    "threshold 0.25",
    "threshold 0.5",
    "threshold 1",
    "plain steps",
    "normals tetrahedron",
    "normals central",
    "normals forward",
    "no cells",
    "plain steps, no cells",
    "threshold 0.01, plain steps",
    "threshold 0.25, plain steps",
    "threshold 0.5, normals forward",
    "lod 0.5 px",
    "threshold 0.1, lod 0.5 px",
    "threshold 0.5, lod 0.5 px",
    "lod 1 px",
    "threshold 1, normals tetrahedron, lod 1 px",
    "lod 2 px",
    "threshold 1, normals forward, lod 2 px",
];

fn bench(sandbox: &Sandbox, more: &str) -> Run {
    let command = format!("bench scene.sdf --engines cpu --width 24 --rounds 1 {more}");
    sandbox.run(&command).ok()
}

fn list<'a>(value: &'a Value, name: &str) -> &'a Vec<Value> {
    let found = value[name].as_array();
    found.unwrap_or_else(|| panic!("no list `{name}` in {value}"))
}

fn number(value: &Value, name: &str) -> f64 {
    let found = value[name].as_f64();
    found.unwrap_or_else(|| panic!("no number `{name}` in {value}"))
}

#[test]
fn every_setting_is_measured() {
    let sandbox = Sandbox::with_scene(SCENE);
    let run = bench(&sandbox, "--json --report report.html --markdown report.md");
    assert_eq!(run.stderr, "");
    let report = run.json();
    let scene = &report["scenes"][0];
    assert_eq!(scene["scene"], "scene.sdf");
    assert_eq!(scene["size"], serde_json::json!([24, 13]));
    let truth = &scene["truth"];
    let rays = ["hits", "misses", "undecided"].map(|name| number(truth, name));
    assert_eq!(rays.iter().sum::<f64>(), 24.0 * 13.0, "{truth}");
    assert!(rays[0] > 50.0, "{truth}");

    let rows = list(scene, "rows");
    let mut names: Vec<_> = rows.iter().map(|row| row["setting"].as_str()).collect();
    let mut wanted = SETTINGS.map(Some).to_vec();
    names.sort();
    wanted.sort();
    assert_eq!(names, wanted);
    for row in rows {
        assert_eq!(row["engine"], "cpu");
        assert_eq!(row["default"], row["setting"] == "default");
        assert!(number(row, "milliseconds") > 0.0, "{row}");
        assert!(number(row, "ray_evaluations") >= 1.0, "{row}");
        assert!(number(row, "evaluations") > number(row, "ray_evaluations"));
        assert_eq!(number(&row["errors"], "pixels"), 24.0 * 13.0);
        assert_eq!(number(&row["errors"], "nans"), 0.0, "{row}");
    }
    let suite = list(&report["suite"], "rows");
    assert_eq!(suite.len(), SETTINGS.len());

    // The other two formats have the same rows.
    let page = String::from_utf8(sandbox.read("report.html")).expect("text");
    let tables = String::from_utf8(sandbox.read("report.md")).expect("text");
    for setting in SETTINGS {
        assert!(page.contains(&format!(">{setting}</td>")), "{setting}");
        assert!(tables.contains(setting), "{setting}");
    }
    for message in [&page, &tables] {
        assert!(message.contains("sdfc bench scene.sdf --engines cpu --width 24"));
        assert!(message.contains(report["date"].as_str().expect("a date")));
        assert!(message.contains("cpu: "), "what it ran on");
    }
    let chart = String::from_utf8(sandbox.read("report.svg")).expect("text");
    assert!(
        chart.starts_with("<svg") && chart.contains("default"),
        "{chart}"
    );
    assert!(
        tables.contains("![Time against error](report.svg)"),
        "{tables}"
    );
    assert!(tables.contains("- The default on cpu: "), "{tables}");
    let files = ["report.html", "report.md", "report.svg", "scene.sdf"];
    assert_eq!(sandbox.files(), files);
}

/// The page loads no resources, and every tag is closed.
#[test]
fn the_page_needs_nothing_else() {
    let sandbox = Sandbox::with_scene(SCENE);
    bench(&sandbox, "--report report.html");
    let page = String::from_utf8(sandbox.read("report.html")).expect("text");
    for outside in ["http", "src=", "url(", "@import", "<link", "<script"] {
        assert!(!page.contains(outside), "{outside}");
    }
    for tag in ["svg", "table", "details", "div", "body", "html", "main"] {
        let opened =
            page.matches(&format!("<{tag}>")).count() + page.matches(&format!("<{tag} ")).count();
        assert!(opened > 0, "{tag}");
        assert_eq!(opened, page.matches(&format!("</{tag}>")).count(), "{tag}");
    }
    assert_eq!(
        page.matches("<svg").count(),
        4,
        "three of all, one of a scene"
    );
}

/// The marked Pareto front is non-empty and contains only undominated rows.
#[test]
fn fronts_are_fronts() {
    let sandbox = Sandbox::with_scene(SCENE);
    let report = bench(&sandbox, "--json").json();
    let rows = list(&report["scenes"][0], "rows");
    for (mark, cost) in [
        ("front_of_time", "milliseconds"),
        ("front_of_evaluations", "evaluations"),
    ] {
        let pair = |row: &Value| (number(row, cost), number(&row["errors"]["depth"], "p99"));
        let beaten = |row: &Value| {
            let (time, error) = pair(row);
            rows.iter().map(pair).any(|(other_time, other_error)| {
                other_time <= time
                    && other_error <= error
                    && (other_time, other_error) != (time, error)
            })
        };
        for row in rows {
            assert_eq!(row[mark], !beaten(row), "{cost} of {row}");
        }
        assert!(rows.iter().any(|row| row[mark] == true), "{cost}");
    }
}

/// Plain steps are at least as many as relaxed ones, and each row has the knob that it names.
#[test]
fn settings_reach_the_march() {
    let sandbox = Sandbox::with_scene(SCENE);
    let report = bench(&sandbox, "--json").json();
    let rows = list(&report["scenes"][0], "rows");
    let evaluations = |setting: &str| {
        let row = rows.iter().find(|row| row["setting"] == setting);
        number(
            row.unwrap_or_else(|| panic!("{setting}")),
            "ray_evaluations",
        )
    };
    assert!(evaluations("no cells") < evaluations("plain steps, no cells"));
    assert!(evaluations("threshold 1") < evaluations("threshold 0.01"));
    let rule = &report["suite"]["steps"][1];
    assert_eq!(rule["relaxed"]["setting"], "no cells");
    let saved = 100.0 * (1.0 - evaluations("no cells") / evaluations("plain steps, no cells"));
    assert!(
        (number(rule, "saved_percent") - saved).abs() < 1e-9,
        "{rule}"
    );
    let picture = |setting: &str| {
        let row = rows.iter().find(|row| row["setting"] == setting);
        number(
            &row.unwrap_or_else(|| panic!("{setting}"))["picture"],
            "mean",
        )
    };
    assert!(picture("threshold 0.01, plain steps") < picture("normals tetrahedron"));
}

#[test]
fn the_fastest_setting_that_keeps_an_error_is_taken() {
    let sandbox = Sandbox::with_scene(SCENE);
    for (tolerance, coarsest) in [("0.5px", 0.5), ("0.02", 0.02)] {
        let run = bench(&sandbox, &format!("--json --tolerance {tolerance}"));
        let report = run.json();
        assert_eq!(number(&report, "tolerance"), coarsest);
        let scene = &report["scenes"][0];
        let choice = &scene["choices"][0];
        assert_eq!(choice["kept"], true, "{choice}");
        let keeps = |row: &&Value| {
            let knobs = &row["knobs"];
            let threshold = number(knobs, "threshold");
            let near = (20.0 * threshold).min(1.0).max(threshold);
            let moved = near / 2.0 + knobs["lod"].as_f64().unwrap_or(0.0);
            moved <= coarsest
                && number(&row["depth_pixels"], "p99") <= coarsest
                && number(&row["errors"], "mismatches_inside") == 0.0
        };
        let times = list(scene, "rows").iter().filter(keeps);
        let fastest = times
            .map(|row| number(row, "milliseconds"))
            .fold(f64::MAX, f64::min);
        assert_eq!(number(choice, "milliseconds"), fastest, "{choice}");
        let taken = choice["setting"].as_str().expect("a setting");
        let told =
            format!("note: scene.sdf on cpu: {taken} is the fastest that keeps {coarsest} px\n");
        assert_eq!(run.stderr, told);
    }
    let run = bench(&sandbox, "--json --tolerance 0.000001px");
    assert_eq!(run.json()["scenes"][0]["choices"][0]["kept"], false);
    assert!(
        run.stderr
            .starts_with("warning: scene.sdf on cpu: no setting keeps 0.000001 px, "),
        "{}",
        run.stderr
    );
}

/// A sample of a larger picture estimates what all of its pixels say.
#[test]
fn a_sample_stands_for_the_picture() {
    let sandbox = Sandbox::with_scene(SCENE);
    let measure = |samples: u32| {
        let command = format!(
            "bench scene.sdf --engines cpu --width 160 --rounds 1 --json --samples {samples}"
        );
        sandbox.run(&command).ok().json()
    };
    let [sample, all] = [measure(1500), measure(1_000_000)].map(|report| {
        let scene = &report["scenes"][0];
        let row = list(scene, "rows")
            .iter()
            .find(|row| row["default"] == true);
        let errors = &row.expect("a default")["errors"];
        let count = |name: &str| number(errors, name);
        let sampled = number(&scene["truth"], "sampled");
        assert_eq!(sampled, count("sampled"));
        (
            sampled,
            ["pixels", "hits", "misses"].map(count),
            number(&errors["depth"], "p50"),
        )
    });
    assert!((1400.0..1700.0).contains(&sample.0), "{sample:?}");
    assert_eq!(all.0, all.1[0], "{all:?}");
    for (estimate, truth) in sample.1.iter().zip(all.1) {
        let error = (estimate - truth).abs() / all.1[0];
        assert!(error < 0.02, "{sample:?} {all:?}");
    }
    assert!((sample.2 / all.2 - 1.0).abs() < 0.2, "{sample:?} {all:?}");
}

/// Compiled files are measured without changes of detail.
#[test]
fn bytecode_keeps_its_detail() {
    let sandbox = Sandbox::with_scene(SCENE);
    sandbox
        .run("compile scene.sdf --emit bytecode -o scene.sdfb")
        .ok();
    let command = "bench scene.sdfb --engines cpu --width 16 --rounds 1 --json";
    let report = sandbox.run(command).ok().json();
    let rows = list(&report["scenes"][0], "rows");
    assert!(rows.iter().all(|row| row["knobs"]["lod"].is_null()));
    assert_eq!(rows.len(), 16);
}

#[test]
fn impossible_measurements_are_reported() {
    let sandbox = Sandbox::with_scene(SCENE);
    sandbox.write("plane.sdf", "circle(1)");
    sandbox.write("wrong.sdf", "spehre(1)");
    for (arguments, code, message) in [
        ("bench", 2, "<SCENE>"),
        (
            "bench missing.sdf --engines cpu",
            3,
            "missing.sdf cannot be read",
        ),
        ("bench wrong.sdf --engines cpu", 1, "spehre"),
        (
            "bench plane.sdf --engines cpu",
            1,
            "plane.sdf: a 2-D shape has no depth",
        ),
        (
            "bench scene.sdf --engines reference",
            2,
            "errors are measured against it",
        ),
        (
            "bench scene.sdf --engines gpu",
            2,
            "there is no engine `gpu`",
        ),
        (
            "bench scene.sdf --tolerance=-1px",
            2,
            "a number of pixels above 0",
        ),
        (
            "bench scene.sdf --tolerance 0px",
            2,
            "a number of pixels above 0",
        ),
        ("bench scene.sdf --width 4", 2, "4 is not in 8..=4096"),
        ("bench scene.sdf --rounds 0", 2, "0 is not in 1..=1000"),
        (
            "bench scene.sdf --report no/where.html",
            3,
            "there is no folder no",
        ),
    ] {
        let run = sandbox.run(arguments);
        assert_eq!(run.code, code, "{}", run.transcript());
        assert!(run.stderr.contains(message), "{}", run.transcript());
        assert!(run.stdout.is_empty(), "{}", run.transcript());
    }
    assert_eq!(sandbox.files(), ["plane.sdf", "scene.sdf", "wrong.sdf"]);
    // Measurable scenes are measured even if others fail.
    let command = "bench plane.sdf scene.sdf --engines cpu --width 16 --rounds 1 --json";
    let run = sandbox.run(command);
    assert_eq!(run.code, 1, "{}", run.transcript());
    assert_eq!(list(&run.json(), "scenes").len(), 1);
}

#[test]
fn without_a_device_the_processor_is_measured() {
    let sandbox = Sandbox::with_scene(SCENE);
    let run = sandbox
        .run_without_gpu("bench scene.sdf --width 16 --rounds 1 --json")
        .ok();
    let report = run.json();
    assert_eq!(list(&report, "devices").len(), 1);
    assert_eq!(
        run.stderr.matches("it is left out").count(),
        2,
        "{}",
        run.stderr
    );
    let run = sandbox.run_without_gpu("bench scene.sdf --engines interp --width 16");
    assert_eq!(run.code, 3, "{}", run.transcript());
}
