//! Models that all renderers draw, with their views.

mod boxes;
mod file;

use crate::view::CubeView;
use std::path::Path;

pub(crate) use boxes::BoxUnion;

/// A model.
pub(crate) struct Model {
    /// Name: that of its file without the extension, or one of [`BOX_MODELS`].
    pub(crate) name: String,
    /// Form in which each renderer receives the model.
    pub(crate) source: ModelSource,
    /// Set if it is drawn as a 2-D shape.
    pub(crate) is_2d: bool,
    /// View of the cube around the model.
    pub(crate) view: CubeView,
}

/// Source of a model.
pub(crate) enum ModelSource {
    /// Clauses of a `.vm` file.
    Clauses(String),
    /// A scene in sdfc's language, and the clauses that sdfc writes of it for its peers.
    Scene {
        /// The scene.
        text: String,
        /// Its clauses.
        clauses: String,
    },
    /// Boxes, which each renderer expresses in its own form.
    Boxes(BoxUnion),
}

/// Models of boxes, which need no file, with their numbers of boxes.
const BOX_MODELS: [(&str, u32); 2] = [("boxes-100", 100), ("boxes-1000", 1000)];

/// Angles about x and y, in degrees, from which solids are seen that name none.
const DEFAULT_ANGLES: [f64; 2] = [-25.0, 30.0];

impl Model {
    /// Opens the models of files and folders, and those of boxes: all of them, or only `names`. Problems of single
    /// files are reported to `note`.
    pub(crate) fn open_all(
        paths: &[impl AsRef<Path>],
        names: &[String],
        note: impl Fn(&str),
    ) -> Result<Vec<Self>, String> {
        let is_wanted = |name: &str| names.is_empty() || names.iter().any(|other| other == name);
        let mut models = Vec::new();
        for path in file::model_files(paths)? {
            if is_wanted(&file::model_name(&path)) {
                match file::open(&path) {
                    Ok(model) => models.push(model),
                    Err(problem) => note(&format!("{}: {problem}", path.display())),
                }
            }
        }
        let [pitch, yaw] = DEFAULT_ANGLES;
        for (name, count) in BOX_MODELS.into_iter().filter(|(name, _)| is_wanted(name)) {
            models.push(Self {
                name: name.to_owned(),
                source: ModelSource::Boxes(BoxUnion::new(count)),
                is_2d: false,
                view: CubeView::new(1.0, pitch, yaw),
            });
        }
        let unknown = names.iter().find(|name| models.iter().all(|model| model.name != **name));
        match unknown {
            Some(name) => Err(format!("there is no model `{name}` in the folders of `--models`")),
            None => Ok(models),
        }
    }
}
