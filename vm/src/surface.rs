//! Surfaces: the materials that a surface program computes along with its distances.
//!
//! Every value of a tape has a material attached. A blend mixes the materials of its operands by their
//! weights ([`crate::material_weights`]), so equal materials stay equal.

use crate::blend::BlendKernel;
use crate::dual::Dual;
use crate::lanes::{F32x64, LANES, LaneNumber, Points};
use crate::local_normal::local_normal;
use crate::material_weights::{MAX_TIE_PER_COORDINATE, blend_weights, operation_weights};
use crate::multiversion;
use crate::real::Real;
use crate::row::Category;
use crate::table::Op;
use crate::tape::NO_REGISTER;
use crate::tape::evaluator::EvalHook;

/// Number of numbers in a surface: albedo, roughness, emission, metallic, the gradient of the bump's
/// height, and the index of its material.
pub const SURFACE_NUMBERS: usize = 12;
/// Index of the first component of the bump height's gradient.
pub const BUMP_INDEX: usize = 8;
/// Index of the material's index.
pub const ID_INDEX: usize = 11;

/// One surface per lane.
pub type SurfaceBlock = [F32x64; SURFACE_NUMBERS];

/// The material of a register. Many values have one surface in all lanes, and equal ones need no mixing.
#[derive(Clone, Default)]
struct MaterialRegister {
    /// The surface of all lanes, if they are equal.
    uniform: Option<[f32; SURFACE_NUMBERS]>,
    /// The surfaces of the lanes, if they differ. Blocks are swapped by pointer.
    block: Box<SurfaceBlock>,
}

impl MaterialRegister {
    /// Returns the surfaces, lane by lane.
    fn lanes(&mut self) -> &mut SurfaceBlock {
        if let Some(numbers) = self.uniform.take() {
            *self.block = numbers.map(|number| F32x64([number; LANES]));
        }
        &mut self.block
    }

    fn copy_from(&mut self, other: &Self) {
        self.uniform = other.uniform;
        if self.uniform.is_none() {
            self.block.clone_from(&other.block);
        }
    }

    /// Mixes in another register by its weights.
    fn mix(&mut self, other: &mut Self, weights: &F32x64) {
        mix(self.lanes(), other.lanes(), weights);
    }
}

/// The materials of dual values.
#[derive(Default)]
pub struct SurfaceHook {
    normals: Points,
    tie_distances: F32x64,
    /// The material of shapes without a material assignment, set before a run.
    pub default_material: [f32; SURFACE_NUMBERS],
    result: MaterialRegister,
    blended: MaterialRegister,
    registers: Vec<MaterialRegister>,
    pending: Box<SurfaceBlock>,
}

impl SurfaceHook {
    /// Sets the points in the world, and the unit normals there, before a run.
    pub fn set_points(&mut self, points: &Points, normals: &Points) {
        self.normals.clone_from(normals);
        for (lane, tie) in self.tie_distances.0.iter_mut().enumerate() {
            let largest = [0, 1, 2].map(|axis| points[axis].0[lane].abs());
            *tie = largest.into_iter().fold(0.0, f32::max) * MAX_TIE_PER_COORDINATE as f32;
        }
    }

    /// Returns the scene's surface, after a run.
    pub fn surface(&mut self) -> &SurfaceBlock {
        self.registers[0].lanes()
    }
}

multiversion! {
    /// Mixes `b` into `a` in every lane; the material's index is that of the larger weight.
    fn mix(a: &mut SurfaceBlock, b: &SurfaceBlock, weights: &F32x64) = mix_body;
}

#[inline(always)]
fn mix_body(a: &mut SurfaceBlock, b: &SurfaceBlock, weights: &F32x64) {
    for number in 0..ID_INDEX {
        for lane in 0..LANES {
            let (x, y) = (a[number].0[lane], b[number].0[lane]);
            a[number].0[lane] = x.mix(y, weights.0[lane]);
        }
    }
    for lane in 0..LANES {
        let (x, y) = (a[ID_INDEX].0[lane], b[ID_INDEX].0[lane]);
        a[ID_INDEX].0[lane] = if weights.0[lane] > 0.5 { y } else { x };
    }
}

impl EvalHook<Dual<f32>> for SurfaceHook {
    fn reserve(&mut self, values: usize) {
        self.registers
            .resize_with(values, MaterialRegister::default);
    }
    fn operate(
        &mut self,
        op: Op,
        q: &[F32x64; 12],
        [a, b]: [&[F32x64; 4]; 2],
        registers: [u16; 2],
        constants: &[f32],
    ) {
        match registers {
            [NO_REGISTER, NO_REGISTER] => self.result.uniform = Some(self.default_material),
            [only, NO_REGISTER] | [NO_REGISTER, only] => self.copy(only),
            [first, second] => {
                self.copy(first);
                let other = &self.registers[usize::from(second)];
                let alike = self.result.uniform.is_some() && self.result.uniform == other.uniform;
                if op.row().facts.category != Category::Combine || alike {
                    return;
                }
                let values = [a.each_ref(), b.each_ref()];
                let weights = operation_weights(op, q, values, constants, &self.tie_distances);
                let other = &mut self.registers[usize::from(second)];
                self.result.mix(other, &weights);
            }
        }
    }
    fn copy(&mut self, from: u16) {
        self.result.copy_from(&self.registers[usize::from(from)]);
    }
    fn normal(&mut self, q: &[F32x64; 12], axis: u8, out: &mut [F32x64; 4]) {
        for lane in 0..LANES {
            let n = f32::load_point(&self.normals, lane);
            let [dx, dy, dz] = Dual::<f32>::load_point(q, lane).gradients;
            let local = local_normal::<f32>(dx, dy, dz, n);
            let component = [local.x, local.y, local.z][usize::from(axis)];
            Dual::fixed(component).store(out, lane);
        }
    }
    fn channel(&mut self, channel: u8, value: &[F32x64; 4]) {
        let channel = usize::from(channel);
        if channel == BUMP_INDEX {
            self.pending[BUMP_INDEX..BUMP_INDEX + 3].copy_from_slice(&value[..3]);
        } else {
            self.pending[channel] = value[3];
        }
    }
    fn paint(&mut self, from: u16, constants: &[[f32; 4]], mask: u8) {
        self.copy(from);
        let numbers = constants.as_flattened();
        if mask == 0 && numbers[9] == 0.0 {
            let mut surface = [0.0; SURFACE_NUMBERS];
            surface[..BUMP_INDEX].copy_from_slice(&numbers[..BUMP_INDEX]);
            surface[ID_INDEX] = numbers[8];
            self.result.uniform = Some(surface);
            return;
        }
        let result = self.result.lanes();
        for (channel, &number) in numbers[..BUMP_INDEX].iter().enumerate() {
            result[channel] = if mask >> channel & 1 == 1 {
                self.pending[channel]
            } else {
                F32x64([number; LANES])
            };
        }
        // The constants enable the bump.
        let bumped = numbers[9] != 0.0;
        for axis in 0..3 {
            let column = self.pending[BUMP_INDEX + axis];
            result[BUMP_INDEX + axis] = if bumped { column } else { F32x64::default() };
        }
        result[ID_INDEX] = F32x64([numbers[8]; LANES]);
    }
    fn blend(
        &mut self,
        kernel: BlendKernel,
        constants: [f32; 4],
        [a, b]: [&[F32x64; 4]; 2],
        accumulator: u16,
    ) {
        let first = &self.registers[usize::from(accumulator)];
        if self.result.uniform.is_some() && self.result.uniform == first.uniform {
            return;
        }
        let mut weights = F32x64::default();
        let values = [a.each_ref(), b.each_ref()];
        blend_weights(kernel, constants, values, &self.tie_distances, &mut weights);
        std::mem::swap(&mut self.blended, &mut self.result);
        self.result.copy_from(first);
        self.result.mix(&mut self.blended, &weights);
    }
    fn set(&mut self, out: u16) {
        std::mem::swap(&mut self.registers[usize::from(out)], &mut self.result);
    }
}
