//! Tests of engines, on programs written here as listings. They cover equal images and values, the cost of
//! updates, and the behaviour at limits and when a device fails.

#[path = "engines/agreement.rs"]
mod agreement;
#[path = "engines/closed.rs"]
mod closed;
#[path = "engines/damage.rs"]
mod damage;
#[path = "engines/devices.rs"]
mod devices;
#[path = "engines/intervals.rs"]
mod intervals;
#[path = "engines/operations.rs"]
mod operations;
#[path = "engines/parts.rs"]
mod parts;
#[path = "engines/places.rs"]
mod places;
#[path = "engines/programs.rs"]
mod programs;
#[path = "engines/reference.rs"]
mod reference;
#[path = "engines/scenes.rs"]
mod scenes;
#[path = "engines/settings.rs"]
mod settings;
#[path = "engines/updates.rs"]
mod updates;
