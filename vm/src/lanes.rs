//! Lanes: 64 numbers at once, and the loops over them.
//!
//! A block of 64 lanes is plain arrays. The compiler vectorizes a loop over it whose body has no branches.
//! Every loop is compiled once per instruction set, and chosen at run time. Measured with 50 primitives
//! and AVX-512: 36 times as fast as one point at a time (see `benches/README.md`).

mod loops;

pub use loops::{bits, with_identity_jacobian, with_identity_jacobian_of_boxes};

use crate::blend::BlendKernel;
use crate::real::Real;
use crate::table::Op;

/// Number of points that are evaluated at once.
pub const LANES: usize = 64;

/// Number of lanes in a chunk. Loops run over whole chunks, so that few points cost less than many.
pub const CHUNK: usize = 16;

/// Runs the body for each lane of the chunks that hold `count` lanes. The compiler can prove that the
/// number of lanes is a multiple of a chunk and at most `LANES`. So it vectorizes the loop without a
/// remainder or a bounds check.
macro_rules! for_each_lane {
    ($count:ident, $lane:ident => $body:block) => {
        let lanes = $count
            .div_ceil($crate::lanes::CHUNK)
            .min($crate::lanes::LANES / $crate::lanes::CHUNK)
            * $crate::lanes::CHUNK;
        for $lane in 0..lanes {
            $body
        }
    };
}

pub(crate) use for_each_lane;

/// One number per lane.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct F32x64(pub [f32; LANES]);

impl Default for F32x64 {
    fn default() -> Self {
        Self([0.0; LANES])
    }
}

/// One point per lane.
pub type Points = [F32x64; 3];

/// A number type that is evaluated in lanes, and the layout of its blocks.
pub trait LaneNumber: Real {
    /// 64 numbers.
    type Block: Clone + Default + Send;
    /// 64 points.
    type PointBlock: Clone + Default + Send;
    /// Returns the number in a lane.
    fn load(block: &Self::Block, lane: usize) -> Self;
    /// Sets the number in a lane.
    fn store(self, block: &mut Self::Block, lane: usize);
    /// Returns the point in a lane.
    fn load_point(block: &Self::PointBlock, lane: usize) -> Self::Vec3;
    /// Sets the point in a lane.
    fn store_point(point: Self::Vec3, block: &mut Self::PointBlock, lane: usize);
    /// Runs an operation in stages over all lanes, where that is faster than one lane after another.
    /// Reports whether it did.
    #[inline(always)]
    fn apply_in_stages(op: Op, reads: &OpInputs<'_, Self>, out: &mut Self::Block) -> bool {
        let _ = (op, reads, out);
        false
    }
    /// Returns the loops over lanes for the highest supported SIMD level up to `widest`.
    fn simd_ops(widest: SimdLevel) -> SimdOps<Self>;
}

/// The SIMD levels for which loops are compiled, from the narrowest on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SimdLevel {
    /// The instructions that every processor of the architecture has.
    Baseline,
    /// AVX2 of x86-64.
    Avx2,
    /// AVX-512 of x86-64.
    Avx512,
}

/// The loops over lanes, compiled for one SIMD level. Each takes at most five arguments, which are all
/// passed in registers: a call through such a pointer then costs a jump.
#[derive(Clone, Copy)]
pub struct SimdOps<L: LaneNumber> {
    /// For each opcode, the loop that runs the operation in every lane. Values go to the block, points to
    /// the block of points.
    pub(crate) operations: &'static [Operation<L>],
    /// Blends the second block into the first.
    pub(crate) blend: fn(BlendKernel, &mut L::Block, &L::Block, &[f32; 4], usize),
    /// Translates points by a constant.
    pub(crate) translate: fn(&L::PointBlock, &[f32; 4], &mut L::PointBlock, usize),
    /// Maps points by three rows.
    pub(crate) apply_affine: AffineMap<L>,
    /// Stores one number in every lane.
    pub(crate) fill: fn(f32, &mut L::Block, usize),
}

/// The inputs of an operation.
pub struct OpInputs<'a, L: LaneNumber> {
    /// The points of evaluation.
    pub(crate) point: &'a L::PointBlock,
    /// The operands; the operation reads as many as its arity.
    pub(crate) values: [&'a L::Block; 3],
    /// The pool from the operation's parameters on.
    pub(crate) constants: &'a [f32],
    /// Number of lanes to evaluate.
    pub(crate) count: usize,
}

/// The three rows of a matrix.
type Rows = [[f32; 4]; 3];

type AffineMap<L> =
    fn(&<L as LaneNumber>::PointBlock, &Rows, &mut <L as LaneNumber>::PointBlock, usize);

type Operation<L> =
    fn(&OpInputs<'_, L>, &mut <L as LaneNumber>::Block, &mut <L as LaneNumber>::PointBlock);
