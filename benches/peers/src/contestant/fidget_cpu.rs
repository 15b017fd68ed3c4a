//! Fidget's evaluators on the CPU: the interpreter and the just-in-time compiler.

use super::{Contestant, not_drawn};
use crate::model::{Model, ModelSource};
use crate::picture::{ComparedImage, SurfacePixel};
use fidget::context::{Context, Node};
use fidget::eval::{Function, MathFunction};
use fidget::raster::{pixel, voxel};
use fidget::render::{RenderHints, ThreadPool};
use fidget::shape::{BoundShape, Shape};

/// A model with one of the evaluators.
struct FidgetCpu<'a, F> {
    model: &'a Model,
    size: u32,
    threads: Option<ThreadPool>,
    shape: Option<Shape<F>>,
    image: Option<FidgetImage>,
}

/// A picture in Fidget's format.
pub(super) enum FidgetImage {
    /// Picture of a 2-D shape.
    Plane(pixel::Image),
    /// Picture of a solid.
    Solid(voxel::Image),
}

/// Opens a model with the evaluator `F`.
///
/// Several threads are those of the current pool. One thread is the calling one, without a pool.
pub(super) fn open<'a, F>(
    model: &'a Model,
    size: u32,
    threads: usize,
) -> Result<Box<dyn Contestant + 'a>, String>
where
    F: Function + MathFunction + RenderHints + 'a,
{
    Ok(Box::new(FidgetCpu::<F> {
        model,
        size,
        threads: (threads > 1).then_some(ThreadPool::Global),
        shape: None,
        image: None,
    }))
}

/// Returns the expression of a model.
pub(super) fn expression(model: &Model) -> Result<(Context, Node), String> {
    match &model.source {
        ModelSource::Clauses(text) | ModelSource::Scene { clauses: text, .. } => {
            Context::from_text(text.as_bytes()).map_err(|error| error.to_string())
        }
        ModelSource::Boxes(boxes) => {
            let mut context = Context::new();
            let node = context.import(&boxes.tree());
            Ok((context, node))
        }
    }
}

/// Returns the settings of a 2-D picture.
pub(super) fn plane_config(model: &Model, size: u32) -> pixel::RenderConfig {
    pixel::RenderConfig {
        world_to_model: model.view.plane_matrix(size),
        ..pixel::RenderConfig::from_size(size.into())
    }
}

/// Returns the settings of a solid's picture.
pub(super) fn solid_config(model: &Model, size: u32) -> voxel::RenderConfig {
    voxel::RenderConfig {
        world_to_model: model.view.matrix(size),
        ..voxel::RenderConfig::from_size(size.into())
    }
}

impl FidgetImage {
    /// Converts the picture for comparison.
    pub(super) fn picture(&self) -> ComparedImage {
        match self {
            Self::Plane(image) => ComparedImage::Plane(image.iter().map(|p| p.inside()).collect()),
            // Gradients are in pixels, whose rows go down.
            Self::Solid(image) => ComparedImage::Solid(
                image
                    .iter()
                    .map(|pixel| SurfacePixel {
                        voxel: pixel.depth,
                        normal: [pixel.normal[0], -pixel.normal[1], pixel.normal[2]],
                    })
                    .collect(),
            ),
        }
    }
}

impl<F: Function + MathFunction + RenderHints> Contestant for FidgetCpu<'_, F> {
    fn device(&self) -> String {
        match &self.threads {
            None => "1 thread".to_owned(),
            Some(pool) => format!("{} threads", pool.thread_count()),
        }
    }

    fn prepare(&mut self) -> Result<(), String> {
        let (context, node) = expression(self.model)?;
        self.shape = Some(Shape::new(&context, node).map_err(|error| error.to_string())?);
        Ok(())
    }

    fn frame(&mut self) -> Result<(), String> {
        let shape = self.shape.clone().ok_or_else(not_drawn)?;
        let bound = BoundShape::try_from(shape).map_err(|error| error.to_string())?;
        let image = if self.model.is_2d {
            let eval = pixel::EvalConfig {
                threads: self.threads.as_ref(),
                ..pixel::EvalConfig::default()
            };
            pixel::render(bound, &plane_config(self.model, self.size), &eval).map(FidgetImage::Plane)
        } else {
            let eval = voxel::EvalConfig {
                threads: self.threads.as_ref(),
                ..voxel::EvalConfig::default()
            };
            voxel::render(bound, &solid_config(self.model, self.size), &eval).map(FidgetImage::Solid)
        };
        self.image = Some(image.ok_or("the picture was cancelled")?);
        Ok(())
    }

    fn picture(&self) -> Result<ComparedImage, String> {
        self.image
            .as_ref()
            .map(FidgetImage::picture)
            .ok_or_else(not_drawn)
    }
}
