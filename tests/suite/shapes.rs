//! Scenes of single shapes, which follow from the rows of the table. Every engine draws each solid and each
//! 2-D shape, with cells and without. The CPU also draws them without passes. All pictures must be alike.

use crate::metamorphic::compare::{Picture, compare};
use crate::metamorphic::draw::{DrawOptions, image};
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{Engine, EngineKind, open};
use sdfc_runtime::render::CellMode;
use sdfc_trials::random::Random;
use sdfc_trials::shapes::finite_solid;
use sdfc_trials::skip::is_gpu_skipped;
use sdfc_vm::row::Category;
use sdfc_vm::table::{ROWS, Row};

/// Size of the pictures.
const SIZE: [u32; 2] = [64, 48];
/// Minimum number of pixels that show a shape.
const MIN_HITS: usize = 12;
/// Number of shapes that devices draw in one picture, and in one of its lines.
const SHAPES_PER_PICTURE: usize = 12;
const SHAPES_PER_LINE: usize = 4;
/// Distance between their centres.
const SPACING: f64 = 2.0;

/// Returns the rows of solids and of 2-D shapes.
pub(crate) fn shape_rows() -> impl Iterator<Item = &'static Row> {
    ROWS.iter()
        .filter(|row| matches!(row.facts.category, Category::Shape3 | Category::Shape2))
}

/// Returns a scene that shows a shape of a row. Its numbers depend on the row's name alone, so that new rows do not
/// change them.
fn text(row: &Row) -> String {
    let letters = row.name.bytes().map(u64::from);
    let seed = letters.fold(0_u64, |seed, letter| {
        seed.wrapping_mul(31).wrapping_add(letter)
    });
    finite_solid(&mut Random::new(seed), row)
}

/// Returns a scene that shows a shape of each row, in lines of [`SHAPES_PER_LINE`].
fn side_by_side(rows: &[&Row]) -> String {
    let translated = rows.iter().enumerate().map(|(index, row)| {
        let x = (index % SHAPES_PER_LINE) as f64 * SPACING;
        let y = (index / SHAPES_PER_LINE) as f64 * SPACING;
        format!("{}.translate({x}, {y}, 0)", text(row))
    });
    translated.collect::<Vec<_>>().join("\n| ")
}

/// Returns the options that an engine draws with.
fn options(kind: EngineKind) -> Vec<DrawOptions> {
    let disable_all: &[bool] = match kind {
        EngineKind::Cpu => &[false, true],
        _ => &[false],
    };
    let combinations = disable_all.iter().flat_map(|&disable_all| {
        [CellMode::Never, CellMode::Always].map(|cells| (disable_all, cells))
    });
    combinations
        .map(|(disable_all, cells)| DrawOptions {
            size: SIZE,
            passes: PassOptions {
                disable_all,
                disabled: Vec::new(),
            },
            cells,
            scale: 1.0,
        })
        .collect()
}

/// Draws a text. Returns its picture, or the reason why the picture cannot be that of a shape.
fn draw(engine: &mut dyn Engine, text: &str, options: &DrawOptions) -> Result<Picture, String> {
    let image = image(engine, text, options)?;
    let hits = image.depth.iter().filter(|depth| depth.is_finite()).count();
    let picture = Picture::new(&image, options.scale);
    if hits < MIN_HITS || picture.lost > 0 {
        return Err(format!("{hits} pixels hit, {} rays lost", picture.lost));
    }
    Ok(picture)
}

/// Draws a text on engines with all of their options. Returns a message for each picture that differs from the
/// first one.
fn failures(engines: &mut [Box<dyn Engine>], text: &str) -> Vec<String> {
    let mut failures = Vec::new();
    let mut reference: Option<Picture> = None;
    for engine in engines {
        for options in options(engine.kind()) {
            let failure = match (draw(&mut **engine, text, &options), &reference) {
                (Err(reason), _) => Some(reason),
                (Ok(picture), Some(reference)) => {
                    let differences = compare(reference, &picture);
                    (differences.count() > 0).then(|| format!("{differences:?}"))
                }
                (Ok(picture), None) => {
                    reference = Some(picture);
                    None
                }
            };
            failures.extend(failure.map(|failure| {
                let (kind, cells) = (engine.kind(), options.cells);
                let passes = match options.passes.disable_all {
                    true => "-O0",
                    false => "-O1",
                };
                format!("{text} on {kind}, {passes}, cells {cells:?}: {failure}")
            }));
        }
    }
    failures
}

#[test]
fn the_cpu_draws_every_shape_alike_with_and_without_passes_and_cells() {
    let mut engines = [open(EngineKind::Cpu).expect("there is always a CPU")];
    let failures: Vec<String> = shape_rows()
        .flat_map(|row| failures(&mut engines, &text(row)))
        .collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Devices take long to load a scene, so that several shapes are drawn side by side. If a picture differs, each of
/// its shapes is drawn alone.
#[test]
fn every_engine_draws_every_shape_alike() {
    if is_gpu_skipped() {
        return;
    }
    let open = |kind| open(kind).unwrap_or_else(|error| panic!("{kind}: {error}"));
    let mut engines = EngineKind::FAST.map(open);
    let mut found = Vec::new();
    let rows: Vec<&Row> = shape_rows().collect();
    for rows in rows.chunks(SHAPES_PER_PICTURE) {
        let together = failures(&mut engines, &side_by_side(rows));
        if !together.is_empty() {
            let alone = rows
                .iter()
                .flat_map(|row| failures(&mut engines, &text(row)));
            found.extend(alone.chain(together));
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}
