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
const PIXELS: u32 = BLOCK_SIDE * BLOCK_SIDE;
var<workgroup> fields: array<f32, 100>;
// The pixels of the block at whose edges signs are counted, their number, and how many points of each are inside.
var<workgroup> uneven: array<u32, 64>;
var<workgroup> next_uneven: atomic<u32>;
var<workgroup> uneven_count: u32;
var<workgroup> inside: array<atomic<u32>, 64>;

// How much of a pixel is covered, if its neighbours tell.
struct EdgePixel { covered: f32, is_uneven: bool }

fn edge_pixel(k: u32) -> EdgePixel {
    let field = fields[k];
    let left = fields[k - 1u];
    let right = fields[k + 1u];
    let above = fields[k - SIDE];
    let below = fields[k + SIDE];
    let upper_left = fields[k - SIDE - 1u];
    let upper_right = fields[k - SIDE + 1u];
    let lower_left = fields[k + SIDE - 1u];
    let lower_right = fields[k + SIDE + 1u];
    let along_axes = vec2f(change_per_pixel(left, field, right), change_per_pixel(above, field, below));
    let change = steepest_change(along_axes, field, upper_left, upper_right, lower_left, lower_right);
    let pixels = pixels_to_edge(field, change);
    let is_uneven = is_uneven_edge(
        field, left, right, above, below, upper_left, upper_right, lower_left, lower_right, change, pixels
    );
    return EdgePixel(coverage(pixels, f32(frame.samples)), is_uneven > 0.5);
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
    let corner = vec2f(frame.tile.xy + item.pixel - in_block);
    let own = (in_block.y + 1u) * SIDE + in_block.x + 1u;
    atomicStore(&inside[lane], 0u);
    if lane == 0u { atomicStore(&next_uneven, 0u); }
    var edge = EdgePixel(0.0, false);
    // The first round fills the block, the second one what is around it, and others count signs.
    var rounds = 2u;
    for (var round = 0u; round < rounds; round += 1u) {
        let value = select(in_block + 1u, border_value(lane), round == 1u);
        var position = corner + vec2f(value) - 1.0;
        var is_needed = round == 0u || lane < 4u * (BLOCK_SIDE + 1u);
        let counted = (round - 2u) * PIXELS + lane;
        let pixel = uneven[min(counted / COUNTS, PIXELS - 1u)];
        if round >= 2u {
            let offset = count_offset(f32(counted % COUNTS), f32(frame.samples));
            position = corner + vec2f(vec2u(pixel % BLOCK_SIDE, pixel / BLOCK_SIDE)) + offset;
            is_needed = counted < uneven_count * COUNTS;
        }
        if is_needed {
            let field = scene_distance(plane_point(position).p);
            if round < 2u {
                fields[value.y * SIDE + value.x] = field;
            } else if field < 0.0 {
                atomicAdd(&inside[pixel], 1u);
            }
        }
        workgroupBarrier();
        if round == 1u {
            edge = edge_pixel(own);
            if edge.is_uneven { uneven[atomicAdd(&next_uneven, 1u)] = lane; }
            workgroupBarrier();
            if lane == 0u { uneven_count = atomicLoad(&next_uneven); }
            rounds = 2u + (workgroupUniformLoad(&uneven_count) * COUNTS + PIXELS - 1u) / PIXELS;
        }
    }
    if edge.is_uneven { edge.covered = f32(atomicLoad(&inside[lane])) / f32(COUNTS); }
    let field = fields[own];
    if !item.exists { return; }
    let point = plane_point(vec2f(frame.tile.xy + item.pixel));
    store_ray(item.index, point.t, field);
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
    add_color(item.index, field, vec4f(color, edge.covered));
}
#end
