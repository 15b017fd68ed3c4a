//! Cell overlay: the length of the pruned program in each cell.
//!
//! The cells come from [`Engine::cells_at`](sdfc_runtime::engine::Engine::cells_at). The colour of a cell
//! encodes its number of clauses on a logarithmic scale, from dark (one) to bright (the whole program).
//! On a slice, cells without a program are pale. Thin lines mark borders between cells.

use super::QueryPoints;
use super::ink::{Color, blend_over, bytes, color, hex, lightness, mix, pixel};
use sdfc_runtime::cells::CellInfo;

/// Legend of a cell overlay.
#[derive(Clone, Debug, PartialEq)]
pub struct CellLegend {
    /// Clause counts in ascending order, with their colours.
    pub entries: Vec<(usize, [u8; 4])>,
    /// Maximum number of clauses of the cells in the picture; 0 without cells.
    pub max: usize,
    /// Mean number of clauses at the pixels.
    pub mean: f64,
}

/// Colour of cells without a program.
const EMPTY_CELL_COLOR: Color = hex(0xe4e6e6);
/// Colour of the borders between cells.
const LINE_COLOR: Color = hex(0x0c0d10);

/// Colour scale from few to many clauses: dark violet, blue, green, yellow.
const CLAUSE_COLORS: [Color; 5] = [
    hex(0x3a1c63),
    hex(0x36568f),
    hex(0x22908c),
    hex(0x6cc95c),
    hex(0xf7e32a),
];

/// Returns the colour of a clause count, given the length of the whole program.
fn clause_color(clauses: usize, program_length: usize) -> Color {
    let fraction = (clauses.max(1) as f32).ln() / (program_length.max(2) as f32).ln();
    let position = fraction.clamp(0.0, 1.0) * (CLAUSE_COLORS.len() - 1) as f32;
    let lower_index = (position as usize).min(CLAUSE_COLORS.len() - 2);
    mix(
        CLAUSE_COLORS[lower_index],
        CLAUSE_COLORS[lower_index + 1],
        position - lower_index as f32,
    )
}

/// Draws the cells at the query points over a picture with rows of `width` pixels. If `shaded` is set,
/// the brightness of the picture is kept. `cells` are the engine's results for the points.
/// `program_length` is the length of the whole program, `module.distance.code.len()`.
pub fn draw(
    picture: &mut [u8],
    width: usize,
    query_points: &QueryPoints,
    cells: &[Option<CellInfo>],
    program_length: usize,
    shaded: bool,
) -> CellLegend {
    let mut by_pixel: Vec<Option<&CellInfo>> = vec![None; picture.len() / 4];
    for (&pixel, cell) in query_points.pixels.iter().zip(cells) {
        if let Some(cell_slot) = by_pixel.get_mut(pixel as usize) {
            *cell_slot = cell.as_ref();
        }
    }
    let (mut max, mut sum, mut count) = (0, 0, 0_usize);
    for (number, cell) in by_pixel.iter().enumerate() {
        let Some(cell) = cell else {
            continue;
        };
        let clauses = cell.clauses.unwrap_or(0);
        max = max.max(clauses);
        sum += clauses;
        count += 1;
        let ink = cell.clauses.map_or(EMPTY_CELL_COLOR, |clauses| {
            clause_color(clauses, program_length)
        });
        let shade = match pixel(picture, number) {
            Some(underlying) if shaded => 0.65 + 0.45 * lightness(color(*underlying)),
            _ => 1.0,
        };
        blend_over(picture, number, ink * shade, 1.0);
        let is_last = width > 0 && number % width == width - 1;
        let neighbours = [(!is_last).then_some(number + 1), Some(number + width)];
        let is_border = neighbours.into_iter().flatten().any(|neighbour| {
            let neighbour = by_pixel.get(neighbour).copied().flatten();
            neighbour.is_some_and(|neighbour| neighbour.region != cell.region)
        });
        if is_border {
            blend_over(picture, number, LINE_COLOR, 0.55);
        }
    }
    let steps = std::iter::successors(Some(1_usize), |n| n.checked_mul(4));
    let mut entries: Vec<usize> = steps.take_while(|&n| n < program_length).collect();
    entries.push(program_length);
    CellLegend {
        entries: entries
            .into_iter()
            .map(|n| (n, bytes(clause_color(n, program_length))))
            .collect(),
        max,
        mean: sum as f64 / count.max(1) as f64,
    }
}
