// plane: the field where each ray meets the plane through the view's centre.

@group(0) @binding(2) var<storage, read_write> rays: array<RayState>;
#if material_colors
#if materials
@group(0) @binding(5) var<storage, read_write> surfaces: array<Surface>;
#end
#end
@group(0) @binding(8) var<storage, read_write> colors: array<vec4f>;

struct PlanePoint { p: vec3f, t: f32 }

// Returns the point that the ray of a position in the picture meets.
fn plane_point(position: vec2f) -> PlanePoint {
    let camera = camera_ray_at(position);
    let t = intersect_plane(camera.origin, camera.direction, frame.centre, frame.forward);
    return PlanePoint(point_along(camera.origin, camera.direction, t), t);
}

// Stores the end of a pixel's ray.
fn store_ray(index: u32, t: f32, distance: f32) {
    var ray = RayState(t, distance, 0.0, 0.0, t, distance, MISS, 1u);
    if is_nan(distance) {
        ray.status = NOT_A_NUMBER;
    } else if distance < 0.0 {
        ray.status = HIT | SHOWN;
    }
    rays[index] = ray;
}

// Adds the colour of a sample, which is nothing where the field is no number.
fn add_color(index: u32, distance: f32, sample_color: vec4f) {
    var color = sample_color;
    if is_nan(distance) { color = vec4f(0.0); }
    color += select(vec4f(0.0), colors[index], frame.sample > 0u);
    colors[index] = color;
}

#if distance
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let item = block_item(line_index(id, groups));
    if !item.exists { return; }
    let point = plane_point(vec2f(frame.tile.xy + item.pixel));
    let distance = scene_distance(point.p);
    store_ray(item.index, point.t, distance);
    let pixel = 2.0 * half_pixel(point.t, frame.half_pixel_size, frame.half_pixel_growth);
    add_color(item.index, distance, vec4f(distance_color(distance, frame.spacing, pixel), 1.0));
}
#else
// The field at the pixels of a block, and at those around it.
const SIDE: u32 = BLOCK_SIDE + 2u;
var<workgroup> fields: array<f32, 100>;

// A pixel's distance to the edge, and how much of it is covered.
struct EdgePixel { field: f32, change: vec2f, pixels: f32, covered: f32, is_doubtful: bool }

fn edge_pixel(k: u32) -> EdgePixel {
    let field = fields[k];
    let left = fields[k - 1u];
    let right = fields[k + 1u];
    let above = fields[k - SIDE];
    let below = fields[k + SIDE];
    let one_side = max(change_on_one_side(left, field, right), change_on_one_side(above, field, below));
    let change_x = change_per_pixel(left, field, right, one_side);
    let change_y = change_per_pixel(above, field, below, one_side);
    let change = steepest_change(
        vec2f(change_x, change_y),
        field, fields[k - SIDE - 1u], fields[k - SIDE + 1u], fields[k + SIDE - 1u], fields[k + SIDE + 1u]
    );
    let pixels = pixels_to_edge(field, change);
    let covered = coverage(pixels, f32(frame.samples));
    let beside = towards_edge(field, change.x, left, right);
    let along = towards_edge(field, change.y, above, below);
    let upper = towards_edge(field, change.x, fields[k - SIDE - 1u], fields[k - SIDE + 1u]);
    let lower = towards_edge(field, change.x, fields[k + SIDE - 1u], fields[k + SIDE + 1u]);
    let diagonal = towards_edge(field, change.y, upper, lower);
    let lowest = min(min(beside, along), diagonal);
    let highest = max(max(beside, along), diagonal);
    return EdgePixel(field, change, pixels, covered, is_doubtful_edge(field, lowest, highest, covered) > 0.5);
}

// Returns the column and the row of a value around the block: four sides, then four corners. Invocations of a side
// stay together, as their points lie in the same cells.
fn border_value(k: u32) -> vec2u {
    let end = SIDE - 1u;
    if k >= 4u * BLOCK_SIDE { return vec2u(k % 2u, (k / 2u) % 2u) * end; }
    let along = k % BLOCK_SIDE + 1u;
    let side = k / BLOCK_SIDE;
    let across = (side % 2u) * end;
    return select(vec2u(across, along), vec2u(along, across), side < 2u);
}

@compute @workgroup_size(64)
fn main(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32
) {
    let item = block_item(line_index(id, groups));
    let in_block = vec2u(lane % BLOCK_SIDE, lane / BLOCK_SIDE);
    let middle = vec2f(frame.tile.xy + item.pixel);
    let first = vec2f(frame.tile.xy + item.pixel - in_block) - 1.0;
    var edge = EdgePixel(0.0, vec2f(0.0), 0.0, 0.0, false);
    // The first round fills the block, the second one what is around it, and the last one probes.
    for (var round = 0u; round < 3u; round += 1u) {
        let value = select(in_block + 1u, border_value(lane), round == 1u);
        let k = value.y * SIDE + value.x;
        var position = first + vec2f(value);
        var is_needed = round == 0u || lane < 4u * (BLOCK_SIDE + 1u);
        if round == 2u {
            edge = edge_pixel(k);
            position = middle + edge_probe(edge.pixels, edge.change);
            is_needed = edge.is_doubtful;
        }
        if is_needed {
            let field = scene_distance(plane_point(position).p);
            if round == 2u {
                edge.covered = probed_coverage(edge.field, field, edge.covered);
            } else {
                fields[k] = field;
            }
        }
        workgroupBarrier();
    }
    if !item.exists { return; }
    let point = plane_point(middle);
    store_ray(item.index, point.t, edge.field);
#if material_colors
#if materials
    let surface = scene_surface(point.p, -frame.forward);
    surfaces[item.index] = surface;
    let material_color = surface.albedo;
#else
    let material_color = frame.albedo;
#end
    let color = frame.sky_horizon + (material_color - frame.sky_horizon) * edge.covered;
#else
    let color = vec3f(edge.covered);
#end
    add_color(item.index, edge.field, vec4f(color, edge.covered));
}
#end
