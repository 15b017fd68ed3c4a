//! The window of a [`SessionHost`](crate::session_host).
//!
//! It draws the state of the session with egui and converts mouse and key input into events; all
//! decisions are made by the session. A frame is drawn after input, after an event of a worker thread,
//! and when the session requests a wake-up. At rest no frames are drawn.

mod action;
mod canvas;
mod corner_labels;
mod dialogs;
mod engine_label;
mod icon;
mod input_queue;
mod menu;
mod number_box;
mod params;
mod picture_view;
mod report;
mod side_panel;
mod state;
mod status;
mod theme;
mod timebar;
mod view_picker;
mod widgets;

use crate::build::SceneOrigin;
use crate::renderer::EngineOpener;
use crate::session::{Event, Session};
use crate::session_host::SessionHost;
use eframe::egui::{self, Context, Frame, Margin, Panel, Ui, ViewportBuilder, ViewportCommand};
use input_queue::{InputQueue, KeyReceiver};
use sdfc_io::files::Files;
use state::{Dialog, WindowState};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// An example scene that comes with the program.
#[derive(Clone, Copy, Debug)]
pub struct Example {
    /// Name of the example.
    pub name: &'static str,
    /// Text of the scene.
    pub text: &'static str,
}

/// Services that the window requires besides a session.
pub struct WindowServices {
    /// Storage that scenes are read from and written to.
    pub files: Arc<dyn Files>,
    /// Creates the engine opener of each render thread.
    pub opener: Box<dyn Fn() -> EngineOpener>,
    /// Entries of the menu of examples.
    pub examples: Vec<Example>,
}

/// Reason why no window can be opened.
#[derive(Debug, thiserror::Error)]
pub enum WindowError {
    /// No desktop is available.
    #[error("there is no desktop to open a window on: {0}; `sdfc watch` needs none")]
    Desktop(String),
    /// No driver can draw on the desktop.
    #[error(
        "there is no Vulkan driver that draws in windows: {0}; a software one will do (on Debian \
         mesa-vulkan-drivers), and `sdfc watch` needs none"
    )]
    Driver(String),
    /// The session host could not be started.
    #[error("{0}")]
    SessionHost(String),
}

/// Opens the window and returns when it is closed. On Linux any thread may call this, elsewhere only the
/// main thread.
///
/// # Errors
///
/// The missing requirement of a window.
pub fn open(session: Session, services: WindowServices) -> Result<(), WindowError> {
    let mut options = eframe::NativeOptions {
        viewport: ViewportBuilder::default()
            .with_inner_size([1280.0, 800.0])
            .with_min_inner_size([480.0, 320.0]),
        // The displayed colours must match those of a saved picture.
        dithering: false,
        ..eframe::NativeOptions::default()
    };
    options.viewport.title = Some(title(&session));
    #[cfg(target_os = "linux")]
    {
        use winit::platform::x11::EventLoopBuilderExtX11;
        options.event_loop_builder = Some(Box::new(|builder| {
            builder.with_any_thread(true);
        }));
    }
    let opened = Arc::new(AtomicBool::new(false));
    let was_opened = Arc::clone(&opened);
    let start = Box::new(move |creation: &eframe::CreationContext<'_>| {
        was_opened.store(true, Ordering::Relaxed);
        if let Some(state) = &creation.wgpu_render_state {
            canvas::prepare(state);
        }
        let window = Window::new(&creation.egui_ctx, session, services)?;
        Ok(Box::new(window) as Box<dyn eframe::App>)
    });
    // A missing desktop library causes a panic.
    let run = AssertUnwindSafe(move || eframe::run_native("sdfc", options, start));
    match catch_unwind(run) {
        Ok(result) => result.map_err(WindowError::from),
        Err(panic) if opened.load(Ordering::Relaxed) => resume_unwind(panic),
        Err(panic) => {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let text = text.or(panic.downcast_ref::<&str>().copied());
            let text = text.unwrap_or("a library of the desktop is missing");
            Err(WindowError::Desktop(text.to_owned()))
        }
    }
}

impl From<eframe::Error> for WindowError {
    fn from(error: eframe::Error) -> Self {
        match error {
            eframe::Error::AppCreation(why) => Self::SessionHost(why.to_string()),
            eframe::Error::Wgpu(why) => {
                // The message ends with a list of the backends' reasons, which may be empty.
                let text = why.to_string();
                Self::Driver(text.trim_end_matches(": {}").to_owned())
            }
            other => {
                // The prefix is the location in the library.
                let text = other.to_string();
                let reason = text.rsplit(": ").next().unwrap_or(&text);
                Self::Desktop(reason.trim_end_matches('.').to_owned())
            }
        }
    }
}

fn title(session: &Session) -> String {
    format!("{} · sdfc", session.source().path().display())
}

/// Minimum delay of a requested repaint.
const MIN_REPAINT_DELAY: Duration = Duration::from_micros(100);

/// The application.
struct Window {
    studio: SessionHost,
    examples: Vec<Example>,
    picture_view: picture_view::PictureView,
    state: WindowState,
    input: InputQueue,
    /// Widget that had the focus when the last frame began.
    focus: Option<egui::Id>,
    /// Receiver of the keys of this frame.
    key_receiver: KeyReceiver,
    title: String,
}

impl Window {
    fn new(ctx: &Context, session: Session, services: WindowServices) -> Result<Self, String> {
        theme::apply(ctx);
        let title = title(&session);
        let waker = ctx.clone();
        // A repaint after a delay, however short, draws one frame; an immediate one would draw two.
        let wake = move || waker.request_repaint_after(MIN_REPAINT_DELAY);
        Ok(Self {
            studio: SessionHost::new(session, services.files, services.opener, wake)?,
            examples: services.examples,
            picture_view: picture_view::PictureView::default(),
            state: WindowState::default(),
            input: InputQueue::default(),
            focus: None,
            key_receiver: KeyReceiver::Window,
            title,
        })
    }

    /// Runs the session host and schedules the next frame if the session requests a wake-up.
    fn turn(&mut self, ctx: &Context) {
        if let Some(delay) = self.studio.turn() {
            ctx.request_repaint_after(delay.max(MIN_REPAINT_DELAY));
        }
        if let Some(text) = self.studio.session_mut().take_exported() {
            ctx.copy_text(text);
        }
        let title = title(self.studio.session());
        if title != self.title {
            ctx.send_viewport_cmd(ViewportCommand::Title(title.clone()));
            self.title = title;
        }
        let now = ctx.input(|input| input.time);
        if let Some((_, number)) = self.studio.session().picture() {
            self.state.count(number, now);
        }
    }

    /// Opens a file that was dropped on the window.
    fn dropped(ctx: &Context, events: &mut Vec<Event>) {
        let dropped = ctx.input(|input| {
            let file = input.raw.dropped_files.first();
            file.map(|file| file.path().to_owned())
        });
        if let Some(path) = dropped {
            events.push(Event::Open(SceneOrigin::File(path)));
        }
    }
}

impl eframe::App for Window {
    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        self.turn(&ctx);
        let mut events = Vec::new();
        number_box::observe_escape(&ctx);
        let mut actions = action::pressed(&ctx, self.key_receiver, self.state.dialog);
        let now = self.studio.now();
        let session = self.studio.session();
        let state = &mut self.state;
        let margins = |x, y| Frame::new().inner_margin(Margin::symmetric(x, y));
        Panel::top("menu").frame(margins(8, 3)).show(ui, |ui| {
            actions.extend(menu::show(ui, session, &self.examples, &mut events));
        });
        Panel::bottom("status")
            .frame(margins(10, 0))
            .exact_size(24.0)
            .show(ui, |ui| status::show(ui, session, state, now));
        if session.timeline().is_some() {
            Panel::bottom("time")
                .frame(margins(8, 0))
                .exact_size(34.0)
                .show(ui, |ui| timebar::show(ui, session, &mut events));
        }
        if state.panels && !session.params().is_empty() {
            Panel::left("params")
                .frame(margins(12, 8))
                .default_size(250.0)
                .size_range(190.0..=420.0)
                .show(ui, |ui| {
                    actions.extend(params::show(ui, session, state, &mut events))
                });
        }
        if state.panels {
            Panel::right("side")
                .frame(margins(12, 8))
                .exact_size(212.0)
                .resizable(false)
                .show(ui, |ui| {
                    actions.extend(side_panel::show(ui, session, state, &mut events));
                });
        }
        let picture_rect = egui::CentralPanel::no_frame()
            .show(ui, |ui| self.picture_view.show(ui, session, &mut events))
            .inner;
        corner_labels::legend(ui, session, picture_rect);
        corner_labels::pick(ui, session, picture_rect, &mut events);
        report::show(ui, session, state, picture_rect);
        dialogs::message(&ctx, session, state, picture_rect, &mut events);
        dialogs::show(&ctx, state, &mut events);
        Self::dropped(&ctx, &mut events);
        for action in actions {
            action.run(&ctx, session, state, &mut events);
        }
        if self.state.dialog != Dialog::None {
            // Input for a dialog must not move the camera.
            events.retain(|event| !matches!(event, Event::Camera(_)));
        }
        for event in events {
            self.studio.handle(event);
        }
        // New events are processed without waiting for the next frame.
        self.turn(&ctx);
    }

    fn raw_input_hook(&mut self, ctx: &Context, raw_input: &mut egui::RawInput) {
        let focus = ctx.memory(egui::Memory::focused);
        // A number box becomes a text field in the frame after it received the focus.
        let is_new = std::mem::replace(&mut self.focus, focus) != focus && focus.is_some();
        // The focus is read here, because Escape ends it before the frame reads keys.
        self.key_receiver = match self.state.dialog {
            Dialog::Open if self.state.frames_until_focus > 0 => KeyReceiver::NoneYet,
            _ if is_new => KeyReceiver::NoneYet,
            _ if ctx.text_edit_focused() => KeyReceiver::TextField,
            _ if focus.is_some() => KeyReceiver::Widget,
            _ => KeyReceiver::Window,
        };
        let events = std::mem::take(&mut raw_input.events);
        raw_input.events = self.input.next_frame(events, self.key_receiver);
        if !self.input.is_empty() || is_new {
            ctx.request_repaint();
        }
    }

    fn clear_color(&self, _visuals: &egui::Visuals) -> [f32; 4] {
        // The clear colour equals that of the panels. Clearing a pixel costs software Vulkan about as
        // much as drawing one of the picture.
        theme::PANEL.to_normalized_gamma_f32()
    }
}
