//! One-off tasks: picking a pixel, saving the picture, writing params into the scene text.

use super::{EngineTier, OneOffTask, Session, Task, pixel};
use crate::build::SceneOrigin;
use crate::camera::Ndc;
use crate::renderer::{PickTask, SceneInputs};
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

impl Session {
    /// Emits a task that picks the pixel at a point of the picture.
    pub(super) fn pick(&mut self, ndc: Ndc) {
        let scene = self.scene.clone();
        let (Some(scene), Some(shown)) = (scene, &self.displayed) else {
            return;
        };
        let picture = &shown.picture;
        let Some([column, row]) = pixel(ndc, picture.size) else {
            return;
        };
        let Some(engine) = self.engine_selection.engine(EngineTier::Instant) else {
            return;
        };
        self.tasks.push(Task::Pick(Box::new(PickTask {
            scene,
            inputs: SceneInputs {
                values: self.params.values(),
                time: self.time(),
            },
            engine,
            image: Arc::clone(&picture.image),
            settings: picture.settings.clone(),
            pixel: [column as u32, row as u32],
        })));
    }

    /// Returns the number of the picked leaf.
    pub(super) fn leaf(&self) -> Option<u32> {
        let pick = self.picked.as_ref()?.result.as_ref().ok()?.as_ref()?;
        Some(pick.leaf).filter(|leaf| *leaf > 0)
    }

    pub(super) fn save(&mut self, path: PathBuf) {
        if let Some(shown) = &self.displayed {
            self.tasks.push(Task::OneOff(OneOffTask::Save {
                path,
                size: shown.picture.size,
                rgba: Arc::clone(&shown.picture.rgba),
            }));
        }
    }

    /// Writes the values of params into their files, with one edit per file.
    pub(super) fn write_back(&mut self, indices: &[usize]) {
        let Some(scene) = self.scene.clone() else {
            return;
        };
        let mut edits: HashMap<_, Vec<_>> = HashMap::new();
        for &index in indices {
            let Some(param) = self
                .params
                .all()
                .get(index)
                .filter(|param| param.is_changed())
            else {
                continue;
            };
            let Some(source) = &param.source else {
                let why = format!("`{}` is not in a text", param.spec.name);
                self.message = Some(Err(why));
                continue;
            };
            let edit = (
                scene.sources.range(source.span),
                param.text(),
                param.spec.name.clone(),
            );
            edits.entry(source.span.file).or_default().push(edit);
        }
        for (file, mut edits) in edits {
            // Edits run from the end of the file to its start, so that earlier ranges stay valid.
            edits.sort_by_key(|(range, ..)| std::cmp::Reverse(range.start));
            let expected = scene.sources.text(file);
            let mut replacement = expected.to_owned();
            let mut names = Vec::new();
            for (range, text, name) in edits {
                replacement.replace_range(range, &text);
                names.push(format!("{name} = {text}"));
            }
            names.reverse();
            let name = scene.sources.name(file);
            match &mut self.source {
                SceneOrigin::Text {
                    name: source_name,
                    text,
                } if source_name == name => {
                    *text = replacement;
                    self.needs_rebuild = true;
                }
                _ => self.tasks.push(Task::OneOff(OneOffTask::Replace {
                    path: PathBuf::from(name),
                    expected: expected.into(),
                    replacement,
                    message: format!("{name}: {}", names.join(", ")),
                })),
            }
        }
    }
}
