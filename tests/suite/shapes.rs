//! Scenes of single shapes, which follow from the rows of the table. Every engine draws each solid and each
//! 2-D shape, with cells and without; the CPU also without passes. All pictures of a shape must be alike.

use crate::metamorphic::compare::{Picture, compare};
use crate::metamorphic::draw::{DrawOptions, frame};
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{Engine, EngineKind, open};
use sdfc_runtime::render::CellMode;
use sdfc_trials::random::Random;
use sdfc_trials::shapes::finite_solid;
use sdfc_vm::row::Category;
use sdfc_vm::table::{ROWS, Row};

/// Size of the pictures.
const SIZE: [u32; 2] = [48, 36];
/// Minimum number of pixels that show a shape.
const MIN_HITS: usize = 12;

/// Returns the rows of solids and of 2-D shapes.
pub(crate) fn shape_rows() -> impl Iterator<Item = &'static Row> {
    ROWS.iter()
        .filter(|row| matches!(row.meta.category, Category::Shape3 | Category::Shape2))
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

/// Opens the engines that are compared, the reference first.
fn engines() -> Vec<Box<dyn Engine>> {
    let mut kinds = EngineKind::FAST.to_vec();
    if let Ok(reason) = std::env::var("SDFC_SKIP_GPU") {
        eprintln!("skipped: only the CPU draws the shapes ({reason})");
        kinds = vec![EngineKind::Cpu];
    }
    let engines = kinds
        .into_iter()
        .map(|kind| open(kind).unwrap_or_else(|error| panic!("{kind}: {error}")));
    engines.collect()
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
    let image = frame(engine, text, options)?;
    let hits = image.depth.iter().filter(|depth| depth.is_finite()).count();
    let picture = Picture::new(&image, options.scale);
    if hits < MIN_HITS || picture.lost > 0 {
        return Err(format!("{hits} pixels hit, {} rays lost", picture.lost));
    }
    Ok(picture)
}

#[test]
fn every_engine_draws_every_shape_of_the_table_alike() {
    let mut engines = engines();
    let mut failures = Vec::new();
    for row in shape_rows() {
        let text = text(row);
        let mut reference: Option<Picture> = None;
        for engine in &mut engines {
            for options in options(engine.kind()) {
                let failure = match (draw(&mut **engine, &text, &options), &reference) {
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
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
