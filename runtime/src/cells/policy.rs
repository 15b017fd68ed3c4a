//! Policy of cells: which part of space is split, and when cells are profitable.

use super::split_rule::{CpuLevels, PrunedLeafLimit, ScreenSpaceLeafLimit};
use super::{Aabb, CellSpec, CellSplit};
use crate::render::plane::face_on_plane;
use crate::render::{CellMode, FieldFacts, PixelPlane, RenderJob};
use glam::Vec3;
use sdfc_shaders::layout::{self, FrameUniforms};
use sdfc_vm::program::{Opcode, Program};
use sdfc_vm::row::Category;
use sdfc_vm::table::Op;
use sdfc_vm::tape::Tape;

/// Minimum number of clauses of a program with bounded slopes for which cells are used.
const MIN_CLAUSES: usize = 32;
/// Maximum side of a leaf of a field written with coordinates, as a fraction of the cube's side. In larger
/// leaves the gradient bounds are too loose, however few pixels they cover.
const MAX_RAW_LEAF_FRACTION: f32 = 0.125;

/// Reports whether cells are profitable for an engine that looks up the cell of every point. Measured:
/// programs with bounded slopes are pruned well and cheaply, and so are fields written with coordinates.
/// In repeated or rough space, intervals are loose, and rays spread over many cells cost more than the cells
/// save.
pub(crate) fn are_lookups_profitable(program: &Program, tape: &Tape) -> bool {
    if tape.lipschitz.is_bounded() {
        return tape.clauses.len() >= MIN_CLAUSES;
    }
    has_op(program, |op| matches!(op, Op::X | Op::Y | Op::Z)) && !is_rough(program)
}

/// Reports whether a program folds space with discontinuities, or contains noise.
pub(crate) fn is_rough(program: &Program) -> bool {
    has_op(program, |op| {
        let facts = &op.row().facts;
        facts.category == Category::Domain || facts.reads_lattice
    })
}

/// Reports whether a program contains an operation for which `test` holds.
fn has_op(program: &Program, test: fn(Op) -> bool) -> bool {
    let mut codes = program.code.iter().map(|i| i.code);
    codes.any(|code| matches!(code, Opcode::Op(op) if test(op)))
}

/// Returns the cube that is split. It encloses the scene's bounds within the length of rays; `None` if that is empty.
pub(crate) fn scene_cube(frame: &FrameUniforms) -> Option<Aabb> {
    scene_extent(frame).map(|extent| enclosing_cube(&extent, ROUNDING_MARGIN))
}

/// Largest half side of a cube that is split. The squares of its sides do not overflow.
const MAX_EXTENT: f32 = 1e15;

/// Returns the scene's bounds, clipped to the length of rays.
fn scene_extent(frame: &FrameUniforms) -> Option<Aabb> {
    let camera = frame.origin;
    // Rays of an orthographic view start away from its centre.
    let view_extent: f32 = [frame.origin_right, frame.origin_up]
        .iter()
        .map(|&v| Vec3::from(v).length())
        .sum();
    let far = (frame.far + view_extent).min(MAX_EXTENT);
    let low: [f32; 3] = std::array::from_fn(|i| frame.bounds_min[i].max(camera[i] - far));
    let high: [f32; 3] = std::array::from_fn(|i| frame.bounds_max[i].min(camera[i] + far));
    let extent = Aabb { low, high };
    let is_empty = (0..3).any(|i| low[i] > high[i]) || extent.longest_side() <= 0.0;
    (!is_empty).then_some(extent)
}

/// Relative enlargement of a cube over the box it encloses, so that rounding leaves no point outside.
const ROUNDING_MARGIN: f32 = 1e-5;
/// Relative enlargement of a cube whose cells are kept when an edit moves a bound a little.
const EDIT_MARGIN: f32 = 1.0 / 16.0;

/// Returns the cube around a box, enlarged by the relative margin.
fn enclosing_cube(Aabb { low, high }: &Aabb, margin: f32) -> Aabb {
    let side = (0..3).fold(0.0, |side, i| f32::max(side, high[i] - low[i]));
    let half = side / 2.0 * (1.0 + margin);
    let middle: [f32; 3] = std::array::from_fn(|i| low[i] + (high[i] - low[i]) / 2.0);
    Aabb {
        low: middle.map(|m| m - half),
        high: middle.map(|m| m + half),
    }
}

/// Maximum ratio of the side of cached cells to the side that an edited scene requires. Leaves of the cached
/// cells are as small, but there are more of them around the scene.
const MAX_REUSE_SIZE_RATIO: f32 = 2.0;

/// Reports whether an engine that looks up the cell of every point uses cells.
pub(crate) fn uses_cells(job: &RenderJob, program: &Program, tape: &Tape) -> bool {
    match job.cells {
        CellMode::Never => false,
        CellMode::Auto => are_lookups_profitable(program, tape),
        CellMode::Always | CellMode::Cpu | CellMode::Gpu => true,
    }
}

/// Minimum number of rays times clauses for which cells that prune well need no trial of their work. Measured: at a
/// width of 64 pixels, examples and hard cases took 0.07 to 0.35 of the time without cells.
const MIN_PRUNED_WORK: f32 = 1.2e6;

/// Reports whether a picture takes so much work that cells pay wherever they prune well.
pub(crate) fn is_large(job: &RenderJob, tape: &Tape) -> bool {
    let frame = &job.uniforms;
    let rays = frame.size[0] * frame.size[1] * frame.samples as f32;
    rays * tape.clauses.len() as f32 >= MIN_PRUNED_WORK
}

/// Use of cells in an engine whose rays go from cell to cell in packets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum PacketCells {
    Never,
    /// A single one, without pruning, in which intervals prove steps.
    Whole,
    /// If they prune well ([`super::trial`]), or a trial of work finds them profitable (`cpu/cell_trial.rs`).
    Trial,
    Always,
}

impl PacketCells {
    /// Returns the use of cells for rendering a tape.
    pub(crate) fn for_job(job: &RenderJob, tape: &Tape, facts: &FieldFacts) -> Self {
        let clauses = tape.clauses.len();
        match job.cells {
            // Nothing else proves that rays step over no surface.
            CellMode::Never if facts.max_slope.is_infinite() => Self::Whole,
            CellMode::Never => Self::Never,
            CellMode::Always | CellMode::Cpu | CellMode::Gpu => Self::Always,
            CellMode::Auto if facts.has_estimated_slopes => Self::Always,
            CellMode::Auto if tape.lipschitz.is_bounded() && clauses >= MIN_CLAUSES => Self::Always,
            CellMode::Auto if tape.lipschitz.is_bounded() => Self::Never,
            CellMode::Auto => Self::Trial,
        }
    }
}

/// The region that an engine splits if it looks up the cell of every point. It is the part of space that rays
/// of all kinds pass through, or the plane of a 2-D shape.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CellRegion {
    /// The part that must be split.
    extent: Aabb,
    /// The part that is split.
    region: Aabb,
    split: CellSplit,
    band: f32,
    margin: f32,
    rule: PrunedLeafLimit,
}

impl CellRegion {
    /// Returns the region for a render; `None` if nothing is visible.
    pub(crate) fn for_job(job: &RenderJob) -> Option<Self> {
        let frame = &job.uniforms;
        if job.shows_plane() {
            let (plane, exact) = face_on_plane(job)?;
            let (region, split) = plane_region(&plane);
            return Some(Self {
                extent: region,
                region,
                split,
                band: exact.band,
                margin: exact.pixels_around_edges() as f32 * plane.pixel_extent(),
                rule: PrunedLeafLimit(ScreenSpaceLeafLimit::from_uniforms(frame)),
            });
        }
        // Samples for occlusion and for normals lie outside the bounds.
        let margin = frame.occlusion_reach.max(0.0);
        let expanded = FrameUniforms {
            bounds_min: frame.bounds_min.map(|v| v - margin),
            bounds_max: frame.bounds_max.map(|v| v + margin),
            ..*frame
        };
        let extent = scene_extent(&expanded)?;
        Some(Self {
            extent,
            region: enclosing_cube(&extent, EDIT_MARGIN),
            split: CellSplit::Volume,
            band: f32::INFINITY,
            margin: 0.0,
            rule: PrunedLeafLimit(ScreenSpaceLeafLimit::from_uniforms(frame)),
        })
    }

    /// Reports whether the cells of this region can be used for another one after an edit. That one has the
    /// same view, lies within this one, and is not much smaller.
    pub(crate) fn covers(&self, other: &Self) -> bool {
        let same_view = Self {
            extent: self.extent,
            region: self.region,
            ..other.clone()
        };
        let Aabb { low, high } = other.extent;
        *self == same_view
            && self.region.contains(low)
            && self.region.contains(high)
            && self.region.longest_side() <= MAX_REUSE_SIZE_RATIO * other.region.longest_side()
    }

    /// Returns the cells to build for the distance program.
    pub(crate) fn distance(&self) -> CellSpec<'_> {
        CellSpec {
            region: self.region,
            split: self.split,
            band: self.band,
            margin: self.margin,
            rule: &self.rule,
            // Devices do not use the slopes of cells.
            max_slope: 1.0,
            max_split_clauses: u64::MAX,
        }
    }

    /// Returns the cells to build for the surface program. A 2-D shape shows its colours everywhere, other scenes
    /// only where rays end.
    pub(crate) fn surface(&self) -> CellSpec<'_> {
        CellSpec {
            band: match self.split {
                CellSplit::Plane => f32::INFINITY,
                CellSplit::Volume => 0.0,
            },
            ..self.distance()
        }
    }

    /// Returns the rule by which the CPU splits cells before a device continues.
    pub(crate) fn cpu_levels(&self) -> CpuLevels<'_> {
        CpuLevels(&self.rule)
    }

    /// Returns the parameters with which a device splits cells further, for the program of `tape` with this band.
    /// Buffer capacities and the words for culled cells are filled in by [`crate::gpu::cell_builder`] and its caller.
    pub(crate) fn gpu_split_params(&self, tape: &Tape, band: f32) -> layout::SplitParams {
        let Aabb { low, high } = self.region;
        let size: [f32; 3] = std::array::from_fn(|axis| high[axis] - low[axis]);
        let farthest = low.iter().chain(&high).fold(0.0, |far, v| v.abs().max(far));
        layout::SplitParams {
            low,
            max_levels: self.split.max_levels(),
            size,
            digit_bits: self.split.digit_bits(),
            // Devices need not support infinity.
            band: band.min(f32::MAX),
            slope: tape.lipschitz.result.min(f32::MAX),
            // Exceeds the rounding error of looking up a point's cell and of that cell's corners.
            rounding: (farthest + self.region.longest_side()) * 5e-7,
            margin: self.margin,
            full_tape_length: tape.clauses.len() as u32,
            ..self.rule.gpu_params()
        }
    }
}

/// Returns the box around the pixels of a 2-D shape, and the arrangement of its children.
fn plane_region(plane: &PixelPlane) -> (Aabb, CellSplit) {
    let [right, down] = plane.size.map(|n| n as f32);
    let (mut low, mut high) = ([0.0; 3], [0.0; 3]);
    for axis in 0..3 {
        let (x, y) = (plane.right[axis] * right, plane.down[axis] * down);
        let first = plane.first[axis];
        // Rays hit the plane with some rounding error. Subpixels lie beyond the pixel centres, and neighbours
        // of pixels beyond the picture.
        let pixel = plane.right[axis].abs() + plane.down[axis].abs();
        let slack = 2.0 * pixel + first.abs() * 1e-5;
        low[axis] = first + x.min(0.0) + y.min(0.0) - slack;
        high[axis] = first + x.max(0.0) + y.max(0.0) + slack;
    }
    let min_thickness = 1e-5 * (high[0] - low[0]).max(high[1] - low[1]);
    if high[2] - low[2] <= min_thickness {
        low[2] -= min_thickness;
        high[2] += min_thickness;
        return (Aabb { low, high }, CellSplit::Plane);
    }
    let side = (0..3).fold(0.0, |side, axis| f32::max(side, high[axis] - low[axis]));
    let middle: [f32; 3] = std::array::from_fn(|axis| (low[axis] + high[axis]) / 2.0);
    let cube = Aabb {
        low: middle.map(|m| m - side / 2.0),
        high: middle.map(|m| m + side / 2.0),
    };
    (cube, CellSplit::Volume)
}

/// Returns the cube and the cell size for a field written with coordinates. Small cells have tight gradient bounds,
/// so that rays take few steps in them; large cells are few. The best leaf size had as many leaves along the
/// cube as pixels along a leaf. For tanglecube at 256², 512² and 1024² these were leaves of 12, 16 and 24
/// pixels. Each split divides a side by four, so the cube is enlarged until a number of splits reaches that
/// size.
pub(crate) fn raw_field_cells(frame: &FrameUniforms) -> Option<(Aabb, ScreenSpaceLeafLimit)> {
    let extent = scene_extent(frame)?;
    let side = enclosing_cube(&extent, ROUNDING_MARGIN).longest_side();
    let pixels = ScreenSpaceLeafLimit::from_uniforms(frame);
    let middle: [f32; 3] = std::array::from_fn(|i| (extent.low[i] + extent.high[i]) / 2.0);
    let distance = Vec3::from(middle).distance(pixels.camera.into());
    let pixel = pixels.pixel_size + pixels.pixel_growth * distance;
    let leaf = (side * pixel)
        .sqrt()
        .clamp(side * 1e-5, side * MAX_RAW_LEAF_FRACTION);
    let levels = ((side / leaf).ln() / 4_f32.ln()).ceil();
    let size_ratio = leaf * 4_f32.powf(levels) / side;
    Some((
        enclosing_cube(&extent, size_ratio * (1.0 + ROUNDING_MARGIN) - 1.0),
        ScreenSpaceLeafLimit {
            max_leaf_pixels: leaf * ROUNDING_FACTOR / pixel,
            max_side: side * MAX_RAW_LEAF_FRACTION * ROUNDING_FACTOR,
            ..pixels
        },
    ))
}

/// Tolerance for rounding when the size of a cell is compared with its target.
const ROUNDING_FACTOR: f32 = 1.01;
