//! Binning of leaves: each leaf is projected onto the picture and listed with the packets that it covers, the
//! nearest first.

use crate::cells::{Aabb, Cells};
use crate::render::ray::vector;
use rayon::prelude::*;
use sdfc_shaders::layout::FrameUniforms;
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;

/// Side of a packet in pixels: 64 rays with nearly the same direction.
pub(super) const PACKET_SIDE: u32 = 8;

/// Side of a bundle in packets: its rays go through a leaf together.
pub(super) const BUNDLE_SIDE: u32 = 4;

/// A leaf in a packet's list.
#[derive(Clone, Copy, Debug)]
pub(super) struct BinnedLeaf {
    /// Smallest distance along any ray of any packet at which it enters the leaf.
    pub(super) min_ray_t: f32,
    /// Index of the cell.
    pub(super) cell: u32,
}

/// For each packet of a picture, the leaves that its rays may meet.
pub(super) struct LeafBins {
    columns: u32,
    rows: u32,
    /// First list entry of each packet, and the length of the list.
    starts: Vec<u32>,
    list: Vec<BinnedLeaf>,
}

/// Screen-space bounds of a leaf, in packets: from (inclusive) and to (exclusive).
struct ScreenExtent {
    leaf: BinnedLeaf,
    from: [u32; 2],
    to: [u32; 2],
}

impl LeafBins {
    /// Bins the leaves of these cells, for all samples of a picture.
    pub(super) fn new(cells: &Cells, frame: &FrameUniforms) -> Self {
        let [columns, rows] = frame.size.map(|n| (n as u32).div_ceil(PACKET_SIDE));
        let projection = Projection::new(frame);
        let leaves: Vec<u32> = cells.leaves().collect();
        let mut extents: Vec<ScreenExtent> = leaves
            .par_iter()
            .with_min_len(256)
            .filter_map(|&cell| {
                let region = &cells.cell(cell).region;
                let (low, high) = projection.screen_extent(region)?;
                let packets = [columns, rows];
                let pixel = |v: f32, axis: usize, up: f32| {
                    ((v / PACKET_SIDE as f32).floor() + up).clamp(0.0, packets[axis] as f32) as u32
                };
                // Samples lie within half a pixel of a pixel's centre, and the shift of all samples.
                let from = [0, 1].map(|axis| pixel(low[axis] - 0.1, axis, 0.0));
                let to = [0, 1].map(|axis| pixel(high[axis] + 0.1, axis, 1.0));
                let min_ray_t = projection.min_ray_t(region);
                let is_visible = from[0] < to[0] && from[1] < to[1] && min_ray_t <= frame.far;
                is_visible.then_some(ScreenExtent {
                    leaf: BinnedLeaf { min_ray_t, cell },
                    from,
                    to,
                })
            })
            .collect();
        // Packets list them in this order.
        extents.par_sort_by(|a, b| a.leaf.min_ray_t.total_cmp(&b.leaf.min_ray_t));
        let count = (columns * rows) as usize;
        let mut starts = vec![0_u32; count + 1];
        let packets = |extent: &ScreenExtent| {
            let (from, to) = (extent.from, extent.to);
            (from[1]..to[1])
                .flat_map(move |y| (from[0]..to[0]).map(move |x| (y * columns + x) as usize))
        };
        for packet in extents.iter().flat_map(packets) {
            starts[packet + 1] += 1;
        }
        for packet in 0..count {
            starts[packet + 1] += starts[packet];
        }
        let mut next = starts.clone();
        let empty = BinnedLeaf {
            min_ray_t: 0.0,
            cell: 0,
        };
        let mut list = vec![empty; starts[count] as usize];
        for extent in &extents {
            for packet in packets(extent) {
                list[next[packet] as usize] = extent.leaf;
                next[packet] += 1;
            }
        }
        Self {
            columns,
            rows,
            starts,
            list,
        }
    }

    /// Returns the leaves of the packet that contains a pixel. Pixels beyond the picture's edge belong to its
    /// last packets.
    pub(super) fn leaves_at(&self, [x, y]: [u32; 2]) -> &[BinnedLeaf] {
        let column = (x / PACKET_SIDE).min(self.columns - 1);
        let row = (y / PACKET_SIDE).min(self.rows - 1);
        let packet = (row * self.columns + column) as usize;
        &self.list[self.starts[packet] as usize..self.starts[packet + 1] as usize]
    }
}

/// Projection from points to pixels.
struct Projection {
    origin: V3<f32>,
    forward: V3<f32>,
    /// Distance from the camera to the start of the rays, along the view.
    approach: f32,
    right: V3<f32>,
    up: V3<f32>,
    orthographic: bool,
    size: [f32; 2],
}

impl Projection {
    fn new(frame: &FrameUniforms) -> Self {
        let orthographic = frame.half_pixel_growth == 0.0;
        let (right, up) = if orthographic {
            (frame.origin_right, frame.origin_up)
        } else {
            (frame.forward_right, frame.forward_up)
        };
        // The dot product with these gives the screen position, from -1 to 1.
        let dual = |v: V3<f32>| v * (1.0 / v.dot(v).max(f32::MIN_POSITIVE));
        Self {
            origin: vector(frame.origin),
            forward: vector(frame.forward),
            approach: frame.approach,
            right: dual(vector(right)),
            up: dual(vector(up)),
            orthographic,
            size: frame.size,
        }
    }

    /// Returns the screen-space bounds of a box in pixels, or `None` if it lies behind the camera.
    fn screen_extent(&self, region: &Aabb) -> Option<([f32; 2], [f32; 2])> {
        let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        let (mut in_front, mut in_back) = (false, false);
        for corner in 0..8 {
            let axis = |i: usize| {
                if corner >> i & 1 == 0 {
                    region.low[i]
                } else {
                    region.high[i]
                }
            };
            let v = V3::new(axis(0), axis(1), axis(2)) - self.origin;
            let depth = v.dot(self.forward);
            // Rays of an orthographic view begin at the camera's plane too.
            let min_depth = if self.orthographic {
                0.0
            } else {
                1e-3 * region.longest_side()
            };
            if depth > min_depth {
                in_front = true;
            } else {
                in_back = true;
            }
            let scale = if self.orthographic {
                1.0
            } else {
                1.0 / (depth + self.approach)
            };
            let (u, w) = (v.dot(self.right) * scale, v.dot(self.up) * scale);
            let position = [
                (u + 1.0) / 2.0 * self.size[0],
                (1.0 - w) / 2.0 * self.size[1],
            ];
            for axis in 0..2 {
                low[axis] = low[axis].min(position[axis]);
                high[axis] = high[axis].max(position[axis]);
            }
        }
        if !in_front {
            return None;
        }
        if in_back && !self.orthographic {
            // The box crosses the camera's plane: it may appear anywhere.
            return Some(([0.0; 2], self.size));
        }
        // Coordinates far from the origin are rounded, and so are the screen positions.
        let slack = [0, 1].map(|axis| 0.05 + 1e-5 * (low[axis].abs() + high[axis].abs()));
        Some((
            [low[0] - slack[0], low[1] - slack[1]],
            [high[0] + slack[0], high[1] + slack[1]],
        ))
    }

    /// Returns a lower bound of the distance along any ray at which it enters a box.
    fn min_ray_t(&self, region: &Aabb) -> f32 {
        let outside = |axis: usize| {
            let origin = [self.origin.x, self.origin.y, self.origin.z][axis];
            (region.low[axis] - origin)
                .max(origin - region.high[axis])
                .max(0.0)
        };
        let distance = if self.orthographic || self.approach > 0.0 {
            let (mut nearest, forward) = (0.0, self.forward);
            for (axis, component) in [forward.x, forward.y, forward.z].into_iter().enumerate() {
                let origin = [self.origin.x, self.origin.y, self.origin.z][axis];
                nearest += ((region.low[axis] - origin) * component)
                    .min((region.high[axis] - origin) * component);
            }
            f32::max(nearest, 0.0)
        } else {
            let [x, y, z] = [0, 1, 2].map(outside);
            (x * x + y * y + z * z).sqrt()
        };
        distance * (1.0 - 1e-5)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::cells::{CellSpec, CellSplit, SplitRule, build};
    use crate::render::ray::camera_ray;
    use crate::render::{Axes, ResolvedLens, View};
    use sdfc_trials::random::Random;
    use sdfc_vm::listing::parse;
    use sdfc_vm::tape::Tape;

    /// Splits the root cell and a quarter of its children.
    struct MixedSizes;

    impl SplitRule for MixedSizes {
        fn should_split(&self, region: &Aabb, _: usize, _: f32) -> bool {
            let mix = |mix: u32, v: &f32| (mix ^ v.to_bits()).wrapping_mul(0x9e37_79b1);
            let mixed = region.low.iter().fold(0, mix);
            region.longest_side() > 0.6 || region.longest_side() > 0.2 && mixed >> 30 == 0
        }
    }

    /// Builds the cells of a cube around the origin; all are kept.
    pub(in crate::cpu) fn cells() -> Cells {
        let program = parse("0000 sphere [0.8]\n").expect("a program");
        let region = Aabb {
            low: [-1.0; 3],
            high: [1.0; 3],
        };
        let spec = CellSpec {
            max_slope: 1.0,
            max_split_clauses: u64::MAX,
            region,
            split: CellSplit::Volume,
            band: f32::INFINITY,
            margin: 0.0,
            rule: &MixedSizes,
        };
        build(&program, &Tape::new(&program), &spec)
    }

    fn frame(view: &View, size: [u32; 2]) -> FrameUniforms {
        let [width, height] = size.map(f64::from);
        let axes = Axes::from_view(view, width / height);
        let single = |v: [f64; 3]| v.map(|v| v as f32);
        FrameUniforms {
            origin: single(axes.origin),
            origin_right: single(axes.origin_right),
            origin_up: single(axes.origin_up),
            forward: single(axes.forward),
            forward_right: single(axes.forward_right),
            forward_up: single(axes.forward_up),
            half_pixel_growth: match view.lens {
                ResolvedLens::Perspective(_) => 1e-3,
                ResolvedLens::Orthographic(_) => 0.0,
            },
            far: 1e3,
            size: size.map(|n| n as f32),
            ..FrameUniforms::default()
        }
    }

    /// Returns the distance along a ray to a box, if the ray goes through more of it than a corner.
    fn entry_distance(region: &Aabb, origin: [f32; 3], direction: [f32; 3]) -> Option<f64> {
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let faces = [region.low[axis], region.high[axis]];
            let [a, b] = faces.map(|end| f64::from(end) - f64::from(origin[axis]));
            let component = f64::from(direction[axis]);
            enter = enter.max((a / component).min(b / component));
            leave = leave.min((a / component).max(b / component));
        }
        (leave > enter + 1e-4).then_some(enter)
    }

    /// The list of a ray's packet contains all leaves that the ray goes through, at most at their true
    /// distances.
    #[test]
    fn packets_list_what_their_rays_go_through() {
        let cells = cells();
        let leaves: Vec<u32> = cells.leaves().collect();
        let mut random = Random::new(17);
        let mut number = |size: f64| (random.below(2001) as f64 / 1000.0 - 1.0) * size;
        let mut met = 0;
        for turn in 0..24 {
            // Cameras nearby, far away, and inside.
            let from = [0, 1, 2].map(|_| number([3.0, 40.0, 0.7][turn % 3]));
            let view = View {
                from,
                look: [0, 1, 2].map(|_| number(0.3)),
                up: [0.0, 1.0, 0.0],
                lens: match turn % 2 {
                    0 => ResolvedLens::Perspective([0.8, 0.06, 1.2][turn % 3]),
                    _ => ResolvedLens::Orthographic(2.5),
                },
            };
            let size = [37, 29];
            let mut frame = frame(&view, size);
            frame.offset = [0, 1].map(|_| number(0.5) as f32);
            let bins = LeafBins::new(&cells, &frame);
            for pixel in 0..size[0] * size[1] {
                let [x, y] = [pixel % size[0], pixel / size[0]];
                let ray = camera_ray(&frame, [x as f32, y as f32]);
                let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
                let listed = bins.leaves_at([x, y]);
                for &leaf in &leaves {
                    let Some(enter) = entry_distance(&cells.cell(leaf).region, origin, direction)
                    else {
                        continue;
                    };
                    met += 1;
                    let min_ray_t = listed.iter().find(|binned| binned.cell == leaf);
                    let min_ray_t = min_ray_t.map(|binned| f64::from(binned.min_ray_t));
                    assert!(
                        min_ray_t.is_some_and(|min_ray_t| min_ray_t <= enter * (1.0 + 1e-6)),
                        "{view:?}, pixel {x} {y}: leaf {leaf} is {enter} away and listed at {min_ray_t:?}"
                    );
                }
            }
        }
        assert!(met > 10_000, "only {met} leaves were met");
    }
}
