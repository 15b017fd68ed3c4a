//! What is asked for once: all about a pixel, a file of the picture, values in the text.

use super::{Errand, Session, Task, Tier, pixel};
use crate::build::Source;
use crate::camera::Place;
use crate::painter::{Moment, PickTask};
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

impl Session {
    /// Asks about what is seen at a place.
    pub(super) fn pick(&mut self, place: Place) {
        let scene = self.scene.clone();
        let (Some(scene), Some(shown)) = (scene, &self.shown) else {
            return;
        };
        let picture = &shown.picture;
        let Some([column, row]) = pixel(place, picture.size) else {
            return;
        };
        let Some(engine) = self.tiers.engine(Tier::Instant) else {
            return;
        };
        self.tasks.push(Task::Pick(Box::new(PickTask {
            scene,
            moment: Moment {
                values: self.knobs.values(),
                time: self.time(),
            },
            engine,
            frame: Arc::clone(&picture.frame),
            settings: picture.settings.clone(),
            pixel: [column as u32, row as u32],
        })));
    }

    /// The leaf that was picked.
    pub(super) fn leaf(&self) -> Option<u32> {
        let found = self.picked.as_ref()?.found.as_ref().ok()?.as_ref()?;
        Some(found.leaf).filter(|leaf| *leaf > 0)
    }

    pub(super) fn save(&mut self, path: PathBuf) {
        if let Some(shown) = &self.shown {
            self.tasks.push(Task::Errand(Errand::Save {
                path,
                size: shown.picture.size,
                rgba: Arc::clone(&shown.picture.rgba),
            }));
        }
    }

    /// Writes the values of params into their texts, one edit a file.
    pub(super) fn write_back(&mut self, indices: &[usize]) {
        let Some(scene) = self.scene.clone() else {
            return;
        };
        let mut edits: HashMap<_, Vec<_>> = HashMap::new();
        for &index in indices {
            let Some(knob) = self.knobs.all().get(index).filter(|knob| knob.is_changed()) else {
                continue;
            };
            let Some(written) = &knob.written else {
                let why = format!("`{}` is not in a text", knob.spec.name);
                self.said = Some(Err(why));
                continue;
            };
            let edit = (
                scene.sources.range(written.span),
                knob.text(),
                knob.spec.name.clone(),
            );
            edits.entry(written.span.file).or_default().push(edit);
        }
        for (file, mut edits) in edits {
            // From the last to the first, so that places stay true.
            edits.sort_by_key(|(range, ..)| std::cmp::Reverse(range.start));
            let before = scene.sources.text(file);
            let mut after = before.to_owned();
            let mut names = Vec::new();
            for (range, text, name) in edits {
                after.replace_range(range, &text);
                names.push(format!("{name} = {text}"));
            }
            names.reverse();
            let name = scene.sources.name(file);
            match &mut self.source {
                Source::Text { name: own, text } if own == name => {
                    *text = after;
                    self.rebuild = true;
                }
                _ => self.tasks.push(Task::Errand(Errand::Replace {
                    path: PathBuf::from(name),
                    before: before.into(),
                    after,
                    said: format!("{name}: {}", names.join(", ")),
                })),
            }
        }
    }
}
