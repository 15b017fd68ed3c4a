//! Which cells the rays of a packet may meet: leaves are projected onto the picture, and each is
//! listed with the packets that it covers, the nearest first.

use super::march::vector;
use crate::cells::{Cells, Region};
use rayon::prelude::*;
use sdfc_shaders::layout::Frame;
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;

/// Pixels along a side of a packet: 64 rays that go nearly the same way.
pub(super) const SIDE: u32 = 8;

/// A cell on the way of a packet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meeting {
    /// No ray of any packet enters it before this.
    pub(super) near: f32,
    /// The cell.
    pub(super) cell: u32,
}

/// For each packet of a picture, the leaves that its rays may meet.
pub(super) struct Meetings {
    columns: u32,
    rows: u32,
    /// Where each packet's list begins; one more than there are packets.
    starts: Vec<u32>,
    list: Vec<Meeting>,
}

/// A leaf on the picture, in packets: from (inclusive) and to (exclusive).
struct Shadow {
    meeting: Meeting,
    from: [u32; 2],
    to: [u32; 2],
}

impl Meetings {
    /// For the leaves of these cells, in all passes of a picture.
    pub(super) fn of(cells: &Cells, frame: &Frame) -> Self {
        let [columns, rows] = frame.size.map(|n| (n as u32).div_ceil(SIDE));
        let view = Projection::of(frame);
        let leaves: Vec<u32> = cells.leaves().collect();
        let mut shadows: Vec<Shadow> = leaves
            .par_iter()
            .with_min_len(256)
            .filter_map(|&cell| {
                let region = &cells.cell(cell).region;
                let (low, high) = view.extent(region)?;
                let packets = [columns, rows];
                let pixel = |v: f32, axis: usize, up: f32| {
                    ((v / SIDE as f32).floor() + up).clamp(0.0, packets[axis] as f32) as u32
                };
                // Samples lie within half a pixel around a pixel's middle.
                let from = [0, 1].map(|axis| pixel(low[axis] - 0.1, axis, 0.0));
                let to = [0, 1].map(|axis| pixel(high[axis] + 0.1, axis, 1.0));
                let near = view.near(region);
                let seen = from[0] < to[0] && from[1] < to[1] && near <= frame.far;
                seen.then_some(Shadow {
                    meeting: Meeting { near, cell },
                    from,
                    to,
                })
            })
            .collect();
        // Packets list them in this order.
        shadows.par_sort_by(|a, b| a.meeting.near.total_cmp(&b.meeting.near));
        let count = (columns * rows) as usize;
        let mut starts = vec![0_u32; count + 1];
        let packets = |shadow: &Shadow| {
            let (from, to) = (shadow.from, shadow.to);
            (from[1]..to[1])
                .flat_map(move |y| (from[0]..to[0]).map(move |x| (y * columns + x) as usize))
        };
        for packet in shadows.iter().flat_map(packets) {
            starts[packet + 1] += 1;
        }
        for packet in 0..count {
            starts[packet + 1] += starts[packet];
        }
        let mut next = starts.clone();
        let nothing = Meeting { near: 0.0, cell: 0 };
        let mut list = vec![nothing; starts[count] as usize];
        for shadow in &shadows {
            for packet in packets(shadow) {
                list[next[packet] as usize] = shadow.meeting;
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

    /// The list of the packet with this pixel; pixels beyond the picture's edge belong to its last
    /// packets.
    pub(super) fn at(&self, [x, y]: [u32; 2]) -> &[Meeting] {
        let column = (x / SIDE).min(self.columns - 1);
        let row = (y / SIDE).min(self.rows - 1);
        let packet = (row * self.columns + column) as usize;
        &self.list[self.starts[packet] as usize..self.starts[packet + 1] as usize]
    }
}

/// A camera, from points to places in the picture.
struct Projection {
    origin: V3<f32>,
    forward: V3<f32>,
    /// How far ahead of the eye the origin lies.
    approach: f32,
    right: V3<f32>,
    up: V3<f32>,
    orthographic: bool,
    size: [f32; 2],
}

impl Projection {
    fn of(frame: &Frame) -> Self {
        let orthographic = frame.footprint_growth == 0.0;
        let (right, up) = if orthographic {
            (frame.origin_right, frame.origin_up)
        } else {
            (frame.forward_right, frame.forward_up)
        };
        // A product with these gives the place, from -1 to 1.
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

    /// The pixels between which a box appears, or `None` if it lies behind the camera.
    fn extent(&self, region: &Region) -> Option<([f32; 2], [f32; 2])> {
        let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        let (mut before, mut behind) = (false, false);
        for corner in 0..8 {
            let axis = |i: usize| {
                if corner >> i & 1 == 0 {
                    region.low[i]
                } else {
                    region.high[i]
                }
            };
            let v = V3::of(axis(0), axis(1), axis(2)) - self.origin;
            let depth = v.dot(self.forward);
            // Rays of a parallel view begin at the camera's plane too.
            let close = if self.orthographic {
                0.0
            } else {
                1e-3 * region.side()
            };
            if depth > close {
                before = true;
            } else {
                behind = true;
            }
            let scale = if self.orthographic {
                1.0
            } else {
                1.0 / (depth + self.approach)
            };
            let (u, w) = (v.dot(self.right) * scale, v.dot(self.up) * scale);
            let place = [
                (u + 1.0) / 2.0 * self.size[0],
                (1.0 - w) / 2.0 * self.size[1],
            ];
            for axis in 0..2 {
                low[axis] = low[axis].min(place[axis]);
                high[axis] = high[axis].max(place[axis]);
            }
        }
        if !before {
            return None;
        }
        if behind && !self.orthographic {
            // It reaches through the camera's plane: it may be anywhere.
            return Some(([0.0; 2], self.size));
        }
        // Coordinates far from the origin are rounded, and so are the places.
        let slack = [0, 1].map(|axis| 0.05 + 1e-5 * (low[axis].abs() + high[axis].abs()));
        Some((
            [low[0] - slack[0], low[1] - slack[1]],
            [high[0] + slack[0], high[1] + slack[1]],
        ))
    }

    /// How far every ray goes before it can be in a box.
    fn near(&self, region: &Region) -> f32 {
        let outside = |axis: usize| {
            let at = [self.origin.x, self.origin.y, self.origin.z][axis];
            (region.low[axis] - at).max(at - region.high[axis]).max(0.0)
        };
        let near = if self.orthographic || self.approach > 0.0 {
            let (mut nearest, forward) = (0.0, self.forward);
            for (axis, way) in [forward.x, forward.y, forward.z].into_iter().enumerate() {
                let at = [self.origin.x, self.origin.y, self.origin.z][axis];
                nearest += ((region.low[axis] - at) * way).min((region.high[axis] - at) * way);
            }
            f32::max(nearest, 0.0)
        } else {
            let [x, y, z] = [0, 1, 2].map(outside);
            (x * x + y * y + z * z).sqrt()
        };
        near * (1.0 - 1e-5)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::cells::{Cut, Refine, Split, build};
    use crate::cpu::tile::camera_ray;
    use crate::frame::{Axes, Lens, View};
    use sdfc_trials::random::Random;
    use sdfc_vm::listing::parse;
    use sdfc_vm::tape::Tape;

    /// Cuts cells of unlike sizes: a quarter of those of the first level.
    struct Unlike;

    impl Refine for Unlike {
        fn cut(&self, region: &Region, _: usize, _: f32) -> bool {
            let mix = |mix: u32, v: &f32| (mix ^ v.to_bits()).wrapping_mul(0x9e37_79b1);
            let mixed = region.low.iter().fold(0, mix);
            region.side() > 0.6 || region.side() > 0.2 && mixed >> 30 == 0
        }
    }

    /// All cells of a cube around the origin.
    pub(in crate::cpu) fn cells() -> Cells {
        let program = parse("0000 sphere [0.8]\n").expect("a program");
        let region = Region {
            low: [-1.0; 3],
            high: [1.0; 3],
        };
        let cut = Cut {
            region,
            split: Split::Cube,
            band: f32::INFINITY,
            refine: &Unlike,
        };
        build(&program, &Tape::of(&program), &cut)
    }

    fn frame(view: &View, size: [u32; 2]) -> Frame {
        let [width, height] = size.map(f64::from);
        let axes = Axes::of_view(view, width / height);
        let single = |v: [f64; 3]| v.map(|v| v as f32);
        Frame {
            origin: single(axes.origin),
            origin_right: single(axes.origin_right),
            origin_up: single(axes.origin_up),
            forward: single(axes.forward),
            forward_right: single(axes.forward_right),
            forward_up: single(axes.forward_up),
            footprint_growth: match view.lens {
                Lens::Perspective(_) => 1e-3,
                Lens::Orthographic(_) => 0.0,
            },
            far: 1e3,
            size: size.map(|n| n as f32),
            ..Frame::default()
        }
    }

    /// The way along a ray to a box, if it goes through more of it than a corner.
    fn way_to(region: &Region, origin: [f32; 3], direction: [f32; 3]) -> Option<f64> {
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let ends = [region.low[axis], region.high[axis]];
            let [a, b] = ends.map(|end| f64::from(end) - f64::from(origin[axis]));
            let along = f64::from(direction[axis]);
            enter = enter.max((a / along).min(b / along));
            leave = leave.min((a / along).max(b / along));
        }
        (leave > enter + 1e-4).then_some(enter)
    }

    /// Every ray finds all leaves that it goes through on its packet's list, none farther away than it is.
    #[test]
    fn packets_list_what_their_rays_go_through() {
        let cells = cells();
        let leaves: Vec<u32> = cells.leaves().collect();
        let mut random = Random::new(17);
        let mut number = |size: f64| (random.below(2001) as f64 / 1000.0 - 1.0) * size;
        let mut found = 0;
        for turn in 0..24 {
            // From near by, from far away, and from within.
            let from = [0, 1, 2].map(|_| number([3.0, 40.0, 0.7][turn % 3]));
            let view = View {
                from,
                look: [0, 1, 2].map(|_| number(0.3)),
                up: [0.0, 1.0, 0.0],
                lens: match turn % 2 {
                    0 => Lens::Perspective([0.8, 0.06, 1.2][turn % 3]),
                    _ => Lens::Orthographic(2.5),
                },
            };
            let size = [37, 29];
            let mut frame = frame(&view, size);
            frame.offset = [0, 1].map(|_| number(0.5) as f32);
            let meetings = Meetings::of(&cells, &frame);
            for pixel in 0..size[0] * size[1] {
                let [x, y] = [pixel % size[0], pixel / size[0]];
                let ray = camera_ray(&frame, [x as f32, y as f32]);
                let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
                let listed = meetings.at([x, y]);
                for &leaf in &leaves {
                    let Some(enter) = way_to(&cells.cell(leaf).region, origin, direction) else {
                        continue;
                    };
                    found += 1;
                    let near = listed.iter().find(|meeting| meeting.cell == leaf);
                    let near = near.map(|meeting| f64::from(meeting.near));
                    assert!(
                        near.is_some_and(|near| near <= enter * (1.0 + 1e-6)),
                        "{view:?}, pixel {x} {y}: leaf {leaf} is {enter} away and listed at {near:?}"
                    );
                }
            }
        }
        assert!(found > 10_000, "only {found} leaves were met");
    }
}
