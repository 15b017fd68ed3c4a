//! Models that all renderers draw, with their views.

mod boxes;
mod clauses;

use crate::view::CubeView;
use std::path::Path;

pub(crate) use boxes::BoxUnion;

/// A model.
pub(crate) struct Model {
    /// Name, one of [`MODEL_NAMES`].
    pub(crate) name: String,
    /// Form in which each renderer receives the model.
    pub(crate) source: ModelSource,
    /// Set if it is drawn as a 2-D shape.
    pub(crate) is_2d: bool,
    /// View of the cube around the model.
    pub(crate) view: CubeView,
    /// Sides of its pictures, in pixels.
    pub(crate) sizes: &'static [u32],
}

/// Source of a model.
pub(crate) enum ModelSource {
    /// Clauses of a `.vm` file.
    Clauses(String),
    /// Boxes, which each renderer expresses in its own form.
    Boxes(BoxUnion),
}

/// Names of all models.
pub(crate) const MODEL_NAMES: [&str; 5] = ["prospero", "hi", "tanglecube", "boxes-100", "boxes-1000"];

impl Model {
    /// Opens the model of this name. The models of peers are in the folder.
    pub(crate) fn open(name: &str, folder: Option<&Path>) -> Result<Self, String> {
        let clauses = || clauses::read(name, folder).map(ModelSource::Clauses);
        let boxes = |count| Ok(ModelSource::Boxes(BoxUnion::new(count)));
        let (source, view, is_2d, sizes): (Result<_, String>, _, _, &[u32]) = match name {
            "prospero" => (clauses(), CubeView::new(1.0, 0.0, 0.0), true, &[1024, 2048]),
            "hi" => (clauses(), CubeView::new(1.0, 0.0, 0.0), false, SOLID_PICTURE_SIZES),
            // As the first line of the file requests.
            "tanglecube" => {
                let view = CubeView::new(1.0 / 0.222, -25.0, 30.0);
                (clauses(), view, false, SOLID_PICTURE_SIZES)
            }
            "boxes-100" => (boxes(100), CubeView::new(1.0, -25.0, 30.0), false, &[512]),
            "boxes-1000" => (boxes(1000), CubeView::new(1.0, -25.0, 30.0), false, &[512]),
            _ => {
                let known = MODEL_NAMES.join(", ");
                return Err(format!("there is no model `{name}`, only {known}"));
            }
        };
        Ok(Self {
            name: name.to_owned(),
            source: source?,
            is_2d,
            view,
            sizes,
        })
    }

    /// Returns clauses with the front and the back of the view as faces of the solid.
    ///
    /// Fidget draws the cut by the front of its volume as a face there, and a ray has to start outside of a
    /// solid.
    pub(crate) fn bounded_clauses(&self, text: &str) -> String {
        clauses::bounded(text, self.view.half())
    }
}

const SOLID_PICTURE_SIZES: &[u32] = &[256, 512, 1024];
