//! Input and output types of a session.

use super::engine_selection::EngineChoice;
use crate::build::{BuildResult, BuildTask, BuiltScene, SceneOrigin};
use crate::camera::Ndc;
use crate::renderer::{DrawError, DrawResult, DrawTask, PickResult, PickTask, ViewMode};
use sdfc_compiler::export::Target;
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::settings::ViewSide;
use std::path::PathBuf;
use std::sync::Arc;

/// An event that a session handles.
#[derive(Clone, Debug)]
pub enum Event {
    /// Open another scene.
    Open(SceneOrigin),
    /// Files of the scene may have changed, vanished or reappeared.
    FilesChanged,
    /// The picture area has this width and height in pixels.
    Resized([u32; 2]),
    /// Set the param at this index to a value.
    Set(usize, Vec<f64>),
    /// Reset the param at this index to the value in the text.
    Reset(usize),
    /// Reset all params.
    ResetAll,
    /// Write the values of the params at these indices into the text.
    WriteBack(Vec<usize>),
    /// Move the camera.
    Camera(CameraEvent),
    /// Control the animation time.
    Time(TimeEvent),
    /// Change the view mode.
    Show(ViewMode),
    /// Pick the pixel at a point of the picture.
    Pick(Ndc),
    /// Clear the picked point.
    Unpick,
    /// Select the engine.
    Engine(EngineChoice),
    /// Save the picture to this path.
    Save(PathBuf),
    /// Export the scene to another language.
    Export(Target),
    /// Dismiss the status message.
    Dismiss,
}

/// A camera motion. Points are in the normalised device coordinates of [`crate::camera`].
#[derive(Clone, Debug, PartialEq)]
pub enum CameraEvent {
    /// Orbit around the look-at point by angles in radians: to the right, and up.
    Orbit([f64; 2]),
    /// Pan so that the surface under the first point moves to the second.
    Pan(Ndc, Ndc),
    /// Zoom by this factor, keeping the surface under the point fixed.
    Zoom(f64, Ndc),
    /// Fit the whole scene into the picture.
    Fit,
    /// Look at the surface under the point.
    Focus(Ndc),
    /// View the scene from one side.
    Face(ViewSide),
    /// Switch between perspective and parallel rays.
    ToggleLens,
    /// Return to the scene's camera of this name; `None` selects the scene's first camera.
    Scene(Option<String>),
}

/// A change of the animation time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TimeEvent {
    /// Play or pause.
    Toggle,
    /// Jump to this time in seconds.
    Scrub(f64),
    /// Step by this number of frames; negative steps go back.
    Step(i64),
    /// Set whether the animation repeats at its end.
    Repeat(bool),
    /// Set the playback speed, relative to real time.
    Speed(f64),
}

/// A task to execute. Tasks of one kind run in order. Of several pending builds, only the last one is
/// required.
#[derive(Clone, Debug)]
pub enum Task {
    /// Build a scene.
    Build(BuildTask),
    /// Draw a picture.
    Draw(DrawTask),
    /// Make an engine ready for all scenes, in parallel with other tasks.
    WarmUp(EngineKind),
    /// Make the second engine ready for a picture and draw it twice; the second picture is timed.
    Prepare(DrawTask),
    /// Pick a pixel.
    Pick(Box<PickTask>),
    /// Watch exactly these files.
    Watch(Vec<PathBuf>),
    /// Write or export something.
    OneOff(OneOffTask),
}

/// A task that runs once and writes its result.
#[derive(Clone, Debug)]
pub enum OneOffTask {
    /// Replace the text of a file.
    Replace {
        /// Path of the file to be written.
        path: PathBuf,
        /// Text that the file must still contain.
        expected: Arc<str>,
        /// New text of the file.
        replacement: String,
        /// Message reported on success.
        message: String,
    },
    /// Write a picture as PNG.
    Save {
        /// Path of the PNG file.
        path: PathBuf,
        /// Width and height.
        size: [usize; 2],
        /// Red, green, blue and alpha of each pixel.
        rgba: Arc<Vec<u8>>,
    },
    /// Translate the scene into another language.
    Export(Target, Arc<BuiltScene>),
}

/// Result of a task.
#[derive(Debug)]
pub enum TaskResult {
    /// Result of a build.
    Built(BuildResult),
    /// Result of a draw task.
    Drawn(DrawResult),
    /// Result of warming up an engine.
    Warm(EngineKind, Result<(), DrawError>),
    /// Result of preparing the second engine.
    Prepared(DrawResult),
    /// Result of picking a pixel.
    Picked(PickResult),
    /// Success or failure message of a file task.
    Message(Result<String, String>),
    /// The exported text, or the reason for a failure.
    Exported(Result<String, String>),
}
