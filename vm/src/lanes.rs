//! Lanes: 64 numbers at once, and the loops over them.
//!
//! A block of 64 lanes is plain arrays. A loop over it whose body has no branches is turned by the
//! compiler into the widest SIMD that it may use, so every loop exists once per instruction set,
//! and the choice is made at run time. Measured with 50 primitives: ten times a scalar interpreter,
//! twice a just-in-time compiler (see `ARCHITECTURE.md`).

use crate::apply::{Applied, Apply, Parameters, read_parameter};
use crate::dual::{Dual, DualVec3};
use crate::ellipsoid;
use crate::evaluate;
use crate::interval::FloatInterval;
use crate::kernel::Kernel;
use crate::ops::{combine, dimension, distance, domain, math, shapes, shapes2};
use crate::real::{Real, Vector3};
use crate::table::{Op, for_each_operation};
use crate::vector::V3;

/// How many points run at once.
pub const LANES: usize = 64;

/// Loops run over whole chunks of this many lanes, so that few points cost less than many.
pub const CHUNK: usize = 16;

/// Runs the body for each lane of the chunks that hold `count` lanes. The compiler sees that the
/// number of lanes is a multiple of a chunk and no more than there are, so the loop becomes vectors
/// without a remainder or a bounds check.
macro_rules! each_lane {
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

pub(crate) use each_lane;

/// One number for each lane.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct Column(pub [f32; LANES]);

impl Default for Column {
    fn default() -> Self {
        Self([0.0; LANES])
    }
}

/// A point for each lane.
pub type Points = [Column; 3];

/// A number type that runs in lanes: how 64 of it are kept.
pub trait Lane: Real {
    /// 64 numbers.
    type Block: Clone + Default + Send;
    /// 64 points.
    type PointBlock: Clone + Default + Send;
    /// The number in a lane.
    fn load(block: &Self::Block, lane: usize) -> Self;
    /// Sets the number in a lane.
    fn store(self, block: &mut Self::Block, lane: usize);
    /// The point in a lane.
    fn load_point(block: &Self::PointBlock, lane: usize) -> Self::Vec3;
    /// Sets the point in a lane.
    fn store_point(point: Self::Vec3, block: &mut Self::PointBlock, lane: usize);
    /// Runs an operation in stages over all lanes, where that is faster than one lane after the other; reports
    /// whether it did.
    #[inline(always)]
    fn in_stages(op: Op, reads: &Reads<'_, Self>, out: &mut Self::Block) -> bool {
        let _ = (op, reads, out);
        false
    }
    /// The loops over lanes, for the widest SIMD of this machine that is allowed.
    fn loops(widest: Instructions) -> Loops<Self>;
}

/// The instruction sets for which loops exist, from the narrowest on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Instructions {
    /// What every processor of its kind has.
    Baseline,
    /// AVX2 of x86-64.
    Avx2,
    /// AVX-512 of x86-64.
    Avx512,
}

/// The loops over lanes, compiled for one instruction set. Each takes so few arguments that all are
/// passed in registers: a call through such a pointer then costs a jump.
#[derive(Clone, Copy)]
pub struct Loops<L: Lane> {
    /// For each opcode, what runs the operation in every lane; values go to the block, points to the
    /// block of points.
    pub(crate) operations: &'static [Operation<L>],
    /// The first block becomes its blend with the second.
    pub(crate) blend: fn(Kernel, &mut L::Block, &L::Block, &[f32; 4], usize),
    /// Points moved by a constant.
    pub(crate) moved: fn(&L::PointBlock, &[f32; 4], &mut L::PointBlock, usize),
    /// Points mapped by three rows.
    pub(crate) mapped: Map<L>,
    /// The same number in every lane.
    pub(crate) fill: fn(f32, &mut L::Block, usize),
}

/// What an operation reads.
pub struct Reads<'a, L: Lane> {
    /// Where it looks at.
    pub(crate) point: &'a L::PointBlock,
    /// As many of them as it has operands.
    pub(crate) values: [&'a L::Block; 3],
    /// Its parameters, and what follows them.
    pub(crate) constants: &'a [f32],
    /// How many lanes matter.
    pub(crate) count: usize,
}

/// The three rows of a matrix.
type Rows = [[f32; 4]; 3];

type Map<L> = fn(&<L as Lane>::PointBlock, &Rows, &mut <L as Lane>::PointBlock, usize);

type Operation<L> = fn(&Reads<'_, L>, &mut <L as Lane>::Block, &mut <L as Lane>::PointBlock);

/// Runs one operation in one lane after the other: the form for processors without any SIMD that is
/// worth a compiled loop for each operation.
#[cfg(target_arch = "x86_64")]
fn operate_singly<L: Lane + Apply>(
    op: Op,
    reads: &Reads<'_, L>,
    out: &mut L::Block,
    to: &mut L::PointBlock,
) {
    for lane in 0..reads.count.min(LANES) {
        let values = reads.values.map(|block| L::load(block, lane));
        match L::apply(
            op,
            L::load_point(reads.point, lane),
            values,
            reads.constants,
        ) {
            Applied::Value(value) => value.store(out, lane),
            Applied::Point(point) => L::store_point(point, to, lane),
        }
    }
}

macro_rules! lane_input {
    ($R:ty, $q:ident, $v:ident, $lane:ident, Point) => {
        <$R>::load_point($q, $lane)
    };
    ($R:ty, $q:ident, $v:ident, $lane:ident, Plane) => {
        <$R>::load_point($q, $lane).xy()
    };
    ($R:ty, $q:ident, $v:ident, $lane:ident, Value) => {{
        let [first, rest @ ..] = $v;
        $v = [rest[0], rest[1], first];
        <$R>::load(first, $lane)
    }};
}

macro_rules! store_output {
    ($L:ty, $result:expr, $out:ident, $to:ident, $lane:ident, Value) => {{
        let _ = &$to;
        $result.store($out, $lane)
    }};
    ($L:ty, $result:expr, $out:ident, $to:ident, $lane:ident, Point) => {{
        let _ = &$out;
        <$L>::store_point($result, $to, $lane)
    }};
}

macro_rules! define_lanes {
    ($(
        $(#[doc = $doc:literal])+
        $name:ident $text:literal = $module:ident::$body:ident(
            $($input:ident: $kind:ident),* ; $($parameter:ident: $ty:ident),*
        ) -> $output:ident, $prepare:ident::$prepared:ident, $meta:expr;
    )+) => {
        /// Each operation, run in every lane; values go to `out`, points to `to`.
        #[allow(non_snake_case, reason = "functions are named as the operations are")]
        mod operations {
            use super::*;
            $(
                #[inline(always)]
                pub(super) fn $name<L: Lane>(
                    reads: &Reads<'_, L>,
                    out: &mut L::Block,
                    to: &mut L::PointBlock,
                ) {
                    if L::in_stages(Op::$name, reads, out) {
                        return;
                    }
                    #[allow(unused_variables, reason = "rows differ in what they read")]
                    let &Reads { point: q, values, constants, count } = reads;
                    #[allow(unused_mut, unused_variables, reason = "rows differ in what they read")]
                    let mut k = Parameters::new(constants);
                    $(let $parameter = read_parameter!(k, L, $ty);)*
                    each_lane!(count, lane => {
                        #[allow(unused_mut, unused_variables, reason = "rows differ in what they read")]
                        let mut v = values;
                        #[allow(unused_assignments, reason = "the last operand leaves the rest unread")]
                        let result = $module::$body::<L>(
                            $(lane_input!(L, q, v, lane, $kind),)*
                            $($parameter),*
                        );
                        store_output!(L, result, out, to, lane, $output);
                    });
                }
            )+
        }

        /// All operations in the order of their opcodes, compiled for an instruction set.
        #[cfg(target_arch = "x86_64")]
        macro_rules! operations_with {
            ($L:ty, $features:literal) => {
                &[$({
                    #[target_feature(enable = $features)]
                    fn run(
                        reads: &Reads<'_, $L>,
                        out: &mut <$L as Lane>::Block,
                        to: &mut <$L as Lane>::PointBlock,
                    ) {
                        operations::$name::<$L>(reads, out, to);
                    }
                    // SAFETY: it is only handed out after its features were detected.
                    |reads, out, to| unsafe { run(reads, out, to) }
                }),+]
            };
        }

        /// The same with no more than all processors of a kind have. Those of before 2013: correct, and
        /// one lane after the other.
        #[cfg(target_arch = "x86_64")]
        macro_rules! baseline_operations {
            ($L:ty) => {
                &[$(|reads, out, to| operate_singly::<$L>(Op::$name, reads, out, to)),+]
            };
        }
        #[cfg(not(target_arch = "x86_64"))]
        macro_rules! baseline_operations {
            ($L:ty) => {
                &[$(operations::$name::<$L>),+]
            };
        }
    };
}
for_each_operation!(define_lanes);

/// The block, for number types that want the widest instruction set.
macro_rules! only_wide {
    (wide $block:block) => {
        $block
    };
    (narrow $block:block) => {};
}

/// The loops of a number type, once per instruction set. Intervals of gradients are asked for seldom and do
/// without the widest one, which keeps this crate quick to compile. It is a macro and not a generic function
/// so that they are compiled in this crate and not again in each that uses it.
macro_rules! loops {
    ($L:ty, $wide:ident, $widest:ident) => {{
        type B = <$L as Lane>::Block;
        type P = <$L as Lane>::PointBlock;
        const BASELINE: &[Operation<$L>] = baseline_operations!($L);
        macro_rules! level {
            ($features:literal) => {{
                const OPERATIONS: &[Operation<$L>] = operations_with!($L, $features);
                #[target_feature(enable = $features)]
                fn blend(kernel: Kernel, a: &mut B, b: &B, k: &[f32; 4], n: usize) {
                    crate::lanes::blend::<$L>(kernel, a, b, k, n);
                }
                #[target_feature(enable = $features)]
                fn moved(p: &P, by: &[f32; 4], to: &mut P, n: usize) {
                    crate::lanes::moved::<$L>(p, by, to, n);
                }
                #[target_feature(enable = $features)]
                fn mapped(p: &P, rows: &Rows, to: &mut P, n: usize) {
                    crate::lanes::mapped::<$L>(p, rows, to, n);
                }
                #[target_feature(enable = $features)]
                fn fill(v: f32, to: &mut B, n: usize) {
                    crate::lanes::fill::<$L>(v, to, n);
                }
                // SAFETY: these loops are only handed out after their features were detected.
                Loops {
                    operations: OPERATIONS,
                    blend: |kernel, a, b, k, n| unsafe { blend(kernel, a, b, k, n) },
                    moved: |p, by, to, n| unsafe { moved(p, by, to, n) },
                    mapped: |p, rows, to, n| unsafe { mapped(p, rows, to, n) },
                    fill: |v, to, n| unsafe { fill(v, to, n) },
                }
            }};
        }
        #[cfg(target_arch = "x86_64")]
        {
            only_wide!($wide {
                if $widest >= Instructions::Avx512
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512bw")
                {
                    return level!("avx512f,avx512dq,avx512vl,avx512bw");
                }
            });
            if $widest >= Instructions::Avx2 && is_x86_feature_detected!("avx2") {
                return level!("avx2");
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        let _ = $widest;
        Loops {
            operations: BASELINE,
            blend: crate::lanes::blend::<$L>,
            moved: crate::lanes::moved::<$L>,
            mapped: crate::lanes::mapped::<$L>,
            fill: crate::lanes::fill::<$L>,
        }
    }};
}

impl Lane for f32 {
    type Block = Column;
    type PointBlock = Points;
    #[inline(always)]
    fn load(block: &Column, lane: usize) -> Self {
        block.0[lane]
    }
    #[inline(always)]
    fn store(self, block: &mut Column, lane: usize) {
        block.0[lane] = self;
    }
    #[inline(always)]
    fn load_point(block: &Points, lane: usize) -> V3<f32> {
        V3::of(block[0].0[lane], block[1].0[lane], block[2].0[lane])
    }
    #[inline(always)]
    fn store_point(point: V3<f32>, block: &mut Points, lane: usize) {
        block[0].0[lane] = point.x;
        block[1].0[lane] = point.y;
        block[2].0[lane] = point.z;
    }
    #[inline(always)]
    fn in_stages(op: Op, reads: &Reads<'_, f32>, out: &mut Column) -> bool {
        if op == Op::Ellipsoid {
            let r = Parameters::new(reads.constants).vec3::<f32>();
            ellipsoid::in_lanes(reads.point, r, reads.count, out);
        }
        op == Op::Ellipsoid
    }
    fn loops(widest: Instructions) -> Loops<Self> {
        loops!(f32, wide, widest)
    }
}

/// Gradient in the first three columns, value in the last.
impl Lane for Dual<f32> {
    type Block = [Column; 4];
    type PointBlock = [Column; 12];
    #[inline(always)]
    fn load(block: &[Column; 4], lane: usize) -> Self {
        let at = |i: usize| block[i].0[lane];
        Self {
            value: at(3),
            gradient: V3::of(at(0), at(1), at(2)),
        }
    }
    #[inline(always)]
    fn store(self, block: &mut [Column; 4], lane: usize) {
        block[0].0[lane] = self.gradient.x;
        block[1].0[lane] = self.gradient.y;
        block[2].0[lane] = self.gradient.z;
        block[3].0[lane] = self.value;
    }
    #[inline(always)]
    fn load_point(block: &[Column; 12], lane: usize) -> DualVec3<f32> {
        let at = |i: usize| V3::of(block[i].0[lane], block[i + 1].0[lane], block[i + 2].0[lane]);
        DualVec3 {
            value: at(0),
            gradients: [at(3), at(6), at(9)],
        }
    }
    #[inline(always)]
    fn store_point(point: DualVec3<f32>, block: &mut [Column; 12], lane: usize) {
        let [dx, dy, dz] = point.gradients;
        for (i, v) in [point.value, dx, dy, dz].into_iter().enumerate() {
            block[3 * i].0[lane] = v.x;
            block[3 * i + 1].0[lane] = v.y;
            block[3 * i + 2].0[lane] = v.z;
        }
    }
    #[inline(always)]
    fn in_stages(op: Op, reads: &Reads<'_, Self>, out: &mut Self::Block) -> bool {
        if op == Op::Ellipsoid {
            let r = Parameters::new(reads.constants).vec3::<f32>();
            ellipsoid::gradients_in_lanes(reads.point, r, reads.count, out);
        }
        op == Op::Ellipsoid
    }
    fn loops(widest: Instructions) -> Loops<Self> {
        loops!(Dual<f32>, wide, widest)
    }
}

/// Columns of the lower ends, then of the upper ones.
impl Lane for FloatInterval {
    type Block = [Column; 2];
    type PointBlock = [Column; 6];
    #[inline(always)]
    fn load(block: &[Column; 2], lane: usize) -> Self {
        Self {
            lo: block[0].0[lane],
            hi: block[1].0[lane],
        }
    }
    #[inline(always)]
    fn store(self, block: &mut [Column; 2], lane: usize) {
        block[0].0[lane] = self.lo;
        block[1].0[lane] = self.hi;
    }
    #[inline(always)]
    fn load_point(block: &[Column; 6], lane: usize) -> V3<Self> {
        let axis = |i: usize| Self {
            lo: block[i].0[lane],
            hi: block[i + 3].0[lane],
        };
        V3::of(axis(0), axis(1), axis(2))
    }
    #[inline(always)]
    fn store_point(point: V3<Self>, block: &mut [Column; 6], lane: usize) {
        for (i, axis) in [point.x, point.y, point.z].into_iter().enumerate() {
            block[i].0[lane] = axis.lo;
            block[i + 3].0[lane] = axis.hi;
        }
    }
    #[inline(always)]
    fn in_stages(op: Op, reads: &Reads<'_, Self>, out: &mut Self::Block) -> bool {
        if op == Op::Ellipsoid {
            let r = Parameters::new(reads.constants).vec3::<Self>();
            ellipsoid::bounds_in_lanes(reads.point, r, reads.count, out);
        }
        op == Op::Ellipsoid
    }
    fn loops(widest: Instructions) -> Loops<Self> {
        loops!(FloatInterval, wide, widest)
    }
}

/// The gradient's three intervals, then the value's.
impl Lane for Dual<FloatInterval> {
    type Block = [[Column; 2]; 4];
    type PointBlock = [[Column; 6]; 4];
    #[inline(always)]
    fn load(block: &[[Column; 2]; 4], lane: usize) -> Self {
        let at = |i: usize| FloatInterval::load(&block[i], lane);
        Self {
            value: at(3),
            gradient: V3::of(at(0), at(1), at(2)),
        }
    }
    #[inline(always)]
    fn store(self, block: &mut [[Column; 2]; 4], lane: usize) {
        self.gradient.x.store(&mut block[0], lane);
        self.gradient.y.store(&mut block[1], lane);
        self.gradient.z.store(&mut block[2], lane);
        self.value.store(&mut block[3], lane);
    }
    #[inline(always)]
    fn load_point(block: &[[Column; 6]; 4], lane: usize) -> DualVec3<FloatInterval> {
        let at = |i: usize| FloatInterval::load_point(&block[i], lane);
        DualVec3 {
            value: at(0),
            gradients: [at(1), at(2), at(3)],
        }
    }
    #[inline(always)]
    fn store_point(point: DualVec3<FloatInterval>, block: &mut [[Column; 6]; 4], lane: usize) {
        FloatInterval::store_point(point.value, &mut block[0], lane);
        for (gradient, block) in point.gradients.into_iter().zip(&mut block[1..]) {
            FloatInterval::store_point(gradient, block, lane);
        }
    }
    fn loops(widest: Instructions) -> Loops<Self> {
        loops!(Dual<FloatInterval>, narrow, widest)
    }
}

/// What is so in each lane, as bits.
#[inline(always)]
pub fn bits(flags: &[bool; LANES]) -> u64 {
    let mut bits = 0;
    for (at, eight) in flags.as_chunks::<8>().0.iter().enumerate() {
        let bytes = u64::from_le_bytes(eight.map(u8::from));
        // Gathers the lowest bit of each byte in the highest byte.
        bits |= (bytes.wrapping_mul(0x0102_0408_1020_4080) >> 56) << (8 * at);
    }
    bits
}

/// Points in the world as numbers with gradients: each coordinate's own is one.
pub fn seeded(points: &Points) -> [Column; 12] {
    let mut block = [Column::default(); 12];
    block[..3].copy_from_slice(points);
    for axis in 0..3 {
        block[3 + 4 * axis] = Column([1.0; LANES]);
    }
    block
}

/// A constant of the program.
#[inline(always)]
fn constant<L: Lane>(v: f32) -> L {
    L::constant(v.into())
}

/// Points moved by a constant.
#[inline(always)]
fn moved<L: Lane>(p: &L::PointBlock, by: &[f32; 4], to: &mut L::PointBlock, count: usize) {
    let [x, y, z, _] = by.map(constant::<L>);
    each_lane!(count, lane => {
        L::store_point(L::load_point(p, lane) + L::Vec3::new(x, y, z), to, lane);
    });
}

/// Points mapped by three rows.
#[inline(always)]
fn mapped<L: Lane>(p: &L::PointBlock, rows: &Rows, to: &mut L::PointBlock, count: usize) {
    let rows = rows.map(|row| row.map(constant::<L>));
    each_lane!(count, lane => {
        L::store_point(
            evaluate::mapped::<L>(rows, L::load_point(p, lane)),
            to,
            lane,
        );
    });
}

/// The same number in every lane.
#[inline(always)]
fn fill<L: Lane>(v: f32, to: &mut L::Block, count: usize) {
    let v = constant::<L>(v);
    each_lane!(count, lane => {
        v.store(to, lane);
    });
}

/// `a = blend(a, b)` in every lane.
#[inline(always)]
fn blend<L: Lane>(
    kernel: Kernel,
    a: &mut L::Block,
    b: &L::Block,
    constants: &[f32; 4],
    count: usize,
) {
    let [s, sb, width, coefficient] = constants.map(constant::<L>);
    macro_rules! each {
        ($kernel:expr) => {
            {
                each_lane!(count, lane => {
                    let (x, y) = (L::load(a, lane), L::load(b, lane));
                    $kernel
                        .blend(x, y, s, sb, width, coefficient)
                        .store(a, lane);
                });
            }
        };
    }
    match kernel {
        Kernel::Hard => each!(Kernel::Hard),
        Kernel::Quadratic => each!(Kernel::Quadratic),
        Kernel::Cubic => each!(Kernel::Cubic),
        Kernel::Circular => each!(Kernel::Circular),
        Kernel::Exponential => each!(Kernel::Exponential),
    }
}
