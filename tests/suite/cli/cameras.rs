//! Flags that change the camera of a scene.

use super::pictures::decoded;
use super::sandbox::Sandbox;

const SIZE: usize = 33;

/// Draws a scene with these flags, and returns the colour of each pixel.
fn colors(sandbox: &Sandbox, flags: &str) -> Vec<[u8; 3]> {
    let size = format!("{SIZE}x{SIZE}");
    sandbox
        .run(&format!(
            "render scene.sdf -o out.png --size {size} --aa 1 --engine cpu --mode albedo {flags}"
        ))
        .ok();
    let (_, _, pixels) = decoded(&sandbox.read("out.png"));
    let channels = pixels.len() / (SIZE * SIZE);
    let color = |pixel: &[u8]| [pixel[0], pixel[1], pixel[2]];
    pixels.chunks(channels).map(color).collect()
}

/// A ball on each half axis: at +X, −X, +Y, −Y, +Z and −Z, in the order of [`MARKS`].
const MARKED: &str = "let ball = sphere(0.3);
union([ball.translate(1.5, 0, 0).color(#ff0000), ball.translate(-1.5, 0, 0).color(#00ff00),
    ball.translate(0, 1.5, 0).color(#0000ff), ball.translate(0, -1.5, 0).color(#ffff00),
    ball.translate(0, 0, 1.5).color(#ff00ff), ball.translate(0, 0, -1.5).color(#00ffff)])";
const MARKS: [(&str, [u8; 3]); 6] = [
    ("+x", [255, 0, 0]),
    ("-x", [0, 255, 0]),
    ("+y", [0, 0, 255]),
    ("-y", [255, 255, 0]),
    ("+z", [255, 0, 255]),
    ("-z", [0, 255, 255]),
];

/// Returns the marks in the middle, at the right and at the upper edge of a picture.
fn marks(colors: &[[u8; 3]]) -> [&'static str; 3] {
    let middle = SIZE / 2;
    let mark = |pixel: usize| {
        let found = MARKS.iter().find(|(_, color)| *color == colors[pixel]);
        found.map(|(name, _)| *name)
    };
    let first = |mut pixels: Box<dyn Iterator<Item = usize>>| {
        pixels.find_map(mark).expect("a mark is in the picture")
    };
    [
        mark(middle * SIZE + middle).expect("a mark is in the middle"),
        first(Box::new((0..SIZE).rev().map(|x| middle * SIZE + x))),
        first(Box::new((0..SIZE).map(|y| y * SIZE + middle))),
    ]
}

#[test]
fn sides_show_what_lies_there() {
    for (up, sides) in [
        (
            "y",
            [
                ("front", ["+z", "+x", "+y"]),
                ("back", ["-z", "-x", "+y"]),
                ("left", ["-x", "+z", "+y"]),
                ("right", ["+x", "-z", "+y"]),
                ("top", ["+y", "+x", "-z"]),
                ("bottom", ["-y", "+x", "+z"]),
            ],
        ),
        (
            "z",
            [
                ("front", ["-y", "+x", "+z"]),
                ("back", ["+y", "-x", "+z"]),
                ("left", ["-x", "-y", "+z"]),
                ("right", ["+x", "+y", "+z"]),
                ("top", ["+z", "+x", "+y"]),
                ("bottom", ["-z", "+x", "-y"]),
            ],
        ),
    ] {
        // The scene's own camera is elsewhere.
        let camera = "camera { from: [9, 8, 7], look: [1, 0, 0] }";
        let sandbox = Sandbox::with_scene(&format!("scene {{ up: {up} }}\n{camera}\n{MARKED}"));
        for (side, expected) in sides {
            let shown = marks(&colors(&sandbox, &format!("--view {side}")));
            assert_eq!(shown, expected, "{side}, {up} up");
        }
    }
}

#[test]
fn a_camera_by_flags_is_that_of_a_block() {
    for (flags, block) in [
        (
            "--from 3,2,4 --look 0,0.5,0 --fov 40deg",
            "from: [3, 2, 4], look: [0, 0.5, 0], fov: 40deg",
        ),
        (
            "--from=-3,2,4 --up 1,1,0 --fov 0.1turn",
            "from: [-3, 2, 4], look: [0, 0, 0], up: [1, 1, 0], fov: 36deg",
        ),
        (
            "--from 3,2,4 --look 0,0,1 --ortho 5",
            "from: [3, 2, 4], look: [0, 0, 1], height: 5",
        ),
        // From above, as on a map.
        (
            "--from 0,6,0 --look 0,0,0",
            "from: [0, 6, 0], look: [0, 0, 0]",
        ),
    ] {
        let by_flags = colors(&Sandbox::with_scene(MARKED), flags);
        let block = Sandbox::with_scene(&format!("camera {{ {block} }}\n{MARKED}"));
        assert!(by_flags == colors(&block, ""), "{flags}");
        assert!(by_flags.iter().any(|color| *color == MARKS[2].1), "{flags}");
    }
}

#[test]
fn fitting_frames_the_scene() {
    let camera = "camera { from: [0.5, 0.4, 0.3], look: [9, 9, 9] }";
    let sandbox = Sandbox::with_scene(&format!("{camera}\n{MARKED}"));
    for flags in [
        "--fit",
        "--fit --ortho 1",
        "--fit --from 50,1,1 --look 0,0,0",
    ] {
        let shown = colors(&sandbox, flags);
        let background = shown[0];
        let is_shown = |x: usize, y: usize| shown[y * SIZE + x] != background;
        let edge = 0..SIZE;
        let is_cut = edge.clone().any(|i| {
            is_shown(i, 0) || is_shown(i, SIZE - 1) || is_shown(0, i) || is_shown(SIZE - 1, i)
        });
        assert!(!is_cut, "{flags}");
        let rows: Vec<_> = edge
            .clone()
            .filter(|&y| edge.clone().any(|x| is_shown(x, y)))
            .collect();
        let columns: Vec<_> = edge
            .clone()
            .filter(|&x| edge.clone().any(|y| is_shown(x, y)))
            .collect();
        let extent = |lines: &[usize]| lines[lines.len() - 1] - lines[0] + 1;
        let filled = extent(&rows).max(extent(&columns));
        assert!(filled >= SIZE * 3 / 4, "{flags}: {filled}");
    }
}

/// A 2-D shape is seen face on: a target and a height are a camera, from flags as from a block.
#[test]
fn plane_shapes_are_seen_with_a_target_and_a_height() {
    let figure = "circle(1).color(#ff0000).translate(3, 1) | rect(1, 2).color(#00ff00)";
    let plain = Sandbox::with_scene(figure);
    let aimed = "camera { look: [2, 1, 0], height: 4 }";
    let block = Sandbox::with_scene(&format!("{aimed}\n{figure}"));
    let shown = colors(&block, "");
    assert!(shown == colors(&plain, "--look 2,1,0 --ortho 4"));
    assert!(shown != colors(&plain, ""));
    for flags in ["--fit", "--fit --ortho 9", "--fit --look 8,8,0"] {
        assert!(colors(&block, flags) == colors(&plain, ""), "{flags}");
    }
}

#[test]
fn impossible_cameras_are_refused() {
    let sandbox = Sandbox::with_scene(MARKED);
    sandbox.write("figure.sdf", "circle(1)");
    let mut messages = String::new();
    for arguments in [
        "scene.sdf --view front --from 1,2,3",
        "scene.sdf --look 1,2,3",
        "scene.sdf --from 1,2",
        "scene.sdf --from 1,2,inf",
        "scene.sdf --fov 35",
        "scene.sdf --fov 190deg",
        "scene.sdf --fov 0deg",
        "scene.sdf --ortho -1",
        "scene.sdf --ortho inf",
        "scene.sdf --ortho 2 --fov 35deg",
        "scene.sdf --from 0,0,0",
        "scene.sdf --from 0,5,0 --up 0,1,0",
        "figure.sdf --view top",
        "figure.sdf --ortho 0",
    ] {
        let run = sandbox.run(&format!("render {arguments} -o out.png --engine cpu"));
        assert_ne!(run.code, 0, "{arguments}");
        messages += &format!("{arguments}\n{}\n", run.stderr);
    }
    insta::assert_snapshot!(messages);
}
