//! Fidget's evaluators on the CPU: the interpreter and the just-in-time compiler.

use super::{Contestant, not_drawn};
use crate::model::{Model, Source};
use crate::picture::{Picture, Seen};
use fidget::context::{Context, Node};
use fidget::eval::{Function, MathFunction};
use fidget::raster::{pixel, voxel};
use fidget::render::{RenderHints, ThreadPool};
use fidget::shape::{BoundShape, Shape};

/// A model with one of the evaluators.
struct Evaluated<'a, F> {
    model: &'a Model,
    size: u32,
    threads: Option<ThreadPool>,
    shape: Option<Shape<F>>,
    image: Option<Image>,
}

/// A picture as Fidget draws it.
pub(super) enum Image {
    /// Of a figure in the plane.
    Plane(pixel::Image),
    /// Of a solid.
    Solid(voxel::Image),
}

/// A model with the evaluator `F`. Several threads are those of the pool that it is called from;
/// one thread is the calling one, without a pool.
pub(super) fn open<'a, F>(
    model: &'a Model,
    size: u32,
    threads: usize,
) -> Result<Box<dyn Contestant + 'a>, String>
where
    F: Function + MathFunction + RenderHints + 'a,
{
    Ok(Box::new(Evaluated::<F> {
        model,
        size,
        threads: (threads > 1).then_some(ThreadPool::Global),
        shape: None,
        image: None,
    }))
}

/// The expression of a model.
pub(super) fn expression(model: &Model) -> Result<(Context, Node), String> {
    match &model.source {
        Source::Clauses(text) => {
            Context::from_text(text.as_bytes()).map_err(|error| error.to_string())
        }
        Source::Boxes(boxes) => {
            let mut context = Context::new();
            let node = context.import(&boxes.tree());
            Ok((context, node))
        }
    }
}

/// The settings of a plane picture.
pub(super) fn plane_config(model: &Model, size: u32) -> pixel::RenderConfig {
    pixel::RenderConfig {
        world_to_model: model.view.plane_matrix(size),
        ..pixel::RenderConfig::from_size(size.into())
    }
}

/// The settings of a solid's picture.
pub(super) fn solid_config(model: &Model, size: u32) -> voxel::RenderConfig {
    voxel::RenderConfig {
        world_to_model: model.view.matrix(size),
        ..voxel::RenderConfig::from_size(size.into())
    }
}

impl Image {
    /// It, to be compared.
    pub(super) fn picture(&self) -> Picture {
        match self {
            Self::Plane(image) => Picture::Plane(image.iter().map(|p| p.inside()).collect()),
            // Gradients are by pixels, whose rows go down.
            Self::Solid(image) => Picture::Solid(
                image
                    .iter()
                    .map(|pixel| Seen {
                        voxel: pixel.depth,
                        normal: [pixel.normal[0], -pixel.normal[1], pixel.normal[2]],
                    })
                    .collect(),
            ),
        }
    }
}

impl<F: Function + MathFunction + RenderHints> Contestant for Evaluated<'_, F> {
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
        let image = if self.model.plane {
            let eval = pixel::EvalConfig {
                threads: self.threads.as_ref(),
                ..pixel::EvalConfig::default()
            };
            pixel::render(bound, &plane_config(self.model, self.size), &eval).map(Image::Plane)
        } else {
            let eval = voxel::EvalConfig {
                threads: self.threads.as_ref(),
                ..voxel::EvalConfig::default()
            };
            voxel::render(bound, &solid_config(self.model, self.size), &eval).map(Image::Solid)
        };
        self.image = Some(image.ok_or("the picture was cancelled")?);
        Ok(())
    }

    fn picture(&self) -> Result<Picture, String> {
        self.image
            .as_ref()
            .map(Image::picture)
            .ok_or_else(not_drawn)
    }
}
