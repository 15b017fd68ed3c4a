//! Tiles: rectangles of an image, as large as the device's current speed allows, and the buffers of a tile's
//! rays.

use super::driver::{Buffer, BufferUsage, Gpu};
use crate::engine::EngineError;
use sdfc_shaders::assemble::BufferSlot;

/// A rectangle of an image, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TileRect {
    /// Left and upper edge.
    pub(super) corner: [u32; 2],
    /// Width and height.
    pub(super) size: [u32; 2],
}

impl TileRect {
    pub(super) fn pixels(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1])
    }

    /// Returns the tile with one more pixel to the right and below, within the image.
    pub(super) fn with_neighbours(&self, image_size: [u32; 2]) -> Self {
        let size = [0, 1].map(|i| (self.size[i] + 1).min(image_size[i] - self.corner[i]));
        Self {
            corner: self.corner,
            size,
        }
    }
}

/// The remaining tiles of an image.
#[derive(Debug)]
pub(super) struct TileQueue(Vec<TileRect>);

impl TileQueue {
    /// Covers a whole image.
    pub(super) fn new(size: [u32; 2]) -> Self {
        Self(vec![TileRect {
            corner: [0, 0],
            size,
        }])
    }

    /// Returns the next tile, with at most `pixels` pixels. The minimum is 8 × 8, the block size of rays.
    pub(super) fn next(&mut self, pixels: u64) -> Option<TileRect> {
        let mut tile = self.0.pop()?;
        while tile.pixels() > pixels {
            let axis = usize::from(tile.size[1] >= tile.size[0]);
            let half = (tile.size[axis] / 2).next_multiple_of(8);
            if half >= tile.size[axis] {
                break;
            }
            let mut remaining = tile;
            remaining.corner[axis] += half;
            remaining.size[axis] -= half;
            tile.size[axis] = half;
            self.0.push(remaining);
        }
        Some(tile)
    }
}

/// The buffers of a tile, created on first use and then reused.
#[derive(Default)]
pub(super) struct TileBuffers {
    buffers: [Option<Buffer>; BufferSlot::ALL.len()],
    /// Changes whenever a buffer is replaced, including those of the scene.
    pub(super) generation: u64,
}

impl TileBuffers {
    pub(super) fn get(&self, slot: BufferSlot) -> Option<Buffer> {
        self.buffers[slot as usize].clone()
    }

    /// Ensures that a buffer exists and is large enough.
    pub(super) fn ensure(
        &mut self,
        gpu: &Gpu,
        slot: BufferSlot,
        pixels: u64,
        lights: u64,
    ) -> Result<(), EngineError> {
        let needed_bytes = slot.bytes(pixels, lights);
        let slot_buffer = &mut self.buffers[slot as usize];
        if slot_buffer
            .as_ref()
            .is_none_or(|buffer| buffer.size() < needed_bytes)
        {
            let usage = match slot {
                BufferSlot::Frame => BufferUsage::Uniform,
                BufferSlot::Lights => BufferUsage::UniformOrStorage,
                _ => BufferUsage::Storage,
            };
            // The old buffer is dropped first: both together may exceed the memory.
            *slot_buffer = None;
            *slot_buffer =
                Some(gpu.buffer(&format!("{slot:?}").to_lowercase(), usage, needed_bytes)?);
            self.generation += 1;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_each_pixel_once_whatever_their_sizes() {
        for size in [[1, 1], [7, 300], [640, 360], [129, 65]] {
            let mut counts = vec![0_u8; (size[0] * size[1]) as usize];
            let mut tiles = TileQueue::new(size);
            let allowed = [4096, 100, 1, 20_000, 1 << 40];
            for n in 0.. {
                let Some(tile) = tiles.next(allowed[n % allowed.len()]) else {
                    break;
                };
                assert!(
                    tile.pixels() <= allowed[n % allowed.len()].max(64 * 8),
                    "{tile:?}"
                );
                for y in tile.corner[1]..tile.corner[1] + tile.size[1] {
                    for x in tile.corner[0]..tile.corner[0] + tile.size[0] {
                        counts[(y * size[0] + x) as usize] += 1;
                    }
                }
            }
            assert!(counts.iter().all(|&count| count == 1), "{size:?}");
        }
    }
}
