//! Picking: the surface point at one pixel and the source text that produced it.
//!
//! [`PixelHit::from_image`] finds the end of a pixel's ray. The caller then samples that point with the
//! scene's engine and with the engine that has the scene's [`Provenance`] loaded. [`describe`] combines the
//! results.

use super::rays::{InspectedRay, PictureRays, distance_to_figure_plane};
use glam::{DVec3, Vec3};
use sdfc_compiler::provenance::{Leaf, Provenance};
use sdfc_lang::{LineCol, Sources, Span};
use sdfc_runtime::engine::FieldSample;
use sdfc_runtime::render::{Image, RenderSettings, Status};
use sdfc_runtime::rounding::{PointError, error_at};
use sdfc_shaders::layout::Surface;
use sdfc_vm::program::Module;
use std::fmt;

/// The ray of a pixel and its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelHit {
    /// Column and row of the pixel, from the upper left.
    pub pixel: [u32; 2],
    /// Ray through the pixel.
    pub ray: InspectedRay,
    /// Status of the ray. In the picture of a 2-D shape, a ray hits inside the shape and misses outside
    /// it.
    pub status: Status,
    /// Distance along the ray in scene units; `None` for a miss. For a 2-D shape it is the distance to
    /// its plane.
    pub distance: Option<f64>,
    /// Unit normal of the surface in the picture; zero without a surface.
    pub normal: [f32; 3],
    /// Colour of the pixel.
    pub color: [u8; 4],
}

impl PixelHit {
    /// Reads the ray and its end from an image; `None` outside the picture.
    pub fn from_image(image: &Image, settings: &RenderSettings, pixel: [u32; 2]) -> Option<Self> {
        let [column, row] = pixel.map(|n| n as usize);
        if column >= image.width || row >= image.height {
            return None;
        }
        let number = row * image.width + column;
        let ray = PictureRays::new(settings).through([column as f64, row as f64]);
        let depth = f64::from(*image.depth.get(number)?);
        let distance = match settings.is_2d {
            true => distance_to_figure_plane(&ray),
            false => depth.is_finite().then_some(depth),
        };
        Some(Self {
            pixel,
            ray,
            status: *image.status.get(number)?,
            distance,
            normal: *image.normal.get(number)?,
            color: image.display.bytes(*image.color.get(number)?),
        })
    }

    /// Returns the point to sample with engines; `None` for the sky.
    pub fn point(&self) -> Option<[f32; 3]> {
        self.point_f64().map(|point| point.as_vec3().into())
    }

    fn point_f64(&self) -> Option<DVec3> {
        self.distance.map(|distance| self.ray.at(distance))
    }
}

/// Scene data for describing a pick.
#[derive(Clone, Copy, Debug)]
pub struct PickContext<'s> {
    /// Module that the engine has loaded.
    pub module: &'s Module,
    /// Results of the uniform program; see [`Module::update`].
    pub uniform_values: &'s [f64],
    /// Settings of the picture.
    pub settings: &'s RenderSettings,
    /// Texts of the scene and of its imports.
    pub sources: &'s Sources,
    /// Leaves of the scene, if available.
    pub origins: Option<&'s Provenance>,
}

/// Description of the surface point at a pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Pick {
    /// Point where the ray hits the surface, in scene units.
    pub point: [f64; 3],
    /// Distance from the ray's origin, in scene units.
    pub distance: f64,
    /// Field value at the point in scene units, nearly zero on a surface.
    pub field: f32,
    /// Unit normal of the surface; the direction of the gradient if the picture has no normal.
    pub normal: [f32; 3],
    /// Material properties; colours are linear.
    pub surface: Surface,
    /// Name of the material; empty if unnamed.
    pub material: String,
    /// Length of the gradient.
    pub slope: f32,
    /// Bounds of the rounding error at the point.
    pub rounding: PointError,
    /// Source texts that produced the point, from the leaf outwards; empty if unknown.
    pub origins: Vec<SourceText>,
    /// Leaf number; 0 if unknown.
    pub leaf: u32,
}

impl Pick {
    /// Returns the innermost place in each further file: those that use the shape of an import.
    pub fn outer_places(&self) -> impl Iterator<Item = &SourceText> {
        let pairs = self.origins.iter().zip(self.origins.iter().skip(1));
        pairs
            .filter(|(inner, outer)| inner.span.file != outer.span.file)
            .map(|(_, outer)| outer)
    }

    /// Returns the name of the material, or a placeholder for unnamed ones.
    pub fn material_name(&self) -> &str {
        match self.material.as_str() {
            "" => "without a name",
            name => name,
        }
    }
}

/// A piece of source text that produced a shape.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceText {
    /// Name of the shape; empty if unnamed.
    pub name: String,
    /// Name of the file.
    pub file: String,
    /// Line and column of the start.
    pub position: LineCol,
    /// Text of the expression that made the shape.
    pub text: String,
    /// Source range, for an editor.
    pub span: Span,
}

/// Describes the end of a ray. `sample` is the result of the scene's engine at the point. `leaf` is the
/// leaf number: the material id from the leaf engine ([`FieldSample::surface`]) or the id of its picture
/// at the pixel ([`super::objects::leaf_at`]). Returns `None` for the sky.
pub fn describe(
    hit: &PixelHit,
    scene: &PickContext<'_>,
    sample: &FieldSample,
    leaf: u32,
) -> Option<Pick> {
    let point = hit.point_f64()?.to_array();
    let number = sample.surface.id.max(0.0) as usize;
    let material = scene.module.settings.materials.get(number);
    let normal = if hit.normal == [0.0; 3] {
        unit(sample.gradient.into()).into()
    } else {
        hit.normal
    };
    let origins = scene.origins.and_then(|origins| {
        let leaf = origins.leaf(leaf)?;
        let chain = origins.chain(leaf);
        Some(chain.map(|leaf| origin(scene.sources, leaf)).collect())
    });
    Some(Pick {
        point,
        distance: hit.distance?,
        field: sample.distance,
        normal,
        surface: sample.surface,
        material: material.cloned().unwrap_or_default(),
        slope: super::slopes::gradient_length(sample),
        rounding: error_at(scene.module, scene.uniform_values, scene.settings, point),
        leaf: if origins.is_some() { leaf } else { 0 },
        origins: origins.unwrap_or_default(),
    })
}

/// Returns the source text of a leaf, or of a shape around one.
fn origin(sources: &Sources, leaf: &Leaf) -> SourceText {
    SourceText {
        name: leaf.name.clone(),
        file: sources.name(leaf.span.file).to_owned(),
        position: sources.line_col(leaf.span.file, leaf.span.start),
        text: sources.slice(leaf.span).to_owned(),
        span: leaf.span,
    }
}

fn unit(v: Vec3) -> Vec3 {
    let length = v.length();
    if length > 0.0 && length.is_finite() {
        v / length
    } else {
        Vec3::ZERO
    }
}

/// Maximum number of characters of source text in one line.
const MAX_LINE_CHARS: usize = 60;

impl fmt::Display for SourceText {
    /// Formats the position and the first line of the text: `scene.sdf:3:5  sphere(1)`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let LineCol { line, column } = self.position;
        let first = self.text.lines().next().unwrap_or("").trim_end();
        let shown: String = first.chars().take(MAX_LINE_CHARS).collect();
        let ellipsis = if shown.len() < self.text.trim_end().len() {
            " …"
        } else {
            ""
        };
        write!(f, "{}:{line}:{column}  {shown}{ellipsis}", self.file)
    }
}

impl fmt::Display for Pick {
    /// Formats a few lines: the source text first, then the numbers.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(origin) = self.origins.first() {
            writeln!(f, "{origin}")?;
        }
        for around in self.outer_places() {
            writeln!(f, "used in    {around}")?;
        }
        let named = self.origins.iter().map(|origin| origin.name.as_str());
        let names: Vec<&str> = named.filter(|name| !name.is_empty()).collect();
        if !names.is_empty() {
            writeln!(f, "part of    {}", names.join(" in "))?;
        }
        writeln!(f, "point      {}", list(self.point))?;
        writeln!(f, "distance   {:.6}", self.distance)?;
        writeln!(f, "normal     {}", list(self.normal.map(f64::from)))?;
        let s = &self.surface;
        write!(
            f,
            "material   {}: linear albedo {}, roughness {:.2}, metallic {:.2}",
            self.material_name(),
            list(s.albedo.map(f64::from)),
            s.roughness,
            s.metallic
        )?;
        if s.emission != [0.0; 3] {
            write!(f, ", emission {}", list(s.emission.map(f64::from)))?;
        }
        writeln!(f)?;
        writeln!(f, "field      {:.3e}", self.field)?;
        writeln!(f, "slope      {:.4} of at most 1", self.slope)?;
        let PointError {
            field,
            pixels,
            branch_uncertain,
        } = self.rounding;
        let note = if branch_uncertain {
            ", branch uncertain"
        } else {
            ""
        };
        write!(
            f,
            "rounding   at most {field:.1e}, {pixels:.1e} pixels{note}"
        )
    }
}

fn list(numbers: [f64; 3]) -> String {
    numbers.map(|number| format!("{number:.4}")).join(", ")
}
