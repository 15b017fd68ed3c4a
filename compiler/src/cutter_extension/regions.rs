//! Images of a box of a cutter's part in the body's frame, and pieces of rings for revolved planes.

use super::mapped::PointSet;
use super::{AffineRows, IDENTITY, PathStep, TOUCH_TOLERANCE, compose};
use crate::analysis::bounds::inverse;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::row::BoundsRule;
use sdfc_vm::table::Op;
use std::f64::consts::{PI, TAU};

/// Maximum number of separate regions; beyond that, the box around all of them is used.
const MAX_REGIONS: usize = 64;

/// A box or a piece of a ring, in a frame of its own.
#[derive(Clone)]
pub(super) struct Region {
    /// The box; for a ring, its radii, heights and angles about the y axis.
    pub(super) bounds: Bounds,
    pub(super) is_ring: bool,
    /// The map from its frame to the body's.
    pub(super) rows: AffineRows,
    /// The maps to the frames on the path from the body to the part, by number of steps. `None` where copies
    /// make them ambiguous.
    frame_maps: Vec<Option<FrameMap>>,
}

/// A map from a region's frame to a frame on the path to the part.
#[derive(Clone)]
pub(super) struct FrameMap {
    pub(super) rows: AffineRows,
    /// True if it maps the half plane of a ring.
    pub(super) is_half_plane: bool,
}

impl Region {
    /// Returns all images of a box along a path to the body; `frame` maps to the part. `None` if a step has no
    /// bounds rule.
    pub(super) fn images_of_box(
        added_box: &Bounds,
        placement: &AffineRows,
        path: &[PathStep],
    ) -> Option<Vec<Self>> {
        let mut frame_maps = vec![None; path.len() + 1];
        frame_maps[path.len()] = Some(FrameMap {
            rows: *placement,
            is_half_plane: false,
        });
        let mut regions = vec![Self {
            bounds: *added_box,
            is_ring: false,
            rows: *placement,
            frame_maps,
        }];
        for (depth, step) in path.iter().enumerate().rev() {
            match step {
                PathStep::Map(map) => {
                    for region in &mut regions {
                        region.rows = compose(map, &region.rows);
                    }
                }
                PathStep::Copies { op, numbers } => match copy_maps(*op, numbers) {
                    Some(maps) if regions.len() * maps.len() <= MAX_REGIONS => {
                        if *op == Op::Mirror {
                            regions.retain_mut(|region| region.clip_to_mirror(numbers));
                        }
                        regions = map_regions(&regions, &maps);
                    }
                    _ => {
                        let BoundsRule::Map(rule) = op.row().facts.bounds else {
                            return None;
                        };
                        for region in &mut regions {
                            region.become_box();
                            region.bounds = rule(numbers, &region.bounds);
                            region.frame_maps.fill(None);
                        }
                    }
                },
                PathStep::Revolve(offset) => {
                    for region in &mut regions {
                        region.become_ring(*offset);
                    }
                }
                PathStep::Clip(clip) => {
                    for region in &mut regions {
                        region.clip(clip);
                    }
                }
            }
            for region in &mut regions {
                region.frame_maps[depth] = Some(FrameMap {
                    rows: region.rows,
                    is_half_plane: false,
                });
            }
        }
        Some(regions)
    }

    /// Returns the point set of these bounds, in the shape of this region.
    pub(super) fn point_set(&self, bounds: Bounds) -> PointSet {
        match self.is_ring {
            true => PointSet::Ring(bounds),
            false => PointSet::Box(bounds),
        }
    }

    /// Returns the map to the frame at a number of steps from the body, if it is known.
    pub(super) fn frame_map(&self, depth: usize) -> Option<&FrameMap> {
        self.frame_maps[depth].as_ref()
    }

    /// Returns the map to the frame of the part, if it is known.
    pub(super) fn to_part(&self) -> Option<&FrameMap> {
        self.frame_maps.last()?.as_ref()
    }

    /// Removes a span along an axis, if it covers one side of the box.
    pub(super) fn subtract_span(&mut self, axis: usize, [low, high]: [f64; 2]) {
        let (min, max) = (self.bounds.min[axis], self.bounds.max[axis]);
        let tolerance = TOUCH_TOLERANCE * min.abs().max(max.abs());
        if low <= min + tolerance && high > min {
            self.bounds.min[axis] = if high >= max - tolerance {
                f64::INFINITY
            } else {
                high
            };
        } else if high >= max - tolerance && low < max {
            self.bounds.max[axis] = low;
        }
    }

    /// Clips the region to the shown side of mirror planes across `axes`. Returns false if at most a face is
    /// left.
    fn clip_to_mirror(&mut self, axes: &[f64]) -> bool {
        let bounds = self.point_set(self.bounds).bounds().mapped(&self.rows);
        let mut shown_side = Bounds::ALL_SPACE;
        let mut is_not_flat = true;
        for axis in (0..3).filter(|&axis| axes[axis] != 0.0) {
            shown_side.min[axis] = 0.0;
            is_not_flat &= bounds.max[axis] > TOUCH_TOLERANCE * bounds.min[axis].abs();
        }
        self.clip(&shown_side);
        is_not_flat
    }

    /// Replaces the region by its bounding box in the target frame of the rows.
    fn become_box(&mut self) {
        let inverse_rows = inverse(self.rows.as_flattened()).filter(|_| !self.is_ring);
        match inverse_rows {
            Some(inverse_rows) => {
                for level in self.frame_maps.iter_mut().flatten() {
                    level.rows = compose(&level.rows, &inverse_rows);
                }
            }
            None => self.frame_maps.fill(None),
        }
        self.bounds = self.point_set(self.bounds).bounds().mapped(&self.rows);
        self.rows = IDENTITY;
        self.is_ring = false;
    }

    /// Replaces the box of a 2-D shape by the ring of its revolution about the y axis, after a shift along x.
    fn become_ring(&mut self, offset: f64) {
        self.become_box();
        let mut shift = IDENTITY;
        shift[0][3] = -offset;
        for level in self.frame_maps.iter_mut().flatten() {
            level.rows = compose(&level.rows, &shift);
            level.is_half_plane = true;
        }
        self.bounds.min[0] = (self.bounds.min[0] + offset).max(0.0);
        self.bounds.max[0] += offset;
        // The part of a profile behind the axis has no effect.
        if self.bounds.max[0]
            <= TOUCH_TOLERANCE * self.bounds.min[1].abs().max(self.bounds.max[1].abs())
        {
            self.bounds.max[0] = f64::NEG_INFINITY;
        }
        (self.bounds.min[2], self.bounds.max[2]) = (-PI, PI);
        self.is_ring = true;
    }

    /// Clips the region, at least partly, to a box in the target frame of the rows.
    fn clip(&mut self, clip: &Bounds) {
        if self.is_ring {
            return;
        }
        let is_bounded = |axis: usize| clip.min[axis].is_finite() || clip.max[axis].is_finite();
        let bounded_axes: Vec<usize> = (0..3).filter(|&axis| is_bounded(axis)).collect();
        let column_of = |axis: usize| aligned_column(&self.rows, axis);
        if !bounded_axes.iter().all(|&axis| column_of(axis).is_some()) {
            self.become_box();
            self.bounds = self.bounds.intersection(clip);
            return;
        }
        for axis in bounded_axes {
            let Some(column) = aligned_column(&self.rows, axis) else {
                continue;
            };
            let (factor, shift) = (self.rows[axis][column], self.rows[axis][3]);
            let ends = [clip.min[axis], clip.max[axis]].map(|end| (end - shift) / factor);
            let (min, max) = (&mut self.bounds.min[column], &mut self.bounds.max[column]);
            *min = min.max(ends[0].min(ends[1]));
            *max = max.min(ends[0].max(ends[1]));
        }
    }
}

/// Maps each region by each map.
fn map_regions(regions: &[Region], maps: &[AffineRows]) -> Vec<Region> {
    let images = maps.iter().flat_map(|map| {
        regions.iter().map(move |region| Region {
            rows: compose(map, &region.rows),
            ..region.clone()
        })
    });
    images.collect()
}

/// Returns the maps to both sides of the planes of a mirror across `axes`.
fn mirror_maps(axes: &[f64]) -> Vec<AffineRows> {
    let mut maps = vec![IDENTITY];
    for axis in (0..3).filter(|&axis| axes[axis] != 0.0) {
        let images = maps.clone().into_iter().map(|mut map| {
            map[axis][axis] = -1.0;
            map
        });
        maps.extend(images.collect::<Vec<_>>());
    }
    maps
}

/// Returns the maps to each copy of a grid, by its spacings, their inverses and its last cells. `None` for too many.
fn grid_maps(numbers: &[f64]) -> Option<Vec<AffineRows>> {
    let last = |axis: usize| numbers[6 + axis];
    let count: f64 = (0..3).map(|axis| last(axis) + 1.0).product();
    if !(1.0..=MAX_REGIONS as f64).contains(&count) {
        return None;
    }
    let mut maps = vec![IDENTITY];
    for axis in 0..3 {
        let shifted = |map: &AffineRows, cell: u32| {
            let mut map = *map;
            map[axis][3] = numbers[axis] * (f64::from(cell) - last(axis) / 2.0);
            map
        };
        let cells = 0..=last(axis) as u32;
        maps = cells
            .flat_map(|cell| maps.iter().map(move |map| shifted(map, cell)))
            .collect();
    }
    Some(maps)
}

/// Returns the maps to each copy of a limited or polar repetition, up to `MAX_REGIONS`, or of a mirror.
pub(super) fn copy_maps(op: Op, numbers: &[f64]) -> Option<Vec<AffineRows>> {
    if op == Op::Mirror {
        return Some(mirror_maps(numbers));
    }
    if op == Op::RepeatLimited {
        return grid_maps(numbers);
    }
    let lateral_axis = match op {
        Op::Polar => 2,
        Op::PolarPlane => 1,
        _ => return None,
    };
    let count = (TAU / numbers[0]).round();
    if !(1.0..=MAX_REGIONS as f64).contains(&count) {
        return None;
    }
    let rotation = |sector: u32| {
        let (sin, cos) = (TAU * f64::from(sector) / count).sin_cos();
        let mut rows = IDENTITY;
        (rows[0][0], rows[0][lateral_axis]) = (cos, -sin);
        (rows[lateral_axis][0], rows[lateral_axis][lateral_axis]) = (sin, cos);
        rows
    };
    Some((0..count as u32).map(rotation).collect())
}

/// Returns the inner axis that is mapped to an outer axis, if the map keeps it separate from the other axes.
pub(super) fn aligned_column(rows: &AffineRows, axis: usize) -> Option<usize> {
    let is_nonzero = |value: f64| value.abs() > 1e-9;
    let mut columns = (0..3).filter(|&column| is_nonzero(rows[axis][column]));
    let column = columns.next()?;
    let is_alone = (0..3).all(|row| row == axis || !is_nonzero(rows[row][column]));
    (columns.next().is_none() && is_alone).then_some(column)
}
