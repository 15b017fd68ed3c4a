//! The window: a [`Studio`](crate::studio) and what is seen of it.
//!
//! It asks the session what there is, draws that with egui, and turns what is done with mouse and keys
//! into events; it decides nothing by itself. A frame is drawn when something was done, when a thread
//! has news, and when the session wants to be asked again: at rest, never.

mod action;
mod canvas;
mod desk;
mod icon;
mod menu;
mod notes;
mod overlay;
mod params;
mod picture;
mod report;
mod shown;
mod side;
mod status;
mod theme;
mod timebar;

use crate::build::Source;
use crate::files::Files;
use crate::painter::Opener;
use crate::session::{Event, Session};
use crate::studio::Studio;
use desk::{Desk, Overlay};
use eframe::egui::{self, Context, Frame, Margin, Panel, Ui, ViewportBuilder, ViewportCommand};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// A scene that comes with the program.
#[derive(Clone, Copy, Debug)]
pub struct Example {
    /// Its name.
    pub name: &'static str,
    /// Its text.
    pub text: &'static str,
}

/// What the window needs besides a session.
pub struct Tools {
    /// Where files are.
    pub files: Arc<dyn Files>,
    /// Gives each thread that draws what opens engines.
    pub opener: Box<dyn Fn() -> Opener>,
    /// The menu of examples.
    pub examples: Vec<Example>,
}

/// Why there is no window.
#[derive(Debug, thiserror::Error)]
pub enum WindowError {
    /// There is no desktop.
    #[error("there is no desktop to open a window on: {0}; `sdfc watch` needs none")]
    Desktop(String),
    /// Nothing can draw on it.
    #[error(
        "there is no Vulkan driver that draws in windows: {0}; a software one will do (on Debian \
         mesa-vulkan-drivers), and `sdfc watch` needs none"
    )]
    Driver(String),
    /// What works for it could not be started.
    #[error("{0}")]
    Studio(String),
}

/// Opens the window, and returns when it is closed. On Linux that may be done on any thread, elsewhere
/// on the main one.
///
/// # Errors
///
/// Says what is missing for a window here.
pub fn open(session: Session, tools: Tools) -> Result<(), WindowError> {
    let mut options = eframe::NativeOptions {
        viewport: ViewportBuilder::default()
            .with_inner_size([1280.0, 800.0])
            .with_min_inner_size([480.0, 320.0]),
        // The picture's colours are to be those that a file of it has.
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
    let opens = Arc::clone(&opened);
    let start = Box::new(move |creation: &eframe::CreationContext<'_>| {
        opens.store(true, Ordering::Relaxed);
        if let Some(state) = &creation.wgpu_render_state {
            canvas::prepare(state);
        }
        let window = Window::new(&creation.egui_ctx, session, tools)?;
        Ok(Box::new(window) as Box<dyn eframe::App>)
    });
    // Where a library of the desktop is missing, that is told by a panic.
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
            eframe::Error::AppCreation(why) => Self::Studio(why.to_string()),
            eframe::Error::Wgpu(why) => {
                // A list of the backends' reasons that may be empty.
                let text = why.to_string();
                Self::Driver(text.trim_end_matches(": {}").to_owned())
            }
            other => {
                // What comes before is where in the library it was found.
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

/// As soon as a frame is asked for.
const SOON: Duration = Duration::from_micros(100);

/// The window's state.
struct Window {
    studio: Studio,
    examples: Vec<Example>,
    stage: picture::Stage,
    desk: Desk,
    title: String,
}

impl Window {
    fn new(ctx: &Context, session: Session, tools: Tools) -> Result<Self, String> {
        theme::apply(ctx);
        let title = title(&session);
        let waker = ctx.clone();
        // After a while, however short, one frame is drawn; at once it would be two.
        let wake = move || waker.request_repaint_after(SOON);
        Ok(Self {
            studio: Studio::new(session, tools.files, tools.opener, wake)?,
            examples: tools.examples,
            stage: picture::Stage::default(),
            desk: Desk::default(),
            title,
        })
    }

    /// Does what became due, and has a frame drawn when the session wants to be asked again.
    fn turn(&mut self, ctx: &Context) {
        if let Some(later) = self.studio.turn() {
            ctx.request_repaint_after(later.max(SOON));
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
        if let Some((_, number)) = self.studio.session().seen() {
            self.desk.count(number, now);
        }
    }

    /// Files that were dropped.
    fn dropped(ctx: &Context, events: &mut Vec<Event>) {
        let dropped = ctx.input(|input| {
            let file = input.raw.dropped_files.first();
            file.map(|file| file.path().to_owned())
        });
        if let Some(path) = dropped {
            events.push(Event::Open(Source::File(path)));
        }
    }
}

impl eframe::App for Window {
    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        self.turn(&ctx);
        let mut events = Vec::new();
        let mut actions = action::pressed(&ctx);
        let session = self.studio.session();
        let desk = &mut self.desk;
        let margins = |x, y| Frame::new().inner_margin(Margin::symmetric(x, y));
        Panel::top("menu").frame(margins(8, 3)).show(ui, |ui| {
            actions.extend(menu::show(ui, session, &self.examples, &mut events));
        });
        Panel::bottom("status")
            .frame(margins(10, 0))
            .exact_size(24.0)
            .show(ui, |ui| status::show(ui, session, desk));
        if session.timeline().is_some() {
            Panel::bottom("time")
                .frame(margins(8, 0))
                .exact_size(34.0)
                .show(ui, |ui| timebar::show(ui, session, &mut events));
        }
        if desk.panels && !session.knobs().is_empty() {
            Panel::left("params")
                .frame(margins(12, 8))
                .default_size(250.0)
                .size_range(190.0..=420.0)
                .show(ui, |ui| {
                    actions.extend(params::show(ui, session, &mut events))
                });
        }
        if desk.panels {
            Panel::right("side")
                .frame(margins(12, 8))
                .exact_size(212.0)
                .resizable(false)
                .show(ui, |ui| {
                    actions.extend(side::show(ui, session, desk, &mut events));
                });
        }
        let picture = egui::CentralPanel::no_frame()
            .show(ui, |ui| self.stage.show(ui, session, &mut events))
            .inner;
        notes::legend(ui, session, picture);
        notes::pick(ui, session, picture, &mut events);
        report::show(ui, session, desk, picture);
        overlay::said(&ctx, session, desk, picture, &mut events);
        overlay::show(&ctx, desk, &mut events);
        Self::dropped(&ctx, &mut events);
        for action in actions {
            action.run(&ctx, session, desk, &mut events);
        }
        if self.desk.overlay != Overlay::None {
            // What is typed or read there is not meant for the camera.
            events.retain(|event| !matches!(event, Event::Camera(_)));
        }
        for event in events {
            self.studio.handle(event);
        }
        // What was done now is not to wait for the next frame.
        self.turn(&ctx);
    }

    fn clear_color(&self, _visuals: &egui::Visuals) -> [f32; 4] {
        // Panels are as dark as the window is where nothing is drawn: software Vulkan takes about as long
        // for a pixel of one colour as for one of the picture.
        theme::PANEL.to_normalized_gamma_f32()
    }
}
