//! Tiles: a square of the picture, with what each stage leaves for the next ones.

use super::beam::Beams;
use super::figure::Plane;
use super::lanes::stream;
use super::march::{March, Polish, vector};
use super::meet::{self, Meetings};
use super::packet::{Marcher, NO_LEAF};
use super::{Evaluator, Field, LANES, normal, occlusion, shade, shadow, show};
use crate::cells::{Cells, Region};
use crate::crew::share;
use crate::frame::{Frame, Picture, Progress, Samples, Status};
use sdfc_shaders::assemble::{Stage, stages};
use sdfc_shaders::features::{Mode, Occlusion};
use sdfc_shaders::layout::{self, Ray, Surface};
use sdfc_shaders::marching::{SHOWN, UNDECIDED};
use sdfc_shaders::{beam, camera};
use sdfc_vm::vector::{V2, V3};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Pixels along a side of a tile, as long as every core gets [`ENOUGH`] of them: points that are asked
/// about together share cells. Ten thousand boxes take a tenth more time with tiles of 32.
const SIDE: u32 = 64;
/// The same where a picture is small.
const SMALL_SIDE: u32 = 32;
/// So many tiles for each core keep all busy to the end.
const ENOUGH: u32 = 16;

/// Pixels along the sides of a picture's tiles.
fn side_of(picture: &Picture) -> u32 {
    let [columns, rows] = picture.size.map(|side| side.div_ceil(SIDE));
    let enough = columns.saturating_mul(rows) >= ENOUGH * rayon::current_num_threads() as u32;
    if enough { SIDE } else { SMALL_SIDE }
}

/// A square of the picture. Lists are by pixel, row after row; items are places in them.
#[derive(Default)]
pub(super) struct Tile {
    left: u32,
    upper: u32,
    /// Pixels in a row that are computed; lines between pixels need one more than is kept.
    pub(super) width: u32,
    /// Rows that are computed.
    pub(super) height: u32,
    kept: [u32; 2],
    /// All places, in blocks of 8 × 8 so that rays that run together are neighbours.
    order: Vec<u32>,
    /// The places where there is a surface, in that order.
    pub(super) shown: Vec<u32>,
    /// Which pixels they are.
    pub(super) pixels: Vec<[f32; 2]>,
    pub(super) rays: Vec<Ray>,
    /// How far the rays of each block of pixels can go together, block row after block row.
    beams: Vec<layout::Beam>,
    /// Whether the rays' ends and the normals are known without marching.
    known: bool,
    /// The leaf of cells in which each ray ended, if they went through cells.
    pub(super) leaves: Vec<u32>,
    /// Where the surfaces are.
    pub(super) points: Vec<V3<f32>>,
    pub(super) normals: Vec<[f32; 3]>,
    /// The points just outside of them, where gradients are taken.
    pub(super) outside: Vec<V3<f32>>,
    /// The lengths of the gradients there, where occlusion reads them.
    pub(super) slopes: Vec<f32>,
    pub(super) surfaces: Vec<Surface>,
    /// What arrives of each light.
    pub(super) arriving: Vec<Vec<f32>>,
    /// What is seen of the sky.
    pub(super) open: Vec<f32>,
    /// The sum of all passes.
    pub(super) colors: Vec<[f32; 4]>,
    marcher: Marcher,
}

/// The cells of a picture, and which of them its rays may meet.
struct Way {
    cells: Arc<Cells>,
    meetings: Meetings,
}

/// Where a pixel's ray starts and which way it goes.
pub(super) struct Camera {
    pub(super) origin: V3<f32>,
    pub(super) direction: V3<f32>,
    /// How much farther from the eye it starts than the ray in the middle of the picture does.
    pub(super) beyond: f32,
}

/// How far from the eye a pixel's ray has come.
pub(crate) fn from_eye(f: &layout::Frame, at: [f32; 2], t: f32) -> f32 {
    // Nearly always rays start at the eye.
    if f.approach == 0.0 {
        return t;
    }
    t + camera_ray(f, at).beyond + f.approach
}

/// Whether a pixel's ray, if it meets nothing, ends because it goes no farther than `far`, and not
/// because there is nothing more of the scene.
pub(crate) fn ends_at_far(f: &layout::Frame, at: [f32; 2]) -> bool {
    let camera = camera_ray(f, at);
    let (low, high) = (vector(f.bounds_min), vector(f.bounds_max));
    let all = camera::crossing::<f32>(camera.origin, camera.direction, low, high, f32::MAX);
    all.x <= f.far && f.far < all.y
}

/// The ray of a pixel.
#[inline(always)]
pub(super) fn camera_ray(f: &layout::Frame, [x, y]: [f32; 2]) -> Camera {
    let pair = |[x, y]: [f32; 2]| V2 { x, y };
    let place = camera::place_in_view::<f32>(V2 { x, y }, pair(f.offset), pair(f.size));
    let (right, up) = (vector(f.origin_right), vector(f.origin_up));
    let origin = camera::across::<f32>(place, vector(f.origin), right, up);
    let (right, up) = (vector(f.forward_right), vector(f.forward_up));
    let side = camera::across::<f32>(place, V3::of(0.0, 0.0, 0.0), right, up);
    let way = camera::across::<f32>(place, vector(f.forward), right, up);
    Camera {
        origin,
        direction: camera::unit::<f32>(way),
        beyond: camera::way_beyond::<f32>(side, f.approach),
    }
}

impl Tile {
    fn place(&mut self, corner: [u32; 2], picture: &Picture) {
        [self.left, self.upper] = corner;
        let room = [0, 1].map(|axis| picture.size[axis] - corner[axis]);
        let side = side_of(picture);
        self.kept = room.map(|room| room.min(side));
        let more = u32::from(picture.features.mode == Mode::Edges);
        [self.width, self.height] = [0, 1].map(|axis| room[axis].min(side + more));
        let count = (self.width * self.height) as usize;
        self.order.clear();
        let blocks = |side: u32| (0..side).step_by(8);
        // The order of packets, when rays go through cells.
        for (y0, x0) in blocks(self.height).flat_map(|y| blocks(self.width).map(move |x| (y, x))) {
            for y in y0..(y0 + 8).min(self.height) {
                let row = y * self.width;
                self.order
                    .extend((x0..(x0 + 8).min(self.width)).map(|x| row + x));
            }
        }
        self.pixels.clear();
        for y in self.upper..self.upper + self.height {
            let row = self.left..self.left + self.width;
            self.pixels.extend(row.map(|x| [x as f32, y as f32]));
        }
        self.rays.resize(count, Ray::default());
        self.points.resize(count, V3::default());
        self.normals.resize(count, [0.0; 3]);
        self.outside.resize(count, V3::default());
        self.slopes.clear();
        let slopes = if picture.features.occlusion == Occlusion::Off {
            0
        } else {
            count
        };
        self.slopes.resize(slopes, 1.0);
        self.surfaces.resize(count, Surface::default());
        self.open.resize(count, 1.0);
        self.arriving.resize(picture.lights.len(), Vec::new());
        for visibility in &mut self.arriving {
            visibility.resize(count, 1.0);
        }
        self.colors.clear();
        self.colors.resize(count, [0.0; 4]);
    }

    /// Adds a pass over subpixels; gives the number of evaluations.
    fn add(
        &mut self,
        f: &layout::Frame,
        picture: &Picture,
        (stages, way, figure): (&[Stage], Option<&Way>, Option<&[f32]>),
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        let features = &picture.features;
        let mut evaluations = 0;
        for stage in stages {
            evaluations += match stage {
                // The march finds them where it needs them.
                Stage::Beam => 0,
                Stage::March => self.march(f, way, evaluator),
                Stage::Polish | Stage::Normal if self.known => 0,
                Stage::Polish => self.polish(f, evaluator),
                Stage::Normal => normal::find(f, features.normals, self, evaluator),
                Stage::Surface => normal::surfaces(f, self, evaluator),
                Stage::Shadow => {
                    let forms = features.lights.iter().zip(&picture.lights).enumerate();
                    forms
                        .map(|(i, (&form, light))| shadow::cast(f, light, i, form, self, evaluator))
                        .sum()
                }
                Stage::Occlusion => occlusion::look_around(f, features, self, evaluator),
                Stage::Shade => {
                    shade::shade(f, features, &picture.lights, self);
                    0
                }
                Stage::View => {
                    show::view(f, features, self);
                    0
                }
                Stage::Edges => {
                    show::edges(f, features, self);
                    0
                }
                Stage::Plane => show::plane(f, features, self, figure, evaluator),
            };
        }
        evaluations
    }

    /// Finds how far the rays of each block can go together.
    fn find_beams(&mut self, frame: &layout::Frame, evaluator: &mut dyn Evaluator) -> u64 {
        let [columns, rows] = [self.width, self.height].map(|side| side.div_ceil(beam::SIDE));
        self.beams.clear();
        self.beams
            .resize((columns * rows) as usize, layout::Beam::default());
        let items: Vec<u32> = (0..columns * rows).collect();
        let mut walk = Beams {
            frame,
            corner: [self.left, self.upper],
            columns,
            beams: &mut self.beams,
        };
        stream(&mut walk, evaluator, &items)
    }

    fn march(
        &mut self,
        frame: &layout::Frame,
        way: Option<&Way>,
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        self.leaves.clear();
        let known = evaluator.ends(frame, &self.pixels, &mut self.rays, &mut self.normals);
        self.known = known.is_some();
        let evaluations = match (known, way) {
            (Some(evaluations), _) => evaluations,
            (None, Some(way)) => {
                self.leaves.resize(self.rays.len(), NO_LEAF);
                self.march_packets(frame, way, evaluator)
            }
            (None, None) => {
                let for_beams = self.find_beams(frame, evaluator);
                let mut walk = March {
                    frame,
                    pixels: &self.pixels,
                    rays: &mut self.rays,
                    beams: &self.beams,
                    columns: self.width.div_ceil(beam::SIDE),
                    width: self.width,
                };
                for_beams + stream(&mut walk, evaluator, &self.order)
            }
        };
        self.shown.clear();
        let rays = &self.rays;
        let shown = self
            .order
            .iter()
            .filter(|&&i| rays[i as usize].status & SHOWN != 0);
        self.shown.extend(shown);
        if way.is_none() || self.known {
            let shown = std::mem::take(&mut self.shown);
            self.find_points(frame, &shown);
            self.shown = shown;
        }
        evaluations
    }

    fn march_packets(
        &mut self,
        frame: &layout::Frame,
        way: &Way,
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        let mut evaluations = 0;
        let side = |length: u32, block: u32| (length - block * meet::SIDE).min(meet::SIDE);
        let mut rest = self.order.as_slice();
        for row in 0..self.height.div_ceil(meet::SIDE) {
            for column in 0..self.width.div_ceil(meet::SIDE) {
                let count = side(self.width, column) * side(self.height, row);
                let (items, others) = rest.split_at(count as usize);
                rest = others;
                let x = self.left + column * meet::SIDE;
                let y = self.upper + row * meet::SIDE;
                evaluations += self.marcher.march(
                    frame,
                    (&way.cells, way.meetings.at([x, y])),
                    items,
                    &self.pixels,
                    (&mut self.rays, &mut self.points, &mut self.leaves),
                    evaluator,
                );
            }
        }
        evaluations
    }

    fn polish(&mut self, frame: &layout::Frame, evaluator: &mut dyn Evaluator) -> u64 {
        let items = std::mem::take(&mut self.shown);
        let mut walk = Polish {
            frame,
            pixels: &self.pixels,
            rays: &mut self.rays,
        };
        let evaluations = stream(&mut walk, evaluator, &items);
        self.find_points(frame, &items);
        self.shown = items;
        evaluations
    }

    fn find_points(&mut self, frame: &layout::Frame, items: &[u32]) {
        for &item in items {
            let i = item as usize;
            let Camera {
                origin, direction, ..
            } = camera_ray(frame, self.pixels[i]);
            self.points[i] = camera::along::<f32>(origin, direction, self.rays[i].t);
        }
    }

    /// The boxes around the points of each 64 places, larger by `reach`.
    pub(super) fn regions_of(&self, items: &[u32], reach: f32) -> Vec<Region> {
        let region = |items: &[u32]| {
            let mut region = normal::around(items.iter().map(|&item| self.points[item as usize]));
            region.low = region.low.map(|v| v - reach);
            region.high = region.high.map(|v| v + reach);
            region
        };
        items.chunks(LANES).map(region).collect()
    }

    /// The places that are kept, and where they are in the whole picture.
    fn kept(&self, width: usize) -> impl Iterator<Item = (usize, usize)> {
        let (left, upper) = (self.left as usize, self.upper as usize);
        let tile_width = self.width as usize;
        let [columns, rows] = self.kept.map(|n| n as usize);
        (0..rows).flat_map(move |y| {
            (0..columns).map(move |x| (y * tile_width + x, (upper + y) * width + left + x))
        })
    }

    /// Copies what the first pass found.
    fn copy_ends(&self, picture: &Picture, frame: &mut Frame) {
        for (i, at) in self.kept(frame.width) {
            let ray = &self.rays[i];
            let status = Status::of(ray.status);
            frame.status[at] = status;
            frame.steps[at] = ray.steps;
            frame
                .stats
                .count(status, || ends_at_far(&picture.uniforms, self.pixels[i]));
            frame.stats.undecided += u64::from(ray.status & UNDECIDED != 0);
            if ray.status & SHOWN == 0 {
                continue;
            }
            frame.depth[at] = from_eye(&picture.uniforms, self.pixels[i], ray.t);
            frame.normal[at] = self.normals[i];
            let id = if picture.features.materials {
                self.surfaces[i].id
            } else {
                picture.uniforms.id
            };
            frame.id[at] = id as u32;
        }
    }

    /// Counts the rays of a later pass.
    fn count(&self, pass: &layout::Frame, frame: &mut Frame) {
        for (i, _) in self.kept(frame.width) {
            let status = self.rays[i].status;
            let at_far = || ends_at_far(pass, self.pixels[i]);
            frame.stats.count(Status::of(status), at_far);
            frame.stats.undecided += u64::from(status & UNDECIDED != 0);
        }
    }

    /// Goes on from the sums of earlier passes.
    fn take_colors(&mut self, frame: &Frame) {
        let mut colors = std::mem::take(&mut self.colors);
        for (i, at) in self.kept(frame.width) {
            colors[i] = frame.color[at];
        }
        self.colors = colors;
    }

    fn copy_colors(&self, samples: u32, frame: &mut Frame) {
        for (i, at) in self.kept(frame.width) {
            frame.color[at] = self.colors[i].map(|sum| sum / samples as f32);
        }
    }
}

/// The plane of a pass that sees it face on along parallel rays, and how far from zero the field may
/// be anything.
pub(super) fn face_on(frame: &layout::Frame, picture: &Picture) -> Option<(Plane, f32)> {
    if frame.footprint_growth != 0.0 {
        return None;
    }
    let at = |x: f32, y: f32| {
        let Camera {
            origin, direction, ..
        } = camera_ray(frame, [x, y]);
        let (centre, forward) = (vector(frame.centre), vector(frame.forward));
        let t = camera::meet_plane::<f32>(origin, direction, centre, forward);
        camera::along::<f32>(origin, direction, t)
    };
    // From one edge to the other, so that the rounding of one pixel is not multiplied.
    let [width, height] = picture.size.map(|n| n as f32);
    let first = at(0.0, 0.0);
    let plane = Plane {
        first: first.to_array(),
        right: ((at(width, 0.0) - first) * (1.0 / width)).to_array(),
        down: ((at(0.0, height) - first) * (1.0 / height)).to_array(),
        size: picture.size.map(|n| n as usize),
    };
    let band = picture.band.unwrap_or(match picture.features.mode {
        Mode::Distance => f32::INFINITY,
        // A pixel is wholly inside or outside where the surface is more than its size away.
        _ => 4.0 * frame.footprint * (frame.samples as f32).sqrt(),
    });
    Some((plane, band))
}

/// The tiles' corners.
fn corners(picture: &Picture) -> Vec<[u32; 2]> {
    let step = side_of(picture) as usize;
    let [columns, rows] = picture.size.map(|length| (0..length).step_by(step));
    rows.flat_map(|y| columns.clone().map(move |x| [x, y]))
        .collect()
}

/// The cells of a picture, and which of them rays meet.
fn way(field: &dyn Field, picture: &Picture) -> Option<Way> {
    let cells = field.cells(picture)?;
    let meetings = Meetings::of(&cells, &picture.uniforms);
    Some(Way { cells, meetings })
}

/// Computes where the surface is, tile by tile.
pub(super) fn geometry(field: &dyn Field, picture: &Picture) -> super::Geometry {
    let corners = corners(picture);
    let way = way(field, picture);
    let [width, height] = picture.size.map(|n| n as usize);
    let found = Mutex::new(super::Geometry {
        depth: vec![f32::INFINITY; width * height],
        normal: vec![[0.0; 3]; width * height],
    });
    share(
        corners.len(),
        || {
            let cells = way.as_ref().map(|way| &*way.cells);
            (Tile::default(), field.evaluator(picture, cells))
        },
        |(tile, evaluator), number| {
            tile.place(corners[number], picture);
            let stages = [Stage::Beam, Stage::March, Stage::Polish, Stage::Normal];
            let todo = (stages.as_slice(), way.as_ref(), None);
            tile.add(&picture.uniforms, picture, todo, &mut **evaluator);
            let mut found = found.lock().unwrap_or_else(PoisonError::into_inner);
            for (i, at) in tile.kept(width) {
                if tile.rays[i].status & SHOWN != 0 {
                    let t = tile.rays[i].t;
                    found.depth[at] = from_eye(&picture.uniforms, tile.pixels[i], t);
                    found.normal[at] = tile.normals[i];
                }
            }
        },
    );
    found.into_inner().unwrap_or_else(PoisonError::into_inner)
}

/// Computes a picture, tile by tile.
pub(super) fn render(
    field: &dyn Field,
    picture: &Picture,
    samples: Samples<'_>,
    progress: &dyn Progress,
) -> Option<Frame> {
    let (passes, begun) = samples.begin(picture);
    let (first, end) = (passes.start, passes.end);
    if passes.is_empty() {
        return Some(begun);
    }
    let stages = stages(&picture.features);
    let corners = corners(picture);
    let way = if stages.contains(&Stage::March) {
        way(field, picture)
    } else {
        None
    };
    let figures: Vec<Option<Vec<f32>>> = passes
        .clone()
        .map(|sample| {
            let (plane, band) = if stages.contains(&Stage::Plane) {
                face_on(&picture.pass(sample), picture)?
            } else {
                return None;
            };
            field.figure(picture, &plane, band)
        })
        .collect();
    let frame = Mutex::new((begun, 0_usize));
    let stopped = AtomicBool::new(false);
    share(
        corners.len(),
        || {
            let cells = way.as_ref().map(|way| &*way.cells);
            (Tile::default(), field.evaluator(picture, cells))
        },
        |(tile, evaluator), number| {
            if stopped.load(Ordering::Relaxed) {
                return;
            }
            tile.place(corners[number], picture);
            if first > 0 {
                tile.take_colors(&frame.lock().unwrap_or_else(PoisonError::into_inner).0);
            }
            let mut evaluations = 0;
            let mut done = 0;
            for sample in passes.clone() {
                let pass = picture.pass(sample);
                let figure = figures[(sample - first) as usize].as_deref();
                let todo = (stages.as_slice(), way.as_ref(), figure);
                evaluations += tile.add(&pass, picture, todo, &mut **evaluator);
                let mut shared = frame.lock().unwrap_or_else(PoisonError::into_inner);
                let (frame, tiles) = &mut *shared;
                if sample == 0 {
                    tile.copy_ends(picture, frame);
                } else {
                    tile.count(&pass, frame);
                }
                if sample + 1 == end {
                    tile.copy_colors(end, frame);
                    frame.stats.evaluations += evaluations;
                    *tiles += 1;
                    done = *tiles;
                }
            }
            if progress
                .is_at(done as f32 / corners.len() as f32)
                .is_break()
            {
                stopped.store(true, Ordering::Relaxed);
            }
        },
    );
    let (frame, _) = frame.into_inner().unwrap_or_else(PoisonError::into_inner);
    (!stopped.into_inner()).then_some(frame)
}
