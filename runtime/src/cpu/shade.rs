//! The stage `shade`: the light that each ray carries to the camera.

use super::LANES;
use super::ray_tasks::{lane_vector, lanes, set_lane_vector};
use super::tile::Tile;
use crate::render::ray::vector;
use sdfc_shaders::features::Features;
use sdfc_shaders::layout::{FrameUniforms, LightRecord, Surface};
use sdfc_shaders::marching::SHOWN;
use sdfc_shaders::{camera, normals, reflectance, sky};
use sdfc_vm::multiversion;
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;

lanes! {
    /// 64 lit points.
    Lit {
        x, y, z, normal_x, normal_y, normal_z, direction_x, direction_y, direction_z, distance,
        red, green, blue, roughness, metallic, emitted_red, emitted_green, emitted_blue,
        sky_visibility, light_visibility, diffuse_red, diffuse_green, diffuse_blue, light_red, light_green, light_blue,
    }
}

/// Adds the light of a sample to the tile.
pub(super) fn shade(
    frame: &FrameUniforms,
    features: &Features,
    lights: &[LightRecord],
    tile: &mut Tile,
) {
    let ground = vector(if features.fog {
        frame.sky_horizon
    } else {
        frame.sky_ground
    });
    for (i, color) in tile.colors.iter_mut().enumerate() {
        if tile.rays[i].status & SHOWN == 0 {
            let direction = tile.camera_rays[i].direction;
            add_sample(color, background(frame, direction, ground, 0.0), 0.0);
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
                (uniform_surface(frame), normal)
            };
            set_lane_vector!(lit, lane, x, y, z, tile.points[i]);
            set_lane_vector!(lit, lane, normal_x, normal_y, normal_z, normal);
            let camera = tile.camera_rays[i];
            let direction = camera.direction;
            set_lane_vector!(lit, lane, direction_x, direction_y, direction_z, direction);
            lit.distance.0[lane] = tile.rays[i].t + camera.start_offset + frame.approach;
            set_lane_vector!(lit, lane, red, green, blue, vector(surface.albedo));
            lit.roughness.0[lane] = surface.roughness;
            lit.metallic.0[lane] = surface.metallic;
            let emission = vector(surface.emission);
            set_lane_vector!(
                lit,
                lane,
                emitted_red,
                emitted_green,
                emitted_blue,
                emission
            );
            lit.sky_visibility.0[lane] = if features.occlusion.taps() > 0 {
                tile.sky_visibility[i]
            } else {
                1.0
            };
        }
        add_sky_light(frame, &mut lit);
        for (light, light_visibility) in lights.iter().zip(&tile.light_visibility) {
            for (lane, &item) in items.iter().enumerate() {
                lit.light_visibility.0[lane] = light_visibility[item as usize];
            }
            add_direct_light(light, &mut lit);
        }
        if features.fog {
            apply_fog(frame, &mut lit);
        }
        for (lane, &item) in items.iter().enumerate() {
            let light = lane_vector!(lit, lane, light_red, light_green, light_blue);
            add_sample(&mut tile.colors[item as usize], light, 1.0);
        }
    }
}

/// Adds a sample to a sum.
pub(super) fn add_sample(sum: &mut [f32; 4], color: V3<f32>, coverage: f32) {
    for (total, component) in sum.iter_mut().zip([color.x, color.y, color.z, coverage]) {
        *total += component;
    }
}

/// Returns the surface of a scene that has only one.
pub(super) fn uniform_surface(frame: &FrameUniforms) -> Surface {
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
fn background(frame: &FrameUniforms, direction: V3<f32>, below: V3<f32>, blur: f32) -> V3<f32> {
    let (top, horizon) = (vector(frame.sky_top), vector(frame.sky_horizon));
    sky::sky_color::<f32>(direction, vector(frame.sky_up), top, horizon, below, blur)
}

multiversion! {
    /// Computes the emitted light and the reflected light of the sky.
    fn add_sky_light(frame: &FrameUniforms, block: &mut Lit) = add_sky_light_body;
}

#[inline(always)]
fn add_sky_light_body(frame: &FrameUniforms, block: &mut Lit) {
    let (top, horizon, ground) = (
        vector(frame.sky_top),
        vector(frame.sky_horizon),
        vector(frame.sky_ground),
    );
    for i in 0..LANES {
        let normal = lane_vector!(block, i, normal_x, normal_y, normal_z);
        let direction = lane_vector!(block, i, direction_x, direction_y, direction_z);
        let albedo = lane_vector!(block, i, red, green, blue);
        let (roughness, metallic) = (block.roughness.0[i], block.metallic.0[i]);
        let irradiance =
            sky::mean_sky_color::<f32>(normal, vector(frame.sky_up), top, horizon, ground);
        let mirrored = reflectance::mirror_direction::<f32>(direction, normal);
        let reflected_sky = background(frame, mirrored, ground, roughness);
        let diffuse =
            reflectance::diffuse_albedo::<f32>(normal, -direction, albedo, roughness, metallic);
        set_lane_vector!(block, i, diffuse_red, diffuse_green, diffuse_blue, diffuse);
        let reflected = reflectance::ambient_light::<f32>(
            normal,
            -direction,
            albedo,
            diffuse,
            roughness,
            metallic,
            irradiance,
            reflected_sky,
            block.sky_visibility.0[i],
        );
        let emitted = lane_vector!(block, i, emitted_red, emitted_green, emitted_blue);
        set_lane_vector!(
            block,
            i,
            light_red,
            light_green,
            light_blue,
            emitted + reflected * frame.ambient
        );
    }
}

multiversion! {
    /// Adds the reflected light of a light source.
    fn add_direct_light(light_record: &LightRecord, block: &mut Lit) = add_direct_light_body;
}

#[inline(always)]
fn add_direct_light_body(light_record: &LightRecord, block: &mut Lit) {
    let color = vector(light_record.color);
    for i in 0..LANES {
        let to_light = vector(light_record.position)
            - lane_vector!(block, i, x, y, z) * light_record.is_positional;
        let attenuation = reflectance::attenuation(to_light.length());
        let strength = if light_record.is_positional > 0.0 {
            attenuation
        } else {
            1.0
        };
        let strength = strength * block.light_visibility.0[i];
        let reflected = reflectance::reflected::<f32>(
            lane_vector!(block, i, normal_x, normal_y, normal_z),
            -lane_vector!(block, i, direction_x, direction_y, direction_z),
            camera::unit::<f32>(to_light),
            lane_vector!(block, i, red, green, blue),
            lane_vector!(block, i, diffuse_red, diffuse_green, diffuse_blue),
            block.roughness.0[i],
            block.metallic.0[i],
        );
        let light = lane_vector!(block, i, light_red, light_green, light_blue);
        set_lane_vector!(
            block,
            i,
            light_red,
            light_green,
            light_blue,
            light + color * strength * reflected
        );
    }
}

multiversion! {
    /// Blends the light with fog along the way to the camera.
    fn apply_fog(frame: &FrameUniforms, block: &mut Lit) = apply_fog_body;
}

#[inline(always)]
fn apply_fog_body(frame: &FrameUniforms, block: &mut Lit) {
    let horizon = vector(frame.sky_horizon);
    for i in 0..LANES {
        let light = lane_vector!(block, i, light_red, light_green, light_blue);
        let fog = sky::fog_opacity(block.distance.0[i], frame.fog);
        set_lane_vector!(
            block,
            i,
            light_red,
            light_green,
            light_blue,
            light + (horizon - light) * fog
        );
    }
}
