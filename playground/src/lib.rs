//! The playground: renders a scene while it is being edited.
//!
//! The core, [`session::Session`], is a state machine without a window. It receives events (a file
//! changed, a slider moved, the mouse turned the camera) and emits tasks (build, draw). Task results are
//! fed back into it. It reads no files, starts no threads and has no clock, so tests can replay any
//! sequence of events. The tasks are executed by [`mod@build`] and [`renderer`] on the threads of
//! [`session_host`]; [`sdfc_io::watcher`] reports changed files. The window is one front-end of this core.

pub mod build;
pub mod camera;
pub mod inspect;
pub mod param_input;
pub mod param_source;
pub mod renderer;
pub mod session;
pub mod session_host;
pub mod timeline;
#[cfg(feature = "window")]
pub mod window;
