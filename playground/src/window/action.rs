//! What can be done with a key, from a menu or with a button: one list, which the menus, the help and
//! the keyboard share.

use super::desk::{Desk, Overlay};
use super::shown::{KINDS, Kind};
use crate::camera::Side;
use crate::session::{CameraEvent, Event, Session, TimeEvent};
use eframe::egui::{Context, Key, Modifiers, Popup, ViewportCommand};
use sdfc_compiler::export::Target;
use std::path::{Path, PathBuf};

/// Something that can be done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Action {
    Open,
    Save,
    Copy(Target),
    CopyCamera,
    Quit,
    Fit,
    Face(Side),
    ToggleLens,
    SceneCamera,
    NextMode(i32),
    Play,
    Step(i64),
    ResetParams,
    WriteParams,
    TogglePanels,
    Help,
    Close,
}

/// A key that does something.
pub(super) struct Binding {
    pub(super) key: Key,
    pub(super) modifiers: Modifiers,
    pub(super) action: Action,
    /// The key as it is written.
    pub(super) name: &'static str,
    /// What it does.
    pub(super) says: &'static str,
}

const fn bind(
    name: &'static str,
    modifiers: Modifiers,
    key: Key,
    action: Action,
    says: &'static str,
) -> Binding {
    Binding {
        key,
        modifiers,
        action,
        name,
        says,
    }
}

const PLAIN: Modifiers = Modifiers::NONE;
const CTRL: Modifiers = Modifiers::COMMAND;
const SHIFT: Modifiers = Modifiers::SHIFT;

/// All keys; of two with the same key, the one with modifiers comes first.
pub(super) const KEYS: [Binding; 24] = [
    bind(
        "F",
        PLAIN,
        Key::F,
        Action::Fit,
        "all of the scene into the picture",
    ),
    bind(
        "Ctrl 1",
        CTRL,
        Key::Num1,
        Action::Face(Side::Back),
        "from behind",
    ),
    bind(
        "1",
        PLAIN,
        Key::Num1,
        Action::Face(Side::Front),
        "from the front",
    ),
    bind(
        "Ctrl 3",
        CTRL,
        Key::Num3,
        Action::Face(Side::Left),
        "from the left",
    ),
    bind(
        "3",
        PLAIN,
        Key::Num3,
        Action::Face(Side::Right),
        "from the right",
    ),
    bind(
        "Ctrl 7",
        CTRL,
        Key::Num7,
        Action::Face(Side::Bottom),
        "from below",
    ),
    bind("7", PLAIN, Key::Num7, Action::Face(Side::Top), "from above"),
    bind(
        "9",
        PLAIN,
        Key::Num9,
        Action::Face(Side::Isometric),
        "from a corner",
    ),
    bind(
        "5",
        PLAIN,
        Key::Num5,
        Action::ToggleLens,
        "parallel rays, or perspective",
    ),
    bind(
        "0",
        PLAIN,
        Key::Num0,
        Action::SceneCamera,
        "the scene's own camera",
    ),
    bind(
        "C",
        PLAIN,
        Key::C,
        Action::CopyCamera,
        "copy the camera as text",
    ),
    bind(
        "Shift M",
        SHIFT,
        Key::M,
        Action::NextMode(-1),
        "what was shown before",
    ),
    bind(
        "M",
        PLAIN,
        Key::M,
        Action::NextMode(1),
        "show the next thing",
    ),
    bind("Space", PLAIN, Key::Space, Action::Play, "play or pause"),
    bind("←", PLAIN, Key::ArrowLeft, Action::Step(-1), "a frame back"),
    bind(
        "→",
        PLAIN,
        Key::ArrowRight,
        Action::Step(1),
        "a frame forwards",
    ),
    bind(
        "R",
        PLAIN,
        Key::R,
        Action::ResetParams,
        "all params as in the text",
    ),
    bind(
        "W",
        PLAIN,
        Key::W,
        Action::WriteParams,
        "write changed params into the text",
    ),
    bind("S", PLAIN, Key::S, Action::Save, "save the picture"),
    bind("O", PLAIN, Key::O, Action::Open, "open a file"),
    bind(
        "P",
        PLAIN,
        Key::P,
        Action::TogglePanels,
        "hide or show the panels",
    ),
    bind("?", PLAIN, Key::Questionmark, Action::Help, "this list"),
    bind("Ctrl Q", CTRL, Key::Q, Action::Quit, "close the window"),
    bind(
        "Esc",
        PLAIN,
        Key::Escape,
        Action::Close,
        "close what lies over the picture",
    ),
];

/// The key of an action, as it is written.
pub(super) fn key_of(action: Action) -> &'static str {
    let found = KEYS.iter().rev().find(|binding| binding.action == action);
    found.map_or("", |binding| binding.name)
}

/// The actions whose keys were pressed, unless somebody types.
pub(super) fn pressed(ctx: &Context) -> Vec<Action> {
    let types = ctx.text_edit_focused();
    // Then Escape is the menu's.
    let chooses = Popup::is_any_open(ctx);
    ctx.input_mut(|input| {
        let mut found = Vec::new();
        for binding in &KEYS {
            let closes = binding.action == Action::Close;
            if closes && chooses || types && !closes {
                continue;
            }
            if input.consume_key(binding.modifiers, binding.key) {
                found.push(binding.action);
            }
        }
        found
    })
}

impl Action {
    /// Does it: to the session by events, to the window at once.
    pub(super) fn run(
        self,
        ctx: &Context,
        session: &Session,
        desk: &mut Desk,
        events: &mut Vec<Event>,
    ) {
        let camera = |event| Event::Camera(event);
        match self {
            Self::Open => desk.open_path(session),
            Self::Save => events.push(Event::Save(free_name(session.source().path()))),
            Self::Copy(target) => events.push(Event::Export(target)),
            Self::CopyCamera => {
                if let Some(camera) = session.camera() {
                    let (_, name) = session.cameras();
                    let name = name.filter(|name| !name.is_empty());
                    ctx.copy_text(camera.text(name));
                    desk.say(ctx, "the camera was copied as text".to_owned());
                }
            }
            Self::Quit => ctx.send_viewport_cmd(ViewportCommand::Close),
            Self::Fit => events.push(camera(CameraEvent::Fit)),
            Self::Face(side) => events.push(camera(CameraEvent::Face(side))),
            Self::ToggleLens => events.push(camera(CameraEvent::ToggleLens)),
            Self::SceneCamera => {
                let (_, name) = session.cameras();
                let name = name.filter(|name| !name.is_empty()).map(str::to_owned);
                events.push(camera(CameraEvent::Scene(name)));
            }
            Self::NextMode(by) => {
                let seen = Kind::of(session.show());
                let now = KINDS.iter().position(|(kind, ..)| *kind == seen);
                let now = now.unwrap_or(0) as i32;
                let next = (now + by).rem_euclid(KINDS.len() as i32) as usize;
                events.push(Event::Show(KINDS[next].0.show(desk, session)));
            }
            Self::Play => events.push(Event::Time(TimeEvent::Toggle)),
            Self::Step(frames) => events.push(Event::Time(TimeEvent::Step(frames))),
            Self::ResetParams => events.push(Event::ResetAll),
            Self::WriteParams => {
                let knobs = session.knobs().iter().enumerate();
                let changed = knobs.filter(|(_, knob)| knob.is_changed());
                let changed: Vec<usize> = changed.map(|(index, _)| index).collect();
                if !changed.is_empty() {
                    events.push(Event::WriteBack(changed));
                }
            }
            Self::TogglePanels => desk.panels = !desk.panels,
            Self::Help => {
                desk.overlay = match desk.overlay {
                    Overlay::Help => Overlay::None,
                    _ => Overlay::Help,
                }
            }
            Self::Close => {
                if desk.overlay == Overlay::None {
                    events.push(Event::Dismiss);
                    events.push(Event::Unpick);
                }
                desk.overlay = Overlay::None;
                desk.report_open = false;
            }
        }
    }
}

/// Where a scene's picture is saved: in the present folder, under a name that is still free.
fn free_name(source: &Path) -> PathBuf {
    let stem = source.file_stem().unwrap_or("picture".as_ref());
    let named = |number: u32| {
        let mut name = stem.to_owned();
        if number > 1 {
            name.push(format!("-{number}"));
        }
        name.push(".png");
        PathBuf::from(name)
    };
    let mut names = (1..10_000).map(named);
    let free = names.find(|name| !name.exists());
    free.unwrap_or_else(|| named(10_000))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_hides_another() {
        for (at, binding) in KEYS.iter().enumerate() {
            let hidden = KEYS[..at]
                .iter()
                .find(|other| other.key == binding.key && other.modifiers.is_none());
            assert!(hidden.is_none(), "{} is never reached", binding.name);
        }
    }

    #[test]
    fn every_action_with_a_key_is_named_by_it() {
        assert_eq!(key_of(Action::Face(Side::Bottom)), "Ctrl 7");
        assert_eq!(key_of(Action::CopyCamera), "C");
        assert_eq!(key_of(Action::Copy(Target::Glsl)), "");
    }

    #[test]
    fn a_picture_takes_a_name_that_is_free() {
        let name = free_name(Path::new("/somewhere/a scene.sdf"));
        assert_eq!(name, Path::new("a scene.png"));
        // The crate's own folder has this one.
        std::fs::write("taken-by-a-test.png", b"").expect("written");
        let name = free_name(Path::new("taken-by-a-test.sdf"));
        std::fs::remove_file("taken-by-a-test.png").expect("removed");
        assert_eq!(name, Path::new("taken-by-a-test-2.png"));
    }
}
