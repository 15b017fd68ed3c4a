// shade: the light along each ray to the camera.

#if lights
#if generic
@group(0) @binding(1) var<storage, read> lights: array<LightRecord>;
#else
@group(0) @binding(1) var<uniform> lights: array<LightRecord, LIGHT_COUNT>;
#end
#end
@group(0) @binding(2) var<storage, read> rays: array<RayState>;
@group(0) @binding(4) var<storage, read> normals: array<vec4f>;
#if materials
@group(0) @binding(5) var<storage, read> surfaces: array<Surface>;
#end
#if shadows
@group(0) @binding(6) var<storage, read> shadows: array<ShadowRayState>;
#end
#if occlusion
@group(0) @binding(7) var<storage, read> occlusion: array<OcclusionState>;
#end
@group(0) @binding(8) var<storage, read_write> colors: array<vec4f>;

#if shadows
// Returns the fraction of a light that arrives, by the visibility that its shadow ray found.
fn light_fraction(light: LightRecord, visibility: f32) -> f32 {
#if sized
    if light.shadow_form == SHADOW_SIZED { return shadow_light_fraction_sized(visibility); }
#end
    return shadow_light_fraction(visibility);
}
#end

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let item = block_item(line_index(id, groups));
    if !item.exists { return; }
    let ray = rays[item.index];
    let camera = camera_ray(item.pixel);
#if generic
    // Fog hides everything infinitely far below the horizon.
    let has_fog = (frame.flags & FOG_FLAG) != 0u;
    let ground = select(frame.sky_ground, frame.sky_horizon, has_fog);
#else
#if fog
    // Fog hides everything infinitely far below the horizon.
    let ground = frame.sky_horizon;
#else
    let ground = frame.sky_ground;
#end
#end
    var color = vec4f(sky_color(
        camera.direction, frame.sky_up, frame.sky_top, frame.sky_horizon, ground, 0.0
    ), 0.0);
    if (ray.status & SHOWN) != 0u {
#if materials
        let surface = surfaces[item.index];
        let normal = bumped(normals[item.index].xyz, surface.bump);
#else
        let surface = Surface(
            frame.albedo, frame.roughness, frame.emission, frame.metallic, vec3f(0.0), frame.id
        );
        let normal = normals[item.index].xyz;
#end
        let to_camera = -camera.direction;
        let mean_sky = mean_sky_color(
            normal, frame.sky_up, frame.sky_top, frame.sky_horizon, frame.sky_ground
        );
        let mirrored_sky = sky_color(
            mirror_direction(camera.direction, normal),
            frame.sky_up, frame.sky_top, frame.sky_horizon, frame.sky_ground, surface.roughness
        );
#if occlusion
#if generic
        let visible_sky = occlusion_open_fraction(occlusion[item.index].hidden, frame.occlusion_weight);
        let open_fraction = select(1.0, visible_sky, frame.occlusion_taps > 0.0);
#else
        let open_fraction = occlusion_open_fraction(occlusion[item.index].hidden, frame.occlusion_weight);
#end
#else
        let open_fraction = 1.0;
#end
        let diffuse = diffuse_albedo(
            normal, to_camera, surface.albedo, surface.roughness, surface.metallic
        );
        var light = surface.emission + ambient_light(
            normal, to_camera, surface.albedo, diffuse, surface.roughness, surface.metallic,
            mean_sky, mirrored_sky, open_fraction
        ) * frame.ambient;
#if lights
        let p = point_along(camera.origin, camera.direction, ray.t);
#if generic
        let count = lights[0].light_count;
#else
        let count = LIGHT_COUNT;
#end
        for (var n = 0u; n < count; n++) {
            let source = lights[n];
            let to_source = source.position - p * source.is_positional;
            var strength = select(1.0, attenuation(length3(to_source)), source.is_positional > 0.0);
#if shadows
            let fraction = light_fraction(source, shadows[n * tile_pixels() + item.index].visibility);
            strength *= select(fraction, 1.0, source.shadow_form == SHADOW_NONE);
#end
            let reflection = reflected(
                normal, to_camera, unit(to_source),
                surface.albedo, diffuse, surface.roughness, surface.metallic
            );
            light += source.color * strength * reflection;
        }
#end
#if generic
        let opacity = fog_opacity(ray.t + camera.start_excess + frame.approach, frame.fog);
        light = select(light, light + (frame.sky_horizon - light) * opacity, has_fog);
#else
#if fog
        light += (frame.sky_horizon - light) * fog_opacity(ray.t + camera.start_excess + frame.approach, frame.fog);
#end
#end
        color = vec4f(light, 1.0);
    }
    color += select(vec4f(0.0), colors[item.index], frame.sample > 0u);
    colors[item.index] = color;
}
