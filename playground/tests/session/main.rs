//! Stories that a session is told, with files in memory, a clock that stands still until it is told
//! to go on, and the CPU engine drawing small pictures.

mod camera;
mod engines;
mod files;
mod params;
mod seeing;
mod stage;

mod play;
