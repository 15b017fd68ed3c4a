//! The playground: a scene that is seen while it is written.
//!
//! Its core is a state machine without a window, [`session::Session`]: events go in (a file changed,
//! a slider moved, the mouse turned the camera), tasks come out (build this, draw that), and what
//! became of them goes in again. It reads no file, starts no thread and knows no clock, so that a test
//! can play any story with it, and a browser can run it. Around it stand what does the tasks
//! ([`mod@build`], [`painter`]) on threads of their own ([`studio`]), and a watcher of files
//! ([`watcher`]). The window is one user of all that.

pub mod build;
pub mod camera;
pub mod files;
pub mod painter;
pub mod picture;
pub mod seeing;
pub mod session;
pub mod studio;
pub mod timeline;
pub mod watcher;
#[cfg(feature = "window")]
pub mod window;
pub mod written;
