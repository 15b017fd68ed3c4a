//! Actions of keys, menus and buttons, in one list shared by the menus, the help and the keyboard.

use super::input_queue::KeyReceiver;
use super::state::{Dialog, WindowState};
use super::view_picker::{VIEW_KINDS, ViewKind};
use crate::session::{CameraEvent, Event, Session, TimeEvent};
use eframe::egui::{self, Context, Key, Modifiers, Popup, ViewportCommand};
use sdfc_compiler::export::Target;
use sdfc_runtime::settings::ViewSide;
use std::path::{Path, PathBuf};

/// An action of the user.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Action {
    Open,
    Save,
    Copy(Target),
    CopyCamera,
    Quit,
    Fit,
    Face(ViewSide),
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

/// A key bound to an action.
pub(super) struct KeyBinding {
    pub(super) key: Key,
    pub(super) modifiers: Modifiers,
    pub(super) action: Action,
    /// Displayed name of the key.
    pub(super) name: &'static str,
    /// Description in the help.
    pub(super) description: &'static str,
}

const fn bind(
    name: &'static str,
    modifiers: Modifiers,
    key: Key,
    action: Action,
    description: &'static str,
) -> KeyBinding {
    KeyBinding {
        key,
        modifiers,
        action,
        name,
        description,
    }
}

const NO_MODIFIER: Modifiers = Modifiers::NONE;
const CTRL: Modifiers = Modifiers::COMMAND;
const SHIFT: Modifiers = Modifiers::SHIFT;

/// All key bindings. Of two bindings of the same key, the one with modifiers comes first.
pub(super) static KEYS: [KeyBinding; 24] = [
    bind(
        "F",
        NO_MODIFIER,
        Key::F,
        Action::Fit,
        "fit the scene into the picture",
    ),
    bind(
        "Ctrl 1",
        CTRL,
        Key::Num1,
        Action::Face(ViewSide::Back),
        "from behind",
    ),
    bind(
        "1",
        NO_MODIFIER,
        Key::Num1,
        Action::Face(ViewSide::Front),
        "from the front",
    ),
    bind(
        "Ctrl 3",
        CTRL,
        Key::Num3,
        Action::Face(ViewSide::Left),
        "from the left",
    ),
    bind(
        "3",
        NO_MODIFIER,
        Key::Num3,
        Action::Face(ViewSide::Right),
        "from the right",
    ),
    bind(
        "Ctrl 7",
        CTRL,
        Key::Num7,
        Action::Face(ViewSide::Bottom),
        "from below",
    ),
    bind(
        "7",
        NO_MODIFIER,
        Key::Num7,
        Action::Face(ViewSide::Top),
        "from above",
    ),
    bind(
        "9",
        NO_MODIFIER,
        Key::Num9,
        Action::Face(ViewSide::Corner),
        "from a corner",
    ),
    bind(
        "5",
        NO_MODIFIER,
        Key::Num5,
        Action::ToggleLens,
        "parallel rays, or perspective",
    ),
    bind(
        "0",
        NO_MODIFIER,
        Key::Num0,
        Action::SceneCamera,
        "the scene's own camera",
    ),
    bind(
        "C",
        NO_MODIFIER,
        Key::C,
        Action::CopyCamera,
        "copy the camera as text",
    ),
    bind(
        "Shift M",
        SHIFT,
        Key::M,
        Action::NextMode(-1),
        "show the previous view",
    ),
    bind(
        "M",
        NO_MODIFIER,
        Key::M,
        Action::NextMode(1),
        "show the next view",
    ),
    bind(
        "Space",
        NO_MODIFIER,
        Key::Space,
        Action::Play,
        "play or pause",
    ),
    bind(
        "←",
        NO_MODIFIER,
        Key::ArrowLeft,
        Action::Step(-1),
        "a frame back",
    ),
    bind(
        "→",
        NO_MODIFIER,
        Key::ArrowRight,
        Action::Step(1),
        "a frame forwards",
    ),
    bind(
        "R",
        NO_MODIFIER,
        Key::R,
        Action::ResetParams,
        "all params as in the text",
    ),
    bind(
        "Ctrl W",
        CTRL,
        Key::W,
        Action::WriteParams,
        "write changed params into the text",
    ),
    bind("Ctrl S", CTRL, Key::S, Action::Save, "save the picture"),
    bind("O", NO_MODIFIER, Key::O, Action::Open, "open a file"),
    bind(
        "P",
        NO_MODIFIER,
        Key::P,
        Action::TogglePanels,
        "hide or show the panels",
    ),
    bind(
        "?",
        NO_MODIFIER,
        Key::Questionmark,
        Action::Help,
        "this list",
    ),
    bind("Ctrl Q", CTRL, Key::Q, Action::Quit, "close the window"),
    bind(
        "Esc",
        NO_MODIFIER,
        Key::Escape,
        Action::Close,
        "close the dialog over the picture",
    ),
];

/// Returns the displayed name of an action's key.
pub(super) fn key_of(action: Action) -> &'static str {
    let actions = KEYS.iter().rev().find(|binding| binding.action == action);
    actions.map_or("", |binding| binding.name)
}

/// Takes the keys bound to actions from the input, and returns the actions in the order of the presses.
///
/// A focused widget comes first: a text field keeps all keys, other widgets keep those that operate them.
/// An open dialog keeps the keys that do not close it.
pub(super) fn pressed(ctx: &Context, receiver: KeyReceiver, dialog: Dialog) -> Vec<Action> {
    let is_typing = matches!(receiver, KeyReceiver::TextField | KeyReceiver::NoneYet);
    let is_typing = is_typing || dialog == Dialog::Open;
    // Escape closes an open menu first.
    let is_menu_open = Popup::is_any_open(ctx);
    let is_taken = |action, key| match action {
        Action::Close => is_menu_open || is_typing && dialog == Dialog::None,
        Action::Help | Action::Quit => is_typing,
        _ => {
            let is_operated = receiver == KeyReceiver::Widget && operates_widgets(key);
            is_typing || is_operated || dialog != Dialog::None
        }
    };
    ctx.input_mut(|input| {
        let mut actions = Vec::new();
        input.events.retain(|event| {
            let binding =
                binding_of(event).filter(|(binding, _)| !is_taken(binding.action, binding.key));
            let Some((binding, is_repeat)) = binding else {
                return true;
            };
            if !is_repeat || binding.action.repeats() {
                actions.push(binding.action);
            }
            false
        });
        actions
    })
}

/// Reports whether a key operates focused buttons and sliders.
fn operates_widgets(key: Key) -> bool {
    matches!(key, Key::Space | Key::ArrowLeft | Key::ArrowRight)
}

/// Returns the binding of a pressed key, and whether the press is a repetition of a held key.
fn binding_of(event: &egui::Event) -> Option<(&'static KeyBinding, bool)> {
    let egui::Event::Key {
        key,
        pressed: true,
        repeat,
        modifiers,
        ..
    } = event
    else {
        return None;
    };
    let is_pressed = |binding: &&KeyBinding| {
        binding.key == *key && modifiers.matches_logically(binding.modifiers)
    };
    Some((KEYS.iter().find(is_pressed)?, *repeat))
}

impl Action {
    /// Reports whether a held key repeats the action.
    fn repeats(self) -> bool {
        matches!(self, Self::Step(_) | Self::NextMode(_))
    }

    /// Runs the action: through events on the session, directly on the window.
    pub(super) fn run(
        self,
        ctx: &Context,
        session: &Session,
        state: &mut WindowState,
        events: &mut Vec<Event>,
    ) {
        let camera = |event| Event::Camera(event);
        match self {
            Self::Open => state.open_path(session),
            Self::Save => events.push(Event::Save(free_name(session.source().path()))),
            Self::Copy(target) => events.push(Event::Export(target)),
            Self::CopyCamera => {
                if let Some(camera) = session.camera() {
                    let (_, name) = session.cameras();
                    let name = name.filter(|name| !name.is_empty());
                    ctx.copy_text(camera.text(name));
                    state.show_message(ctx, "the camera was copied as text".to_owned());
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
                let current_kind = ViewKind::from_view_mode(session.show());
                let index = VIEW_KINDS
                    .iter()
                    .position(|(kind, ..)| *kind == current_kind);
                let index = index.unwrap_or(0) as i32;
                let next = (index + by).rem_euclid(VIEW_KINDS.len() as i32) as usize;
                events.push(Event::Show(VIEW_KINDS[next].0.show(state, session)));
            }
            Self::Play => events.push(Event::Time(TimeEvent::Toggle)),
            Self::Step(frames) => events.push(Event::Time(TimeEvent::Step(frames))),
            Self::ResetParams => events.push(Event::ResetAll),
            Self::WriteParams => {
                let params = session.params().iter().enumerate();
                let changed = params.filter(|(_, param)| param.is_changed());
                let changed: Vec<usize> = changed.map(|(index, _)| index).collect();
                if !changed.is_empty() {
                    events.push(Event::WriteBack(changed));
                }
            }
            Self::TogglePanels => state.panels = !state.panels,
            Self::Help => {
                state.dialog = match state.dialog {
                    Dialog::Help => Dialog::None,
                    _ => Dialog::Help,
                }
            }
            Self::Close => {
                if state.dialog == Dialog::None {
                    events.push(Event::Dismiss);
                    events.push(Event::Unpick);
                }
                state.dialog = Dialog::None;
                state.report_open = false;
            }
        }
    }
}

/// Returns an unused file name for a scene's picture in the current folder.
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
    let first_free = names.find(|name| !name.exists());
    first_free.unwrap_or_else(|| named(10_000))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_hides_another() {
        for (index, binding) in KEYS.iter().enumerate() {
            let hidden = KEYS[..index]
                .iter()
                .find(|other| other.key == binding.key && other.modifiers.is_none());
            assert!(hidden.is_none(), "{} is never reached", binding.name);
        }
    }

    #[test]
    fn every_action_with_a_key_is_named_by_it() {
        assert_eq!(key_of(Action::Face(ViewSide::Bottom)), "Ctrl 7");
        assert_eq!(key_of(Action::CopyCamera), "C");
        assert_eq!(key_of(Action::Copy(Target::Glsl)), "");
    }

    /// Returns the actions of keys pressed in one frame.
    fn actions_of(keys: &[(Key, Modifiers)], receiver: KeyReceiver, dialog: Dialog) -> Vec<Action> {
        let event = |&(key, modifiers): &(Key, Modifiers)| egui::Event::Key {
            key,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers,
        };
        let input = egui::RawInput {
            events: keys.iter().map(event).collect(),
            ..egui::RawInput::default()
        };
        let mut actions = Vec::new();
        let mut output = Context::default().run_ui(input, |ui| {
            actions.extend(pressed(ui.ctx(), receiver, dialog));
        });
        output.textures_delta.clear();
        actions
    }

    const HELD_CTRL: Modifiers = Modifiers {
        ctrl: true,
        command: true,
        ..Modifiers::NONE
    };

    #[test]
    fn every_press_counts_once_and_in_order() {
        let keys = [Key::P, Key::S, Key::M, Key::W, Key::O].map(|key| (key, NO_MODIFIER));
        let actions = actions_of(&keys, KeyReceiver::Window, Dialog::None);
        let expected = [Action::TogglePanels, Action::NextMode(1), Action::Open];
        assert_eq!(actions, expected, "S and W write files");
        let keys = [(Key::W, HELD_CTRL), (Key::S, HELD_CTRL)];
        let actions = actions_of(&keys, KeyReceiver::Window, Dialog::None);
        assert_eq!(actions, [Action::WriteParams, Action::Save]);
    }

    #[test]
    fn a_focused_widget_keeps_its_keys() {
        let keys = [
            (Key::P, NO_MODIFIER),
            (Key::Space, NO_MODIFIER),
            (Key::Q, HELD_CTRL),
            (Key::Escape, NO_MODIFIER),
        ];
        for receiver in [KeyReceiver::TextField, KeyReceiver::NoneYet] {
            assert_eq!(actions_of(&keys, receiver, Dialog::None), []);
        }
        let actions = actions_of(&keys, KeyReceiver::Widget, Dialog::None);
        let expected = [Action::TogglePanels, Action::Quit, Action::Close];
        assert_eq!(actions, expected, "Space presses a button");
    }

    #[test]
    fn a_dialog_leaves_only_the_keys_that_close_it() {
        let keys = [Key::M, Key::R, Key::Questionmark, Key::Escape].map(|key| (key, NO_MODIFIER));
        let actions = actions_of(&keys, KeyReceiver::Window, Dialog::Help);
        assert_eq!(actions, [Action::Help, Action::Close]);
        let actions = actions_of(&keys, KeyReceiver::TextField, Dialog::Open);
        assert_eq!(actions, [Action::Close]);
    }

    #[test]
    fn a_picture_takes_a_name_that_is_free() {
        let name = free_name(Path::new("/somewhere/a scene.sdf"));
        assert_eq!(name, Path::new("a scene.png"));
        // This file exists in the crate's folder, the current folder of tests.
        std::fs::write("taken-by-a-test.png", b"").expect("written");
        let name = free_name(Path::new("taken-by-a-test.sdf"));
        std::fs::remove_file("taken-by-a-test.png").expect("removed");
        assert_eq!(name, Path::new("taken-by-a-test-2.png"));
    }
}
