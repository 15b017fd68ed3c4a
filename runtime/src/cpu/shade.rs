//! The stage `shade`: the light that each ray brings to the eye.

use super::LANES;
use super::lanes::lanes;
use super::march::vector;
use super::tile::{Tile, camera_ray};
use sdfc_shaders::features::Features;
use sdfc_shaders::layout::{Frame, Light, Surface};
use sdfc_shaders::marching::SHOWN;
use sdfc_shaders::{camera, normals, reflectance, sky};
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;
use sdfc_vm::widest;

lanes! {
    /// 64 lit points.
    Lit {
        x, y, z, normal_x, normal_y, normal_z, direction_x, direction_y, direction_z, way,
        red, green, blue, roughness, metallic, emitted_red, emitted_green, emitted_blue,
        open, arriving, diffuse_red, diffuse_green, diffuse_blue, light_red, light_green, light_blue,
    }
}

/// A vector of three columns' numbers in a lane.
macro_rules! at {
    ($b:ident, $lane:expr, $x:ident, $y:ident, $z:ident) => {
        V3::of($b.$x.0[$lane], $b.$y.0[$lane], $b.$z.0[$lane])
    };
}

/// Puts a vector into three columns of a lane.
macro_rules! put {
    ($b:ident, $lane:expr, $x:ident, $y:ident, $z:ident, $v:expr) => {
        let v = $v;
        $b.$x.0[$lane] = v.x;
        $b.$y.0[$lane] = v.y;
        $b.$z.0[$lane] = v.z;
    };
}

/// Adds the light of a pass to the tile.
pub(super) fn shade(frame: &Frame, features: &Features, lights: &[Light], tile: &mut Tile) {
    let below = vector(if features.fog {
        frame.sky_horizon
    } else {
        frame.sky_ground
    });
    for (i, color) in tile.colors.iter_mut().enumerate() {
        if tile.rays[i].status & SHOWN == 0 {
            let direction = camera_ray(frame, tile.pixels[i]).direction;
            add(color, background(frame, direction, below, 0.0), 0.0);
        }
    }
    let mut lit = Lit::default();
    for items in tile.shown.chunks(LANES) {
        for (lane, &item) in items.iter().enumerate() {
            let i = item as usize;
            let normal = vector(tile.normals[i]);
            let (surface, normal) = if features.materials {
                let surface = tile.surfaces[i];
                (
                    surface,
                    normals::bumped::<f32>(normal, vector(surface.bump)),
                )
            } else {
                (only_surface(frame), normal)
            };
            put!(lit, lane, x, y, z, tile.points[i]);
            put!(lit, lane, normal_x, normal_y, normal_z, normal);
            let camera = camera_ray(frame, tile.pixels[i]);
            let direction = camera.direction;
            put!(lit, lane, direction_x, direction_y, direction_z, direction);
            lit.way.0[lane] = tile.rays[i].t + camera.beyond + frame.approach;
            put!(lit, lane, red, green, blue, vector(surface.albedo));
            lit.roughness.0[lane] = surface.roughness;
            lit.metallic.0[lane] = surface.metallic;
            let emission = vector(surface.emission);
            put!(
                lit,
                lane,
                emitted_red,
                emitted_green,
                emitted_blue,
                emission
            );
            lit.open.0[lane] = if features.occlusion.taps() > 0 {
                tile.open[i]
            } else {
                1.0
            };
        }
        around(frame, &mut lit);
        for (light, arriving) in lights.iter().zip(&tile.arriving) {
            for (lane, &item) in items.iter().enumerate() {
                lit.arriving.0[lane] = arriving[item as usize];
            }
            from_lamp(light, &mut lit);
        }
        if features.fog {
            through_air(frame, &mut lit);
        }
        for (lane, &item) in items.iter().enumerate() {
            let light = at!(lit, lane, light_red, light_green, light_blue);
            add(&mut tile.colors[item as usize], light, 1.0);
        }
    }
}

/// Adds a sample to a sum.
pub(super) fn add(sum: &mut [f32; 4], color: V3<f32>, coverage: f32) {
    for (total, part) in sum.iter_mut().zip([color.x, color.y, color.z, coverage]) {
        *total += part;
    }
}

/// The surface of a scene that has only one.
pub(super) fn only_surface(frame: &Frame) -> Surface {
    Surface {
        albedo: frame.albedo,
        roughness: frame.roughness,
        emission: frame.emission,
        metallic: frame.metallic,
        bump: [0.0; 3],
        id: frame.id,
    }
}

#[inline(always)]
fn background(f: &Frame, direction: V3<f32>, below: V3<f32>, blur: f32) -> V3<f32> {
    let (top, horizon) = (vector(f.sky_top), vector(f.sky_horizon));
    sky::sky::<f32>(direction, vector(f.sky_up), top, horizon, below, blur)
}

widest! {
    /// What the surfaces give off and send on of the sky's light.
    fn around(f: &Frame, b: &mut Lit) = around_body;
}

#[inline(always)]
fn around_body(f: &Frame, b: &mut Lit) {
    let (top, horizon, ground) = (
        vector(f.sky_top),
        vector(f.sky_horizon),
        vector(f.sky_ground),
    );
    for i in 0..LANES {
        let normal = at!(b, i, normal_x, normal_y, normal_z);
        let direction = at!(b, i, direction_x, direction_y, direction_z);
        let albedo = at!(b, i, red, green, blue);
        let (roughness, metallic) = (b.roughness.0[i], b.metallic.0[i]);
        let around = sky::sky_on::<f32>(normal, vector(f.sky_up), top, horizon, ground);
        let mirrored = reflectance::mirror::<f32>(direction, normal);
        let ahead = background(f, mirrored, ground, roughness);
        let diffuse = reflectance::diffuse::<f32>(normal, -direction, albedo, roughness, metallic);
        put!(b, i, diffuse_red, diffuse_green, diffuse_blue, diffuse);
        let sent = reflectance::ambient::<f32>(
            normal,
            -direction,
            albedo,
            diffuse,
            roughness,
            metallic,
            around,
            ahead,
            b.open.0[i],
        );
        let emitted = at!(b, i, emitted_red, emitted_green, emitted_blue);
        put!(
            b,
            i,
            light_red,
            light_green,
            light_blue,
            emitted + sent * f.ambient
        );
    }
}

widest! {
    /// What the surfaces send on of a lamp's light.
    fn from_lamp(lamp: &Light, b: &mut Lit) = from_lamp_body;
}

#[inline(always)]
fn from_lamp_body(lamp: &Light, b: &mut Lit) {
    let color = vector(lamp.color);
    for i in 0..LANES {
        let to_place = vector(lamp.place) - at!(b, i, x, y, z) * lamp.near;
        let faded = reflectance::attenuation(to_place.length());
        let strength = if lamp.near > 0.0 { faded } else { 1.0 };
        let strength = strength * b.arriving.0[i];
        let sent = reflectance::reflected::<f32>(
            at!(b, i, normal_x, normal_y, normal_z),
            -at!(b, i, direction_x, direction_y, direction_z),
            camera::unit::<f32>(to_place),
            at!(b, i, red, green, blue),
            at!(b, i, diffuse_red, diffuse_green, diffuse_blue),
            b.roughness.0[i],
            b.metallic.0[i],
        );
        let light = at!(b, i, light_red, light_green, light_blue);
        put!(
            b,
            i,
            light_red,
            light_green,
            light_blue,
            light + color * strength * sent
        );
    }
}

widest! {
    /// What of that reaches the eye through the air.
    fn through_air(f: &Frame, b: &mut Lit) = through_air_body;
}

#[inline(always)]
fn through_air_body(f: &Frame, b: &mut Lit) {
    let horizon = vector(f.sky_horizon);
    for i in 0..LANES {
        let light = at!(b, i, light_red, light_green, light_blue);
        let hidden = sky::hidden_by_fog(b.way.0[i], f.fog);
        put!(
            b,
            i,
            light_red,
            light_green,
            light_blue,
            light + (horizon - light) * hidden
        );
    }
}
