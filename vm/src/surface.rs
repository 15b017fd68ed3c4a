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
use crate::row::Category;
use crate::table::Op;
use crate::tape::NONE;
use crate::tape::machine::Attachment;
use crate::vector::V3;

/// How many numbers a surface has: albedo, roughness, emission, metallic, the gradient of the
/// bump's height, and the number of its material.
pub const NUMBERS: usize = 12;
/// Where the gradient of the bump's height starts.
pub const BUMP: usize = 8;
/// Where the number of the material is.
pub const ID: usize = 11;

/// A surface in each lane.
pub type SurfaceBlock = [Column; NUMBERS];

/// Blocks change places with each other by their pointers.
type Swapped = Box<SurfaceBlock>;

/// Materials attached to dual values.
#[derive(Default)]
pub struct Surfaces {
    /// The unit normals in the world, set before a run.
    pub normals: Points,
    /// What a shape has that nothing painted, set before a run.
    pub unpainted: [f32; NUMBERS],
    result: Box<SurfaceBlock>,
    blended: Box<SurfaceBlock>,
    registers: Vec<Swapped>,
    pending: Box<SurfaceBlock>,
}

impl Surfaces {
    /// The scene's surface, after a run.
    pub fn surface(&self) -> &SurfaceBlock {
        &self.registers[0]
    }
}

/// Two values whose gradients tell them apart.
#[inline(always)]
fn seeds(a: f32, b: f32) -> [Dual<f32>; 2] {
    [
        Dual {
            value: a,
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

/// `a` and `b` mixed in every lane into `a`; the material's number is the larger share's.
#[inline(always)]
fn mix(a: &mut SurfaceBlock, b: &SurfaceBlock, shares: &Column) {
    for number in 0..ID {
        for lane in 0..LANES {
            let (x, y) = (a[number].0[lane], b[number].0[lane]);
            a[number].0[lane] = x.mix(y, shares.0[lane]);
        }
    }
    for lane in 0..LANES {
        if shares.0[lane] > 0.5 {
            a[ID].0[lane] = b[ID].0[lane];
        }
    }
}

impl Attachment<Dual<f32>> for Surfaces {
    fn reserve(&mut self, values: usize) {
        self.registers.resize_with(values, Box::default);
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
            [NONE, NONE] => {
                for (column, v) in self.result.iter_mut().zip(self.unpainted) {
                    *column = Column([v; LANES]);
                }
            }
            [only, NONE] | [NONE, only] => self.copy(only),
            [first, second] => {
                self.copy(first);
                if op.row().meta.category != Category::Combine {
                    return;
                }
                let mut shares = Column::default();
                for lane in 0..LANES {
                    let [x, y] = seeds(a[3].0[lane], b[3].0[lane]);
                    let values = [x, y, Dual::fixed(0.0)];
                    // The point stays: only the operands' shares are asked for.
                    let p = DualVec3::fixed(Dual::<f32>::load_point(q, lane).value);
                    if let Applied::Value(v) = apply::<Dual<f32>>(op, p, values, constants) {
                        shares.0[lane] = share(v.gradient.x, v.gradient.y);
                    }
                }
                mix(
                    &mut self.result,
                    &self.registers[usize::from(second)],
                    &shares,
                );
            }
        }
    }
    fn copy(&mut self, from: u16) {
        self.result.clone_from(&self.registers[usize::from(from)]);
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
        for (channel, &number) in numbers[..BUMP].iter().enumerate() {
            self.result[channel] = if mask >> channel & 1 == 1 {
                self.pending[channel]
            } else {
                Column([number; LANES])
            };
        }
        // The bump is there whenever its share of the constants says so.
        let bumped = numbers[9] != 0.0;
        for axis in 0..3 {
            let column = self.pending[BUMP + axis];
            self.result[BUMP + axis] = if bumped { column } else { Column::default() };
        }
        self.result[ID] = Column([numbers[8]; LANES]);
    }
    fn blend(
        &mut self,
        kernel: Kernel,
        constants: [f32; 4],
        [a, b]: [&[Column; 4]; 2],
        below: u16,
    ) {
        let [s, sb, width, coefficient] = constants.map(Dual::fixed);
        let mut shares = Column::default();
        for lane in 0..LANES {
            let [x, y] = seeds(a[3].0[lane], b[3].0[lane]);
            let v = kernel.blend(x, y, s, sb, width, coefficient);
            shares.0[lane] = share(v.gradient.x, v.gradient.y);
        }
        std::mem::swap(&mut self.blended, &mut self.result);
        self.result.clone_from(&self.registers[usize::from(below)]);
        mix(&mut self.result, &self.blended, &shares);
    }
    #[inline(always)]
    fn choose(&mut self, _: u32, _: Kernel, _: [f32; 4], _: [&[Column; 4]; 2]) {}
    fn set(&mut self, out: u16) {
        std::mem::swap(&mut self.registers[usize::from(out)], &mut self.result);
    }
}
