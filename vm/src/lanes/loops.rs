//! The loops over lanes: each operation of the table, blends and maps of points, once per instruction set.

use super::{
    F32x64, LANES, LaneNumber, OpInputs, Operation, Points, Rows, SimdLevel, SimdOps, for_each_lane,
};
use crate::apply::{Apply, OpResult, ParameterReader, read_parameter};
use crate::blend::BlendKernel;
use crate::dual::{Dual, DualVec3};
use crate::ellipsoid;
use crate::evaluate;
use crate::interval::FloatInterval;
use crate::ops::{combine, dimension, distance, domain, math, shapes};
use crate::real::Vector3;
use crate::table::{Op, for_each_operation};
use crate::vector::V3;

/// Runs one operation in one lane after another: the fallback for processors without AVX2, for which no
/// loop is compiled per operation.
#[cfg(target_arch = "x86_64")]
fn apply_scalar<L: LaneNumber + Apply>(
    op: Op,
    reads: &OpInputs<'_, L>,
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
            OpResult::Value(value) => value.store(out, lane),
            OpResult::Point(point) => L::store_point(point, to, lane),
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
        ) -> $output:ident, $prepare:ident::$prepared:ident, $facts:expr;
    )+) => {
        /// The loop of each operation over all lanes; values go to `out`, points to `to`.
        #[allow(non_snake_case, reason = "functions are named as the operations are")]
        mod operations {
            use super::*;
            $(
                #[inline(always)]
                pub(super) fn $name<L: LaneNumber>(
                    reads: &OpInputs<'_, L>,
                    out: &mut L::Block,
                    to: &mut L::PointBlock,
                ) {
                    if L::apply_in_stages(Op::$name, reads, out) {
                        return;
                    }
                    #[allow(unused_variables, reason = "rows differ in what they read")]
                    let &OpInputs { point: q, values, constants, count } = reads;
                    #[allow(unused_mut, unused_variables, reason = "rows differ in what they read")]
                    let mut k = ParameterReader::new(constants);
                    $(let $parameter = read_parameter!(k, L, $ty);)*
                    for_each_lane!(count, lane => {
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
                        reads: &OpInputs<'_, $L>,
                        out: &mut <$L as LaneNumber>::Block,
                        to: &mut <$L as LaneNumber>::PointBlock,
                    ) {
                        operations::$name::<$L>(reads, out, to);
                    }
                    // SAFETY: the function is only returned after its features were detected.
                    |reads, out, to| unsafe { run(reads, out, to) }
                }),+]
            };
        }

        /// The baseline table (SSE2 on x86-64). It serves processors from before 2013: correct, but scalar.
        #[cfg(target_arch = "x86_64")]
        macro_rules! baseline_operations {
            ($L:ty) => {
                &[$(|reads, out, to| apply_scalar::<$L>(Op::$name, reads, out, to)),+]
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

/// Expands to the block for number types that have loops for AVX-512.
macro_rules! only_wide {
    (wide $block:block) => {
        $block
    };
    (narrow $block:block) => {};
}

/// The loops of a number type, once per instruction set. Interval gradients are evaluated seldom, so they
/// have no loops for AVX-512, which keeps this crate quick to compile. It is a macro: a generic
/// function's loops would be compiled again in each crate that uses it.
macro_rules! simd_ops {
    ($L:ty, $wide:ident, $widest:ident) => {{
        type B = <$L as LaneNumber>::Block;
        type P = <$L as LaneNumber>::PointBlock;
        const BASELINE: &[Operation<$L>] = baseline_operations!($L);
        macro_rules! level {
            ($features:literal) => {{
                const OPERATIONS: &[Operation<$L>] = operations_with!($L, $features);
                #[target_feature(enable = $features)]
                fn blend(kernel: BlendKernel, a: &mut B, b: &B, k: &[f32; 4], n: usize) {
                    crate::lanes::loops::blend::<$L>(kernel, a, b, k, n);
                }
                #[target_feature(enable = $features)]
                fn translate(p: &P, by: &[f32; 4], to: &mut P, n: usize) {
                    crate::lanes::loops::translate::<$L>(p, by, to, n);
                }
                #[target_feature(enable = $features)]
                fn apply_affine(p: &P, rows: &Rows, to: &mut P, n: usize) {
                    crate::lanes::loops::apply_affine::<$L>(p, rows, to, n);
                }
                #[target_feature(enable = $features)]
                fn fill(v: f32, to: &mut B, n: usize) {
                    crate::lanes::loops::fill::<$L>(v, to, n);
                }
                // SAFETY: these loops are only returned after their features were detected.
                SimdOps {
                    operations: OPERATIONS,
                    blend: |kernel, a, b, k, n| unsafe { blend(kernel, a, b, k, n) },
                    translate: |p, by, to, n| unsafe { translate(p, by, to, n) },
                    apply_affine: |p, rows, to, n| unsafe { apply_affine(p, rows, to, n) },
                    fill: |v, to, n| unsafe { fill(v, to, n) },
                }
            }};
        }
        #[cfg(target_arch = "x86_64")]
        {
            only_wide!($wide {
                if $widest >= SimdLevel::Avx512
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512bw")
                {
                    return level!("avx512f,avx512dq,avx512vl,avx512bw");
                }
            });
            if $widest >= SimdLevel::Avx2 && is_x86_feature_detected!("avx2") {
                return level!("avx2");
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        let _ = $widest;
        SimdOps {
            operations: BASELINE,
            blend: crate::lanes::loops::blend::<$L>,
            translate: crate::lanes::loops::translate::<$L>,
            apply_affine: crate::lanes::loops::apply_affine::<$L>,
            fill: crate::lanes::loops::fill::<$L>,
        }
    }};
}

/// Defines the loops of a number type in a module of its own. The compiler divides its work by modules: in one,
/// these loops would keep a single core busy for minutes.
macro_rules! simd_ops_module {
    ($module:ident, $L:ty, $wide:ident) => {
        mod $module {
            use super::*;

            pub(super) fn simd_ops(widest: SimdLevel) -> SimdOps<$L> {
                simd_ops!($L, $wide, widest)
            }
        }
    };
}
simd_ops_module!(floats, f32, wide);
simd_ops_module!(duals, Dual<f32>, wide);
simd_ops_module!(intervals, FloatInterval, wide);
simd_ops_module!(interval_duals, Dual<FloatInterval>, narrow);

impl LaneNumber for f32 {
    type Block = F32x64;
    type PointBlock = Points;
    #[inline(always)]
    fn load(block: &F32x64, lane: usize) -> Self {
        block.0[lane]
    }
    #[inline(always)]
    fn store(self, block: &mut F32x64, lane: usize) {
        block.0[lane] = self;
    }
    #[inline(always)]
    fn load_point(block: &Points, lane: usize) -> V3<f32> {
        V3::new(block[0].0[lane], block[1].0[lane], block[2].0[lane])
    }
    #[inline(always)]
    fn store_point(point: V3<f32>, block: &mut Points, lane: usize) {
        block[0].0[lane] = point.x;
        block[1].0[lane] = point.y;
        block[2].0[lane] = point.z;
    }
    #[inline(always)]
    fn apply_in_stages(op: Op, reads: &OpInputs<'_, f32>, out: &mut F32x64) -> bool {
        if op == Op::Ellipsoid {
            let r = ParameterReader::new(reads.constants).vec3::<f32>();
            ellipsoid::lanes::in_lanes(reads.point, r, reads.count, out);
        }
        op == Op::Ellipsoid
    }
    fn simd_ops(widest: SimdLevel) -> SimdOps<Self> {
        floats::simd_ops(widest)
    }
}

/// Gradient in the first three columns, value in the last.
impl LaneNumber for Dual<f32> {
    type Block = [F32x64; 4];
    type PointBlock = [F32x64; 12];
    #[inline(always)]
    fn load(block: &[F32x64; 4], lane: usize) -> Self {
        let component = |i: usize| block[i].0[lane];
        Self {
            value: component(3),
            gradient: V3::new(component(0), component(1), component(2)),
        }
    }
    #[inline(always)]
    fn store(self, block: &mut [F32x64; 4], lane: usize) {
        block[0].0[lane] = self.gradient.x;
        block[1].0[lane] = self.gradient.y;
        block[2].0[lane] = self.gradient.z;
        block[3].0[lane] = self.value;
    }
    #[inline(always)]
    fn load_point(block: &[F32x64; 12], lane: usize) -> DualVec3<f32> {
        let component =
            |i: usize| V3::new(block[i].0[lane], block[i + 1].0[lane], block[i + 2].0[lane]);
        DualVec3 {
            value: component(0),
            gradients: [component(3), component(6), component(9)],
        }
    }
    #[inline(always)]
    fn store_point(point: DualVec3<f32>, block: &mut [F32x64; 12], lane: usize) {
        let [dx, dy, dz] = point.gradients;
        for (i, v) in [point.value, dx, dy, dz].into_iter().enumerate() {
            block[3 * i].0[lane] = v.x;
            block[3 * i + 1].0[lane] = v.y;
            block[3 * i + 2].0[lane] = v.z;
        }
    }
    #[inline(always)]
    fn apply_in_stages(op: Op, reads: &OpInputs<'_, Self>, out: &mut Self::Block) -> bool {
        if op == Op::Ellipsoid {
            let r = ParameterReader::new(reads.constants).vec3::<f32>();
            ellipsoid::lanes::gradients_in_lanes(reads.point, r, reads.count, out);
        }
        op == Op::Ellipsoid
    }
    fn simd_ops(widest: SimdLevel) -> SimdOps<Self> {
        duals::simd_ops(widest)
    }
}

/// Columns of the lower ends, then of the upper ones.
impl LaneNumber for FloatInterval {
    type Block = [F32x64; 2];
    type PointBlock = [F32x64; 6];
    #[inline(always)]
    fn load(block: &[F32x64; 2], lane: usize) -> Self {
        Self {
            lo: block[0].0[lane],
            hi: block[1].0[lane],
        }
    }
    #[inline(always)]
    fn store(self, block: &mut [F32x64; 2], lane: usize) {
        block[0].0[lane] = self.lo;
        block[1].0[lane] = self.hi;
    }
    #[inline(always)]
    fn load_point(block: &[F32x64; 6], lane: usize) -> V3<Self> {
        let axis = |i: usize| Self {
            lo: block[i].0[lane],
            hi: block[i + 3].0[lane],
        };
        V3::new(axis(0), axis(1), axis(2))
    }
    #[inline(always)]
    fn store_point(point: V3<Self>, block: &mut [F32x64; 6], lane: usize) {
        for (i, axis) in [point.x, point.y, point.z].into_iter().enumerate() {
            block[i].0[lane] = axis.lo;
            block[i + 3].0[lane] = axis.hi;
        }
    }
    #[inline(always)]
    fn apply_in_stages(op: Op, reads: &OpInputs<'_, Self>, out: &mut Self::Block) -> bool {
        if op == Op::Ellipsoid {
            let r = ParameterReader::new(reads.constants).vec3::<Self>();
            ellipsoid::lanes::bounds_in_lanes(reads.point, r, reads.count, out);
        }
        op == Op::Ellipsoid
    }
    fn simd_ops(widest: SimdLevel) -> SimdOps<Self> {
        intervals::simd_ops(widest)
    }
}

/// The gradient's three intervals, then the value's.
impl LaneNumber for Dual<FloatInterval> {
    type Block = [[F32x64; 2]; 4];
    type PointBlock = [[F32x64; 6]; 4];
    #[inline(always)]
    fn load(block: &[[F32x64; 2]; 4], lane: usize) -> Self {
        let component = |i: usize| FloatInterval::load(&block[i], lane);
        Self {
            value: component(3),
            gradient: V3::new(component(0), component(1), component(2)),
        }
    }
    #[inline(always)]
    fn store(self, block: &mut [[F32x64; 2]; 4], lane: usize) {
        self.gradient.x.store(&mut block[0], lane);
        self.gradient.y.store(&mut block[1], lane);
        self.gradient.z.store(&mut block[2], lane);
        self.value.store(&mut block[3], lane);
    }
    #[inline(always)]
    fn load_point(block: &[[F32x64; 6]; 4], lane: usize) -> DualVec3<FloatInterval> {
        let component = |i: usize| FloatInterval::load_point(&block[i], lane);
        DualVec3 {
            value: component(0),
            gradients: [component(1), component(2), component(3)],
        }
    }
    #[inline(always)]
    fn store_point(point: DualVec3<FloatInterval>, block: &mut [[F32x64; 6]; 4], lane: usize) {
        FloatInterval::store_point(point.value, &mut block[0], lane);
        for (gradient, block) in point.gradients.into_iter().zip(&mut block[1..]) {
            FloatInterval::store_point(gradient, block, lane);
        }
    }
    fn simd_ops(widest: SimdLevel) -> SimdOps<Self> {
        interval_duals::simd_ops(widest)
    }
}

/// Packs one flag per lane into bits.
#[inline(always)]
pub fn bits(flags: &[bool; LANES]) -> u64 {
    let mut bits = 0;
    for (index, eight) in flags.as_chunks::<8>().0.iter().enumerate() {
        let bytes = u64::from_le_bytes(eight.map(u8::from));
        // Gathers the lowest bit of each byte in the highest byte.
        bits |= (bytes.wrapping_mul(0x0102_0408_1020_4080) >> 56) << (8 * index);
    }
    bits
}

/// Returns points in the world with their Jacobian, which is the identity.
pub fn with_identity_jacobian(points: &Points) -> [F32x64; 12] {
    let mut block = [F32x64::default(); 12];
    block[..3].copy_from_slice(points);
    for axis in 0..3 {
        block[3 + 4 * axis] = F32x64([1.0; LANES]);
    }
    block
}

/// Returns boxes with the Jacobian of the identity, as inputs of interval gradients.
pub fn with_identity_jacobian_of_boxes(boxes: &[F32x64; 6]) -> [[F32x64; 6]; 4] {
    let mut inputs = <[[F32x64; 6]; 4]>::default();
    inputs[0] = *boxes;
    for axis in 0..3 {
        inputs[axis + 1][axis] = F32x64([1.0; LANES]);
        inputs[axis + 1][axis + 3] = F32x64([1.0; LANES]);
    }
    inputs
}

/// Converts a constant of the program.
#[inline(always)]
fn constant<L: LaneNumber>(v: f32) -> L {
    L::constant(v.into())
}

/// Translates points by a constant.
#[inline(always)]
fn translate<L: LaneNumber>(
    p: &L::PointBlock,
    by: &[f32; 4],
    to: &mut L::PointBlock,
    count: usize,
) {
    let [x, y, z, _] = by.map(constant::<L>);
    for_each_lane!(count, lane => {
        L::store_point(L::load_point(p, lane) + L::Vec3::new(x, y, z), to, lane);
    });
}

/// Maps points by three rows.
#[inline(always)]
fn apply_affine<L: LaneNumber>(
    p: &L::PointBlock,
    rows: &Rows,
    to: &mut L::PointBlock,
    count: usize,
) {
    let rows = rows.map(|row| row.map(constant::<L>));
    for_each_lane!(count, lane => {
        L::store_point(
            evaluate::apply_affine::<L>(rows, L::load_point(p, lane)),
            to,
            lane,
        );
    });
}

/// Stores one number in every lane.
#[inline(always)]
fn fill<L: LaneNumber>(v: f32, to: &mut L::Block, count: usize) {
    let v = constant::<L>(v);
    for_each_lane!(count, lane => {
        v.store(to, lane);
    });
}

/// Computes `a = blend(a, b)` in every lane.
#[inline(always)]
fn blend<L: LaneNumber>(
    kernel: BlendKernel,
    a: &mut L::Block,
    b: &L::Block,
    constants: &[f32; 4],
    count: usize,
) {
    let [s, sb, width, coefficient] = constants.map(constant::<L>);
    macro_rules! each {
        ($kernel:expr) => {
            {
                for_each_lane!(count, lane => {
                    let (x, y) = (L::load(a, lane), L::load(b, lane));
                    $kernel
                        .blend(x, y, s, sb, width, coefficient)
                        .store(a, lane);
                });
            }
        };
    }
    match kernel {
        BlendKernel::Hard => each!(BlendKernel::Hard),
        BlendKernel::Quadratic => each!(BlendKernel::Quadratic),
        BlendKernel::Cubic => each!(BlendKernel::Cubic),
        BlendKernel::Circular => each!(BlendKernel::Circular),
        BlendKernel::Exponential => each!(BlendKernel::Exponential),
    }
}
