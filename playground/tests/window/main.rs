//! End-to-end tests of the window on a virtual desktop, drawn by software Vulkan. A scene is edited,
//! broken and repaired while the window is open, and the result is read from the screen.
//!
//! `SDFC_SOAK=1000` adds a thousand edits, over which memory and open files must not grow.
//! `SDFC_SKIP_WINDOW` (or `SDFC_SKIP_GPU`) states the reason for skipping these tests.

#![cfg(target_os = "linux")]

mod desktop;
mod screen;

use desktop::{Desktop, SIZE, Window};
use screen::{Color, Screen, ScreenRect};
use sdfc_io::files::Disk;
use sdfc_playground::build::SceneOrigin;
use sdfc_playground::renderer::EngineOpener;
use sdfc_playground::session::{Devices, Session};
use sdfc_playground::window::{WindowServices, open};
use sdfc_runtime::engine;
use sdfc_trials::skip::is_window_skipped;
use std::fs;
use std::path::PathBuf;
use std::sync::Arc;
use tempfile::TempDir;

/// Name of the test function that runs the window.
const WINDOW_TEST: &str = "the_window_itself";
/// Environment variable with the path of the window's scene.
const SCENE_VARIABLE: &str = "SDFC_WINDOW_SCENE";

#[test]
#[ignore = "it is the window that the other tests open"]
fn the_window_itself() {
    let Some(path) = std::env::var_os(SCENE_VARIABLE) else {
        return;
    };
    let services = WindowServices {
        files: Arc::new(Disk),
        opener: Box::new(|| -> EngineOpener { Box::new(engine::open) }),
        examples: Vec::new(),
    };
    let session = Session::new(SceneOrigin::File(path.into()), Devices::default());
    open(session, services).expect("a window");
}

/// A scene in its own temporary folder.
struct SceneFolder {
    folder: TempDir,
}

impl SceneFolder {
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

    /// Saves like an editor: a new file replaces the old one.
    fn rename(&self, text: &str) {
        let new = self.folder.path().join("scene.sdf.new");
        fs::write(&new, text).expect("written");
        fs::rename(new, self.path()).expect("renamed");
    }

    fn text(&self) -> String {
        fs::read_to_string(self.path()).expect("read")
    }
}

/// Returns a scene with a uniformly emissive sphere on black.
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

/// Centre of the picture while the panels are hidden.
const MIDDLE: [usize; 2] = [SIZE[0] / 2, SIZE[1] / 2];
/// The window without the bars above and below the picture.
const PICTURE_AREA: ScreenRect = ScreenRect {
    from: [0, 40],
    to: [SIZE[0], SIZE[1] - 30],
};
/// Area of reports, without the frame around the picture.
const REPORT_AREA: ScreenRect = ScreenRect {
    from: [20, 50],
    to: [SIZE[0] - 20, SIZE[1] - 40],
};
/// Area of the params while the panels are shown.
const PARAMS_AREA: ScreenRect = ScreenRect {
    from: [0, 40],
    to: [230, SIZE[1] - 30],
};

/// Matches colours close to this one.
fn is_close_to(expected: Color) -> impl Fn(Color) -> bool {
    move |color| (0..3).all(|i| color[i].abs_diff(expected[i]) <= 12)
}

const RED: Color = [255, 0, 0];
const GREEN: Color = [0, 255, 0];
const BLUE: Color = [0, 0, 255];
/// Matches the frame around an outdated picture, and the text of its report.
fn is_alarm(color: Color) -> bool {
    is_close_to([242, 110, 112])(color)
}
/// Matches the text of a warning.
fn is_warning(color: Color) -> bool {
    is_close_to([230, 180, 92])(color)
}
/// Matches the filled part of a slider.
fn is_slider(color: Color) -> bool {
    is_close_to([46, 74, 120])(color)
}

/// Matches screens whose centre has this colour and that show no error.
fn shows(color: Color) -> impl Fn(&Screen) -> bool {
    move |screen| is_close_to(color)(screen.at(MIDDLE)) && screen.count(PICTURE_AREA, is_alarm) == 0
}

/// Opens the window on a sphere and hides its panels.
fn opened<'d>(desktop: &'d Desktop, scene: &SceneFolder) -> Window<'d> {
    let window = Window::open(desktop, &scene.path());
    window.until("the panels", |screen| {
        screen.count(PARAMS_AREA, is_slider) > 20
    });
    desktop.key("p");
    window.until("a red ball", shows(RED));
    window
}

#[test]
fn a_scene_is_followed_while_it_is_edited_broken_and_mended() {
    if is_window_skipped() {
        return;
    }
    let desktop = Desktop::start();
    let scene = SceneFolder::new(&ball("#ff0000", ""));
    let window = opened(&desktop, &scene);

    scene.write(&ball("#0000ff", ""));
    window.until("blue, after the file was written", shows(BLUE));
    scene.rename(&ball("#00ff00", ""));
    window.until("green, after another file took its place", shows(GREEN));
    let first_picture = window.wait_until_idle();

    scene.write(&ball("#ff0000", " | sphre(2)"));
    let broken = window.until("a report", |screen| {
        screen.count(PICTURE_AREA, is_alarm) > 2 * SIZE[0]
    });
    let dimmed = broken.at(MIDDLE);
    assert!(
        dimmed[1] > 60 && dimmed[1] < 160 && dimmed[0] < 20,
        "the last good picture is not under it, dimmed: {dimmed:?}"
    );
    // The frame surrounds the picture.
    for [x, y] in [[0, MIDDLE[1]], [SIZE[0] - 1, MIDDLE[1]]] {
        assert!(is_alarm(broken.at([x, y])), "no frame at {x}, {y}");
    }
    scene.rename(&ball("#00ff00", ""));
    window.until("green again, and no report", shows(GREEN));
    let mended = window.wait_until_idle();
    let differs = mended.differs(&first_picture, PICTURE_AREA);
    assert_eq!(differs, 0, "pixels differ from before it was broken");

    fs::remove_file(scene.path()).expect("removed");
    window.until("a report of a file that is gone", |screen| {
        screen.count(PICTURE_AREA, is_alarm) > 2 * SIZE[0]
    });
    scene.write(&ball("#0000ff", ""));
    window.until("blue, now that it is back", shows(BLUE));

    desktop.key("ctrl+q");
    assert!(window.closes(), "it failed while closing");
}

#[test]
fn sliders_mouse_and_keys_change_the_picture() {
    if is_window_skipped() {
        return;
    }
    let desktop = Desktop::start();
    let scene = SceneFolder::new(&ball("#ff0000", ""));
    let window = opened(&desktop, &scene);
    let first = window.wait_until_idle();
    let red = |screen: &Screen| screen.count(PICTURE_AREA, is_close_to(RED));

    // A slider enlarges the sphere; a reset restores it.
    desktop.key("p");
    let panels = window.until("the panels", |screen| {
        screen.count(PARAMS_AREA, is_slider) > 20
    });
    let small = red(&window.wait_until_idle());
    let filled = panels.positions(PARAMS_AREA, is_slider);
    let x = filled
        .iter()
        .map(|position| position[0])
        .max()
        .expect("a slider") as i32;
    let y = filled.iter().map(|position| position[1]).sum::<usize>() / filled.len();
    desktop.drag("1", [x + 4, y as i32], [x + 150, y as i32]);
    window.until("a larger ball", |screen| red(screen) > 2 * small);
    assert_eq!(scene.text(), ball("#ff0000", ""), "the text was touched");
    desktop.key("r");
    window.until("the ball as it was", |screen| red(screen) == small);

    // The changed value is written into the text, and nothing else changes.
    desktop.drag("1", [x + 4, y as i32], [x + 150, y as i32]);
    window.until("a larger ball", |screen| red(screen) > 2 * small);
    desktop.key("ctrl+w");
    window.until("the params as in the text", |screen| {
        scene.text() != ball("#ff0000", "")
            && screen.count(PARAMS_AREA, is_close_to([122, 170, 245])) == 0
    });
    let written = scene.text();
    let value = written.split("param r = ").nth(1).expect("the param");
    let value = value.split_once(" in").expect("its range").0;
    let number: f64 = value.parse().expect("a number");
    assert!((0.9..=1.5).contains(&number), "{number}");
    let restored = written.replace(&format!("r = {value}"), "r = 0.5");
    assert_eq!(restored, ball("#ff0000", ""), "more than the value changed");
    scene.write(&ball("#ff0000", ""));
    desktop.key("p");
    window.until("the first picture", |screen| {
        screen.differs(&first, PICTURE_AREA) == 0
    });

    // A sphere looks the same from all directions, so the camera is panned.
    let middle = MIDDLE.map(|v| v as i32);
    desktop.drag("3", middle, [middle[0] - 200, middle[1]]);
    // The front of the sphere follows the mouse; its centre, which is farther away, moves less.
    let moved = ScreenRect {
        from: [MIDDLE[0] - 240, 0],
        to: [MIDDLE[0] - 125, SIZE[1]],
    };
    window.until("the ball on the left", |screen| {
        !is_close_to(RED)(screen.at(MIDDLE))
            && screen.count(moved, is_close_to(RED)) + 100 > red(&first)
    });
    desktop.key("0");
    window.until("the scene's camera", |screen| {
        screen.differs(&first, PICTURE_AREA) == 0
    });
    let [x, y] = middle.map(|v| v.to_string());
    desktop.tool(&["mousemove", &x, &y, "click", "--repeat", "6", "4"]);
    desktop.park();
    window.until("a nearer ball", |screen| red(screen) > red(&first) * 3 / 2);
    desktop.key("0");
    window.until("the scene's camera", |screen| {
        screen.differs(&first, PICTURE_AREA) == 0
    });

    // Another view mode has other colours; returning restores the first picture.
    desktop.key("m");
    window.until("something else", |screen| {
        !is_close_to(RED)(screen.at(MIDDLE))
    });
    desktop.key("shift+m");
    window.until("the picture as before", |screen| {
        screen.differs(&first, PICTURE_AREA) == 0
    });

    // The list of keys covers the picture until it is closed.
    desktop.key("question");
    window.until("the keys", |screen| {
        screen.differs(&first, PICTURE_AREA) > 10_000
    });
    desktop.key("Escape");
    window.until("no keys", |screen| {
        screen.differs(&first, PICTURE_AREA) == 0
    });

    // A menu covers the picture too.
    desktop.tool(&["mousemove", "20", "12", "click", "1"]);
    desktop.park();
    window.until("the menu of files", |screen| {
        screen.differs(&first, PICTURE_AREA) > 10_000
    });
    desktop.key("Escape");
    window.until("no menu", |screen| {
        screen.differs(&first, PICTURE_AREA) == 0
    });
}

#[test]
fn a_report_grows_with_its_lines() {
    if is_window_skipped() {
        return;
    }
    let desktop = Desktop::start();
    let scene = SceneFolder::new(&ball("#ff0000", ""));
    let window = opened(&desktop, &scene);
    // The red letters of reports, which name the errors.
    let errors = |screen: &Screen| screen.count(REPORT_AREA, is_alarm);
    let two_errors = ball(
        "#ff0000",
        " | sphre(2) | bxo(1) | trous(1, 2) | cilinder(1)",
    );
    scene.write(&two_errors);
    window.until("a report", |screen| errors(screen) > 100);
    let full = errors(&window.wait_until_idle());
    scene.write(&ball("#ff0000", ""));
    window.until("a red ball", shows(RED));
    scene.write(&format!("let unused = 1;\n{}", ball("#ff0000", "")));
    window.until("a warning", |screen| {
        screen.count(REPORT_AREA, is_warning) > 20
    });
    scene.write(&two_errors);
    window.until("a report", |screen| errors(screen) > 100);
    let after_warning = errors(&window.wait_until_idle());
    assert_eq!(after_warning, full, "lines are hidden");
}

#[test]
fn typing_while_the_program_is_busy_reaches_the_field() {
    if is_window_skipped() {
        return;
    }
    let desktop = Desktop::start();
    let scene = SceneFolder::new(&ball("#ff0000", ""));
    let window = opened(&desktop, &scene);
    window.wait_until_idle();
    let other = ball("#0000ff", "");
    fs::write(scene.folder.path().join("swpm.sdf"), other).expect("written");

    // All keys arrive in one frame, before the field exists.
    window.stop();
    let keys = [
        "o", "ctrl+a", "s", "w", "p", "m", "period", "s", "d", "f", "Return",
    ];
    for key in keys {
        desktop.key(key);
    }
    window.resume();
    window.until("the other scene, without panels", shows(BLUE));

    // The field is closed, so that a key of the window counts again.
    desktop.key("ctrl+s");
    let is_saved = || scene.folder.path().join("swpm.png").exists();
    window.until("the saved picture", |_| is_saved());
    let files = fs::read_dir(scene.folder.path()).expect("the folder");
    assert_eq!(files.count(), 3, "two scenes and one picture");
}

#[test]
fn a_typed_number_counts_once_it_is_complete() {
    if is_window_skipped() {
        return;
    }
    let desktop = Desktop::start();
    let text = ball("#ff0000", "").replace("0.5 in 0.2..=1.5", "50cm in 20cm..=150cm");
    let scene = SceneFolder::new(&text);
    let window = opened(&desktop, &scene);
    desktop.key("p");
    let panels = window.until("the panels", |screen| {
        screen.count(PARAMS_AREA, is_slider) > 20
    });
    let red = |screen: &Screen| screen.count(PICTURE_AREA, is_close_to(RED));
    let small = red(&window.wait_until_idle());
    let slider = panels.positions(PARAMS_AREA, is_slider);
    let y = slider.iter().map(|position| position[1]).sum::<usize>() / slider.len();
    // The number stands above the right end of the slider.
    let number = ["215".to_owned(), (y - 24).to_string()];
    let type_number = |keys: &[&str]| {
        desktop.tool(&["mousemove", &number[0], &number[1], "click", "1"]);
        for key in keys {
            desktop.key(key);
        }
        desktop.park();
    };
    type_number(&["1", "period", "2", "m"]);
    assert_eq!(red(&window.wait_until_idle()), small, "it is incomplete");
    desktop.key("Return");
    window.until("a larger ball", |screen| red(screen) > 4 * small);
    let large = window.wait_until_idle();
    type_number(&["3", "0", "Escape"]);
    assert_eq!(
        red(&window.wait_until_idle()),
        red(&large),
        "Escape restores"
    );
    desktop.key("ctrl+w");
    let written = text.replace("50cm in", "120cm in");
    window.until("the written number", |_| scene.text() == written);
}

#[test]
fn a_thousand_edits_hold_memory_and_file_handles() {
    let Some(edits) = std::env::var("SDFC_SOAK").ok() else {
        return;
    };
    if is_window_skipped() {
        return;
    }
    let edits: usize = edits.parse().expect("SDFC_SOAK is a number of edits");
    let desktop = Desktop::start();
    let scene = SceneFolder::new(&ball("#ff0000", ""));
    let window = opened(&desktop, &scene);
    let mut settled = None;
    for edit in 0..edits {
        let (name, color) = [("#00ff00", GREEN), ("#0000ff", BLUE), ("#ff0000", RED)][edit % 3];
        if edit % 7 == 0 {
            scene.write(&ball(name, " | sphre(2)"));
            window.until("a report", |screen| {
                screen.count(PICTURE_AREA, is_alarm) > SIZE[0]
            });
        }
        if edit % 2 == 0 {
            scene.rename(&ball(name, ""));
        } else {
            scene.write(&ball(name, ""));
        }
        window.until("the next colour", shows(color));
        if edit == edits / 10 {
            window.wait_until_idle();
            settled = Some((window.memory(), window.handles()));
        }
    }
    window.wait_until_idle();
    let (memory, handles) = settled.expect("enough edits");
    let current = (window.memory(), window.handles());
    eprintln!("{edits} edits: from {memory} KiB and {handles} files to {current:?}");
    assert!(
        current.1 <= handles,
        "{handles} files were open, now {}",
        current.1
    );
    // Allocators may retain a twentieth.
    let max_memory = memory + memory / 20 + 4096;
    assert!(
        current.0 <= max_memory,
        "{memory} KiB were resident, now {}",
        current.0
    );
}
