//! One pixel: what is seen there, and which text made it.
//!
//! [`Spot::at`] says where a pixel's ray ended. Whoever calls then asks the scene's engine about that
//! point, and the engine that has the scene's [`Origins`] loaded, and [`describe`] puts it all together.

use super::rays::{Ray, Rays, single, to_figure};
use sdfc_compiler::origins::{Leaf, Origins};
use sdfc_lang::{LineCol, Sources, Span};
use sdfc_runtime::engine::Sample;
use sdfc_runtime::frame::{Frame, RenderSettings, Status};
use sdfc_runtime::rounding::{Here, here};
use sdfc_shaders::layout::Surface;
use sdfc_vm::program::Module;
use sdfc_vm::vector::V3;
use std::fmt;

/// Where the ray of a pixel went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// The pixel: column and row, from the upper left.
    pub pixel: [u32; 2],
    /// Its ray.
    pub ray: Ray,
    /// How it ended. A ray of a plane figure hits where the figure is, and misses beside it.
    pub status: Status,
    /// How far that is, in scene units; `None` where it met nothing. Of a plane figure it is the way to
    /// its plane.
    pub distance: Option<f64>,
    /// The direction of the surface as the picture has it, of length one; zero where there is none.
    pub normal: [f32; 3],
    /// The colour of the pixel.
    pub color: [u8; 4],
}

impl Spot {
    /// Where the ray of a pixel went; `None` outside of the picture.
    pub fn at(frame: &Frame, settings: &RenderSettings, pixel: [u32; 2]) -> Option<Self> {
        let [column, row] = pixel.map(|n| n as usize);
        if column >= frame.width || row >= frame.height {
            return None;
        }
        let number = row * frame.width + column;
        let ray = Rays::of(settings).through([column as f64, row as f64]);
        let depth = f64::from(*frame.depth.get(number)?);
        let distance = match settings.plane {
            true => to_figure(&ray),
            false => depth.is_finite().then_some(depth),
        };
        Some(Self {
            pixel,
            ray,
            status: *frame.status.get(number)?,
            distance,
            normal: *frame.normal.get(number)?,
            color: frame.display.bytes(*frame.color.get(number)?),
        })
    }

    /// The point where it ended, which engines are to be asked about; `None` in the sky, which has a
    /// direction ([`Spot::ray`]) and a colour, and nothing else to tell.
    pub fn point(&self) -> Option<[f32; 3]> {
        self.place().map(single)
    }

    fn place(&self) -> Option<V3<f64>> {
        self.distance.map(|distance| self.ray.at(distance))
    }
}

/// The scene that a picture is of.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'s> {
    /// What its engine has loaded, and the results of its uniform program.
    pub module: &'s Module,
    /// See [`Module::update`].
    pub outputs: &'s [f64],
    /// Of the picture.
    pub settings: &'s RenderSettings,
    /// Its texts.
    pub sources: &'s Sources,
    /// Its leaves, if they are known.
    pub origins: Option<&'s Origins>,
}

/// What is seen at a pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Pick {
    /// The point.
    pub point: [f64; 3],
    /// How far it is from where the ray started, in scene units.
    pub distance: f64,
    /// The field there: nearly zero on a surface, in scene units.
    pub field: f32,
    /// The direction of the surface, of length one; of the field where the picture has none.
    pub normal: [f32; 3],
    /// What it is made of; colours are linear.
    pub surface: Surface,
    /// The name of the material; empty if it has none.
    pub material: String,
    /// How fast the field changes there, per unit of the way.
    pub slope: f32,
    /// How far off rounding may be there.
    pub rounding: Here,
    /// The text that made it, and what stands around that, from the inside out; empty where nothing is
    /// known.
    pub origins: Vec<Origin>,
    /// The number of the leaf that made it; 0 where that is not known.
    pub leaf: u32,
}

impl Pick {
    /// The name of the material, or that it has none.
    pub fn material_name(&self) -> &str {
        match self.material.as_str() {
            "" => "without a name",
            name => name,
        }
    }
}

/// A piece of text that made something.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Origin {
    /// The name that the shape was given; empty if none.
    pub name: String,
    /// The file.
    pub file: String,
    /// Where it begins.
    pub place: LineCol,
    /// The text itself.
    pub text: String,
    /// The same for an editor.
    pub span: Span,
}

/// What is seen at a spot: `sample` is what the scene's engine gave for its point, and `leaf` the number
/// of the leaf there: the material that the origins' engine gave ([`Sample::surface`]), or what its
/// picture has at the pixel ([`super::objects::leaf_at`]). `None` in the sky.
pub fn describe(spot: &Spot, scene: &Scene<'_>, sample: &Sample, leaf: u32) -> Option<Pick> {
    let point = spot.place()?;
    let point = [point.x, point.y, point.z];
    let number = sample.surface.id.max(0.0) as usize;
    let material = scene.module.settings.materials.get(number);
    let normal = if spot.normal == [0.0; 3] {
        unit(sample.gradient)
    } else {
        spot.normal
    };
    let origins = scene.origins.and_then(|origins| {
        let leaf = origins.leaf(leaf)?;
        let chain = origins.chain(leaf);
        Some(chain.map(|leaf| origin(scene.sources, leaf)).collect())
    });
    Some(Pick {
        point,
        distance: spot.distance?,
        field: sample.distance,
        normal,
        surface: sample.surface,
        material: material.cloned().unwrap_or_default(),
        slope: super::slopes::steepness(sample),
        rounding: here(scene.module, scene.outputs, scene.settings, point),
        leaf: if origins.is_some() { leaf } else { 0 },
        origins: origins.unwrap_or_default(),
    })
}

/// A leaf, or a shape around one, in its text.
fn origin(sources: &Sources, leaf: &Leaf) -> Origin {
    Origin {
        name: leaf.name.clone(),
        file: sources.name(leaf.span.file).to_owned(),
        place: sources.line_col(leaf.span.file, leaf.span.start),
        text: sources.slice(leaf.span).to_owned(),
        span: leaf.span,
    }
}

fn unit(v: [f32; 3]) -> [f32; 3] {
    let length = v.iter().map(|x| x * x).sum::<f32>().sqrt();
    if length > 0.0 && length.is_finite() {
        v.map(|x| x / length)
    } else {
        [0.0; 3]
    }
}

/// The most characters of a text in one line.
const LONGEST: usize = 60;

impl fmt::Display for Origin {
    /// The place and the text's first line: `scene.sdf:3:5  sphere(1)`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let LineCol { line, column } = self.place;
        let first = self.text.lines().next().unwrap_or("").trim_end();
        let shown: String = first.chars().take(LONGEST).collect();
        let more = if shown.len() < self.text.trim_end().len() {
            " …"
        } else {
            ""
        };
        write!(f, "{}:{line}:{column}  {shown}{more}", self.file)
    }
}

impl fmt::Display for Pick {
    /// A few lines for people: the text first, then the numbers.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(origin) = self.origins.first() {
            writeln!(f, "{origin}")?;
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
            "material   {}: albedo {}, roughness {:.2}, metallic {:.2}",
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
        let Here {
            field,
            pixels,
            torn,
        } = self.rounding;
        let torn = if torn { ", at a seam" } else { "" };
        write!(
            f,
            "rounding   at most {field:.1e}, {pixels:.1e} pixels{torn}"
        )
    }
}

fn list(numbers: [f64; 3]) -> String {
    numbers.map(|number| format!("{number:.4}")).join(", ")
}
