//! The view that all sides draw: along parallel rays, a cube that fills the picture.
//!
//! Fidget samples a pixel at its lower left corner and sdfc at its centre, so Fidget's matrix moves
//! by half a pixel: both see the field at the same points, and none of them lies exactly on an edge
//! of a model with round coordinates, where one side would call it inside and the other outside.

use nalgebra::{Matrix3, Matrix4, Rotation3, Vector2, Vector3};
use sdfc_runtime::frame::{Lens, View as Camera};

/// A cube around the origin, seen through one of its faces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    /// Half a side of the cube.
    half: f64,
    /// From the view's axes (right, up, towards the viewer) to the model's.
    turn: Rotation3<f64>,
}

impl View {
    /// A view of the cube from −half to half, turned about x by `pitch` and then about y by `yaw`,
    /// in degrees.
    pub(crate) fn new(half: f64, pitch: f64, yaw: f64) -> Self {
        let about = |axis: Vector3<f64>, degrees: f64| Rotation3::new(axis * degrees.to_radians());
        Self {
            half,
            turn: about(Vector3::y(), yaw) * about(Vector3::x(), pitch),
        }
    }

    /// Half a side of the cube.
    pub(crate) fn half(&self) -> f64 {
        self.half
    }

    /// sdfc's camera: two half sides before the middle.
    pub(crate) fn camera(&self) -> Camera {
        let turned = |v: Vector3<f64>| (self.turn * v).into();
        Camera {
            from: turned(Vector3::z() * self.distance()),
            look: [0.0; 3],
            up: turned(Vector3::y()),
            lens: Lens::Orthographic(2.0 * self.half),
        }
    }

    /// How far that camera is from the middle.
    fn distance(&self) -> f64 {
        2.0 * self.half
    }

    /// How far its rays go: to the back of the cube.
    pub(crate) fn far(&self) -> f64 {
        self.distance() + self.half
    }

    /// The voxel, counted from 1 at the back, in whose front half-open slice a ray ended that went
    /// this far; `size` voxels fill the cube.
    pub(crate) fn voxel(&self, depth: f32, size: u32) -> u32 {
        let height = (self.distance() - f64::from(depth)) / self.half;
        let voxels = (height + 1.0) / 2.0 * f64::from(size);
        (voxels.floor() + 1.0).clamp(1.0, f64::from(size)) as u32
    }

    /// A direction of the model's space in the view's axes.
    pub(crate) fn seen(&self, direction: [f32; 3]) -> [f32; 3] {
        let direction = Vector3::from(direction).cast::<f64>();
        (self.turn.inverse() * direction).cast::<f32>().into()
    }

    /// Fidget's matrix from the cube between −1 and 1 to the model's space, for pictures of `size`
    /// pixels.
    pub(crate) fn matrix(&self, size: u32) -> Matrix4<f32> {
        let shift = 1.0 / f64::from(size);
        let shift = Matrix4::new_translation(&Vector3::new(shift, shift, 0.0));
        (self.turn.to_homogeneous() * Matrix4::new_scaling(self.half) * shift).cast()
    }

    /// The same for the plane.
    pub(crate) fn plane_matrix(&self, size: u32) -> Matrix3<f32> {
        let shift = 1.0 / f64::from(size);
        let shift = Matrix3::new_translation(&Vector2::new(shift, shift));
        (Matrix3::new_scaling(self.half) * shift).cast()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_sides_see_the_same_points() {
        let size = 16_u32;
        let view = View::new(3.0, -25.0, 30.0);
        let camera = view.camera();
        let fidget =
            view.matrix(size) * fidget::render::VoxelSize::new(size, size, size).screen_to_world();
        let (from, look) = (Vector3::from(camera.from), Vector3::from(camera.look));
        let forward = (look - from).normalize();
        let right = forward.cross(&Vector3::from(camera.up));
        let up = right.cross(&forward);
        for (x, y) in [(0, 0), (15, 0), (3, 9), (8, 8)] {
            let place = |n: f64| (n + 0.5) / f64::from(size) * 2.0 - 1.0;
            let across = right * place(f64::from(x)) - up * place(f64::from(y));
            let ours = look + across * view.half();
            let theirs = fidget.transform_point(&nalgebra::Point3::new(x as f32, y as f32, 8.0));
            assert!(
                (ours - theirs.coords.cast()).norm() < 1e-5,
                "{ours} {theirs}"
            );
        }
    }

    #[test]
    fn voxels_are_counted_from_the_back() {
        let view = View::new(1.0, 0.0, 0.0);
        assert_eq!(view.voxel(1.0, 64), 64);
        assert_eq!(view.voxel(1.001, 64), 64);
        assert_eq!(view.voxel(3.0, 64), 1);
        assert_eq!(view.voxel(2.001, 64), 32);
    }
}
