//! What a picture shows besides what engines draw by themselves.

use super::{DrawTask, Painter, Picture, Problem};
use crate::seeing::slice::{Front, Slice};
use crate::seeing::slopes::Slope;
use crate::seeing::{Asked, cells, difference, fade, objects, slopes, steps};
use sdfc_runtime::engine::EngineKind;
use sdfc_runtime::frame::{Mode, RenderSettings};
use sdfc_runtime::settings::Overrides;
use std::sync::Arc;

/// What is to be seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Show {
    /// What engines draw by themselves; steps are spread over a scale of their own.
    Mode(Mode),
    /// The field on a plane in the scene.
    Slice(SliceAt),
    /// Where the field is steeper than its bound, and where it is much flatter.
    Slopes,
    /// The same on a plane in the scene.
    SliceSlopes(SliceAt),
    /// How long the program is in the cells that surfaces lie in.
    Cells,
    /// A colour for each leaf of the scene.
    Objects,
    /// How the picture of another engine differs.
    Difference(EngineKind),
}

/// A plane across an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SliceAt {
    /// The axis: 0 for x, 1, 2.
    pub axis: usize,
    /// The coordinate.
    pub at: f64,
    /// What becomes of surfaces before it.
    pub front: Front,
}

impl Default for Show {
    fn default() -> Self {
        Self::Mode(Mode::Shaded)
    }
}

impl Show {
    /// The mode of the picture that it is drawn over.
    pub fn mode(&self) -> Mode {
        match self {
            Self::Mode(mode) => *mode,
            // It asks for what lies where, and for no light.
            Self::Objects => Mode::Id,
            Self::Slice(_)
            | Self::Slopes
            | Self::SliceSlopes(_)
            | Self::Cells
            | Self::Difference(_) => Mode::Shaded,
        }
    }

    /// Whether it is what was shown before with its plane moved, as it is by hand.
    pub fn is_moved(&self, before: Self) -> bool {
        *self != before
            && matches!(
                (self, before),
                (Self::Slice(_), Self::Slice(_)) | (Self::SliceSlopes(_), Self::SliceSlopes(_))
            )
    }

    /// The only engine that can show it, if there is only one.
    pub fn engine(&self) -> Option<EngineKind> {
        // Cells of devices stay there.
        (*self == Self::Cells).then_some(EngineKind::Cpu)
    }

    /// Whether its pixels are numbers rather than light, of which a mean says nothing.
    pub fn is_exact(&self) -> bool {
        !matches!(
            self,
            Self::Mode(Mode::Shaded | Mode::Albedo | Mode::Normal | Mode::Edges | Mode::Mask)
        )
    }
}

impl Painter {
    /// Draws over an engine's picture what the task asks for.
    pub(super) fn finish(&mut self, task: &DrawTask, picture: &mut Picture) -> Result<(), Problem> {
        match task.show {
            Show::Mode(Mode::Steps) => {
                let (pixels, legend) = steps::draw(&picture.frame);
                picture.rgba = Arc::new(pixels);
                picture.legend = named(legend.entries, "steps");
                picture.notes = vec![format!(
                    "{:.1} steps a ray, {} at most",
                    legend.mean, legend.most
                )];
            }
            Show::Mode(_) => {}
            Show::Slice(at) => {
                let cut = self.slice(task, at, &picture.settings)?;
                let cut = cut.cut(&picture.frame, &picture.settings);
                let held = self.held(task.engine)?;
                let samples = held.engine.query(&cut.asked.points)?;
                cut.draw(picture.pixels(), &samples);
                picture.notes = vec![format!("lines every {}", cut.spacing)];
            }
            Show::Slopes => {
                let asked = Asked::on_surface(&picture.frame, &picture.settings);
                self.slopes(task, &asked, picture)?;
            }
            Show::SliceSlopes(at) => {
                let slice = self.slice(task, at, &picture.settings)?;
                let cut = slice.cut(&picture.frame, &picture.settings);
                self.slopes(task, &cut.asked, picture)?;
            }
            Show::Cells => self.cells(task, picture)?,
            Show::Objects => self.objects(task, picture)?,
            Show::Difference(other) => self.difference(task, other, picture)?,
        }
        Ok(())
    }

    fn slice(
        &mut self,
        task: &DrawTask,
        at: SliceAt,
        settings: &RenderSettings,
    ) -> Result<Slice, Problem> {
        let now = self.held(task.engine)?.now()?;
        let bounds = now.module.settings.space();
        Ok(Slice {
            front: at.front,
            ..Slice::across(at.axis, at.at, bounds, settings)
        })
    }

    fn slopes(
        &mut self,
        task: &DrawTask,
        asked: &Asked,
        picture: &mut Picture,
    ) -> Result<(), Problem> {
        let held = self.held(task.engine)?;
        let samples = held.engine.query(&asked.points)?;
        fade(picture.pixels());
        let slopes = slopes::slopes(asked, &samples, picture.size[0]);
        slopes.draw(picture.pixels(), asked);
        let count = slopes.count;
        let kinds = [
            (Slope::Steep, count.steep, "steeper than 1".to_owned()),
            (Slope::Jump, count.jumps, "beside a jump".to_owned()),
            (
                Slope::Slow,
                count.slow,
                "less than half as steep".to_owned(),
            ),
            (Slope::Unknown, count.unknown, "not a number".to_owned()),
        ];
        let entry = |(kind, number, what): (Slope, usize, String)| {
            Some((kind.color()?, format!("{number} {what}")))
        };
        picture.legend = kinds.into_iter().filter_map(entry).collect();
        picture.notes = vec![format!(
            "{} points, at most {} per unit",
            count.points, count.steepest
        )];
        Ok(())
    }

    fn cells(&mut self, task: &DrawTask, picture: &mut Picture) -> Result<(), Problem> {
        let asked = Asked::on_surface(&picture.frame, &picture.settings);
        let held = self.held(task.engine)?;
        let parts = held.engine.cells_at(&picture.settings, &asked.points)?;
        let whole = held.now()?.module.distance.code.len();
        let Some(parts) = parts else {
            let why = format!(
                "engine {} draws this scene without cells that could be asked",
                task.engine
            );
            picture.notes = vec![why];
            return Ok(());
        };
        let width = picture.size[0];
        let legend = cells::draw(picture.pixels(), width, &asked, &parts, whole, true);
        picture.legend = named(legend.entries, "clauses");
        picture.notes = vec![format!(
            "{:.1} clauses at a pixel, {} at most, of {whole}",
            legend.mean, legend.most
        )];
        Ok(())
    }

    fn objects(&mut self, task: &DrawTask, picture: &mut Picture) -> Result<(), Problem> {
        let Some((held, origins)) = self.leaves(&task.scene, &task.moment)? else {
            picture.notes = vec!["only scenes with a text have leaves".to_owned()];
            return Ok(());
        };
        let look = Overrides {
            mode: Mode::Id,
            aa: Some(1),
            view: Some(picture.settings.view),
            ..task.look.clone()
        };
        let settings = held.settings(&look)?;
        let frame = held.engine.render(&settings, &task.stop)?;
        picture.rgba = Arc::new(objects::draw(&frame, &settings, task.leaf));
        picture.frame = Arc::new(frame);
        picture.notes = vec![format!("{} leaves", origins.leaves.len())];
        if let Some((number, leaf)) = task
            .leaf
            .and_then(|number| Some((number, origins.leaf(number)?)))
        {
            let place = task.scene.sources.line_col(leaf.span.file, leaf.span.start);
            let name = origins.name(leaf);
            let line = format!("{name} in line {}", place.line);
            picture.legend = vec![(objects::color(number), line.trim().to_owned())];
        }
        Ok(())
    }

    fn difference(
        &mut self,
        task: &DrawTask,
        other: EngineKind,
        picture: &mut Picture,
    ) -> Result<(), Problem> {
        let held = self.held(other)?;
        held.bring(&task.scene, &task.moment)?;
        let frame = held.engine.render(&picture.settings, &task.stop)?;
        if let Some(difference) = difference::difference(&frame, &picture.frame) {
            picture.notes = vec![format!("{} against {other}: {difference}", task.engine)];
            picture.notes.extend(difference.failures);
            picture.rgba = Arc::new(difference.picture);
        }
        Ok(())
    }
}

/// Numbers and their colours, with what they count.
fn named<N: std::fmt::Display>(entries: Vec<(N, [u8; 4])>, what: &str) -> Vec<([u8; 4], String)> {
    let entries = entries.into_iter();
    entries
        .map(|(number, color)| (color, format!("{number} {what}")))
        .collect()
}
