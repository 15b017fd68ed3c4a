// The item that an invocation works on.

struct Item { index: u32, pixel: vec2u, exists: bool }

fn line_index(id: vec3u, groups: vec3u) -> u32 {
    return id.y * (groups.x * 64u) + id.x;
}

fn tile_pixels() -> u32 {
    return frame.tile.z * frame.tile.w;
}

// Returns the upper left pixel of a block.
fn block_pixel(block: u32) -> vec2u {
    let columns = (frame.tile.z + BLOCK_SIDE - 1u) / BLOCK_SIDE;
    return vec2u(block % columns, block / columns) * BLOCK_SIDE;
}

// Returns the item of a line index. Rays are taken in blocks of 8×8 pixels, so that neighbours stay together.
fn block_item(k: u32) -> Item {
    let pixel = block_pixel(k / 64u) + vec2u(k, k / BLOCK_SIDE) % BLOCK_SIDE;
    return Item(pixel.y * frame.tile.z + pixel.x, pixel, pixel.x < frame.tile.z && pixel.y < frame.tile.w);
}

fn stored_item(index: u32) -> Item {
    let pixel = vec2u(index % frame.tile.z, index / frame.tile.z);
    return Item(index, pixel, index < tile_pixels());
}
