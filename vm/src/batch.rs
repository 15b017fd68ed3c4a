//! Running a program on 64 points at once: the CPU's way to pictures.
//!
//! Every value of the machine is a block of 64 lanes in plain arrays, and every operation is a loop
//! over them, which the compiler turns into the widest SIMD that the machine has: the loop exists
//! once per instruction set and the choice is made at run time. Measured on 50 primitives: ten
//! times a scalar interpreter, twice a just-in-time compiler (see `ARCHITECTURE.md`).
//!
//! On [`Dual`] lanes the same machine gives gradients; with materials attached it gives surfaces
//! ([`crate::surface`]).

use crate::apply::{Parameters, read_parameter};
use crate::dual::{Dual, DualVec3};
use crate::evaluate::{constants, mapped};
use crate::kernel::Kernel;
use crate::ops::{combine, dimension, distance, domain, math, shapes, shapes2};
use crate::program::{Code, Frame, Needs, Operands, Place, Program};
use crate::real::{Real, Vector3};
use crate::surface::{Attachment, Plain};
use crate::table::{Op, for_each_operation};
use crate::vector::V3;

/// How many points run at once.
pub const LANES: usize = 64;

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
    type Block: Clone + Default;
    /// 64 points.
    type PointBlock: Clone + Default;
    /// The number in a lane.
    fn load(block: &Self::Block, lane: usize) -> Self;
    /// Sets the number in a lane.
    fn store(self, block: &mut Self::Block, lane: usize);
    /// The point in a lane.
    fn load_point(block: &Self::PointBlock, lane: usize) -> Self::Vec3;
    /// Sets the point in a lane.
    fn store_point(point: Self::Vec3, block: &mut Self::PointBlock, lane: usize);
    /// World points.
    fn seed(points: &Points) -> Self::PointBlock;
    /// The number without its gradient.
    fn value(self) -> f32;
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
    fn seed(points: &Points) -> Points {
        *points
    }
    #[inline(always)]
    fn value(self) -> f32 {
        self
    }
}

/// Gradient in the first three columns, value in the last.
impl Lane for Dual<f32> {
    type Block = [Column; 4];
    type PointBlock = [Column; 12];
    #[inline(always)]
    fn load(block: &[Column; 4], lane: usize) -> Self {
        let at = |i: usize| block[i].0[lane];
        Self { value: at(3), gradient: V3::of(at(0), at(1), at(2)) }
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
        DualVec3 { value: at(0), gradients: [at(3), at(6), at(9)] }
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
    fn seed(points: &Points) -> [Column; 12] {
        let mut block = [Column::default(); 12];
        block[..3].copy_from_slice(points);
        for axis in 0..3 {
            block[3 + 4 * axis] = Column([1.0; LANES]);
        }
        block
    }
    #[inline(always)]
    fn value(self) -> f32 {
        self.value
    }
}

/// The memory that a run needs, made once and used for any number of runs.
pub struct Machine<L: Lane, A: Attachment<L> = Plain> {
    /// The value on top, which [`run`](Self::run) leaves the result in.
    top: Box<L::Block>,
    result: Box<L::Block>,
    constant: Box<L::Block>,
    stack: Vec<Box<L::Block>>,
    slots: Vec<Box<L::Block>>,
    points: Vec<L::PointBlock>,
    current: L::PointBlock,
    framed: L::PointBlock,
    target: L::PointBlock,
    attachment: A,
}

impl<L: Lane, A: Attachment<L>> Machine<L, A> {
    /// A machine for programs that need no more than `needs`.
    pub fn new(needs: &Needs) -> Self {
        Self {
            top: Box::default(),
            result: Box::default(),
            constant: Box::default(),
            // One more than the depth: the first push saves a top that means nothing.
            stack: vec![Box::default(); needs.depth + 1],
            slots: vec![Box::default(); needs.slots],
            points: vec![L::PointBlock::default(); needs.points],
            current: L::PointBlock::default(),
            framed: L::PointBlock::default(),
            target: L::PointBlock::default(),
            attachment: A::new(needs),
        }
    }

    /// What is attached to the values.
    pub fn attachment(&mut self) -> &mut A {
        &mut self.attachment
    }

    /// Runs a verified program, whose needs the machine covers, on 64 points.
    pub fn run(&mut self, program: &Program, points: &Points) -> &L::Block {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512bw")
            {
                // SAFETY: the features were just detected.
                unsafe { run_avx512(self, program, points) };
                return &self.top;
            }
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the feature was just detected.
                unsafe { run_avx2(self, program, points) };
                return &self.top;
            }
        }
        run(self, program, points);
        &self.top
    }
}

// `unsafe` is what calling a function with other target features than its caller costs; the
// measurement that asks for it is in this file's head.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx512bw")]
fn run_avx512<L: Lane, A: Attachment<L>>(m: &mut Machine<L, A>, program: &Program, points: &Points) {
    run(m, program, points);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2<L: Lane, A: Attachment<L>>(m: &mut Machine<L, A>, program: &Program, points: &Points) {
    run(m, program, points);
}

#[inline(always)]
fn run<L: Lane, A: Attachment<L>>(m: &mut Machine<L, A>, program: &Program, points: &Points) {
    m.current = L::seed(points);
    let (mut depth, mut kept) = (0_usize, 0_usize);
    for i in &program.code {
        if i.pops > 0 {
            kept -= usize::from(i.pops);
            m.current.clone_from(&m.points[kept]);
        }
        if i.push {
            m.points[kept].clone_from(&m.current);
            kept += 1;
        }
        let q = match i.frame {
            Frame::Same => &m.current,
            Frame::Moved(index) => {
                let [x, y, z, _] = program.pool[index as usize].map(constant::<L>);
                for lane in 0..LANES {
                    let p = L::load_point(&m.current, lane) + L::Vec3::new(x, y, z);
                    L::store_point(p, &mut m.framed, lane);
                }
                &m.framed
            }
            Frame::Mapped(index) => {
                let row = |row: u32| program.pool[(index + row) as usize].map(constant::<L>);
                let rows = [row(0), row(1), row(2)];
                for lane in 0..LANES {
                    let p = mapped::<L>(rows, L::load_point(&m.current, lane));
                    L::store_point(p, &mut m.framed, lane);
                }
                &m.framed
            }
        };
        let taken = i.taken();
        match i.code {
            Code::Op(op) => {
                let constants = constants(program, i);
                let under = |n: usize| &*m.stack[depth.saturating_sub(n)];
                let [a, b, c] = match i.operands {
                    Operands::Stack => match taken {
                        0 | 1 => [&*m.top, &*m.top, &*m.top],
                        2 => [under(1), &*m.top, &*m.top],
                        _ => [under(2), under(1), &*m.top],
                    },
                    Operands::Right(index) | Operands::Left(index) => {
                        let value = constant::<L>(program.pool[index as usize][0]);
                        for lane in 0..LANES {
                            value.store(&mut m.constant, lane);
                        }
                        match i.operands {
                            Operands::Left(_) => [&*m.constant, &*m.top, &*m.top],
                            _ => [&*m.top, &*m.constant, &*m.constant],
                        }
                    }
                };
                operate::<L>(op, q, [a, b, c], constants, &mut m.result, &mut m.target);
                if i.code.gives_point() {
                    std::mem::swap(&mut m.current, &mut m.target);
                    // Its operands are gone: the value below them is on top again.
                    if taken > 0 {
                        depth -= taken;
                        std::mem::swap(&mut m.top, &mut m.stack[depth]);
                        m.attachment.restore(depth);
                    }
                    continue;
                }
                m.attachment.operate(op, [a, b], depth, taken, constants);
            }
            Code::Load => {
                m.result.clone_from(&m.slots[usize::from(i.slot)]);
                m.attachment.load(i.slot);
            }
            Code::Store => {
                m.slots[usize::from(i.slot)].clone_from(&m.top);
                m.result.clone_from(&m.top);
                m.attachment.store(i.slot);
            }
            Code::Take => {
                m.result.clone_from(&m.top);
                m.attachment.keep();
            }
            Code::Normal => m.attachment.normal(q, i.slot, &mut m.result),
            Code::Channel => {
                m.attachment.channel(i.slot, &m.top);
                depth -= 1;
                std::mem::swap(&mut m.top, &mut m.stack[depth]);
                m.attachment.restore(depth);
                continue;
            }
            Code::Paint => {
                m.result.clone_from(&m.top);
                let start = i.parameters as usize;
                m.attachment.paint(&program.pool[start..start + 3], i.slot);
            }
        }
        match i.place {
            Place::Push => {
                if taken == 0 {
                    std::mem::swap(&mut m.stack[depth], &mut m.top);
                    m.attachment.save(depth);
                    depth += 1;
                } else {
                    depth -= taken - 1;
                }
                std::mem::swap(&mut m.top, &mut m.result);
                m.attachment.take_result();
            }
            Place::Blend { kernel, index } => {
                let [s, sb, width, coefficient] = program.pool[index as usize].map(constant::<L>);
                depth -= taken;
                let below = if taken == 0 { &*m.top } else { &*m.stack[depth] };
                m.attachment.blend(
                    kernel,
                    program.pool[index as usize],
                    (taken > 0).then_some(depth),
                    below,
                    &m.result,
                );
                if taken > 0 {
                    std::mem::swap(&mut m.top, &mut m.stack[depth]);
                }
                blend::<L>(kernel, &mut m.top, &m.result, [s, sb, width, coefficient]);
            }
        }
    }
}

/// A constant of the program.
#[inline(always)]
fn constant<L: Lane>(v: f32) -> L {
    L::constant(v.into())
}

/// `a = blend(a, b)` in every lane.
#[inline(always)]
fn blend<L: Lane>(
    kernel: Kernel,
    a: &mut L::Block,
    b: &L::Block,
    [s, sb, width, coefficient]: [L; 4],
) {
    macro_rules! each {
        ($kernel:expr) => {
            for lane in 0..LANES {
                let (x, y) = (L::load(a, lane), L::load(b, lane));
                $kernel.blend(x, y, s, sb, width, coefficient).store(a, lane);
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
    ($L:ty, $result:expr, $out:ident, $to:ident, $lane:ident, Value) => {
        $result.store($out, $lane)
    };
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
        /// Runs one operation in every lane; values go to `out`, points to `to`.
        #[inline(always)]
        fn operate<L: Lane>(
            op: Op,
            q: &L::PointBlock,
            operands: [&L::Block; 3],
            constants: &[f32],
            out: &mut L::Block,
            to: &mut L::PointBlock,
        ) {
            match op {
                $(Op::$name => {
                    #[allow(unused_mut, unused_variables, reason = "rows differ in what they read")]
                    let mut k = Parameters::new(constants);
                    $(let $parameter = read_parameter!(k, L, $ty);)*
                    for lane in 0..LANES {
                        #[allow(unused_mut, unused_variables, reason = "rows differ in what they read")]
                        let mut v = operands;
                        #[allow(unused_assignments, reason = "the last operand leaves the rest unread")]
                        let result = $module::$body::<L>(
                            $(lane_input!(L, q, v, lane, $kind),)*
                            $($parameter),*
                        );
                        store_output!(L, result, out, to, lane, $output);
                    }
                })+
            }
        }
    };
}
for_each_operation!(define_lanes);
