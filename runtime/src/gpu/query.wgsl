// query: evaluates the scene at each point of a list.

@group(0) @binding(1) var<storage, read> points: array<vec4f>;
#if distance
@group(0) @binding(2) var<storage, read_write> distances: array<f32>;
#end
#if gradient
@group(0) @binding(3) var<storage, read_write> gradients: array<vec4f>;
#end
#if surface
@group(0) @binding(3) var<storage, read> gradients: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> surfaces: array<Surface>;

// The unit direction of a gradient; up if it has none.
fn direction(gradient: vec3f) -> vec3f {
    let size = abs(gradient);
    let largest = max(size.x, max(size.y, size.z));
    if !(largest > 1e-30 && largest < 1e30) { return vec3f(0.0, 1.0, 0.0); }
    let v = gradient * (1.0 / largest);
    return v * (1.0 / sqrt(v.x * v.x + v.y * v.y + v.z * v.z));
}
#end

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = id.y * (groups.x * 64u) + id.x;
    if i >= arrayLength(&points) { return; }
    let p = points[i].xyz;
#if distance
    distances[i] = scene_distance(p);
#end
#if gradient
    gradients[i] = scene_gradient(p);
#end
#if surface
    surfaces[i] = scene_surface(p, direction(gradients[i].xyz));
#end
}
