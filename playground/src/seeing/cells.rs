//! Cells: how much of the program is run where.
//!
//! The parts of space come from [`Engine::cells_at`](sdfc_runtime::engine::Engine::cells_at). The
//! colour of a cell says how many clauses its program has, on a scale of doublings from dark (one) to
//! bright (the whole program); parts in which nothing is run are pale on a slice, and thin lines are
//! where cells meet.

use super::Asked;
use super::ink::{Color, bytes, color, hex, lay, lightness, mixed, pixel};
use sdfc_runtime::cells::Part;

/// What the colours of a picture of cells stand for.
#[derive(Clone, Debug, PartialEq)]
pub struct Legend {
    /// Numbers of clauses, rising, with their colours.
    pub entries: Vec<(usize, [u8; 4])>,
    /// The most clauses of any cell in the picture; 0 where there is none.
    pub most: usize,
    /// The mean number of clauses at the pixels.
    pub mean: f64,
}

/// The colour of parts in which nothing is run.
const IDLE: Color = hex(0xe4e6e6);
/// The lines between cells.
const LINE: Color = hex(0x0c0d10);

/// From few to many: dark violet, blue, green, yellow.
const SCALE: [Color; 5] = [
    hex(0x3a1c63),
    hex(0x36568f),
    hex(0x22908c),
    hex(0x6cc95c),
    hex(0xf7e32a),
];

/// The colour for so many clauses, where the whole program has `whole`.
fn scale(clauses: usize, whole: usize) -> Color {
    let share = (clauses.max(1) as f32).ln() / (whole.max(2) as f32).ln();
    let at = share.clamp(0.0, 1.0) * (SCALE.len() - 1) as f32;
    let below = (at as usize).min(SCALE.len() - 2);
    mixed(SCALE[below], SCALE[below + 1], at - below as f32)
}

/// Draws the cells at some points over a picture with rows of `width` pixels, whose lights and shades
/// stay where `shaded` says so. `parts` are what an engine gave for the points; `whole` is how long
/// the whole program is: `module.distance.code.len()`.
pub fn draw(
    picture: &mut [u8],
    width: usize,
    asked: &Asked,
    parts: &[Option<Part>],
    whole: usize,
    shaded: bool,
) -> Legend {
    let mut by_pixel: Vec<Option<&Part>> = vec![None; picture.len() / 4];
    for (&pixel, part) in asked.pixels.iter().zip(parts) {
        if let Some(slot) = by_pixel.get_mut(pixel as usize) {
            *slot = part.as_ref();
        }
    }
    let (mut most, mut sum, mut count) = (0, 0, 0_usize);
    for (number, part) in by_pixel.iter().enumerate() {
        let Some(part) = part else {
            continue;
        };
        let clauses = part.clauses.unwrap_or(0);
        most = most.max(clauses);
        sum += clauses;
        count += 1;
        let ink = part.clauses.map_or(IDLE, |clauses| scale(clauses, whole));
        let shade = match pixel(picture, number) {
            Some(below) if shaded => 0.65 + 0.45 * lightness(color(*below)),
            _ => 1.0,
        };
        lay(picture, number, ink * shade, 1.0);
        let is_last = width > 0 && number % width == width - 1;
        let neighbours = [(!is_last).then_some(number + 1), Some(number + width)];
        let meets = neighbours.into_iter().flatten().any(|there| {
            let there = by_pixel.get(there).copied().flatten();
            there.is_some_and(|there| there.region != part.region)
        });
        if meets {
            lay(picture, number, LINE, 0.55);
        }
    }
    let steps = std::iter::successors(Some(1_usize), |n| n.checked_mul(4));
    let mut entries: Vec<usize> = steps.take_while(|&n| n < whole).collect();
    entries.push(whole);
    Legend {
        entries: entries
            .into_iter()
            .map(|n| (n, bytes(scale(n, whole))))
            .collect(),
        most,
        mean: sum as f64 / count.max(1) as f64,
    }
}
