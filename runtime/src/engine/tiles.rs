//! Tiles: a picture cut into rectangles as large as the device's speed allows at the moment, and
//! the buffers that a tile's rays are kept in.

use super::EngineError;
use crate::gpu::{Buffer, Gpu, Usage};
use sdfc_shaders::assemble::Slot;

/// A part of a picture, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tile {
    /// Left and upper edge.
    pub(super) corner: [u32; 2],
    /// Width and height.
    pub(super) size: [u32; 2],
}

impl Tile {
    pub(super) fn pixels(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1])
    }

    /// With one pixel more to the right and below, as far as the picture goes.
    pub(super) fn with_neighbours(&self, picture: [u32; 2]) -> Self {
        let size = [0, 1].map(|i| (self.size[i] + 1).min(picture[i] - self.corner[i]));
        Self {
            corner: self.corner,
            size,
        }
    }
}

/// What is left of a picture.
#[derive(Debug)]
pub(super) struct Tiles(Vec<Tile>);

impl Tiles {
    /// All of a picture.
    pub(super) fn of(size: [u32; 2]) -> Self {
        Self(vec![Tile {
            corner: [0, 0],
            size,
        }])
    }

    /// The next tile, with at most so many pixels (or 8 × 8, in which rays are taken).
    pub(super) fn next(&mut self, pixels: u64) -> Option<Tile> {
        let mut tile = self.0.pop()?;
        while tile.pixels() > pixels {
            let side = usize::from(tile.size[1] >= tile.size[0]);
            let half = (tile.size[side] / 2).next_multiple_of(8);
            if half >= tile.size[side] {
                break;
            }
            let mut rest = tile;
            rest.corner[side] += half;
            rest.size[side] -= half;
            tile.size[side] = half;
            self.0.push(rest);
        }
        Some(tile)
    }
}

/// The buffers of a tile, made when a stage first needs them and kept for all later ones.
#[derive(Default)]
pub(super) struct TileBuffers {
    buffers: [Option<Buffer>; Slot::ALL.len()],
    /// Changes when any buffer does, the scene's included.
    pub(super) generation: u64,
}

impl TileBuffers {
    pub(super) fn get(&self, slot: Slot) -> Option<Buffer> {
        self.buffers[slot as usize].clone()
    }

    /// Makes sure that a buffer is there and large enough.
    pub(super) fn provide(
        &mut self,
        gpu: &Gpu,
        slot: Slot,
        pixels: u64,
        lights: u64,
    ) -> Result<(), EngineError> {
        let need = slot.bytes(pixels, lights);
        let place = &mut self.buffers[slot as usize];
        if place.as_ref().is_none_or(|buffer| buffer.size() < need) {
            let usage = match slot {
                Slot::Frame => Usage::Uniform,
                Slot::Lights => Usage::UniformOrStorage,
                _ => Usage::Storage,
            };
            // The old one goes first: both together may be too much.
            *place = None;
            *place = Some(gpu.buffer(&format!("{slot:?}").to_lowercase(), usage, need)?);
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
            let mut seen = vec![0_u8; (size[0] * size[1]) as usize];
            let mut tiles = Tiles::of(size);
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
                        seen[(y * size[0] + x) as usize] += 1;
                    }
                }
            }
            assert!(seen.iter().all(|&count| count == 1), "{size:?}");
        }
    }
}
