//! The window, for real: on a desktop that nobody sees, drawn by software Vulkan, with a scene that is
//! edited, broken and mended while it is open. What it shows is read from the screen.
//!
//! `SDFC_SOAK=1000` adds a thousand edits, over which memory and open files must not grow.
//! `SDFC_SKIP_WINDOW` (or `SDFC_SKIP_GPU`) gives the reason why there can be no window.

#![cfg(target_os = "linux")]

mod desktop;
mod screen;

use desktop::{Desktop, SIZE, Window};
use screen::{Color, Part, Screen};
use sdfc_playground::build::Source;
use sdfc_playground::files::Disk;
use sdfc_playground::painter::Opener;
use sdfc_playground::session::{Devices, Session};
use sdfc_playground::window::{Tools, open};
use sdfc_runtime::engine;
use std::fs;
use std::path::PathBuf;
use std::sync::Arc;
use tempfile::TempDir;

/// The test that is no test, but the window.
const PROCESS: &str = "the_window_itself";
/// Names its scene.
const SCENE: &str = "SDFC_WINDOW_SCENE";

#[test]
#[ignore = "it is the window that the other tests open"]
fn the_window_itself() {
    let Some(path) = std::env::var_os(SCENE) else {
        return;
    };
    let tools = Tools {
        files: Arc::new(Disk),
        opener: Box::new(|| -> Opener { Box::new(engine::open) }),
        examples: Vec::new(),
    };
    let session = Session::new(Source::File(path.into()), Devices::default());
    open(session, tools).expect("a window");
}

/// Why the window is not tried, if so.
fn skipped() -> bool {
    let asked = ["SDFC_SKIP_WINDOW", "SDFC_SKIP_GPU"];
    let reason = asked.iter().find_map(|name| std::env::var(name).ok());
    if let Some(reason) = &reason {
        eprintln!("skipped: {reason}");
    }
    reason.is_some()
}

/// A scene in a folder of its own.
struct Scene {
    folder: TempDir,
}

impl Scene {
    fn new(text: &str) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let scene = Self { folder };
        scene.write(text);
        scene
    }

    fn path(&self) -> PathBuf {
        self.folder.path().join("scene.sdf")
    }

    fn write(&self, text: &str) {
        fs::write(self.path(), text).expect("written");
    }

    /// As editors do: a new file takes the place of the old one.
    fn rename(&self, text: &str) {
        let new = self.folder.path().join("scene.sdf.new");
        fs::write(&new, text).expect("written");
        fs::rename(new, self.path()).expect("renamed");
    }

    fn text(&self) -> String {
        fs::read_to_string(self.path()).expect("read")
    }
}

/// A ball that shines in one colour, evenly, before black.
fn ball(color: &str, rest: &str) -> String {
    format!(
        "/// How large the ball is.\nparam r = 0.5 in 0.2..=1.5;\n\
         camera {{ from: [0, 0, 6], look: [0, 0, 0], fov: 40deg }}\n\
         light {{ dir: [0, 1, 0], intensity: 0 }}\n\
         sky {{ top: #000000, horizon: #000000, ground: #000000 }}\n\
         render {{ aa: 1, occlusion: off, tonemap: none }}\n\
         material m {{ color: #000000, emission: {color} }}\n\
         sphere(r).material(m){rest}\n"
    )
}

/// The middle of the picture while the panels are hidden.
const MIDDLE: [usize; 2] = [SIZE[0] / 2, SIZE[1] / 2];
/// All of the window but the lines above and below the picture.
const PICTURE: Part = Part {
    from: [0, 40],
    to: [SIZE[0], SIZE[1] - 30],
};
/// Where the params are while the panels are shown.
const PARAMS: Part = Part {
    from: [0, 40],
    to: [230, SIZE[1] - 30],
};

/// Whether a colour is about this one.
fn about(wanted: Color) -> impl Fn(Color) -> bool {
    move |color| (0..3).all(|i| color[i].abs_diff(wanted[i]) <= 12)
}

const RED: Color = [255, 0, 0];
const GREEN: Color = [0, 255, 0];
const BLUE: Color = [0, 0, 255];
/// The frame around a picture that is no longer the scene's, and its report.
fn is_alarm(color: Color) -> bool {
    about([242, 110, 112])(color)
}
/// The filled part of a slider.
fn is_slider(color: Color) -> bool {
    about([46, 74, 120])(color)
}

/// Whether the middle has this colour and nothing is wrong.
fn shows(color: Color) -> impl Fn(&Screen) -> bool {
    move |screen| about(color)(screen.at(MIDDLE)) && screen.count(PICTURE, is_alarm) == 0
}

/// Opens the window on a ball, without its panels.
fn opened<'d>(desktop: &'d Desktop, scene: &Scene) -> Window<'d> {
    let window = Window::open(desktop, &scene.path());
    window.until("the panels", |screen| screen.count(PARAMS, is_slider) > 20);
    desktop.key("p");
    window.until("a red ball", shows(RED));
    window
}

#[test]
fn a_scene_is_followed_while_it_is_edited_broken_and_mended() {
    if skipped() {
        return;
    }
    let desktop = Desktop::start();
    let scene = Scene::new(&ball("#ff0000", ""));
    let window = opened(&desktop, &scene);

    scene.write(&ball("#0000ff", ""));
    window.until("blue, after the file was written", shows(BLUE));
    scene.rename(&ball("#00ff00", ""));
    window.until("green, after another file took its place", shows(GREEN));
    let whole = window.rest();

    scene.write(&ball("#ff0000", " | sphre(2)"));
    let broken = window.until("a report", |screen| {
        screen.count(PICTURE, is_alarm) > 2 * SIZE[0]
    });
    let dimmed = broken.at(MIDDLE);
    assert!(
        dimmed[1] > 60 && dimmed[1] < 160 && dimmed[0] < 20,
        "the last good picture is not under it, dimmed: {dimmed:?}"
    );
    // The frame goes all around.
    for [x, y] in [[0, MIDDLE[1]], [SIZE[0] - 1, MIDDLE[1]]] {
        assert!(is_alarm(broken.at([x, y])), "no frame at {x}, {y}");
    }
    scene.rename(&ball("#00ff00", ""));
    window.until("green again, and no report", shows(GREEN));
    let mended = window.rest();
    let differs = mended.differs(&whole, PICTURE);
    assert_eq!(differs, 0, "pixels differ from before it was broken");

    fs::remove_file(scene.path()).expect("removed");
    window.until("a report of a file that is gone", |screen| {
        screen.count(PICTURE, is_alarm) > 2 * SIZE[0]
    });
    scene.write(&ball("#0000ff", ""));
    window.until("blue, now that it is back", shows(BLUE));

    desktop.key("ctrl+q");
    assert!(window.closes(), "it failed while closing");
}

#[test]
fn sliders_mouse_and_keys_change_the_picture() {
    if skipped() {
        return;
    }
    let desktop = Desktop::start();
    let scene = Scene::new(&ball("#ff0000", ""));
    let window = opened(&desktop, &scene);
    let first = window.rest();
    let red = |screen: &Screen| screen.count(PICTURE, about(RED));

    // A slider: the ball grows, and shrinks again.
    desktop.key("p");
    let panels = window.until("the panels", |screen| screen.count(PARAMS, is_slider) > 20);
    let small = red(&window.rest());
    let filled = panels.places(PARAMS, is_slider);
    let x = filled.iter().map(|place| place[0]).max().expect("a slider") as i32;
    let y = filled.iter().map(|place| place[1]).sum::<usize>() / filled.len();
    desktop.drag("1", [x + 4, y as i32], [x + 150, y as i32]);
    window.until("a larger ball", |screen| red(screen) > 2 * small);
    assert_eq!(scene.text(), ball("#ff0000", ""), "the text was touched");
    desktop.key("r");
    window.until("the ball as it was", |screen| red(screen) == small);

    // Again, and into the text, in which nothing else changes.
    desktop.drag("1", [x + 4, y as i32], [x + 150, y as i32]);
    window.until("a larger ball", |screen| red(screen) > 2 * small);
    desktop.key("w");
    window.until("the params as in the text", |screen| {
        scene.text() != ball("#ff0000", "") && screen.count(PARAMS, about([122, 170, 245])) == 0
    });
    let written = scene.text();
    let value = written.split("param r = ").nth(1).expect("the param");
    let value = value.split_once(" in").expect("its range").0;
    let number: f64 = value.parse().expect("a number");
    assert!((0.9..=1.5).contains(&number), "{number}");
    let back = written.replace(&format!("r = {value}"), "r = 0.5");
    assert_eq!(back, ball("#ff0000", ""), "more than the value changed");
    scene.write(&ball("#ff0000", ""));
    desktop.key("p");
    window.until("the first picture", |screen| {
        screen.differs(&first, PICTURE) == 0
    });

    // The mouse: a ball looks the same from all sides, but not from the side.
    let middle = MIDDLE.map(|v| v as i32);
    desktop.drag("3", middle, [middle[0] - 200, middle[1]]);
    // The ball's front went with the mouse; its middle, which is farther away, a little less far.
    let moved = Part {
        from: [MIDDLE[0] - 240, 0],
        to: [MIDDLE[0] - 125, SIZE[1]],
    };
    window.until("the ball on the left", |screen| {
        !about(RED)(screen.at(MIDDLE)) && screen.count(moved, about(RED)) + 100 > red(&first)
    });
    desktop.key("0");
    window.until("the scene's camera", |screen| {
        screen.differs(&first, PICTURE) == 0
    });
    let [x, y] = middle.map(|v| v.to_string());
    desktop.tool(&["mousemove", &x, &y, "click", "--repeat", "6", "4"]);
    desktop.park();
    window.until("a nearer ball", |screen| red(screen) > red(&first) * 3 / 2);
    desktop.key("0");
    window.until("the scene's camera", |screen| {
        screen.differs(&first, PICTURE) == 0
    });

    // What is shown: steps have other colours, the way back leads to the first picture.
    desktop.key("m");
    window.until("something else", |screen| !about(RED)(screen.at(MIDDLE)));
    desktop.key("shift+m");
    window.until("the picture as before", |screen| {
        screen.differs(&first, PICTURE) == 0
    });

    // The list of keys lies over the picture until it is closed.
    desktop.key("question");
    window.until("the keys", |screen| {
        screen.differs(&first, PICTURE) > 10_000
    });
    desktop.key("Escape");
    window.until("no keys", |screen| screen.differs(&first, PICTURE) == 0);

    // So does a menu.
    desktop.tool(&["mousemove", "20", "12", "click", "1"]);
    desktop.park();
    window.until("the menu of files", |screen| {
        screen.differs(&first, PICTURE) > 10_000
    });
    desktop.key("Escape");
    window.until("no menu", |screen| screen.differs(&first, PICTURE) == 0);
}

#[test]
fn a_thousand_edits_hold_memory_and_file_handles() {
    let Some(edits) = std::env::var("SDFC_SOAK").ok() else {
        return;
    };
    if skipped() {
        return;
    }
    let edits: usize = edits.parse().expect("SDFC_SOAK is a number of edits");
    let desktop = Desktop::start();
    let scene = Scene::new(&ball("#ff0000", ""));
    let window = opened(&desktop, &scene);
    let mut settled = None;
    for edit in 0..edits {
        let (name, color) = [("#00ff00", GREEN), ("#0000ff", BLUE), ("#ff0000", RED)][edit % 3];
        if edit % 7 == 0 {
            scene.write(&ball(name, " | sphre(2)"));
            window.until("a report", |screen| {
                screen.count(PICTURE, is_alarm) > SIZE[0]
            });
        }
        if edit % 2 == 0 {
            scene.rename(&ball(name, ""));
        } else {
            scene.write(&ball(name, ""));
        }
        window.until("the next colour", shows(color));
        if edit == edits / 10 {
            window.rest();
            settled = Some((window.memory(), window.handles()));
        }
    }
    window.rest();
    let (memory, handles) = settled.expect("enough edits");
    let now = (window.memory(), window.handles());
    eprintln!("{edits} edits: from {memory} KiB and {handles} files to {now:?}");
    assert!(now.1 <= handles, "{handles} files were open, now {}", now.1);
    // A twentieth is what an allocator may keep.
    let most = memory + memory / 20 + 4096;
    assert!(now.0 <= most, "{memory} KiB were resident, now {}", now.0);
}
