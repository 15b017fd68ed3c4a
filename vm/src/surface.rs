//! Surfaces: what a program of surfaces carries along with its distances.
//!
//! Every value of a tape has a material attached. A blend mixes the materials of its operands by
//! the blend's own derivatives: the weight of an operand is the share of the result's slope that
//! comes from it. So a hard union takes the nearer one's material, a smooth one goes over as the
//! shape does, and two equal materials stay equal.

use crate::apply::{Applied, apply};
use crate::dual::{Dual, DualVec3};
use crate::kernel::Kernel;
use crate::lanes::{Column, LANES, Lane, Points};
use crate::real::{Real, Vector3};
use crate::row::{Category, SetOperation};
use crate::table::Op;
use crate::tape::NONE;
use crate::tape::machine::Attachment;
use crate::vector::V3;
use crate::widest;

/// How many numbers a surface has: albedo, roughness, emission, metallic, the gradient of the
/// bump's height, and the number of its material.
pub const NUMBERS: usize = 12;
/// Where the gradient of the bump's height starts.
pub const BUMP: usize = 8;
/// Where the number of the material is.
pub const ID: usize = 11;

/// A surface in each lane.
pub type SurfaceBlock = [Column; NUMBERS];

/// What a register holds: many values have one surface in all lanes, which needs no mixing with its
/// like.
#[derive(Clone, Default)]
struct Held {
    /// The surface in all lanes, unless they differ.
    one: Option<[f32; NUMBERS]>,
    /// The surfaces where they differ. Blocks change places by their pointers.
    block: Box<SurfaceBlock>,
}

impl Held {
    /// The surfaces, lane by lane.
    fn lanes(&mut self) -> &mut SurfaceBlock {
        if let Some(numbers) = self.one.take() {
            *self.block = numbers.map(|number| Column([number; LANES]));
        }
        &mut self.block
    }

    fn become_like(&mut self, other: &Self) {
        self.one = other.one;
        if self.one.is_none() {
            self.block.clone_from(&other.block);
        }
    }

    /// Mixes with another by its shares.
    fn mix(&mut self, other: &mut Self, shares: &Column) {
        mix(self.lanes(), other.lanes(), shares);
    }
}

/// Materials attached to dual values.
#[derive(Default)]
pub struct Surfaces {
    normals: Points,
    ties: Column,
    /// What a shape has that nothing painted, set before a run.
    pub unpainted: [f32; NUMBERS],
    result: Held,
    blended: Held,
    registers: Vec<Held>,
    pending: Box<SurfaceBlock>,
}

impl Surfaces {
    /// Takes the points in the world, and the unit normals there, before a run.
    pub fn place(&mut self, points: &Points, normals: &Points) {
        self.normals.clone_from(normals);
        for (lane, tie) in self.ties.0.iter_mut().enumerate() {
            let largest = [0, 1, 2].map(|axis| points[axis].0[lane].abs());
            *tie = largest.into_iter().fold(0.0, f32::max) * TIE as f32;
        }
    }

    /// The scene's surface, after a run.
    pub fn surface(&mut self) -> &SurfaceBlock {
        self.registers[0].lanes()
    }
}

/// The most by which distances of faces in the same place differ, per unit of the point's largest coordinate.
pub const TIE: f64 = 6e-6;

/// The line of WGSL that tells how near distances are to each other that faces at a point have.
pub fn tie_line(point: &str) -> String {
    format!("let tie = max(max(abs({point}.x), abs({point}.y)), abs({point}.z)) * {TIE};")
}

/// The sign of what is taken from the first value, so that of two faces in the same place the first one shows:
/// 1 for unions, −1 for intersections and differences, 0 for all others.
pub fn precedence(op: Op) -> f64 {
    match op.row().meta.set {
        Some(SetOperation::Union) => 1.0,
        Some(SetOperation::Intersection | SetOperation::Subtraction) => -1.0,
        None => 0.0,
    }
}

/// Two values whose gradients tell them apart; the first one is less by what `tie`, a distance, is in the units
/// of the steeper one.
#[inline(always)]
fn seeds(a: [&Column; 4], b: [&Column; 4], lane: usize, tie: f32) -> [Dual<f32>; 2] {
    let slope = |axis: usize| a[axis].0[lane].abs().max(b[axis].0[lane].abs());
    let steepest = slope(0).max(slope(1)).max(slope(2));
    let (a, b) = (a[3].0[lane], b[3].0[lane]);
    [
        Dual {
            value: a - tie * steepest,
            gradient: V3::of(1.0, 0.0, 0.0),
        },
        Dual {
            value: b,
            gradient: V3::of(0.0, 1.0, 0.0),
        },
    ]
}

/// The second operand's share, from the derivatives with respect to both.
#[inline(always)]
pub fn share<R: Real>(by_first: R, by_second: R) -> R {
    let (a, b) = (by_first.abs(), by_second.abs());
    b / (a + b).max(R::constant(1e-20))
}

widest! {
    /// `a` and `b` mixed in every lane into `a`; the material's number is the larger share's.
    fn mix(a: &mut SurfaceBlock, b: &SurfaceBlock, shares: &Column) = mix_body;
}

#[inline(always)]
fn mix_body(a: &mut SurfaceBlock, b: &SurfaceBlock, shares: &Column) {
    for number in 0..ID {
        for lane in 0..LANES {
            let (x, y) = (a[number].0[lane], b[number].0[lane]);
            a[number].0[lane] = x.mix(y, shares.0[lane]);
        }
    }
    for lane in 0..LANES {
        let (x, y) = (a[ID].0[lane], b[ID].0[lane]);
        a[ID].0[lane] = if shares.0[lane] > 0.5 { y } else { x };
    }
}

widest! {
    /// The share of the second operand of a blend, in every lane.
    fn shares_of(
        kernel: Kernel, constants: [f32; 4], values: [[&Column; 4]; 2], ties: &Column,
        shares: &mut Column
    ) = shares_body;
}

#[inline(always)]
fn shares_body(
    kernel: Kernel,
    constants: [f32; 4],
    [a, b]: [[&Column; 4]; 2],
    ties: &Column,
    shares: &mut Column,
) {
    let sign = constants[0];
    let [s, sb, width, coefficient] = constants.map(Dual::fixed);
    macro_rules! each {
        ($kernel:expr) => {
            for lane in 0..LANES {
                let [x, y] = seeds(a, b, lane, sign * ties.0[lane]);
                let v = $kernel.blend(x, y, s, sb, width, coefficient);
                shares.0[lane] = share(v.gradient.x, v.gradient.y);
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

impl Attachment<Dual<f32>> for Surfaces {
    fn reserve(&mut self, values: usize) {
        self.registers.resize_with(values, Held::default);
    }
    fn operate(
        &mut self,
        op: Op,
        q: &[Column; 12],
        [a, b]: [&[Column; 4]; 2],
        registers: [u16; 2],
        constants: &[f32],
    ) {
        match registers {
            [NONE, NONE] => self.result.one = Some(self.unpainted),
            [only, NONE] | [NONE, only] => self.copy(only),
            [first, second] => {
                self.copy(first);
                let other = &self.registers[usize::from(second)];
                let alike = self.result.one.is_some() && self.result.one == other.one;
                if op.row().meta.category != Category::Combine || alike {
                    return;
                }
                let mut shares = Column::default();
                let sign = precedence(op) as f32;
                for lane in 0..LANES {
                    let tie = sign * self.ties.0[lane];
                    let [x, y] = seeds(a.each_ref(), b.each_ref(), lane, tie);
                    let values = [x, y, Dual::fixed(0.0)];
                    // The point stays: only the operands' shares are asked for.
                    let p = DualVec3::fixed(Dual::<f32>::load_point(q, lane).value);
                    if let Applied::Value(v) = apply::<Dual<f32>>(op, p, values, constants) {
                        shares.0[lane] = share(v.gradient.x, v.gradient.y);
                    }
                }
                let other = &mut self.registers[usize::from(second)];
                self.result.mix(other, &shares);
            }
        }
    }
    fn copy(&mut self, from: u16) {
        self.result.become_like(&self.registers[usize::from(from)]);
    }
    fn normal(&mut self, q: &[Column; 12], axis: u8, out: &mut [Column; 4]) {
        for lane in 0..LANES {
            let n = f32::load_point(&self.normals, lane);
            let [dx, dy, dz] = Dual::<f32>::load_point(q, lane).gradients;
            let local = V3::of(dx.dot(n), dy.dot(n), dz.dot(n)).normalize();
            let component = [local.x, local.y, local.z][usize::from(axis)];
            Dual::fixed(component).store(out, lane);
        }
    }
    fn channel(&mut self, channel: u8, value: &[Column; 4]) {
        let channel = usize::from(channel);
        if channel == BUMP {
            self.pending[BUMP..BUMP + 3].copy_from_slice(&value[..3]);
        } else {
            self.pending[channel] = value[3];
        }
    }
    fn paint(&mut self, from: u16, constants: &[[f32; 4]], mask: u8) {
        self.copy(from);
        let numbers = constants.as_flattened();
        if mask == 0 && numbers[9] == 0.0 {
            let mut one = [0.0; NUMBERS];
            one[..BUMP].copy_from_slice(&numbers[..BUMP]);
            one[ID] = numbers[8];
            self.result.one = Some(one);
            return;
        }
        let result = self.result.lanes();
        for (channel, &number) in numbers[..BUMP].iter().enumerate() {
            result[channel] = if mask >> channel & 1 == 1 {
                self.pending[channel]
            } else {
                Column([number; LANES])
            };
        }
        // The bump is there whenever its share of the constants says so.
        let bumped = numbers[9] != 0.0;
        for axis in 0..3 {
            let column = self.pending[BUMP + axis];
            result[BUMP + axis] = if bumped { column } else { Column::default() };
        }
        result[ID] = Column([numbers[8]; LANES]);
    }
    fn blend(
        &mut self,
        kernel: Kernel,
        constants: [f32; 4],
        [a, b]: [&[Column; 4]; 2],
        below: u16,
    ) {
        let first = &self.registers[usize::from(below)];
        if self.result.one.is_some() && self.result.one == first.one {
            return;
        }
        let mut shares = Column::default();
        let values = [a.each_ref(), b.each_ref()];
        shares_of(kernel, constants, values, &self.ties, &mut shares);
        std::mem::swap(&mut self.blended, &mut self.result);
        self.result.become_like(first);
        self.result.mix(&mut self.blended, &shares);
    }
    #[inline(always)]
    fn choose(&mut self, _: u32, _: Kernel, _: [f32; 4], _: [&[Column; 4]; 2]) {}
    fn set(&mut self, out: u16) {
        std::mem::swap(&mut self.registers[usize::from(out)], &mut self.result);
    }
}
