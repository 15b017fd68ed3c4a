//! The view that all renderers draw: a cube that fills the picture, along parallel rays.
//!
//! Fidget samples a pixel at its lower left corner and sdfc near its center, so Fidget's matrix moves by about
//! half a pixel. Both then sample the field at the same points. None of them is exactly on an edge of a model
//! with round coordinates, where rounding would decide between inside and outside.

use nalgebra::{Matrix3, Matrix4, Rotation3, Vector2, Vector3};
use sdfc_runtime::render::{ResolvedLens, View as Camera};
use sdfc_shaders::camera::SAMPLE_SHIFT;

/// A cube around the origin, viewed through one of its faces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CubeView {
    /// Half a side of the cube.
    half: f64,
    /// Centre of the cube.
    center: Vector3<f64>,
    /// Rotation from the view's axes (right, up, towards the viewer) to the model's.
    rotation: Rotation3<f64>,
}

impl CubeView {
    /// Creates a view of the cube from −half to half, rotated about x by `pitch` and then about y by `yaw`,
    /// in degrees.
    pub(crate) fn new(half: f64, pitch: f64, yaw: f64) -> Self {
        let rotation = |axis: Vector3<f64>, degrees: f64| Rotation3::new(axis * degrees.to_radians());
        Self {
            half,
            center: Vector3::zeros(),
            rotation: rotation(Vector3::y(), yaw) * rotation(Vector3::x(), pitch),
        }
    }

    /// Returns the same view of the cube around another centre.
    pub(crate) fn around(self, center: [f64; 3]) -> Self {
        Self {
            center: center.into(),
            ..self
        }
    }

    /// Returns half a side of the cube.
    #[cfg(test)]
    pub(crate) fn half(&self) -> f64 {
        self.half
    }

    /// Returns sdfc's camera, at two half sides in front of the center.
    pub(crate) fn camera(&self) -> Camera {
        let from = self.center + self.rotation * (Vector3::z() * self.distance());
        Camera {
            from: from.into(),
            look: self.center.into(),
            up: (self.rotation * Vector3::y()).into(),
            lens: ResolvedLens::Orthographic(2.0 * self.half),
        }
    }

    /// Returns the distance of that camera from the center.
    fn distance(&self) -> f64 {
        2.0 * self.half
    }

    /// Returns the length of its rays, to the back of the cube.
    pub(crate) fn far(&self) -> f64 {
        self.distance() + self.half
    }

    /// Returns the voxel of a ray's end at a depth, counted from 1 at the back.
    ///
    /// `size` voxels fill the cube, and each is half-open at the front.
    pub(crate) fn voxel(&self, depth: f32, size: u32) -> u32 {
        let height = (self.distance() - f64::from(depth)) / self.half;
        let voxels = (height + 1.0) / 2.0 * f64::from(size);
        (voxels.floor() + 1.0).clamp(1.0, f64::from(size)) as u32
    }

    /// Returns a direction of the model's space in the view's axes.
    pub(crate) fn to_view_axes(&self, direction: [f32; 3]) -> [f32; 3] {
        let direction = Vector3::from(direction).cast::<f64>();
        (self.rotation.inverse() * direction).cast::<f32>().into()
    }

    /// Returns Fidget's matrix from the cube between −1 and 1 to the model's space, for pictures of `size`
    /// pixels.
    pub(crate) fn matrix(&self, size: u32) -> Matrix4<f32> {
        let [right, up] = sample_offset(size);
        let shift = Matrix4::new_translation(&Vector3::new(right, up, 0.0));
        let place = Matrix4::new_translation(&self.center) * self.rotation.to_homogeneous();
        (place * Matrix4::new_scaling(self.half) * shift).cast()
    }

    /// Returns Fidget's matrix for pictures of 2-D shapes.
    pub(crate) fn plane_matrix(&self, size: u32) -> Matrix3<f32> {
        let shift = Matrix3::new_translation(&Vector2::from(sample_offset(size)));
        let place = Matrix3::new_translation(&self.center.xy());
        (place * Matrix3::new_scaling(self.half) * shift).cast()
    }
}

/// Returns the offset of sdfc's sample from the lower left corner of a pixel, to the right and up. The picture has
/// `size` pixels between −1 and 1.
fn sample_offset(size: u32) -> [f64; 2] {
    let [right, down] = SAMPLE_SHIFT;
    [0.5 + right, 0.5 - down].map(|pixels| 2.0 * pixels / f64::from(size))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_sides_see_the_same_points() {
        let size = 16_u32;
        let view = CubeView::new(3.0, -25.0, 30.0).around([0.5, -1.0, 2.0]);
        let camera = view.camera();
        let fidget =
            view.matrix(size) * fidget::render::VoxelSize::new(size, size, size).screen_to_world();
        let (from, look) = (Vector3::from(camera.from), Vector3::from(camera.look));
        let forward = (look - from).normalize();
        let right = forward.cross(&Vector3::from(camera.up));
        let up = right.cross(&forward);
        for (x, y) in [(0, 0), (15, 0), (3, 9), (8, 8)] {
            let normalized = |n: f64, shift: f64| (n + 0.5 + shift) / f64::from(size) * 2.0 - 1.0;
            let [u, v] = [normalized(f64::from(x), SAMPLE_SHIFT[0]), normalized(f64::from(y), SAMPLE_SHIFT[1])];
            let offset = right * u - up * v;
            let sdfc_point = look + offset * view.half();
            let fidget_point = fidget.transform_point(&nalgebra::Point3::new(x as f32, y as f32, 8.0));
            assert!(
                (sdfc_point - fidget_point.coords.cast()).norm() < 1e-5,
                "{sdfc_point} {fidget_point}"
            );
        }
    }

    #[test]
    fn voxels_are_counted_from_the_back() {
        let view = CubeView::new(1.0, 0.0, 0.0);
        assert_eq!(view.voxel(1.0, 64), 64);
        assert_eq!(view.voxel(1.001, 64), 64);
        assert_eq!(view.voxel(3.0, 64), 1);
        assert_eq!(view.voxel(2.001, 64), 32);
    }
}
