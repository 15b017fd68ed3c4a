//! Tests of the session with files in memory, a clock that advances only on request, and the CPU engine
//! drawing small pictures.

mod camera;
mod engines;
mod files;
mod inspect;
mod params;
mod session_host;

mod harness;
