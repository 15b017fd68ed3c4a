// shade: the light that each ray brings to the eye.

#if lit
#if general
@group(0) @binding(1) var<storage, read> lights: array<Light>;
#else
@group(0) @binding(1) var<uniform> lights: array<Light, LIGHTS>;
#end
#end
@group(0) @binding(2) var<storage, read> rays: array<Ray>;
@group(0) @binding(4) var<storage, read> normals: array<vec4f>;
#if materials
@group(0) @binding(5) var<storage, read> surfaces: array<Surface>;
#end
#if shadows
@group(0) @binding(6) var<storage, read> shadows: array<ShadowRay>;
#end
#if occlusion
@group(0) @binding(7) var<storage, read> occlusion: array<OcclusionRay>;
#end
@group(0) @binding(8) var<storage, read_write> colors: array<vec4f>;

#if shadows
// What arrives of a light, from what its shadow ray found.
fn arriving(light: Light, visibility: f32) -> f32 {
#if sized
    if light.shadow == SHADOW_SIZED { return shadow_arriving_sized(visibility); }
#end
    return shadow_arriving(visibility);
}
#end

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let item = block_item(line_index(id, groups));
    if !item.exists { return; }
    let ray = rays[item.index];
    let camera = camera_ray(item.pixel);
#if general
    // Air hides what is endlessly far below the horizon.
    let foggy = (frame.choices & FOG) != 0u;
    let below = select(frame.sky_ground, frame.sky_horizon, foggy);
#else
#if fog
    // Air hides what is endlessly far below the horizon.
    let below = frame.sky_horizon;
#else
    let below = frame.sky_ground;
#end
#end
    var color = vec4f(sky_color(
        camera.direction, frame.sky_up, frame.sky_top, frame.sky_horizon, below, 0.0
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
        let to_eye = -camera.direction;
        let around = sky_on(
            normal, frame.sky_up, frame.sky_top, frame.sky_horizon, frame.sky_ground
        );
        let ahead = sky_color(
            mirror(camera.direction, normal),
            frame.sky_up, frame.sky_top, frame.sky_horizon, frame.sky_ground, surface.roughness
        );
#if occlusion
#if general
        let open = occlusion_open(occlusion[item.index].hidden, frame.occlusion_weight);
        let seen = select(1.0, open, frame.occlusion_taps > 0.0);
#else
        let seen = occlusion_open(occlusion[item.index].hidden, frame.occlusion_weight);
#end
#else
        let seen = 1.0;
#end
        let diffuse = diffuse_share(
            normal, to_eye, surface.albedo, surface.roughness, surface.metallic
        );
        var light = surface.emission + ambient_light(
            normal, to_eye, surface.albedo, diffuse, surface.roughness, surface.metallic,
            around, ahead, seen
        ) * frame.ambient;
#if lit
        let p = along(camera.origin, camera.direction, ray.t);
#if general
        let count = lights[0].count;
#else
        let count = LIGHTS;
#end
        for (var n = 0u; n < count; n++) {
            let lamp = lights[n];
            let to_place = lamp.place - p * lamp.near;
            var strength = select(1.0, attenuation(length3(to_place)), lamp.near > 0.0);
#if shadows
            let arrives = arriving(lamp, shadows[n * tile_pixels() + item.index].visibility);
            strength *= select(arrives, 1.0, lamp.shadow == SHADOW_NONE);
#end
            let sent = reflected(
                normal, to_eye, unit(to_place),
                surface.albedo, diffuse, surface.roughness, surface.metallic
            );
            light += lamp.color * strength * sent;
        }
#end
#if general
        let thick = hidden_by_fog(ray.t + camera.beyond + frame.approach, frame.fog);
        light = select(light, light + (frame.sky_horizon - light) * thick, foggy);
#else
#if fog
        light += (frame.sky_horizon - light) * hidden_by_fog(ray.t + camera.beyond + frame.approach, frame.fog);
#end
#end
        color = vec4f(light, 1.0);
    }
    color += select(vec4f(0.0), colors[item.index], frame.sample > 0u);
    colors[item.index] = color;
}
