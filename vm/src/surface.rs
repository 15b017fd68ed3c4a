//! Surfaces: what a program of surfaces carries along with its distances.
//!
//! Every value on the stack has a material attached. A blend mixes the materials of its operands by
//! the blend's own derivatives: the weight of an operand is the share of the result's slope that
//! comes from it. So a hard union takes the nearer one's material, a smooth one goes over as the
//! shape does, and two equal materials stay equal.

use crate::apply::{Applied, apply};
use crate::dual::{Dual, DualVec3};
use crate::kernel::Kernel;
use crate::lanes::{Column, LANES, Lane, Points};
use crate::program::Needs;
use crate::real::{Real, Vector3};
use crate::row::Category;
use crate::table::Op;
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

/// What rides on the values of a machine's stack. The machine tells it what it does; see
/// [`crate::batch`].
pub trait Attachment<L: Lane> {
    /// For programs that need no more than `needs`.
    fn new(needs: &Needs) -> Self;
    /// The top goes to the stack at this depth.
    fn save(&mut self, depth: usize);
    /// The top comes back from the stack at this depth.
    fn restore(&mut self, depth: usize);
    /// The result becomes the top.
    fn take_result(&mut self);
    /// The result is what the top is.
    fn keep(&mut self);
    /// The result comes from a slot.
    fn load(&mut self, slot: u8);
    /// The top is kept in a slot, and is the result.
    fn store(&mut self, slot: u8);
    /// An operation at the point `q` took so many values from the stack of this depth, and gave a
    /// new one.
    fn operate(
        &mut self,
        op: Op,
        q: &L::PointBlock,
        ab: [&L::Block; 2],
        depth_and_taken: (usize, usize),
        k: &[f32],
    );
    /// The result is blended into the top, or into the stack at `below`, and becomes the top.
    fn blend(
        &mut self,
        kernel: Kernel,
        constants: [f32; 4],
        below: Option<usize>,
        a: &L::Block,
        b: &L::Block,
    );
    /// A component of the normal in the frame of the point `q`.
    fn normal(&mut self, q: &L::PointBlock, axis: u8, out: &mut L::Block);
    /// The top becomes a number of the next material.
    fn channel(&mut self, channel: u8, top: &L::Block);
    /// The result is the top in a new material.
    fn paint(&mut self, constants: &[[f32; 4]], mask: u8);
}

/// Nothing attached: distances and gradients only.
#[derive(Clone, Copy, Debug)]
pub struct Plain;

impl<L: Lane> Attachment<L> for Plain {
    #[inline(always)]
    fn new(_: &Needs) -> Self {
        Self
    }
    #[inline(always)]
    fn save(&mut self, _: usize) {}
    #[inline(always)]
    fn restore(&mut self, _: usize) {}
    #[inline(always)]
    fn take_result(&mut self) {}
    #[inline(always)]
    fn keep(&mut self) {}
    #[inline(always)]
    fn load(&mut self, _: u8) {}
    #[inline(always)]
    fn store(&mut self, _: u8) {}
    #[inline(always)]
    fn operate(
        &mut self,
        _: Op,
        _: &L::PointBlock,
        _: [&L::Block; 2],
        _: (usize, usize),
        _: &[f32],
    ) {
    }
    #[inline(always)]
    fn blend(&mut self, _: Kernel, _: [f32; 4], _: Option<usize>, _: &L::Block, _: &L::Block) {}
    #[inline(always)]
    fn normal(&mut self, _: &L::PointBlock, _: u8, _: &mut L::Block) {}
    #[inline(always)]
    fn channel(&mut self, _: u8, _: &L::Block) {}
    #[inline(always)]
    fn paint(&mut self, _: &[[f32; 4]], _: u8) {}
}

/// Materials attached to dual values.
pub struct Surfaces {
    /// The surface of the value on top: after a run, the scene's.
    pub top: Box<SurfaceBlock>,
    /// The unit normals in the world, set before a run.
    pub normals: Points,
    /// What a shape has that nothing painted, set before a run.
    pub unpainted: [f32; NUMBERS],
    result: Box<SurfaceBlock>,
    stack: Vec<Swapped>,
    slots: Vec<Swapped>,
    pending: Swapped,
}

/// Blocks change places with each other by their pointers.
type Swapped = Box<SurfaceBlock>;

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
    fn new(needs: &Needs) -> Self {
        Self {
            top: Box::default(),
            normals: Points::default(),
            unpainted: [0.0; NUMBERS],
            result: Box::default(),
            stack: vec![Box::default(); needs.depth + 1],
            slots: vec![Box::default(); needs.slots],
            pending: Box::default(),
        }
    }
    fn save(&mut self, depth: usize) {
        std::mem::swap(&mut self.stack[depth], &mut self.top);
    }
    fn restore(&mut self, depth: usize) {
        std::mem::swap(&mut self.stack[depth], &mut self.top);
    }
    fn take_result(&mut self) {
        std::mem::swap(&mut self.top, &mut self.result);
    }
    fn keep(&mut self) {
        self.result.clone_from(&self.top);
    }
    fn load(&mut self, slot: u8) {
        self.result.clone_from(&self.slots[usize::from(slot)]);
    }
    fn store(&mut self, slot: u8) {
        self.slots[usize::from(slot)].clone_from(&self.top);
        self.result.clone_from(&self.top);
    }
    fn operate(
        &mut self,
        op: Op,
        q: &[Column; 12],
        [a, b]: [&[Column; 4]; 2],
        (depth, taken): (usize, usize),
        constants: &[f32],
    ) {
        match taken {
            0 => {
                for (column, v) in self.result.iter_mut().zip(self.unpainted) {
                    *column = Column([v; LANES]);
                }
            }
            2 if op.row().meta.category == Category::Combine => {
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
                self.result.clone_from(&self.stack[depth - 1]);
                mix(&mut self.result, &self.top, &shares);
            }
            2 => self.result.clone_from(&self.stack[depth - 1]),
            _ => self.result.clone_from(&self.top),
        }
    }
    fn blend(
        &mut self,
        kernel: Kernel,
        constants: [f32; 4],
        below: Option<usize>,
        a: &[Column; 4],
        b: &[Column; 4],
    ) {
        let [s, sb, width, coefficient] = constants.map(Dual::fixed);
        let mut shares = Column::default();
        for lane in 0..LANES {
            let [x, y] = seeds(a[3].0[lane], b[3].0[lane]);
            let v = kernel.blend(x, y, s, sb, width, coefficient);
            shares.0[lane] = share(v.gradient.x, v.gradient.y);
        }
        if let Some(depth) = below {
            std::mem::swap(&mut self.top, &mut self.stack[depth]);
        }
        mix(&mut self.top, &self.result, &shares);
    }
    fn normal(&mut self, q: &[Column; 12], axis: u8, out: &mut [Column; 4]) {
        for lane in 0..LANES {
            let n = f32::load_point(&self.normals, lane);
            let [dx, dy, dz] = Dual::<f32>::load_point(q, lane).gradients;
            let local = V3::of(dx.dot(n), dy.dot(n), dz.dot(n)).normalize();
            let component = [local.x, local.y, local.z][usize::from(axis)];
            Dual::fixed(component).store(out, lane);
        }
        self.keep();
    }
    fn channel(&mut self, channel: u8, top: &[Column; 4]) {
        let channel = usize::from(channel);
        if channel == BUMP {
            self.pending[BUMP..BUMP + 3].copy_from_slice(&top[..3]);
        } else {
            self.pending[channel] = top[3];
        }
    }
    fn paint(&mut self, constants: &[[f32; 4]], mask: u8) {
        self.keep();
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
}
