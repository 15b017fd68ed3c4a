//! The models that all sides draw, and how they are looked at.

mod boxes;
mod clauses;

use crate::view::View;
use std::path::Path;

pub(crate) use boxes::Boxes;

/// A model.
pub(crate) struct Model {
    /// Its name.
    pub(crate) name: String,
    /// What it is written as.
    pub(crate) source: Source,
    /// Whether it is drawn as a figure in the plane.
    pub(crate) plane: bool,
    /// How it is looked at.
    pub(crate) view: View,
    /// Sides of its pictures, in pixels.
    pub(crate) sizes: &'static [u32],
}

/// What a model is written as.
pub(crate) enum Source {
    /// The clauses of a `.vm` file.
    Clauses(String),
    /// Boxes, which each side writes in its own way.
    Boxes(Boxes),
}

/// The names of all models.
pub(crate) const NAMES: [&str; 5] = ["prospero", "hi", "tanglecube", "boxes-100", "boxes-1000"];

impl Model {
    /// The model of this name. Those of the peers lie in the folder.
    pub(crate) fn open(name: &str, folder: Option<&Path>) -> Result<Self, String> {
        let clauses = || clauses::read(name, folder).map(Source::Clauses);
        let boxes = |count| Ok(Source::Boxes(Boxes::new(count)));
        let (source, view, plane, sizes): (Result<_, String>, _, _, &[u32]) = match name {
            "prospero" => (clauses(), View::new(1.0, 0.0, 0.0), true, &[1024, 2048]),
            "hi" => (clauses(), View::new(1.0, 0.0, 0.0), false, SOLID_SIZES),
            // As the file's first line asks for.
            "tanglecube" => {
                let view = View::new(1.0 / 0.222, -25.0, 30.0);
                (clauses(), view, false, SOLID_SIZES)
            }
            "boxes-100" => (boxes(100), View::new(1.0, -25.0, 30.0), false, &[512]),
            "boxes-1000" => (boxes(1000), View::new(1.0, -25.0, 30.0), false, &[512]),
            _ => {
                let known = NAMES.join(", ");
                return Err(format!("there is no model `{name}`, only {known}"));
            }
        };
        Ok(Self {
            name: name.to_owned(),
            source: source?,
            plane,
            view,
            sizes,
        })
    }

    /// Clauses with the front and the back of the view as faces of the solid. Fidget draws what is
    /// cut by the front of its volume as a face there, and a ray has to start outside of a solid.
    pub(crate) fn bounded_clauses(&self, text: &str) -> String {
        clauses::bounded(text, self.view.half())
    }
}

const SOLID_SIZES: &[u32] = &[256, 512, 1024];
