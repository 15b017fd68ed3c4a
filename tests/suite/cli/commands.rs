//! The other subcommands, for valid and invalid input.

use super::sandbox::Sandbox;
use insta::assert_snapshot;
use sdfc_trials::skip::is_gpu_skipped;
use serde_json::json;

#[test]
fn check_reports_errors_as_json() {
    let sandbox = Sandbox::new();
    sandbox.write("good.sdf", "sphere(1)");
    sandbox.write("library.sdf", "fn ball(r) = sphere(r);");
    sandbox.write("bad.sdf", "sphere(r = 1)");
    assert_eq!(
        sandbox.run("check good.sdf library.sdf").ok().transcript(),
        "\
        $ sdfc check good.sdf library.sdf\n--- exit code 0\n"
    );
    let run = sandbox.run("check --json good.sdf library.sdf bad.sdf missing.sdf");
    assert_eq!(run.code, 3, "{}", run.transcript());
    let found = run.json();
    let ok: Vec<_> = found
        .as_array()
        .expect("a list")
        .iter()
        .map(|file| &file["ok"])
        .collect();
    assert_eq!(ok, [true, true, false, false]);
    let diagnostic = &found[2]["diagnostics"][0];
    assert_eq!(diagnostic["code"], "E0117");
    assert_eq!(
        diagnostic["primary"]["start"],
        json!({ "line": 1, "column": 10, "offset": 9 })
    );
    let error = found[3]["error"].as_str().expect("a reason");
    assert!(error.starts_with("missing.sdf cannot be read"), "{error}");
}

#[test]
fn every_stage_is_shown() {
    let sandbox = Sandbox::with_scene(
        "param k = 0.2 in 0.0..1.0;\nsphere(1) |[k] box(1).translate(1, 0, 0).color(#ff0000)\n",
    );
    for stage in [
        "ast",
        "scene",
        "graph",
        "optimized",
        "asm",
        "wgsl",
        "glsl",
        "hlsl",
        "msl",
        "shadertoy",
    ] {
        let run = sandbox
            .run(&format!("compile scene.sdf --emit {stage}"))
            .ok();
        assert!(run.text().len() > 40, "{}", run.transcript());
        assert_eq!(run.stderr, "");
        sandbox
            .run(&format!("compile scene.sdf --emit {stage} -o file.txt"))
            .ok();
        assert!(
            sandbox.read("file.txt") == run.stdout,
            "{stage}: a file holds what is printed"
        );
    }
    assert_snapshot!(sandbox.run("compile scene.sdf --emit ast").transcript());
}

/// Equal text and flags give equal bytes.
#[test]
fn compiling_is_deterministic() {
    let sandbox = Sandbox::with_scene(
        "union(for i in 0..20 { sphere(1).translate(i, 0, 0).color(rgb(i / 20, 0.5, 0.5)) }, smooth: 0.1)",
    );
    let bytes = || sandbox.run("compile scene.sdf --emit bytecode").ok().stdout;
    assert!(bytes() == bytes());
}

#[test]
fn query_prints_distances() {
    let sandbox = Sandbox::with_scene("sphere(1).color(#ff0000)");
    let points = "# x y z\n2 0 0\n\n0, 3, 0   # above\n  0 0 -0.5\n";
    let run = sandbox.run_on("query scene.sdf --engine cpu", points).ok();
    let rows: Vec<Vec<f32>> = run
        .text()
        .lines()
        .map(|line| {
            line.split(' ')
                .take(4)
                .map(|word| word.parse().expect("a number"))
                .collect()
        })
        .collect();
    let wanted = [
        [1.0, 1.0, 0.0, 0.0],
        [2.0, 0.0, 1.0, 0.0],
        [-0.5, 0.0, 0.0, -1.0],
    ];
    assert_eq!(rows.len(), wanted.len());
    for (row, wanted) in rows.iter().zip(wanted) {
        assert!(
            row.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-6),
            "{row:?}"
        );
    }
    let found = sandbox
        .run_on("query scene.sdf --engine cpu --json", "2 0 0")
        .ok()
        .json();
    assert_eq!(found[0]["distance"], 1.0);
    assert_eq!(found[0]["point"], json!([2.0, 0.0, 0.0]));
    assert_eq!(
        sandbox
            .run_on("query scene.sdf --engine cpu", "")
            .ok()
            .text(),
        ""
    );
}

#[test]
fn query_reports_lines_that_are_no_points() {
    let sandbox = Sandbox::with_scene("sphere(1)");
    let run = sandbox.run_on(
        "query scene.sdf --engine cpu",
        "0 0 0\n1 2\n1 two 3\n0 nan 0\n1\n",
    );
    assert_eq!(run.code, 1, "{}", run.transcript());
    assert_snapshot!(run.transcript());
}

#[test]
fn info_lists_the_contents_of_a_scene() {
    let sandbox = Sandbox::with_scene(
        "/// How strongly they melt together.\nparam goo = 0.35 in 0.0..1.0 by 0.05;\n\
         param count = 3 in 1..=6;\nparam turn = 30deg;\nparam tint: color = #3aa6ff;\n\
         camera hero { from: [0, 1, 5], look: [0, 0, 0] }\n\
         part balls = union(for i in 0..count { sphere(1).translate(i, 0, 0) }, smooth: goo);\n\
         part base = box(4, 1, 1).rotate(turn, Y).color(tint);\nballs | base\n",
    );
    assert_snapshot!(sandbox.run("info scene.sdf").ok().text());
    let info = sandbox.run("info scene.sdf --json").ok().json();
    assert_eq!(info["parts"], json!(["balls", "base"]));
    assert_eq!(info["cameras"], json!(["hero"]));
    assert_eq!(info["params"][1]["structural"], true);
    assert_eq!(info["params"][0]["range"], json!([0.0, 1.0]));
}

/// Without a found bound, values follow from an estimate. Exported source is a safe step by the stated bound all the same.
#[test]
fn stated_slopes_are_in_info_and_in_exported_source() {
    let sandbox = Sandbox::new();
    let source = |slope: &str| {
        sandbox.write(
            "scene.sdf",
            format!("field(fn(p) => length(p) - 0.7 - p.x * p.y / length(p.xy){slope}) & box(2)"),
        );
        let info = sandbox.run("info scene.sdf").ok().text();
        (
            info,
            sandbox.run("compile scene.sdf --emit wgsl").ok().text(),
        )
    };
    let (info, tight) = source(", lipschitz: 20");
    assert!(
        info.contains("by what the scene states, after division"),
        "{info}"
    );
    let (_, loose) = source(", lipschitz: 40");
    let differing = tight.lines().zip(loose.lines()).filter(|(a, b)| a != b);
    assert_eq!(differing.count(), 2, "the distance and the gradient");
    let (info, _) = source("");
    assert!(info.contains("unknown, after division"), "{info}");
}

/// Detail of 1e-4 at 1e4 from the origin exceeds single precision; near the origin it does not.
#[test]
fn detail_hidden_by_rounding_is_a_warning() {
    let sandbox = Sandbox::with_scene("sphere(0.0001).translate(10000, 0, 0)");
    assert_snapshot!(sandbox.run("info scene.sdf").ok().transcript());
    assert_snapshot!(sandbox.run("check scene.sdf").ok().transcript());
    let found = sandbox.run("check scene.sdf --json").ok().json();
    let warning = found[0]["warnings"][0].as_str().expect("a warning");
    assert!(warning.contains("rounding"), "{warning}");
    sandbox.write("near.sdf", "sphere(0.0001)");
    let draw = |scene: &str| {
        let run = format!("render {scene} -o out.png --size 32x18 --engine cpu");
        sandbox.run(&run).ok().stderr
    };
    let (far, near) = (draw("scene.sdf"), draw("near.sdf"));
    assert!(
        far.contains("warning: rounding may move surfaces by"),
        "{far}"
    );
    assert!(!near.contains("rounding"), "{near}");
    let near = sandbox.run("info near.sdf --json").ok();
    assert_eq!(near.stderr, "");
    let rounding = &near.json()["rounding"];
    let number = |name: &str| rounding[name]["at_most"].as_f64().expect("a number");
    assert!(number("within") < 1e-10, "{rounding}");
    assert!(number("pixels") < 1e-2, "{rounding}");
    assert_eq!(rounding["afar"]["distance"], 10_000.0);
}

/// The squares of lengths of 1e-25 vanish in single precision, so that the field is negative everywhere.
#[test]
fn a_scene_too_small_for_single_precision_is_a_warning() {
    for size in ["1e-18", "1e-25"] {
        let sandbox = Sandbox::with_scene(&format!("sphere({size})"));
        for run in [
            "check scene.sdf",
            "render scene.sdf -o out.png --size 32x18 --engine cpu",
        ] {
            let warnings = sandbox.run(run).ok().stderr;
            assert!(
                warnings.contains("large: f32 cannot represent"),
                "{warnings}"
            );
            assert!(!warnings.contains("camera"), "{warnings}");
        }
    }
}

#[test]
fn ops_is_the_reference() {
    let sandbox = Sandbox::new();
    let list = sandbox.run("ops").ok().text();
    for name in [
        "sphere(r)",
        "torus(r1, r2, angle)",
        "solids",
        "changes of space",
        "rotate(shape: shape, angle: angle, axis?: direction)",
    ] {
        assert!(list.contains(name), "{list}");
    }
    let rows = sandbox.run("ops --json").ok().json();
    assert!(rows.as_array().expect("a list").len() > 40);
    assert_snapshot!(sandbox.run("ops torus").ok().text());
    // A word of the language, and an operation that is listed by the same name.
    assert_snapshot!(sandbox.run("ops slice").ok().text());
    let run = sandbox.run("ops spere");
    assert_eq!(run.code, 1);
    assert_snapshot!(run.transcript());
}

#[test]
fn explain_has_a_page_for_every_code() {
    let sandbox = Sandbox::new();
    let list = sandbox.run("explain").ok().text();
    let codes: Vec<_> = list
        .lines()
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    assert!(codes.contains(&"E0101"));
    assert_snapshot!(sandbox.run("explain w0101").ok().text());
    assert_eq!(sandbox.run("explain E9999").code, 1);
}

#[test]
fn fmt_lays_out_in_place() {
    let sandbox = Sandbox::with_scene("let  a=sphere( 1 ) ; // kept\na|box( 1,2,3 )");
    let run = sandbox.run("fmt --check scene.sdf");
    assert_eq!(run.code, 1, "{}", run.transcript());
    sandbox.run("fmt scene.sdf").ok();
    let text = String::from_utf8(sandbox.read("scene.sdf")).expect("text");
    assert_eq!(text, "let a = sphere(1); // kept\na | box(1, 2, 3)\n");
    sandbox.run("fmt --check scene.sdf").ok();
    sandbox.write("scene.sdf", "sphere(");
    assert_eq!(sandbox.run("fmt scene.sdf").code, 1);
    assert_eq!(sandbox.read("scene.sdf"), b"sphere(");
    assert_eq!(sandbox.files(), ["scene.sdf"]);
}

#[test]
fn devices_are_listed() {
    let sandbox = Sandbox::new();
    assert!(sandbox.run("devices").ok().text().starts_with("cpu "));
    assert!(sandbox.run("devices --json").ok().json()["cpu"]["cores"].as_u64() >= Some(1));
}

#[test]
fn verify_compares_all_engines() {
    if is_gpu_skipped() {
        return;
    }
    let sandbox =
        Sandbox::with_scene("sphere(1) |[0.3] box(1).translate(0.8, 0, 0).color(#ff0000)");
    let run = sandbox.run("verify scene.sdf").ok();
    for pair in [
        "cpu and interp agree",
        "cpu and wgsl agree",
        "interp and wgsl agree",
    ] {
        assert!(run.text().contains(pair), "{}", run.transcript());
    }
    let run = sandbox
        .run("verify scene.sdf --json --engines interp,wgsl")
        .ok();
    assert_eq!(run.json()[0]["ok"], true);
    assert_eq!(sandbox.files(), ["scene.sdf"]);
}

/// With `--strict` engines give equal bits, so they print equal text.
#[test]
fn strict_engines_give_the_same_bits() {
    if is_gpu_skipped() {
        return;
    }
    let scene = "sphere(1) |[0.3] box(1).rotate(31deg, [1, 2, 3]).translate(0.8, 0, 0)";
    let sandbox = Sandbox::with_scene(scene);
    let run = sandbox.run("verify scene.sdf --strict --size 48x32").ok();
    let rays = "of 1536 rays differ: hit or miss 0, depth 0, steps 0, normal 0";
    let points = "of 4096 points differ: distance 0, gradient 0";
    for message in [rays, points] {
        assert_eq!(
            run.text().matches(message).count(),
            3,
            "{}",
            run.transcript()
        );
    }
    let run = sandbox
        .run("verify scene.sdf --strict --size 48x32 --json")
        .ok();
    assert_eq!(
        run.json()[0]["report"]["comparisons"][0]["bits"]["depths"],
        0
    );
    let asked: String = (0..200)
        .map(|n| {
            format!(
                "{} {} {}\n",
                f64::from(n) * 0.01,
                f64::from(n % 17) * 0.1,
                0.3
            )
        })
        .collect();
    let [cpu, interp, wgsl] = ["cpu", "interp", "wgsl"].map(|engine| {
        sandbox
            .run_on(
                &format!("query scene.sdf --strict --engine {engine}"),
                &asked,
            )
            .ok()
            .text()
    });
    assert_eq!(cpu, interp);
    assert_eq!(cpu, wgsl);
    let [cpu, wgsl] = ["cpu", "wgsl"].map(|engine| {
        sandbox
            .run(&format!(
                "render scene.sdf --strict --engine {engine} --mode depth --size 48x32 -o {engine}.png"
            ))
            .ok();
        sandbox.read(&format!("{engine}.png"))
    });
    assert!(cpu == wgsl);
}

#[test]
fn notes_of_passes_are_printed_beside_the_graph() {
    let sandbox = Sandbox::with_scene("sphere(1) | box(1).translate(2, 0, 0).offset(0)\n");
    let plain = sandbox.run("compile scene.sdf --emit optimized");
    let run = sandbox.run("compile scene.sdf --emit optimized --stats --no-pass dead");
    assert_eq!(run.code, 0);
    assert!(run.stderr.contains("dead      left out"), "{}", run.stderr);
    let run = sandbox.run("compile scene.sdf --emit optimized --stats");
    assert_eq!(run.stdout, plain.stdout);
    assert_snapshot!(run.stderr);
}

#[test]
fn engines_are_compared_at_the_requested_size() {
    let sandbox = Sandbox::with_scene("sphere(1)\n");
    let run = sandbox.run("verify scene.sdf --size 40x24 --json");
    assert_eq!(run.code, 0, "{}", run.stderr);
    let message = String::from_utf8_lossy(&run.stdout);
    assert!(
        message.contains("40") && message.contains("24"),
        "{message}"
    );
}
