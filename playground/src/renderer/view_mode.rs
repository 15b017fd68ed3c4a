//! View modes: overlays that are drawn in addition to the engines' own modes.

use super::{DrawError, DrawTask, Picture, PixelValues, Renderer};
use crate::inspect::slice::{FrontSurfaces, Slice, VisibleSlice};
use crate::inspect::slopes::SlopeClass;
use crate::inspect::{QueryPoints, cells, difference, fade, legend, objects, slopes, steps};
use sdfc_runtime::engine::{EngineKind, FieldSample};
use sdfc_runtime::render::{Mode, RenderSettings};
use sdfc_runtime::settings::Overrides;
use std::sync::Arc;

/// Content of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ViewMode {
    /// A mode of the engines. Step counts are spread over a scale of their own.
    Mode(Mode),
    /// The field on a plane in the scene.
    Slice(SlicePlane),
    /// Surface points where the field is steeper than its bound, or much flatter.
    Slopes,
    /// The slope classes on a plane in the scene.
    SliceSlopes(SlicePlane),
    /// Program length in the cells that contain surfaces.
    Cells,
    /// A colour for each leaf of the scene.
    Objects,
    /// The difference to the picture of another engine.
    Difference(EngineKind),
}

/// A plane across an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlicePlane {
    /// Index of the axis: 0 for x, 1 for y, 2 for z.
    pub axis: usize,
    /// Coordinate of the plane on that axis.
    pub coordinate: f64,
    /// Treatment of surfaces in front of the plane.
    pub front: FrontSurfaces,
}

impl Default for ViewMode {
    fn default() -> Self {
        Self::Mode(Mode::Shaded)
    }
}

impl ViewMode {
    /// Returns the render mode of the picture below the overlay.
    pub fn mode(&self) -> Mode {
        match self {
            Self::Mode(mode) => *mode,
            // The object view only requires hits, not lighting.
            Self::Objects => Mode::Id,
            Self::Slice(_)
            | Self::Slopes
            | Self::SliceSlopes(_)
            | Self::Cells
            | Self::Difference(_) => Mode::Shaded,
        }
    }

    /// Reports whether this is the previous view mode with a moved plane.
    pub fn is_moved_from(&self, previous: Self) -> bool {
        *self != previous
            && matches!(
                (self, previous),
                (Self::Slice(_), Self::Slice(_)) | (Self::SliceSlopes(_), Self::SliceSlopes(_))
            )
    }

    /// Returns the engine that the view mode requires, if there is only one.
    pub fn engine(&self) -> Option<EngineKind> {
        // Cells on a GPU are not read back.
        (*self == Self::Cells).then_some(EngineKind::Cpu)
    }

    /// Reports whether the pixels encode numbers rather than light, so that samples must not be averaged.
    pub fn is_exact(&self) -> bool {
        !matches!(
            self,
            Self::Mode(Mode::Shaded | Mode::Albedo | Mode::Normal | Mode::Edges | Mode::Mask)
        )
    }
}

impl Renderer {
    /// Draws the overlay that the task requests over an engine's picture.
    pub(super) fn draw_view_mode(
        &mut self,
        task: &DrawTask,
        picture: &mut Picture,
    ) -> Result<(), DrawError> {
        match task.show {
            ViewMode::Mode(Mode::Steps) => {
                let (pixels, legend) = steps::draw(&picture.image);
                picture.rgba = Arc::new(pixels);
                picture.legend = labelled_colors(legend.entries, "steps");
                picture.notes = vec![format!(
                    "{:.1} steps a ray, {} at most",
                    legend.mean, legend.max
                )];
            }
            ViewMode::Mode(Mode::Distance) => {
                // The engines' picture has lines as wide as the field is flat, which hide thin walls.
                let slice = Slice::across_view(&picture.settings.view);
                let visible = slice.visible_part(&picture.image, &picture.settings);
                let loaded = self.loaded_engine(task.engine)?;
                let samples = loaded.engine.query(&visible.query_points.points)?;
                visible.draw_alone(picture.pixels(), &samples);
                explain_slice(picture, &visible, &samples);
            }
            ViewMode::Mode(mode) => {
                let materials = &task.scene.opened.compiled.module.settings.materials;
                let (image, rgba) = (&picture.image, &picture.rgba);
                picture.legend = legend::for_mode(mode, image, rgba, materials);
                if mode == Mode::Depth {
                    picture.values = Some(PixelValues {
                        values: image.depth.clone(),
                        unit: "units",
                    });
                }
            }
            ViewMode::Slice(plane) => {
                let visible = self.slice_on(task, plane, &picture.settings)?;
                let visible = visible.visible_part(&picture.image, &picture.settings);
                let loaded = self.loaded_engine(task.engine)?;
                let samples = loaded.engine.query(&visible.query_points.points)?;
                visible.draw(picture.pixels(), &samples);
                explain_slice(picture, &visible, &samples);
            }
            ViewMode::Slopes => {
                let query_points = QueryPoints::on_surface(&picture.image, &picture.settings);
                self.draw_slopes(task, &query_points, picture)?;
            }
            ViewMode::SliceSlopes(plane) => {
                let slice = self.slice_on(task, plane, &picture.settings)?;
                let visible = slice.visible_part(&picture.image, &picture.settings);
                self.draw_slopes(task, &visible.query_points, picture)?;
            }
            ViewMode::Cells => self.draw_cells(task, picture)?,
            ViewMode::Objects => self.draw_objects(task, picture)?,
            ViewMode::Difference(other_engine) => {
                self.draw_difference(task, other_engine, picture)?
            }
        }
        Ok(())
    }

    fn slice_on(
        &mut self,
        task: &DrawTask,
        plane: SlicePlane,
        settings: &RenderSettings,
    ) -> Result<Slice, DrawError> {
        let current = self.loaded_engine(task.engine)?.loaded_scene()?;
        let bounds = current.module.settings.clip_bounds();
        Ok(Slice {
            front: plane.front,
            ..Slice::across(plane.axis, plane.coordinate, bounds, settings)
        })
    }

    fn draw_slopes(
        &mut self,
        task: &DrawTask,
        query_points: &QueryPoints,
        picture: &mut Picture,
    ) -> Result<(), DrawError> {
        let loaded = self.loaded_engine(task.engine)?;
        let ratio = loaded.loaded_scene()?.module.settings.slope_over_estimate;
        let mut samples = loaded.engine.query(&query_points.points)?;
        slopes::divide_by_stated_slope(&mut samples, ratio);
        fade(picture.pixels());
        let slopes = slopes::classify_slopes(query_points, &samples, picture.size[0]);
        slopes.draw(picture.pixels(), query_points);
        picture.values = Some(PixelValues::new(
            query_points,
            samples.iter().map(slopes::gradient_length),
            picture.size,
            "per unit",
        ));
        let counts = slopes.counts;
        let kinds = [
            (SlopeClass::Steep, counts.steep, "steeper than 1".to_owned()),
            (
                SlopeClass::Discontinuity,
                counts.discontinuities,
                "beside a discontinuity".to_owned(),
            ),
            (
                SlopeClass::Slow,
                counts.slow,
                "less than half as steep".to_owned(),
            ),
            (
                SlopeClass::Unknown,
                counts.unknown,
                "not a number".to_owned(),
            ),
        ];
        let legend_entry = |(kind, number, what): (SlopeClass, usize, String)| {
            Some((kind.color()?, format!("{number} {what}")))
        };
        picture.legend = kinds.into_iter().filter_map(legend_entry).collect();
        picture.notes = vec![format!(
            "{} points, at most {} per unit",
            counts.points, counts.max_slope
        )];
        Ok(())
    }

    fn draw_cells(&mut self, task: &DrawTask, picture: &mut Picture) -> Result<(), DrawError> {
        let query_points = QueryPoints::on_surface(&picture.image, &picture.settings);
        let loaded = self.loaded_engine(task.engine)?;
        let cells_at_points = loaded
            .engine
            .cells_at(&picture.settings, &query_points.points)?;
        let program_length = loaded.loaded_scene()?.module.distance.code.len();
        let Some(cells_at_points) = cells_at_points else {
            let why = format!(
                "not cut into cells: engine {} draws this scene without",
                task.engine
            );
            picture.notes = vec![why];
            return Ok(());
        };
        let width = picture.size[0];
        let legend = cells::draw(
            picture.pixels(),
            width,
            &query_points,
            &cells_at_points,
            program_length,
            true,
        );
        picture.legend = labelled_colors(legend.entries, "clauses");
        picture.notes = vec![format!(
            "{:.1} clauses at a pixel, {} at most, of {program_length}",
            legend.mean, legend.max
        )];
        Ok(())
    }

    fn draw_objects(&mut self, task: &DrawTask, picture: &mut Picture) -> Result<(), DrawError> {
        let Some((loaded, origins)) = self.leaf_engine(&task.scene, &task.inputs)? else {
            picture.notes = vec!["only scenes with a text have leaves".to_owned()];
            return Ok(());
        };
        let overrides = Overrides {
            mode: Mode::Id,
            aa: Some(1),
            view: Some(picture.settings.view),
            ..task.overrides.clone()
        };
        let settings = loaded.settings(&overrides)?;
        let image = loaded.engine.render(&settings, &task.stop)?;
        picture.rgba = Arc::new(objects::draw(&image, &settings, task.leaf));
        picture.image = Arc::new(image);
        picture.notes = vec![format!("{} leaves", origins.leaves.len())];
        if let Some((number, leaf)) = task
            .leaf
            .and_then(|number| Some((number, origins.leaf(number)?)))
        {
            let position = task.scene.sources.line_col(leaf.span.file, leaf.span.start);
            let name = origins.name(leaf);
            let line = format!("{name} in line {}", position.line);
            picture.legend = vec![(objects::color(number), line.trim().to_owned())];
        }
        Ok(())
    }

    fn draw_difference(
        &mut self,
        task: &DrawTask,
        other_engine: EngineKind,
        picture: &mut Picture,
    ) -> Result<(), DrawError> {
        let loaded = self.loaded_engine(other_engine)?;
        loaded.load_scene(&task.scene, &task.inputs)?;
        let image = loaded.engine.render(&picture.settings, &task.stop)?;
        if let Some(difference) = difference::difference(&image, &picture.image) {
            picture.notes = vec![format!(
                "{} against {other_engine}: {difference}",
                task.engine
            )];
            picture.notes.extend(difference.failures);
            picture.legend = difference::legend();
            picture.rgba = Arc::new(difference.picture);
        }
        Ok(())
    }
}

/// Labels colours with their numbers and a unit.
fn labelled_colors<N: std::fmt::Display>(
    entries: Vec<(N, [u8; 4])>,
    what: &str,
) -> Vec<([u8; 4], String)> {
    let entries = entries.into_iter();
    entries
        .map(|(number, color)| (color, format!("{number} {what}")))
        .collect()
}

/// Explains the colours of a slice, and keeps the values that its samples have.
fn explain_slice(picture: &mut Picture, slice: &VisibleSlice, samples: &[FieldSample]) {
    picture.legend = legend::signs(slice.spacing);
    picture.values = Some(PixelValues::new(
        &slice.query_points,
        samples.iter().map(|sample| sample.distance),
        picture.size,
        "units",
    ));
    picture.notes = vec![format!("lines every {} units", slice.spacing)];
}
