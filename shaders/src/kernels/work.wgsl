// Which ray an invocation works on.

struct Item { index: u32, pixel: vec2u, exists: bool }

fn line_index(id: vec3u, groups: vec3u) -> u32 {
    return id.y * (groups.x * 64u) + id.x;
}

fn tile_pixels() -> u32 {
    return frame.tile.z * frame.tile.w;
}

// Rays are taken in blocks of 8×8 pixels, so that neighbours stay together.
fn block_item(k: u32) -> Item {
    let columns = (frame.tile.z + 7u) / 8u;
    let block = k / 64u;
    let x = (block % columns) * 8u + k % 8u;
    let y = (block / columns) * 8u + (k / 8u) % 8u;
    return Item(y * frame.tile.z + x, vec2u(x, y), x < frame.tile.z && y < frame.tile.w);
}

fn stored_item(index: u32) -> Item {
    let pixel = vec2u(index % frame.tile.z, index / frame.tile.z);
    return Item(index, pixel, index < tile_pixels());
}
