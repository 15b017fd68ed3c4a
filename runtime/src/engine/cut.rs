//! Which cells a picture wants: where they begin, how small they get, and whether they pay.

use crate::cells::{Cut, Refine, Region, Split};
use crate::cpu::figure::Plane;
use crate::cpu::plane_and_band;
use crate::frame::{CellUse, Picture};
use sdfc_shaders::interpreter::cut::LONGEST;
use sdfc_shaders::layout::{self, Frame};
use sdfc_vm::program::{Code, Program};
use sdfc_vm::row::Category;
use sdfc_vm::table::Op;
use sdfc_vm::tape::Tape;

/// Programs of shapes with fewer clauses are marched without cells.
const FEW: usize = 32;
/// A leaf's side in pixels, at most.
const LEAF: f32 = 16.0;
/// The largest leaf of fields written with coordinates, as a share of the whole: bounds of its gradient
/// tell little in larger ones, however few pixels they have.
const RAW_LARGEST: f32 = 0.125;
/// The side in pixels from which on cells with next to nothing to leave out are cut.
const PLAIN_LEAF: f32 = 256.0;
/// Tapes of so many clauses have next to nothing to leave out.
const PLAIN: usize = 2;

/// Whether a program is worth cells for an engine that looks every point up. Measured: shapes whose slopes
/// are known are pruned well and cheaply; so are fields written with coordinates. Where space is repeated or
/// rough, intervals tell little of it, and rays that are spread over many cells cost more than the cells save.
pub(super) fn pays(program: &Program, tape: &Tape) -> bool {
    if tape.slopes.known() {
        return tape.clauses.len() >= FEW;
    }
    has(program, |op| matches!(op, Op::X | Op::Y | Op::Z)) && !is_rough(program)
}

/// Whether a program folds space with seams, or has noise.
pub(super) fn is_rough(program: &Program) -> bool {
    has(program, |op| {
        let row = op.row();
        row.meta.category == Category::Domain
            || row.name.contains("noise")
            || row.name.contains("octave")
    })
}

/// Whether a program has such an operation.
fn has(program: &Program, test: fn(Op) -> bool) -> bool {
    let mut codes = program.code.iter().map(|i| i.code);
    codes.any(|code| matches!(code, Code::Op(op) if test(op)))
}

/// The cube that is cut: the scene's bounds, as far as rays go. `None` where there is nothing.
pub(super) fn region(frame: &Frame) -> Option<Region> {
    extent(frame).map(|extent| cube(&extent, TIGHT))
}

/// The scene's bounds, as far as rays go.
fn extent(frame: &Frame) -> Option<Region> {
    let eye = frame.origin;
    // Rays of a parallel view start away from its middle.
    let wide: f32 = [frame.origin_right, frame.origin_up]
        .iter()
        .map(|v| v.iter().map(|x| x * x).sum::<f32>().sqrt())
        .sum();
    let far = (frame.far + wide).min(1e9);
    let low: [f32; 3] = std::array::from_fn(|i| frame.bounds_min[i].max(eye[i] - far));
    let high: [f32; 3] = std::array::from_fn(|i| frame.bounds_max[i].min(eye[i] + far));
    let extent = Region { low, high };
    let nothing = (0..3).any(|i| low[i] > high[i]) || extent.side() <= 0.0;
    (!nothing).then_some(extent)
}

/// How much larger than what it holds a cube is, as a share: so much that rounding leaves no point
/// outside.
const TIGHT: f32 = 1e-5;
/// The same where the cells are to be kept when an edit moves a bound a little.
const ROOMY: f32 = 1.0 / 16.0;

/// The cube around a box.
fn cube(Region { low, high }: &Region, larger: f32) -> Region {
    let side = (0..3).fold(0.0, |side, i| f32::max(side, high[i] - low[i]));
    let half = side / 2.0 * (1.0 + larger);
    let middle: [f32; 3] = std::array::from_fn(|i| low[i] + (high[i] - low[i]) / 2.0);
    Region {
        low: middle.map(|m| m - half),
        high: middle.map(|m| m + half),
    }
}

/// Tapes of no more clauses are short enough where each point is looked up.
const SHORT: usize = 6;

/// The cells of a space this many times as wide as an edit left it are kept: they are as small, but
/// there is more of them around what is there.
const WIDER: f32 = 2.0;

/// Whether a picture's rays are to meet cells of such an engine.
pub(super) fn wanted(picture: &Picture, program: &Program, tape: &Tape) -> bool {
    match picture.cells {
        CellUse::Never => false,
        CellUse::Auto => pays(program, tape),
        CellUse::Always | CellUse::Processor | CellUse::Device => true,
    }
}

/// Where slopes are not known, cells are thought of where a picture's rays and their clauses are so many
/// together. Measured: 64 pixels wide, examples and hard cases with such fields took 0.07 to 0.35 of the time
/// without cells.
const RAW_WORK: f32 = 1.2e6;

/// Whether cells are to be had for an engine whose rays go from cell to cell in packets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ByPackets {
    No,
    /// If they turn out to be worth it ([`super::worth`]).
    Tried,
    Yes,
}

impl ByPackets {
    /// For a picture of a tape.
    pub(super) fn of(picture: &Picture, tape: &Tape) -> Self {
        let frame = &picture.uniforms;
        let rays = frame.size[0] * frame.size[1] * frame.samples as f32;
        let clauses = tape.clauses.len();
        match picture.cells {
            CellUse::Never => Self::No,
            CellUse::Always | CellUse::Processor | CellUse::Device => Self::Yes,
            CellUse::Auto if tape.slopes.known() && clauses >= FEW => Self::Yes,
            CellUse::Auto if tape.slopes.known() => Self::No,
            CellUse::Auto if rays * clauses as f32 >= RAW_WORK => Self::Tried,
            CellUse::Auto => Self::No,
        }
    }
}

/// What an engine that looks every point up cuts for a picture: the part of space that rays of all
/// kinds come through, or the plane of a figure.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Space {
    /// What has to be cut.
    extent: Region,
    /// What is cut.
    region: Region,
    split: Split,
    band: f32,
    pixels: Pixels,
}

impl Space {
    /// `None` where there is nothing to be seen.
    pub(super) fn of(picture: &Picture) -> Option<Self> {
        let frame = &picture.uniforms;
        if picture.shows_plane() {
            let (plane, band) = plane_and_band(picture)?;
            let (region, split) = around(&plane);
            return Some(Self {
                extent: region,
                region,
                split,
                band,
                pixels: Pixels::of(frame),
            });
        }
        // Taps of occlusion and of normals reach out of the bounds.
        let reach = frame.occlusion_reach.max(0.0);
        let grown = Frame {
            bounds_min: frame.bounds_min.map(|v| v - reach),
            bounds_max: frame.bounds_max.map(|v| v + reach),
            ..*frame
        };
        let extent = extent(&grown)?;
        Some(Self {
            extent,
            region: cube(&extent, ROOMY),
            split: Split::Cube,
            band: f32::INFINITY,
            pixels: Pixels::of(frame),
        })
    }

    /// Whether its cells do for another space too: one that is seen alike, and that an edit left within
    /// this one and not much smaller.
    pub(super) fn does_for(&self, other: &Self) -> bool {
        let alike = Self {
            extent: self.extent,
            region: self.region,
            ..other.clone()
        };
        let Region { low, high } = other.extent;
        *self == alike
            && self.region.holds(low)
            && self.region.holds(high)
            && self.region.side() <= WIDER * other.region.side()
    }

    /// The cells of the distance.
    pub(super) fn distance(&self) -> Cut<'_> {
        Cut {
            region: self.region,
            split: self.split,
            band: self.band,
            refine: self,
        }
    }

    /// The cells of surfaces: a figure shows its colours everywhere, other scenes only where rays
    /// end.
    pub(super) fn surface(&self) -> Cut<'_> {
        Cut {
            band: match self.split {
                Split::Square => f32::INFINITY,
                Split::Cube => 0.0,
            },
            ..self.distance()
        }
    }

    /// What a device has to know to cut cells of a program further, the distance or surfaces with
    /// this band; where there is room, and the words of what is not kept, are somebody else's.
    pub(super) fn on_device(&self, tape: &Tape, band: f32) -> layout::Cut {
        let Region { low, high } = self.region;
        let size: [f32; 3] = std::array::from_fn(|axis| high[axis] - low[axis]);
        let farthest = low.iter().chain(&high).fold(0.0, |far, v| v.abs().max(far));
        layout::Cut {
            low,
            levels: self.split.levels(),
            size,
            digit: self.split.digit(),
            eye: self.pixels.eye,
            footprint: self.pixels.footprint,
            growth: self.pixels.growth,
            leaf: self.pixels.leaf,
            // Devices need not know infinity.
            band: band.min(f32::MAX),
            slope: tape.slopes.whole.min(f32::MAX),
            // More than what it takes to find a point's cell and the corners of that.
            rounding: (farthest + self.region.side()) * 5e-7,
            few: SHORT as u32,
            whole: tape.clauses.len() as u32,
            ..layout::Cut::default()
        }
    }
}

/// The first cuts of space, where a device makes the others: until no invocation has to walk through
/// a longer tape than it may.
pub(super) struct First<'a>(pub(super) &'a Space);

impl Refine for First<'_> {
    fn cut(&self, region: &Region, clauses: usize, away: f32) -> bool {
        self.0.cut(region, clauses, away)
    }
    fn leaves(&self, clauses: usize) -> bool {
        clauses <= LONGEST
    }
}

impl Refine for Space {
    fn cut(&self, region: &Region, clauses: usize, away: f32) -> bool {
        // A ray's step is about as long as the way to the surface: it asks few times in a cell that
        // is smaller than that.
        clauses > SHORT && away < 2.0 * region.side() && self.pixels.cut(region, clauses, away)
    }
}

/// The box around a figure's pixels, and how it is cut.
fn around(plane: &Plane) -> (Region, Split) {
    let [right, down] = plane.size.map(|n| n as f32);
    let (mut low, mut high) = ([0.0; 3], [0.0; 3]);
    for axis in 0..3 {
        let (x, y) = (plane.right[axis] * right, plane.down[axis] * down);
        let first = plane.first[axis];
        // Rays meet the plane with some rounding, and subpixels lie beyond the pixels' middles.
        let slack = plane.right[axis].abs() + plane.down[axis].abs() + first.abs() * 1e-5;
        low[axis] = first + x.min(0.0) + y.min(0.0) - slack;
        high[axis] = first + x.max(0.0) + y.max(0.0) + slack;
    }
    let thick = 1e-5 * (high[0] - low[0]).max(high[1] - low[1]);
    if high[2] - low[2] <= thick {
        low[2] -= thick;
        high[2] += thick;
        return (Region { low, high }, Split::Square);
    }
    let side = (0..3).fold(0.0, |side, axis| f32::max(side, high[axis] - low[axis]));
    let middle: [f32; 3] = std::array::from_fn(|axis| (low[axis] + high[axis]) / 2.0);
    let cube = Region {
        low: middle.map(|m| m - side / 2.0),
        high: middle.map(|m| m + side / 2.0),
    };
    (cube, Split::Cube)
}

/// Cells as large as so many pixels of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pixels {
    eye: [f32; 3],
    footprint: f32,
    growth: f32,
    /// A leaf's side in pixels, at most.
    leaf: f32,
    /// Larger cells are cut in any case.
    largest: f32,
}

impl Pixels {
    pub(super) fn of(frame: &Frame) -> Self {
        // Half a pixel of a pass over subpixels is less than half a pixel of the picture.
        let passes = (frame.samples.max(1) as f32).sqrt();
        Self {
            eye: frame.origin,
            footprint: 2.0 * frame.footprint * passes,
            growth: 2.0 * frame.footprint_growth * passes,
            leaf: LEAF,
            largest: f32::INFINITY,
        }
    }
}

impl Pixels {
    /// Cells that are so many times as large.
    pub(super) fn coarser(&self, times: f32) -> Self {
        Self {
            leaf: self.leaf * times,
            largest: self.largest * times,
            ..*self
        }
    }
}

impl Refine for Pixels {
    fn cut(&self, region: &Region, clauses: usize, _: f32) -> bool {
        let side = region.side();
        let away = |axis: usize| {
            (region.low[axis] - self.eye[axis])
                .max(self.eye[axis] - region.high[axis])
                .max(0.0)
        };
        let [x, y, z] = [0, 1, 2].map(away);
        // From inside a cell, its far parts count.
        let distance = (x * x + y * y + z * z).sqrt().max(side * 0.25);
        let pixel = self.footprint + self.growth * distance;
        let most = if clauses <= PLAIN {
            PLAIN_LEAF
        } else {
            self.leaf
        };
        side > most * pixel || side > self.largest
    }
}

/// The cube that is cut of a field written with coordinates, and how small its cells get. Small ones have
/// close bounds of the gradient, so that rays take few steps in them; large ones are few. In all, as many
/// leaves along the cube as pixels along a leaf did best: of tanglecube at 256², 512² and 1024² leaves of
/// 12, 16 and 24 pixels. As cells are cut into four each time, the cube is as large as it takes to come to
/// that.
pub(super) fn raw(frame: &Frame) -> Option<(Region, Pixels)> {
    let extent = extent(frame)?;
    let side = cube(&extent, TIGHT).side();
    let pixels = Pixels::of(frame);
    let middle: [f32; 3] = std::array::from_fn(|i| (extent.low[i] + extent.high[i]) / 2.0);
    let away = (0..3).map(|i| (middle[i] - pixels.eye[i]) * (middle[i] - pixels.eye[i]));
    let pixel = pixels.footprint + pixels.growth * away.sum::<f32>().sqrt();
    let leaf = (side * pixel).sqrt().clamp(side * 1e-5, side * RAW_LARGEST);
    let levels = ((side / leaf).ln() / 4_f32.ln()).ceil();
    let larger = leaf * 4_f32.powf(levels) / side;
    Some((
        cube(&extent, larger * (1.0 + TIGHT) - 1.0),
        Pixels {
            leaf: leaf * ALMOST / pixel,
            largest: side * RAW_LARGEST * ALMOST,
            ..pixels
        },
    ))
}

/// What makes up for rounding where a cell is compared with what it was meant to be.
const ALMOST: f32 = 1.01;
