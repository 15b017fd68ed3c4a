//! What goes into a session and what comes out of it.

use super::tiers::Choice;
use crate::build::{BuildTask, Built, Scene, Source};
use crate::camera::{Place, Side};
use crate::painter::{DrawTask, Drawn, PickTask, Picked, Problem, Show};
use sdfc_compiler::export::Target;
use sdfc_runtime::engine::EngineKind;
use std::path::PathBuf;
use std::sync::Arc;

/// What happened.
#[derive(Clone, Debug)]
pub enum Event {
    /// Another scene is to be shown.
    Open(Source),
    /// Some of the scene's files may have changed, or are gone, or are back.
    FilesChanged,
    /// The picture has another place to fill: so many pixels.
    Resized([u32; 2]),
    /// A param, by its position, has this value now.
    Set(usize, Vec<f64>),
    /// A param has the text's value again.
    Reset(usize),
    /// All of them have.
    ResetAll,
    /// The values of these params are to be written into the text.
    WriteBack(Vec<usize>),
    /// The camera moves.
    Camera(CameraEvent),
    /// Time moves, or not.
    Time(TimeEvent),
    /// Something else is to be seen.
    Show(Show),
    /// All about what is seen at a place is to be told.
    Pick(Place),
    /// That is enough.
    Unpick,
    /// Another engine is to draw.
    Engine(Choice),
    /// The picture is to be saved.
    Save(PathBuf),
    /// The scene is wanted in another language.
    Export(Target),
    /// What was said was read.
    Dismiss,
}

/// How the camera moves. Places are those of [`crate::camera`].
#[derive(Clone, Debug, PartialEq)]
pub enum CameraEvent {
    /// Around what it looks at, in radians: to its right, and up.
    Orbit([f64; 2]),
    /// Along the picture; what was under the first place is then under the second.
    Pan(Place, Place),
    /// Nearer by this factor, to what is under the place.
    Zoom(f64, Place),
    /// So that all of the scene is in the picture.
    Fit,
    /// To look at what is under the place.
    Focus(Place),
    /// To one of the sides.
    Face(Side),
    /// To parallel rays, or back from them.
    ToggleLens,
    /// Back to the scene's camera of that name, or to its first one.
    Scene(Option<String>),
}

/// How time moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TimeEvent {
    /// It goes on, or stops.
    Toggle,
    /// It is this, in seconds.
    Scrub(f64),
    /// So many frames forwards or back.
    Step(i64),
    /// Whether it starts again at its end.
    Repeat(bool),
    /// So many times as fast.
    Speed(f64),
}

/// What is to be done. Tasks of the same kind are done in their order; of several builds, only the
/// last has to be.
#[derive(Clone, Debug)]
pub enum Task {
    /// Build a scene.
    Build(BuildTask),
    /// Draw a picture.
    Draw(DrawTask),
    /// Make an engine ready for all scenes, beside whatever else is done.
    WarmUp(EngineKind),
    /// Make the second engine ready for a picture, and draw it, twice: the second one is timed.
    Prepare(DrawTask),
    /// Tell all about a pixel.
    Pick(Box<PickTask>),
    /// Watch these files, and no others.
    Watch(Vec<PathBuf>),
    /// Write something.
    Errand(Errand),
}

/// What is written.
#[derive(Clone, Debug)]
pub enum Errand {
    /// Put a text in the place of another one in a file.
    Replace {
        /// The file.
        path: PathBuf,
        /// What it must still hold.
        before: Arc<str>,
        /// What it is to hold.
        after: String,
        /// What was done, for people.
        said: String,
    },
    /// Write a picture as PNG.
    Save {
        /// Where to.
        path: PathBuf,
        /// Width and height.
        size: [usize; 2],
        /// Red, green, blue and alpha of each pixel.
        rgba: Arc<Vec<u8>>,
    },
    /// Write the scene in another language.
    Export(Target, Arc<Scene>),
}

/// What became of a task.
#[derive(Debug)]
pub enum Done {
    /// Of a build.
    Built(Built),
    /// Of a picture.
    Drawn(Drawn),
    /// Of making an engine ready for all scenes.
    Warm(EngineKind, Result<(), Problem>),
    /// Of making the second engine ready.
    Prepared(Drawn),
    /// Of looking at a pixel.
    Picked(Picked),
    /// Of writing a text or a picture: what to say.
    Said(Result<String, String>),
    /// Of writing the scene in another language: its text.
    Exported(Result<String, String>),
}
