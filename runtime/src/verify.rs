//! Whether engines agree: the same picture and the same values from each of them, compared in
//! pairs.
//!
//! There are two demands. With strict arithmetic ([`Arithmetic::is_strict`]) engines are equal: every
//! bit of hit, depth, step count and normal, and of distances and gradients at points
//! ([`BitDifferences`]). Without:
//!
//! Engines on plain WGSL are not equal bit for bit: drivers contract and reorder arithmetic. What
//! is held is this. Away from silhouettes no ray hits in one picture and misses in the other; away
//! from all edges (of shapes, materials, shadows) no pixel differs by more than one step of a
//! byte; and at random points the distances differ by no more than rounding can explain. The
//! first engine is the reference: it says where silhouettes and edges are. Everything that was
//! measured is in the [`Report`], passed or not.

mod bits;
mod field;
mod picture;
mod spread;

use crate::engine::{Engine, EngineError, EngineKind, Loaded, Sample};
use crate::frame::{CellUse, Frame, RenderSettings};
use crate::gpu::Arithmetic;
use serde::Serialize;
use std::fmt;

pub use bits::{BitDifferences, PointDifference, RayDifference};
pub use field::{FieldDifferences, POINTS};
pub use picture::{PictureDifferences, difference_picture};
pub use spread::Spread;

/// The width of the pictures that are compared where nothing else is asked for.
pub const WIDTH: u32 = 160;

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The engines, the reference first.
    pub engines: Vec<Subject>,
    /// Width and height of the pictures.
    pub size: [u32; 2],
    /// Each pair of engines.
    pub comparisons: Vec<Comparison>,
    /// The pictures, in the order of the engines.
    #[serde(skip)]
    pub frames: Vec<Frame>,
}

/// An engine that took part.
#[derive(Clone, Debug, Serialize)]
pub struct Subject {
    /// Which one.
    pub kind: EngineKind,
    /// What it ran on.
    pub device: String,
}

/// Two engines compared.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// The one that is compared with.
    pub reference: EngineKind,
    /// The one that is compared.
    pub engine: EngineKind,
    /// How their pictures differ.
    pub picture: PictureDifferences,
    /// How their values at points differ.
    pub field: FieldDifferences,
    /// The results that are not equal in every bit, where equality was demanded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bits: Option<BitDifferences>,
    /// What is more than may be; empty if they agree.
    pub failures: Vec<String>,
}

impl Report {
    /// Whether all engines agree.
    pub fn passed(&self) -> bool {
        self.comparisons
            .iter()
            .all(|comparison| comparison.failures.is_empty())
    }

    /// The pictures of two engines that were compared.
    pub fn pictures(&self, comparison: &Comparison) -> Option<[&Frame; 2]> {
        let of = |kind| {
            let at = self
                .engines
                .iter()
                .position(|subject| subject.kind == kind)?;
            self.frames.get(at)
        };
        Some([of(comparison.reference)?, of(comparison.engine)?])
    }
}

/// The settings of a small picture of the same view: [`WIDTH`] wide, one sample per pixel.
pub fn small(settings: &RenderSettings) -> RenderSettings {
    let [width, height] = settings.size.map(u64::from);
    let height = (u64::from(WIDTH) * height / width.max(1)).clamp(1, 4 * u64::from(WIDTH));
    RenderSettings {
        size: [WIDTH, height as u32],
        aa: 1,
        ..settings.clone()
    }
}

/// How a picture differs from a reference of the same view, and what of it is more than may be.
pub fn compare(reference: &Frame, frame: &Frame) -> (PictureDifferences, Vec<String>) {
    let edges = picture::Edges::of(reference);
    let differences = picture::compare(reference, frame, &edges);
    let failures = differences.failures();
    (differences, failures)
}

/// Loads the scene into all engines, makes the picture with each, asks each for values at
/// [`POINTS`] points, and compares each with every one before it.
pub fn verify(
    scene: &Loaded<'_>,
    engines: &mut [Box<dyn Engine>],
    settings: &RenderSettings,
) -> Result<Report, EngineError> {
    verify_with(scene, engines, settings, Arithmetic::Default)
}

/// The same with the demand of this arithmetic, which is that of the engines.
pub fn verify_with(
    scene: &Loaded<'_>,
    engines: &mut [Box<dyn Engine>],
    settings: &RenderSettings,
    arithmetic: Arithmetic,
) -> Result<Report, EngineError> {
    // Engines are compared in the same steps. Rays in cells stop at other places, by less than the
    // stop threshold; that is compared with the same engine without cells, by a test.
    let settings = &RenderSettings {
        cells: CellUse::Never,
        ..settings.clone()
    };
    let points = field::points(&scene.module.settings.bounds);
    let mut subjects = Vec::new();
    let mut frames: Vec<Frame> = Vec::new();
    let mut samples = Vec::new();
    for engine in engines.iter_mut() {
        engine.load(scene)?;
        frames.push(engine.render(settings, &|_| {})?);
        samples.push(engine.query(&points)?);
        subjects.push(Subject {
            kind: engine.kind(),
            device: engine.device(),
        });
    }
    let mut comparisons = Vec::new();
    for b in 1..subjects.len() {
        for a in 0..b {
            let edges = picture::Edges::of(&frames[a]);
            let picture = picture::compare(&frames[a], &frames[b], &edges);
            let field = field::compare(scene.module, &points, &samples[a], &samples[b]);
            let mut failures = picture.failures();
            failures.extend(field.failures());
            let frames = [&frames[a], &frames[b]];
            let samples: [&[Sample]; 2] = [&samples[a], &samples[b]];
            let bits = arithmetic
                .is_strict()
                .then(|| bits::compare(frames, &points, samples));
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
        frames,
    })
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
