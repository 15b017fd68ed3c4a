//! Tiles: a square of the picture, with what each stage leaves for the next ones.

use super::lanes::stream;
use super::march::{March, Polish, vector};
use super::occlusion::Look;
use super::{Evaluator, Field, normal, shade, shadow, show};
use crate::frame::{Frame, Picture, Status};
use rayon::prelude::*;
use sdfc_shaders::assemble::{Stage, stages};
use sdfc_shaders::camera;
use sdfc_shaders::features::{Features, Mode, Occlusion};
use sdfc_shaders::layout::{self, Ray, Surface};
use sdfc_shaders::marching::SHOWN;
use sdfc_vm::vector::{V2, V3};
use std::sync::{Mutex, PoisonError};

/// Pixels along a side of a tile: enough rays to keep the lanes full, few enough that every core
/// gets many tiles.
const SIDE: u32 = 32;

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
    /// Where the surfaces are.
    pub(super) points: Vec<V3<f32>>,
    pub(super) normals: Vec<[f32; 3]>,
    pub(super) surfaces: Vec<Surface>,
    /// What arrives of each light.
    pub(super) arriving: Vec<Vec<f32>>,
    /// What is seen of the sky.
    pub(super) open: Vec<f32>,
    /// The sum of all passes.
    pub(super) colors: Vec<[f32; 4]>,
}

/// Where a pixel's ray starts and which way it goes.
pub(super) struct Camera {
    pub(super) origin: V3<f32>,
    pub(super) direction: V3<f32>,
}

/// The ray of a pixel.
pub(super) fn camera_ray(f: &layout::Frame, [x, y]: [f32; 2]) -> Camera {
    let pair = |[x, y]: [f32; 2]| V2 { x, y };
    let place = camera::place_in_view::<f32>(V2 { x, y }, pair(f.offset), pair(f.size));
    let (right, up) = (vector(f.origin_right), vector(f.origin_up));
    let origin = camera::across::<f32>(place, vector(f.origin), right, up);
    let (right, up) = (vector(f.forward_right), vector(f.forward_up));
    let way = camera::across::<f32>(place, vector(f.forward), right, up);
    Camera {
        origin,
        direction: camera::unit::<f32>(way),
    }
}

impl Tile {
    fn place(&mut self, corner: [u32; 2], picture: &Picture) {
        [self.left, self.upper] = corner;
        let room = [0, 1].map(|axis| picture.size[axis] - corner[axis]);
        self.kept = room.map(|room| room.min(SIDE));
        let more = u32::from(picture.features.mode == Mode::Edges);
        [self.width, self.height] = [0, 1].map(|axis| room[axis].min(SIDE + more));
        let count = (self.width * self.height) as usize;
        self.order.clear();
        let blocks = |side: u32| (0..side).step_by(8);
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
        stages: &[Stage],
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        let features = &picture.features;
        let mut evaluations = 0;
        for stage in stages {
            evaluations += match stage {
                Stage::March => self.march(f, evaluator),
                Stage::Polish => self.polish(f, evaluator),
                Stage::Normal => normal::find(f, features.normals, self, evaluator),
                Stage::Surface => normal::surfaces(self, evaluator),
                Stage::Shadow => {
                    let forms = features.lights.iter().zip(&picture.lights).enumerate();
                    forms
                        .map(|(i, (&form, light))| shadow::cast(f, light, i, form, self, evaluator))
                        .sum()
                }
                Stage::Occlusion => self.look_around(f, features, evaluator),
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
                Stage::Plane => show::plane(f, features, self, evaluator),
                Stage::Resolve => 0,
            };
        }
        evaluations
    }

    fn march(&mut self, frame: &layout::Frame, evaluator: &mut dyn Evaluator) -> u64 {
        let mut walk = March {
            frame,
            pixels: &self.pixels,
            rays: &mut self.rays,
        };
        let evaluations = stream(&mut walk, evaluator, &self.order);
        self.shown.clear();
        let rays = &self.rays;
        let shown = self
            .order
            .iter()
            .filter(|&&i| rays[i as usize].status & SHOWN != 0);
        self.shown.extend(shown);
        self.find_points(frame);
        evaluations
    }

    fn polish(&mut self, frame: &layout::Frame, evaluator: &mut dyn Evaluator) -> u64 {
        let mut walk = Polish {
            frame,
            pixels: &self.pixels,
            rays: &mut self.rays,
        };
        let evaluations = stream(&mut walk, evaluator, &self.shown);
        self.find_points(frame);
        evaluations
    }

    fn find_points(&mut self, frame: &layout::Frame) {
        for &item in &self.shown {
            let i = item as usize;
            let Camera { origin, direction } = camera_ray(frame, self.pixels[i]);
            self.points[i] = camera::along::<f32>(origin, direction, self.rays[i].t);
        }
    }

    fn look_around(
        &mut self,
        frame: &layout::Frame,
        features: &Features,
        evaluator: &mut dyn Evaluator,
    ) -> u64 {
        macro_rules! look {
            ($many:literal) => {{
                let mut walk = Look::<$many> {
                    frame,
                    taps: features.occlusion.taps(),
                    pixels: &self.pixels,
                    points: &self.points,
                    rays: &self.rays,
                    normals: &self.normals,
                    open: &mut self.open,
                };
                stream(&mut walk, evaluator, &self.shown)
            }};
        }
        match features.occlusion {
            Occlusion::Off => 0,
            Occlusion::FiveTap => look!(false),
            Occlusion::Multi(_) => look!(true),
        }
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
    fn copy_ends(&self, features: &Features, only_id: f32, frame: &mut Frame) {
        for (i, at) in self.kept(frame.width) {
            let ray = &self.rays[i];
            let status = Status::of(ray.status);
            frame.status[at] = status;
            frame.steps[at] = ray.steps;
            frame.stats.count(status);
            if ray.status & SHOWN == 0 {
                continue;
            }
            frame.depth[at] = ray.t;
            frame.normal[at] = self.normals[i];
            let id = if features.materials {
                self.surfaces[i].id
            } else {
                only_id
            };
            frame.id[at] = id as u32;
        }
    }

    /// Counts the rays of a later pass.
    fn count(&self, frame: &mut Frame) {
        for (i, _) in self.kept(frame.width) {
            frame.stats.count(Status::of(self.rays[i].status));
        }
    }

    fn copy_colors(&self, samples: u32, frame: &mut Frame) {
        for (i, at) in self.kept(frame.width) {
            frame.color[at] = self.colors[i].map(|sum| sum / samples as f32);
        }
    }
}

/// Computes a picture, tile by tile.
pub(super) fn render(
    field: &dyn Field,
    picture: &Picture,
    progress: &(dyn Fn(f32) + Sync),
) -> Frame {
    let stages = stages(&picture.features);
    let sides = picture.size.map(|side| (0..side).step_by(SIDE as usize));
    let [columns, rows] = sides;
    let corners: Vec<[u32; 2]> = rows
        .flat_map(|y| columns.clone().map(move |x| [x, y]))
        .collect();
    let frame = Mutex::new((picture.blank(), 0_usize));
    corners.par_iter().with_max_len(1).for_each_init(
        || (Tile::default(), field.evaluator()),
        |(tile, evaluator), &corner| {
            tile.place(corner, picture);
            let mut evaluations = 0;
            let mut done = 0;
            for sample in 0..picture.passes() {
                let pass = picture.pass(sample);
                evaluations += tile.add(&pass, picture, &stages, &mut **evaluator);
                let mut shared = frame.lock().unwrap_or_else(PoisonError::into_inner);
                let (frame, tiles) = &mut *shared;
                if sample == 0 {
                    tile.copy_ends(&picture.features, picture.uniforms.id, frame);
                } else {
                    tile.count(frame);
                }
                if sample + 1 == picture.passes() {
                    tile.copy_colors(picture.passes(), frame);
                    frame.stats.evaluations += evaluations;
                    *tiles += 1;
                    done = *tiles;
                }
            }
            progress(done as f32 / corners.len() as f32);
        },
    );
    frame.into_inner().unwrap_or_else(PoisonError::into_inner).0
}
