// Which ray an invocation works on.

struct Item { index: u32, pixel: vec2u, exists: bool }

fn line_index(id: vec3u, groups: vec3u) -> u32 {
    return id.y * (groups.x * 64u) + id.x;
}

fn tile_pixels() -> u32 {
    return frame.tile.z * frame.tile.w;
}

// The upper left pixel of a block.
fn block_pixel(block: u32) -> vec2u {
    let columns = (frame.tile.z + BLOCK - 1u) / BLOCK;
    return vec2u(block % columns, block / columns) * BLOCK;
}

// Rays are taken in blocks of 8×8 pixels, so that neighbours stay together.
fn block_item(k: u32) -> Item {
    let at = block_pixel(k / 64u) + vec2u(k, k / BLOCK) % BLOCK;
    return Item(at.y * frame.tile.z + at.x, at, at.x < frame.tile.z && at.y < frame.tile.w);
}

fn stored_item(index: u32) -> Item {
    let pixel = vec2u(index % frame.tile.z, index / frame.tile.z);
    return Item(index, pixel, index < tile_pixels());
}
