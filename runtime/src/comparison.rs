//! Comparison of engines: the same image and the same values from each of them, compared in pairs.
//!
//! There are two criteria. With strict arithmetic ([`Arithmetic::is_strict`]) engines must be equal in every
//! bit. That holds for hit, depth, step count and normal, and for distances and gradients at points
//! ([`BitDifferences`]).
//!
//! With default arithmetic drivers contract and reorder operations, so bits differ. The criteria are then:
//! Away from silhouettes no ray hits in one image and misses in the other. Away from all edges (of shapes,
//! materials, shadows) no pixel differs by more than one step of a byte. There, 99.9 % of the depths differ
//! by at most eight units in the last place. At random points the distances differ by no more than rounding
//! can explain. The gradients differ by at most a hundredth, unless they vary by about as much within
//! rounding of the point. The first engine of a pair is the reference: it defines the silhouettes and
//! edges. All measurements are in the [`Report`], passed or not.

mod bits;
mod field;
mod percentiles;
mod picture;

use crate::engine::{Engine, EngineError, EngineKind, FieldSample, SceneInput};
use crate::gpu::Arithmetic;
use crate::render::{CellMode, Image, RenderProgress, RenderSettings};
use serde::Serialize;
use std::fmt;
use std::ops::ControlFlow;

pub use bits::{BitDifferences, PointDifference, RayDifference};
pub use field::{FieldDifferences, POINT_COUNT};
pub use percentiles::Percentiles;
pub use picture::{MISMATCH_COLOR, PictureDifferences, SILHOUETTE_COLOR, difference_image};

/// Default width of the compared images.
pub const DEFAULT_WIDTH: u32 = 160;

/// The result of a verification.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The engines, the reference first.
    pub engines: Vec<Subject>,
    /// Width and height of the images.
    pub size: [u32; 2],
    /// The comparisons of all pairs of engines.
    pub comparisons: Vec<Comparison>,
    /// The images, in the order of the engines.
    #[serde(skip)]
    pub images: Vec<Image>,
}

/// A verified engine.
#[derive(Clone, Debug, Serialize)]
pub struct Subject {
    /// The kind of the engine.
    pub kind: EngineKind,
    /// The name of its device.
    pub device: String,
}

/// Two engines compared.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// The engine whose image is the reference: the earlier one.
    pub reference: EngineKind,
    /// The engine compared with it.
    pub engine: EngineKind,
    /// Differences of their images.
    pub picture: PictureDifferences,
    /// Differences of their values at points.
    pub field: FieldDifferences,
    /// The results that differ in any bit, if equality was required.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bits: Option<BitDifferences>,
    /// Messages for all differences that are not allowed; empty if the engines agree.
    pub failures: Vec<String>,
}

impl Report {
    /// Reports whether all engines agree.
    pub fn passed(&self) -> bool {
        self.comparisons
            .iter()
            .all(|comparison| comparison.failures.is_empty())
    }

    /// Returns the images of two engines that were compared: the reference first.
    pub fn images_of(&self, comparison: &Comparison) -> Option<[&Image; 2]> {
        let image_of = |kind| {
            let index = self
                .engines
                .iter()
                .position(|subject| subject.kind == kind)?;
            self.images.get(index)
        };
        Some([
            image_of(comparison.reference)?,
            image_of(comparison.engine)?,
        ])
    }
}

/// Returns the settings of a small image of the same view: [`DEFAULT_WIDTH`] wide, one sample per pixel.
pub fn small_settings(settings: &RenderSettings) -> RenderSettings {
    let [width, height] = settings.size.map(u64::from);
    let height =
        (u64::from(DEFAULT_WIDTH) * height / width.max(1)).clamp(1, 4 * u64::from(DEFAULT_WIDTH));
    RenderSettings {
        size: [DEFAULT_WIDTH, height as u32],
        aa: 1,
        ..settings.clone()
    }
}

/// Compares an image with a reference of the same view. Returns the differences, and messages for those that
/// are not allowed.
pub fn compare(reference: &Image, image: &Image) -> (PictureDifferences, Vec<String>) {
    let edges = picture::Edges::new(reference);
    let differences = picture::compare(reference, image, &edges);
    let failures = differences.failures();
    (differences, failures)
}

/// Compares engines: loads the scene into each, renders its image, queries values at [`POINT_COUNT`] points,
/// and compares each engine with all earlier ones.
pub fn compare_engines(
    scene: &SceneInput<'_>,
    engines: &mut [Box<dyn Engine>],
    settings: &RenderSettings,
) -> Result<Report, EngineError> {
    compare_engines_with(scene, engines, settings, Arithmetic::Default, &|_| {})
}

/// Compares engines like [`compare_engines`], with the criterion of this arithmetic, which must be that of the engines.
///
/// # Errors
///
/// As those of engines; [`EngineError::Stopped`] if the progress stops it.
pub fn compare_engines_with(
    scene: &SceneInput<'_>,
    engines: &mut [Box<dyn Engine>],
    settings: &RenderSettings,
    arithmetic: Arithmetic,
    progress: &dyn RenderProgress,
) -> Result<Report, EngineError> {
    // Without cells all engines take the same steps. Rays in cells stop at other points, by less than the
    // stop threshold; a test compares that with the same engine without cells.
    let settings = &RenderSettings {
        cells: CellMode::Never,
        ..settings.clone()
    };
    // Where a slope is only estimated, the CPU proves its steps, and devices do not.
    let has_same_bits = arithmetic.is_strict() && scene.module.settings.max_slope().is_finite();
    let points = field::points(&scene.module.settings.bounds);
    let mut subjects = Vec::new();
    let mut images: Vec<Image> = Vec::new();
    let mut samples = Vec::new();
    let count = engines.len() as f32;
    for (number, engine) in engines.iter_mut().enumerate() {
        engine.load(scene)?;
        let progress = PartOfProgress {
            whole: progress,
            start: number as f32 / count,
            length: 1.0 / count,
        };
        images.push(engine.render(settings, &progress)?);
        samples.push(engine.query(&points)?);
        subjects.push(Subject {
            kind: engine.kind(),
            device: engine.device(),
        });
    }
    let mut comparisons = Vec::new();
    for b in 1..subjects.len() {
        for a in 0..b {
            let edges = picture::Edges::new(&images[a]);
            let picture = picture::compare(&images[a], &images[b], &edges);
            let field = field::compare(scene.module, &points, &samples[a], &samples[b]);
            let mut failures = picture.failures();
            failures.extend(field.failures());
            let pair = [&images[a], &images[b]];
            let samples: [&[FieldSample]; 2] = [&samples[a], &samples[b]];
            let bits = has_same_bits.then(|| bits::compare(pair, &points, samples));
            failures.extend(bits.iter().flat_map(BitDifferences::failures));
            let (reference, engine) = (subjects[a].kind, subjects[b].kind);
            comparisons.push(Comparison {
                reference,
                engine,
                picture,
                field,
                bits,
                failures,
            });
        }
    }
    Ok(Report {
        engines: subjects,
        size: settings.size,
        comparisons,
        images,
    })
}

/// Progress of a part of some work.
struct PartOfProgress<'a> {
    whole: &'a dyn RenderProgress,
    /// Fraction of the work before this part.
    start: f32,
    /// Fraction of the work that is this part.
    length: f32,
}

impl RenderProgress for PartOfProgress<'_> {
    fn report(&self, fraction: f32) -> ControlFlow<()> {
        self.whole.report(self.start + self.length * fraction)
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, comparison) in self.comparisons.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "{comparison}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = if self.failures.is_empty() {
            "agree"
        } else {
            "DIFFER"
        };
        writeln!(f, "{} and {} {verdict}", self.reference, self.engine)?;
        write!(f, "{}{}", self.picture, self.field)?;
        if let Some(bits) = &self.bits {
            write!(f, "{bits}")?;
        }
        for failure in &self.failures {
            writeln!(f, "  failed: {failure}")?;
        }
        Ok(())
    }
}
